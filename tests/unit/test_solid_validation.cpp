// Solids against answers from elsewhere: order of convergence, beams, Cook's membrane, NAFEMS LE10.

#include "solid/assembly.h"
#include "solid/stress.h"
#include "solve/factor.h"
#include "tet_fixtures.h"
#include "tetrahedra/boundary.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <numbers>
#include <numeric>
#include <utility>
#include <vector>

namespace gewebe {
namespace {

constexpr double pi = std::numbers::pi;

/// A body that is held, and what it was made of.
struct Solid {
  TetMesh mesh;
  std::vector<SolidMaterial> materials;
  std::vector<SolidElement> elements;
  std::vector<std::uint8_t> fixed;

  Solid(TetMesh of_corners, bool quadratic, const SolidMaterial& material)
      : mesh(std::move(of_corners)), materials{material} {
    if (quadratic)
      make_quadratic(mesh);
    elements = solid_elements(mesh, materials);
    fixed.resize(3 * mesh.points.size());
  }
  std::size_t unknowns() const {
    return fixed.size() - static_cast<std::size_t>(std::accumulate(fixed.begin(), fixed.end(), 0));
  }
  /// Fixes axis where `held` says so.
  void hold(std::size_t axis, const std::function<bool(const Vec3&)>& held) {
    for (std::size_t i = 0; i < mesh.points.size(); ++i)
      if (held(mesh.points[i]))
        fixed[3 * i + axis] = 1;
  }
  /// Displacements under a load, with those on fixed axes as given, or 0.
  std::vector<double> solve(std::vector<double> load, std::vector<double> u = {}) const {
    u.resize(fixed.size());
    for (std::size_t axis = 0; axis < u.size(); ++axis)
      u[axis] = fixed[axis] != 0 ? u[axis] : 0;
    std::vector<double> held(u.size()), moved(u.size());
    multiply_solid(mesh, elements, u, held);
    for (std::size_t axis = 0; axis < u.size(); ++axis)
      load[axis] -= held[axis];
    const StiffnessMatrix k = solid_stiffness(mesh, elements, fixed);
    solve_axes(k, Factor(k, {}), load, moved);
    for (std::size_t axis = 0; axis < u.size(); ++axis)
      u[axis] += moved[axis];
    return u;
  }
  /// Triangles of the boundary whose corners all are there.
  std::vector<std::uint32_t> triangles(const TetBoundary& faces,
                                       const std::function<bool(const Vec3&)>& there) const {
    std::vector<std::uint32_t> found;
    for (std::uint32_t k = 0; k < faces.mesh.triangles.size(); ++k) {
      const auto [a, b, c] = faces.mesh.triangles[k];
      if (there(faces.mesh.points[a]) && there(faces.mesh.points[b]) && there(faces.mesh.points[c]))
        found.push_back(k);
    }
    return found;
  }
  std::size_t node_at(const Vec3& p) const {
    for (std::size_t i = 0; i < mesh.points.size(); ++i)
      if (norm(mesh.points[i] - p) < 1e-9 * (1 + norm(p)))
        return i;
    ADD_FAILURE() << "no node at " << p.x << ' ' << p.y << ' ' << p.z;
    return 0;
  }
};

/// Points in a tetrahedron that integrate polynomials of degree 5 (Stroud's conical product of
/// three Gauss points each, weights for a volume of 1).
struct IntegrationPoint {
  std::array<double, 4> at;
  double weight;
};
std::vector<IntegrationPoint> integration_points() {
  const double far = std::sqrt(15.0) / 10;
  const std::array<double, 3> x{0.5 - far, 0.5, 0.5 + far}, w{5.0 / 18, 8.0 / 18, 5.0 / 18};
  std::vector<IntegrationPoint> points;
  double sum = 0;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      for (std::size_t k = 0; k < 3; ++k) {
        const double a = x[i], b = x[j] * (1 - a), c = x[k] * (1 - a) * (1 - x[j]);
        points.push_back(
            {{1 - a - b - c, a, b, c}, w[i] * w[j] * w[k] * (1 - a) * (1 - a) * (1 - x[j])});
        sum += points.back().weight;
      }
  for (IntegrationPoint& p : points)
    p.weight /= sum;
  return points;
}

std::array<double, 10> shapes(const std::array<double, 4>& l, bool quadratic) {
  if (!quadratic)
    return {l[0], l[1], l[2], l[3]};
  return {l[0] * (2 * l[0] - 1), l[1] * (2 * l[1] - 1), l[2] * (2 * l[2] - 1),
          l[3] * (2 * l[3] - 1), 4 * l[0] * l[1],       4 * l[1] * l[2],
          4 * l[0] * l[2],       4 * l[0] * l[3],       4 * l[1] * l[3],
          4 * l[2] * l[3]};
}

/// Two standing waves, one of shear and one of volume whose pressure stays of the size of the shear
/// stress as nu goes to 1/2.
struct Waves {
  Elasticity material;
  Vec3 across{1, 2, -1}, along{1.5, -1, 2}; ///< their wave vectors
  Vec3 shear{1, 0, 1};                      ///< at right angles to the first

