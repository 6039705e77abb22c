// Models of finite elements that a blade cuts: whole, as heavy as before, drawn as before but for
// the wall, and weaker where they are cut.

#include "cutting/cut_solid.h"
#include "fem/model_stiffness.h"
#include "fem/solid_model.h"
#include "linalg/factor.h"
#include "mesh/check.h"
#include "tests/unit/complaint.h"
#include "tests/unit/larger.h"
#include "tet_cut_checks.h"
#include "tet_fixtures.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace gewebe::test {
namespace {

using test::blade_strip;

/// A box of 6 × 4 × 4 cells, 3 × 2 × 2 mm, of two materials, held at x = 0, with texture
/// coordinates that are linear in space on each side of a seam, and loads of lead at two nodes.
model::Model box_model(bool quadratic) {
  tetrahedra::TetMesh mesh = test::box_tetrahedra(6, 4, 4, 0.5);
  for (const Tetrahedron& t : mesh.tetrahedra) {
    double x = 0;
    for (const std::uint32_t corner : t)
      x += mesh.points[corner].x / 4;
    mesh.material.push_back(x < 1.5 ? 0 : 1);
  }
  fem::SolidModelOptions options;
  options.material.materials = {{"gel", 1.1e-3, 5000, 1, 0.2, 0.4},
                                {"stone", 2e-3, 20000, 1, 0.2, 0.2}};
  options.material.of_part = {0, 1};
  options.quadratic = quadratic;
  options.normals = true;
  model::Model model = fem::solid_model(std::move(mesh), options, {});
  for (model::Node& node : model.nodes)
    if (node.position.x == 0)
      node.fixed = model::fixed_all;
  model.nodes[5].mass += 0.5;
  model.nodes[20].mass += 0.25;
  std::rotate(model.triangles[3].begin(), model.triangles[3].begin() + 1, model.triangles[3].end());
  return model;
}

std::array<double, 2> texture_at(const Vec3& p, bool seam) {
  return {p.x - 2 * p.z + (seam ? 10 : 0), p.y + p.z};
}

void add_texcoords(model::Model& model) {
  for (std::size_t t = 0; t < model.triangles.size(); ++t) {
    std::array<double, 6> coordinates{};
    for (std::size_t c = 0; c < 3; ++c) {
      const auto [u, v] = texture_at(model.nodes[model.triangles[t][c]].position, t % 2 == 0);
      coordinates[2 * c] = u;
      coordinates[2 * c + 1] = v;
    }
    model.texcoords.push_back(coordinates);
  }
}

/// From above at x = 1.2, down to the middle.
TriangleMesh half_way() {
  return blade_strip({1.2, 1, 1.6}, {0.05, 2, 0}, {0.02, 0, 0.75}, 3);
}

cutting::SolidCut checked_cut(const model::Model& model, const TriangleMesh& blade) {
  cutting::SolidCut cut = cutting::cut_solid(model, blade);
  model::check_model(cut.model);
  EXPECT_EQ(cut.origin.size(), cut.model.nodes.size());
  EXPECT_EQ(cut.tetrahedron.size(), cut.model.tetrahedra.size());
  EXPECT_EQ(cut.triangle.size(), cut.model.triangles.size());
  EXPECT_NEAR(model::total_mass(cut.model), model::total_mass(model),
              1e-13 * model::total_mass(model));
  for (const model::Node& node : cut.model.nodes)
    EXPECT_GT(node.mass, 0);
  const TriangleMesh surface = model::surface_mesh(cut.model);
  EXPECT_NEAR(signed_volume(surface), 12, 1e-11);
  const mesh::MeshReport report = mesh::examine_mesh(surface);
  EXPECT_TRUE(report.closed() && report.oriented() && report.manifold());
  return cut;
}

class CutSolid : public testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Orders, CutSolid, testing::Bool());

