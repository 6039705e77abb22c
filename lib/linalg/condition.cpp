#include "linalg/condition.h"

#include "base/disjoint_sets.h"
#include "base/error.h"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <vector>

// Based on: Hager, Condition Estimates, 1984; Higham, FORTRAN Codes for Estimating the One-Norm of
// a Real or Complex Matrix, 1988. Inverse iteration: Golub, Van Loan, Matrix Computations, 4th ed.,
// 8.2.2.

namespace gewebe::linalg {

namespace {

double sum_abs(const std::vector<double>& x) {
  double sum = 0;
  for (const double value : x)
    sum += std::abs(value);
  return sum;
}

/// NaN if there is one.
double max_abs(std::span<const double> x) {
  double largest = 0;
  for (const double value : x) {
    if (std::isnan(value))
      return value;
    largest = std::max(largest, std::abs(value));
  }
  return largest;
}

std::size_t index_of_largest(const std::vector<double>& x) {
  std::size_t at = 0;
  for (std::size_t i = 1; i < x.size(); ++i)
    if (std::abs(x[i]) > std::abs(x[at]))
      at = i;
  return at;
}

std::string short_number(double value) {
  std::array<char, 32> text{};
  const auto result =
      std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::general, 2);
  return {text.data(), result.ptr};
}

/// A fixed sequence without pattern in [-1, 1).
class Noise {
public:
  double next() {
    state_ = state_ * 6364136223846793005U + 1442695040888963407U;
    return static_cast<double>(static_cast<std::int64_t>(state_) >> 11) * 0x1p-52;
  }

private:
  std::uint64_t state_ = 1;
};

} // namespace

double inverse_norm(const Factor& factor) {
  return inverse_norm(factor.order(),
                      [&](std::span<const double> x, std::span<double> y) { factor.solve(x, y); });
}

double
inverse_norm(std::size_t n,
             const std::function<void(std::span<const double> x, std::span<double> y)>& solve) {
  std::vector<double> x(n, 1 / static_cast<double>(n)), y(n), sign(n), z(n);
  solve(x, y);
  double estimate = sum_abs(y);
  std::size_t before = n; // no unit vector yet
  const int rounds = 5;
  for (int round = 0; round < rounds; ++round) {
    for (std::size_t i = 0; i < n; ++i)
      sign[i] = y[i] < 0 ? -1 : 1;
    solve(sign, z);
    const std::size_t at = index_of_largest(z);
    if (at == before)
      break;
    before = at;
    std::fill(x.begin(), x.end(), 0.0);
    x[at] = 1;
    solve(x, y);
    const double sum = sum_abs(y);
    if (!(sum > estimate))
      break;
    estimate = sum;
  }
  // Higham's safeguard: a vector that no cancellation hides.
  for (std::size_t i = 0; i < n; ++i)
    x[i] = (i % 2 == 0 ? 1 : -1) * (1 + static_cast<double>(i) / static_cast<double>(n));
  solve(x, y);
  return std::max(estimate, 2 * sum_abs(y) / (3 * static_cast<double>(n)));
}

void require_precision(double condition, bool single) {
  const double max = 0x1p24;
  if (single && !(condition <= max))
    throw Error("the condition " + short_number(condition) + " is beyond " + short_number(max) +
                ", what float32 can tell, expected --precision float64");
}

double backward_error(const StiffnessMatrix& matrix, double norm, std::span<const double> x,
                      std::span<const double> f) {
  std::vector<double> r(matrix.order());
  multiply(matrix, x, r);
  for (std::size_t i = 0; i < r.size(); ++i)
    r[i] -= f[i];
  const double scale = norm * max_abs(x) + max_abs(f);
  const double size = max_abs(r);
  return size == 0 && scale == 0 ? 0 : size / scale;
}

namespace {

/// Sets of free axes that springs connect: K is one block for each.
struct Parts {
  std::vector<std::uint32_t> of_row;
  std::vector<std::vector<std::size_t>> rows; ///< of each part, ascending
};

Parts parts_of(const StiffnessMatrix& matrix) {
  const std::size_t n = matrix.order();
  DisjointSets sets(n);
  const auto join = [&](std::size_t a, std::size_t b) {
    sets.join(static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b));
  };
  for (std::size_t c = 0; c < n; ++c) {
    // The axes of a node belong together even where K has no entry between them.
    if (c > 0 && matrix.axis_of_row[c] / 3 == matrix.axis_of_row[c - 1] / 3)
      join(c, c - 1);
    for (std::int64_t at = matrix.column_start[c]; at < matrix.column_start[c + 1]; ++at)
      join(c, static_cast<std::size_t>(matrix.row[static_cast<std::size_t>(at)]));
  }
  Parts parts;
  parts.of_row.resize(n);
  for (std::uint32_t r = 0; r < n; ++r) {
    const std::uint32_t top = sets.find(r);
    if (top == r) {
      parts.of_row[r] = static_cast<std::uint32_t>(parts.rows.size());
      parts.rows.emplace_back();
    }
    parts.of_row[r] = parts.of_row[top];
    parts.rows[parts.of_row[r]].push_back(r);
  }
  return parts;
}

