#include "contact/contact_solver.h"
#include "statics/contact_turns_internal.h"

#include "base/vector_at.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

namespace gewebe {

namespace {

using Eigen::Index, Eigen::MatrixXd, Eigen::VectorXd;

constexpr double same_place = 1e-9; ///< of the radius, and of a normal's length
constexpr double fair_place = 1e-6; ///< that is not worth a warning
constexpr double outside = 1e-9;    ///< of the radius: so deep is not inside
constexpr double immovable = 1e-12; ///< of the largest compliance
constexpr double nearly = 0.03;     ///< from where on each turn comes nearer
constexpr double most_softer = 8;   ///< by which forces make their points give way more
constexpr double short_way = 0.1;
constexpr int max_turns = 60;
constexpr int max_vain = 3; ///< turns whose forces were not found
constexpr int max_sweeps = 200;
constexpr double least_square = 1e-6; ///< of weights of nodes that give way
constexpr int max_idle = 20;          ///< turns on end that came no nearer

std::array<Vec3, 3> corners_of(const Facet& piece, std::span<const Vec3> at) {
  return {at[piece[0]], at[piece[1]], at[piece[2]]};
}

auto key_of(const TouchPair& p) {
  return std::tuple(p.instrument, p.part, p.piece);
}

/// Corners that a point depends on, ascending and last repeated: the same for pieces that share it.
Facet support_of(const TouchPair& p) {
  Facet all{};
  std::size_t count = 0;
  for (std::size_t c = 0; c < 3; ++c)
    if (p.point.weights[c] > 0)
      all[count++] = p.piece[c];
  std::sort(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(count));
  for (std::size_t c = count; c < 3; ++c)
    all[c] = all[count - 1];
  return all;
}

class Turns {
public:
  Turns(const DelassusOperator& delassus, const ContactNodes& nodes, std::span<const Vec3> free,
        std::span<const std::optional<PlacedInstrument>> placed,
        std::span<const std::optional<MovedInstrument>> moved, ContactTurns& turns)
      : nodes_(nodes), free_(free), placed_(placed), moved_(moved), turns_(turns),
        size_(static_cast<Index>(3 * nodes.moving)), w_(delassus.compliance.data(), size_, size_) {}

  void run() {
    const std::vector<Vec3> last =
        std::exchange(turns_.at, std::vector<Vec3>(free_.begin(), free_.end()));
    largest_ = size_ > 0 ? w_.diagonal().maxCoeff() : 0;
    std::ranges::sort(turns_.pairs, {}, key_of);
    join(nodes_.was, 0);
    join(free_, outside);
    const bool known = last.size() == free_.size(); // of a round before
    at_ = known ? last : nodes_.was;
    turns_.solved = turns_.pairs.empty();
    double before = HUGE_VAL;
    double best = HUGE_VAL;
    int vain = 0, since_best = 0;
    for (turns_.turns = 0; turns_.turns < max_turns && !turns_.pairs.empty(); ++turns_.turns) {
      locate(at_);
      const bool bend = known || turns_.turns > 0;
      bool exact = solve(bend, false);
      double change = changed(), part = 1;
      if (turns_.turns > 0 && !(change < nearly && change < before)) {
        part = shorten();
        if (part < short_way) { // it leads up
          exact = solve(bend, true);
          change = changed();
          part = shorten();
        }
      }
      vain += exact ? 0 : 1;
      const bool joined = join(turns_.at, outside);
      turns_.solved = exact && !joined && change <= fair_place;
      since_best = joined || change < 0.8 * best ? 0 : since_best + 1;
      best = joined ? HUGE_VAL : std::min(best, change);
      if ((!joined && change <= same_place) || vain == max_vain || since_best == max_idle)
        break;
      before = change;
      at_ = turns_.at;
      forces_ = next_forces_;
    }
    if (!turns_.solved)
      move_out();
  }

private:
  /// Whatever the forces are, nothing stays inside: the nodes around move alike.
  void move_out() {
    for (int sweep = 0; sweep < max_sweeps; ++sweep) {
      bool clear = true;
      for (const TouchPair& p : turns_.pairs) {
        const PlacedInstrument& instrument = *placed_[p.instrument];
        const auto found = nearest_points(instrument, p.part, corners_of(p.piece, turns_.at),
                                          corner_count(p.piece));
        if (!found || !(found->distance < (1 - outside) * instrument.radius))
          continue;
        double square = 0;
        for (std::size_t c = 0; c < 3; ++c)
          if (p.piece[c] < nodes_.moving)
            square += found->weights[c] * found->weights[c];
        if (!(square > least_square))
          continue;
        clear = false;
        const Vec3 n =
            dot(found->normal(p.normal), p.normal) < 0 ? p.normal : found->normal(p.normal);
        for (std::size_t c = 0; c < 3; ++c)
          if (p.piece[c] < nodes_.moving && found->weights[c] > 0)
            turns_.at[p.piece[c]] += (instrument.radius - dot(found->place - found->core, n)) *
                                     found->weights[c] / square * n;
      }
      if (clear)
        return;
    }
  }

