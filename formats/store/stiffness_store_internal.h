#pragma once
// Names and numbers of the stiffness store that its reader and its writer share.

#include <cstddef>
#include <cstdint>

namespace gewebe::formats::store {

inline constexpr const char* format = "gewebe stiffness store";
inline constexpr std::int64_t version = 1;
/// The group of an object's second matrix, in its group.
inline constexpr const char* second_stage = "stage2";
/// The group of an object's compressed columns, in its group.
inline constexpr const char* compressed = "compressed";
/// A bound of magnitude stands for the rows of so many nodes.
inline constexpr std::uint64_t bound_nodes = 256;

inline std::uint64_t bound_blocks(std::uint64_t nodes) {
  return nodes / bound_nodes + (nodes % bound_nodes != 0 ? 1 : 0);
}

} // namespace gewebe::formats::store
