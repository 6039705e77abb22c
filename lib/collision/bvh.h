#pragma once
// Bounding volume hierarchy over axis-aligned boxes.

#include "geometry/boxes_meet.h"
#include "geometry/vec3.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace gewebe::collision {

/// Binary tree over items 0, 1, …, each with a box. Built once by where the items are, refitted
/// when their boxes change. All visits come in an order that depends on the boxes alone.
class Bvh {
public:
  Bvh() = default;
  /// Splits at the median of the centres along the longest side of their bounding box, ties by
  /// number, down to at most `leaf` items. Boxes that are empty or not finite belong nowhere near
  /// and are never visited by a box. \pre leaf > 0
  explicit Bvh(std::span<const Box3> boxes, std::size_t leaf = 4);

  /// New boxes for the same items.
  void refit(std::span<const Box3> boxes);

  std::size_t size() const noexcept { return order_.size(); }
  bool empty() const noexcept { return order_.empty(); }
  /// Box around everything.
  const Box3& box() const { return nodes_.empty() ? nothing_ : nodes_[0].box; }

  /// Calls visit(items) for each leaf: groups of neighbours, which hold each item once.
  template <class Visit>
  void for_each_leaf(Visit&& visit) const {
    for (const Node& node : nodes_)
      if (node.second == 0)
        visit(std::span(order_).subspan(node.begin, node.end - node.begin));
  }

  /// Calls visit(item) for all items whose box has a point in common with this one.
  template <class Visit>
  void for_each_overlapping(const Box3& box, Visit&& visit) const {
    for_each_where([&](const Box3& other) { return meet(box, other); }, visit);
  }

  /// Whether an item whose box has a point in common with this one passes the test.
  template <class Test>
  bool any_overlapping(const Box3& box, Test&& test) const {
    bool found = false;
    for_each_where([&](const Box3& other) { return !found && meet(box, other); },
                   [&](std::uint32_t item) { found = found || test(item); });
    return found;
  }

  /// Calls visit(item) where may_hold(box) is true for the item's box and those around it: for
  /// rays, planes, spheres.
  template <class MayHold, class Visit>
  void for_each_where(MayHold&& may_hold, Visit&& visit) const {
    if (nodes_.empty())
      return;
    std::array<std::uint32_t, most_open> open{};
    std::size_t waiting = 1;
    while (waiting > 0) {
      const std::uint32_t at = open[--waiting];
      const Node& node = nodes_[at];
      if (!may_hold(node.box))
        continue;
      if (node.second == 0) {
        for (std::uint32_t k = node.begin; k < node.end; ++k)
          if (may_hold(boxes_[k]))
            visit(order_[k]);
      } else {
        open[waiting++] = node.second;
        open[waiting++] = at + 1;
      }
    }
  }

  /// Calls visit(item of this tree, item of the other) for all items whose boxes meet.
  template <class Visit>
  void for_each_pair(const Bvh& other, Visit&& visit) const {
    if (nodes_.empty() || other.nodes_.empty())
      return;
    std::array<std::pair<std::uint32_t, std::uint32_t>, 2 * most_open> open{};
    std::size_t waiting = 1;
    while (waiting > 0) {
      const auto [a, b] = open[--waiting];
      const Node &mine = nodes_[a], &its = other.nodes_[b];
      if (!meet(mine.box, its.box))
        continue;
      if (mine.second == 0 && its.second == 0) {
        for (std::uint32_t i = mine.begin; i < mine.end; ++i)
          for (std::uint32_t j = its.begin; j < its.end; ++j)
            if (meet(boxes_[i], other.boxes_[j]))
              visit(order_[i], other.order_[j]);
      } else if (its.second == 0 ||
                 (mine.second != 0 && mine.end - mine.begin >= its.end - its.begin)) {
        open[waiting++] = {mine.second, b};
        open[waiting++] = {a + 1, b};
      } else {
        open[waiting++] = {a, its.second};
        open[waiting++] = {a, b + 1};
      }
    }
  }

  /// Calls visit(smaller number, larger number) once for each two items of this tree whose boxes
  /// meet.
  template <class Visit>
  void for_each_own_pair(Visit&& visit) const {
    for (std::uint32_t k = 0; k < order_.size(); ++k)
      for_each_overlapping(boxes_[k], [&](std::uint32_t other) {
        if (order_[k] < other)
          visit(order_[k], other);
      });
  }

  /// Item with the smallest distance, by branch and bound; ties by number.
  /// \param bound  lower_bound(box): no item in the box is nearer
  /// \param distance  distance(item); not less than the bound of its box, any unit
  /// \param best  items that are not nearer are left out
  /// \return number and distance, or size() and `best` where none is nearer
  template <class LowerBound, class Distance>
  std::pair<std::size_t, double> nearest(LowerBound&& lower_bound, Distance&& distance,
                                         double best) const {
    std::pair<std::size_t, double> found{size(), best};
    if (nodes_.empty())
      return found;
    std::array<std::pair<std::uint32_t, double>, most_open> open{};
    open[0] = {0, lower_bound(nodes_[0].box)};
    std::size_t waiting = 1;
    while (waiting > 0) {
      const auto [at, bound] = open[--waiting];
      if (!(bound <= found.second))
        continue;
      const Node& node = nodes_[at];
      if (node.second == 0) {
        for (std::uint32_t k = node.begin; k < node.end; ++k) {
          if (!(lower_bound(boxes_[k]) <= found.second))
            continue;
          const double d = distance(order_[k]);
          if (d < found.second ||
              (d == found.second && order_[k] < found.first && found.first < size()))
            found = {order_[k], d};
        }
        continue;
      }
      std::pair<std::uint32_t, double> near{at + 1, lower_bound(nodes_[at + 1].box)},
          far{node.second, lower_bound(nodes_[node.second].box)};
      if (far.second < near.second)
        std::swap(near, far);
      open[waiting++] = far;
      open[waiting++] = near;
    }
    return found;
  }

private:
  static constexpr std::size_t most_open = 128; ///< two of each level, which halves the number
  struct Node {
    Box3 box;
    std::uint32_t begin = 0, end = 0;
    std::uint32_t second = 0; ///< second child; the first follows its parent; 0: a leaf
  };
  std::vector<std::uint32_t> order_; ///< items in the order of leaves
  std::vector<Box3> boxes_;          ///< in that order
  std::vector<Node> nodes_;          ///< parents before their children
  Box3 nothing_;
};

} // namespace gewebe::collision