  bool movable(const TouchPair& p) const {
    return std::ranges::any_of(p.piece, [&](std::uint32_t i) { return i < nodes_.moving; });
  }

  /// Pairs of every piece with whatever it is in.
  bool join(std::span<const Vec3> at, double depth) {
    bool joined = false;
    for (std::uint32_t k = 0; k < placed_.size(); ++k) {
      if (!placed_[k])
        continue;
      const PlacedInstrument& instrument = *placed_[k];
      for (const Facet& whole : nodes_.pieces) {
        // A piece can't be moved out while a corner that is held is in.
        const std::optional<Facet> piece = part_of(whole, [&](std::uint32_t i) {
          return i < nodes_.moving || instrument.distance(free_[i]) >= -outside * instrument.radius;
        });
        if (!piece)
          continue;
        for_parts(instrument, *piece, [&](CorePart part, const Facet& corners) {
          const auto found =
              nearest_points(instrument, part, corners_of(corners, at), corner_count(corners));
          if (!found || !(found->distance < (1 - depth) * instrument.radius))
            return;
          TouchPair pair{k, part, corners, *found, {}, {}};
          const auto there = std::ranges::lower_bound(turns_.pairs, key_of(pair), {}, key_of);
          if (there != turns_.pairs.end() && key_of(*there) == key_of(pair))
            return;
          if (!movable(pair))
            return;
          turns_.pairs.insert(there, pair);
          joined = true;
        });
      }
    }
    return joined;
  }

  Vec3 inward(const TouchPair& p) const {
    Vec3 sum;
    for (std::size_t c = 0; c < 3; ++c)
      sum += p.point.weights[c] * nodes_.inward[p.piece[c]];
    return sum;
  }

  /// The points of all pairs where the nodes are, and which of them count: one of those that are
  /// the same.
  void locate(std::span<const Vec3> at) {
    active_.clear();
    std::vector<std::tuple<std::uint32_t, CorePart, Facet, std::uint32_t>> order;
    for (std::uint32_t i = 0; i < turns_.pairs.size(); ++i) {
      TouchPair& p = turns_.pairs[i];
      const PlacedInstrument& instrument = *placed_[p.instrument];
      const auto found =
          nearest_points(instrument, p.part, corners_of(p.piece, at), corner_count(p.piece));
      if (!found) {
        p.force = {};
        continue;
      }
      p.point = *found;
      const Vec3 normal = p.point.distance > 1e-9 * instrument.radius
                              ? p.point.normal({})
                              : instrument.normal(p.point.core, inward(p));
      if (dot(normal, p.normal) < 0) { // through: out the way it came
        std::size_t deepest = 0;
        for (std::size_t c = 1; c < 3; ++c)
          if (dot(at[p.piece[c]], p.normal) < dot(at[p.piece[deepest]], p.normal))
            deepest = c;
        p.point.weights = {};
        p.point.weights[deepest] = 1;
        p.point.place = at[p.piece[deepest]];
      } else { // the force turns with the normal
        const double push = dot(p.force, p.normal);
        const Vec3 drag = p.force - push * p.normal;
        p.force = push * normal + (drag - dot(drag, normal) * normal);
        p.normal = normal;
      }
      order.emplace_back(p.instrument, p.part, support_of(p), i);
    }
    std::ranges::sort(order);
    for (std::size_t k = 0; k < order.size(); ++k) {
      const auto& [instrument, part, support, i] = order[k];
      TouchPair& p = turns_.pairs[i];
      if (k > 0 && std::tie(instrument, part, support) == std::tie(std::get<0>(order[k - 1]),
                                                                   std::get<1>(order[k - 1]),
                                                                   std::get<2>(order[k - 1]))) {
        turns_.pairs[active_.back()].force += p.force;
        p.force = {};
      } else {
        active_.push_back(i);
      }
    }
  }

