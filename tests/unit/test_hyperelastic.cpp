// Hyperelastic solids: the element by finite differences and by fem/element.h at rest, bodies by
// analysis: uniaxial stretch, an elastica, a motion made up, order of convergence.

#include "base/cpu.h"
#include "base/error.h"
#include "fem/assembly.h"
#include "fem/hyperelastic.h"
#include "fem/hyperelastic_kernel_internal.h"
#include "fit/hyperelastic_statics.h"
#include "hyperelastic_laws.h"
#include "linalg/factor.h"
#include "tests/unit/larger.h"
#include "tet_fixtures.h"
#include "tetrahedra/boundary.h"

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <random>
#include <vector>

namespace gewebe::test {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double young = 2500;
constexpr std::array<Vec3, 4> corners{
    {{0.3, -0.2, 0.1}, {2.1, 0.4, -0.3}, {0.2, 1.7, 0.5}, {0.6, 0.3, 1.4}}};
constexpr std::array<model::HyperelasticLaw, 2> laws{test::stable_neo_hookean, test::neo_hookean};

std::vector<model::HyperelasticLaw> all_laws() {
  std::vector<model::HyperelasticLaw> all(laws.begin(), laws.end());
  all.insert(all.end(), test::modified_laws.begin(), test::modified_laws.end());
  return all;
}

Vec3 vec(const Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}
Vector3d eigen(const Vec3& v) {
  return {v.x, v.y, v.z};
}

/// An element under displacements of its nodes, the last one the bubble's.
struct Moved {
  fem::SolidElement element;
  bool quadratic = false;
  std::vector<Vec3> u;

  std::size_t unknowns() const { return quadratic ? 33 : 12; }
  fem::HyperelasticResponse response(const model::HyperelasticLaw& law,
                                     fem::HyperelasticPart part) const {
    fem::HyperelasticResponse r;
    fem::SolidElement own = element;
    own.law = law;
    fem::hyperelastic_response(own, std::span(u).first(quadratic ? 10 : 4), u.back(), part, r);
    return r;
  }
  MatrixXd tangent(const model::HyperelasticLaw& law, fem::HyperelasticPart part) const {
    const auto r = response(law, part);
    const auto n = static_cast<Eigen::Index>(unknowns());
    MatrixXd k(n, n);
    for (Eigen::Index row = 0; row < n; ++row)
      for (Eigen::Index column = 0; column < n; ++column)
        k(row, column) = r.tangent[static_cast<std::size_t>(33 * row + column)];
    return k;
  }
};

/// Nodes of the element at rest, the bubble's amplitude 0.
std::vector<Vec3> places(bool quadratic) {
  std::vector<Vec3> p(corners.begin(), corners.end());
  if (quadratic) {
    for (const auto& [i, j] : tetrahedra::tetrahedron_edges)
      p.push_back((corners[i] + corners[j]) / 2);
    p.push_back({});
  }
  return p;
}

/// Nodes anywhere, or mirrored.
Moved moved(bool quadratic, double poisson, double by, bool mirrored = false) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(-1, 1);
  Moved m{fem::solid_element(corners, fem::elasticity(young, poisson)), quadratic,
          places(quadratic)};
  const Matrix3d turn = Eigen::AngleAxisd(1.3, Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  for (std::size_t a = 0; a < m.u.size(); ++a) {
    Vector3d to = turn * eigen(m.u[a]);
    if (mirrored)
      to.z() *= -0.6;
    Vec3 u = a == 10 ? Vec3{} : vec(to) - m.u[a];
    for (int axis = 0; axis < 3; ++axis)
      u[axis] += by * any(random);
    m.u[a] = u;
  }
  return m;
}

/// The same by the formula, in its order.
double entry_of(const fem::TangentPoint& q, std::size_t m, std::size_t n, std::size_t i,
                std::size_t j) {
  const auto gradient = [&](std::size_t k) {
    return Vec3{q.gradient[0][k], q.gradient[1][k], q.gradient[2][k]};
  };
  const auto times = [](const std::array<double, 9>& a, const Vec3& v) {
    return Vec3{a[0] * v.x + a[1] * v.y + a[2] * v.z, a[3] * v.x + a[4] * v.y + a[5] * v.z,
                a[6] * v.x + a[7] * v.y + a[8] * v.z};
  };
  const Vec3 turned = times(q.f, cross(gradient(m), gradient(n))) * q.d;
  const double even = q.a * dot(gradient(m), gradient(n));
  const std::array<double, 9> skew{even,     turned.z, -turned.y, -turned.z, even,
                                   turned.x, turned.y, -turned.x, even};
  const int row = static_cast<int>(i), column = static_cast<int>(j);
  return q.weight *
         (skew[3 * i + j] +
          (q.b * times(q.f, gradient(m))[row] * times(q.f, gradient(n))[column] +
           q.c * times(q.cofactor, gradient(m))[row] * times(q.cofactor, gradient(n))[column]));
}

TEST(HyperelasticKernel, GivesTheSameBitsAtEveryLevelOfCpu) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> any(-1, 1);
  std::vector<fem::AddTangent> kernels{&fem::add_tangent_baseline};
  if (best_cpu_level() != CpuLevel::baseline)
    kernels.push_back(&fem::add_tangent_avx2);
  for (const std::size_t count : {4U, 11U}) {
    std::vector<fem::TangentPoint> points(3);
    for (fem::TangentPoint& q : points) {
      for (double* const value : {&q.weight, &q.a, &q.b, &q.c, &q.d})
        *value = any(random);
      for (std::size_t k = 0; k < 9; ++k) {
        q.f[k] = any(random);
        q.cofactor[k] = any(random);
      }
      for (auto& axis : q.gradient)
        for (std::size_t n = 0; n < count; ++n)
          axis[n] = any(random);
    }
    for (const fem::AddTangent kernel : kernels) {
      fem::TangentSums sums{};
      for (const fem::TangentPoint& q : points)
        kernel(q, count, sums);
      for (std::size_t k = 0; k < 9; ++k)
        for (std::size_t m = 0; m < count; ++m)
          for (std::size_t n = m; n < count; ++n) {
            double sum = 0;
            for (const fem::TangentPoint& q : points)
              sum += entry_of(q, m, n, k / 3, k % 3);
            EXPECT_EQ(sums[k][m][n], sum);
          }
    }
  }
}