TEST_P(CutSolid, IsWholeAndAsHeavyAsBefore) {
  const model::Model model = box_model(GetParam());
  const cutting::SolidCut cut = checked_cut(model, half_way());
  EXPECT_TRUE(cut.cut());
  EXPECT_GT(cut.report.doubled, 3U);
  // What else two nodes carry stays with them.
  EXPECT_GT(cut.model.nodes[5].mass, 0.5);
  EXPECT_GT(cut.model.nodes[20].mass, 0.25);
  // The surface is that of the elements.
  const tetrahedra::TetBoundary outer = tetrahedra::boundary(fem::element_mesh(cut.model));
  EXPECT_EQ(cut.model.triangles.size(), outer.mesh.triangles.size() * (GetParam() ? 4 : 1));
  double most = 0;
  for (const model::Node& node : cut.model.nodes)
    most = test::larger(most, node.drag / node.mass);
  EXPECT_NEAR(most, 1, 1e-12);
  for (std::size_t n = 0; n < model.nodes.size(); ++n)
    EXPECT_EQ(cut.model.nodes[n].fixed,
              model.nodes[n].position.x == 0 ? model::fixed_all : model::fixed_none);
  for (std::size_t n = model.nodes.size(); n < cut.model.nodes.size(); ++n)
    EXPECT_EQ(cut.model.nodes[n].fixed, model::fixed_none);
}

TEST_P(CutSolid, HoldsWhatStandsBetweenHeldNodes) {
  const model::Model model = box_model(GetParam());
  const cutting::SolidCut cut =
      checked_cut(model, blade_strip({1, 1.1, 1}, {3, 0.1, 0}, {0, 0.1, 3}));
  std::size_t fresh = 0;
  for (std::size_t n = 0; n < cut.model.nodes.size(); ++n) {
    EXPECT_EQ(cut.model.nodes[n].fixed,
              cut.model.nodes[n].position.x == 0 ? model::fixed_all : model::fixed_none)
        << n;
    fresh += n >= model.nodes.size() && cut.model.nodes[n].position.x == 0 ? 1 : 0;
  }
  EXPECT_GT(fresh, 3U);
  for (std::size_t n = 0; n < model.nodes.size(); ++n)
    if (model.nodes[n].fixed != model::fixed_none && cut.origin[n].node == n) {
      EXPECT_EQ(cut.model.nodes[n].position, model.nodes[n].position);
    }
}

/// Drag per mass of a node is the mean of the nodes that it stands between.
TEST_P(CutSolid, DragOfNewNodesIsTheMeanOfTheirParents) {
  model::Model model = box_model(GetParam());
  for (std::size_t n = 0; n < model.nodes.size(); ++n)
    model.nodes[n].drag = model.nodes[n].mass * static_cast<double>(1 + n % 7);
  const cutting::SolidCut cut = checked_cut(model, half_way());
  std::size_t several = 0;
  for (std::size_t n = 0; n < cut.model.nodes.size(); ++n) {
    const incision::TetNodeOrigin& from = cut.origin[n];
    const model::Node& node = cut.model.nodes[n];
    double rate = 0;
    int parents = 0;
    for (std::size_t k = 0; from.node == incision::TetNodeOrigin::none && k < 4; ++k)
      if (from.weights[k] != 0) {
        rate += static_cast<double>(1 + model.tetrahedra[from.tetrahedron][k] % 7);
        ++parents;
      }
    if (from.node != incision::TetNodeOrigin::none)
      rate = static_cast<double>(1 + from.node % 7);
    EXPECT_NEAR(node.drag / node.mass, rate / std::max(parents, 1), 1e-9) << n;
    several += parents > 1 ? 1 : 0;
  }
  EXPECT_GT(several, 3U);
}

Vec3 centre(const model::Model& model, std::size_t triangle) {
  Vec3 sum;
  for (const std::uint32_t corner : model.triangles[triangle])
    sum += model.nodes[corner].position / 3;
  return sum;
}

bool has_moved(const cutting::SolidCut& cut, std::size_t triangle, std::size_t before) {
  return std::ranges::any_of(cut.model.triangles[triangle], [&](std::uint32_t n) {
    return n < before && cut.origin[n].node == incision::TetNodeOrigin::none;
  });
}

