#include "base/error.h"
#include "formats/mesh/ply.h"
#include "formats/mesh/ply_source.h"
#include "mesh/triangulate.h"
#include "text/number_text.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <utility>
// Based on: Turk, The PLY polygon file format, 1994.

namespace gewebe::formats {
namespace {

using namespace ply;

// The faces before they become triangles.
struct Faces {
  std::vector<std::uint32_t> sizes;   // corners of each face; empty while all have three
  std::vector<std::uint32_t> corners; // all faces one after the other
  std::vector<float> texcoords;       // two per corner, or none
  std::vector<std::int32_t> part, material;
  std::size_t count = 0;
};

bool has(const Element& element, Use use) {
  return std::any_of(element.properties.begin(), element.properties.end(),
                     [&](const Property& p) { return p.use == use; });
}

template <class Source>
class BodyReader {
public:
  BodyReader(Source source, const Header& header, const std::string& name)
      : source_(std::move(source)), header_(header), name_(name) {}

  TriangleMesh read(PlyStats& stats) {
    for (const Element& element : header_.elements) {
      check_room(element);
      if (element.name == "vertex") {
        read_vertices(element);
      } else if (element.name == "face") {
        read_faces(element);
      } else {
        ++stats.skipped_elements;
        skip_element(source_, element);
      }
      if (element.name == "vertex" || element.name == "face")
        stats.skipped_properties += static_cast<std::uint64_t>(
            std::count_if(element.properties.begin(), element.properties.end(),
                          [](const Property& p) { return p.use == Use::skip; }));
    }
    source_.finish();
    make_triangles(stats);
    return std::move(mesh_);
  }

private:
  // Nothing is reserved for a count that the bytes left can't hold.
  void check_room(const Element& element) const {
    std::size_t min = 0;
    for (const Property& p : element.properties) {
      min += Source::min_size(p.count_type.value_or(p.type));
      if (p.use == Use::indices)
        min += 3 * Source::min_size(p.type);
    }
    if (min > 0 && element.count > source_.left() / min)
      source_.fail(std::to_string(element.count) + " elements " + quoted(element.name) + " in " +
                   std::to_string(source_.left()) + " bytes, expected at least " +
                   std::to_string(min) + " bytes for each");
    if (min > 0 && element.count >= UINT32_MAX)
      source_.fail(std::to_string(element.count) + " elements, expected fewer than " +
                   std::to_string(UINT32_MAX));
  }

  double finite(const Property& property) {
    const double value = source_.value(property.type);
    if (!std::isfinite(value))
      source_.fail(property.name + " is not finite, expected a finite number");
    return value;
  }

  float finite_float(double value, const Property& property) const {
    if (!(std::fabs(value) <= static_cast<double>(std::numeric_limits<float>::max())))
      source_.fail(property.name + " is not finite, expected a finite number");
    return static_cast<float>(value);
  }

  std::int32_t whole(const Property& property) {
    const double value = source_.value(property.type);
    if (!(value >= 0 && value <= INT32_MAX && value == std::floor(value)))
      source_.fail(property.name + " is " + gewebe::text::number_text(value) +
                   ", expected an integer from 0");
    return static_cast<std::int32_t>(value);
  }

  void read_vertices(const Element& element) {
    const bool normals = has(element, Use::nx) && has(element, Use::ny) && has(element, Use::nz);
    for (const auto& [use, axis] :
         {std::pair(Use::x, "x"), std::pair(Use::y, "y"), std::pair(Use::z, "z")})
      if (!has(element, use))
        header_fail(element, std::string("vertices without ") + axis + ", expected x, y and z");
    mesh_.points.reserve(element.count);
    if (normals)
      mesh_.normals.reserve(element.count);
    for (std::uint64_t i = 0; i < element.count; ++i) {
      Vec3 point, normal;
      source_.begin_record(element);
      for (const Property& property : element.properties) {
        switch (property.use) {
        case Use::x:
          point.x = finite(property);
          break;
        case Use::y:
          point.y = finite(property);
          break;
        case Use::z:
          point.z = finite(property);
          break;
        case Use::nx:
          normal.x = finite(property);
          break;
        case Use::ny:
          normal.y = finite(property);
          break;
        case Use::nz:
          normal.z = finite(property);
          break;
        default:
          skip_property(source_, property);
        }
      }
      source_.end_record();
      mesh_.points.push_back(point);
      if (normals)
        mesh_.normals.push_back(unit(normal));
    }
  }

  static std::array<float, 3> unit(Vec3 n) {
    const double length = norm(n);
    if (length > 0 && std::isfinite(length) && !(std::fabs(length - 1) <= 1e-5))
      n = n / length;
    if (!std::isfinite(length))
      n = {};
    return {static_cast<float>(n.x), static_cast<float>(n.y), static_cast<float>(n.z)};
  }