TEST(Hyperelastic, AtRestItIsTheElementOfSmallStrains) {
  for (const double poisson : {0.0, 0.3, 0.499})
    for (const model::HyperelasticLaw& law : all_laws())
      for (const bool quadratic : {false, true})
        for (const auto part :
             {fem::HyperelasticPart::tangent, fem::HyperelasticPart::positive_tangent}) {
          Moved m{fem::solid_element(corners, fem::elasticity(young, poisson)), quadratic, {}};
          m.u.resize(quadratic ? 11 : 4);
          const fem::HyperelasticResponse r = m.response(law, part);
          EXPECT_NEAR(r.energy, 0, 1e-14 * young * m.element.volume);
          MatrixXd k = m.tangent(law, part);
          for (const Vec3& f : r.force)
            EXPECT_LE(norm(f), 1e-14 * k.norm());
          if (quadratic) {
            const MatrixXd bubble = k.bottomRightCorner(3, 3);
            k = MatrixXd(k.topLeftCorner(30, 30) -
                         k.topRightCorner(30, 3) * bubble.inverse() * k.bottomLeftCorner(3, 30));
          }
          double worst = 0;
          for (std::size_t a = 0; a < (quadratic ? 10U : 4U); ++a)
            for (std::size_t b = 0; b < (quadratic ? 10U : 4U); ++b) {
              const fem::SolidBlock block = quadratic ? fem::quadratic_block(m.element, a, b)
                                                      : fem::linear_block(m.element, a, b);
              for (std::size_t i = 0; i < 9; ++i)
                worst = test::larger(
                    worst, std::abs(block[i] - k(static_cast<Eigen::Index>(3 * a + i / 3),
                                                 static_cast<Eigen::Index>(3 * b + i % 3))));
            }
          // The positive one raises the rotations' eigenvalues from 0 to mu / 1000.
          if (part == fem::HyperelasticPart::tangent)
            EXPECT_LE(worst, 1e-13 * k.norm()) << poisson << ' ' << quadratic;
          else
            EXPECT_LE(worst, 1e-3 * k.norm()) << poisson << ' ' << quadratic;
        }
}

