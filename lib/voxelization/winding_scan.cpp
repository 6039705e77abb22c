#include "voxelization/winding_scan_internal.h"
// Based on: A. Jacobson, L. Kavan, O. Sorkine-Hornung, Robust Inside-Outside Segmentation using
// Generalized Winding Numbers, 2013.

#include "base/error.h"
#include "base/parallel.h"
#include "geometry/exact_predicates.h"
#include "repair/oriented_surface.h"
#include "voxelization/inside_scan_internal.h"
#include "voxelization/solid_angle_tree_internal.h"

namespace gewebe::voxelization {
namespace {

constexpr double diagonal = 1.7320508075688774;

/// Leaves in which the cones' winding number may reach 1/2, ascending, in units of leaves.
std::vector<Int3> leaves_near(const Context& context, const SolidAngleTree& cones) {
  std::vector<Int3> near;
  Box3 box = cones.box();
  if (box.empty())
    return near;
  const double reach = cones.reach();
  Int3 low{};
  std::int32_t side = 1;
  for (int a = 0; a < 3; ++a) {
    low[static_cast<std::size_t>(a)] =
        static_cast<std::int32_t>(std::floor((box.min[a] - reach) / volume::leaf_dim));
    while (low[static_cast<std::size_t>(a)] + side < (box.max[a] + reach) / volume::leaf_dim + 1)
      side *= 2;
  }
  struct Cube {
    Int3 low;
    std::int32_t side;
  };
  std::vector<Cube> cubes{{low, side}};
  while (!cubes.empty()) {
    const Cube cube = cubes.back();
    cubes.pop_back();
    // Half a cube from the middle of the first to that of the last voxel.
    const double half = (volume::leaf_dim * static_cast<double>(cube.side) - 1) / 2;
    const Vec3 middle =
        Vec3{1.0 * cube.low[0], 1.0 * cube.low[1], 1.0 * cube.low[2]} * volume::leaf_dim +
        Vec3{half, half, half};
    const WindingSum sum = cones.within(middle, half * diagonal);
    if (std::fabs(sum.value) + sum.error < 0.5)
      continue;
    if (cube.side == 1) {
      near.push_back(cube.low);
      if (near.size() % 65536 == 0)
        require_memory(context, 4096.0 * static_cast<double>(near.size()),
                       "the leaves near the holes of the mesh");
      continue;
    }
    const std::int32_t next = cube.side / 2;
    for (int c = 0; c < 8; ++c)
      cubes.push_back(
          {{cube.low[0] + ((c & 4) != 0 ? next : 0), cube.low[1] + ((c & 2) != 0 ? next : 0),
            cube.low[2] + ((c & 1) != 0 ? next : 0)},
           next});
  }
  std::sort(near.begin(), near.end());
  return near;
}

/// Is |whole - w(cones)| > 1/2 at p?
bool winds(const SolidAngleTree& cones, const Vec3& p, std::int32_t whole) {
  if (const WindingSum sum = cones.quick_at(p);
      std::fabs(std::fabs(whole - sum.value) - 0.5) > sum.error)
    return std::fabs(whole - sum.value) > 0.5;
  return std::fabs(whole - cones.exact_at(p)) > 0.5;
}

struct Counters {
  std::uint64_t crossings = 0, exact_tests = 0, summed = 0;
};

/// Winding numbers of a leaf to bits.
BitLeaf bits_of(const CountLeaf& leaf) {
  BitLeaf bits;
  for (std::size_t v = 0; v < volume::leaf_voxels; ++v)
    bits.word[v / 64] |= std::uint64_t{leaf.count[v] != 0} << (v % 64);
  return bits;
}

/// Decides the samples of a cube of a leaf, together where the cones' winding number varies little
/// enough in it, else in eight parts down to single samples.
void decide(const SolidAngleTree& cones, const CountLeaf& leaf, const Int3& origin, const Int3& low,
            std::int32_t side, BitLeaf& bits, std::uint64_t& summed) {
  const double half = (side - 1) / 2.0;
  const Vec3 middle{origin[0] + low[0] + half, origin[1] + low[1] + half,
                    origin[2] + low[2] + half};
  const auto place = [&](std::int32_t n) { // the samples of the cube
    return static_cast<std::size_t>(volume::leaf_offset(
        {low[0] + n / (side * side), low[1] + n / side % side, low[2] + n % side}));
  };
  const auto whole = [&](std::size_t at) { return static_cast<std::int32_t>(leaf.count[at]); };
  const auto set = [&](std::size_t at, bool inside) {
    bits.word[at / 64] |= std::uint64_t{inside} << (at % 64);
  };
  if (side == 1) {
    set(place(0), winds(cones, middle, whole(place(0))));
    ++summed;
    return;
  }
  const WindingSum sum = cones.within(middle, half * diagonal);
  bool clear = true;
  for (std::int32_t n = 0; clear && n < side * side * side; ++n)
    clear = std::fabs(std::fabs(whole(place(n)) - sum.value) - 0.5) > sum.error;
  if (clear) {
    for (std::int32_t n = 0; n < side * side * side; ++n)
      set(place(n), std::fabs(whole(place(n)) - sum.value) > 0.5);
    return;
  }
  const std::int32_t next = side / 2;
  for (int c = 0; c < 8; ++c)
    decide(cones, leaf, origin,
           {low[0] + ((c & 4) != 0 ? next : 0), low[1] + ((c & 2) != 0 ? next : 0),
            low[2] + ((c & 1) != 0 ? next : 0)},
           next, bits, summed);
}

/// Keeps the winding numbers of leaves from `from` up to leaf k_end, if others than 0 and 1 occur
/// inside.
void keep(const CountLeaf& leaf, const BitLeaf& bits, std::int32_t slab_i, LeafKey from,
          std::int32_t k_end, std::vector<WindingRun>& runs) {
  WindingRun run;
  bool others = false;
  for (std::size_t v = 0; v < volume::leaf_voxels; ++v) {
    if ((bits.word[v / 64] >> (v % 64) & 1) == 0)
      continue;
    const auto whole = static_cast<std::int32_t>(leaf.count[v]);
    run.winding[v] = static_cast<std::int16_t>(whole == 0 ? 1 : std::clamp(whole, -32767, 32767));
    others |= run.winding[v] != 1;
  }
  if (!others)
    return;
  run.origin = {slab_i * volume::leaf_dim, from.j * volume::leaf_dim, from.k * volume::leaf_dim};
  run.k_end = k_end * volume::leaf_dim;
  runs.push_back(run);
}

/// Sums the flips of a slab up along k. `near` are its leaves near the cones. \param runs  if not
/// null, gets the winding numbers
Slab<BitLeaf> integrate(LeafMap<CountLeaf>& map, std::int32_t slab_i, std::span<const Int3> near,
                        const SolidAngleTree& cones, std::vector<WindingRun>* runs,
                        Counters& counters, MemoryAccount& memory) {
  for (const Int3& leaf : near)
    (void)map.at({leaf[1], leaf[2]});
  std::vector<std::uint32_t> order(map.keys.size());
  for (std::size_t n = 0; n < order.size(); ++n)
    order[n] = static_cast<std::uint32_t>(n);
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return map.keys[a] < map.keys[b]; });
  Slab<BitLeaf> slab;
  slab.memory = MemoryShare(memory);
  const std::uint64_t full = BitLeaf::full(1);
  CountLeaf::Carry carry{};
  for (std::size_t n = 0; n < order.size(); ++n) {
    const LeafKey key = map.keys[order[n]];
    const LeafKey last = n > 0 ? map.keys[order[n - 1]] : LeafKey{key.j - 1, 0};
    if (last.j == key.j && last.k + 1 < key.k) {
      CountLeaf gap;
      gap.integrate(carry);
      slab.put(bits_of(gap), {key.j, last.k + 1}, key.k, full);
      if (runs != nullptr)
        keep(gap, bits_of(gap), slab_i, {key.j, last.k + 1}, key.k, *runs);
    }
    CountLeaf& leaf = map.leaves[order[n]];
    leaf.integrate(carry); // 0 again past the last leaf: every ray leaves as often as it enters
    BitLeaf bits;
    if (std::binary_search(near.begin(), near.end(), Int3{slab_i, key.j, key.k}))
      decide(cones, leaf,
             {slab_i * volume::leaf_dim, key.j * volume::leaf_dim, key.k * volume::leaf_dim},
             {0, 0, 0}, volume::leaf_dim, bits, counters.summed);
    else
      bits = bits_of(leaf);
    slab.put(bits, key, key.k + 1, full);
    if (runs != nullptr)
      keep(leaf, bits, slab_i, key, key.k + 1, *runs);
  }
  return slab;
}

} // namespace

