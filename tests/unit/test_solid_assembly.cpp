// A solid put together: its matrix against dense sums, solved patch tests, masses, loads, springs
// beside it, any number of threads.

#include "base/error.h"
#include "fem/assembly.h"
#include "fem/model_stiffness.h"
#include "fem/stress.h"
#include "linalg/factor.h"
#include "tests/unit/larger.h"
#include "tests/unit/solid_bodies.h"
#include "tet_fixtures.h"
#include "tetrahedra/boundary.h"

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace gewebe::test {
namespace {

const std::vector<fem::SolidMaterial> two{{2500, 0.3, 1.1e-3}, {400, 0.499, 0.9e-3}};

/// A box 2 × 2 × 2 whose inner nodes stand anywhere.
tetrahedra::TetMesh distorted(bool quadratic, bool materials) {
  tetrahedra::TetMesh mesh = test::distorted_box();
  if (quadratic)
    tetrahedra::make_quadratic(mesh);
  if (materials)
    for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t)
      mesh.material.push_back(t % 3 == 0);
  return mesh;
}

Vec3 of_axes(const std::vector<double>& u, std::size_t i) {
  return {u[3 * i], u[3 * i + 1], u[3 * i + 2]};
}

double largest(const std::vector<double>& v) {
  double most = 0;
  for (const double x : v)
    most = test::larger(most, std::abs(x));
  return most;
}

TEST(SolidAssembly, MatrixMultipliesAsItsElementsDo) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> any(-1, 1);
  for (const bool quadratic : {false, true}) {
    const tetrahedra::TetMesh mesh = distorted(quadratic, true);
    const auto elements = fem::solid_elements(mesh, two);
    std::vector<std::uint8_t> fixed(3 * mesh.points.size());
    for (std::uint8_t& f : fixed)
      f = random() % 5 == 0;
    const linalg::StiffnessMatrix k = fem::solid_stiffness(mesh, elements, fixed);
    std::vector<double> u(fixed.size()), f(fixed.size()), x, y(k.order());
    for (std::size_t axis = 0; axis < u.size(); ++axis)
      u[axis] = fixed[axis] != 0 ? 0 : any(random);
    for (const std::int64_t axis : k.axis_of_row)
      x.push_back(u[static_cast<std::size_t>(axis)]);
    linalg::multiply(k, x, y);
    fem::multiply_solid(mesh, elements, u, f);
    for (std::size_t r = 0; r < y.size(); ++r)
      EXPECT_NEAR(y[r], f[static_cast<std::size_t>(k.axis_of_row[r])], 1e-13 * largest(f));
    for (std::size_t c = 0; c < k.order(); ++c) {
      EXPECT_EQ(k.row[static_cast<std::size_t>(k.column_start[c])], static_cast<std::int64_t>(c));
      for (auto at = k.column_start[c] + 1; at < k.column_start[c + 1]; ++at)
        EXPECT_LT(k.row[static_cast<std::size_t>(at - 1)], k.row[static_cast<std::size_t>(at)]);
    }
    EXPECT_THROW(fem::solid_stiffness(mesh, elements, std::vector<std::uint8_t>(fixed.size(), 1)),
                 Error);
  }
}

TEST(SolidAssembly, AnyNumberOfThreadsGivesTheSameBytes) {
  tetrahedra::TetMesh mesh = test::box_tetrahedra(5, 4, 12, 0.3);
  tetrahedra::make_quadratic(mesh);
  const auto with = [&](int threads) {
    Context context;
    context.threads = threads;
    return fem::solid_stiffness(mesh, fem::solid_elements(mesh, two, context), {}, context);
  };
  const linalg::StiffnessMatrix one = with(1), five = with(5);
  EXPECT_TRUE(test::same_bytes(one.value, five.value));
  EXPECT_TRUE(test::same_bytes(one.row, five.row));
  EXPECT_EQ(one.column_start, five.column_start);
}