TEST(Hyperelastic, ForcesAndTangentsAreDerivatives) {
  for (const bool mirrored : {false, true})
    for (const double poisson : {0.0, 0.3, 0.499})
      for (const model::HyperelasticLaw& law : all_laws())
        for (const bool quadratic : {false, true}) {
          if (mirrored && law.kind == model::HyperelasticLaw::neo_hookean)
            continue;
          Moved m = moved(quadratic, poisson, mirrored ? 0.2 : 0.05, mirrored);
          const auto r = m.response(law, fem::HyperelasticPart::force);
          const MatrixXd k = m.tangent(law, fem::HyperelasticPart::tangent);
          EXPECT_LE((k - k.transpose()).norm(), 1e-14 * k.norm());
          VectorXd slope(k.rows()), force(k.rows());
          MatrixXd change(k.rows(), k.rows());
          const double h = 1e-4;
          for (Eigen::Index n = 0; n < k.rows(); ++n) {
            const auto a = static_cast<std::size_t>(n / 3);
            const int axis = static_cast<int>(n % 3);
            force[n] = r.force[a][axis];
            // Four places: errors of h⁴.
            const double at = m.u[a][axis];
            slope[n] = 0;
            change.col(n).setZero();
            for (const auto& [step, weight] : std::array<std::array<double, 2>, 4>{
                     {{-2, 1.0 / 12}, {-1, -8.0 / 12}, {1, 8.0 / 12}, {2, -1.0 / 12}}}) {
              m.u[a][axis] = at + step * h;
              const auto there = m.response(law, fem::HyperelasticPart::force);
              slope[n] += weight / h * there.energy;
              for (Eigen::Index row = 0; row < k.rows(); ++row)
                change(row, n) +=
                    weight / h *
                    there.force[static_cast<std::size_t>(row / 3)][static_cast<int>(row % 3)];
            }
            m.u[a][axis] = at;
          }
          EXPECT_GT(force.norm(), 10);
          EXPECT_LE((slope + force).norm(), 1e-8 * k.norm()) << poisson << ' ' << quadratic;
          EXPECT_LE((change + k).norm(), 1e-8 * k.norm()) << poisson << ' ' << quadratic;
        }
}

TEST(Hyperelastic, ATurnedFrameTurnsForcesAlone) {
  const Matrix3d turn =
      Eigen::AngleAxisd(2.1, Vector3d(-1, 0.5, 2).normalized()).toRotationMatrix();
  for (const model::HyperelasticLaw& law : all_laws())
    for (const bool quadratic : {false, true}) {
      const Moved m = moved(quadratic, 0.49, 0.05);
      Moved other = m;
      const auto at = places(quadratic);
      for (std::size_t a = 0; a < other.u.size(); ++a)
        other.u[a] =
            vec(turn * eigen(at[a] + m.u[a]) + (a < 10 ? Vector3d(3, 1, -2) : Vector3d(0, 0, 0))) -
            at[a];
      const auto r = m.response(law, fem::HyperelasticPart::force),
                 s = other.response(law, fem::HyperelasticPart::force);
      EXPECT_GT(r.energy, 1);
      EXPECT_NEAR(r.energy, s.energy, 1e-12 * r.energy);
      double size = 0, worst = 0;
      for (std::size_t a = 0; a < m.u.size(); ++a) {
        size = test::larger(size, norm(r.force[a]));
        worst = test::larger(worst, (turn * eigen(r.force[a]) - eigen(s.force[a])).norm());
      }
      EXPECT_LE(worst, 1e-12 * size);
      // A body that only turns is at rest.
      Moved turned = m;
      for (std::size_t a = 0; a < turned.u.size(); ++a)
        turned.u[a] = vec(turn * eigen(at[a])) - at[a];
      const auto none = turned.response(law, fem::HyperelasticPart::force);
      EXPECT_NEAR(none.energy, 0, 1e-12 * young);
      for (const Vec3& f : none.force)
        EXPECT_LE(norm(f), 1e-11 * young);
    }
}

