// The linear problem of a turn: the forces of the pairs that push, or would be inside.

#include "base/cpu.h"
#include "contact/contact_solver.h"
#include "statics/bent_kernel_internal.h"
#include "statics/contact_scene_internal.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

namespace gewebe {

namespace {

using Eigen::Index, Eigen::MatrixXd, Eigen::VectorXd;

constexpr double immovable = 1e-12; ///< of the largest compliance
constexpr double most_softer = 8;   ///< by which forces make their points give way more
constexpr double overlook = 1e-11;  ///< of the radius
constexpr std::size_t few = 32;     ///< pairs that join at once, at least

class LinearContacts {
public:
  LinearContacts(const ContactScene& scene, std::span<TouchPair> pairs,
                 std::span<const std::uint32_t> active, std::optional<TouchPair>& stuck)
      : scene_(scene), pairs_(pairs), active_(active), stuck_(stuck),
        largest_(scene.rows() > 0 ? scene.w.diagonal().maxCoeff() : 0),
        rough_(std::ranges::any_of(active, [&](std::uint32_t i) {
          return scene.placed[pairs[i].instrument]->friction > 0;
        })) {}

  std::optional<LookedContacts> solve(std::span<const Vec3> at, const BentParts& bent,
                                      const VectorXd& held, bool careful) {
    const VectorXd free = scene_.rows_of(scene_.free), last = scene_.rows_of(at);
    const BentStart start = bent.start(free, held, last);
    VectorXd base = bent.without(start, pushed());
    LookedContacts looked;
    looked.columns.resize(scene_.rows(), 0);
    looked.x = base;
    if (!looked.x.allFinite())
      return std::nullopt;
    std::vector<std::uint32_t> more;
    for (const std::uint32_t i : active_)
      if (pairs_[i].force != Vec3{})
        more.push_back(i);
    if (more.empty())
      more = overlooked(looked);
    MatrixXd compliance;
    // In parts, once more with what far forces turn by now: most of what each of them left.
    for (bool left = bent.in_parts(); !more.empty() || (left && !looked.pairs.empty());) {
      if (more.empty()) {
        base = bent.without(start, pushed());
        left = false;
      } else {
        look_at(more, bent, looked);
        // Finite numbers less themselves are 0, others are not.
        if (!((looked.columns - looked.columns).sum() == 0))
          return std::nullopt;
        compliance = compliance_of(looked);
        if (careful && !stable(looked, compliance))
          return std::nullopt;
      }
      solve_looked(compliance, base, looked);
      more = overlooked(looked);
    }
    return looked;
  }

private:
  Index width() const { return rough_ ? 3 : 1; }
  /// Directions of a pair's forces, one or three of unit length.
  Eigen::Matrix<double, 3, Eigen::Dynamic> directions(const TouchPair& p) const {
    if (rough_)
      return Eigen::Matrix3d::Identity();
    return Eigen::Vector3d(p.normal.x, p.normal.y, p.normal.z);
  }

  /// What a pair's point moves with, of what gives way.
  struct Point {
    std::array<Index, 3> row{}; ///< of a corner's node, the first
    std::array<double, 3> weight{};
    std::size_t count = 0;
    Vec3 normal;

    Vec3 of(const double* rows) const {
      Vec3 sum;
      for (std::size_t c = 0; c < count; ++c)
        sum += weight[c] * Vec3{rows[row[c]], rows[row[c] + 1], rows[row[c] + 2]};
      return sum;
    }
  };
  Point point(const TouchPair& p) const {
    Point all;
    all.normal = p.normal;
    for (std::size_t c = 0; c < 3; ++c)
      if (p.point.weights[c] > 0 && p.piece[c] < scene_.nodes.moving) {
        all.row[all.count] = 3 * static_cast<Index>(p.piece[c]);
        all.weight[all.count++] = p.point.weights[c];
      }
    return all;
  }

