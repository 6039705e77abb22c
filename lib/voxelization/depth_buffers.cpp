#include "voxelization/depth_buffers_internal.h"
// Based on: E.-A. Karabassi, G. Papaioannou, T. Theoharis, A Fast Depth-Buffer-Based Voxelization
// Algorithm, 1999.

#include "base/error.h"
#include "base/parallel.h"
#include "voxelization/inside_scan_internal.h"

namespace gewebe::voxelization {
namespace {

/// The pair of depth buffers of one axis w: for each ray (u, v) the first samples beyond its first
/// and its last crossing. Samples between lie in [near, far).
struct DepthPair {
  Range u, v;
  std::vector<std::int32_t> near, far;

  std::size_t at(std::int32_t a, std::int32_t b) const {
    return static_cast<std::size_t>(a - u.begin) * static_cast<std::size_t>(v.end - v.begin) +
           static_cast<std::size_t>(b - v.begin);
  }
};

/// For each 8 x 8 rays of a DepthPair: what all of them hold, and what any of them does.
struct DepthTiles {
  std::int32_t columns = 0; ///< tiles along v
  struct Tile {
    std::int32_t near_all = INT32_MIN, far_all = INT32_MAX, near_any = INT32_MAX,
                 far_any = INT32_MIN;
  };
  std::vector<Tile> tiles;

  explicit DepthTiles(const DepthPair& pair)
      : columns((pair.v.end - pair.v.begin) / volume::leaf_dim),
        tiles(pair.near.size() / (std::size_t{volume::leaf_dim} * volume::leaf_dim)) {
    for (std::int32_t u = pair.u.begin; u < pair.u.end; ++u)
      for (std::int32_t v = pair.v.begin; v < pair.v.end; ++v) {
        Tile& tile =
            tiles[static_cast<std::size_t>((u - pair.u.begin) / volume::leaf_dim * columns +
                                           (v - pair.v.begin) / volume::leaf_dim)];
        const std::int32_t near = pair.near[pair.at(u, v)], far = pair.far[pair.at(u, v)];
        tile = {std::max(tile.near_all, near), std::min(tile.far_all, far),
                std::min(tile.near_any, near), std::max(tile.far_any, far)};
      }
  }
};

using Axes = std::array<int, 3>;

/// The mesh seen along one axis.
struct View {
  Axes axes; ///< u, v, w among i, j, k
  TieOrder ties;
};
// i is moved by more than j, and j by more than k.
constexpr std::array<View, 3> views{View{{1, 2, 0}, TieOrder::zxy}, View{{0, 2, 1}, TieOrder::xzy},
                                    View{{0, 1, 2}, TieOrder::xyz}};

/// Samples of whole leaves around [low, high].
Range leaves_around(double low, double high) {
  return {floor_int(low) & ~7, (floor_int(high) | 7) + 1};
}

DepthPair draw(const Context& context, const SampleMesh& mesh, const View& view, const Box3& box,
               VoxelizeReport& report) {
  std::vector<Vec3> points(mesh.points.size());
  const auto [u, v, w] = view.axes;
  for (std::size_t n = 0; n < points.size(); ++n)
    points[n] = {mesh.points[n][u], mesh.points[n][v], mesh.points[n][w]};
  const SampleMesh seen{1, points, mesh.triangles, mesh.cpu};
  const Chunks chunks = sort_triangles(context, seen);
  for (const Block& block : chunks.blocks)
    report.triangles_skipped += block.skipped;

  DepthPair pair;
  pair.u = leaves_around(box.min[u], box.max[u]);
  pair.v = leaves_around(box.min[v], box.max[v]);
  const std::size_t rays = static_cast<std::size_t>(pair.u.end - pair.u.begin) *
                           static_cast<std::size_t>(pair.v.end - pair.v.begin);
  pair.near.assign(rays, INT32_MAX);
  pair.far.assign(rays, INT32_MIN);
  std::vector<std::uint64_t> crossings(chunks.count()), exact_tests(chunks.count());
  parallel_blocks(context, chunks.count(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      const std::int32_t chunk = chunks.range.begin + static_cast<std::int32_t>(n);
      const std::int32_t rows = chunks.slabs_each * volume::leaf_dim;
      for_each_crossing(seen, chunks, chunk, {chunk * rows, (chunk + 1) * rows}, view.ties,
                        exact_tests[n], [&](std::int32_t a, std::int32_t b, std::int32_t depth) {
                          const std::size_t ray = pair.at(a, b);
                          pair.near[ray] = std::min(pair.near[ray], depth);
                          pair.far[ray] = std::max(pair.far[ray], depth);
                          ++crossings[n];
                        });
    }
  });
  for (std::size_t n = 0; n < crossings.size(); ++n) {
    report.crossings += crossings[n];
    report.exact_tests += exact_tests[n];
  }
  return pair;
}

/// Which of the samples from leaf_begin on lie in [near, far), the first in the lowest bit.
unsigned bits_between(std::int32_t near, std::int32_t far, std::int32_t leaf_begin) {
  const std::int32_t low = std::clamp(near, leaf_begin, leaf_begin + volume::leaf_dim) - leaf_begin;
  const std::int32_t high = std::clamp(far, leaf_begin, leaf_begin + volume::leaf_dim) - leaf_begin;
  return low < high ? (0xffu << low) & (0xffu >> (volume::leaf_dim - high)) : 0u;
}

/// The leaf from (i, j, k) on.
BitLeaf leaf_between(const std::array<DepthPair, 3>& pairs, const Int3& origin) {
  BitLeaf leaf;
  for (std::int32_t a = 0; a < volume::leaf_dim; ++a)
    for (std::int32_t b = 0; b < volume::leaf_dim; ++b) {
      const std::size_t ray = pairs[2].at(origin[0] + a, origin[1] + b);
      unsigned column = bits_between(pairs[2].near[ray], pairs[2].far[ray], origin[2]);
      for (std::int32_t c = 0; c < volume::leaf_dim; ++c) {
        const std::size_t along_i = pairs[0].at(origin[1] + b, origin[2] + c);
        const std::size_t along_j = pairs[1].at(origin[0] + a, origin[2] + c);
        const std::int32_t i = origin[0] + a, j = origin[1] + b;
        if (!(pairs[0].near[along_i] <= i && i < pairs[0].far[along_i] &&
              pairs[1].near[along_j] <= j && j < pairs[1].far[along_j]))
          column &= ~(1u << c);
      }
      leaf.word[static_cast<std::size_t>(a)] |= std::uint64_t{column} << (8 * b);
    }
  return leaf;
}

} // namespace

