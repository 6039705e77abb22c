#include "solid/solid_motion.h"

#include "base/error.h"
#include "base/parallel.h"
#include "solid/assembly_internal.h"
#include "solid/corotational.h"
#include "solve/factor.h"
#include "solve/single_factor.h"
#include "solve/stiffness.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

namespace gewebe {

namespace {

using Numbers = std::vector<double>;

/// Four sums side by side: always the same, and not one addition after the other.
double product(std::span<const double> a, std::span<const double> b) {
  std::array<double, 4> sum{};
  std::size_t k = 0;
  for (; k + 4 <= a.size(); k += 4)
    for (std::size_t lane = 0; lane < 4; ++lane)
      sum[lane] += a[k + lane] * b[k + lane];
  for (; k < a.size(); ++k)
    sum[0] += a[k] * b[k];
  return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

void add(std::span<double> to, double factor, std::span<const double> of) {
  for (std::size_t k = 0; k < to.size(); ++k)
    to[k] += factor * of[k];
}

/// What L-BFGS knows of a step's rounds (Nocedal, Wright, Numerical optimization, 2006, 7.2).
class Secants {
public:
  void clear() { pairs_.clear(); }
  void add(Numbers moved, Numbers turned) {
    const double curvature = product(moved, turned);
    if (!(curvature > 0))
      return;
    if (pairs_.size() == most)
      pairs_.pop_front();
    pairs_.push_back({std::move(moved), std::move(turned), 1 / curvature});
  }
  /// The direction for a gradient, by `solve` in place.
  template <class Solve>
  void direction(Numbers& gradient, const Solve& solve) const {
    std::array<double, most> part{};
    for (std::size_t k = pairs_.size(); k-- > 0;) {
      part[k] = pairs_[k].over * product(pairs_[k].moved, gradient);
      gewebe::add(gradient, -part[k], pairs_[k].turned);
    }
    solve(gradient);
    for (std::size_t k = 0; k < pairs_.size(); ++k)
      gewebe::add(gradient, part[k] - pairs_[k].over * product(pairs_[k].turned, gradient),
                  pairs_[k].moved);
  }

private:
  static constexpr std::size_t most = 8;
  struct Pair {
    Numbers moved, turned; ///< of places, of gradients
    double over;
  };
  std::deque<Pair> pairs_;
};

using Matrix3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

Matrix3 matrix(const SolidBlock& block) {
  return Eigen::Map<const Matrix3>(block.data());
}

Eigen::Vector3d eigen(const Vec3& v) {
  return {v.x, v.y, v.z};
}

/// What the turning of the frame adds to the tangent of a corotational element, where positive:
/// the energy aᵀ m a of a = Rᵀ curl of the displacement, over twice the volume. Exact for linear
/// elements without damping.
Matrix3 turning(const SolidElement& element, const ElementFrame& frame) {
  const auto [lambda, mu] = element.material;
  const SymmetricBlock& s = frame.stretch;
  const double trace = s[0] + s[3] + s[5];
  Matrix3 g;
  g << trace - s[0], -s[1], -s[2], -s[1], trace - s[3], -s[4], -s[2], -s[4], trace - s[5];
  const Eigen::SelfAdjointEigenSolver<Matrix3> solver(g);
  Eigen::Vector3d value;
  for (int k = 0; k < 3; ++k) {
    const double pair = solver.eigenvalues()[k];
    value[k] = pair > 0 ? std::max(0.0, mu + (lambda * (trace - 3) - 2 * mu) / pair) : 0;
  }
  return solver.eigenvectors() * value.asDiagonal() * solver.eigenvectors().transpose();
}

Matrix3 cross_matrix(const Vec3& v) {
  Matrix3 m;
  m << 0, -v.z, v.y, v.z, 0, -v.x, -v.y, v.x, 0;
  return m;
}

/// Gradient of a node's shape function in the middle of the element.
Vec3 middle_gradient(const SolidElement& e, std::size_t a, bool quadratic) {
  if (!quadratic)
    return e.gradient[a];
  if (a < 4)
    return {};
  const auto [i, j] = tetrahedron_edges[a - 4];
  return e.gradient[i] + e.gradient[j];
}

} // namespace

double damping_per_stiffness(double ratio, double frequency) {
  return ratio / (std::numbers::pi * frequency);
}

struct SolidMotion::State {
  TetMesh mesh;
  std::vector<SolidElement> elements;
  SolidMotionOptions options;
  CorotationalSolid solid;
  Numbers masses; ///< by node
  Numbers rest, place, velocity, load, reactions;
  Numbers acceleration; ///< of the last step, if one was of `last_step`
  double last_step = 0;
  std::vector<std::uint8_t> held;
  Numbers target; ///< of held axes in the next step: displacements
  bool moved = false, renewed = true;
  double elastic = 0;        ///< of `place`
  double unsure_at_rest = 0; ///< of the energy, by rounding
  std::vector<Vec3> bubbles, new_bubbles;

