#include "base/error.h"
#include "formats/mesh/ply.h"

#include <bit>
// Based on: Turk, The PLY polygon file format, 1994.

namespace gewebe::formats {
namespace {

static_assert(std::endian::native == std::endian::little, "the codec copies little-endian memory");

class PieceWriter {
public:
  explicit PieceWriter(const std::function<void(std::string_view)>& sink) : sink_(sink) {}

  void text(std::string_view bytes) { buffer_.append(bytes); }
  template <class T>
  void put(const T& value) {
    buffer_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  void end_record() {
    if (buffer_.size() >= piece)
      flush();
  }
  void flush() {
    sink_(buffer_);
    buffer_.clear();
  }

private:
  static constexpr std::size_t piece = 1 << 18;
  const std::function<void(std::string_view)>& sink_;
  std::string buffer_;
};

std::string header_of(const TriangleMesh& mesh) {
  std::string text = "ply\nformat binary_little_endian 1.0\ncomment gewebe_mesh, millimetres\n";
  text += "element vertex " + std::to_string(mesh.points.size()) + "\n";
  text += "property double x\nproperty double y\nproperty double z\n";
  if (!mesh.normals.empty())
    text += "property float nx\nproperty float ny\nproperty float nz\n";
  text += "element face " + std::to_string(mesh.triangles.size()) + "\n";
  text += "property list uchar int vertex_indices\n";
  if (!mesh.texcoords.empty())
    text += "property list uchar float texcoord\n";
  if (!mesh.part.empty())
    text += "property int part\n";
  if (!mesh.material.empty())
    text += "property int material\n";
  return text + "end_header\n";
}

} // namespace

void write_ply(const TriangleMesh& mesh, const std::function<void(std::string_view)>& sink) {
  if (mesh.points.size() > INT32_MAX)
    throw Error(std::to_string(mesh.points.size()) + " points, expected at most " +
                std::to_string(INT32_MAX) + " in a PLY file");
  PieceWriter out(sink);
  out.text(header_of(mesh));
  for (std::size_t p = 0; p < mesh.points.size(); ++p) {
    out.put(mesh.points[p]);
    if (!mesh.normals.empty())
      out.put(mesh.normals[p]);
    out.end_record();
  }
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    out.put(std::uint8_t{3});
    out.put(mesh.triangles[t]);
    if (!mesh.texcoords.empty()) {
      out.put(std::uint8_t{6});
      out.put(mesh.texcoords[t]);
    }
    if (!mesh.part.empty())
      out.put(mesh.part[t]);
    if (!mesh.material.empty())
      out.put(mesh.material[t]);
    out.end_record();
  }
  out.flush();
}

std::string write_ply(const TriangleMesh& mesh) {
  std::string bytes;
  write_ply(mesh, [&](std::string_view piece) { bytes += piece; });
  return bytes;
}

} // namespace gewebe::formats
