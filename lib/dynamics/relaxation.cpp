#include "dynamics/relaxation.h"

#include "base/error.h"
#include "base/parallel.h"
#include "dynamics/elastodynamic.h"
#include "dynamics/spring_kernel.h"
#include "dynamics/spring_layout.h"
#include "linalg/condition.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

// Based on: Underwood, Dynamic relaxation, 1983 (drag that damps the slowest mode critically).

namespace gewebe::dynamics {

namespace {

constexpr int checks_a_period = 16;
constexpr double largest_move = 1e-4; // of the shortest spring
constexpr double max_periods = 1000;

/// √ of the least ω² with K x = ω² M x, by inverse iteration; M by node.
double slowest_mode(const linalg::StiffnessMatrix& matrix, const linalg::Factor& factor,
                    const model::Model& model) {
  const std::size_t n = matrix.order();
  std::vector<double> mass(n), x(n), y(n), load(n);
  for (std::size_t r = 0; r < n; ++r) {
    mass[r] = model.nodes[static_cast<std::size_t>(matrix.axis_of_row[r]) / 3].mass;
    x[r] = 1 + static_cast<double>(r % 7); // no mode is orthogonal to it by symmetry
  }
  double square = 0;
  const int rounds = 40;
  for (int round = 0; round < rounds; ++round) {
    double kinetic = 0, elastic = 0;
    for (std::size_t r = 0; r < n; ++r)
      load[r] = mass[r] * x[r];
    factor.solve(load, y);
    for (std::size_t r = 0; r < n; ++r) {
      kinetic += mass[r] * y[r] * y[r];
      elastic += y[r] * load[r];
    }
    square = elastic / kinetic; // Rayleigh's quotient of y
    const double scale = 1 / std::sqrt(kinetic);
    for (std::size_t r = 0; r < n; ++r)
      x[r] = y[r] * scale;
  }
  return std::sqrt(square);
}

/// The same springs with masses and drag that let it rest soon.
model::Model soon_at_rest(model::Model model, const linalg::StiffnessMatrix& matrix,
                          const linalg::Factor& factor, double& slowest) {
  for (model::Node& node : model.nodes)
    node.mass = node.drag = 0;
  for (model::Spring& s : model.springs) {
    s.damping = 0;
    model.nodes[s.i].mass += 2 * s.stiffness;
    model.nodes[s.j].mass += 2 * s.stiffness;
  }
  slowest = slowest_mode(matrix, factor, model);
  for (model::Node& node : model.nodes)
    node.drag = 2 * slowest * node.mass;
  return model;
}

struct Workspace {
  std::vector<NodeRow> now, next;
  std::vector<NodeTraits> traits;
  std::vector<double> columns, rows, load; ///< [3][3 n], and of K
  double residual = 0;
  std::uint64_t steps = 0, pulls = 0;
};

class Relaxation {
public:
  Relaxation(const model::Model& model, const linalg::StiffnessMatrix& matrix,
             const linalg::Factor& factor, double norm, const RelaxOptions& options,
             const Context& context)
      : model_(soon_at_rest(model, matrix, factor, slowest_)), layout_(spring_layout(model_)),
        matrix_(matrix), factor_(factor), norm_(norm), options_(options), context_(context),
        step_(safe_step_fraction * model::safe_step(model_)), traits_(layout_.movable) {
    for (std::size_t row = 0; row < layout_.movable; ++row) {
      const std::uint32_t i = layout_.node_of_row[row];
      for (int a = 0; a < 3; ++a)
        traits_[row].inverse_mass[a] =
            contact::is_fixed(model_, i, a) ? 0 : 1 / model_.nodes[i].mass;
      traits_[row].drag = model_.nodes[i].drag;
    }
    for (const model::Spring& s : model_.springs)
      shortest_ = std::min(shortest_,
                           gewebe::norm(model_.nodes[s.j].position - model_.nodes[s.i].position));
    const double steps = 2 * std::numbers::pi / (slowest_ * step_) / checks_a_period;
    between_checks_ = static_cast<std::uint64_t>(std::max(1.0, std::ceil(steps)));
  }

  void solve(std::uint32_t node, Workspace& work) const {
    const std::size_t axes = matrix_.row_of_axis.size();
    work.columns.assign(3 * axes, 0.0);
    work.traits = traits_;
    for (std::size_t a = 0; a < 3; ++a) {
      const std::int64_t row = matrix_.row_of_axis[3 * std::size_t{node} + a];
      if (row < 0)
        continue;
      double* const column = work.columns.data() + a * axes;
      const double force = force_for(static_cast<std::size_t>(row), work);
      for (const double sign : {1.0, -1.0}) {
        pull(node, a, sign * force, work);
        for (std::size_t r = 0; r < layout_.movable; ++r)
          for (std::size_t b = 0; b < 3; ++b)
            column[3 * std::size_t{layout_.node_of_row[r]} + b] += sign * work.now[r].u[b];
      }
      for (std::size_t i = 0; i < axes; ++i)
        column[i] /= 2 * force;
      check(static_cast<std::size_t>(row), {column, axes}, work);
    }
  }

private:
  double force_for(std::size_t row, Workspace& work) const {
    if (options_.force > 0)
      return options_.force;
    work.load.assign(matrix_.order(), 0.0);
    work.rows.resize(matrix_.order());
    work.load[row] = 1;
    factor_.solve(work.load, work.rows);
    double largest = 0;
    for (const double u : work.rows)
      largest = std::max(largest, std::abs(u));
    return largest_move * shortest_ / largest;
  }

