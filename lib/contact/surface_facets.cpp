#include "contact/surface_facets.h"

#include "base/vector_at.h"
#include "contact/box_blocks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <immintrin.h>
#include <utility>

namespace gewebe {

namespace {

constexpr std::size_t max_in_block = 64;

/// Nodes that belong to the surface without a triangle.
std::vector<std::uint32_t> loose_nodes(const Model& model) {
  std::vector<std::uint8_t> taken(model.nodes.size());
  for (const Tetrahedron& t : model.tetrahedra)
    for (const std::uint32_t corner : t)
      taken[corner] = 1;
  for (const EdgeMiddles& middles : model.middles)
    for (const std::uint32_t middle : middles)
      taken[middle] = 1;
  for (const Triangle& t : model.triangles)
    for (const std::uint32_t corner : t)
      taken[corner] = 1;
  std::vector<std::uint32_t> loose;
  const std::size_t surface = surface_count(model);
  for (std::uint32_t i = 0; i < surface; ++i)
    if (taken[i] == 0)
      loose.push_back(i);
  return loose;
}

Box3 grown(const Box3& box, double by) {
  const Vec3 far{by, by, by};
  return {box.min - far, box.max + far};
}

struct Two {
  __m128d value;
};

} // namespace

Box3 range_of(std::span<const double> displacement) {
  constexpr std::size_t wide = 12; // side by side: comparisons wait for each other
  std::array<double, wide> least{}, most{};
  std::array<Two, wide / 2> low{}, high{};
  low.fill({_mm_set1_pd(HUGE_VAL)});
  high.fill({_mm_set1_pd(-HUGE_VAL)});
  std::size_t k = 0;
  for (; k + wide <= displacement.size(); k += wide)
    for (std::size_t pair = 0; pair < wide / 2; ++pair) {
      const __m128d two = _mm_loadu_pd(displacement.data() + k + 2 * pair);
      low[pair].value = _mm_min_pd(two, low[pair].value); // the second where one is NaN
      high[pair].value = _mm_max_pd(two, high[pair].value);
    }
  for (std::size_t pair = 0; pair < wide / 2; ++pair) {
    _mm_storeu_pd(least.data() + 2 * pair, low[pair].value);
    _mm_storeu_pd(most.data() + 2 * pair, high[pair].value);
  }
  for (std::size_t lane = 0; k + lane < displacement.size(); ++lane) {
    least[lane] = std::min(least[lane], displacement[k + lane]);
    most[lane] = std::max(most[lane], displacement[k + lane]);
  }
  Box3 all;
  for (std::size_t lane = 0; lane < wide; ++lane) {
    const int a = static_cast<int>(lane % 3);
    all.min[a] = std::min(all.min[a], least[lane]);
    all.max[a] = std::max(all.max[a], most[lane]);
  }
  return all;
}

std::vector<Vec3> inward_directions(const Model& model) {
  std::vector<Vec3> inward(model.nodes.size());
  for (const Triangle& t : model.triangles) {
    const Vec3 a = model.nodes[t[0]].position, b = model.nodes[t[1]].position,
               c = model.nodes[t[2]].position;
    for (const std::uint32_t corner : t)
      inward[corner] -= cross(b - a, c - a);
  }
  return inward;
}

SurfaceFacets::SurfaceFacets(const Model& model) {
  for (const Triangle& t : model.triangles)
    facets_.push_back({t[0], t[1], t[2]});
  for (const std::uint32_t i : loose_nodes(model))
    facets_.push_back({i, i, i});
  std::vector<Vec3> middle;
  for (const Facet& f : facets_)
    middle.push_back(model.nodes[f[0]].position + model.nodes[f[1]].position +
                     model.nodes[f[2]].position);
  BlockOrder blocks = block_order(middle, max_in_block);
  first_ = std::move(blocks.first);
  boxes_.resize(first_.size() - 1);
  std::vector<Facet> sorted;
  for (const std::uint32_t k : blocks.order)
    sorted.push_back(facets_[k]);
  facets_ = std::move(sorted);
  for (std::size_t b = 0; b < boxes_.size(); ++b) {
    first_node_.push_back(nodes_.size());
    std::vector<std::uint32_t> some;
    for (std::size_t k = first_[b]; k < first_[b + 1]; ++k)
      some.insert(some.end(), facets_[k].begin(), facets_[k].end());
    std::ranges::sort(some);
    nodes_.insert(nodes_.end(), some.begin(), std::ranges::unique(some).begin());
  }
  first_node_.push_back(nodes_.size());

  first_of_node_.assign(model.nodes.size() + 1, 0);
  const auto for_corners = [&](auto&& visit) {
    for (std::uint32_t k = 0; k < facets_.size(); ++k)
      for (int c = 0; c < corner_count(facets_[k]); ++c)
        visit(facets_[k][static_cast<std::size_t>(c)], k);
  };
  for_corners([&](std::uint32_t node, std::uint32_t) { ++first_of_node_[node + 1]; });
  for (std::size_t i = 1; i < first_of_node_.size(); ++i)
    first_of_node_[i] += first_of_node_[i - 1];
  of_node_.resize(first_of_node_.back());
  std::vector<std::size_t> next(first_of_node_.begin(), first_of_node_.end() - 1);
  for_corners([&](std::uint32_t node, std::uint32_t k) { of_node_[next[node]++] = k; });
  set_shape(model, {});
  rest_ = boxes_;
  rest_box_ = box_;
}

Box3 SurfaceFacets::box_of(const Model& model, std::span<const double> displacement,
                           std::size_t block) const {
  // As Box3::add, which passes over a NaN too, but without a call for each number.
  Box3 box;
  Vec3 min = box.min, max = box.max;
  for (std::size_t k = first_node_[block]; k < first_node_[block + 1]; ++k) {
    const std::uint32_t i = nodes_[k];
    const Vec3 at =
        model.nodes[i].position + (displacement.empty() ? Vec3{} : vector_at(displacement, i));
    for (int a = 0; a < 3; ++a) {
      min[a] = at[a] < min[a] ? at[a] : min[a];
      max[a] = at[a] > max[a] ? at[a] : max[a];
    }
  }
  box.min = min;
  box.max = max;
  return box;
}

void SurfaceFacets::set_shape(const Model& model, std::span<const double> displacement) {
  box_ = {};
  range_.reset();
  for (std::size_t b = 0; b < boxes_.size(); ++b) {
    boxes_[b] = box_of(model, displacement, b);
    box_.add(boxes_[b].min);
    box_.add(boxes_[b].max);
  }
}

void SurfaceFacets::set_shape_near(const Model& model, std::span<const double> displacement,
                                   std::span<const Box3> places) {
  const Box3 far = range_.emplace(range_of(displacement));
  box_ = {};
  for (std::size_t b = 0; b < boxes_.size(); ++b) {
    // Sums round alike at both ends, so that what is in the box at rest is in this one.
    Box3& box = boxes_[b];
    box.min = rest_[b].min + far.min;
    box.max = rest_[b].max + far.max;
    if (std::ranges::any_of(places, [&](const Box3& place) { return near(place, box); }))
      box = box_of(model, displacement, b);
    box_.add(box.min);
    box_.add(box.max);
  }
}

/// Which groups the nodes of each block are of.
void SurfaceFacets::group_blocks(const NodeReach& reach) {
  if (group_ == reach.group)
    return;
  block_groups_.clear();
  first_group_.clear();
  for (std::size_t b = 0; b < boxes_.size(); ++b) {
    first_group_.push_back(block_groups_.size());
    std::vector<std::uint32_t> some;
    for (const std::uint32_t node : nodes_of(b))
      some.push_back((*reach.group)[node]);
    std::ranges::sort(some);
    block_groups_.insert(block_groups_.end(), some.begin(), std::ranges::unique(some).begin());
  }
  first_group_.push_back(block_groups_.size());
  group_ = reach.group;
}

void SurfaceFacets::set_reach(const NodeReach& reach) {
  group_blocks(reach);
  range_.reset();
  double all = 0;
  for (std::size_t b = 0; b < boxes_.size(); ++b) {
    double most = 0;
    for (std::size_t k = first_group_[b]; k < first_group_[b + 1]; ++k)
      most = std::max(most, reach.most[block_groups_[k]]);
    boxes_[b] = grown(rest_[b], most);
    all = std::max(all, most);
  }
  box_ = grown(rest_box_, all);
}

void SurfaceFacets::add_places(const Model& model, std::span<const double> displacement,
                               std::span<const std::uint32_t> nodes) {
  for (const std::uint32_t node : nodes) {
    const Vec3 at = model.nodes[node].position + vector_at(displacement, node);
    for (const std::uint32_t piece : at_node(node))
      boxes_[static_cast<std::size_t>(std::ranges::upper_bound(first_, piece) - first_.begin()) - 1]
          .add(at);
    box_.add(at);
  }
}

std::vector<std::size_t> SurfaceFacets::blocks_near(std::span<const Box3> places) const {
  std::vector<std::size_t> blocks;
  for (std::size_t b = 0; b < boxes_.size(); ++b)
    if (std::ranges::any_of(places, [&](const Box3& place) { return near(place, boxes_[b]); }))
      blocks.push_back(b);
  return blocks;
}

void SurfaceFacets::set_boxes(const Model& model, std::span<const double> displacement,
                              std::span<const std::size_t> blocks) {
  for (const std::size_t b : blocks)
    boxes_[b] = box_of(model, displacement, b);
}

} // namespace gewebe