  /// ∂(Bᵀ f)/∂x of the last pushes f, by differences. \param loose how much of it that makes softer
  MatrixXd bending(double loose) const {
    MatrixXd h = MatrixXd::Zero(size_, size_);
    for (const std::uint32_t i : active_) {
      const TouchPair& p = turns_.pairs[i];
      const double push = dot(p.force, p.normal);
      if (!(push > 0))
        continue;
      std::optional<Eigen::Matrix<double, 9, 9>> own = bending_of(p);
      if (!own)
        continue;
      if (loose < 1) {
        const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 9, 9>> parts(*own);
        const Eigen::Matrix<double, 9, 1> all =
            parts.eigenvalues().cwiseMin(0.0) + loose * parts.eigenvalues().cwiseMax(0.0);
        *own = parts.eigenvectors() * all.asDiagonal() * parts.eigenvectors().transpose();
      }
      for (Index c = 0; c < 9; ++c)
        for (Index r = 0; r < 9; ++r) {
          const std::uint32_t from = p.piece[static_cast<std::size_t>(c / 3)],
                              to = p.piece[static_cast<std::size_t>(r / 3)];
          if (from < nodes_.moving && to < nodes_.moving)
            h(3 * static_cast<Index>(to) + r % 3, 3 * static_cast<Index>(from) + c % 3) +=
                push * (*own)(r, c);
        }
    }
    return h;
  }

  /// Second derivatives of a pair's distance by its corners' places, 0 for repeated ones.
  std::optional<Eigen::Matrix<double, 9, 9>> bending_of(const TouchPair& p) const {
    const PlacedInstrument& instrument = *placed_[p.instrument];
    const int count = corner_count(p.piece);
    const double by = 1e-6 * instrument.radius;
    Eigen::Matrix<double, 9, 9> all = Eigen::Matrix<double, 9, 9>::Zero();
    for (int c = 0; c < count; ++c)
      for (int a = 0; a < 3; ++a)
        for (const double side : {-by, by}) {
          std::array<Vec3, 3> corners = corners_of(p.piece, at_);
          corners[static_cast<std::size_t>(c)][a] += side;
          const auto found = nearest_points(instrument, p.part, corners, count);
          if (!found || !(found->distance > 1e-3 * instrument.radius))
            return std::nullopt;
          const Vec3 n = found->normal({});
          for (int d = 0; d < count; ++d)
            for (int b = 0; b < 3; ++b)
              all(3 * d + b, 3 * c + a) +=
                  found->weights[static_cast<std::size_t>(d)] * n[b] / (2 * side);
        }
    return 0.5 * (all + all.transpose());
  }

  /// Energy and what violates the conditions, on the way from the last places to the new ones.
  double merit(double part, double weight) const {
    double energy = 0;
    std::vector<Vec3> at(at_);
    for (std::size_t k = 0; k < nodes_.moving; ++k) {
      at[k] += part * (turns_.at[k] - at_[k]);
      for (int a = 0; a < 3; ++a) {
        const auto row = static_cast<Index>(3 * k) + a;
        energy += 0.5 * (forces_[row] + part * (next_forces_[row] - forces_[row])) *
                  (at[k] - free_[k])[a];
      }
    }
    for (const TouchPair& p : turns_.pairs) {
      const PlacedInstrument& instrument = *placed_[p.instrument];
      const auto found =
          nearest_points(instrument, p.part, corners_of(p.piece, at), corner_count(p.piece));
      if (found && found->distance < instrument.radius)
        energy += weight * (instrument.radius - found->distance);
      if (found && instrument.friction > 0) {
        const Vec3 drag = p.force - dot(p.force, p.normal) * p.normal;
        energy -= dot(drag, point_of(p, at));
      }
    }
    return energy;
  }

  /// Less of the last way where all of it leads up.
  double shorten() {
    double weight = 0;
    for (const TouchPair& p : turns_.pairs)
      weight = std::max(weight, 2 * norm(p.force));
    const double here = merit(0, weight);
    double part = 1, best = HUGE_VAL;
    for (double way = 1; way > 0.01; way /= 2) {
      const double there = merit(way, weight);
      if (there < best) {
        best = there;
        part = way;
      }
      if (there < here)
        break;
    }
    if (part < 1) {
      for (std::size_t k = 0; k < nodes_.moving; ++k)
        turns_.at[k] = at_[k] + part * (turns_.at[k] - at_[k]);
      next_forces_ = forces_ + part * (next_forces_ - forces_);
    }
    return part;
  }

