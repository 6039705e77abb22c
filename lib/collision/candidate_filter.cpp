#include "collision/candidate_filter.h"

#include "collision/distance.h"
#include "collision/pair_feature.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
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
/// What bounds of sums are multiplied by, so that rounding does not make them too small.
constexpr double with_rounding = 1 + 1e-12;

template <std::size_t n>
double gap_of(const CollisionSurface& surface, std::span<const Vec3> x,
              const std::array<std::uint32_t, n>& vertices, std::size_t first) {
  std::array<Vec3, n> y;
  for (std::size_t k = 0; k < n; ++k)
    y[k] = x[vertices[k]];
  return std::sqrt(squared_distance(closest_feature(y, first), y)) -
         radius_sum(surface, vertices.front(), vertices.back());
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

/// Calls act(number of vertices as a constant, vertices of the first side) for a list of
/// Candidates.
template <class Act>
void with_list(std::size_t list, const Act& act) {
  if (list == 0)
    act(std::integral_constant<std::size_t, 2>(), std::size_t{1});
  else if (list == 1)
    act(std::integral_constant<std::size_t, 3>(), std::size_t{1});
  else
    act(std::integral_constant<std::size_t, 4>(), list == 2 ? std::size_t{2} : std::size_t{1});
}

template <std::size_t n>
std::array<std::uint32_t, n> first_of(const std::array<std::uint32_t, 4>& vertices) {
  std::array<std::uint32_t, n> first;
  std::copy_n(vertices.begin(), n, first.begin());
  return first;
}

/// Buckets of gaps, two for each power of two: the order of magnitude, by the bits of the number.
constexpr std::size_t buckets = 128;
std::size_t bucket_of(double gap) {
  constexpr std::uint64_t smallest = std::bit_cast<std::uint64_t>(0x1p-32) >> 51;
  if (!(gap > 0x1p-32))
    return 0;
  return std::min<std::uint64_t>((std::bit_cast<std::uint64_t>(gap) >> 51) - smallest, buckets - 1);
}

} // namespace

void CandidateFilter::reset(const CollisionSurface& surface, const Candidates& candidates,
                            std::span<const double> gaps, std::span<const std::uint32_t> vertices,
                            std::span<const Vec3> x) {
  surface_ = &surface;
  candidates_ = &candidates;
  vertices_ = vertices;
  groups_.clear();
  blocks_.clear();
  pairs_.clear();
  pairs_.reserve(candidates.size());
  seen_ = 0;
  reference_.clear();
  for (const std::uint32_t v : vertices)
    reference_.push_back(x[v]);
  std::uint32_t number = 0;
  std::vector<std::uint32_t> sorted;
  const auto add = [&](const auto& list, std::size_t which) {
    for (std::size_t k = 0; k < list.size();) {
      const Group group{which, surface.owner[list[k].front()], surface.owner[list[k].back()], 0, 0};
      std::size_t end = k;
      std::array<std::size_t, buckets + 1> begin{};
      for (; end < list.size() && surface.owner[list[end].front()] == group.a &&
             surface.owner[list[end].back()] == group.b;
           ++end)
        ++begin[bucket_of(gaps[number + end]) + 1];
      std::partial_sum(begin.begin(), begin.end(), begin.begin());
      const std::size_t before = pairs_.size();
      pairs_.resize(before + end - k);
      for (; k < end; ++k) {
        const double gap = gaps[number + k];
        Pair& pair = pairs_[before + begin[bucket_of(gap)]++];
        std::ranges::copy(list[k], pair.vertices.begin());
        pair.number = number + static_cast<std::uint32_t>(k);
        pair.bound = gap;
      }
      groups_.push_back(group);
      for (std::size_t p = before; p < pairs_.size(); p += block_size) {
        Block& block = blocks_.emplace_back();
        block.begin = p;
        block.end = std::min(p + block_size, pairs_.size());
        block.group = groups_.size() - 1;
        set_least(block);
      }
    }
    number += static_cast<std::uint32_t>(list.size());
  };
  add(candidates.point_point, 0);
  add(candidates.point_edge, 1);
  add(candidates.edge_edge, 2);
  add(candidates.point_triangle, 3);
}

void CandidateFilter::set_least(Block& block) const {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t p = block.begin; p < block.end; ++p)
    least = pairs_[p].bound >= least ? least : pairs_[p].bound; // NaN stays
  block.least = least - block.less;
}

void CandidateFilter::set_motion(std::span<const Vec3> vectors, double Group::*bound) {
  struct Motion {
    Vec3 mean;
    double count = 0, deviation = 0;
  };
  std::vector<Motion> motions;
  for (const std::uint32_t v : vertices_) {
    const std::uint32_t owner = surface_->owner[v];
    if (owner >= motions.size())
      motions.resize(owner + std::size_t{1});
    motions[owner].mean += vectors[v];
    ++motions[owner].count;
  }
  for (Motion& motion : motions)
    if (motion.count > 0)
      motion.mean = motion.mean / motion.count;
  for (const std::uint32_t v : vertices_) {
    Motion& motion = motions[surface_->owner[v]];
    const double deviation = norm(vectors[v] - motion.mean);
    motion.deviation = deviation <= motion.deviation ? motion.deviation : deviation; // NaN stays
  }
  for (Group& group : groups_) {
    const Motion &a = motions[group.a], &b = motions[group.b];
    group.*bound = with_rounding * (norm(a.mean - b.mean) + a.deviation + b.deviation);
  }
}