  // The constant matrix.
  double factor_step = 0;
  std::vector<std::uint8_t> factor_held;
  StiffnessMatrix stiffness;
  std::optional<Factor> factor;
  std::optional<SingleFactor> quick;
  Numbers rotations;
  // The tangent of the reference.
  StiffnessMatrix tangent;
  std::optional<Factor> tangent_factor;
  std::vector<Numbers> of_element; ///< tangents of Neo-Hookean elements, bubbles eliminated

  State(const TetMesh& of, std::span<const SolidMaterial> materials, const SolidMotionOptions& with,
        const Context& context)
      : mesh(of), elements(solid_elements(of, materials, context)), options(with),
        solid(of, elements), masses(solid_masses(of, materials)) {
    const std::size_t axes = 3 * mesh.points.size();
    for (const Vec3& p : mesh.points)
      rest.insert(rest.end(), {p.x, p.y, p.z});
    place = rest;
    velocity.resize(axes);
    acceleration.resize(axes);
    load.resize(axes);
    reactions.resize(axes);
    target.resize(axes);
    held.resize(axes);
    if (options.law == SolidLaw::stable_neo_hookean && !mesh.middles.empty())
      bubbles.resize(elements.size());
    new_bubbles = bubbles;
    if (options.law == SolidLaw::stable_neo_hookean) // a difference of numbers of the size of mu
      for (const SolidElement& e : elements)
        unsure_at_rest += 1e-14 * e.material.mu * e.volume;
  }

  std::size_t axes() const { return place.size(); }
  bool quadratic() const { return !mesh.middles.empty(); }
  bool any_held() const {
    return std::ranges::any_of(held, [](std::uint8_t h) { return h != 0; });
  }

  // ---- energies

  /// Of Neo-Hookean elements, into `forces` what is added; bubbles are where they have least
  /// energy.
  double hyperelastic(const Numbers& at, std::span<double> forces, const Context& context) {
    const std::size_t count = solid_nodes(mesh);
    Numbers energy(elements.size());
    std::vector<std::array<Vec3, 10>> part(elements.size());
    parallel_blocks(context, elements.size(), 64, [&](std::size_t begin, std::size_t end) {
      HyperelasticResponse response;
      for (std::size_t t = begin; t < end; ++t) {
        const std::array<Vec3, 10> u = displacements(at, t);
        Vec3 bubble;
        if (count == 10)
          bubble = new_bubbles[t] = settled_bubble(t, u);
        hyperelastic_response(elements[t], HyperelasticLaw::stable_neo_hookean,
                              std::span(u).first(count), bubble, HyperelasticPart::force, response);
        energy[t] = response.energy;
        for (std::size_t a = 0; a < count; ++a)
          part[t][a] = response.force[a];
      }
    });
    double sum = 0;
    for (std::size_t t = 0; t < elements.size(); ++t) {
      sum += energy[t];
      for (std::size_t a = 0; a < count; ++a)
        for (int i = 0; i < 3; ++i)
          forces[3 * std::size_t{solid_node(mesh, t, a)} + static_cast<std::size_t>(i)] +=
              part[t][a][i];
    }
    return sum;
  }

  std::array<Vec3, 10> displacements(const Numbers& at, std::size_t t) const {
    std::array<Vec3, 10> u;
    for (std::size_t a = 0; a < solid_nodes(mesh); ++a) {
      const std::size_t axis = 3 * std::size_t{solid_node(mesh, t, a)};
      u[a] = {at[axis] - rest[axis], at[axis + 1] - rest[axis + 1], at[axis + 2] - rest[axis + 2]};
    }
    return u;
  }