InsideScan winding_scan(const Context& context, std::vector<Vec3>& points,
                        std::span<const Triangle> triangles, std::span<const std::int32_t> part,
                        bool keep_windings, VoxelizeReport& report) {
  const repair::OrientedSurface surface = repair::orient_surface(points, triangles, part);
  report.parts = surface.parts;
  report.parts_turned = surface.parts_turned;
  report.triangles_turned = surface.triangles_turned;
  report.triangles_duplicate = surface.triangles_duplicate;
  const repair::ClosingCones caps = repair::closing_cones(points, surface.triangles);
  for (Vec3& p : points)
    p = {predicate_coordinate(p.x), predicate_coordinate(p.y), predicate_coordinate(p.z)};
  const SolidAngleTree cones(points, caps.cones, caps.pieces, context.cpu);
  const std::vector<Int3> near = leaves_near(context, cones);

  // Those that a ray upward enters through, and those that it leaves through.
  std::array<std::vector<Triangle>, 2> facing;
  for (const std::span<const Triangle> list :
       {std::span<const Triangle>(surface.triangles), std::span<const Triangle>(caps.cones)})
    for (const Triangle& t : list) {
      const Vec3 &a = points[t[0]], &b = points[t[1]], &c = points[t[2]];
      const int normal_z = turn_sign(a.x, a.y, b.x, b.y, c.x, c.y, report.exact_tests);
      if (normal_z == 0)
        ++report.triangles_skipped; // parallel to the rays
      else
        facing[normal_z < 0 ? 0 : 1].push_back(t);
    }
  std::array<SampleMesh, 2> meshes;
  std::array<Chunks, 2> chunks;
  Range slabs_range{INT32_MAX, INT32_MIN};
  const auto include = [&](std::int32_t begin, std::int32_t end) {
    slabs_range = {std::min(slabs_range.begin, begin), std::max(slabs_range.end, end)};
  };
  for (std::size_t way = 0; way < 2; ++way) {
    meshes[way] = {1, points, facing[way], context.cpu};
    chunks[way] = sort_triangles(context, meshes[way]);
    for (const Block& block : chunks[way].blocks)
      report.triangles_skipped += block.skipped;
    if (chunks[way].count() > 0)
      include(chunks[way].range.begin * chunks[way].slabs_each,
              chunks[way].range.end * chunks[way].slabs_each);
  }
  if (!near.empty())
    include(near.front()[0], near.back()[0] + 1);
  if (slabs_range.begin >= slabs_range.end)
    return {};

  // The points are the same, so the chunks are.
  const std::int32_t each = chunks[0].slabs_each;
  const Range range{
      slabs_range.begin >= 0 ? slabs_range.begin / each : -((-slabs_range.begin + each - 1) / each),
      slabs_range.end > 0 ? (slabs_range.end + each - 1) / each : -(-slabs_range.end / each)};
  const auto count = static_cast<std::size_t>(range.end - range.begin);
  MemoryAccount memory(context, "the voxelized mesh");
  std::vector<Slab<BitLeaf>> slabs(count * static_cast<std::size_t>(each));
  std::vector<std::vector<WindingRun>> windings(slabs.size());
  std::vector<Counters> counters(count);
  parallel_blocks(context, count, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      std::array<LeafMap<CountLeaf>, 4> maps = leaf_maps<CountLeaf>(memory);
      const std::int32_t chunk = range.begin + static_cast<std::int32_t>(n);
      const std::int32_t first = chunk * each * volume::leaf_dim;
      for (std::size_t way = 0; way < 2; ++way)
        for_each_crossing(
            meshes[way], chunks[way], chunk, {first, first + each * volume::leaf_dim},
            TieOrder::xyz, counters[n].exact_tests,
            [&](std::int32_t i, std::int32_t j, std::int32_t k) {
              maps[static_cast<std::size_t>((i - first) >> 3)]
                  .at({j >> 3, k >> 3})
                  .count[static_cast<std::size_t>((i & 7) << 6 | (j & 7) << 3 | (k & 7))] +=
                  way == 0 ? 1u : ~0u;
              ++counters[n].crossings;
            });
      for (std::int32_t s = 0; s < each; ++s) {
        const std::int32_t slab_i = chunk * each + s;
        const auto of_slab = [&](std::int32_t i) {
          return std::lower_bound(
              near.begin(), near.end(), i,
              [](const Int3& leaf, std::int32_t slab) { return leaf[0] < slab; });
        };
        const std::size_t at = n * static_cast<std::size_t>(each) + static_cast<std::size_t>(s);
        slabs[at] = integrate(maps[static_cast<std::size_t>(s)], slab_i,
                              {of_slab(slab_i), of_slab(slab_i + 1)}, cones,
                              keep_windings ? &windings[at] : nullptr, counters[n], memory);
      }
    }
  });
  for (const Counters& c : counters) {
    report.crossings += c.crossings;
    report.exact_tests += c.exact_tests;
    report.samples_summed += c.summed;
  }
  InsideScan scan = join_slabs(slabs, range.begin * each);
  for (const std::vector<WindingRun>& runs : windings)
    scan.windings.insert(scan.windings.end(), runs.begin(), runs.end());
  return scan;
}

} // namespace gewebe::voxelization
