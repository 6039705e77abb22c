// Surfaces that pass through each other: the curve in which they do, and what is refused.

#include "mesh/crossing.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <utility>

namespace gewebe::test {
namespace {

/// A square of 4 x 4 mm in z = height, of 8 x 8 cells, turned over if it looks down.
void add_square(TriangleMesh& mesh, double height, bool down, double x = 0) {
  constexpr std::uint32_t cells = 8;
  const auto first = static_cast<std::uint32_t>(mesh.points.size());
  for (std::uint32_t i = 0; i <= cells; ++i)
    for (std::uint32_t j = 0; j <= cells; ++j)
      mesh.points.push_back({x + 0.5 * i, 0.5 * j, height});
  for (std::uint32_t i = 0; i < cells; ++i)
    for (std::uint32_t j = 0; j < cells; ++j) {
      const std::uint32_t a = first + i * (cells + 1) + j, b = a + cells + 1;
      for (Triangle t : {Triangle{a, b, b + 1}, Triangle{a, b + 1, a + 1}}) {
        if (down)
          std::swap(t[0], t[1]);
        mesh.triangles.push_back(t);
      }
    }
}

TriangleMesh upright_sheet() {
  TriangleMesh sheet;
  sheet.points = {{1.13, -1, -1}, {1.72, 5, -1}, {1.81, 5, 1}, {1.21, -1, 1}};
  sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
  return sheet;
}

TEST(SurfaceCrossing, WallsThatAreApartAreCrossedOneByOne) {
  TriangleMesh walls;
  add_square(walls, 0, false);
  add_square(walls, 1e-6, true);
  const mesh::SurfaceCrossing crossing = mesh::cross_surfaces(walls, upright_sheet());
  EXPECT_GT(crossing.curve.size(), 30U);
  double length = 0;
  for (const mesh::SurfaceCrossing::Edge& edge : crossing.curve)
    length += norm(crossing.a.points[edge.a[1]] - crossing.a.points[edge.a[0]]);
  EXPECT_NEAR(length, 2 * 4 * norm(Vec3{0.595, 6, 0}) / 6, 2e-2);
}

TEST(SurfaceCrossing, WallsThatLieOnEachOtherAreRefusedByName) {
  TriangleMesh walls;
  add_square(walls, 0, false);
  add_square(walls, 0, true);
  for (const bool swapped : {false, true})
    try {
      (void)(swapped ? mesh::cross_surfaces(upright_sheet(), walls)
                     : mesh::cross_surfaces(walls, upright_sheet()));
      ADD_FAILURE();
    } catch (const mesh::MeetingOfNoSheets& error) {
      EXPECT_EQ(std::string(error.what()),
                "the surfaces meet where one of them lies on itself, expected two sheets");
    }
}

TEST(SurfaceCrossing, WhatLiesOnItselfElsewhereIsNoMatter) {
  TriangleMesh walls;
  add_square(walls, 0, false);
  add_square(walls, 0, false, 10);
  add_square(walls, 0, true, 10);
  EXPECT_GT(mesh::cross_surfaces(walls, upright_sheet()).curve.size(), 15U);
}

} // namespace
} // namespace gewebe::test
