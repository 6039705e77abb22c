// Speed of voxelization: a patient's colon, each triangle cut into four (a ball where there is no
// shared data), at 128 to 1024 voxels, with the peers on the same input in the same run: Embree,
// one ray per column of voxels, alone with its robust tests and in coherent packets without; VTK's
// image stencil, where python3 has VTK; OpenVDB's level set.
// Each time is of the whole call without reading files; all results are sparse.
//
// Writes CSV to standard output as geometry.cpp does, and the peak of memory that one call adds to
// the process, in MiB (0: not measured).

#include "voxelization/voxelize.h"
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

constexpr int runs = 7;

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
  volume::GridTransform lattice;
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

double voxels_inside(const voxelization::InsideScan& scan) {
  double sum = 0;
  for (const auto& leaf : scan.bits)
    for (const std::uint64_t word : leaf)
      sum += std::popcount(word);
  for (const volume::TileView& t : scan.tiles)
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
  std::vector<float> hits[16]; ///< by the ray's number in its packet
};

void keep_hit(const RTCFilterFunctionNArguments* arguments) {
  for (unsigned n = 0; n < arguments->N; ++n) {
    if (arguments->valid[n] == 0)
      continue;
    auto& hits = reinterpret_cast<RayContext*>(arguments->context)->hits;
    hits[RTCRayN_id(arguments->ray, arguments->N, n)].push_back(
        RTCRayN_tfar(arguments->ray, arguments->N, n));
    arguments->valid[n] = 0; // and on along the ray
  }
}

/// The mesh in an Embree of one thread.
class EmbreeScene {
public:
  EmbreeScene(const Scene& scene, bool robust)
      : device_(rtcNewDevice("threads=1")), world_(rtcNewScene(device_)) {
    unsigned flags = RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION;
    if (robust)
      flags |= RTC_SCENE_FLAG_ROBUST;
    rtcSetSceneFlags(world_, static_cast<RTCSceneFlags>(flags));
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* points = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                               RTC_FORMAT_FLOAT3, 3 * sizeof(float),
                                                               scene.mesh.points.size()));
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
    rtcAttachGeometry(world_, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(world_);
  }
  EmbreeScene(const EmbreeScene&) = delete;
  EmbreeScene& operator=(const EmbreeScene&) = delete;
  ~EmbreeScene() {
    rtcReleaseScene(world_);
    rtcReleaseDevice(device_);
  }
  RTCScene world() const { return world_; }

  Box3 box; ///< of the mesh, in voxels

private:
  RTCDevice device_;
  RTCScene world_;
};

std::int32_t first_voxel(double x) {
  return static_cast<std::int32_t>(std::ceil(x));
}

/// All hits of a column, sorted and paired.
void take(std::vector<float>& hits, float from, std::int32_t i, std::int32_t j,
          std::vector<Interval>& inside) {
  std::sort(hits.begin(), hits.end());
  for (std::size_t n = 1; n < hits.size(); n += 2)
    inside.push_back({i, j, first_voxel(static_cast<double>(from + hits[n - 1])),
                      first_voxel(static_cast<double>(from + hits[n]))});
  hits.clear();
}

/// One ray along each column of voxel centres.
std::vector<Interval> embree_rays(const Scene& scene) {
  const EmbreeScene embree(scene, true);
  std::vector<Interval> inside;
  RayContext rays;
  rtcInitIntersectContext(&rays.context);
  rays.context.filter = keep_hit;
  const Box3& box = embree.box;
  for (std::int32_t i = first_voxel(box.min.x); i < first_voxel(box.max.x); ++i)
    for (std::int32_t j = first_voxel(box.min.y); j < first_voxel(box.max.y); ++j) {
      RTCRayHit ray{};
      ray.ray.org_x = static_cast<float>(i);
      ray.ray.org_y = static_cast<float>(j);
      ray.ray.org_z = static_cast<float>(box.min.z - 1);
      ray.ray.dir_z = 1;
      ray.ray.tfar = HUGE_VALF;
      ray.ray.mask = UINT32_MAX;
      ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
      rtcIntersect1(embree.world(), &rays.context, &ray);
      take(rays.hits[0], ray.ray.org_z, i, j, inside);
    }
  return inside;
}

void intersect(const int* valid, RTCScene world, RTCIntersectContext* context, RTCRayHit8* rays) {
  rtcIntersect8(valid, world, context, rays);
}
void intersect(const int* valid, RTCScene world, RTCIntersectContext* context, RTCRayHit16* rays) {
  rtcIntersect16(valid, world, context, rays);
}