  void pull(std::uint32_t node, std::size_t axis, double force, Workspace& work) const {
    work.now.assign(model_.nodes.size(), {});
    work.next = work.now;
    double& constant = work.traits[layout_.row_of_node[node]].constant[axis];
    constant = force;
    const BlockStep kernel =
        context_.cpu == CpuLevel::baseline ? block_step_baseline : block_step_avx2;
    const auto max =
        options_.steps != 0
            ? options_.steps
            : between_checks_ * static_cast<std::uint64_t>(checks_a_period * max_periods);
    int calm = 0; // checks in a row
    for (std::uint64_t s = 1; s <= max; ++s) {
      bool finite = true;
      for (const SpringBlock& block : layout_.blocks)
        finite = kernel(block, layout_.rest.data(), work.traits.data(), work.now.data(),
                        work.next.data(), step_) &&
                 finite;
      std::swap(work.now, work.next);
      ++work.steps;
      if (!finite)
        throw Error("node " + std::to_string(node) +
                    " under force: the motion is no longer finite, expected a smaller force");
      if (s % between_checks_ != 0)
        continue;
      if (context_.cancelled && context_.cancelled())
        throw Cancelled();
      calm = options_.steps == 0 && is_calm(work) ? calm + 1 : 0;
      if (calm > checks_a_period)
        break;
    }
    if (options_.steps == 0 && calm <= checks_a_period)
      throw Error("node " + std::to_string(node) + " does not come to rest in " +
                  std::to_string(max) + " steps, expected a larger threshold of velocity");
    constant = 0;
    ++work.pulls;
  }

  bool is_calm(const Workspace& work) const {
    double speeds = 0, largest = 0;
    for (std::size_t r = 0; r < layout_.movable; ++r) {
      const NodeRow& row = work.now[r];
      speeds += std::sqrt(row.v[0] * row.v[0] + row.v[1] * row.v[1] + row.v[2] * row.v[2]);
      largest = std::max({largest, std::abs(row.u[0]), std::abs(row.u[1]), std::abs(row.u[2])});
    }
    return speeds <= options_.threshold * largest * slowest_ * static_cast<double>(layout_.movable);
  }

  void check(std::size_t row, std::span<const double> column, Workspace& work) const {
    work.rows.resize(matrix_.order());
    work.load.assign(matrix_.order(), 0.0);
    work.load[row] = 1;
    for (std::size_t r = 0; r < work.rows.size(); ++r)
      work.rows[r] = column[static_cast<std::size_t>(matrix_.axis_of_row[r])];
    work.residual =
        std::max(work.residual, linalg::backward_error(matrix_, norm_, work.rows, work.load));
  }

  double slowest_ = 0;
  model::Model model_;
  SpringLayout layout_;
  const linalg::StiffnessMatrix& matrix_;
  const linalg::Factor& factor_;
  double norm_;
  double shortest_ = std::numeric_limits<double>::infinity(); ///< spring, mm
  RelaxOptions options_;
  const Context& context_;
  double step_;
  std::vector<NodeTraits> traits_;
  std::uint64_t between_checks_ = 1;
};

} // namespace

RelaxFigures relaxed_columns(const model::Model& model, const linalg::StiffnessMatrix& matrix,
                             const linalg::Factor& factor, double norm,
                             std::span<const std::uint32_t> nodes, const RelaxOptions& options,
                             const Context& context, columns::ColumnSink& sink) {
  const Relaxation relaxation(model, matrix, factor, norm, options, context);
  Context quiet = context;
  quiet.progress = nullptr;
  std::vector<Workspace> work(2 * static_cast<std::size_t>(thread_count(context)));
  RelaxFigures figures;
  for (std::size_t first = 0; first < nodes.size(); first += work.size()) {
    const std::size_t count = std::min(work.size(), nodes.size() - first);
    parallel_blocks(quiet, count, 1, [&](std::size_t k, std::size_t) {
      work[k].residual = 0;
      work[k].steps = work[k].pulls = 0;
      relaxation.solve(nodes[first + k], work[k]);
    });
    for (std::size_t k = 0; k < count; ++k) {
      sink.write(first + k, work[k].columns, work[k].residual);
      figures.residual = std::max(figures.residual, work[k].residual);
      figures.steps += work[k].steps;
      figures.pulls += work[k].pulls;
    }
    if (context.progress)
      context.progress(static_cast<double>(first + count) / static_cast<double>(nodes.size()));
  }
  return figures;
}

} // namespace gewebe::dynamics
