// How forces of contact turn and wander with the nodes they push.

#include "statics/contact_scene_internal.h"

#include <Eigen/Core>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

namespace gewebe {

namespace {

using Eigen::Index, Eigen::MatrixXd, Eigen::VectorXd;

constexpr double thin = 1e-6; ///< the square of a sine

class Bending {
public:
  Bending(const ContactScene& scene, std::span<const TouchPair> pairs,
          std::span<const std::uint32_t> active, std::span<const Vec3> at)
      : scene_(scene), pairs_(pairs), active_(active), at_(at) {}

  BentParts all(const Bend& how, const ContactParts* apart, VectorXd& held) const {
    held = VectorXd::Zero(scene_.rows());
    std::vector<Turning> turning(apart != nullptr ? apart->size() : 1);
    const std::vector<Index> row_of = rows_that_turn(apart, turning);
    for (const std::uint32_t i : active_) {
      if (!pushes(i))
        continue;
      const TouchPair& p = pairs_[i];
      std::optional<Matrix9> own = bending_of(p);
      if (!own)
        continue;
      if (how.loose < 1) {
        const Eigen::SelfAdjointEigenSolver<Matrix9> parts(*own);
        const Eigen::Matrix<double, 9, 1> all =
            parts.eigenvalues().cwiseMin(0.0) + how.loose * parts.eigenvalues().cwiseMax(0.0);
        *own = parts.eigenvectors() * all.asDiagonal() * parts.eigenvectors().transpose();
      }
      *own *= dot(p.force, p.normal);
      if (how.hold > 0)
        hold(p, how.hold, *own, held);
      for (std::size_t from = 0; from < 3; ++from)
        for (std::size_t to = 0; to < 3; ++to)
          if (p.piece[from] < scene_.nodes.moving && p.piece[to] < scene_.nodes.moving)
            turning[part_of(apart, p.piece[to])].h.block<3, 3>(row_of[p.piece[to]],
                                                               row_of[p.piece[from]]) +=
                own->block<3, 3>(3 * static_cast<Index>(to), 3 * static_cast<Index>(from));
    }
    return {scene_.w, std::move(turning), apart};
  }

private:
  static std::size_t part_of(const ContactParts* apart, std::size_t node) {
    return apart != nullptr ? apart->of_node[node] : 0;
  }

  /// Sets the rows of each part, with an H of 0. \return where each moving node that is pushed has
  /// its first one in it
  std::vector<Index> rows_that_turn(const ContactParts* apart,
                                    std::vector<Turning>& turning) const {
    std::vector<Index> row_of(scene_.nodes.moving, -1);
    for (const std::uint32_t i : active_)
      if (pushes(i))
        for (const std::uint32_t node : pairs_[i].piece)
          if (node < scene_.nodes.moving)
            row_of[node] = 0;
    std::vector<Index> before(turning.size(), 0); // nodes of the part
    for (std::size_t node = 0; node < row_of.size(); ++node) {
      const std::size_t part = part_of(apart, node);
      const Index own = before[part]++;
      if (row_of[node] < 0)
        continue;
      std::vector<Index>& rows = turning[part].rows;
      row_of[node] = std::ssize(rows);
      for (Index a = 0; a < 3; ++a)
        rows.push_back(3 * own + a);
    }
    for (Turning& part : turning)
      part.h = MatrixXd::Zero(std::ssize(part.rows), std::ssize(part.rows));
    return row_of;
  }

  /// Springs that hold a pair's point where its contact wants it: along the normal, and where it
  /// sticks along the surface.
  void hold(const TouchPair& p, double by, Matrix9& h, VectorXd& held) const {
    const Vec3 n = p.normal;
    Eigen::Matrix3d own = Eigen::Matrix3d::Zero(); // compliance of the point
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t d = 0; d < 3; ++d)
        if (p.piece[c] < scene_.nodes.moving && p.piece[d] < scene_.nodes.moving)
          own += p.point.weights[c] * p.point.weights[d] *
                 scene_.w.block<3, 3>(3 * static_cast<Index>(p.piece[c]),
                                      3 * static_cast<Index>(p.piece[d]));
    const PlacedInstrument& instrument = *scene_.placed[p.instrument];
    const MovedInstrument& way = *scene_.moved[p.instrument];
    const Vec3 here = point_of(p, at_),
               slip = here - carried(way.before, way.now, point_of(p, scene_.nodes.was));
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
      if (p.piece[c] < scene_.nodes.moving)
        for (int a = 0; a < 3; ++a)
          held[3 * static_cast<Index>(p.piece[c]) + a] -= stiffness * p.point.weights[c] * miss[a];
    }
  }
  bool pushes(std::uint32_t pair) const { return dot(pairs_[pair].force, pairs_[pair].normal) > 0; }

