// CSG: what set algebra and arithmetic promise, voxel by voxel; operands that are used up.

#include "csg_grids.h"
#include "mesh_fixtures.h"
#include "volume/lattice.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

namespace {

using namespace gewebe;
using namespace gewebe::test;
using Op = volume::CsgOperation;

constexpr std::array all_operations{Op::add,       Op::subtract,   Op::unite,
                                    Op::intersect, Op::difference, Op::exclusive_or};

/// Calls visit(values of the grids at one voxel) for all voxels in [-20, 20)³.
void for_voxels(const std::vector<volume::Grid>& grids,
                const std::function<void(const std::vector<float>&)>& visit) {
  std::vector<volume::GridAccessor> accessors;
  for (const volume::Grid& grid : grids)
    accessors.emplace_back(grid);
  std::vector<float> values(grids.size());
  for (std::int32_t i = -20; i < 20; ++i)
    for (std::int32_t j = -20; j < 20; ++j)
      for (std::int32_t k = -20; k < 20; ++k) {
        for (std::size_t g = 0; g < grids.size(); ++g)
          values[g] = accessors[g].value({i, j, k});
        visit(values);
      }
}

/// Voxels in which the two differ.
std::uint64_t differences(const volume::Grid& a, const volume::Grid& b) {
  std::uint64_t count = 0;
  for_voxels({a, b}, [&](const std::vector<float>& v) { count += !(v[0] == v[1]); });
  return count;
}

/// 1 in all that the random grids may reach.
volume::Grid universe() {
  volume::GridBuilder builder{volume::GridInfo{}};
  for (std::int32_t i = -128; i < 128; i += 128)
    for (std::int32_t j = -128; j < 128; j += 128)
      for (std::int32_t k = -128; k < 128; k += 128)
        builder.add_tile({{i, j, k}, 128, 1, true});
  return builder.finish(false);
}
volume::Grid complement(const volume::Grid& a) {
  return combine(Op::difference, {universe(), a});
}
volume::Grid unite(const volume::Grid& a, const volume::Grid& b) {
  return combine(Op::unite, {a, b});
}
volume::Grid intersect(const volume::Grid& a, const volume::Grid& b) {
  return combine(Op::intersect, {a, b});
}

class CsgAlgebra : public testing::TestWithParam<int> {
protected:
  CsgAlgebra() {
    std::mt19937 random(static_cast<unsigned>(GetParam()));
    a = random_grid(random, 0, 1);
    b = random_grid(random, 0, 1);
    c = random_grid(random, 0, 1);
  }
  volume::Grid a, b, c;
};

TEST_P(CsgAlgebra, HoldsExactlyOnDensitiesFrom0To1) {
  EXPECT_EQ(differences(unite(a, a), a), 0U);
  EXPECT_EQ(differences(intersect(a, a), a), 0U);
  // De Morgan: rounding is monotonous, so 1 - max(a, b) = min(1 - a, 1 - b) to the last bit.
  EXPECT_EQ(differences(complement(unite(a, b)), intersect(complement(a), complement(b))), 0U);
  EXPECT_EQ(differences(complement(intersect(a, b)), unite(complement(a), complement(b))), 0U);
  EXPECT_EQ(differences(unite(a, intersect(a, b)), a), 0U); // absorption
  EXPECT_EQ(differences(intersect(a, unite(a, b)), a), 0U);
  EXPECT_EQ(differences(intersect(a, unite(b, c)), unite(intersect(a, b), intersect(a, c))), 0U);
  EXPECT_EQ(differences(unite(a, intersect(b, c)), intersect(unite(a, b), unite(a, c))), 0U);
  EXPECT_EQ(differences(unite(unite(a, b), c), unite(a, unite(b, c))), 0U);
  EXPECT_EQ(differences(unite(a, universe()), universe()), 0U);
  EXPECT_EQ(differences(intersect(a, universe()), a), 0U);
  EXPECT_EQ(differences(combine(Op::difference, {a, b}), intersect(a, complement(b))), 0U);
  EXPECT_EQ(differences(combine(Op::exclusive_or, {a, b}), combine(Op::exclusive_or, {b, a})), 0U);
  EXPECT_EQ(differences(combine(Op::exclusive_or, {a, b}),
                        unite(combine(Op::difference, {a, b}), combine(Op::difference, {b, a}))),
            0U);
  // n operands at once are the same as one after the other.
  for (const Op operation : {Op::unite, Op::intersect, Op::difference, Op::exclusive_or})
    EXPECT_EQ(differences(combine(operation, {a, b, c}),
                          combine(operation, {combine(operation, {a, b}), c})),
              0U);
}

TEST_P(CsgAlgebra, FalseIdentitiesAreSeen) {
  EXPECT_GT(differences(complement(unite(a, b)), unite(complement(a), complement(b))), 100U);
  EXPECT_GT(differences(unite(a, intersect(a, b)), b), 100U);
  EXPECT_GT(differences(combine(Op::exclusive_or, {a, a}), volume::Grid()),
            100U); // grey, not 0 or 1
  EXPECT_GT(differences(intersect(a, complement(a)), volume::Grid()), 100U);
  EXPECT_GT(differences(complement(complement(a)), a), 100U); // 1 - (1 - a) is rounded
}

TEST_P(CsgAlgebra, AddThenSubtractGivesBackToOneRoundingWhereNothingWasClamped) {
  std::mt19937 random(static_cast<unsigned>(GetParam()) + 100);
  const volume::Grid x = random_grid(random, -0.5f, 1.5f), y = random_grid(random, 0, 3);
  const volume::Grid sum = combine(Op::add, {x, y}), back = combine(Op::subtract, {sum, y});
  constexpr double epsilon = std::numeric_limits<float>::epsilon();
  std::uint64_t checked = 0, clamped = 0, rounded = 0;
  for_voxels({x, y, back}, [&](const std::vector<float>& v) {
    const double error = std::fabs(static_cast<double>(v[2]) - static_cast<double>(v[0]));
    if (v[0] < 0) {
      clamped += error > 1e-6 ? 1 : 0; // control: the bound is broken where it may be
      return;
    }
    ++checked;
    rounded += error > 0 ? 1 : 0;
    ASSERT_LE(error, epsilon * (static_cast<double>(v[0]) + static_cast<double>(v[1])));
  });
  EXPECT_GT(checked, 1000U);
  EXPECT_GT(clamped, 1000U);
  EXPECT_GT(rounded, 100U); // the bound is about something
}

INSTANTIATE_TEST_SUITE_P(Random, CsgAlgebra, testing::Values(1, 2, 3, 4));

// ---- operands that are used up

/// Both ways must give the same: operands that live on and operands that are moved in.
TEST(CsgOwnership, OperandsThatAreMovedInGiveTheSame) {
  std::mt19937 random(5);
  for (int n = 0; n < 4; ++n)
    for (const Op operation : all_operations)
      for (unsigned moved = 1; moved < 8; ++moved) {
        std::vector<volume::Grid> keep;
        std::vector<std::uint64_t> digests;
        std::vector<volume::CsgOperand> operands;
        const bool canonical = n % 2 == 0;
        for (unsigned g = 0; g < 3; ++g) {
          const unsigned seed = static_cast<unsigned>(n) * 10 + g;
          const auto make = [&] {
            std::mt19937 own(seed);
            return canonical ? random_grid(own, 0.01f, 1) : random_grid(own);
          };
          keep.push_back(make());
          digests.push_back(keep.back().digest());
          operands.push_back({(moved >> g & 1) != 0 ? make() : keep.back(), ""});
        }
        volume::CsgReport shared_report, report;
        const volume::Grid shared = combine(operation, keep, &shared_report);
        const volume::Grid result =
            volume::csg(Context{}, operation, std::move(operands), {}, &report);
        ASSERT_EQ(result.digest(), shared.digest()) << n << " " << moved;
        EXPECT_EQ(report.leaves_computed, shared_report.leaves_computed);
        EXPECT_EQ(report.leaves_shared, shared_report.leaves_shared);
        EXPECT_EQ(report.leaves_constant, shared_report.leaves_constant);
        for (unsigned g = 0; g < 3; ++g)
          EXPECT_EQ(keep[g].digest(), digests[g]); // nobody's volume was written to
      }
}

TEST(CsgOwnership, UntouchedLeavesStayWhereTheyAre) {
  const auto big = [] {
    return voxelization::voxelize(Context{}, sphere_mesh(3, 40, {0, 0, 0}),
                                  volume::uniform_transform(1), {.samples = 2});
  };
  const auto small = [] {
    return voxelization::voxelize(Context{}, sphere_mesh(2, 4, {39, 0, 0}),
                                  volume::uniform_transform(1), {.samples = 2});
  };
  for (const bool moved : {true, false}) {
    volume::Grid a = big();
    const volume::Grid witness = moved ? volume::Grid() : a;
    std::vector<std::pair<Int3, const float*>> places;
    for (const volume::LeafView& leaf : a.leaves())
      places.emplace_back(leaf.origin, leaf.values);
    std::vector<volume::CsgOperand> operands;
    operands.push_back({std::move(a), "a"});
    operands.push_back({small(), "b"});
    volume::CsgReport report;
    const volume::Grid result = volume::csg(Context{}, Op::unite, std::move(operands), {}, &report);
    volume::GridAccessor accessor(result);
    std::size_t same = 0;
    for (const auto& [origin, values] : places) {
      float tile = 0;
      same += accessor.leaf_at(origin, tile).values == values ? 1 : 0;
    }
    EXPECT_LT(same, places.size()); // control: some were computed
    EXPECT_GE(same + 8, places.size());
    EXPECT_GE(report.leaves_shared, same);
  }
}

TEST(CsgOwnership, ResultsOfResultsOutliveTheirOperands) {
  std::mt19937 random(9);
  volume::Grid result = random_grid(random, 0, 1);
  volume::Grid plain = result;
  for (int n = 0; n < 5; ++n) {
    std::mt19937 next(static_cast<unsigned>(n) + 50);
    const volume::Grid other = random_grid(next, 0, 1);
    plain = combine(Op::unite, {plain, other});
    std::vector<volume::CsgOperand> operands;
    operands.push_back({std::move(result), ""});
    operands.push_back({other, ""});
    result = volume::csg(Context{}, Op::unite, std::move(operands));
  }
  EXPECT_EQ(result.digest(), plain.digest());
}

} // namespace
