// Solid elements by analysis: integrals against numerical ones, rigid motions, constant strain on
// distorted meshes, other frames.

#include "base/error.h"
#include "fem/element.h"
#include "tet_fixtures.h"

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <limits>
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

enum class Kind { linear, plain, quadratic };
constexpr std::size_t nodes_of(Kind kind) {
  return kind == Kind::linear ? 4 : 10;
}

MatrixXd stiffness(const fem::SolidElement& e, Kind kind) {
  const std::size_t n = nodes_of(kind);
  MatrixXd k(3 * n, 3 * n);
  for (std::size_t a = 0; a < n; ++a)
    for (std::size_t b = 0; b < n; ++b) {
      const fem::SolidBlock block = kind == Kind::linear  ? fem::linear_block(e, a, b)
                                    : kind == Kind::plain ? fem::plain_quadratic_block(e, a, b)
                                                          : fem::quadratic_block(e, a, b);
      for (std::size_t i = 0; i < 9; ++i)
        k(static_cast<Eigen::Index>(3 * a + i / 3), static_cast<Eigen::Index>(3 * b + i % 3)) =
            block[i];
    }
  return k;
}

/// Corners, then middles in VTK's order, written out here once more.
std::vector<Vec3> ten_nodes(const std::array<Vec3, 4>& c) {
  return {c[0],
          c[1],
          c[2],
          c[3],
          (c[0] + c[1]) / 2,
          (c[1] + c[2]) / 2,
          (c[0] + c[2]) / 2,
          (c[0] + c[3]) / 2,
          (c[1] + c[3]) / 2,
          (c[2] + c[3]) / 2};
}

Vector3d eigen(const Vec3& v) {
  return {v.x, v.y, v.z};
}

/// Gauss points on 0 … 1.
struct GaussPoint {
  double at, weight;
};
std::vector<GaussPoint> gauss(int count) {
  std::vector<GaussPoint> points;
  for (int k = 0; k < count; ++k) {
    double x = std::cos(M_PI * (k + 0.75) / (count + 0.5)), slope = 1;
    for (int round = 0; round < 50; ++round) {
      double p = 1, before = 0;
      for (int n = 0; n < count; ++n) {
        const double next = ((2 * n + 1) * x * p - n * before) / (n + 1);
        before = p;
        p = next;
      }
      slope = count * (x * p - before) / (x * x - 1);
      x -= p / slope;
    }
    points.push_back({(1 + x) / 2, 1 / ((1 - x * x) * slope * slope)});
  }
  return points;
}

/// The element by its definition: shape functions differentiated by a complex step in x, y, z, 33
/// displacements with the bubble, divergence projected on linear functions, all integrals by 6³
/// points, then the bubble eliminated.
struct ByDefinition {
  MatrixXd k;         ///< 30 × 30
  MatrixXd body_load; ///< 30 × 3, per force along each axis
};
ByDefinition by_definition(const std::array<Vec3, 4>& c, const fem::Elasticity& m,
                           bool with_bubble) {
  Matrix3d edges;
  for (int j = 0; j < 3; ++j)
    edges.col(j) = eigen(c[static_cast<std::size_t>(j + 1)] - c[0]);
  const double six_volumes = edges.determinant();
  const Matrix3d to_local = edges.inverse();
  using Complex = std::complex<double>;
  const auto shapes = [&](const std::array<Complex, 3>& x) {
    const Complex l1 = x[0], l2 = x[1], l3 = x[2], l0 = 1.0 - l1 - l2 - l3;
    return std::array<Complex, 11>{l0 * (2.0 * l0 - 1.0),
                                   l1 * (2.0 * l1 - 1.0),
                                   l2 * (2.0 * l2 - 1.0),
                                   l3 * (2.0 * l3 - 1.0),
                                   4.0 * l0 * l1,
                                   4.0 * l1 * l2,
                                   4.0 * l0 * l2,
                                   4.0 * l0 * l3,
                                   4.0 * l1 * l3,
                                   4.0 * l2 * l3,
                                   256.0 * l0 * l1 * l2 * l3};
  };
  MatrixXd k = MatrixXd::Zero(33, 33), moments = MatrixXd::Zero(4, 33),
           load = MatrixXd::Zero(33, 3);
  Eigen::Matrix4d mass = Eigen::Matrix4d::Zero();
  const auto line = gauss(6);
  for (const GaussPoint& p : line)
    for (const GaussPoint& q : line)
      for (const GaussPoint& r : line) {
        const std::array<double, 3> at{p.at, q.at * (1 - p.at), r.at * (1 - p.at) * (1 - q.at)};
        const double weight =
            p.weight * q.weight * r.weight * (1 - p.at) * (1 - p.at) * (1 - q.at) * six_volumes;
        MatrixXd strain = MatrixXd::Zero(6, 33), divergence = MatrixXd::Zero(1, 33);
        for (int j = 0; j < 3; ++j) {
          std::array<Complex, 3> moved{};
          for (int i = 0; i < 3; ++i)
            moved[static_cast<std::size_t>(i)] =
                Complex(at[static_cast<std::size_t>(i)], 1e-30 * to_local(i, j));
          const auto values = shapes(moved);
          for (int a = 0; a < 11; ++a) {
            const double slope = values[static_cast<std::size_t>(a)].imag() / 1e-30;
            // Mandel's notation: xx yy zz √2 (xy yz zx).
            strain(j, 3 * a + j) += slope;
            divergence(0, 3 * a + j) += slope;
            const int next = (j + 1) % 3, last = (j + 2) % 3;
            strain(3 + j, 3 * a + next) += slope / std::sqrt(2);
            strain(3 + last, 3 * a + last) += slope / std::sqrt(2);
            if (j == 0)
              for (int i = 0; i < 3; ++i)
                load(3 * a + i, i) += weight * values[static_cast<std::size_t>(a)].real();
          }
        }
        k += weight * 2 * m.mu * strain.transpose() * strain;
        const Eigen::Vector4d l(1 - at[0] - at[1] - at[2], at[0], at[1], at[2]);
        moments += weight * l * divergence;
        mass += weight * l * l.transpose();
      }
  k += m.lambda * moments.transpose() * mass.inverse() * moments;
  if (!with_bubble)
    return {k.topLeftCorner(30, 30), load.topRows(30)};
  const MatrixXd handed = k.topRightCorner(30, 3) * k.bottomRightCorner(3, 3).inverse();
  return {k.topLeftCorner(30, 30) - handed * k.bottomLeftCorner(3, 30),
          load.topRows(30) - handed * load.bottomRows(3)};
}

