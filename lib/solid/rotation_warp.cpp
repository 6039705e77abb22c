#include "solid/rotation_warp.h"

#include "base/error.h"
#include "solid/warp_kernel_internal.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <string>
#include <utility>

namespace gewebe {

namespace {

using Vector = std::vector<double>;

double largest(std::span<const double> v) {
  double most = 0;
  for (const double x : v)
    most = !(std::abs(x) <= most) ? std::abs(x) : most;
  return most;
}

struct FixedPoint {
  Vector x;
  double change = 0;
  int rounds = 0;
};

/// x = map(x) by Anderson's method: the combination of the last rounds whose changes cancel best.
FixedPoint fixed_point(const std::function<Vector(const Vector&)>& map, Vector start,
                       const WarpOptions& options) {
  constexpr std::size_t depth = 3;
  FixedPoint result{std::move(start), HUGE_VAL, 0};
  std::vector<Vector> places, changes; // the latest first
  while (result.rounds < options.max_rounds && !(result.change <= options.tolerance)) {
    Vector next = map(result.x), change(next.size());
    for (std::size_t k = 0; k < next.size(); ++k)
      change[k] = next[k] - result.x[k];
    ++result.rounds;
    const double size = largest(next);
    result.change = size > 0 ? largest(change) / size : 0;
    places.insert(places.begin(), next);
    changes.insert(changes.begin(), change);
    if (places.size() > depth + 1) {
      places.pop_back();
      changes.pop_back();
    }
    const auto older = static_cast<Eigen::Index>(places.size()) - 1;
    Eigen::MatrixXd normal(older, older);
    Eigen::VectorXd right(older);
    const auto differences = [&](Eigen::Index a, std::size_t k) {
      return changes[0][k] - changes[static_cast<std::size_t>(a) + 1][k];
    };
    for (Eigen::Index a = 0; a < older; ++a) {
      right[a] = 0;
      for (std::size_t k = 0; k < next.size(); ++k)
        right[a] += differences(a, k) * changes[0][k];
      for (Eigen::Index b = 0; b <= a; ++b) {
        normal(a, b) = 0;
        for (std::size_t k = 0; k < next.size(); ++k)
          normal(a, b) += differences(a, k) * differences(b, k);
        normal(b, a) = normal(a, b);
      }
    }
    if (older > 0) {
      normal.diagonal() *= 1 + 1e-10;
      const Eigen::LDLT<Eigen::MatrixXd> solver(normal);
      const Eigen::VectorXd share = solver.solve(right);
      if (share.allFinite())
        for (Eigen::Index a = 0; a < older; ++a)
          for (std::size_t k = 0; k < next.size(); ++k)
            next[k] -= share[a] * (places[0][k] - places[static_cast<std::size_t>(a) + 1][k]);
    }
    result.x.swap(next);
  }
  return result;
}

/// columns.inverse times v: forces at the nodes that displace them so.
Vector forces_for(const WarpColumns& columns, std::span<const double> v) {
  Vector q(v.size());
  for (std::size_t r = 0; r < q.size(); ++r)
    for (std::size_t c = 0; c < q.size(); ++c)
      q[r] += columns.inverse[r * q.size() + c] * v[c];
  return q;
}

} // namespace

RotationWarp::RotationWarp(const TetMesh& mesh, std::span<const SolidElement> elements,
                           std::span<const std::uint8_t> fixed, const StiffnessMatrix& matrix,
                           const Factor& factor, const Context& context)
    : surface_(mesh, elements, fixed, context), matrix_(matrix), factor_(factor),
      kernel_(warp_kernel(context.cpu)) {}

void RotationWarp::combine(const WarpColumns& columns, std::span<const double> coefficients,
                           std::size_t nodes, std::span<double> u) const {
  kernel_.combine(columns.values.data(), 3 * surface_.nodes().size(), 3 * nodes,
                  coefficients.data(), coefficients.size(), u.data());
}

std::vector<double> RotationWarp::project(const WarpColumns& columns,
                                          std::span<const double> forces) const {
  const std::size_t rows = 3 * surface_.nodes().size();
  Vector moved(columns.count());
  const bool everywhere = !columns.loads.empty();
  kernel_.project(columns.values.data(), rows, everywhere ? rows : 3 * surface_.corners(),
                  forces.data(), moved.size(), moved.data());
  for (const std::uint32_t node : columns.nodes)
    for (std::size_t k = 3 * std::size_t{node};
         !everywhere && node >= surface_.corners() && k < 3 * std::size_t{node} + 3; ++k)
      for (std::size_t c = 0; c < moved.size(); ++c)
        moved[c] += forces[k] * static_cast<double>(columns.values[c * rows + k]);
  return moved;
}

WarpedShape RotationWarp::shape(std::span<const double> load, std::span<const double> start,
                                const WarpOptions& options) const {
  const std::vector<std::uint32_t>& nodes = surface_.nodes();
  const Vector on_surface = surface_.on_surface(load);
  Vector y(on_surface.size()), forces(y.size()), local(load.begin(), load.end()), all(load.size());
  surface_.spread(on_surface, y);
  const auto solved = [&] {
    solve_axes(matrix_, factor_, local, all);
    Vector u(on_surface.size());
    for (std::size_t k = 0; k < u.size(); ++k)
      u[k] = all[3 * std::size_t{nodes[k / 3]} + k % 3];
    return u;
  };
  const auto round = [&](const Vector& u) {
    surface_.take_back(u, y, forces);
    std::ranges::copy(load, local.begin());
    for (std::size_t k = 0; k < forces.size(); ++k)
      local[3 * std::size_t{nodes[k / 3]} + k % 3] += forces[k] - on_surface[k];
    return solved();
  };
  FixedPoint found =
      fixed_point(round, start.empty() ? solved() : Vector(start.begin(), start.end()), options);
  WarpedShape shape{Vector(found.x.size()), std::move(found.x), found.change, found.rounds};
  surface_.deform(shape.local, shape.u);
  return shape;
}

WarpColumns RotationWarp::columns(std::span<const std::uint32_t> nodes,
                                  std::span<const double> loads) const {
  WarpColumns columns;
  columns.nodes.assign(nodes.begin(), nodes.end());
  const std::vector<std::uint32_t>& surface = surface_.nodes();
  const std::size_t axes = matrix_.row_of_axis.size(), rows = 3 * surface.size();
  for (std::size_t k = 0; k < loads.size(); k += axes)
    columns.loads.push_back(surface_.on_surface(loads.subspan(k, axes)));
  const std::size_t of_nodes = 3 * nodes.size(), count = columns.count();
  const auto axis_of = [&](std::size_t c) {
    return 3 * std::size_t{surface[nodes[c / 3]]} + c % 3;
  };
  for (std::size_t c = 0; c < of_nodes; ++c)
    if (matrix_.row_of_axis[axis_of(c)] < 0)
      throw Error("node " + std::to_string(axis_of(c) / 3) +
                  " is fixed, expected one that forces move");
  columns.values.resize(rows * count);
  Eigen::MatrixXd own(static_cast<Eigen::Index>(count), static_cast<Eigen::Index>(count));
  Vector load(axes), u(axes);
  for (std::size_t c = 0; c < count; ++c) {
    std::ranges::fill(load, 0.0);
    if (c < of_nodes)
      load[axis_of(c)] = 1;
    else
      std::ranges::copy(loads.subspan((c - of_nodes) * axes, axes), load.begin());
    solve_axes(matrix_, factor_, load, u);
    for (std::size_t k = 0; k < rows; ++k)
      columns.values[c * rows + k] = static_cast<float>(u[3 * std::size_t{surface[k / 3]} + k % 3]);
    for (std::size_t r = 0; r < count; ++r) {
      double work = 0;
      if (r < of_nodes)
        work = u[axis_of(r)];
      else
        for (std::size_t axis = 0; axis < axes; ++axis)
          work += u[axis] * loads[(r - of_nodes) * axes + axis];
      own(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c)) = work;
    }
  }
  const Eigen::MatrixXd inverse =
      Eigen::LDLT<Eigen::MatrixXd>(own).solve(Eigen::MatrixXd::Identity(own.rows(), own.cols()));
  columns.inverse.resize(count * count);
  for (std::size_t r = 0; r < count; ++r)
    for (std::size_t c = 0; c < count; ++c)
      columns.inverse[r * count + c] =
          inverse(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c));
  return columns;
}