  void read_faces(const Element& element) {
    if (!has(element, Use::indices))
      header_fail(element, "faces without vertex_indices, expected that list");
    const bool with_texcoords = has(element, Use::texcoord);
    faces_.corners.reserve(3 * element.count);
    if (with_texcoords)
      faces_.texcoords.reserve(6 * element.count);
    if (has(element, Use::part))
      faces_.part.reserve(element.count);
    if (has(element, Use::material))
      faces_.material.reserve(element.count);
    for (std::uint64_t i = 0; i < element.count; ++i) {
      std::size_t corners = 0, texcoords = 0;
      source_.begin_record(element);
      for (const Property& property : element.properties) {
        switch (property.use) {
        case Use::indices:
          corners = read_indices(property);
          break;
        case Use::texcoord:
          texcoords = read_texcoords(property);
          break;
        case Use::part:
          faces_.part.push_back(whole(property));
          break;
        case Use::material:
          faces_.material.push_back(whole(property));
          break;
        default:
          skip_property(source_, property);
        }
      }
      source_.end_record();
      if (with_texcoords && texcoords != 2 * corners)
        source_.fail("a face with " + std::to_string(corners) + " corners and " +
                     std::to_string(texcoords) + " texture coordinates, expected two a corner");
      add_size(corners);
    }
  }

  void add_size(std::size_t corners) {
    if (corners != 3 && faces_.sizes.empty())
      faces_.sizes.assign(faces_.count, 3);
    ++faces_.count;
    if (corners != 3 || !faces_.sizes.empty())
      faces_.sizes.push_back(static_cast<std::uint32_t>(corners));
  }

  std::size_t read_indices(const Property& property) {
    const std::size_t size = list_size(source_, property);
    if (size < 3)
      source_.fail("a face with " + std::to_string(size) + " corners, expected at least 3");
    for (std::size_t k = 0; k < size; ++k) {
      const double index = source_.value(property.type);
      if (!(index >= 0 && index < vertex_count() && index == std::floor(index)))
        source_.fail("a face with corner " + gewebe::text::number_text(index) +
                     ", expected an index below " + gewebe::text::number_text(vertex_count()));
      faces_.corners.push_back(static_cast<std::uint32_t>(index));
    }
    return size;
  }

  std::size_t read_texcoords(const Property& property) {
    const std::size_t size = list_size(source_, property);
    for (std::size_t k = 0; k < size; ++k)
      faces_.texcoords.push_back(finite_float(source_.value(property.type), property));
    return size;
  }

  // As the header states it, for the faces may come first.
  double vertex_count() {
    if (!vertex_count_) {
      vertex_count_ = 0;
      for (const Element& element : header_.elements)
        if (element.name == "vertex")
          vertex_count_ = static_cast<double>(element.count);
    }
    return *vertex_count_;
  }

  [[noreturn]] void header_fail(const Element& element, const std::string& what) const {
    throw Error(name_ + ":" + std::to_string(element.line), what);
  }

  void make_triangles(PlyStats& stats) {
    std::size_t triangles = 0;
    for (const std::uint32_t size : faces_.sizes)
      triangles += size - 2;
    if (faces_.sizes.empty())
      triangles = faces_.count;
    mesh_.triangles.reserve(triangles);
    if (!faces_.texcoords.empty())
      mesh_.texcoords.reserve(triangles);
    if (!faces_.sizes.empty() && !faces_.part.empty())
      mesh_.part.reserve(triangles);
    if (!faces_.sizes.empty() && !faces_.material.empty())
      mesh_.material.reserve(triangles);

    std::vector<Vec3> polygon;
    std::vector<Triangle> cut;
    std::size_t first = 0;
    for (std::size_t f = 0; f < faces_.count; ++f) {
      const std::uint32_t size = faces_.sizes.empty() ? 3 : faces_.sizes[f];
      const std::span<const std::uint32_t> corners(faces_.corners.data() + first, size);
      cut.clear();
      if (size == 3) {
        cut.push_back({0, 1, 2});
      } else {
        ++stats.polygons;
        polygon.clear();
        for (const std::uint32_t corner : corners)
          polygon.push_back(mesh_.points[corner]);
        gewebe::at(name_, [&] { mesh::triangulate_polygon(polygon, cut); });
      }
      for (const Triangle& t : cut) {
        mesh_.triangles.push_back({corners[t[0]], corners[t[1]], corners[t[2]]});
        if (!faces_.texcoords.empty()) {
          const float* st = faces_.texcoords.data() + 2 * first;
          const std::size_t a = t[0], b = t[1], c = t[2];
          mesh_.texcoords.push_back(
              {st[2 * a], st[2 * a + 1], st[2 * b], st[2 * b + 1], st[2 * c], st[2 * c + 1]});
        }
        if (!faces_.sizes.empty() && !faces_.part.empty())
          mesh_.part.push_back(faces_.part[f]);
        if (!faces_.sizes.empty() && !faces_.material.empty())
          mesh_.material.push_back(faces_.material[f]);
      }
      first += size;
    }
    if (faces_.sizes.empty()) {
      mesh_.part = std::move(faces_.part);
      mesh_.material = std::move(faces_.material);
    }
  }

  Source source_;
  const Header& header_;
  const std::string& name_;
  TriangleMesh mesh_;
  Faces faces_;
  std::optional<double> vertex_count_;
};

} // namespace

TriangleMesh read_ply(std::string_view bytes, const std::string& name, PlyStats* stats) {
  PlyStats unused;
  PlyStats& counts = stats == nullptr ? unused : *stats;
  const Header header = read_header(bytes, name);
  if (header.encoding == Encoding::ascii)
    return BodyReader(AsciiSource(bytes, name, header.bytes, header.lines), header, name)
        .read(counts);
  const bool swap = header.encoding == Encoding::big;
  return BodyReader(BinarySource(bytes, name, header.bytes, swap), header, name).read(counts);
}

} // namespace gewebe::formats
