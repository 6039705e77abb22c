// All columns of the compliance of a whole organ: every one of them is put back into K, K c = e,
// and a sample of rows is held against the columns that it must equal. A patient's colon of 10,000
// nodes with central springs, or a ball where there is no shared data. The negative control is a
// column with one number changed. Argument: every how-many-th node has columns (default 1: all).

#include "columns/compliance_columns.h"
#include "fem/model_stiffness.h"
#include "linalg/condition.h"
#include "model/build.h"
#include "tests/unit/larger.h"
#include "tests/unit/mesh_fixtures.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <span>
#include <vector>

namespace {

using namespace gewebe;

class Checked final : public columns::ColumnSink {
public:
  Checked(const linalg::StiffnessMatrix& matrix, std::span<const std::uint32_t> nodes)
      : matrix_(matrix), nodes_(nodes), x_(matrix.order()), y_(matrix.order()) {
    for (std::size_t row = 0; row < matrix.order(); row += 1 + matrix.order() / 200)
      sample_.push_back(row);
    kept_.resize(sample_.size() * matrix.order());
  }

  void write(std::size_t k, std::span<const double> columns, double) override {
    const std::size_t axes = matrix_.row_of_axis.size();
    for (std::size_t a = 0; a < 3; ++a) {
      const std::int64_t of = matrix_.row_of_axis[3 * std::size_t{nodes_[k]} + a];
      if (of < 0)
        continue;
      const auto row = static_cast<std::size_t>(of);
      for (std::size_t r = 0; r < x_.size(); ++r)
        x_[r] = columns[a * axes + static_cast<std::size_t>(matrix_.axis_of_row[r])];
      defect = test::larger(defect, defect_of(row));
      for (std::size_t s = 0; s < sample_.size(); ++s)
        kept_[s * x_.size() + row] = x_[sample_[s]];
      if (++count == 1) { // the negative control
        x_[row] *= 1 + 1e-9;
        control = defect_of(row);
        x_[row] /= 1 + 1e-9;
      }
    }
  }

  /// Of the sample, |c_rs - c_sr| over the largest |c|, where both columns were asked for.
  double asymmetry() const {
    double difference = 0, largest = 0;
    for (std::size_t s = 0; s < sample_.size(); ++s)
      for (std::size_t t = 0; t < s; ++t) {
        const double a = kept_[s * x_.size() + sample_[t]], b = kept_[t * x_.size() + sample_[s]];
        if (a == 0 || b == 0) // a column that wasn't asked for
          continue;
        difference = test::larger(difference, std::abs(a - b));
        largest = test::larger(largest, std::abs(a));
      }
    return difference / largest;
  }

  double defect = 0, control = 0; ///< max |K c - e|
  std::size_t count = 0;

private:
  double defect_of(std::size_t row) {
    linalg::multiply(matrix_, x_, y_);
    y_[row] -= 1;
    double worst = 0;
    for (const double y : y_)
      worst = test::larger(worst, std::abs(y));
    return worst;
  }

  const linalg::StiffnessMatrix& matrix_;
  std::span<const std::uint32_t> nodes_;
  std::vector<double> x_, y_, kept_; // kept_: of each sampled row all columns
  std::vector<std::size_t> sample_;
};

} // namespace

int main(int argc, char** argv) {
  const auto every =
      static_cast<std::uint32_t>(argc > 1 ? std::max(1L, std::strtol(argv[1], nullptr, 10)) : 1);
  TriangleMesh organ = test::load_test_mesh("gca90_large_intestine_20k.stl");
  if (organ.triangles.empty()) {
    (void)std::fputs("compliance: no shared data, a ball instead\n", stderr);
    organ = test::sphere_mesh(5, 100, {});
  }
  const model::Model model = model::build_model(organ, {}, Context{}).model;
  const linalg::StiffnessMatrix matrix = fem::stiffness_matrix(model);
  linalg::StiffnessCheck check;
  const linalg::Factor factor = linalg::checked_factor(model, matrix, Context{}, check);
  std::vector<std::uint32_t> nodes;
  for (std::uint32_t i = 0; i < model.nodes.size(); i += every)
    nodes.push_back(i);
  Checked checked(matrix, nodes);
  (void)columns::compliance_columns(matrix, factor, check.norm, nodes, Context{}, checked);
  const double symmetry = checked.asymmetry(),
               allowed = 10 * std::numeric_limits<double>::epsilon() * check.condition;
  std::printf("%zu nodes, %zu columns: max|K C - I| %.3g (with one number changed by 1e-9: %.3g), "
              "condition %.3g, asymmetry %.3g, 10 eps cond %.3g\n",
              model.nodes.size(), checked.count, checked.defect, checked.control, check.condition,
              symmetry, allowed);
  const bool good =
      checked.count > 0 && checked.defect < 1e-10 && checked.control > 1e-10 && symmetry <= allowed;
  return good ? EXIT_SUCCESS : EXIT_FAILURE;
}
