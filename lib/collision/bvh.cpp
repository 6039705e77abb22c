#include "collision/bvh.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace gewebe::collision {

namespace {

Vec3 centre_of(const Box3& box) {
  Vec3 centre = 0.5 * (box.min + box.max);
  for (int axis = 0; axis < 3; ++axis)
    if (!std::isfinite(centre[axis]))
      centre[axis] = 0;
  return centre;
}

} // namespace

Bvh::Bvh(std::span<const Box3> boxes, std::size_t leaf) : order_(boxes.size()) {
  std::iota(order_.begin(), order_.end(), std::uint32_t{0});
  std::vector<Vec3> centres(boxes.size());
  std::transform(boxes.begin(), boxes.end(), centres.begin(), centre_of);
  struct Task {
    std::uint32_t begin, end, parent;
  };
  constexpr std::uint32_t none = ~std::uint32_t{0};
  std::vector<Task> tasks;
  if (!boxes.empty())
    tasks.push_back({0, static_cast<std::uint32_t>(boxes.size()), none});
  while (!tasks.empty()) {
    const Task task = tasks.back();
    tasks.pop_back();
    const std::uint32_t at = static_cast<std::uint32_t>(nodes_.size());
    if (task.parent != none)
      nodes_[task.parent].second = at;
    nodes_.push_back({{}, task.begin, task.end, 0});
    if (task.end - task.begin <= leaf)
      continue;
    const auto first = order_.begin() + task.begin, last = order_.begin() + task.end;
    Box3 around;
    std::for_each(first, last, [&](std::uint32_t k) { around.add(centres[k]); });
    const Vec3 size = around.size();
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const std::uint32_t middle = task.begin + (task.end - task.begin) / 2;
    std::nth_element(first, order_.begin() + middle, last, [&](std::uint32_t a, std::uint32_t b) {
      const double of_a = centres[a][axis], of_b = centres[b][axis];
      return of_a != of_b ? of_a < of_b : a < b;
    });
    // The first child directly follows its parent; the second stores its index in the parent.
    tasks.push_back({middle, task.end, at});
    tasks.push_back({task.begin, middle, none});
  }
  for (const Node& node : nodes_) // one order, whatever nth_element does
    if (node.second == 0)
      std::sort(order_.begin() + node.begin, order_.begin() + node.end);
  boxes_.resize(boxes.size());
  refit(boxes);
}

void Bvh::refit(std::span<const Box3> boxes) {
  for (std::size_t k = 0; k < order_.size(); ++k)
    boxes_[k] = boxes[order_[k]];
  for (std::size_t at = nodes_.size(); at-- > 0;) {
    Node& node = nodes_[at];
    node.box = {};
    const auto add = [&](const Box3& other) {
      if (other.empty())
        return;
      node.box.add(other.min);
      node.box.add(other.max);
    };
    if (node.second == 0) {
      for (std::uint32_t k = node.begin; k < node.end; ++k)
        add(boxes_[k]);
    } else {
      add(nodes_[at + 1].box);
      add(nodes_[node.second].box);
    }
  }
}

} // namespace gewebe::collision