WarpedShape RotationWarp::shape(const WarpColumns& columns, std::span<const double> load,
                                std::span<const double> start, const WarpOptions& options) const {
  const std::size_t rows = 3 * surface_.nodes().size(), of_nodes = 3 * columns.nodes.size();
  Vector f(rows), y(rows), u(rows), forces(rows);
  for (std::size_t k = 0; k < of_nodes; ++k)
    f[3 * std::size_t{columns.nodes[k / 3]} + k % 3] = load[k];
  for (std::size_t n = 0; n < columns.loads.size(); ++n)
    for (std::size_t k = 0; k < rows; ++k)
      f[k] += load[of_nodes + n] * columns.loads[n][k];
  surface_.spread(f, y);
  FixedPoint found = fixed_point(
      [&](const Vector& q) {
        combine(columns, q, surface_.corners(), u);
        surface_.take_back(u, y, forces);
        for (std::size_t k = 0; k < rows; ++k) // what turning changes
          forces[k] -= f[k];
        Vector next = forces_for(columns, project(columns, forces));
        for (std::size_t k = 0; k < next.size(); ++k)
          next[k] += load[k];
        return next;
      },
      start.empty() ? Vector(load.begin(), load.end()) : Vector(start.begin(), start.end()),
      options);
  combine(columns, found.x, surface_.nodes().size(), u);
  WarpedShape shape{Vector(rows), std::move(found.x), found.change, found.rounds};
  surface_.deform(u, shape.u);
  return shape;
}

