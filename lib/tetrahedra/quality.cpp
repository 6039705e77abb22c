#include "tetrahedra/quality.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>

namespace gewebe::tetrahedra {
namespace {

constexpr double degrees = 57.295779513082320877;

void count_nodes(const TetMesh& mesh, const TetBoundary& surface, TetQuality& quality) {
  std::vector<bool> used(mesh.points.size()), outer(mesh.points.size());
  for (const Tetrahedron& t : mesh.tetrahedra)
    for (const std::uint32_t corner : t)
      used[corner] = true;
  for (const EdgeMiddles& m : mesh.middles)
    for (const std::uint32_t middle : m)
      used[middle] = true;
  for (const std::uint32_t node : surface.node)
    outer[node] = true;
  for (const auto& middles : surface.middles)
    for (const std::uint32_t middle : middles)
      outer[middle] = true;
  quality.surface_nodes = static_cast<std::uint64_t>(std::ranges::count(outer, true));
  quality.inner_nodes =
      static_cast<std::uint64_t>(std::ranges::count(used, true)) - quality.surface_nodes;
}

class Shares {
public:
  void add(std::int32_t material, double volume) {
    if (last_ == nullptr || last_->material != material) {
      last_ = &shares_[material];
      last_->material = material;
    }
    ++last_->tetrahedra;
    last_->volume += volume;
  }
  std::vector<MaterialShare> list() const {
    std::vector<MaterialShare> list;
    for (const auto& [material, share] : shares_)
      list.push_back(share);
    return list;
  }

private:
  std::map<std::int32_t, MaterialShare> shares_;
  MaterialShare* last_ = nullptr;
};

} // namespace

std::array<double, 6> dihedral_angles(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  // Outward normals of a positive tetrahedron; of an inverted one all point inward, which leaves
  // the angles between them.
  const Vec3 ab = b - a, ac = c - a, ad = d - a, bc = c - b, bd = d - b;
  const std::array<Vec3, 4> normal{cross(bc, bd), cross(ad, ac), cross(ab, ad), cross(ac, ab)};
  constexpr std::array<std::array<std::size_t, 2>, 6> at_edge{
      {{2, 3}, {0, 3}, {1, 3}, {1, 2}, {0, 2}, {0, 1}}};
  std::array<double, 6> angles{};
  for (std::size_t e = 0; e < 6; ++e) {
    const Vec3 &m = normal[at_edge[e][0]], &n = normal[at_edge[e][1]];
    angles[e] = std::atan2(norm(cross(m, n)), -dot(m, n));
  }
  return angles;
}

double radius_edge_ratio(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const Vec3 u = b - a, v = c - a, w = d - a, vu = v - u, wu = w - u, wv = w - v;
  const double uu = dot(u, u), vv = dot(v, v), ww = dot(w, w);
  const Vec3 vw = cross(v, w);
  const double radius =
      norm(uu * vw + vv * cross(w, u) + ww * cross(u, v)) / (2 * std::fabs(dot(u, vw)));
  const double shortest = std::sqrt(std::min({uu, vv, ww, dot(vu, vu), dot(wu, wu), dot(wv, wv)}));
  const double ratio = radius / shortest;
  return std::isnan(ratio) ? HUGE_VAL : ratio;
}

TetQuality tet_quality(const TetMesh& mesh, const TetBoundary& surface) {
  TetQuality quality;
  quality.tetrahedra = mesh.tetrahedra.size();
  constexpr std::size_t bins = 18;
  quality.angles = {180, std::vector<std::uint64_t>(bins, 0)};
  count_nodes(mesh, surface, quality);
  if (mesh.tetrahedra.empty())
    return quality;
  double smallest = HUGE_VAL, largest = -1, shortest = HUGE_VAL, longest = 0;
  quality.smallest_volume = HUGE_VAL;
  Shares shares;
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
    const Tetrahedron& tetrahedron = mesh.tetrahedra[t];
    const Vec3 &a = mesh.points[tetrahedron[0]], &b = mesh.points[tetrahedron[1]],
               &c = mesh.points[tetrahedron[2]], &d = mesh.points[tetrahedron[3]];
    const double volume = tetrahedron_volume(a, b, c, d);
    quality.volume += volume;
    quality.smallest_volume = std::fmin(quality.smallest_volume, volume);
    shares.add(mesh.material.empty() ? 0 : mesh.material[t], volume);
    std::array<double, 6> angles = dihedral_angles(a, b, c, d);
    if (volume == 0)
      angles = {0, 0, 0, M_PI, M_PI, M_PI};
    for (const double angle : angles) {
      const double bin = angle * (bins / M_PI);
      ++quality.angles.counts[std::min(bins - 1, static_cast<std::size_t>(std::fmax(bin, 0)))];
      if (angle < smallest) {
        smallest = angle;
        quality.smallest_angle_at = static_cast<std::uint32_t>(t);
      }
      if (angle > largest) {
        largest = angle;
        quality.largest_angle_at = static_cast<std::uint32_t>(t);
      }
    }
    quality.radius_edge_ratio = std::fmax(quality.radius_edge_ratio,
                                          volume == 0 ? HUGE_VAL : radius_edge_ratio(a, b, c, d));
    for (const auto& edge : tetrahedron_edges) {
      const Vec3 side = mesh.points[tetrahedron[edge[1]]] - mesh.points[tetrahedron[edge[0]]];
      const double square = dot(side, side);
      shortest = std::fmin(shortest, square);
      longest = std::fmax(longest, square);
    }
  }
  quality.smallest_angle = smallest * degrees;
  quality.largest_angle = largest * degrees;
  quality.edge_min = std::sqrt(shortest);
  quality.edge_max = std::sqrt(longest);
  quality.materials = shares.list();
  return quality;
}

TetQuality tet_quality(const TetMesh& mesh) {
  return tet_quality(mesh, boundary(mesh));
}

} // namespace gewebe::tetrahedra
