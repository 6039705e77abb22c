// Solids at rest under large strains, as scenes have them: against a converged Newton's method,
// under small loads the linear method, and bodies in motion that have come to rest; pressure,
// contact, cuts; answers taken back.

#include "base/error.h"
#include "contact_checks.h"
#include "dynamics/solid_static.h"
#include "fem/model_stiffness.h"
#include "fem/solid_model.h"
#include "fit/hyperelastic_statics.h"
#include "geometry/vector_at.h"
#include "integrator/solid_motion.h"
#include "larger.h"
#include "linalg/condition.h"
#include "scene/simulation.h"
#include "sim_models.h"
#include "statics/elastostatic.h"
#include "tests/unit/pressed_bar.h"
#include "tests/unit/relative_difference.h"
#include "tet_fixtures.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace gewebe::test {
namespace {

/// A bar of cells of `edge` along x, held at x = 0 by whole nodes.
model::Model bar(tetrahedra::TetMesh mesh, double young, double poisson = 0.45, int order = 1) {
  fem::SolidModelOptions options;
  options.material.materials = {{"gel", 1e-3, young, 1, 0.2, poisson}};
  options.quadratic = order == 2;
  model::Model model = fem::solid_model(std::move(mesh), options, {});
  for (model::Node& node : model.nodes)
    if (node.position.x == 0)
      node.fixed = model::fixed_all;
  return model;
}
model::Model bar(double young = 2e4, int order = 1) {
  return bar(test::box_tetrahedra(10, 2, 2, 4), young, 0.45, order);
}

std::vector<std::uint32_t> where(const model::Model& model, auto&& is) {
  std::vector<std::uint32_t> nodes;
  for (std::uint32_t i = 0; i < model::surface_count(model); ++i)
    if (is(model.nodes[i].position))
      nodes.push_back(i);
  return nodes;
}
std::vector<std::uint32_t> end_of(const model::Model& model) {
  return where(model, [](const Vec3& p) { return p.x > 40 - 1e-9; });
}

double largest(std::span<const double> values) {
  double most = 0;
  for (const double x : values)
    most = test::larger(most, std::abs(x));
  return most;
}

integrator::SolidChoice law(integrator::SolidLaw of = integrator::SolidLaw::hyperelastic) {
  integrator::SolidChoice choice;
  choice.law = of;
  return choice;
}

/// The same body, Neo-Hookean, by Newton's method; forces, weight by the nodes' masses, and
/// prescribed places as in the load.
struct Reference {
  std::vector<double> u;
  std::vector<double> forces; ///< that hold, by axis
  /// \param start  a shape near to it, or none
  explicit Reference(const model::Model& model, const contact::Load& load,
                     std::span<const double> start = {}) {
    const tetrahedra::TetMesh mesh = fem::element_mesh(model);
    const auto elements = fem::solid_elements(mesh, fem::element_materials(model));
    std::vector<std::uint8_t> fixed(3 * model.nodes.size());
    std::vector<double> prescribed(fixed.size());
    fit::SolidVector f{fem::weight_of(model, load.gravity), {}};
    for (std::uint32_t i = 0; i < model.nodes.size(); ++i)
      for (int a = 0; a < 3; ++a)
        fixed[axis_of(i, a)] = contact::is_fixed(model, i, a) ? 1 : 0;
    for (const auto& [node, d] : load.displacement)
      for (int a = 0; a < 3; ++a) {
        fixed[axis_of(node, a)] = 1;
        prescribed[axis_of(node, a)] = d[a];
      }
    for (const auto& [node, force] : load.force)
      for (int a = 0; a < 3; ++a)
        f.axes[axis_of(node, a)] += force[a];
    fit::HyperelasticOptions options;
    options.start.axes.assign(start.begin(), start.end());
    const auto found = fit::hyperelastic_statics(mesh, elements, fixed, prescribed, f, options);
    u = found.displacement.axes;
    forces = fit::hyperelastic_forces(mesh, elements, found.displacement).axes;
    for (std::size_t k = 0; k < forces.size(); ++k)
      forces[k] = -forces[k] - f.axes[k];
  }
};

class SolidStaticOf : public testing::TestWithParam<int> {};

/// \param near  whether Newton's method starts from there, which does not find its way to all
void expect_newtons_shapes(const model::Model& model, bool near = false) {
  const auto end = end_of(model);
  contact::Load heavy, moved;
  heavy.gravity = {0, 0, -9810};
  for (const std::uint32_t node : end)
    heavy.force[node] = {0, 0, -1e4 / static_cast<double>(end.size())};
  for (const std::uint32_t node : end)
    moved.displacement[node] = {14, 0, -12};
  for (const contact::Load& load : {heavy, moved}) {
    dynamics::SolidStatic body(model, integrator::SolidLaw::hyperelastic, test::one_thread());
    ASSERT_NO_THROW(body.update(load));
    const Reference expected(model, load, near ? body.displacement() : std::span<const double>());
    EXPECT_GT(largest(expected.u), 12);
    EXPECT_LE(test::relative_difference(body.displacement(), expected.u), 1e-5);
    const auto forces = body.holding_forces();
    ASSERT_EQ(forces.size(), load.displacement.size());
    double most = 0, off = 0;
    for (const contact::NodeVector& f : forces) {
      const Vec3 other = vector_at(std::span<const double>(expected.forces), f.node);
      most = test::larger(most, norm(other));
      off = test::larger(off, norm(f.value - other));
    }
    EXPECT_LE(off, 1e-5 * most);
    // From another shape it is found, too, and back.
    ASSERT_NO_THROW(body.update({}));
    EXPECT_EQ(largest(body.displacement()), 0);
    ASSERT_NO_THROW(body.update(load));
    EXPECT_LE(test::relative_difference(body.displacement(), expected.u), 1e-5);
  }
}

TEST_P(SolidStaticOf, LargeShapesAreThoseOfNewtonsMethod) {
  model::Model model = bar(2e4, GetParam());
  expect_newtons_shapes(model);
  for (const char* const law : {"yeoh:c20=0.1", "mooney-rivlin:c01=0.2", "ogden:alpha1=4"}) {
    SCOPED_TRACE(law);
    model.materials[0].law = model::parse_law(law);
    if (GetParam() == 2 && model.materials[0].law->kind != model::HyperelasticLaw::yeoh)
      continue; // Newton's method takes long
    expect_newtons_shapes(model, true);
    // Almost all of a load is taken away.
    dynamics::SolidStatic body(model, integrator::SolidLaw::hyperelastic, test::one_thread());
    contact::Load heavy, light;
    heavy.gravity = {0, 0, -9810};
    light.gravity = {0, 0, -1};
    body.update(heavy);
    ASSERT_NO_THROW(body.update(light));
    const Reference expected(model, light);
    EXPECT_LE(test::relative_difference(body.displacement(), expected.u), 1e-5);
  }
}

/// A material's law is that of its object, if none is chosen.
TEST(SolidStatic, AnObjectHasTheLawOfItsMaterial) {
  model::Model model = bar();
  std::vector<std::vector<double>> shapes;
  for (const char* const law : {"yeoh:c20=3", "neo-hookean", ""}) {
    model.materials[0].law.reset();
    if (*law != 0)
      model.materials[0].law = model::parse_law(law);
    scene::Simulation scene(test::one_thread(), {});
    scene.add_object("bar", model, scene::Method::ffe);
    scene.apply(scene::SetGravity{{0, 0, -9810}});
    scene.step(0.1);
    const auto u = scene.displacement(0);
    shapes.emplace_back(u.begin(), u.end());
  }
  contact::Load weight;
  weight.gravity = {0, 0, -9810};
  model.materials[0].law = model::parse_law("yeoh:c20=3");
  EXPECT_LE(test::relative_difference(shapes[0], Reference(model, weight).u), 1e-5);
  EXPECT_GT(test::relative_difference(shapes[0], shapes[1]), 1e-3);
  EXPECT_GT(test::relative_difference(shapes[1], shapes[2]), 0.1); // that is the linear one
  model.materials[0].law = model::parse_law("classical-neo-hookean");
  scene::Simulation scene(test::one_thread(), {});
  EXPECT_THROW(scene.add_object("bar", model, scene::Method::ffe), Error);
}

TEST_P(SolidStaticOf, UnderSmallLoadsItIsTheLinearMethod) {
  const model::Model model = bar(2e4, GetParam());
  contact::Load load;
  load.gravity = {0, 0.1, -0.2};
  for (const std::uint32_t node : end_of(model))
    load.force[node] = {0, 0.03, -0.05};
  for (const std::uint32_t node : where(model, [](const Vec3& p) { return p.x == 20 && p.z == 8; }))
    load.displacement[node] = {1e-6, 0, 2e-6};
  statics::Elastostatic linear(model, nullptr, test::one_thread());
  linear.update(load);
  for (const integrator::SolidLaw of :
       {integrator::SolidLaw::corotational, integrator::SolidLaw::hyperelastic}) {
    dynamics::SolidStatic body(model, of, test::one_thread());
    body.update(load);
    EXPECT_LE(test::relative_difference(body.displacement(), linear.displacement()), 1e-4);
    const auto forces = body.holding_forces();
    ASSERT_EQ(forces.size(), linear.contact_forces().size());
    for (std::size_t k = 0; k < forces.size(); ++k)
      EXPECT_LE(norm(forces[k].value - linear.contact_forces()[k].value),
                1e-3 * norm(linear.contact_forces()[k].value));
  }
}

/// The shape of a body in motion that was damped until it rested.
TEST_P(SolidStaticOf, AMovingBodyComesToRestThere) {
  const model::Model model = bar(2e4, GetParam());
  for (const integrator::SolidLaw of :
       {integrator::SolidLaw::corotational, integrator::SolidLaw::hyperelastic}) {
    std::vector<std::vector<double>> shapes;
    for (const scene::Method method : {scene::Method::ffe, scene::Method::ela}) {
      scene::Simulation scene(test::one_thread(), {});
      integrator::SolidChoice choice = law(of);
      choice.tolerance = 1e-5;
      choice.damping = integrator::damping_per_stiffness(0.5, 3);
      scene.add_object("bar", model, method, {}, scene::Integration::semi_implicit, choice);
      scene.apply(scene::SetGravity{{0, 0, -4000}});
      const std::vector<std::uint32_t> top =
          where(model, [](const Vec3& p) { return p.z == 8 && p.x > 10; });
      scene.apply(scene::SetPressure{0, top, {-60, 0}});
      scene.apply(scene::SetTimestep{0.5});
      scene.step(method == scene::Method::ffe ? 0.5 : 60);
      const auto u = scene.displacement(0);
      shapes.emplace_back(u.begin(), u.end());
    }
    EXPECT_GT(largest(shapes[0]), 5);
    EXPECT_LE(test::relative_difference(shapes[0], shapes[1]), 1e-3);
  }
}

INSTANTIATE_TEST_SUITE_P(Orders, SolidStaticOf, testing::Values(1, 2));

TEST(SolidStatic, WhatNothingHoldsIsRefused) {
  model::Model model = bar();
  for (model::Node& node : model.nodes)
    node.fixed = 0;
  dynamics::SolidStatic body(model, integrator::SolidLaw::corotational, test::one_thread());
  contact::Load load;
  load.gravity = {0, 0, -1};
  EXPECT_THROW(body.update(load), linalg::SingularStiffness);
  for (const std::uint32_t node : end_of(model)) // that hold it
    load.displacement[node] = {0, 0, 1};
  body.update(load);
  EXPECT_GT(largest(body.displacement()), 0.9);
}

TEST(SolidStatic, WhatIsNotFoundTellsTheShareThatWas) {
  const model::Model model = bar();
  dynamics::SolidStatic body(model, integrator::SolidLaw::hyperelastic, test::one_thread());
  contact::Load load;
  for (const std::uint32_t node : end_of(model))
    load.force[node] = {0, 0, 1e30};
  try {
    body.update(load);
    FAIL() << "there is no such shape";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("% of the way to this load"), std::string::npos)
        << error.what();
  }
  EXPECT_EQ(body.answer(), nullptr);
}