WarpedForces RotationWarp::forces(const WarpColumns& columns, std::span<const double> targets,
                                  std::span<const double> start, const WarpOptions& options) const {
  const std::size_t rows = 3 * surface_.nodes().size(), count = targets.size();
  Vector u(rows), x(rows), f(rows), y(rows), back(rows);
  const auto turned = [&](std::span<const double> v, bool to_local) {
    Vector result(count);
    for (std::size_t n = 0; n < columns.nodes.size(); ++n) {
      const std::array<double, 9> r = surface_.rotation(u, columns.nodes[n]);
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j)
          result[3 * n + i] += (to_local ? r[3 * j + i] : r[3 * i + j]) * v[3 * n + j];
    }
    return result;
  };

  // Linear displacements of the nodes, corrected in their frames by what is missing.
  Vector local(targets.begin(), targets.end());
  if (!start.empty()) {
    combine(columns, start, surface_.nodes().size(), u);
    for (std::size_t k = 0; k < count; ++k)
      local[k] = u[3 * std::size_t{columns.nodes[k / 3]} + k % 3];
  }
  FixedPoint found = fixed_point(
      [&](const Vector& v) {
        combine(columns, forces_for(columns, v), surface_.nodes().size(), u);
        surface_.deform(u, x);
        Vector missing(count);
        for (std::size_t k = 0; k < count; ++k)
          missing[k] = targets[k] - x[3 * std::size_t{columns.nodes[k / 3]} + k % 3];
        missing = turned(missing, true);
        for (std::size_t k = 0; k < count; ++k)
          missing[k] += v[k];
        return missing;
      },
      std::move(local), options);
  WarpedForces result;
  result.shape.local = forces_for(columns, found.x);
  result.shape.change = found.change;
  result.shape.rounds = found.rounds;
  combine(columns, result.shape.local, surface_.nodes().size(), u);
  result.shape.u.resize(rows);
  surface_.deform(u, result.shape.u);

  // The forces whose work with each column is that of the local ones.
  const auto apply = [&](const Vector& on_nodes) {
    for (std::size_t k = 0; k < count; ++k)
      f[3 * std::size_t{columns.nodes[k / 3]} + k % 3] = on_nodes[k];
    surface_.spread(f, y);
    surface_.take_back(u, y, back);
    return forces_for(columns, project(columns, back));
  };
  FixedPoint balance = fixed_point(
      [&](const Vector& forces) {
        Vector missing = apply(forces);
        for (std::size_t k = 0; k < count; ++k)
          missing[k] = result.shape.local[k] - missing[k];
        missing = turned(missing, false);
        for (std::size_t k = 0; k < count; ++k)
          missing[k] += forces[k];
        return missing;
      },
      turned(result.shape.local, false), options);
  result.forces = std::move(balance.x);
  result.shape.change = std::max(result.shape.change, balance.change);
  result.shape.rounds += balance.rounds;
  return result;
}

} // namespace gewebe
