// Laws in modified invariants: elements and meshes by closed forms under uniform strains up to a
// stretch of 3, laws that are the same under two names, flat elements.

#include "fem/assembly.h"
#include "fem/hyperelastic.h"
#include "fit/hyperelastic_statics.h"
#include "hyperelastic_laws.h"
#include "integrator/solid_motion.h"
#include "tests/unit/larger.h"
#include "tet_fixtures.h"

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <random>
#include <string>
#include <vector>

namespace gewebe::test {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double young = 2500;

/// An element of one or two orders, displaced by a uniform gradient.
struct Uniform {
  fem::SolidElement element;
  std::vector<Vec3> nodes;

  Uniform(const model::HyperelasticLaw& law, double poisson, bool quadratic) {
    constexpr std::array<Vec3, 4> corners{
        {{0.3, -0.2, 0.1}, {2.1, 0.4, -0.3}, {0.2, 1.7, 0.5}, {0.6, 0.3, 1.4}}};
    element = fem::solid_element(corners, fem::elasticity(young, poisson));
    element.law = law;
    nodes.assign(corners.begin(), corners.end());
    if (quadratic)
      for (const auto& [i, j] : tetrahedra::tetrahedron_edges)
        nodes.push_back((corners[i] + corners[j]) / 2);
  }
  fem::HyperelasticResponse
  response(const Matrix3d& f, fem::HyperelasticPart part = fem::HyperelasticPart::force) const {
    std::vector<Vec3> u;
    for (const Vec3& p : nodes) {
      const Vector3d to = f * Vector3d(p.x, p.y, p.z);
      u.push_back(Vec3{to.x(), to.y(), to.z()} - p);
    }
    fem::HyperelasticResponse r;
    fem::hyperelastic_response(element, u, {}, part, r);
    return r;
  }
  /// First Piola-Kirchhoff: the moment of the nodes' forces.
  Matrix3d stress(const Matrix3d& f) const {
    const fem::HyperelasticResponse r = response(f);
    Matrix3d sum = Matrix3d::Zero();
    for (std::size_t a = 0; a < nodes.size(); ++a)
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
          sum(i, j) -= r.force[a][i] * nodes[a][j] / element.volume;
    return sum;
  }
};

/// The root of a rising function between two numbers.
double root(double low, double high, const std::function<double(double)>& f) {
  for (int round = 0; round < 200; ++round)
    (f((low + high) / 2) > 0 ? high : low) = (low + high) / 2;
  return (low + high) / 2;
}

enum class Mode { uniaxial, equibiaxial, planar };
constexpr std::array<Mode, 3> modes{Mode::uniaxial, Mode::equibiaxial, Mode::planar};

/// Principal stretches of a material whose free sides carry nothing.
Vector3d stretches(const model::HyperelasticLaw& law, const fem::Elasticity& m, Mode mode,
                   double stretch) {
  const auto of = [&](double across) {
    return mode == Mode::uniaxial      ? Vector3d(stretch, across, across)
           : mode == Mode::equibiaxial ? Vector3d(stretch, stretch, across)
                                       : Vector3d(stretch, 1, across);
  };
  return of(root(0.05, 5, [&](double across) {
    return test::first_piola(law, m, of(across).asDiagonal())(2, 2);
  }));
}

std::string name_of(const model::HyperelasticLaw& law, double stretch, Mode mode) {
  return model::law_text(law) + ", stretch " + std::to_string(stretch) + ", mode " +
         std::to_string(static_cast<int>(mode));
}

TEST(HyperelasticLaws, StressesOfStretchedElementsAreClosedForms) {
  const Matrix3d turn = Eigen::AngleAxisd(0.7, Vector3d(1, -2, 0.5).normalized()).matrix();
  for (const model::HyperelasticLaw& law : test::modified_laws)
    for (const double poisson : {0.3, 0.4999})
      for (const bool quadratic : {false, true}) {
        const Uniform element(law, poisson, quadratic);
        const fem::Elasticity& m = element.element.material;
        for (double stretch = 0.5; stretch < 3.01; stretch += 0.25)
          for (const Mode mode : modes) {
            const Vector3d s = stretches(law, m, mode, stretch);
            const Matrix3d f = turn * s.asDiagonal();
            const Matrix3d p = element.stress(f),
                           expected = turn * test::principal_stress(law, m, s).asDiagonal();
            EXPECT_LE((p - expected).norm(), 1e-8 * (m.mu + expected.norm()))
                << name_of(law, stretch, mode) << '\n'
                << p << '\n'
                << expected;
            EXPECT_LE(std::abs((turn.transpose() * p)(2, 2)), 1e-8 * (m.mu + expected.norm()));
          }
      }
}

/// By the textbook's formulas for incompressible materials, as in Ogden, Non-linear elastic
/// deformations, 1984, sections 4.2 and 4.4: what nearly incompressible ones come to.
TEST(HyperelasticLaws, NearlyIncompressibleStressesAreThoseOfIncompressibleMaterials) {
  for (const model::HyperelasticLaw& law : test::modified_laws) {
    const Uniform element(law, 0.4999999, true);
    const double mu = element.element.material.mu;
    const auto& q = law.parameter;
    for (const double stretch : {0.5, 0.8, 1.5, 2.0, 3.0})
      for (const Mode mode : modes) {
        // With the stretch s along the pull, s^-k across.
        const double s = stretch, across = mode == Mode::uniaxial      ? 1 / std::sqrt(s)
                                           : mode == Mode::equibiaxial ? 1 / (s * s)
                                                                       : 1 / s;
        const double other = mode == Mode::uniaxial ? across : mode == Mode::equibiaxial ? s : 1;
        const double i1 = s * s + other * other + across * across,
                     i2 = 1 / (s * s) + 1 / (other * other) + 1 / (across * across), x = i1 - 3;
        (void)i2;
        double expected = 0; // nominal stress
        switch (law.kind) {
        case model::HyperelasticLaw::mooney_rivlin: {
          // t_1 - t_3 = 2 (s² - a²) (C10 + C01 other²)
          const double c01 = q[0] * mu, c10 = mu / 2 - c01;
          expected = 2 * (s * s - across * across) * (c10 + c01 * other * other) / s;
          break;
        }
        case model::HyperelasticLaw::yeoh:
          expected = 2 * (s * s - across * across) *
                     (mu / 2 + 2 * q[0] * mu * x + 3 * q[1] * mu * x * x) / s;
          break;
        default:
          expected = 2 * mu * (1 - q[2]) / q[0] * (std::pow(s, q[0]) - std::pow(across, q[0])) / s;
          if (q[2] != 0)
            expected += 2 * mu * q[2] / q[1] * (std::pow(s, q[1]) - std::pow(across, q[1])) / s;
        }
        const Vector3d found = stretches(law, element.element.material, mode, stretch);
        EXPECT_NEAR(element.stress(found.asDiagonal())(0, 0), expected,
                    3e-5 * (mu + std::abs(expected)) * (1 + std::abs(expected) / mu / 10))
            << name_of(law, stretch, mode);
      }
  }
}

/// Rivlin's universal relation t_11 - t_22 = shear t_12 besides the closed form.
TEST(HyperelasticLaws, StressesOfShearedElementsAreClosedForms) {
  for (const model::HyperelasticLaw& law : test::modified_laws)
    for (const bool quadratic : {false, true})
      for (const double shear : {0.01, 0.5, 1.5, 2.6}) {
        const Uniform element(law, 0.4999, quadratic);
        const fem::Elasticity& m = element.element.material;
        const Matrix3d f{{1, shear, 0}, {0, 1, 0}, {0, 0, 1}};
        // Principal stretches s, 1, 1/s with s - 1/s = shear; along them B has eigenvectors at
        // tan(2 angle) = 2 / shear.
        const double s = shear / 2 + std::sqrt(1 + shear * shear / 4),
                     angle = std::atan2(2, shear) / 2;
        const Vector3d p = test::principal_stress(law, m, {s, 1, 1 / s}),
                       t = p.cwiseProduct(Vector3d(s, 1, 1 / s));
        const double c = std::cos(angle), d = std::sin(angle);
        const Matrix3d cauchy{{c * c * t[0] + d * d * t[2], c * d * (t[0] - t[2]), 0},
                              {c * d * (t[0] - t[2]), d * d * t[0] + c * c * t[2], 0},
                              {0, 0, t[1]}};
        const Matrix3d found = element.stress(f) * f.transpose();
        EXPECT_LE((found - cauchy).norm(), 1e-8 * (m.mu + cauchy.norm()))
            << name_of(law, shear, {});
        EXPECT_NEAR(found(0, 0) - found(1, 1), shear * found(0, 1), 1e-8 * (m.mu + cauchy.norm()));
      }
}

Matrix3d any_gradient(std::mt19937& random, double size) {
  std::uniform_real_distribution<double> any(-1, 1);
  Matrix3d f = Matrix3d::Identity();
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      f(i, j) += size * any(random);
  return f;
}

/// Ogden's law with the powers 2 and -2 is Mooney and Rivlin's, and that without C01 is Yeoh's.
TEST(HyperelasticLaws, LawsThatAreTheSameHaveTheSameTangents) {
  const std::array<std::array<model::HyperelasticLaw, 2>, 4> same{{
      {{{model::HyperelasticLaw::mooney_rivlin, {}}, {model::HyperelasticLaw::yeoh, {}}}},
      {{{model::HyperelasticLaw::mooney_rivlin, {}}, {model::HyperelasticLaw::ogden, {2}}}},
      {{{model::HyperelasticLaw::mooney_rivlin, {0.5}}, {model::HyperelasticLaw::ogden, {-2}}}},
      {{{model::HyperelasticLaw::mooney_rivlin, {0.15}},
        {model::HyperelasticLaw::ogden, {2, -2, 0.3}}}},
  }};
  std::mt19937 random(3);
  std::vector<Matrix3d> gradients{Matrix3d::Identity(), 1.1 * Matrix3d::Identity()};
  // Two or three equal or nearly equal stretches, down to where all are alike.
  for (const double apart : {0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3, 0.02, 0.04, 0.1}) {
    const Matrix3d left = Eigen::Quaterniond::UnitRandom().matrix(),
                   right = Eigen::Quaterniond::UnitRandom().matrix();
    gradients.push_back(left * Vector3d(1.2, 1.2 + apart, 0.8).asDiagonal() * right);
    gradients.push_back(left * Vector3d(0.9, 0.9 + apart, 0.9 - apart / 2).asDiagonal() * right);
  }
  for (int n = 0; n < 20; ++n)
    gradients.push_back(any_gradient(random, 0.3));
  for (const auto& [a, b] : same)
    for (const Matrix3d& f : gradients) {
      if (f.determinant() < 0.2)
        continue;
      const Uniform one(a, 0.4, false), two(b, 0.4, false);
      const auto r = one.response(f, fem::HyperelasticPart::tangent),
                 s = two.response(f, fem::HyperelasticPart::tangent);
      EXPECT_NEAR(r.energy, s.energy, 1e-13 * (young + r.energy)) << model::law_text(b);
      double force = 0, tangent = 0, size = 0;
      for (std::size_t n = 0; n < 4; ++n)
        force = test::larger(force, norm(r.force[n] - s.force[n]));
      for (std::size_t n = 0; n < r.tangent.size(); ++n) {
        tangent = test::larger(tangent, std::abs(r.tangent[n] - s.tangent[n]));
        size = test::larger(size, std::abs(r.tangent[n]));
      }
      EXPECT_LE(force, 1e-13 * size) << model::law_text(b);
      EXPECT_LE(tangent, 1e-13 * size) << model::law_text(b);
    }
}

/// Tangents at close stretches by differences of forces: where their quotients change their form.
TEST(HyperelasticLaws, TangentsOfCloseStretchesAreDerivatives) {
  for (const model::HyperelasticLaw& law : test::modified_laws)
    for (const double apart : {0.0, 1e-13, 1e-8, 1e-4, 0.01, 0.015, 0.017, 0.03}) {
      const Uniform element(law, 0.45, false);
      const Matrix3d f = Eigen::AngleAxisd(0.4, Vector3d(3, 1, 2).normalized()) *
                         Vector3d(1.3, 1.3 + apart, 0.9).asDiagonal() *
                         Eigen::AngleAxisd(1.4, Vector3d(1, -1, 2).normalized());
      const auto r = element.response(f, fem::HyperelasticPart::tangent);
      double worst = 0, size = 0;
      const double h = 1e-4;
      std::vector<Vec3> u(4);
      for (std::size_t a = 0; a < 4; ++a) {
        const Vec3& p = element.nodes[a];
        const Vector3d to = f * Vector3d(p.x, p.y, p.z);
        u[a] = Vec3{to.x(), to.y(), to.z()} - p;
      }
      for (std::size_t n = 0; n < 12; ++n) {
        std::array<Vec3, 4> change{};
        for (const auto& [step, weight] : std::array<std::array<double, 2>, 4>{
                 {{-2, 1.0 / 12}, {-1, -8.0 / 12}, {1, 8.0 / 12}, {2, -1.0 / 12}}}) {
          std::vector<Vec3> there = u;
          there[n / 3][static_cast<int>(n % 3)] += step * h;
          fem::HyperelasticResponse s;
          fem::hyperelastic_response(element.element, there, {}, fem::HyperelasticPart::force, s);
          for (std::size_t a = 0; a < 4; ++a)
            change[a] += weight / h * s.force[a];
        }
        for (std::size_t row = 0; row < 12; ++row) {
          const double k = r.tangent[33 * row + n];
          worst = test::larger(worst, std::abs(change[row / 3][static_cast<int>(row % 3)] + k));
          size = test::larger(size, std::abs(k));
        }
      }
      EXPECT_LE(worst, 1e-9 * size) << model::law_text(law) << ' ' << apart;
    }
}

/// A shrunk or mirrored element grows back: no balance on the way.
TEST(HyperelasticLaws, CollapsedElementsUnfold) {
  for (const model::HyperelasticLaw& law : test::modified_laws)
    for (const double poisson : {0.0, 0.3, 0.49})
      for (double scale = -1.005; scale < 0.99; scale += 0.01) {
        const Uniform element(law, poisson, false);
        const Matrix3d flat = Vector3d(1, 1, scale).asDiagonal();
        EXPECT_LT(element.stress(flat)(2, 2), 0) << name_of(law, scale, {}) << ' ' << poisson;
        if (scale > 0) {
          EXPECT_LT(element.stress(scale * Matrix3d::Identity()).trace(), 0)
              << name_of(law, scale, {}) << ' ' << poisson;
        }
      }
}

/// A box whose sides are moved.
struct Box {
  tetrahedra::TetMesh mesh;
  std::vector<fem::SolidElement> elements;
  std::vector<std::uint8_t> fixed;
  std::vector<double> prescribed;

