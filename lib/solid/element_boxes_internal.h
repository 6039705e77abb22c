#pragma once
// Elements by boxes of space: which one is nearest to a point.

#include "base/vec3.h"
#include "mesh/nearest_point.h"
#include "model/model.h"
#include "tetrahedra/tet_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace gewebe::elements {

using Corners = std::array<Vec3, 4>;
using Barycentric = std::array<double, 4>;

inline Corners corners_of(const Model& model, std::uint32_t tetrahedron) {
  const Tetrahedron& t = model.tetrahedra[tetrahedron];
  return {model.nodes[t[0]].position, model.nodes[t[1]].position, model.nodes[t[2]].position,
          model.nodes[t[3]].position};
}

inline Barycentric barycentric(const Corners& c, const Vec3& x) {
  const double whole = tetrahedron_volume(c[0], c[1], c[2], c[3]);
  Barycentric l{0, tetrahedron_volume(c[0], x, c[2], c[3]) / whole,
                tetrahedron_volume(c[0], c[1], x, c[3]) / whole,
                tetrahedron_volume(c[0], c[1], c[2], x) / whole};
  l[0] = 1 - l[1] - l[2] - l[3];
  return l;
}

inline bool holds(const Barycentric& l) {
  return l[0] >= 0 && l[1] >= 0 && l[2] >= 0 && l[3] >= 0;
}

/// The point of an element that is nearest to x.
inline Vec3 nearest_in(const Corners& c, const Vec3& x) {
  if (holds(barycentric(c, x)))
    return x;
  Vec3 nearest = c[0];
  double least = HUGE_VAL;
  for (const auto& [i, j, k] : tetrahedron_faces) {
    const Vec3 q = nearest_on_triangle(x, c[i], c[j], c[k]).point;
    if (const double squared = dot(x - q, x - q); squared < least) {
      least = squared;
      nearest = q;
    }
  }
  return nearest;
}

/// The elements by boxes of space, so that the nearest one is found among few.
class ElementBoxes {
public:
  /// \pre `elements` is not empty
  ElementBoxes(const Model& model, std::span<const std::uint32_t> elements) : model_(model) {
    Box3 box;
    for (const std::uint32_t t : elements)
      for (const std::uint32_t node : model.tetrahedra[t])
        box.add(model.nodes[node].position);
    low_ = box.min;
    const Vec3 size = box.max - box.min;
    const double side = std::max({size.x, size.y, size.z});
    // As many boxes as elements, at most.
    cell_ = side / std::cbrt(static_cast<double>(elements.size()));
    for (std::size_t a = 0; a < 3; ++a)
      count_[a] = std::max(1, static_cast<int>(size[static_cast<int>(a)] / cell_));
    start_.assign(cells() + 1, 0);
    for (int pass = 0; pass < 2; ++pass) { // count, then fill
      for (const std::uint32_t t : elements) {
        each_box(t, [&](std::size_t at) {
          if (pass == 0)
            ++start_[at + 1];
          else
            element_[next_[at]++] = t;
        });
      }
      if (pass > 0)
        break;
      for (std::size_t at = 0; at < cells(); ++at)
        start_[at + 1] += start_[at];
      element_.resize(start_.back());
      next_ = start_;
    }
  }

  /// The nearest element that may be, the first of several, and its distance squared; infinite
  /// where there is none.
  template <class May>
  std::pair<std::uint32_t, double> nearest(const Vec3& x, May&& may) const {
    const std::array<int, 3> at = box_of(x);
    std::uint32_t found = 0;
    double least = HUGE_VAL;
    const int rings = std::max({count_[0], count_[1], count_[2]});
    for (int ring = 0; ring <= rings; ++ring) {
      // What lies in this ring or beyond is at least so far from the box of x.
      const double reach = (ring - 1) * cell_;
      if (reach > 0 && least < reach * reach)
        break;
      each_of_ring(at, ring, [&](std::size_t cell) {
        for (std::size_t k = start_[cell]; k < start_[cell + 1]; ++k) {
          const std::uint32_t t = element_[k];
          if (!may(t) || squared_to_box(t, x) > least * (1 + 1e-12))
            continue;
          const Vec3 away = x - nearest_in(corners_of(model_, t), x);
          const double squared = dot(away, away);
          if (squared < least || (squared == least && t < found)) {
            least = squared;
            found = t;
          }
        }
      });
    }
    return {found, least};
  }

private:
  /// From a point to the box of an element: the element is no nearer.
  double squared_to_box(std::uint32_t t, const Vec3& x) const {
    Box3 box;
    for (const std::uint32_t node : model_.tetrahedra[t])
      box.add(model_.nodes[node].position);
    double squared = 0;
    for (int a = 0; a < 3; ++a) {
      const double away = std::max({box.min[a] - x[a], x[a] - box.max[a], 0.0});
      squared += away * away;
    }
    return squared;
  }
  std::size_t cells() const {
    return static_cast<std::size_t>(count_[0]) * static_cast<std::size_t>(count_[1]) *
           static_cast<std::size_t>(count_[2]);
  }
  std::size_t index(int i, int j, int k) const {
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(count_[1]) +
            static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(count_[0]) +
           static_cast<std::size_t>(i);
  }
  /// The box that a point lies in or is nearest to.
  std::array<int, 3> box_of(const Vec3& x) const {
    std::array<int, 3> at{};
    for (std::size_t a = 0; a < 3; ++a) {
      const int axis = static_cast<int>(a);
      const double place = std::floor((x[axis] - low_[axis]) / cell_);
      at[a] = static_cast<int>(std::clamp(place, 0.0, static_cast<double>(count_[a] - 1)));
    }
    return at;
  }
  template <class Work>
  void each_box(std::uint32_t t, Work&& work) const {
    Box3 box;
    for (const Vec3& corner : corners_of(model_, t))
      box.add(corner);
    const std::array<int, 3> from = box_of(box.min), to = box_of(box.max);
    for (int k = from[2]; k <= to[2]; ++k)
      for (int j = from[1]; j <= to[1]; ++j)
        for (int i = from[0]; i <= to[0]; ++i)
          work(index(i, j, k));
  }
  /// The boxes whose largest distance in steps along an axis is `ring`.
  template <class Work>
  void each_of_ring(const std::array<int, 3>& at, int ring, Work&& work) const {
    const auto from = [&](std::size_t a) { return std::max(at[a] - ring, 0); };
    const auto to = [&](std::size_t a) { return std::min(at[a] + ring, count_[a] - 1); };
    for (int k = from(2); k <= to(2); ++k)
      for (int j = from(1); j <= to(1); ++j) {
        const bool side = std::abs(k - at[2]) == ring || std::abs(j - at[1]) == ring;
        for (int i = from(0); i <= to(0); ++i)
          if (side || std::abs(i - at[0]) == ring)
            work(index(i, j, k));
      }
  }

  const Model& model_;
  Vec3 low_;
  double cell_ = 1;
  std::array<int, 3> count_{};
  std::vector<std::size_t> start_, next_;
  std::vector<std::uint32_t> element_;
};

} // namespace gewebe::elements
