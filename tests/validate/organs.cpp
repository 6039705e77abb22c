#include "tests/validate/organs.h"

#include "antialiasing/distance_ramp.h"
#include "stuffing/stuffing.h"
#include "tests/unit/mesh_fixtures.h"
#include "tests/validate/peers.h"
#include "tetrahedra/components.h"
#include "tetrahedra/order.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

namespace gewebe::validate {

volume::Grid organ_volume(const Organ& organ, double voxel) {
  return antialiasing::jones_density({}, organ.surface, volume::uniform_transform(voxel),
                                     voxelization::OpenMesh::fill);
}

namespace {

/// What a triangle's nodes have of the patch's weight: 3 corners, then the middles of edges 01, 12,
/// 20 of a quadratic one. By the centroids of 16² parts, as the weight is smooth and the same parts
/// make the total.
std::array<double, 6> weights(const std::array<Vec3, 3>& corner, const Vec3& centre,
                              bool quadratic) {
  constexpr int parts = 16;
  const double area =
      norm(cross(corner[1] - corner[0], corner[2] - corner[0])) / 2 / (parts * parts);
  std::array<double, 6> sum{};
  for (int i = 0; i < parts; ++i)
    for (int j = 0; i + j < parts; ++j)
      for (const bool upper : {false, true}) {
        if (upper && i + j + 1 >= parts)
          continue;
        const double shift = upper ? 2.0 / 3 : 1.0 / 3, a = (i + shift) / parts,
                     b = (j + shift) / parts, c = 1 - a - b;
        const Vec3 d = c * corner[0] + a * corner[1] + b * corner[2] - centre;
        const double inside = 1 - dot(d, d) / (patch_radius * patch_radius);
        if (!(inside > 0))
          continue;
        const double w = inside * inside * area;
        const std::array<double, 6> shape =
            quadratic ? std::array<double, 6>{c * (2 * c - 1), a * (2 * a - 1), b * (2 * b - 1),
                                              4 * c * a,       4 * a * b,       4 * b * c}
                      : std::array<double, 6>{c, a, b};
        for (std::size_t k = 0; k < 6; ++k)
          sum[k] += w * shape[k];
      }
  return sum;
}

/// What lies above a plane z of a mesh of corners: tetrahedra that it cuts are cut along it, so
/// that what is held there does not hang on where nodes are. Nodes nearer than `near` are moved
/// onto it.
void cut_below(tetrahedra::TetMesh& mesh, double plane, double near) {
  for (Vec3& p : mesh.points)
    if (std::abs(p.z - plane) <= near)
      p.z = plane;
  std::map<std::array<std::uint32_t, 2>, std::uint32_t> cuts; // of an edge, lower end first
  const auto cut = [&](std::uint32_t below, std::uint32_t above) {
    const auto [it, fresh] =
        cuts.try_emplace({below, above}, static_cast<std::uint32_t>(mesh.points.size()));
    if (fresh) {
      const Vec3 low = mesh.points[below], high = mesh.points[above];
      Vec3 p = low + (plane - low.z) / (high.z - low.z) * (high - low);
      p.z = plane;
      mesh.points.push_back(p);
    }
    return it->second;
  };
  const auto z = [&](std::uint32_t node) { return mesh.points[node].z; };
  std::vector<Tetrahedron> kept;
  for (const Tetrahedron& t : mesh.tetrahedra) {
    if (std::ranges::all_of(t, [&](std::uint32_t n) { return z(n) <= plane; }))
      continue;
    if (std::ranges::all_of(t, [&](std::uint32_t n) { return z(n) >= plane; })) {
      kept.push_back(t);
      continue;
    }
    // The faces of what is left, and that on the plane from their edges there.
    std::vector<std::vector<std::uint32_t>> faces;
    std::map<std::uint32_t, std::uint32_t> next;
    for (const auto& corners : tetrahedra::tetrahedron_faces) {
      std::vector<std::uint32_t> face;
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t a = t[corners[k]], b = t[corners[(k + 1) % 3]];
        if (z(a) >= plane)
          face.push_back(a);
        if (z(a) < plane && z(b) > plane)
          face.push_back(cut(a, b));
        else if (z(a) > plane && z(b) < plane)
          face.push_back(cut(b, a));
      }
      if (face.size() < 3)
        continue;
      for (std::size_t k = 0; k < face.size(); ++k)
        if (const std::uint32_t b = face[(k + 1) % face.size()];
            z(face[k]) == plane && z(b) == plane)
          next[b] = face[k]; // the other way round
      faces.push_back(std::move(face));
    }
    std::vector<std::uint32_t> cap{next.begin()->first};
    while (next.at(cap.back()) != cap.front())
      cap.push_back(next.at(cap.back()));
    faces.push_back(std::move(cap));
    // A fan of the least node of all to fans of the least nodes of faces, which neighbours share.
    std::uint32_t apex = UINT32_MAX;
    for (const auto& face : faces)
      apex = test::smaller(apex, *std::ranges::min_element(face));
    for (auto& face : faces) {
      if (std::ranges::find(face, apex) != face.end())
        continue;
      std::ranges::rotate(face, std::ranges::min_element(face));
      for (std::size_t k = 2; k < face.size(); ++k)
        kept.push_back({face[0], face[k], face[k - 1], apex}); // faces look outward
    }
  }
  mesh.tetrahedra = std::move(kept);
}

} // namespace

