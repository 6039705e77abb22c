#include "volume/voxelize.h"
// Based on: E.-A. Karabassi, G. Papaioannou, T. Theoharis, A Fast Depth-Buffer-Based Voxelization
// Algorithm, 1999 (the report's method, of which the rays along one axis remain); the parity rule
// after F. S. Nooruddin, G. Turk, Simplification and Repair of Polygonal Models Using Volumetric
// Techniques, 2003.

#include "base/error.h"
#include "base/parallel.h"
#include "volume/exact_predicates.h"
#include "volume/mesh_border.h"
#include "volume/ray_crossings_internal.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <string>

namespace gewebe {
namespace {

constexpr double index_limit = 1 << 30;

// ---- leaves under construction
//
// A leaf first holds flips:
// where along k the state of a column changes. `integrate` sums them up along k, starting from what
// the column carries over from the leaf before.

/// One sample per voxel: bit n of word w is offset 64 w + n, a byte is a column.
struct BitLeaf {
  using Carry = std::array<std::uint64_t, 8>; ///< bytes 0x00 or 0xff
  std::array<std::uint64_t, 8> word{};

  void integrate(Carry& carry) {
    for (std::size_t w = 0; w < 8; ++w) {
      std::uint64_t x = word[w];
      x ^= (x << 1) & 0xfefefefefefefefeu;
      x ^= (x << 2) & 0xfcfcfcfcfcfcfcfcu;
      x ^= (x << 4) & 0xf0f0f0f0f0f0f0f0u;
      x ^= carry[w];
      word[w] = x;
      carry[w] = (x >> 7 & 0x0101010101010101u) * 0xff;
    }
  }
  bool is_constant(std::uint64_t value) const {
    return std::all_of(word.begin(), word.end(), [&](std::uint64_t w) { return w == value; });
  }
  static std::uint64_t full(int) { return ~std::uint64_t{0}; }
};

/// samples³ samples per voxel: differences of the counts along k, modulo 2^32.
struct CountLeaf {
  using Carry = std::array<std::uint32_t, 64>;
  std::array<std::uint32_t, leaf_voxels> count{};

  void integrate(Carry& carry) {
    for (std::size_t column = 0; column < 64; ++column)
      for (std::size_t k = 0; k < 8; ++k)
        count[8 * column + k] = carry[column] += count[8 * column + k];
  }
  bool is_constant(std::uint64_t value) const {
    return std::all_of(count.begin(), count.end(), [&](std::uint32_t c) { return c == value; });
  }
  static std::uint64_t full(int samples) {
    return static_cast<std::uint64_t>(samples) * static_cast<std::uint64_t>(samples) *
           static_cast<std::uint64_t>(samples);
  }
};

/// Place of a leaf in its slab, in units of leaves; ordered like the pair (j, k).
struct LeafKey {
  std::int32_t j, k;
  auto operator<=>(const LeafKey&) const = default;
};

/// The leaves of a slab by place: an open-addressing hash table that remembers the last answer.
template <class Leaf>
class LeafMap {
public:
  LeafMap() : slots_(64, empty) {}

  Leaf& at(LeafKey key) {
    if (key == last_key_ && last_ != empty)
      return leaves[last_];
    std::size_t slot = find(key);
    if (slots_[slot] == empty) {
      if (2 * (keys.size() + 1) > slots_.size()) {
        grow();
        slot = find(key);
      }
      slots_[slot] = static_cast<std::uint32_t>(keys.size());
      keys.push_back(key);
      leaves.emplace_back();
    }
    last_key_ = key;
    last_ = slots_[slot];
    return leaves[last_];
  }

  std::vector<LeafKey> keys;
  std::vector<Leaf> leaves;

private:
  static constexpr std::uint32_t empty = UINT32_MAX;

  std::size_t find(LeafKey key) const {
    const std::uint64_t word = static_cast<std::uint64_t>(static_cast<std::uint32_t>(key.j)) << 32 |
                               static_cast<std::uint32_t>(key.k);
    const std::size_t mask = slots_.size() - 1;
    std::size_t slot = static_cast<std::size_t>(word * 0x9e3779b97f4a7c15u >> 20) & mask;
    while (slots_[slot] != empty && keys[slots_[slot]] != key)
      slot = (slot + 1) & mask;
    return slot;
  }
  void grow() {
    slots_.assign(2 * slots_.size(), empty);
    for (std::size_t n = 0; n < keys.size(); ++n)
      slots_[find(keys[n])] = static_cast<std::uint32_t>(n);
  }

