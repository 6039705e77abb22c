#include "sim/elastostatic.h"

#include "base/error.h"
#include "base/parallel.h"
#include "sim/condition.h"
#include "sim/stiffness.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

// Based on: M. Bro-Nielsen, Finite element modeling in surgery simulation, 1998; N. Hansen, FZKA
// 7190, 2006, 3.3.2 and 3.3.3 (prescribed displacements turned into forces).

namespace gewebe {

namespace {

constexpr double contact_tolerance = 1e-6;
// Doubles of L per free axis, to compare costs while the factor is not loaded yet.
constexpr std::size_t typical_fill = 110;
constexpr std::size_t rows_at_once = 8192;

double largest_size(std::span<const double> values) {
  double m = 0;
  for (const double v : values)
    m = std::isnan(v) ? v : std::max(m, std::abs(v));
  return m;
}

std::size_t axis_of(std::uint32_t node, int axis) {
  return 3 * std::size_t{node} + static_cast<std::size_t>(axis);
}

bool same_nodes(const std::map<std::uint32_t, Vec3>& a, const std::map<std::uint32_t, Vec3>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const auto& x, const auto& y) { return x.first == y.first; });
}

/// A factor with the rows of its matrix.
struct Solver {
  Factor factor;
  std::vector<std::int64_t> row_of_axis;

  /// Solves for right-hand sides over all axes, one behind the other, in place.
  void solve(std::span<double> over_axes, std::size_t columns) const {
    const std::size_t axes = row_of_axis.size(), order = factor.order();
    std::vector<double> f(order * columns), u(order * columns);
    for (std::size_t c = 0; c < columns; ++c)
      for (std::size_t a = 0; a < axes; ++a)
        if (row_of_axis[a] >= 0)
          f[c * order + static_cast<std::size_t>(row_of_axis[a])] = over_axes[c * axes + a];
    factor.solve(f, u, columns);
    for (std::size_t c = 0; c < columns; ++c)
      for (std::size_t a = 0; a < axes; ++a)
        over_axes[c * axes + a] =
            row_of_axis[a] < 0 ? 0 : u[c * order + static_cast<std::size_t>(row_of_axis[a])];
  }
};

} // namespace

struct Elastostatic::State {
  const Model& model;
  StiffnessParts parts;
  Context context;
  ElastostaticOptions options;
  std::size_t axes = 0; // 3 n
  ElastostaticCounts counts;

  std::optional<Solver> solver;
  std::optional<double> norm;                           // of K, for backward errors
  std::map<std::uint32_t, std::vector<double>> columns; // kept

  // What was computed last, each with the part of the load that it belongs to.
  Load load;
  std::vector<double> u;
  std::vector<NodeVector> forces;

  Vec3 weight_gravity;
  std::vector<double> weight; // K⁻¹ M g; empty for 0

  std::map<std::uint32_t, Vec3> outer_force;
  Vec3 outer_gravity;
  std::vector<double> outer; // K⁻¹ (f + M g)

  std::map<std::uint32_t, Vec3> block_nodes;
  std::vector<std::size_t> contact_axes;
  Eigen::LLT<Eigen::MatrixXd> block; // of C_cc

  std::map<std::uint32_t, Vec3> held_nodes;
  std::optional<Solver> held; // of K_ff; none where nothing is free

  State(const Model& m, StiffnessParts p, const Context& c, const ElastostaticOptions& o)
      : model(m), parts(std::move(p)), context(c), options(o), axes(3 * m.nodes.size()) {
    context.progress = nullptr;
    u.assign(axes, 0);
    outer.assign(axes, 0);
  }

