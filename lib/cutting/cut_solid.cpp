#include "cutting/cut_solid.h"

#include "base/error.h"
#include "cutting/skin_binding.h"
#include "fem/assembly.h"
#include "fem/solid_model.h"
#include "geometry/perpendicular.h"
#include "tetrahedra/faces.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <optional>
#include <string>
#include <tuple>
#include <utility>

namespace gewebe::cutting {
namespace {

using Weights = std::array<double, 3>;

void check(const model::Model& model) {
  if (model.tetrahedra.empty())
    throw Error("the model has no tetrahedra, expected a solid to cut with a blade");
  if (!model.springs.empty())
    throw Error("the model has " + std::to_string(model.springs.size()) +
                " springs, expected elements alone to cut with a blade");
  if (model::body_count(model) != model.nodes.size())
    throw Error("the model has central nodes, expected elements alone to cut with a blade");
}

/// A face of an element as triangles of a model's surface: itself, or four about its middles.
std::vector<Triangle> surface_of(const Triangle& corners, const Triangle& middles, bool quadratic) {
  const auto& [a, b, c] = corners;
  if (!quadratic)
    return {corners};
  const auto& [ab, bc, ca] = middles;
  return {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}};
}

/// The same of places in the face.
std::vector<std::array<Weights, 3>> surface_of(const std::array<Weights, 3>& corners,
                                               bool quadratic) {
  const auto& [a, b, c] = corners;
  if (!quadratic)
    return {corners};
  const auto half = [](const Weights& p, const Weights& q) {
    return Weights{(p[0] + q[0]) / 2, (p[1] + q[1]) / 2, (p[2] + q[2]) / 2};
  };
  const Weights ab = half(a, b), bc = half(b, c), ca = half(c, a);
  return {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}};
}

/// Which of the four holds a place of the face.
std::size_t quarter_at(const Weights& place) {
  for (std::size_t k = 0; k < 3; ++k)
    if (place[k] > 0.5)
      return k;
  return 3;
}

/// Barycentric coordinates of a place of the face in one of the four.
Weights within_quarter(const Weights& w, std::size_t quarter) {
  const auto& [a, b, c] = w;
  switch (quarter) {
  case 0:
    return {1 - 2 * b - 2 * c, 2 * b, 2 * c};
  case 1:
    return {1 - 2 * c - 2 * a, 2 * c, 2 * a};
  case 2:
    return {1 - 2 * a - 2 * b, 2 * a, 2 * b};
  default:
    return {1 - 2 * c, 1 - 2 * a, 1 - 2 * b};
  }
}

struct NamedTriangle {
  Triangle corners{}; // ascending
  std::uint32_t number = 0;

  auto operator<=>(const NamedTriangle&) const = default;
};

class Cutter {
public:
  /// \param sheet of the skin, if there is one  \param narrow no wider than the wall
  Cutter(const model::Model& model, incision::TetCut cut, tetrahedra::TetMesh before,
         const SkinSheet* sheet, bool narrow)
      : before_(model), mesh_(std::move(before)), cut_(std::move(cut)), sheet_(sheet),
        narrow_(narrow) {
    result_.model = model;
    result_.report = cut_.report;
  }

  SolidCut carry_out() {
    if (!cut_.changed.empty()) {
      write_elements();
      write_nodes();
      write_surface();
      write_normals();
      write_skin();
    } else {
      for (std::uint32_t t = 0; t < before_.triangles.size(); ++t)
        result_.triangle.push_back(t);
    }
    result_.origin = std::move(cut_.origin);
    result_.tetrahedron = std::move(cut_.tetrahedron);
    result_.changed = std::move(cut_.changed);
    return std::move(result_);
  }

private:
  void write_elements() {
    model::Model& model = result_.model;
    model.tetrahedra = cut_.mesh.tetrahedra;
    model.middles = cut_.mesh.middles;
    model.tetrahedron_material = cut_.mesh.material;
  }

