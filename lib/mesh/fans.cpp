#include "mesh/fans.h"

#include "base/disjoint_sets.h"
#include "base/error.h"
#include "base/parallel.h"
#include "mesh/edges.h"
#include "mesh/face_ranges.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <emmintrin.h>
#include <memory>
#include <string>
#include <utility>

namespace gewebe::mesh {

namespace {

constexpr std::size_t grain = 8192;
/// A face at a point, by its other corners in the order of the face.
struct FanFace {
  std::uint32_t next, previous;
};

/// The faces round each point of a range, except those with equal corners.
class Fans {
public:
  /// Of points [begin, end).
  Fans(std::span<const Triangle> triangles, const FaceRanges& ranges, std::size_t begin,
       std::size_t end)
      : begin_(begin), first_(end - begin + 2) {
    const auto each = [&](const auto& use) {
      ranges.for_each_block(begin, end, [&](std::size_t first, std::size_t stop, bool whole) {
        const auto within = [&](std::uint32_t p) { return whole || (p >= begin && p < end); };
        for (std::size_t f = first; f < stop; ++f) {
          const auto [a, b, c] = triangles[f];
          if (gewebe::mesh::has_equal_corners(triangles[f]))
            continue;
          if (within(a))
            use(a - begin, b, c);
          if (within(b))
            use(b - begin, c, a);
          if (within(c))
            use(c - begin, a, b);
        }
      });
    };
    each([&](std::size_t p, std::uint32_t, std::uint32_t) { ++first_[p + 2]; });
    for (std::size_t p = 2; p < first_.size(); ++p)
      first_[p] += first_[p - 1];
    faces_ = std::make_unique_for_overwrite<FanFace[]>(first_.back() + std::size_t{spare});
    std::fill_n(&faces_[first_.back()], spare, FanFace{});
    // first_[p + 1] is where the next face of p goes, and the end of its list when all are there.
    each([&](std::size_t p, std::uint32_t next, std::uint32_t previous) {
      faces_[first_[p + 1]++] = {next, previous};
    });
    first_.pop_back();
  }

  /// In the order of the mesh.
  std::span<const FanFace> at(std::size_t point) const {
    const std::uint32_t* const first = &first_[point - begin_];
    return {&faces_[first[0]], first[1] - first[0]};
  }
  std::size_t count(std::size_t begin, std::size_t end) const {
    return first_[end - begin_] - first_[begin - begin_];
  }

private:
  static constexpr std::size_t spare = 8; // behind the last, so that 8 of any can be read
  std::size_t begin_;
  std::vector<std::uint32_t> first_; // of each point, and the end
  std::unique_ptr<FanFace[]> faces_;
};

/// The figures of some points.
class Examiner {
public:
  /// For points with so many faces together.
  Examiner(const std::vector<Vec3>& points, std::size_t faces)
      : points_(points), squares_(std::make_unique_for_overwrite<double[]>(2 * faces + 1)) {}

  /// \return the smallest of the point and those joined to it   \pre as Fans::at gives them
  std::uint32_t point(std::uint32_t p, std::span<const FanFace> faces) {
    if (faces.empty()) {
      ++figures_.unused_points;
      return p;
    }
    if (faces.size() > most_of_ring || !(faces.size() <= 8 ? is_ring_of_8(faces) : is_ring(faces)))
      return other(p, faces);
    return edges(p, faces, [](const FanFace& face) { return face.next; });
  }

  FanFigures figures_;

  /// Those of the edges taken at their smaller ends.
  std::vector<float> lengths() {
    std::vector<float> lengths(square_count_);
    figures_.edges = square_count_;
    figures_.edge_min = HUGE_VAL;
    for (std::size_t n = 0; n < square_count_; ++n) {
      const double length = std::sqrt(squares_[n]);
      lengths[n] = static_cast<float>(length);
      figures_.edge_min = std::min(figures_.edge_min, length);
      figures_.edge_max = std::max(figures_.edge_max, length);
      figures_.length_sum += length;
    }
    return lengths;
  }

private:
  static constexpr std::size_t most_of_ring = 32;