/// Boundary nodes displaced by a linear function; inner nodes follow it.
TEST(SolidAssembly, PatchTestIsSolved) {
  for (const bool quadratic : {false, true})
    for (const double poisson : {0.0, 0.3, 0.4999}) {
      const test::SolidCase patch = test::patch(quadratic, poisson);
      EXPECT_LE(figure(patch), 1e-12);
      const auto& [mesh, materials, elements, fixed] = patch.solid;
      const auto stresses =
          fem::solid_stresses(elements, fem::solid_strains(mesh, materials, elements, patch.given));
      const auto [lambda, mu] = fem::elasticity(2500, poisson);
      for (const linalg::SymmetricBlock& at_node : fem::nodal_tensors(mesh, elements, stresses)) {
        EXPECT_NEAR(at_node[0], lambda * 6e-3 + 2 * mu * 3e-3, 1e-12 * (lambda + mu));
        EXPECT_NEAR(at_node[1], mu * 5e-3, 1e-12 * (lambda + mu));
        EXPECT_NEAR(at_node[4], mu * -2e-3, 1e-12 * (lambda + mu));
      }
    }
}

TEST(SolidAssembly, MassesArePositiveAndComplete) {
  for (const bool quadratic : {false, true}) {
    const tetrahedra::TetMesh mesh = distorted(quadratic, true);
    const auto masses = fem::solid_masses(mesh, two);
    double expected = 0;
    for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
      const Tetrahedron& c = mesh.tetrahedra[t];
      expected += two[static_cast<std::size_t>(mesh.material[t])].density *
                  tetrahedra::tetrahedron_volume(mesh.points[c[0]], mesh.points[c[1]],
                                                 mesh.points[c[2]], mesh.points[c[3]]);
    }
    double total = 0;
    for (const double m : masses) {
      EXPECT_GT(m, 0);
      total += m;
    }
    EXPECT_NEAR(total, expected, 1e-14 * expected);
  }
  // One element: the diagonal of the consistent mass is in the proportion 6 : 32.
  tetrahedra::TetMesh one;
  one.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  one.tetrahedra = {{0, 1, 2, 3}};
  tetrahedra::make_quadratic(one);
  const auto masses = fem::solid_masses(one, two);
  for (std::size_t i = 0; i < 10; ++i)
    EXPECT_NEAR(masses[i], 1.1e-3 / 6 * (i < 4 ? 6 : 32) / 216, 1e-18);
}

struct Sums {
  Vec3 force, moment;
};
Sums sums(const tetrahedra::TetMesh& mesh, const std::vector<double>& load) {
  Sums s;
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    s.force += of_axes(load, i);
    s.moment += cross(mesh.points[i], of_axes(load, i));
  }
  return s;
}
void expect_near(const Vec3& a, const Vec3& b, double scale) {
  EXPECT_LE(norm(a - b), 1e-12 * scale) << a.x << ' ' << a.y << ' ' << a.z;
}

TEST(SolidAssembly, LoadsAddUpToTheirForceAndMoment) {
  for (const bool quadratic : {false, true}) {
    tetrahedra::TetMesh mesh = distorted(quadratic, false);
    const auto elements = fem::solid_elements(mesh, two);
    const Vec3 g{100, -200, -9810};
    const double mass = 8 * two[0].density;
    const Sums weight = sums(mesh, fem::gravity_load(mesh, two, elements, g));
    expect_near(weight.force, mass * g, mass * norm(g));
    expect_near(weight.moment, cross({1, 1, 1}, mass * g), mass * norm(g));

    const tetrahedra::TetBoundary faces = tetrahedra::boundary(mesh);
    std::vector<std::uint32_t> all(faces.mesh.triangles.size()), right;
    std::iota(all.begin(), all.end(), 0U);
    for (const std::uint32_t k : all) {
      bool in_plane = true;
      for (const std::uint32_t c : faces.mesh.triangles[k])
        in_plane = in_plane && faces.mesh.points[c].x == 2;
      if (in_plane)
        right.push_back(k);
    }
    const Sums pressed = sums(mesh, fem::pressure_load(mesh, faces, right, 50));
    expect_near(pressed.force, {-200, 0, 0}, 200);
    expect_near(pressed.moment, cross({2, 1, 1}, {-200, 0, 0}), 200);
    const Sums pulled = sums(mesh, fem::traction_load(mesh, faces, right, {7, -5, 3}));
    expect_near(pulled.force, {28, -20, 12}, 30);
    expect_near(pulled.moment, cross({2, 1, 1}, {28, -20, 12}), 30);
    const Sums closed = sums(mesh, fem::pressure_load(mesh, faces, all, 50));
    expect_near(closed.force, {}, 200);
    expect_near(closed.moment, {}, 200);
  }
}

