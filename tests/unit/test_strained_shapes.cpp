// Solids at rest under large strains against closed forms: Rivlin's torsion of a cylinder, a thick
// sphere blown up to twice its radius, a column that buckles, a heavy bar near incompressibility.

#include "contact_checks.h"
#include "dynamics/solid_static.h"
#include "fem/solid_model.h"
#include "geometry/vector_at.h"
#include "larger.h"
#include "sim_models.h"
#include "tests/unit/relative_difference.h"
#include "tet_fixtures.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

namespace gewebe::test {
namespace {

constexpr double young = 3e4;

model::Model quadratic(tetrahedra::TetMesh mesh, double poisson,
                       const model::HyperelasticLaw& law) {
  for (Tetrahedron& t : mesh.tetrahedra)
    if (!(tetrahedra::tetrahedron_volume(mesh.points[t[0]], mesh.points[t[1]], mesh.points[t[2]],
                                         mesh.points[t[3]]) > 0))
      std::swap(t[2], t[3]);
  fem::SolidModelOptions options;
  options.material.materials = {{"gel", 1e-3, young, 1, 0.2, poisson, law}};
  options.quadratic = true;
  return fem::solid_model(std::move(mesh), options, {});
}

template <class Is>
std::vector<std::uint32_t> where(const model::Model& model, const Is& is) {
  std::vector<std::uint32_t> nodes;
  for (std::uint32_t i = 0; i < model.nodes.size(); ++i)
    if (is(model.nodes[i].position))
      nodes.push_back(i);
  return nodes;
}

/// An octant of a thick sphere: cells between directions (1, s, t) in each order of axes.
tetrahedra::TetMesh octant(double inner, double outer, int cells, int layers) {
  tetrahedra::TetMesh mesh;
  std::map<std::array<int, 4>, std::uint32_t> known;
  const auto point = [&](const std::array<int, 3>& direction, int layer) {
    const auto [entry, is_new] =
        known.try_emplace({direction[0], direction[1], direction[2], layer},
                          static_cast<std::uint32_t>(mesh.points.size()));
    if (is_new) {
      const Vec3 d{static_cast<double>(direction[0]), static_cast<double>(direction[1]),
                   static_cast<double>(direction[2])};
      mesh.points.push_back(d * ((inner + (outer - inner) * layer / layers) / norm(d)));
    }
    return entry->second;
  };
  constexpr std::array<std::array<std::size_t, 3>, 6> orders{
      {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}}};
  for (std::size_t along = 0; along < 3; ++along)
    for (int s = 0; s < cells; ++s)
      for (int t = 0; t < cells; ++t)
        for (int layer = 0; layer < layers; ++layer)
          for (const auto& order : orders) {
            std::array<int, 3> at{s, t, layer};
            Tetrahedron corners{};
            for (std::size_t k = 0; k < 4; ++k) {
              std::array<int, 3> direction{at[0], at[1], at[1]};
              direction[along] = cells;
              direction[along == 0 ? 1 : 0] = at[0];
              direction[along == 2 ? 1 : 2] = at[1];
              corners[k] = point(direction, at[2]);
              if (k < 3)
                ++at[order[k]];
            }
            mesh.tetrahedra.push_back(corners);
          }
  return mesh;
}

/// Energy per volume of Yeoh's law at C10 = mu/2, C20 = c20 mu under two equal stretches, its
/// slope, mu = 1, without a change of volume.
double biaxial_slope(double stretch, double c20) {
  const double squared = stretch * stretch, fourth = squared * squared;
  const double by = 2 * squared + 1 / fourth - 3;
  return (0.5 + 2 * c20 * by) * (4 * stretch - 4 / (fourth * stretch));
}

TEST(StrainedShapes, AThickSphereIsBlownUpToTwiceItsRadius) {
  const double inner = 10, outer = 20, c20 = 0.1, poisson = 0.4995;
  const model::Model octants = [&] {
    model::HyperelasticLaw law{model::HyperelasticLaw::yeoh, {c20, 0, 0}};
    model::Model model = quadratic(octant(inner, outer, 4, 3), poisson, law);
    for (model::Node& node : model.nodes)
      for (int axis = 0; axis < 3; ++axis)
        if (std::abs(node.position[axis]) < 1e-9)
          node.fixed = static_cast<std::uint8_t>(node.fixed | 1 << axis);
    return model;
  }();
  // p = integral of W'(s) / (s^3 - 1) between the stretches of both walls (Green, Zerna,
  // Theoretical elasticity, 1954).
  const double a = 2, b = std::cbrt(1 + 7 * inner * inner * inner / (outer * outer * outer));
  double pressure = 0;
  constexpr int parts = 2000;
  for (int k = 0; k < parts; ++k) {
    const double s = b + (a - b) * (k + 0.5) / parts;
    pressure += (a - b) / parts * biaxial_slope(s, c20) / (s * s * s - 1);
  }
  pressure *= young / 2 / (1 + poisson);
  contact::Load load;
  const auto wall = where(octants, [&](const Vec3& p) { return norm(p) < 1.05 * inner; });
  for (const std::uint32_t node : wall)
    load.pressure[node] = {-pressure};
  dynamics::SolidStatic body(octants, integrator::SolidLaw::hyperelastic, test::one_thread());
  ASSERT_NO_THROW(body.update(load));
  double radius = 0, corners = 0;
  for (const std::uint32_t node : wall)
    if (const Vec3 at = octants.nodes[node].position; std::abs(norm(at) - inner) < 1e-9) {
      radius += norm(at + vector_at(body.displacement(), node));
      ++corners;
    }
  EXPECT_GT(corners, 20);
  EXPECT_NEAR(radius / corners, 2 * inner, 0.02 * inner);
  EXPECT_LE(body.counts().factors, 20);
}

/// A cylinder along z whose cross-sections are squares drawn to a circle.
tetrahedra::TetMesh cylinder(double radius, double length, std::uint32_t cells,
                             std::uint32_t layers) {
  tetrahedra::TetMesh mesh = test::box_tetrahedra(cells, cells, layers);
  for (Vec3& p : mesh.points) {
    const double x = 2 * p.x / cells - 1, y = 2 * p.y / cells - 1;
    p = {radius * x * std::sqrt(1 - y * y / 2), radius * y * std::sqrt(1 - x * x / 2),
         length * p.z / layers};
  }
  return mesh;
}

/// Integral of x² + y² over the body, per length.
double polar_moment(const model::Model& model, double length) {
  double sum = 0;
  for (const Tetrahedron& t : model.tetrahedra) {
    double squares = 0, x = 0, y = 0;
    for (const std::uint32_t corner : t) {
      const Vec3& p = model.nodes[corner].position;
      squares += p.x * p.x + p.y * p.y;
      x += p.x;
      y += p.y;
    }
    sum += tetrahedra::tetrahedron_volume(model.nodes[t[0]].position, model.nodes[t[1]].position,
                                          model.nodes[t[2]].position, model.nodes[t[3]].position) /
           20 * (squares + x * x + y * y);
  }
  return sum / length;
}

TEST(StrainedShapes, ATwistedCylinderHasRivlinsTorqueAndIsPressed) {
  // Torque mu t J and force -mu t² J / 2 of a twist t per length, J the polar moment: the ends of
  // an incompressible Neo-Hookean cylinder are turned and stay in their planes (Rivlin, Phil.
  // Trans. A 241, 1948).
  const double length = 30, poisson = 0.4995;
  model::Model model =
      quadratic(cylinder(10, length, 4, 6), poisson, {model::HyperelasticLaw::yeoh, {}});
  const auto lower = where(model, [](const Vec3& p) { return p.z < 1e-9; });
  for (const std::uint32_t node : lower)
    model.nodes[node].fixed = model::fixed_all;
  const auto upper = where(model, [&](const Vec3& p) { return p.z > length - 1e-9; });
  const double mu = young / 2 / (1 + poisson), moment = polar_moment(model, length);
  dynamics::SolidStatic body(model, integrator::SolidLaw::hyperelastic, test::one_thread());
  const double angle = std::numbers::pi / 3;
  contact::Load load;
  for (const std::uint32_t node : upper) {
    const Vec3& p = model.nodes[node].position;
    load.displacement[node] = {std::cos(angle) * p.x - std::sin(angle) * p.y - p.x,
                               std::sin(angle) * p.x + std::cos(angle) * p.y - p.y, 0};
  }
  ASSERT_NO_THROW(body.update(load));
  double torque = 0, force = 0;
  for (const contact::NodeVector& f : body.holding_forces()) {
    const Vec3 at = model.nodes[f.node].position + vector_at(body.displacement(), f.node);
    torque += at.x * f.value.y - at.y * f.value.x;
    force += f.value.z;
  }
  const double twist = angle / length;
  EXPECT_NEAR(torque / (mu * twist * moment), 1, 0.01);
  EXPECT_NEAR(force / (-mu * twist * twist * moment / 2), 1, 0.03);
}

TEST(StrainedShapes, AColumnBucklesAtEulersLoadAndBendsAsTheElasticaBeyond) {
  // Thicker along z, so that it buckles along y alone.
  const double length = 100, side = 10, width = 15, poisson = 0.3;
  model::Model model = quadratic(test::box_tetrahedra(20, 2, 3, side / 2), poisson, {});
  for (model::Node& node : model.nodes)
    if (node.position.x < 1e-9)
      node.fixed = model::fixed_all;
  const auto end = where(model, [&](const Vec3& p) { return p.x > length - 1e-9; });
  const double euler = std::numbers::pi * std::numbers::pi * young * width * side * side * side /
                       12 / (4 * length * length);
  dynamics::SolidStatic body(model, integrator::SolidLaw::hyperelastic, test::one_thread());
  const auto mean = [&](double along, double across) {
    contact::Load load;
    for (const std::uint32_t node : end)
      load.force[node] = Vec3{-along, across, 0} / static_cast<double>(end.size());
    body.update(load);
    Vec3 sum;
    for (const std::uint32_t node : end)
      sum += vector_at(body.displacement(), node);
    return sum / static_cast<double>(end.size());
  };
  // A small force across bends it by w = w0 / (1 - P / Pc) (Southwell, Proc. R. Soc. A 135, 1932).
  const double across = 1e-4 * euler, near = 0.5 * euler, far = 0.8 * euler;
  const double w = mean(near, across).y, larger = mean(far, across).y;
  const double critical = (larger * far - w * near) / (larger - w);
  EXPECT_NEAR(critical / euler, 1, 0.02);
  // The elastica whose end has turned by 60 degrees: P = 1.152 Pc, 0.593 of the length across,
  // 0.741 of it left along (Timoshenko, Gere, Theory of elastic stability, 1961, table 2-4).
  const Vec3 bent = mean(1.152 * critical, across);
  EXPECT_NEAR(bent.y / length, 0.593, 0.012);
  EXPECT_NEAR(1 + bent.x / length, 0.741, 0.02);
}

TEST(StrainedShapes, AHeavyBarIsFoundAtOnceHoweverNearPoissonsRatioIsToOneHalf) {
  std::vector<double> before;
  for (const double poisson : {0.49, 0.499, 0.4999}) {
    model::Model model = quadratic(test::box_tetrahedra(8, 2, 2, 10), poisson, {});
    for (model::Node& node : model.nodes)
      if (node.position.x < 1e-9)
        node.fixed = model::fixed_all;
    contact::Load load;
    load.gravity = {0, 0, -9810};
    dynamics::SolidStatic body(model, integrator::SolidLaw::hyperelastic, test::one_thread());
    ASSERT_NO_THROW(body.update(load));
    EXPECT_LE(body.counts().factors, 16) << poisson;
    const std::vector<double> u(body.displacement().begin(), body.displacement().end());
    double drop = 0;
    for (const double by : u)
      drop = test::larger(drop, std::abs(by));
    EXPECT_GT(drop, 25);
    if (!before.empty()) {
      EXPECT_LE(test::relative_difference(u, before), 0.02) << poisson;
    }
    before = u;
  }
}

} // namespace
} // namespace gewebe::test
