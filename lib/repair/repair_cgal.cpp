#include "mesh/edges.h"
#include "mesh/sheets.h"
#include "repair/repair_internal.h"

#define CGAL_HOLE_FILLING_DO_NOT_USE_CDT2 // off by default, and dear to compile

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/border.h>
#include <CGAL/Polygon_mesh_processing/repair_degeneracies.h>
#include <CGAL/Polygon_mesh_processing/triangulate_hole.h>
#include <CGAL/Surface_mesh.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <utility>
#include <vector>

namespace gewebe::repair {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Surface = CGAL::Surface_mesh<Kernel::Point_3>;
using Vertex = Surface::Vertex_index;
using Face = Surface::Face_index;
using Edge = Surface::Edge_index;
using Halfedge = Surface::Halfedge_index;

/// By link_condition, of this thread's repair: CGAL calls it without an object.
thread_local std::uint64_t neighbours_asked = 0;

/// The points around one, except `other`, ascending.
std::vector<Vertex> neighbours(const Surface& surface, Vertex of, Vertex other) {
  std::vector<Vertex> around;
  for (const Halfedge h : CGAL::halfedges_around_target(of, surface))
    if (surface.source(h) != other)
      around.push_back(surface.source(h));
  neighbours_asked += around.size();
  std::sort(around.begin(), around.end());
  return around;
}

/// Whether the surface stays one when this edge is made a point: the ends have no neighbour in
/// common but the corners of the edge's faces, and nothing folds up.
bool link_condition(const Surface& surface, Edge edge) {
  const Halfedge there = surface.halfedge(edge), back = surface.opposite(there);
  const Vertex a = surface.source(there), b = surface.target(there);
  const bool left = !surface.is_border(there), right = !surface.is_border(back);
  const Vertex on_left = surface.target(surface.next(there));
  const Vertex on_right = surface.target(surface.next(back));
  std::vector<Vertex> both;
  const std::vector<Vertex> of_a = neighbours(surface, a, b), of_b = neighbours(surface, b, a);
  std::set_intersection(of_a.begin(), of_a.end(), of_b.begin(), of_b.end(),
                        std::back_inserter(both));
  for (const Vertex v : both)
    if (!(left && v == on_left) && !(right && v == on_right))
      return false;
  const auto alone = [&](Halfedge h) { // the face has no other neighbour
    return surface.is_border(surface.opposite(surface.next(h))) &&
           surface.is_border(surface.opposite(surface.prev(h)));
  };
  if ((left && alone(there)) || (right && alone(back)))
    return false;
  if (!left || !right)
    return true;
  return !(surface.is_border(a) && surface.is_border(b)) && !CGAL::is_tetrahedron(there, surface) &&
         !(surface.next(there) == surface.opposite(surface.prev(back)) &&
           surface.prev(there) == surface.opposite(surface.next(back)));
}

} // namespace
} // namespace gewebe::repair

/// CGAL's own goes round the neighbours of each neighbour: for thousands of flat faces at one point
/// that takes hours. The answer is the same.
template <>
inline bool CGAL::Euler::does_satisfy_link_condition<gewebe::repair::Surface>(
    gewebe::repair::Edge edge, const gewebe::repair::Surface& surface) {
  return gewebe::repair::link_condition(surface, edge);
}

namespace gewebe::repair {

namespace {

namespace pmp = CGAL::Polygon_mesh_processing;

constexpr std::uint32_t none = UINT32_MAX;

using TextureCoordinates = std::array<float, 2>;

class Repair {
public:
  Repair(TriangleMesh& mesh, RepairReport& report) : mesh_(mesh), report_(report) {}

  void run(const RepairOptions& options) {
    searched_edges_ = std::min<std::uint64_t>(options.searched_edges, 1'000'000);
    steps_left_ = searched_edges_ * searched_edges_ * searched_edges_;
    cut_into_sheets();
    if (options.degenerate)
      remove_flat_faces();
    if (options.holes)
      fill_holes(*options.holes);
    write_back(!options.degenerate);
  }

private:
  /// Makes sheets with consistent orientation of the mesh, without faces with equal corners, for
  /// CGAL. Copies of points are undone in write_back(). The half-edges are linked here: CGAL's
  /// add_face() goes round each corner's point, and would take hours where many faces meet.
  void cut_into_sheets() {
    std::vector<Triangle> faces;
    std::vector<std::uint32_t> source;
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
      if (mesh::has_equal_corners(mesh_.triangles[t]))
        continue;
      faces.push_back(mesh_.triangles[t]);
      source.push_back(t);
    }
    edges_ = mesh::edge_table(mesh_.triangles, mesh_.points.size());
    const mesh::Sheets sheets = gewebe::mesh::cut_into_sheets(mesh_.points.size(), faces);
    const mesh::HalfEdges links = mesh::half_edges(sheets.origin.size(), sheets.triangles);

