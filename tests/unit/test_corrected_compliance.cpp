// The columns that a cut model takes over, as they go to a store.

#include "update/corrected_compliance.h"

#include "base/error.h"
#include "columns/compliance_columns.h"
#include "cut_models.h"
#include "fem/model_stiffness.h"
#include "larger.h"
#include "linalg/condition.h"
#include "made_columns.h"
#include "relative_difference.h"

#include <gtest/gtest.h>

#include <limits>

using namespace gewebe;
using namespace gewebe::test;

namespace {

/// What a sink is handed.
class Kept final : public columns::ColumnSink {
public:
  void write(std::size_t k, std::span<const double> columns, double residual) override {
    EXPECT_EQ(k, columns_.size()); // ascending by one
    columns_.emplace_back(columns.begin(), columns.end());
    residuals_.push_back(residual);
  }
  const std::vector<std::vector<double>>& columns() const { return columns_; }
  const std::vector<double>& residuals() const { return residuals_; }

private:
  std::vector<std::vector<double>> columns_;
  std::vector<double> residuals_;
};

/// Columns of which one number is wrong.
class Damaged final : public columns::ColumnSource {
public:
  Damaged(std::shared_ptr<const columns::ColumnSource> sound, std::size_t place, double wrong)
      : sound_(std::move(sound)), place_(place), wrong_(wrong) {}
  std::size_t node_count() const override { return sound_->node_count(); }
  const std::vector<std::uint32_t>& nodes() const override { return sound_->nodes(); }
  bool single() const override { return sound_->single(); }
  void read(std::size_t k, std::span<double> out) const override {
    sound_->read(k, out);
    if (k == place_)
      for (double& x : out)
        x *= wrong_;
  }

private:
  std::shared_ptr<const columns::ColumnSource> sound_;
  std::size_t place_;
  double wrong_;
};

/// A ball before and behind a cut.
struct Cut {
  explicit Cut(std::uint32_t step, bool single = false)
      : cut(hand_cut(before, 3, 4, 2)), matrix(fem::stiffness_matrix(cut.model)),
        axes{linalg::checked_factor(cut.model, matrix, Context{}, check), matrix.row_of_axis},
        made(std::make_shared<Made>(before, solver(before), every(step, before), single)) {}

  update::CorrectedColumns corrected(std::shared_ptr<const columns::ColumnSource> source,
                                     std::size_t solve_entries = 0) const {
    return {std::move(source),
            update::stiffness_change(before, cut.model, cut.origin, cut.place),
            [this](std::span<double> f, std::size_t columns) { axes.solve(f, columns); },
            Context{},
            made->single() ? solver(before) : update::AxesSolve{},
            solve_entries};
  }
  update::CorrectedCompliance write(const update::CorrectedColumns& columns,
                                    columns::ColumnSink& sink, const Context& context = {}) const {
    return update::corrected_compliance(matrix, axes, check.norm, columns, context, sink);
  }
  /// The largest error of a column, relative to that made afresh.
  double error(const update::CorrectedColumns& columns, const Kept& kept) const {
    Kept afresh;
    (void)columns::compliance_columns(matrix, axes.factor, check.norm, columns.nodes(), Context{},
                                      afresh);
    if (kept.columns().size() != afresh.columns().size())
      return HUGE_VAL;
    double max = 0;
    for (std::size_t k = 0; k < afresh.columns().size(); ++k)
      if (const double e = relative_difference(kept.columns()[k], afresh.columns()[k]); !(e <= max))
        max = e;
    return max;
  }

