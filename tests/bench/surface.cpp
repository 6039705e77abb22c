// Speed of the surface stage: marching cubes and snapping on a narrow band, on a plain volume of
// many small features and on a dense gyroid, against OpenVDB's volumeToMesh and against VTK's
// FlyingEdges3D where python3 has VTK; and each against the time that the machine needs to read the
// volume's values once. Times are of whole calls without reading files. The VTK volume is dense,
// ours is what the programs before mc-opt make.
//
// Writes CSV to standard output as geometry.cpp does: stage, program, voxel (mm), size (points of
// the mesh), threads, median and spread of the times, and a figure whose meaning stands in the
// column `measure`.

#include "base/parallel.h"
#include "density/density.h"
#include "surface/marching_cubes.h"
#include "surface/snapping.h"
#include "tests/bench/peer.h"
#include "tests/bench/timing.h"
#include "volume/grid_internal.h"

#include <openvdb/tools/VolumeToMesh.h>

#include <oneapi/tbb/global_control.h>

#include <array>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <unistd.h>

using namespace gewebe;
using namespace gewebe::timing;

namespace {

constexpr int runs = 7;

void report(const std::string& stage, const char* program, double voxel, double size, int threads,
            const Times& times, double figure, const char* measure) {
  std::printf("%s,%s,%g,%.0f,%d,%.3f,%.3f,%.3f,%.3g,%s\n", stage.c_str(), program, voxel, size,
              threads, times.median, times.fastest, times.slowest, figure, measure);
  std::fflush(stdout);
}

/// Adds up all values of the leaves: what any method that looks at each once must pay.
Times measure_reading(const volume::Grid& grid, int threads) {
  const std::vector<volume::LeafView> leaves = grid.leaves();
  std::atomic<std::uint32_t> kept{0};
  return measure([&] {
    parallel_blocks(
        with_threads(threads), leaves.size(), 1024, [&](std::size_t begin, std::size_t end) {
          std::array<std::uint32_t, 16> sums{};
          for (std::size_t n = begin; n < end; ++n) {
            const auto* const words = reinterpret_cast<const std::uint32_t*>(leaves[n].values);
            for (std::size_t v = 0; v < volume::leaf_voxels; v += sums.size())
              for (std::size_t lane = 0; lane < sums.size(); ++lane)
                sums[lane] ^= words[v + lane];
          }
          for (const std::uint32_t sum : sums)
            kept ^= sum;
        });
  });
}

/// The first n voxels of each axis from `low` on, x fastest, as VTK wants them.
void write_dense(const volume::Grid& grid, const Int3& low, int n, const std::string& path) {
  std::vector<float> values(static_cast<std::size_t>(n) * static_cast<std::size_t>(n) *
                            static_cast<std::size_t>(n));
  parallel_blocks({}, static_cast<std::size_t>(n), 8, [&](std::size_t begin, std::size_t end) {
    volume::GridAccessor accessor(grid);
    for (int i = 0; i < n; ++i) // one 8-voxel layer of k at a time: leaf by leaf
      for (int j = 0; j < n; ++j)
        for (auto k = static_cast<int>(begin); k < static_cast<int>(end); ++k)
          values[(static_cast<std::size_t>(k) * static_cast<std::size_t>(n) +
                  static_cast<std::size_t>(j)) *
                     static_cast<std::size_t>(n) +
                 static_cast<std::size_t>(i)] =
              accessor.value({low[0] + i, low[1] + j, low[2] + k});
  });
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(values.data()),
             static_cast<std::streamsize>(values.size() * sizeof(float)));
}

