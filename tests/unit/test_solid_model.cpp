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

namespace gewebe::test {
namespace {

fem::SolidModelOptions options(bool quadratic = true) {
  fem::SolidModelOptions o;
  o.material.materials = {{"gel", 1.1e-3, 5000, 1, 0.2, 0.4}, {"stone", 2e-3, 20000, 1, 0.2, 0.2}};
  o.material.of_part = {0, 1};
  o.quadratic = quadratic;
  return o;
}

/// A box 2 × 2 × 2 whose inner nodes stand anywhere, of two materials, held at z = 0.
model::Model box_model(bool quadratic = true) {
  tetrahedra::TetMesh mesh = test::distorted_box();
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t)
    mesh.material.push_back(t % 3 == 0);
  model::Model model = fem::solid_model(std::move(mesh), options(quadratic), {});
  for (model::Node& node : model.nodes)
    if (node.position.z == 0)
      node.fixed = model::fixed_all;
  return model;
}

double largest(const std::vector<double>& v) {
  double most = 0;
  for (const double x : v)
    most = test::larger(most, std::abs(x));
  return most;
}

std::string complaint(tetrahedra::TetMesh mesh, const fem::SolidModelOptions& o) {
  return test::complaint([&] { return fem::solid_model(std::move(mesh), o, {}); });
}

TEST(SolidModel, IsWholeAndHoldsTheSurfaceFirst) {
  for (const bool quadratic : {false, true}) {
    const model::Model model = box_model(quadratic);
    model::check_model(model);
    EXPECT_EQ(formats::parse_ela(formats::ela_text(model), "M"), model);
    const std::size_t surface = model::surface_count(model);
    for (std::size_t i = 0; i < model.nodes.size(); ++i) {
      const Vec3& p = model.nodes[i].position;
      const bool outside = p.x == 0 || p.x == 2 || p.y == 0 || p.y == 2 || p.z == 0 || p.z == 2;
      EXPECT_EQ(outside, i < surface) << i;
      EXPECT_GT(model.nodes[i].mass, 0);
      EXPECT_EQ(model.nodes[i].drag, model.nodes[i].mass);
    }
    double mass = 0;
    const tetrahedra::TetMesh mesh = fem::element_mesh(model);
    for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t)
      mass += fem::solid_elements(mesh, fem::element_materials(model))[t].volume *
              model.materials[static_cast<std::size_t>(model.tetrahedron_material[t])].density;
    EXPECT_NEAR(model::total_mass(model), mass, 1e-13 * mass);
    const mesh::MeshReport report = mesh::examine_mesh(model::surface_mesh(model));
    EXPECT_TRUE(report.manifold());
    EXPECT_TRUE(report.oriented());
    EXPECT_EQ(model.triangles.size(), quadratic ? 4U * 108 : 108U);
    EXPECT_EQ(model::components(model).count, 1U);
  }
}

TEST(SolidModel, NamesWhatItCantUse) {
  tetrahedra::TetMesh mesh = test::box_tetrahedra(1, 1, 1);
  EXPECT_EQ(complaint(mesh, options()), "");
  tetrahedra::make_quadratic(mesh);
  EXPECT_EQ(complaint(mesh, options(false)),
            "the mesh has quadratic elements, expected linear ones");
  mesh.points.back().x += 0.1;
  EXPECT_NE(complaint(mesh, options()).find("away from the middle of its edge"), std::string::npos);
  fem::SolidModelOptions o = options();
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
    model::Model model = box_model(quadratic);
    std::vector<std::uint32_t> top;
    for (std::uint32_t i = 0; i < model.nodes.size(); ++i)
      if (model.nodes[i].position.z == 2)
        top.push_back(i);
    for (const std::uint32_t end : {top[3], top[7]})
      model.springs.push_back(
          {top[0], end, model::SpringKind::edge, 7000, 0,
           0.9 * norm(model.nodes[end].position - model.nodes[top[0]].position)});
    model::check_model(model);
    const linalg::StiffnessMatrix k = fem::stiffness_matrix(model);
    std::vector<double> u(3 * model.nodes.size()), f(u.size()), x, y(k.order());
    for (std::size_t axis = 0; axis < u.size(); ++axis)
      u[axis] = contact::is_fixed(model, axis / 3, static_cast<int>(axis % 3)) ? 0 : any(random);
    for (const std::int64_t axis : k.axis_of_row)
      x.push_back(u[static_cast<std::size_t>(axis)]);
    linalg::multiply(k, x, y);
    fem::StiffnessOperator(model).multiply(u, f);
    for (std::size_t r = 0; r < y.size(); ++r)
      EXPECT_NEAR(y[r], f[static_cast<std::size_t>(k.axis_of_row[r])], 1e-13 * largest(f));
    // Both parts are in it.
    std::vector<double> springs(u.size()), solid(u.size());
    linalg::multiply_springs(model, linalg::stiffness_blocks(model), u, springs);
    model::Model without = model;
    without.springs.clear();
    fem::multiply_stiffness(without, u, solid);
    EXPECT_GT(largest(springs), 0.01 * largest(f));
    EXPECT_GT(largest(solid), 0.01 * largest(f));
    for (std::size_t axis = 0; axis < u.size(); ++axis)
      EXPECT_NEAR(f[axis], springs[axis] + solid[axis], 1e-13 * largest(f));
    EXPECT_EQ(fem::stiffness_matrix(without).order(), k.order());
  }
}

