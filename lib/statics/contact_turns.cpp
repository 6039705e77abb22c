#include "contact/contact_solver.h"
#include "statics/bent_compliance_internal.h"
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

/// How a turn takes the forces' turning: how much of what makes softer counts, and by how much
/// (over a contact's own stiffness) what pushes is held to its place, which changes nothing where
/// that is met and makes stable what is so only under its contacts.
struct Bend {
  double loose = 1, hold = 0;
};
constexpr std::array<Bend, 5> bends{{{1.0, 0}, {1.0, 4}, {0.7, 0}, {0.4, 0}, {0.0, 0}}};

constexpr double same_place = 1e-9; ///< of the radius, and of a normal's length
constexpr double fair_place = 1e-6; ///< that is not worth a warning
constexpr double outside = 1e-9;    ///< of the radius: so deep is not inside
constexpr double immovable = 1e-12; ///< of the largest compliance
constexpr double nearly = 0.03;     ///< from where on each turn comes nearer
constexpr double most_softer = 8;   ///< by which forces make their points give way more
constexpr double short_way = 0.1, most_way = 8;
constexpr double overlook = 1e-11; ///< of the radius
constexpr std::size_t few = 32;    ///< pairs that join at once, at least
constexpr int max_turns = 100;
constexpr int max_vain = 3; ///< turns whose forces were not found
constexpr int max_sweeps = 200;
constexpr double least_square = 1e-6; ///< of weights of nodes that give way
constexpr int max_idle = 40;          ///< turns on end that came no nearer

std::array<Vec3, 3> corners_of(const Facet& piece, std::span<const Vec3> at) {
  return {at[piece[0]], at[piece[1]], at[piece[2]]};
}

auto key_of(const TouchPair& p) {
  return std::tuple(p.instrument, p.part, p.piece);
}

/// Corners that a point depends on, ascending and last repeated: the same for pieces that share it.
/// All of them where forces without bounds have left it no place.
Facet support_of(const TouchPair& p) {
  Facet all{};
  std::size_t count = 0;
  for (std::size_t c = 0; c < 3; ++c)
    if (p.point.weights[c] > 0)
      all[count++] = p.piece[c];
  if (count == 0)
    return p.piece;
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
      turns_.change = change;
      since_best = joined || change < 0.8 * best ? 0 : since_best + 1;
      best = joined ? HUGE_VAL : std::min(best, change);
      if ((!joined && change <= same_place) || vain == max_vain || since_best == max_idle)
        break;
      if (level_ < bends.size() && bends[level_].hold > 0 && !(change < before))
        can_hold_ = false;
      before = last_change_ = change;
      at_ = turns_.at;
      forces_ = next_forces_;
    }
    turns_.solved = turns_.solved && !pierced();
    if (!turns_.solved)
      move_out();
  }

