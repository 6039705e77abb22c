#include "statics/held_contacts.h"

#include "compliance/load_answer.h"
#include "fem/model_stiffness.h"
#include "geometry/vector_at.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace gewebe::statics {

namespace {

template <class Map>
bool same_nodes(const Map& a, const Map& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const auto& x, const auto& y) { return x.first == y.first; });
}

} // namespace

void HeldContacts::refactor(const contact::Load& now) {
  if (now_.held && same_nodes(now.displacement, now_.held->nodes))
    return;
  if (!stiffness_)
    stiffness_.emplace(model_, context_);
  now_ = {};
  auto made = std::make_shared<Held>();
  std::vector<std::uint8_t> fixed(axes_, 0);
  for (const auto& entry : now.displacement)
    std::fill_n(fixed.begin() + static_cast<std::ptrdiff_t>(axis_of(entry.first, 0)), 3, 1);
  bool any_free = false;
  for (std::uint32_t i = 0; i < model_.nodes.size() && !any_free; ++i)
    for (int a = 0; a < 3; ++a)
      any_free = any_free || (fixed[axis_of(i, a)] == 0 && !contact::is_fixed(model_, i, a));
  if (any_free) {
    ++factors_;
    if (free_) {
      model::Model held = model_;
      for (const auto& entry : now.displacement)
        held.nodes[entry.first].fixed = model::fixed_all;
      made->solver.emplace(compliance::factorise_axes(held, context_));
    } else {
      made->solver.emplace(compliance::factorise_axes(model_, fixed, context_));
    }
  }
  made->nodes = now.displacement;
  now_.held = std::move(made);
}

void HeldContacts::solve(const Held& held, std::span<double> over_axes, std::size_t columns) {
  if (!held.solver) {
    std::fill(over_axes.begin(), over_axes.end(), 0.0);
    return;
  }
  held.solver->solve(over_axes, columns);
  solves_ += columns;
}

/// The shape under f (over all axes) and these displacements.
void HeldContacts::shape_under(std::span<const double> f, std::span<const double> prescribed,
                               std::vector<double>& shape) {
  std::vector<double> product(axes_, 0);
  stiffness_->multiply(prescribed, product);
  shape.resize(axes_);
  for (std::size_t r = 0; r < axes_; ++r)
    shape[r] = (f.empty() ? 0 : f[r]) - product[r];
  solve(*now_.held, shape, 1);
  for (std::size_t r = 0; r < axes_; ++r)
    shape[r] += prescribed[r]; // on held axes the solution is 0
}

std::vector<contact::NodeVector> HeldContacts::meet(const contact::Load& now,
                                                    std::vector<double>& u) {
  refactor(now);
  Held& held = *now_.held;
  const std::vector<double> f = compliance::forces_over_axes(model_, now);
  std::vector<double> wanted(3 * now.displacement.size()), prescribed(axes_, 0);
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
  const bool rigid = held.solver && now_.modes->express(wanted, coefficients, rest);
  if (!held.solver) { // no axis is free
    spread(wanted, 1);
    shape = std::move(prescribed);
  } else if (rigid || now_.modes->open()) {
    if (held.base.empty() || held.base_gravity != now.gravity || held.base_force != now.force) {
      shape_under(f, prescribed, held.base);
      held.base_gravity = now.gravity;
      held.base_force = now.force;
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
      shape_under({}, prescribed, answer);
      for (double& r : rest)
        r /= length;
      now_.modes.write().add(rest, std::move(answer));
      coefficients.push_back(length);
    }
    shape = held.base;
    now_.modes->answer(coefficients, shape);
  } else {
    if (now_.modes->size() > 0)
      now_.modes.write().give_up();
    spread(wanted, 1);
    shape_under(f, prescribed, shape);
  }
  for (const auto& [node, d] : now.displacement)
    for (int a = 0; a < 3; ++a)
      shape[axis_of(node, a)] = d[a];
  std::vector<double> product(axes_, 0);
  stiffness_->multiply(shape, product);
  std::vector<contact::NodeVector> forces;
  for (const auto& entry : now.displacement) {
    Vec3 force;
    for (int a = 0; a < 3; ++a)
      if (!contact::is_fixed(model_, entry.first, a))
        force[a] = product[axis_of(entry.first, a)] - f[axis_of(entry.first, a)];
    forces.push_back({entry.first, force});
  }
  u = std::move(shape);
  return forces;
}

const columns::ColumnCache& HeldContacts::columns(std::span<const std::uint32_t> nodes) {
  Held& held = *now_.held;
  if (!held.columns)
    held.columns.emplace(
        model_.nodes.size(), nullptr,
        [this, &held](std::span<const std::uint32_t> some, std::span<double> columns) {
          std::fill(columns.begin(), columns.end(), 0.0);
          for (std::size_t k = 0; k < some.size(); ++k)
            for (int a = 0; a < 3; ++a)
              columns[(3 * k + static_cast<std::size_t>(a)) * axes_ + axis_of(some[k], a)] = 1;
          solve(held, columns, 3 * some.size());
        },
        static_cast<double>(context_.max_memory) / 4, false);
  held.columns->need(nodes);
  return *held.columns;
}

} // namespace gewebe::statics