/// A pressure all around has an answer without shear: u = -p/(3 lambda + 2 mu) x.
TEST(SolidAssembly, PressureAllAroundShrinksTheBodyEvenly) {
  for (const bool quadratic : {false, true})
    for (const double poisson : {0.3, 0.499}) {
      const tetrahedra::TetMesh mesh = distorted(quadratic, false);
      const std::vector<fem::SolidMaterial> material{{2500, poisson, 1e-3}};
      const auto elements = fem::solid_elements(mesh, material);
      const tetrahedra::TetBoundary faces = tetrahedra::boundary(mesh);
      std::vector<std::uint32_t> all(faces.mesh.triangles.size());
      std::iota(all.begin(), all.end(), 0U);
      const auto load = fem::pressure_load(mesh, faces, all, 50);
      const double shrink = 50 * (1 - 2 * poisson) / 2500;
      std::vector<double> u(load.size()), f(load.size());
      for (std::size_t axis = 0; axis < u.size(); ++axis)
        u[axis] = -shrink * mesh.points[axis / 3][static_cast<int>(axis % 3)];
      fem::multiply_solid(mesh, elements, u, f);
      for (std::size_t axis = 0; axis < u.size(); ++axis)
        EXPECT_NEAR(f[axis], load[axis], 1e-11 * largest(load));
    }
}

/// Standing in a box without friction under its weight: u_z is quadratic, and so found exactly,
/// with the pressure that grows downwards, at any nu.
TEST(SolidAssembly, WeightInABoxIsFoundExactly) {
  for (const double poisson : {0.3, 0.499}) {
    const tetrahedra::TetMesh mesh = distorted(true, false);
    const std::vector<fem::SolidMaterial> material{{2500, poisson, 1e-3}};
    const auto elements = fem::solid_elements(mesh, material);
    const Vec3 g{0, 0, -9810};
    const auto [lambda, mu] = fem::elasticity(2500, poisson);
    const double weight = 1e-3 * 9810, modulus = lambda + 2 * mu;
    std::vector<std::uint8_t> fixed(3 * mesh.points.size());
    for (std::size_t i = 0; i < mesh.points.size(); ++i) {
      const Vec3& p = mesh.points[i];
      fixed[3 * i] = p.x == 0 || p.x == 2;
      fixed[3 * i + 1] = p.y == 0 || p.y == 2;
      fixed[3 * i + 2] = p.z == 0;
    }
    const linalg::StiffnessMatrix k = fem::solid_stiffness(mesh, elements, fixed);
    std::vector<double> u(fixed.size());
    linalg::solve_axes(k, linalg::Factor(k, {}), fem::gravity_load(mesh, material, elements, g), u);
    const double most = weight / modulus * 2;
    for (std::size_t i = 0; i < mesh.points.size(); ++i) {
      const double z = mesh.points[i].z;
      expect_near(of_axes(u, i), {0, 0, -weight / modulus * (2 * z - z * z / 2)}, most);
    }
    const auto stresses = fem::nodal_tensors(
        mesh, elements,
        fem::solid_stresses(elements, fem::solid_strains(mesh, material, elements, u, g)));
    for (std::size_t i = 0; i < mesh.points.size(); ++i)
      EXPECT_NEAR(stresses[i][5], -weight * (2 - mesh.points[i].z), 1e-9 * 2 * weight);
  }
}

TEST(SolidAssembly, FieldsOfALinearDisplacementAreThoseOfItsGradient) {
  const std::array<double, 9> g{0.02, 0.01, -0.03, 0.005, -0.01, 0.02, 0.04, 0.03, 0.015};
  const linalg::SymmetricBlock strain{g[0], (g[1] + g[3]) / 2, (g[2] + g[6]) / 2,
                                      g[4], (g[5] + g[7]) / 2, g[8]};
  for (const bool quadratic : {false, true}) {
    const tetrahedra::TetMesh mesh = distorted(quadratic, false);
    const std::vector<fem::SolidMaterial> material{{2500, 0.3, 1e-3}};
    std::vector<double> u;
    for (const Vec3& p : mesh.points)
      for (std::size_t i = 0; i < 3; ++i)
        u.push_back(g[3 * i] * p.x + g[3 * i + 1] * p.y + g[3 * i + 2] * p.z);
    const fem::SolidFields fields =
        fem::solid_fields(mesh, material, fem::solid_elements(mesh, material), u);
    const auto [lambda, mu] = fem::elasticity(2500, 0.3);
    ASSERT_EQ(fields.node_strain.size(), mesh.points.size());
    ASSERT_EQ(fields.element_stress.size(), mesh.tetrahedra.size());
    for (std::size_t k = 0; k < 6; ++k) {
      const bool diagonal = k == 0 || k == 3 || k == 5;
      const double stress =
          2 * mu * strain[k] + (diagonal ? lambda * (strain[0] + strain[3] + strain[5]) : 0);
      for (const auto* const all : {&fields.node_strain, &fields.element_strain})
        for (const linalg::SymmetricBlock& one : *all)
          EXPECT_NEAR(one[k], strain[k], 1e-13);
      for (const auto* const all : {&fields.node_stress, &fields.element_stress})
        for (const linalg::SymmetricBlock& one : *all)
          EXPECT_NEAR(one[k], stress, 1e-13 * (lambda + mu));
    }
  }
}