  model::Model before = organ_ball();
  HandCut cut;
  linalg::StiffnessMatrix matrix;
  linalg::StiffnessCheck check;
  compliance::AxisSolver axes;
  std::shared_ptr<const Made> made;
};

TEST(CorrectedCompliance, AllColumnsAreCorrectedAndChecked) {
  const Cut c(3);
  const update::CorrectedColumns columns = c.corrected(c.made);
  ASSERT_GT(columns.nodes().size(), 2 * columns::compliance_block);
  ASSERT_NE(columns.nodes().size() % columns::compliance_block, 0U);
  Kept kept;
  std::vector<double> progress;
  Context context;
  context.progress = [&](double part) { progress.push_back(part); };
  const update::CorrectedCompliance made = c.write(columns, kept, context);
  EXPECT_EQ(made.corrected, 3 * columns.nodes().size());
  EXPECT_LT(c.error(columns, kept), 1e-9);
  double max = 0;
  for (const double residual : kept.residuals())
    max = test::larger(max, residual);
  EXPECT_EQ(made.residual, max);
  EXPECT_GT(max, 0);
  EXPECT_LE(max, linalg::max_backward_error);
  EXPECT_EQ(progress.size(),
            (columns.nodes().size() + columns::compliance_block - 1) / columns::compliance_block);
  EXPECT_EQ(progress.back(), 1);
}

TEST(CorrectedCompliance, ABlockThatErrsIsSolvedFor) {
  const Cut c(3);
  for (const double wrong : {1 + 1e-9, -1., std::numeric_limits<double>::quiet_NaN()}) {
    const auto damaged = std::make_shared<Damaged>(c.made, columns::compliance_block + 1, wrong);
    const update::CorrectedColumns columns = c.corrected(damaged);
    Kept kept;
    const update::CorrectedCompliance made = c.write(columns, kept);
    EXPECT_EQ(made.corrected, 3 * (columns.nodes().size() - columns::compliance_block)) << wrong;
    EXPECT_LT(c.error(columns, kept), 1e-9) << wrong;
    EXPECT_LE(made.residual, linalg::max_backward_error);
  }
}

TEST(CorrectedCompliance, ColumnsOfFloat32AreHeldToItsPrecision) {
  const Cut c(3, true);
  const update::CorrectedColumns columns = c.corrected(c.made);
  Kept kept;
  const update::CorrectedCompliance made = c.write(columns, kept);
  EXPECT_EQ(made.corrected, 3 * columns.nodes().size());
  EXPECT_GT(made.residual, linalg::max_backward_error);
  EXPECT_LE(made.residual, std::numeric_limits<float>::epsilon());
  EXPECT_LT(c.error(columns, kept), 6e-8);
  const auto damaged = std::make_shared<Damaged>(c.made, 1, 1.01);
  const update::CorrectedColumns wrong = c.corrected(damaged);
  Kept again;
  EXPECT_EQ(c.write(wrong, again).corrected,
            3 * (columns.nodes().size() - columns::compliance_block));
  EXPECT_LT(c.error(wrong, again), 6e-8);
}

TEST(CorrectedCompliance, WhereItDoesNotPayAllAreSolvedFor) {
  const Cut c(60);
  const update::CorrectedColumns columns = c.corrected(c.made, 1);
  ASSERT_FALSE(columns.pays(columns.nodes().size()));
  Kept kept;
  const update::CorrectedCompliance made = c.write(columns, kept);
  EXPECT_EQ(made.corrected, 0U);
  EXPECT_EQ(c.error(columns, kept), 0);
  EXPECT_LE(made.residual, linalg::max_backward_error);
}

TEST(CorrectedCompliance, CanBeCancelledAndPassesOnWhatTheSinkThrows) {
  const Cut c(3);
  const update::CorrectedColumns columns = c.corrected(c.made);
  int asked = 0;
  Context context;
  context.cancelled = [&] { return ++asked > 1; };
  Kept kept;
  EXPECT_THROW(c.write(columns, kept, context), Cancelled);
  EXPECT_EQ(kept.columns().size(), columns::compliance_block);
  struct Full final : columns::ColumnSink {
    void write(std::size_t, std::span<const double>, double) override { throw Error("full"); }
  } full;
  EXPECT_THROW(c.write(columns, full), Error);
}

} // namespace
