#include "statics/elastostatic.h"

#include "base/error.h"
#include "compliance/axis_solver.h"
#include "compliance/column_cache.h"
#include "compliance/compliance.h"
#include "compliance/costs.h"
#include "solve/stiffness.h"
#include "statics/contact_block.h"
#include "statics/shape_modes.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

namespace gewebe {

namespace {

constexpr double contact_tolerance = 1e-6;
// Roundings of sums that follow their changes stay below 1000 times one.
constexpr std::uint64_t most_increments = 1000;

double largest_size(std::span<const double> values) {
  double m = 0;
  for (const double v : values)
    m = std::isnan(v) ? v : std::max(m, std::abs(v));
  return m;
}

std::size_t axis_of(std::uint32_t node, int axis) {
  return 3 * std::size_t{node} + static_cast<std::size_t>(axis);
}

template <class Map>
bool same_nodes(const Map& a, const Map& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const auto& x, const auto& y) { return x.first == y.first; });
}

std::vector<std::uint32_t> nodes_of(const std::map<std::uint32_t, Vec3>& values) {
  std::vector<std::uint32_t> nodes;
  nodes.reserve(values.size());
  for (const auto& entry : values)
    nodes.push_back(entry.first);
  return nodes;
}

std::vector<NodeVector> as_vectors(const std::map<std::uint32_t, Vec3>& values) {
  std::vector<NodeVector> list;
  list.reserve(values.size());
  for (const auto& [node, value] : values)
    list.push_back({node, value});
  return list;
}

} // namespace

struct Elastostatic::State {
  const Model& model;
  Context context;
  ElastostaticOptions options;
  Compliance compliance;
  std::size_t axes = 0; // 3 n
  ElastostaticCounts counts;
  std::optional<double> norm; // of K, for backward errors

  // The last load, its contact forces, and its shape, where that was asked for.
  Load load;
  std::vector<NodeVector> forces;
  std::vector<double> u;
  bool shape_known = true;

  // K⁻¹ M g; empty for 0.
  Vec3 weight_gravity;
  std::vector<double> weight;

  // K⁻¹ (f + M g), of these.
  std::map<std::uint32_t, Vec3> outer_force;
  Vec3 outer_gravity;
  std::vector<double> outer;
  std::uint64_t increments = 0;

  // C_cc of these nodes, in order of arrival.
  struct Contact {
    std::uint32_t node = 0;
    std::vector<std::size_t> axes;
  };
  std::vector<Contact> contacts;
  ContactBlock block;
  std::uint64_t block_changes = 0;
  std::vector<double> question;      // what the contacts have to be moved by, beyond other loads
  std::vector<double> contact_force; // by axis of the block
  bool by_block = false;             // how the present load is met
  int shapes_of_contacts = 0;        // that were asked for with this set
  ShapeModes modes;                  // of this set: question to shape

  // K with these nodes held, and what its springs add to it.
  std::vector<SymmetricBlock> spring_blocks;
  std::map<std::uint32_t, Vec3> held_nodes;
  std::optional<AxisSolver> held; // none where nothing is free
  std::optional<ColumnCache> held_columns;
  ShapeModes held_modes; // displacements to shape
  std::map<std::uint32_t, Vec3> base_force;
  Vec3 base_gravity;
  std::vector<double> base; // the shape with all displacements 0, under these; empty: unknown

  State(const Model& m, std::shared_ptr<ComplianceSource> s, const Context& c,
        const ElastostaticOptions& o)
      : model(m), context(c), options(o), compliance(m, std::move(s), c, o.tolerance > 0),
        axes(3 * m.nodes.size()) {
    context.progress = nullptr;
    u.assign(axes, 0);
    outer.assign(axes, 0);
  }

  // ---- what acts beside displacements

  std::vector<double> weights(const Vec3& gravity) const {
    std::vector<double> f(axes, 0);
    for (std::uint32_t i = 0; i < model.nodes.size(); ++i)
      for (int a = 0; a < 3; ++a)
        f[axis_of(i, a)] = model.nodes[i].mass * gravity[a];
    return f;
  }

  std::vector<double> outer_load(const Load& now) const {
    std::vector<double> f =
        now.gravity == Vec3{} ? std::vector<double>(axes, 0) : weights(now.gravity);
    for (const auto& [node, force] : now.force)
      for (int a = 0; a < 3; ++a)
        f[axis_of(node, a)] += force[a];
    return f;
  }

