// Work against error of the geometry stages, with OpenVDB's own tools on the same input in the same
// run. Writes CSV to standard output: stage, program, voxel (mm), size (what the work follows),
// threads, median and spread of the times, error (what it means stands in the column `measure`).

#include "density/density.h"
#include "surface/marching_cubes.h"
#include "surface/snapping.h"
#include "tests/bench/timing.h"
#include "volume/grid_internal.h"

#include <openvdb/tools/VolumeToMesh.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>

using namespace gewebe;
using namespace gewebe::timing;

namespace {

void report(const char* stage, const char* program, double voxel, std::size_t size, int threads,
            const Times& times, double error, const char* measure) {
  std::printf("%s,%s,%g,%zu,%d,%.3f,%.3f,%.3f,%.3g,%s\n", stage, program, voxel, size, threads,
              times.median, times.fastest, times.slowest, error, measure);
  std::fflush(stdout);
}

volume::Grid ball(double voxel, double support) {
  density::DensityOptions options;
  options.info.transform = volume::uniform_transform(voxel);
  return density::metaball_density({}, {{{0.1, 0.2, 0.3}, support, 1}}, options);
}

template <class Points>
double radial_error(const Points& points, double radius) {
  double sum = 0;
  for (const auto& p : points)
    sum += std::fabs(norm(Vec3{p[0], p[1], p[2]} - Vec3{0.1, 0.2, 0.3}) - radius);
  return sum / static_cast<double>(points.size());
}

void bench_surface(double voxel) {
  constexpr double support = 40; // so the surface at 0.5 has radius 20
  const volume::Grid grid = ball(voxel, support);
  for (const int threads : {1, 2}) {
    surface::IsoSurface surface;
    const Context context = with_threads(threads);
    Times times = measure([&] { surface = surface::marching_cubes(context, grid); });
    report("surface", "marching cubes", voxel, surface.mesh.triangles.size(), threads, times,
           radial_error(surface.mesh.points, support / 2), "mean distance mm");
    surface::SnapResult snapped;
    times = measure([&] {
      surface = surface::marching_cubes_to_snap(context, grid);
      snapped = surface::snap(context, surface, {});
    });
    report("surface", "mc-opt 0.15", voxel, snapped.mesh.triangles.size(), threads, times,
           radial_error(snapped.mesh.points, support / 2), "mean distance mm");
  }
  const auto native = openvdb::FloatGrid::create(grid.native()->tree);
  native->setTransform(openvdb::math::Transform::createLinearTransform(voxel));
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec4I> quads;
  const Times times = measure([&] { openvdb::tools::volumeToMesh(*native, points, quads, 0.5); });
  std::vector<std::array<double, 3>> plain;
  for (const openvdb::Vec3s& p : points)
    plain.push_back(
        {static_cast<double>(p.x()), static_cast<double>(p.y()), static_cast<double>(p.z())});
  report("surface", "OpenVDB volumeToMesh", voxel, quads.size() * 2, 0, times,
         radial_error(plain, support / 2), "mean distance mm");
}

} // namespace

int main() {
  openvdb::initialize();
  std::puts("stage,program,voxel,size,threads,median_ms,fastest_ms,slowest_ms,error,measure");
  for (const double voxel : {2.0, 1.0, 0.5, 0.25})
    bench_surface(voxel);
  return 0;
}
