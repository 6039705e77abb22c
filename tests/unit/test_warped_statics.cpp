// Solids that turn far, as scenes have them: against converged hyperelastic ones and, under small
// loads, the linear method; contact; answers taken back.

#include "base/error.h"
#include "contact_checks.h"
#include "fem/model_stiffness.h"
#include "fem/solid_model.h"
#include "fem/stress.h"
#include "fit/hyperelastic_statics.h"
#include "geometry/vector_at.h"
#include "larger.h"
#include "scene/simulation.h"
#include "sim_models.h"
#include "statics/elastostatic.h"
#include "statics/warped_statics.h"
#include "tests/unit/pressed_bar.h"
#include "tests/unit/relative_difference.h"
#include "tet_fixtures.h"

#include <Eigen/Dense>
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

/// A bar 40 × 8 × 8 mm along x, held at x = 0.
model::Model bar(double young = 2e4, double density = 1e-3) {
  tetrahedra::TetMesh mesh = test::box_tetrahedra(10, 2, 2, 4);
  fem::SolidModelOptions options;
  options.material.materials = {{"gel", density, young, 1, 0.2, 0.45}};
  model::Model model = fem::solid_model(std::move(mesh), options, {});
  for (model::Node& node : model.nodes)
    if (node.position.x == 0)
      node.fixed = model::fixed_all;
  return model;
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

/// The same body, Neo-Hookean, converged; f and prescribed places as in the load.
struct Reference {
  std::vector<double> u;
  std::vector<double> forces; ///< that hold, by axis
  explicit Reference(const model::Model& model, const contact::Load& load) {
    const tetrahedra::TetMesh mesh = fem::element_mesh(model);
    const auto materials = fem::element_materials(model);
    const auto elements = fem::solid_elements(mesh, materials);
    std::vector<std::uint8_t> fixed(3 * model.nodes.size());
    std::vector<double> prescribed(fixed.size());
    fit::SolidVector f = fit::hyperelastic_weight(mesh, materials, elements, load.gravity);
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
    const auto found = fit::hyperelastic_statics(mesh, elements, fixed, prescribed, f);
    u = found.displacement.axes;
    forces = fit::hyperelastic_forces(mesh, elements, found.displacement).axes;
    for (std::size_t k = 0; k < forces.size(); ++k)
      forces[k] = -forces[k] - f.axes[k];
  }
};

TEST(WarpedStatics, UnderSmallLoadsItIsTheLinearMethod) {
  const model::Model model = bar();
  contact::Load load;
  load.gravity = {0, 1, -2};
  for (const std::uint32_t node : end_of(model))
    load.force[node] = {0, 0.3, -0.5};
  const auto held =
      where(model, [](const Vec3& p) { return p.x == 20 && p.z == 8 && p.y > 3 && p.y < 5; });
  for (const std::uint32_t node : held)
    load.displacement[node] = {1e-5, 0, 2e-5};
  ASSERT_FALSE(held.empty());
  statics::Elastostatic linear(model, nullptr, test::one_thread());
  statics::WarpedStatics warped(model, nullptr, test::one_thread());
  linear.update(load);
  warped.update(load);
  EXPECT_LE(test::relative_difference(
                warped.surface_displacement(),
                linear.surface_displacement().first(3 * model::surface_count(model))),
            1e-3);
  EXPECT_LE(test::relative_difference(warped.displacement(), linear.displacement()), 1e-3);
  EXPECT_LE(test::relative_difference(warped.local_displacement(), linear.displacement()), 1e-3);
  const auto forces = warped.holding_forces();
  ASSERT_EQ(forces.size(), held.size());
  for (std::size_t k = 0; k < forces.size(); ++k) {
    EXPECT_EQ(forces[k].node, linear.contact_forces()[k].node);
    EXPECT_LE(norm(forces[k].value - linear.contact_forces()[k].value),
              2e-3 * norm(linear.contact_forces()[k].value));
  }
}

/// Bent by some 30 degrees by its weight, a force on its end by columns and by a solution, an end
/// that is moved.
TEST(WarpedStatics, LargeShapesAreNearHyperelasticOnes) {
  const model::Model model = bar();
  const auto end = end_of(model);
  contact::Load few, held;
  for (const std::uint32_t node : end)
    few.force[node] = {0, 0, -3e3 / static_cast<double>(end.size())};
  contact::Load many = few;
  for (std::uint32_t i = 0; i < model::surface_count(model) && many.force.size() <= 64; ++i)
    if (model.nodes[i].fixed == 0)
      many.force.emplace(i, Vec3{});
  contact::Load heavy = few;
  heavy.gravity = {0, 0, -2000};
  for (const std::uint32_t node : end)
    if (std::abs(model.nodes[node].position.y - 4) < 1 &&
        std::abs(model.nodes[node].position.z - 4) < 1)
      held.displacement[node] = {-3.3, 2, -15};
  held.gravity = {0, 0, -2000};
  ASSERT_FALSE(held.displacement.empty());
  struct Case {
    const char* what;
    const contact::Load& load;
    double error;
  };
  for (const Case& c : {Case{"few", few, 0.02}, Case{"many", many, 0.02},
                        Case{"heavy", heavy, 0.03}, Case{"held", held, 0.03}}) {
    statics::WarpedStatics warped(model, nullptr, test::one_thread());
    statics::Elastostatic linear(model, nullptr, test::one_thread());
    warped.update(c.load);
    linear.update(c.load);
    const Reference expected(model, c.load);
    EXPECT_LE(test::relative_difference(warped.displacement(), expected.u), c.error) << c.what;
    EXPECT_GE(test::relative_difference(linear.displacement(), expected.u), 3 * c.error) << c.what;
    EXPECT_LE(warped.counts().change, 1e-3) << c.what;
    for (const auto& [node, d] : c.load.displacement)
      EXPECT_EQ(vector_at(warped.displacement(), node), d);
    Vec3 force, other;
    for (const contact::NodeVector& f : warped.holding_forces()) {
      force += f.value;
      other += vector_at(expected.forces, f.node);
    }
    EXPECT_LE(norm(force - other), 0.1 * norm(other)) << c.what;
  }
}

/// Strains in frames that turn are those in space, turned.
TEST(WarpedStatics, StressesTurnWithTheirFrames) {
  const model::Model model = bar();
  const tetrahedra::TetMesh mesh = fem::element_mesh(model);
  const auto materials = fem::element_materials(model);
  const auto elements = fem::solid_elements(mesh, materials);
  const Eigen::Vector3d w(0.3, -1.1, 0.6);
  std::vector<double> strained, turned;
  for (const model::Node& node : model.nodes) {
    const Vec3 p = node.position;
    const Vec3 e{0.02 * p.x + 0.01 * p.y, 0.01 * p.x - 0.03 * p.y, 0.015 * p.z};
    const Eigen::Vector3d r = w.cross(Eigen::Vector3d(p.x, p.y, p.z));
    strained.insert(strained.end(), {e.x, e.y, e.z});
    turned.insert(turned.end(), {e.x + r.x(), e.y + r.y(), e.z + r.z()});
  }
  const fem::SolidFields rest = fem::solid_fields(mesh, materials, elements, strained),
                         found = fem::solid_fields(mesh, materials, elements, turned, {},
                                                   fem::StrainFrames::turning);
  const Eigen::Matrix3d r = Eigen::AngleAxisd(w.norm(), w.normalized()).toRotationMatrix();
  const auto matrix = [](const linalg::SymmetricBlock& s) {
    Eigen::Matrix3d m;
    m << s[0], s[1], s[2], s[1], s[3], s[4], s[2], s[4], s[5];
    return m;
  };
  for (std::size_t i = 0; i < model.nodes.size(); ++i) {
    const Eigen::Matrix3d expected = r * matrix(rest.node_stress[i]) * r.transpose();
    EXPECT_LE((matrix(found.node_stress[i]) - expected).norm(), 1e-9 * expected.norm());
    EXPECT_NEAR(fem::von_mises(found.node_stress[i]), fem::von_mises(rest.node_stress[i]),
                1e-9 * fem::von_mises(rest.node_stress[i]));
  }
  for (std::size_t t = 0; t < elements.size(); ++t)
    EXPECT_LE((matrix(found.element_strain[t]) - r * matrix(rest.element_strain[t]) * r.transpose())
                  .norm(),
              1e-11);
}

class Pressed : public test::PressedBar {
public:
  explicit Pressed(bool warp = true, int threads = 1)
      : test::PressedBar(bar(), {}, warp, threads) {}
  std::vector<double> shape() const {
    const auto u = scene().surface_displacement(0);
    return {u.begin(), u.end()};
  }
};

TEST(WarpedStatics, AnInstrumentPressesTheBarDown) {
  Pressed pressed;
  for (const double z : {13.0, 9.0, 4.0, 0.0}) {
    pressed.press(z);
    const std::vector<double> u = pressed.shape();
    const scene::Simulation& scene = pressed.scene();
    EXPECT_GT(scene.instrument(0).nodes, 0U);
    Vec3 sum;
    contact::Load load;
    const std::span<const double> shown = scene.displacement(0);
    EXPECT_TRUE(std::ranges::equal(u, shown.first(u.size()))) << "one shape, read in two ways";
    EXPECT_NEAR(test::surface_depth(pressed.model(), shown, {6, {}, 0}, {{36, 4, z}, {}}), 0,
                test::depth_allowed);
    // No friction: all forces pass through the centre.
    EXPECT_LE(norm(scene.instrument(0).torque), 1e-6 * 6 * norm(scene.instrument(0).force));
    for (const contact::NodeVector& f : scene.contact_forces(0)) {
      sum += f.value;
      load.force[f.node] = f.value;
    }
    EXPECT_LE(norm(sum + scene.instrument(0).force), 1e-9 * norm(sum));
    for (std::uint32_t i = 0; i < model::surface_count(pressed.model()); ++i)
      EXPECT_GE(norm(pressed.model().nodes[i].position + vector_at(u, i) - Vec3{36, 4, z}),
                6 * (1 - test::depth_allowed));
    // These forces press a Neo-Hookean bar as far.
    const Reference expected(pressed.model(), load);
    EXPECT_LE(test::relative_difference(u, std::span(expected.u).first(u.size())), 0.03) << z;
  }
  Pressed linear(false);
  for (const double z : {13.0, 9.0, 4.0, 0.0})
    linear.press(z);
  EXPECT_GE(test::relative_difference(pressed.shape(), linear.shape()), 0.1);
}

TEST(WarpedStatics, ThreadsDoNotMatterAndWhatIsTakenBackLeavesNoTrace) {
  Pressed one, two(true, 2), with_error;
  for (const double z : {12.0, 8.0, 6.5}) {
    one.press(z);
    two.press(z);
    with_error.press(z);
    (void)with_error.scene().displacement(0); // whoever looks inside changes nothing
    // A step that goes far and then fails.
    with_error.scene().apply(scene::SetGravity{{0, 0, -5000}});
    with_error.scene().apply(scene::SetForce{0, end_of(one.model()), {0, 0, 1e30}});
    EXPECT_THROW(with_error.scene().step(0.01), Error);
    with_error.scene().apply(scene::SetGravity{{0, 0, 0}});
    with_error.scene().apply(scene::SetForce{0, end_of(one.model()), {}});
    EXPECT_EQ(one.shape(), two.shape());
  }
  one.press(5);
  two.press(5);
  with_error.press(5);
  EXPECT_EQ(one.shape(), two.shape());
  EXPECT_EQ(one.shape(), with_error.shape());
  EXPECT_EQ(one.scene().contact_forces(0), with_error.scene().contact_forces(0));
}

/// On the surface, everywhere, and in frames that turn.
std::vector<std::vector<double>> shapes_of(statics::WarpedStatics& warped) {
  std::vector<std::vector<double>> all;
  for (const std::span<const double> u :
       {warped.surface_displacement(), warped.displacement(), warped.local_displacement()})
    all.emplace_back(u.begin(), u.end());
  return all;
}

TEST(WarpedStatics, RestoreInvalidatesCachedShapes) {
  const model::Model model = bar();
  statics::WarpedStatics warped(model, nullptr, test::one_thread());
  const auto shown = [&](const Vec3& gravity) {
    contact::Load load;
    load.gravity = gravity;
    warped.update(load);
    return std::pair(warped.answer(), shapes_of(warped));
  };
  const auto first = shown({0, 0, -2000}), second = shown({0, 1500, 0});
  EXPECT_NE(first.second, second.second);
  warped.restore(first.first);
  EXPECT_EQ(shapes_of(warped), first.second);
}

TEST(WarpedStatics, BadInputIsRefusedByName) {
  const auto message = [](auto&& act) {
    try {
      act();
    } catch (const gewebe::Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const model::Model model = bar();
  statics::WarpedStatics warped(model, nullptr, test::one_thread());
  contact::Load inside;
  inside.displacement[static_cast<std::uint32_t>(model.nodes.size() - 1)] = {1, 0, 0};
  EXPECT_NE(
      message([&] { warped.update(inside); }).find("is inside, expected nodes of the surface"),
      std::string::npos);
  EXPECT_EQ(message([&] {
              const model::Model net = test::organ(3);
              statics::WarpedStatics(net, nullptr, test::one_thread());
            }),
            "the model has no tetrahedra, expected a solid for rotation=warp");
  // It goes on as if nothing had been.
  contact::Load load;
  load.force[end_of(model)[0]] = {0, 0, -100};
  warped.update(load);
  EXPECT_GT(largest(warped.surface_displacement()), 0);
}

} // namespace
} // namespace gewebe::test