  void renew_weight(const Vec3& gravity) {
    if (gravity == weight_gravity)
      return;
    std::vector<double> fresh;
    if (gravity != Vec3{}) {
      fresh = weights(gravity);
      compliance.solve(fresh);
    }
    weight = std::move(fresh);
    weight_gravity = gravity;
  }

  bool outer_known(const Load& now) const {
    return now.gravity == outer_gravity && now.force == outer_force;
  }

  /// Forces that differ from those of `outer`, by their difference.
  std::vector<NodeVector> changed_forces(const std::map<std::uint32_t, Vec3>& now) const {
    std::vector<NodeVector> changed;
    auto a = outer_force.begin();
    auto b = now.begin();
    while (a != outer_force.end() || b != now.end()) {
      if (b == now.end() || (a != outer_force.end() && a->first < b->first)) {
        changed.push_back({a->first, -a->second});
        ++a;
      } else if (a == outer_force.end() || b->first < a->first) {
        changed.push_back({b->first, b->second});
        ++b;
      } else {
        if (!(a->second == b->second))
          changed.push_back({b->first, b->second - a->second});
        ++a;
        ++b;
      }
    }
    return changed;
  }

  void forget_outer() { outer_gravity = {HUGE_VAL, HUGE_VAL, HUGE_VAL}; }

  void renew_outer(const Load& now) {
    if (outer_known(now))
      return;
    renew_weight(now.gravity);
    const std::vector<NodeVector> changed =
        now.gravity == outer_gravity ? changed_forces(now.force) : std::vector<NodeVector>{};
    std::vector<double> fresh;
    if (now.gravity == outer_gravity && changed.size() < now.force.size() &&
        increments < most_increments) {
      fresh = std::move(outer);
      forget_outer(); // should the sum fail
      compliance.add(changed, 0, fresh);
      ++increments;
    } else {
      fresh = weight;
      fresh.resize(axes, 0);
      compliance.add(as_vectors(now.force), 0, fresh);
      increments = 0;
    }
    outer = std::move(fresh);
    outer_gravity = now.gravity;
    outer_force = now.force;
  }

  /// The displacements under all but the contacts, at the axes of `wanted`. The same bits whatever
  /// shapes were asked for.
  std::vector<double> outer_at(const Load& now, std::span<const std::size_t> wanted) {
    std::vector<double> values;
    values.reserve(wanted.size());
    const std::vector<std::uint32_t> nodes = nodes_of(now.force);
    if (compliance.columns_pay(nodes)) {
      renew_weight(now.gravity);
      for (const std::size_t axis : wanted)
        values.push_back(weight.empty() ? 0 : weight[axis]);
      compliance.add_rows(as_vectors(now.force), wanted, values);
      return values;
    }
    if (increments > 0)
      forget_outer();
    renew_outer(now);
    for (const std::size_t axis : wanted)
      values.push_back(outer[axis]);
    return values;
  }

  // ---- contacts by the block

  bool block_is_cheaper(const Load& now) const {
    const std::size_t m = now.displacement.size();
    if (options.block_limit != SIZE_MAX)
      return m <= options.block_limit;
    if (m > std::min(costs::most_in_block(true), compliance.capacity()))
      return false;
    return m <= costs::most_in_block(false) || compliance.stored(nodes_of(now.displacement));
  }

  bool join(std::uint32_t node) {
    Contact contact{node, {}};
    std::vector<ComplianceBlock> with;
    with.reserve(contacts.size());
    for (const Contact& other : contacts)
      with.push_back(compliance.block(node, other.node));
    const ComplianceBlock own = compliance.block(node, node);
    std::vector<double> row;
    for (std::size_t a = 0; a < 3; ++a) {
      if (is_fixed(model, node, static_cast<int>(a)))
        continue;
      contact.axes.push_back(axis_of(node, static_cast<int>(a)));
      row.clear();
      for (std::size_t k = 0; k < contacts.size(); ++k)
        for (const std::size_t axis : contacts[k].axes)
          row.push_back(with[k][a][axis % 3]);
      for (const std::size_t axis : contact.axes)
        row.push_back(own[a][axis % 3]);
      if (!block.append(row)) {
        block.remove(block.size() + 1 - contact.axes.size(), contact.axes.size() - 1);
        return false;
      }
    }
    contacts.push_back(std::move(contact));
    ++block_changes;
    return true;
  }

