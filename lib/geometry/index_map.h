#pragma once
// Hash map from lattice indices to numbers: flat, linear probing, no removal. Results of look-ups
// do not depend on the order of insertion.

#include "geometry/vec3.h"

#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace gewebe {

class IndexMap {
public:
  static constexpr std::uint32_t none = UINT32_MAX;

  /// Room for `count` keys. \pre no more than that are inserted
  explicit IndexMap(std::size_t count = 0)
      : slots_(std::bit_ceil(2 * count + 2)),
        shift_(64 - static_cast<int>(std::bit_width(slots_.size() - 1))) {}

  /// The number of `key`; if it has none yet, `value` becomes it. \pre value != none
  std::uint32_t insert(const Int3& key, std::uint32_t value) {
    Slot& slot = slots_[position(key)];
    if (slot.value == none)
      slot = {key, value};
    return slot.value;
  }
  /// The number of `key`, or none.
  std::uint32_t find(const Int3& key) const { return slots_[position(key)].value; }

private:
  struct Slot {
    Int3 key{};
    std::uint32_t value = none;
  };
  /// operator== of arrays calls memcmp.
  static bool equal(const Int3& a, const Int3& b) {
    return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
  }
  std::size_t position(const Int3& key) const {
    const auto word = [](std::int32_t n) { return std::uint64_t{static_cast<std::uint32_t>(n)}; };
    std::uint64_t h = (word(key[0]) << 32 | word(key[1])) * 0x9e3779b97f4a7c15U;
    h = (h ^ h >> 29 ^ word(key[2])) * 0xbf58476d1ce4e5b9U;
    h = (h ^ h >> 32) * 0x94d049bb133111ebU;
    std::size_t n = static_cast<std::size_t>(h >> shift_);
    while (slots_[n].value != none && !equal(slots_[n].key, key))
      n = (n + 1) & (slots_.size() - 1);
    return n;
  }
  std::vector<Slot> slots_;
  int shift_;
};

} // namespace gewebe