TEST(Hyperelastic, PositiveTangentsArePositive) {
  for (const model::HyperelasticLaw& law : all_laws())
    for (const bool mirrored : {false, true})
      for (const bool quadratic : {false, true}) {
        if (law.kind == model::HyperelasticLaw::neo_hookean)
          continue; // inverted here
        const Moved m = moved(quadratic, 0.4, 0.4, mirrored);
        const auto least = [&](fem::HyperelasticPart part) {
          const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(m.tangent(law, part));
          return solver.eigenvalues()[0] / solver.eigenvalues().maxCoeff();
        };
        EXPECT_LT(least(fem::HyperelasticPart::tangent), -1e-5);
        EXPECT_GT(least(fem::HyperelasticPart::positive_tangent), -1e-13);
      }
}

TEST(Hyperelastic, AnInvertedElementHasAnEnergyUnlessClassical) {
  for (const bool quadratic : {false, true}) {
    const Moved flat = [&] {
      Moved m = moved(quadratic, 0.45, 0);
      const auto at = places(quadratic);
      for (std::size_t a = 0; a < m.u.size(); ++a)
        m.u[a] = {0, 0, -at[a].z};
      return m;
    }();
    for (const Moved& m : {flat, moved(quadratic, 0.45, 0, true)}) {
      for (const model::HyperelasticLaw& law : all_laws()) {
        const auto r = m.response(law, fem::HyperelasticPart::force);
        if (law.kind == model::HyperelasticLaw::neo_hookean) {
          EXPECT_EQ(r.energy, HUGE_VAL);
          continue;
        }
        EXPECT_TRUE(std::isfinite(r.energy));
        EXPECT_GT(r.energy, 100);
        EXPECT_GT(norm(r.force[3]) + norm(r.force[9]), 1);
      }
    }
  }
}

/// A body that is held.
struct Body {
  tetrahedra::TetMesh mesh;
  std::vector<fem::SolidMaterial> materials;
  std::vector<fem::SolidElement> elements;
  std::vector<std::uint8_t> fixed;
  std::vector<double> prescribed;

  Body(tetrahedra::TetMesh of_corners, bool quadratic, const fem::SolidMaterial& material)
      : mesh(std::move(of_corners)), materials{material} {
    if (quadratic)
      tetrahedra::make_quadratic(mesh);
    elements = fem::solid_elements(mesh, materials);
    fixed.resize(3 * mesh.points.size());
    prescribed.resize(fixed.size());
  }
  void hold(int axis, const std::function<bool(const Vec3&)>& held, double to = 0) {
    for (std::size_t i = 0; i < mesh.points.size(); ++i)
      if (held(mesh.points[i])) {
        fixed[3 * i + static_cast<std::size_t>(axis)] = 1;
        prescribed[3 * i + static_cast<std::size_t>(axis)] = to;
      }
  }
  std::vector<double> end_load(double x, const Vec3& traction) const {
    const tetrahedra::TetBoundary faces = tetrahedra::boundary(mesh);
    std::vector<std::uint32_t> found;
    for (std::uint32_t k = 0; k < faces.mesh.triangles.size(); ++k) {
      bool there = true;
      for (const std::uint32_t c : faces.mesh.triangles[k])
        there = there && faces.mesh.points[c].x > x - 1e-6;
      if (there)
        found.push_back(k);
    }
    return fem::traction_load(mesh, faces, found, traction);
  }
  fit::HyperelasticState solve(const fit::SolidVector& load,
                               fit::HyperelasticOptions options = {}) const {
    return fit::hyperelastic_statics(mesh, elements, fixed, prescribed, load, options);
  }
  Vec3 displacement(const fit::SolidVector& u, const Vec3& p) const {
    for (std::size_t i = 0; i < mesh.points.size(); ++i)
      if (norm(mesh.points[i] - p) < 1e-9 * (1 + norm(p)))
        return {u.axes[3 * i], u.axes[3 * i + 1], u.axes[3 * i + 2]};
    ADD_FAILURE() << "no node there";
    return {};
  }
};

