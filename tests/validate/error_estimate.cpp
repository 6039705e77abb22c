// Estimated errors of forces and displacements against those that finer meshes show.

#include "fem/stress_error.h"
#include "tests/validate/checks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace gewebe::validate {

namespace {

using test::Solid, test::SolidCase;

constexpr int cases = 200;
constexpr double wanted_share = 0.9; ///< of cases whose estimate is within a factor of 2

/// A mesh and the places that its nodes had in a box, by which regions are found.
struct Body {
  tetrahedra::TetMesh mesh;
  std::vector<Vec3> box;
};

/// Each tetrahedron becomes eight.
Body refined(const Body& coarse) {
  Body fine = coarse;
  fine.mesh.tetrahedra.clear();
  fine.mesh.material.clear();
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
  const auto middle = [&](std::uint32_t a, std::uint32_t b) {
    const auto [found, added] =
        middles.emplace(std::minmax(a, b), static_cast<std::uint32_t>(fine.mesh.points.size()));
    if (added) {
      fine.mesh.points.push_back(0.5 * (fine.mesh.points[a] + fine.mesh.points[b]));
      fine.box.push_back(0.5 * (fine.box[a] + fine.box[b]));
    }
    return found->second;
  };
  for (std::size_t t = 0; t < coarse.mesh.tetrahedra.size(); ++t) {
    const auto [a, b, c, d] = coarse.mesh.tetrahedra[t];
    const std::uint32_t ab = middle(a, b), bc = middle(b, c), ac = middle(a, c), ad = middle(a, d),
                        bd = middle(b, d), cd = middle(c, d);
    const std::array<Tetrahedron, 8> children{{{a, ab, ac, ad},
                                               {ab, b, bc, bd},
                                               {ac, bc, c, cd},
                                               {ad, bd, cd, d},
                                               {ab, bc, ac, bd},
                                               {ab, ac, ad, bd},
                                               {ac, bc, cd, bd},
                                               {ac, cd, ad, bd}}};
    for (const Tetrahedron& child : children) {
      fine.mesh.tetrahedra.push_back(child);
      fine.mesh.material.push_back(coarse.mesh.material[t]);
    }
  }
  return fine;
}

enum class Kind { traction, weight, moved_end, punch };

/// What a random case is made of.
struct Recipe {
  std::array<std::uint32_t, 3> cells{};
  int form = 0; ///< box, bent, twisted, ball
  Kind kind = Kind::traction;
  double poisson = 0.45, contrast = 1;
  Vec3 direction;
};

Recipe random_recipe(std::mt19937& random) {
  const auto pick = [&](int from, int to) {
    return std::uniform_int_distribution<int>(from, to)(random);
  };
  std::uniform_real_distribution<double> unit(0, 1);
  Recipe r;
  r.cells = {static_cast<std::uint32_t>(pick(2, 4)), 2, 2};
  r.form = pick(0, 3);
  r.kind = static_cast<Kind>(pick(0, 3));
  r.poisson = 0.3 + 0.19 * unit(random);
  r.contrast = pick(0, 2) == 0 ? 0.2 + 4 * unit(random) : 1;
  r.direction = {unit(random) - 0.5, unit(random) - 0.5, unit(random) - 0.5};
  return r;
}

Body make_body(const Recipe& r) {
  Body body{test::box_tetrahedra(r.cells[0], r.cells[1], r.cells[2]), {}};
  for (Vec3& p : body.mesh.points) {
    const Vec3 q{p.x / r.cells[0], p.y / r.cells[1], p.z / r.cells[2]};
    body.box.push_back(q);
    const double c = std::cos(q.x), s = std::sin(q.x);
    const Vec3 centred = 2 * q - Vec3{1, 1, 1};
    const double most = std::max({std::abs(centred.x), std::abs(centred.y), std::abs(centred.z)});
    if (r.form == 1)
      p = {20 * s - 8 * q.z * s, 10 * q.y, 20 * (1 - c) + 8 * q.z * c};
    else if (r.form == 2)
      p = {20 * q.x, 8 * (centred.y * c - centred.z * s), 8 * (centred.y * s + centred.z * c)};
    else if (r.form == 3)
      p = norm(centred) > 0 ? (8 * (0.5 + 0.5 * most / norm(centred))) * centred : Vec3{};
    else
      p = {10.0 * r.cells[0] / 3 * q.x, 10 * q.y, 10 * q.z};
  }
  for (const Tetrahedron& t : body.mesh.tetrahedra) {
    double x = 0;
    for (const std::uint32_t corner : t)
      x += body.box[corner].x / 4;
    body.mesh.material.push_back(x > 0.5 ? 1 : 0);
  }
  return body;
}

/// Twice the energy, and its estimated error.
struct Energy {
  double value = 0, error = 0;
};

Energy solve(const Recipe& r, const Body& body, bool quadratic) {
  const double young = 1e4;
  SolidCase c{
      {body.mesh, quadratic, {{young, r.poisson, 1e-3}, {young * r.contrast, r.poisson, 1e-3}}},
      {},
      {},
      {}};
  Solid& solid = c.solid;
  std::vector<Vec3> box = body.box;
  box.resize(solid.mesh.points.size());
  for (std::size_t t = 0; quadratic && t < solid.mesh.tetrahedra.size(); ++t)
    for (std::size_t k = 0; k < 6; ++k)
      box[solid.mesh.middles[t][k]] =
          0.5 * (box[solid.mesh.tetrahedra[t][tetrahedra::tetrahedron_edges[k][0]]] +
                 box[solid.mesh.tetrahedra[t][tetrahedra::tetrahedron_edges[k][1]]]);
  const auto pressed = [&](const Vec3& q) { // whole triangles of the coarsest mesh
    return q.z > 1 - 1e-9 && q.y < 0.5 + 1e-9 && q.x > 1 - 1.0 / r.cells[0] - 1e-9;
  };
  c.given.resize(solid.fixed.size());
  c.load.resize(solid.fixed.size());
  for (std::size_t i = 0; i < box.size(); ++i)
    for (std::size_t a = 0; a < 3; ++a) {
      const bool base = r.kind == Kind::punch ? box[i].z < 1e-9 : box[i].x < 1e-9;
      const bool led = (r.kind == Kind::moved_end && box[i].x > 1 - 1e-9) ||
                       (r.kind == Kind::punch && a == 2 && pressed(box[i]));
      solid.fixed[3 * i + a] = base || led ? 1 : 0;
      if (led)
        c.given[3 * i + a] = r.kind == Kind::punch ? -0.5 : r.direction[static_cast<int>(a)];
    }
  if (r.kind == Kind::weight)
    c.load = fem::gravity_load(solid.mesh, solid.materials, solid.elements, 9810 * r.direction);
  if (r.kind == Kind::traction) {
    const tetrahedra::TetBoundary faces = tetrahedra::boundary(solid.mesh);
    std::vector<std::uint32_t> end;
    for (std::uint32_t k = 0; k < faces.mesh.triangles.size(); ++k)
      if (std::ranges::all_of(faces.mesh.triangles[k], [&](std::uint32_t corner) {
            return box[faces.node[corner]].x > 1 - 1e-9;
          }))
        end.push_back(k);
    c.load = fem::traction_load(solid.mesh, faces, end, 100 * r.direction);
  }
  const std::vector<double> u = displacements(c);
  std::vector<double> held(u.size());
  fem::multiply_solid(solid.mesh, solid.elements, u, held);
  const Vec3 gravity = r.kind == Kind::weight ? 9810 * r.direction : Vec3{};
  const fem::StressError error = fem::stress_error(
      solid.mesh, solid.elements,
      fem::solid_stresses(solid.elements, fem::solid_strains(solid.mesh, solid.materials,
                                                             solid.elements, u, gravity)));
  return {std::inner_product(u.begin(), u.end(), held.begin(), 0.0),
          std::accumulate(error.energy.begin(), error.energy.end(), 0.0)};
}

} // namespace