  /// W Bᵀ, 3 columns for each active pair.
  MatrixXd spread() const {
    MatrixXd all = MatrixXd::Zero(size_, 3 * static_cast<Index>(active_.size()));
    for (std::size_t k = 0; k < active_.size(); ++k) {
      const TouchPair& p = turns_.pairs[active_[k]];
      for (std::size_t c = 0; c < 3; ++c)
        if (p.point.weights[c] > 0 && p.piece[c] < nodes_.moving)
          all.middleCols(3 * static_cast<Index>(k), 3) +=
              p.point.weights[c] * w_.middleCols(3 * static_cast<Index>(p.piece[c]), 3);
    }
    return all;
  }

  /// The points of the active pairs.
  Vec3 point_of(const TouchPair& p, std::span<const Vec3> at) const {
    return p.point.weights[0] * at[p.piece[0]] + p.point.weights[1] * at[p.piece[1]] +
           p.point.weights[2] * at[p.piece[2]];
  }
  MatrixXd at_points(const MatrixXd& rows) const {
    MatrixXd all = MatrixXd::Zero(3 * static_cast<Index>(active_.size()), rows.cols());
    for (std::size_t k = 0; k < active_.size(); ++k) {
      const TouchPair& p = turns_.pairs[active_[k]];
      for (std::size_t c = 0; c < 3; ++c)
        if (p.point.weights[c] > 0 && p.piece[c] < nodes_.moving)
          all.middleRows(3 * static_cast<Index>(k), 3) +=
              p.point.weights[c] * rows.middleRows(3 * static_cast<Index>(p.piece[c]), 3);
    }
    return all;
  }

  /// Compliance of the nodes and their places without forces of the active pairs, with these
  /// forces' turning. \return whether it is stable: forces move their points out
  bool bent(const MatrixXd& h, const MatrixXd& straight, MatrixXd& columns, VectorXd& base) const {
    VectorXd x(size_);
    for (Index r = 0; r < size_; ++r)
      x[r] = at_[static_cast<std::size_t>(r / 3)][static_cast<int>(r % 3)];
    const Eigen::PartialPivLU<MatrixXd> lu(MatrixXd::Identity(size_, size_) - w_ * h);
    columns = lu.solve(straight);
    base = lu.solve(base - w_ * (h * x)).eval();
    if (!columns.allFinite() || !base.allFinite())
      return false;
    const MatrixXd p = at_points(columns), before = at_points(straight);
    const auto count = static_cast<Index>(active_.size());
    MatrixXd normal(count, count);
    for (Index i = 0; i < count; ++i)
      for (Index j = 0; j < count; ++j) {
        const Vec3 a = normal_of(i), b = normal_of(j);
        normal(i, j) = Eigen::Vector3d(a.x, a.y, a.z)
                           .dot(p.block<3, 3>(3 * i, 3 * j) * Eigen::Vector3d(b.x, b.y, b.z));
      }
    normal = (0.5 * (normal + normal.transpose())).eval();
    for (Index r = 0; r < p.rows(); ++r) // near its end nothing of it can be trusted
      if (!(p(r, r) <= most_softer * before(r, r)))
        return false;
    normal.diagonal().array() += 1e-10 * normal.diagonal().cwiseAbs().maxCoeff();
    return Eigen::LLT<MatrixXd>(normal).info() == Eigen::Success;
  }

