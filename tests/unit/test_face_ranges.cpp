// Faces by ranges of points, and what nets take of a mesh, against plain loops.

#include "base/error.h"
#include "base/huge_pages.h"
#include "mesh/face_ranges.h"
#include "model/usable_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>
#include <vector>

namespace gewebe::test {
namespace {

Context on(int threads) {
  Context context;
  context.threads = threads;
  return context;
}

/// A band of triangles whose points follow one another, and at its end some far apart.
std::vector<Triangle> band(std::uint32_t points, std::size_t far) {
  std::vector<Triangle> triangles;
  for (std::uint32_t p = 0; p + 2 < points; ++p)
    triangles.push_back({p, p + 1, p + 2});
  std::mt19937 random(3);
  for (std::size_t n = 0; n < far; ++n)
    triangles.push_back({static_cast<std::uint32_t>(random() % points),
                         static_cast<std::uint32_t>(random() % points),
                         static_cast<std::uint32_t>(random() % points)});
  return triangles;
}

TEST(FaceRanges, BlocksHoldAllFacesOfARange) {
  for (const std::size_t far : {std::size_t{0}, std::size_t{5}, std::size_t{60000}}) {
    constexpr std::uint32_t points = 600000;
    const std::vector<Triangle> triangles = band(points, far);
    const mesh::FaceRanges ranges(triangles, points, on(2));
    EXPECT_EQ(mesh::FaceRanges(triangles, points, on(1)).grain(), ranges.grain());
    std::size_t whole_blocks = 0, looked_at = 0, corners = 0;
    for (std::size_t begin = 0; begin < points; begin += ranges.grain()) {
      const std::size_t end = std::min<std::size_t>(points, begin + ranges.grain());
      const auto within = [&](std::uint32_t p) { return p >= begin && p < end; };
      std::size_t last = 0;
      ranges.for_each_block(begin, end, [&](std::size_t first, std::size_t stop, bool whole) {
        EXPECT_GE(first, last);
        last = stop;
        whole_blocks += whole ? 1U : 0U;
        looked_at += stop - first;
        for (std::size_t f = first; f < stop; ++f) {
          const auto some = static_cast<std::size_t>(std::ranges::count_if(triangles[f], within));
          corners += some;
          ASSERT_TRUE(!whole || some == 3);
        }
      });
    }
    EXPECT_EQ(corners, 3 * triangles.size()); // each once, by its own range
    EXPECT_GT(whole_blocks, 0U);
    EXPECT_LT(looked_at, 3 * triangles.size());
  }
}

TEST(FaceRanges, AFaceIsOfTheRangesOfItsFirstAndLastPoint) {
  const std::vector<Triangle> none;
  const auto border = static_cast<std::uint32_t>(mesh::FaceRanges(none, 0, on(1)).grain());
  const std::vector<Triangle> one{{border - 1, border, border - 1}};
  const mesh::FaceRanges ranges(one, 2 * border, on(1));
  ASSERT_EQ(ranges.grain(), border);
  for (const std::size_t begin : {std::size_t{0}, std::size_t{border}}) {
    std::size_t blocks = 0;
    ranges.for_each_block(begin, begin + border, [&](std::size_t, std::size_t, bool whole) {
      EXPECT_FALSE(whole);
      ++blocks;
    });
    EXPECT_EQ(blocks, 1U);
  }
}

TEST(FaceRanges, PointsInDisorderAreLookedAtInFewRanges) {
  constexpr std::uint32_t points = 2000000;
  std::mt19937 random(1);
  std::vector<Triangle> triangles(100000);
  for (Triangle& t : triangles)
    for (std::uint32_t& corner : t)
      corner = static_cast<std::uint32_t>(random() % points);
  const mesh::FaceRanges ranges(triangles, points, on(2));
  EXPECT_GE(ranges.grain() * 16, points);
  EXPECT_LT(ranges.grain() * 8, points);
}

TEST(UsableSurface, IsThatOfAPlainLoop) {
  TriangleMesh mesh;
  mesh.points.resize(150000);
  std::mt19937 random(11);
  const auto any = [&] { return static_cast<std::uint32_t>(random() % mesh.points.size()); };
  for (std::size_t n = 0; n < 120000; ++n) {
    const std::uint32_t p = any() / 4 * 3; // so that many are of no face
    mesh.triangles.push_back({p, any() / 2, n % 7 == 0 ? p : any()});
    if (n % 5000 == 0 && n > 0)
      mesh.triangles.push_back(mesh.triangles[any() % n]);
  }
  std::vector<std::uint32_t> faces;
  std::set<std::uint32_t> used;
  std::set<std::vector<std::uint32_t>> known;
  std::size_t degenerate = 0, twice = 0;
  for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f) {
    std::vector<std::uint32_t> corners(mesh.triangles[f].begin(), mesh.triangles[f].end());
    std::ranges::sort(corners);
    if (std::ranges::adjacent_find(corners) != corners.end()) {
      ++degenerate;
      continue;
    }
    used.insert(corners.begin(), corners.end());
    if (known.insert(corners).second)
      faces.push_back(f);
    else
      ++twice;
  }
  ASSERT_GT(degenerate, 0U);
  ASSERT_GT(twice, 0U);
  ASSERT_LT(used.size(), mesh.points.size());
  for (const int threads : {1, 3}) {
    const model::UsableSurface s = model::usable_surface(mesh, on(threads));
    EXPECT_EQ(s.face_of_triangle, faces);
    EXPECT_EQ(s.point_of_node, std::vector<std::uint32_t>(used.begin(), used.end()));
    EXPECT_EQ(s.degenerate_faces, degenerate);
    EXPECT_EQ(s.duplicate_faces, twice);
    EXPECT_EQ(s.isolated_points, mesh.points.size() - used.size());
    ASSERT_EQ(s.triangles.size(), faces.size());
    for (std::size_t t = 0; t < faces.size(); ++t)
      for (std::size_t k = 0; k < 3; ++k)
        ASSERT_EQ(s.point_of_node[s.triangles[t][k]], mesh.triangles[faces[t]][k]);
    EXPECT_EQ(s.edges.corners.size(), 3 * faces.size());
  }
  mesh.triangles = {{0, 1, 1}};
  EXPECT_THROW((void)model::usable_surface(mesh, on(1)), Error);
}

TEST(TouchedPages, HoldWhatIsWritten) {
  for (const std::size_t count : {std::size_t{0}, std::size_t{1}, std::size_t{3} << 20}) {
    std::vector<double> numbers;
    reserve_touched(on(2), numbers, count);
    EXPECT_TRUE(numbers.empty());
    EXPECT_GE(numbers.capacity(), count);
    numbers.resize(count, 1.5);
    EXPECT_EQ(std::ranges::count(numbers, 1.5), static_cast<std::ptrdiff_t>(count));
  }
}

} // namespace
} // namespace gewebe::test