void CandidateFilter::move_to(std::span<const Vec3> x) {
  moved_.resize(x.size());
  for (std::size_t k = 0; k < vertices_.size(); ++k)
    moved_[vertices_[k]] = x[vertices_[k]] - reference_[k];
  set_motion(moved_, &Group::moved);
  measured_.clear();
  for (Block& block : blocks_)
    block.seen = false;
}

void CandidateFilter::keep_measured() {
  const auto all = static_cast<double>(pairs_.size());
  const bool follows = static_cast<double>(measured_.size()) > many_measured * all ||
                       static_cast<double>(seen_) > many_seen * all;
  if (follows) {
    seen_ = 0;
    for (Block& block : blocks_) {
      const Group& group = groups_[block.group];
      if (!block.seen) {
        block.less += group.moved;
        block.least -= group.moved;
        continue;
      }
      with_list(group.list, [&](auto n, std::size_t first) {
        for (std::size_t p = block.begin; p < block.end; ++p)
          pairs_[p].bound -= between_sides(first_of<n()>(pairs_[p].vertices), first, moved_);
      });
    }
    for (std::size_t k = 0; k < vertices_.size(); ++k)
      reference_[k] += moved_[vertices_[k]];
  }
  for (const Measured& m : measured_) {
    const double bound = (follows ? m.gap : m.gap - m.moved) + blocks_[m.block].less;
    pairs_[m.pair].bound = bound > pairs_[m.pair].bound ? bound : pairs_[m.pair].bound;
  }
  for (Block& block : blocks_)
    if (block.seen)
      set_least(block);
}

const Candidates& CandidateFilter::select(std::span<const Vec3> x, double range) {
  move_to(x);
  numbers_.clear();
  for (std::size_t number = 0; number < blocks_.size(); ++number) {
    Block& block = blocks_[number];
    const Group& group = groups_[block.group];
    if (block.least > range + group.moved)
      continue;
    block.seen = true;
    with_list(group.list, [&](auto n, std::size_t first) {
      for (std::size_t p = block.begin; p < block.end; ++p) {
        const double bound = pairs_[p].bound - block.less;
        seen_ += bound > range ? 1 : 0;
        if (bound > range + group.moved)
          continue;
        const auto vertices = first_of<n()>(pairs_[p].vertices);
        const double moved = between_sides(vertices, first, moved_);
        if (bound - moved > range)
          continue;
        const double gap = gap_of(*surface_, x, vertices, first);
        measured_.push_back({number, p, gap, moved});
        if (!(gap > range))
          numbers_.push_back(pairs_[p].number);
      }
    });
  }
  keep_measured();
  std::ranges::sort(numbers_);
  near_.clear();
  std::size_t k = 0, begin = 0;
  const auto take = [&](const auto& list, auto& to) {
    for (; k < numbers_.size() && numbers_[k] < begin + list.size(); ++k)
      to.push_back(list[numbers_[k] - begin]);
    begin += list.size();
  };
  take(candidates_->point_point, near_.point_point);
  take(candidates_->point_edge, near_.point_edge);
  take(candidates_->edge_edge, near_.edge_edge);
  take(candidates_->point_triangle, near_.point_triangle);
  return near_;
}

double CandidateFilter::free_step(std::span<const Vec3> x0, std::span<const Vec3> x1,
                                  const Separation& separation) {
  const double range = separation.most;
  move_to(x0);
  way_.resize(x0.size());
  for (const std::uint32_t v : vertices_)
    way_[v] = x1[v] - x0[v];
  set_motion(way_, &Group::way);
  struct Ahead {
    double least = 0; ///< gap
    std::size_t block = 0;
  };
  std::vector<Ahead> ahead;
  for (std::size_t number = 0; number < blocks_.size(); ++number) {
    const Group& group = groups_[blocks_[number].group];
    const double least = blocks_[number].least - group.moved;
    if (!(least > range + group.way))
      ahead.push_back({least, number});
  }
  std::ranges::stable_sort(ahead, {}, &Ahead::least);
  double step = 1;
  for (const auto& [least, number] : ahead) {
    Block& block = blocks_[number];
    const Group& group = groups_[block.group];
    if (least > range + step * group.way)
      continue;
    block.seen = true;
    with_list(group.list, [&](auto n, std::size_t first) {
      for (std::size_t p = block.begin; p < block.end; ++p) {
        const double bound = pairs_[p].bound - block.less;
        seen_ += bound > range + step * group.way ? 1 : 0;
        if (bound - group.moved > range + step * group.way)
          continue;
        const auto vertices = first_of<n()>(pairs_[p].vertices);
        const double moved = between_sides(vertices, first, moved_);
        const double far = range + step * between_sides(vertices, first, way_);
        if (bound - moved > far)
          continue;
        const double gap = gap_of(*surface_, x0, vertices, first);
        measured_.push_back({number, p, gap, moved});
        if (!(gap > far))
          step = collision_free_step(*surface_, vertices, first, x0, x1, separation, step);
      }
    });
  }
  keep_measured();
  return step;
}

} // namespace gewebe::collision