  void leave_all() {
    contacts.clear();
    block.clear();
    block_changes = 0;
    modes.clear();
  }

  /// Whether C_cc of these nodes is positive definite.
  bool renew_block(const std::map<std::uint32_t, Vec3>& nodes) {
    std::size_t staying = 0;
    for (const Contact& c : contacts)
      staying += nodes.contains(c.node) ? 1 : 0;
    if (staying == contacts.size() && staying == nodes.size())
      return true;
    modes.clear();
    if (2 * staying < contacts.size() || block_changes > most_increments)
      leave_all();
    shapes_of_contacts = 0;
    compliance.need_blocks(nodes_of(nodes));
    std::size_t row = 0;
    for (std::size_t k = 0; k < contacts.size();) {
      if (nodes.contains(contacts[k].node)) {
        row += contacts[k++].axes.size();
        continue;
      }
      block.remove(row, contacts[k].axes.size());
      contacts.erase(contacts.begin() + static_cast<std::ptrdiff_t>(k));
      ++block_changes;
    }
    for (const auto& entry : nodes) {
      const bool there = std::any_of(contacts.begin(), contacts.end(),
                                     [&](const Contact& c) { return c.node == entry.first; });
      if (!there && !join(entry.first)) {
        leave_all();
        return false;
      }
    }
    return true;
  }

  std::vector<std::size_t> contact_axes() const {
    std::vector<std::size_t> all;
    for (const Contact& c : contacts)
      all.insert(all.end(), c.axes.begin(), c.axes.end());
    return all;
  }

  std::vector<NodeVector> by_node(std::span<const double> force) const {
    std::vector<NodeVector> list;
    std::size_t row = 0;
    for (const Contact& c : contacts) {
      NodeVector& f = list.emplace_back(NodeVector{c.node, {}});
      for (const std::size_t axis : c.axes)
        f.value[static_cast<int>(axis % 3)] = force[row++];
    }
    std::sort(list.begin(), list.end(),
              [](const NodeVector& a, const NodeVector& b) { return a.node < b.node; });
    return list;
  }

  /// Whether it came out right.
  bool contact_by_block(const Load& now) {
    if (!renew_block(now.displacement))
      return false;
    const std::vector<std::size_t> where = contact_axes();
    std::vector<double> wanted = outer_at(now, where);
    double size = largest_size(wanted);
    for (std::size_t k = 0; k < where.size(); ++k) {
      const double d = now.displacement.at(
          static_cast<std::uint32_t>(where[k] / 3))[static_cast<int>(where[k] % 3)];
      size = std::max(size, std::abs(d));
      wanted[k] = d - wanted[k];
    }
    std::vector<double> f = wanted, back(wanted.size()), correction(wanted.size());
    block.solve(f);
    double miss = 0;
    for (int round = 0; round < 2; ++round) { // once more where updates of the factor left error
      block.multiply(f, back);
      for (std::size_t k = 0; k < back.size(); ++k)
        correction[k] = wanted[k] - back[k];
      miss = largest_size(correction);
      if (round == 1 || miss <= 1e-13 * size)
        break;
      block.solve(correction);
      for (std::size_t k = 0; k < f.size(); ++k)
        f[k] += correction[k];
    }
    if (size > 0)
      miss /= size;
    if (!(miss <= contact_tolerance))
      return false;
    counts.contact_error = std::max(counts.contact_error, miss);
    forces = by_node(f);
    question = std::move(wanted);
    contact_force = std::move(f);
    by_block = true;
    return true;
  }

  /// By what a rigid motion of the contacts did before, if this is one. \return whether it was
  bool shape_by_modes(const Load& now) {
    if (contacts.size() < costs::worth_modes || (modes.size() == 0 && !modes.open()))
      return false;
    std::vector<double> coefficients, rest;
    if (!modes.express(question, coefficients, rest)) {
      if (!modes.open()) {
        modes.give_up();
        return false;
      }
      double square = 0;
      for (const double r : rest)
        square += r * r;
      const double length = std::sqrt(square);
      for (double& r : rest)
        r /= length;
      std::vector<double> f = rest, answer(axes, 0);
      block.solve(f);
      compliance.add(by_node(f), 0, answer);
      modes.add(rest, std::move(answer));
      coefficients.push_back(length);
    }
    renew_outer(now);
    u = outer;
    modes.answer(coefficients, u);
    return true;
  }

