#pragma once
// Solids that are held and loaded, with the answers that theory or others have for them: what the
// unit tests judge in small and tests/validate by work and error.

#include "base/error.h"
#include "fem/assembly.h"
#include "fem/stress.h"
#include "linalg/factor.h"
#include "tests/unit/larger.h"
#include "tests/unit/tet_fixtures.h"
#include "tetrahedra/boundary.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <numbers>
#include <numeric>
#include <utility>
#include <vector>

namespace gewebe::test {

/// A body that is held, and what it was made of.
struct Solid {
  tetrahedra::TetMesh mesh;
  std::vector<fem::SolidMaterial> materials;
  std::vector<fem::SolidElement> elements;
  std::vector<std::uint8_t> fixed;

  Solid(tetrahedra::TetMesh of_corners, bool quadratic,
        std::vector<fem::SolidMaterial> of_materials)
      : mesh(std::move(of_corners)), materials(std::move(of_materials)) {
    if (quadratic)
      tetrahedra::make_quadratic(mesh);
    elements = fem::solid_elements(mesh, materials);
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
  /// Triangles of the boundary whose corners all are there.
  std::vector<std::uint32_t> triangles(const tetrahedra::TetBoundary& faces,
                                       const std::function<bool(const Vec3&)>& there) const {
    std::vector<std::uint32_t> found;
    for (std::uint32_t k = 0; k < faces.mesh.triangles.size(); ++k) {
      const auto [a, b, c] = faces.mesh.triangles[k];
      if (there(faces.mesh.points[a]) && there(faces.mesh.points[b]) && there(faces.mesh.points[c]))
        found.push_back(k);
    }
    return found;
  }
  /// \throw Error if there is none
  std::size_t node_at(const Vec3& p) const {
    for (std::size_t i = 0; i < mesh.points.size(); ++i)
      if (norm(mesh.points[i] - p) < 1e-9 * (1 + norm(p)))
        return i;
    throw Error("no node where a figure is to be read");
  }
  std::uint32_t node(std::size_t t, std::size_t a) const {
    return a < 4 ? mesh.tetrahedra[t][a] : mesh.middles[t][a - 4];
  }
};

/// Displacements under a load, with those on fixed axes as given, or 0: of a matrix and its factor.
inline std::vector<double> displacements(const Solid& solid, std::vector<double> load,
                                         std::vector<double> given,
                                         const linalg::StiffnessMatrix& k,
                                         const linalg::Factor& factor) {
  given.resize(solid.fixed.size());
  for (std::size_t axis = 0; axis < given.size(); ++axis)
    given[axis] = solid.fixed[axis] != 0 ? given[axis] : 0;
  std::vector<double> held(given.size()), moved(given.size());
  fem::multiply_solid(solid.mesh, solid.elements, given, held);
  for (std::size_t axis = 0; axis < given.size(); ++axis)
    load[axis] -= held[axis];
  linalg::solve_axes(k, factor, load, moved);
  for (std::size_t axis = 0; axis < given.size(); ++axis)
    given[axis] += moved[axis];
  return given;
}

/// A solid, its load, what its fixed axes are displaced by (nothing: 0), and a figure of its
/// displacements.
struct SolidCase {
  Solid solid;
  std::vector<double> load;
  std::vector<double> given = {};
  std::function<double(const Solid&, const std::vector<double>&)> read;
};

inline std::vector<double> displacements(const SolidCase& c) {
  const linalg::StiffnessMatrix k =
      fem::solid_stiffness(c.solid.mesh, c.solid.elements, c.solid.fixed);
  return displacements(c.solid, c.load, c.given, k, linalg::Factor(k, {}));
}
inline double figure(const SolidCase& c) {
  return c.read(c.solid, displacements(c));
}

// --- Constant strain --------------------------------------------------------------------------

/// A distorted box whose sides are displaced by a linear function, which all nodes follow. The
/// figure is the largest deviation from it, over the largest displacement.
inline SolidCase patch(bool quadratic, double poisson) {
  SolidCase c{{distorted_box(), quadratic, {{2500, poisson, 1e-3}}}, {}, {}, {}};
  const std::array<Vec3, 3> gradient{
      {{3e-3, -2e-3, 5e-3}, {7e-3, 1e-3, -4e-3}, {-6e-3, 2e-3, 2e-3}}};
  const auto side = [](double x) { return x == 0 || x == 2; };
  for (std::size_t axis = 0; axis < 3; ++axis)
    c.solid.hold(axis, [&](const Vec3& p) { return side(p.x) || side(p.y) || side(p.z); });
  c.load.resize(c.solid.fixed.size());
  for (std::size_t axis = 0; axis < c.load.size(); ++axis)
    c.given.push_back(dot(gradient[axis % 3], c.solid.mesh.points[axis / 3]));
  c.read = [exact = c.given](const Solid&, const std::vector<double>& u) {
    double error = 0, whole = 0;
    for (std::size_t axis = 0; axis < u.size(); ++axis) {
      error = numeric::larger(error, std::abs(u[axis] - exact[axis]));
      whole = numeric::larger(whole, std::abs(exact[axis]));
    }
    return error / whole;
  };
  return c;
}

// --- A manufactured solution ------------------------------------------------------------------

/// Points in a tetrahedron that integrate polynomials of degree 5 (Stroud's conical product of
/// three Gauss points each, weights for a volume of 1).
struct IntegrationPoint {
  std::array<double, 4> at;
  double weight;
};
inline std::vector<IntegrationPoint> integration_points() {
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

inline std::array<double, 10> shapes(const std::array<double, 4>& l, bool quadratic) {
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
  fem::Elasticity material;
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

/// They in a cube of n³ cubes of six tetrahedra, given at its sides. The figure is the L2 norm of
/// the error over that of the displacement. Loads are those of our quadratic elements with what
/// their bubbles hand on, or `plain`.
inline SolidCase waves(std::uint32_t n, bool quadratic, double poisson, bool plain = false) {
  SolidCase c{{box_tetrahedra(n, n, n, 1.0 / n), quadratic, {{2500, poisson, 1}}}, {}, {}, {}};
  const Waves exact{fem::elasticity(2500, poisson)};
  const auto points = integration_points();
  const std::size_t count = quadratic ? 10 : 4;
  const auto place = [](const Solid& solid, std::size_t t, const std::array<double, 4>& l) {
    Vec3 p;
    for (std::size_t k = 0; k < 4; ++k)
      p += l[k] * solid.mesh.points[solid.mesh.tetrahedra[t][k]];
    return p;
  };
  c.load.resize(c.solid.fixed.size());
  for (std::size_t t = 0; t < c.solid.elements.size(); ++t) {
    const fem::SolidElement& e = c.solid.elements[t];
    std::array<Vec3, 10> force{}, even{};
    Vec3 at_bubble; // mean of the force density, weighted by the bubble
    for (const IntegrationPoint& point : points) {
      const Vec3 f = exact.force_density(place(c.solid, t, point.at)) * (point.weight * e.volume);
      const auto values = shapes(point.at, quadratic);
      for (std::size_t a = 0; a < count; ++a)
        force[a] += values[a] * f;
      at_bubble +=
          256 * point.at[0] * point.at[1] * point.at[2] * point.at[3] / (32.0 / 105 * e.volume) * f;
    }
    fem::body_load(e, at_bubble, std::span(even).first(count));
    for (std::size_t a = 0; a < count; ++a) {
      if (quadratic && !plain) // what the bubble hands on
        force[a] += even[a] - at_bubble * (e.volume * (a < 4 ? -1.0 / 20 : 1.0 / 5));
      for (int axis = 0; axis < 3; ++axis)
        c.load[3 * std::size_t{c.solid.node(t, a)} + static_cast<std::size_t>(axis)] +=
            force[a][axis];
    }
  }
  for (const Vec3& p : c.solid.mesh.points)
    for (int axis = 0; axis < 3; ++axis)
      c.given.push_back(exact.displacement(p)[axis]);
  const auto side = [](double x) { return x < 1e-9 || x > 1 - 1e-9; };
  for (std::size_t axis = 0; axis < 3; ++axis)
    c.solid.hold(axis, [&](const Vec3& p) { return side(p.x) || side(p.y) || side(p.z); });
  c.read = [=](const Solid& solid, const std::vector<double>& u) {
    double error = 0, whole = 0;
    for (std::size_t t = 0; t < solid.elements.size(); ++t)
      for (const IntegrationPoint& point : points) {
        const Vec3 right = exact.displacement(place(solid, t, point.at));
        Vec3 found;
        const auto values = shapes(point.at, quadratic);
        for (std::size_t a = 0; a < count; ++a)
          for (int axis = 0; axis < 3; ++axis)
            found[axis] +=
                values[a] * u[3 * std::size_t{solid.node(t, a)} + static_cast<std::size_t>(axis)];
        error += point.weight * solid.elements[t].volume * dot(found - right, found - right);
        whole += point.weight * solid.elements[t].volume * dot(right, right);
      }
    return std::sqrt(error / whole);
  };
  return c;
}

// --- Beams and plates -------------------------------------------------------------------------

/// 200 × 10 × 10 mm, E = 10 kPa, held at one end, a shear traction at the other. The figure is the
/// droop over Timoshenko's (shear coefficient of Cowper, 1966).
inline SolidCase slender_beam(bool quadratic, double poisson, std::uint32_t across) {
  const double length = 200, height = 10, young = 1e4, traction = 0.2;
  SolidCase c{{box_tetrahedra(20 * across, across, across, height / across),
               quadratic,
               {{young, poisson, 1e-3}}},
              {},
              {},
              {}};
  for (std::size_t axis = 0; axis < 3; ++axis)
    c.solid.hold(axis, [](const Vec3& p) { return p.x == 0; });
  const tetrahedra::TetBoundary faces = tetrahedra::boundary(c.solid.mesh);
  const auto end = c.solid.triangles(faces, [&](const Vec3& p) { return p.x > length - 1e-6; });
  c.load = fem::traction_load(c.solid.mesh, faces, end, {0, 0, -traction});
  const double force = traction * height * height, inertia = std::pow(height, 4) / 12,
               coefficient = 10 * (1 + poisson) / (12 + 11 * poisson),
               shear = young / (2 * (1 + poisson));
  const double expected = force * std::pow(length, 3) / (3 * young * inertia) +
                          force * length / (coefficient * shear * height * height);
  c.read = [=](const Solid& solid, const std::vector<double>& u) {
    return -u[3 * solid.node_at({length, height / 2, height / 2}) + 2] / expected;
  };
  return c;
}

/// Cook's membrane in plane strain, E = 250, nu = 0.4999, 100 on the right side. The figure is how
/// far its upper right corner rises.
inline SolidCase cooks_membrane(std::uint32_t n, bool quadratic) {
  tetrahedra::TetMesh box = box_tetrahedra(n, n, 1, 1.0 / n);
  for (Vec3& p : box.points)
    p = {48 * p.x, 44 * p.x + (44 - 28 * p.x) * p.y, 48 * p.z};
  SolidCase c{{std::move(box), quadratic, {{250, 0.4999, 1}}}, {}, {}, {}};
  for (std::size_t axis = 0; axis < 3; ++axis)
    c.solid.hold(axis, [&](const Vec3& p) { return axis == 2 || p.x == 0; });
  const tetrahedra::TetBoundary faces = tetrahedra::boundary(c.solid.mesh);
  const auto right = c.solid.triangles(faces, [](const Vec3& p) { return p.x > 48 - 1e-6; });
  c.load = fem::traction_load(c.solid.mesh, faces, right, {0, 6.25, 0});
  c.read = [](const Solid& solid, const std::vector<double>& u) {
    return u[3 * solid.node_at({48, 60, 0}) + 1];
  };
  return c;
}
/// Plane Taylor-Hood elements (quadratic displacements, linear pressure), finer towards the four
/// corners, where stresses are singular, by halving eight times: 7.7694, 7.77095, 7.77118 with
/// sides in 8, 16, 32 (tests/validate/cook_reference.py).
inline constexpr double cooks_rise = 7.7712;

/// A thick elliptic plate under pressure (NAFEMS, The standard NAFEMS benchmarks, 1990: LE10). The
/// figure is stress yy at the inner end of its upper side, D, MPa.
inline SolidCase le10(std::uint32_t radial, std::uint32_t around, std::uint32_t through,
                      bool quadratic) {
  tetrahedra::TetMesh box = box_tetrahedra(radial, around, through);
  for (Vec3& p : box.points) {
    const double out = p.x / radial, angle = p.y / around * std::numbers::pi / 2;
    const bool first = p.y == 0, last = p.y == around;
    p = {last ? 0 : (2 + 1.25 * out) * std::cos(angle),
         first ? 0 : (1 + 1.75 * out) * std::sin(angle), 0.6 * p.z / through};
  }
  SolidCase c{{std::move(box), quadratic, {{210e9, 0.3, 1}}}, {}, {}, {}};
  // Middles of the outer side's edges lie on chords.
  const auto outside = [](const Vec3& p) {
    return p.x * p.x / (3.25 * 3.25) + p.y * p.y / (2.75 * 2.75) > 0.99;
  };
  c.solid.hold(0, [&](const Vec3& p) { return p.x == 0 || outside(p); });
  c.solid.hold(1, [&](const Vec3& p) { return p.y == 0 || outside(p); });
  c.solid.hold(2, [&](const Vec3& p) { return outside(p) && std::abs(p.z - 0.3) < 1e-9; });
  const tetrahedra::TetBoundary faces = tetrahedra::boundary(c.solid.mesh);
  const auto top = c.solid.triangles(faces, [](const Vec3& p) { return p.z > 0.6 - 1e-9; });
  c.load = fem::pressure_load(c.solid.mesh, faces, top, 1e6);
  c.read = [](const Solid& solid, const std::vector<double>& u) {
    const auto stresses = fem::nodal_tensors(
        solid.mesh, solid.elements,
        fem::solid_stresses(solid.elements,
                            fem::solid_strains(solid.mesh, solid.materials, solid.elements, u)));
    return stresses[solid.node_at({2, 0, 0.6})][3] / 1e6;
  };
  return c;
}
inline constexpr double le10_stress = -5.38;

// --- A beam that was measured -----------------------------------------------------------------

/// A beam of silicone (Dragon Skin 10, 100 x 30 x 30 mm), clamped at an end: Dubied et al.,
/// Sim-to-Real for Soft Robots using Differentiable FEM, IEEE RA-L 2022, who fitted E to it. Cubes
/// of 30/across mm; 10 · across must be a multiple of 3. Loaded by its own weight; the figure is
/// the droop of the second marker's place, for which the authors' COMSOL has 6.75 mm.
inline SolidCase silicone_beam(std::uint32_t across, bool quadratic) {
  const double cell = 30.0 / across;
  SolidCase c{{box_tetrahedra(10 * across / 3, across, across, cell),
               quadratic,
               {{263824, 0.499, 1.07e-3}}},
              {},
              {},
              {}};
  for (std::size_t axis = 0; axis < 3; ++axis)
    c.solid.hold(axis, [](const Vec3& p) { return p.x == 0; });
  c.load = fem::gravity_load(c.solid.mesh, c.solid.materials, c.solid.elements, {0, 0, -9807.09});
  c.read = [](const Solid& solid, const std::vector<double>& u) {
    return -u[3 * solid.node_at({100, 0, 25}) + 2];
  };
  return c;
}
/// Where three markers stood, and their droops in mm, means of two trials.
struct SiliconeMarker {
  Vec3 place;
  double droop;
};
inline constexpr std::array<SiliconeMarker, 3> silicone_markers{
    {{{100, 15, 30}, 6.68}, {{100, 0, 25}, 6.555}, {{100, 30, 5}, 6.25}}};

} // namespace gewebe::test