TEST(SolidStatic, AnAnswerIsAValue) {
  const model::Model model = bar();
  const auto shown = [](dynamics::SolidStatic& body, const Vec3& gravity) {
    contact::Load load;
    load.gravity = gravity;
    body.update(load);
    const auto u = body.displacement();
    return std::vector<double>(u.begin(), u.end());
  };
  dynamics::SolidStatic one(model, integrator::SolidLaw::hyperelastic, test::one_thread());
  const std::vector<double> first = shown(one, {0, 0, -9810});
  const auto kept = one.answer();
  const std::vector<double> second = shown(one, {0, 9810, -9810});
  (void)shown(one, {0, 20000, 0});
  one.restore(kept);
  EXPECT_TRUE(std::ranges::equal(one.displacement(), first));
  EXPECT_EQ(shown(one, {0, 9810, -9810}), second);
  Context threads;
  threads.threads = 2;
  dynamics::SolidStatic other(model, integrator::SolidLaw::hyperelastic, threads);
  other.restore(kept);
  EXPECT_EQ(shown(other, {0, 9810, -9810}), second);
}

class Pressed : public test::PressedBar {
public:
  explicit Pressed(integrator::SolidLaw of = integrator::SolidLaw::hyperelastic, int threads = 1)
      : test::PressedBar(bar(), law(of), false, threads) {}
  std::vector<double> shape() const {
    const auto u = scene().displacement(0);
    return {u.begin(), u.end()};
  }
};