  /// Second derivatives of a pair's distance by its corners' places, 0 for repeated ones.
  std::optional<Matrix9> bending_of(const TouchPair& p) const {
    const PlacedInstrument& instrument = *scene_.placed[p.instrument];
    const int count = corner_count(p.piece);
    if (p.part.kind == CorePart::Kind::corner) {
      const std::array<Vec3, 3> corners = corners_of(p.piece, at_);
      const auto found = nearest_points(instrument, p.part, corners, count);
      if (!found || !found->has_normal(1e-3 * instrument.radius))
        return std::nullopt;
      if (auto own = bending_from_point(*found, corners, count))
        return own;
    }
    const double by = 1e-6 * instrument.radius;
    Matrix9 all = Matrix9::Zero();
    for (int c = 0; c < count; ++c)
      for (int a = 0; a < 3; ++a)
        for (const double side : {-by, by}) {
          std::array<Vec3, 3> corners = corners_of(p.piece, at_);
          corners[static_cast<std::size_t>(c)][a] += side;
          const auto found = nearest_points(instrument, p.part, corners, count);
          if (!found || !found->has_normal(1e-3 * instrument.radius))
            return std::nullopt;
          const Vec3 n = found->normal({});
          for (int d = 0; d < count; ++d)
            for (int b = 0; b < 3; ++b)
              all(3 * d + b, 3 * c + a) +=
                  found->weights[static_cast<std::size_t>(d)] * n[b] / (2 * side);
        }
    return 0.5 * (all + all.transpose());
  }
  const ContactScene& scene_;
  std::span<const TouchPair> pairs_;
  std::span<const std::uint32_t> active_;
  std::span<const Vec3> at_;
};

} // namespace

std::optional<Matrix9> bending_from_point(const SurfacePoint& found,
                                          const std::array<Vec3, 3>& corners, int count) {
  const auto eigen = [](const Vec3& v) { return Eigen::Vector3d(v.x, v.y, v.z); };
  const Eigen::Vector3d out = eigen(found.place - found.core), n = out / found.distance;
  std::array<Index, 3> on{};
  Index support = 0;
  for (Index c = 0; c < count; ++c)
    if (found.weights[static_cast<std::size_t>(c)] > 0)
      on[static_cast<std::size_t>(support++)] = c;
  if (support == 0)
    return std::nullopt;
  Matrix9 h = Matrix9::Zero();
  const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - n * n.transpose();
  Eigen::Matrix<double, 9, 2> mixed = Eigen::Matrix<double, 9, 2>::Zero();
  std::array<Eigen::Vector3d, 2> edge{};
  for (Index m = 0; m + 1 < support; ++m)
    edge[static_cast<std::size_t>(m)] =
        eigen(corners[static_cast<std::size_t>(on[static_cast<std::size_t>(m + 1)])] -
              corners[static_cast<std::size_t>(on[0])]);
  for (Index i = 0; i < support; ++i) {
    const Index at = on[static_cast<std::size_t>(i)];
    const double w = found.weights[static_cast<std::size_t>(at)];
    for (Index j = 0; j < support; ++j) {
      const Index to = on[static_cast<std::size_t>(j)];
      h.block<3, 3>(3 * at, 3 * to) = w * found.weights[static_cast<std::size_t>(to)] * across;
    }
    for (Index m = 0; m + 1 < support; ++m)
      mixed.block<3, 1>(3 * at, m) = w * edge[static_cast<std::size_t>(m)] +
                                     ((i == m + 1 ? 1.0 : 0.0) - (i == 0 ? 1.0 : 0.0)) * out;
  }
  if (support == 2)
    h -= mixed.col(0) * mixed.col(0).transpose() / edge[0].squaredNorm();
  if (support == 3) {
    const double a = edge[0].squaredNorm(), b = edge[0].dot(edge[1]), c = edge[1].squaredNorm();
    const double det = a * c - b * b;
    if (!(det > thin * a * c))
      return std::nullopt;
    Eigen::Matrix2d inverse;
    inverse << c / det, -b / det, -b / det, a / det;
    const Eigen::Matrix<double, 9, 2> turned = mixed * inverse;
    h -= turned.lazyProduct(mixed.transpose()); // which is too small to be packed
  }
  return h / found.distance;
}

BentParts bending(const ContactScene& scene, std::span<const TouchPair> pairs,
                  std::span<const std::uint32_t> active, std::span<const Vec3> at, const Bend& how,
                  const ContactParts* parts, VectorXd& held) {
  return Bending(scene, pairs, active, at).all(how, parts, held);
}

} // namespace gewebe
