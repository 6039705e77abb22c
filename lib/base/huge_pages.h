#pragma once
// Large results without the price of their first touch: vectors that lie in huge pages where the
// system has them, or whose pages are asked for in pieces, on several threads at once. See
// zero_pages.h.

#include "base/context.h"
#include "base/parallel.h"

#include <array>
#include <cstddef>
#include <functional>
#include <vector>

namespace gewebe {

/// Asks for huge pages in the part of `bytes` from `data` on that they can hold. Does no harm where
/// there are none.
void prefer_huge_pages(void* data, std::size_t bytes) noexcept;

/// What makes an empty vector `count` long, to be called later.
template <class T>
std::function<void()> resizing(std::vector<T>& vector, std::size_t count) {
  return [&vector, count] {
    vector.reserve(count);
    prefer_huge_pages(vector.data(), count * sizeof(T));
    vector.resize(count);
  };
}

/// Calls all at once, since each touches fresh memory.
template <class... Resizings>
void resize_all(const Context& context, const Resizings&... resizings) {
  const std::array<std::function<void()>, sizeof...(resizings)> all{resizings...};
  parallel_blocks(context, all.size(), 1, [&](std::size_t begin, std::size_t) { all.at(begin)(); });
}

/// Asks for all pages of a range that is to be written soon: in one call a piece, on all threads,
/// in place of a fault for each page on the thread that writes. Does no harm where the system knows
/// no such call.
void touch_pages(const Context& context, void* data, std::size_t bytes);

/// Room for `count`, of whose pages none has to be asked for later. For what is written once at
/// once, where huge pages would cost more: to find one may take the system longer than it spares.
template <class T>
void reserve_touched(const Context& context, std::vector<T>& vector, std::size_t count) {
  vector.reserve(count);
  touch_pages(context, vector.data(), count * sizeof(T));
}

} // namespace gewebe
