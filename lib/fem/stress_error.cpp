#include "fem/stress_error.h"

#include "base/parallel.h"

#include <Eigen/Core>
#include <Eigen/QR>

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace gewebe::fem {

namespace {

using Eigen::Dynamic, Eigen::Index, Eigen::Matrix;

/// Of a linear function in space.
constexpr int terms = 4;

/// Samples of a fit over its coefficients: fewer, and the patch grows by the elements around it.
constexpr std::size_t samples_per_term = 2;
constexpr int max_rings = 3;
/// Singular values below this part of the largest are not determined by the samples.
constexpr double rank_tolerance = 1e-6;
/// Energy of the error over that of d: linear functions miss a part of what is singular at clamped
/// edges and at the edges of contact. By `validate estimates`.
constexpr double energy_share = 1.6;
/// Nodes of a block of parallel work.
constexpr std::size_t nodes_per_block = 64;

struct Point {
  std::array<double, 4> at{};
  double weight = 0;
};
constexpr std::size_t point_count = 14;

/// Exact to degree 5, with positive weights of sum 1 (Walkington, Quadrature on simplices of
/// arbitrary dimension, 2000).
std::array<Point, point_count> make_points() {
  std::array<Point, point_count> all;
  std::size_t n = 0;
  const auto four = [&](double a, double weight) {
    for (std::size_t k = 0; k < 4; ++k) {
      all[n].at.fill(a);
      all[n].at[k] = 1 - 3 * a;
      all[n++].weight = weight;
    }
  };
  four(0.31088591926330060980, 0.11268792571801585080);
  four(0.092735250310891226402, 0.073493043116361949544);
  constexpr double a = 0.045503704125649649492;
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = i + 1; j < 4; ++j) {
      all[n].at.fill(a);
      all[n].at[i] = all[n].at[j] = 0.5 - a;
      all[n++].weight = 0.042546020777081466438;
    }
  return all;
}

/// Where stresses of an element are sampled.
std::span<const std::array<double, 4>> sampling_points(bool quadratic) {
  constexpr double a = 0.58541019662496845446, b = 0.13819660112501051518;
  static constexpr std::array<std::array<double, 4>, 1> middle{{{0.25, 0.25, 0.25, 0.25}}};
  static constexpr std::array<std::array<double, 4>, 4> gauss{
      {{a, b, b, b}, {b, a, b, b}, {b, b, a, b}, {b, b, b, a}}};
  if (quadratic)
    return gauss;
  return middle;
}

/// Elements of each corner.
struct Stars {
  std::vector<std::size_t> first;
  std::vector<std::uint32_t> element;

  explicit Stars(const tetrahedra::TetMesh& mesh) : first(mesh.points.size() + 1) {
    for (const Tetrahedron& t : mesh.tetrahedra)
      for (const std::uint32_t corner : t)
        ++first[corner + 1];
    for (std::size_t k = 1; k < first.size(); ++k)
      first[k] += first[k - 1];
    element.resize(first.back());
    std::vector<std::size_t> next(first.begin(), first.end() - 1);
    for (std::uint32_t t = 0; t < mesh.tetrahedra.size(); ++t)
      for (const std::uint32_t corner : mesh.tetrahedra[t])
        element[next[corner]++] = t;
  }
  std::span<const std::uint32_t> of(std::uint32_t node) const {
    return std::span(element).subspan(first[node], first[node + 1] - first[node]);
  }
};

/// Recovered stress at the nodes of an element: its corners, and its middles by both ends of their
/// edges, whose mean counts. Each has one patch that it comes from.
struct Recovered {
  std::array<linalg::SymmetricBlock, 4> corner{};
  std::array<std::array<linalg::SymmetricBlock, 2>, 6> middle{};
};

class Recovery {
public:
  Recovery(const tetrahedra::TetMesh& mesh, std::span<const CornerTensors> stresses)
      : mesh_(mesh), stresses_(stresses), stars_(mesh), quadratic_(!mesh.middles.empty()),
        samples_(sampling_points(quadratic_)), recovered_(mesh.tetrahedra.size()) {}

  std::vector<Recovered> run(const Context& context) {
    parallel_blocks(context, mesh_.points.size(), nodes_per_block,
                    [&](std::size_t begin, std::size_t end) {
                      for (std::size_t node = begin; node < end; ++node)
                        fit_around(static_cast<std::uint32_t>(node));
                    });
    return std::move(recovered_);
  }

private:
  std::int32_t material(std::uint32_t t) const {
    return mesh_.material.empty() ? 0 : mesh_.material[t];
  }

  /// Elements of one material around a node, with those around them where they are too few.
  std::vector<std::uint32_t> patch(std::uint32_t node, std::int32_t of) const {
    const std::size_t wanted = samples_per_term * terms / samples_.size();
    std::vector<std::uint32_t> all;
    for (const std::uint32_t t : stars_.of(node))
      if (material(t) == of)
        all.push_back(t);
    for (int ring = 0; ring < max_rings && all.size() < wanted; ++ring) {
      std::vector<std::uint32_t> wider = all;
      for (const std::uint32_t t : all)
        for (const std::uint32_t corner : mesh_.tetrahedra[t])
          for (const std::uint32_t other : stars_.of(corner))
            if (material(other) == of)
              wider.push_back(other);
      std::ranges::sort(wider);
      wider.erase(std::ranges::unique(wider).begin(), wider.end());
      all.swap(wider);
    }
    return all;
  }

  void fit_around(std::uint32_t node) {
    std::vector<std::int32_t> materials;
    for (const std::uint32_t t : stars_.of(node))
      materials.push_back(material(t));
    std::ranges::sort(materials);
    materials.erase(std::ranges::unique(materials).begin(), materials.end());
    for (const std::int32_t of : materials)
      keep(node, of, fit(node, patch(node, of)));
  }

  /// Linear function of (x - centre) / size, for each component of the stress.
  struct Fit {
    Vec3 centre;
    double size = 0; ///< of the patch, mm
    Matrix<double, terms, 6> coefficients;

    linalg::SymmetricBlock operator()(const Vec3& p) const {
      const Vec3 x = (p - centre) / size;
      linalg::SymmetricBlock value{};
      for (std::size_t k = 0; k < 6; ++k) {
        const auto c = coefficients.col(static_cast<Index>(k));
        value[k] = c[0] + c[1] * x.x + c[2] * x.y + c[3] * x.z;
      }
      return value;
    }
  };

  /// The one that fits the samples of some elements best.
  Fit fit(std::uint32_t node, std::span<const std::uint32_t> elements) const {
    Fit result{mesh_.points[node], 0, {}};
    for (const std::uint32_t t : elements)
      for (const std::uint32_t corner : mesh_.tetrahedra[t])
        result.size = std::max(result.size, norm(mesh_.points[corner] - result.centre));
    const auto rows = static_cast<Index>(elements.size() * samples_.size());
    Matrix<double, Dynamic, terms> places(rows, terms);
    Matrix<double, Dynamic, 6> values(rows, 6);
    Index r = 0;
    for (const std::uint32_t t : elements)
      for (const std::array<double, 4>& sample : samples_) {
        Vec3 x = -result.centre;
        for (std::size_t k = 0; k < 4; ++k)
          x += sample[k] * mesh_.points[mesh_.tetrahedra[t][k]];
        x = x / result.size;
        places.row(r) << 1, x.x, x.y, x.z;
        const linalg::SymmetricBlock stress = tensor_at(stresses_[t], sample);
        values.row(r) = Eigen::Map<const Matrix<double, 1, 6>>(stress.data());
        ++r;
      }
    Eigen::CompleteOrthogonalDecomposition<Matrix<double, Dynamic, terms>> decomposition;
    decomposition.setThreshold(rank_tolerance);
    decomposition.compute(places);
    result.coefficients = decomposition.solve(values);
    return result;
  }

  /// Keeps the values at the places of the node in the elements around it, which are its own: no
  /// two nodes have the same.
  void keep(std::uint32_t node, std::int32_t of, const Fit& fit) {
    const linalg::SymmetricBlock here = fit(mesh_.points[node]);
    for (const std::uint32_t t : stars_.of(node)) {
      if (material(t) != of)
        continue;
      for (std::size_t a = 0; a < 4; ++a)
        if (mesh_.tetrahedra[t][a] == node)
          recovered_[t].corner[a] = here;
      for (std::size_t k = 0; quadratic_ && k < 6; ++k)
        for (std::size_t end = 0; end < 2; ++end)
          if (mesh_.tetrahedra[t][tetrahedra::tetrahedron_edges[k][end]] == node)
            recovered_[t].middle[k][end] = fit(mesh_.points[mesh_.middles[t][k]]);
    }
  }

  const tetrahedra::TetMesh& mesh_;
  std::span<const CornerTensors> stresses_;
  Stars stars_;
  bool quadratic_;
  std::span<const std::array<double, 4>> samples_;
  std::vector<Recovered> recovered_;
};

/// Recovered minus element stress at a point of an element.
linalg::SymmetricBlock difference_at(const Recovered& recovered, const CornerTensors& stresses,
                                     const std::array<double, 4>& l, bool quadratic) {
  linalg::SymmetricBlock d = tensor_at(stresses, l);
  for (double& value : d)
    value = -value;
  const auto add = [&](double weight, const linalg::SymmetricBlock& tensor) {
    for (std::size_t k = 0; k < 6; ++k)
      d[k] += weight * tensor[k];
  };
  for (std::size_t a = 0; a < 4; ++a)
    add(quadratic ? l[a] * (2 * l[a] - 1) : l[a], recovered.corner[a]);
  for (std::size_t k = 0; quadratic && k < 6; ++k)
    for (const linalg::SymmetricBlock& end : recovered.middle[k])
      add(2 * l[tetrahedra::tetrahedron_edges[k][0]] * l[tetrahedra::tetrahedron_edges[k][1]], end);
  return d;
}

} // namespace