  // Is it a ring, where each edge is of two faces that run along it in opposite directions? Then
  // each face is followed by the one that begins at the point where it ends, and all by one
  // another.

  static bool is_ring(std::span<const FanFace> faces) {
    std::size_t at = 0;
    for (std::size_t step = 1; step <= faces.size(); ++step) {
      const std::uint32_t wanted = faces[at].previous;
      at = 0;
      while (at < faces.size() && faces[at].next != wanted)
        ++at;
      if (at == faces.size() || (at == 0) != (step == faces.size()))
        return false;
    }
    return faces.size() > 2;
  }

  /// For up to 8 faces, without a branch that depends on their order.
  static bool is_ring_of_8(std::span<const FanFace> faces) {
    const auto count = static_cast<unsigned>(faces.size());
    const unsigned all = (1U << count) - 1;
    const auto* const from = reinterpret_cast<const float*>(faces.data());
    const auto nexts = [&](std::size_t at) {
      return _mm_castps_si128(
          _mm_shuffle_ps(_mm_loadu_ps(from + 2 * at), _mm_loadu_ps(from + 2 * at + 4), 0x88));
    };
    const __m128i low = nexts(0), high = nexts(4);
    std::uint64_t follows = 0; // a byte for each face
    unsigned met = 0, odd = 0;
    for (unsigned n = 0; n < count; ++n) {
      const __m128i wanted = _mm_set1_epi32(static_cast<int>(faces[n].previous));
      const auto bits = [&](const __m128i& some) {
        return static_cast<unsigned>(
            _mm_movemask_ps(_mm_castsi128_ps(_mm_cmpeq_epi32(some, wanted))));
      };
      const unsigned found = (bits(low) | bits(high) << 4) & all;
      odd |= found & (found - 1);
      met |= found;
      follows |= static_cast<std::uint64_t>(std::countr_zero(found | 256U)) << 8 * n;
    }
    if (met != all || odd != 0)
      return false;
    unsigned seen = 0, at = 0;
    for (unsigned n = 0; n < count; ++n) {
      at = static_cast<unsigned>(follows >> 8 * at) & 7U;
      seen |= 1U << at;
    }
    return seen == all && count > 2;
  }

  /// Takes the edges of a point, each once, which lead to end_of(item).
  template <class Items, class EndOf>
  std::uint32_t edges(std::uint32_t p, const Items& items, const EndOf& end_of) {
    const Vec3 from = points_[p];
    std::uint32_t smallest = p;
    double least = HUGE_VAL;
    std::size_t at = square_count_;
    for (const auto& item : items) {
      const std::uint32_t to = end_of(item);
      const Vec3 d = points_[to] - from;
      const double square = dot(d, d);
      squares_[at] = square;
      at += to > p ? 1U : 0U;
      least = std::min(least, square);
      smallest = std::min(smallest, to);
    }
    square_count_ = at;
    // No sum of inverse lengths is above their number by the least length.
    const auto number = static_cast<double>(items.size());
    if (number * number > figures_.stiffness_max * figures_.stiffness_max * least) {
      double stiffness = 0;
      for (const auto& item : items)
        stiffness += 1 / norm(points_[end_of(item)] - from);
      figures_.stiffness_max = std::max(figures_.stiffness_max, stiffness);
    }
    return smallest;
  }

  struct Side {
    std::uint32_t end, face;
    bool towards; // does the face run from its end to the point?
  };

