#include "columns/node_clusters.h"

#include <algorithm>
#include <tuple>

namespace gewebe::columns {

namespace {

void halve(std::span<const Vec3> positions, std::span<std::uint32_t> nodes, std::size_t most,
           NodeClusters& to) {
  if (nodes.empty())
    return;
  if (nodes.size() <= most) {
    std::sort(nodes.begin(), nodes.end());
    to.node.insert(to.node.end(), nodes.begin(), nodes.end());
    to.first.push_back(static_cast<std::uint32_t>(to.node.size()));
    return;
  }
  Box3 box;
  for (const std::uint32_t node : nodes)
    box.add(positions[node]);
  const Vec3 size = box.size();
  const int axis = size.x >= size.y ? (size.x >= size.z ? 0 : 2) : (size.y >= size.z ? 1 : 2);
  const auto half = nodes.begin() + static_cast<std::ptrdiff_t>(nodes.size() / 2);
  std::nth_element(nodes.begin(), half, nodes.end(), [&](std::uint32_t a, std::uint32_t b) {
    return std::tuple(positions[a][axis], a) < std::tuple(positions[b][axis], b);
  });
  halve(positions, nodes.first(nodes.size() / 2), most, to);
  halve(positions, nodes.subspan(nodes.size() / 2), most, to);
}

} // namespace

void append_clusters(std::span<const Vec3> positions, std::span<const std::uint32_t> nodes,
                     std::size_t most, NodeClusters& to) {
  std::vector<std::uint32_t> all(nodes.begin(), nodes.end());
  halve(positions, all, most, to);
}

} // namespace gewebe::columns
