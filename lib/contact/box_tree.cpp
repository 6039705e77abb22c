#include "contact/box_tree.h"

#include <algorithm>
#include <utility>

namespace gewebe {

namespace {

constexpr std::size_t most_in_leaf = 4;

} // namespace

BoxTree::BoxTree(std::span<const Vec3> middles) : order_(middles.size()) {
  for (std::uint32_t k = 0; k < order_.size(); ++k)
    order_[k] = k;
  // Parts to be made, and whose second half each is.
  std::vector<std::pair<Part, std::uint32_t>> open{{{0, order_.size(), 0}, 0}};
  while (!open.empty()) {
    const auto [part, whole] = open.back();
    open.pop_back();
    const auto number = static_cast<std::uint32_t>(parts_.size());
    if (number > 0 && number != whole + 1)
      parts_[whole].second = number;
    parts_.push_back(part);
    if (part.end - part.begin <= most_in_leaf)
      continue;
    Box3 box;
    for (std::size_t k = part.begin; k < part.end; ++k)
      box.add(middles[order_[k]]);
    const Vec3 size = box.size();
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const std::size_t half = part.begin + (part.end - part.begin) / 2;
    const auto at = [&](std::size_t k) { return order_.begin() + static_cast<std::ptrdiff_t>(k); };
    std::nth_element(at(part.begin), at(half), at(part.end), [&](std::uint32_t i, std::uint32_t j) {
      const double a = middles[i][axis], b = middles[j][axis];
      return a < b || (a == b && i < j);
    });
    open.push_back({{half, part.end, 0}, number});
    open.push_back({{part.begin, half, 0}, number});
  }
  for (const Part& part : parts_)
    if (part.second == 0)
      std::sort(order_.begin() + static_cast<std::ptrdiff_t>(part.begin),
                order_.begin() + static_cast<std::ptrdiff_t>(part.end));
  boxes_.resize(parts_.size());
}

void BoxTree::fit(std::span<const Box3> boxes) {
  for (std::size_t p = parts_.size(); p-- > 0;) {
    Box3 box;
    const auto join = [&](const Box3& more) {
      box.add(more.min);
      box.add(more.max);
    };
    if (parts_[p].second == 0) {
      for (std::size_t k = parts_[p].begin; k < parts_[p].end; ++k)
        join(boxes[order_[k]]);
    } else {
      join(boxes_[p + 1]);
      join(boxes_[parts_[p].second]);
    }
    boxes_[p] = box;
  }
}

} // namespace gewebe
