#include "fit/hyperelastic_statics.h"

#include "base/error.h"
#include "base/parallel.h"
#include "fem/assembly_blocks.h"
#include "linalg/factor.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

namespace gewebe::fit {

namespace {

constexpr std::size_t grain = 64;

struct ElementDisplacement {
  std::array<Vec3, 10> nodes;
  Vec3 bubble;
};

ElementDisplacement of_element(const tetrahedra::TetMesh& mesh, const SolidVector& v,
                               std::size_t t) {
  ElementDisplacement result;
  for (std::size_t a = 0; a < fem::solid_nodes(mesh); ++a) {
    const std::size_t axis = 3 * std::size_t{fem::solid_node(mesh, t, a)};
    result.nodes[a] = {v.axes[axis], v.axes[axis + 1], v.axes[axis + 2]};
  }
  if (!mesh.middles.empty() && !v.bubbles.empty())
    result.bubble = v.bubbles[t];
  return result;
}

double product(const SolidVector& a, const SolidVector& b) {
  double sum = 0;
  for (std::size_t axis = 0; axis < a.axes.size(); ++axis)
    sum += a.axes[axis] * b.axes[axis];
  for (std::size_t t = 0; t < std::min(a.bubbles.size(), b.bubbles.size()); ++t)
    sum += dot(a.bubbles[t], b.bubbles[t]);
  return sum;
}

/// a + s b
SolidVector moved(SolidVector a, const SolidVector& b, double s) {
  for (std::size_t axis = 0; axis < a.axes.size(); ++axis)
    a.axes[axis] += s * b.axes[axis];
  for (std::size_t t = 0; t < a.bubbles.size(); ++t)
    a.bubbles[t] += s * b.bubbles[t];
  return a;
}

using Matrix3 = Eigen::Matrix3d;
using Rows3 = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor, 3, 30>;
using Full = Eigen::Matrix<double, 33, 33, Eigen::RowMajor>;

/// An element at a displacement, linearised, its bubble eliminated.
struct Linearised {
  std::array<Vec3, 10> force;  ///< on its nodes, with what the bubble hands on
  Vec3 unbalanced;             ///< on the bubble
  Matrix3 bubble_flexibility;  ///< the inverse of its stiffness
  Rows3 between;               ///< bubble and nodes
  std::vector<double> tangent; ///< nodes × nodes, 3 rows each
  double magnitude = 0;        ///< the squares of its nodes' forces
};

class Newton {
public:
  Newton(const tetrahedra::TetMesh& mesh, std::span<const fem::SolidElement> elements,
         std::span<const std::uint8_t> fixed, const HyperelasticOptions& options,
         const Context& context)
      : mesh_(mesh), elements_(elements), fixed_(fixed), options_(options), context_(context),
        of_element_(elements.size()) {
    for (const fem::SolidElement& e : elements) {
      rounding_ += 1e-14 * e.material.mu * e.volume;
      const double stiffness = (e.material.lambda + 2 * e.material.mu) * e.volume;
      for (const Vec3& g : e.gradient)
        force_rounding_ += 1e-30 * stiffness * stiffness * dot(g, g);
    }
  }

  /// From `state` to the balance at `load` and with displacements on fixed axes increased by `by`;
  /// false if it isn't found.
  bool step(const SolidVector& load, const std::vector<double>& by, HyperelasticState& state) {
    bool prescribes = std::ranges::any_of(by, [](double d) { return d != 0; });
    for (int round = 0; round < options_.max_rounds; ++round) {
      fem::HyperelasticPart part = fem::HyperelasticPart::tangent;
      bool definite = linearise(load, state.displacement, part);
      if (!std::isfinite(residual_))
        return false;
      state.residual = residual_;
      if (!prescribes && residual_ <= options_.tolerance)
        return true;
      ++state.rounds;
      SolidVector direction;
      definite = definite && solve(prescribes ? by : std::vector<double>{}, direction);
      if (!definite || (!prescribes && !(product(unbalanced_, direction) > 0))) {
        part = fem::HyperelasticPart::positive_tangent;
        ++state.rounds;
        if (!linearise(load, state.displacement, part) ||
            !solve(prescribes ? by : std::vector<double>{}, direction))
          return false;
      }
      if (prescribes) {
        prescribes = false; // the whole displacement at once; the caller takes a part of it where
                            // no balance is found
        state.displacement = moved(std::move(state.displacement), direction, 1);
      } else if (!go(load, direction, part == fem::HyperelasticPart::tangent, state.displacement)) {
        return false;
      }
    }
    return false;
  }

