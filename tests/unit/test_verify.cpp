// The second opinion: it agrees with what is right and finds what is wrong.

#include "columns/verify.h"

#include "columns/compliance_columns.h"
#include "fem/model_stiffness.h"
#include "larger.h"
#include "linalg/condition.h"
#include "stiffness_models.h"

#include <gtest/gtest.h>

using namespace gewebe;
using namespace gewebe::test;

namespace {

/// Columns of some nodes in memory.
class Kept final : public columns::ColumnSink, public columns::ColumnSource {
public:
  Kept(std::size_t count, std::vector<std::uint32_t> nodes)
      : count_(count), nodes_(std::move(nodes)) {}
  void write(std::size_t, std::span<const double> columns, double) override {
    kept.emplace_back(columns.begin(), columns.end());
  }
  std::size_t node_count() const override { return count_; }
  const std::vector<std::uint32_t>& nodes() const override { return nodes_; }
  void read(std::size_t k, std::span<double> out) const override {
    std::copy(kept[k].begin(), kept[k].end(), out.begin());
  }
  std::vector<std::vector<double>> kept;

private:
  std::size_t count_;
  std::vector<std::uint32_t> nodes_;
};

struct Solved {
  model::Model model = model_of(ball(2));
  linalg::StiffnessMatrix matrix = fem::stiffness_matrix(model);
  linalg::StiffnessCheck check;
  linalg::Factor factor = linalg::checked_factor(model, matrix, {}, check);
  Kept columns{model.nodes.size(), {0, 5, 17, 40, 41}};
  Solved() {
    (void)columns::compliance_columns(matrix, factor, check.norm, columns.nodes(), {}, columns);
  }
  columns::Verification verify(const columns::ColumnSource* source, bool single = false) const {
    return columns::verify_compliance(matrix, factor, source,
                                      {.condition = check.condition, .single = single}, {});
  }
};

TEST(Verify, AgreesWithColumnsAndFactor) {
  const Solved s;
  const columns::Verification stored = s.verify(&s.columns);
  EXPECT_EQ(stored.columns_read, 15u);
  EXPECT_EQ(stored.recomputed, 3u);
  EXPECT_LT(stored.difference, 1e-11);
  EXPECT_LT(stored.asymmetry, 1e-13);
  const columns::Verification made = s.verify(nullptr);
  EXPECT_EQ(made.columns_read, 0u);
  EXPECT_EQ(made.recomputed, 3u);
  EXPECT_LT(made.difference, 1e-11);
}

TEST(Verify, FindsAWrongNumber) {
  const double wrong = 1 + 1e-6;
  for (const std::size_t k : {0u, 1u, 2u, 4u}) {
    Solved s;
    // Chosen nodes are compared as a whole, others where they meet a chosen one.
    s.columns.kept[k][3 * std::size_t{5}] *= wrong;
    s.columns.kept[k][3 * std::size_t{17}] *= wrong;
    s.columns.kept[k][3 * std::size_t{40}] *= wrong;
    s.columns.kept[k][0] *= wrong;
    EXPECT_THROW((void)s.verify(&s.columns), Error) << k;
  }
  Solved s;
  s.columns.kept[1][7] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW((void)s.verify(&s.columns), Error);
}

TEST(Verify, SymmetryIsThatOfAllAxes) {
  Solved s;
  const std::size_t axes = 3 * s.model.nodes.size();
  // Node 5 is none of those that are computed again: of its columns only what meets them is seen.
  std::vector<double>& column = s.columns.kept[1];
  double largest = 0;
  for (const double value : column)
    largest = numeric::larger(largest, std::abs(value));
  for (const std::size_t along : {0U, 1U, 2U})
    for (const std::size_t axis : {0U, 1U, 2U}) {
      double& entry = column[along * axes + 3 * std::size_t{17} + axis];
      const double right = entry;
      entry += 1e-6 * largest;
      EXPECT_THROW((void)s.verify(&s.columns), Error) << along << ' ' << axis;
      entry = right;
    }
  EXPECT_NO_THROW((void)s.verify(&s.columns));
}

TEST(Verify, AnotherFactorIsFound) {
  const Solved s;
  model::Model other = s.model;
  for (model::Spring& spring : other.springs)
    spring.stiffness *= 1 + 1e-7;
  linalg::StiffnessCheck check;
  const linalg::Factor factor =
      linalg::checked_factor(other, fem::stiffness_matrix(other), {}, check);
  EXPECT_THROW((void)columns::verify_compliance(s.matrix, factor, nullptr,
                                                {.condition = s.check.condition}, {}),
               Error);
}

TEST(Verify, ConjugateGradientsRefuseAnIndefiniteMatrix) {
  Solved s;
  for (double& value : s.matrix.value)
    value = -value;
  std::vector<double> f(s.matrix.order(), 1.0), x(f.size());
  EXPECT_THROW((void)columns::conjugate_gradients(s.matrix, f, x, {}), Error);
}

} // namespace
