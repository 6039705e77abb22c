#include "formats/tetrahedra/msh_internal.h"

#include <set>
// Based on: Geuzaine, Remacle, Gmsh reference manual 4.11, MSH file format, version 4.1, and
// legacy version 2.2.

namespace gewebe::formats::tet {
namespace {

/// Corners and middles of one in Gmsh's order.
std::array<std::uint32_t, 10> gmsh_nodes(const TetNodes& nodes) {
  std::array<std::uint32_t, 10> order{};
  for (std::size_t k = 0; k < nodes.size(); ++k)
    order[k] = nodes[k];
  std::swap(order[8], order[9]);
  return order;
}

int type_of(const tetrahedra::TetMesh& mesh) {
  return mesh.middles.empty() ? 4 : 11;
}

/// The numbers of entities and of their physical groups: those of the materials, ascending, and the
/// smallest free one for material 0. Of a mesh without materials one, 1, and no groups.
struct Groups {
  explicit Groups(const tetrahedra::TetMesh& mesh) : any(!mesh.material.empty()) {
    for (const std::int32_t m : mesh.material)
      if (materials.empty() || m != *materials.rbegin())
        materials.insert(m);
    if (materials.empty())
      materials.insert(0);
    while (materials.contains(of_0))
      ++of_0;
  }
  std::int32_t of(std::int32_t material) const { return material == 0 ? of_0 : material; }
  std::int32_t of(const tetrahedra::TetMesh& mesh, std::size_t t) const {
    return of(mesh.material.empty() ? 0 : mesh.material[t]);
  }
  void write_name(Pieces& out) const {
    if (any && materials.contains(0))
      out << "$PhysicalNames\n1\n3 " << of_0 << " \"" << name_of_0 << "\"\n$EndPhysicalNames\n";
  }

  bool any;
  std::set<std::int32_t> materials;
  std::int32_t of_0 = 1;
};

} // namespace

void write_msh2(const tetrahedra::TetMesh& mesh, const Sink& sink) {
  Pieces out(sink);
  const Groups groups(mesh);
  out << "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n";
  groups.write_name(out);
  out << "$Nodes\n" << mesh.points.size() << "\n";
  for (std::size_t p = 0; p < mesh.points.size(); ++p) {
    const Vec3& point = mesh.points[p];
    out << p + 1 << " " << point.x << " " << point.y << " " << point.z << "\n";
  }
  out << "$EndNodes\n$Elements\n" << mesh.tetrahedra.size() << "\n";
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
    const std::int32_t group = groups.of(mesh, t);
    out << t + 1 << " " << type_of(mesh) << " 2 " << (groups.any ? group : 0) << " " << group;
    const TetNodes nodes(mesh, t);
    const auto order = gmsh_nodes(nodes);
    for (std::size_t k = 0; k < nodes.size(); ++k)
      out << " " << std::uint64_t{order[k]} + 1;
    out << "\n";
  }
  out << "$EndElements\n";
  out.flush();
}

void write_msh4(const tetrahedra::TetMesh& mesh, const Sink& sink) {
  const auto size = [](std::size_t n) { return std::uint64_t{n}; };
  const Groups groups(mesh);
  Pieces out(sink);
  out << "$MeshFormat\n4.1 1 8\n";
  out.put(std::int32_t{1});
  out << "\n$EndMeshFormat\n";
  groups.write_name(out);
  out << "$Entities\n";
  for (int dimension = 0; dimension < 3; ++dimension)
    out.put(size(0));
  out.put(size(groups.materials.size()));
  const Box3 box = mesh.points.empty() ? Box3{{}, {}} : tetrahedra::bounding_box(mesh);
  for (const std::int32_t material : groups.materials) {
    out.put(groups.of(material));
    out.put(box.min);
    out.put(box.max);
    out.put(size(groups.any ? 1 : 0));
    if (groups.any)
      out.put(groups.of(material));
    out.put(size(0));
  }
  out << "\n$EndEntities\n$Nodes\n";
  const std::size_t points = mesh.points.size();
  out.put(size(points == 0 ? 0 : 1));
  out.put(size(points));
  out.put(size(points == 0 ? 0 : 1));
  out.put(size(points));
  if (points > 0) {
    out.put(std::int32_t{3});
    out.put(groups.of(*groups.materials.begin()));
    out.put(std::int32_t{0});
    out.put(size(points));
    for (std::size_t p = 0; p < points; ++p)
      out.put(size(p + 1));
    for (const Vec3& p : mesh.points)
      out.put(p);
  }
  out << "\n$EndNodes\n$Elements\n";
  // Tetrahedra keep their order: a block for each run of one material.
  std::vector<std::size_t> runs;
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t)
    if (t == 0 || (!mesh.material.empty() && mesh.material[t] != mesh.material[t - 1]))
      runs.push_back(t);
  out.put(size(runs.size()));
  out.put(size(mesh.tetrahedra.size()));
  out.put(size(mesh.tetrahedra.empty() ? 0 : 1));
  out.put(size(mesh.tetrahedra.size()));
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const std::size_t end = r + 1 < runs.size() ? runs[r + 1] : mesh.tetrahedra.size();
    out.put(std::int32_t{3});
    out.put(groups.of(mesh, runs[r]));
    out.put(std::int32_t{type_of(mesh)});
    out.put(size(end - runs[r]));
    for (std::size_t t = runs[r]; t < end; ++t) {
      out.put(size(t + 1));
      const TetNodes nodes(mesh, t);
      const auto order = gmsh_nodes(nodes);
      for (std::size_t k = 0; k < nodes.size(); ++k)
        out.put(size(order[k]) + 1);
    }
  }
  out << "\n$EndElements\n";
  out.flush();
}

} // namespace gewebe::formats::tet