  Box(const model::HyperelasticLaw& law, double poisson, bool quadratic, bool distorted)
      : mesh(test::box_tetrahedra(2, 2, 2)) {
    std::mt19937 random(11);
    std::uniform_real_distribution<double> any(-1, 1);
    for (Vec3& p : mesh.points)
      for (int axis = 0; axis < 3; ++axis)
        if (distorted && p[axis] == 1) // sides stay where they are
          p[axis] += 0.25 * any(random);
    if (quadratic)
      tetrahedra::make_quadratic(mesh);
    elements = fem::solid_elements(mesh, std::array{fem::SolidMaterial{young, poisson, 1, law}});
    fixed.resize(3 * mesh.points.size());
    prescribed.resize(fixed.size());
  }
  void hold(int axis, double side, double by) {
    for (std::size_t i = 0; i < mesh.points.size(); ++i)
      if (mesh.points[i][axis] == side) {
        fixed[3 * i + static_cast<std::size_t>(axis)] = 1;
        prescribed[3 * i + static_cast<std::size_t>(axis)] = by;
      }
  }
  fit::HyperelasticState solve() const {
    return fit::hyperelastic_statics(mesh, elements, fixed, prescribed,
                                     {std::vector<double>(fixed.size()), {}});
  }
  /// First Piola-Kirchhoff stress, its mean: the moment of the forces that hold the box.
  Matrix3d mean_stress(const fit::HyperelasticState& state) const {
    const fit::SolidVector f = fit::hyperelastic_forces(mesh, elements, state.displacement);
    Matrix3d sum = Matrix3d::Zero();
    for (std::size_t i = 0; i < mesh.points.size(); ++i)
      for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column)
          sum(row, column) -=
              f.axes[3 * i + static_cast<std::size_t>(row)] * mesh.points[i][column] / 8;
    return sum;
  }
  /// Force on a side.
  Vec3 pull(const fit::HyperelasticState& state, int axis) const {
    const fit::SolidVector f = fit::hyperelastic_forces(mesh, elements, state.displacement);
    Vec3 sum;
    for (std::size_t i = 0; i < mesh.points.size(); ++i)
      if (mesh.points[i][axis] == 2)
        sum -= Vec3{f.axes[3 * i], f.axes[3 * i + 1], f.axes[3 * i + 2]};
    return sum;
  }
};