/// Gravity strains the bubbles of quadratic elements. A body rotated by R has the strains of an
/// unrotated body under Rᵀ g, rotated by R.
TEST(SolidAssembly, StrainsUnderGravityRotateWithTheBody) {
  tetrahedra::TetMesh mesh = test::distorted_box();
  tetrahedra::make_quadratic(mesh);
  const std::vector<fem::SolidMaterial> material{{2500, 0.45, 1e-3}};
  const auto elements = fem::solid_elements(mesh, material);
  const Eigen::Vector3d w(0.5, -1.2, 0.8), g(300, -9810, 4000);
  const Eigen::Matrix3d r = Eigen::AngleAxisd(w.norm(), w.normalized()).toRotationMatrix();
  std::vector<double> turned;
  for (const Vec3& p : mesh.points) {
    const Eigen::Vector3d u = w.cross(Eigen::Vector3d(p.x, p.y, p.z));
    turned.insert(turned.end(), {u.x(), u.y(), u.z()});
  }
  const Eigen::Vector3d back = r.transpose() * g;
  const auto at_rest =
                 fem::solid_strains(mesh, material, elements, std::vector<double>(turned.size()),
                                    {back.x(), back.y(), back.z()}),
             found = fem::solid_strains(mesh, material, elements, turned, {g.x(), g.y(), g.z()},
                                        fem::StrainFrames::turning);
  const auto matrix = [](const linalg::SymmetricBlock& s) {
    Eigen::Matrix3d m;
    m << s[0], s[1], s[2], s[1], s[3], s[4], s[2], s[4], s[5];
    return m;
  };
  double size = 0, worst = 0;
  for (std::size_t t = 0; t < elements.size(); ++t)
    for (std::size_t p = 0; p < 4; ++p) {
      const Eigen::Matrix3d expected = r * matrix(at_rest[t][p]) * r.transpose();
      size = test::larger(size, expected.norm());
      worst = test::larger(worst, (matrix(found[t][p]) - expected).norm());
    }
  EXPECT_GT(size, 1e-6);
  EXPECT_LT(worst, 0.02 * size); // the rotation that bubbles add to is the corner's own
}

/// u = (0, a x², 0) turns a body by a x about z, and shears it by as much. In turning frames the
/// strain at a corner is turned by the rotation of that corner.
TEST(SolidAssembly, StrainsOfABentBodyTurnAtEachCorner) {
  tetrahedra::TetMesh mesh = test::distorted_box();
  tetrahedra::make_quadratic(mesh);
  const std::vector<fem::SolidMaterial> material{{2500, 0.3, 1e-3}};
  const auto elements = fem::solid_elements(mesh, material);
  constexpr double a = 0.7;
  std::vector<double> u;
  for (const Vec3& p : mesh.points)
    u.insert(u.end(), {0, a * p.x * p.x, 0});
  const auto plain = fem::solid_strains(mesh, material, elements, u),
             found =
                 fem::solid_strains(mesh, material, elements, u, {}, fem::StrainFrames::turning);
  double size = 0, worst = 0;
  for (std::size_t t = 0; t < elements.size(); ++t)
    for (std::size_t p = 0; p < 4; ++p) {
      const double x = mesh.points[mesh.tetrahedra[t][p]].x, shear = plain[t][p][1];
      EXPECT_NEAR(shear, a * x, 0.1);
      size = test::larger(size, std::abs(shear));
      worst = test::larger(worst, std::abs(found[t][p][0] + std::sin(2 * a * x) * shear));
      worst = test::larger(worst, std::abs(found[t][p][1] - std::cos(2 * a * x) * shear));
    }
  EXPECT_GT(size, 1);
  EXPECT_LT(worst, 0.1 * size); // bubbles strain and turn it, too
}