  Vec3 displacement(const Vec3& p) const {
    return std::sin(dot(across, p) + 0.3) * shear +
           (material.mu / (material.lambda + 2 * material.mu)) * std::cos(dot(along, p)) * along;
  }
  /// -div(stress)
  Vec3 force_density(const Vec3& p) const {
    return material.mu * dot(across, across) * std::sin(dot(across, p) + 0.3) * shear +
           material.mu * dot(along, along) * std::cos(dot(along, p)) * along;
  }
};

/// The L2 norm of the error over that of the displacement, on a cube in n³ cubes.
double wave_error(std::uint32_t n, bool quadratic, double poisson) {
  Solid solid(test::box_tetrahedra(n, n, n, 1.0 / n), quadratic, {2500, poisson, 1});
  const Waves waves{elasticity(2500, poisson)};
  const auto points = integration_points();
  const std::size_t count = quadratic ? 10 : 4;
  const auto node = [&](std::size_t t, std::size_t a) {
    return std::size_t{a < 4 ? solid.mesh.tetrahedra[t][a] : solid.mesh.middles[t][a - 4]};
  };
  const auto place = [&](std::size_t t, const std::array<double, 4>& l) {
    Vec3 p;
    for (std::size_t k = 0; k < 4; ++k)
      p += l[k] * solid.mesh.points[solid.mesh.tetrahedra[t][k]];
    return p;
  };
  std::vector<double> load(solid.fixed.size()), exact(load.size());
  for (std::size_t t = 0; t < solid.elements.size(); ++t) {
    const SolidElement& e = solid.elements[t];
    std::array<Vec3, 10> force{}, even{};
    Vec3 at_bubble; // mean of the force density, weighted by the bubble
    for (const IntegrationPoint& point : points) {
      const Vec3 f = waves.force_density(place(t, point.at)) * (point.weight * e.volume);
      const auto values = shapes(point.at, quadratic);
      for (std::size_t a = 0; a < count; ++a)
        force[a] += values[a] * f;
      at_bubble +=
          256 * point.at[0] * point.at[1] * point.at[2] * point.at[3] / (32.0 / 105 * e.volume) * f;
    }
    body_load(e, at_bubble, std::span(even).first(count));
    for (std::size_t a = 0; a < count; ++a) {
      if (quadratic) // what the bubble hands on
        force[a] += even[a] - at_bubble * (e.volume * (a < 4 ? -1.0 / 20 : 1.0 / 5));
      for (int axis = 0; axis < 3; ++axis)
        load[3 * node(t, a) + static_cast<std::size_t>(axis)] += force[a][axis];
    }
  }
  for (std::size_t i = 0; i < solid.mesh.points.size(); ++i)
    for (int axis = 0; axis < 3; ++axis)
      exact[3 * i + static_cast<std::size_t>(axis)] =
          waves.displacement(solid.mesh.points[i])[axis];
  const auto side = [](double x) { return x < 1e-9 || x > 1 - 1e-9; };
  for (std::size_t axis = 0; axis < 3; ++axis)
    solid.hold(axis, [&](const Vec3& p) { return side(p.x) || side(p.y) || side(p.z); });
  const auto u = solid.solve(load, exact);
  double error = 0, whole = 0;
  for (std::size_t t = 0; t < solid.elements.size(); ++t)
    for (const IntegrationPoint& point : points) {
      const Vec3 right = waves.displacement(place(t, point.at));
      Vec3 found;
      const auto values = shapes(point.at, quadratic);
      for (std::size_t a = 0; a < count; ++a)
        for (int axis = 0; axis < 3; ++axis)
          found[axis] += values[a] * u[3 * node(t, a) + static_cast<std::size_t>(axis)];
      error += point.weight * solid.elements[t].volume * dot(found - right, found - right);
      whole += point.weight * solid.elements[t].volume * dot(right, right);
    }
  return std::sqrt(error / whole);
}

TEST(SolidValidation, DisplacementsConvergeWithOrders2And3) {
  for (const double poisson : {0.0, 0.3, 0.499}) {
    const double coarse = wave_error(3, true, poisson), fine = wave_error(6, true, poisson);
    const double order = std::log2(coarse / fine);
    EXPECT_GE(order, 2.8) << poisson;
    EXPECT_LE(order, 3.5) << poisson;
  }
  const double coarse = wave_error(4, false, 0.3), fine = wave_error(8, false, 0.3);
  const double order = std::log2(coarse / fine);
  EXPECT_GE(order, 1.8);
  EXPECT_LE(order, 2.5);
}

struct Beam {
  double droop = 0;
  std::size_t unknowns = 0;
};
/// 200 × 10 × 10 mm, E = 10 kPa, held at one end, a shear traction at the other; droop over
/// Timoshenko's (shear coefficient of Cowper, 1966).
Beam beam(bool quadratic, double poisson, std::uint32_t across) {
  const double length = 200, height = 10, young = 1e4, traction = 0.2;
  Solid solid(test::box_tetrahedra(20 * across, across, across, height / across), quadratic,
              {young, poisson, 1e-3});
  for (std::size_t axis = 0; axis < 3; ++axis)
    solid.hold(axis, [](const Vec3& p) { return p.x == 0; });
  const TetBoundary faces = boundary(solid.mesh);
  const auto end = solid.triangles(faces, [&](const Vec3& p) { return p.x > length - 1e-6; });
  const auto u = solid.solve(traction_load(solid.mesh, faces, end, {0, 0, -traction}));
  const double force = traction * height * height, inertia = std::pow(height, 4) / 12,
               coefficient = 10 * (1 + poisson) / (12 + 11 * poisson),
               shear = young / (2 * (1 + poisson));
  const double expected = force * std::pow(length, 3) / (3 * young * inertia) +
                          force * length / (coefficient * shear * height * height);
  return {-u[3 * solid.node_at({length, 5, 5}) + 2] / expected, solid.unknowns()};
}

TEST(SolidValidation, SlenderBeamDroopsAsTimoshenkosWhereQuadratic) {
  const Beam tissue = beam(true, 0.3, 2), silicone = beam(true, 0.499, 2);
  EXPECT_EQ(tissue.unknowns, 6000U);
  EXPECT_NEAR(tissue.droop, 1, 0.01);
  // Where the end is held it can't thicken either, which Timoshenko leaves out.
  EXPECT_NEAR(silicone.droop, 1, 0.025);
  // With as many linear elements' nodes: too stiff in bending, and locked.
  const Beam linear = beam(false, 0.3, 4), locked = beam(false, 0.499, 4);
  EXPECT_EQ(locked.unknowns, 6000U);
  EXPECT_LT(linear.droop, 0.85);
  EXPECT_GT(linear.droop, 0.5);
  EXPECT_LT(locked.droop, 0.1);
}

/// Cook's membrane in plane strain, E = 250, nu = 0.4999, 100 on the right side: the corner rises
/// by 7.769. (Plane Taylor-Hood elements of another program, sides in 8, 16, 32, 64: 7.559, 7.679,
/// 7.729, 7.751, and on to their limit; the upper left corner is singular.)
double cooks_rise(std::uint32_t n, bool quadratic) {
  TetMesh box = test::box_tetrahedra(n, n, 1, 1.0 / n);
  for (Vec3& p : box.points)
    p = {48 * p.x, 44 * p.x + (44 - 28 * p.x) * p.y, 48 * p.z};
  Solid solid(std::move(box), quadratic, {250, 0.4999, 1});
  for (std::size_t axis = 0; axis < 3; ++axis)
    solid.hold(axis, [&](const Vec3& p) { return axis == 2 || p.x == 0; });
  const TetBoundary faces = boundary(solid.mesh);
  const auto right = solid.triangles(faces, [](const Vec3& p) { return p.x > 48 - 1e-6; });
  const auto u = solid.solve(traction_load(solid.mesh, faces, right, {0, 6.25, 0}));
  return u[3 * solid.node_at({48, 60, 0}) + 1];
}

TEST(SolidValidation, CooksMembraneDoesNotLock) {
  const double expected = 7.769;
  EXPECT_NEAR(cooks_rise(8, true), expected, 0.045 * expected);
  EXPECT_NEAR(cooks_rise(28, true), expected, 0.01 * expected);
  EXPECT_LT(cooks_rise(16, false), 0.4 * expected);
}

/// A thick elliptic plate under pressure (NAFEMS, The standard NAFEMS benchmarks, 1990: LE10):
/// stress yy at the inner end of its upper side, D.
TEST(SolidValidation, NafemsLe10) {
  const auto stress = [](std::uint32_t radial, std::uint32_t around, std::uint32_t through) {
    TetMesh box = test::box_tetrahedra(radial, around, through);
    for (Vec3& p : box.points) {
      const double out = p.x / radial, angle = p.y / around * pi / 2;
      const bool first = p.y == 0, last = p.y == around;
      p = {last ? 0 : (2 + 1.25 * out) * std::cos(angle),
           first ? 0 : (1 + 1.75 * out) * std::sin(angle), 0.6 * p.z / through};
    }
    Solid solid(std::move(box), true, {210e9, 0.3, 1});
    // Middles of the outer side's edges lie on chords.
    const auto outside = [](const Vec3& p) {
      return p.x * p.x / (3.25 * 3.25) + p.y * p.y / (2.75 * 2.75) > 0.99;
    };
    solid.hold(0, [&](const Vec3& p) { return p.x == 0 || outside(p); });
    solid.hold(1, [&](const Vec3& p) { return p.y == 0 || outside(p); });
    solid.hold(2, [&](const Vec3& p) { return outside(p) && std::abs(p.z - 0.3) < 1e-9; });
    const TetBoundary faces = boundary(solid.mesh);
    const auto top = solid.triangles(faces, [](const Vec3& p) { return p.z > 0.6 - 1e-9; });
    const auto u = solid.solve(pressure_load(solid.mesh, faces, top, 1e6));
    const auto stresses =
        nodal_tensors(solid.mesh, solid.elements,
                      solid_stresses(solid.elements, solid_strains(solid.mesh, solid.materials,
                                                                   solid.elements, u)));
    const double at_d = stresses[solid.node_at({2, 0, 0.6})][3] / 1e6;
    return std::array{at_d, static_cast<double>(solid.unknowns())};
  };
  const auto [at_d, unknowns] = stress(12, 16, 2);
  EXPECT_EQ(unknowns, 11772);
  EXPECT_NEAR(at_d, -5.38, 0.01 * 5.38);
}

// A beam of silicone (Dragon Skin 10, 100 x 30 x 30 mm), clamped at an end: Dubied et al.,
// Sim-to-Real for Soft Robots using Differentiable FEM, IEEE RA-L 2022, who fitted E to it. Droop
// of their three markers under the beam's own weight, means of two trials; small strains leave out
// that the beam turns.
TEST(SolidValidation, ASiliconeBeamDroopsAsMeasured) {
  struct Marker {
    Vec3 place;
    double measured;
  };
  const std::array<Marker, 3> markers{
      {{{100, 15, 30}, 6.68}, {{100, 0, 25}, 6.555}, {{100, 30, 5}, 6.25}}};
  const auto droops = [&](bool quadratic) {
    Solid beam(test::box_tetrahedra(20, 6, 6, 5), quadratic, {263824, 0.499, 1.07e-3});
    for (std::size_t axis = 0; axis < 3; ++axis)
      beam.hold(axis, [](const Vec3& p) { return p.x == 0; });
    const std::vector<double> u =
        beam.solve(gravity_load(beam.mesh, beam.materials, beam.elements, {0, 0, -9807.09}));
    std::array<double, 3> result{};
    for (std::size_t n = 0; n < 3; ++n)
      result[n] = -u[3 * beam.node_at(markers[n].place) + 2];
    return result;
  };
  const std::array<double, 3> droop = droops(true), locked = droops(false);
  double mean = 0, measured = 0;
  for (std::size_t n = 0; n < 3; ++n) {
    EXPECT_NEAR(droop[n], markers[n].measured, 0.08 * markers[n].measured) << n;
    EXPECT_LT(locked[n], 0.25 * markers[n].measured) << n;
    mean += droop[n] / 3;
    measured += markers[n].measured / 3;
  }
  EXPECT_NEAR(mean, measured, 0.04 * measured);
  EXPECT_NEAR(droop[1], 6.75, 0.01 * 6.75); // COMSOL
}

} // namespace
} // namespace gewebe