  std::uint32_t other(std::uint32_t p, std::span<const FanFace> faces) {
    sides_.clear();
    ends_.clear();
    for (std::uint32_t f = 0; f < faces.size(); ++f) {
      sides_.push_back({faces[f].next, f, false});
      sides_.push_back({faces[f].previous, f, true});
    }
    std::ranges::sort(sides_, {}, [](const Side& s) { return std::pair(s.end, s.face); });
    DisjointSets joined(faces.size());
    std::size_t parts = faces.size();
    for (std::size_t begin = 0, end = 0; begin < sides_.size(); begin = end) {
      int surplus = 0;
      for (end = begin; end < sides_.size() && sides_[end].end == sides_[begin].end; ++end) {
        surplus += sides_[end].towards ? 1 : -1;
        parts -= joined.join(sides_[begin].face, sides_[end].face) ? 1U : 0U;
      }
      ends_.push_back(sides_[begin].end);
      if (sides_[begin].end < p)
        continue;
      figures_.boundary_edges += end - begin == 1 ? 1U : 0U;
      figures_.nonmanifold_edges += end - begin > 2 ? 1U : 0U;
      figures_.misoriented_edges += end - begin == 2 && surplus != 0 ? 1U : 0U;
    }
    figures_.nonmanifold_points += parts > 1 ? 1U : 0U;
    duplicates(p, faces);
    return edges(p, ends_, [](std::uint32_t end) { return end; });
  }

  /// Faces at their smallest corner with the same corners as an earlier one.
  void duplicates(std::uint32_t p, std::span<const FanFace> faces) {
    pairs_.clear();
    for (const FanFace& f : faces)
      if (f.next > p && f.previous > p)
        pairs_.emplace_back(std::minmax(f.next, f.previous));
    std::ranges::sort(pairs_);
    for (std::size_t n = 1; n < pairs_.size(); ++n)
      figures_.duplicate_faces += pairs_[n] == pairs_[n - 1] ? 1U : 0U;
  }

  const std::vector<Vec3>& points_;
  std::unique_ptr<double[]> squares_; ///< of lengths, and room for one more
  std::size_t square_count_ = 0;
  std::vector<std::uint32_t> ends_; ///< of the edges of one point, each once
  std::vector<Side> sides_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs_;
};

void add(FanFigures& sum, const FanFigures& part) {
  sum.unused_points += part.unused_points;
  sum.nonmanifold_points += part.nonmanifold_points;
  sum.duplicate_faces += part.duplicate_faces;
  sum.edges += part.edges;
  sum.boundary_edges += part.boundary_edges;
  sum.nonmanifold_edges += part.nonmanifold_edges;
  sum.misoriented_edges += part.misoriented_edges;
  sum.edge_min = std::min(sum.edge_min, part.edge_min);
  sum.edge_max = std::max(sum.edge_max, part.edge_max);
  sum.length_sum += part.length_sum;
  sum.stiffness_max = std::max(sum.stiffness_max, part.stiffness_max);
}

} // namespace

FanFigures examine_fans(const TriangleMesh& mesh, const Context& context) {
  constexpr std::size_t max_triangles = (std::size_t{1} << 32) / 3;
  if (mesh.triangles.size() > max_triangles)
    throw Error(std::to_string(mesh.triangles.size()) + " triangles, expected at most " +
                std::to_string(max_triangles));
  const std::size_t points = mesh.points.size();
  const FaceRanges ranges(mesh.triangles, points, context);
  std::vector<FanFigures> parts((points + grain - 1) / grain);
  FanFigures sum;
  sum.lengths.resize(parts.size());
  sum.joined_to.resize(points);
  parallel_blocks(context, points, ranges.grain(), [&](std::size_t first, std::size_t last) {
    const Fans fans(mesh.triangles, ranges, first, last);
    for (std::size_t begin = first; begin < last; begin += grain) {
      const std::size_t end = std::min(last, begin + grain);
      Examiner examiner(mesh.points, fans.count(begin, end));
      for (std::size_t p = begin; p < end; ++p)
        sum.joined_to[p] = examiner.point(static_cast<std::uint32_t>(p), fans.at(p));
      sum.lengths[begin / grain] = examiner.lengths();
      parts[begin / grain] = std::move(examiner.figures_);
    }
  });
  sum.edge_min = HUGE_VAL;
  for (const FanFigures& part : parts)
    add(sum, part);
  if (sum.edges == 0)
    sum.edge_min = 0;
  return sum;
}

} // namespace gewebe::mesh