  /// The least energy's bubble, from the state's: BFGS from the bubble's flexibility at rest.
  Vec3 settled_bubble(std::size_t t, const std::array<Vec3, 10>& u) const {
    constexpr auto law = HyperelasticLaw::stable_neo_hookean;
    const SolidElement& e = elements[t];
    const SymmetricBlock& f = e.bubble_flexibility;
    const double integral = 32.0 / 105 * e.volume;
    const Matrix3 r = matrix(solid.frame(t).rotation);
    Matrix3 inverse;
    inverse << f[0], f[1], f[2], f[1], f[3], f[4], f[2], f[4], f[5];
    inverse = r * inverse * r.transpose() / (integral * integral);
    HyperelasticResponse response;
    const auto at = [&](const Eigen::Vector3d& w) {
      hyperelastic_response(e, law, u, {w[0], w[1], w[2]}, HyperelasticPart::force, response);
    };
    Eigen::Vector3d w = eigen(bubbles[t]);
    at(w);
    for (int round = 0; round < 60; ++round) {
      const Eigen::Vector3d force = eigen(response.force[10]), by = inverse * force;
      const double slope = force.dot(by), energy = response.energy,
                   unsure = 1e-14 * (std::abs(energy) + e.material.mu * e.volume);
      // Of the second order in what the bubble is off by: what is left changes no force.
      if (!(slope > 1e-10 * unsure))
        break;
      double s = 1;
      for (; s > 1e-6; s /= 2) {
        at(w + s * by);
        if (response.energy <= energy - 1e-4 * s * slope + unsure)
          break;
      }
      if (!(s > 1e-6))
        break;
      w += s * by;
      const Eigen::Vector3d step = s * by, turned = force - eigen(response.force[10]);
      if (const double curvature = step.dot(turned); curvature > 0) {
        const Matrix3 side = Matrix3::Identity() - step * turned.transpose() / curvature;
        inverse = (side * inverse * side.transpose() + step * step.transpose() / curvature).eval();
      }
    }
    return {w[0], w[1], w[2]};
  }

  double potential(const Numbers& at, double damping, std::span<double> forces,
                   const Context& context) {
    const bool corotational = options.law == SolidLaw::corotational;
    const double energy = solid.evaluate(at, {corotational ? 1.0 : 0.0, damping}, forces, context);
    return corotational ? energy : energy + hyperelastic(at, forces, context);
  }

  double work_of_load(const Numbers& at) const {
    double sum = 0;
    for (std::size_t axis = 0; axis < axes(); ++axis)
      sum += load[axis] * (at[axis] - rest[axis]);
    return sum;
  }

  double kinetic() const {
    double sum = 0;
    for (std::size_t axis = 0; axis < axes(); ++axis)
      sum += masses[axis / 3] * velocity[axis] * velocity[axis];
    return sum / 2;
  }

  // ---- a step

  /// What a step makes least.
  struct Objective {
    double h, inertia; ///< per mass
    Numbers ahead;     ///< where inertia alone leads
  };

  struct Found {
    Numbers at, gradient; ///< 0 on held axes
    Numbers forces;       ///< what holders must push with, on all axes
    double value = HUGE_VAL, unsure = 0;
  };

  void evaluate(const Objective& o, Found& found, const Context& context) {
    found.gradient.resize(axes());
    found.forces.resize(axes());
    const double energy = potential(found.at, options.damping / o.h, found.forces, context),
                 work = work_of_load(found.at);
    double inertial = 0, forced = 0;
    for (std::size_t axis = 0; axis < axes(); ++axis) {
      const double off = found.at[axis] - o.ahead[axis], mass = masses[axis / 3] * o.inertia;
      forced += std::abs(found.forces[axis] * found.at[axis]);
      found.forces[axis] = mass * off - found.forces[axis] - load[axis];
      found.gradient[axis] = held[axis] != 0 ? 0 : found.forces[axis];
      if (held[axis] == 0)
        inertial += mass * off * off / 2;
    }
    found.value = energy + inertial - work;
    found.unsure = unsure_at_rest + 1e-15 * forced +
                   1e-13 * (std::abs(energy) + std::abs(inertial) + std::abs(work));
  }

  int make_factor(double h, const Context& context) {
    if (factor && factor_step == h && factor_held == held)
      return 0;
    const double scale = 1 + options.damping / h, inertia = 1 / (h * h) + options.drag / h;
    const bool same_pattern = factor && factor_held == held;
    if (!same_pattern)
      stiffness = solid_stiffness(mesh, elements, held, context);
    StiffnessMatrix a = stiffness;
    for (double& value : a.value)
      value *= scale;
    add_masses(a, inertia);
    if (same_pattern)
      factor->refactor(a, context);
    else
      factor.emplace(a, context);
    quick.emplace(*factor);
    factor_step = h;
    factor_held = held;
    return 1;
  }