  // ---- contacts by constraints

  void renew_held(const Load& now) {
    if (!held_nodes.empty() && same_nodes(now.displacement, held_nodes))
      return;
    if (spring_blocks.empty())
      spring_blocks = stiffness_blocks(model);
    held.reset();
    held_nodes.clear();
    held_columns.reset();
    base.clear();
    held_modes.clear();
    std::vector<std::uint8_t> fixed(axes, 0);
    for (const auto& entry : now.displacement)
      std::fill_n(fixed.begin() + static_cast<std::ptrdiff_t>(axis_of(entry.first, 0)), 3, 1);
    bool any_free = false;
    for (std::uint32_t i = 0; i < model.nodes.size() && !any_free; ++i)
      for (int a = 0; a < 3; ++a)
        any_free = any_free || (fixed[axis_of(i, a)] == 0 && !is_fixed(model, i, a));
    if (any_free) {
      ++counts.factors;
      held.emplace(factorise_axes(model, fixed, context));
    }
    held_nodes = now.displacement;
  }

  void solve_held(std::span<double> over_axes, std::size_t columns = 1) {
    if (!held) {
      std::fill(over_axes.begin(), over_axes.end(), 0.0);
      return;
    }
    held->solve(over_axes, columns);
    counts.solves += columns;
  }

  /// u = shape under f (over all axes) and these displacements.
  void held_shape(std::span<const double> f, std::span<const double> prescribed,
                  std::vector<double>& shape) {
    std::vector<double> product(axes, 0);
    multiply_stiffness(model, spring_blocks, prescribed, product);
    shape.resize(axes);
    for (std::size_t r = 0; r < axes; ++r)
      shape[r] = (f.empty() ? 0 : f[r]) - product[r];
    solve_held(shape);
    for (std::size_t r = 0; r < axes; ++r)
      shape[r] += prescribed[r]; // on held axes the solution is 0
  }

  void contact_by_constraints(const Load& now) {
    renew_held(now);
    const std::vector<double> f = outer_load(now);
    std::vector<double> wanted(3 * now.displacement.size()), prescribed(axes, 0);
    std::size_t k = 0;
    for (const auto& [node, d] : now.displacement)
      for (int a = 0; a < 3; ++a)
        wanted[k++] = d[a];
    const auto spread = [&](std::span<const double> values, double factor) {
      std::size_t at = 0;
      for (const auto& entry : now.displacement)
        for (int a = 0; a < 3; ++a)
          prescribed[axis_of(entry.first, a)] = factor * values[at++];
    };
    std::vector<double> coefficients, rest;
    std::vector<double> shape;
    const bool rigid = held && held_modes.express(wanted, coefficients, rest);
    if (!held) { // nothing is left to give way
      spread(wanted, 1);
      shape = std::move(prescribed);
    } else if (rigid || held_modes.open()) {
      if (base.empty() || base_gravity != now.gravity || base_force != now.force) {
        held_shape(f, prescribed, base);
        base_gravity = now.gravity;
        base_force = now.force;
      }
      if (!rigid) {
        const double length = [&] {
          double square = 0;
          for (const double r : rest)
            square += r * r;
          return std::sqrt(square);
        }();
        spread(rest, 1 / length);
        std::vector<double> answer;
        held_shape({}, prescribed, answer);
        for (double& r : rest)
          r /= length;
        held_modes.add(rest, std::move(answer));
        coefficients.push_back(length);
      }
      shape = base;
      held_modes.answer(coefficients, shape);
    } else {
      held_modes.give_up();
      spread(wanted, 1);
      held_shape(f, prescribed, shape);
    }
    for (const auto& [node, d] : now.displacement)
      for (int a = 0; a < 3; ++a)
        shape[axis_of(node, a)] = d[a];
    std::vector<double> product(axes, 0);
    multiply_stiffness(model, spring_blocks, shape, product);
    forces.clear();
    for (const auto& entry : now.displacement) {
      Vec3 force;
      for (int a = 0; a < 3; ++a)
        if (!is_fixed(model, entry.first, a))
          force[a] = product[axis_of(entry.first, a)] - f[axis_of(entry.first, a)];
      forces.push_back({entry.first, force});
    }
    u = std::move(shape);
    by_block = false;
    shape_known = true;
  }

