#pragma once
// Large blocks of zero bytes from the system, in huge pages if it has them.
//
// The first touch of fresh memory costs a page fault. For blocks that are written once (the leaves
// of a volume) these faults take 2 to 11 times as long as the arithmetic, with pages of 4 KiB. With
// pages of 2 MiB there are 512 times fewer faults, and one call frees the whole block.

#include <cstddef>
#include <span>
#include <utility>

namespace gewebe {

class ZeroPages {
public:
  ZeroPages() = default;
  /// `bytes` of zeros, aligned to at least 64 bytes. \throw std::bad_alloc
  explicit ZeroPages(std::size_t bytes);
  ~ZeroPages();
  ZeroPages(ZeroPages&& other) noexcept
      : data_(std::exchange(other.data_, nullptr)), bytes_(std::exchange(other.bytes_, 0)) {}
  ZeroPages& operator=(ZeroPages&& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(bytes_, other.bytes_);
    return *this;
  }
  ZeroPages(const ZeroPages&) = delete;
  ZeroPages& operator=(const ZeroPages&) = delete;

  /// Grows the block to at least `bytes`; the content stays. Pages are remapped, no byte is copied.
  /// \throw std::bad_alloc, with nothing changed
  void grow(std::size_t bytes);

  std::byte* data() const { return data_; }
  std::size_t size() const { return bytes_; }
  bool holds(const void* p) const {
    const auto* const byte = static_cast<const std::byte*>(p);
    return byte >= data_ && byte < data_ + bytes_;
  }

private:
  std::byte* data_ = nullptr;
  std::size_t bytes_ = 0;
};

} // namespace gewebe