TEST(Solid, ElementIsItsDefinitionIntegratedNumerically) {
  for (const double poisson : {0.0, 0.3, 0.49, 0.4999}) {
    const fem::Elasticity m = fem::elasticity(young, poisson);
    const fem::SolidElement e = fem::solid_element(corners, m);
    const ByDefinition with = by_definition(corners, m, true),
                       without = by_definition(corners, m, false);
    EXPECT_LE((stiffness(e, Kind::quadratic) - with.k).norm(), 1e-13 * without.k.norm()) << poisson;
    EXPECT_LE((stiffness(e, Kind::plain) - without.k).norm(), 1e-13 * without.k.norm()) << poisson;
    EXPECT_GT((with.k - without.k).norm(), 1e-2 * with.k.norm());
    for (int axis = 0; axis < 3; ++axis) {
      std::array<Vec3, 10> load;
      Vec3 along;
      along[axis] = 1;
      fem::body_load(e, along, load);
      for (int a = 0; a < 10; ++a)
        for (int i = 0; i < 3; ++i)
          EXPECT_NEAR(load[static_cast<std::size_t>(a)][i], with.body_load(3 * a + i, axis),
                      1e-13 * e.volume);
    }
  }
}

TEST(Solid, LameConstantsAreThoseOfTheLaw) {
  // Pulled along x: stress E, strain across -nu.
  for (const double poisson : {0.0, 0.3, 0.499}) {
    const auto [lambda, mu] = fem::elasticity(young, poisson);
    const double trace = 1 - 2 * poisson;
    EXPECT_NEAR(lambda * trace + 2 * mu, young, 1e-12 * young);
    EXPECT_NEAR(lambda * trace - 2 * mu * poisson, 0, 1e-12 * young);
  }
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double wrong : {0.5, 0.6, -0.1, nan})
    EXPECT_THROW(fem::elasticity(young, wrong), Error) << wrong;
  for (const double wrong : {0.0, -1.0, nan, HUGE_VAL})
    EXPECT_THROW(fem::elasticity(wrong, 0.3), Error) << wrong;
}

TEST(Solid, ElementsWithoutVolumeAreRefused) {
  const fem::Elasticity m = fem::elasticity(young, 0.3);
  EXPECT_THROW(fem::solid_element({corners[1], corners[0], corners[2], corners[3]}, m), Error);
  EXPECT_THROW(fem::solid_element({corners[0], corners[0], corners[2], corners[3]}, m), Error);
  std::array<Vec3, 4> broken = corners;
  broken[2].y = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(fem::solid_element(broken, m), Error);
}