double energy_density(const Elasticity& material, const linalg::SymmetricBlock& stress) {
  const double bulk = material.lambda + 2 * material.mu / 3;
  const double pressure = (stress[0] + stress[3] + stress[5]) / 3;
  const double size = von_mises(stress); // 3/2 of the square of the deviator
  return size * size / (3 * material.mu) + pressure * pressure / bulk;
}

StressError stress_error(const tetrahedra::TetMesh& mesh, std::span<const SolidElement> elements,
                         std::span<const CornerTensors> stresses, const Context& context) {
  static const std::array<Point, point_count> points = make_points();
  const std::vector<Recovered> recovered = Recovery(mesh, stresses).run(context);
  const bool quadratic = !mesh.middles.empty();
  StressError error;
  error.energy.resize(elements.size());
  error.at_node.resize(mesh.points.size());
  std::vector<double> volume(mesh.points.size());
  for (std::size_t t = 0; t < elements.size(); ++t) {
    double square = 0;
    for (const Point& point : points) {
      const linalg::SymmetricBlock d =
          difference_at(recovered[t], stresses[t], point.at, quadratic);
      const double size = von_mises(d);
      square += point.weight * size * size;
      error.energy[t] += point.weight * energy_density(elements[t].material, d);
    }
    error.energy[t] *= energy_share * elements[t].volume;
    for (std::size_t a = 0; a < (quadratic ? 10 : 4); ++a) {
      const std::uint32_t node = a < 4 ? mesh.tetrahedra[t][a] : mesh.middles[t][a - 4];
      error.at_node[node] += elements[t].volume * square;
      volume[node] += elements[t].volume;
    }
  }
  for (std::size_t i = 0; i < volume.size(); ++i)
    error.at_node[i] = volume[i] > 0 ? std::sqrt(error.at_node[i] / volume[i]) : 0;
  return error;
}

} // namespace gewebe::fem
