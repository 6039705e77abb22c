#include "statics/rotation_warp.h"

#include "numeric/larger.h"
#include "statics/warp_kernel_internal.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <optional>
#include <utility>

namespace gewebe::statics {

namespace {

using Vector = std::vector<double>;
using Rotation = std::array<double, 9>;

constexpr double fair_force = 0.1; ///< of a force's change counts as one of displacements

double largest(std::span<const double> v) {
  double most = 0;
  for (const double x : v)
    most = !(std::abs(x) <= most) ? std::abs(x) : most;
  return most;
}

double sum_of_sizes(std::span<const double> v) {
  double sum = 0;
  for (const double x : v)
    sum += std::abs(x);
  return sum;
}

double largest_difference(std::span<const double> a, std::span<const double> b) {
  double most = 0;
  for (std::size_t k = 0; k < a.size(); ++k)
    most = numeric::larger(most, std::abs(a[k] - b[k]));
  return most;
}

/// r v or rᵀ v of three numbers, in place.
void turn(const Rotation& r, bool back, double* v) {
  const std::array<double, 3> old{v[0], v[1], v[2]};
  for (std::size_t i = 0; i < 3; ++i) {
    v[i] = 0;
    for (std::size_t j = 0; j < 3; ++j)
      v[i] += (back ? r[3 * j + i] : r[3 * i + j]) * old[j];
  }
}

/// What a round finds: from z comes to.
struct Round {
  Vector z, to;
  Vector off; ///< what it changes, as displacements: of these lengths are taken
};

/// Anderson's method for z = map(z), also known as a secant method of several pairs: the
/// combination of earlier changes that leaves the least one.
void mix(std::span<const WarpPair> pairs, const Vector& off, Vector& to) {
  const auto count = static_cast<Eigen::Index>(pairs.size());
  if (count == 0)
    return;
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(count, count);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(count);
  const auto of = [&](Eigen::Index a) { return std::span(pairs[static_cast<std::size_t>(a)].off); };
  for (Eigen::Index a = 0; a < count; ++a) {
    for (std::size_t k = 0; k < off.size(); ++k)
      right[a] += of(a)[k] * off[k];
    for (Eigen::Index b = 0; b <= a; ++b) {
      for (std::size_t k = 0; k < off.size(); ++k)
        normal(a, b) += of(a)[k] * of(b)[k];
      normal(b, a) = normal(a, b);
    }
  }
  normal.diagonal() *= 1 + 1e-10;
  const Eigen::VectorXd share = Eigen::LDLT<Eigen::MatrixXd>(normal).solve(right);
  if (share.allFinite())
    for (Eigen::Index a = 0; a < count; ++a)
      for (std::size_t k = 0; k < to.size(); ++k)
        to[k] -= share[a] * pairs[static_cast<std::size_t>(a)].to[k];
}

/// The change between two rounds, kept with the last ones.
void keep_pair(const Round& before, const Round& now, std::vector<WarpPair>& pairs) {
  constexpr std::size_t depth = 5;
  WarpPair pair{now.off, now.to};
  for (std::size_t k = 0; k < pair.off.size(); ++k)
    pair.off[k] -= before.off[k];
  for (std::size_t k = 0; k < pair.to.size(); ++k)
    pair.to[k] -= before.to[k];
  pairs.insert(pairs.begin(), std::move(pair));
  if (pairs.size() > depth)
    pairs.pop_back();
}

/// inverse times x, by rows.
Vector product(std::span<const double> inverse, std::span<const double> x) {
  Vector y(x.size());
  for (std::size_t r = 0; r < y.size(); ++r)
    for (std::size_t c = 0; c < y.size(); ++c)
      y[r] += inverse[r * y.size() + c] * x[c];
  return y;
}

bool any(std::span<const std::uint8_t> flags) {
  return std::ranges::any_of(flags, [](std::uint8_t f) { return f != 0; });
}

} // namespace

void WarpColumns::set(std::span<const std::uint32_t> nodes,
                      const std::function<void(std::uint32_t, std::span<double>)>& column_of) {
  // Ascending, so that sums do not depend on the order of calls.
  std::vector<std::uint32_t> wanted(nodes.begin(), nodes.end());
  std::ranges::sort(wanted);
  if (wanted == nodes_)
    return;
  const std::size_t size = 3 * rows_; // of a node
  std::vector<float> values(size * wanted.size());
  Vector fresh(size);
  for (std::size_t n = 0; n < wanted.size(); ++n) {
    const auto old = std::ranges::lower_bound(nodes_, wanted[n]);
    if (old != nodes_.end() && *old == wanted[n]) {
      const auto from = static_cast<std::size_t>(old - nodes_.begin());
      std::memcpy(&values[size * n], &values_[size * from], size * sizeof(float));
      continue;
    }
    column_of(wanted[n], fresh);
    for (std::size_t k = 0; k < size; ++k)
      values[size * n + k] = static_cast<float>(fresh[k]);
  }
  nodes_ = std::move(wanted);
  values_ = std::move(values);
  std::vector<std::size_t> all(count());
  for (std::size_t c = 0; c < all.size(); ++c)
    all[c] = c;
  block_ = block_of(all);
  inverse_ = inverse_of(all);
  held_.clear();
  held_columns_.clear();
}

/// A fixed axis does not move: its row and column are those of the identity.
Vector WarpColumns::block_of(std::span<const std::size_t> columns) const {
  const std::size_t size = columns.size();
  Vector block(size * size);
  for (std::size_t r = 0; r < size; ++r)
    for (std::size_t c = 0; c <= r; ++c)
      block[r * size + c] = block[c * size + r] =
          (entry(columns[r], row_of(columns[c])) + entry(columns[c], row_of(columns[r]))) / 2;
  for (std::size_t r = 0; r < size; ++r)
    if (block[r * size + r] == 0)
      block[r * size + r] = 1;
  return block;
}

Vector WarpColumns::inverse_of(std::span<const std::size_t> columns) const {
  const auto size = static_cast<Eigen::Index>(columns.size());
  const Vector block = block_of(columns);
  const Eigen::MatrixXd inverse =
      Eigen::LDLT<Eigen::MatrixXd>(Eigen::Map<const Eigen::MatrixXd>(block.data(), size, size))
          .solve(Eigen::MatrixXd::Identity(size, size));
  return {inverse.data(), inverse.data() + inverse.size()};
}

void WarpColumns::multiply(std::span<double> x) const {
  std::ranges::copy(product(block_, x), x.begin());
}

void WarpColumns::solve(std::span<double> x) const {
  std::ranges::copy(product(inverse_, x), x.begin());
}

void WarpColumns::solve_held(std::span<const std::uint8_t> held, std::span<double> x) const {
  if (!std::ranges::equal(held, held_)) {
    held_columns_.clear();
    for (std::size_t c = 0; c < count(); ++c)
      if (held[c / 3] != 0)
        held_columns_.push_back(c);
    held_inverse_ = held_columns_.size() == count() ? inverse_ : inverse_of(held_columns_);
    held_.assign(held.begin(), held.end());
  }
  Vector part;
  for (const std::size_t c : held_columns_)
    part.push_back(x[c]);
  part = product(held_inverse_, part);
  std::ranges::fill(x, 0.0);
  for (std::size_t k = 0; k < part.size(); ++k)
    x[held_columns_[k]] = part[k];
}

RotationWarp::RotationWarp(const tetrahedra::TetMesh& mesh,
                           std::span<const fem::SolidElement> elements,
                           std::span<const std::uint8_t> fixed, WarpSolve solve,
                           const Context& context)
    : surface_(mesh, elements, fixed, context), solve_(std::move(solve)),
      kernel_(warp_kernel(context.cpu)) {}

WarpWholeLoad RotationWarp::whole_load(Vector over_axes) const {
  WarpWholeLoad load{std::move(over_axes), {}, {}};
  load.on_surface = surface_.on_surface(load.over_axes);
  load.spread.resize(load.on_surface.size());
  surface_.spread(load.on_surface, load.spread);
  return load;
}

void RotationWarp::column_of(std::uint32_t node, std::span<double> columns) const {
  const std::vector<std::uint32_t>& nodes = surface_.nodes();
  const std::size_t rows = 3 * nodes.size();
  Vector over_axes;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    over_axes.assign(3 * surface_.place().size(), 0);
    over_axes[3 * std::size_t{nodes[node]} + axis] = 1;
    solve_(over_axes);
    for (std::size_t k = 0; k < rows; ++k)
      columns[axis * rows + k] = over_axes[3 * std::size_t{nodes[k / 3]} + k % 3];
  }
}

