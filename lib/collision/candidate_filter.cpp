#include "collision/candidate_filter.h"

#include "collision/distance.h"
#include "collision/pair_feature.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>
#include <type_traits>

namespace gewebe::collision {

namespace {

/// Part of the candidates that were measured, from which on the reference moves.
constexpr double many_measured = 0.05;
/// Candidates that were looked at only since vertices have moved, over all: from there on the
/// reference moves, which costs as much.
constexpr double many_seen = 1;
/// Candidates of a block.
constexpr std::size_t block_size = 64;

template <std::size_t n>
double gap_of(const CollisionSurface& surface, std::span<const Vec3> x,
              const std::array<std::uint32_t, n>& vertices, std::size_t first) {
  std::array<Vec3, n> y;
  for (std::size_t k = 0; k < n; ++k)
    y[k] = x[vertices[k]];
  return std::sqrt(squared_distance(closest_feature(y, first), y)) -
         radius_sum(surface, vertices.front(), vertices.back());
}

/// Sum of the largest values of both sides of a pair. \param first  vertices of its first side
template <std::size_t n>
double both_sides(const std::array<std::uint32_t, n>& vertices, std::size_t first,
                  std::span<const double> values) {
  std::array<double, 2> most{0, 0};
  for (std::size_t k = 0; k < n; ++k) {
    double& side = most[k < first ? 0 : 1];
    side = values[vertices[k]] <= side ? side : values[vertices[k]]; // NaN stays
  }
  return most[0] + most[1];
}

/// Largest difference of the vectors of both sides of a pair: their distance changes by no more
/// where vertices move by these. \param first  vertices of its first side
template <std::size_t n>
double between_sides(const std::array<std::uint32_t, n>& vertices, std::size_t first,
                     std::span<const Vec3> vectors) {
  double most = 0;
  for (std::size_t i = 0; i < first; ++i)
    for (std::size_t j = first; j < n; ++j) {
      const Vec3 difference = vectors[vertices[i]] - vectors[vertices[j]];
      const double square = dot(difference, difference);
      most = square <= most ? most : square; // NaN stays
    }
  return std::sqrt(most);
}

} // namespace

void CandidateFilter::reset(const Candidates& candidates, std::span<const std::uint32_t> vertices,
                            std::span<const Vec3> x) {
  candidates_ = &candidates;
  vertices_ = vertices;
  constexpr double unknown = -std::numeric_limits<double>::infinity();
  gap_.assign(candidates.size(), unknown);
  seen_ = 0;
  least_.assign((gap_.size() + block_size - 1) / block_size, unknown);
  reference_.clear();
  for (const std::uint32_t v : vertices)
    reference_.push_back(x[v]);
}

double CandidateFilter::move_to(std::span<const Vec3> x) {
  moved_.resize(x.size());
  length_.resize(x.size());
  double most = 0;
  for (std::size_t k = 0; k < vertices_.size(); ++k) {
    const std::uint32_t v = vertices_[k];
    moved_[v] = x[v] - reference_[k];
    length_[v] = norm(moved_[v]);
    most = length_[v] <= most ? most : length_[v]; // NaN stays
  }
  measured_.clear();
  return most;
}

template <class Act>
void CandidateFilter::for_lists(const Act& act) {
  std::size_t begin = 0;
  const auto next = [&](const auto& list, std::size_t first, auto& to) {
    act(list, first, to, begin);
    begin += list.size();
  };
  next(candidates_->point_point, 1, near_.point_point);
  next(candidates_->point_edge, 1, near_.point_edge);
  next(candidates_->edge_edge, 2, near_.edge_edge);
  next(candidates_->point_triangle, 1, near_.point_triangle);
}

void CandidateFilter::keep_measured() {
  const auto all = static_cast<double>(gap_.size());
  const bool follows = static_cast<double>(measured_.size()) > many_measured * all ||
                       static_cast<double>(seen_) > many_seen * all;
  if (follows) {
    seen_ = 0;
    for_lists([&](const auto& list, std::size_t first, auto& /*to*/, std::size_t number) {
      for (const auto& vertices : list)
        gap_[number++] -= between_sides(vertices, first, moved_);
    });
    for (std::size_t k = 0; k < vertices_.size(); ++k)
      reference_[k] += moved_[vertices_[k]];
  }
  for (const auto& [number, gap, moved] : measured_) {
    const double bound = follows ? gap : gap - moved;
    gap_[number] = bound > gap_[number] ? bound : gap_[number];
  }
  const auto renew = [&](std::size_t block) {
    const auto begin = gap_.begin() + static_cast<std::ptrdiff_t>(block * block_size);
    least_[block] =
        *std::min_element(begin, begin + std::min<std::ptrdiff_t>(block_size, gap_.end() - begin));
  };
  if (follows)
    for (std::size_t block = 0; block < least_.size(); ++block)
      renew(block);
  else
    for (std::size_t k = 0; k < measured_.size(); ++k)
      if (const std::size_t block = measured_[k].candidate / block_size;
          k + 1 == measured_.size() || measured_[k + 1].candidate / block_size != block)
        renew(block);
}

const Candidates& CandidateFilter::select(const CollisionSurface& surface, std::span<const Vec3> x,
                                          double range) {
  const double any = range + 2 * move_to(x);
  near_.clear();
  for_lists([&](const auto& list, std::size_t first, auto& to, std::size_t begin) {
    for (std::size_t k = 0; k < list.size();) {
      const std::size_t number = begin + k;
      if (least_[number / block_size] > any) {
        k += block_size - number % block_size;
        continue;
      }
      const auto& vertices = list[k++];
      seen_ += gap_[number] > range ? 1 : 0;
      // Cheap bounds first.
      if (gap_[number] > any || gap_[number] > range + both_sides(vertices, first, length_))
        continue;
      const double moved = between_sides(vertices, first, moved_);
      if (gap_[number] - moved > range)
        continue;
      const double gap = gap_of(surface, x, vertices, first);
      measured_.push_back({number, gap, moved});
      if (!(gap > range))
        to.push_back(vertices);
    }
  });
  keep_measured();
  return near_;
}

double CandidateFilter::free_step(const CollisionSurface& surface, std::span<const Vec3> x0,
                                  std::span<const Vec3> x1, const Separation& separation) {
  const double moved_most = move_to(x0), range = separation.most;
  way_.resize(x0.size());
  way_length_.resize(x0.size());
  double way_most = 0;
  for (const std::uint32_t v : vertices_) {
    way_[v] = x1[v] - x0[v];
    way_length_[v] = norm(way_[v]);
    way_most = way_length_[v] <= way_most ? way_most : way_length_[v]; // NaN stays
  }
  struct Block {
    double least = 0;
    std::size_t number = 0;
  };
  std::vector<Block> blocks;
  for (std::size_t block = 0; block < least_.size(); ++block)
    if (!(least_[block] > range + 2 * (moved_most + way_most)))
      blocks.push_back({least_[block], block});
  std::ranges::stable_sort(blocks, {}, &Block::least);
  double step = 1;
  for (const Block& block : blocks) {
    if (block.least > range + 2 * (moved_most + step * way_most))
      break;
    const std::size_t from = block.number * block_size;
    const std::size_t to = std::min(from + block_size, gap_.size());
    for_lists([&](const auto& list, std::size_t first, auto& /*near*/, std::size_t begin) {
      const std::size_t end = std::min(to, begin + list.size());
      for (std::size_t number = std::max(from, begin); number < end; ++number) {
        const auto& vertices = list[number - begin];
        const double along = range + step * both_sides(vertices, first, way_length_);
        seen_ += gap_[number] > along ? 1 : 0;
        if (gap_[number] > along + both_sides(vertices, first, length_))
          continue;
        const double moved = between_sides(vertices, first, moved_);
        const double far = range + step * between_sides(vertices, first, way_);
        if (gap_[number] - moved > far)
          continue;
        const double gap = gap_of(surface, x0, vertices, first);
        measured_.push_back({number, gap, moved});
        if (!(gap > far))
          step = collision_free_step(surface, vertices, first, x0, x1, separation, step);
      }
    });
  }
  keep_measured();
  return step;
}

} // namespace gewebe::collision