/// In equibiaxial and planar compression a free surface of a Neo-Hookean body wrinkles below
/// stretches of 0.67 and 0.54 (Biot, Mechanics of incremental deformations, 1965), so that meshes
/// are less compressed than elements.
TEST(HyperelasticLaws, StretchedMeshesAreClosedForms) {
  std::size_t n = 0; // each kind of mesh is met by each law
  for (const model::HyperelasticLaw& law : test::modified_laws)
    for (const Mode mode : modes)
      for (const double stretch : {mode == Mode::uniaxial ? 0.5 : 0.75, 1.6, 3.0}) {
        const bool quadratic = n % 2 != 0, distorted = n / 2 % 2 != 0;
        ++n;
        SCOPED_TRACE(name_of(law, stretch, mode) + (quadratic ? " quadratic" : "") +
                     (distorted ? " distorted" : ""));
        Box box(law, 0.4995, quadratic, distorted);
        for (int axis = 0; axis < 3; ++axis)
          box.hold(axis, 0, 0);
        box.hold(0, 2, 2 * (stretch - 1));
        if (mode != Mode::uniaxial)
          box.hold(1, 2, mode == Mode::planar ? 0 : 2 * (stretch - 1));
        fit::HyperelasticState state;
        ASSERT_NO_THROW(state = box.solve());
        const fem::Elasticity m = fem::elasticity(young, 0.4995);
        const Vector3d s = stretches(law, m, mode, stretch), p = test::principal_stress(law, m, s);
        for (int axis = 0; axis < 2; ++axis)
          EXPECT_NEAR(box.pull(state, axis)[axis] / 4, p[axis], 1e-6 * (m.mu + p.norm()))
              << name_of(law, stretch, mode);
        for (std::size_t i = 0; i < box.mesh.points.size(); ++i)
          for (int axis = 0; axis < 3; ++axis)
            EXPECT_NEAR(state.displacement.axes[3 * i + static_cast<std::size_t>(axis)],
                        (s[axis] - 1) * box.mesh.points[i][axis], 1e-6);
      }
}