namespace {

/// Which numbers an answer goes on by: local forces at column nodes, what holds the held ones, and
/// the whole load's share of displacements.
struct Unknowns {
  std::size_t forces, whole;
  std::span<double> local(Vector& z) const { return std::span(z).first(forces); }
  std::span<double> holding(Vector& z) const { return std::span(z).subspan(forces, forces); }
  std::span<double> share(Vector& z) const { return std::span(z).subspan(2 * forces, whole); }
};

} // namespace

/// The whole load's share of local displacements, if it has turned since that was found.
void RotationWarp::follow_whole(const WarpWholeLoad& whole, const WarpOptions& options,
                                WarpState& state) const {
  const std::vector<std::uint32_t>& nodes = surface_.nodes();
  const std::size_t rows = 3 * nodes.size();
  Vector back(rows), change(rows);
  surface_.take_back(state.local, state.frames, whole.spread, back);
  for (std::size_t k = 0; k < state.whole_forces.size(); ++k)
    change[k] = back[k] - state.whole_forces[k];
  if (!state.whole_forces.empty() &&
      sum_of_sizes(change) <= options.tolerance * sum_of_sizes(whole.on_surface))
    return;
  Vector all_axes = whole.over_axes;
  for (std::size_t k = 0; k < rows; ++k)
    all_axes[3 * std::size_t{nodes[k / 3]} + k % 3] += back[k] - whole.on_surface[k];
  solve_(all_axes);
  ++state.solves;
  state.whole_forces = std::move(back);
  state.whole_local.resize(rows);
  for (std::size_t k = 0; k < rows; ++k)
    state.whole_local[k] = all_axes[3 * std::size_t{nodes[k / 3]} + k % 3];
}