  std::vector<std::uint32_t> slots_;
  LeafKey last_key_{};
  std::uint32_t last_ = empty;
};

/// Leaves [k_begin, k_end) of a column of leaves that are wholly inside.
struct FullRun {
  std::int32_t j, k_begin, k_end;
};

/// Result of one slab: 8 voxels thick along i.
template <class Leaf>
struct Slab {
  std::vector<LeafKey> keys;
  std::vector<Leaf> leaves;
  std::vector<FullRun> runs;
  std::uint64_t crossings = 0, odd_rays = 0, exact_tests = 0;
};

// ---- one slab

/// Mesh in the index space of the samples, and the triangles of each slab.
struct Prepared {
  int samples = 1;
  std::vector<Vec3> points;
  std::vector<Triangle> triangles;
  std::int32_t first_slab = 0;
  std::vector<std::size_t> slab_begin; ///< per slab and one more: place in `members`
  std::vector<std::uint32_t> members;
};

template <class Visit>
void for_each_crossing(const Prepared& mesh, std::size_t slab, std::int32_t row_begin,
                       std::int32_t row_end, std::uint64_t& exact_tests, Visit&& visit) {
  for (std::size_t n = mesh.slab_begin[slab]; n < mesh.slab_begin[slab + 1]; ++n) {
    const Triangle& t = mesh.triangles[mesh.members[n]];
    cross_triangle(mesh.points[t[0]], mesh.points[t[1]], mesh.points[t[2]], row_begin, row_end,
                   exact_tests, visit);
  }
}

/// Sums flips to states, column of leaves by column of leaves, and fills the gaps between leaves.
template <class Leaf>
void integrate_slab(LeafMap<Leaf>& map, int samples, Slab<Leaf>& slab) {
  std::vector<std::uint32_t> order(map.keys.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return map.keys[a] < map.keys[b]; });
  const std::uint64_t full = Leaf::full(samples);
  const auto put = [&](const Leaf& leaf, LeafKey from, std::int32_t k_end) {
    if (leaf.is_constant(0))
      return;
    if (leaf.is_constant(full)) {
      if (!slab.runs.empty() && slab.runs.back().j == from.j && slab.runs.back().k_end == from.k)
        slab.runs.back().k_end = k_end;
      else
        slab.runs.push_back({from.j, from.k, k_end});
      return;
    }
    for (std::int32_t k = from.k; k < k_end; ++k) {
      slab.keys.push_back({from.j, k});
      slab.leaves.push_back(leaf);
    }
  };
  typename Leaf::Carry carry{};
  for (std::size_t n = 0; n < order.size(); ++n) {
    const LeafKey key = map.keys[order[n]];
    if (n > 0 && map.keys[order[n - 1]].j == key.j) {
      const std::int32_t next = map.keys[order[n - 1]].k + 1;
      if (next < key.k) {
        Leaf gap;
        gap.integrate(carry);
        put(gap, {key.j, next}, key.k);
      }
    } else {
      carry = {}; // rays of odd count are gone, so nothing is carried past the last leaf
    }
    Leaf& leaf = map.leaves[order[n]];
    leaf.integrate(carry);
    put(leaf, key, key.k + 1);
  }
}

/// Takes the flips of rays with an odd number of them out; returns how many rays that are.
std::uint64_t drop_odd_rays(LeafMap<BitLeaf>& map) {
  LeafMap<BitLeaf> columns; // XOR of all leaves of a column of leaves
  for (std::size_t n = 0; n < map.keys.size(); ++n) {
    BitLeaf& sum = columns.at({map.keys[n].j, 0});
    for (std::size_t w = 0; w < 8; ++w)
      sum.word[w] ^= map.leaves[n].word[w];
  }
  std::uint64_t odd = 0;
  for (BitLeaf& sum : columns.leaves)
    for (std::uint64_t& x : sum.word) {
      x ^= x >> 4;
      x ^= x >> 2;
      x ^= x >> 1;
      x &= 0x0101010101010101u;
      odd += static_cast<std::uint64_t>(std::popcount(x));
      x *= 0xff;
    }
  if (odd == 0)
    return 0;
  for (std::size_t n = 0; n < map.keys.size(); ++n) {
    const BitLeaf& sum = columns.at({map.keys[n].j, 0});
    for (std::size_t w = 0; w < 8; ++w)
      map.leaves[n].word[w] &= ~sum.word[w];
  }
  return odd;
}

Slab<BitLeaf> scan_slab_bits(const Prepared& mesh, std::size_t slab) {
  Slab<BitLeaf> result;
  LeafMap<BitLeaf> map;
  const std::int32_t row = (mesh.first_slab + static_cast<std::int32_t>(slab)) * leaf_dim;
  for_each_crossing(
      mesh, slab, row, row + leaf_dim, result.exact_tests,
      [&](std::int32_t i, std::int32_t j, std::int32_t k) {
        const int bit = (j & 7) * 8 + (k & 7);
        map.at({j >> 3, k >> 3}).word[static_cast<std::size_t>(i & 7)] ^= std::uint64_t{1} << bit;
        ++result.crossings;
      });
  result.odd_rays = drop_odd_rays(map);
  integrate_slab(map, 1, result);
  return result;
}

std::int32_t floor_divide(std::int32_t n, std::int32_t by) {
  const std::int32_t quotient = n / by;
  return quotient - (n % by < 0 ? 1 : 0);
}

/// Coarse voxel of fine sample f, rounding down, and the sample's place in it.
struct Place {
  std::int32_t voxel, rest;
};
Place place_of(std::int32_t fine, std::int32_t samples) {
  const std::int32_t voxel = floor_divide(fine, samples);
  return {voxel, fine - voxel * samples};
}

Slab<CountLeaf> scan_slab_counts(const Prepared& mesh, std::size_t slab) {
  constexpr std::int32_t rows_at_once = 64;
  Slab<CountLeaf> result;
  LeafMap<CountLeaf> map;
  const std::int32_t n = mesh.samples;
  const std::int32_t first = (mesh.first_slab + static_cast<std::int32_t>(slab)) * leaf_dim * n;
  const std::int32_t last = first + leaf_dim * n;
  std::vector<std::vector<std::uint64_t>> rows(rows_at_once); // crossings, j above k, both biased
  constexpr std::uint32_t bias = 0x80000000u;
  for (std::int32_t row = first; row < last; row += rows_at_once) {
    const std::int32_t row_end = std::min(last, row + rows_at_once);
    for_each_crossing(mesh, slab, row, row_end, result.exact_tests,
                      [&](std::int32_t i, std::int32_t j, std::int32_t k) {
                        rows[static_cast<std::size_t>(i - row)].push_back(
                            std::uint64_t{static_cast<std::uint32_t>(j) + bias} << 32 |
                            (static_cast<std::uint32_t>(k) + bias));
                      });
    for (std::int32_t i = row; i < row_end; ++i) {
      std::vector<std::uint64_t>& crossings = rows[static_cast<std::size_t>(i - row)];
      std::sort(crossings.begin(), crossings.end());
      result.crossings += crossings.size();
      const std::int32_t column_i = (place_of(i, n).voxel & 7) << 6;
      for (std::size_t c = 0; c < crossings.size();) {
        const std::uint64_t ray = crossings[c] >> 32;
        std::size_t end = c;
        while (end < crossings.size() && crossings[end] >> 32 == ray)
          ++end;
        if ((end - c) % 2 != 0) {
          ++result.odd_rays;
          c = end;
          continue;
        }
        const std::int32_t j =
            place_of(static_cast<std::int32_t>(static_cast<std::uint32_t>(ray) - bias), n).voxel;
        const std::int32_t column = column_i | (j & 7) << 3;
        for (std::uint32_t sign = 1; c < end; ++c, sign = 0u - sign) {
          const auto k = static_cast<std::int32_t>(static_cast<std::uint32_t>(crossings[c]) - bias);
          const Place place = place_of(k, n);
          const auto add = [&](std::int32_t voxel, std::int32_t samples) {
            map.at({j >> 3, voxel >> 3}).count[static_cast<std::size_t>(column | (voxel & 7))] +=
                sign * static_cast<std::uint32_t>(samples);
          };
          add(place.voxel, n - place.rest);
          if (place.rest > 0)
            add(place.voxel + 1, place.rest);
        }
      }
      crossings.clear();
    }
  }
  integrate_slab(map, n, result);
  return result;
}

// ---- all slabs

/// Sample rows [row_begin, row_end) that a triangle may cross; empty if none.
struct Rows {
  std::int32_t begin = 0, end = 0;
};
Rows rows_of(const Prepared& mesh, const Triangle& t) {
  const Vec3 &a = mesh.points[t[0]], &b = mesh.points[t[1]], &c = mesh.points[t[2]];
  const auto [x_min, x_max] = std::minmax({a.x, b.x, c.x});
  const auto [y_min, y_max] = std::minmax({a.y, b.y, c.y});
  if (ceil_int(y_min) > floor_int(y_max))
    return {0, 0};
  return {ceil_int(x_min), ceil_int(x_max)};
}

/// Sorts the triangles into the slabs that they cross; returns how many cross none.
std::uint64_t assign_slabs(const Context& context, Prepared& mesh) {
  const std::int32_t thickness = leaf_dim * mesh.samples;
  std::int32_t low = INT32_MAX, high = INT32_MIN;
  std::uint64_t skipped = 0;
  std::size_t total = 0;
  std::vector<Rows> slabs_of(mesh.triangles.size());
  for (std::size_t n = 0; n < slabs_of.size(); ++n) {
    const Rows rows = rows_of(mesh, mesh.triangles[n]);
    if (rows.begin >= rows.end) {
      ++skipped;
      continue;
    }
    const Rows s{floor_divide(rows.begin, thickness), floor_divide(rows.end - 1, thickness) + 1};
    slabs_of[n] = s;
    low = std::min(low, s.begin);
    high = std::max(high, s.end);
    total += static_cast<std::size_t>(s.end - s.begin);
  }
  const std::size_t slabs = low < high ? static_cast<std::size_t>(high - low) : 0;
  require_memory(context, 16.0 * static_cast<double>(slabs) + 4.0 * static_cast<double>(total),
                 "sorting the triangles into slabs");
  mesh.first_slab = slabs == 0 ? 0 : low;
  mesh.slab_begin.assign(slabs + 1, 0);
  const auto for_each_pair = [&](auto&& visit) {
    for (std::size_t n = 0; n < mesh.triangles.size(); ++n) {
      const Rows range = slabs_of[n];
      for (std::int32_t s = range.begin; s < range.end; ++s)
        visit(static_cast<std::size_t>(s - low), static_cast<std::uint32_t>(n));
    }
  };
  for_each_pair([&](std::size_t slab, std::uint32_t) { ++mesh.slab_begin[slab + 1]; });
  std::partial_sum(mesh.slab_begin.begin(), mesh.slab_begin.end(), mesh.slab_begin.begin());
  mesh.members.resize(total);
  std::vector<std::size_t> next(mesh.slab_begin.begin(), mesh.slab_begin.end() - 1);
  for_each_pair([&](std::size_t slab, std::uint32_t n) { mesh.members[next[slab]++] = n; });
  return skipped;
}

/// Writes the runs as tiles of 8³ and, where all 256 columns of a node of 128³ are full, of 128³.
template <class Leaf>
std::vector<TileView> tiles_of(const std::vector<Slab<Leaf>>& slabs, std::int32_t first_slab) {
  const auto for_each_node = [](std::int32_t i, const FullRun& run, auto&& visit) {
    for (std::int32_t k = (run.k_begin + 15) >> 4; k < run.k_end >> 4; ++k)
      visit(Int3{i >> 4, run.j >> 4, k});
  };
  const auto for_each_run = [&](auto&& visit) {
    for (std::size_t s = 0; s < slabs.size(); ++s)
      for (const FullRun& run : slabs[s].runs)
        visit(first_slab + static_cast<std::int32_t>(s), run);
  };
  std::vector<Int3> covered;
  for_each_run([&](std::int32_t i, const FullRun& run) {
    for_each_node(i, run, [&](const Int3& node) { covered.push_back(node); });
  });
  std::sort(covered.begin(), covered.end());
  std::vector<Int3> full;
  for (std::size_t n = 0; n + 256 <= covered.size(); ++n)
    if (covered[n] == covered[n + 255]) {
      full.push_back(covered[n]);
      n += 255;
    }
  const auto is_full = [&](const Int3& node) {
    return std::binary_search(full.begin(), full.end(), node);
  };

  std::vector<TileView> tiles;
  for (const Int3& node : full)
    tiles.push_back({{node[0] * 128, node[1] * 128, node[2] * 128}, 128, 1.0f, true});
  for_each_run([&](std::int32_t i, const FullRun& run) {
    for (std::int32_t k = run.k_begin; k < run.k_end;) {
      if ((k & 15) == 0 && k + 16 <= run.k_end && is_full({i >> 4, run.j >> 4, k >> 4})) {
        k += 16;
        continue;
      }
      tiles.push_back({{i * 8, run.j * 8, k * 8}, 8, 1.0f, true});
      ++k;
    }
  });
  return tiles;
}

void move_leaves(std::vector<BitLeaf>& from, InsideScan& scan) {
  for (const BitLeaf& leaf : from)
    scan.bits.push_back(leaf.word);
}
void move_leaves(std::vector<CountLeaf>& from, InsideScan& scan) {
  for (const CountLeaf& leaf : from)
    scan.counts.push_back(leaf.count);
}

template <class Leaf, class ScanSlab>
InsideScan scan_slabs(const Context& context, const Prepared& mesh, ScanSlab&& scan_slab,
                      VoxelizeReport& report) {
  std::vector<Slab<Leaf>> slabs(mesh.slab_begin.size() - 1);
  parallel_blocks(context, slabs.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t s = begin; s < end; ++s)
      slabs[s] = scan_slab(mesh, s);
  });
  InsideScan scan;
  scan.samples = mesh.samples;
  scan.tiles = tiles_of(slabs, mesh.first_slab);
  std::size_t leaves = 0;
  for (const Slab<Leaf>& slab : slabs)
    leaves += slab.keys.size();
  scan.origins.reserve(leaves);
  if (mesh.samples == 1)
    scan.bits.reserve(leaves);
  else
    scan.counts.reserve(leaves);
  for (std::size_t s = 0; s < slabs.size(); ++s) {
    Slab<Leaf>& slab = slabs[s];
    const std::int32_t i = (mesh.first_slab + static_cast<std::int32_t>(s)) * leaf_dim;
    for (const LeafKey& key : slab.keys)
      scan.origins.push_back({i, key.j * leaf_dim, key.k * leaf_dim});
    move_leaves(slab.leaves, scan);
    report.crossings += slab.crossings;
    report.odd_rays += slab.odd_rays;
    report.exact_tests += slab.exact_tests;
    slab = {};
  }
  return scan;
}

