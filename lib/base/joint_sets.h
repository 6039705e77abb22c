#pragma once
// Union-find for several threads at once: which items are connected by the pairs joined so far.

#include "base/context.h"
#include "base/parallel.h"

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

// Based on: Anderson and Woll, Wait-free Parallel Algorithms for the Union-Find Problem, 1991.

namespace gewebe {

/// DisjointSets (base/disjoint_sets.h) whose join() may be called from several threads. A set is
/// named by its smallest member, so that names depend neither on the order of pairs nor on threads.
class JointSets {
public:
  /// Starts from one pair for each item: the item and an item with the same or a smaller number.
  explicit JointSets(std::vector<std::uint32_t> not_above) : parent_(std::move(not_above)) {}
  /// \pre a, b < count
  void join(std::uint32_t a, std::uint32_t b) {
    for (;;) {
      if (a == b || parent(a) == parent(b))
        return;
      a = find(a);
      b = find(b);
      if (a == b)
        return;
      std::uint32_t child = std::max(a, b);
      // Only a root may be attached to another. If it is no root any more, its new root is
      // searched.
      if (std::atomic_ref(parent_[child])
              .compare_exchange_strong(child, std::min(a, b), std::memory_order_relaxed))
        return;
    }
  }
  /// Compresses all paths, so that later look-ups are fast.
  void flatten(const Context& context) {
    Context quiet = context;
    quiet.progress = nullptr;
    parallel_blocks(quiet, parent_.size(), 1 << 16, [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n < end; ++n)
        std::atomic_ref(parent_[n])
            .store(find(static_cast<std::uint32_t>(n)), std::memory_order_relaxed);
    });
  }
  /// The smallest member of each item's set.
  std::vector<std::uint32_t> smallest(const Context& context) && {
    flatten(context);
    return std::move(parent_);
  }

private:
  std::uint32_t parent(std::uint32_t n) {
    return std::atomic_ref(parent_[n]).load(std::memory_order_relaxed);
  }
  /// A parent has a smaller number than its child. An ancestor of an item stays its ancestor, so
  /// that concurrent writes of other threads can't make a write here wrong.
  std::uint32_t find(std::uint32_t n) {
    for (;;) {
      const std::uint32_t next = parent(n);
      if (next == n)
        return n;
      const std::uint32_t above = parent(next);
      if (above == next)
        return above;
      std::atomic_ref(parent_[n]).store(above, std::memory_order_relaxed);
      n = above;
    }
  }

  std::vector<std::uint32_t> parent_;
};

} // namespace gewebe