/// The same by coherent packets of columns that lie in a row, without Embree's robust tests.
template <class Packet, int width>
std::vector<Interval> embree_packets(const Scene& scene) {
  const EmbreeScene embree(scene, false);
  std::vector<Interval> inside;
  RayContext rays;
  rtcInitIntersectContext(&rays.context);
  rays.context.filter = keep_hit;
  rays.context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  const Box3& box = embree.box;
  const std::int32_t stop = first_voxel(box.max.y);
  for (std::int32_t i = first_voxel(box.min.x); i < first_voxel(box.max.x); ++i)
    for (std::int32_t j = first_voxel(box.min.y); j < stop; j += width) {
      alignas(64) Packet packet{};
      alignas(64) int valid[width];
      for (int n = 0; n < width; ++n) {
        valid[n] = j + n < stop ? -1 : 0;
        packet.ray.org_x[n] = static_cast<float>(i);
        packet.ray.org_y[n] = static_cast<float>(j + n);
        packet.ray.org_z[n] = static_cast<float>(box.min.z - 1);
        packet.ray.dir_z[n] = 1;
        packet.ray.tfar[n] = HUGE_VALF;
        packet.ray.mask[n] = UINT32_MAX;
        packet.ray.id[n] = static_cast<unsigned>(n);
        packet.hit.geomID[n] = RTC_INVALID_GEOMETRY_ID;
      }
      intersect(valid, embree.world(), &rays.context, &packet);
      for (int n = 0; n < width && j + n < stop; ++n)
        take(rays.hits[n], packet.ray.org_z[n], i, j + n, inside);
    }
  return inside;
}

void bench_embree(const Scene& scene) {
  using Rays = std::function<std::vector<Interval>(const Scene&)>;
  const std::pair<const char*, Rays> ways[] = {
      {"Embree rays", embree_rays},
      {"Embree packets of 8", embree_packets<RTCRayHit8, 8>},
      {"Embree packets of 16", embree_packets<RTCRayHit16, 16>}};
  for (const auto& [name, way] : ways) {
    double voxels = 0;
    const Times times = measure([&] {
      const std::vector<Interval> inside = way(scene);
      voxels = 0;
      for (const Interval& run : inside)
        voxels += run.k_end - run.k_begin;
    });
    report(scene, name, 1, times, scene.error(voxels), peak_mib([&] { (void)way(scene); }));
  }
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
  voxelization::InsideScan scan;
  volume::Grid grid;
  const double scan_peak =
      peak_mib([&] { scan = voxelization::scan_inside(one, scene.mesh, scene.lattice, {}); });
  const double grid_peak =
      peak_mib([&] { grid = voxelization::voxelize(one, scene.mesh, scene.lattice, {}); });
  for (const int threads : {1, 2}) {
    Context context;
    context.threads = threads;
    Times times =
        measure([&] { scan = voxelization::scan_inside(context, scene.mesh, scene.lattice, {}); });
    report(scene, "voxelize: bits", threads, times, scene.error(voxels_inside(scan)), scan_peak);
    times = measure([&] {
      grid = {}; // not to hold two at once
      grid = voxelization::voxelize(context, scene.mesh, scene.lattice, {});
    });
    report(scene, "voxelize: grid", threads, times,
           scene.error(volume::volume_stats({}, grid).volume / std::pow(scene.voxel(), 3)),
           grid_peak);
  }
  std::fprintf(stderr, "voxelize %d: the grid holds %.1f MiB\n", scene.dim,
               static_cast<double>(grid.memory_bytes()) / 0x1p20);
}

TriangleMesh bench_mesh() {
  const std::string path = test::shared_folder() + "/data/gca90_large_intestine_20k.stl";
  if (!std::filesystem::exists(path))
    return test::sphere_mesh(6, 100, {0.1, 0.2, 0.3});
  formats::Input input(path);
  formats::MeshReadOptions options;
  options.kind = formats::Kind::stl;
  return subdivided(formats::read_mesh(input, options));
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
    scenes.push_back({mesh, dim, volume::lattice_for_dim(bounding_box(mesh), dim)});
  for (const Scene& scene : scenes) {
    bench_ours(scene);
    bench_embree(scene);
    bench_vtk(scene);
    if (scene.dim <= 256) // beyond it takes tens of seconds a run
      bench_openvdb(scene);
  }
  return 0;
}
