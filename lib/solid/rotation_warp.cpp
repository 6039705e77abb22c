#include "solid/rotation_warp.h"

#include "solid/warp_kernel_internal.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <utility>

namespace gewebe {

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
    most = !(std::abs(a[k] - b[k]) <= most) ? std::abs(a[k] - b[k]) : most;
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

/// Anderson's method for x = map(x): the combination of the last rounds whose changes cancel best.
class Mixing {
public:
  /// \return what to go on from, behind map(from) = to
  Vector next(const Vector& from, Vector to) {
    Vector change(to.size());
    for (std::size_t k = 0; k < to.size(); ++k)
      change[k] = to[k] - from[k];
    places_.insert(places_.begin(), to);
    changes_.insert(changes_.begin(), std::move(change));
    if (places_.size() > depth + 1) {
      places_.pop_back();
      changes_.pop_back();
    }
    const auto older = static_cast<Eigen::Index>(places_.size()) - 1;
    if (older == 0)
      return to;
    const auto difference = [&](Eigen::Index a, std::size_t k) {
      return changes_[0][k] - changes_[static_cast<std::size_t>(a) + 1][k];
    };
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(older, older);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(older);
    for (Eigen::Index a = 0; a < older; ++a) {
      for (std::size_t k = 0; k < to.size(); ++k)
        right[a] += difference(a, k) * changes_[0][k];
      for (Eigen::Index b = 0; b <= a; ++b) {
        for (std::size_t k = 0; k < to.size(); ++k)
          normal(a, b) += difference(a, k) * difference(b, k);
        normal(b, a) = normal(a, b);
      }
    }
    normal.diagonal() *= 1 + 1e-10;
    const Eigen::VectorXd share = Eigen::LDLT<Eigen::MatrixXd>(normal).solve(right);
    if (share.allFinite())
      for (Eigen::Index a = 0; a < older; ++a)
        for (std::size_t k = 0; k < to.size(); ++k)
          to[k] -= share[a] * (places_[0][k] - places_[static_cast<std::size_t>(a) + 1][k]);
    return to;
  }

private:
  static constexpr std::size_t depth = 3;
  std::vector<Vector> places_, changes_; // the latest first
};

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
  // Ascending, so that sums don't depend on who came when.
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
  inverse_ = inverse_of(all);
  held_.clear();
  held_columns_.clear();
}