TEST(ModelStiffness, LeavesOutWhatElseIsHeld) {
  const model::Model model = box_model();
  std::vector<std::uint8_t> held(3 * model.nodes.size());
  const auto free = static_cast<std::size_t>(fem::stiffness_matrix(model).axis_of_row[4]);
  held[free] = 1;
  const linalg::StiffnessMatrix k = fem::stiffness_matrix(model, held);
  EXPECT_EQ(k.order() + 1, fem::stiffness_matrix(model).order());
  EXPECT_EQ(k.row_of_axis[free], -1);
}

TEST(ModelWeight, IsConsistentAndWhole) {
  const Vec3 g{100, -200, -9810};
  model::Model model = box_model();
  const tetrahedra::TetMesh mesh = fem::element_mesh(model);
  const auto materials = fem::element_materials(model);
  const std::vector<double> consistent =
      fem::gravity_load(mesh, materials, fem::solid_elements(mesh, materials), g);
  EXPECT_EQ(fem::weight_of(model, g), consistent);
  // What a node weighs beside its elements counts too.
  model.nodes[7].mass += 2;
  const std::vector<double> more = fem::weight_of(model, g);
  for (std::size_t axis = 0; axis < more.size(); ++axis)
    EXPECT_NEAR(more[axis] - consistent[axis],
                axis / 3 == 7 ? 2 * g[static_cast<int>(axis % 3)] : 0, 1e-10);
}

TEST(ModelPressure, OnAWholeSurfaceIsTheConsistentLoad) {
  for (const bool quadratic : {false, true}) {
    const model::Model model = box_model(quadratic);
    contact::Load load;
    for (std::uint32_t i = 0; i < model::surface_count(model); ++i)
      load.pressure[i] = {250, 0};
    const contact::Load now = contact::load_at(load, model, 0);
    const tetrahedra::TetMesh mesh = fem::element_mesh(model);
    const tetrahedra::TetBoundary surface = tetrahedra::boundary(mesh);
    std::vector<std::uint32_t> all(surface.mesh.triangles.size());
    std::iota(all.begin(), all.end(), 0U);
    const std::vector<double> expected = fem::pressure_load(mesh, surface, all, -250);
    std::vector<double> f(expected.size());
    for (const auto& [node, force] : now.force)
      for (int a = 0; a < 3; ++a)
        f[3 * std::size_t{node} + static_cast<std::size_t>(a)] = force[a];
    for (std::size_t axis = 0; axis < f.size(); ++axis)
      EXPECT_NEAR(f[axis], expected[axis], 1e-13 * largest(expected));
  }
}

TEST(SolidSelector, RangesOverTheSurfaceOrTheBody) {
  const model::Model model = box_model();
  const auto surface = static_cast<std::uint32_t>(model::surface_count(model));
  const auto count = [&](const char* text, model::SelectorScope scope) {
    return model::select_nodes(model, model::parse_selector(text), nullptr, scope).size();
  };
  const std::size_t body = model.nodes.size();
  ASSERT_GT(body, surface + 10);
  for (const model::SelectorScope scope :
       {model::SelectorScope::surface, model::SelectorScope::body}) {
    EXPECT_EQ(count("surface", scope), surface);
    EXPECT_EQ(count("inside", scope), body - surface);
    EXPECT_EQ(count("all", scope), body);
    EXPECT_EQ(count("not surface or surface", scope),
              scope == model::SelectorScope::body ? body : surface);
    EXPECT_EQ(count("inside or z<10", scope), body);
    EXPECT_EQ(
        model::select_nodes(model, model::parse_selector(std::to_string(body - 1)), nullptr, scope),
        std::vector<std::uint32_t>{static_cast<std::uint32_t>(body - 1)});
  }
  EXPECT_LT(count("z<1.5", model::SelectorScope::surface),
            count("z<1.5", model::SelectorScope::body));
}

