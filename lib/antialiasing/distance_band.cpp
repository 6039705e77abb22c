#include "antialiasing/distance_band_internal.h"
#include "base/error.h"
#include "base/parallel.h"
#include "voxelization/ray_crossings.h"
#include "voxelization/voxelize_input.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <utility>

namespace gewebe::antialiasing {
namespace {

/// Nearest triangles of a leaf's voxels.
struct BandLeaf {
  std::array<double, volume::leaf_voxels> squared;
  std::array<std::uint32_t, volume::leaf_voxels> triangle;
  // By the winding rule alone:
  std::array<std::uint64_t, 8> several{}; ///< bits: triangles of several patches are near
  std::vector<std::uint32_t> near;        ///< triangles that are near voxels of the leaf
};

/// Leaves of the band of one slab, in ascending order.
struct BandLeaves {
  std::map<LeafPlace, std::unique_ptr<BandLeaf>> at;
  MemoryShare memory;

  BandLeaf& make(LeafPlace place) {
    memory.add(sizeof(BandLeaf) + 96); // a node of the map
    std::unique_ptr<BandLeaf>& slot = at[place];
    slot = std::make_unique<BandLeaf>();
    slot->squared.fill(HUGE_VAL);
    return *slot;
  }
};

/// Offers triangle n to all voxels of the slab nearer to it than `reach`. \param faces  null unless
/// the rule is that of the winding number
void offer(const SlabbedMesh& mesh, const OrientedFaces* faces, std::uint32_t n,
           std::int32_t first_row, double reach, BandLeaves& leaves) {
  const Triangle& t = mesh.triangles[n];
  const Vec3 &a = mesh.points[t[0]], &b = mesh.points[t[1]], &c = mesh.points[t[2]];
  Int3 low{}, high{}; // of voxels, whose centres are at the index and a half
  for (int axis = 0; axis < 3; ++axis) {
    const auto [min, max] = std::minmax({a[axis], b[axis], c[axis]});
    low[static_cast<std::size_t>(axis)] = voxelization::ceil_int(min - reach - 0.5);
    high[static_cast<std::size_t>(axis)] = voxelization::floor_int(max + reach - 0.5);
  }
  low[0] = std::max(low[0], first_row);
  high[0] = std::min(high[0], first_row + volume::leaf_dim - 1);
  Vec3 normal = cross(b - a, c - a);
  const double length = norm(normal);
  // A needle's normal may be rounding alone: then no point is passed over by its plane.
  const bool flat = length > 1e-9 * norm(b - a) * norm(c - a);
  normal = flat ? normal / length : Vec3{};
  const double limit = reach * reach;
  for (std::int32_t j_leaf = low[1] >> 3; j_leaf <= high[1] >> 3; ++j_leaf)
    for (std::int32_t k_leaf = low[2] >> 3; k_leaf <= high[2] >> 3; ++k_leaf) {
      BandLeaf* leaf = nullptr;
      const auto other_patch = [&](std::size_t v) {
        return faces != nullptr && faces->patch[n] != OrientedFaces::none &&
               leaf->squared[v] < HUGE_VAL && faces->patch[leaf->triangle[v]] != faces->patch[n] &&
               (leaf->several[v >> 6] >> (v & 63) & 1) == 0;
      };
      const std::int32_t j_end = std::min(high[1], 8 * j_leaf + 7);
      const std::int32_t k_end = std::min(high[2], 8 * k_leaf + 7);
      for (std::int32_t i = low[0]; i <= high[0]; ++i)
        for (std::int32_t j = std::max(low[1], 8 * j_leaf); j <= j_end; ++j)
          for (std::int32_t k = std::max(low[2], 8 * k_leaf); k <= k_end; ++k) {
            const Vec3 p{i + 0.5, j + 0.5, k + 0.5};
            const double to_plane = dot(normal, p - a); // no point of the triangle is nearer
            if (!(to_plane * to_plane < limit))
              continue;
            const auto v = static_cast<std::size_t>(volume::leaf_offset({i, j, k}));
            if (leaf != nullptr && to_plane * to_plane > leaf->squared[v] * (1 + 1e-9) &&
                !other_patch(v))
              continue;
            const Vec3 offset = p - mesh::nearest_on_triangle(p, a, b, c).point;
            const double squared = dot(offset, offset);
            if (!(squared < limit))
              continue;
            if (leaf == nullptr) {
              const LeafPlace place{j_leaf, k_leaf};
              const auto found = leaves.at.find(place);
              leaf = found != leaves.at.end() ? found->second.get() : &leaves.make(place);
              if (faces != nullptr)
                leaf->near.push_back(n);
            }
            if (other_patch(v))
              leaf->several[v >> 6] |= std::uint64_t{1} << (v & 63);
            if (squared < leaf->squared[v]) {
              leaf->squared[v] = squared;
              leaf->triangle[v] = n;
            }
          }
    }
}

/// Bits of the leaves of a scan, mixed or not.
class InsideBits {
public:
  explicit InsideBits(const voxelization::InsideScan& scan) : scan_(scan) {
    for (const volume::TileView& tile : scan.tiles)
      (tile.dim == volume::leaf_dim ? small_ : large_).push_back(tile.origin);
    std::ranges::sort(small_);
    std::ranges::sort(large_);
  }
  std::array<std::uint64_t, 8> of(const Int3& origin) const {
    const auto at = std::ranges::lower_bound(scan_.origins, origin);
    if (at != scan_.origins.end() && *at == origin)
      return scan_.bits[static_cast<std::size_t>(at - scan_.origins.begin())];
    std::array<std::uint64_t, 8> bits{};
    if (std::ranges::binary_search(small_, origin) ||
        std::ranges::binary_search(large_,
                                   Int3{origin[0] & ~127, origin[1] & ~127, origin[2] & ~127}))
      bits.fill(~std::uint64_t{0});
    return bits;
  }

private:
  const voxelization::InsideScan& scan_;
  std::vector<Int3> small_, large_;
};

/// Winding numbers of the voxels of a scan by the winding rule.
class Windings {
public:
  explicit Windings(const voxelization::InsideScan& scan) : runs_(scan.windings) {}
  /// Of a leaf where others than 0 and 1 occur; null elsewhere.
  const voxelization::WindingRun* of(const Int3& origin) const {
    const auto next =
        std::ranges::upper_bound(runs_, origin, {}, &voxelization::WindingRun::origin);
    if (next == runs_.begin())
      return nullptr;
    const voxelization::WindingRun& run = *(next - 1);
    const bool within =
        run.origin[0] == origin[0] && run.origin[1] == origin[1] && origin[2] < run.k_end;
    return within ? &run : nullptr;
  }

private:
  std::span<const voxelization::WindingRun> runs_;
};

/// What the values of all voxels are made from.
struct RampSource {
  const SlabbedMesh& mesh;
  const OrientedFaces* faces; ///< null unless the rule is that of the winding number
  double half_width;
  const RampDistances& distances;

