#include "solid/skin.h"

#include "base/error.h"
#include "base/number_text.h"
#include "base/parallel.h"
#include "mesh/nearest_point.h"
#include "tetrahedra/tet_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <utility>

namespace gewebe {
namespace {

using Corners = std::array<Vec3, 4>;
using Barycentric = std::array<double, 4>;

Corners corners_of(const Model& model, std::uint32_t tetrahedron) {
  const Tetrahedron& t = model.tetrahedra[tetrahedron];
  return {model.nodes[t[0]].position, model.nodes[t[1]].position, model.nodes[t[2]].position,
          model.nodes[t[3]].position};
}

Barycentric barycentric(const Corners& c, const Vec3& x) {
  const double whole = tetrahedron_volume(c[0], c[1], c[2], c[3]);
  Barycentric l{0, tetrahedron_volume(c[0], x, c[2], c[3]) / whole,
                tetrahedron_volume(c[0], c[1], x, c[3]) / whole,
                tetrahedron_volume(c[0], c[1], c[2], x) / whole};
  l[0] = 1 - l[1] - l[2] - l[3];
  return l;
}

bool holds(const Barycentric& l) {
  return l[0] >= 0 && l[1] >= 0 && l[2] >= 0 && l[3] >= 0;
}

/// The point of an element that is nearest to x.
Vec3 nearest_in(const Corners& c, const Vec3& x) {
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
  explicit ElementBoxes(const Model& model) : model_(model) {
    Box3 box;
    for (const Tetrahedron& t : model.tetrahedra)
      for (const std::uint32_t node : t)
        box.add(model.nodes[node].position);
    low_ = box.min;
    const Vec3 size = box.max - box.min;
    const double side = std::max({size.x, size.y, size.z});
    // As many boxes as elements, at most.
    cell_ = side / std::cbrt(static_cast<double>(model.tetrahedra.size()));
    for (std::size_t a = 0; a < 3; ++a)
      count_[a] = std::max(1, static_cast<int>(size[static_cast<int>(a)] / cell_));
    start_.assign(cells() + 1, 0);
    for (int pass = 0; pass < 2; ++pass) { // count, then fill
      for (std::uint32_t t = 0; t < model.tetrahedra.size(); ++t) {
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

  /// The nearest element, the first of several, and its distance squared.
  std::pair<std::uint32_t, double> nearest(const Vec3& x) const {
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

} // namespace

SkinWeights skin_weights(const Model& model) {
  SkinWeights all;
  all.nodes = model.middles.empty() ? 4 : 10;
  const Skin& skin = model.skin;
  all.node.reserve(all.nodes * skin.points.size());
  all.weight.reserve(all.nodes * skin.points.size());
  for (std::size_t p = 0; p < skin.points.size(); ++p) {
    const std::uint32_t t = skin.tetrahedron[p];
    const Corners corners = corners_of(model, t);
    const Barycentric there = barycentric(corners, skin.points[p]);
    const Barycentric l = barycentric(corners, nearest_in(corners, skin.points[p]));
    Barycentric d{}; // from the nearest point on
    for (std::size_t a = 0; a < 4; ++a)
      d[a] = there[a] - l[a];
    const auto& nodes = model.tetrahedra[t];
    all.node.insert(all.node.end(), nodes.begin(), nodes.end());
    if (model.middles.empty()) {
      all.weight.insert(all.weight.end(), there.begin(), there.end());
      continue;
    }
    all.node.insert(all.node.end(), model.middles[t].begin(), model.middles[t].end());
    for (std::size_t a = 0; a < 4; ++a)
      all.weight.push_back(l[a] * (2 * l[a] - 1) + (4 * l[a] - 1) * d[a]);
    for (const auto& [a, b] : tetrahedron_edges)
      all.weight.push_back(4 * l[a] * l[b] + 4 * (l[a] * d[b] + l[b] * d[a]));
  }
  return all;
}

std::vector<Vec3> displaced_skin(const SkinWeights& weights, std::span<const Vec3> rest,
                                 std::span<const double> displacement) {
  std::vector<Vec3> points(rest.begin(), rest.end());
  for (std::size_t p = 0; p < points.size(); ++p)
    for (std::size_t k = weights.nodes * p; k < weights.nodes * (p + 1); ++k) {
      const double* const u = &displacement[3 * std::size_t{weights.node[k]}];
      points[p] += Vec3{u[0], u[1], u[2]} * weights.weight[k];
    }
  return points;
}

SkinReport add_skin(Model& model, const TriangleMesh& surface,
                    std::span<const std::int32_t> material, const Context& context) {
  SkinReport report;
  Skin skin;
  std::vector<std::uint32_t> number(surface.points.size(), UINT32_MAX);
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const auto& [a, b, c] = surface.triangles[t];
    if (a == b || b == c || c == a) {
      ++report.dropped_triangles;
      continue;
    }
    for (const std::uint32_t corner : {a, b, c})
      number[corner] = 0;
    skin.triangles.push_back(surface.triangles[t]);
    skin.material.push_back(material.empty() ? 0 : material[t]);
    if (!surface.texcoords.empty())
      std::ranges::transform(surface.texcoords[t], skin.texcoords.emplace_back().begin(),
                             [](float value) { return decimal_of(value); });
  }
  if (skin.triangles.empty())
    throw Error("the surface has no triangle of three different points, expected some");
  for (std::size_t p = 0; p < number.size(); ++p)
    if (number[p] == 0) {
      number[p] = static_cast<std::uint32_t>(skin.points.size());
      skin.points.push_back(surface.points[p]);
    }
  for (Triangle& triangle : skin.triangles)
    for (std::uint32_t& corner : triangle)
      corner = number[corner];

  Context quiet = context;
  quiet.progress = nullptr;
  const ElementBoxes boxes(model);
  skin.tetrahedron.resize(skin.points.size());
  std::vector<double> squared(skin.points.size());
  parallel_blocks(quiet, skin.points.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p)
      std::tie(skin.tetrahedron[p], squared[p]) = boxes.nearest(skin.points[p]);
  });
  for (const double one : squared)
    if (one > 0) {
      ++report.points_outside;
      report.farthest = std::max(report.farthest, std::sqrt(one));
    }
  model.skin = std::move(skin);
  return report;
}

} // namespace gewebe
