#include "columns/verify.h"

#include "base/error.h"
#include "numeric/larger.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

namespace gewebe::columns {

namespace {

double product(std::span<const double> a, std::span<const double> b) {
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

double largest(std::span<const double> values) {
  double max = 0;
  for (const double value : values)
    max = numeric::larger(max, std::fabs(value));
  return max;
}

std::string number(double value) {
  char text[32];
  (void)std::snprintf(text, sizeof text, "%.2g", value);
  return text;
}

/// Compares the columns of one node with those that conjugate gradients find.
class Recomputed {
public:
  Recomputed(const linalg::StiffnessMatrix& matrix, double tolerance, double bound,
             const Context& context)
      : matrix_(matrix), tolerance_(tolerance), bound_(bound), context_(context),
        load_(matrix.order()), x_(matrix.order()) {}

  /// Solves again along the axis `solved`, or the next one that is free, and compares.
  /// \param columns  as in columns/columns.h
  void compare(std::uint32_t node, std::size_t solved, std::span<const double> columns,
               Verification& result) {
    const std::size_t axes = columns.size() / 3; // of the first nodes
    bool again = false;
    for (std::size_t n = 0; n < 3; ++n) {
      const std::size_t a = (solved + n) % 3;
      const std::int64_t row = matrix_.row_of_axis[3 * std::size_t{node} + a];
      const std::span<const double> column = columns.subspan(a * axes, axes);
      if (row < 0) {
        if (largest(column) != 0)
          throw Error("the column of node " + std::to_string(node) + " along a fixed axis isn't 0");
        continue;
      }
      if (std::exchange(again, true))
        continue;
      std::ranges::fill(load_, 0.0);
      load_[static_cast<std::size_t>(row)] = 1;
      (void)conjugate_gradients(matrix_, load_, x_, context_);
      double difference = 0;
      for (std::size_t r = 0; r < x_.size(); ++r)
        if (const auto axis = static_cast<std::size_t>(matrix_.axis_of_row[r]); axis < axes)
          difference = numeric::larger(difference, std::fabs(column[axis] - x_[r]));
      const double tolerance = tolerance_ + bound_ / largest(x_);
      difference /= largest(x_);
      ++result.recomputed;
      result.tolerance = std::max(result.tolerance, tolerance);
      if (!(difference <= tolerance))
        throw Error("the columns of node " + std::to_string(node) + " differ by " +
                    number(difference) + " from those of conjugate gradients, expected at most " +
                    number(tolerance));
      result.difference = std::max(result.difference, difference);
    }
  }

private:
  const linalg::StiffnessMatrix& matrix_;
  double tolerance_, bound_; ///< of what is compared, and of each entry
  const Context& context_;
  std::vector<double> load_, x_;
};

/// `count` of `nodes`, evenly spread.
std::vector<std::size_t> spread(std::size_t nodes, std::size_t count) {
  std::vector<std::size_t> chosen;
  for (std::size_t n = 0; n < std::min(nodes, count); ++n)
    chosen.push_back((2 * n + 1) * nodes / (2 * std::min(nodes, count)));
  return chosen;
}

void verify_stored(const ColumnSource& columns, std::span<const std::size_t> chosen,
                   Recomputed& again, Verification& result, const Context& context) {
  const std::size_t axes = 3 * columns.row_nodes(), count = columns.nodes().size();
  const double tolerance = result.tolerance; // entries that mirror each other have no other bound
  std::vector<std::vector<double>> kept;     // of the chosen nodes
  for (const std::size_t k : chosen) {
    kept.emplace_back(3 * axes);
    columns.read(k, kept.back());
    again.compare(columns.nodes()[k], kept.size() % 3, kept.back(), result);
  }
  std::vector<double> read(3 * axes);
  for (std::size_t k = 0; k < count; ++k) {
    if (context.cancelled && context.cancelled())
      throw Cancelled();
    columns.read(k, read);
    result.columns_read += 3;
    const double max = largest(read);
    if (!std::isfinite(max))
      throw Error("the columns of node " + std::to_string(columns.nodes()[k]) + " aren't finite");
    for (std::size_t c = 0; c < chosen.size(); ++c) { // C_ij = C_ji
      const std::size_t i = columns.nodes()[k], j = columns.nodes()[chosen[c]];
      const double scale = std::max(max, largest(kept[c]));
      for (std::size_t a = 0; a < 3; ++a)
        for (std::size_t b = 0; b < 3; ++b) {
          const double difference =
              std::fabs(read[a * axes + 3 * j + b] - kept[c][b * axes + 3 * i + a]);
          if (!(difference <= tolerance * scale))
            throw Error("the columns of nodes " + std::to_string(i) + " and " + std::to_string(j) +
                        " aren't symmetric: they differ by " + number(difference / scale) +
                        ", expected at most " + number(tolerance));
          if (difference > 0)
            result.asymmetry = std::max(result.asymmetry, difference / scale);
        }
    }
    if (context.progress)
      context.progress(static_cast<double>(k + 1) / static_cast<double>(count));
  }
}

} // namespace

std::size_t conjugate_gradients(const linalg::StiffnessMatrix& matrix, std::span<const double> f,
                                std::span<double> x, const Context& context) {
  const std::size_t n = matrix.order();
  std::vector<double> inverse(n), r(f.begin(), f.end()), z(n), p(n), q(n);
  for (std::size_t c = 0; c < n; ++c) // the diagonal stands first in its column
    inverse[c] = 1 / matrix.value[static_cast<std::size_t>(matrix.column_start[c])];
  std::ranges::fill(x, 0.0);
  const auto precondition = [&] {
    std::ranges::transform(r, inverse, z.begin(), std::multiplies<>());
  };
  precondition();
  p = z;
  const double enough = 1e-15 * std::sqrt(product(f, f));
  double rz = product(r, z);
  for (std::size_t step = 0;; ++step) {
    if (std::sqrt(product(r, r)) <= enough)
      return step;
    if (step == 100 * n + 1000)
      throw Error("conjugate gradients found no solution in " + std::to_string(step) + " steps");
    if (step % 64 == 0 && context.cancelled && context.cancelled())
      throw Cancelled();
    linalg::multiply(matrix, p, q);
    const double curvature = product(p, q);
    if (!(curvature > 0))
      throw Error("the stiffness matrix is not positive definite along a direction of conjugate "
                  "gradients");
    const double alpha = rz / curvature;
    for (std::size_t k = 0; k < n; ++k) {
      x[k] += alpha * p[k];
      r[k] -= alpha * q[k];
    }
    precondition();
    const double before = std::exchange(rz, product(r, z));
    for (std::size_t k = 0; k < n; ++k)
      p[k] = z[k] + rz / before * p[k];
  }
}

Verification verify_compliance(const linalg::StiffnessMatrix& matrix, const linalg::Factor& factor,
                               const ColumnSource* columns, const VerifyOptions& options,
                               const Context& context) {
  Verification result;
  const double rounding = std::numeric_limits<double>::epsilon();
  result.tolerance =
      10 * options.condition * rounding + options.method_error +
      (options.single ? 2 * static_cast<double>(std::numeric_limits<float>::epsilon()) : 0);
  Recomputed again(matrix, result.tolerance, options.bound, context);
  if (columns != nullptr) {
    verify_stored(*columns, spread(columns->nodes().size(), options.samples), again, result,
                  context);
    return result;
  }
  const std::size_t axes = matrix.row_of_axis.size();
  for (const std::size_t node : spread(axes / 3, options.samples)) {
    std::vector<double> made(3 * axes), f(axes);
    for (std::size_t a = 0; a < 3; ++a) {
      std::ranges::fill(f, 0.0);
      f[3 * node + a] = 1;
      linalg::solve_axes(matrix, factor, f, std::span(made).subspan(a * axes, axes));
    }
    again.compare(static_cast<std::uint32_t>(node), node % 3, made, result);
  }
  return result;
}

} // namespace gewebe::columns