/// Is a place in its plane within a triangle?
bool holds(const model::Model& model, std::size_t triangle, const Vec3& place) {
  const Triangle& t = model.triangles[triangle];
  const Vec3 &a = model.nodes[t[0]].position, &b = model.nodes[t[1]].position,
             &c = model.nodes[t[2]].position;
  const Vec3 normal = cross(b - a, c - a);
  return dot(cross(b - a, place - a), normal) >= -1e-12 &&
         dot(cross(c - b, place - b), normal) >= -1e-12 &&
         dot(cross(a - c, place - c), normal) >= -1e-12;
}

TEST_P(CutSolid, PartsOfTrianglesKeepTheirTexture) {
  model::Model model = box_model(GetParam());
  for (std::size_t t = 0; t < model.triangles.size(); ++t) // any corner may come first
    std::rotate(model.triangles[t].begin(),
                model.triangles[t].begin() + static_cast<std::ptrdiff_t>(t % 3),
                model.triangles[t].end());
  add_texcoords(model);
  const cutting::SolidCut cut = checked_cut(model, half_way());
  std::size_t walls = 0, parts = 0;
  ASSERT_EQ(cut.model.texcoords.size(), cut.model.triangles.size());
  for (std::size_t t = 0; t < cut.model.triangles.size(); ++t) {
    if (cut.triangle[t] == cutting::SolidCut::wall) {
      ++walls;
      EXPECT_EQ(cut.model.texcoords[t], (std::array<double, 6>{}));
      continue;
    }
    ASSERT_LT(cut.triangle[t], model.triangles.size());
    EXPECT_EQ(walls, 0U);
    parts += cut.model.triangles[t] == model.triangles[cut.triangle[t]] ? 0 : 1;
    EXPECT_TRUE(has_moved(cut, t, model.nodes.size()) ||
                holds(model, cut.triangle[t], centre(cut.model, t)));
    for (std::size_t c = 0; c < 3; ++c) {
      const auto [u, v] =
          texture_at(cut.model.nodes[cut.model.triangles[t][c]].position, cut.triangle[t] % 2 == 0);
      EXPECT_NEAR(cut.model.texcoords[t][2 * c], u, 1e-12) << t;
      EXPECT_NEAR(cut.model.texcoords[t][2 * c + 1], v, 1e-12);
    }
  }
  EXPECT_GT(walls, 20U);
  EXPECT_GT(parts, 10U);
}

TEST_P(CutSolid, NormalsLookOutOfBothWalls) {
  const model::Model model = box_model(GetParam());
  const cutting::SolidCut cut = checked_cut(model, half_way());
  ASSERT_EQ(cut.model.normals.size(), cut.model.nodes.size());
  std::vector<Vec3> sums(cut.model.nodes.size());
  for (const auto& [a, b, c] : cut.model.triangles) {
    const Vec3 &p = cut.model.nodes[a].position, &q = cut.model.nodes[b].position,
               &r = cut.model.nodes[c].position;
    for (const std::uint32_t corner : {a, b, c})
      sums[corner] += cross(q - p, r - p);
  }
  for (std::size_t n = 0; n < sums.size(); ++n)
    if (norm(sums[n]) > 1e-9) { // not where the front is flat
      EXPECT_LE(norm(cut.model.normals[n] - sums[n] / norm(sums[n])), 1e-9) << n;
    }
}

