// Speed of voxelization: a patient's colon, each triangle cut into four (a ball where there is no
// shared data), at 128 to 1024 voxels, with the peers on the same input in the same run: Embree,
// one ray per column of voxels; VTK's image stencil, where python3 has VTK; OpenVDB's level set.
// Each time is of the whole call without reading files; all results are sparse.
//
// Writes CSV to standard output as geometry.cpp does, and the peak of memory that one call adds to
// the process, in MiB (0: not measured).

#include "voxelize/voxelize.h"
#include "formats/mesh/mesh_file.h"
#include "tests/bench/peer.h"
#include "tests/bench/timing.h"
#include "tests/unit/mesh_fixtures.h"
#include "volume/lattice.h"
#include "volume/volume_stats.h"

#include <embree3/rtcore.h>
#include <malloc.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/MeshToVolume.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>

using namespace gewebe;
using namespace gewebe::timing;

namespace {

constexpr int runs = 5;

/// What `work` adds at most to the process, MiB: asked of a child, which ends before it frees
/// anything.
double peak_mib(const std::function<void()>& work) {
  malloc_trim(0);
  int pipe_ends[2];
  if (pipe(pipe_ends) != 0)
    return 0;
  const pid_t child = fork();
  if (child == 0) {
    rusage before{}, after{};
    getrusage(RUSAGE_SELF, &before);
    work();
    getrusage(RUSAGE_SELF, &after);
    const double mib = static_cast<double>(after.ru_maxrss - before.ru_maxrss) / 1024;
    _exit(write(pipe_ends[1], &mib, sizeof mib) == sizeof mib ? 0 : 1);
  }
  close(pipe_ends[1]);
  double mib = 0;
  if (read(pipe_ends[0], &mib, sizeof mib) != sizeof mib)
    mib = 0;
  close(pipe_ends[0]);
  waitpid(child, nullptr, 0);
  return mib;
}

struct Scene {
  TriangleMesh mesh;
  int dim;
  GridTransform lattice;
  double voxel() const { return lattice.m[0]; }
  /// Relative error of the volume of so many voxels.
  double error(double voxels) const {
    return std::fabs(voxels * voxel() * voxel() * voxel() / signed_volume(mesh) - 1);
  }
};

void report(const Scene& scene, const char* program, int threads, const Times& times, double error,
            double peak) {
  std::printf("voxelize %d,%s,%g,%zu,%d,%.3f,%.3f,%.3f,%.3g,relative volume,%.1f\n", scene.dim,
              program, scene.voxel(), scene.mesh.triangles.size(), threads, times.median,
              times.fastest, times.slowest, error, peak);
  std::fflush(stdout);
}

double voxels_inside(const InsideScan& scan) {
  double sum = 0;
  for (const auto& leaf : scan.bits)
    for (const std::uint64_t word : leaf)
      sum += std::popcount(word);
  for (const TileView& t : scan.tiles)
    sum += std::pow(t.dim, 3);
  return sum;
}

/// Each triangle in four.
TriangleMesh subdivided(const TriangleMesh& mesh) {
  TriangleMesh fine;
  fine.points = mesh.points;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
  const auto middle = [&](std::uint32_t a, std::uint32_t b) {
    const auto [it, fresh] =
        middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(fine.points.size()));
    if (fresh)
      fine.points.push_back((fine.points[a] + fine.points[b]) * 0.5);
    return it->second;
  };
  for (const auto& [a, b, c] : mesh.triangles) {
    const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    fine.triangles.insert(fine.triangles.end(),
                          {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
  }
  return fine;
}

// ---- peers

/// Intervals of voxels inside along k.
struct Interval {
  std::int32_t i, j, k_begin, k_end;
};

struct RayContext {
  RTCIntersectContext context;
  std::vector<float> hits;
};

void keep_hit(const RTCFilterFunctionNArguments* arguments) {
  reinterpret_cast<RayContext*>(arguments->context)
      ->hits.push_back(RTCRayN_tfar(arguments->ray, arguments->N, 0));
  arguments->valid[0] = 0; // and on along the ray
}

/// One ray along each column of voxel centres; all its hits, sorted and paired.
std::vector<Interval> embree_rays(const Scene& scene) {
  RTCDevice device = rtcNewDevice("threads=1");
  RTCScene world = rtcNewScene(device);
  rtcSetSceneFlags(world, RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION);
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* points = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                             RTC_FORMAT_FLOAT3, 3 * sizeof(float),
                                                             scene.mesh.points.size()));
  Box3 box;
  for (std::size_t n = 0; n < scene.mesh.points.size(); ++n) {
    const Vec3 p = scene.lattice.to_index(scene.mesh.points[n]);
    box.add(p);
    for (int a = 0; a < 3; ++a)
      points[3 * n + static_cast<std::size_t>(a)] = static_cast<float>(p[a]);
  }
  auto* corners = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                          sizeof(Triangle), scene.mesh.triangles.size());
  std::copy(scene.mesh.triangles.begin(), scene.mesh.triangles.end(),
            static_cast<Triangle*>(corners));
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(world, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(world);

  std::vector<Interval> inside;
  RayContext rays;
  rtcInitIntersectContext(&rays.context);
  rays.context.filter = keep_hit;
  const auto first = [](double x) { return static_cast<std::int32_t>(std::ceil(x)); };
  for (std::int32_t i = first(box.min.x); i < first(box.max.x); ++i)
    for (std::int32_t j = first(box.min.y); j < first(box.max.y); ++j) {
      rays.hits.clear();
      RTCRayHit ray{};
      ray.ray.org_x = static_cast<float>(i);
      ray.ray.org_y = static_cast<float>(j);
      ray.ray.org_z = static_cast<float>(box.min.z - 1);
      ray.ray.dir_z = 1;
      ray.ray.tfar = HUGE_VALF;
      ray.ray.mask = UINT32_MAX;
      ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
      rtcIntersect1(world, &rays.context, &ray);
      std::sort(rays.hits.begin(), rays.hits.end());
      for (std::size_t n = 1; n < rays.hits.size(); n += 2)
        inside.push_back({i, j, first(static_cast<double>(ray.ray.org_z + rays.hits[n - 1])),
                          first(static_cast<double>(ray.ray.org_z + rays.hits[n]))});
    }
  rtcReleaseScene(world);
  rtcReleaseDevice(device);
  return inside;
}

