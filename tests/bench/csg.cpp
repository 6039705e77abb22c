// CSG of a large volume and small balls: what it costs when most of the large one stays as it is,
// against the size of the small one, with OpenVDB's tools on the same volumes in the same run.
// Writes CSV to standard output: operation, program (gewebe: operands moved in; gewebe_shared:
// operands that live on; openvdb: compMax or compSum on copies, as they use up their operands;
// openvdb_moved: the same without the copy), leaves of the large and of the small volume, threads,
// median, fastest and slowest time in ms, voxels that differ from gewebe's.

#include "volume/csg.h"
#include "tests/bench/timing.h"
#include "tests/unit/mesh_fixtures.h"
#include "volume/grid_internal.h"
#include "volume/lattice.h"
#include "voxelization/voxelize.h"

#include <openvdb/tools/Composite.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>

using namespace gewebe;
using namespace gewebe::timing;
using gewebe::test::sphere_mesh;

namespace {

constexpr int runs = 7;

/// Times `work(prepare())`; preparing doesn't count, nor does the end of what work returns.
template <class Prepare, class Work>
Times measure(const Prepare& prepare, const Work& work) {
  std::vector<double> times;
  for (int run = 0; run < runs; ++run) {
    auto input = prepare();
    const auto start = std::chrono::steady_clock::now();
    [[maybe_unused]] const auto result = work(std::move(input));
    times.push_back(
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
            .count());
  }
  return times_of(std::move(times));
}

void report(const char* operation, const char* program, std::size_t large, std::size_t small,
            int threads, const Times& times, std::uint64_t differences) {
  std::printf("%s,%s,%zu,%zu,%d,%.3f,%.3f,%.3f,%llu\n", operation, program, large, small, threads,
              times.median, times.fastest, times.slowest,
              static_cast<unsigned long long>(differences));
  std::fflush(stdout);
}

/// A ball of 0 and 1 with an edge of a few voxels between: leaves near its surface, tiles inside.
volume::Grid ball(const Vec3& center, double radius) {
  const volume::Grid scan = voxelization::voxelize({}, sphere_mesh(6, radius, center),
                                                   volume::uniform_transform(1), {.samples = 1});
  volume::GridBuilder builder(scan.info());
  std::vector<Int3> origins;
  for (const volume::LeafView& leaf : scan.leaves())
    origins.push_back(leaf.origin);
  for (const volume::LeafRef& leaf : builder.add_leaves({}, origins))
    for (int n = 0; n < volume::leaf_voxels; ++n) {
      const Vec3 voxel{1.0 * (leaf.origin[0] + (n >> 6)), 1.0 * (leaf.origin[1] + (n >> 3 & 7)),
                       1.0 * (leaf.origin[2] + (n & 7))};
      const double density = 0.5 + 0.2 * (radius - norm(voxel - center));
      leaf.values[n] = static_cast<float>(std::clamp(density, 0.0, 1.0));
      if (leaf.values[n] != 0)
        leaf.active[n / 64] |= std::uint64_t{1} << (n % 64);
    }
  for (const volume::TileView& tile : scan.tiles())
    builder.add_tile(tile);
  return builder.finish();
}

/// With leaves and tiles of its own.
volume::Grid copy_of(const volume::Grid& grid) {
  volume::GridBuilder builder(grid.info());
  const std::vector<volume::LeafView> leaves = grid.leaves();
  std::vector<Int3> origins;
  for (const volume::LeafView& leaf : leaves)
    origins.push_back(leaf.origin);
  const std::vector<volume::LeafRef> refs = builder.add_leaves({}, origins);
  for (std::size_t n = 0; n < leaves.size(); ++n) {
    std::copy_n(leaves[n].values, volume::leaf_voxels, refs[n].values);
    std::copy_n(leaves[n].active, 8, refs[n].active);
  }
  for (const volume::TileView& tile : grid.tiles())
    builder.add_tile(tile);
  volume::Grid copy = builder.finish(false);
  (void)copy.summary({}); // as after reading
  return copy;
}

std::uint64_t differences(const volume::Grid& ours, const volume::FloatTree& theirs) {
  std::uint64_t count = 0;
  for (const volume::LeafView& leaf : ours.leaves()) {
    const volume::FloatLeaf* const other = theirs.probeConstLeaf(volume::to_coord(leaf.origin));
    for (int n = 0; n < volume::leaf_voxels; ++n) {
      const float value = other != nullptr ? other->buffer().data()[n]
                                           : theirs.getValue(volume::to_coord(leaf.origin));
      count += !(value == leaf.values[n]);
    }
  }
  return count;
}

using Tool = std::function<void(openvdb::FloatGrid&, openvdb::FloatGrid&)>;

void bench(const char* name, volume::CsgOperation operation, const Tool& tool,
           const volume::Grid& large, const volume::Grid& small) {
  const std::size_t leaves = large.leaves().size(), others = small.leaves().size();
  volume::Grid ours;
  for (const int threads : {1, 2}) {
    Context context;
    context.threads = threads;
    const auto combine = [&](std::vector<volume::CsgOperand> operands) {
      return volume::csg(context, operation, std::move(operands));
    };
    const Times moved = measure(
        [&] {
          std::vector<volume::CsgOperand> operands;
          operands.push_back({copy_of(large), ""});
          operands.push_back({copy_of(small), ""});
          return operands;
        },
        combine);
    report(name, "gewebe", leaves, others, threads, moved, 0);
    const auto share = [&] { return std::vector<volume::CsgOperand>{{large, ""}, {small, ""}}; };
    report(name, "gewebe_shared", leaves, others, threads, measure(share, combine), 0);
    ours = combine(share());
  }
  std::pair<openvdb::FloatGrid::Ptr, openvdb::FloatGrid::Ptr> theirs; // freed between the runs
  const auto copies = [&] {
    const auto copy = [](const volume::Grid& grid) {
      return openvdb::FloatGrid::create(std::make_shared<volume::FloatTree>(*grid.native()->tree));
    };
    return std::pair(copy(large), copy(small));
  };
  const auto apply = [&](auto pair) {
    tool(*pair.first, *pair.second);
    theirs = std::move(pair);
    return 0;
  };
  const auto free_last = [&] {
    theirs = {};
    return 0;
  };
  const Times with_copy = measure(free_last, [&](int) { return apply(copies()); });
  report(name, "openvdb", leaves, others, 2, with_copy, differences(ours, theirs.first->tree()));
  const Times without = measure(
      [&] {
        theirs = {};
        return copies();
      },
      apply);
  report(name, "openvdb_moved", leaves, others, 2, without,
         differences(ours, theirs.first->tree()));
}

} // namespace

int main() {
  std::puts("operation,program,large_leaves,small_leaves,threads,median_ms,fastest_ms,slowest_ms,"
            "differences");
  const volume::Grid large = copy_of(ball({0, 0, 0}, 500)); // 1000³ voxels
  for (const double radius : {4.0, 16.0, 64.0, 256.0}) {
    const volume::Grid small = copy_of(ball({500, 0, 0}, radius));
    bench(
        "add", volume::CsgOperation::add,
        [](openvdb::FloatGrid& a, openvdb::FloatGrid& b) { openvdb::tools::compSum(a, b); }, large,
        small);
    bench(
        "union", volume::CsgOperation::unite, // csgUnion is for level sets
        [](openvdb::FloatGrid& a, openvdb::FloatGrid& b) { openvdb::tools::compMax(a, b); }, large,
        small);
  }
}
