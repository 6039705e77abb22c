// Columns of a solid with rows for its surface alone: what is inside costs nothing, and is right
// where it is asked for.

#include "base/error.h"
#include "columns/column_compression.h"
#include "columns/compliance_columns.h"
#include "columns/verify.h"
#include "compliance/compliance.h"
#include "compliance/load_answer.h"
#include "compressed_source.h"
#include "fem/model_stiffness.h"
#include "fem/solid_model.h"
#include "larger.h"
#include "linalg/condition.h"
#include "scene/simulation.h"
#include "statics/elastostatic.h"
#include "statics/two_step.h"
#include "tet_fixtures.h"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <memory>
#include <numeric>
#include <random>
#include <span>
#include <utility>
#include <vector>

namespace gewebe::test {
namespace {

/// A box 2 × 2 × 2 whose inner nodes stand anywhere, held at z = 0.
model::Model box_model(double young = 5000) {
  fem::SolidModelOptions options;
  options.material.materials = {{"gel", 1.1e-3, young, 1, 0.2, 0.4}};
  model::Model model = fem::solid_model(test::distorted_box(), options, {});
  for (model::Node& node : model.nodes)
    if (node.position.z == 0)
      node.fixed = model::fixed_all;
  return model;
}

/// What compliance_columns gives, in memory.
class Kept final : public columns::ColumnSource, public columns::ColumnSink {
public:
  Kept(const model::Model& model, std::size_t rows, std::vector<std::uint32_t> nodes)
      : count_(model.nodes.size()), rows_(rows), nodes_(std::move(nodes)) {}
  std::size_t node_count() const override { return count_; }
  std::size_t row_nodes() const override { return rows_; }
  const std::vector<std::uint32_t>& nodes() const override { return nodes_; }
  void read(std::size_t k, std::span<double> out) const override {
    ASSERT_EQ(out.size(), kept[k].size());
    std::copy(kept[k].begin(), kept[k].end(), out.begin());
  }
  void write(std::size_t, std::span<const double> columns, double) override {
    kept.emplace_back(columns.begin(), columns.end());
  }
  std::vector<std::vector<double>> kept;

private:
  std::size_t count_, rows_;
  std::vector<std::uint32_t> nodes_;
};

std::vector<std::uint32_t> first_nodes(std::size_t count) {
  std::vector<std::uint32_t> nodes(count);
  std::iota(nodes.begin(), nodes.end(), 0U);
  return nodes;
}

/// Columns of all surface nodes with rows for so many.
std::unique_ptr<Kept> columns_of(const model::Model& model, std::size_t rows) {
  const linalg::StiffnessMatrix k = fem::stiffness_matrix(model);
  auto columns = std::make_unique<Kept>(model, rows, first_nodes(model::surface_count(model)));
  (void)columns::compliance_columns(k, linalg::Factor(k, {}), linalg::stiffness_norm(k),
                                    columns->nodes(), {}, *columns, rows);
  return columns;
}

std::shared_ptr<compliance::ComplianceSource> stored(const model::Model& model, std::size_t rows,
                                                     double wrong = 1) {
  auto columns = columns_of(model, rows);
  for (double& entry : columns->kept.back())
    entry *= wrong;
  return compliance::compliance_of_store(
      {std::move(columns),
       [&model] { return linalg::Factor(fem::stiffness_matrix(model), Context{}); }});
}

std::shared_ptr<compliance::ComplianceSource> surface_of(const model::Model& model,
                                                         double wrong = 1) {
  return stored(model, model::surface_count(model), wrong);
}

double largest(std::span<const double> values) {
  double most = 0;
  for (const double x : values)
    most = test::larger(most, std::abs(x));
  return most;
}

void expect_near(std::span<const double> a, std::span<const double> b, double tolerance,
                 const char* what) {
  ASSERT_LE(a.size(), b.size()) << what;
  double difference = 0;
  for (std::size_t r = 0; r < a.size(); ++r)
    difference = test::larger(difference, std::abs(a[r] - b[r]));
  EXPECT_LE(difference, tolerance * largest(b)) << what;
}

/// Nodes that can move: of the surface (some at its top), and inside.
struct Places {
  std::vector<std::uint32_t> outer, inner;
};
Places places_of(const model::Model& model) {
  Places places;
  for (std::uint32_t i = 0; i < model.nodes.size(); ++i)
    if (model.nodes[i].fixed == model::fixed_none)
      (i < model::surface_count(model) ? places.outer : places.inner).push_back(i);
  return places;
}

TEST(SurfaceRows, AreTheFirstOfAllRows) {
  const model::Model model = box_model();
  const std::size_t surface = model::surface_count(model), n = model.nodes.size();
  ASSERT_LT(surface + 20, n);
  const auto some = columns_of(model, surface), all = columns_of(model, n);
  for (std::size_t k = 0; k < some->kept.size(); ++k) {
    ASSERT_EQ(some->kept[k].size(), 9 * surface);
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (std::size_t r = 0; r < 3 * surface; ++r)
        ASSERT_EQ(some->kept[k][axis * 3 * surface + r], all->kept[k][axis * 3 * n + r]);
  }
}

TEST(SurfaceRows, AreTheInverseOfTheCondensedStiffness) {
  const model::Model model = box_model();
  const linalg::StiffnessMatrix k = fem::stiffness_matrix(model);
  const auto n = static_cast<Eigen::Index>(k.order());
  const std::size_t axes = 3 * model::surface_count(model);
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(n, n);
  for (std::size_t c = 0; c < k.order(); ++c)
    for (auto at = k.column_start[c]; at < k.column_start[c + 1]; ++at) {
      const auto r = k.row[static_cast<std::size_t>(at)], column = static_cast<std::int64_t>(c);
      dense(r, column) = dense(column, r) = k.value[static_cast<std::size_t>(at)];
    }
  Eigen::Index outer = 0; // rows of the surface come first
  while (outer < n &&
         static_cast<std::size_t>(k.axis_of_row[static_cast<std::size_t>(outer)]) < axes)
    ++outer;
  const Eigen::Index inner = n - outer;
  const Eigen::MatrixXd condensed =
      dense.topLeftCorner(outer, outer) -
      dense.topRightCorner(outer, inner) *
          dense.bottomRightCorner(inner, inner).llt().solve(dense.bottomLeftCorner(inner, outer));
  const auto columns = columns_of(model, model::surface_count(model));
  Eigen::MatrixXd compliance(outer, outer);
  for (Eigen::Index c = 0; c < outer; ++c)
    for (Eigen::Index r = 0; r < outer; ++r) {
      const auto of = static_cast<std::size_t>(k.axis_of_row[static_cast<std::size_t>(c)]);
      const auto at = static_cast<std::size_t>(k.axis_of_row[static_cast<std::size_t>(r)]);
      compliance(r, c) = columns->kept[of / 3][of % 3 * axes + at];
    }
  const Eigen::MatrixXd one = condensed * compliance;
  EXPECT_LT((one - Eigen::MatrixXd::Identity(outer, outer)).lpNorm<Eigen::Infinity>(), 1e-10);
}

TEST(SurfaceRows, AreVerified) {
  const model::Model model = box_model();
  const linalg::StiffnessMatrix k = fem::stiffness_matrix(model);
  linalg::StiffnessCheck check;
  const linalg::Factor factor = linalg::checked_factor(model, k, {}, check);
  const columns::VerifyOptions options{.condition = check.condition};
  auto columns = columns_of(model, model::surface_count(model));
  EXPECT_EQ(columns::verify_compliance(k, factor, columns.get(), options, {}).recomputed, 3U);
  // The last row of one that is solved for again.
  columns->kept[columns->kept.size() / 2].back() += 1e-6 * largest(columns->kept.back());
  EXPECT_THROW((void)columns::verify_compliance(k, factor, columns.get(), options, {}), Error);
}

/// Loads of each kind, one after the other.
std::vector<contact::Load> loads_of(const model::Model& model) {
  const Places at = places_of(model);
  std::vector<contact::Load> loads(9);
  const auto push = [](std::size_t k) {
    return Vec3{1.0 + static_cast<double>(k), -2, 3 - static_cast<double>(k)};
  };
  for (std::size_t k = 0; k < 4; ++k)
    loads[0].force[at.outer[7 * k]] = push(k);
  loads[1] = loads[0];
  loads[1].gravity = {0, 50, -9810};
  for (std::size_t k = 0; k < 8; ++k)
    loads[2].displacement[at.outer[5 * k]] = 0.01 * push(k);
  loads[3] = loads[2];
  loads[3].force[at.outer[3]] = {5, 6, 7};
  loads[3].gravity = {0, 0, -9810};
  loads[4] = loads[3];
  loads[4].force[at.inner[2]] = {-50, 6, 70}; // inside
  loads[5] = loads[3];
  loads[5].displacement[at.inner[1]] = {0.01, 0, 0.02};
  loads[5].displacement[at.inner[9]] = {0, 0.01, 0};
  loads[5].force[at.inner[2]] = {50, 6, 7};
  loads[6].displacement[at.inner[1]] = {0.01, 0, 0.02};
  loads[7] = loads[2];
  for (auto& [node, d] : loads[7].displacement)
    d = {0.01, 0.02, 0.03}; // one by one alike
  for (const std::uint32_t node : at.outer)
    loads[8].displacement[node] = {0.01, 0.02, 0.03};
  return loads;
}

TEST(SurfaceRows, GiveWhatAllRowsGive) {
  const model::Model model = box_model();
  for (const std::size_t limit : {SIZE_MAX, std::size_t{0}}) {
    const statics::ElastostaticOptions options{.measure_error = true, .block_limit = limit};
    statics::Elastostatic some(model, surface_of(model), {}, options);
    statics::Elastostatic never(model, surface_of(model), {},
                                {.block_limit = limit}); // asked for the whole
    statics::Elastostatic all(model, nullptr, {}, options);
    const std::size_t rows = 3 * model::surface_count(model);
    int number = 0;
    for (const contact::Load& load : loads_of(model)) {
      SCOPED_TRACE(number++);
      some.update(load);
      never.update(load);
      all.update(load);
      ASSERT_EQ(some.contact_forces().size(), all.contact_forces().size());
      for (std::size_t k = 0; k < all.contact_forces().size(); ++k)
        for (int a = 0; a < 3; ++a)
          EXPECT_NEAR(some.contact_forces()[k].value[a], all.contact_forces()[k].value[a], 1e-7);
      ASSERT_EQ(some.displacement().size(), 3 * model.nodes.size());
      ASSERT_EQ(some.surface_displacement().size(), rows);
      expect_near(some.displacement(), all.displacement(), 1e-10, "whole");
      expect_near(some.surface_displacement(), all.displacement(), 1e-10, "surface");
      const auto a = never.surface_displacement(), b = some.surface_displacement();
      EXPECT_TRUE(std::equal(a.begin(), a.end(), b.begin())); // whoever asked for more
      for (const auto& [node, d] : load.displacement)
        for (int axis = 0; axis < 3; ++axis)
          EXPECT_EQ(some.displacement()[3 * std::size_t{node} + static_cast<std::size_t>(axis)],
                    d[axis]);
    }
    EXPECT_LT(some.counts().backward_error, 1e-10);
    EXPECT_EQ(some.counts().shape_error, 0);
  }
}

/// Compressed columns which say of themselves `claimed` times the bound that they have.
std::shared_ptr<compliance::ComplianceSource> compressed(const model::Model& model, double relative,
                                                         std::size_t step = 1, double claimed = 1) {
  columns::CompressedMade made = test::compressed_surface(model, relative, step);
  made.layout.bound *= claimed;
  return test::compressed(model, std::move(made));
}

// Nodes with columns, without, and inside, in all mixtures.
TEST(SurfaceRows, OfCompressedColumnsGiveWhatAllRowsGive) {
  const model::Model model = box_model();
  const std::size_t surface = model::surface_count(model);
  for (const std::size_t step : {1U, 2U})
    for (const std::size_t limit : {SIZE_MAX, std::size_t{0}}) {
      const statics::ElastostaticOptions options{.block_limit = limit};
      statics::Elastostatic some(model, compressed(model, 1e-7, step), {}, options);
      statics::Elastostatic all(model, nullptr, {}, options);
      int number = 0;
      for (const contact::Load& load : loads_of(model)) {
        SCOPED_TRACE(number++);
        some.update(load);
        all.update(load);
        expect_near(some.surface_displacement(), all.displacement(), 1e-5, "surface");
        ASSERT_EQ(some.surface_displacement().size(), 3 * surface);
        expect_near(some.displacement(), all.displacement(), 1e-5, "whole");
        const std::vector<std::uint32_t> touched{
            places_of(model).outer[1], places_of(model).outer[4], places_of(model).inner[3]};
        const statics::DelassusOperator a = some.delassus_operator(load, touched),
                                        b = all.delassus_operator(load, touched);
        expect_near(a.compliance, b.compliance, 1e-5, "compliance");
      }
    }
}

// Of sets that share nodes, one behind the other, and of each of them alone.
TEST(SurfaceRows, DelassusOperatorsDoNotDependOnThoseBefore) {
  const model::Model model = box_model();
  const std::vector<std::uint32_t> at = places_of(model).outer;
  ASSERT_GT(at.size(), 9);
  for (const bool stored : {false, true}) {
    const auto source = [&] { return stored ? compressed(model, 1e-6) : nullptr; };
    statics::Elastostatic one(model, source(), {});
    for (const std::vector<std::size_t>& set : {std::vector<std::size_t>{1, 3, 5},
                                                {3, 5, 7, 8},
                                                {3, 5, 7, 8},
                                                {0, 1, 8},
                                                {0, 8},
                                                {2, 4}}) {
      std::vector<std::uint32_t> nodes;
      for (const std::size_t k : set)
        nodes.push_back(at[k]);
      std::ranges::sort(nodes);
      statics::Elastostatic alone(model, source(), {});
      EXPECT_EQ(one.delassus_operator({}, nodes).compliance,
                alone.delassus_operator({}, nodes).compliance);
    }
  }
}

TEST(SurfaceRows, OfCompressedColumnsHaveBlocksWithTheInside) {
  const model::Model model = box_model();
  compliance::Compliance some(model, compressed(model, 1e-7), {}, false),
      all(model, nullptr, {}, false);
  const Places at = places_of(model);
  const std::vector<std::uint32_t> nodes{at.outer[2], at.outer[20], at.inner[1], at.inner[7]};
  for (compliance::Compliance* const compliance : {&some, &all}) {
    compliance->need(nodes);
    compliance->need_blocks(nodes);
  }
  const double size = all.block(nodes[3], nodes[3])[0][0];
  ASSERT_GT(size, 0);
  for (const std::uint32_t node : nodes)
    for (const std::uint32_t other : nodes)
      for (int a = 0; a < 3; ++a)
        for (std::size_t b = 0; b < 3; ++b) {
          const double expected = all.block(node, other)[static_cast<std::size_t>(a)][b];
          EXPECT_NEAR(some.block(node, other)[static_cast<std::size_t>(a)][b], expected,
                      1e-5 * size);
          EXPECT_NEAR(some.entry(node, a, 3 * std::size_t{other} + b), expected, 1e-5 * size);
        }
}

TEST(SurfaceRows, OfCompressedColumnsCostNoSolveUntilTheInsideIsAskedFor) {
  const model::Model model = box_model();
  statics::Elastostatic object(model, compressed(model, 1e-4), {});
  const std::vector<contact::Load> loads = loads_of(model);
  for (const std::size_t k : {0U, 2U, 7U, 2U}) {
    object.update(loads[k]);
    (void)object.surface_displacement();
  }
  EXPECT_EQ(object.counts().solves, 0U);
  EXPECT_EQ(object.counts().factors, 0U);
  (void)object.displacement();
  EXPECT_EQ(object.counts().solves, 1U);
}

TEST(SurfaceRows, InnerNodesFollowAChangeOfGravity) {
  const model::Model model = box_model();
  statics::Elastostatic some(model, surface_of(model), {}), all(model, nullptr, {});
  compliance::Compliance compliance(model, surface_of(model), {}, false);
  compliance::LoadAnswer answer(model, compliance);
  const Places at = places_of(model);
  const std::vector<std::size_t> rows{3 * std::size_t{at.inner[2]},
                                      3 * std::size_t{at.inner[2]} + 2,
                                      3 * std::size_t{at.outer[3]} + 1};
  contact::Load load;
  load.force[at.outer[5]] = {0, 3, 1};
  for (const Vec3& gravity : {Vec3{0, 0, -100}, {50, 0, 0}, {}, {0, 0, -100}}) {
    load.gravity = gravity;
    some.update(load);
    all.update(load);
    const std::span<const double> expected = all.displacement();
    expect_near(some.displacement(), expected, 1e-9, "shape");
    const std::vector<double> found = answer.at(load, rows);
    for (std::size_t k = 0; k < rows.size(); ++k)
      EXPECT_NEAR(found[k], expected[rows[k]], 1e-9 * largest(expected));
  }
}

TEST(SurfaceRows, CostNoSolveUntilTheInsideIsAskedFor) {
  const model::Model model = box_model();
  statics::Elastostatic object(model, surface_of(model), {});
  const std::vector<contact::Load> loads = loads_of(model);
  for (const std::size_t k : {0U, 2U, 7U, 2U}) {
    object.update(loads[k]);
    (void)object.surface_displacement();
    (void)object.delassus_operator(loads[k], std::vector<std::uint32_t>{places_of(model).outer[1]});
  }
  EXPECT_EQ(object.counts().solves, 0U);
  EXPECT_EQ(object.counts().factors, 0U);
  (void)object.displacement();
  (void)object.displacement();
  EXPECT_EQ(object.counts().solves, 1U);
  EXPECT_EQ(object.counts().factors, 1U);
}

TEST(SurfaceRows, OfContactAreTheSame) {
  const model::Model model = box_model();
  const Places at = places_of(model);
  const std::vector<std::uint32_t> touched{at.outer[1], at.outer[4], at.outer[30]};
  for (const std::size_t limit : {SIZE_MAX, std::size_t{0}}) {
    statics::Elastostatic some(model, surface_of(model), {}, {.block_limit = limit}),
        all(model, nullptr, {}, {.block_limit = limit});
    for (const std::size_t k : {1U, 3U, 4U, 5U}) {
      const contact::Load load = loads_of(model)[k];
      const statics::DelassusOperator a = some.delassus_operator(load, touched),
                                      b = all.delassus_operator(load, touched);
      expect_near(a.compliance, b.compliance, 1e-10, "compliance");
      expect_near(a.free, b.free, 1e-9, "free");
    }
  }
}

TEST(SurfaceRows, ThatAreWrongAreMeasured) {
  const model::Model model = box_model();
  statics::Elastostatic object(model, surface_of(model, 1.001), {}, {.measure_error = true});
  contact::Load load;
  load.force[static_cast<std::uint32_t>(model::surface_count(model) - 1)] = {1, 2, 3};
  object.update(load);
  (void)object.surface_displacement();
  EXPECT_GT(object.counts().backward_error, 1e-5);
  EXPECT_FALSE(object.counts().worst_shape.within());
  EXPECT_EQ(object.counts().worst_shape.limit, 1e-6);
  EXPECT_EQ(object.counts().worst_shape.relative, 0);
}

// A shape may be wrong by what the bound allows under its own forces, and not by more.
TEST(SurfaceRows, OfCompressedColumnsAreAsWrongAsTheirBoundSays) {
  const model::Model model = box_model();
  const auto worst = [&](double relative, double claimed) {
    statics::Elastostatic object(model, compressed(model, relative, 1, claimed), {},
                                 {.measure_error = true});
    for (const contact::Load& load : loads_of(model)) {
      object.update(load);
      (void)object.surface_displacement();
    }
    return object.counts().worst_shape;
  };
  for (const double relative : {1e-2, 1e-4}) {
    const statics::ShapeError good = worst(relative, 1);
    EXPECT_TRUE(good.within()) << good.error << " > " << good.limit;
    EXPECT_EQ(good.relative, relative);
    EXPECT_GT(good.limit, 1e-6);
    EXPECT_GT(good.error, relative / 100);
    EXPECT_FALSE(worst(relative, 1e-3).within()) << relative;
  }
}

TEST(SurfaceRows, OfOtherNodesAreRefused) {
  const model::Model model = box_model();
  EXPECT_THROW(statics::Elastostatic(model, stored(model, model::surface_count(model) - 1), {}),
               Error);
  EXPECT_THROW(statics::Elastostatic(model, stored(model, model::surface_count(model) + 1), {}),
               Error);
  EXPECT_NO_THROW(statics::Elastostatic(model, stored(model, model.nodes.size()), {}));
}

TEST(SurfaceRows, OfTwoStagesAreTheSame) {
  const model::Model soft = box_model(), stiff = box_model(20000);
  statics::Elastostatic some(soft, surface_of(soft), {}), all(soft, nullptr, {});
  const statics::TwoStepOptions options{.threshold = 3, .series = true};
  statics::TwoStep two_some(soft, surface_of(stiff), {}, options),
      two_all(soft, compliance::compliance_of_factor([&] {
                return linalg::Factor(fem::stiffness_matrix(stiff), {});
              }),
              {}, options);
  for (const std::size_t k : {0U, 2U, 3U, 5U}) {
    const contact::Load load = loads_of(soft)[k];
    two_some.update(some, load);
    two_all.update(all, load);
    EXPECT_GT(two_some.load(), options.threshold);
    const std::span<const double> surface = two_some.surface_displacement(some);
    ASSERT_EQ(surface.size(), 3 * model::surface_count(soft));
    expect_near(surface, two_all.displacement(all), 1e-9, "surface");
    ASSERT_EQ(two_some.displacement(some).size(), 3 * soft.nodes.size());
    expect_near(two_some.displacement(some), two_all.displacement(all), 1e-9, "whole");
  }
}

TEST(SurfaceRows, OfASceneGiveItsWholeShapeWhenAsked) {
  const model::Model model = box_model();
  const std::size_t n = model.nodes.size(), surface = model::surface_count(model);
  const std::uint32_t inside = places_of(model).inner[4];
  scene::Simulation some({}, {}), never({}, {}), all({}, {});
  some.add_object("o", model, scene::Method::ffe, surface_of(model));
  never.add_object("o", model, scene::Method::ffe, surface_of(model));
  all.add_object("o", model, scene::Method::ffe, nullptr);
  EXPECT_EQ(some.surface_nodes(0), surface);
  const auto both = [&](const scene::Change& change) {
    for (scene::Simulation* const s : {&some, &never, &all})
      s->apply(change);
  };
  const auto compare = [&](const char* what, double tolerance) {
    for (scene::Simulation* const s : {&some, &never, &all})
      s->step(0.01);
    ASSERT_EQ(some.displacement(0).size(), 3 * n);
    EXPECT_GT(largest(some.displacement(0)), 0);
    expect_near(some.displacement(0), all.displacement(0), tolerance, what);
    expect_near(some.surface_displacement(0), all.displacement(0), tolerance, what);
    const auto a = never.surface_displacement(0), b = some.surface_displacement(0);
    ASSERT_EQ(a.size(), b.size());
    EXPECT_TRUE(std::equal(a.begin(), a.end(), b.begin())) << what;
  };
  both(scene::SetForce{0, {places_of(model).outer[9]}, {3, 4, 5}});
  compare("force", 1e-10);
  both(scene::SetForce{0, {inside}, {30, 4, 5}});
  compare("a force inside", 1e-10);
  // A ball pressed into its top: contact needs the surface alone.
  both(scene::SetInstrument{0, {0.8, {}, 0.2}, {{1, 1, 3}, {}}, "ball"});
  compare("a ball above", 1e-10);
  both(scene::MoveInstrument{0, {1, 1, 2.6}, {}, 0});
  // Rounding differs, so that contact is solved to its own tolerance alike, not to the bit: without
  // friction to 1e-4, with it to its last change, which is of 1e-3 of a force.
  constexpr double contact_met = 2e-3;
  compare("a ball presses", contact_met);
  ASSERT_GT(some.instrument(0).nodes, 2U);
  both(scene::Grasp{0, {inside}, 0});
  both(scene::MoveInstrument{0, {1.1, 1, 2.7}, {}, 0});
  compare("a node inside follows it", contact_met);
  const std::uint64_t solves = never.counts().elastostatic.solves;
  EXPECT_GT(some.counts().elastostatic.solves, solves);
}

TEST(SurfaceRows, OfASceneCostNoSolve) {
  const model::Model model = box_model();
  scene::Simulation scene({}, {});
  scene.add_object("o", model, scene::Method::ffe, surface_of(model));
  scene.apply(scene::Emit{.surfaces = true});
  scene.apply(scene::SetInstrument{0, {0.8, {}, 0.2}, {{1, 1, 2.7}, {}}, "ball"});
  for (int k = 0; k < 5; ++k) {
    scene.apply(scene::MoveInstrument{0, {1 + 0.01 * k, 1, 2.6}, {}, 0});
    scene.step(0.01);
    ASSERT_EQ(scene.surface_displacement(0).size(), 3 * model::surface_count(model));
  }
  EXPECT_GT(scene.instrument(0).nodes, 2U);
  EXPECT_EQ(scene.counts().elastostatic.solves, 0U);
  EXPECT_EQ(scene.counts().elastostatic.factors, 0U);
  scene.apply(scene::Emit{}); // all nodes
  scene.apply(scene::MoveInstrument{0, {1, 1, 2.5}, {}, 0});
  scene.step(0.01);
  EXPECT_GT(scene.counts().elastostatic.solves, 0U);
}

} // namespace
} // namespace gewebe::test