/// Surface area in faces of voxels, and the box of the points in voxels.
struct Extent {
  double area = 0;
  Box3 box;
};
Extent extent_of(const TriangleMesh& mesh, const GridTransform& transform) {
  Extent extent;
  for (const Vec3& p : mesh.points)
    extent.box.add(transform.to_index(p));
  double twice = 0;
  for (const Triangle& t : mesh.triangles) {
    const Vec3& a = mesh.points[t[0]];
    twice += norm(cross(mesh.points[t[1]] - a, mesh.points[t[2]] - a));
  }
  extent.area = twice / 2 / std::pow(std::fabs(transform.determinant()), 2.0 / 3.0);
  return extent;
}

/// Points in the index space of the samples: f = samples x + (samples - 1)/2.
std::vector<Vec3> sample_points(const TriangleMesh& mesh, const GridTransform& transform,
                                int samples) {
  std::vector<Vec3> points(mesh.points.size());
  const double scale = samples, shift = (samples - 1) / 2.0;
  for (std::size_t n = 0; n < points.size(); ++n) {
    const Vec3 p = transform.to_index(mesh.points[n]);
    for (int a = 0; a < 3; ++a) {
      const double x = std::fma(p[a], scale, shift);
      if (!(std::fabs(x) < index_limit))
        throw Error(
            "point " + std::to_string(n) + " lies " + std::to_string(std::fabs(x)) +
            " samples from the lattice's origin, expected less than 2^30: choose a larger voxel");
      points[n][a] = predicate_coordinate(x);
    }
  }
  return points;
}

} // namespace

