#pragma once
// Union-find: which items are connected by the pairs joined so far.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace gewebe {

/// Sets of the numbers 0 … count - 1, each named by its smallest member, so that names depend on
/// the pairs alone and not on their order.
class DisjointSets {
public:
  explicit DisjointSets(std::size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), 0U);
  }
  /// The smallest member of n's set. \pre n < count
  std::uint32_t find(std::uint32_t n) {
    while (parent_[n] != n)
      n = parent_[n] = parent_[parent_[n]];
    return n;
  }
  /// True if a and b were in different sets.
  bool join(std::uint32_t a, std::uint32_t b) {
    if (parent_[a] == parent_[b])
      return false;
    const std::uint32_t x = find(a), y = find(b);
    if (x == y)
      return false;
    parent_[std::max(x, y)] = std::min(x, y);
    return true;
  }
  /// The set of each, numbered by smallest member; returns how many there are.
  std::uint32_t number(std::vector<std::uint32_t>& set) {
    set.resize(parent_.size());
    std::uint32_t sets = 0;
    for (std::uint32_t n = 0; n < set.size(); ++n) {
      const std::uint32_t smallest = find(n);
      set[n] = smallest == n ? sets++ : set[smallest];
    }
    return sets;
  }

private:
  std::vector<std::uint32_t> parent_;
};

} // namespace gewebe