TEST_P(CutSolid, HeldNodesStayAndNewOnesHaveAMaterial) {
  model::Model model = box_model(GetParam());
  const TriangleMesh blade = blade_strip({1.4, 1, 1.6}, {0.05, 2, 0}, {0.6, 0, 0.75}, 3);
  const auto moved = [&](const cutting::SolidCut& cut, std::size_t n) {
    return cut.model.nodes[n].position != model.nodes[n].position;
  };
  const cutting::SolidCut free = checked_cut(model, blade);
  std::vector<std::size_t> held;
  for (std::size_t n = 0; n < model.nodes.size(); ++n)
    if (moved(free, n))
      held.push_back(n);
  ASSERT_GT(held.size(), 0U);
  for (const std::size_t n : held)
    model.nodes[n].fixed = model::fixed_y;
  const cutting::SolidCut cut = checked_cut(model, blade);
  std::size_t corners = 0;
  for (const std::size_t n : held) {
    const bool is_corner = std::ranges::any_of(
        model.tetrahedra, [&](const Tetrahedron& t) { return std::ranges::find(t, n) != t.end(); });
    corners += is_corner ? 1 : 0;
    EXPECT_FALSE(is_corner && moved(cut, n));
  }
  EXPECT_GT(corners, 0U);
  std::vector<std::int32_t> first(cut.model.nodes.size(), -1);
  const auto use = [&](std::uint32_t node, std::int32_t material) {
    if (first[node] == -1)
      first[node] = material;
  };
  for (std::size_t t = 0; t < cut.model.tetrahedra.size(); ++t) {
    for (const std::uint32_t n : cut.model.tetrahedra[t])
      use(n, cut.model.tetrahedron_material[t]);
    if (GetParam())
      for (const std::uint32_t n : cut.model.middles[t])
        use(n, cut.model.tetrahedron_material[t]);
  }
  for (std::size_t n = model.nodes.size(); n < first.size(); ++n)
    EXPECT_EQ(cut.model.nodes[n].material, first[n]);
}

/// How far the free end sinks under its weight.
double droop(const model::Model& model) {
  const linalg::StiffnessMatrix matrix = fem::stiffness_matrix(model);
  const std::vector<double> f = fem::weight_of(model, {0, 0, -9810});
  std::vector<double> u(f.size());
  linalg::solve_axes(matrix, linalg::Factor(matrix, {}), f, u);
  double lowest = 0;
  for (const double x : u)
    lowest = test::smaller(lowest, x);
  return lowest;
}

TEST_P(CutSolid, BendsMoreThanBefore) {
  const model::Model model = box_model(GetParam());
  const double before = droop(model);
  // Cutting into the side changes little more than the mesh; from above half way it is a hinge.
  const double slit =
      droop(cutting::cut_solid(model, blade_strip({1.2, 1, 1}, {0.5, 0, 0}, {0, 0.6, 0.05})).model);
  const double hinge = droop(cutting::cut_solid(model, half_way()).model);
  EXPECT_LT(before, 0);
  EXPECT_LT(hinge, 1.3 * before);
  EXPECT_LT(hinge, 1.15 * slit);
}

TEST_P(CutSolid, RefusesByName) {
  const model::Model model = box_model(GetParam());
  const auto refusal = [](const model::Model& of) {
    return test::complaint([&] { cutting::cut_solid(of, half_way()); });
  };
  EXPECT_EQ(refusal(model), "");
  model::Model other = model;
  other.tetrahedra.clear();
  EXPECT_NE(refusal(other).find("no tetrahedra"), std::string::npos);
  other = model;
  other.springs.push_back({0, 1, model::SpringKind::edge, 1, 0, 1});
  EXPECT_NE(refusal(other).find("1 springs"), std::string::npos);
  other = model;
  other.nodes[0].central = static_cast<std::int32_t>(other.nodes.size());
  other.nodes.emplace_back();
  EXPECT_NE(refusal(other).find("central"), std::string::npos);
  other = model;
  std::erase_if(other.triangles, [&](const Triangle& t) {
    return std::ranges::all_of(t, [&](std::uint32_t n) { return model.nodes[n].position.z == 2; });
  });
  EXPECT_NE(refusal(other).find("is not among the triangles"), std::string::npos);
}

TEST_P(CutSolid, ABladeBesideItChangesNothing) {
  model::Model model = box_model(GetParam());
  add_texcoords(model);
  const cutting::SolidCut cut =
      cutting::cut_solid(model, blade_strip({5, 5, 5}, {1, 0, 0}, {0, 1, 0}));
  EXPECT_EQ(cut.model, model);
  EXPECT_FALSE(cut.cut());
  EXPECT_EQ(cut.triangle.size(), model.triangles.size());
}

} // namespace
} // namespace gewebe::test