/// Local forces at column nodes under forces there.
Vector RotationWarp::forces_in_frames(const WarpColumns& columns, std::span<const double> on_nodes,
                                      const WarpState& state) const {
  const std::size_t rows = 3 * surface_.nodes().size(), corners = 3 * surface_.corners(),
                    count = columns.count();
  Vector f(rows), y(rows), back(rows), work(count);
  for (std::size_t c = 0; c < count; ++c)
    f[columns.row_of(c)] = on_nodes[c];
  surface_.spread(f, y);
  surface_.take_back(state.local, state.frames, y, back);
  for (std::size_t k = 0; k < rows; ++k)
    back[k] -= f[k]; // what turning changes
  kernel_.project(columns.values(), rows, corners, back.data(), count, work.data());
  for (std::size_t n = 0; n < count; n += 3) // and what is on middles
    for (std::size_t k = columns.row_of(n); k >= corners && k < columns.row_of(n) + 3; ++k)
      for (std::size_t c = 0; c < count; ++c)
        work[c] += back[k] * columns.entry(c, k);
  columns.solve(work);
  for (std::size_t c = 0; c < count; ++c)
    work[c] += on_nodes[c];
  return work;
}

/// Displacements of the rows from `from` to `to` under local forces and the whole load.
void RotationWarp::combine(const WarpColumns& columns, std::span<const double> forces,
                           std::span<const double> whole, std::size_t from, std::size_t to,
                           std::span<double> local) const {
  if (columns.count() > 0)
    kernel_.combine(columns.values() + from, 3 * surface_.nodes().size(), to - from, forces.data(),
                    columns.count(), &local[from]);
  else
    std::ranges::fill(local.subspan(from, to - from), 0.0);
  for (std::size_t k = from; k < to && !whole.empty(); ++k)
    local[k] += whole[k];
}