  /// K itself is checked for what it determines; with more axes held it can only get better.
  Solver factorise() {
    StiffnessMatrix matrix = stiffness_matrix(model);
    ++counts.factors;
    StiffnessCheck check;
    Factor factor = checked_factor(model, matrix, context, check);
    norm = stiffness_norm(matrix);
    return {std::move(factor), std::move(matrix.row_of_axis)};
  }
  Solver factorise_held(std::span<const std::uint8_t> fixed) {
    StiffnessMatrix matrix = stiffness_matrix(model, fixed);
    ++counts.factors;
    return {Factor(matrix, context), std::move(matrix.row_of_axis)};
  }

  const Solver& whole() {
    if (solver)
      return *solver;
    if (!parts.factor) {
      solver.emplace(factorise());
      return *solver;
    }
    std::vector<std::int64_t> rows(axes, -1);
    std::int64_t next = 0;
    for (std::uint32_t i = 0; i < model.nodes.size(); ++i)
      for (int a = 0; a < 3; ++a)
        if (!is_fixed(model, i, a))
          rows[axis_of(i, a)] = next++;
    ++counts.factors;
    Factor factor = parts.factor();
    if (factor.order() != static_cast<std::size_t>(next))
      throw Error("the factor has " + std::to_string(factor.order()) + " rows, expected " +
                  std::to_string(next) + " as the model has free axes");
    solver.emplace(Solver{std::move(factor), std::move(rows)});
    return *solver;
  }

  void solve(const Solver& by, std::span<double> over_axes, std::size_t count = 1) {
    by.solve(over_axes, count);
    counts.solves += count;
  }

  // ---- columns

  std::optional<std::size_t> stored(std::uint32_t node) const {
    if (!parts.columns)
      return std::nullopt;
    const std::vector<std::uint32_t>& nodes = parts.columns->nodes();
    const auto found = std::lower_bound(nodes.begin(), nodes.end(), node);
    if (found == nodes.end() || *found != node)
      return std::nullopt;
    return static_cast<std::size_t>(found - nodes.begin());
  }

  template <class Nodes>
  bool all_stored(const Nodes& nodes) const {
    return std::all_of(nodes.begin(), nodes.end(), [&](const auto& entry) {
      return columns.contains(entry.first) || stored(entry.first);
    });
  }

  std::size_t nodes_in_memory() const {
    const double bytes = std::min(static_cast<double>(context.max_memory) / 4, 1073741824.0);
    return static_cast<std::size_t>(bytes / (72 * static_cast<double>(model.nodes.size())));
  }

  /// Columns of these nodes come to memory; others leave it where there is no room.
  template <class Nodes>
  void need_columns(const Nodes& nodes) {
    std::vector<std::uint32_t> missing;
    for (const auto& [node, value] : nodes)
      if (!columns.contains(node))
        missing.push_back(node);
    if (columns.size() + missing.size() > nodes_in_memory())
      std::erase_if(columns, [&](const auto& entry) { return !nodes.contains(entry.first); });
    std::vector<std::uint32_t> unknown;
    for (const std::uint32_t node : missing) {
      if (const auto k = stored(node)) {
        std::vector<double> c(3 * axes);
        parts.columns->read(*k, c);
        ++counts.columns_read;
        columns.emplace(node, std::move(c));
      } else {
        unknown.push_back(node);
      }
    }
    constexpr std::size_t at_once = 8;
    for (std::size_t begin = 0; begin < unknown.size(); begin += at_once) {
      const std::size_t count = std::min(at_once, unknown.size() - begin);
      std::vector<double> block_columns(3 * axes * count);
      for (std::size_t k = 0; k < count; ++k)
        for (int a = 0; a < 3; ++a)
          block_columns[(3 * k + static_cast<std::size_t>(a)) * axes +
                        axis_of(unknown[begin + k], a)] = 1;
      solve(whole(), block_columns, 3 * count);
      for (std::size_t k = 0; k < count; ++k) {
        const auto first = block_columns.begin() + static_cast<std::ptrdiff_t>(3 * axes * k);
        columns.emplace(unknown[begin + k],
                        std::vector<double>(first, first + static_cast<std::ptrdiff_t>(3 * axes)));
      }
    }
  }

