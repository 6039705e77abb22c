#pragma once
// Reader of VTK's legacy files (.vtk), text and binary, of the versions 1 to 5.1.

#include "geometry/mesh.h"
#include "geometry/vec3.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace gewebe::formats::vtk {

/// Cells as ranges of point numbers.
struct LegacyCells {
  std::vector<std::uint64_t> ends; ///< of each cell in `nodes`, ascending
  std::vector<std::int64_t> nodes; ///< not checked against the number of points

  std::size_t size() const { return ends.size(); }
  std::span<const std::int64_t> operator[](std::size_t c) const {
    const std::uint64_t begin = c == 0 ? 0 : ends[c - 1];
    return std::span(nodes).subspan(begin, ends[c] - begin);
  }
};

/// What a file holds of a PolyData or an unstructured grid.
struct Legacy {
  bool grid = false; ///< an unstructured grid, else PolyData
  std::vector<Vec3> points;
  LegacyCells cells;                  ///< of a grid all; of PolyData the polygons
  LegacyCells strips;                 ///< of PolyData
  std::vector<std::int64_t> types;    ///< of a grid, as many as cells
  std::uint64_t points_and_lines = 0; ///< cells of PolyData, which come before polygons
  std::vector<std::int64_t> material; ///< integers of that name of all cells; empty: none
  std::vector<std::int64_t> part;     ///< likewise
};

/// All arrays are walked; those that are not listed above are passed over.
/// \throw Error with place (`name:LINE` or `name: byte N`): another dataset, by name; anything
/// missing, surplus or not finite; counts that the file cannot hold
Legacy read_legacy(std::string_view bytes, const std::string& name);

/// Whether the first bytes are those of an unstructured grid in a legacy file.
bool is_legacy_grid(std::string_view first_bytes);

} // namespace gewebe::formats::vtk

namespace gewebe::formats {

struct VtpStats;

/// The triangles of a PolyData file, as read_vtp() has them. \throw Error as read_legacy, also for
/// an unstructured grid
TriangleMesh read_vtk_surface(std::string_view bytes, const std::string& name, VtpStats* stats);

} // namespace gewebe::formats
