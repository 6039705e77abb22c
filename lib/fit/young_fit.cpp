#include "fit/young_fit.h"

#include "base/error.h"
#include "embedding/solid_place.h"
#include "linalg/factor.h"
#include "numeric/student_t.h"
#include "text/rounded_text.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <utility>

namespace gewebe::fit {

namespace {

constexpr double furthest = 0.1; // of the body's diagonal, that a place may be off it
constexpr double confidence = 0.95;
constexpr double unseen = 1e-6; // of displacements, per relative change of a modulus or of nodes
constexpr double alike = 1e-8;  // of the largest eigenvalue: materials that cannot be distinguished
constexpr double widest = 4;    // factor of a modulus in a round

/// One measured axis of one place.
struct Datum {
  std::size_t of_case = 0;
  embedding::SolidPlace place;
  int axis = 0;
  double value = 0;
  const std::string* name = nullptr;
};

double predicted(const Datum& d, std::span<const double> u) {
  return embedding::displacement_at(d.place, u)[d.axis];
}

std::vector<Datum> data_of(const tetrahedra::TetMesh& mesh, std::span<const std::uint8_t> fixed,
                           std::span<const MeasuredCase> cases) {
  const Box3 box = tetrahedra::bounding_box(mesh);
  const double limit = furthest * norm(box.max - box.min);
  std::vector<Datum> data;
  for (std::size_t c = 0; c < cases.size(); ++c)
    for (const Measurement& m : cases[c].measurements) {
      const embedding::SolidPlace place = embedding::find_place(mesh, m.place);
      if (!(place.outside <= limit))
        throw Error(m.name, "the place is " + text::rounded_text(place.outside) +
                                " mm off the body, expected at most " + text::rounded_text(limit));
      for (int axis = 0; axis < 3; ++axis) {
        const std::optional<double>& value = m.displacement[static_cast<std::size_t>(axis)];
        if (!value)
          continue;
        double free = 0;
        for (std::size_t k = 0; k < place.count; ++k)
          if (fixed[3 * std::size_t{place.node[k]} + static_cast<std::size_t>(axis)] == 0)
            free += std::abs(place.weight[k]);
        if (!(free > unseen))
          throw Error(m.name, "what is measured there is held, expected a place that can move");
        data.push_back({c, place, axis, *value, &m.name});
      }
    }
  return data;
}

double mean_square(std::span<const double> values) {
  double sum = 0;
  for (const double v : values)
    sum += v * v;
  return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

/// A common factor of all moduli with which small strains fit the measurements.
double start_factor(const tetrahedra::TetMesh& mesh, std::span<const fem::SolidMaterial> materials,
                    std::span<const std::uint8_t> fixed, std::span<const MeasuredCase> cases,
                    std::span<const Datum> data, const Context& context) {
  const std::vector<fem::SolidElement> elements = fem::solid_elements(mesh, materials, context);
  SolidVector rest{std::vector<double>(fixed.size()), {}};
  rest.bubbles.resize(mesh.middles.empty() ? 0 : elements.size());
  std::vector<SolidVector> loads;
  for (const MeasuredCase& c : cases)
    loads.push_back(c.load);
  const auto u = hyperelastic_response_to(mesh, elements, fixed, rest, loads, {}, context);
  double with = 0, square = 0;
  std::vector<std::pair<double, double>> ratios; // measured by computed, and their weight
  const Datum* worst = nullptr;
  double most_against = 0;
  for (const Datum& d : data) {
    const double p = predicted(d, u[d.of_case]);
    with += p * d.value;
    square += p * p;
    if (p != 0)
      ratios.emplace_back(d.value / p, p * p);
    if (worst == nullptr || p * d.value < most_against) {
      most_against = p * d.value;
      worst = &d;
    }
  }
  if (!(square > 0))
    throw Error("the loads move nothing that is measured, expected a force or gravity");
  if (!(with > 0))
    throw Error(*worst->name, "what is measured goes against the loads" +
                                  std::string(data.size() == 1 ? "" : ", here the most") +
                                  ", expected displacements along them: look at signs and axes");
  // The weighted median: one wrong measurement must not make the body as soft as a fluid.
  std::ranges::sort(ratios);
  double below = 0;
  for (const auto& [ratio, weight] : ratios)
    if (below += weight; 2 * below >= square)
      return ratio > 0 ? 1 / ratio : square / with;
  return square / with;
}

class Fit {
public:
  Fit(const tetrahedra::TetMesh& mesh, std::span<const fem::SolidMaterial> materials,
      std::span<const std::string> names, std::span<const std::size_t> sought,
      std::span<const std::uint8_t> fixed, std::span<const MeasuredCase> cases,
      const std::vector<Datum>& data, const Context& context)
      : mesh_(mesh), materials_(materials.begin(), materials.end()), names_(names), sought_(sought),
        fixed_(fixed), cases_(cases), data_(data), context_(context),
        jacobian_(static_cast<Eigen::Index>(data.size()), static_cast<Eigen::Index>(sought.size())),
        residual_(static_cast<Eigen::Index>(data.size())) {
    fit_.displacement.resize(cases.size());
    options_.tolerance = 1e-8;
  }

  void scale(double factor) {
    for (const std::size_t m : sought_)
      materials_[m].young *= factor;
  }

  /// Balances and derivatives at the moduli as they are.
  void solve() {
    const std::vector<fem::SolidElement> elements =
        fem::solid_elements(mesh_, materials_, context_);
    for (std::size_t c = 0; c < cases_.size(); ++c) {
      HyperelasticOptions options = options_;
      options.start = fit_.displacement[c];
      fit_.displacement[c] =
          hyperelastic_statics(mesh_, elements, fixed_, {}, cases_[c].load, options, context_)
              .displacement;
      ++fit_.solves;
      std::vector<SolidVector> changes;
      for (const std::size_t m : sought_)
        changes.push_back(
            hyperelastic_forces(mesh_, only(elements, m), fit_.displacement[c], context_));
      const auto moves = hyperelastic_response_to(mesh_, elements, fixed_, fit_.displacement[c],
                                                  changes, options, context_);
      for (std::size_t k = 0; k < data_.size(); ++k) {
        const Datum& d = data_[k];
        if (d.of_case != c)
          continue;
        const auto row = static_cast<Eigen::Index>(k);
        residual_[row] = predicted(d, fit_.displacement[c].axes) - d.value;
        for (std::size_t p = 0; p < sought_.size(); ++p)
          jacobian_(row, static_cast<Eigen::Index>(p)) = -predicted(d, moves[p]); // by log 1/E
      }
    }
  }

  /// Changes the moduli. \return the largest relative change, before it is limited
  double improve() {
    require_seen();
    const Eigen::MatrixXd normal = jacobian_.transpose() * jacobian_;
    const Eigen::VectorXd step = normal.ldlt().solve(-jacobian_.transpose() * residual_);
    double change = 0;
    for (std::size_t p = 0; p < sought_.size(); ++p) {
      const double s = step[static_cast<Eigen::Index>(p)];
      if (!std::isfinite(s))
        throw Error("the rounds of the fit left the numbers");
      change = std::max(change, std::abs(s));
      materials_[sought_[p]].young /= std::clamp(1 + s, 1 / widest, widest);
    }
    return change;
  }

  /// What the last solve() and improve() come to.
  YoungFit result() {
    const auto count = static_cast<double>(data_.size());
    const double freedom = count - static_cast<double>(sought_.size()),
                 variance = freedom > 0 ? residual_.squaredNorm() / freedom : 0;
    fit_.axes = data_.size();
    fit_.residual = std::sqrt(residual_.squaredNorm() / count);
    std::vector<double> values;
    for (const Datum& d : data_)
      values.push_back(d.value);
    fit_.measured = std::sqrt(mean_square(values));
    const Eigen::MatrixXd inverse =
        (jacobian_.transpose() * jacobian_)
            .ldlt()
            .solve(Eigen::MatrixXd::Identity(jacobian_.cols(), jacobian_.cols()));
    for (std::size_t p = 0; p < sought_.size(); ++p) {
      FittedYoung young{sought_[p], materials_[sought_[p]].young, {}};
      if (freedom > 0) {
        const auto i = static_cast<Eigen::Index>(p);
        const double width =
            numeric::student_t_quantile((1 - confidence) / 2, data_.size() - sought_.size()) *
            std::sqrt(variance * inverse(i, i));
        young.interval = {young.young * std::exp(-width), young.young * std::exp(width)};
      }
      fit_.materials.push_back(young);
    }
    if (freedom > 1)
      find_outliers(inverse, freedom);
    return std::move(fit_);
  }

  int solves() const { return fit_.solves; }

  /// The measurement that the last solve() meets worst, with what it says.
  std::string worst_measurement() const {
    Eigen::Index row = 0;
    if (!(residual_.cwiseAbs().maxCoeff(&row) > 0))
      return "";
    const Datum& d = data_[static_cast<std::size_t>(row)];
    return *d.name + " is farthest from the others: " + text::rounded_text(d.value) +
           " mm measured where " + text::rounded_text(d.value + residual_[row]) +
           " mm are computed";
  }

private:
  std::vector<fem::SolidElement> only(std::vector<fem::SolidElement> elements,
                                      std::size_t material) const {
    for (std::size_t t = 0; t < elements.size(); ++t) {
      const std::size_t m =
          mesh_.material.empty() ? 0 : static_cast<std::size_t>(mesh_.material[t]);
      if (m != material)
        elements[t].material = {};
    }
    return elements;
  }

  /// \throw Error naming materials that the data say nothing of
  void require_seen() const {
    double largest = 0;
    for (const Datum& d : data_)
      largest = std::max(largest, std::abs(d.value));
    Eigen::MatrixXd unit = jacobian_;
    for (Eigen::Index p = 0; p < unit.cols(); ++p) {
      const double length = unit.col(p).norm();
      if (!(length > unseen * largest))
        throw Error("no measurement depends on the Young's modulus of " + name(p) +
                    ", expected one that does, or 'known'");
      unit.col(p) /= length;
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(unit.transpose() * unit);
    if (eigen.eigenvalues()[0] > alike * eigen.eigenvalues()[unit.cols() - 1])
      return;
    Eigen::VectorXd mixed = eigen.eigenvectors().col(0).cwiseAbs();
    Eigen::Index first = 0, second = 0;
    mixed.maxCoeff(&first);
    mixed[first] = -1;
    mixed.maxCoeff(&second);
    throw Error("the measurements don't tell the Young's moduli of " +
                name(std::min(first, second)) + " and " + name(std::max(first, second)) +
                " apart, expected others, or one of them 'known'");
  }

  /// Studentised residuals, each by the variance without it, against the quantile for the worst of
  /// all (Bonferroni).
  void find_outliers(const Eigen::MatrixXd& inverse, double freedom) {
    const double square = residual_.squaredNorm();
    const double limit =
        numeric::student_t_quantile((1 - confidence) / 2 / static_cast<double>(data_.size()),
                                    data_.size() - sought_.size() - 1);
    double size = 0;
    for (const Datum& d : data_)
      size = std::max(size, std::abs(d.value));
    for (std::size_t k = 0; k < data_.size(); ++k) {
      const auto row = static_cast<Eigen::Index>(k);
      const double leverage = jacobian_.row(row) * inverse * jacobian_.row(row).transpose(),
                   r = residual_[row], free = 1 - leverage;
      if (!(free > 0) || std::abs(r) <= 1e-6 * size)
        continue;
      const double others = (square - r * r / free) / (freedom - 1);
      if (!(r * r <= limit * limit * others * free) &&
          (fit_.outliers.empty() || fit_.outliers.back() != *data_[k].name))
        fit_.outliers.push_back(*data_[k].name);
    }
  }

  std::string name(Eigen::Index p) const { return names_[sought_[static_cast<std::size_t>(p)]]; }

  const tetrahedra::TetMesh& mesh_;
  std::vector<fem::SolidMaterial> materials_;
  std::span<const std::string> names_;
  std::span<const std::size_t> sought_;
  std::span<const std::uint8_t> fixed_;
  std::span<const MeasuredCase> cases_;
  const std::vector<Datum>& data_;
  const Context& context_;
  HyperelasticOptions options_;
  Eigen::MatrixXd jacobian_; ///< of displacements by log 1/E
  Eigen::VectorXd residual_;
  YoungFit fit_;
};

} // namespace

YoungFit fit_young(const tetrahedra::TetMesh& mesh, std::span<const fem::SolidMaterial> materials,
                   std::span<const std::string> names, std::span<const std::size_t> sought,
                   std::span<const std::uint8_t> fixed, std::span<const MeasuredCase> cases,
                   const YoungFitOptions& options, const Context& context) {
  const std::vector<Datum> data = data_of(mesh, fixed, cases);
  if (sought.empty())
    throw Error("all materials are known, expected one to fit");
  if (data.size() < sought.size())
    throw Error(std::to_string(data.size()) + " measured axes for " +
                std::to_string(sought.size()) + " materials, expected as many at least");
  Fit fit(mesh, materials, names, sought, fixed, cases, data, context);
  fit.scale(start_factor(mesh, materials, fixed, cases, data, context));
  // What ends the fit has no place of its own: a wrong measurement is the usual reason.
  const auto naming_worst = [&](auto&& work) {
    try {
      return work();
    } catch (const gewebe::Cancelled&) {
      throw;
    } catch (const gewebe::Error& error) {
      const std::string worst = data.size() > 1 ? fit.worst_measurement() : "";
      if (worst.empty() || !error.place().empty())
        throw;
      throw gewebe::Error(error.what() + ("; " + worst));
    }
  };
  fit.solve();
  return naming_worst([&] {
    for (;;) {
      const double change = fit.improve();
      if (change <= options.tolerance)
        return fit.result();
      if (fit.solves() + static_cast<int>(cases.size()) > options.max_solves)
        throw Error("the fit did not end in " + std::to_string(fit.solves()) +
                    " solves: moduli still change by " + text::rounded_text(100 * change) +
                    " %, expected measurements of this body under these loads");
      fit.solve();
    }
  });
}

} // namespace gewebe::fit
