#include "statics/surface_tiles.h"

#include "geometry/vector_at.h"

#include <algorithm>
#include <array>
#include <cstddef>

namespace gewebe::statics {

namespace {

/// Triangles of a tile: four edges across.
constexpr std::size_t tile_triangles = 32;

/// Whether boxes may meet where points of the first are displaced by up to `bound`.
bool may_meet(const Box3& a, double bound, const Box3& b) {
  for (int axis = 0; axis < 3; ++axis)
    if (a.min[axis] - bound > b.max[axis] || b.min[axis] > a.max[axis] + bound)
      return false;
  return true;
}

void keep_each_once(std::vector<std::uint32_t>& numbers) {
  std::ranges::sort(numbers);
  numbers.erase(std::ranges::unique(numbers).begin(), numbers.end());
}

} // namespace

double SurfaceTiles::Tile::bound(std::span<const double> bounds) const {
  double most = 0;
  for (const std::uint32_t cluster : clusters)
    if (!(bounds[cluster] <= most))
      most = bounds[cluster];
  return most;
}

SurfaceTiles::SurfaceTiles(const contact::ModelSurface& surface,
                           const columns::NodeClusters& clusters)
    : surface_(surface), clusters_(clusters), cluster_(surface.node.size()),
      place_(surface.node.size()), tile_(surface.node.size()) {
  std::vector<std::uint32_t> cluster_of(clusters.node.size()), place_of(clusters.node.size());
  for (std::uint32_t c = 0; c < clusters.size(); ++c) {
    const std::span<const std::uint32_t> nodes = clusters.nodes(c);
    for (std::uint32_t k = 0; k < nodes.size(); ++k) {
      cluster_of[nodes[k]] = c;
      place_of[nodes[k]] = k;
    }
  }
  for (std::size_t v = 0; v < surface.node.size(); ++v) {
    cluster_[v] = cluster_of[surface.node[v]];
    place_[v] = place_of[surface.node[v]];
  }
  const contact::BodySurface& own = surface.surface;
  std::vector<Vec3> middle;
  std::vector<std::uint32_t> all;
  for (const auto& [a, b, c] : own.triangles) {
    all.push_back(static_cast<std::uint32_t>(all.size()));
    middle.push_back((own.rest[a] + own.rest[b] + own.rest[c]) / 3);
  }
  columns::NodeClusters groups;
  columns::append_clusters(middle, all, tile_triangles, groups);
  for (std::size_t g = 0; g < groups.size(); ++g) {
    Tile& tile = tiles_.emplace_back();
    for (const std::uint32_t t : groups.nodes(g)) {
      tile.triangles.push_back(t);
      for (const std::uint32_t v : own.triangles[t]) {
        tile.box.add(own.rest[v]);
        tile.clusters.push_back(cluster_[v]);
        tile_[v] = static_cast<std::uint32_t>(g);
      }
    }
    keep_each_once(tile.clusters);
  }
}

std::vector<std::uint32_t> SurfaceTiles::near(std::span<const Box3> boxes,
                                              std::span<const double> bounds) const {
  const double largest = largest_size(bounds);
  std::vector<std::uint32_t> found;
  for (std::uint32_t k = 0; k < tiles_.size(); ++k) {
    const auto within = [&](double bound) {
      return std::ranges::any_of(
          boxes, [&](const Box3& box) { return may_meet(tiles_[k].box, bound, box); });
    };
    if (within(largest) && within(tiles_[k].bound(bounds)))
      found.push_back(k);
  }
  return found;
}

std::vector<std::uint32_t> SurfaceTiles::with(std::span<const std::uint32_t> nodes) const {
  std::vector<std::uint32_t> found;
  for (const std::uint32_t node : nodes) {
    const auto at = std::ranges::lower_bound(surface_.node, node);
    if (at != surface_.node.end() && *at == node)
      found.push_back(tile_[static_cast<std::size_t>(at - surface_.node.begin())]);
  }
  keep_each_once(found);
  return found;
}

Box3 SurfaceTiles::box(std::span<const double> bounds) const {
  Box3 all;
  for (const Tile& tile : tiles_) {
    const double bound = tile.bound(bounds);
    const Vec3 by{bound, bound, bound};
    all.add(tile.box.min - by);
    all.add(tile.box.max + by);
  }
  return all;
}

SurfacePatch SurfaceTiles::part(std::span<const std::uint32_t> tiles) const {
  SurfacePatch part;
  const contact::BodySurface& whole = surface_.surface;
  std::vector<std::uint32_t> triangles, vertices;
  for (const std::uint32_t k : tiles)
    triangles.insert(triangles.end(), tiles_[k].triangles.begin(), tiles_[k].triangles.end());
  std::ranges::sort(triangles);
  for (const std::uint32_t t : triangles)
    vertices.insert(vertices.end(), whole.triangles[t].begin(), whole.triangles[t].end());
  keep_each_once(vertices);
  for (const std::uint32_t v : vertices)
    part.clusters.push_back(cluster_[v]);
  keep_each_once(part.clusters);
  std::vector<std::uint32_t> first{0};
  for (const std::uint32_t c : part.clusters) {
    const std::span<const std::uint32_t> nodes = clusters_.nodes(c);
    part.node.insert(part.node.end(), nodes.begin(), nodes.end());
    first.push_back(static_cast<std::uint32_t>(part.node.size()));
  }
  const auto index_of = [](const std::vector<std::uint32_t>& ascending, std::uint32_t value) {
    return static_cast<std::uint32_t>(std::ranges::lower_bound(ascending, value) -
                                      ascending.begin());
  };
  for (const std::uint32_t v : vertices) {
    part.surface.node.push_back(surface_.node[v]);
    part.surface.surface.rest.push_back(whole.rest[v]);
    part.surface.surface.fixed.push_back(whole.fixed[v]);
    part.place.push_back(first[index_of(part.clusters, cluster_[v])] + place_[v]);
  }
  for (const std::uint32_t t : triangles) {
    std::array<std::uint32_t, 3> corners{};
    for (std::size_t k = 0; k < 3; ++k)
      corners[k] = index_of(vertices, whole.triangles[t][k]);
    part.surface.surface.triangles.push_back(corners);
  }
  part.surface.typical = surface_.typical;
  return part;
}

} // namespace gewebe::statics
