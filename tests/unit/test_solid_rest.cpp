// Solids at rest under large strains, by the step of infinite length: closed forms of uniaxial
// stretch and simple shear, an independent Newton's method, first order under small loads.

#include "fit/hyperelastic_statics.h"
#include "integrator/solid_motion.h"
#include "linalg/factor.h"
#include "tests/unit/larger.h"
#include "tests/unit/relative_difference.h"
#include "tests/unit/solid_bodies.h"
#include "tet_fixtures.h"
#include "tetrahedra/order.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace gewebe::test {
namespace {

using Numbers = std::vector<double>;
using Matrix = std::array<std::array<double, 3>, 3>;

constexpr double young = 2500;

double largest(const Numbers& a) {
  return test::largest_difference(a, Numbers(a.size()));
}

/// A solid, what is held of it and where to, and its load.
struct Rest {
  tetrahedra::TetMesh mesh;
  std::vector<fem::SolidMaterial> materials;
  std::vector<std::uint8_t> held;
  Numbers target, load;

  Rest(tetrahedra::TetMesh of, bool quadratic, double poisson, double e = young)
      : mesh(std::move(of)), materials{{e, poisson, 1e-3}} {
    if (quadratic)
      tetrahedra::make_quadratic(mesh);
    held.resize(3 * mesh.points.size());
    target.resize(held.size());
    load.resize(held.size());
  }
  void hold(
      std::size_t axis, const std::function<bool(const Vec3&)>& there,
      const std::function<double(const Vec3&)>& to = [](const Vec3&) { return 0.0; }) {
    for (std::size_t i = 0; i < mesh.points.size(); ++i)
      if (there(mesh.points[i])) {
        held[3 * i + axis] = 1;
        target[3 * i + axis] = to(mesh.points[i]);
      }
  }
  integrator::SolidMotion body(integrator::SolidLaw law, double tolerance = 1e-8) const {
    integrator::SolidMotionOptions options;
    options.law = law;
    options.tolerance = tolerance;
    options.max_rounds = 200;
    integrator::SolidMotion body(mesh, materials, options);
    body.hold(held);
    body.set_load(load);
    body.move_held(target);
    return body;
  }
  /// Sum of what holders of the nodes there push with along an axis.
  double pull(const integrator::SolidMotion& body, std::size_t axis,
              const std::function<bool(const Vec3&)>& there) const {
    double sum = 0;
    for (std::size_t i = 0; i < mesh.points.size(); ++i)
      sum += there(mesh.points[i]) ? body.reactions()[3 * i + axis] : 0;
    return sum;
  }
  Numbers by_newton(int* rounds = nullptr) const {
    const auto state = fit::hyperelastic_statics(mesh, fem::solid_elements(mesh, materials), held,
                                                 target, {load, {}});
    if (rounds != nullptr)
      *rounds = state.rounds;
    return state.displacement.axes;
  }
};

/// First Piola-Kirchhoff stress of stable Neo-Hookean material under stretches along the axes.
double stress(const fem::Elasticity& m, const std::array<double, 3>& stretch, std::size_t axis) {
  const double j = stretch[0] * stretch[1] * stretch[2],
               i_c = stretch[0] * stretch[0] + stretch[1] * stretch[1] + stretch[2] * stretch[2];
  const double mu = 4.0 / 3 * m.mu, lambda = m.lambda + 5.0 / 6 * m.mu,
               alpha = 1 + mu / lambda - mu / (4 * lambda);
  return mu * (1 - 1 / (i_c + 1)) * stretch[axis] + lambda * (j - alpha) * j / stretch[axis];
}

TEST(SolidRest, UniaxialStretchIsAnalytic) {
  for (const bool quadratic : {false, true})
    for (const double poisson : {0.3, 0.45, 0.499})
      for (const double stretch : {0.6, 1.5}) {
        Rest bar(test::box_tetrahedra(3, 1, 1), quadratic, poisson);
        for (std::size_t axis = 0; axis < 3; ++axis)
          bar.hold(axis, [&](const Vec3& p) { return p[static_cast<int>(axis)] == 0; });
        bar.hold(
            0, [](const Vec3& p) { return p.x == 3; },
            [&](const Vec3&) { return 3 * (stretch - 1); });
        integrator::SolidMotion body = bar.body(integrator::SolidLaw::hyperelastic);
        const integrator::SolidStep step = body.settle({});
        EXPECT_LE(step.left, 1e-8);
        const fem::Elasticity m = fem::elasticity(young, poisson);
        double low = 0.3, high = 2;
        for (int round = 0; round < 100; ++round) {
          const double s = (low + high) / 2;
          (stress(m, {stretch, s, s}, 1) > 0 ? high : low) = s;
        }
        for (std::size_t i = 0; i < bar.mesh.points.size(); ++i)
          for (std::size_t axis = 1; axis < 3; ++axis)
            EXPECT_NEAR(body.displacement()[3 * i + axis],
                        (low - 1) * bar.mesh.points[i][static_cast<int>(axis)], 1e-6);
        EXPECT_NEAR(bar.pull(body, 0, [](const Vec3& p) { return p.x == 3; }),
                    stress(m, {stretch, low, low}, 0), 1e-5 * young)
            << quadratic << poisson << stretch;
      }
}

/// All of the surface is sheared, and the inside follows. The work of the holders on another shear
/// is that of the stress, 4/3 mu (1 - 1/(I_C + 1)) times the shear.
TEST(SolidRest, SimpleShearIsAnalytic) {
  for (const bool quadratic : {false, true})
    for (const double shear : {0.3, 1.0}) {
      Rest box(test::box_tetrahedra(3, 3, 3), quadratic, 0.45);
      const auto outside = [](const Vec3& p) {
        return p.x == 0 || p.x == 3 || p.y == 0 || p.y == 3 || p.z == 0 || p.z == 3;
      };
      box.hold(0, outside, [&](const Vec3& p) { return shear * p.z; });
      box.hold(1, outside);
      box.hold(2, outside);
      integrator::SolidMotion body = box.body(integrator::SolidLaw::hyperelastic);
      EXPECT_LE(body.settle({}).left, 1e-8);
      double off = 0, work = 0;
      for (std::size_t i = 0; i < box.mesh.points.size(); ++i) {
        const Vec3& p = box.mesh.points[i];
        off = test::larger(off, std::abs(body.displacement()[3 * i] - shear * p.z));
        off = test::larger(off, std::abs(body.displacement()[3 * i + 1]));
        work += body.reactions()[3 * i] * p.z;
      }
      EXPECT_LE(off, 1e-6);
      EXPECT_NEAR(work / 27,
                  4.0 / 3 * fem::elasticity(young, 0.45).mu * (1 - 1 / (4 + shear * shear)) * shear,
                  1e-5 * young);
    }
}

TEST(SolidRest, ACantileverIsWhereNewtonsMethodHasIt) {
  for (const bool quadratic : {false, true})
    for (const double poisson : {0.3, 0.49}) {
      Rest beam(test::box_tetrahedra(8, 2, 2, 5), quadratic, poisson);
      for (std::size_t axis = 0; axis < 3; ++axis)
        beam.hold(axis, [](const Vec3& p) { return p.x == 0; });
      for (std::size_t i = 0; i < beam.mesh.points.size(); ++i)
        if (beam.mesh.points[i].x == 40)
          beam.load[3 * i + 2] = quadratic ? -200 : -600;
      integrator::SolidMotion body = beam.body(integrator::SolidLaw::hyperelastic);
      EXPECT_LE(body.settle({}).left, 1e-8);
      const Numbers expected = beam.by_newton();
      EXPECT_GT(largest(expected), 8);
      EXPECT_LT(test::largest_difference(body.displacement(), expected), 1e-6 * largest(expected));
    }
}

/// A bar that hangs under its weight: each piece is stretched by what hangs below.
TEST(SolidRest, AHangingBarIsAnalytic) {
  const double length = 40, density = 1e-3, gravity = 4e4;
  Rest bar(test::box_tetrahedra(1, 1, 20, 2), true, 0);
  for (std::size_t axis = 0; axis < 3; ++axis) // slides at the top, so that nothing is held across
    bar.hold(axis, [&](const Vec3& p) {
      return axis == 2 ? p.z == length : p[static_cast<int>(axis)] == 0;
    });
  const integrator::SolidMotion masses = bar.body(integrator::SolidLaw::hyperelastic);
  for (std::size_t i = 0; i < bar.mesh.points.size(); ++i)
    bar.load[3 * i + 2] = -gravity * masses.masses()[i];
  integrator::SolidMotion body = bar.body(integrator::SolidLaw::hyperelastic);
  EXPECT_LE(body.settle({}).left, 1e-8);
  const fem::Elasticity m = fem::elasticity(young, 0);
  // Stretch and stretch across, for which nothing pulls there, under a tension per area at rest.
  const auto stretch_under = [&](double tension) {
    double low = 1, high = 3;
    for (int k = 0; k < 60; ++k) {
      const double s = (low + high) / 2;
      double thin = 0.3, thick = 1.5;
      for (int n = 0; n < 60; ++n)
        (stress(m, {s, (thin + thick) / 2, (thin + thick) / 2}, 1) > 0 ? thick : thin) =
            (thin + thick) / 2;
      (stress(m, {s, thin, thin}, 0) > tension ? high : low) = s;
    }
    return low;
  };
  double fall = 0;
  const int pieces = 200;
  for (int k = 0; k < pieces; ++k)
    fall += (stretch_under(density * gravity * length * (k + 0.5) / pieces) - 1) * length / pieces;
  double lowest = 0;
  for (std::size_t i = 0; i < bar.mesh.points.size(); ++i)
    if (bar.mesh.points[i].z == 0)
      lowest = test::larger(lowest, -body.displacement()[3 * i + 2]);
  EXPECT_GT(fall, 0.2 * length);
  EXPECT_NEAR(lowest, fall, 2e-3 * fall);
}

/// From far away, corotational too: downhill, and what holders push with balances the load.
TEST(SolidRest, FarLoadsBalance) {
  for (const integrator::SolidLaw law :
       {integrator::SolidLaw::corotational, integrator::SolidLaw::hyperelastic})
    for (const bool quadratic : {false, true}) {
      Rest beam(test::box_tetrahedra(6, 2, 2, 5), quadratic, 0.45);
      for (std::size_t axis = 0; axis < 3; ++axis)
        beam.hold(axis, [](const Vec3& p) { return p.x == 0; });
      double load = 0;
      for (std::size_t i = 0; i < beam.mesh.points.size(); ++i)
        if (beam.mesh.points[i].x == 30)
          load += beam.load[3 * i + 1] = quadratic ? 200 : 400;
      integrator::SolidMotion body = beam.body(law);
      const integrator::SolidStep step = body.settle({});
      EXPECT_LE(step.left, 1e-8);
      EXPECT_NEAR(beam.pull(body, 1, [](const Vec3& p) { return p.x == 0; }), -load, 1e-5 * load);
      // Not moved when asked again, nor by what it did before.
      const Numbers once = body.displacement();
      (void)body.settle({});
      EXPECT_LT(test::largest_difference(body.displacement(), once), 1e-7 * largest(once));
    }
}

} // namespace
} // namespace gewebe::test
