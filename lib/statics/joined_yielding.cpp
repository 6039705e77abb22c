#include "statics/joined_yielding.h"

#include <algorithm>

namespace gewebe {

std::vector<NodeTouch> touches_of_part(std::span<const NodeTouch> touches, std::uint32_t first,
                                       std::uint32_t end) {
  std::vector<NodeTouch> own;
  for (const NodeTouch& t : touches)
    if (first <= t.node && t.node < end)
      own.push_back({t.node - first, t.instrument, t.force});
  return own;
}

JoinedYielding::JoinedYielding(std::vector<Part> parts, std::size_t nodes)
    : parts_(std::move(parts)), nodes_(static_cast<std::uint32_t>(nodes)), shape_(3 * nodes),
      known_(parts_.size()) {}

std::uint32_t JoinedYielding::end_of(std::size_t part) const {
  return part + 1 < parts_.size() ? parts_[part + 1].first : nodes_;
}

DelassusOperator JoinedYielding::delassus_operator(std::span<const std::uint32_t> nodes) {
  asked_.assign(nodes.begin(), nodes.end());
  DelassusOperator all;
  all.nodes = asked_;
  const std::size_t size = 3 * nodes.size();
  all.compliance.resize(size * size);
  std::size_t row = 0;
  for (std::size_t k = 0; k < parts_.size(); ++k) {
    std::vector<std::uint32_t> own;
    for (const std::uint32_t node : nodes)
      if (parts_[k].first <= node && node < end_of(k))
        own.push_back(node - parts_[k].first);
    if (own.empty())
      continue;
    const DelassusOperator one = parts_[k].object->delassus_operator(own);
    const std::size_t count = 3 * own.size();
    for (std::size_t c = 0; c < count; ++c)
      std::copy_n(one.compliance.begin() + static_cast<std::ptrdiff_t>(c * count), count,
                  all.compliance.begin() + static_cast<std::ptrdiff_t>((row + c) * size + row));
    all.free.insert(all.free.end(), one.free.begin(), one.free.end());
    row += count;
  }
  return all;
}

bool JoinedYielding::push(std::span<const NodeTouch> touches, std::span<const Vec3> at) {
  bool agreed = true;
  for (std::size_t k = 0; k < parts_.size(); ++k) {
    const std::uint32_t first = parts_[k].first, end = end_of(k);
    std::vector<Vec3> own;
    for (std::size_t i = 0; i < at.size(); ++i)
      if (first <= asked_[i] && asked_[i] < end)
        own.push_back(at[i]);
    agreed = parts_[k].object->push(touches_of_part(touches, first, end), own) && agreed;
  }
  return agreed;
}

std::span<const double> JoinedYielding::shape() {
  for (std::size_t k = 0; k < parts_.size(); ++k) {
    const std::span<const double> own = parts_[k].object->shape();
    std::ranges::copy(own, shape_.begin() + std::ptrdiff_t{3} * parts_[k].first);
    known_[k] = own.size();
  }
  return shape_;
}

} // namespace gewebe