  /// How the forces of the pairs that are looked at move their points, along their directions; made
  /// symmetric.
  MatrixXd compliance_of(const LookedContacts& looked) const {
    MatrixXd all(looked.columns.cols(), looked.columns.cols());
    if (rough_) {
      for (Index column = 0; column < all.cols(); ++column) {
        double* to = all.col(column).data();
        for (const Point& point : points_) {
          const Vec3 own = point.of(looked.columns.col(column).data());
          for (int a = 0; a < 3; ++a)
            *to++ = own[a];
        }
      }
    } else {
      const MatrixXd by_force = looked.columns.transpose();
      for (Index k = 0; k < all.cols(); ++k) {
        const Point& point = points_[static_cast<std::size_t>(k)];
        std::array<const double*, 3> x{};
        for (std::size_t c = 0; c < point.count; ++c)
          x[c] = by_force.col(point.row[c]).data();
        const std::array<double, 3> along{point.normal.x, point.normal.y, point.normal.z};
        kernel_.read(x.data(), point.weight.data(), point.count,
                     static_cast<std::size_t>(all.rows()), along.data(), all.col(k).data());
      }
    }
    for (Index c = 0; c < all.cols(); ++c)
      for (Index r = 0; r < c; ++r)
        all(r, c) = all(c, r) = 0.5 * (all(r, c) + all(c, r));
    return all;
  }

  /// The forces on nodes that this turn begins with.
  VectorXd pushed() const {
    VectorXd all = VectorXd::Zero(scene_.rows());
    for (const std::uint32_t i : active_) {
      const TouchPair& p = pairs_[i];
      for (std::size_t c = 0; c < 3; ++c)
        for (int a = 0; a < 3 && p.piece[c] < scene_.nodes.moving; ++a)
          all[3 * static_cast<Index>(p.piece[c]) + a] += p.point.weights[c] * p.force[a];
    }
    return all;
  }

  /// Columns of W Bᵀ of a pair's point.
  void set_columns(const Point& point, Eigen::Ref<MatrixXd> to) const {
    std::array<const double*, 3> w{};
    for (std::size_t c = 0; c < point.count; ++c)
      w[c] = scene_.w.col(point.row[c]).data();
    for (Index a = 0; a < width(); ++a) {
      const Vec3& n = point.normal;
      const std::array<double, 3> along =
          rough_ ? std::array{a == 0 ? 1.0 : 0.0, a == 1 ? 1.0 : 0.0, a == 2 ? 1.0 : 0.0}
                 : std::array{n.x, n.y, n.z};
      kernel_.push(w.data(), point.weight.data(), point.count,
                   static_cast<std::size_t>(scene_.rows()), along.data(), to.col(a).data());
    }
  }

  /// Pairs join those that are looked at.
  void look_at(std::span<const std::uint32_t> pairs, const BentParts& bent,
               LookedContacts& looked) {
    MatrixXd more(scene_.rows(), width() * std::ssize(pairs));
    const Index before = looked.columns.cols();
    looked.straight.conservativeResize(before + more.cols(), 1);
    std::vector<std::uint32_t> pushed;
    pushed.reserve(pairs.size());
    for (Index column = 0; const std::uint32_t i : pairs) {
      const TouchPair& p = pairs_[i];
      points_.push_back(point(p));
      set_columns(points_.back(), more.middleCols(column, width()));
      for (Index a = 0; a < width(); ++a, ++column) {
        const Vec3 own = points_.back().of(more.col(column).data());
        looked.straight(before + column, 0) =
            rough_ ? own[static_cast<int>(a)] : dot(p.normal, own);
      }
      pushed.push_back(*std::ranges::min_element(p.piece));
    }
    bent.apply(more, pushed, width());
    if (before == 0) {
      looked.columns = std::move(more);
    } else {
      looked.columns.conservativeResize(scene_.rows(), before + more.cols());
      looked.columns.rightCols(more.cols()) = more;
    }
    looked.pairs.insert(looked.pairs.end(), pairs.begin(), pairs.end());
  }

  /// Whether forces move their points out, and not too far.
  bool stable(const LookedContacts& looked, const MatrixXd& compliance) const {
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
    return Eigen::LLT<Eigen::Ref<MatrixXd>>(normal).info() == Eigen::Success;
  }

