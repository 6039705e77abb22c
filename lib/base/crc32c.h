#pragma once
// CRC-32C (Castagnoli; reversed polynomial 0x82F63B78), which finds damage in stored blocks.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe {

/// Of `size` bytes; `before` is that of the bytes in front of them, 0 for none.
std::uint32_t crc32c(const void* data, std::size_t size, std::uint32_t before = 0);

/// Of the elements' bytes (no padding inside T, little-endian machine).
template <class T>
std::uint32_t crc32c(std::span<const T> values) {
  return crc32c(values.data(), values.size_bytes());
}
template <class T>
std::uint32_t crc32c(const std::vector<T>& values) {
  return crc32c(values.data(), values.size() * sizeof(T));
}

} // namespace gewebe