  /// Masses by the tetrahedra of a mesh that come from changed ones.
  std::vector<double> masses_of_changed(const tetrahedra::TetMesh& mesh, bool now) const {
    std::vector<bool> changed(before_.tetrahedra.size());
    for (const std::uint32_t t : cut_.changed)
      changed[t] = true;
    tetrahedra::TetMesh part;
    part.points = mesh.points;
    for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t)
      if (changed[now ? cut_.tetrahedron[t] : t]) {
        part.tetrahedra.push_back(mesh.tetrahedra[t]);
        part.material.push_back(mesh.material[t]);
        if (!mesh.middles.empty())
          part.middles.push_back(mesh.middles[t]);
      }
    return fem::solid_masses(part, fem::element_materials(before_));
  }

  /// The nodes before between which a node stands.
  std::vector<std::uint32_t> parents_of(const incision::TetNodeOrigin& from) const {
    if (from.node != incision::TetNodeOrigin::none)
      return {from.node};
    std::vector<std::uint32_t> parents;
    for (std::size_t k = 0; k < 4; ++k)
      if (from.weights[k] != 0)
        parents.push_back(before_.tetrahedra[from.tetrahedron][k]);
    return parents;
  }

  void write_nodes() {
    std::vector<double> lost = masses_of_changed(mesh_, false);
    const std::vector<double> gained = masses_of_changed(cut_.mesh, true);
    lost.resize(gained.size());
    std::vector<model::Node>& nodes = result_.model.nodes;
    nodes.resize(cut_.mesh.points.size());
    for (std::size_t n = 0; n < nodes.size(); ++n) {
      const incision::TetNodeOrigin& from = cut_.origin[n];
      const bool had = n < before_.nodes.size();
      nodes[n].position = cut_.mesh.points[n];
      if (!had || lost[n] != gained[n]) { // else as it was, to the last digit
        nodes[n].mass = (had ? before_.nodes[n].mass - lost[n] : 0) + gained[n];
        nodes[n].drag = drag_rate(from) * nodes[n].mass;
      }
      if (had && from.node != incision::TetNodeOrigin::none)
        continue;
      nodes[n].fixed = model::fixed_all;
      for (const std::uint32_t parent : parents_of(from))
        nodes[n].fixed = static_cast<std::uint8_t>(nodes[n].fixed & before_.nodes[parent].fixed);
      nodes[n].material = -1;
    }
    give_materials(nodes);
  }

  double drag_rate(const incision::TetNodeOrigin& from) const {
    double rate = 0;
    const std::vector<std::uint32_t> parents = parents_of(from);
    for (const std::uint32_t parent : parents) {
      const model::Node& node = before_.nodes[parent];
      rate += node.mass > 0 ? node.drag / node.mass / static_cast<double>(parents.size()) : 0;
    }
    return rate;
  }

  void give_materials(std::vector<model::Node>& nodes) const {
    const tetrahedra::TetMesh& mesh = cut_.mesh;
    const auto use = [&](std::uint32_t node, std::int32_t material) {
      if (nodes[node].material < 0)
        nodes[node].material = material;
    };
    for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
      for (const std::uint32_t corner : mesh.tetrahedra[t])
        use(corner, mesh.material[t]);
      if (!mesh.middles.empty())
        for (const std::uint32_t middle : mesh.middles[t])
          use(middle, mesh.material[t]);
    }
  }

  // ---- Surface

  bool quadratic() const { return !before_.middles.empty(); }

  /// The triangles of the surface before that make up a face before, in the order of surface_of().
  std::vector<Triangle> triangles_of(std::uint32_t face) const {
    const Tetrahedron& t = before_.tetrahedra[face / 4];
    Triangle middles{};
    const auto& own = tetrahedra::tetrahedron_faces[face % 4];
    for (std::size_t c = 0; quadratic() && c < 3; ++c)
      for (std::size_t k = 0; k < 6; ++k) {
        const auto& [a, b] = tetrahedra::tetrahedron_edges[k];
        if (std::min(a, b) == std::min(own[c], own[(c + 1) % 3]) &&
            std::max(a, b) == std::max(own[c], own[(c + 1) % 3]))
          middles[c] = before_.middles[face / 4][k];
      }
    return surface_of(tetrahedra::corners_of_face(t, face % 4), middles, quadratic());
  }

  void index_triangles() {
    std::vector<std::uint8_t> near(before_.nodes.size());
    for (const incision::CutFace& face : cut_.surface)
      for (const Triangle& triangle : triangles_of(face.face_before))
        for (const std::uint32_t corner : triangle)
          near[corner] = 1;
    for (std::uint32_t n = 0; n < before_.triangles.size(); ++n) {
      Triangle corners = before_.triangles[n];
      if (near[corners[0]] == 0 || near[corners[1]] == 0 || near[corners[2]] == 0)
        continue;
      std::ranges::sort(corners);
      named_.push_back({corners, n});
    }
    std::ranges::sort(named_);
  }

  std::uint32_t number_of(Triangle corners, std::uint32_t face) const {
    std::ranges::sort(corners);
    const auto at = std::ranges::lower_bound(named_, corners, {}, &NamedTriangle::corners);
    if (at == named_.end() || at->corners != corners)
      throw Error("a face of element " + std::to_string(face / 4) +
                  " on the boundary at the blade is not among the triangles of the surface, "
                  "expected the whole boundary there");
    return at->number;
  }

  void add(const Triangle& triangle, std::uint32_t before,
           const std::optional<std::array<double, 6>>& texcoords) {
    result_.model.triangles.push_back(triangle);
    result_.triangle.push_back(before);
    if (!before_.texcoords.empty())
      result_.model.texcoords.push_back(texcoords.value_or(std::array<double, 6>{}));
  }

  void write_surface() {
    index_triangles();
    std::vector<bool> replaced(before_.triangles.size());
    for (const incision::CutFace& face : cut_.surface)
      for (const Triangle& triangle : triangles_of(face.face_before))
        replaced[number_of(triangle, face.face_before)] = true;
    result_.model.triangles.clear();
    result_.model.texcoords.clear();
    for (std::uint32_t n = 0; n < before_.triangles.size(); ++n)
      if (!replaced[n])
        add(before_.triangles[n], n, texcoords_before(n));
    for (const incision::CutFace& face : cut_.surface)
      add_parts(face);
    for (const incision::WallTriangle& wall : cut_.wall)
      for (std::size_t side = 0; side < 2; ++side)
        for (const Triangle& triangle :
             surface_of(wall.corners[side], wall.middles[side], quadratic()))
          add(triangle, SolidCut::wall, std::nullopt);
  }

  std::optional<std::array<double, 6>> texcoords_before(std::uint32_t n) const {
    if (before_.texcoords.empty())
      return std::nullopt;
    return before_.texcoords[n];
  }

  void add_parts(const incision::CutFace& face) {
    const std::vector<Triangle> now = surface_of(face.corners, face.middles, quadratic()),
                                old = triangles_of(face.face_before);
    const std::vector<std::array<Weights, 3>> places = surface_of(face.weights, quadratic());
    for (std::size_t n = 0; n < now.size(); ++n) {
      Weights centre{};
      for (const Weights& corner : places[n])
        for (std::size_t k = 0; k < 3; ++k)
          centre[k] += corner[k] / 3;
      const std::size_t quarter = quadratic() ? quarter_at(centre) : 0;
      const std::uint32_t before = number_of(old[quarter], face.face_before);
      if (before_.texcoords.empty()) {
        add(now[n], before, std::nullopt);
        continue;
      }
      std::array<double, 6> texcoords{};
      for (std::size_t c = 0; c < 3; ++c) {
        const Weights within = quadratic() ? within_quarter(places[n][c], quarter) : places[n][c];
        for (std::size_t k = 0; k < 3; ++k) {
          // Which corner of the triangle before it is: that may start elsewhere.
          const Triangle& stored = before_.triangles[before];
          const auto at =
              static_cast<std::size_t>(std::ranges::find(stored, old[quarter][k]) - stored.begin());
          for (std::size_t axis = 0; axis < 2; ++axis)
            texcoords[2 * c + axis] += within[k] * before_.texcoords[before][2 * at + axis];
        }
      }
      add(now[n], before, texcoords);
    }
  }

  void write_normals() {
    model::Model& model = result_.model;
    if (before_.normals.empty())
      return;
    std::vector<std::uint8_t> renewed(model.nodes.size());
    std::size_t kept = 0; // triangles that stay come first
    while (kept < model.triangles.size() && result_.triangle[kept] != SolidCut::wall &&
           model.triangles[kept] == before_.triangles[result_.triangle[kept]])
      ++kept;
    for (std::size_t n = kept; n < model.triangles.size(); ++n)
      for (const std::uint32_t corner : model.triangles[n])
        renewed[corner] = 1;
    model.normals.resize(model.nodes.size());
    for (std::size_t n = 0; n < model.nodes.size(); ++n)
      if (renewed[n] != 0)
        model.normals[n] = {};
    for (const Triangle& triangle : model.triangles) {
      const Vec3 &p = model.nodes[triangle[0]].position, &q = model.nodes[triangle[1]].position,
                 &r = model.nodes[triangle[2]].position;
      const Vec3 area = cross(q - p, r - p);
      for (const std::uint32_t corner : triangle)
        if (renewed[corner] != 0)
          model.normals[corner] += area;
    }
    for (std::size_t n = 0; n < model.nodes.size(); ++n)
      if (const double length = norm(model.normals[n]); renewed[n] != 0 && length > 0)
        model.normals[n] = model.normals[n] / length;
  }

  void write_skin() {
    if (before_.skin.points.empty())
      return;
    constexpr double reach = 3; // of the longest edge
    constexpr int steps = 6;
    double longest = 0;
    for (const std::uint32_t t : cut_.changed)
      for (const auto& [a, b] : tetrahedra::tetrahedron_edges)
        longest = std::max(longest, norm(mesh_.points[mesh_.tetrahedra[t][b]] -
                                         mesh_.points[mesh_.tetrahedra[t][a]]));
    SkinSheet narrow;
    if (narrow_)
      narrow = sheet_beside(result_.model, cut_.wall, *sheet_);
    SkinCut cut = cut_skin(before_.skin,
                           cut_.wall.empty() ? SkinSheet{}
                           : narrow_         ? narrow
                                             : *sheet_,
                           sheet_cell(before_), reach * longest);
    result_.model.skin = std::move(cut.skin);
    const std::vector<std::int8_t> sides =
        sides_of_elements(result_.model, cut_.wall, reach * longest, steps);
    bind_skin(result_.model, cut, sides, cut_.changed);
    result_.skin_end = std::move(cut.end);
  }

  const model::Model& before_;
  tetrahedra::TetMesh mesh_; // the elements before
  incision::TetCut cut_;
  const SkinSheet* sheet_;
  bool narrow_;
  std::vector<NamedTriangle> named_; // triangles before near the blade
  SolidCut result_;
};

} // namespace