  /// The forces of these pairs, whatever the others say. \param base where the nodes are without
  void solve_looked(const MatrixXd& compliance, const VectorXd& base, LookedContacts& looked) {
    const std::vector<Vec3> without = scene_.places_of(base);
    std::vector<Contact> contacts;
    std::vector<Vec3> guess;
    for (std::uint32_t k = 0; k < looked.pairs.size(); ++k) {
      TouchPair& p = pairs_[looked.pairs[k]];
      const PlacedInstrument& instrument = *scene_.placed[p.instrument];
      const MovedInstrument& way = *scene_.moved[p.instrument];
      const Index row = width() * static_cast<Index>(k);
      const Eigen::Vector3d n = normal_of(looked, k);
      const double own =
          rough_ ? n.dot(compliance.block<3, 3>(row, row) * n) : compliance(row, row);
      if (!(own > immovable * largest_)) {
        stuck_ = p;
        p.force = {};
        continue;
      }
      const Vec3 here = point_of(p, without);
      const Vec3 slip =
          rough_ ? here - carried(way.before, way.now, point_of(p, scene_.nodes.was)) : Vec3{};
      contacts.push_back({k, p.normal, dot(p.normal, here - p.point.core) - instrument.radius, slip,
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
      const bool whole = std::ssize(rows) == compliance.rows();
      const MatrixXd some = whole ? MatrixXd{} : MatrixXd(compliance(rows, rows));
      const MatrixXd& of = whole ? compliance : some;
      const PushForces found =
          solve_pushes({of.data(), static_cast<std::size_t>(of.size())}, gap, start);
      looked.exact = found.solved;
      for (std::size_t i = 0; i < rows.size(); ++i)
        looked.forces[rows[i]] = found.push[i];
    }
    for (std::size_t k = 0; k < looked.pairs.size(); ++k) {
      TouchPair& p = pairs_[looked.pairs[k]];
      const Eigen::Vector3d force =
          directions(p) * looked.forces.segment(width() * static_cast<Index>(k), width());
      p.force = {force[0], force[1], force[2]};
    }
    const MatrixXd& columns = looked.columns;
    looked.x = base + times({columns.data(), columns.rows(), columns.cols()}, looked.forces);
  }
  /// The pairs that nobody looked at whose points are in their instruments, the deepest first.
  std::vector<std::uint32_t> overlooked(const LookedContacts& looked) const {
    if (looked.pairs.size() == active_.size())
      return {};
    const std::vector<Vec3> at = looked.x.size() > 0
                                     ? scene_.places_of(looked.x)
                                     : std::vector<Vec3>(scene_.free.begin(), scene_.free.end());
    std::vector<std::uint32_t> known(looked.pairs);
    std::ranges::sort(known);
    std::vector<std::pair<double, std::uint32_t>> found;
    for (const std::uint32_t i : active_) {
      if (std::ranges::binary_search(known, i))
        continue;
      const TouchPair& p = pairs_[i];
      const double radius = scene_.placed[p.instrument]->radius;
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

  Eigen::Vector3d normal_of(const LookedContacts& looked, Index k) const {
    const Vec3& n = pairs_[looked.pairs[static_cast<std::size_t>(k)]].normal;
    return {n.x, n.y, n.z};
  }
  const ContactScene& scene_;
  std::span<TouchPair> pairs_;
  std::span<const std::uint32_t> active_;
  std::optional<TouchPair>& stuck_;
  double largest_;
  bool rough_; ///< anything rubs
  const BentKernel& kernel_ = bent_kernel(best_cpu_level());
  std::vector<Point> points_; ///< of those that are looked at
};

} // namespace

std::optional<LookedContacts> solve_bent(const ContactScene& scene, std::span<TouchPair> pairs,
                                         std::span<const std::uint32_t> active,
                                         std::span<const Vec3> at, const BentParts& bent,
                                         const VectorXd& held, bool careful,
                                         std::optional<TouchPair>& stuck) {
  return LinearContacts(scene, pairs, active, stuck).solve(at, bent, held, careful);
}

} // namespace gewebe
