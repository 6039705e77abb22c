#include "contact/contact_solver.h"

#include "contact/contact_interior_internal.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <optional>

// Based on: P. Alart, A. Curnier, A mixed formulation for
// frictional contact problems prone to Newton like solution methods, 1991.

namespace gewebe {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Of the largest diagonal entry: keeps contacts of one node that say the same solvable.
constexpr double regular = 1e-12;

// Of the same, in a Newton step alone: forces that contacts can share anyhow stay small.
constexpr double regular_step = 1e-7;

constexpr int max_vain = 2;   ///< rounds that don't halve the residual
constexpr int max_inner = 60; ///< steps along the centre
constexpr int max_idle = 12;  ///< of them that don't halve it
constexpr int max_newton = 12;
constexpr int max_sweeps = 10;

using Block = Eigen::Matrix3d;

/// The problem in the coordinates of its contacts: n, t1, t2 of each.
struct Local {
  std::vector<Block> frame; ///< rows n, t1, t2
  MatrixXd w;
  VectorXd q; ///< gap, slip
};

Eigen::Vector3d eigen(const Vec3& v) {
  return {v.x, v.y, v.z};
}

Block frame_of(const Vec3& n) {
  const Vec3 helper = std::abs(n.x) < 0.6 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
  Vec3 t = cross(n, helper);
  t = t / norm(t);
  Block f;
  f.row(0) = eigen(n);
  f.row(1) = eigen(t);
  f.row(2) = eigen(cross(n, t));
  return f;
}

using Compliance = Eigen::Map<const MatrixXd>;

Compliance matrix(std::span<const double> compliance, std::size_t m) {
  return {compliance.data(), static_cast<Index>(3 * m), static_cast<Index>(3 * m)};
}

Block block(const Compliance& w, const Contact& a, const Contact& b) {
  return w.block<3, 3>(3 * static_cast<Index>(a.node), 3 * static_cast<Index>(b.node));
}

Local local(const Compliance& w, std::span<const Contact> contacts) {
  const auto count = static_cast<Index>(contacts.size());
  Local l;
  l.w.resize(3 * count, 3 * count);
  l.q.resize(3 * count);
  for (const Contact& c : contacts)
    l.frame.push_back(frame_of(c.normal));
  for (Index i = 0; i < count; ++i) {
    const auto ci = static_cast<std::size_t>(i);
    l.q.segment<3>(3 * i) = l.frame[ci] * eigen(contacts[ci].slip);
    l.q[3 * i] = contacts[ci].gap;
    for (Index j = 0; j < count; ++j) {
      const auto cj = static_cast<std::size_t>(j);
      l.w.block<3, 3>(3 * i, 3 * j) =
          l.frame[ci] * block(w, contacts[ci], contacts[cj]) * l.frame[cj].transpose();
    }
  }
  const double largest = l.w.size() > 0 ? l.w.diagonal().maxCoeff() : 0;
  l.w.diagonal().array() += regular * largest;
  return l;
}

/// The force in 1 contact whose gap and slip are b without it.
Eigen::Vector3d alone(const Block& w, const Eigen::Vector3d& b, double friction) {
  if (b[0] >= 0)
    return Eigen::Vector3d::Zero();
  if (friction == 0)
    return {-b[0] / w(0, 0), 0, 0};
  const Eigen::Vector3d stick = -w.ldlt().solve(b);
  if (stick[0] >= 0 && stick.tail<2>().norm() <= friction * stick[0])
    return stick;
  // Slipping: with g = 0 the tangential part is (S + α) f_t = -c, and |f_t| - μ f_n falls from
  // above 0 at α = 0 to below 0 at infinity.
  const Eigen::Matrix2d s =
      w.bottomRightCorner<2, 2>() - w.bottomLeftCorner<2, 1>() * w.topRightCorner<1, 2>() / w(0, 0);
  const Eigen::Vector2d c = b.tail<2>() - w.bottomLeftCorner<2, 1>() * (b[0] / w(0, 0));
  const auto at = [&](double alpha) {
    const double xx = s(0, 0) + alpha, yy = s(1, 1) + alpha, xy = s(0, 1);
    const double det = xx * yy - xy * xy;
    Eigen::Vector3d f;
    f[1] = -(yy * c[0] - xy * c[1]) / det;
    f[2] = -(xx * c[1] - xy * c[0]) / det;
    f[0] = -(b[0] + w.topRightCorner<1, 2>().dot(f.tail<2>())) / w(0, 0);
    return f;
  };
  const auto excess = [&](const Eigen::Vector3d& f) {
    return f.tail<2>().norm() - friction * f[0];
  };
  double low = 0, high = std::max(s.trace(), 1e-300);
  double above = excess(stick), below = excess(at(high)); // at low, at high
  while (below > 0 && std::isfinite(high)) {
    low = high;
    above = below;
    high *= 4;
    below = excess(at(high));
  }
  // The chord's root, with an end that stays weighed less and less (Illinois's way).
  for (int k = 0, side = 0; k < 60; ++k) {
    const double chord = high - below * (high - low) / (below - above);
    const double next = chord > low && chord < high && k % 8 != 7 ? chord : low + (high - low) / 2;
    if (!(next > low && next < high))
      break;
    const Eigen::Vector3d f = at(next);
    const double value = excess(f);
    if (value > 0) {
      low = next;
      above = value;
      below /= side == 1 ? 2 : 1;
      side = 1;
    } else {
      high = next;
      below = value;
      above /= side == -1 ? 2 : 1;
      side = -1;
      if (-value <= 1e-15 * friction * f[0])
        break;
    }
  }
  return at(high);
}

struct Residual {
  VectorXd value;
  double size = 0; ///< largest, over the largest force
};

/// Alart and Curnier's equations, in forces: f - P(f - ρ r).
Residual equations(const Local& l, std::span<const Contact> contacts, const VectorXd& f) {
  const VectorXd r = l.q + l.w * f;
  Residual e;
  e.value.resize(f.size());
  double scale = 0, miss = 0;
  for (Index i = 0; 3 * i < f.size(); ++i) {
    const double friction = contacts[static_cast<std::size_t>(i)].friction;
    const Block w = l.w.block<3, 3>(3 * i, 3 * i);
    const double rho_n = 1 / w(0, 0), rho_t = 2 / (w(1, 1) + w(2, 2));
    const Eigen::Vector3d fi = f.segment<3>(3 * i), ri = r.segment<3>(3 * i);
    const double push = std::max(0.0, fi[0] - rho_n * ri[0]);
    e.value[3 * i] = fi[0] - push;
    Eigen::Vector2d drag = fi.tail<2>() - rho_t * ri.tail<2>();
    const double size = drag.norm();
    if (size > friction * push)
      drag *= friction * push / size;
    e.value.segment<2>(3 * i + 1) = fi.tail<2>() - drag;
    scale = std::max({scale, fi.norm(), push});
    const double here = e.value.segment<3>(3 * i).norm();
    miss = std::isnan(here) ? here : std::max(miss, here);
  }
  e.size = scale > 0 ? miss / scale : miss;
  return e;
}

/// One Newton step from f; false where it leads nowhere.
bool newton(const Local& l, std::span<const Contact> contacts, VectorXd& f, Residual& e) {
  const VectorXd r = l.q + l.w * f;
  std::vector<Index> on; // contacts that push; the others' forces become 0
  VectorXd base = f;
  for (Index i = 0; 3 * i < f.size(); ++i)
    if (f[3 * i] - r[3 * i] / l.w(3 * i, 3 * i) > 0)
      on.push_back(i);
    else
      base.segment<3>(3 * i).setZero();
  const VectorXd rb = l.q + l.w * base;
  const double soft = regular_step * l.w.diagonal().maxCoeff();
  const auto size = static_cast<Index>(3 * on.size());
  MatrixXd jacobian(size, size);
  VectorXd rhs(size);
  for (std::size_t a = 0; a < on.size(); ++a) {
    const Index i = on[a], row = static_cast<Index>(3 * a);
    const double friction = contacts[static_cast<std::size_t>(i)].friction;
    const Block w = l.w.block<3, 3>(3 * i, 3 * i);
    const double rho_n = 1 / w(0, 0), rho_t = 2 / (w(1, 1) + w(2, 2));
    const double push = base[3 * i] - rho_n * rb[3 * i];
    const Eigen::Vector2d z = base.segment<2>(3 * i + 1) - rho_t * rb.segment<2>(3 * i + 1);
    const double length = z.norm();
    // Rows of r, then of f, in each of the three equations.
    Block of_r = Block::Zero(), of_f = Block::Zero();
    Eigen::Vector3d value;
    of_r(0, 0) = rho_n;
    value[0] = base[3 * i] - push;
    if (length <= friction * std::max(0.0, push)) {
      of_r(1, 1) = of_r(2, 2) = rho_t;
      value.tail<2>() = rho_t * rb.segment<2>(3 * i + 1);
    } else {
      const double bound = friction * std::max(0.0, push);
      const Eigen::Vector2d t = length > 0 ? Eigen::Vector2d(z / length) : Eigen::Vector2d::Zero();
      const Eigen::Matrix2d d = bound / length * (Eigen::Matrix2d::Identity() - t * t.transpose());
      of_f.bottomRightCorner<2, 2>() = Eigen::Matrix2d::Identity() - d;
      of_r.bottomRightCorner<2, 2>() = rho_t * d;
      of_f.bottomLeftCorner<2, 1>() = -friction * t;
      of_r.bottomLeftCorner<2, 1>() = friction * rho_n * t;
      value.tail<2>() = base.segment<2>(3 * i + 1) - bound * t;
    }
    for (std::size_t b = 0; b < on.size(); ++b)
      jacobian.block<3, 3>(row, static_cast<Index>(3 * b)) =
          of_r * l.w.block<3, 3>(3 * i, 3 * on[b]);
    jacobian.block<3, 3>(row, row) += of_f + soft * of_r;
    rhs.segment<3>(row) = -value;
  }
  const VectorXd by = jacobian.partialPivLu().solve(rhs);
  if (!by.allFinite())
    return false;
  for (const double part : {1.0, 0.5, 0.25, 0.125}) {
    VectorXd g = base;
    for (std::size_t a = 0; a < on.size(); ++a)
      g.segment<3>(3 * on[a]) += part * by.segment<3>(static_cast<Index>(3 * a));
    Residual there = equations(l, contacts, g);
    if (there.size < e.size) {
      f = g;
      e = std::move(there);
      return true;
    }
  }
  return false;
}

void sweep(const Local& l, std::span<const Contact> contacts, VectorXd& f) {
  for (Index i = 0; 3 * i < f.size(); ++i) {
    const Block w = l.w.block<3, 3>(3 * i, 3 * i);
    const Eigen::Vector3d old = f.segment<3>(3 * i);
    const Eigen::Vector3d b = l.q.segment<3>(3 * i) + l.w.middleRows<3>(3 * i) * f - w * old;
    f.segment<3>(3 * i) = alone(w, b, contacts[static_cast<std::size_t>(i)].friction);
  }
}

/// The normal forces under given tangential ones.
void push_out(const Local& l, VectorXd& f) {
  const Index count = f.size() / 3;
  MatrixXd a(count, count);
  VectorXd b(count), drag = f;
  std::vector<double> start;
  for (Index i = 0; i < count; ++i) {
    start.push_back(f[3 * i]);
    drag[3 * i] = 0;
  }
  const VectorXd r = l.q + l.w * drag;
  for (Index i = 0; i < count; ++i) {
    b[i] = r[3 * i];
    for (Index j = 0; j < count; ++j)
      a(i, j) = l.w(3 * i, 3 * j);
  }
  const PushForces pushes = solve_pushes({a.data(), static_cast<std::size_t>(a.size())},
                                         {b.data(), static_cast<std::size_t>(b.size())}, start);
  for (Index i = 0; i < count; ++i)
    f[3 * i] = pushes.push[static_cast<std::size_t>(i)];
}

/// Along the centre, then by Newton's steps. \pre e is of f; so it is behind
void go_inside(const Local& l, std::span<const Contact> contacts, VectorXd& f, Residual& e,
               double tolerance) {
  std::vector<Index> rows;
  std::vector<double> friction;
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    friction.push_back(contacts[i].friction);
    for (Index a = 0; a < (contacts[i].friction > 0 ? 3 : 1); ++a)
      rows.push_back(3 * static_cast<Index>(i) + a);
  }
  const MatrixXd w = l.w(rows, rows);
  const VectorXd q = l.q(rows);
  double last = HUGE_VAL;
  int idle = 0;
  follow_contact_centre(w, q, friction, max_inner, [&](const VectorXd& some) {
    VectorXd all = VectorXd::Zero(f.size());
    all(rows) = some;
    Residual there = equations(l, contacts, all);
    idle = there.size < 0.5 * last ? 0 : idle + 1;
    last = idle == 0 ? there.size : last;
    if (there.size < e.size) {
      f = std::move(all);
      e = std::move(there);
    }
    return e.size <= 0.1 * tolerance || idle == max_idle;
  });
  for (int k = 0; k < max_newton && !(e.size <= tolerance); ++k)
    if (!newton(l, contacts, f, e))
      break;
}

} // namespace