  void add_masses(StiffnessMatrix& a, double inertia) const {
    for (std::size_t c = 0; c < a.order(); ++c)
      a.value[static_cast<std::size_t>(a.column_start[c])] +=
          masses[static_cast<std::size_t>(a.axis_of_row[c]) / 3] * inertia;
  }

  /// Frames of nodes, as in the last evaluation; those that are held along an axis don't turn.
  void turn_frames(const Context& context) {
    rotations.resize(3 * axes());
    solid.node_rotations(rotations, context);
    for (std::size_t i = 0; i < axes() / 3; ++i)
      if (held[3 * i] != 0 || held[3 * i + 1] != 0 || held[3 * i + 2] != 0)
        for (std::size_t k = 0; k < 9; ++k)
          rotations[9 * i + k] = k % 4 == 0 ? 1 : 0;
  }

  /// A⁻¹ in the nodes' frames, in place, to single precision.
  void solve_turned(Numbers& v, const Context& context) {
    const std::size_t order = stiffness.order();
    Numbers rows(order), turned(axes());
    for (std::size_t i = 0; i < axes() / 3; ++i) {
      const double *const r = rotations.data() + 9 * i, *const from = v.data() + 3 * i;
      for (std::size_t k = 0; k < 3; ++k)
        turned[3 * i + k] = r[k] * from[0] + r[3 + k] * from[1] + r[6 + k] * from[2];
    }
    double scale = 0; // whatever the numbers are, single precision holds them
    for (std::size_t k = 0; k < order; ++k) {
      rows[k] = turned[static_cast<std::size_t>(stiffness.axis_of_row[k])];
      scale = std::max(scale, std::abs(rows[k]));
    }
    if (!(scale > 0 && std::isfinite(scale)))
      return;
    for (double& value : rows)
      value /= scale;
    quick->solve(rows, context);
    std::ranges::fill(turned, 0.0);
    for (std::size_t k = 0; k < order; ++k)
      turned[static_cast<std::size_t>(stiffness.axis_of_row[k])] = scale * rows[k];
    for (std::size_t i = 0; i < axes() / 3; ++i) {
      const double *const r = rotations.data() + 9 * i, *const from = turned.data() + 3 * i;
      for (std::size_t k = 0; k < 3; ++k)
        v[3 * i + k] = r[3 * k] * from[0] + r[3 * k + 1] * from[1] + r[3 * k + 2] * from[2];
    }
  }

  /// The tangent's factor where the last evaluation was, at `at`.
  void make_tangent(const Objective& o, const Numbers& at, const Context& context) {
    const std::size_t count = solid_nodes(mesh);
    const bool corotational = options.law == SolidLaw::corotational;
    if (!corotational)
      tangents(at, context);
    const double scale = (corotational ? 1 : 0) + options.damping / o.h;
    std::vector<Matrix3> turns(elements.size()), frames(elements.size());
    for (std::size_t t = 0; t < elements.size(); ++t) {
      const ElementFrame frame = solid.frame(t);
      frames[t] = matrix(frame.rotation);
      turns[t] = corotational ? turning(elements[t], frame) : Matrix3(Matrix3::Zero());
    }
    const auto block_of = [&](std::size_t t, std::size_t a, std::size_t b) {
      const SolidElement& e = elements[t];
      const SolidBlock small = count == 4 ? linear_block(e, a, b) : quadratic_block(e, a, b);
      const Matrix3 ga = cross_matrix(middle_gradient(e, a, count == 10)),
                    gb = cross_matrix(middle_gradient(e, b, count == 10));
      const Matrix3 local = scale * matrix(small) + e.volume * ga.transpose() * turns[t] * gb;
      SolidBlock block;
      Eigen::Map<Matrix3> to(block.data());
      to = frames[t] * local * frames[t].transpose();
      if (!corotational)
        for (std::size_t n = 0; n < 9; ++n)
          block[n] += of_element[t][3 * count * (3 * a + n / 3) + 3 * b + n % 3];
      return block;
    };
    tangent = assembled_matrix(mesh, block_of, held, context);
    add_masses(tangent, o.inertia);
    if (tangent_factor && tangent_factor->order() == tangent.order() && !renewed)
      tangent_factor->refactor(tangent, context);
    else
      tangent_factor.emplace(tangent, context);
    renewed = false;
  }