  // ---- the shape

  /// Less than the largest size of an entry of the shape.
  double least_size(const Load& now) {
    double size = 0;
    for (const auto& entry : now.displacement)
      for (int a = 0; a < 3; ++a)
        size = std::max(size, std::abs(entry.second[a]));
    if (size > 0 || now.force.empty())
      return size;
    std::vector<std::size_t> where;
    for (const auto& entry : now.force)
      for (int a = 0; a < 3; ++a)
        where.push_back(axis_of(entry.first, a));
    const double most = largest_size(outer_at(now, where));
    return std::isfinite(most) ? most : 0;
  }

  void make_shape(double tolerance) {
    const Load& now = load;
    if (now.displacement.empty()) {
      // Where sums may leave something out, they are made for this load alone.
      if (tolerance > 0 && !outer_known(now) && compliance.columns_pay(nodes_of(now.force))) {
        renew_weight(now.gravity);
        const double allowed = tolerance * least_size(now);
        u = weight;
        u.resize(axes, 0);
        compliance.add(as_vectors(now.force), allowed, u);
        return;
      }
      renew_outer(now);
      u = outer;
      return;
    }
    if (!shape_by_modes(now)) {
      const std::vector<std::uint32_t> nodes = nodes_of(now.displacement);
      const bool columns = !by_block || compliance.columns_for_shape(nodes, ++shapes_of_contacts);
      if (columns && (outer_known(now) || compliance.columns_pay(nodes))) {
        renew_outer(now);
        u = outer;
        compliance.add(forces, tolerance * least_size(now), u);
      } else {
        u = outer_load(now);
        for (const NodeVector& contact : forces)
          for (int a = 0; a < 3; ++a)
            u[axis_of(contact.node, a)] += contact.value[a];
        compliance.solve(u);
      }
    }
    for (const auto& [node, d] : now.displacement)
      for (int a = 0; a < 3; ++a)
        u[axis_of(node, a)] = d[a];
  }

  void need_shape() {
    if (shape_known)
      return;
    make_shape(options.tolerance);
    ++counts.shapes;
    double sum = 0;
    for (const double value : u)
      sum += std::abs(value);
    if (!std::isfinite(sum))
      throw Error("the shape is not finite, expected a smaller load");
    if (options.measure_error)
      measure();
    shape_known = true;
  }

  void measure() {
    const Load& now = load;
    if (options.tolerance > 0) {
      std::vector<double> taken = u;
      make_shape(0);
      double worst = 0;
      for (std::size_t r = 0; r < axes; ++r)
        worst = std::max(worst, std::abs(taken[r] - u[r]));
      const double size = largest_size(u);
      if (size > 0)
        counts.shape_error = std::max(counts.shape_error, worst / size);
      std::swap(taken, u);
    }
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
    shape_known = false;
    std::vector<NodeVector> before = std::move(forces);
    forces.clear();
    try {
      if (!now.displacement.empty() && !(block_is_cheaper(now) && contact_by_block(now)))
        contact_by_constraints(now);
      double sum = 0;
      for (const NodeVector& f : forces)
        sum += std::abs(f.value.x) + std::abs(f.value.y) + std::abs(f.value.z);
      if (!std::isfinite(sum))
        throw Error("the contact forces are not finite, expected a smaller load");
    } catch (...) {
      forces = std::move(before);
      throw;
    }
    load = now;
    if (shape_known) {
      ++counts.shapes;
      if (options.measure_error)
        measure();
    }
  }

  // ---- for who finds forces by conditions

