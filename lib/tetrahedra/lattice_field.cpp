#include "tetrahedra/lattice_field.h"

#include "base/parallel.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace gewebe::tetrahedra {
namespace {

constexpr double outside_by = 1e-9; // of barycentric coordinates

/// From the world to places' numbers along the lattice.
class ToLattice {
public:
  explicit ToLattice(const PlaceLattice& lattice) : origin_(lattice.origin) {
    const auto& [a, b, c] = lattice.step;
    const double volume = dot(cross(a, b), c);
    rows_ = {cross(b, c) * (1 / volume), cross(c, a) * (1 / volume), cross(a, b) * (1 / volume)};
  }
  Vec3 operator()(const Vec3& p) const {
    const Vec3 d = p - origin_;
    return {dot(rows_[0], d), dot(rows_[1], d), dot(rows_[2], d)};
  }
  /// Whether lattices turn what is right-handed.
  bool mirrors() const { return dot(cross(rows_[0], rows_[1]), rows_[2]) < 0; }

private:
  Vec3 origin_;
  std::array<Vec3, 3> rows_;
};

using Weights = std::array<double, 10>;
using Coordinates = std::array<double, 4>; // barycentric

/// An element in coordinates of the lattice.
class Element {
public:
  Element(std::span<const Vec3> nodes, bool mirrored) : nodes_(nodes), mirrored_(mirrored) {
    corner_inverse_ = inverse(nodes_[1] - nodes_[0], nodes_[2] - nodes_[0], nodes_[3] - nodes_[0]);
  }

  /// All that it may hold: the hull of its corners and of the points whose means with them are the
  /// middles of its edges.
  Box3 box() const {
    Box3 box;
    for (std::size_t k = 0; k < 4; ++k)
      box.add(nodes_[k]);
    for (std::size_t e = 0; 4 + e < nodes_.size(); ++e)
      box.add(2 * nodes_[4 + e] -
              0.5 * (nodes_[tetrahedron_edges[e][0]] + nodes_[tetrahedron_edges[e][1]]));
    return box;
  }

  std::optional<Weights> weights_at(const Vec3& place) const {
    const std::optional<Coordinates> at = nodes_.size() == 4 ? linear(place) : curved(place);
    if (!at || !(*std::ranges::min_element(*at) >= -outside_by))
      return std::nullopt;
    Weights weights{};
    if (nodes_.size() == 4)
      std::ranges::copy(*at, weights.begin());
    else
      weights = quadratic_weights(*at);
    return weights;
  }

private:
  using Rows = std::array<Vec3, 3>;

  /// Rows of the inverse of the matrix with these columns, where that does not turn what the mesh
  /// has, nor is flat.
  std::optional<Rows> inverse(const Vec3& a, const Vec3& b, const Vec3& c,
                              bool turned_too = false) const {
    const double volume = dot(cross(a, b), c);
    const bool right = mirrored_ ? volume < 0 : volume > 0;
    if (!(right || (turned_too && volume != 0)))
      return std::nullopt;
    const double by = 1 / volume;
    return Rows{cross(b, c) * by, cross(c, a) * by, cross(a, b) * by};
  }

  std::optional<Coordinates> linear(const Vec3& place) const {
    if (!corner_inverse_)
      return std::nullopt;
    return coordinates(*corner_inverse_, place - nodes_[0], {1, 0, 0, 0});
  }

  static Coordinates coordinates(const Rows& rows, const Vec3& d, Coordinates from) {
    const std::array<double, 3> step{dot(rows[0], d), dot(rows[1], d), dot(rows[2], d)};
    for (std::size_t k = 0; k < 3; ++k) {
      from[k + 1] += step[k];
      from[0] -= step[k];
    }
    return from;
  }

  static Weights quadratic_weights(const Coordinates& at) {
    Weights weights{};
    for (std::size_t k = 0; k < 4; ++k)
      weights[k] = at[k] * (2 * at[k] - 1);
    for (std::size_t e = 0; e < 6; ++e)
      weights[4 + e] = 4 * at[tetrahedron_edges[e][0]] * at[tetrahedron_edges[e][1]];
    return weights;
  }

  /// By Newton's method from the middle; nothing where it finds no place, or one in which the
  /// element is turned.
  std::optional<Coordinates> curved(const Vec3& place) const {
    Coordinates at{0.25, 0.25, 0.25, 0.25};
    for (int n = 0; n < 30; ++n) {
      const Weights weights = quadratic_weights(at);
      Vec3 d = place;
      for (std::size_t k = 0; k < 10; ++k)
        d = d - weights[k] * nodes_[k];
      const std::array<Vec3, 3> columns = derivatives(at);
      const auto rows = inverse(columns[0], columns[1], columns[2], true);
      if (!rows)
        return std::nullopt;
      const Coordinates next = coordinates(*rows, d, at);
      double moved = 0, most = 0;
      for (std::size_t k = 0; k < 4; ++k) {
        moved = std::max(moved, std::fabs(next[k] - at[k]));
        most = std::max(most, std::fabs(next[k]));
      }
      at = next;
      if (!(most < 10)) // far outside
        return std::nullopt;
      if (moved < 1e-12) {
        const std::array<Vec3, 3> here = derivatives(at);
        return inverse(here[0], here[1], here[2]) ? std::optional(at) : std::nullopt;
      }
    }
    return std::nullopt;
  }

