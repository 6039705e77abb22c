#include "base/error.h"
#include "formats/mesh/vtk_legacy.h"
#include "formats/mesh/vtk_xml.h"
#include "formats/mesh/vtp.h"
#include "mesh/triangulate.h"

#include <utility>

namespace gewebe::formats {
namespace {

class SurfaceReader {
public:
  SurfaceReader(vtk::Legacy legacy, const std::string& name)
      : legacy_(std::move(legacy)), name_(name) {
    mesh_.points = std::move(legacy_.points);
  }

  TriangleMesh read(VtpStats& stats) {
    stats.skipped_primitives = legacy_.points_and_lines;
    for (std::size_t c = 0; c < legacy_.cells.size(); ++c)
      stats.polygons += add_polygon(c) ? 1 : 0;
    for (std::size_t c = 0; c < legacy_.strips.size(); ++c)
      add_strip(c);
    return std::move(mesh_);
  }

private:
  void take_corners(const char* what, std::size_t cell, std::span<const std::int64_t> nodes) {
    vtk::take_corners(name_, what + std::to_string(cell), nodes, mesh_.points.size(), corners_);
  }

  void add(const Triangle& triangle, std::size_t cell) {
    mesh_.triangles.push_back(triangle);
    add_number(legacy_.part, cell, mesh_.part);
    add_number(legacy_.material, cell, mesh_.material);
  }

  void add_number(const std::vector<std::int64_t>& of_cells, std::size_t cell,
                  std::vector<std::int32_t>& to) const {
    if (of_cells.empty())
      return;
    const std::int64_t value = of_cells[legacy_.points_and_lines + cell];
    if (value < 0 || value > INT32_MAX)
      throw Error(name_, "part or material " + std::to_string(value) + ", expected 0 to " +
                             std::to_string(INT32_MAX));
    to.push_back(static_cast<std::int32_t>(value));
  }

  /// Whether it has more than three corners.
  bool add_polygon(std::size_t cell) {
    take_corners("polygon ", cell, legacy_.cells[cell]);
    std::vector<Triangle> cut{{0, 1, 2}};
    if (corners_.size() > 3) {
      cut.clear();
      std::vector<Vec3> polygon;
      for (const std::uint32_t corner : corners_)
        polygon.push_back(mesh_.points[corner]);
      gewebe::at(name_, [&] { mesh::triangulate_polygon(polygon, cut); });
    }
    for (const Triangle& t : cut)
      add({corners_[t[0]], corners_[t[1]], corners_[t[2]]}, cell);
    return corners_.size() > 3;
  }

  /// Every second triangle is turned, so that all of a strip show the same side.
  void add_strip(std::size_t strip) {
    take_corners("strip ", strip, legacy_.strips[strip]);
    for (std::size_t k = 0; k + 2 < corners_.size(); ++k)
      add({corners_[k], corners_[k + 1 + k % 2], corners_[k + 2 - k % 2]},
          legacy_.cells.size() + strip);
  }

  vtk::Legacy legacy_;
  const std::string& name_;
  TriangleMesh mesh_;
  std::vector<std::uint32_t> corners_; ///< of the cell at hand
};

} // namespace

TriangleMesh read_vtk_surface(std::string_view bytes, const std::string& name, VtpStats* stats) {
  vtk::Legacy legacy = vtk::read_legacy(bytes, name);
  if (legacy.grid)
    throw Error(name, "an unstructured grid, expected PolyData: a surface");
  VtpStats counts;
  TriangleMesh mesh = SurfaceReader(std::move(legacy), name).read(counts);
  if (stats != nullptr)
    *stats = counts;
  return mesh;
}

} // namespace gewebe::formats