  ContactSpace space(const Load& now, std::span<const std::uint32_t> nodes) {
    update(now);
    ContactSpace space;
    space.nodes.assign(nodes.begin(), nodes.end());
    std::vector<std::size_t> where;
    for (const std::uint32_t node : nodes)
      for (int a = 0; a < 3; ++a)
        where.push_back(axis_of(node, a));
    const std::size_t size = where.size();
    space.compliance.resize(size * size);
    const auto symmetric = [&](const auto& entry) {
      for (std::size_t c = 0; c < size; ++c)
        for (std::size_t r = c; r < size; ++r)
          space.compliance[c * size + r] = space.compliance[r * size + c] = entry(c, r);
    };
    const auto node_at = [&](std::size_t row) { return nodes[row / 3]; };
    const auto axis_at = [&](std::size_t row) { return static_cast<int>(row % 3); };
    if (!now.displacement.empty() && !by_block) {
      space_by_constraints(nodes);
      symmetric([&](std::size_t c, std::size_t r) {
        return held_columns->entry(node_at(c), axis_at(c), where[r]);
      });
      for (const std::size_t axis : where)
        space.free.push_back(u[axis]);
      return space;
    }
    std::vector<std::uint32_t> all(nodes.begin(), nodes.end());
    for (const Contact& c : contacts)
      if (!now.displacement.empty())
        all.push_back(c.node);
    if (all.size() > compliance.capacity())
      throw Error("the columns of " + std::to_string(all.size()) +
                  " nodes in contact do not fit in memory, expected more of it or fewer contacts");
    compliance.need(all);
    symmetric([&](std::size_t c, std::size_t r) {
      return compliance.entry(node_at(c), axis_at(c), where[r]);
    });
    space.free = outer_at(now, where);
    if (now.displacement.empty())
      return space;
    // The displaced nodes give way to nothing: C - C_ch C_hh⁻¹ C_hc.
    const std::vector<std::size_t> held_axes = contact_axes();
    std::vector<double> across(held_axes.size() * size), answer;
    for (std::size_t c = 0; c < size; ++c)
      for (std::size_t k = 0; k < held_axes.size(); ++k)
        across[c * held_axes.size() + k] = compliance.entry(node_at(c), axis_at(c), held_axes[k]);
    const auto column = [&](std::size_t c) {
      return std::span(across).subspan(c * held_axes.size(), held_axes.size());
    };
    for (std::size_t c = 0; c < size; ++c) {
      answer.assign(column(c).begin(), column(c).end());
      block.solve(answer);
      for (std::size_t r = c; r < size; ++r) {
        double sum = 0;
        for (std::size_t k = 0; k < answer.size(); ++k)
          sum += answer[k] * column(r)[k];
        space.compliance[c * size + r] -= sum;
        if (r > c)
          space.compliance[r * size + c] = space.compliance[c * size + r];
      }
      for (std::size_t k = 0; k < held_axes.size(); ++k)
        space.free[c] += column(c)[k] * contact_force[k];
    }
    return space;
  }

  void space_by_constraints(std::span<const std::uint32_t> nodes) {
    if (!held_columns)
      held_columns.emplace(
          model.nodes.size(), nullptr,
          [this](std::span<const std::uint32_t> some, std::span<double> columns) {
            std::fill(columns.begin(), columns.end(), 0.0);
            for (std::size_t k = 0; k < some.size(); ++k)
              for (int a = 0; a < 3; ++a)
                columns[(3 * k + static_cast<std::size_t>(a)) * axes + axis_of(some[k], a)] = 1;
            solve_held(columns, 3 * some.size());
          },
          static_cast<double>(context.max_memory) / 4, false);
    held_columns->need(nodes);
  }
};

Elastostatic::Elastostatic(const Model& model, std::shared_ptr<ComplianceSource> source,
                           const Context& context, const ElastostaticOptions& options)
    : state_(std::make_unique<State>(model, std::move(source), context, options)) {}
Elastostatic::~Elastostatic() = default;
Elastostatic::Elastostatic(Elastostatic&&) noexcept = default;

void Elastostatic::update(const Load& load) {
  state_->update(load);
}

std::span<const double> Elastostatic::displacement() {
  state_->need_shape();
  return state_->u;
}

const std::vector<NodeVector>& Elastostatic::contact_forces() const noexcept {
  return state_->forces;
}

ContactSpace Elastostatic::contact_space(const Load& load, std::span<const std::uint32_t> nodes) {
  return state_->space(load, nodes);
}

ElastostaticCounts Elastostatic::counts() const noexcept {
  ElastostaticCounts counts = state_->counts;
  counts.solves += state_->compliance.solves();
  counts.factors += state_->compliance.factors();
  counts.columns_read = state_->compliance.cache().columns_read();
  counts.terms = state_->compliance.cache().taken();
  counts.skipped = state_->compliance.cache().skipped();
  return counts;
}

} // namespace gewebe