InsideScan depth_buffer_scan(const Context& context, const SampleMesh& mesh,
                             VoxelizeReport& report) {
  Box3 box;
  for (const Vec3& p : mesh.points)
    box.add(p);
  const Vec3 size = box.size() + Vec3{16, 16, 16};
  require_memory(context, 8.5 * (size.x * size.y + size.y * size.z + size.z * size.x),
                 "the three pairs of depth buffers");
  std::array<DepthPair, 3> pairs;
  for (std::size_t axis = 0; axis < 3; ++axis)
    pairs[axis] = draw(context, mesh, views[axis], box, report);
  const std::array<DepthTiles, 3> tiles{DepthTiles(pairs[0]), DepthTiles(pairs[1]),
                                        DepthTiles(pairs[2])};

  const Range i = pairs[2].u, j = pairs[2].v, k = pairs[0].v;
  MemoryAccount memory(context, "the voxelized mesh");
  std::vector<Slab<BitLeaf>> slabs(static_cast<std::size_t>((i.end - i.begin) / volume::leaf_dim));
  parallel_blocks(context, slabs.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t s = begin; s < end; ++s) {
      Slab<BitLeaf>& slab = slabs[s];
      slab.memory = MemoryShare(memory);
      const std::int32_t row = i.begin + static_cast<std::int32_t>(s) * volume::leaf_dim;
      const auto tile_at = [&](std::size_t axis, std::int32_t u, std::int32_t v) {
        const DepthPair& pair = pairs[axis];
        return tiles[axis].tiles[static_cast<std::size_t>((u - pair.u.begin) / volume::leaf_dim *
                                                              tiles[axis].columns +
                                                          (v - pair.v.begin) / volume::leaf_dim)];
      };
      for (std::int32_t b = j.begin; b < j.end; b += volume::leaf_dim) {
        const DepthTiles::Tile along_k = tile_at(2, row, b);
        if (along_k.near_any >= along_k.far_any)
          continue;
        const std::int32_t last = std::min(k.end, along_k.far_any);
        for (std::int32_t c = std::max(k.begin, along_k.near_any & ~7); c < last;
             c += volume::leaf_dim) {
          const std::array<DepthTiles::Tile, 3> three{tile_at(0, b, c), tile_at(1, row, c),
                                                      along_k};
          const Int3 origin{row, b, c};
          bool full = true, empty = false;
          for (std::size_t axis = 0; axis < 3; ++axis) {
            full = full && three[axis].near_all <= origin[axis] &&
                   origin[axis] + volume::leaf_dim <= three[axis].far_all;
            empty = empty || three[axis].near_any >= origin[axis] + volume::leaf_dim ||
                    three[axis].far_any <= origin[axis];
          }
          if (empty)
            continue;
          const LeafKey key{b / volume::leaf_dim, c / volume::leaf_dim};
          const BitLeaf leaf = full ? BitLeaf{} : leaf_between(pairs, origin);
          if (full || leaf.is_constant(BitLeaf::full(1))) {
            if (!slab.runs.empty() && slab.runs.back().j == key.j &&
                slab.runs.back().k_end == key.k)
              ++slab.runs.back().k_end;
            else
              slab.runs.push_back({key.j, key.k, key.k + 1});
          } else if (!leaf.is_constant(0)) {
            slab.keys.push_back(key);
            slab.leaves.push_back(leaf);
          }
        }
      }
    }
  });
  return join_slabs(slabs, i.begin / volume::leaf_dim);
}

} // namespace gewebe::voxelization