Organ load_organ(const std::string& file, double unit, double held, const Vec3& outwards) {
  Organ organ{test::load_test_mesh(file), 0, {}, -outwards};
  const TriangleMesh& mesh = organ.surface;
  Vec3 centre;
  for (Vec3& p : organ.surface.points) {
    p *= unit;
    centre += p / static_cast<double>(mesh.points.size());
  }
  if (mesh.triangles.empty())
    return organ;
  const Box3 box = bounding_box(mesh);
  organ.plane = box.min.z + held * box.size().z;
  double farthest = 0;
  for (const auto& [a, b, c] : mesh.triangles) { // Möller, Trumbore 1997
    const Vec3 u = mesh.points[b] - mesh.points[a], v = mesh.points[c] - mesh.points[a],
               from = centre - mesh.points[a], p = cross(outwards, v), q = cross(from, u);
    const double determinant = dot(u, p), s = dot(from, p) / determinant,
                 t = dot(outwards, q) / determinant;
    if (s >= 0 && t >= 0 && s + t <= 1 && dot(v, q) / determinant > farthest)
      farthest = dot(v, q) / determinant;
  }
  if (!(farthest > 0))
    throw Error(file + " is not met by a line from its middle");
  organ.patch = centre + farthest * outwards;
  return organ;
}

test::SolidCase organ_case(const Organ& organ, const volume::Grid& volume, double cell,
                           unsigned grade, bool quadratic, const fem::SolidMaterial& material,
                           Hold hold) {
  stuffing::StuffingOptions options;
  options.cell = cell;
  options.grade = grade;
  tetrahedra::TetMesh mesh = stuffing::stuff({}, volume, options);
  if (hold == Hold::cut)
    cut_below(mesh, organ.plane, 0.05 * cell);
  (void)tetrahedra::keep_components(mesh, {.largest = 1});
  test::SolidCase c{{std::move(mesh), quadratic, {material}}, {}, {}, {}};
  for (std::size_t axis = 0; axis < 3; ++axis)
    c.solid.hold(axis, [&](const Vec3& p) { return p.z <= organ.plane; });
  const tetrahedra::TetBoundary faces = tetrahedra::boundary(c.solid.mesh);
  std::vector<double> weight(c.solid.mesh.points.size());
  double total = 0;
  for (std::size_t t = 0; t < faces.mesh.triangles.size(); ++t) {
    std::array<Vec3, 3> corner;
    for (std::size_t k = 0; k < 3; ++k)
      corner[k] = faces.mesh.points[faces.mesh.triangles[t][k]];
    const std::array<double, 6> of = weights(corner, organ.patch, quadratic);
    for (std::size_t k = 0; k < (quadratic ? 6 : 3); ++k) {
      weight[k < 3 ? faces.node[faces.mesh.triangles[t][k]] : faces.middles[t][k - 3]] += of[k];
      total += of[k];
    }
  }
  c.load.resize(c.solid.fixed.size());
  for (std::size_t i = 0; i < weight.size(); ++i)
    for (int axis = 0; axis < 3; ++axis)
      c.load[3 * i + static_cast<std::size_t>(axis)] =
          patch_force / total * weight[i] * organ.direction[axis];
  c.read = [load = c.load](const test::Solid&, const std::vector<double>& u) {
    double work = 0;
    for (std::size_t axis = 0; axis < u.size(); ++axis)
      work += load[axis] * u[axis];
    return work / patch_force;
  };
  return c;
}