TEST(HyperelasticStatics, UniaxialStretchIsAnalytic) {
  for (const model::HyperelasticLaw& law : laws)
    for (const bool quadratic : {false, true})
      for (const double poisson : {0.3, 0.499})
        for (const double stretch : {0.6, 1.7}) {
          Body box(test::box_tetrahedra(2, 1, 1), quadratic, {young, poisson, 1, law});
          for (int axis = 0; axis < 3; ++axis)
            box.hold(axis, [&](const Vec3& p) { return p[axis] == 0; });
          box.hold(
              0, [](const Vec3& p) { return p.x == 2; }, 2 * (stretch - 1));
          const fit::SolidVector no_load{std::vector<double>(box.fixed.size()), {}};
          const auto state = box.solve(no_load);
          // The stretch across for which nothing pulls there.
          const fem::Elasticity m = fem::elasticity(young, poisson);
          const auto across = [&](double s) {
            return test::first_piola(law, m, Vector3d(stretch, s, s).asDiagonal())(1, 1);
          };
          double low = 0.3, high = 2;
          for (int round = 0; round < 100; ++round)
            (across((low + high) / 2) > 0 ? high : low) = (low + high) / 2;
          const Vec3 u = box.displacement(state.displacement, {2, 1, 1});
          EXPECT_NEAR(u.y, low - 1, 1e-9);
          EXPECT_NEAR(u.z, low - 1, 1e-9);
          const auto f = fit::hyperelastic_forces(box.mesh, box.elements, state.displacement);
          double pull = 0;
          for (std::size_t i = 0; i < box.mesh.points.size(); ++i)
            pull -= box.mesh.points[i].x == 2 ? f.axes[3 * i] : 0;
          EXPECT_NEAR(pull,
                      test::first_piola(law, m, Vector3d(stretch, low, low).asDiagonal())(0, 0),
                      1e-7 * young);
          EXPECT_LE(state.residual, 1e-10);
        }
}

TEST(HyperelasticStatics, SmallLoadsGiveSmallStrains) {
  for (const bool quadratic : {false, true}) {
    Body beam(test::box_tetrahedra(6, 2, 2), quadratic, {young, 0.499, 1});
    for (int axis = 0; axis < 3; ++axis)
      beam.hold(axis, [](const Vec3& p) { return p.x == 0; });
    const Vec3 g{0, 1e-6, -3e-6};
    const auto state =
        beam.solve(fit::hyperelastic_weight(beam.mesh, beam.materials, beam.elements, g));
    const auto load = fem::gravity_load(beam.mesh, beam.materials, beam.elements, g);
    const linalg::StiffnessMatrix k = fem::solid_stiffness(beam.mesh, beam.elements, beam.fixed);
    std::vector<double> u(load.size());
    linalg::solve_axes(k, linalg::Factor(k, {}), load, u);
    double worst = 0, most = 0;
    for (std::size_t axis = 0; axis < u.size(); ++axis) {
      worst = test::larger(worst, std::abs(u[axis] - state.displacement.axes[axis]));
      most = test::larger(most, std::abs(u[axis]));
    }
    EXPECT_LE(worst, 1e-6 * most);
    EXPECT_GT(most, 1e-8);
  }
}

/// A slender beam under an end load that keeps its direction (Bisshopp, Drucker, Large deflection
/// of cantilever beams, 1945): with P L² / E I = 2 the end moves by 0.4935 L across and 0.1606 L
/// back.
TEST(HyperelasticStatics, ASlenderBeamIsAnElastica) {
  const double length = 200, height = 5, e = 1e5;
  for (const model::HyperelasticLaw& law : laws) {
    Body beam(test::box_tetrahedra(40, 1, 1, height), true, {e, 0, 1, law});
    for (int axis = 0; axis < 3; ++axis)
      beam.hold(axis, [](const Vec3& p) { return p.x == 0; });
    const double force = 2 * e * std::pow(height, 4) / 12 / (length * length);
    const auto state = beam.solve({beam.end_load(length, {0, 0, -force / (height * height)}), {}});
    const Vec3 end = (beam.displacement(state.displacement, {length, 0, 0}) +
                      beam.displacement(state.displacement, {length, height, height})) /
                     2;
    EXPECT_NEAR(end.z, -0.4935 * length, 0.005 * 0.4935 * length);
    EXPECT_NEAR(end.x, -0.1606 * length, 0.01 * 0.1606 * length);
  }
}

/// A motion without change of volume: two shears, one behind the other.
struct MadeUp {
  fem::Elasticity material;
  model::HyperelasticLaw law;