using Six = std::array<double, 6>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// Where a row stands, and along which axis.
struct Place {
  std::size_t node;
  int axis;
};

Place place_of(const StiffnessMatrix& matrix, std::size_t row) {
  const std::int64_t axis = matrix.axis_of_row[row];
  return {static_cast<std::size_t>(axis / 3), static_cast<int>(axis % 3)};
}

/// Displacement along one axis under the three unit translations and the three unit turns about
/// `center`; lengths are in units of `size`.
Six rigid_at(const Vec3& position, int axis, const Vec3& center, double size) {
  const Vec3 r = (position - center) / size;
  Six six{};
  six[static_cast<std::size_t>(axis)] = 1;
  const int next = (axis + 1) % 3, last = (axis + 2) % 3;
  six[3 + static_cast<std::size_t>(next)] = r[last];  // (ω × r)_a = ω_b r_c - ω_c r_b
  six[3 + static_cast<std::size_t>(last)] = -r[next]; // with (a, b, c) cyclic
  return six;
}

/// Rigid motions of a part in order of the stiffness against them: columns of `motions` are
/// combinations of unit translations and turns, orthonormal as displacements of the part's rows.
struct RigidMotions {
  Eigen::VectorXd stiffness;
  Eigen::MatrixXd motions;
  Eigen::VectorXd share; ///< of a prescribed unit displacement in each of them
};

RigidMotions rigid_motions(const model::Model& model, const StiffnessMatrix& matrix,
                           const Parts& parts, std::size_t part, const std::vector<double>& x) {
  const std::vector<std::size_t>& rows = parts.rows[part];
  Box3 box;
  for (const std::size_t row : rows)
    box.add(model.nodes[place_of(matrix, row).node].position);
  const Vec3 center = (box.min + box.max) * 0.5;
  const double size = box.longest_side() > 0 ? box.longest_side() / 2 : 1;
  const auto rigid = [&](std::size_t row) {
    const Place p = place_of(matrix, row);
    return rigid_at(model.nodes[p.node].position, p.axis, center, size);
  };
  // A = RᵀKR and B = RᵀR of the six columns R over the part's rows.
  Matrix6 a = Matrix6::Zero(), b = Matrix6::Zero();
  Eigen::Matrix<double, 6, 1> rx = Eigen::Matrix<double, 6, 1>::Zero();
  for (const std::size_t c : rows) {
    const Eigen::Matrix<double, 6, 1> rc(rigid(c).data());
    b += rc * rc.transpose();
    rx += rc * x[c];
    for (std::int64_t at = matrix.column_start[c]; at < matrix.column_start[c + 1]; ++at) {
      const auto r = static_cast<std::size_t>(matrix.row[static_cast<std::size_t>(at)]);
      const double value = matrix.value[static_cast<std::size_t>(at)];
      const Eigen::Matrix<double, 6, 1> rr(rigid(r).data());
      a += value * rr * rc.transpose();
      if (r != c)
        a += value * rc * rr.transpose();
    }
  }
  // Motions that move nothing here (a turn about a line of nodes) count as none.
  const Eigen::SelfAdjointEigenSolver<Matrix6> mass(b);
  const double min = 1e-10 * mass.eigenvalues()[5];
  const auto rank = std::count_if(mass.eigenvalues().begin(), mass.eigenvalues().end(),
                                  [&](double value) { return value > min; });
  const Eigen::MatrixXd basis =
      mass.eigenvectors().rightCols(rank) *
      mass.eigenvalues().tail(rank).cwiseSqrt().cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(basis.transpose() * a * basis);
  const Eigen::MatrixXd motions = basis * solver.eigenvectors();
  return {solver.eigenvalues(), motions, motions.transpose() * rx};
}

