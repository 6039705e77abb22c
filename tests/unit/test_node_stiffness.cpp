// K of a solid by its nodes: that of the elements, before and after cuts, and its factor, which
// follows them.

#include "cutting/cut.h"
#include "cutting/cut_solid.h"
#include "fem/model_stiffness.h"
#include "fem/solid_model.h"
#include "larger.h"
#include "linalg/factor.h"
#include "tet_fixtures.h"
#include "update/cut_stiffness.h"
#include "update/node_stiffness.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

namespace gewebe::test {
namespace {

model::Model block(bool quadratic, std::uint32_t cells = 6) {
  fem::SolidModelOptions options;
  options.material.materials = {{"gel", 1e-3, 20000, 1, 0.2, 0.45}};
  options.quadratic = quadratic;
  model::Model model = fem::solid_model(test::box_tetrahedra(cells, cells, cells, 2), options, {});
  for (std::uint32_t i = 0; i < model.nodes.size(); ++i) {
    const Vec3& p = model.nodes[i].position;
    model.nodes[i].fixed = p.x == 0                          ? model::fixed_all
                           : p.x < 5 && p.y == 0 && p.z == 0 ? model::fixed_y
                                                             : model::fixed_none;
  }
  return model;
}

/// The same numbers as in the matrix by rows.
void expect_like(const linalg::NodeMatrix& matrix, const model::Model& model, double tolerance) {
  const linalg::StiffnessMatrix k = fem::stiffness_matrix(model);
  ASSERT_EQ(matrix.nodes(), model.nodes.size());
  constexpr std::array<std::array<std::size_t, 3>, 3> entry{{{0, 1, 2}, {1, 3, 4}, {2, 4, 5}}};
  double largest = 0, worst = 0;
  std::size_t found = 0;
  for (std::size_t c = 0; c < k.order(); ++c)
    for (auto at = static_cast<std::size_t>(k.column_start[c]);
         at < static_cast<std::size_t>(k.column_start[c + 1]); ++at) {
      const auto column = static_cast<std::size_t>(k.axis_of_row[c]),
                 row = static_cast<std::size_t>(k.axis_of_row[static_cast<std::size_t>(k.row[at])]);
      const std::size_t i = row / 3, j = column / 3;
      double is = 0;
      if (i == j) {
        is = matrix.diagonal[i][entry[row % 3][column % 3]];
      } else {
        const auto begin = matrix.node.begin() + static_cast<std::ptrdiff_t>(matrix.start[i]),
                   end = matrix.node.begin() + static_cast<std::ptrdiff_t>(matrix.start[i + 1]);
        const auto arm = std::lower_bound(begin, end, static_cast<std::uint32_t>(j));
        ASSERT_TRUE(arm != end && *arm == j);
        const std::size_t n = static_cast<std::size_t>(arm - matrix.node.begin());
        is = matrix.block[matrix.at[n]][3 * (row % 3) + column % 3];
      }
      largest = test::larger(largest, std::abs(k.value[at]));
      worst = test::larger(worst, std::abs(k.value[at] - is));
      ++found;
    }
  EXPECT_GT(found, 1000U);
  EXPECT_LE(worst, tolerance * largest);
}

std::optional<cutting::CutModel> cut_at(const model::Model& model, const Vec3& place,
                                        const Vec3& normal, double radius) {
  std::vector<std::uint8_t> among(model.nodes.size());
  for (std::size_t i = 0; i < among.size(); ++i)
    among[i] = norm(model.nodes[i].position - place) <= radius;
  incision::BladeCutOptions options;
  options.among = among;
  cutting::SolidCut cut =
      cutting::cut_solid(model, cutting::plane_blade(model, {place, normal}), options);
  if (cut.report.doubled == 0)
    return std::nullopt;
  return cutting::as_cut_model(model, std::move(cut));
}

double error_of(const update::CutStiffness& stiffness, const model::Model& model) {
  std::vector<double> is(3 * model.nodes.size());
  for (std::size_t k = 0; k < is.size(); ++k)
    is[k] = static_cast<double>(k * 7 % 23) - 11;
  const std::vector<double> load = is;
  stiffness.compliance()->solve(is, 1);
  const linalg::StiffnessMatrix matrix = fem::stiffness_matrix(model);
  const linalg::Factor factor(matrix, {});
  std::vector<double> f, u(matrix.order());
  for (const std::int64_t axis : matrix.axis_of_row)
    f.push_back(load[static_cast<std::size_t>(axis)]);
  factor.solve(f, u, 1);
  double worst = 0, largest = 0;
  for (std::size_t k = 0; k < u.size(); ++k) {
    worst =
        test::larger(worst, std::abs(u[k] - is[static_cast<std::size_t>(matrix.axis_of_row[k])]));
    largest = test::larger(largest, std::abs(u[k]));
  }
  return worst / largest;
}

class NodeStiffness : public testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Orders, NodeStiffness, testing::Bool());

TEST_P(NodeStiffness, IsThatOfTheElements) {
  const model::Model model = block(GetParam(), 4);
  expect_like(update::node_stiffness(model), model, 1e-15);
}

TEST_P(NodeStiffness, ItsNormIsThatOfTheRowsAndNoNumberWhereOneIsNone) {
  const model::Model model = block(GetParam(), 4);
  linalg::NodeMatrix matrix = update::node_stiffness(model);
  const linalg::StiffnessMatrix k = fem::stiffness_matrix(model);
  std::vector<double> sums(3 * model.nodes.size());
  for (std::size_t c = 0; c < k.order(); ++c)
    for (auto at = static_cast<std::size_t>(k.column_start[c]);
         at < static_cast<std::size_t>(k.column_start[c + 1]); ++at) {
      const auto r = static_cast<std::size_t>(k.row[at]);
      sums[static_cast<std::size_t>(k.axis_of_row[r])] += std::abs(k.value[at]);
      if (r != c)
        sums[static_cast<std::size_t>(k.axis_of_row[c])] += std::abs(k.value[at]);
    }
  for (std::size_t i = 0; i < matrix.nodes(); ++i) {
    const double most = std::max({sums[3 * i], sums[3 * i + 1], sums[3 * i + 2]});
    ASSERT_NEAR(update::row_norm(matrix, i), most, 1e-13 * most) << i;
  }
  std::size_t last = 0;
  for (std::size_t i = 0; i < matrix.nodes(); ++i)
    if (matrix.fixed[i] == model::fixed_none)
      last = i;
  for (const std::size_t entry : {0U, 3U, 5U}) { // of one axis alone
    linalg::NodeMatrix spoilt = matrix;
    spoilt.diagonal[last][entry] = std::nan("");
    EXPECT_TRUE(std::isnan(update::row_norm(spoilt, last))) << entry;
  }
}

TEST_P(NodeStiffness, FollowsCuts) {
  model::Model model = block(GetParam(), 4);
  linalg::NodeMatrix matrix = update::node_stiffness(model);
  std::size_t cuts = 0;
  for (int k = 0; k < 6; ++k) {
    std::optional<cutting::CutModel> cut =
        cut_at(model, {3.1 + k, 8, 8 - 0.7 * k}, {1, 0.3 * k, 0.5}, 4.5);
    if (!cut)
      continue;
    ++cuts;
    const std::vector<std::uint32_t> rows = update::changed_rows(model, cut->model, cut->place);
    EXPECT_LT(rows.size(), cut->model.nodes.size() * 2 / 3);
    update::update_node_stiffness(matrix, cut->model, rows);
    model = std::move(cut->model);
    const linalg::NodeMatrix fresh = update::node_stiffness(model);
    EXPECT_EQ(matrix.start, fresh.start);
    EXPECT_EQ(matrix.node, fresh.node);
    EXPECT_EQ(matrix.diagonal, fresh.diagonal);
    EXPECT_EQ(matrix.fixed, fresh.fixed);
    for (std::size_t n = 0; n < matrix.node.size(); ++n)
      ASSERT_EQ(matrix.block[matrix.at[n]], fresh.block[fresh.at[n]]);
    EXPECT_LE(matrix.block.size(), 4 * fresh.block.size());
  }
  EXPECT_GE(cuts, 4U);
  expect_like(matrix, model, 1e-15);
}

TEST_P(NodeStiffness, ItsFactorFollowsCutsInPart) {
  auto model = std::make_shared<const model::Model>(block(GetParam(), GetParam() ? 4 : 8));
  update::CutStiffness stiffness(model, nullptr, {});
  const double size = GetParam() ? 8 : 16;
  std::size_t in_part = 0, cuts = 0;
  for (int k = 0; k < 12; ++k) {
    const double x = 2.6 + (size - 4) * (k * 5 % 12) / 12, y = size * (k * 7 % 12) / 12;
    std::optional<cutting::CutModel> cut =
        cut_at(*model, {x, y, size - 0.1}, {1, 0.2 * k - 1, 0.4}, 4.2);
    if (!cut || !cutting::free_parts(*model, *cut).parts.empty())
      continue;
    auto next = std::make_shared<const model::Model>(cut->model);
    const update::CutWork work = stiffness.cut(next, cut->origin, cut->place);
    in_part += work.way == update::CutWay::refactor &&
                       work.factor.operations < 0.95 * work.factor.all_operations
                   ? 1
                   : 0;
    ++cuts;
    model = next;
    EXPECT_LT(error_of(stiffness, *model), 1e-10);
  }
  EXPECT_GE(cuts, 6U);
  EXPECT_GE(in_part, cuts - 3); // of a small one the order is worn out now and then
}

TEST_P(NodeStiffness, ANewOrderIsCheaperThanTheOneThatIsWornOut) {
  auto model = std::make_shared<const model::Model>(block(GetParam(), GetParam() ? 4 : 8));
  update::CutStiffness stiffness(model, nullptr, {});
  stiffness.prepare();
  const double size = GetParam() ? 8 : 16;
  double before = 0; // operations of a whole factor
  for (int k = 0; k < 400; ++k) {
    const double x = 3 + (size - 5) * (k * 5 % 13) / 13, y = size * (k * 7 % 17) / 17,
                 z = size * (k * 3 % 11) / 11;
    std::optional<cutting::CutModel> cut =
        cut_at(*model, {x, y, z}, {1, 0.2 * (k % 9) - 1, 0.4}, 4.2);
    if (!cut || !cutting::free_parts(*model, *cut).parts.empty())
      continue;
    model = std::make_shared<const model::Model>(cut->model);
    const update::CutWork work = stiffness.cut(model, cut->origin, cut->place);
    if (work.way == update::CutWay::fresh) {
      EXPECT_GT(before, 0);
      EXPECT_LT(work.factor.all_operations, 0.8 * before);
      return;
    }
    before = work.factor.all_operations;
  }
  ADD_FAILURE() << "no order was worn out";
}

TEST_P(NodeStiffness, ItsFactorGoesOnWithoutAPiece) {
  auto model = std::make_shared<const model::Model>(block(GetParam(), 4));
  update::CutStiffness stiffness(model, nullptr, {});
  stiffness.prepare();
  cutting::SolidCut cut =
      cutting::cut_solid(*model, cutting::plane_blade(*model, {{5.2, 4, 4}, {1, 0.2, 0.1}}), {});
  cutting::CutModel step = cutting::as_cut_model(*model, std::move(cut));
  cutting::FreeParts parts = cutting::free_parts(*model, step);
  ASSERT_EQ(parts.parts.size(), 1U);
  step = cutting::without_parts(std::move(step), std::move(parts.rest));
  const auto next = std::make_shared<const model::Model>(step.model);
  (void)stiffness.cut(next, step.origin, step.place);
  EXPECT_LT(error_of(stiffness, *next), 1e-10);
  std::optional<cutting::CutModel> more = cut_at(*next, {2.4, 8, 8}, {1, 0.2, 0.5}, 4.5);
  ASSERT_TRUE(more.has_value());
  const auto last = std::make_shared<const model::Model>(more->model);
  (void)stiffness.cut(last, more->origin, more->place);
  EXPECT_LT(error_of(stiffness, *last), 1e-10);
}

/// Fronts of more rows than one thread is left alone with, computed again after a cut.
TEST(LargeFronts, FollowACutToTheSameBitsOnAnyThreads) {
  const auto model = std::make_shared<const model::Model>(block(false, 17));
  const std::optional<cutting::CutModel> cut = cut_at(*model, {17, 17, 17}, {1, 0.2, 0.1}, 4.5);
  ASSERT_TRUE(cut.has_value());
  const auto now = std::make_shared<const model::Model>(cut->model);
  std::vector<double> first;
  for (const int threads : {1, 2, 3}) {
    Context context;
    context.threads = threads;
    update::CutStiffness stiffness(model, nullptr, context);
    stiffness.prepare();
    const update::CutWork work = stiffness.cut(now, cut->origin, cut->place);
    EXPECT_EQ(work.way, update::CutWay::refactor);
    EXPECT_GT(work.factor.operations, 2e8);
    std::vector<double> u(3 * now->nodes.size());
    for (std::size_t k = 0; k < u.size(); ++k)
      u[k] = static_cast<double>(k * 7 % 23) - 11;
    stiffness.compliance()->solve(u, 1);
    if (first.empty())
      first = u;
    EXPECT_EQ(u, first) << threads;
  }
}

} // namespace
} // namespace gewebe::test