void bench_embree(const Scene& scene) {
  double voxels = 0;
  const Times times = measure([&] {
    const std::vector<Interval> inside = embree_rays(scene);
    voxels = 0;
    for (const Interval& run : inside)
      voxels += run.k_end - run.k_begin;
  });
  report(scene, "Embree rays", 1, times, scene.error(voxels),
         peak_mib([&] { embree_rays(scene); }));
}

void bench_vtk(const Scene& scene) {
  const auto path = std::filesystem::temp_directory_path() /
                    ("voxelize-bench-" + std::to_string(getpid()) + ".mesh");
  FILE* file = std::fopen(path.c_str(), "wb");
  if (file == nullptr)
    return;
  const std::uint64_t counts[2] = {scene.mesh.points.size(), scene.mesh.triangles.size()};
  std::fwrite(counts, sizeof counts, 1, file);
  std::fwrite(scene.mesh.points.data(), sizeof(Vec3), scene.mesh.points.size(), file);
  std::fwrite(scene.mesh.triangles.data(), sizeof(Triangle), scene.mesh.triangles.size(), file);
  std::fclose(file);
  char call[512];
  std::snprintf(call, sizeof call, "tests/bench/voxelize_vtk.py '%s' %.17g %d", path.c_str(),
                scene.voxel(), runs);
  std::vector<double> numbers = numbers_of_script(call); // the times, then the voxels
  std::filesystem::remove(path);
  if (numbers.size() == static_cast<std::size_t>(runs) + 1) {
    const double voxels = numbers.back();
    numbers.pop_back();
    report(scene, "VTK stencil", 1, times_of(numbers), voxels > 0 ? scene.error(voxels) : NAN, 0);
  } else
    std::fprintf(stderr, "voxelize %d, VTK stencil: skipped, python3 has no VTK\n", scene.dim);
}