/// What the softest `count` rigid motions are, together.
void name_rigid(const RigidMotions& rigid, Eigen::Index count, FreeMotion& motion) {
  // Turns are those combinations that turn at all; what is left over are translations.
  Eigen::MatrixXd motions = rigid.motions.leftCols(count);
  motions.colwise().normalize();
  const Eigen::MatrixXd turns = motions.bottomRows(3);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(turns * turns.transpose());
  for (Eigen::Index i = 0; i < 3; ++i)
    motion.rotations += solver.eigenvalues()[i] > 1e-6 ? 1 : 0;
  motion.translations = static_cast<int>(count) - motion.rotations;
  if (count == 6)
    motion.kind = FreeMotion::Kind::free;
  else if (motion.translations > 0)
    motion.kind = FreeMotion::Kind::translation;
  else
    motion.kind = motion.rotations == 1 ? FreeMotion::Kind::hinge : FreeMotion::Kind::turn;
}

/// For each part the stiffness against its softest motion, and that motion in `x`.
std::vector<double> soften(const StiffnessMatrix& matrix, const Factor& shifted, const Parts& parts,
                           const Context& context, std::vector<double>& x) {
  const std::size_t n = matrix.order();
  std::vector<double> y(n), stiffness(parts.rows.size());
  Noise noise;
  for (double& value : x)
    value = noise.next();
  const auto normalise = [&] {
    std::vector<double> square(parts.rows.size());
    for (std::size_t r = 0; r < n; ++r)
      square[parts.of_row[r]] += x[r] * x[r];
    for (std::size_t r = 0; r < n; ++r)
      if (const double s = square[parts.of_row[r]]; s > 0)
        x[r] /= std::sqrt(s);
  };
  normalise();
  const int rounds = 12;
  for (int round = 0; round < rounds; ++round) {
    if (context.cancelled && context.cancelled())
      throw Cancelled();
    shifted.solve(x, y);
    x.swap(y);
    normalise();
  }
  multiply(matrix, x, y);
  for (std::size_t r = 0; r < n; ++r)
    stiffness[parts.of_row[r]] += x[r] * y[r];
  return stiffness;
}

/// K + shift I has a factor for the smallest of these shifts, or nothing.
std::optional<Factor> shifted_factor(const StiffnessMatrix& matrix, double norm,
                                     const Context& context) {
  for (const double relative : {1e-14, 1e-12, 1e-10}) {
    StiffnessMatrix shifted = matrix;
    for (std::size_t c = 0; c < matrix.order(); ++c)
      shifted.value[static_cast<std::size_t>(matrix.column_start[c])] += relative * norm;
    try {
      return Factor(shifted, context);
    } catch (const NotPositiveDefinite&) {
      continue; // with a larger one
    }
  }
  return std::nullopt;
}

} // namespace

std::optional<FreeMotion> weakest_motion(const model::Model& model, const StiffnessMatrix& matrix,
                                         const Context& context) {
  // A matrix of zeros is as singular as one can be, whatever the scale.
  const double norm = std::max(stiffness_norm(matrix), 1e-300);
  const std::optional<Factor> shifted = shifted_factor(matrix, norm, context);
  if (!shifted)
    return std::nullopt;
  const Parts parts = parts_of(matrix);
  std::vector<double> x(matrix.order());
  const std::vector<double> stiffness = soften(matrix, *shifted, parts, context, x);

  // Everything below this is rounding, so parts that are equally free tie and the first is named.
  const double noise = 1e-14 * norm;
  const auto level = [&](double value) { return std::max(value, noise); };
  std::size_t part = 0;
  for (std::size_t p = 1; p < parts.rows.size(); ++p)
    if (level(stiffness[p]) < level(stiffness[part]))
      part = p;

  FreeMotion motion;
  motion.stiffness = stiffness[part];
  const std::vector<std::size_t>& rows = parts.rows[part];
  motion.node = static_cast<std::uint32_t>(place_of(matrix, rows.front()).node);
  const RigidMotions rigid = rigid_motions(model, matrix, parts, part, x);
  const double bound = 10 * level(motion.stiffness);
  const auto soft = std::count_if(rigid.stiffness.begin(), rigid.stiffness.end(),
                                  [&](double value) { return value <= bound; });
  // Where more than rigid motions are free, as in a flat sheet, the one found is no rigid one.
  const bool is_rigid = soft > 0 && rigid.share.head(soft).squaredNorm() > 0.99;
  const bool alone = place_of(matrix, rows.back()).node == motion.node;
  if (alone) {
    motion.kind = FreeMotion::Kind::isolated;
    motion.translations = static_cast<int>(soft);
  } else if (is_rigid) {
    name_rigid(rigid, soft, motion);
  }
  if (alone || !is_rigid) {
    const std::size_t max = *std::max_element(
        rows.begin(), rows.end(), [&](auto a, auto b) { return std::abs(x[a]) < std::abs(x[b]); });
    motion.node = static_cast<std::uint32_t>(place_of(matrix, max).node);
    for (const std::size_t row : rows)
      if (const Place p = place_of(matrix, row); p.node == motion.node)
        motion.direction[p.axis] = x[row];
    motion.direction = motion.direction / gewebe::norm(motion.direction);
  }
  motion.component = model::components(model).of_node[motion.node];
  return motion;
}

