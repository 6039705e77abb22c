// Caches of lib/compliance: answers to consecutive loads, and columns of the compliance matrix.

#include "columns/column_cache.h"
#include "compliance/compliance.h"
#include "compliance/load_answer.h"
#include "larger.h"
#include "sim_models.h"
#include "update/cut_stiffness.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <random>
#include <span>
#include <vector>

namespace gewebe::test {
namespace {

/// A ball of springs, and nodes of it that can move.
struct Organ {
  model::Model model = test::organ(2);
  std::vector<std::uint32_t> nodes = test::free_nodes(model);
};

contact::Load pulled(const std::vector<std::uint32_t>& nodes, std::size_t count,
                     const Vec3& gravity = {}) {
  contact::Load load;
  load.gravity = gravity;
  for (std::size_t k = 0; k < count; ++k)
    load.force[nodes[3 * k]] = {1.0 + static_cast<double>(k), -2, 0.5};
  return load;
}

/// Incremental sums accumulate rounding errors: a large force leaves an error that stays until the
/// sum is recomputed.
TEST(LoadAnswer, IsRecomputedAfterAThousandIncrements) {
  const Organ organ;
  compliance::Compliance compliance(organ.model, nullptr, test::one_thread(), false);
  compliance::LoadAnswer answer(organ.model, compliance);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> any(-1, 1);
  contact::Load load = pulled(organ.nodes, 5);
  (void)answer.whole(load);
  const auto as_fresh = [&] {
    return answer.whole(load) == compliance::LoadAnswer(organ.model, compliance).whole(load);
  };
  for (int change = 1; change <= 1000; ++change) {
    load.force[organ.nodes[0]] = {change == 1 ? 1e9 : any(random), any(random), any(random)};
    (void)answer.whole(load);
  }
  EXPECT_FALSE(as_fresh()); // still incremental
  load.force[organ.nodes[0]] = {any(random), any(random), any(random)};
  EXPECT_TRUE(as_fresh());
}

/// at_blocks() caches the answer to the load that the factor carries along.
TEST(LoadAnswer, CarriedLoadIsThatOfTheLastCall) {
  const Organ organ;
  update::CutStiffness stiffness(std::make_shared<const model::Model>(organ.model), nullptr,
                                 test::one_thread());
  stiffness.prepare();
  compliance::Compliance compliance(organ.model, stiffness.compliance(), test::one_thread(), false);
  ASSERT_TRUE(compliance.carries());
  compliance::LoadAnswer used(organ.model, compliance);
  const std::vector<std::uint32_t> nodes{organ.nodes[1], organ.nodes[7]};
  compliance.need_blocks(nodes);
  std::vector<std::size_t> rows;
  for (const std::uint32_t node : nodes)
    for (std::size_t axis = 0; axis < 3; ++axis)
      rows.push_back(3 * std::size_t{node} + axis);
  for (const std::size_t forces : {std::size_t{0}, std::size_t{2}, organ.nodes.size() / 3})
    for (const Vec3& gravity : {Vec3{0, 0, -10}, {7, 0, 0}, {}, {0, 3, 0}}) {
      const contact::Load load = pulled(organ.nodes, forces, gravity);
      const std::vector<double> found = used.at_blocks(load, rows);
      EXPECT_EQ(found, compliance::LoadAnswer(organ.model, compliance).at_blocks(load, rows));
      std::vector<double> expected;
      const std::vector<double> whole = compliance::LoadAnswer(organ.model, compliance).whole(load);
      double most = 0;
      for (const double u : whole)
        most = test::larger(most, std::abs(u));
      for (std::size_t k = 0; k < rows.size(); ++k)
        EXPECT_NEAR(found[k], whole[rows[k]], 1e-9 * most) << forces;
    }
}

/// Solves for unit vectors, and counts them.
struct Units {
  std::size_t nodes = 0, solved = 0;
  columns::ColumnSolve solve() {
    return [this](std::span<const std::uint32_t> of, std::span<double> columns) {
      solved += of.size();
      std::ranges::fill(columns, 0.0);
      for (std::size_t k = 0; k < of.size(); ++k)
        for (std::size_t a = 0; a < 3; ++a)
          columns[(3 * k + a) * 3 * nodes + 3 * std::size_t{of[k]} + a] = 1;
    };
  }
};

TEST(ColumnCache, EvictsTheLeastRecentlyUsedColumn) {
  Units units{6};
  columns::ColumnCache cache(6, nullptr, units.solve(), 3 * 24.0 * 18,
                             false); // three nodes' columns
  ASSERT_EQ(cache.capacity(), 3U);
  const auto need = [&](std::vector<std::uint32_t> nodes) { cache.need(nodes); };
  need({0});
  need({1});
  need({2});
  need({0}); // once more
  need({3});
  EXPECT_TRUE(cache.resident(0) && cache.resident(2) && cache.resident(3));
  EXPECT_FALSE(cache.resident(1));
  EXPECT_EQ(units.solved, 4U);
}

/// A call may not evict columns that it needs itself, even the oldest ones.
TEST(ColumnCache, NeededColumnsAreNotEvicted) {
  Units units{6};
  columns::ColumnCache cache(6, nullptr, units.solve(), 3 * 24.0 * 18, false);
  for (const std::uint32_t node : {0U, 1U, 2U})
    cache.need(std::span(&node, 1));
  const std::vector<std::uint32_t> wanted{0, 4, 5};
  cache.need(wanted);
  for (const std::uint32_t node : wanted) {
    ASSERT_TRUE(cache.resident(node)) << node;
    EXPECT_EQ(cache.entry(node, 1, 3 * std::size_t{node} + 1), 1);
  }
  EXPECT_EQ(units.solved, 5U);
}

} // namespace
} // namespace gewebe::test
