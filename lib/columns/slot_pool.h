#pragma once
// Pool of equal pieces of memory, in huge pages if the system has them, so that fast sequential
// reads do not wait for page tables.

#include "base/huge_pages.h"

#include <algorithm>
#include <cstddef>
#include <memory>
#include <vector>

namespace gewebe {

template <class T>
class SlotPool {
public:
  explicit SlotPool(std::size_t size) : size_(size) {}

  /// Takes a slot of uninitialised numbers.
  T* take() {
    if (free_.empty()) {
      constexpr std::size_t chunk_bytes = std::size_t{16} << 20U;
      const std::size_t count = std::clamp<std::size_t>(chunk_bytes / (size_ * sizeof(T)), 1, 64);
      chunks_.push_back(std::make_unique_for_overwrite<T[]>(size_ * count));
      prefer_huge_pages(chunks_.back().get(), size_ * count * sizeof(T));
      for (std::size_t k = count; k-- > 0;)
        free_.push_back(chunks_.back().get() + k * size_);
    }
    T* const slot = free_.back();
    free_.pop_back();
    return slot;
  }
  void give_back(T* slot) { free_.push_back(slot); }

private:
  std::size_t size_;
  std::vector<std::unique_ptr<T[]>> chunks_; // NOLINT(modernize-avoid-c-arrays)
  std::vector<T*> free_;
};

} // namespace gewebe