/// Patch test: sides follow a uniform gradient, and so does what is inside.
TEST(HyperelasticLaws, PatchesFollowUniformGradients) {
  const Matrix3d shear{{1, 1.2, 0}, {0, 1, 0}, {0, 0, 1}},
      other = Eigen::AngleAxisd(0.6, Vector3d(1, 2, -1).normalized()) *
              Matrix3d{{1.5, 0.3, -0.2}, {0.1, 0.8, 0.2}, {0, -0.3, 0.9}};
  for (const model::HyperelasticLaw& law : test::modified_laws)
    for (const bool quadratic : {false, true})
      for (const Matrix3d& f : {shear, other}) {
        Box box(law, 0.495, quadratic, true);
        for (std::size_t i = 0; i < box.mesh.points.size(); ++i) {
          const Vec3& p = box.mesh.points[i];
          const Vector3d u = (f - Matrix3d::Identity()) * Vector3d(p.x, p.y, p.z);
          for (int axis = 0; axis < 3; ++axis)
            for (int side = 0; side < 3; ++side)
              if (p[side] == 0 || p[side] == 2) {
                box.fixed[3 * i + static_cast<std::size_t>(axis)] = 1;
                box.prescribed[3 * i + static_cast<std::size_t>(axis)] = u[axis];
              }
        }
        const fit::HyperelasticState state = box.solve();
        double worst = 0;
        for (std::size_t i = 0; i < box.mesh.points.size(); ++i) {
          const Vec3& p = box.mesh.points[i];
          const Vector3d u = (f - Matrix3d::Identity()) * Vector3d(p.x, p.y, p.z);
          for (int axis = 0; axis < 3; ++axis)
            worst = test::larger(
                worst, std::abs(state.displacement.axes[3 * i + static_cast<std::size_t>(axis)] -
                                u[axis]));
        }
        EXPECT_LE(worst, 1e-9) << model::law_text(law);
        const Matrix3d expected = test::first_piola(law, fem::elasticity(young, 0.495), f);
        EXPECT_LE((box.mean_stress(state) - expected).norm(), 1e-8 * (young + expected.norm()));
      }
}