  /// Forces of the active pairs, and where the nodes are under them.
  bool solve(bool bend, bool safe) {
    bend = bend && !active_.empty();
    const MatrixXd straight = spread();
    MatrixXd columns = straight;
    VectorXd base(size_);
    for (Index r = 0; r < size_; ++r)
      base[r] = free_[static_cast<std::size_t>(r / 3)][static_cast<int>(r % 3)];
    MatrixXd h = MatrixXd::Zero(size_, size_);
    if (bend) {
      const VectorXd free = base;
      bool stable = false;
      for (const double loose : {1.0, 0.7, 0.4, 0.0}) {
        if (safe && loose > 0)
          continue;
        h = bending(loose);
        columns = straight;
        base = free;
        stable = bent(h, straight, columns, base);
        if (stable)
          break;
      }
      if (!stable) {
        h.setZero();
        columns = straight;
        base = free;
      }
    }
    MatrixXd compliance = at_points(columns);
    compliance = (0.5 * (compliance + compliance.transpose())).eval();
    std::vector<Vec3> without(free_.begin(), free_.end());
    for (std::size_t k = 0; k < nodes_.moving; ++k)
      without[k] = {base[static_cast<Index>(3 * k)], base[static_cast<Index>(3 * k + 1)],
                    base[static_cast<Index>(3 * k + 2)]};
    std::vector<Contact> contacts;
    std::vector<Vec3> guess;
    std::vector<std::uint32_t> used;
    for (std::uint32_t k = 0; k < active_.size(); ++k) {
      TouchPair& p = turns_.pairs[active_[k]];
      const PlacedInstrument& instrument = *placed_[p.instrument];
      const MovedInstrument& way = *moved_[p.instrument];
      const Index row = 3 * static_cast<Index>(k);
      const Eigen::Vector3d n(p.normal.x, p.normal.y, p.normal.z);
      const double own = n.dot(compliance.block<3, 3>(row, row) * n);
      if (!(own > immovable * largest_)) {
        turns_.stuck = p;
        p.force = {};
        continue;
      }
      const Vec3 here = point_of(p, without);
      contacts.push_back({k, p.normal, dot(p.normal, here - p.point.core) - instrument.radius,
                          here - carried(way.before, way.now, point_of(p, nodes_.was)),
                          instrument.friction});
      guess.push_back(p.force);
      used.push_back(active_[k]);
    }
    const ContactForces forces =
        solve_contacts({compliance.data(), static_cast<std::size_t>(compliance.size())},
                       active_.size(), contacts, guess);
    VectorXd f = VectorXd::Zero(compliance.rows());
    for (std::size_t i = 0; i < used.size(); ++i) {
      turns_.pairs[used[i]].force = forces.force[i];
      for (int a = 0; a < 3; ++a)
        f[3 * static_cast<Index>(contacts[i].node) + a] = forces.force[i][a];
    }
    const VectorXd x = base + columns * f;
    // The forces on the nodes that these places mean.
    next_forces_ = VectorXd::Zero(size_);
    for (std::size_t i = 0; i < used.size(); ++i) {
      const TouchPair& p = turns_.pairs[used[i]];
      for (std::size_t c = 0; c < 3; ++c)
        for (int a = 0; a < 3; ++a)
          if (p.piece[c] < nodes_.moving)
            next_forces_[3 * static_cast<Index>(p.piece[c]) + a] += p.point.weights[c] * p.force[a];
    }
    if (bend) {
      VectorXd way = x;
      for (Index r = 0; r < size_; ++r)
        way[r] -= at_[static_cast<std::size_t>(r / 3)][static_cast<int>(r % 3)];
      next_forces_ += h * way;
    }
    turns_.at.assign(free_.begin(), free_.end());
    for (std::size_t k = 0; k < nodes_.moving; ++k)
      turns_.at[k] = {x[static_cast<Index>(3 * k)], x[static_cast<Index>(3 * k + 1)],
                      x[static_cast<Index>(3 * k + 2)]};
    return forces.solved;
  }

  /// How far the pairs' points and normals are from where the nodes now have them: of those that
  /// push.
  double changed() const {
    double most = 0;
    for (const std::uint32_t i : active_) {
      const TouchPair& p = turns_.pairs[i];
      if (p.force == Vec3{})
        continue;
      const PlacedInstrument& instrument = *placed_[p.instrument];
      const auto found =
          nearest_points(instrument, p.part, corners_of(p.piece, turns_.at), corner_count(p.piece));
      if (!found)
        return 1;
      const double change =
          std::max(norm(found->normal(p.normal) - p.normal),
                   norm(found->place - point_of(p, turns_.at)) / instrument.radius);
      most = change <= most ? most : change;
    }
    return most;
  }

  Vec3 normal_of(Index k) const {
    return turns_.pairs[active_[static_cast<std::size_t>(k)]].normal;
  }

  const ContactNodes& nodes_;
  std::span<const Vec3> free_;
  std::span<const std::optional<PlacedInstrument>> placed_;
  std::span<const std::optional<MovedInstrument>> moved_;
  ContactTurns& turns_;
  Index size_;
  Eigen::Map<const MatrixXd> w_;
  double largest_ = 0;
  std::vector<Vec3> at_;              ///< before a turn
  VectorXd forces_, next_forces_;     ///< on the nodes, as the places mean before and behind a turn
  std::vector<std::uint32_t> active_; ///< pairs
};

} // namespace

void take_turns(const DelassusOperator& delassus, const ContactNodes& nodes,
                std::span<const Vec3> free, std::span<const std::optional<PlacedInstrument>> placed,
                std::span<const std::optional<MovedInstrument>> moved, ContactTurns& turns) {
  Turns(delassus, nodes, free, placed, moved, turns).run();
}

} // namespace gewebe
