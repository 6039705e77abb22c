#include "formats/tetrahedra/tet_file_internal.h"

#include <algorithm>
// Based on: Si, TetGen user's manual 1.5, 5.1 (.node, .ele). The order of the middles of edges is
// that of its output, 23 03 01 12 13 02.

namespace gewebe::formats {
namespace tet {
namespace {

/// Where TetGen's node 4 + k stands among our middles.
constexpr std::array<std::size_t, 6> middle_of{5, 3, 0, 1, 4, 2};

struct Node {
  std::uint64_t first = 0; // number of the first point, 0 or 1
  std::uint64_t count = 0;
};

Node read_node(std::string_view bytes, const std::string& name, std::vector<Vec3>& points) {
  Words words(bytes, name, '#');
  Node head;
  head.count = words.count("the number of points");
  if (words.count("the dimension") != 3)
    words.fail("points of another dimension, expected 3");
  const std::uint64_t attributes = words.count("the number of attributes"),
                      markers = words.count("the number of boundary markers");
  if (attributes > 4096 || markers > 1)
    words.fail("over 4096 attributes or 1 marker, expected fewer");
  words.require(head.count, 4 + attributes + markers, "points");
  points.reserve(head.count);
  for (std::uint64_t p = 0; p < head.count; ++p) {
    const std::uint64_t number = words.count("a point's number");
    if (p == 0 && number > 1)
      words.fail("first point " + std::to_string(number) + ", expected 0 or 1");
    if (p == 0)
      head.first = number;
    if (number != head.first + p)
      words.fail("point " + std::to_string(number) + ", expected " +
                 std::to_string(head.first + p));
    const double x = words.real("x"), y = words.real("y"), z = words.real("z");
    points.push_back({x, y, z});
    for (std::uint64_t k = 0; k < attributes + markers; ++k)
      words.real("an attribute");
  }
  if (!words.word().empty())
    words.fail("words after the last point, expected the end");
  return head;
}

void read_ele(std::string_view bytes, const std::string& name, const Node& head,
              Tetrahedra& result) {
  Words words(bytes, name, '#');
  const std::uint64_t count = words.count("the number of tetrahedra"),
                      size = words.count("the nodes of each"),
                      attributes = words.count("the number of attributes");
  if (size != 4 && size != 10)
    words.fail("tetrahedra of " + std::to_string(size) + " nodes, expected 4 or 10");
  if (attributes > 4096)
    words.fail("over 4096 attributes, expected fewer");
  words.require(count, 1 + size + attributes, "tetrahedra");
  std::array<std::uint32_t, 10> nodes{};
  for (std::uint64_t t = 0; t < count; ++t) {
    words.count("a tetrahedron's number");
    for (std::size_t k = 0; k < size; ++k) {
      const std::uint64_t node = words.count("a point");
      if (node < head.first || node - head.first >= head.count)
        words.fail("point " + std::to_string(node) + ", expected " + std::to_string(head.first) +
                   " to below " + std::to_string(head.first + head.count));
      nodes[k < 4 ? k : 4 + middle_of[k - 4]] = static_cast<std::uint32_t>(node - head.first);
    }
    double material = 0;
    for (std::uint64_t k = 0; k < attributes; ++k)
      if (const double attribute = words.real("an attribute"); k == 0)
        material = attribute;
    if (!(material >= 0 && material <= INT32_MAX && material == std::floor(material)))
      words.fail("a first attribute that is no material, expected an integer from 0");
    result.add(std::span(nodes).first(size), static_cast<std::int64_t>(material),
               [&](const std::string& what) { words.fail(what); });
  }
  if (!words.word().empty())
    words.fail("words after the last tetrahedron, expected the end");
  if (attributes == 0)
    result.mesh.material = {};
}

} // namespace

void write_node(const tetrahedra::TetMesh& mesh, const Sink& sink) {
  Pieces out(sink);
  out << "# gewebe_tetmesh, millimetres\n" << mesh.points.size() << " 3 0 0\n";
  for (std::size_t p = 0; p < mesh.points.size(); ++p) {
    const Vec3& point = mesh.points[p];
    out << p << " " << point.x << " " << point.y << " " << point.z << "\n";
  }
  out.flush();
}

void write_ele(const tetrahedra::TetMesh& mesh, const Sink& sink) {
  Pieces out(sink);
  out << "# gewebe_tetmesh\n"
      << mesh.tetrahedra.size() << (mesh.middles.empty() ? " 4 " : " 10 ")
      << (mesh.material.empty() ? 0 : 1) << "\n";
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
    out << t;
    const TetNodes nodes(mesh, t);
    for (std::size_t k = 0; k < nodes.size(); ++k)
      out << " " << nodes[k < 4 ? k : 4 + middle_of[k - 4]];
    if (!mesh.material.empty())
      out << " " << mesh.material[t];
    out << "\n";
  }
  out.flush();
}

} // namespace tet

tetrahedra::TetMesh tet_mesh_from_tetgen(const TetgenFiles& bytes, const TetgenFiles& names) {
  tet::Tetrahedra result;
  const tet::Node head = tet::read_node(bytes.node, names.node, result.mesh.points);
  tet::read_ele(bytes.ele, names.ele, head, result);
  return std::move(result.mesh);
}

TetgenFiles tetgen_bytes(const tetrahedra::TetMesh& mesh) {
  TetgenFiles files;
  tet::write_node(mesh, [&](std::string_view piece) { files.node += piece; });
  tet::write_ele(mesh, [&](std::string_view piece) { files.ele += piece; });
  return files;
}

} // namespace gewebe::formats
