// Models of finite elements: made of meshes, their stiffness beside springs, loads, selectors, and
// scenes of them against a solution made directly.

#include "contact/load.h"
#include "fem/model_stiffness.h"
#include "fem/solid_model.h"
#include "formats/model/ela.h"
#include "formats/store/stiffness_store.h"
#include "linalg/condition.h"
#include "linalg/factor.h"
#include "mesh/check.h"
#include "model/selector.h"
#include "scene/simulation.h"
#include "tests/unit/complaint.h"
#include "tests/unit/larger.h"
#include "tet_fixtures.h"
#include "tetrahedra/boundary.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <random>
#include <string>
#include <vector>

namespace gewebe {
namespace {

SolidModelOptions options(bool quadratic = true) {
  SolidModelOptions o;
  o.material.materials = {{"gel", 1.1e-3, 5000, 1, 0.2, 0.4}, {"stone", 2e-3, 20000, 1, 0.2, 0.2}};
  o.material.of_part = {0, 1};
  o.quadratic = quadratic;
  return o;
}

/// A box 2 × 2 × 2 whose inner nodes stand anywhere, of two materials, held at z = 0.
Model box_model(bool quadratic = true) {
  TetMesh mesh = test::distorted_box();
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t)
    mesh.material.push_back(t % 3 == 0);
  Model model = solid_model(std::move(mesh), options(quadratic), {});
  for (Node& node : model.nodes)
    if (node.position.z == 0)
      node.fixed = fixed_all;
  return model;
}

double largest(const std::vector<double>& v) {
  double most = 0;
  for (const double x : v)
    most = test::larger(most, std::abs(x));
  return most;
}

std::string complaint(TetMesh mesh, const SolidModelOptions& o) {
  return test::complaint([&] { return solid_model(std::move(mesh), o, {}); });
}

TEST(SolidModel, IsWholeAndHoldsTheSurfaceFirst) {
  for (const bool quadratic : {false, true}) {
    const Model model = box_model(quadratic);
    check_model(model);
    EXPECT_EQ(parse_ela(ela_text(model), "M"), model);
    const std::size_t surface = surface_count(model);
    for (std::size_t i = 0; i < model.nodes.size(); ++i) {
      const Vec3& p = model.nodes[i].position;
      const bool outside = p.x == 0 || p.x == 2 || p.y == 0 || p.y == 2 || p.z == 0 || p.z == 2;
      EXPECT_EQ(outside, i < surface) << i;
      EXPECT_GT(model.nodes[i].mass, 0);
      EXPECT_EQ(model.nodes[i].drag, model.nodes[i].mass);
    }
    double mass = 0;
    const TetMesh mesh = element_mesh(model);
    for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t)
      mass += solid_elements(mesh, element_materials(model))[t].volume *
              model.materials[static_cast<std::size_t>(model.tetrahedron_material[t])].density;
    EXPECT_NEAR(total_mass(model), mass, 1e-13 * mass);
    const MeshReport report = examine_mesh(surface_mesh(model));
    EXPECT_TRUE(report.manifold());
    EXPECT_TRUE(report.oriented());
    EXPECT_EQ(model.triangles.size(), quadratic ? 4U * 108 : 108U);
    EXPECT_EQ(components(model).count, 1U);
  }
}

TEST(SolidModel, NamesWhatItCantUse) {
  TetMesh mesh = test::box_tetrahedra(1, 1, 1);
  EXPECT_EQ(complaint(mesh, options()), "");
  make_quadratic(mesh);
  EXPECT_EQ(complaint(mesh, options(false)),
            "the mesh has quadratic elements, expected linear ones");
  mesh.points.back().x += 0.1;
  EXPECT_NE(complaint(mesh, options()).find("away from the middle of its edge"), std::string::npos);
  SolidModelOptions o = options();
  o.material.materials[0].poisson.reset();
  EXPECT_EQ(complaint(test::box_tetrahedra(1, 1, 1), o),
            "the material 'gel' has no Poisson's ratio, expected one");
  // What no element has needs none.
  EXPECT_EQ(complaint(test::box_tetrahedra(1, 1, 1), options()), "");
}