double voxelize_bytes(const TriangleMesh& mesh, const GridTransform& transform, int samples) {
  const Extent extent = extent_of(mesh, transform);
  const auto cells = [&](double edge) { // that the surface meets, at most all of the box
    const Vec3 size = extent.box.size() * (1 / edge);
    // A patch meets |nx| + |ny| + |nz| <= sqrt(3) cells for each face's area of it, more at its
    // rim.
    return std::fmin(1.75 * extent.area / (edge * edge) + 8,
                     (size.x + 2) * (size.y + 2) * (size.z + 2));
  };
  const double leaf_bytes = (samples == 1 ? 64 : 2 * 4 * leaf_voxels) + 4 * leaf_voxels + 200;
  const double node_bytes = 4096.0 * (sizeof(TileView) + 8);
  const double solid_nodes =
      extent.box.size().x * extent.box.size().y * extent.box.size().z / 0x1p21;
  const double fine_rows = std::fmin(64, 8 * samples), slabs = extent.box.size().x / 8 + 1;
  const double crossings_at_once =
      extent.area * samples * samples / slabs * fine_rows / (8 * samples);
  const double top_bytes = 32768 * 8.25; // a node of 4096³ voxels, one for each octant at least
  return cells(leaf_dim) * leaf_bytes + cells(128) * node_bytes + cells(4096) * top_bytes +
         solid_nodes * 40 + 200 * slabs + (samples == 1 ? 0 : 64 * crossings_at_once) +
         60.0 * static_cast<double>(mesh.points.size() + mesh.triangles.size());
}

