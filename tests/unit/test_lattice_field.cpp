// Vectors at nodes, interpolated at the places of a lattice.

#include "formats/volume/nifti_field.h"
#include "larger.h"
#include "tet_fixtures.h"
#include "tetrahedra/lattice_field.h"
#include "volume/grid.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace gewebe::test {
namespace {

using VectorOf = std::function<Vec3(const Vec3&)>;

tetrahedra::TetMesh solid(bool quadratic) {
  tetrahedra::TetMesh mesh = test::odd_tetrahedra(quadratic, false);
  for (Vec3& p : mesh.points)
    p.z -= 100; // results are in single precision
  return mesh;
}

/// Oblique to the axes of the world, mirrored or not, around the mesh and beyond it.
tetrahedra::PlaceLattice lattice_around(const tetrahedra::TetMesh& mesh, bool mirrored) {
  const Box3 box = tetrahedra::bounding_box(mesh);
  const double h = box.longest_side() / 14;
  tetrahedra::PlaceLattice lattice;
  lattice.step = {Vec3{0.96, 0.28, 0} * h, Vec3{-0.28, 0.96, 0} * (1.1 * h),
                  Vec3{0, 0.1, mirrored ? -1.0 : 1.0} * (0.9 * h)};
  lattice.size = {23, 22, 21};
  const Vec3 middle = (box.min + box.max) * 0.5;
  lattice.origin = middle;
  for (std::size_t a = 0; a < 3; ++a)
    lattice.origin =
        lattice.origin - lattice.step[a] * (0.5 * static_cast<double>(lattice.size[a] - 1));
  return lattice;
}

Vec3 place_of(const tetrahedra::PlaceLattice& lattice, std::size_t n) {
  const std::array<std::size_t, 3> at{n % lattice.size[0], n / lattice.size[0] % lattice.size[1],
                                      n / lattice.size[0] / lattice.size[1]};
  Vec3 place = lattice.origin;
  for (std::size_t a = 0; a < 3; ++a)
    place = place + lattice.step[a] * static_cast<double>(at[a]);
  return place;
}

tetrahedra::LatticeField field_of(const tetrahedra::TetMesh& mesh, const std::vector<Vec3>& values,
                                  const tetrahedra::PlaceLattice& lattice, int threads = 2) {
  Context context;
  context.threads = threads;
  tetrahedra::LatticeField field(lattice.places());
  tetrahedra::interpolate_on_lattice(mesh, values, lattice, field, context);
  return field;
}

std::vector<Vec3> at_points(const tetrahedra::TetMesh& mesh, const VectorOf& of) {
  std::vector<Vec3> values;
  for (const Vec3& p : mesh.points)
    values.push_back(of(p));
  return values;
}

/// The largest error against `of` where a place is held.
double error_of(const tetrahedra::LatticeField& field, const tetrahedra::PlaceLattice& lattice,
                const VectorOf& of) {
  double worst = 0;
  for (std::size_t n = 0; n < lattice.places(); ++n) {
    if (field.held[n] == 0)
      continue;
    const Vec3 expected = of(place_of(lattice, n));
    const auto& [x, y, z] = field.values[n];
    worst = test::larger(worst, norm(Vec3{x, y, z} - expected));
  }
  return worst;
}

std::size_t held(const tetrahedra::LatticeField& field) {
  std::size_t count = 0;
  for (const std::uint8_t h : field.held)
    count += h;
  return count;
}

/// How deep the place lies in the mesh's straight elements, by the least barycentric coordinate.
double depth(const tetrahedra::TetMesh& mesh, const Vec3& x) {
  double deepest = -HUGE_VAL;
  for (const Tetrahedron& t : mesh.tetrahedra) {
    const auto& [a, b, c, d] = t;
    const std::array<Vec3, 4> p{mesh.points[a], mesh.points[b], mesh.points[c], mesh.points[d]};
    const double whole = tetrahedra::tetrahedron_volume(p[0], p[1], p[2], p[3]);
    double least = HUGE_VAL;
    for (std::size_t k = 0; k < 4; ++k) {
      std::array<Vec3, 4> q = p;
      q[k] = x;
      least = test::smaller(least, tetrahedra::tetrahedron_volume(q[0], q[1], q[2], q[3]) / whole);
    }
    deepest = test::larger(deepest, least);
  }
  return deepest;
}

Vec3 affine(const Vec3& p) {
  return {0.3 + 0.2 * p.x - 0.1 * p.y, -0.4 + 0.05 * p.z + 0.3 * p.y, 0.1 * p.x - 0.2 * p.z};
}

TEST(LatticeField, AffineVectorsAreReproduced) {
  for (const bool quadratic : {false, true})
    for (const bool mirrored : {false, true}) {
      const tetrahedra::TetMesh mesh = solid(quadratic);
      const tetrahedra::PlaceLattice lattice = lattice_around(mesh, mirrored);
      const tetrahedra::LatticeField field = field_of(mesh, at_points(mesh, affine), lattice);
      EXPECT_GT(held(field), 100U);
      EXPECT_LT(error_of(field, lattice, affine), 1e-6);
      // Held are those inside, and none else.
      for (std::size_t n = 0; n < lattice.places(); ++n) {
        const double deep = depth(mesh, place_of(lattice, n));
        if (std::fabs(deep) > 1e-8) {
          EXPECT_EQ(field.held[n], deep > 0 ? 1 : 0) << n << " " << deep;
        }
        if (field.held[n] == 0) {
          EXPECT_EQ(field.values[n], (std::array<float, 3>{}));
        }
      }
    }
}

TEST(LatticeField, QuadraticVectorsByQuadraticElements) {
  const VectorOf of = [](const Vec3& p) {
    return Vec3{p.x * p.x - p.y * p.z, p.x * p.y, p.z * p.z - 0.5 * p.y * p.y + p.x};
  };
  for (const bool quadratic : {false, true}) {
    const tetrahedra::TetMesh mesh = solid(quadratic);
    const tetrahedra::PlaceLattice lattice = lattice_around(mesh, false);
    const double error = error_of(field_of(mesh, at_points(mesh, of), lattice), lattice, of);
    if (quadratic) {
      EXPECT_LT(error, 1e-6);
    } else {
      EXPECT_GT(error, 1e-3) << "the check sees nothing";
    }
  }
}

/// Bends, so that edges are curves.
Vec3 bent(const Vec3& p) {
  return {p.x + 0.15 * p.y * p.y, p.y - 0.1 * p.x * p.z, p.z + 0.1 * p.x * p.x};
}

TEST(LatticeField, CurvedElementsAreFollowed) {
  const tetrahedra::TetMesh rest = solid(true);
  tetrahedra::TetMesh mesh = rest;
  mesh.points = at_points(rest, bent);
  const tetrahedra::PlaceLattice lattice = lattice_around(mesh, true);
  const auto identity = [](const Vec3& p) { return p; };
  const tetrahedra::LatticeField field = field_of(mesh, mesh.points, lattice);
  EXPECT_GT(held(field), 100U);
  EXPECT_LT(error_of(field, lattice, identity), 1e-6);
  // Back to rest: bent again, which quadratic elements know exactly, each place is the one it was.
  const tetrahedra::LatticeField back = field_of(mesh, rest.points, lattice);
  double worst = 0;
  for (std::size_t n = 0; n < lattice.places(); ++n)
    if (back.held[n] != 0) {
      const auto& [x, y, z] = back.values[n];
      worst = test::larger(worst, norm(bent({x, y, z}) - place_of(lattice, n)));
    }
  EXPECT_LT(worst, 2e-6);
  // Their volume, in places.
  const double of_place = std::fabs(dot(cross(lattice.step[0], lattice.step[1]), lattice.step[2]));
  const double by_places = of_place * static_cast<double>(held(field));
  tetrahedra::TetMesh straight = mesh;
  straight.middles = {};
  EXPECT_NEAR(by_places / tetrahedra::volume(straight), 1, 0.1);
}

TEST(LatticeField, TheFirstCountsOnAnyThreads) {
  for (const bool quadratic : {false, true}) {
    const tetrahedra::TetMesh mesh = solid(quadratic);
    const tetrahedra::PlaceLattice lattice = lattice_around(mesh, false);
    const std::vector<Vec3> values = at_points(mesh, bent);
    const tetrahedra::LatticeField one = field_of(mesh, values, lattice, 1),
                                   four = field_of(mesh, values, lattice, 4);
    EXPECT_EQ(one.values, four.values);
    EXPECT_EQ(one.held, four.held);
    // A second solid changes nothing that the first holds.
    tetrahedra::LatticeField again = one;
    Context context;
    tetrahedra::interpolate_on_lattice(mesh, std::vector<Vec3>(mesh.points.size(), Vec3{9, 9, 9}),
                                       lattice, again, context);
    EXPECT_EQ(one.values, again.values);
  }
}

TEST(LatticeField, WhatIsTurnedOrFlatHoldsNothing) {
  for (const bool quadratic : {false, true}) {
    tetrahedra::TetMesh mesh = solid(quadratic);
    for (Vec3& p : mesh.points)
      p.z = -p.z;
    const tetrahedra::PlaceLattice lattice = lattice_around(mesh, false);
    EXPECT_EQ(held(field_of(mesh, mesh.points, lattice)), 0U);
    for (Vec3& p : mesh.points)
      p.z = lattice.origin.z;
    EXPECT_EQ(held(field_of(mesh, mesh.points, lattice)), 0U);
  }
}

TEST(LatticeField, NiftiHasItsPlaceAndItsSigns) {
  volume::GridTransform transform;
  transform.m = {0, -2, 0, 5, 3, 0, 0, 6, 0, 0, 4, 7}; // turned by 90 degrees
  const Int3 size{3, 2, 2};
  const tetrahedra::PlaceLattice lattice = formats::voxel_centres(size, transform);
  EXPECT_EQ(lattice.places(), 12U);
  EXPECT_LT(norm(place_of(lattice, 11) - transform.to_world({2, 1, 1})), 1e-12);
  tetrahedra::LatticeField field(12);
  field.held[5] = 1;
  field.values[5] = {1, 2, 3};
  std::string bytes;
  const auto sink = [&](std::string_view piece) { bytes += piece; };
  formats::write_nifti_field(field, size, transform, std::nanf(""), "what", false, sink);
  ASSERT_EQ(bytes.size(), 352U + 12 * 3 * 4);
  const auto real = [&](std::size_t at) {
    float value = 0;
    std::memcpy(&value, bytes.data() + at, 4);
    return value;
  };
  EXPECT_EQ(real(352 + 4 * 5), -1);
  EXPECT_EQ(real(352 + 4 * 17), -2);
  EXPECT_EQ(real(352 + 4 * 29), 3);
  EXPECT_TRUE(std::isnan(real(352)));
  // Columns of unit length are a rotation by 90 degrees about z: a = d = sqrt(1/2).
  EXPECT_NEAR(real(256), 0, 1e-7);
  EXPECT_NEAR(real(260), 0, 1e-7);
  EXPECT_NEAR(real(264), std::sqrt(0.5), 1e-7);
  EXPECT_EQ(real(76), 1);
  EXPECT_EQ(real(80), 3);
  EXPECT_EQ(real(84), 2);
  std::string packed, again;
  formats::write_nifti_field(field, size, transform, 0, "what", true,
                             [&](std::string_view piece) { packed += piece; });
  formats::write_nifti_field(field, size, transform, 0, "what", true,
                             [&](std::string_view piece) { again += piece; });
  EXPECT_EQ(packed, again);
  EXPECT_TRUE(packed.starts_with("\x1f\x8b"));
}

} // namespace
} // namespace gewebe::test