TEST(ModelStiffness, OfSpringsAndElementsAddsUp) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(-1, 1);
  for (const bool quadratic : {false, true}) {
    Model model = box_model(quadratic);
    std::vector<std::uint32_t> top;
    for (std::uint32_t i = 0; i < model.nodes.size(); ++i)
      if (model.nodes[i].position.z == 2)
        top.push_back(i);
    for (const std::uint32_t end : {top[3], top[7]})
      model.springs.push_back(
          {top[0], end, SpringKind::edge, 7000, 0,
           0.9 * norm(model.nodes[end].position - model.nodes[top[0]].position)});
    check_model(model);
    const StiffnessMatrix k = stiffness_matrix(model);
    std::vector<double> u(3 * model.nodes.size()), f(u.size()), x, y(k.order());
    for (std::size_t axis = 0; axis < u.size(); ++axis)
      u[axis] = is_fixed(model, axis / 3, static_cast<int>(axis % 3)) ? 0 : any(random);
    for (const std::int64_t axis : k.axis_of_row)
      x.push_back(u[static_cast<std::size_t>(axis)]);
    multiply(k, x, y);
    StiffnessOperator(model).multiply(u, f);
    for (std::size_t r = 0; r < y.size(); ++r)
      EXPECT_NEAR(y[r], f[static_cast<std::size_t>(k.axis_of_row[r])], 1e-13 * largest(f));
    // Both parts are in it.
    std::vector<double> springs(u.size()), solid(u.size());
    multiply_springs(model, stiffness_blocks(model), u, springs);
    Model without = model;
    without.springs.clear();
    multiply_stiffness(without, u, solid);
    EXPECT_GT(largest(springs), 0.01 * largest(f));
    EXPECT_GT(largest(solid), 0.01 * largest(f));
    for (std::size_t axis = 0; axis < u.size(); ++axis)
      EXPECT_NEAR(f[axis], springs[axis] + solid[axis], 1e-13 * largest(f));
    EXPECT_EQ(stiffness_matrix(without).order(), k.order());
  }
}

TEST(ModelStiffness, LeavesOutWhatElseIsHeld) {
  const Model model = box_model();
  std::vector<std::uint8_t> held(3 * model.nodes.size());
  const auto free = static_cast<std::size_t>(stiffness_matrix(model).axis_of_row[4]);
  held[free] = 1;
  const StiffnessMatrix k = stiffness_matrix(model, held);
  EXPECT_EQ(k.order() + 1, stiffness_matrix(model).order());
  EXPECT_EQ(k.row_of_axis[free], -1);
}

TEST(ModelWeight, IsConsistentAndWhole) {
  const Vec3 g{100, -200, -9810};
  Model model = box_model();
  const TetMesh mesh = element_mesh(model);
  const auto materials = element_materials(model);
  const std::vector<double> consistent =
      gravity_load(mesh, materials, solid_elements(mesh, materials), g);
  EXPECT_EQ(weight_of(model, g), consistent);
  // What a node weighs beside its elements counts too.
  model.nodes[7].mass += 2;
  const std::vector<double> more = weight_of(model, g);
  for (std::size_t axis = 0; axis < more.size(); ++axis)
    EXPECT_NEAR(more[axis] - consistent[axis],
                axis / 3 == 7 ? 2 * g[static_cast<int>(axis % 3)] : 0, 1e-10);
}

TEST(ModelPressure, OnAWholeSurfaceIsTheConsistentLoad) {
  for (const bool quadratic : {false, true}) {
    const Model model = box_model(quadratic);
    Load load;
    for (std::uint32_t i = 0; i < surface_count(model); ++i)
      load.pressure[i] = {250, 0};
    const Load now = load_at(load, model, 0);
    const TetMesh mesh = element_mesh(model);
    const TetBoundary surface = boundary(mesh);
    std::vector<std::uint32_t> all(surface.mesh.triangles.size());
    std::iota(all.begin(), all.end(), 0U);
    const std::vector<double> expected = pressure_load(mesh, surface, all, -250);
    std::vector<double> f(expected.size());
    for (const auto& [node, force] : now.force)
      for (int a = 0; a < 3; ++a)
        f[3 * std::size_t{node} + static_cast<std::size_t>(a)] = force[a];
    for (std::size_t axis = 0; axis < f.size(); ++axis)
      EXPECT_NEAR(f[axis], expected[axis], 1e-13 * largest(expected));
  }
}

TEST(SolidSelector, RangesOverTheSurfaceOrTheBody) {
  const Model model = box_model();
  const auto surface = static_cast<std::uint32_t>(surface_count(model));
  const auto count = [&](const char* text, SelectorScope scope) {
    return select_nodes(model, parse_selector(text), nullptr, scope).size();
  };
  const std::size_t body = model.nodes.size();
  ASSERT_GT(body, surface + 10);
  for (const SelectorScope scope : {SelectorScope::surface, SelectorScope::body}) {
    EXPECT_EQ(count("surface", scope), surface);
    EXPECT_EQ(count("inside", scope), body - surface);
    EXPECT_EQ(count("all", scope), body);
    EXPECT_EQ(count("not surface or surface", scope),
              scope == SelectorScope::body ? body : surface);
    EXPECT_EQ(count("inside or z<10", scope), body);
    EXPECT_EQ(select_nodes(model, parse_selector(std::to_string(body - 1)), nullptr, scope),
              std::vector<std::uint32_t>{static_cast<std::uint32_t>(body - 1)});
  }
  EXPECT_LT(count("z<1.5", SelectorScope::surface), count("z<1.5", SelectorScope::body));
}

