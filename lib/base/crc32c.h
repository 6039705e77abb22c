#pragma once
// CRC-32C (Castagnoli; reversed polynomial 0x82F63B78), to find damage in stored blocks.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe {

/// Checksum of `size` bytes. \param before  checksum of the preceding bytes; 0: none
std::uint32_t crc32c(const void* data, std::size_t size, std::uint32_t before = 0);

/// Checksum of the elements' bytes (no padding inside T, little-endian machine).
template <class T>
std::uint32_t crc32c(std::span<const T> values) {
  return crc32c(values.data(), values.size_bytes());
}
template <class T>
std::uint32_t crc32c(const std::vector<T>& values) {
  return crc32c(values.data(), values.size() * sizeof(T));
}

} // namespace gewebe
