// The stiffness of an object that is cut: whichever way it is followed, equal to a fresh one.

#include "update/cut_stiffness.h"

#include "compliance/axis_solver.h"
#include "cutting/cut_select.h"
#include "fem/model_stiffness.h"
#include "linalg/condition.h"
#include "mesh_fixtures.h"
#include "random_cuts.h"
#include "relative_difference.h"
#include "stiffness_models.h"
#include "tests/bench/memory_columns.h"

#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <random>

using namespace gewebe;
using namespace gewebe::test;

namespace {

std::shared_ptr<const model::Model> round_organ(int rounds) {
  return std::make_shared<const model::Model>(model_of(sphere_mesh(rounds, 20, {1, 2, 3})));
}

/// One that opens the surface.
cutting::CutModel opened(const model::Model& model, double length) {
  const cutting::SweptQuad area =
      blade_at(model, 100, 0.3, length * mean_edge(model), mean_edge(model));
  return cutting::cut_model(model, cutting::swept_cut(model, {}, std::span(&area, 1)));
}

std::vector<double> fresh(const model::Model& model, std::vector<double> f) {
  const compliance::AxisSolver solver = compliance::factorise_axes(model, Context{});
  solver.solve(f, f.size() / (3 * model.nodes.size()));
  return f;
}

} // namespace

TEST(CutStiffness, EveryWayIsThatOfAFreshFactor) {
  for (const update::CutWay way :
       {update::CutWay::woodbury, update::CutWay::refactor, update::CutWay::fresh}) {
    const auto model = round_organ(4);
    update::CutStiffness stiffness(model, nullptr, Context{});
    stiffness.prepare();
    cutting::CutModel cut = opened(*model, 5);
    ASSERT_GT(cut.doubled, 0u);
    const auto now = std::make_shared<const model::Model>(std::move(cut.model));
    const update::CutWork work = stiffness.cut(now, cut.origin, cut.place, way);
    EXPECT_EQ(work.way, way);
    const std::vector<double> f = random_vector(3 * now->nodes.size(), 1);
    std::vector<double> u = f;
    stiffness.compliance()->solve(u, 1);
    EXPECT_LT(relative_difference(u, fresh(*now, f)), 1e-8);
  }
}

TEST(CutStiffness, ManyCutsInARow) {
  auto model = round_organ(3);
  update::CutStiffness stiffness(model, nullptr, Context{});
  std::mt19937 random(3);
  int corrected = 0, refactored = 0;
  for (int done = 0; done < 25;) {
    std::optional<cutting::CutModel> next = random_cut(*model, random, 6);
    if (!next)
      continue;
    auto now = std::make_shared<const model::Model>(std::move(next->model));
    const std::vector<double> f = random_vector(3 * now->nodes.size(), 2);
    std::vector<double> expected;
    try {
      expected = fresh(*now, f);
    } catch (const linalg::SingularStiffness&) {
      continue;
    }
    // On so few nodes a refactorisation is always cheaper.
    const update::CutWork work =
        stiffness.cut(now, next->origin, next->place,
                      done % 3 == 0 ? std::optional(update::CutWay::woodbury) : std::nullopt);
    corrected += work.way == update::CutWay::woodbury ? 1 : 0;
    refactored += work.way == update::CutWay::refactor ? 1 : 0;
    std::vector<double> u = f;
    stiffness.compliance()->solve(u, 1);
    ASSERT_LT(relative_difference(u, expected), 1e-8) << done;
    model = now;
    ++done;
  }
  EXPECT_GT(corrected, 0);
  EXPECT_GT(refactored, 0);
}

