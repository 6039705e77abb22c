// exp2ela --accuracy: what a body of a given surface would have in addition,
// tools/model/shape_error.h.

#include "fem/stress_error.h"
#include "tests/unit/tet_fixtures.h"
#include "tetrahedra/boundary.h"
#include "tools/model/shape_error.h"

#include <cmath>
#include <gtest/gtest.h>
#include <numeric>
#include <vector>

namespace gewebe::test {
namespace {

/// A bar of 4 x 2 x 2 mm under one stress everywhere, turned about z.
struct Bar {
  tetrahedra::TetMesh mesh;
  std::vector<fem::SolidElement> elements;
  std::vector<fem::CornerTensors> stresses;
  double density = 0; ///< of twice the energy, Pa
  Vec3 axis;          ///< from the middle of the one end to that of the other

  Bar(std::uint32_t cells, double angle) {
    mesh = box_tetrahedra(2 * cells, cells, cells, 2.0 / cells);
    axis = {std::cos(angle), std::sin(angle), 0}; // NOLINT: a test's own numbers
    for (Vec3& p : mesh.points)
      p = {p.x * axis.x - p.y * axis.y, p.x * axis.y + p.y * axis.x, p.z};
    const fem::Elasticity material = fem::elasticity(3000, 0.3);
    constexpr linalg::SymmetricBlock stress{100, 20, -5, 40, 10, -30};
    for (const Tetrahedron& t : mesh.tetrahedra) {
      elements.push_back(fem::solid_element(
          {mesh.points[t[0]], mesh.points[t[1]], mesh.points[t[2]], mesh.points[t[3]]}, material));
      stresses.push_back({stress, stress, stress, stress});
    }
    density = fem::energy_density(material, stress);
  }

  cli::ElementErrors errors() const { return {&mesh, {}, 1, elements, stresses}; }

  /// The bar's surface, longer by d at its far end.
  TriangleMesh longer(double d) const {
    TriangleMesh surface = tetrahedra::boundary(mesh).mesh;
    for (Vec3& p : surface.points)
      if (dot(p, axis) > 4 - 1e-9)
        p += d * axis;
    return surface;
  }
};

double sum(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

TEST(ShapeError, ALongerBarHasTheEnergyOfItsSlice) {
  for (const std::uint32_t cells : {1U, 2U, 4U})
    for (const double angle : {0.0, 0.3})
      for (const double d : {0.05, -0.05}) {
        const Bar bar(cells, angle);
        const TriangleMesh surface = bar.longer(d);
        const double exact = bar.density * d * 4; // of a section of 2 x 2 mm
        EXPECT_NEAR(sum(cli::ShapeError(surface).energies(bar.errors(), {})), exact,
                    1e-9 * std::abs(exact))
            << cells << " cells, angle " << angle << ", " << d;
      }
}

TEST(ShapeError, ATouchedSurfaceAddsHertzsPartAndAnInnerNodeNothing) {
  const Bar bar(2, 0.3);
  const TriangleMesh surface = bar.longer(0.05);
  const cli::ShapeError shape(surface);
  const double alone = sum(shape.energies(bar.errors(), {}));
  std::uint32_t end = 0, inner = 0;
  for (std::uint32_t n = 0; n < bar.mesh.points.size(); ++n) {
    const Vec3& p = bar.mesh.points[n];
    const Vec3 own{dot(p, bar.axis), p.y * bar.axis.x - p.x * bar.axis.y, p.z};
    if (norm(own - Vec3{4, 1, 1}) < 1e-9)
      end = n;
    if (norm(own - Vec3{2, 1, 1}) < 1e-9)
      inner = n;
  }
  ASSERT_GT(end, 0U);
  ASSERT_GT(inner, 0U);
  const std::vector<contact::NodeVector> pressed{{end, -7.0 * bar.axis}};
  EXPECT_NEAR(sum(shape.energies(bar.errors(), pressed)) - alone, 1.2 * 7 * 0.05, 1e-9);
  const std::vector<contact::NodeVector> displaced{{inner, -7.0 * bar.axis}};
  EXPECT_EQ(sum(shape.energies(bar.errors(), displaced)), alone);
}

} // namespace
} // namespace gewebe::test
