#pragma once
// Pool of equal pieces of memory, in huge pages if the system has them, so that fast sequential
// reads do not wait for page tables.

#include "base/huge_pages.h"

#include <algorithm>
#include <cstddef>
#include <memory>
#include <vector>

namespace gewebe::columns {

/// Slots return to the pool when their last owner goes, and keep the pool alive.
template <class T>
class SlotPool : public std::enable_shared_from_this<SlotPool<T>> {
public:
  explicit SlotPool(std::size_t size) : size_(size) {}

  /// Takes a slot of uninitialised numbers. \pre the pool is held by a shared_ptr
  std::shared_ptr<T> take() {
    if (free_.empty()) {
      constexpr std::size_t chunk_bytes = std::size_t{16} << 20U;
      const std::size_t count = std::clamp<std::size_t>(chunk_bytes / (size_ * sizeof(T)), 1, 64);
      slots_ += count;
      free_.reserve(slots_); // so that no return fails
      chunks_.push_back(std::make_unique_for_overwrite<T[]>(size_ * count));
      prefer_huge_pages(chunks_.back().get(), size_ * count * sizeof(T));
      for (std::size_t k = count; k-- > 0;)
        free_.push_back(chunks_.back().get() + k * size_);
    }
    T* const slot = free_.back();
    free_.pop_back();
    return {slot, [pool = this->shared_from_this()](T* taken) { pool->free_.push_back(taken); }};
  }

private:
  std::size_t size_, slots_ = 0;
  std::vector<std::unique_ptr<T[]>> chunks_; // NOLINT(modernize-avoid-c-arrays)
  std::vector<T*> free_;
};

} // namespace gewebe::columns
