#include "texture/tissue_color.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <iterator>
#include <map>
#include <string>
#include <vector>

namespace gewebe::test {
namespace {

/// Triangles round one point, each with one of the materials.
TriangleMesh fan(const std::vector<std::int32_t>& materials) {
  TriangleMesh mesh;
  mesh.points.resize(2 * materials.size() + 1);
  for (std::uint32_t n = 0; n < materials.size(); ++n)
    mesh.triangles.push_back({0, 2 * n + 1, 2 * n + 2});
  mesh.material = materials;
  return mesh;
}

void expect_all_differ(const std::map<std::int32_t, Vec3>& colors) {
  for (auto a = colors.begin(); a != colors.end(); ++a)
    for (auto b = std::next(a); b != colors.end(); ++b)
      EXPECT_NE(a->second, b->second) << a->first << " and " << b->first;
}

TEST(TissueColor, NeighboursDiffer) {
  // By number alone 1, 9 and 17 look alike.
  ASSERT_EQ(texture::tissue_color("", 1), texture::tissue_color("", 9));
  const auto colors = texture::tissue_colors(fan({1, 9, 17, 2}), {});
  ASSERT_EQ(colors.size(), 4U);
  expect_all_differ(colors);
  EXPECT_EQ(colors.at(1), texture::tissue_color("", 1));
  EXPECT_EQ(colors.at(2), texture::tissue_color("", 2));
  // Sixteen round one point.
  std::vector<std::int32_t> many;
  for (std::int32_t n = 0; n < 16; ++n)
    many.push_back(3 * n);
  expect_all_differ(texture::tissue_colors(fan(many), {}));
}

TEST(TissueColor, StaysWhereNothingTouches) {
  TriangleMesh mesh = fan({1, 9});
  mesh.points.resize(6);
  mesh.triangles = {{0, 1, 2}, {3, 4, 5}};
  const auto colors = texture::tissue_colors(mesh, {});
  EXPECT_EQ(colors.at(1), texture::tissue_color("", 1));
  EXPECT_EQ(colors.at(9), texture::tissue_color("", 9));
}

TEST(TissueColor, PresetsKeepTheirs) {
  const std::vector<std::string> names{"mine", "liver", "other", "uterus"};
  const auto colors = texture::tissue_colors(fan({0, 1, 2, 3}), names);
  EXPECT_EQ(colors.at(1), texture::tissue_color("liver", 1));
  EXPECT_EQ(colors.at(3), texture::tissue_color("uterus", 3));
  expect_all_differ(colors);
  // Any material beside a preset that has its colour in the row takes another one.
  for (const std::string preset : {"liver", "gallbladder", "uterus", "tumour"})
    for (std::int32_t n = 0; n < 8; ++n) {
      std::vector<std::string> of(9);
      of[8] = preset;
      expect_all_differ(texture::tissue_colors(fan({n, 8}), of));
    }
}

} // namespace
} // namespace gewebe::test