private:
  /// Whether a core goes through a piece: no pair leads it out again.
  bool pierced() const {
    for (const std::optional<PlacedInstrument>& instrument : placed_)
      for (const Facet& piece : nodes_.pieces)
        if (instrument && corner_count(piece) == 3 &&
            goes_through(*instrument, corners_of(piece, turns_.at)))
          return true;
    return false;
  }

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

  /// ∂(Bᵀ f)/∂x of the last pushes f, by differences. \param held becomes the forces that hold what
  /// pushes to its place, where the nodes were last
  BentCompliance bending(const Bend& how, VectorXd& held) const {
    held = VectorXd::Zero(size_);
    std::vector<Index> rows;
    for (const std::uint32_t i : active_)
      if (pushes(i))
        for (const std::uint32_t node : turns_.pairs[i].piece)
          if (node < nodes_.moving)
            for (Index a = 0; a < 3; ++a)
              rows.push_back(3 * static_cast<Index>(node) + a);
    std::ranges::sort(rows);
    rows.erase(std::ranges::unique(rows).begin(), rows.end());
    const auto count = static_cast<Index>(rows.size());
    MatrixXd h = MatrixXd::Zero(count, count);
    const auto row_of = [&](std::uint32_t node) {
      return std::ranges::lower_bound(rows, 3 * static_cast<Index>(node)) - rows.begin();
    };
    for (const std::uint32_t i : active_) {
      if (!pushes(i))
        continue;
      const TouchPair& p = turns_.pairs[i];
      std::optional<Eigen::Matrix<double, 9, 9>> own = bending_of(p);
      if (!own)
        continue;
      if (how.loose < 1) {
        const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 9, 9>> parts(*own);
        const Eigen::Matrix<double, 9, 1> all =
            parts.eigenvalues().cwiseMin(0.0) + how.loose * parts.eigenvalues().cwiseMax(0.0);
        *own = parts.eigenvectors() * all.asDiagonal() * parts.eigenvectors().transpose();
      }
      *own *= dot(p.force, p.normal);
      if (how.hold > 0)
        hold(p, how.hold, *own, held);
      for (std::size_t from = 0; from < 3; ++from)
        for (std::size_t to = 0; to < 3; ++to)
          if (p.piece[from] < nodes_.moving && p.piece[to] < nodes_.moving)
            h.block<3, 3>(row_of(p.piece[to]), row_of(p.piece[from])) +=
                own->block<3, 3>(3 * static_cast<Index>(to), 3 * static_cast<Index>(from));
    }
    return {w_, std::move(rows), std::move(h)};
  }
  /// Springs that hold a pair's point where its contact wants it: along the normal, and where it
  /// sticks along the surface.
  void hold(const TouchPair& p, double by, Eigen::Matrix<double, 9, 9>& h, VectorXd& held) const {
    const Vec3 n = p.normal;
    Eigen::Matrix3d own = Eigen::Matrix3d::Zero(); // compliance of the point
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t d = 0; d < 3; ++d)
        if (p.piece[c] < nodes_.moving && p.piece[d] < nodes_.moving)
          own += p.point.weights[c] * p.point.weights[d] *
                 w_.block<3, 3>(3 * static_cast<Index>(p.piece[c]),
                                3 * static_cast<Index>(p.piece[d]));
    const PlacedInstrument& instrument = *placed_[p.instrument];
    const MovedInstrument& way = *moved_[p.instrument];
    const Vec3 here = point_of(p, at_),
               slip = here - carried(way.before, way.now, point_of(p, nodes_.was));
    const double push = dot(p.force, n);
    const bool sticks = norm(p.force - push * n) < (1 - 1e-6) * instrument.friction * push;
    const Vec3 miss = (dot(n, here - p.point.core) - instrument.radius) * n +
                      (sticks ? slip - dot(slip, n) * n : Vec3{});
    const Eigen::Vector3d along(n.x, n.y, n.z);
    const double stiffness = by / along.dot(own * along);
    if (!(stiffness > 0) || !std::isfinite(stiffness))
      return;
    const Eigen::Matrix3d axes =
        sticks ? Eigen::Matrix3d(Eigen::Matrix3d::Identity()) : along * along.transpose();
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t d = 0; d < 3; ++d)
        h.block<3, 3>(3 * static_cast<Index>(c), 3 * static_cast<Index>(d)) -=
            stiffness * p.point.weights[c] * p.point.weights[d] * axes;
      if (p.piece[c] < nodes_.moving)
        for (int a = 0; a < 3; ++a)
          held[3 * static_cast<Index>(p.piece[c]) + a] -= stiffness * p.point.weights[c] * miss[a];
    }
  }
  bool pushes(std::uint32_t pair) const {
    return dot(turns_.pairs[pair].force, turns_.pairs[pair].normal) > 0;
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

  /// Less of the last way where all of it leads up; more while that leads down, as from a saddle,
  /// where curvature was left out.
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
    for (double way = 2; level_ > 1 && part >= 1 && way <= most_way; way *= 2) {
      const double there = merit(way, weight);
      if (!(there < best))
        break;
      best = there;
      part = way;
    }
    if (part != 1) {
      for (std::size_t k = 0; k < nodes_.moving; ++k)
        turns_.at[k] = at_[k] + part * (turns_.at[k] - at_[k]);
      next_forces_ = forces_ + part * (next_forces_ - forces_);
    }
    return part;
  }

  /// The pair's point.
  static Vec3 point_of(const TouchPair& p, std::span<const Vec3> at) {
    return p.point.weights[0] * at[p.piece[0]] + p.point.weights[1] * at[p.piece[1]] +
           p.point.weights[2] * at[p.piece[2]];
  }

  /// The pairs that a turn's linear problem looks at, each with a column of W Bᵀ for its push, or
  /// three for its force where anything rubs.
  struct Looked {
    std::vector<std::uint32_t> pairs;
    MatrixXd straight; ///< own compliance by rows of the points, before forces turn: diagonal
    MatrixXd columns;  ///< with it
    VectorXd forces;   ///< by column
    VectorXd x;        ///< where the nodes are under them
    bool exact = true;
  };

  Index width() const { return rough_ ? 3 : 1; }
  /// Directions of a pair's forces, one or three of unit length.
  Eigen::Matrix<double, 3, Eigen::Dynamic> directions(const TouchPair& p) const {
    if (rough_)
      return Eigen::Matrix3d::Identity();
    return Eigen::Vector3d(p.normal.x, p.normal.y, p.normal.z);
  }

  /// Rows of the points of pairs, along their directions.
  MatrixXd at_points(std::span<const std::uint32_t> pairs, const MatrixXd& rows) const {
    MatrixXd all(width() * static_cast<Index>(pairs.size()), rows.cols());
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      const TouchPair& p = turns_.pairs[pairs[k]];
      MatrixXd own = MatrixXd::Zero(3, rows.cols());
      for (std::size_t c = 0; c < 3; ++c)
        if (p.point.weights[c] > 0 && p.piece[c] < nodes_.moving)
          own += p.point.weights[c] * rows.middleRows(3 * static_cast<Index>(p.piece[c]), 3);
      all.middleRows(width() * static_cast<Index>(k), width()) = directions(p).transpose() * own;
    }
    return all;
  }

  /// Pairs join those that are looked at.
  void look_at(std::span<const std::uint32_t> pairs, const BentCompliance& bent,
               Looked& looked) const {
    MatrixXd more = MatrixXd::Zero(size_, width() * static_cast<Index>(pairs.size()));
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      const TouchPair& p = turns_.pairs[pairs[k]];
      const auto along = directions(p);
      for (std::size_t c = 0; c < 3; ++c)
        if (p.point.weights[c] > 0 && p.piece[c] < nodes_.moving)
          more.middleCols(width() * static_cast<Index>(k), width()) +=
              p.point.weights[c] * w_.middleCols(3 * static_cast<Index>(p.piece[c]), 3) * along;
    }
    const Index before = looked.columns.cols();
    const VectorXd own = at_points(pairs, more).diagonal();
    bent.apply(more);
    looked.straight.conservativeResize(before + more.cols(), 1);
    looked.straight.bottomRows(more.cols()) = own;
    looked.columns.conservativeResize(size_, before + more.cols());
    looked.columns.rightCols(more.cols()) = more;
    looked.pairs.insert(looked.pairs.end(), pairs.begin(), pairs.end());
  }

  /// Whether forces move their points out, and not too far.
  bool stable(const Looked& looked, const MatrixXd& compliance) const {
    for (Index r = 0; r < compliance.rows(); ++r) // near its end nothing of it can be trusted
      if (!(compliance(r, r) <= most_softer * looked.straight(r, 0)))
        return false;
    const auto count = static_cast<Index>(looked.pairs.size());
    MatrixXd normal = compliance;
    if (rough_) {
      normal.resize(count, count);
      for (Index i = 0; i < count; ++i)
        for (Index j = 0; j < count; ++j)
          normal(i, j) =
              normal_of(looked, i).dot(compliance.block<3, 3>(3 * i, 3 * j) * normal_of(looked, j));
    }
    normal.diagonal().array() += 1e-10 * normal.diagonal().cwiseAbs().maxCoeff();
    return Eigen::LLT<MatrixXd>(normal).info() == Eigen::Success;
  }

  /// The forces of these pairs, whatever the others say. \param base where the nodes are without
  void solve_looked(const MatrixXd& compliance, const VectorXd& base, Looked& looked) {
    const std::vector<Vec3> without = places_of(base);
    std::vector<Contact> contacts;
    std::vector<Vec3> guess;
    for (std::uint32_t k = 0; k < looked.pairs.size(); ++k) {
      TouchPair& p = turns_.pairs[looked.pairs[k]];
      const PlacedInstrument& instrument = *placed_[p.instrument];
      const MovedInstrument& way = *moved_[p.instrument];
      const Index row = width() * static_cast<Index>(k);
      const Eigen::Vector3d n = normal_of(looked, k);
      const double own =
          rough_ ? n.dot(compliance.block<3, 3>(row, row) * n) : compliance(row, row);
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
    }
    looked.forces = VectorXd::Zero(compliance.rows());
    if (rough_) {
      const ContactForces found =
          solve_contacts({compliance.data(), static_cast<std::size_t>(compliance.size())},
                         looked.pairs.size(), contacts, guess);
      looked.exact = found.solved;
      for (std::size_t i = 0; i < contacts.size(); ++i)
        for (int a = 0; a < 3; ++a)
          looked.forces[3 * static_cast<Index>(contacts[i].node) + a] = found.force[i][a];
    } else {
      std::vector<Index> rows;
      std::vector<double> gap, start;
      for (std::size_t i = 0; i < contacts.size(); ++i) {
        rows.push_back(contacts[i].node);
        gap.push_back(contacts[i].gap);
        start.push_back(dot(guess[i], contacts[i].normal));
      }
      const MatrixXd some = compliance(rows, rows);
      const PushForces found =
          solve_pushes({some.data(), static_cast<std::size_t>(some.size())}, gap, start);
      looked.exact = found.solved;
      for (std::size_t i = 0; i < rows.size(); ++i)
        looked.forces[rows[i]] = found.push[i];
    }
    for (std::size_t k = 0; k < looked.pairs.size(); ++k) {
      TouchPair& p = turns_.pairs[looked.pairs[k]];
      const Eigen::Vector3d force =
          directions(p) * looked.forces.segment(width() * static_cast<Index>(k), width());
      p.force = {force[0], force[1], force[2]};
    }
    looked.x = base + looked.columns * looked.forces;
  }

  std::vector<Vec3> places_of(const VectorXd& x) const {
    std::vector<Vec3> all(free_.begin(), free_.end());
    for (std::size_t k = 0; k < nodes_.moving; ++k)
      for (int a = 0; a < 3; ++a)
        all[k][a] = x[static_cast<Index>(3 * k) + a];
    return all;
  }
  VectorXd rows_of(std::span<const Vec3> places) const {
    VectorXd all(size_);
    for (Index r = 0; r < size_; ++r)
      all[r] = places[static_cast<std::size_t>(r / 3)][static_cast<int>(r % 3)];
    return all;
  }

  /// The pairs that nobody looked at whose points are in their instruments, the deepest first.
  std::vector<std::uint32_t> overlooked(const Looked& looked) const {
    const std::vector<Vec3> at =
        looked.x.size() > 0 ? places_of(looked.x) : std::vector<Vec3>(free_.begin(), free_.end());
    std::vector<std::uint32_t> known(looked.pairs);
    std::ranges::sort(known);
    std::vector<std::pair<double, std::uint32_t>> found;
    for (const std::uint32_t i : active_) {
      if (std::ranges::binary_search(known, i))
        continue;
      const TouchPair& p = turns_.pairs[i];
      const double radius = placed_[p.instrument]->radius;
      const double gap = dot(p.normal, point_of(p, at) - p.point.core) - radius;
      if (!(gap >= -overlook * radius))
        found.emplace_back(gap / radius, i);
    }
    std::ranges::sort(found);
    found.resize(std::min(found.size(), std::max(few, known.size())));
    std::vector<std::uint32_t> pairs;
    for (const auto& [gap, i] : found)
      pairs.push_back(i);
    std::ranges::sort(pairs);
    return pairs;
  }

  /// The linear problem of a turn, by more and more of the pairs. \return none where it isn't
  /// stable
  std::optional<Looked> solve_bent(const BentCompliance& bent, const VectorXd& held, bool careful) {
    MatrixXd base = rows_of(free_);
    base += w_ * (held - bent.turning(rows_of(at_)));
    bent.apply(base);
    Looked looked;
    looked.columns.resize(size_, 0);
    looked.x = base;
    if (!looked.x.allFinite())
      return std::nullopt;
    std::vector<std::uint32_t> more;
    for (const std::uint32_t i : active_)
      if (turns_.pairs[i].force != Vec3{})
        more.push_back(i);
    if (more.empty())
      more = overlooked(looked);
    while (!more.empty()) {
      look_at(more, bent, looked);
      if (!looked.columns.allFinite())
        return std::nullopt;
      MatrixXd compliance = at_points(looked.pairs, looked.columns);
      compliance = (0.5 * (compliance + compliance.transpose())).eval();
      if (careful && !stable(looked, compliance))
        return std::nullopt;
      solve_looked(compliance, base, looked);
      more = overlooked(looked);
    }
    return looked;
  }

  /// Forces of the active pairs, and where the nodes are under them.
  bool solve(bool bend, bool safe) {
    rough_ = std::ranges::any_of(active_, [&](std::uint32_t i) {
      return placed_[turns_.pairs[i].instrument]->friction > 0;
    });
    std::vector<Vec3> guess;
    for (const TouchPair& p : turns_.pairs)
      guess.push_back(p.force);
    std::optional<BentCompliance> bent;
    std::optional<Looked> looked;
    VectorXd held;
    for (std::size_t level = safe ? bends.size() - 1 : 0; bend && !looked && level < bends.size();
         ++level) {
      if (bends[level].hold > 0 &&
          (!can_hold_ || !(last_change_ < nearly))) // what pushes may not, and is held then
        continue;
      for (std::size_t i = 0; i < guess.size(); ++i)
        turns_.pairs[i].force = guess[i];
      bent.emplace(bending(bends[level], held));
      looked = solve_bent(*bent, held, true);
      level_ = level;
    }
    if (!looked) {
      for (std::size_t i = 0; i < guess.size(); ++i)
        turns_.pairs[i].force = guess[i];
      held = VectorXd::Zero(size_);
      bent.emplace(w_, std::vector<Index>{}, MatrixXd{});
      looked = solve_bent(*bent, held, false);
    }
    if (!looked)
      return false;
    // The forces on the nodes that these places mean.
    next_forces_ = held + bent->turning(looked->x - rows_of(at_));
    for (const std::uint32_t i : looked->pairs) {
      const TouchPair& p = turns_.pairs[i];
      for (std::size_t c = 0; c < 3; ++c)
        for (int a = 0; a < 3; ++a)
          if (p.piece[c] < nodes_.moving)
            next_forces_[3 * static_cast<Index>(p.piece[c]) + a] += p.point.weights[c] * p.force[a];
    }
    turns_.at = places_of(looked->x);
    return looked->exact;
  }

  /// How far the pairs' points and normals are from where the nodes now have them: of those that
  /// push.
  double changed() const {
    double most = 0;
    for (const std::uint32_t i : active_) {
      const TouchPair& p = turns_.pairs[i];
      const PlacedInstrument& instrument = *placed_[p.instrument];
      const auto found =
          nearest_points(instrument, p.part, corners_of(p.piece, turns_.at), corner_count(p.piece));
      if (p.force == Vec3{}) { // its plane may have been beside its place now
        if (found && found->distance < (1 - outside) * instrument.radius)
          most = std::max(most, 1 - found->distance / instrument.radius);
        continue;
      }
      if (!found)
        return 1;
      const double change =
          std::max(norm(found->normal(p.normal) - p.normal),
                   norm(found->place - point_of(p, turns_.at)) / instrument.radius);
      most = change <= most ? most : change;
    }
    return most;
  }

  Eigen::Vector3d normal_of(const Looked& looked, Index k) const {
    const Vec3& n = turns_.pairs[looked.pairs[static_cast<std::size_t>(k)]].normal;
    return {n.x, n.y, n.z};
  }

  const ContactNodes& nodes_;
  std::span<const Vec3> free_;
  std::span<const std::optional<PlacedInstrument>> placed_;
  std::span<const std::optional<MovedInstrument>> moved_;
  ContactTurns& turns_;
  Index size_;
  Eigen::Map<const MatrixXd> w_;
  double largest_ = 0;
  bool rough_ = false; ///< anything rubs
  double last_change_ = HUGE_VAL;
  bool can_hold_ = true;              ///< nothing came of it that was worse
  std::size_t level_ = 0;             ///< of looseness
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
