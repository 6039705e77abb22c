#include "stuffing/cutter_internal.h"

#include <utility>

namespace gewebe::stuffing {

BlockCutter::BlockCutter(const StuffingParts& parts) : parts_(parts) {
  for (unsigned n = 0; n < bcc::cell_points; ++n) {
    const bcc::Point point = bcc::cell_point(n);
    offset_[n] = BlockPoints::at(point.kind, static_cast<unsigned>(point.place[0]),
                                 static_cast<unsigned>(point.place[1]),
                                 static_cast<unsigned>(point.place[2]));
  }
}

void BlockCutter::gather(std::size_t block, BlockPoints& points) const {
  const StuffingNodes& nodes = parts_.nodes;
  unsigned n = 0;
  for (unsigned kind = 0; kind < 2; ++kind)
    for (int i = 0; i <= volume::leaf_dim; ++i)
      for (int j = 0; j <= volume::leaf_dim; ++j)
        for (int k = 0; k <= volume::leaf_dim; ++k, ++n) {
          const PlaceInBlock place = locate(parts_.blocks[block], kind, {i, j, k});
          points.sign[n] = -1;
          if (place.block == StuffingBlock::none)
            continue;
          const StuffingBlock& there = parts_.blocks[place.block];
          if (!there.surface.contains(place.word, place.bit)) {
            if (!there.in(place.word, place.bit))
              continue;
          } else {
            const std::uint32_t point = there.surface_point(place.word, place.bit);
            points.surface[n] = point;
            if (parts_.surface.points[point].warped()) {
              points.sign[n] = 0;
              points.material[n].reset();
              points.node[n] = nodes.first[point];
              if (nodes.meeting[point] != Meeting::interior)
                continue;
            } else if (!parts_.surface.points[point].inside)
              continue;
          }
          if (points.sign[n] != 0) {
            points.sign[n] = 1;
            if (parts_.follows()) {
              points.material[n] = material_at(parts_.materials, place);
              if (there.interface.contains(place.word, place.bit)) {
                points.interface[n] = there.interface_point(place.word, place.bit);
                if (parts_.interface.points[points.interface[n]].on)
                  points.material[n].reset();
              }
            }
          }
          points.node[n] =
              nodes.first_inner[place.block] + nodes.inner[place.block].rank(place.word, place.bit);
        }
}

void BlockCutter::choose(const BlockPoints& points, std::array<int, 4> signs, bool even, bool even2,
                         CutTetrahedron& tetrahedron) const {
  bool outside = false;
  std::optional<std::int32_t> smaller, larger;
  for (std::size_t c = 0; c < 4; ++c) {
    const unsigned at = tetrahedron.at[c];
    outside = outside || signs[c] < 0;
    if (signs[c] <= 0 || !points.material[at])
      continue;
    if (!smaller || *points.material[at] < *smaller)
      smaller = points.material[at];
    if (!larger || *points.material[at] > *larger)
      larger = points.material[at];
  }
  tetrahedron.material = smaller;
  tetrahedron.beyond = nullptr;
  if (outside || smaller == larger) {
    tetrahedron.stencil = &stencil(signs, even, even2);
    return;
  }
  std::array<int, 4> beyond{};
  for (std::size_t c = 0; c < 4; ++c) {
    const std::optional<std::int32_t>& material = points.material[tetrahedron.at[c]];
    signs[c] = signs[c] <= 0 || !material ? 0 : material == smaller ? 1 : -1;
    beyond[c] = -signs[c];
  }
  tetrahedron.material_beyond = larger;
  tetrahedron.stencil = &stencil(signs, even, even2);
  tetrahedron.beyond = &stencil(beyond, even, even2);
}

Tetrahedron BlockCutter::nodes_of(const std::array<StencilNode, 4>& of, const CutTetrahedron& cut,
                                  const BlockPoints& points) const {
  Tetrahedron result{};
  for (std::size_t n = 0; n < 4; ++n) {
    const StencilNode node = of[n];
    result[n] =
        !node.is_cut() ? points.node[cut.at[node.code]]
        : cut.beyond != nullptr
            ? interface_node(cut, node.inner(), node.outer(), points)
            : parts_.nodes.cut(points.surface[cut.at[node.inner()]],
                               bcc::cell_directions[cut.number][node.inner()][node.outer()]);
  }
  return result;
}

std::uint32_t BlockCutter::interface_node(const CutTetrahedron& cut, unsigned i, unsigned j,
                                          const BlockPoints& points) const {
  if (*points.material[cut.at[i]] > *points.material[cut.at[j]])
    std::swap(i, j);
  return parts_.nodes.interface_cut(points.interface[cut.at[i]],
                                    bcc::cell_directions[cut.number][i][j]);
}

BlockCutter::Found BlockCutter::find(const StuffingBlock& block, const bcc::Point& point) const {
  const PlaceInBlock place = locate(block, point.kind, point.place);
  if (place.block == StuffingBlock::none)
    return {};
  const PointRanks& inner = parts_.nodes.inner[place.block];
  return {inner.contains(place.word, place.bit),
          parts_.nodes.first_inner[place.block] + inner.rank(place.word, place.bit)};
}

} // namespace gewebe::stuffing