Section error_estimates() {
  std::mt19937 random(54);
  Section section{"Estimated errors",
                  "Error of the energy, and so of forces at given displacements and of "
                  "displacements under given forces, as `ffe-run --estimate` has it, over that "
                  "which meshes with 8 and 64 times as many elements show (extrapolated).",
                  {},
                  {}};
  std::array<int, 2> good{}, all{};
  std::array<Curve, 2> curves{{{"linear", {}}, {"quadratic", {}}}};
  for (int k = 0; k < cases; ++k) {
    const Recipe recipe = random_recipe(random);
    const Body coarse = make_body(recipe), middle = refined(coarse), fine = refined(middle);
    const std::size_t quadratic = k % 2 == 0 ? 0 : 1;
    // Linear elements need smaller cells for any answer worth an estimate.
    const Energy found =
        quadratic != 0 ? solve(recipe, coarse, true) : solve(recipe, middle, false);
    const double a = solve(recipe, coarse, true).value, b = solve(recipe, middle, true).value,
                 c = solve(recipe, fine, true).value;
    const double limit = c - (b - c) * (b - c) / ((a - b) - (b - c)); // Aitken
    const double truth = std::abs(found.value - limit);
    const double effectivity = found.error / truth;
    ++all[quadratic];
    good[quadratic] += effectivity >= 0.5 && effectivity <= 2 ? 1 : 0;
    curves[quadratic].points.push_back({truth / limit, effectivity});
  }
  for (const std::size_t quadratic : {0U, 1U}) {
    const double share = static_cast<double>(good[quadratic]) / all[quadratic];
    Check check;
    check.what = std::string(quadratic != 0 ? "quadratic" : "linear") + " elements, " +
                 std::to_string(all[quadratic]) + " random bodies";
    check.source = "finer meshes";
    check.reference = "0.5 to 2 in 90 %";
    check.figure = percent(share) + " of them";
    check.error = 1 - share;
    check.bound = 1 - wanted_share;
    section.checks.push_back(check);
  }
  section.plots.push_back({"estimates.svg",
                           "Estimated over true error",
                           "true relative error",
                           "estimated over true",
                           {curves.begin(), curves.end()}});
  return section;
}

} // namespace gewebe::validate