  /// Nodes whose columns cost as much to add up as one solve, which reads L twice. Measured, 10,246
  /// nodes: 0.09 ms a node while columns are in a cache, 0.26 ms beyond, 5 to 8 ms a solve.
  std::size_t break_even() const {
    const std::size_t entries = solver ? solver->factor.entries() : typical_fill * axes;
    return std::max<std::size_t>(1, entries / (3 * axes));
  }

  /// Adds the displacement under these forces to `sum`, by columns or by a solve.
  template <class Nodes>
  void add_shape(const Nodes& forces_of, std::span<double> sum) {
    if (forces_of.empty())
      return;
    const bool few = forces_of.size() <= std::min(break_even(), nodes_in_memory());
    if (few && all_stored(forces_of)) {
      need_columns(forces_of);
      std::vector<std::pair<const double*, double>> terms;
      for (const auto& [node, force] : forces_of)
        for (int a = 0; a < 3; ++a)
          if (force[a] != 0 && !is_fixed(model, node, a))
            terms.emplace_back(columns.at(node).data() + static_cast<std::size_t>(a) * axes,
                               force[a]);
      Context some = context;
      if (terms.size() * axes < 1000000)
        some.threads = 1;
      parallel_blocks(some, axes, rows_at_once, [&](std::size_t begin, std::size_t end) {
        for (const auto& [column, factor] : terms)
          for (std::size_t r = begin; r < end; ++r)
            sum[r] += column[r] * factor;
      });
      return;
    }
    std::vector<double> f(axes, 0);
    for (const auto& [node, force] : forces_of)
      for (int a = 0; a < 3; ++a)
        f[axis_of(node, a)] = force[a];
    solve(whole(), f);
    for (std::size_t r = 0; r < axes; ++r)
      sum[r] += f[r];
  }

  // ---- the parts of an update

  std::vector<double> weights(const Vec3& gravity) const {
    std::vector<double> f(axes, 0);
    for (std::uint32_t i = 0; i < model.nodes.size(); ++i)
      for (int a = 0; a < 3; ++a)
        f[axis_of(i, a)] = model.nodes[i].mass * gravity[a];
    return f;
  }

  void renew_outer(const Load& now) {
    if (now.gravity == outer_gravity && now.force == outer_force)
      return;
    if (now.gravity != weight_gravity) {
      weight.clear();
      if (now.gravity != Vec3{}) {
        weight = weights(now.gravity);
        solve(whole(), weight);
      }
      weight_gravity = now.gravity;
    }
    if (weight.empty())
      outer.assign(axes, 0);
    else
      outer = weight;
    add_shape(now.force, outer);
    outer_gravity = now.gravity;
    outer_force = now.force;
  }

  bool block_is_cheaper(const Load& now) const {
    const std::size_t m = now.displacement.size();
    if (options.block_limit != SIZE_MAX)
      return m <= options.block_limit;
    // Columns that are not stored cost three solves each, a fresh factor some dozens.
    const std::size_t most = all_stored(now.displacement) ? 128 : 32;
    return m <= std::min(most, nodes_in_memory());
  }

  void renew_block(const Load& now) {
    if (!block_nodes.empty() && same_nodes(now.displacement, block_nodes))
      return;
    need_columns(now.displacement);
    contact_axes.clear();
    for (const auto& [node, d] : now.displacement)
      for (int a = 0; a < 3; ++a)
        if (!is_fixed(model, node, a))
          contact_axes.push_back(axis_of(node, a));
    const auto size = static_cast<Eigen::Index>(contact_axes.size());
    Eigen::MatrixXd c(size, size);
    for (Eigen::Index j = 0; j < size; ++j) {
      const std::size_t axis = contact_axes[static_cast<std::size_t>(j)];
      const double* const column =
          columns.at(static_cast<std::uint32_t>(axis / 3)).data() + axis % 3 * axes;
      for (Eigen::Index i = 0; i < size; ++i)
        c(i, j) = column[contact_axes[static_cast<std::size_t>(i)]];
    }
    block.compute(c);
    block_nodes = now.displacement;
  }