  void tangents(const Numbers& at, const Context& context) {
    const std::size_t count = solid_nodes(mesh);
    const auto order = static_cast<Eigen::Index>(3 * count);
    of_element.resize(elements.size());
    parallel_blocks(context, elements.size(), 16, [&](std::size_t begin, std::size_t end) {
      HyperelasticResponse response;
      for (std::size_t t = begin; t < end; ++t) {
        const std::array<Vec3, 10> u = displacements(at, t);
        hyperelastic_response(elements[t], HyperelasticLaw::stable_neo_hookean,
                              std::span(u).first(count), count == 10 ? new_bubbles[t] : Vec3{},
                              HyperelasticPart::positive_tangent, response);
        const Eigen::Map<const Eigen::Matrix<double, 33, 33, Eigen::RowMajor>> k(
            response.tangent.data());
        of_element[t].resize(9 * count * count);
        Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> own(
            of_element[t].data(), order, order);
        own = k.topLeftCorner(order, order);
        if (count == 10) {
          const Eigen::Matrix<double, 3, 30> between = k.bottomLeftCorner<3, 30>();
          own.noalias() -= between.transpose() * k.bottomRightCorner<3, 3>().llt().solve(between);
        }
      }
    });
  }

  void solve_tangent(Numbers& v) const {
    const Numbers f = v;
    solve_axes(tangent, *tangent_factor, f, v);
  }

  double step_length(const Numbers& at) const {
    double sum = 0;
    for (std::size_t axis = 0; axis < axes(); ++axis)
      sum += (at[axis] - place[axis]) * (at[axis] - place[axis]);
    return std::sqrt(sum);
  }

  /// From `now`, evaluated, downhill to the least value.
  void descend(const Objective& o, Found& now, SolidStep& step, const Context& context) {
    // Rounding of places, which no round gets below.
    const double rounding = 1e-15 * std::sqrt(product(rest, rest));
    const double tolerance = options.reference ? 1e-10 : options.tolerance;
    const int most = options.reference ? 200 : options.max_rounds;
    Secants secants;
    Found next;
    double before = HUGE_VAL;
    bool fresh = false;
    if (!options.reference)
      turn_frames(context);
    while (step.rounds < most) {
      if (context.cancelled && context.cancelled())
        throw Cancelled();
      if (options.reference && (step.rounds == 0 || step.change > 0.25 * before)) {
        make_tangent(o, now.at, context);
        ++step.factorisations;
        secants.clear();
        fresh = true;
      }
      before = step.change;
      Numbers direction = now.gradient;
      secants.direction(direction, [&](Numbers& v) {
        if (options.reference)
          solve_tangent(v);
        else
          solve_turned(v, context);
      });
      ++step.rounds;
      const double slope = product(now.gradient, direction),
                   length = std::sqrt(product(direction, direction));
      if (!(length > rounding)) {
        step.change = 0;
        return;
      }
      double s = 1;
      bool found = false;
      for (; s > 1e-14 && !found && slope > 0; s /= 2) {
        next.at = now.at;
        add(next.at, -s, direction);
        evaluate(o, next, context);
        found = next.value <= now.value - 1e-4 * s * slope + now.unsure;
      }
      if (!found) {                // nothing to be gained, but perhaps with a matrix of here
        evaluate(o, now, context); // frames, strains and bubbles are those of the last one
        if (fresh || (!options.reference && before == HUGE_VAL))
          return;
        secants.clear();
        before = HUGE_VAL;
        step.change = HUGE_VAL;
        continue;
      }
      fresh = false;
      s *= 2; // what was taken
      step.change = s * length / step_length(next.at);
      Numbers taken = next.at, turned = next.gradient;
      add(taken, -1, now.at);
      add(turned, -1, now.gradient);
      secants.add(std::move(taken), std::move(turned));
      std::swap(now, next);
      if (s == 1 && step.change <= tolerance)
        return;
    }
  }