TEST(Solid, ElementsAreSymmetricAndFreeInRigidMotionsAlone) {
  for (const double poisson : {0.0, 0.3, 0.499, 0.49999})
    for (const Kind kind : {Kind::linear, Kind::plain, Kind::quadratic}) {
      const MatrixXd k =
          stiffness(fem::solid_element(corners, fem::elasticity(young, poisson)), kind);
      EXPECT_LE((k - k.transpose()).norm(), 1e-15 * k.norm());
      const VectorXd value = Eigen::SelfAdjointEigenSolver<MatrixXd>(k).eigenvalues();
      const double largest = value[value.size() - 1];
      for (Eigen::Index n = 0; n < 6; ++n)
        EXPECT_LE(std::abs(value[n]), 1e-14 * largest) << n;
      // Not on the way to 0 as nu goes to 1/2: shear keeps its stiffness.
      EXPECT_GT(value[6], 1e-3 * young) << poisson << ' ' << static_cast<int>(kind);
      const auto nodes = ten_nodes(corners);
      for (int axis = 0; axis < 3; ++axis)
        for (const bool turn : {false, true}) {
          Vec3 along;
          along[axis] = 1;
          VectorXd u(k.rows());
          for (Eigen::Index a = 0; a < u.size() / 3; ++a)
            u.segment<3>(3 * a) =
                eigen(turn ? cross(along, nodes[static_cast<std::size_t>(a)]) : along);
          EXPECT_LE((k * u).norm(), 1e-14 * k.norm() * u.norm());
        }
    }
}

TEST(Solid, AnotherFrameGivesTheSameElement) {
  const Matrix3d turn =
      (Eigen::AngleAxisd(1.1, Vector3d(1, 2, -0.5).normalized())).toRotationMatrix();
  std::array<Vec3, 4> turned;
  for (std::size_t a = 0; a < 4; ++a) {
    const Vector3d p = turn * eigen(corners[a]) + Vector3d(3, -5, 2);
    turned[a] = {p.x(), p.y(), p.z()};
  }
  // Another order of the corners, and of the middles with it.
  const std::array<std::size_t, 10> other{1, 2, 0, 3, 5, 6, 4, 8, 9, 7};
  for (const Kind kind : {Kind::linear, Kind::plain, Kind::quadratic}) {
    const fem::Elasticity m = fem::elasticity(young, 0.49);
    const MatrixXd k = stiffness(fem::solid_element(corners, m), kind),
                   kt = stiffness(fem::solid_element(turned, m), kind),
                   ko = stiffness(
                       fem::solid_element({corners[1], corners[2], corners[0], corners[3]}, m),
                       kind);
    for (Eigen::Index a = 0; a < k.rows() / 3; ++a)
      for (Eigen::Index b = 0; b < k.rows() / 3; ++b) {
        EXPECT_LE(
            (kt.block<3, 3>(3 * a, 3 * b) - turn * k.block<3, 3>(3 * a, 3 * b) * turn.transpose())
                .norm(),
            1e-13 * k.norm());
        const auto oa = static_cast<Eigen::Index>(other[static_cast<std::size_t>(a)]),
                   ob = static_cast<Eigen::Index>(other[static_cast<std::size_t>(b)]);
        EXPECT_LE((ko.block<3, 3>(3 * a, 3 * b) - k.block<3, 3>(3 * oa, 3 * ob)).norm(),
                  1e-13 * k.norm());
      }
  }
}

/// A box whose inner nodes stand anywhere, its volume 8.
tetrahedra::TetMesh distorted(bool quadratic) {
  tetrahedra::TetMesh mesh = test::distorted_box();
  if (quadratic)
    tetrahedra::make_quadratic(mesh);
  return mesh;
}

std::array<Vec3, 4> corners_of(const tetrahedra::TetMesh& mesh, std::size_t t) {
  std::array<Vec3, 4> c;
  for (std::size_t k = 0; k < 4; ++k)
    c[k] = mesh.points[mesh.tetrahedra[t][k]];
  return c;
}