    origin_ = surface_.add_property_map<Vertex, std::uint32_t>("v:origin", none).first;
    for (std::uint32_t p = 0; p < sheets.origin.size(); ++p) {
      const Vec3& at = mesh_.points[sheets.origin[p]];
      const Vertex v = surface_.add_vertex({at.x, at.y, at.z});
      origin_[v] = sheets.origin[p];
      surface_.set_halfedge(v, halfedge(links.of_point[p]));
    }
    source_ = surface_.add_property_map<Face, std::uint32_t>("f:source", none).first;
    backward_ = surface_.add_property_map<Face, char>("f:backward", 0).first;
    for (std::uint32_t f = 0; f < sheets.triangles.size(); ++f) {
      const Face face = surface_.add_face();
      source_[face] = source[f];
      backward_[face] = sheets.backward[f];
      surface_.set_halfedge(face, halfedge(links.of_face[f]));
    }
    for (std::uint32_t h = 0; h < links.target.size(); h += 2)
      (void)surface_.add_edge();
    for (std::uint32_t h = 0; h < links.target.size(); ++h) {
      surface_.set_target(halfedge(h), Vertex(links.target[h]));
      surface_.set_next(halfedge(h), halfedge(links.next[h]));
      surface_.set_face(halfedge(h),
                        links.face[h] == none ? Surface::null_face() : Face(links.face[h]));
    }
  }

  /// CGAL's null is none.
  static Halfedge halfedge(std::uint32_t index) {
    return index == none ? Surface::null_halfedge() : Halfedge(index);
  }

  /// Whether sheets meet in a border edge, which is no border then.
  bool is_seam(Halfedge h) const {
    const auto [low, high] = std::minmax(origin_[surface_.source(h)], origin_[surface_.target(h)]);
    const std::size_t edge = edges_.find({low, high});
    return edge != mesh::EdgeTable::no_edge && edges_.around(edge).size() > 1;
  }

  std::uint64_t flat_faces() const {
    const double cap = std::cos(repair_cap * M_PI / 180);
    std::uint64_t count = 0;
    for (const Face f : surface_.faces()) {
      const bool flat =
          pmp::is_needle_triangle_face(f, surface_, repair_needle) != Surface::null_halfedge() ||
          pmp::is_cap_triangle_face(f, surface_, cap) != Surface::null_halfedge();
      count += flat ? 1 : 0;
    }
    return count;
  }

  void remove_flat_faces() {
    const std::uint64_t before = flat_faces();
    report_.degenerate_faces =
        mesh_.triangles.size() - surface_.number_of_faces(); // those with equal corners
    if (before == 0)
      return;
    auto seam = surface_.add_property_map<Edge, bool>("e:seam", false).first;
    for (const Halfedge h : surface_.halfedges())
      if (surface_.is_border(h) && is_seam(h))
        seam[surface_.edge(h)] = true;
    neighbours_asked = 0;
    (void)pmp::experimental::remove_almost_degenerate_faces(
        surface_.faces(), surface_, std::cos(repair_cap * M_PI / 180), repair_needle, 0,
        CGAL::parameters::edge_is_constrained_map(seam));
    report_.neighbours_asked = neighbours_asked;
    report_.degenerate_left = flat_faces();
    report_.degenerate_faces += before - std::min(before, report_.degenerate_left);
  }

  /// How many edges of the border are no seams.
  std::uint64_t open_edges(const std::vector<Halfedge>& border) const {
    std::uint64_t open = 0;
    for (const Halfedge h : border)
      open += is_seam(h) ? 0 : 1;
    return open;
  }
  bool meets_itself(const std::vector<Halfedge>& border) const {
    std::vector<std::uint32_t> points;
    for (const Halfedge h : border)
      points.push_back(origin_[surface_.target(h)]);
    std::sort(points.begin(), points.end());
    return std::adjacent_find(points.begin(), points.end()) != points.end();
  }

  /// Whether one face has the whole border, so that its back is all that could fill it.
  bool is_lone_face(const std::vector<Halfedge>& border) const {
    return std::all_of(border.begin(), border.end(), [&](Halfedge h) {
      return surface_.face(surface_.opposite(h)) == surface_.face(surface_.opposite(border[0]));
    });
  }