  static Vector3d place(const Vector3d& p) {
    const double x = p.x() + 0.25 * std::sin(2.5 * p.y() + 0.3);
    return {x, p.y(), p.z() + 0.3 * std::sin(2 * x + 1.5 * p.y())};
  }
  static Matrix3d gradient(const Vector3d& p) {
    const double x = p.x() + 0.25 * std::sin(2.5 * p.y() + 0.3),
                 x_y = 0.25 * 2.5 * std::cos(2.5 * p.y() + 0.3),
                 slope = 0.3 * std::cos(2 * x + 1.5 * p.y());
    return Matrix3d{{1, x_y, 0}, {0, 1, 0}, {2 * slope, slope * (2 * x_y + 1.5), 1}};
  }
  /// -Div(stress), by differences.
  Vec3 force_density(const Vec3& at) const {
    Vector3d f = Vector3d::Zero();
    const double h = 1e-3;
    for (int j = 0; j < 3; ++j)
      for (const auto& [step, weight] : std::array<std::array<double, 2>, 4>{
               {{-2, 1.0 / 12}, {-1, -8.0 / 12}, {1, 8.0 / 12}, {2, -1.0 / 12}}}) {
        Vector3d p = eigen(at);
        p[j] += step * h;
        f -= weight / h * test::first_piola(law, material, gradient(p)).col(j);
      }
    return vec(f);
  }
};

struct IntegrationPoint {
  std::array<double, 4> at;
  double weight;
};
/// Exact to degree 7: conical products of four Gauss points.
std::vector<IntegrationPoint> integration_points() {
  const std::array<double, 4> x{0.0694318442029737, 0.3300094782075719, 0.6699905217924281,
                                0.9305681557970263},
      w{0.1739274225687269, 0.3260725774312731, 0.3260725774312731, 0.1739274225687269};
  std::vector<IntegrationPoint> points;
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < 4; ++j)
      for (std::size_t k = 0; k < 4; ++k) {
        const double a = x[i], b = x[j] * (1 - a), c = x[k] * (1 - a) * (1 - x[j]);
        points.push_back(
            {{1 - a - b - c, a, b, c}, 6 * w[i] * w[j] * w[k] * (1 - a) * (1 - a) * (1 - x[j])});
      }
  return points;
}
/// Of the nodes, then of the bubble.
std::vector<double> shapes(const std::array<double, 4>& l, bool quadratic) {
  std::vector<double> n(l.begin(), l.end());
  if (!quadratic)
    return n;
  for (std::size_t a = 0; a < 4; ++a)
    n[a] = l[a] * (2 * l[a] - 1);
  for (const auto& [i, j] : tetrahedra::tetrahedron_edges)
    n.push_back(4 * l[i] * l[j]);
  n.push_back(256 * l[0] * l[1] * l[2] * l[3]);
  return n;
}

double made_up_error(std::uint32_t n, bool quadratic, double poisson,
                     const model::HyperelasticLaw& law) {
  Body body(test::box_tetrahedra(n, n, n, 1.0 / n), quadratic, {young, poisson, 1, law});
  const MadeUp motion{fem::elasticity(young, poisson), law};
  const auto side = [](double x) { return x < 1e-9 || x > 1 - 1e-9; };
  for (std::size_t i = 0; i < body.mesh.points.size(); ++i) {
    const Vec3& p = body.mesh.points[i];
    const Vec3 u = vec(MadeUp::place(eigen(p))) - p;
    for (int axis = 0; axis < 3; ++axis)
      if (side(p.x) || side(p.y) || side(p.z)) {
        body.fixed[3 * i + static_cast<std::size_t>(axis)] = 1;
        body.prescribed[3 * i + static_cast<std::size_t>(axis)] = u[axis];
      }
  }
  const auto node = [&](std::size_t t, std::size_t a) {
    return std::size_t{a < 4 ? body.mesh.tetrahedra[t][a] : body.mesh.middles[t][a - 4]};
  };
  const std::size_t count = quadratic ? 10 : 4;
  fit::SolidVector load{std::vector<double>(body.fixed.size()), {}};
  load.bubbles.resize(quadratic ? body.elements.size() : 0);
  const auto points = integration_points();
  const auto place = [&](std::size_t t, const std::array<double, 4>& l) {
    Vec3 p;
    for (std::size_t k = 0; k < 4; ++k)
      p += l[k] * body.mesh.points[body.mesh.tetrahedra[t][k]];
    return p;
  };
  for (std::size_t t = 0; t < body.elements.size(); ++t)
    for (const IntegrationPoint& q : points) {
      const Vec3 f = motion.force_density(place(t, q.at)) * (q.weight * body.elements[t].volume);
      const auto values = shapes(q.at, quadratic);
      for (std::size_t a = 0; a < count; ++a)
        for (int axis = 0; axis < 3; ++axis)
          load.axes[3 * node(t, a) + static_cast<std::size_t>(axis)] += values[a] * f[axis];
      if (quadratic)
        load.bubbles[t] += values[10] * f;
    }
  const auto state = body.solve(load);
  double error = 0, whole = 0;
  for (std::size_t t = 0; t < body.elements.size(); ++t)
    for (const IntegrationPoint& q : points) {
      const Vec3 p = place(t, q.at), right = vec(MadeUp::place(eigen(p))) - p;
      Vec3 found;
      const auto values = shapes(q.at, quadratic);
      for (std::size_t a = 0; a < count; ++a)
        for (int axis = 0; axis < 3; ++axis)
          found[axis] +=
              values[a] * state.displacement.axes[3 * node(t, a) + static_cast<std::size_t>(axis)];
      error += q.weight * body.elements[t].volume * dot(found - right, found - right);
      whole += q.weight * body.elements[t].volume * dot(right, right);
    }
  return std::sqrt(error / whole);
}