  /// How far the shape misses the prescribed displacements, over the largest one.
  double missed(const Load& now) const {
    double miss = 0, size = largest_size(u);
    for (const auto& [node, d] : now.displacement)
      for (int a = 0; a < 3; ++a) {
        const double error = std::abs(u[axis_of(node, a)] - d[a]);
        miss = std::isnan(error) ? error : std::max(miss, error);
        size = std::max(size, std::abs(d[a]));
      }
    return size == 0 ? miss : miss / size;
  }

  /// Whether it came out right.
  bool contact_by_block(const Load& now) {
    renew_block(now);
    if (block.info() != Eigen::Success)
      return false;
    Eigen::VectorXd rhs(static_cast<Eigen::Index>(contact_axes.size()));
    for (std::size_t k = 0; k < contact_axes.size(); ++k) {
      const std::size_t axis = contact_axes[k];
      const Vec3& d = now.displacement.at(static_cast<std::uint32_t>(axis / 3));
      rhs[static_cast<Eigen::Index>(k)] = d[static_cast<int>(axis % 3)] - outer[axis];
    }
    const Eigen::VectorXd f = block.solve(rhs);
    std::map<std::uint32_t, Vec3> contact;
    for (const auto& [node, d] : now.displacement)
      contact.emplace(node, Vec3{});
    for (std::size_t k = 0; k < contact_axes.size(); ++k)
      contact[static_cast<std::uint32_t>(contact_axes[k] / 3)]
             [static_cast<int>(contact_axes[k] % 3)] = f[static_cast<Eigen::Index>(k)];
    u = outer;
    add_shape(contact, u);
    const double miss = missed(now);
    if (!(miss <= contact_tolerance))
      return false;
    counts.contact_error = std::max(counts.contact_error, miss);
    forces.clear();
    for (const auto& [node, force] : contact)
      forces.push_back({node, force});
    return true;
  }

  std::vector<double> outer_load(const Load& now) const {
    std::vector<double> f = weights(now.gravity);
    for (const auto& [node, force] : now.force)
      for (int a = 0; a < 3; ++a)
        f[axis_of(node, a)] += force[a];
    return f;
  }

  void renew_held(const Load& now) {
    if (!held_nodes.empty() && same_nodes(now.displacement, held_nodes))
      return;
    held.reset();
    held_nodes.clear();
    std::vector<std::uint8_t> fixed(axes, 0);
    bool any_free = false;
    for (std::uint32_t i = 0; i < model.nodes.size(); ++i)
      for (int a = 0; a < 3; ++a) {
        fixed[axis_of(i, a)] = now.displacement.contains(i) ? 1 : 0;
        any_free = any_free || (fixed[axis_of(i, a)] == 0 && !is_fixed(model, i, a));
      }
    if (any_free)
      held.emplace(factorise_held(fixed));
    held_nodes = now.displacement;
  }

  void contact_by_constraints(const Load& now) {
    renew_held(now);
    const std::vector<double> f = outer_load(now);
    std::vector<double> prescribed(axes, 0), product(axes, 0);
    for (const auto& [node, d] : now.displacement)
      for (int a = 0; a < 3; ++a)
        prescribed[axis_of(node, a)] = d[a];
    u.assign(axes, 0);
    if (held) {
      multiply_stiffness(model, prescribed, product);
      for (std::size_t r = 0; r < axes; ++r)
        u[r] = f[r] - product[r];
      solve(*held, u);
    }
    for (const auto& [node, d] : now.displacement)
      for (int a = 0; a < 3; ++a)
        u[axis_of(node, a)] = d[a];
    multiply_stiffness(model, u, product);
    forces.clear();
    for (const auto& [node, d] : now.displacement) {
      Vec3 force;
      for (int a = 0; a < 3; ++a)
        if (!is_fixed(model, node, a))
          force[a] = product[axis_of(node, a)] - f[axis_of(node, a)];
      forces.push_back({node, force});
    }
  }