void bench_vtk(const std::string& stage, const volume::Grid& grid, double isovalue, const Int3& low,
               int n, double voxel, const std::array<double, 2>& ours) {
  const std::string path =
      (std::filesystem::temp_directory_path() / ("surface-" + std::to_string(getpid()))).string();
  write_dense(grid, low, n, path);
  for (const int threads : {1, 2}) {
    char call[512];
    (void)std::snprintf(call, sizeof call, "tests/bench/surface_vtk.py '%s' %d %.17g %d %d",
                        path.c_str(), n, isovalue, threads, runs);
    std::vector<double> numbers = numbers_of_script(call); // the times, then the points
    if (numbers.size() != runs + 1) {
      (void)std::fputs("surface: FlyingEdges3D skipped, python3 has no vtk\n", stderr);
      break;
    }
    const double points = numbers.back();
    numbers.pop_back();
    const Times times = times_of(numbers);
    report(stage, "FlyingEdges3D", voxel, points, threads, times,
           times.median / ours.at(static_cast<std::size_t>(threads) - 1), "times of ours");
  }
  std::filesystem::remove(path);
}

void bench_scene(const std::string& stage, const volume::Grid& grid, const Int3& low, int n) {
  const double voxel = grid.info().transform.voxel_size().x;
  const double isovalue = surface::default_isovalue(grid.info());
  std::array<double, 2> ours{}, snaps{}, boths{};
  for (const int threads : {1, 2}) {
    const auto slot = static_cast<std::size_t>(threads) - 1;
    const Context context = with_threads(threads);
    const Times reading = measure_reading(grid, threads);
    // Marching cubes alone; and as mc-opt does it, without a mesh in between, with snapping.
    std::vector<double> meshing_times, snapping_times, both_times;
    double points = 0, points_left = 0, cells = 0;
    for (int run = 0; run < runs; ++run) {
      surface::IsoSurface surface, to_snap; // memory is given back outside the measurement
      surface::SnapResult snapped;
      meshing_times.push_back(
          milliseconds([&] { surface = surface::marching_cubes(context, grid); }));
      const double before =
          milliseconds([&] { to_snap = surface::marching_cubes_to_snap(context, grid); });
      snapping_times.push_back(
          milliseconds([&] { snapped = surface::snap(context, to_snap, {}); }));
      both_times.push_back(before + snapping_times.back());
      points = static_cast<double>(surface.mesh.points.size());
      points_left = static_cast<double>(snapped.mesh.points.size());
      cells = static_cast<double>(surface.active_cells);
    }
    const Times meshing = times_of(meshing_times), snapping = times_of(snapping_times),
                both = times_of(both_times);
    ours.at(slot) = meshing.median;
    snaps.at(slot) = snapping.median;
    boths.at(slot) = both.median;
    report(stage, "reading the values", voxel, points, threads, reading,
           1e6 * reading.median / cells, "ns an active cell");
    report(stage, "marching cubes", voxel, points, threads, meshing, 1e6 * meshing.median / cells,
           "ns an active cell");
    report(stage, "snap 0.15", voxel, points_left, threads, snapping,
           snapping.median / meshing.median, "of marching cubes");
    report(stage, "mc-opt 0.15", voxel, points_left, threads, both, both.median / meshing.median,
           "of marching cubes");

    const oneapi::tbb::global_control limit(oneapi::tbb::global_control::max_allowed_parallelism,
                                            static_cast<std::size_t>(threads));
    const auto native = openvdb::FloatGrid::create(grid.native()->tree);
    std::size_t found = 0;
    const Times peer = measure([&] {
      std::vector<openvdb::Vec3s> corners;
      std::vector<openvdb::Vec4I> quads;
      openvdb::tools::volumeToMesh(*native, corners, quads, isovalue);
      found = corners.size();
    });
    report(stage, "OpenVDB volumeToMesh", voxel, static_cast<double>(found), threads, peer,
           peer.median / meshing.median, "times of ours");
    if (threads == 2) {
      report(stage + " 1/2 threads", "marching cubes", voxel, points, threads, meshing,
             ours[0] / ours[1], "times faster");
      report(stage + " 1/2 threads", "snap 0.15", voxel, points_left, threads, snapping,
             snaps[0] / snaps[1], "times faster");
      report(stage + " 1/2 threads", "mc-opt 0.15", voxel, points_left, threads, both,
             boths[0] / boths[1], "times faster");
    }
  }
  bench_vtk(stage, grid, isovalue, low, n, voxel, ours);
}