  /// Speeds such that the energy is what it was, at most; true if they had to be lowered.
  bool limit(double before, double rounding) {
    const double kinetic_now = kinetic(),
                 excess = kinetic_now + elastic - work_of_load(place) - before;
    if (!(excess > rounding))
      return false;
    Numbers body(axes()), turning_part(axes());
    if (!any_held())
      rigid_parts(body, turning_part);
    const auto energy_of = [&](const Numbers& v) {
      double sum = 0;
      for (std::size_t axis = 0; axis < axes(); ++axis)
        sum += masses[axis / 3] * v[axis] * v[axis];
      return sum / 2;
    };
    Numbers inner = velocity;
    add(inner, -1, body);
    add(inner, -1, turning_part);
    double inner_energy = energy_of(inner), turning_energy = energy_of(turning_part);
    const auto take = [&](double energy, double& left) { // the factor that takes so much of it
      const double taken = std::min(energy, left);
      left -= taken;
      return energy > 0 ? std::sqrt(std::max(0.0, 1 - taken / energy)) : 0;
    };
    double left = excess;
    const double of_inner = take(inner_energy, left), of_turning = take(turning_energy, left),
                 of_body = take(energy_of(body), left);
    for (std::size_t axis = 0; axis < axes(); ++axis)
      velocity[axis] =
          of_inner * inner[axis] + of_turning * turning_part[axis] + of_body * body[axis];
    return true;
  }

  /// Of the speeds what moves and what turns the body as a whole.
  void rigid_parts(Numbers& body, Numbers& turning_part) const {
    double mass = 0;
    Eigen::Vector3d centre = Eigen::Vector3d::Zero(), mean = centre, moment = centre;
    const auto at = [](const Numbers& of, std::size_t i) {
      return Eigen::Vector3d(of[3 * i], of[3 * i + 1], of[3 * i + 2]);
    };
    for (std::size_t i = 0; i < masses.size(); ++i) {
      mass += masses[i];
      centre += masses[i] * at(place, i);
      mean += masses[i] * at(velocity, i);
    }
    centre /= mass;
    mean /= mass;
    Matrix3 inertia = Matrix3::Zero();
    for (std::size_t i = 0; i < masses.size(); ++i) {
      const Eigen::Vector3d arm = at(place, i) - centre;
      moment += masses[i] * arm.cross(at(velocity, i) - mean);
      inertia += masses[i] * (arm.squaredNorm() * Matrix3::Identity() - arm * arm.transpose());
    }
    const Eigen::Vector3d spin = inertia.ldlt().solve(moment);
    for (std::size_t i = 0; i < masses.size(); ++i) {
      const Eigen::Vector3d of_spin = spin.cross(at(place, i) - centre);
      for (int k = 0; k < 3; ++k) {
        body[3 * i + static_cast<std::size_t>(k)] = mean[k];
        turning_part[3 * i + static_cast<std::size_t>(k)] = of_spin[k];
      }
    }
  }