void RotationWarp::answer(const WarpLoad& load, WarpState& state,
                          const WarpOptions& options) const {
  const WarpColumns& columns = load.columns;
  const std::size_t rows = 3 * surface_.nodes().size(), corners = 3 * surface_.corners(),
                    count = columns.count();
  const bool holds = any(load.held);
  const auto held = [&](std::size_t c) { return holds && load.held[c / 3] != 0; };
  const Unknowns part{count, load.whole != nullptr ? rows : 0};

  // From the last answer, as far as it is of these nodes.
  state.local.resize(rows);
  state.u.resize(rows);
  if (state.frames.empty())
    state.frames = surface_.turning(state.local);
  Round round;
  round.z.assign(2 * count + part.whole, 0);
  for (std::size_t c = 0; c < count; ++c)
    if (const auto at = std::ranges::lower_bound(state.nodes, columns.nodes()[c / 3]);
        at != state.nodes.end() && *at == columns.nodes()[c / 3]) {
      const std::size_t old = 3 * static_cast<std::size_t>(at - state.nodes.begin()) + c % 3;
      part.local(round.z)[c] = state.local_forces[old];
      part.holding(round.z)[c] = held(c) ? state.holding[old] : 0;
    }
  std::vector<std::uint8_t> flags(load.held.begin(), load.held.end());
  if (state.nodes != columns.nodes() || state.held != flags ||
      (load.whole == nullptr) != state.whole_local.empty()) {
    state.pairs.clear();
    state.nodes = columns.nodes();
    state.held = std::move(flags);
  }
  if (load.whole == nullptr) {
    state.whole_local.clear();
    state.whole_forces.clear();
  } else if (!state.whole_local.empty()) {
    std::ranges::copy(state.whole_local, part.share(round.z).begin());
  }
  state.rounds = state.solves = 0;
  Vector missed(count); // by the held nodes
  const auto find_missed = [&] {
    for (std::size_t c = 0; c < count; ++c)
      missed[c] = held(c) ? load.targets[c] - state.u[columns.row_of(c)] : 0;
  };
  find_missed();

  Vector on_nodes(count), found(rows);
  std::optional<Round> before;
  for (;;) {
    if (load.whole != nullptr)
      follow_whole(*load.whole, options, state);
    for (std::size_t c = 0; c < count; ++c) {
      on_nodes[c] = held(c) ? part.holding(round.z)[c] : load.forces.empty() ? 0 : load.forces[c];
      if (columns.entry(c, columns.row_of(c)) == 0) // fixed
        on_nodes[c] = 0;
    }
    round.to = round.z;
    if (part.whole > 0)
      std::ranges::copy(state.whole_local, part.share(round.to).begin());
    if (count > 0)
      std::ranges::copy(forces_in_frames(columns, on_nodes, state), part.local(round.to).begin());
    if (holds)
      hold(load, state, missed, part.local(round.z), part.local(round.to), part.holding(round.to));
    // What the round changes, at the column nodes as displacements.
    round.off.assign(round.z.size(), 0);
    for (std::size_t k = 0; k < round.off.size(); ++k)
      round.off[k] = round.to[k] - round.z[k];
    columns.multiply(part.local(round.off));
    columns.multiply(part.holding(round.off));
    if (before)
      keep_pair(*before, round, state.pairs);
    Vector next = round.to;
    mix(state.pairs, round.off, next);
    // Secant pairs of earlier answers can be stale. If they cancel most of the residual, a small
    // step is no sign of convergence.
    const auto own = std::min(state.pairs.size(), static_cast<std::size_t>(state.rounds));
    if (state.pairs.size() > own) {
      Vector step = next;
      for (std::size_t k = 0; k < step.size(); ++k)
        step[k] -= round.z[k];
      columns.multiply(part.local(step));
      columns.multiply(part.holding(step));
      if (!(2 * largest(step) >= largest(round.off))) {
        state.pairs.resize(own);
        next = round.to;
        mix(state.pairs, round.off, next);
      }
    }

    const std::size_t known = holds ? rows : corners;
    combine(columns, part.local(next), part.share(next), 0, known, found);
    ++state.rounds;
    const double size = largest(std::span(found).first(corners));
    double change = largest_difference(std::span(state.local).first(corners), found);
    std::swap(state.local, found);
    state.frames = surface_.turning(state.local);
    if (holds) {
      surface_.deform(state.local, state.frames, state.u);
      find_missed();
      change = numeric::larger(change, largest(missed));
    }
    state.change = size == 0 ? 0 : change / size;
    const double force = largest(part.holding(next));
    if (holds && force != 0) // forces have a wider tolerance
      state.change = numeric::larger(
          state.change,
          fair_force * largest_difference(part.holding(next), part.holding(round.z)) / force);
    const bool last = state.change <= options.tolerance || state.rounds >= options.max_rounds;
    if (last && !holds) {
      combine(columns, part.local(next), part.share(next), corners, rows, state.local);
      surface_.deform(state.local, state.frames, state.u);
    }
    if (last) {
      const std::span<const double> local = part.local(next), holding = part.holding(next),
                                    share = part.share(next);
      state.local_forces.assign(local.begin(), local.end());
      state.holding.assign(holding.begin(), holding.end());
      state.whole_local.assign(share.begin(), share.end());
      return;
    }
    before = round;
    round.z = std::move(next);
  }
}