TEST(SolidAssembly, VonMisesIsThatOfTensionShearAndPressure) {
  EXPECT_DOUBLE_EQ(fem::von_mises({0, 0, 0, -30, 0, 0}), 30);
  EXPECT_DOUBLE_EQ(fem::von_mises({5, 0, 0, 35, 0, 5}), 30); // a pressure adds nothing
  EXPECT_EQ(fem::von_mises({7, 0, 0, 7, 0, 7}), 0);
  for (const std::size_t shear : {1U, 2U, 4U}) {
    linalg::SymmetricBlock stress{};
    stress[shear] = -10;
    EXPECT_DOUBLE_EQ(fem::von_mises(stress), 10 * std::sqrt(3));
  }
}

TEST(SolidAssembly, WhatItCannotUseIsRefusedByName) {
  const auto refuses = [](const tetrahedra::TetMesh& mesh,
                          const std::vector<fem::SolidMaterial>& materials,
                          const std::string& expected) {
    try {
      fem::solid_elements(mesh, materials);
      ADD_FAILURE() << "took it, expected: " << expected;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(expected), std::string::npos) << error.what();
    }
  };
  tetrahedra::TetMesh mesh = distorted(true, false);
  mesh.points[mesh.middles[0][3]].x += 0.01;
  refuses(mesh, two, "tetrahedron 0 has a node away from the middle");
  mesh = distorted(false, true);
  mesh.material[4] = 2;
  refuses(mesh, two, "tetrahedron 4 is of material 2");
  mesh = distorted(false, false);
  std::swap(mesh.tetrahedra[7][0], mesh.tetrahedra[7][1]);
  refuses(mesh, two, "tetrahedron 7 has no positive volume");
  mesh = distorted(false, false);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  refuses(mesh, {{1e4, 0.5, 1e-3}}, "Poisson's ratio");
  refuses(mesh, {{nan, 0.3, 1e-3}}, "Young's modulus");
  refuses(mesh, {{1e4, 0.3, 0}}, "density");
  refuses(mesh, {{1e4, 0.3, nan}}, "density");
}

/// A spring along x between two nodes of a solid: its stiffness adds.
TEST(SolidAssembly, SpringsAndSolidsAdd) {
  const tetrahedra::TetMesh mesh = distorted(true, false);
  const auto elements = fem::solid_elements(mesh, two);
  model::Model model;
  model.materials.resize(1);
  for (const Vec3& p : mesh.points)
    model.nodes.push_back({.position = p, .mass = 1});
  for (std::uint32_t i = 0; i + 1 < mesh.points.size(); i += 2)
    model.springs.push_back({.i = i,
                             .j = i + 1,
                             .stiffness = 100.0 + i,
                             .rest = norm(mesh.points[i] - mesh.points[i + 1])});
  std::vector<std::uint8_t> fixed(3 * mesh.points.size());
  fixed[0] = fixed[1] = fixed[2] = 1;
  const linalg::StiffnessMatrix both =
      fem::sum(fem::solid_stiffness(mesh, elements, fixed), fem::stiffness_matrix(model, fixed));
  std::mt19937 random(1);
  std::uniform_real_distribution<double> any(-1, 1);
  std::vector<double> u(fixed.size()), f(u.size()), g(u.size()), x, y(both.order());
  for (std::size_t axis = 3; axis < u.size(); ++axis)
    x.push_back(u[axis] = any(random));
  linalg::multiply(both, x, y);
  fem::multiply_solid(mesh, elements, u, f);
  fem::multiply_stiffness(model, u, g);
  for (std::size_t r = 0; r < y.size(); ++r)
    EXPECT_NEAR(y[r], f[r + 3] + g[r + 3], 1e-13 * largest(f));
  EXPECT_GT(largest(g), 0.01 * largest(f));
  EXPECT_THROW(fem::sum(both, fem::stiffness_matrix(model)), Error);
}

} // namespace
} // namespace gewebe::test