TEST(CutStiffness, ColumnsOfTheFirstModelServeTheCutOne) {
  const auto model = round_organ(4);
  const linalg::StiffnessMatrix matrix = fem::stiffness_matrix(*model);
  const linalg::FactorData factor = linalg::Factor(matrix, {}).data();
  update::CutStiffness stiffness(model,
                                 compliance::compliance_of_store(timing::memory_stiffness(
                                     matrix, factor, {3, 500, 1000}, false)),
                                 Context{});
  cutting::CutModel cut = opened(*model, 4);
  const auto now = std::make_shared<const model::Model>(std::move(cut.model));
  (void)stiffness.cut(now, cut.origin, cut.place);
  const std::shared_ptr<compliance::ComplianceSource> compliance = stiffness.compliance();
  const columns::ColumnSource* const stored = compliance->columns();
  ASSERT_NE(stored, nullptr);
  EXPECT_FALSE(stored->pays(1)) << "one node is solved for";
  for (std::size_t k = 0; k < stored->nodes().size(); ++k) {
    std::vector<double> columns(9 * now->nodes.size()), right(columns.size(), 0);
    stored->read(k, columns);
    for (std::size_t a = 0; a < 3; ++a)
      right[a * 3 * now->nodes.size() + 3 * std::size_t{stored->nodes()[k]} + a] = 1;
    EXPECT_LT(relative_difference(columns, fresh(*now, right)), 1e-9) << k;
  }
  EXPECT_TRUE(stored->pays(1)) << "now that the responses are there";
}

TEST(CutStiffness, NamesWhatMovesFreely) {
  // A node that hangs at one spring, with its tension: nothing holds it across.
  const auto model = round_organ(3);
  update::CutStiffness stiffness(model, nullptr, Context{});
  cutting::Cut cut;
  bool one = true;
  for (std::size_t e = 0; e < model->springs.size(); ++e)
    if (model->springs[e].i == 40 || model->springs[e].j == 40) {
      if (!one)
        cut.springs.push_back(e);
      one = false;
    }
  cutting::CutModel next = cutting::cut_model(*model, cut);
  const auto now = std::make_shared<const model::Model>(std::move(next.model));
  try {
    (void)stiffness.cut(now, next.origin, next.place);
    FAIL() << "node 40 can move";
  } catch (const linalg::SingularStiffness& error) {
    EXPECT_NE(std::string(error.what()).find("40"), std::string::npos) << error.what();
  }
}

TEST(CutStiffness, WhatWasHandedOutBeforeGivesTheSameBits) {
  const auto model = round_organ(3);
  for (const int cuts : {1, 2}) {
    update::CutStiffness stiffness(model, nullptr, Context{});
    stiffness.prepare();
    std::shared_ptr<const model::Model> now = model;
    if (cuts == 2) { // before the one that changes the factor
      cutting::CutModel cut = opened(*now, 2);
      now = std::make_shared<const model::Model>(std::move(cut.model));
      (void)stiffness.cut(now, cut.origin, cut.place, update::CutWay::refactor);
    }
    const update::CutStiffness copy = stiffness;
    const std::shared_ptr<compliance::ComplianceSource> before = copy.compliance();
    const auto answer = [&](compliance::ComplianceSource& source, std::size_t nodes) {
      std::vector<double> f(3 * nodes, 1);
      source.solve(f, 1);
      return f;
    };
    const std::vector<double> expected = answer(*before, now->nodes.size());
    cutting::CutModel cut = opened(*now, 4);
    const auto next = std::make_shared<const model::Model>(std::move(cut.model));
    (void)stiffness.cut(next, cut.origin, cut.place, update::CutWay::refactor);
    const std::vector<double> behind = answer(*stiffness.compliance(), next->nodes.size());
    EXPECT_EQ(answer(*before, now->nodes.size()), expected);
    EXPECT_EQ(answer(*copy.compliance(), now->nodes.size()), expected);
    EXPECT_EQ(answer(*stiffness.compliance(), next->nodes.size()), behind);
  }
}

TEST(CutStiffness, RepeatedIsTheSameToTheBit) {
  std::vector<double> first;
  for (const int threads : {1, 2, 1}) {
    Context context;
    context.threads = threads;
    auto model = round_organ(3);
    update::CutStiffness stiffness(model, nullptr, context);
    if (threads == 2)
      stiffness.prepare(); // announced or not
    std::mt19937 random(5);
    for (int done = 0; done < 6;) {
      std::optional<cutting::CutModel> next = random_cut(*model, random, 4);
      if (!next)
        continue;
      model = std::make_shared<const model::Model>(std::move(next->model));
      (void)stiffness.cut(model, next->origin, next->place);
      ++done;
    }
    std::vector<double> u = random_vector(3 * model->nodes.size(), 4);
    stiffness.compliance()->solve(u, 1);
    if (first.empty())
      first = u;
    ASSERT_EQ(u.size(), first.size());
    EXPECT_EQ(std::memcmp(u.data(), first.data(), 8 * u.size()), 0) << threads;
  }
}