/// Moves held nodes to their places by the displacement that is missing in their frames; the forces
/// that hold them follow. (The other way around, wrong forces of a first round would turn the
/// body.)
void RotationWarp::hold(const WarpLoad& load, const WarpState& state,
                        std::span<const double> missed, std::span<const double> placed,
                        std::span<double> local, std::span<double> holding) const {
  const WarpColumns& columns = load.columns;
  const std::size_t count = columns.count();
  Vector more(missed.begin(), missed.end());
  std::vector<Rotation> turned(count / 3);
  for (std::size_t n = 0; n < count / 3; ++n)
    if (load.held[n] != 0) {
      turned[n] = surface_.rotation(state.frames, columns.nodes()[n]);
      turn(turned[n], true, &more[3 * n]);
    }
  columns.solve_held(load.held, more);
  for (std::size_t n = 0; n < count / 3; ++n) {
    if (load.held[n] == 0)
      continue;
    for (std::size_t c = 3 * n; c < 3 * n + 3; ++c) {
      const double wanted = placed[c] + more[c];
      more[c] = wanted - local[c];
      local[c] = wanted;
    }
    turn(turned[n], false, &more[3 * n]);
    for (std::size_t c = 3 * n; c < 3 * n + 3; ++c)
      holding[c] += more[c];
  }
}

Vector RotationWarp::compliance_at(const WarpLoad& load, const WarpState& state,
                                   std::span<const std::size_t> places) const {
  const WarpColumns& columns = load.columns;
  const std::size_t size = 3 * places.size(), count = columns.count();
  const bool holds = any(load.held);
  std::vector<Rotation> turned;
  for (const std::size_t place : places)
    turned.push_back(surface_.rotation(state.frames, columns.nodes()[place]));
  Vector block(size * size), across(count);
  for (std::size_t r = 0; r < size; ++r) {
    const std::size_t column = 3 * places[r / 3] + r % 3;
    if (holds) {
      for (std::size_t c = 0; c < count; ++c)
        across[c] = load.held[c / 3] != 0 ? columns.entry(column, columns.row_of(c)) : 0;
      columns.solve_held(load.held, across);
    }
    for (std::size_t c = 0; c < size; ++c) {
      const std::size_t other = 3 * places[c / 3] + c % 3;
      double value = columns.entry(column, columns.row_of(other));
      for (std::size_t k = 0; holds && k < count; ++k)
        if (load.held[k / 3] != 0)
          value -= across[k] * columns.entry(other, columns.row_of(k));
      block[r * size + c] = value;
    }
  }
  // R block Rᵀ
  for (std::size_t r = 0; r < size; ++r)
    for (std::size_t n = 0; n < places.size(); ++n)
      turn(turned[n], false, &block[r * size + 3 * n]);
  for (std::size_t c = 0; c < size; ++c)
    for (std::size_t n = 0; n < places.size(); ++n) {
      std::array<double, 3> v{};
      for (std::size_t i = 0; i < 3; ++i)
        v[i] = block[(3 * n + i) * size + c];
      turn(turned[n], false, v.data());
      for (std::size_t i = 0; i < 3; ++i)
        block[(3 * n + i) * size + c] = v[i];
    }
  for (std::size_t r = 0; r < size; ++r)
    for (std::size_t c = 0; c < r; ++c)
      block[r * size + c] = block[c * size + r] = (block[r * size + c] + block[c * size + r]) / 2;
  return block;
}

Vector RotationWarp::whole_local(const WarpLoad& load, const WarpState& state) const {
  const std::vector<std::uint32_t>& nodes = surface_.nodes();
  const std::size_t rows = 3 * nodes.size();
  Vector over_axes =
      load.whole != nullptr ? load.whole->over_axes : Vector(3 * surface_.place().size());
  const auto axis_of = [&](std::size_t k) { return 3 * std::size_t{nodes[k / 3]} + k % 3; };
  for (std::size_t k = 0; k < rows && load.whole != nullptr; ++k)
    over_axes[axis_of(k)] += state.whole_forces[k] - load.whole->on_surface[k];
  for (std::size_t c = 0; c < state.local_forces.size(); ++c)
    over_axes[axis_of(3 * std::size_t{state.nodes[c / 3]} + c % 3)] += state.local_forces[c];
  solve_(over_axes);
  return over_axes;
}

Vector RotationWarp::whole_shape(const WarpState& state,
                                 std::span<const double> whole_local) const {
  Vector turned(state.u.size());
  for (std::size_t k = 0; k < turned.size(); ++k)
    turned[k] = state.u[k] - state.local[k];
  Vector shape = surface_.extend(turned);
  for (std::size_t k = 0; k < shape.size(); ++k)
    shape[k] += whole_local[k];
  for (std::size_t k = 0; k < state.u.size(); ++k)
    shape[3 * std::size_t{surface_.nodes()[k / 3]} + k % 3] = state.u[k];
  return shape;
}

} // namespace gewebe::statics