  /// How a balance moves per change of the load. False if it isn't stable.
  bool respond(const SolidVector& at, std::span<const SolidVector> changes,
               std::vector<std::vector<double>>& moves) {
    const SolidVector none{std::vector<double>(fixed_.size()), {}};
    SolidVector direction;
    if (!linearise(none, at, fem::HyperelasticPart::tangent) || !solve({}, direction))
      return false;
    for (const SolidVector& change : changes) {
      condensed_ = change.axes;
      for (std::size_t t = 0; t < change.bubbles.size(); ++t) {
        const Linearised& e = of_element_[t];
        const Eigen::Vector3d w(change.bubbles[t].x, change.bubbles[t].y, change.bubbles[t].z);
        const Eigen::Matrix<double, 30, 1> handed =
            e.between.transpose() * (e.bubble_flexibility * w);
        for (std::size_t a = 0; a < 30; ++a)
          condensed_[axis_of(t, a)] -= handed[static_cast<Eigen::Index>(a)];
      }
      std::vector<double>& u = moves.emplace_back(fixed_.size());
      linalg::solve_axes(*matrix_, *factor_, condensed_, u);
    }
    return true;
  }

private:
  /// Fills of_element_, unbalanced_ and residual_. False if a bubble isn't stable.
  bool linearise(const SolidVector& load, const SolidVector& at, fem::HyperelasticPart part) {
    const std::size_t count = fem::solid_nodes(mesh_);
    const auto order = static_cast<Eigen::Index>(3 * count);
    std::vector<std::uint8_t> stable(elements_.size(), 1);
    parallel_blocks(context_, elements_.size(), grain, [&](std::size_t begin, std::size_t end) {
      fem::HyperelasticResponse response;
      for (std::size_t t = begin; t < end; ++t) {
        const ElementDisplacement u = of_element(mesh_, at, t);
        fem::hyperelastic_response(elements_[t], std::span(u.nodes).first(count), u.bubble, part,
                                   response);
        Linearised& e = of_element_[t];
        e.magnitude = response.energy == HUGE_VAL ? HUGE_VAL : 0;
        for (std::size_t a = 0; a < count; ++a) {
          e.force[a] = response.force[a];
          e.magnitude += dot(e.force[a], e.force[a]);
        }
        const Eigen::Map<const Full> k(response.tangent.data());
        e.tangent.resize(9 * count * count);
        Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> own(
            e.tangent.data(), order, order);
        own = k.topLeftCorner(order, order);
        if (count == 4)
          continue;
        e.unbalanced = response.force[10] + (load.bubbles.empty() ? Vec3{} : load.bubbles[t]);
        const Eigen::LLT<Matrix3> bubble(Matrix3(k.bottomRightCorner<3, 3>()));
        stable[t] = bubble.info() == Eigen::Success;
        e.bubble_flexibility = bubble.solve(Matrix3::Identity());
        e.between = k.bottomLeftCorner<3, 30>();
        const Rows3 handed = e.bubble_flexibility * e.between;
        own.noalias() -= e.between.transpose() * handed;
      }
    });

    unbalanced_ = load;
    unbalanced_.bubbles.resize(count == 4 ? 0 : elements_.size());
    condensed_ = load.axes;
    double forces = product(load, load), rest = 0;
    for (std::size_t t = 0; t < elements_.size(); ++t) {
      const Linearised& e = of_element_[t];
      forces += e.magnitude;
      Eigen::Matrix<double, 30, 1> handed = Eigen::Matrix<double, 30, 1>::Zero();
      if (count == 10) {
        unbalanced_.bubbles[t] = e.unbalanced;
        const Eigen::Vector3d w(e.unbalanced.x, e.unbalanced.y, e.unbalanced.z);
        handed = e.between.transpose() * (e.bubble_flexibility * w);
        rest += w.squaredNorm();
      }
      for (std::size_t a = 0; a < count; ++a)
        for (std::size_t i = 0; i < 3; ++i) {
          const std::size_t axis = 3 * std::size_t{fem::solid_node(mesh_, t, a)} + i;
          unbalanced_.axes[axis] += e.force[a][static_cast<int>(i)];
          condensed_[axis] +=
              e.force[a][static_cast<int>(i)] - handed[static_cast<Eigen::Index>(3 * a + i)];
        }
    }
    for (std::size_t axis = 0; axis < fixed_.size(); ++axis) {
      if (fixed_[axis] != 0)
        unbalanced_.axes[axis] = 0;
      rest += unbalanced_.axes[axis] * unbalanced_.axes[axis];
    }
    residual_ = !std::isfinite(forces)    ? HUGE_VAL
                : rest <= force_rounding_ ? 0
                                          : std::sqrt(rest / forces);
    return std::ranges::all_of(stable, [](std::uint8_t s) { return s != 0; });
  }