TEST(SolidStatic, AnInstrumentPressesTheBarDown) {
  Pressed pressed;
  for (const double z : {13.0, 9.0, 4.0, 0.0, 9.0}) {
    pressed.press(z);
    const std::vector<double> u = pressed.shape();
    const scene::Simulation& scene = pressed.scene();
    EXPECT_GT(scene.instrument(0).nodes, 0U);
    EXPECT_NEAR(test::surface_depth(pressed.model(), u, {6, {}, 0}, {{36, 4, z}, {}}), 0,
                test::depth_allowed);
    // No friction: all forces pass through the centre.
    EXPECT_LE(norm(scene.instrument(0).torque), 1e-6 * 6 * norm(scene.instrument(0).force));
    Vec3 sum;
    contact::Load load;
    for (const contact::NodeVector& f : scene.contact_forces(0)) {
      sum += f.value;
      load.force[f.node] = f.value;
    }
    EXPECT_LE(norm(sum + scene.instrument(0).force), 1e-9 * norm(sum));
    const Reference expected(pressed.model(), load, u);
    EXPECT_LE(test::relative_difference(u, expected.u), 1e-3) << z;
  }
}

/// A block under a sphere that goes 12 mm into its 20 mm.
TEST(SolidStatic, ABlockIsIndentedDeeply) {
  for (const integrator::SolidLaw of : {integrator::SolidLaw::hyperelastic}) {
    model::Model model = bar(test::box_tetrahedra(6, 6, 4, 5), 2500, 0.45, 2);
    for (model::Node& node : model.nodes)
      node.fixed = node.position.z == 0 ? model::fixed_all : 0;
    scene::Simulation scene(test::one_thread(), {});
    scene.add_object("block", model, scene::Method::ffe, {}, scene::Integration::semi_implicit,
                     law(of));
    scene::SetInstrument ball;
    ball.name = "ball";
    ball.shape.radius = 8;
    ball.pose.place = {15, 15, 30};
    scene.apply(ball);
    scene.step(0.1);
    double before = 0;
    for (int level = 1; level <= 6; ++level) {
      const Vec3 place{15, 15, 28 - 2.0 * level};
      scene.apply(scene::MoveInstrument{0, place, {}, 0});
      scene.step(0.1);
      const double force = scene.instrument(0).force.z;
      EXPECT_GT(force, before);
      before = force;
      EXPECT_NEAR(test::surface_depth(model, scene.displacement(0), {8, {}, 0}, {place, {}}), 0,
                  test::depth_allowed);
    }
    // Forces that hold all nodes where they are have nothing to do but at the bottom.
    integrator::SolidMotionOptions options;
    options.law = of;
    integrator::SolidMotion body(fem::element_mesh(model), fem::element_materials(model), options);
    std::vector<double> load(3 * model.nodes.size());
    double most = 0, off = 0;
    for (const contact::NodeVector& f : scene.contact_forces(0))
      for (int a = 0; a < 3; ++a) {
        load[axis_of(f.node, a)] = f.value[a];
        most = test::larger(most, std::abs(f.value[a]));
      }
    body.hold(std::vector<std::uint8_t>(load.size(), 1));
    body.set_load(load);
    body.set_state(scene.displacement(0), std::vector<double>(load.size()));
    body.find_reactions();
    for (std::uint32_t i = 0; i < model.nodes.size(); ++i)
      if (model.nodes[i].fixed == 0)
        off = test::larger(off, norm(vector_at(body.reactions(), i)));
    EXPECT_LE(off, 2e-3 * most);
  }
}

