#pragma once
// The element that is nearest to a point.

#include "collision/bvh.h"
#include "geometry/vec3.h"
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

namespace gewebe::embedding::elements {

using Corners = std::array<Vec3, 4>;
using Barycentric = std::array<double, 4>;

inline Corners corners_of(const model::Model& model, std::uint32_t tetrahedron) {
  const Tetrahedron& t = model.tetrahedra[tetrahedron];
  return {model.nodes[t[0]].position, model.nodes[t[1]].position, model.nodes[t[2]].position,
          model.nodes[t[3]].position};
}

inline Barycentric barycentric(const Corners& c, const Vec3& x) {
  const double whole = tetrahedra::tetrahedron_volume(c[0], c[1], c[2], c[3]);
  Barycentric l{0, tetrahedra::tetrahedron_volume(c[0], x, c[2], c[3]) / whole,
                tetrahedra::tetrahedron_volume(c[0], c[1], x, c[3]) / whole,
                tetrahedra::tetrahedron_volume(c[0], c[1], c[2], x) / whole};
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
  for (const auto& [i, j, k] : tetrahedra::tetrahedron_faces) {
    const Vec3 q = mesh::nearest_on_triangle(x, c[i], c[j], c[k]).point;
    if (const double squared = dot(x - q, x - q); squared < least) {
      least = squared;
      nearest = q;
    }
  }
  return nearest;
}

/// Hierarchy of elements, for the nearest one.
class ElementBoxes {
public:
  ElementBoxes(const model::Model& model, std::span<const std::uint32_t> elements)
      : model_(model), elements_(elements.begin(), elements.end()) {
    std::ranges::sort(elements_); // of equally near ones the first is returned
    std::vector<Box3> boxes(elements_.size());
    for (std::size_t k = 0; k < elements_.size(); ++k)
      for (const Vec3& corner : corners_of(model, elements_[k]))
        boxes[k].add(corner);
    tree_ = collision::Bvh(boxes);
  }

  /// The nearest element that may be, the first of several, and its distance squared; infinite
  /// where there is none.
  template <class May>
  std::pair<std::uint32_t, double> nearest(const Vec3& x, May&& may) const {
    const auto to_box = [&](const Box3& box) {
      double squared = 0;
      for (int a = 0; a < 3; ++a) {
        const double away = std::max({box.min[a] - x[a], x[a] - box.max[a], 0.0});
        squared += away * away;
      }
      return squared * (1 - 1e-12); // rounding of the distance
    };
    const auto to_element = [&](std::uint32_t item) {
      const std::uint32_t t = elements_[item];
      if (!may(t))
        return HUGE_VAL;
      const Vec3 away = x - nearest_in(corners_of(model_, t), x);
      return dot(away, away);
    };
    const auto [item, squared] = tree_.nearest(to_box, to_element, HUGE_VAL);
    return {item < elements_.size() ? elements_[item] : 0, squared};
  }

private:
  const model::Model& model_;
  std::vector<std::uint32_t> elements_;
  collision::Bvh tree_;
};

} // namespace gewebe::embedding::elements