  /// Of the place by the second to fourth coordinate, the first making their sum 1.
  std::array<Vec3, 3> derivatives(const Coordinates& at) const {
    std::array<Vec3, 4> by{};
    for (std::size_t k = 0; k < 4; ++k)
      by[k] = (4 * at[k] - 1) * nodes_[k];
    for (std::size_t e = 0; e < 6; ++e) {
      const auto [a, b] = tetrahedron_edges[e];
      by[a] = by[a] + (4 * at[b]) * nodes_[4 + e];
      by[b] = by[b] + (4 * at[a]) * nodes_[4 + e];
    }
    return {by[1] - by[0], by[2] - by[0], by[3] - by[0]};
  }

  std::span<const Vec3> nodes_;
  bool mirrored_;
  std::optional<Rows> corner_inverse_;
};

struct Range {
  std::size_t begin = 0, end = 0;
};

/// Whole numbers from `low` to `high`, a little more for rounding, within 0 … size - 1.
Range places_between(double low, double high, std::size_t size) {
  const double last = static_cast<double>(size);
  const double begin = std::clamp(std::ceil(low - 1e-6), 0.0, last),
               end = std::clamp(std::floor(high + 1e-6) + 1, 0.0, last);
  if (!(begin < end))
    return {};
  return {static_cast<std::size_t>(begin), static_cast<std::size_t>(end)};
}

class Interpolation {
public:
  Interpolation(const TetMesh& mesh, std::span<const Vec3> values, const PlaceLattice& lattice,
                LatticeField& field, const Context& context)
      : mesh_(mesh), values_(values), lattice_(lattice), field_(field), to_(lattice),
        points_(mesh.points.size()) {
    parallel_blocks(context, points_.size(), 4096, [&](std::size_t begin, std::size_t end) {
      for (std::size_t p = begin; p < end; ++p)
        points_[p] = to_(mesh_.points[p]);
    });
    list_by_layer();
    parallel_blocks(context, lattice_.size[2], 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k)
        fill_layer(k);
    });
  }

private:
  using Nodes = std::array<Vec3, 10>;

  std::size_t nodes_of(std::size_t t, std::array<std::uint32_t, 10>& numbers) const {
    std::ranges::copy(mesh_.tetrahedra[t], numbers.begin());
    if (mesh_.middles.empty())
      return 4;
    std::ranges::copy(mesh_.middles[t], numbers.begin() + 4);
    return 10;
  }

  std::size_t places_of(std::size_t t, Nodes& nodes) const {
    std::array<std::uint32_t, 10> numbers{};
    const std::size_t count = nodes_of(t, numbers);
    for (std::size_t n = 0; n < count; ++n)
      nodes[n] = points_[numbers[n]];
    return count;
  }

  /// Which elements may hold places of each layer, in their order.
  void list_by_layer() {
    first_.assign(lattice_.size[2] + 1, 0);
    std::vector<Range> layers(mesh_.tetrahedra.size());
    for (std::size_t t = 0; t < layers.size(); ++t) {
      Nodes nodes;
      const std::size_t count = places_of(t, nodes);
      const Box3 box = Element(std::span<const Vec3>(nodes).first(count), to_.mirrors()).box();
      layers[t] = places_between(box.min.z, box.max.z, lattice_.size[2]);
      for (std::size_t k = layers[t].begin; k < layers[t].end; ++k)
        ++first_[k + 1];
    }
    for (std::size_t k = 0; k < lattice_.size[2]; ++k)
      first_[k + 1] += first_[k];
    elements_.resize(first_.back());
    std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
    for (std::size_t t = 0; t < layers.size(); ++t)
      for (std::size_t k = layers[t].begin; k < layers[t].end; ++k)
        elements_[next[k]++] = static_cast<std::uint32_t>(t);
  }

  void fill_layer(std::size_t k) {
    for (std::size_t n = first_[k]; n < first_[k + 1]; ++n) {
      Nodes nodes;
      const std::size_t t = elements_[n], count = places_of(t, nodes);
      const Element element(std::span<const Vec3>(nodes).first(count), to_.mirrors());
      const Box3 box = element.box();
      const Range columns = places_between(box.min.x, box.max.x, lattice_.size[0]),
                  rows = places_between(box.min.y, box.max.y, lattice_.size[1]);
      for (std::size_t j = rows.begin; j < rows.end; ++j)
        for (std::size_t i = columns.begin; i < columns.end; ++i)
          fill(t, element, i, j, k);
    }
  }

  void fill(std::size_t t, const Element& element, std::size_t i, std::size_t j, std::size_t k) {
    const std::size_t place = (k * lattice_.size[1] + j) * lattice_.size[0] + i;
    if (field_.held[place] != 0)
      return;
    const auto weights = element.weights_at(
        {static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)});
    if (!weights)
      return;
    std::array<std::uint32_t, 10> numbers{};
    const std::size_t count = nodes_of(t, numbers);
    Vec3 sum{};
    for (std::size_t n = 0; n < count; ++n)
      sum = sum + (*weights)[n] * values_[numbers[n]];
    field_.values[place] = {static_cast<float>(sum.x), static_cast<float>(sum.y),
                            static_cast<float>(sum.z)};
    field_.held[place] = 1;
  }

  const TetMesh& mesh_;
  std::span<const Vec3> values_;
  const PlaceLattice& lattice_;
  LatticeField& field_;
  ToLattice to_;
  std::vector<Vec3> points_;            // by the lattice
  std::vector<std::size_t> first_;      // of each layer in
  std::vector<std::uint32_t> elements_; // those that may hold its places
};

} // namespace

void interpolate_on_lattice(const TetMesh& mesh, std::span<const Vec3> values,
                            const PlaceLattice& lattice, LatticeField& field,
                            const Context& context) {
  Interpolation(mesh, values, lattice, field, context);
}

} // namespace gewebe::tetrahedra