TEST(SolidScene, IsWhatTheFactorSays) {
  const Model model = box_model();
  std::uint32_t pulled = 0;
  for (std::uint32_t i = 0; i < surface_count(model); ++i)
    if (model.nodes[i].position.z == 2)
      pulled = i;
  Simulation scene(Context{}, {});
  scene.add_object("o", model, Method::ffe, {});
  scene.apply(SetGravity{{0, 0, -9810}});
  scene.apply(SetForce{0, {pulled}, {200, 0, 500}});
  scene.step(0.01);
  const StiffnessMatrix k = stiffness_matrix(model);
  std::vector<double> f = weight_of(model, {0, 0, -9810}), u(f.size());
  f[3 * std::size_t{pulled}] += 200;
  f[3 * std::size_t{pulled} + 2] += 500;
  solve_axes(k, Factor(k, {}), f, u);
  const std::span<const double> shown = scene.displacement(0);
  for (std::size_t axis = 0; axis < u.size(); ++axis)
    EXPECT_NEAR(shown[axis], u[axis], 1e-12 * largest(u));
  // A node that is displaced to where the force took it needs that force.
  Simulation other(Context{}, {});
  other.add_object("o", model, Method::ffe, {});
  other.apply(SetGravity{{0, 0, -9810}});
  other.apply(SetDisplacement{0,
                              {pulled},
                              {u[3 * std::size_t{pulled}], u[3 * std::size_t{pulled} + 1],
                               u[3 * std::size_t{pulled} + 2]}});
  other.step(0.01);
  const std::vector<NodeVector> forces = other.contact_forces(0);
  ASSERT_EQ(forces.size(), 1U);
  EXPECT_NEAR(forces[0].value.x, 200, 1e-7);
  EXPECT_NEAR(forces[0].value.y, 0, 1e-7);
  EXPECT_NEAR(forces[0].value.z, 500, 1e-7);
}

TEST(SolidCondition, NamesThePartThatFloats) {
  Model model = box_model();
  const auto offset = static_cast<std::uint32_t>(model.nodes.size());
  const Model one = solid_model(test::box_tetrahedra(1, 1, 1), options(), {});
  for (Node node : one.nodes) {
    node.position.x += 10;
    model.nodes.push_back(node);
  }
  for (std::size_t t = 0; t < one.tetrahedra.size(); ++t) {
    Tetrahedron corners = one.tetrahedra[t];
    EdgeMiddles middles = one.middles[t];
    for (std::uint32_t& corner : corners)
      corner += offset;
    for (std::uint32_t& middle : middles)
      middle += offset;
    model.tetrahedra.push_back(corners);
    model.middles.push_back(middles);
    model.tetrahedron_material.push_back(0);
  }
  check_model(model);
  try {
    const StiffnessMatrix k = stiffness_matrix(model);
    StiffnessCheck check;
    (void)checked_factor(model, k, {}, check);
    ADD_FAILURE() << "it is held";
  } catch (const SingularStiffness& error) {
    EXPECT_NE(std::string(error.what())
                  .find("component 1 is held by nothing: it can move and turn "
                        "as a rigid body"),
              std::string::npos)
        << error.what();
  }
}

TEST(StiffnessHash, SeesElementsAndTheirMaterial) {
  const Model model = box_model();
  const auto hash = [&](auto&& edit) {
    Model m = model;
    edit(m);
    return stiffness_hash(m);
  };
  const std::uint64_t same = stiffness_hash(model);
  EXPECT_NE(same, hash([](Model& m) { m.materials[1].poisson = 0.21; }));
  EXPECT_NE(same, hash([](Model& m) { m.materials[1].young *= 2; }));
  EXPECT_NE(same, hash([](Model& m) { m.materials[1].density *= 2; }));
  EXPECT_NE(same, hash([](Model& m) { m.tetrahedron_material[0] ^= 1; }));
  EXPECT_NE(same, hash([](Model& m) { std::swap(m.tetrahedra[0], m.tetrahedra[1]); }));
  EXPECT_NE(same, hash([](Model& m) { std::swap(m.middles[0][0], m.middles[0][1]); }));
  EXPECT_EQ(same, hash([](Model& m) { m.materials[1].name = "rock"; }));
  EXPECT_EQ(same, hash([](Model& m) { m.materials[1].damping_ratio = 1; }));
}

} // namespace
} // namespace gewebe