namespace {

/// Cells of 6, 5 and 4 mm among themselves, and each beside the peer.
void spleen(Section& section) {
  const std::string source = "surface: Browne et al., HuBMAP CCF 3D Reference Object Library, "
                             "female spleen (CC BY 4.0)";
  const Organ organ = load_organ("hubmap_F_spleen_uv.obj", 1000, 0.1, {1, 0, 0});
  if (organ.surface.triangles.empty()) {
    section.checks.push_back(skipped("spleen", source, "no hubmap_F_spleen_uv.obj"));
    return;
  }
  const fem::SolidMaterial tissue{5000, 0.45, 1e-3};
  const volume::Grid volume = organ_volume(organ, 1);
  const auto at = [&](double cell, bool quadratic, Hold hold = Hold::cut) {
    return organ_case(organ, volume, cell, cell > 4.5 ? 0 : 1, quadratic, tissue, hold);
  };
  const Figure finest = figure_of(at(3.5, true));
  Figure middle{}; // cells of 6 mm
  const auto line = [&](const std::string& what, double reference, const Figure& found,
                        double bound) {
    Check check{"spleen, " + what,
                source,
                text_of(reference),
                text_of(found.value),
                std::abs(found.value / reference - 1),
                bound,
                {},
                found.cost};
    check.judged = bound > 0;
    section.checks.push_back(check);
  };
  Plot plot{"spleen.svg",
            "Spleen under 0.1 N on a patch: cells of 3.5 mm are the reference",
            "seconds of one processor",
            "error of the patch's displacement",
            {}};
  Curve ours{"Gewebe, quadratic", {}}, linear{"Gewebe, linear", {}},
      theirs{"scikit-fem, plain quadratic", {}};
  const auto add = [&](Curve& curve, const Figure& f) {
    curve.points.push_back({f.cost.total() / 1000, std::abs(f.value / finest.value - 1)});
  };
  for (const double cell : {8.0, 6.0, 5.0, 4.0}) {
    const test::SolidCase c = at(cell, true);
    const Figure found = figure_of(c);
    const std::string name = "cells of " + text_of(cell) + " mm";
    add(ours, found);
    if (cell == 6)
      middle = found;
    line(name + " against 3.5 mm", finest.value, found, cell < 7 ? 0.02 : 0);
    if (cell > 7)
      continue;
    if (const auto peer = figure_by_peer(c, PeerElement::plain)) {
      add(theirs, *peer);
      line(name + " against scikit-fem's plain quadratic elements", peer->value, found, 0.02);
    } else {
      section.checks.push_back(
          skipped("spleen, " + name + " against plain quadratic elements", source, no_peer));
    }
  }
  line("cells of 6 mm, of voxels of 2 against 1 mm", middle.value,
       figure_of(organ_case(organ, organ_volume(organ, 2), 6, 0, true, tissue)), 0.02);
  for (const double cell : {6.0, 4.0, 3.0}) {
    const Figure found = figure_of(at(cell, false));
    add(linear, found);
    line("linear elements, cells of " + text_of(cell) + " mm", finest.value, found, 0);
  }
  for (const double cell : {6.0, 4.0})
    line("nodes held instead, cells of " + text_of(cell) + " mm", finest.value,
         figure_of(at(cell, true, Hold::nodes)), 0);
  plot.curves = {ours, linear};
  if (!theirs.points.empty())
    plot.curves.push_back(theirs);
  section.plots.push_back(plot);
}

/// What halving the voxels, and what halving the cells changes.
void liver(Section& section) {
  const std::string source = "surface: SOFA, share/mesh/liver-smooth.obj (LGPL)";
  const Organ organ = load_organ("sofa_liver_smooth.obj", 10, 0.25, {0, 0, 1});
  if (organ.surface.triangles.empty()) {
    section.checks.push_back(skipped("liver", source, "no sofa_liver_smooth.obj"));
    return;
  }
  const fem::SolidMaterial tissue{5000, 0.49, 1e-3};
  const auto at = [&](double voxel, double cell, unsigned grade) {
    return figure_of(organ_case(organ, organ_volume(organ, voxel), cell, grade, true, tissue));
  };
  const auto line = [&](const std::string& what, const Figure& coarse, const Figure& fine) {
    section.checks.push_back({"liver, " + what,
                              source,
                              text_of(fine.value),
                              text_of(coarse.value),
                              std::abs(coarse.value / fine.value - 1),
                              0.02,
                              {},
                              coarse.cost});
  };
  const Figure middle = at(1, 5, 0);
  line("cells of 5 mm, halved", middle, at(1, 2.5, 1));
  line("voxels of 2 mm, halved", at(2, 5, 0), middle);
  line("voxels of 1 mm, halved", middle, at(0.5, 5, 0));
}

} // namespace

Section organs() {
  Section section{"Organs under a load on a patch",
                  "A spleen (190 cm³, ν = 0.45) is held at its lowest tenth, a small liver (39 "
                  "cm³, ν = 0.49) at its lowest quarter; E = 5 kPa. 0.1 N presses on a patch. "
                  "Surfaces become volumes with voxels of 1 mm, then tetrahedra. The figures are "
                  "the mean displacement of the patch along the force in mm.\n\n"
                  "Loads and supports are defined by positions, not by nodes, so that meshes can "
                  "be compared. The load is a traction t (1 - (r/R)²)² on the surface within R = 6 "
                  "mm of a point, integrated over triangles and scaled to 0.1 N. The mean has the "
                  "same weights, so it is the work of the force over the force. Tissue is fixed "
                  "below a plane that cuts tetrahedra; lines show the effect of holding nodes "
                  "below the plane instead. Linear elements are shown for comparison.",
                  {},
                  {}};
  spleen(section);
  liver(section);
  return section;
}

} // namespace gewebe::validate