/// An axis that is fixed gives way to nothing: its row and column are those of the identity.
Vector WarpColumns::inverse_of(std::span<const std::size_t> columns) const {
  const auto size = static_cast<Eigen::Index>(columns.size());
  const auto row_of = [&](std::size_t c) { return 3 * std::size_t{nodes_[c / 3]} + c % 3; };
  Eigen::MatrixXd block(size, size);
  for (Eigen::Index r = 0; r < size; ++r)
    for (Eigen::Index c = 0; c <= r; ++c) {
      const std::size_t a = columns[static_cast<std::size_t>(r)],
                        b = columns[static_cast<std::size_t>(c)];
      block(r, c) = block(c, r) = (entry(a, row_of(b)) + entry(b, row_of(a))) / 2;
    }
  for (Eigen::Index r = 0; r < size; ++r)
    if (block(r, r) == 0)
      block(r, r) = 1;
  const Eigen::MatrixXd inverse =
      Eigen::LDLT<Eigen::MatrixXd>(block).solve(Eigen::MatrixXd::Identity(size, size));
  return {inverse.data(), inverse.data() + inverse.size()};
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

RotationWarp::RotationWarp(const TetMesh& mesh, std::span<const SolidElement> elements,
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

void RotationWarp::answer(const WarpLoad& load, WarpState& state,
                          const WarpOptions& options) const {
  const WarpColumns& columns = load.columns;
  const std::vector<std::uint32_t>& nodes = surface_.nodes();
  const std::size_t rows = 3 * nodes.size(), corners = 3 * surface_.corners(),
                    count = columns.count();
  const bool holds = any(load.held);
  const auto row_of = [&](std::size_t c) {
    return 3 * std::size_t{columns.nodes()[c / 3]} + c % 3;
  };
  const auto held = [&](std::size_t c) { return holds && load.held[c / 3] != 0; };

  // The last answer.
  Vector local = std::move(state.local), u = std::move(state.u), holding(count),
         by_place(count); // local forces that put the held nodes where they are
  local.resize(rows);
  u.resize(rows);
  for (std::size_t c = 0; c < count; ++c)
    if (const auto at = std::ranges::lower_bound(state.nodes, columns.nodes()[c / 3]);
        held(c) && at != state.nodes.end() && *at == columns.nodes()[c / 3]) {
      const std::size_t old = 3 * static_cast<std::size_t>(at - state.nodes.begin()) + c % 3;
      holding[c] = state.holding[old];
      by_place[c] = state.local_forces[old];
    }
  Vector missed(count); // by the held nodes, last
  const auto find_missed = [&] {
    for (std::size_t c = 0; c < count; ++c)
      missed[c] = held(c) ? load.targets[c] - u[row_of(c)] : 0;
  };
  find_missed();
  state.nodes = columns.nodes();
  state.local_forces.assign(count, 0);
  state.rounds = state.solves = 0;
  if (load.whole == nullptr) {
    state.whole_local.clear();
    state.whole_forces.clear();
  }
  double softest = 0; // turns forces into displacements of a like size
  for (std::size_t c = 0; c < count; ++c)
    softest = std::max(softest, columns.entry(c, row_of(c)));

  Vector f(rows), y(rows), last_f, back(rows), work(count), all_axes, found(rows);
  Mixing mixing;
  for (;;) {
    const Vector frames = surface_.turning(local);
    if (load.whole != nullptr) {
      surface_.take_back(local, frames, load.whole->spread, back);
      Vector change = back;
      for (std::size_t k = 0; k < state.whole_forces.size(); ++k)
        change[k] -= state.whole_forces[k];
      if (state.whole_forces.empty() ||
          !(sum_of_sizes(change) <= options.tolerance * sum_of_sizes(load.whole->on_surface))) {
        state.whole_forces = back;
        all_axes = load.whole->over_axes;
        for (std::size_t k = 0; k < rows; ++k)
          all_axes[3 * std::size_t{nodes[k / 3]} + k % 3] += back[k] - load.whole->on_surface[k];
        solve_(all_axes);
        ++state.solves;
        state.whole_local.resize(rows);
        for (std::size_t k = 0; k < rows; ++k)
          state.whole_local[k] = all_axes[3 * std::size_t{nodes[k / 3]} + k % 3];
      }
    }
    if (count > 0) {
      for (std::size_t c = 0; c < count; ++c)
        f[row_of(c)] = held(c) ? holding[c] : load.forces.empty() ? 0 : load.forces[c];
      if (f != last_f) {
        surface_.spread(f, y);
        last_f = f;
      }
      surface_.take_back(local, frames, y, back);
      for (std::size_t k = 0; k < rows; ++k)
        back[k] -= f[k]; // what turning changes
      kernel_.project(columns.values(), rows, corners, back.data(), count, work.data());
      for (std::size_t n = 0; n < count; n += 3) // and what is on middles
        for (std::size_t k = row_of(n); k >= corners && k < row_of(n) + 3; ++k)
          for (std::size_t c = 0; c < count; ++c)
            work[c] += back[k] * columns.entry(c, k);
      columns.solve(work);
      for (std::size_t c = 0; c < count; ++c)
        state.local_forces[c] = f[row_of(c)] + work[c];
    }
    // Held nodes go where they must by what is missing in their frames; what holds them follows.
    // (The other way around, wrong forces of a first round would turn the body.)
    const Vector placed_before = by_place, held_before = holding;
    if (holds) {
      Vector more = missed;
      std::vector<Rotation> turned(count / 3);
      for (std::size_t n = 0; n < count / 3; ++n)
        if (held(3 * n)) {
          turned[n] = surface_.rotation(frames, columns.nodes()[n]);
          turn(turned[n], true, &more[3 * n]);
        }
      columns.solve_held(load.held, more);
      for (std::size_t n = 0; n < count / 3; ++n)
        for (std::size_t c = 3 * n; held(c) && c < 3 * n + 3; ++c) {
          by_place[c] += more[c];
          more[c] = by_place[c] - state.local_forces[c];
          state.local_forces[c] = by_place[c];
        }
      for (std::size_t n = 0; n < count / 3; ++n)
        if (held(3 * n))
          turn(turned[n], false, &more[3 * n]);
      for (std::size_t c = 0; c < count; ++c)
        holding[c] += held(c) ? more[c] : 0;
    }
    const auto combine = [&](std::size_t from, std::size_t to) {
      if (count > 0)
        kernel_.combine(columns.values() + from, rows, to - from, state.local_forces.data(), count,
                        &found[from]);
      else
        std::fill(found.begin() + static_cast<std::ptrdiff_t>(from),
                  found.begin() + static_cast<std::ptrdiff_t>(to), 0.0);
      for (std::size_t k = from; k < to && load.whole != nullptr; ++k)
        found[k] += state.whole_local[k];
    };
    const std::size_t known = holds ? rows : corners;
    combine(0, known);
    ++state.rounds;
    const double size = largest(std::span(found).first(corners));
    double change = largest_difference(std::span(local).first(corners), found);
    Vector from, to; // corners; forces that hold; places of the held
    const auto gather = [&](Vector& into, const Vector& displacement, const Vector& placed,
                            const Vector& forces) {
      into.assign(displacement.begin(),
                  displacement.begin() + static_cast<std::ptrdiff_t>(corners));
      for (std::size_t c = 0; c < count; ++c)
        if (held(c)) {
          into.push_back(softest * placed[c]);
          into.push_back(softest * forces[c]);
          into.push_back(missed[c]);
        }
    };
    gather(from, local, placed_before, held_before);
    if (holds) {
      surface_.deform(found, u);
      find_missed();
      change = std::max(change, largest(missed));
    }
    state.change = size > 0 ? change / size : 0;
    if (holds) { // of forces less is asked
      const double force = largest(holding);
      if (force > 0)
        state.change =
            std::max(state.change, fair_force * largest_difference(holding, held_before) / force);
    }
    if (state.change <= options.tolerance || state.rounds >= options.max_rounds) {
      if (!holds) {
        combine(corners, rows);
        surface_.deform(found, u);
      }
      break;
    }
    gather(to, found, by_place, holding);
    const Vector mixed = mixing.next(from, std::move(to));
    std::copy_n(mixed.begin(), corners, local.begin());
    for (std::size_t c = 0, k = corners; c < count; ++c)
      if (held(c)) {
        by_place[c] = softest > 0 ? mixed[k] / softest : 0;
        holding[c] = softest > 0 ? mixed[k + 1] / softest : 0;
        missed[c] = mixed[k + 2];
        k += 3;
      }
  }
  state.local = std::move(found);
  state.u = std::move(u);
  state.holding = std::move(holding);
}

Vector RotationWarp::compliance_at(const WarpLoad& load, const WarpState& state,
                                   std::span<const std::size_t> places) const {
  const WarpColumns& columns = load.columns;
  const std::size_t size = 3 * places.size(), count = columns.count();
  const bool holds = any(load.held);
  std::vector<Rotation> turned;
  const Vector frames = surface_.turning(state.local);
  for (const std::size_t place : places)
    turned.push_back(surface_.rotation(frames, columns.nodes()[place]));
  const auto row_of = [&](std::size_t c) {
    return 3 * std::size_t{columns.nodes()[c / 3]} + c % 3;
  };
  Vector block(size * size), across(count);
  for (std::size_t r = 0; r < size; ++r) {
    const std::size_t column = 3 * places[r / 3] + r % 3;
    if (holds) {
      for (std::size_t c = 0; c < count; ++c)
        across[c] = load.held[c / 3] != 0 ? columns.entry(column, row_of(c)) : 0;
      columns.solve_held(load.held, across);
    }
    for (std::size_t c = 0; c < size; ++c) {
      const std::size_t other = 3 * places[c / 3] + c % 3;
      double value = columns.entry(column, row_of(other));
      for (std::size_t k = 0; holds && k < count; ++k)
        if (load.held[k / 3] != 0)
          value -= across[k] * columns.entry(other, row_of(k));
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

} // namespace gewebe