  /// With Delaunay's tetrahedra, or else by a search while there are steps left for it.
  void fill_hole(Halfedge start, std::uint64_t edges, std::vector<Face>& faces,
                 std::vector<Vertex>& points) {
    const auto fill = [&](bool search) {
      pmp::triangulate_and_refine_hole(surface_, start, std::back_inserter(faces),
                                       std::back_inserter(points),
                                       CGAL::parameters::do_not_use_cubic_algorithm(!search));
    };
    fill(false);
    if (!faces.empty())
      return;
    if (edges > searched_edges_ || edges * edges * edges > steps_left_) {
      ++report_.holes_bent;
      return;
    }
    steps_left_ -= edges * edges * edges;
    fill(true);
  }

  void fill_holes(std::uint64_t max_edges) {
    std::vector<Halfedge> starts;
    pmp::extract_boundary_cycles(surface_, std::back_inserter(starts));
    for (const Halfedge start : starts) {
      std::vector<Halfedge> border;
      for (const Halfedge h : CGAL::halfedges_around_face(start, surface_))
        border.push_back(h);
      const std::uint64_t open = open_edges(border);
      if (open == 0)
        continue; // where sheets meet
      std::vector<Face> faces;
      std::vector<Vertex> points;
      if (open == border.size() && open <= max_edges && !meets_itself(border) &&
          !is_lone_face(border))
        fill_hole(start, border.size(), faces, points);
      if (faces.empty()) {
        ++report_.holes_left;
        continue;
      }
      ++report_.holes;
      report_.hole_points += points.size();
      hole_of_.resize(surface_.number_of_vertices() + surface_.number_of_removed_vertices(), none);
      for (const Vertex v : points)
        hole_of_[v.idx()] = static_cast<std::uint32_t>(borders_.size());
      borders_.emplace_back();
      for (const Halfedge h : border)
        borders_.back().push_back(origin_[surface_.target(h)]);
    }
  }

  /// What faces that are new inherit: from a neighbour that is old or has inherited.
  void inherit(std::vector<std::uint32_t>& heir) {
    heir.assign(surface_.number_of_faces() + surface_.number_of_removed_faces(), none);
    std::vector<Face> waiting;
    for (const Face f : surface_.faces()) {
      heir[f.idx()] = source_[f];
      if (source_[f] == none)
        waiting.push_back(f);
    }
    report_.hole_faces = waiting.size();
    while (!waiting.empty()) {
      std::vector<Face> later;
      for (const Face f : waiting) {
        for (const Face next : CGAL::faces_around_face(surface_.halfedge(f), surface_))
          if (next != Surface::null_face() && heir[next.idx()] != none) {
            heir[f.idx()] = heir[next.idx()];
            backward_[f] = backward_[next];
            break;
          }
        if (heir[f.idx()] == none)
          later.push_back(f);
      }
      if (later.size() == waiting.size())
        break; // new faces alone: a patch has a border, so that there are none
      waiting = std::move(later);
    }
    for (std::uint32_t& from : heir)
      from = from == none ? 0 : from;
  }

  /// Texture coordinates of the first corner at each point, and of new points the mean round their
  /// hole.
  std::vector<TextureCoordinates> point_coordinates(std::size_t old_points) const {
    std::vector<TextureCoordinates> st(mesh_.points.size());
    if (mesh_.texcoords.empty())
      return st;
    for (std::size_t t = mesh_.triangles.size(); t-- > 0;)
      for (std::size_t k = 0; k < 3; ++k)
        st[mesh_.triangles[t][k]] = {mesh_.texcoords[t][2 * k], mesh_.texcoords[t][2 * k + 1]};
    for (std::size_t n = old_points; n < st.size(); ++n) {
      const std::vector<std::uint32_t>& border = borders_[hole_of_point_[n - old_points]];
      std::array<double, 2> sum{};
      for (const std::uint32_t p : border)
        for (std::size_t a = 0; a < 2; ++a)
          sum[a] += static_cast<double>(st[p][a]);
      for (std::size_t a = 0; a < 2; ++a)
        st[n][a] = static_cast<float>(sum[a] / static_cast<double>(border.size()));
    }
    return st;
  }