TEST(SolidScene, IsWhatTheFactorSays) {
  const model::Model model = box_model();
  std::uint32_t pulled = 0;
  for (std::uint32_t i = 0; i < model::surface_count(model); ++i)
    if (model.nodes[i].position.z == 2)
      pulled = i;
  scene::Simulation scene(Context{}, {});
  scene.add_object("o", model, scene::Method::ffe, {});
  scene.apply(scene::SetGravity{{0, 0, -9810}});
  scene.apply(scene::SetForce{0, {pulled}, {200, 0, 500}});
  scene.step(0.01);
  const linalg::StiffnessMatrix k = fem::stiffness_matrix(model);
  std::vector<double> f = fem::weight_of(model, {0, 0, -9810}), u(f.size());
  f[3 * std::size_t{pulled}] += 200;
  f[3 * std::size_t{pulled} + 2] += 500;
  linalg::solve_axes(k, linalg::Factor(k, {}), f, u);
  const std::span<const double> shown = scene.displacement(0);
  for (std::size_t axis = 0; axis < u.size(); ++axis)
    EXPECT_NEAR(shown[axis], u[axis], 1e-12 * largest(u));
  // A node that is displaced to where the force took it needs that force.
  scene::Simulation other(Context{}, {});
  other.add_object("o", model, scene::Method::ffe, {});
  other.apply(scene::SetGravity{{0, 0, -9810}});
  other.apply(scene::SetDisplacement{0,
                                     {pulled},
                                     {u[3 * std::size_t{pulled}], u[3 * std::size_t{pulled} + 1],
                                      u[3 * std::size_t{pulled} + 2]}});
  other.step(0.01);
  const std::vector<contact::NodeVector> forces = other.contact_forces(0);
  ASSERT_EQ(forces.size(), 1U);
  EXPECT_NEAR(forces[0].value.x, 200, 1e-7);
  EXPECT_NEAR(forces[0].value.y, 0, 1e-7);
  EXPECT_NEAR(forces[0].value.z, 500, 1e-7);
}

TEST(SolidCondition, NamesThePartThatFloats) {
  model::Model model = box_model();
  const auto offset = static_cast<std::uint32_t>(model.nodes.size());
  const model::Model one = fem::solid_model(test::box_tetrahedra(1, 1, 1), options(), {});
  for (model::Node node : one.nodes) {
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
  model::check_model(model);
  try {
    const linalg::StiffnessMatrix k = fem::stiffness_matrix(model);
    linalg::StiffnessCheck check;
    (void)linalg::checked_factor(model, k, {}, check);
    ADD_FAILURE() << "it is held";
  } catch (const linalg::SingularStiffness& error) {
    EXPECT_NE(std::string(error.what())
                  .find("component 1 is held by nothing: it can move and turn "
                        "as a rigid body"),
              std::string::npos)
        << error.what();
  }
}

TEST(StiffnessHash, SeesElementsAndTheirMaterial) {
  const model::Model model = box_model();
  const auto hash = [&](auto&& edit) {
    gewebe::model::Model m = model;
    edit(m);
    return gewebe::formats::stiffness_hash(m);
  };
  const std::uint64_t same = formats::stiffness_hash(model);
  EXPECT_NE(same, hash([](model::Model& m) { m.materials[1].poisson = 0.21; }));
  EXPECT_NE(same, hash([](model::Model& m) { m.materials[1].young *= 2; }));
  EXPECT_NE(same, hash([](model::Model& m) { m.materials[1].density *= 2; }));
  EXPECT_NE(same, hash([](model::Model& m) { m.tetrahedron_material[0] ^= 1; }));
  EXPECT_NE(same, hash([](model::Model& m) { std::swap(m.tetrahedra[0], m.tetrahedra[1]); }));
  EXPECT_NE(same, hash([](model::Model& m) { std::swap(m.middles[0][0], m.middles[0][1]); }));
  EXPECT_EQ(same, hash([](model::Model& m) { m.materials[1].name = "rock"; }));
  EXPECT_EQ(same, hash([](model::Model& m) { m.materials[1].damping_ratio = 1; }));
}

} // namespace
} // namespace gewebe::test