  void measure(const Load& now) {
    if (!norm)
      norm = stiffness_norm(stiffness_matrix(model));
    std::vector<double> f = outer_load(now), product(axes, 0);
    for (const NodeVector& contact : forces)
      for (int a = 0; a < 3; ++a)
        f[axis_of(contact.node, a)] += contact.value[a];
    multiply_stiffness(model, u, product);
    double residual = 0, load_size = 0;
    for (std::uint32_t i = 0; i < model.nodes.size(); ++i)
      for (int a = 0; a < 3; ++a)
        if (!is_fixed(model, i, a)) {
          residual = std::max(residual, std::abs(product[axis_of(i, a)] - f[axis_of(i, a)]));
          load_size = std::max(load_size, std::abs(f[axis_of(i, a)]));
        }
    const double scale = *norm * largest_size(u) + load_size;
    if (scale > 0)
      counts.backward_error = std::max(counts.backward_error, residual / scale);
  }

  void update(const Load& now) {
    ++counts.updates;
    if (now == load) {
      ++counts.unchanged;
      return;
    }
    if (now.displacement.empty()) {
      renew_outer(now);
      u = outer;
      forces.clear();
    } else {
      bool done = false;
      if (block_is_cheaper(now)) {
        renew_outer(now);
        done = contact_by_block(now);
      }
      if (!done)
        contact_by_constraints(now);
      for (const auto& [node, d] : now.displacement)
        for (int a = 0; a < 3; ++a)
          u[axis_of(node, a)] = d[a];
    }
    double sum = 0;
    for (const double value : u)
      sum += std::abs(value);
    if (!std::isfinite(sum))
      throw Error("the shape is not finite, expected a smaller load");
    if (options.measure_error)
      measure(now);
    load = now;
  }
};

Elastostatic::Elastostatic(const Model& model, StiffnessParts parts, const Context& context,
                           const ElastostaticOptions& options)
    : state_(std::make_unique<State>(model, std::move(parts), context, options)) {
  if (!state_->parts.factor)
    (void)state_->whole();
}
Elastostatic::~Elastostatic() = default;
Elastostatic::Elastostatic(Elastostatic&&) noexcept = default;

void Elastostatic::update(const Load& load) {
  state_->update(load);
}

std::span<const double> Elastostatic::displacement() const noexcept {
  return state_->u;
}

const std::vector<NodeVector>& Elastostatic::contact_forces() const noexcept {
  return state_->forces;
}

const ElastostaticCounts& Elastostatic::counts() const noexcept {
  return state_->counts;
}

LinearRange linear_range(const Model& model, std::span<const double> displacement) {
  const auto moved = [&](std::uint32_t node) {
    return Vec3{displacement[axis_of(node, 0)], displacement[axis_of(node, 1)],
                displacement[axis_of(node, 2)]};
  };
  LinearRange range;
  for (std::size_t s = 0; s < model.springs.size(); ++s) {
    const Spring& spring = model.springs[s];
    if (spring.kind != SpringKind::edge)
      break; // edges come first
    const Vec3 along = model.nodes[spring.j].position - model.nodes[spring.i].position;
    const Vec3 by = moved(spring.j) - moved(spring.i);
    const double length = norm(along);
    const double strain = std::abs(norm(along + by) - length) / length;
    const double turn = norm(by - along * (dot(by, along) / (length * length))) / length;
    if (strain > range.strain) {
      range.strain = strain;
      range.strain_spring = s;
    }
    if (turn > range.turn) {
      range.turn = turn;
      range.turn_spring = s;
    }
  }
  return range;
}

} // namespace gewebe
