#include "formats/mesh/ply_header.h"
#include "formats/mesh/ply_source.h"
#include "formats/tetrahedra/tet_file_internal.h"
#include "tetrahedra/boundary.h"

#include <algorithm>
#include <optional>
// Based on: Turk, The PLY polygon file format, 1994.

namespace gewebe::formats::tet {
namespace {

using namespace ply;

bool is_nodes(const Property& p) {
  return p.count_type && (p.name == "vertex_indices" || p.name == "vertex_index");
}

bool is_material(const Property& p) {
  return !p.count_type && p.name == "material";
}

template <class Source>
class TetPlyReader {
public:
  TetPlyReader(Source source, const Header& header, const std::string& name, TetReadStats& stats)
      : source_(std::move(source)), header_(header), name_(name), stats_(stats) {}

  tetrahedra::TetMesh read() {
    bool has_tetrahedra = false;
    for (const Element& element : header_.elements) {
      check_room(element);
      if (element.name == "vertex") {
        read_vertices(element);
      } else if (element.name == "tetrahedron") {
        read_tetrahedra(element);
      } else {
        stats_.skipped_elements += element.name == "face" ? 0 : 1;
        skip_element(source_, element);
      }
      has_tetrahedra = has_tetrahedra || element.name == "tetrahedron";
    }
    source_.finish();
    if (!has_tetrahedra)
      throw Error(name_, "a PLY file without the element tetrahedron, expected that");
    return std::move(result_.mesh);
  }

private:
  /// Nothing is reserved for a count that the bytes left can't hold.
  void check_room(const Element& element) const {
    std::size_t least = 0;
    for (const Property& p : element.properties) {
      least += Source::min_size(p.count_type.value_or(p.type));
      if (element.name == "tetrahedron" && is_nodes(p))
        least += 4 * Source::min_size(p.type);
    }
    if (least > 0 && (element.count > source_.left() / least || element.count >= UINT32_MAX))
      source_.fail(std::to_string(element.count) + " elements " + ply::quoted(element.name) +
                   " in " + std::to_string(source_.left()) + " bytes, expected a count that fits");
  }

  [[noreturn]] void header_fail(const Element& element, const std::string& what) const {
    throw Error(name_ + ":" + std::to_string(element.line), what);
  }

  std::uint64_t whole(Type type, std::uint64_t below, const char* what) {
    const double value = source_.value(type);
    if (!(value >= 0 && value < static_cast<double>(below) && value == std::floor(value)))
      source_.fail(std::string(what) + " is no integer from 0 to below " + std::to_string(below));
    return static_cast<std::uint64_t>(value);
  }

  void read_vertices(const Element& element) {
    for (const auto& [use, axis] :
         {std::pair(Use::x, "x"), std::pair(Use::y, "y"), std::pair(Use::z, "z")})
      if (std::ranges::find(element.properties, use, &Property::use) == element.properties.end())
        header_fail(element, std::string("vertices without ") + axis + ", expected x, y and z");
    stats_.skipped_properties += element.properties.size() - 3;
    std::vector<Vec3>& points = result_.mesh.points;
    points.reserve(element.count);
    for (std::uint64_t i = 0; i < element.count; ++i) {
      Vec3 point;
      source_.begin_record(element);
      for (const Property& property : element.properties) {
        if (property.use != Use::x && property.use != Use::y && property.use != Use::z) {
          skip_property(source_, property);
          continue;
        }
        const double value = source_.value(property.type);
        if (!std::isfinite(value))
          source_.fail(property.name + " is not finite, expected a finite number");
        point[property.use == Use::x ? 0 : property.use == Use::y ? 1 : 2] = value;
      }
      source_.end_record();
      points.push_back(point);
    }
  }

  void read_tetrahedra(const Element& element) {
    if (std::ranges::count_if(element.properties, is_nodes) != 1)
      header_fail(element, "tetrahedra without vertices, expected the list vertex_indices");
    std::uint64_t points = 0; // as the header states it
    for (const Element& other : header_.elements)
      if (other.name == "vertex")
        points = other.count;
    const bool has_material = std::ranges::any_of(element.properties, is_material);
    stats_.skipped_properties += element.properties.size() - (has_material ? 2 : 1);
    std::array<std::uint32_t, 10> nodes{};
    const auto fail = [&](const std::string& what) { source_.fail(what); };
    for (std::uint64_t i = 0; i < element.count; ++i) {
      std::size_t size = 0;
      std::int64_t material = 0;
      source_.begin_record(element);
      for (const Property& property : element.properties) {
        if (is_nodes(property)) {
          size = list_size(source_, property);
          if (size != 4 && size != 10)
            source_.fail("a tetrahedron of " + std::to_string(size) +
                         " vertices, expected 4 or 10");
          for (std::size_t k = 0; k < size; ++k)
            nodes[k] = static_cast<std::uint32_t>(whole(property.type, points, "a vertex"));
        } else if (is_material(property)) {
          material = static_cast<std::int64_t>(
              whole(property.type, std::uint64_t{INT32_MAX} + 1, "material"));
        } else {
          skip_property(source_, property);
        }
      }
      source_.end_record();
      result_.add(std::span(nodes).first(size), material, fail);
    }
    if (!has_material)
      result_.mesh.material = {};
  }

  Source source_;
  const Header& header_;
  const std::string& name_;
  TetReadStats& stats_;
  Tetrahedra result_;
};

} // namespace

tetrahedra::TetMesh read_ply(std::string_view bytes, const std::string& name, TetReadStats& stats) {
  const Header header = read_header(bytes, name);
  if (header.encoding == Encoding::ascii)
    return TetPlyReader(AsciiSource(bytes, name, header.bytes, header.lines), header, name, stats)
        .read();
  const bool swap = header.encoding == Encoding::big;
  return TetPlyReader(BinarySource(bytes, name, header.bytes, swap), header, name, stats).read();
}

void write_ply(const tetrahedra::TetMesh& mesh, const Sink& sink) {
  if (mesh.points.size() > INT32_MAX)
    throw Error(std::to_string(mesh.points.size()) + " points, expected at most " +
                std::to_string(INT32_MAX) + " in a PLY file");
  const tetrahedra::TetBoundary surface = tetrahedra::boundary(mesh);
  Pieces out(sink);
  out << "ply\nformat binary_little_endian 1.0\ncomment gewebe_tetmesh, millimetres\n"
         "element vertex "
      << mesh.points.size() << "\nproperty double x\nproperty double y\nproperty double z\n"
      << "element face " << surface.mesh.triangles.size()
      << "\nproperty list uchar int vertex_indices\nelement tetrahedron " << mesh.tetrahedra.size()
      << "\nproperty list uchar int vertex_indices\n"
      << (mesh.material.empty() ? "" : "property int material\n") << "end_header\n";
  for (const Vec3& p : mesh.points)
    out.put(p);
  for (const Triangle& t : surface.mesh.triangles) {
    out.put(std::uint8_t{3});
    for (const std::uint32_t corner : t)
      out.put(surface.node[corner]);
  }
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
    const TetNodes nodes(mesh, t);
    out.put(static_cast<std::uint8_t>(nodes.size()));
    for (const std::uint32_t node : nodes.in_order())
      out.put(node);
    if (!mesh.material.empty())
      out.put(mesh.material[t]);
  }
  out.flush();
}

} // namespace gewebe::formats::tet
