#pragma once
// Fast allocation of large vectors: in huge pages if the system has them, or with pages touched in
// advance, in pieces, on several threads. zero_pages.h explains the cost of the first touch.

#include "base/context.h"
#include "base/parallel.h"

#include <array>
#include <cstddef>
#include <functional>
#include <vector>

namespace gewebe {

/// Requests huge pages for the part of the range that whole huge pages cover. Without effect if the
/// system has none.
void prefer_huge_pages(void* data, std::size_t bytes) noexcept;

/// Function that resizes an empty vector to `count`, to be called later.
template <class T>
std::function<void()> resizing(std::vector<T>& vector, std::size_t count) {
  return [&vector, count] {
    vector.reserve(count);
    prefer_huge_pages(vector.data(), count * sizeof(T));
    vector.resize(count);
  };
}

/// Calls all resizings in parallel, because each touches fresh memory.
template <class... Resizings>
void resize_all(const Context& context, const Resizings&... resizings) {
  const std::array<std::function<void()>, sizeof...(resizings)> all{resizings...};
  parallel_blocks(context, all.size(), 1, [&](std::size_t begin, std::size_t) { all.at(begin)(); });
}

/// Touches all pages of a range that is to be written soon: by one system call per piece, on all
/// threads, instead of a fault for each page on the thread that writes. Without effect if the
/// system has no such call.
void touch_pages(const Context& context, void* data, std::size_t bytes);

/// Reserves memory for `count` elements, with all pages touched. For data that is written once and
/// at once: huge pages can cost more then, because the system may take longer to find one than it
/// saves.
template <class T>
void reserve_touched(const Context& context, std::vector<T>& vector, std::size_t count) {
  vector.reserve(count);
  touch_pages(context, vector.data(), count * sizeof(T));
}

} // namespace gewebe