  /// Distance of voxel v at p, inside or not; winding is not 0 inside.
  double distance(const BandLeaf& band, std::size_t v, const Vec3& p, int winding) const;
};

double RampSource::distance(const BandLeaf& band, std::size_t v, const Vec3& p, int winding) const {
  const std::uint32_t nearest = band.triangle[v];
  // Outside, the face nearest to p always belongs to the boundary: no other is in between.
  if (faces == nullptr || winding == 0)
    return distances.to_triangle(mesh, p, nearest);
  const auto is_behind = [&](const Triangle& t) {
    const Vec3 &a = mesh.points[t[0]], &b = mesh.points[t[1]], &c = mesh.points[t[2]];
    return dot(cross(b - a, c - a), p - a) < 0;
  };
  if (winding == 1 && (band.several[v >> 6] >> (v & 63) & 1) == 0 &&
      faces->patch[nearest] != OrientedFaces::none && is_behind(faces->triangles[nearest]))
    return distances.to_triangle(mesh, p, nearest);
  const std::optional<BoundaryPoint> found =
      nearest_boundary(mesh.points, *faces, p, winding, band.near, half_width);
  if (!found)
    return half_width;
  return found->other == OrientedFaces::none ? distances.to_triangle(mesh, p, found->triangle)
                                             : distances.to_curve(mesh, p, *found);
}

struct RampLeaf {
  Int3 origin{};
  std::array<float, volume::leaf_voxels> values{};
  std::array<std::uint64_t, 8> active{};
};
struct RampSlab {
  MemoryShare memory;
  std::vector<RampLeaf> leaves;
  std::uint64_t band_voxels = 0;
};

RampLeaf ramp_leaf(const RampSource& source, const BandLeaf* band, const Int3& origin,
                   const std::array<std::uint64_t, 8>& inside,
                   const voxelization::WindingRun* windings, std::uint64_t& band_voxels) {
  RampLeaf leaf;
  leaf.origin = origin;
  for (std::size_t v = 0; v < volume::leaf_voxels; ++v) {
    const bool in = (inside[v >> 6] >> (v & 63) & 1) != 0;
    double value = in ? 1 : 0;
    if (band != nullptr && band->squared[v] < HUGE_VAL) {
      const auto n = static_cast<std::int32_t>(v);
      const Vec3 p{origin[0] + (n >> 6) + 0.5, origin[1] + (n >> 3 & 7) + 0.5,
                   origin[2] + (n & 7) + 0.5};
      const int winding = !in ? 0 : windings != nullptr ? windings->winding[v] : 1;
      const double ramp =
          std::fmin(0.5, source.distance(*band, v, p, winding) / (2 * source.half_width));
      value = in ? 0.5 + ramp : 0.5 - ramp;
      ++band_voxels;
    }
    leaf.values[v] = static_cast<float>(value);
    leaf.active[v >> 6] |= static_cast<std::uint64_t>(leaf.values[v] > 0) << (v & 63);
  }
  return leaf;
}

/// Adds the tiles of the scan less the leaves of `taken` (ascending); returns how many leaves that
/// are.
std::uint64_t add_tiles(const voxelization::InsideScan& scan, const std::vector<Int3>& taken,
                        volume::GridBuilder& builder) {
  const auto node_of = [](const Int3& o) { return Int3{o[0] & ~127, o[1] & ~127, o[2] & ~127}; };
  std::vector<Int3> nodes;
  for (const Int3& origin : taken)
    nodes.push_back(node_of(origin));
  std::ranges::sort(nodes);
  std::uint64_t added = 0;
  const auto add_small = [&](const Int3& origin) {
    if (!std::ranges::binary_search(taken, origin)) {
      builder.add_tile({origin, volume::leaf_dim, 1.0f, true});
      ++added;
    }
  };
  for (const volume::TileView& tile : scan.tiles) {
    if (tile.dim == volume::leaf_dim) {
      add_small(tile.origin);
    } else if (!std::ranges::binary_search(nodes, tile.origin)) {
      builder.add_tile(tile);
      added += 4096;
    } else {
      for (std::int32_t i = 0; i < tile.dim; i += volume::leaf_dim)
        for (std::int32_t j = 0; j < tile.dim; j += volume::leaf_dim)
          for (std::int32_t k = 0; k < tile.dim; k += volume::leaf_dim)
            add_small({tile.origin[0] + i, tile.origin[1] + j, tile.origin[2] + k});
    }
  }
  return added;
}

} // namespace

volume::Grid ramp_density(const Context& context, const TriangleMesh& mesh,
                          const volume::GridTransform& transform,
                          const voxelization::VoxelizeOptions& options, double half_width,
                          const std::function<RampDistances(const SlabbedMesh&)>& prepare,
                          CoverageReport& report) {
  report = {};
  const bool winding = options.rule == voxelization::VoxelRule::winding;
  voxelization::VoxelizeOptions scanned = options;
  scanned.keep_windings = winding;
  const voxelization::InsideScan scan =
      voxelization::scan_inside(context, mesh, transform, scanned, &report.mesh);
  // The band is wider than the surface's leaves by half_width on both sides.
  require_memory(context, 3 * coverage_bytes(mesh, transform), "the voxelized mesh");
  SlabbedMesh slabbed;
  slabbed.points = coverage_points(mesh, transform);
  slabbed.triangles = mesh.triangles;
  voxelization::VoxelizeReport holes;
  const bool refused = options.rule == voxelization::VoxelRule::parity ||
                       options.on_open != voxelization::OpenMesh::refuse;
  voxelization::close_or_refuse(context, mesh, transform,
                                refused ? options.on_open : voxelization::OpenMesh::skip,
                                slabbed.points, slabbed.triangles, holes);
  sort_into_slabs(context, slabbed, half_width);
  const RampDistances distances = prepare(slabbed);
  OrientedFaces faces;
  if (winding) {
    const bool closed = slabbed.triangles.size() > mesh.triangles.size();
    faces = orient_faces(slabbed.points, slabbed.triangles,
                         {mesh.part.data(), closed ? 0 : mesh.part.size()});
  }
  const RampSource source{slabbed, winding ? &faces : nullptr, half_width, distances};

  const InsideBits bits(scan);
  const Windings windings(scan);
  MemoryAccount memory(context, "the voxelized mesh");
  std::vector<RampSlab> slabs(slabbed.slab_begin.size() - 1);
  parallel_blocks(context, slabs.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t s = begin; s < end; ++s) {
      const std::int32_t row =
          (slabbed.first_slab + static_cast<std::int32_t>(s)) * volume::leaf_dim;
      BandLeaves band;
      band.memory = MemoryShare(memory);
      for (std::size_t n = slabbed.slab_begin[s]; n < slabbed.slab_begin[s + 1]; ++n)
        offer(slabbed, source.faces, slabbed.members[n], row, half_width, band);
      // Mixed leaves lie in the band; only rays that were left empty can make others.
      for (auto at = std::ranges::lower_bound(scan.origins, Int3{row, INT32_MIN, INT32_MIN});
           at != scan.origins.end() && (*at)[0] == row; ++at)
        band.at.try_emplace({(*at)[1] >> 3, (*at)[2] >> 3});
      slabs[s].memory = MemoryShare(memory);
      slabs[s].memory.add(band.at.size() * sizeof(RampLeaf));
      slabs[s].leaves.reserve(band.at.size());
      for (const auto& [place, leaf] : band.at) {
        const Int3 origin{row, 8 * place.j, 8 * place.k};
        slabs[s].leaves.push_back(ramp_leaf(source, leaf.get(), origin, bits.of(origin),
                                            windings.of(origin), slabs[s].band_voxels));
      }
    }
  });

  volume::GridInfo info;
  info.transform = transform;
  volume::GridBuilder builder(info);
  std::vector<Int3> origins;
  std::vector<const RampLeaf*> values;
  double sum = 0;
  for (const RampSlab& slab : slabs) {
    report.surface_voxels += slab.band_voxels;
    for (const RampLeaf& leaf : slab.leaves) {
      origins.push_back(leaf.origin);
      values.push_back(&leaf);
      double of_leaf = 0;
      for (const float value : leaf.values)
        of_leaf += static_cast<double>(value);
      sum += of_leaf;
    }
  }
  sum += static_cast<double>(add_tiles(scan, origins, builder)) * volume::leaf_voxels;
  report.volume = sum * std::fabs(transform.determinant());
  const std::vector<volume::LeafRef> leaves = builder.add_leaves(context, origins);
  parallel_blocks(context, leaves.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      std::ranges::copy(values[n]->values, leaves[n].values);
      std::ranges::copy(values[n]->active, leaves[n].active);
    }
  });
  return builder.finish(false);
}

} // namespace gewebe::antialiasing
