#include "base/error.h"
#include "formats/mesh/vtk_xml.h"
#include "formats/mesh/vtp.h"
#include "mesh/triangulate.h"

#include <array>
#include <cstddef>
#include <span>
#include <vector>
// Based on: VTK file formats, docs.vtk.org, "XML file formats".

namespace gewebe::formats {
namespace {

class VtpReader {
public:
  VtpReader(std::string_view bytes, const std::string& name, VtpStats& stats)
      : name_(name), stats_(stats),
        piece_(bytes, name, "PolyData", {"Points", "Polys", "Strips", "CellData", "PointData"}) {}

  TriangleMesh read() {
    polygons_ = piece_.count("NumberOfPolys");
    strips_ = piece_.count("NumberOfStrips");
    before_ = piece_.count("NumberOfVerts") + piece_.count("NumberOfLines");
    stats_.skipped_primitives = before_;
    mesh_.points = piece_.points();
    numbers_of_cells("part", part_);
    numbers_of_cells("material", material_);
    read_texture();
    if (polygons_ > 0)
      read_polygons();
    if (strips_ > 0)
      read_strips();
    return std::move(mesh_);
  }

private:
  void numbers_of_cells(const std::string& name, std::vector<std::int64_t>& numbers) const {
    const vtk::Array* const array = piece_.find("CellData/" + name);
    if (array == nullptr || polygons_ + strips_ == 0)
      return;
    const std::string place = piece_.place(*array);
    if (array->components != 1)
      throw Error(place,
                  name + " of " + std::to_string(array->components) + " components, expected 1");
    if (polygons_ > 0 && strips_ > 0)
      throw Error(place, name + " of polygons and of strips, expected one of them");
    numbers = piece_.integers(*array, before_ + polygons_ + strips_);
    for (std::size_t c = 0; c < numbers.size(); ++c)
      if (numbers[c] < 0 || numbers[c] > INT32_MAX)
        throw Error(place, name + " " + std::to_string(numbers[c]) + " of cell " +
                               std::to_string(c) + ", expected 0 to " + std::to_string(INT32_MAX));
  }

  void read_texture() {
    const std::string name = piece_.active("PointData", "TCoords");
    if (name.empty())
      return;
    const vtk::Array& array = piece_.need("PointData/" + name);
    if (array.components != 2 && array.components != 3)
      throw Error(piece_.place(array), "texture coordinates of " +
                                           std::to_string(array.components) +
                                           " components, expected 2 or 3");
    const std::vector<double> numbers = piece_.reals(array, array.components * mesh_.points.size());
    texture_.reserve(mesh_.points.size());
    for (std::size_t p = 0; p < mesh_.points.size(); ++p)
      texture_.push_back({static_cast<float>(numbers[array.components * p]),
                          static_cast<float>(numbers[array.components * p + 1])});
  }

  void corners_of(const char* what, std::size_t cell, std::span<const std::int64_t> nodes) {
    vtk::take_corners(name_, what + std::to_string(cell), nodes, mesh_.points.size(), corners_);
  }

  void add(const Triangle& corners, std::size_t cell) {
    mesh_.triangles.push_back(corners);
    if (!texture_.empty()) {
      const auto &a = texture_[corners[0]], &b = texture_[corners[1]], &c = texture_[corners[2]];
      mesh_.texcoords.push_back({a[0], a[1], b[0], b[1], c[0], c[1]});
    }
    if (!part_.empty())
      mesh_.part.push_back(static_cast<std::int32_t>(part_[before_ + cell]));
    if (!material_.empty())
      mesh_.material.push_back(static_cast<std::int32_t>(material_[before_ + cell]));
  }

  void read_polygons() {
    const vtk::Cells cells = piece_.cells("Polys", polygons_);
    std::vector<Vec3> polygon;
    std::vector<Triangle> cut;
    for (std::size_t c = 0; c < polygons_; ++c) {
      corners_of("polygon ", c, cells[c]);
      cut.clear();
      if (corners_.size() == 3) {
        cut.push_back({0, 1, 2});
      } else {
        ++stats_.polygons;
        polygon.clear();
        for (const std::uint32_t corner : corners_)
          polygon.push_back(mesh_.points[corner]);
        gewebe::at(name_, [&] { mesh::triangulate_polygon(polygon, cut); });
      }
      for (const Triangle& t : cut)
        add({corners_[t[0]], corners_[t[1]], corners_[t[2]]}, c);
    }
  }

  /// Every second triangle is turned, so that all of a strip show the same side.
  void read_strips() {
    const vtk::Cells cells = piece_.cells("Strips", strips_);
    for (std::size_t c = 0; c < strips_; ++c) {
      corners_of("strip ", c, cells[c]);
      for (std::size_t k = 0; k + 2 < corners_.size(); ++k)
        add({corners_[k], corners_[k + 1 + k % 2], corners_[k + 2 - k % 2]}, c);
    }
  }

  const std::string& name_;
  VtpStats& stats_;
  vtk::Piece piece_;
  TriangleMesh mesh_;
  std::uint64_t polygons_ = 0, strips_ = 0;
  std::uint64_t before_ = 0;                  // cells that stand before those
  std::vector<std::int64_t> part_, material_; // of all cells
  std::vector<std::array<float, 2>> texture_; // of points
  std::vector<std::uint32_t> corners_;        // of the cell at hand
};

} // namespace

TriangleMesh read_vtp(std::string_view bytes, const std::string& name, VtpStats* stats) {
  VtpStats counts;
  TriangleMesh mesh = VtpReader(bytes, name, counts).read();
  if (stats != nullptr)
    *stats = counts;
  return mesh;
}

} // namespace gewebe::formats
