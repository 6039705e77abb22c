// Cells whose isosurface is hard to get right: what the fixed rule makes of them, and how that
// differs from the trilinear interpolant.

#include "tests/unit/larger.h"
#include "tests/unit/surface_scenes.h"
#include "volume/field.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>

namespace gewebe::test {
namespace {

using namespace scenes;

using Cell = std::array<double, 8>; // values at x + 2 y + 4 z, isovalue 0

/// The cell across the border of leaves, all else well outside.
volume::Grid padded(const Cell& cell) {
  volume::GridInfo info;
  double largest = 0;
  for (const double value : cell)
    largest = test::larger(largest, std::abs(value));
  info.background = -static_cast<float>(largest);
  info.isovalue = 0;
  return sample(info, {7, 7, 7}, {8, 8, 8}, [&](int i, int j, int k) {
    return cell[static_cast<std::size_t>(4 * (k - 7) + 2 * (j - 7) + i - 7)];
  });
}

struct Topology {
  std::int64_t components = 0, euler = 0;
  bool operator==(const Topology&) const = default;
};

Topology topology(const mesh::MeshReport& report) {
  EXPECT_TRUE(is_sound(report));
  return {static_cast<std::int64_t>(report.components), report.euler};
}

/// Of the trilinear interpolant of a padded cell: its mesh on a lattice `fine` times finer.
Topology trilinear_topology(const volume::Grid& grid, int fine) {
  volume::Field field(grid);
  volume::GridInfo info = grid.info();
  const volume::Grid samples =
      sample(info, {6 * fine, 6 * fine, 6 * fine}, {9 * fine, 9 * fine, 9 * fine},
             [&](int i, int j, int k) {
               return field.value({1.0 * i / fine, 1.0 * j / fine, 1.0 * k / fine});
             });
  return topology(mesh::examine_mesh(surface::marching_cubes({}, samples).mesh));
}

/// At every epsilon sound, and of one topology: the fixed rule's.
Topology fixed_topology(const volume::Grid& grid, const std::string& name) {
  const surface::IsoSurface surface = surface::marching_cubes({}, grid);
  const Topology plain = topology(mesh::examine_mesh(surface.mesh));
  for (const double epsilon : {0.0, 0.05, 0.15, 0.25, 0.35, 0.45, 0.5})
    for (const auto place :
         {surface::SnapOptions::Place::mean, surface::SnapOptions::Place::corner})
      EXPECT_EQ(topology(mesh::examine_mesh(surface::snap({}, surface, {epsilon, place}).mesh)),
                plain)
          << name << ", epsilon " << epsilon;
  return plain;
}

/// Are the corners on one side of the isovalue connected along edges, on both sides? Then there is
/// nothing that a rule could decide.
bool is_simple(const Cell& cell) {
  std::array<int, 8> part{};
  int parts = 0;
  for (int start = 0; start < 8; ++start) {
    if (part[static_cast<std::size_t>(start)] != 0)
      continue;
    std::vector<int> open{start};
    part[static_cast<std::size_t>(start)] = ++parts;
    while (!open.empty()) {
      const auto corner = static_cast<unsigned>(open.back());
      open.pop_back();
      for (const unsigned axis : {1U, 2U, 4U})
        if (const unsigned next = corner ^ axis;
            part[next] == 0 && (cell[next] > 0) == (cell[corner] > 0)) {
          part[next] = parts;
          open.push_back(static_cast<int>(next));
        }
    }
  }
  return parts <= 2;
}

struct HardCell {
  const char* name;
  Cell cell;
  Topology fixed, trilinear;
};

// An ambiguous face is joined where its saddle is inside (Nielson and Hamann 1991): for values a, b
// inside and c, d outside if ab > cd.
const std::vector<HardCell> hard_cells{
    {"one corner", {1, -1, -1, -1, -1, -1, -1, -1}, {1, 2}, {1, 2}},
    {"all but one corner", {-1, 1, 1, 1, 1, 1, 1, 1}, {1, 2}, {1, 2}},
    {"face diagonal apart", {1, -3, -3, 1, -3, -3, -3, -3}, {2, 4}, {2, 4}},
    {"face diagonal joined", {3, -1, -1, 3, -1, -1, -1, -1}, {2, 4}, {1, 2}},
    {"face diagonal, saddle on the isovalue", {2, -1, -4, 2, -5, -5, -5, -5}, {2, 4}, {2, 4}},
    {"space diagonal apart", {1, -1, -1, -1, -1, -1, -1, 1}, {2, 4}, {2, 4}},
    {"space diagonal joined", {9, -1, -1, -1, -1, -1, -1, 9}, {2, 4}, {1, 2}},
    {"two edges apart", {1, 1, -3, -3, -3, -3, 1, 1}, {2, 4}, {2, 4}},
    {"two edges joined", {3, 3, -1, -1, -1, -1, 3, 3}, {2, 4}, {1, 2}},
    {"two edges joined at both ends alone", {5, 1, -4, -1, -1, -4, 1, 5}, {2, 4}, {1, 2}},
    {"three corners joined", {-1, -1, -1, 9, -1, 9, 9, -1}, {3, 6}, {1, 2}},
    {"three corners joined in a ring", {-50, -0.05, -0.05, 12, -0.05, 12, 12, -50}, {3, 6}, {1, 0}},
    {"four corners apart", {1, -9, -9, 1, -9, 1, 1, -9}, {4, 8}, {4, 8}},
    {"four corners joined", {9, -1, -1, 9, -1, 9, 9, -1}, {4, 8}, {1, 2}},
    {"corners on the isovalue", {0, 1, 1, 0, 1, 0, 0, -1}, {3, 6}, {1, 2}},
    {"an edge on the isovalue", {0, 0, -1, -2, -1, -2, 3, 4}, {1, 2}, {1, 2}},
    {"all on the isovalue but one", {0, 0, 0, 0, 0, 0, 0, 1}, {1, 2}, {1, 2}},
};

TEST(HardCells, OfOurOwn) {
  for (const HardCell& hard : hard_cells) {
    const volume::Grid grid = padded(hard.cell);
    EXPECT_EQ(fixed_topology(grid, hard.name), hard.fixed) << hard.name;
    for (const int fine : {12, 17}) {
      EXPECT_EQ(trilinear_topology(grid, fine), hard.trilinear) << hard.name << ", " << fine;
    }
  }
}

TEST(HardCells, OfMcPro) {
  const char* shared = std::getenv("GEWEBE_SHARED");
  std::ifstream file(std::string(shared != nullptr ? shared : "../shared") +
                     "/data/mcpro_cells.json");
  if (!file)
    GTEST_SKIP() << "no mcpro_cells.json";
  const nlohmann::json cells = nlohmann::json::parse(file);
  EXPECT_EQ(cells.size(), 64U);
  int different = 0;
  for (const auto& [name, entry] : cells.items()) {
    ASSERT_EQ(entry.at("values").size(), 8U);
    const Cell cell = entry.at("values").get<Cell>();
    const volume::Grid grid = padded(cell);
    const Topology fixed = fixed_topology(grid, name);
    const Topology coarse = trilinear_topology(grid, 12), fine = trilinear_topology(grid, 17);
    if (fixed != fine || coarse != fine) {
      ++different;
      std::printf("%-40s fixed rule: %2d components, Euler %2d; trilinear: %2d, %2d%s\n",
                  name.c_str(), static_cast<int>(fixed.components), static_cast<int>(fixed.euler),
                  static_cast<int>(fine.components), static_cast<int>(fine.euler),
                  coarse == fine ? "" : " (singular: depends on the sampling)");
    }
    EXPECT_GE(fixed.components, fine.components) << name; // the rule separates
    if (is_simple(cell)) {
      EXPECT_EQ(fixed, fine) << name;
    }
    if (entry.contains("ref_betti")) {
      const auto betti = entry.at("ref_betti").get<std::vector<std::int64_t>>();
      if (betti.size() == 3) {
        EXPECT_EQ(fixed, (Topology{betti[0], betti[0] - betti[1] + betti[2]})) << name;
      }
      std::printf("%-40s Betti numbers given:", name.c_str());
      for (const std::int64_t b : betti)
        std::printf(" %d", static_cast<int>(b));
      std::printf(", of the fixed rule's: %d %d %d\n", static_cast<int>(fixed.components),
                  static_cast<int>(2 * fixed.components - fixed.euler),
                  static_cast<int>(fixed.components));
    }
  }
  std::printf("%d of %zu cells differ\n", different, cells.size());
  EXPECT_GT(different, 20); // they are hard, after all
  EXPECT_LT(different, 44);
}

} // namespace
} // namespace gewebe::test