/// Balls of support R(1 ± 0.25) in a cube of 100 mm.
volume::Grid metaballs(int count, double R, int n) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  Particles particles;
  for (int p = 0; p < count; ++p) {
    const double support = R * (0.75 + 0.5 * unit(random));
    const auto place = [&] { return support + unit(random) * (100 - 2 * support); };
    const double x = place(), y = place(), z = place();
    particles.push_back({{x, y, z}, support, 1});
  }
  density::DensityOptions options;
  options.info.transform = volume::uniform_transform(100.0 / n);
  options.band = 0.5;
  return density::metaball_density({}, particles, options);
}

/// A ball of fluid: particles about a cubic lattice of unit distance; n voxels across.
volume::Grid fluid(int count, int n, bool band) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(-0.2, 0.2);
  const double radius = std::cbrt(count * 3 / (4 * 3.14159265358979));
  const int half = static_cast<int>(radius) + 1;
  Particles particles;
  for (int i = -half; i <= half; ++i)
    for (int j = -half; j <= half; ++j)
      for (int k = -half; k <= half; ++k)
        if (i * i + j * j + k * k < radius * radius) {
          const double x = i + unit(random), y = j + unit(random), z = k + unit(random);
          particles.push_back({{x, y, z}, 1.2, 1});
        }
  density::DensityOptions options;
  options.info.transform = volume::uniform_transform(support_box(particles).longest_side() / n);
  if (band)
    options.band = 0.5;
  return density::metaball_density({}, particles, options);
}

/// 0.5 + gyroid of the given period, in all n³ voxels.
volume::Grid gyroid(int n, double period) {
  std::vector<double> sine, cosine;
  for (int i = 0; i < n; ++i) {
    sine.push_back(std::sin(2 * 3.14159265358979 * i / period));
    cosine.push_back(std::cos(2 * 3.14159265358979 * i / period));
  }
  std::vector<Int3> origins;
  for (int i = 0; i < n; i += volume::leaf_dim)
    for (int j = 0; j < n; j += volume::leaf_dim)
      for (int k = 0; k < n; k += volume::leaf_dim)
        origins.push_back({i, j, k});
  volume::GridBuilder builder{volume::GridInfo{}};
  for (const volume::LeafRef& leaf : builder.add_leaves({}, origins))
    for (int v = 0; v < volume::leaf_voxels; ++v) {
      const auto i = static_cast<std::size_t>(leaf.origin[0] + (v >> 6)),
                 j = static_cast<std::size_t>(leaf.origin[1] + (v >> 3 & 7)),
                 k = static_cast<std::size_t>(leaf.origin[2] + (v & 7));
      leaf.values[v] =
          static_cast<float>(0.5 + sine[i] * cosine[j] + sine[j] * cosine[k] + sine[k] * cosine[i]);
      leaf.active[v >> 6] |= std::uint64_t{1} << (v & 63);
    }
  return builder.finish(false);
}

} // namespace

/// Arguments: some of metaballs, fluid, gyroid; all where there are none.
int main(int argc, char** argv) {
  const auto wanted = [&](const char* name) {
    return argc == 1 || std::any_of(argv + 1, argv + argc,
                                    [&](const char* word) { return std::string(word) == name; });
  };
  std::puts("stage,program,voxel,size,threads,median_ms,fastest_ms,slowest_ms,error,measure");
  if (wanted("metaballs"))
    bench_scene("metaballs 512^3 band", metaballs(20, 22, 512), {0, 0, 0}, 512);
  if (wanted("fluid")) {
    bench_scene("fluid 512^3 band", fluid(100000, 512, true), {-256, -256, -256}, 512);
    bench_scene("fluid 512^3", fluid(100000, 512, false), {-256, -256, -256}, 512);
  }
  if (wanted("gyroid"))
    bench_scene("gyroid 256^3", gyroid(256, 32), {0, 0, 0}, 256);
  return 0;
}