  /// A free body goes on with its momentum and the load's: what unfinished rounds took or gave.
  void keep_momentum(const Objective& o, Found& found) const {
    std::array<double, 3> off{};
    double mass = 0;
    for (const double m : masses)
      mass += m;
    for (std::size_t axis = 0; axis < axes(); ++axis)
      off[axis % 3] += masses[axis / 3] * (found.at[axis] - o.ahead[axis]) * o.inertia - load[axis];
    for (std::size_t axis = 0; axis < axes(); ++axis)
      found.at[axis] -= off[axis % 3] / (mass * o.inertia);
  }
};

SolidMotion::~SolidMotion() = default;
SolidMotion::SolidMotion(SolidMotion&&) noexcept = default;
SolidMotion& SolidMotion::operator=(SolidMotion&&) noexcept = default;

SolidMotion::SolidMotion(const TetMesh& mesh, std::span<const SolidMaterial> materials,
                         const SolidMotionOptions& options, const Context& context)
    : state_(std::make_unique<State>(mesh, materials, options, context)) {
  const auto sound = [](double value) { return value >= 0 && std::isfinite(value); };
  if (!sound(options.drag) || !sound(options.damping))
    throw Error("the damping of a solid is not a number of 0 or more");
  if (!(options.tolerance > 0) || options.max_rounds < 1)
    throw Error("a step of a solid has no tolerance or no rounds");
  for (const double mass : state_->masses)
    if (!(mass > 0))
      throw Error("a node of a solid is in no tetrahedron");
}

void SolidMotion::set_load(std::span<const double> forces) {
  std::ranges::copy(forces, state_->load.begin());
}

void SolidMotion::hold(std::span<const std::uint8_t> held) {
  State& s = *state_;
  for (std::size_t axis = 0; axis < s.axes(); ++axis) {
    s.held[axis] = held[axis];
    if (held[axis] != 0)
      s.velocity[axis] = s.acceleration[axis] = 0;
  }
  s.renewed = true;
}

void SolidMotion::move_held(std::span<const double> displacement) {
  State& s = *state_;
  std::ranges::copy(displacement, s.target.begin());
  s.moved = true;
}

SolidStep SolidMotion::step(double h, const Context& context) {
  State& s = *state_;
  SolidStep step;
  step.change = HUGE_VAL;
  if (!s.options.reference)
    step.factorisations += s.make_factor(h, context);
  const double work = s.work_of_load(s.place), energy = s.kinetic() + s.elastic - work;
  State::Objective o{h, 1 / (h * h) + s.options.drag / h, s.place};
  add(o.ahead, h / (1 + s.options.drag * h), s.velocity);

  State::Found found;
  found.at = s.place;
  add(found.at, h, s.velocity);
  if (s.last_step == h)
    add(found.at, h * h, s.acceleration);
  for (std::size_t axis = 0; axis < s.axes(); ++axis)
    if (s.held[axis] != 0)
      found.at[axis] = s.moved ? s.rest[axis] + s.target[axis] : s.place[axis];
  s.evaluate(o, found, context);
  double still = s.elastic - work; // the value where it stands
  for (std::size_t axis = 0; axis < s.axes(); ++axis)
    if (const double off = s.place[axis] - o.ahead[axis]; s.held[axis] == 0)
      still += s.masses[axis / 3] * o.inertia * off * off / 2;
  if (!(found.value <= still)) {
    for (std::size_t axis = 0; axis < s.axes(); ++axis)
      if (s.held[axis] == 0)
        found.at[axis] = s.place[axis];
    s.evaluate(o, found, context);
  }
  s.descend(o, found, step, context);
  if (!std::isfinite(found.value))
    throw Error("a solid's motion is no longer finite");

  s.reactions = found.forces;
  for (std::size_t axis = 0; axis < s.axes(); ++axis)
    if (s.held[axis] == 0)
      s.reactions[axis] = 0;
  const bool free = !s.any_held();
  if (free)
    s.keep_momentum(o, found);
  s.solid.remember();
  s.bubbles = s.new_bubbles;
  Numbers forces(s.axes());
  for (std::size_t axis = 0; axis < s.axes(); ++axis) {
    const double speed = (found.at[axis] - s.place[axis]) / h;
    s.acceleration[axis] = (speed - s.velocity[axis]) / h;
    s.velocity[axis] = speed;
  }
  s.place = std::move(found.at);
  s.elastic = s.potential(s.place, 0, forces, context);
  if (!s.moved)
    step.limited = s.limit(energy, 1e-12 * (s.kinetic() + s.elastic + std::abs(energy) +
                                            std::abs(s.work_of_load(s.place))));
  s.last_step = h;
  s.moved = false;
  return step;
}

std::span<const double> SolidMotion::places() const noexcept {
  return state_->place;
}
std::vector<double> SolidMotion::displacement() const {
  std::vector<double> u = state_->place;
  add(u, -1, state_->rest);
  return u;
}
std::span<const double> SolidMotion::velocity() const noexcept {
  return state_->velocity;
}
std::span<const double> SolidMotion::reactions() const noexcept {
  return state_->reactions;
}
std::span<const double> SolidMotion::masses() const noexcept {
  return state_->masses;
}

void SolidMotion::set_state(std::span<const double> displacement, std::span<const double> velocity,
                            const Context& context) {
  State& s = *state_;
  for (std::size_t axis = 0; axis < s.axes(); ++axis)
    s.place[axis] = s.rest[axis] + displacement[axis];
  std::ranges::copy(velocity, s.velocity.begin());
  std::ranges::fill(s.acceleration, 0.0);
  std::ranges::fill(s.bubbles, Vec3{});
  s.last_step = 0;
  Numbers forces(s.axes());
  s.elastic = s.potential(s.place, 0, forces, context);
  s.solid.remember();
  s.bubbles = s.new_bubbles;
}

double SolidMotion::kinetic_energy() const {
  return state_->kinetic();
}
double SolidMotion::elastic_energy() const {
  return state_->elastic;
}
double SolidMotion::potential_energy() const {
  return state_->elastic - state_->work_of_load(state_->place);
}

} // namespace gewebe