/// Of each kind one, for time's sake.
const std::array<model::HyperelasticLaw, 3> moving_laws{
    test::modified_laws[1], test::modified_laws[2], test::modified_laws[7]};

/// A bar that is held at one end.
struct Bar {
  tetrahedra::TetMesh mesh = test::box_tetrahedra(4, 1, 1, 5);
  std::vector<fem::SolidMaterial> materials;
  std::vector<std::uint8_t> fixed;

  Bar(const model::HyperelasticLaw& law, bool quadratic) : materials{{2e4, 0.47, 1e-3, law}} {
    if (quadratic)
      tetrahedra::make_quadratic(mesh);
    for (const Vec3& p : mesh.points)
      fixed.insert(fixed.end(), 3, p.x == 0 ? 1 : 0);
  }
  integrator::SolidMotion moving() const {
    integrator::SolidMotionOptions options;
    options.law = integrator::SolidLaw::hyperelastic;
    options.tolerance = 1e-6;
    options.max_rounds = 100;
    integrator::SolidMotion motion(mesh, materials, options);
    motion.hold(fixed);
    return motion;
  }
};

TEST(HyperelasticLaws, MovingSolidsComeToRestWhereTheyAreInBalance) {
  for (const model::HyperelasticLaw& law : moving_laws)
    for (const bool quadratic : {false, true}) {
      const Bar bar(law, quadratic);
      integrator::SolidMotion moving = bar.moving();
      fit::SolidVector load{std::vector<double>(bar.fixed.size()), {}};
      for (std::size_t n = 0; n < bar.mesh.points.size(); ++n) {
        load.axes[3 * n] = 4e5 * moving.masses()[n];
        load.axes[3 * n + 2] = 3e4 * moving.masses()[n];
      }
      moving.set_load(load.axes);
      for (int n = 0; n < 30; ++n)
        (void)moving.step(1, {});
      const std::vector<double> found = moving.displacement();
      const std::vector<double> expected =
          fit::hyperelastic_statics(bar.mesh, fem::solid_elements(bar.mesh, bar.materials),
                                    bar.fixed, {}, load)
              .displacement.axes;
      double worst = 0, most = 0;
      for (std::size_t axis = 0; axis < found.size(); ++axis) {
        worst = test::larger(worst, std::abs(found[axis] - expected[axis]));
        most = test::larger(most, std::abs(expected[axis]));
      }
      EXPECT_GT(most, 2) << model::law_text(law);
      EXPECT_LE(worst, 1e-4 * most) << model::law_text(law) << ' ' << quadratic;
    }
}

TEST(HyperelasticLaws, SolidsThatAreMirroredFindBack) {
  for (const model::HyperelasticLaw& law : moving_laws)
    for (const bool quadratic : {false, true}) {
      const Bar bar(law, quadratic);
      integrator::SolidMotion moving = bar.moving();
      // Folded into its own first quarter, without velocity.
      std::vector<double> u(bar.fixed.size());
      for (std::size_t n = 0; n < bar.mesh.points.size(); ++n)
        u[3 * n] = -1.4 * test::larger(0.0, bar.mesh.points[n].x - 5);
      moving.set_state(u, std::vector<double>(u.size()));
      const double folded = moving.elastic_energy();
      EXPECT_TRUE(std::isfinite(folded));
      for (int n = 0; n < 60; ++n)
        (void)moving.step(0.1, {});
      EXPECT_LE(moving.elastic_energy(), 1e-6 * folded) << model::law_text(law) << ' ' << quadratic;
    }
}

} // namespace
} // namespace gewebe::test