TEST(SolidStatic, ThreadsDoNotMatterAndWhatIsTakenBackLeavesNoTrace) {
  Pressed one, two(integrator::SolidLaw::hyperelastic, 2), with_error;
  const auto fail = [&] { // a step that goes far
    with_error.scene().apply(scene::SetGravity{{0, 0, -5000}});
    with_error.scene().apply(scene::SetForce{0, end_of(one.model()), {0, 0, 1e30}});
    EXPECT_THROW(with_error.scene().step(0.01), Error);
    with_error.scene().apply(scene::SetGravity{{0, 0, 0}});
    with_error.scene().apply(scene::SetForce{0, end_of(one.model()), {}});
  };
  for (const double z : {12.0, 8.0, 3.0, 20.0, 8.0}) {
    one.press(z);
    two.press(z);
    with_error.press(z);
    EXPECT_EQ(one.shape(), two.shape());
    EXPECT_EQ(one.shape(), with_error.shape());
    EXPECT_EQ(one.scene().contact_forces(0), with_error.scene().contact_forces(0));
    fail();
  }
}

TEST(SolidStatic, ACutBodyIsThatOfItsModel) {
  const model::Model model = bar();
  scene::Simulation scene(test::one_thread(), {});
  scene.add_object("bar", model, scene::Method::ffe, {}, scene::Integration::semi_implicit, law());
  scene.apply(scene::SetGravity{{0, 0, -9810}});
  scene.step(0.01);
  scene::CutObject cut;
  cut.object = 0;
  scene::PlaneToCut plane;
  plane.plane = {{20, 4, 8}, {1, 0, 0}};
  plane.nodes = where(model, [](const Vec3& p) { return std::abs(p.x - 20) < 5 && p.z > 3; });
  cut.what = plane;
  scene.apply(cut);
  scene.step(0.01);
  const model::Model after = scene.model(0);
  EXPECT_GT(after.nodes.size(), model.nodes.size());
  contact::Load load;
  load.gravity = {0, 0, -9810};
  EXPECT_LE(test::relative_difference(scene.displacement(0), Reference(after, load).u), 1e-5);
}

} // namespace
} // namespace gewebe::test
