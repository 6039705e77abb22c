#include "dynamics/spring_layout.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <span>
#include <utility>

namespace gewebe::dynamics {

namespace {

constexpr std::size_t lanes = 4;

/// Sorts nodes so that every half is on one side of a plane; leaves are blocks.
void bisect(const model::Model& model, std::span<std::uint32_t> nodes, std::size_t first,
            std::vector<std::pair<std::size_t, std::size_t>>& blocks) {
  if (nodes.size() <= 1) {
    if (blocks.empty() && !nodes.empty())
      blocks.emplace_back(first, nodes.size());
    return;
  }
  const bool is_block = nodes.size() <= largest_block;
  Box3 box;
  for (const std::uint32_t node : nodes)
    box.add(model.nodes[node].position);
  const Vec3 size = box.size();
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const auto middle = nodes.begin() + static_cast<std::ptrdiff_t>(nodes.size() / 2);
  std::nth_element(nodes.begin(), middle, nodes.end(), [&](std::uint32_t a, std::uint32_t b) {
    const double pa = model.nodes[a].position[axis], pb = model.nodes[b].position[axis];
    return pa != pb ? pa < pb : a < b;
  });
  std::vector<std::pair<std::size_t, std::size_t>> inside{{0, 0}}; // a block is not divided further
  const auto half = nodes.size() / 2;
  bisect(model, nodes.first(half), first, is_block ? inside : blocks);
  bisect(model, nodes.subspan(half), first + half, is_block ? inside : blocks);
  if (is_block)
    blocks.emplace_back(first, nodes.size());
}

std::uint32_t bytes(std::uint32_t row) {
  return row * static_cast<std::uint32_t>(sizeof(NodeRest));
}

struct Half {
  std::uint32_t i, j; ///< rows
  const model::Spring* spring;
};

/// Groups of springs in rounds in which no node comes twice: a sum that waits for the one before
/// costs the time of a whole group.
void append_groups(std::vector<Half> springs, std::uint32_t idle, bool both_ends,
                   std::vector<SpringGroup>& groups) {
  std::sort(springs.begin(), springs.end(),
            [](const Half& a, const Half& b) { return std::pair(a.i, a.j) < std::pair(b.i, b.j); });
  std::size_t lane = lanes;
  const auto put = [&](const Half& half) {
    if (lane == lanes) {
      SpringGroup& empty = groups.emplace_back();
      std::fill(std::begin(empty.i), std::end(empty.i), bytes(idle));
      std::fill(std::begin(empty.j), std::end(empty.j), bytes(idle));
      lane = 0;
    }
    SpringGroup& group = groups.back();
    group.stiffness[lane] = half.spring->stiffness;
    group.damping[lane] = half.spring->damping;
    group.rest[lane] = half.spring->rest;
    group.i[lane] = bytes(half.i);
    group.j[lane] = bytes(half.j);
    ++lane;
  };
  std::vector<bool> used(largest_block);
  while (!springs.empty()) {
    std::fill(used.begin(), used.end(), false);
    std::size_t kept = 0;
    for (const Half& half : springs) {
      const std::size_t i = half.i - idle, j = both_ends ? half.j - idle : i;
      if (used[i] || used[j]) {
        springs[kept++] = half;
        continue;
      }
      used[i] = used[j] = true;
      put(half);
    }
    springs.resize(kept);
  }
}

} // namespace

std::uint64_t SpringLayout::pulls() const {
  return lanes * groups.size();
}

SpringLayout spring_layout(const model::Model& model) {
  SpringLayout layout;
  const std::size_t n = model.nodes.size();
  layout.node_of_row.resize(n);
  std::iota(layout.node_of_row.begin(), layout.node_of_row.end(), 0U);
  const auto held = std::stable_partition(
      layout.node_of_row.begin(), layout.node_of_row.end(),
      [&](std::uint32_t node) { return model.nodes[node].fixed != model::fixed_all; });
  layout.movable = static_cast<std::size_t>(held - layout.node_of_row.begin());
  std::vector<std::pair<std::size_t, std::size_t>> ranges;
  bisect(model, {layout.node_of_row.data(), layout.movable}, 0, ranges);

  layout.row_of_node.resize(n);
  for (std::uint32_t row = 0; row < n; ++row)
    layout.row_of_node[layout.node_of_row[row]] = row;
  layout.rest.reserve(n);
  for (const std::uint32_t node : layout.node_of_row) {
    const Vec3& p = model.nodes[node].position;
    layout.rest.push_back({{p.x, p.y, p.z, 0}});
  }
  std::vector<std::uint32_t> block_of_row(layout.movable);
  for (std::uint32_t b = 0; b < ranges.size(); ++b)
    for (std::size_t row = ranges[b].first; row < ranges[b].first + ranges[b].second; ++row)
      block_of_row[row] = b;

  std::vector<std::vector<Half>> within(ranges.size()), across(ranges.size());
  for (const model::Spring& s : model.springs) {
    const std::uint32_t i = layout.row_of_node[s.i], j = layout.row_of_node[s.j];
    const bool i_moves = i < layout.movable, j_moves = j < layout.movable;
    if (i_moves && j_moves && block_of_row[i] == block_of_row[j]) {
      within[block_of_row[i]].push_back({std::min(i, j), std::max(i, j), &s});
      continue;
    }
    if (i_moves)
      across[block_of_row[i]].push_back({i, j, &s});
    if (j_moves)
      across[block_of_row[j]].push_back({j, i, &s});
  }
  std::vector<std::array<std::size_t, 3>> starts;
  for (std::size_t b = 0; b < ranges.size(); ++b) {
    const auto idle = static_cast<std::uint32_t>(ranges[b].first);
    const std::size_t first = layout.groups.size();
    append_groups(std::move(within[b]), idle, true, layout.groups);
    const std::size_t middle = layout.groups.size();
    append_groups(std::move(across[b]), idle, false, layout.groups);
    starts.push_back({first, middle, layout.groups.size()});
  }
  for (std::size_t b = 0; b < ranges.size(); ++b)
    layout.blocks.push_back({ranges[b].first, ranges[b].second, layout.groups.data() + starts[b][0],
                             starts[b][1] - starts[b][0], layout.groups.data() + starts[b][1],
                             starts[b][2] - starts[b][1]});
  return layout;
}

} // namespace gewebe::dynamics