void bench_openvdb(const Scene& scene) {
  std::vector<openvdb::Vec3s> points;
  for (const Vec3& p : scene.mesh.points)
    points.emplace_back(p.x, p.y, p.z);
  std::vector<openvdb::Vec3I> triangles;
  for (const Triangle& t : scene.mesh.triangles)
    triangles.emplace_back(t[0], t[1], t[2]);
  openvdb::FloatGrid::Ptr grid;
  const Times times = measure([&] {
    grid = openvdb::tools::meshToLevelSet<openvdb::FloatGrid>(
        *openvdb::math::Transform::createLinearTransform(scene.voxel()), points, triangles, 3.0F);
  });
  double inside = 0;
  for (auto value = grid->cbeginValueAll(); value; ++value)
    if (*value < 0)
      inside += static_cast<double>(value.getVoxelCount());
  report(scene, "OpenVDB meshToLevelSet", 0, times, scene.error(inside), 0);
}

// ---- ours

void bench_ours(const Scene& scene) {
  // The peaks first: a child may not inherit TBB's threads.
  Context one;
  one.threads = 1;
  InsideScan scan;
  Grid grid;
  const double scan_peak =
      peak_mib([&] { scan = scan_inside(one, scene.mesh, scene.lattice, {}); });
  const double grid_peak = peak_mib([&] { grid = voxelize(one, scene.mesh, scene.lattice, {}); });
  for (const int threads : {1, 2}) {
    Context context;
    context.threads = threads;
    Times times = measure([&] { scan = scan_inside(context, scene.mesh, scene.lattice, {}); });
    report(scene, "voxelize: bits", threads, times, scene.error(voxels_inside(scan)), scan_peak);
    times = measure([&] {
      grid = {}; // not to hold two at once
      grid = voxelize(context, scene.mesh, scene.lattice, {});
    });
    report(scene, "voxelize: grid", threads, times,
           scene.error(volume_stats({}, grid).volume / std::pow(scene.voxel(), 3)), grid_peak);
  }
  std::fprintf(stderr, "voxelize %d: the grid holds %.1f MiB\n", scene.dim,
               static_cast<double>(grid.memory_bytes()) / 0x1p20);
}

TriangleMesh bench_mesh() {
  const std::string path = test::shared_folder() + "/data/gca90_large_intestine_20k.stl";
  if (!std::filesystem::exists(path))
    return test::sphere_mesh(6, 100, {0.1, 0.2, 0.3});
  Input input(path);
  MeshReadOptions options;
  options.kind = Kind::stl;
  return subdivided(read_mesh(input, options));
}

} // namespace

/// Arguments: the sizes (default 128 256 512 1024).
int main(int argc, char** argv) {
  openvdb::initialize();
  std::puts(
      "stage,program,voxel,size,threads,median_ms,fastest_ms,slowest_ms,error,measure,peak_mib");
  std::vector<int> sizes;
  for (int n = 1; n < argc; ++n)
    sizes.push_back(std::atoi(argv[n]));
  if (sizes.empty())
    sizes = {128, 256, 512, 1024};
  const TriangleMesh mesh = bench_mesh();
  std::vector<Scene> scenes;
  for (const int dim : sizes)
    scenes.push_back({mesh, dim, lattice_for_dim(bounding_box(mesh), dim)});
  for (const Scene& scene : scenes) {
    bench_ours(scene);
    bench_embree(scene);
    bench_vtk(scene);
    if (scene.dim <= 256) // beyond it takes tens of seconds a run
      bench_openvdb(scene);
  }
  return 0;
}