double sheet_cell(const model::Model& model) {
  double sum = 0;
  for (const Tetrahedron& t : model.tetrahedra)
    for (const auto& [a, b] : tetrahedra::tetrahedron_edges)
      sum += norm(model.nodes[t[b]].position - model.nodes[t[a]].position);
  return sum / (6 * static_cast<double>(model.tetrahedra.size()));
}

SolidCut cut_solid(const model::Model& model, const TriangleMesh& blade,
                   const incision::BladeCutOptions& options, const SkinSheet* sheet) {
  check(model);
  incision::BladeCutOptions own = options;
  std::vector<std::uint32_t> held(options.held.begin(), options.held.end());
  for (std::uint32_t n = 0; n < model.nodes.size(); ++n)
    if (model.nodes[n].fixed != model::fixed_none)
      held.push_back(n);
  own.held = held;
  tetrahedra::TetMesh mesh = fem::element_mesh(model);
  incision::TetCut cut = incision::cut_tetrahedra(mesh, blade, own);
  SkinSheet of_blade;
  if (sheet == nullptr && !model.skin.points.empty()) {
    of_blade.surface = blade;
    sheet = &of_blade;
  }
  return Cutter(model, std::move(cut), std::move(mesh), sheet, !options.among.empty()).carry_out();
}

