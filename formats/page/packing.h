#pragma once
// Numbers as text of a page: quantised, as differences, compressed, in base64.

#include "geometry/mesh.h"
#include "geometry/vec3.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace gewebe::formats {

/// A grid of 16 bits over a box: place = origin + step (i, j, k).
struct PlaceGrid {
  Vec3 origin;
  double step = 1; ///< mm, > 0
};
/// The finest cubic grid of 16 bits over a box; of step 1 over a point or nothing.
PlaceGrid place_grid(const Box3& box);
/// Grid numbers x y z of each point. \pre the points lie in the box of the grid
std::vector<std::uint16_t> quantised(std::span<const Vec3> points, const PlaceGrid& grid);
/// 0 … 65534 from `least` to `greatest`, clamped. \pre least <= greatest, values are finite
std::vector<std::uint16_t> quantised(std::span<const double> values, double least, double greatest);
/// What stands for no value.
inline constexpr std::uint16_t no_value = 65535;

/// Base64 (RFC 4648) of rows of numbers that change little from row to row. A row has `axes`
/// interleaved numbers for each of its points. Each number is replaced by its difference, modulo
/// 2^16, from the row before (from 0 in the first), less that of the point before on the same axis;
/// the differences stand axis by axis, in zigzag code, low bytes of all first, as a zlib stream.
/// \pre rows of equal length, a multiple of `axes`
std::string packed_rows(std::span<const std::vector<std::uint16_t>> rows, std::size_t axes);
/// The same of corners of triangles: 32-bit differences from the corner before, in four planes.
std::string packed_corners(std::span<const Triangle> triangles);

std::string base64(std::string_view bytes);

} // namespace gewebe::formats
