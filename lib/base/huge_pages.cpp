#include "base/huge_pages.h"

#include <cstddef>
#include <cstdint>
#include <sys/mman.h>

namespace gewebe {

void prefer_huge_pages(void* data, std::size_t bytes) noexcept {
  constexpr std::size_t huge_page = std::size_t{2} << 20;
  const auto begin = reinterpret_cast<std::uintptr_t>(data);
  const std::size_t head = (huge_page - begin % huge_page) % huge_page;
  if (bytes < head + huge_page)
    return;
  (void)::madvise(static_cast<std::byte*>(data) + head, (bytes - head) / huge_page * huge_page,
                  MADV_HUGEPAGE);
}

void touch_pages(const Context& context, void* data, std::size_t bytes) {
#ifdef MADV_POPULATE_WRITE
  constexpr std::size_t page = 4096, piece = std::size_t{4} << 20;
  const auto begin = reinterpret_cast<std::uintptr_t>(data);
  const std::size_t head = (page - begin % page) % page;
  if (bytes < head + piece)
    return;
  auto* const first = static_cast<std::byte*>(data) + head;
  Context quiet = context;
  quiet.progress = nullptr;
  parallel_blocks(quiet, (bytes - head) / page * page, piece,
                  [&](std::size_t from, std::size_t to) {
                    (void)::madvise(first + from, to - from, MADV_POPULATE_WRITE);
                  });
#endif
}

} // namespace gewebe