TEST(HyperelasticStatics, LargeDisplacementsConvergeWithOrders2And3) {
  for (const model::HyperelasticLaw& law : laws)
    for (const double poisson : {0.3, 0.499}) {
      const double order =
          std::log2(made_up_error(3, true, poisson, law) / made_up_error(6, true, poisson, law));
      EXPECT_GE(order, 2.8) << poisson;
      EXPECT_LE(order, 3.5) << poisson;
    }
  const double order =
      std::log2(made_up_error(4, false, 0.3, laws[0]) / made_up_error(8, false, 0.3, laws[0]));
  EXPECT_GE(order, 1.8);
  EXPECT_LE(order, 2.5);
}

/// Beyond the load of Euler the straight column is a balance, but no stable one.
TEST(HyperelasticStatics, AColumnBucklesWherePushedBeyondEulersLoad) {
  const double length = 100, height = 5, e = 1e5;
  Body column(test::box_tetrahedra(20, 1, 1, height), true, {e, 0, 1});
  for (int axis = 0; axis < 3; ++axis)
    column.hold(axis, [&](const Vec3& p) { return axis == 1 || p.x == 0; }); // to one side
  const double euler = M_PI * M_PI * e * std::pow(height, 4) / 12 / (4 * length * length);
  const auto bend = [&](double load) {
    const double traction = load * euler / (height * height);
    const auto state = column.solve({column.end_load(length, {-traction, 0, 5e-3 * traction}), {}});
    EXPECT_LE(state.residual, 1e-10);
    return (column.displacement(state.displacement, {length, 0, 0}).z +
            column.displacement(state.displacement, {length, height, height}).z) /
           (2 * length);
  };
  EXPECT_LT(bend(0.9), 0.05);
  // Timoshenko, Gere, Theory of elastic stability, 1961, table 2-4: 0.792 at 1.518.
  EXPECT_NEAR(bend(1.518), 0.792, 0.02 * 0.792);
}

TEST(HyperelasticStatics, AnyNumberOfThreadsGivesTheSameBytes) {
  Body beam(test::box_tetrahedra(8, 3, 3), true, {young, 0.45, 1});
  for (int axis = 0; axis < 3; ++axis)
    beam.hold(axis, [](const Vec3& p) { return p.x == 0; });
  const auto load = fit::hyperelastic_weight(beam.mesh, beam.materials, beam.elements, {0, 2, -5});
  const auto with = [&](int threads) {
    Context context;
    context.threads = threads;
    return fit::hyperelastic_statics(beam.mesh, beam.elements, beam.fixed, {}, load, {}, context)
        .displacement.axes;
  };
  EXPECT_TRUE(test::same_bytes(with(1), with(4)));
}

TEST(HyperelasticStatics, ABodyThatNothingHoldsIsRefused) {
  Body free(test::box_tetrahedra(1, 1, 1), true, {young, 0.3, 1});
  EXPECT_THROW(
      free.solve(fit::hyperelastic_weight(free.mesh, free.materials, free.elements, {0, 0, -5})),
      Error);
}

} // namespace
} // namespace gewebe::test
