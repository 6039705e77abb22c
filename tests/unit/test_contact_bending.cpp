#include "statics/contact_scene_internal.h"

#include <algorithm>
#include <array>
#include <gtest/gtest.h>
#include <random>

namespace gewebe {
namespace {

/// The same by differences of the gradient w_i n.
Matrix9 by_differences(const PlacedInstrument& ball, const std::array<Vec3, 3>& corners,
                       int count) {
  const double by = 1e-6;
  Matrix9 all = Matrix9::Zero();
  for (int c = 0; c < count; ++c)
    for (int a = 0; a < 3; ++a)
      for (const double side : {-by, by}) {
        std::array<Vec3, 3> moved = corners;
        moved[static_cast<std::size_t>(c)][a] += side;
        const auto found = nearest_points(ball, CorePart::first_end, moved, count);
        for (int d = 0; d < count; ++d)
          for (int b = 0; b < 3; ++b)
            all(3 * d + b, 3 * c + a) +=
                found->weights[static_cast<std::size_t>(d)] * found->normal({})[b] / (2 * side);
      }
  return 0.5 * (all + all.transpose());
}

TEST(ContactBending, OfAPointIsWhatDifferencesSay) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> in(-1, 1);
  const auto some = [&] { return Vec3{in(random), in(random), in(random)}; };
  std::array<int, 4> of_support{};
  for (int k = 0; k < 6000; ++k) {
    const int count = 1 + k % 3;
    std::array<Vec3, 3> corners{some(), some(), some()};
    for (std::size_t c = static_cast<std::size_t>(count); c < 3; ++c)
      corners[c] = corners[c - 1];
    const PlacedInstrument ball({1, {}, 0}, {some() + Vec3{0, 0, 1}, {}});
    const auto found = nearest_points(ball, CorePart::first_end, corners, count);
    ASSERT_TRUE(found);
    const bool sure =
        std::ranges::all_of(found->weights, [](double w) { return w == 0 || w > 0.01; });
    const Vec3 n = cross(corners[1] - corners[0], corners[2] - corners[0]);
    if (!sure || found->distance < 0.1 || (count == 3 && norm(n) < 0.1))
      continue; // differences are across two kinds, or rough
    const auto exact = bending_from_point(*found, corners, count);
    ASSERT_TRUE(exact);
    const Matrix9 rough = by_differences(ball, corners, count);
    EXPECT_LT((*exact - rough).norm(), 1e-6 * (1 + rough.norm()));
    ++of_support[static_cast<std::size_t>(
        std::ranges::count_if(found->weights, [](double w) { return w > 0; }))];
  }
  for (const std::size_t support : {1U, 2U, 3U})
    EXPECT_GT(of_support[support], 100) << support;
}

TEST(ContactBending, NoneInATriangleTooThin) {
  const std::array<Vec3, 3> corners{Vec3{-1, 0, 0}, Vec3{1, 0, 0}, Vec3{0, 1e-5, 0}};
  const PlacedInstrument ball({1, {}, 0}, {Vec3{0, 0.4e-5, 1}, {}});
  const auto found = nearest_points(ball, CorePart::first_end, corners, 3);
  ASSERT_TRUE(found);
  EXPECT_FALSE(bending_from_point(*found, corners, 3));
}

} // namespace
} // namespace gewebe
