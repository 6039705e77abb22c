#include "base/huge_pages.h"

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

} // namespace gewebe