TEST(Solid, ConstantStrainIsInBalanceOnADistortedMesh) {
  const Matrix3d gradient{{0.3, -0.2, 0.5}, {0.7, 0.1, -0.4}, {-0.6, 0.2, 0.25}};
  for (const double poisson : {0.0, 0.3, 0.4999})
    for (const bool order2 : {false, true}) {
      const tetrahedra::TetMesh mesh = distorted(order2);
      const fem::Elasticity m = fem::elasticity(young, poisson);
      const Matrix3d stress = m.lambda * gradient.trace() * Matrix3d::Identity() +
                              m.mu * (gradient + gradient.transpose());
      std::vector<Vector3d> force(mesh.points.size(), Vector3d::Zero());
      const auto displacement = [&](const Vec3& p) -> Vector3d { return gradient * eigen(p); };
      for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
        const fem::SolidElement e = fem::solid_element(corners_of(mesh, t), m);
        std::vector<std::uint32_t> node(mesh.tetrahedra[t].begin(), mesh.tetrahedra[t].end());
        if (order2)
          node.insert(node.end(), mesh.middles[t].begin(), mesh.middles[t].end());
        VectorXd u(static_cast<Eigen::Index>(3 * node.size()));
        std::vector<Vec3> values;
        for (std::size_t a = 0; a < node.size(); ++a) {
          const Vector3d v = displacement(mesh.points[node[a]]);
          u.segment<3>(static_cast<Eigen::Index>(3 * a)) = v;
          values.push_back({v.x(), v.y(), v.z()});
        }
        const VectorXd f = stiffness(e, order2 ? Kind::quadratic : Kind::linear) * u;
        for (std::size_t a = 0; a < node.size(); ++a)
          force[node[a]] += f.segment<3>(static_cast<Eigen::Index>(3 * a));
        for (const fem::SolidBlock& found : fem::displacement_gradients(e, values))
          for (int i = 0; i < 9; ++i)
            EXPECT_NEAR(found[static_cast<std::size_t>(i)], gradient(i / 3, i % 3), 1e-12);
      }
      Vector3d right = Vector3d::Zero();
      for (std::size_t i = 0; i < force.size(); ++i) {
        const Vec3& p = mesh.points[i];
        if (p.x > 0 && p.x < 2 && p.y > 0 && p.y < 2 && p.z > 0 && p.z < 2) {
          EXPECT_LE(force[i].norm(), 1e-12 * stress.norm()) << i;
        }
        right += p.x * force[i];
      }
      // The first moment along x is the volume's ∫ stress ∂x.
      EXPECT_LE((right - 8 * stress.col(0)).norm(), 1e-12 * stress.norm());
    }
}

/// Forces of the stresses ∫ stress ∇Na, which the projection leaves as they are.
TEST(Solid, StressesAreInBalanceWithTheForcesOfNodes) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(-1, 1);
  for (const double poisson : {0.0, 0.3, 0.499}) {
    const fem::Elasticity m = fem::elasticity(young, poisson);
    const fem::SolidElement e = fem::solid_element(corners, m);
    std::vector<Vec3> u(10);
    VectorXd flat(30);
    for (int a = 0; a < 10; ++a)
      for (int i = 0; i < 3; ++i)
        flat[3 * a + i] = u[static_cast<std::size_t>(a)][i] = any(random);
    const Vec3 density{200 * any(random), 300 * any(random), 100 * any(random)};
    std::array<Vec3, 10> load;
    fem::body_load(e, density, load);
    const VectorXd f = stiffness(e, Kind::quadratic) * flat;
    const auto gradient = fem::displacement_gradients(e, u, density);
    std::array<Matrix3d, 4> stress;
    for (std::size_t p = 0; p < 4; ++p) {
      Matrix3d g;
      for (int i = 0; i < 9; ++i)
        g(i / 3, i % 3) = gradient[p][static_cast<std::size_t>(i)];
      stress[p] = m.lambda * g.trace() * Matrix3d::Identity() + m.mu * (g + g.transpose());
    }
    for (std::size_t a = 0; a < 10; ++a) {
      // ∇Na at the corners, from the barycentric coordinates.
      std::array<Vector3d, 4> slope;
      const std::array<std::array<std::size_t, 2>, 6> edge{
          {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}}};
      for (std::size_t p = 0; p < 4; ++p)
        if (a < 4)
          slope[p] = eigen(e.gradient[a]) * (p == a ? 3 : -1);
        else
          slope[p] = eigen(e.gradient[edge[a - 4][1]]) * (p == edge[a - 4][0] ? 4 : 0) +
                     eigen(e.gradient[edge[a - 4][0]]) * (p == edge[a - 4][1] ? 4 : 0);
      Vector3d sum = Vector3d::Zero();
      for (std::size_t p = 0; p < 4; ++p)
        for (std::size_t q = 0; q < 4; ++q)
          sum += e.volume / 20 * (p == q ? 2 : 1) * stress[p] * slope[q];
      // K u - load + what acts on the node itself, (∫Na) density.
      const Vector3d expected = f.segment<3>(static_cast<Eigen::Index>(3 * a)) - eigen(load[a]) +
                                eigen(density) * e.volume * (a < 4 ? -1.0 / 20 : 1.0 / 5);
      EXPECT_LE((sum - expected).norm(), 1e-13 * f.norm()) << a;
    }
  }
}

} // namespace
} // namespace gewebe::test