  /// Newton's step, with displacements on fixed axes changed by `by` (or not, if empty). False if
  /// the tangent isn't definite.
  bool solve(const std::vector<double>& by, SolidVector& direction) {
    const std::size_t count = fem::solid_nodes(mesh_);
    matrix_ = fem::assembled_matrix(
        mesh_,
        [&](std::size_t t, std::size_t a, std::size_t b) {
          fem::SolidBlock block;
          for (std::size_t n = 0; n < 9; ++n)
            block[n] = of_element_[t].tangent[3 * count * (3 * a + n / 3) + 3 * b + n % 3];
          return block;
        },
        fixed_, context_);
    try {
      if (factor_)
        factor_->refactor(*matrix_, context_);
      else
        factor_.emplace(*matrix_, context_);
    } catch (const linalg::NotPositiveDefinite&) {
      factor_.reset();
      return false;
    }
    std::vector<double> rest = condensed_;
    for (std::size_t t = 0; !by.empty() && t < elements_.size(); ++t)
      for (std::size_t a = 0; a < 3 * count; ++a)
        for (std::size_t b = 0; b < 3 * count; ++b)
          rest[axis_of(t, a)] -= of_element_[t].tangent[3 * count * a + b] * by[axis_of(t, b)];
    direction.axes.assign(fixed_.size(), 0);
    linalg::solve_axes(*matrix_, *factor_, rest, direction.axes);
    for (std::size_t axis = 0; !by.empty() && axis < fixed_.size(); ++axis)
      direction.axes[axis] += by[axis];
    direction.bubbles.assign(unbalanced_.bubbles.size(), {});
    for (std::size_t t = 0; t < direction.bubbles.size(); ++t) {
      const Linearised& e = of_element_[t];
      Eigen::Matrix<double, 30, 1> u;
      for (std::size_t a = 0; a < 30; ++a)
        u[static_cast<Eigen::Index>(a)] = direction.axes[axis_of(t, a)];
      const Eigen::Vector3d w =
          e.bubble_flexibility *
          (Eigen::Vector3d(e.unbalanced.x, e.unbalanced.y, e.unbalanced.z) - e.between * u);
      direction.bubbles[t] = {w[0], w[1], w[2]};
    }
    return true;
  }

  std::size_t axis_of(std::size_t t, std::size_t a) const {
    return 3 * std::size_t{fem::solid_node(mesh_, t, a / 3)} + a % 3;
  }

  /// All of the direction if `whole` is right; otherwise as much as the energy falls by (Armijo) or
  /// rounding hides.
  bool go(const SolidVector& load, const SolidVector& direction, bool whole,
          SolidVector& at) const {
    const double slope = product(unbalanced_, direction);
    if (!(slope > 0))
      return false;
    const double energy = hyperelastic_energy(mesh_, elements_, at, context_),
                 work = product(load, at),
                 unsure = rounding_ + 1e-12 * (std::abs(energy) + std::abs(work));
    for (double s = 1; s > 1e-4; s /= 2) {
      SolidVector there = moved(at, direction, s);
      const double potential =
          hyperelastic_energy(mesh_, elements_, there, context_) - product(load, there);
      if ((whole && std::isfinite(potential)) ||
          potential <= energy - work - 1e-4 * s * slope + unsure) {
        at = std::move(there);
        return true;
      }
    }
    return false;
  }

