#include "base/crc32c.h"

#include <array>
#include <cstring>

// Based on: Castagnoli, Bräuer, Herrmann, Optimization of Cyclic Redundancy-Check Codes with 24 and
// 32 Parity Bits, 1993. Eight tables at a time: Kounavis, Berry, A Systematic Approach to Building
// High Performance Software-based CRC Generators, 2005.

namespace gewebe {

namespace {

constexpr std::uint32_t polynomial = 0x82F63B78;
constexpr std::size_t word = 8; // bytes at a time

using Tables = std::array<std::array<std::uint32_t, 256>, word>;

constexpr Tables make_tables() {
  Tables tables{};
  for (std::uint32_t byte = 0; byte < 256; ++byte) {
    std::uint32_t crc = byte;
    for (int bit = 0; bit < 8; ++bit)
      crc = crc >> 1 ^ ((crc & 1) != 0 ? polynomial : 0);
    tables[0][byte] = crc;
  }
  // Table t has the effect of a byte after t further bytes.
  for (std::size_t t = 1; t < word; ++t)
    for (std::size_t byte = 0; byte < 256; ++byte)
      tables[t][byte] = tables[t - 1][byte] >> 8 ^ tables[0][tables[t - 1][byte] & 0xff];
  return tables;
}

constexpr Tables tables = make_tables();

std::uint32_t step(std::uint32_t crc, unsigned char byte) {
  return crc >> 8 ^ tables[0][(crc ^ byte) & 0xff];
}

std::uint32_t by_tables(std::uint32_t crc, const unsigned char* at, std::size_t size) {
  for (; size >= word; at += word, size -= word) {
    std::uint64_t bytes = 0;
    std::memcpy(&bytes, at, word);
    bytes ^= crc;
    crc = 0;
    for (std::size_t b = 0; b < word; ++b)
      crc ^= tables[word - 1 - b][bytes >> (8 * b) & 0xff];
  }
  for (; size > 0; ++at, --size)
    crc = step(crc, *at);
  return crc;
}

#if defined(__x86_64__)
/// The same by the instruction that there is for it.
__attribute__((target("sse4.2"))) std::uint32_t
by_instruction(std::uint32_t crc, const unsigned char* at, std::size_t size) {
  std::uint64_t wide = crc;
  for (; size >= word; at += word, size -= word) {
    std::uint64_t bytes = 0;
    std::memcpy(&bytes, at, word);
    wide = __builtin_ia32_crc32di(wide, bytes);
  }
  crc = static_cast<std::uint32_t>(wide);
  for (; size > 0; ++at, --size)
    crc = __builtin_ia32_crc32qi(crc, *at);
  return crc;
}
#endif

} // namespace

std::uint32_t crc32c(const void* data, std::size_t size, std::uint32_t before) {
  const auto* const at = static_cast<const unsigned char*>(data);
#if defined(__x86_64__)
  if (__builtin_cpu_supports("sse4.2") != 0)
    return ~by_instruction(~before, at, size);
#endif
  return ~by_tables(~before, at, size);
}

} // namespace gewebe