InsideScan scan_inside(const Context& context, const TriangleMesh& mesh,
                       const GridTransform& transform, const VoxelizeOptions& options,
                       VoxelizeReport* report) {
  if (options.samples < 1 || options.samples > 64)
    throw Error("voxelize: " + std::to_string(options.samples) +
                " samples along an edge, expected 1 to 64");
  if (mesh.triangles.empty())
    throw Error("the mesh has no triangle, expected at least one");
  if (const double edge = transform.voxel_size().x; !(edge >= 1e-100 && edge <= 1e100))
    throw Error("the voxels are too " + std::string(edge < 1 ? "small" : "large") +
                ", expected an edge from 1e-100 to 1e100 mm");
  if (!transform.is_cubic())
    throw Error("the lattice is not cubic (" + transform.describe() +
                "), expected voxels with equal edges");
  require_memory(context, voxelize_bytes(mesh, transform, options.samples), "the voxelized mesh");

  VoxelizeReport local;
  VoxelizeReport& r = report != nullptr ? *report : local;
  r = {};
  r.triangles = mesh.triangles.size();
  Prepared prepared;
  prepared.samples = options.samples;
  prepared.points = sample_points(mesh, transform, options.samples);
  prepared.triangles = mesh.triangles;
  const auto border = odd_edges(prepared.points, prepared.triangles);
  r.boundary_edges = border.size();
  if (!border.empty()) {
    std::vector<std::uint32_t> group;
    r.holes = edge_groups(border, group);
    if (options.on_open == OpenMesh::fill)
      close_with_cones(border, prepared.points, prepared.triangles);
  }
  r.triangles_skipped = assign_slabs(context, prepared);
  InsideScan scan = options.samples == 1
                        ? scan_slabs<BitLeaf>(context, prepared, scan_slab_bits, r)
                        : scan_slabs<CountLeaf>(context, prepared, scan_slab_counts, r);
  if (!border.empty() && options.on_open == OpenMesh::refuse)
    throw Error("the mesh is open: " + std::to_string(r.boundary_edges) + " boundary edges in " +
                std::to_string(r.holes) + (r.holes == 1 ? " hole, " : " holes, ") +
                std::to_string(r.odd_rays) +
                " odd rays, expected a closed mesh (or --on-open warn|fill)");
  return scan;
}

