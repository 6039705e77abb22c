#include "base/zero_pages.h"

#include <cstdint>
#include <new>
#include <sys/mman.h>

namespace gewebe {
namespace {

constexpr std::size_t page = 4096, huge_page = std::size_t{2} << 20;

std::size_t up_to(std::size_t bytes, std::size_t unit) {
  return (bytes + unit - 1) / unit * unit;
}

} // namespace

ZeroPages::ZeroPages(std::size_t bytes) : bytes_(up_to(bytes, page)) {
  if (bytes == 0)
    return;
  if (bytes > SIZE_MAX / 2)
    throw std::bad_alloc();
  // A huge page must begin at a multiple of its size: map more memory, then unmap the ends.
  const std::size_t slack = bytes_ >= huge_page ? huge_page : 0;
  void* const raw = ::mmap(nullptr, bytes_ + slack, PROT_READ | PROT_WRITE,
                           MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (raw == MAP_FAILED) // NOLINT(*-int-to-ptr)
    throw std::bad_alloc();
  auto* const begin = static_cast<std::byte*>(raw);
  const std::size_t address = reinterpret_cast<std::uintptr_t>(begin);
  const std::size_t head = slack == 0 ? 0 : up_to(address, huge_page) - address;
  if (head != 0)
    (void)::munmap(begin, head);
  if (slack != head)
    (void)::munmap(begin + head + bytes_, slack - head);
  data_ = begin + head;
  if (slack != 0)
    (void)::madvise(data_, bytes_, MADV_HUGEPAGE); // without them it works too
}

void ZeroPages::grow(std::size_t bytes) {
  if (bytes <= bytes_)
    return;
  ZeroPages larger(bytes);
  if (bytes_ > 0) {
    // Onto the begin of the new block, which keeps to the huge pages' multiples if this one does.
    if (::mremap(data_, bytes_, bytes_, MREMAP_MAYMOVE | MREMAP_FIXED, larger.data_) ==
        MAP_FAILED) // NOLINT(*-int-to-ptr)
      throw std::bad_alloc();
    data_ = nullptr;
    bytes_ = 0;
  }
  *this = std::move(larger);
}

ZeroPages::~ZeroPages() {
  if (data_ != nullptr)
    (void)::munmap(data_, bytes_);
}

} // namespace gewebe
