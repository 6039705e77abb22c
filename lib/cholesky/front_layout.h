#pragma once
// How the numbers of a front stand in memory.

#include <cstddef>

namespace gewebe::cholesky {

/// Columns that are eliminated together, at most: a block of L.
inline constexpr std::size_t front_block = 128;

/// Where column c of a front's L begins, at the first row of its block: what is above a block isn't
/// there, so that little more is than L's own entries. For the column behind the last one, the
/// result is how many numbers L has. \pre c <= rows
constexpr std::size_t front_offset(std::size_t rows, std::size_t c) {
  const std::size_t first = c / front_block * front_block; // column and row of the block
  return first * rows - first * (first - front_block) / 2 + (c - first) * (rows - first);
}
/// Column c such that [r] is its entry in row r of the front, r >= c.
inline double* front_column(double* l, std::size_t rows, std::size_t c) {
  if (c < front_block)
    return l + c * rows;
  return l + front_offset(rows, c) - c / front_block * front_block;
}

} // namespace gewebe::cholesky