namespace {

std::string count_text(int count, const char* what) {
  return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

const char* remedy(FreeMotion::Kind kind) {
  switch (kind) {
  case FreeMotion::Kind::isolated:
    return "expected springs, or the node fixed";
  case FreeMotion::Kind::hinge:
    return "expected fixed nodes or central nodes off that axis (three in all that are not on one "
           "line)";
  case FreeMotion::Kind::local:
    return "expected springs that hold it, as bending or central springs, or the node fixed";
  default:
    return "expected at least three fixed nodes or central nodes that are not on one line";
  }
}

} // namespace

std::string motion_text(const FreeMotion& motion) {
  const std::string component = "component " + std::to_string(motion.component);
  const std::string node = "node " + std::to_string(motion.node);
  switch (motion.kind) {
  case FreeMotion::Kind::isolated:
    return node + " (" + component + ") is held by no spring along " +
           count_text(std::max(motion.translations, 1), "direction");
  case FreeMotion::Kind::free:
    return component + " is held by nothing: it can move and turn as a rigid body";
  case FreeMotion::Kind::translation:
    return component + " can move as a rigid body (" +
           count_text(motion.translations, "translation") +
           (motion.rotations > 0 ? ", " + count_text(motion.rotations, "rotation") : "") + ")";
  case FreeMotion::Kind::turn:
    return component + " can turn about a point (" + count_text(motion.rotations, "rotation") + ")";
  case FreeMotion::Kind::hinge:
    return component + " can turn about an axis like a hinge (1 rotation)";
  default:
    return "a part of " + component + " can move against the rest, most at " + node + " along (" +
           short_number(motion.direction.x) + ", " + short_number(motion.direction.y) + ", " +
           short_number(motion.direction.z) + ")";
  }
}

namespace {

[[noreturn]] void refuse(const model::Model& model, const StiffnessMatrix& matrix,
                         const Context& context, double condition) {
  const std::optional<FreeMotion> motion = weakest_motion(model, matrix, context);
  // Beyond 2^52 rounding alone decides what the condition is, and whether a pivot is positive.
  const std::string how = condition > 0 && condition < 0x1p52
                              ? "nearly singular (condition " + short_number(condition) +
                                    ", at most " + short_number(max_condition) + ")"
                              : "singular";
  if (!motion)
    throw Error("the model is unstable at rest: springs shorter than their rest length push nodes "
                "aside, expected springs near it");
  throw SingularStiffness("the stiffness matrix is " + how + ": " + motion_text(*motion) + ", " +
                          remedy(motion->kind));
}

/// The largest backward error of some right-hand sides: noise, and a unit force in the middle.
double worst_residual(const StiffnessMatrix& matrix, const Factor& factor, double norm) {
  const std::size_t n = matrix.order();
  std::vector<double> f(n), x(n);
  Noise noise;
  for (double& value : f)
    value = noise.next();
  factor.solve(f, x);
  const double first = backward_error(matrix, norm, x, f);
  std::fill(f.begin(), f.end(), 0.0);
  f[n / 2] = 1;
  factor.solve(f, x);
  const std::array<double, 2> both{first, backward_error(matrix, norm, x, f)};
  return max_abs(both);
}

} // namespace

Factor checked_factor(const model::Model& model, const StiffnessMatrix& matrix,
                      const Context& context, StiffnessCheck& check) {
  check.norm = stiffness_norm(matrix);
  std::optional<Factor> factor;
  try {
    factor.emplace(matrix, context);
  } catch (const NotPositiveDefinite&) {
    refuse(model, matrix, context, 0);
  }
  check.condition = check.norm * inverse_norm(*factor);
  if (!(check.condition <= max_condition))
    refuse(model, matrix, context, check.condition);
  check.residual = worst_residual(matrix, *factor, check.norm);
  if (!(check.residual <= max_backward_error))
    throw Error("a solution has backward error " + short_number(check.residual) +
                ", expected at most " + short_number(max_backward_error));
  return std::move(*factor);
}

} // namespace gewebe::linalg