ContactForces solve_contacts(std::span<const double> compliance, std::size_t m,
                             std::span<const Contact> contacts, std::span<const Vec3> start,
                             double tolerance) {
  ContactForces result;
  if (contacts.empty()) {
    result.solved = true;
    return result;
  }
  const Local l = local(matrix(compliance, m), contacts);
  VectorXd f = VectorXd::Zero(l.q.size());
  bool rough = false;
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const auto row = static_cast<Index>(3 * i);
    if (!start.empty()) {
      f.segment<3>(row) = l.frame[i] * eigen(start[i]);
      f[row] = std::max(0.0, f[row]);
      if (contacts[i].friction == 0)
        f.segment<2>(row + 1).setZero();
    }
    rough = rough || contacts[i].friction > 0;
  }
  push_out(l, f);
  Residual e = equations(l, contacts, f);
  double best = HUGE_VAL;
  for (int vain = 0; rough && vain < max_vain && !(e.size <= tolerance);) {
    for (int k = 0; k < max_newton && !(e.size <= tolerance); ++k)
      if (!newton(l, contacts, f, e))
        break;
    if (e.size <= tolerance)
      break;
    for (int k = 0; k < max_sweeps; ++k)
      sweep(l, contacts, f);
    e = equations(l, contacts, f);
    vain = e.size < 0.5 * best ? 0 : vain + 1;
    best = e.size < best ? e.size : best;
  }
  if (rough && !(e.size <= tolerance))
    go_inside(l, contacts, f, e, tolerance);
  if (rough && !(e.size <= tolerance)) { // rather nothing inside, than friction right
    VectorXd out = f;
    push_out(l, out);
    if (Residual there = equations(l, contacts, out); there.size < e.size) {
      f = std::move(out);
      e = std::move(there);
    }
  }
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const Eigen::Vector3d g = l.frame[i].transpose() * f.segment<3>(static_cast<Index>(3 * i));
    result.force.push_back({g[0], g[1], g[2]});
  }
  result.residual = e.size;
  result.solved = e.size <= tolerance;
  return result;
}

double contact_residual(std::span<const double> compliance, std::size_t m,
                        std::span<const Contact> contacts, std::span<const Vec3> force) {
  const Local l = local(matrix(compliance, m), contacts);
  VectorXd f(l.q.size());
  for (std::size_t i = 0; i < contacts.size(); ++i)
    f.segment<3>(static_cast<Index>(3 * i)) = l.frame[i] * eigen(force[i]);
  return equations(l, contacts, f).size;
}

} // namespace gewebe