namespace {

bool before_by_place(const incision::TetNodeOrigin& a, const incision::TetNodeOrigin& b) {
  return std::tie(a.tetrahedron, a.weights) < std::tie(b.tetrahedron, b.weights);
}

/// The one that has most; of several the first.
std::uint32_t main_of(const std::vector<std::pair<std::uint32_t, double>>& shares) {
  return std::ranges::max_element(shares, {}, [](const auto& share) { return share.second; })
      ->first;
}

} // namespace

CutModel as_cut_model(const model::Model& before, SolidCut cut) {
  const auto n = static_cast<std::uint32_t>(before.nodes.size());
  const tetrahedra::TetMesh mesh = fem::element_mesh(before);
  CutModel result;
  std::vector<std::uint32_t> moved; // nodes before
  for (std::uint32_t i = 0; i < n; ++i)
    if (cut.origin[i].node == incision::TetNodeOrigin::none)
      moved.push_back(i);
  std::ranges::sort(moved, [&](std::uint32_t a, std::uint32_t b) {
    return before_by_place(cut.origin[a], cut.origin[b]);
  });
  std::vector<bool> fresh(cut.origin.size());
  for (std::uint32_t i = 0; i < cut.origin.size(); ++i) {
    const incision::TetNodeOrigin& from = cut.origin[i];
    if (from.node != incision::TetNodeOrigin::none) {
      result.origin.push_back(from.node);
      continue;
    }
    CutModel::Between between{i, incision::shares_of(mesh, from)};
    std::uint32_t origin = i;
    if (i >= n) { // a copy of one that has been moved, or new
      const auto at = std::ranges::lower_bound(
          moved, from, before_by_place,
          [&](std::uint32_t m) -> const incision::TetNodeOrigin& { return cut.origin[m]; });
      fresh[i] = at == moved.end() || !(cut.origin[*at] == from);
      origin = fresh[i] ? main_of(between.of) : *at;
    }
    result.origin.push_back(origin);
    result.between.push_back(std::move(between));
  }
  std::vector<double> mass(n, 0.0);
  std::vector<std::uint32_t> copies(n, 0);
  for (std::uint32_t i = 0; i < result.origin.size(); ++i)
    if (!fresh[i]) {
      mass[result.origin[i]] += cut.model.nodes[i].mass;
      ++copies[result.origin[i]];
    }
  for (std::uint32_t i = 0; i < result.origin.size(); ++i) {
    const std::uint32_t o = result.origin[i];
    result.share.push_back(fresh[i] ? 0 : copies[o] == 1 ? 1 : cut.model.nodes[i].mass / mass[o]);
  }
  result.place.resize(n);
  std::iota(result.place.begin(), result.place.end(), 0U);
  result.doubled = cut.report.doubled;
  result.model = std::move(cut.model);
  return result;
}

TriangleMesh plane_blade(const model::Model& model, const CutPlane& plane) {
  Box3 box;
  for (const model::Node& node : model.nodes)
    box.add(node.position);
  const Vec3 normal = plane.normal / norm(plane.normal), middle = (box.min + box.max) * 0.5;
  const Vec3 foot = middle - dot(normal, middle - plane.point) * normal;
  const double reach = 2 * norm(box.max - box.min) + 1;
  Vec3 u = some_perpendicular(normal);
  u = u * (reach / norm(u));
  const Vec3 v = cross(normal, u);
  TriangleMesh blade;
  blade.points = {foot - u - v, foot + u - v, foot + u + v, foot - u + v};
  blade.triangles = {{0, 1, 2}, {0, 2, 3}};
  return blade;
}

} // namespace gewebe::cutting