Grid grid_from_scan(const Context& context, const InsideScan& scan,
                    const GridTransform& transform) {
  GridInfo info;
  info.transform = transform;
  GridBuilder builder(info);
  for (const TileView& tile : scan.tiles)
    builder.add_tile(tile);
  const std::vector<LeafRef> leaves = builder.add_leaves(context, scan.origins);
  const double full = scan.samples * scan.samples * scan.samples;
  parallel_blocks(context, leaves.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n)
      for (std::size_t w = 0; w < 8; ++w) {
        float* values = leaves[n].values + 64 * w;
        std::uint64_t active = 0;
        if (scan.samples == 1) {
          active = scan.bits[n][w];
          for (std::size_t v = 0; v < 64; ++v)
            values[v] = static_cast<float>(active >> v & 1);
        } else {
          for (std::size_t v = 0; v < 64; ++v) {
            const std::uint32_t count = scan.counts[n][64 * w + v];
            values[v] = static_cast<float>(count / full);
            active |= static_cast<std::uint64_t>(count != 0) << v;
          }
        }
        leaves[n].active[w] = active;
      }
  });
  return builder.finish(false);
}

Grid voxelize(const Context& context, const TriangleMesh& mesh, const GridTransform& transform,
              const VoxelizeOptions& options, VoxelizeReport* report) {
  return grid_from_scan(context, scan_inside(context, mesh, transform, options, report), transform);
}

} // namespace gewebe
