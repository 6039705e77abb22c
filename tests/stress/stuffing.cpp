// Strains isosurface stuffing: random scenes of balls, noise and noise of few values (many of
// them at the isovalue), on straight, mirrored and sheared axes, each at four sizes of cells,
// with all grades, half of them with materials whose interfaces are followed. What holds of
// every mesh: bounds of angles, positive volumes, a boundary that is a closed 2-manifold and
// comes first, no unused node. Argument: number of scenes (default 2000).

#include "stuffing/stuffing.h"
#include "tests/unit/larger.h"
#include "tests/unit/surface_scenes.h"
#include "tetrahedra/boundary.h"
#include "tetrahedra/check.h"
#include "tetrahedra/quality.h"

#include <charconv>
#include <cstdio>
#include <exception>
#include <random>
#include <string_view>

namespace {

using namespace gewebe;

volume::Grid random_scene(std::uint32_t seed) {
  switch (seed % 3) {
  case 0:
    return scenes::metaballs(12 + static_cast<int>(seed % 7), seed, 0.3 + seed % 5);
  case 1:
    return scenes::noise(6 + static_cast<int>(seed % 5), seed);
  default:
    return scenes::noise(6 + static_cast<int>(seed % 5), seed, 1 + static_cast<int>(seed / 3 % 4));
  }
}

/// The same values on other axes.
volume::Grid turned(const volume::Grid& grid, std::uint32_t seed) {
  if (seed / 3 % 3 == 0)
    return grid;
  volume::GridInfo info = grid.info();
  if (seed / 3 % 3 == 1)
    info.transform.m = {0, -0.7, 0, 2, 0.7, 0, 0, -3, 0, 0, -0.7, 1};
  else
    info.transform.m = {0.5, 0.1, 0, 3, 0, 0.9, 0.05, -2, 0.02, 0, 1.4, 1};
  volume::GridBuilder builder(info);
  for (const volume::LeafView& leaf : grid.leaves())
    builder.share_leaf(grid, leaf);
  for (const volume::TileView& tile : grid.tiles())
    builder.add_tile(tile);
  return builder.finish(false);
}

struct Totals {
  std::uint64_t meshes = 0, empty = 0, tetrahedra = 0, refused = 0, interface_cuts = 0, failed = 0;
  double smallest = 180, smallest_followed = 180, largest = 0, shift = 0; ///< degrees, and cells
};

/// Two to four materials in cubes of `width` mm, by chance.
stuffing::MaterialSource materials(std::uint32_t seed, double width) {
  return [seed, width] {
    return [seed, width](const Vec3& place) -> std::int32_t {
      std::uint32_t hash = seed;
      for (int a = 0; a < 3; ++a)
        hash = (hash ^ static_cast<std::uint32_t>(std::lround(place[a] / width) + 100000)) *
               2654435761U;
      return static_cast<std::int32_t>((hash >> 16) % (2 + seed % 3));
    };
  };
}

void examine(const volume::Grid& grid, double cell, std::uint32_t seed, Totals& totals) {
  stuffing::StuffingReport report;
  stuffing::StuffingOptions options{{}, cell, seed % (stuffing::stuffing_grade_max + 1)};
  if (seed / 4 % 2 != 0) {
    options.materials = materials(seed, cell * (1 + seed % 7));
    options.follow_interface = true;
  }
  const tetrahedra::TetMesh mesh = stuffing::stuff({}, grid, options, &report);
  ++totals.meshes;
  if (mesh.tetrahedra.empty()) {
    ++totals.empty;
    return;
  }
  const tetrahedra::TetReport found = tetrahedra::examine_tetrahedra(mesh);
  const tetrahedra::TetBoundary surface = tetrahedra::boundary(mesh);
  const tetrahedra::TetQuality quality = tetrahedra::tet_quality(mesh, surface);
  bool first = surface.node.size() == report.surface_nodes;
  for (std::size_t n = 0; first && n < surface.node.size(); ++n)
    first = surface.node[n] == n;
  const bool good =
      found.sound() && found.unused_points.count == 0 && found.manifold_boundary() && first &&
      quality.smallest_volume > 0 &&
      quality.smallest_angle >= (options.follow_interface ? stuffing::stuffing_interface_angle_min
                                                          : stuffing::stuffing_angle_min) &&
      quality.largest_angle <= stuffing::stuffing_angle_max;
  if (!good) {
    ++totals.failed;
    std::printf("scene %u, cell %g: FAILED (angles %.3f to %.3f)\n", seed, cell,
                quality.smallest_angle, quality.largest_angle);
  }
  totals.tetrahedra += mesh.tetrahedra.size();
  totals.refused += report.refused_warps;
  double& smallest = options.follow_interface ? totals.smallest_followed : totals.smallest;
  smallest = test::smaller(smallest, quality.smallest_angle);
  totals.interface_cuts += report.interface_cuts;
  totals.largest = test::larger(totals.largest, quality.largest_angle);
  totals.shift = test::larger(totals.shift, report.largest_shift / report.cell);
}

int run(std::uint32_t scenes) {
  Totals totals;
  for (std::uint32_t seed = 0; seed < scenes; ++seed) {
    const volume::Grid grid = turned(random_scene(seed), seed);
    const double voxel = std::cbrt(std::fabs(grid.info().transform.determinant()));
    std::mt19937 random(seed);
    const double factor = 1 + static_cast<double>(random()) / 4294967296.0;
    for (const double cells : {0.5, 1.0, 1.0 * factor, 2.0 * factor})
      examine(grid, cells * voxel, seed, totals);
  }
  std::printf("%llu meshes (%llu empty), %llu tetrahedra, angles %.3f (%.3f with %llu cuts between "
              "materials) to %.3f, %llu warps refused, shift at most %.3f cells, %llu failed\n",
              static_cast<unsigned long long>(totals.meshes),
              static_cast<unsigned long long>(totals.empty),
              static_cast<unsigned long long>(totals.tetrahedra), totals.smallest,
              totals.smallest_followed, static_cast<unsigned long long>(totals.interface_cuts),
              totals.largest, static_cast<unsigned long long>(totals.refused), totals.shift,
              static_cast<unsigned long long>(totals.failed));
  return totals.failed == 0 ? 0 : 1;
}

} // namespace

int main(int argc, char** argv) {
  std::uint32_t scenes = 2000;
  if (argc > 1) {
    const std::string_view text = argv[1];
    const auto parsed = std::from_chars(text.data(), text.data() + text.size(), scenes);
    if (parsed.ec != std::errc() || parsed.ptr != text.data() + text.size() || scenes < 1) {
      (void)std::fputs("stress_stuffing: expected a number of scenes\n", stderr);
      return 2;
    }
  }
  try {
    return run(scenes);
  } catch (const std::exception& error) {
    (void)std::fprintf(stderr, "stress_stuffing: %s\n", error.what());
    return 1;
  }
}