  void write_back(bool keep_collapsed) {
    const std::size_t old_points = mesh_.points.size();
    std::vector<char> was_used(old_points, 0);
    for (const Triangle& t : mesh_.triangles)
      for (const std::uint32_t corner : t)
        was_used[corner] = 1;
    std::vector<std::uint32_t> heir;
    inherit(heir);
    std::vector<std::uint32_t> id(
        surface_.number_of_vertices() + surface_.number_of_removed_vertices(), none);
    for (const Vertex v : surface_.vertices()) {
      id[v.idx()] = origin_[v];
      if (id[v.idx()] != none)
        continue;
      id[v.idx()] = static_cast<std::uint32_t>(mesh_.points.size());
      const Kernel::Point_3& p = surface_.point(v);
      mesh_.points.push_back({p.x(), p.y(), p.z()});
      hole_of_point_.push_back(hole_of_[v.idx()]);
    }

    // Faces in the order of the mesh, new ones last.
    struct Out {
      std::uint32_t source, heir;
      Triangle corners;
    };
    std::vector<Out> out;
    for (const Face f : surface_.faces()) {
      Triangle t{};
      std::size_t k = 0;
      for (const Vertex v : CGAL::vertices_around_face(surface_.halfedge(f), surface_))
        t[k++] = id[v.idx()];
      if (backward_[f] != 0)
        std::swap(t[1], t[2]);
      out.push_back({source_[f], heir[f.idx()], t});
    }
    if (keep_collapsed)
      for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
        if (mesh::has_equal_corners(mesh_.triangles[t]))
          out.push_back({t, t, mesh_.triangles[t]});
      }
    std::stable_sort(out.begin(), out.end(),
                     [](const Out& a, const Out& b) { return a.source < b.source; });

    const std::vector<TextureCoordinates> st = point_coordinates(old_points);
    const TriangleMesh from = std::exchange(mesh_, {});
    for (Out& o : out) {
      if (o.source != none)
        first_corner_first(o.corners, from.triangles[o.source]);
      mesh_.triangles.push_back(o.corners);
      if (!from.part.empty())
        mesh_.part.push_back(from.part[o.heir]);
      if (!from.material.empty())
        mesh_.material.push_back(from.material[o.heir]);
      if (from.texcoords.empty())
        continue;
      std::array<float, 6> own{};
      for (std::size_t k = 0; k < 3; ++k) {
        TextureCoordinates at = st[o.corners[k]];
        for (std::size_t m = 0; o.source != none && m < 3; ++m)
          if (from.triangles[o.source][m] == o.corners[k])
            at = {from.texcoords[o.source][2 * m], from.texcoords[o.source][2 * m + 1]};
        own[2 * k] = at[0];
        own[2 * k + 1] = at[1];
      }
      mesh_.texcoords.push_back(own);
    }
    drop_points(from, was_used);
  }

  /// CGAL may name another corner first.
  static void first_corner_first(Triangle& t, const Triangle& as) {
    const auto first = std::find(t.begin(), t.end(), as[0]);
    if (first != t.end())
      std::rotate(t.begin(), first, t.end());
  }

  /// Points that faces used and use no more go.
  void drop_points(const TriangleMesh& from, std::vector<char>& was_used) {
    std::vector<char> used(from.points.size(), 0);
    for (const Triangle& t : mesh_.triangles)
      for (const std::uint32_t corner : t)
        used[corner] = 1;
    was_used.resize(from.points.size(), 1);
    std::vector<std::uint32_t> number(from.points.size(), none);
    for (std::size_t p = 0; p < from.points.size(); ++p)
      if (used[p] != 0 || was_used[p] == 0) {
        number[p] = static_cast<std::uint32_t>(mesh_.points.size());
        mesh_.points.push_back(from.points[p]);
        if (p < from.normals.size())
          mesh_.normals.push_back(from.normals[p]);
      }
    for (Triangle& t : mesh_.triangles)
      for (std::uint32_t& corner : t)
        corner = number[corner];
    if (mesh_.normals.size() != mesh_.points.size())
      mesh_.normals.clear();
  }

  TriangleMesh& mesh_;
  RepairReport& report_;
  mesh::EdgeTable edges_; ///< of the mesh
  Surface surface_;
  Surface::Property_map<Vertex, std::uint32_t> origin_; ///< point of the mesh, or none
  Surface::Property_map<Face, std::uint32_t> source_;   ///< face of the mesh, or none
  Surface::Property_map<Face, char> backward_;          ///< it runs the other way in the mesh
  std::uint64_t searched_edges_ = 0, steps_left_ = 0;   ///< for bent holes
  std::vector<std::vector<std::uint32_t>> borders_;     ///< of filled holes, points of the mesh
  std::vector<std::uint32_t> hole_of_;                  ///< of each new vertex
  std::vector<std::uint32_t> hole_of_point_;            ///< of each new point
};

} // namespace

void with_cgal(TriangleMesh& mesh, const RepairOptions& options, RepairReport& report) {
  Repair(mesh, report).run(options);
}

} // namespace gewebe::repair