  const tetrahedra::TetMesh& mesh_;
  std::span<const fem::SolidElement> elements_;
  std::span<const std::uint8_t> fixed_;
  const HyperelasticOptions& options_;
  const Context& context_;
  std::vector<Linearised> of_element_;
  SolidVector unbalanced_;        ///< forces, 0 on fixed axes
  std::vector<double> condensed_; ///< with what the bubbles hand on
  double residual_ = 0;
  double rounding_ = 0;                           ///< of energies
  double force_rounding_ = 0;                     ///< of forces, squared
  std::optional<linalg::StiffnessMatrix> matrix_; ///< the last tangent
  std::optional<linalg::Factor> factor_;
};

} // namespace

SolidVector hyperelastic_weight(const tetrahedra::TetMesh& mesh,
                                std::span<const fem::SolidMaterial> materials,
                                std::span<const fem::SolidElement> elements,
                                const Vec3& acceleration) {
  SolidVector load{std::vector<double>(3 * mesh.points.size()), {}};
  const std::size_t count = fem::solid_nodes(mesh);
  load.bubbles.resize(count == 4 ? 0 : elements.size());
  std::array<Vec3, 11> force;
  for (std::size_t t = 0; t < elements.size(); ++t) {
    const std::size_t m = mesh.material.empty() ? 0 : static_cast<std::size_t>(mesh.material[t]);
    fem::hyperelastic_body_load(elements[t], materials[m].density * acceleration,
                                std::span(force).first(count == 4 ? 4 : 11));
    for (std::size_t a = 0; a < count; ++a)
      for (int axis = 0; axis < 3; ++axis)
        load.axes[3 * std::size_t{fem::solid_node(mesh, t, a)} + static_cast<std::size_t>(axis)] +=
            force[a][axis];
    if (count == 10)
      load.bubbles[t] = force[10];
  }
  return load;
}

double hyperelastic_energy(const tetrahedra::TetMesh& mesh,
                           std::span<const fem::SolidElement> elements,
                           const SolidVector& displacement, const Context& context) {
  std::vector<double> energy(elements.size());
  parallel_blocks(context, elements.size(), grain, [&](std::size_t begin, std::size_t end) {
    fem::HyperelasticResponse response;
    for (std::size_t t = begin; t < end; ++t) {
      const ElementDisplacement u = of_element(mesh, displacement, t);
      fem::hyperelastic_response(elements[t], std::span(u.nodes).first(fem::solid_nodes(mesh)),
                                 u.bubble, fem::HyperelasticPart::energy, response);
      energy[t] = response.energy;
    }
  });
  double sum = 0;
  for (const double e : energy)
    sum += e;
  return sum;
}

SolidVector hyperelastic_forces(const tetrahedra::TetMesh& mesh,
                                std::span<const fem::SolidElement> elements,
                                const SolidVector& displacement, const Context& context) {
  const std::size_t count = fem::solid_nodes(mesh);
  std::vector<std::array<Vec3, fem::HyperelasticResponse::nodes>> forces(elements.size());
  parallel_blocks(context, elements.size(), grain, [&](std::size_t begin, std::size_t end) {
    fem::HyperelasticResponse response;
    for (std::size_t t = begin; t < end; ++t) {
      const ElementDisplacement u = of_element(mesh, displacement, t);
      fem::hyperelastic_response(elements[t], std::span(u.nodes).first(count), u.bubble,
                                 fem::HyperelasticPart::force, response);
      forces[t] = response.force;
    }
  });
  SolidVector sum{std::vector<double>(3 * mesh.points.size()), {}};
  for (std::size_t t = 0; t < elements.size(); ++t)
    for (std::size_t a = 0; a < count; ++a)
      for (int axis = 0; axis < 3; ++axis)
        sum.axes[3 * std::size_t{fem::solid_node(mesh, t, a)} + static_cast<std::size_t>(axis)] +=
            forces[t][a][axis];
  for (std::size_t t = 0; count == 10 && t < elements.size(); ++t)
    sum.bubbles.push_back(forces[t][10]);
  return sum;
}

HyperelasticState hyperelastic_statics(const tetrahedra::TetMesh& mesh,
                                       std::span<const fem::SolidElement> elements,
                                       std::span<const std::uint8_t> fixed,
                                       std::span<const double> prescribed, const SolidVector& load,
                                       const HyperelasticOptions& options, const Context& context) {
  HyperelasticState state;
  state.displacement.axes.resize(fixed.size());
  state.displacement.bubbles.resize(mesh.middles.empty() ? 0 : elements.size());
  Newton newton(mesh, elements, fixed, options, context);
  std::vector<double> by(fixed.size());
  const auto way = [&](const HyperelasticState& from, double part) {
    for (std::size_t axis = 0; axis < fixed.size(); ++axis)
      by[axis] = fixed[axis] != 0 && !prescribed.empty()
                     ? part * prescribed[axis] - from.displacement.axes[axis]
                     : 0;
  };
  if (!options.start.axes.empty()) {
    HyperelasticState near = state;
    near.displacement = options.start;
    near.displacement.bubbles.resize(state.displacement.bubbles.size());
    way(near, 1);
    if (newton.step(load, by, near)) {
      near.steps = 1;
      return near;
    }
    state.rounds = near.rounds;
  }
  double done = 0, step = 1;
  while (done < 1) {
    const double next = std::min(1.0, done + step);
    SolidVector part = load;
    for (double& f : part.axes)
      f *= next;
    for (Vec3& f : part.bubbles)
      f *= next;
    HyperelasticState tried = state;
    way(state, next);
    if (newton.step(part, by, tried)) {
      state = std::move(tried);
      ++state.steps;
      done = next;
      step *= 2;
    } else {
      state.rounds = tried.rounds;
      step /= 2;
      if (!(step >= options.least_step))
        throw Error("no balance of a hyperelastic solid was found beyond " +
                    std::to_string(100 * done) + " % of its load");
    }
  }
  return state;
}

std::vector<std::vector<double>>
hyperelastic_response_to(const tetrahedra::TetMesh& mesh,
                         std::span<const fem::SolidElement> elements,
                         std::span<const std::uint8_t> fixed, const SolidVector& at,
                         std::span<const SolidVector> changes, const HyperelasticOptions& options,
                         const Context& context) {
  Newton newton(mesh, elements, fixed, options, context);
  std::vector<std::vector<double>> moves;
  if (!newton.respond(at, changes, moves))
    throw Error("the balance of a hyperelastic solid is not stable");
  return moves;
}

} // namespace gewebe::fit
