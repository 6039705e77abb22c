#include "mesh/crossing.h"

#include "geometry/boxes_meet.h"
#include "mesh/sheets.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/corefinement.h>
#include <CGAL/Surface_mesh.h>

#include <algorithm>
#include <array>
#include <exception>
#include <new>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace gewebe::mesh {
namespace {

namespace pmp = CGAL::Polygon_mesh_processing;

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Surface = CGAL::Surface_mesh<Kernel::Point_3>;
using Vertex = Surface::Vertex_index;
using Face = Surface::Face_index;
using Halfedge = Surface::Halfedge_index;
using Marks = Surface::Property_map<Surface::Edge_index, bool>;

constexpr std::uint32_t none = UINT32_MAX;

Halfedge halfedge(std::uint32_t index) {
  return index == none ? Surface::null_halfedge() : Halfedge(index);
}

/// One of the two, as CGAL has it.
struct Side {
  Surface surface;
  std::vector<std::uint32_t> origin; // of its first vertices, in the mesh
  Surface::Property_map<Face, std::uint32_t> from;
  Marks marks;
  std::uint32_t splitting = none; // the face in work, as it was before

  explicit Side(const TriangleMesh& mesh) {
    Sheets sheets = cut_into_sheets(mesh.points.size(), mesh.triangles);
    const HalfEdges links = half_edges(sheets.origin.size(), sheets.triangles);
    for (std::uint32_t p = 0; p < sheets.origin.size(); ++p) {
      const Vec3& at = mesh.points[sheets.origin[p]];
      const Vertex v = surface.add_vertex({at.x, at.y, at.z});
      surface.set_halfedge(v, halfedge(links.of_point[p]));
    }
    origin = std::move(sheets.origin);
    from = surface.add_property_map<Face, std::uint32_t>("f:from", none).first;
    marks = surface.add_property_map<Surface::Edge_index, bool>("e:curve", false).first;
    for (std::uint32_t f = 0; f < sheets.triangles.size(); ++f) {
      const Face face = surface.add_face();
      from[face] = f;
      surface.set_halfedge(face, halfedge(links.of_face[f]));
    }
    for (std::uint32_t h = 0; h < links.target.size(); h += 2)
      (void)surface.add_edge();
    for (std::uint32_t h = 0; h < links.target.size(); ++h) {
      surface.set_target(halfedge(h), Vertex(links.target[h]));
      surface.set_next(halfedge(h), halfedge(links.next[h]));
      surface.set_face(halfedge(h),
                       links.face[h] == none ? Surface::null_face() : Face(links.face[h]));
    }
  }

  std::uint32_t number(Vertex v, std::size_t points) const {
    const auto index = static_cast<std::size_t>(v);
    return index < origin.size() ? origin[index]
                                 : static_cast<std::uint32_t>(points + index - origin.size());
  }

  RefinedSurface refined(const TriangleMesh& mesh) const {
    RefinedSurface result;
    result.points = mesh.points;
    for (auto v = static_cast<Surface::size_type>(origin.size()); v < surface.number_of_vertices();
         ++v) {
      const Kernel::Point_3& p = surface.point(Vertex(v));
      result.points.push_back({p.x(), p.y(), p.z()});
    }
    for (const Face f : surface.faces()) {
      Triangle& corners = result.triangles.emplace_back();
      std::size_t k = 0;
      for (const Vertex v : CGAL::vertices_around_face(surface.halfedge(f), surface))
        corners[k++] = number(v, mesh.points.size());
      result.from.push_back(from[f]);
    }
    return result;
  }
};

/// Records the origin of parts of faces.
struct Parts : pmp::Corefinement::Default_visitor<Surface> {
  Side *a = nullptr, *b = nullptr;

  Parts(Side& first, Side& second) : a(&first), b(&second) {}
  Side& of(const Surface& surface) const { return &surface == &a->surface ? *a : *b; }

