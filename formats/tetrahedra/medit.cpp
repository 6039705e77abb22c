#include "formats/tetrahedra/tet_file_internal.h"

#include <algorithm>
// Based on: Frey, MEDIT: an interactive mesh visualization software, INRIA RT-0253, 2001; names of
// quadratic elements as libMeshb (github.com/LoicMarechal/libMeshb) has them.

namespace gewebe::formats::tet {
namespace {

/// Sections of elements: number of integers of each; the last one is a reference.
struct Section {
  std::string_view name;
  std::size_t words;
};

constexpr std::array<Section, 15> passed_over{{
    {"Edges", 3},
    {"EdgesP2", 4},
    {"Triangles", 4},
    {"TrianglesP2", 7},
    {"Quadrilaterals", 5},
    {"QuadrilateralsQ2", 10},
    {"Corners", 1},
    {"Ridges", 1},
    {"RequiredVertices", 1},
    {"RequiredEdges", 1},
    {"RequiredTriangles", 1},
    {"RequiredQuadrilaterals", 1},
    {"NormalAtVertices", 2},
    {"TangentAtVertices", 2},
    {"NormalAtTriangleVertices", 3},
}};

constexpr std::array<std::string_view, 12> refused{
    {"Hexahedra", "Hexaedra", "HexahedraQ2", "Prisms", "PrismsP2", "Pentahedra", "Wedges",
     "Pyramids", "PyramidsP2", "TetrahedraP3", "TetrahedraP4", "TetrahedraP2Ordering"}};

/// Those that are no element of the mesh.
bool is_mark(const Section& section) {
  return section.words <= 3 && section.name != "Edges";
}

class MeditReader {
public:
  MeditReader(std::string_view bytes, const std::string& name, TetReadStats& stats)
      : words_(bytes, name, '#'), stats_(stats) {}

  tetrahedra::TetMesh read() {
    if (words_.word() != "MeshVersionFormatted")
      words_.fail("no Medit mesh in text, expected MeshVersionFormatted");
    const std::uint64_t version = words_.count("the version");
    if (version < 1 || version > 4)
      words_.fail("version " + std::to_string(version) + ", expected 1 to 4");
    bool ended = false;
    while (!ended) {
      const std::string_view keyword = words_.word();
      if (keyword.empty())
        break;
      ended = keyword == "End";
      if (!ended)
        read_section(keyword);
    }
    if (ended && !words_.word().empty())
      words_.fail("words after End, expected the end");
    if (!has_vertices_)
      words_.fail("the file ends without Vertices, expected them");
    if (!has_tetrahedra_)
      words_.fail("the file ends without Tetrahedra, expected them");
    return result_.take_unless_zero();
  }

private:
  void read_section(std::string_view keyword) {
    if (keyword == "Dimension") {
      if (words_.count("the dimension") != 3)
        words_.fail("a mesh of another dimension, expected 3");
      has_dimension_ = true;
    } else if (keyword == "Vertices") {
      read_vertices();
    } else if (keyword == "Tetrahedra" || keyword == "TetrahedraP2") {
      read_tetrahedra(keyword == "Tetrahedra" ? 4 : 10);
    } else if (const auto* const section = std::ranges::find(passed_over, keyword, &Section::name);
               section != passed_over.end()) {
      skip(*section);
    } else if (std::ranges::find(refused, keyword) != refused.end()) {
      if (words_.count("their number") > 0)
        words_.fail(std::string(keyword) +
                    ", expected tetrahedra of 4 or 10 nodes in the usual order");
    } else if ((keyword[0] >= 'A' && keyword[0] <= 'Z') ||
               (keyword[0] >= 'a' && keyword[0] <= 'z')) {
      skip_numbers();
    } else {
      words_.fail(quoted(keyword) + ", expected a keyword");
    }
  }

  void read_vertices() {
    if (!has_dimension_)
      words_.fail("Vertices before Dimension, expected Dimension 3");
    if (has_vertices_)
      words_.fail("a second section Vertices, expected one");
    has_vertices_ = true;
    const std::uint64_t count = words_.count("the number of vertices");
    words_.require(count, 4, "vertices");
    std::vector<Vec3>& points = result_.mesh.points;
    points.reserve(count);
    for (std::uint64_t n = 0; n < count; ++n) {
      const double x = words_.real("x"), y = words_.real("y"), z = words_.real("z");
      points.push_back({x, y, z});
      words_.integer("a reference");
    }
  }

  void read_tetrahedra(std::size_t size) {
    if (!has_vertices_)
      words_.fail("Tetrahedra before Vertices, expected Vertices first");
    has_tetrahedra_ = true;
    const std::uint64_t count = words_.count("the number of tetrahedra");
    words_.require(count, size + 1, "tetrahedra");
    std::array<std::uint32_t, 10> nodes{};
    const auto fail = [&](const std::string& what) { words_.fail(what); };
    for (std::uint64_t n = 0; n < count; ++n) {
      for (std::size_t k = 0; k < size; ++k) {
        const std::uint64_t node = words_.count("a vertex");
        if (node < 1 || node > result_.mesh.points.size())
          words_.fail("vertex " + std::to_string(node) + ", expected 1 to " +
                      std::to_string(result_.mesh.points.size()));
        nodes[k] = static_cast<std::uint32_t>(node - 1);
      }
      result_.add(std::span(nodes).first(size), words_.integer("a reference"), fail);
    }
  }

  void skip(const Section& section) {
    const std::uint64_t count = words_.count("the number of elements");
    words_.require(count, section.words, "elements");
    for (std::uint64_t n = 0; n < count * section.words; ++n)
      words_.integer("a vertex or reference");
    if (!is_mark(section))
      stats_.skipped_elements += count;
  }

  /// Whatever else there is: numbers up to the next keyword.
  void skip_numbers() {
    for (;;) {
      const std::string_view next = words_.peek();
      if (next.empty() || (next[0] >= 'A' && next[0] <= 'Z') || (next[0] >= 'a' && next[0] <= 'z'))
        return;
      words_.word();
    }
  }

  Words words_;
  TetReadStats& stats_;
  Tetrahedra result_;
  bool has_dimension_ = false, has_vertices_ = false, has_tetrahedra_ = false;
};

} // namespace

tetrahedra::TetMesh read_medit(std::string_view bytes, const std::string& name,
                               TetReadStats& stats) {
  return MeditReader(bytes, name, stats).read();
}

void write_medit(const tetrahedra::TetMesh& mesh, const Sink& sink) {
  Pieces out(sink);
  out << "MeshVersionFormatted 2\n# gewebe_tetmesh, millimetres\nDimension 3\nVertices\n"
      << mesh.points.size() << "\n";
  for (const Vec3& p : mesh.points)
    out << p.x << " " << p.y << " " << p.z << " 0\n";
  out << (mesh.middles.empty() ? "Tetrahedra\n" : "TetrahedraP2\n") << mesh.tetrahedra.size()
      << "\n";
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
    const TetNodes nodes(mesh, t);
    for (const std::uint32_t node : nodes.in_order())
      out << std::uint64_t{node} + 1 << " ";
    out << (mesh.material.empty() ? 0 : mesh.material[t]) << "\n";
  }
  out << "End\n";
  out.flush();
}

} // namespace gewebe::formats::tet
