#include "contact/box_blocks.h"

#include <algorithm>
#include <utility>

namespace gewebe {

BlockOrder block_order(std::span<const Vec3> middle, std::size_t most) {
  BlockOrder blocks;
  std::vector<std::uint32_t>& order = blocks.order;
  order.resize(middle.size());
  for (std::uint32_t k = 0; k < order.size(); ++k)
    order[k] = k;
  const auto at = [&](std::size_t k) { return order.begin() + static_cast<std::ptrdiff_t>(k); };
  std::vector<std::pair<std::size_t, std::size_t>> open{{0, order.size()}};
  while (!open.empty()) {
    const auto [begin, end] = open.back();
    open.pop_back();
    if (end - begin <= most) {
      blocks.first.push_back(begin);
      continue;
    }
    Box3 box;
    for (std::size_t k = begin; k < end; ++k)
      box.add(middle[order[k]]);
    const Vec3 size = box.size();
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const std::size_t half = begin + (end - begin) / 2;
    std::nth_element(at(begin), at(half), at(end), [&](std::uint32_t i, std::uint32_t j) {
      const double a = middle[i][axis], b = middle[j][axis];
      return a < b || (a == b && i < j);
    });
    open.emplace_back(begin, half);
    open.emplace_back(half, end);
  }
  std::sort(blocks.first.begin(), blocks.first.end());
  blocks.first.push_back(order.size());
  for (std::size_t b = 0; b + 1 < blocks.first.size(); ++b)
    std::sort(at(blocks.first[b]), at(blocks.first[b + 1]));
  return blocks;
}

} // namespace gewebe