  // NOLINTNEXTLINE(readability-identifier-naming): CGAL's
  void before_subface_creations(Face face, Surface& surface) const {
    Side& side = of(surface);
    side.splitting = side.from[face];
  }
  void after_subface_created(Face face, Surface& surface) const {
    Side& side = of(surface);
    side.from[face] = side.splitting;
  }
};

using Places = std::array<std::array<double, 3>, 2>; // of an edge, ascending

/// Of all triangles one that may come there.
bool may_meet(const TriangleMesh& mesh, const Box3& box) {
  return std::ranges::any_of(mesh.triangles, [&](const Triangle& triangle) {
    Box3 own;
    for (const std::uint32_t corner : triangle)
      own.add(mesh.points[corner]);
    return meet(own, box);
  });
}

/// Where edges lie on each other and have different points CGAL's corefinement puts points at one
/// place into a face of the other surface, whose triangulation then may have no end.
void require_apart(const TriangleMesh& mesh, const TriangleMesh& other) {
  struct Edge {
    Places places;
    std::array<std::uint32_t, 2> ends{}; // in their order
    auto operator<=>(const Edge&) const = default;
  };
  std::vector<Edge> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (const Triangle& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      Edge edge;
      edge.ends = {t[k], t[(k + 1) % 3]};
      for (std::size_t end = 0; end < 2; ++end) {
        const Vec3& p = mesh.points[edge.ends[end]];
        edge.places[end] = {p.x, p.y, p.z};
      }
      if (std::pair(edge.places[1], edge.ends[1]) < std::pair(edge.places[0], edge.ends[0])) {
        std::swap(edge.places[0], edge.places[1]);
        std::swap(edge.ends[0], edge.ends[1]);
      }
      edges.push_back(edge);
    }
  std::ranges::sort(edges);
  for (std::size_t n = 1; n < edges.size(); ++n) {
    if (edges[n].places != edges[n - 1].places || edges[n].ends == edges[n - 1].ends)
      continue;
    Box3 box;
    for (const std::uint32_t end : edges[n].ends)
      box.add(mesh.points[end]);
    if (may_meet(other, box))
      throw MeetingOfNoSheets("the surfaces meet where one of them lies on itself, expected two "
                              "sheets");
  }
}

struct Marked {
  Places places;
  std::array<std::uint32_t, 2> ends{}; // in their order
  auto operator<=>(const Marked&) const = default;
};

std::vector<Marked> marked_edges(const Side& side, std::size_t points) {
  std::vector<Marked> all;
  for (const Surface::Edge_index e : side.surface.edges()) {
    if (!side.marks[e])
      continue;
    Marked one;
    for (std::size_t k = 0; k < 2; ++k) {
      const Vertex v = side.surface.vertex(e, static_cast<unsigned>(k));
      const Kernel::Point_3& p = side.surface.point(v);
      one.places[k] = {p.x(), p.y(), p.z()};
      one.ends[k] = side.number(v, points);
    }
    if (one.places[1] < one.places[0]) {
      std::swap(one.places[0], one.places[1]);
      std::swap(one.ends[0], one.ends[1]);
    }
    all.push_back(one);
  }
  std::ranges::sort(all);
  return all;
}

} // namespace

SurfaceCrossing cross_surfaces(const TriangleMesh& a, const TriangleMesh& b) {
  require_apart(a, b);
  require_apart(b, a);
  Side one(a), other(b);
  try {
    pmp::corefine(one.surface, other.surface,
                  CGAL::parameters::edge_is_constrained_map(one.marks).visitor(Parts(one, other)),
                  CGAL::parameters::edge_is_constrained_map(other.marks));
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception&) {
    throw MeetingOfNoSheets(
        "the surfaces meet where one of them passes through itself, expected two sheets");
  }
  const std::vector<Marked> of_a = marked_edges(one, a.points.size()),
                            of_b = marked_edges(other, b.points.size());
  SurfaceCrossing crossing{one.refined(a), other.refined(b), {}};
  for (std::size_t n = 0; n < std::max(of_a.size(), of_b.size()); ++n) {
    if (n >= of_a.size() || n >= of_b.size() || of_a[n].places != of_b[n].places ||
        of_a[n].places[0] == of_a[n].places[1] || (n > 0 && of_a[n].places == of_a[n - 1].places))
      throw MeetingOfNoSheets(
          "the surfaces meet in a curve that has other edges on one of them than on the "
          "other, expected two sheets");
    crossing.curve.push_back({of_a[n].ends, of_b[n].ends});
  }
  return crossing;
}

} // namespace gewebe::mesh
