// Error and quality of isosurface meshes: ours over epsilon, both placements and --regularize, and
// peers on the same volumes: CGAL's isotropic remeshing of our unsnapped mesh to the edge length of
// ours at epsilon 0.5; OpenVDB's volumeToMesh; VTK's FlyingEdges3D and scikit-image's
// marching_cubes where $PYTHON (python3) has them.
//
// Volumes: five metaballs at 64³, whose true surface is known; the liver and the colon of
// $GEWEBE_SHARED/data where they are, by exact volume fractions at 96 and 128 voxels, whose true
// surface is the mesh that was voxelised.
//
// CSV on standard output as geometry.cpp writes it: `error` is the mean distance of the points from
// the true surface in voxels. Then: the largest such distance, mean and largest distance of the
// triangles' centroids, points, smallest angle of all and the one at 1 % of the triangles
// (degrees), share of triangles below 10 degrees, longest edge over shortest, explicit time step
// over the voxel edge's square root (mesh/quality.h; comparable between volumes), zero-area faces,
// pairs of triangles that cut each other.

#include "antialiasing/coverage.h"
#include "formats/mesh/mesh_file.h"
#include "mesh/check.h"
#include "mesh/quality.h"
#include "mesh/self_intersections.h"
#include "surface/marching_cubes.h"
#include "surface/regularize.h"
#include "surface/snapping.h"
#include "tests/bench/peer.h"
#include "tests/bench/timing.h"
#include "tests/unit/larger.h"
#include "tests/unit/mesh_fixtures.h"
#include "tests/unit/surface_scenes.h"
#include "volume/lattice.h"

#include <CGAL/AABB_face_graph_triangle_primitive.h>
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/remesh.h>
#include <CGAL/Surface_mesh.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/VolumeToMesh.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

using namespace gewebe;
using namespace gewebe::timing;

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Surface = CGAL::Surface_mesh<Kernel::Point_3>;

constexpr int runs = 3;

Surface cgal_mesh(const TriangleMesh& mesh) {
  Surface surface;
  for (const Vec3& p : mesh.points)
    surface.add_vertex({p.x, p.y, p.z});
  for (const auto& [a, b, c] : mesh.triangles)
    surface.add_face(Surface::Vertex_index(a), Surface::Vertex_index(b), Surface::Vertex_index(c));
  return surface;
}

TriangleMesh from_cgal(const Surface& surface) {
  TriangleMesh mesh;
  std::vector<std::uint32_t> number(surface.num_vertices());
  for (const auto v : surface.vertices()) {
    number[v] = static_cast<std::uint32_t>(mesh.points.size());
    const auto& p = surface.point(v);
    mesh.points.push_back({p.x(), p.y(), p.z()});
  }
  for (const auto f : surface.faces()) {
    Triangle t{};
    std::size_t n = 0;
    for (const auto v : surface.vertices_around_face(surface.halfedge(f)))
      t[n++] = number[v];
    mesh.triangles.push_back(t);
  }
  return mesh;
}

struct Scene {
  std::string name;
  volume::Grid grid;
  std::function<double(const Vec3&)> distance; // mm, from the true surface
  double voxel() const { return grid.info().transform.voxel_size().x; }
};

// ---- true surfaces

/// Distance along the gradient of the exact density, from p to its foot.
double distance_of_balls(const std::vector<scenes::Ball>& balls, const Vec3& p) {
  Vec3 foot = p;
  for (int step = 0; step < 20; ++step) {
    Vec3 gradient;
    for (const scenes::Ball& ball : balls) {
      const Vec3 d = foot - ball.center;
      const double rr = ball.radius * ball.radius, t = dot(d, d) / rr;
      if (t < 1) // of (1-t)² (1 - 4t/9)
        gradient += d * (2 / rr * (-2 * (1 - t) * (1 - 4 * t / 9) - 4.0 / 9 * (1 - t) * (1 - t)));
    }
    foot -= gradient * ((scenes::density(balls, foot) - 0.5) / dot(gradient, gradient));
  }
  return norm(foot - p);
}

std::function<double(const Vec3&)> distance_to_mesh(const TriangleMesh& mesh) {
  using Primitive = CGAL::AABB_face_graph_triangle_primitive<Surface>;
  using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;
  struct Known {
    Surface surface;
    Tree tree;
  };
  const auto known = std::make_shared<Known>();
  known->surface = cgal_mesh(mesh);
  known->tree.insert(faces(known->surface).first, faces(known->surface).second, known->surface);
  known->tree.accelerate_distance_queries();
  return [known](const Vec3& p) {
    return std::sqrt(known->tree.squared_distance({p.x, p.y, p.z}));
  };
}

std::vector<Scene> make_scenes() {
  std::vector<Scene> result;
  const std::vector<scenes::Ball> balls = scenes::five_balls(64, 3);
  result.push_back({"metaballs", scenes::metaballs(64, 3),
                    [balls](const Vec3& p) { return distance_of_balls(balls, p); }});
  struct Organ {
    const char *name, *file, *unit;
    int dim;
  };
  for (const Organ& organ : {Organ{"liver", "sofa_liver_smooth.obj", "cm", 96},
                             Organ{"colon", "gca90_large_intestine_20k.stl", "mm", 128}}) {
    const std::string path = test::shared_folder() + "/data/" + organ.file;
    if (!std::filesystem::exists(path)) {
      (void)std::fprintf(stderr, "surface quality: %s skipped, no such file\n", organ.name);
      continue;
    }
    formats::Input input(path);
    formats::MeshReadOptions options;
    options.kind = path.ends_with("obj") ? formats::Kind::obj : formats::Kind::stl;
    options.unit = organ.unit;
    const TriangleMesh mesh = formats::read_mesh(input, options);
    antialiasing::CoverageReport report;
    std::optional<volume::Grid> grid = antialiasing::exact_coverage(
        {}, mesh, volume::lattice_for_dim(bounding_box(mesh), organ.dim),
        voxelization::OpenMesh::refuse, &report);
    if (grid)
      result.push_back({organ.name, *grid, distance_to_mesh(mesh)});
  }
  return result;
}

// ---- figures

struct Errors {
  double mean = 0, largest = 0;
  void add(double error) {
    mean += error;
    largest = test::larger(largest, error);
  }
};

void report(const Scene& scene, const std::string& program, int threads, const Times& times,
            const TriangleMesh& mesh) {
  Errors points, centroids;
  for (const Vec3& p : mesh.points)
    points.add(scene.distance(p) / scene.voxel());
  for (const auto& [a, b, c] : mesh.triangles)
    centroids.add(scene.distance((mesh.points[a] + mesh.points[b] + mesh.points[c]) / 3) /
                  scene.voxel());
  const mesh::MeshReport shape = mesh::examine_mesh(mesh);
  const mesh::MeshQuality quality = mesh::mesh_quality(mesh);
  std::printf("surface quality of %s,%s,%g,%zu,%d,%.3f,%.3f,%.3f,%.5f,mean distance of points "
              "(voxels),%.4f,%.5f,%.4f,%zu,%.3f,%.2f,%.5f,%.1f,%.4f,%llu,%llu\n",
              scene.name.c_str(), program.c_str(), scene.voxel(), mesh.triangles.size(), threads,
              times.median, times.fastest, times.slowest,
              points.mean / static_cast<double>(mesh.points.size()), points.largest,
              centroids.mean / static_cast<double>(mesh.triangles.size()), centroids.largest,
              mesh.points.size(), shape.smallest_angle, quality.angle_1_percent,
              quality.share_below_10, quality.edge_ratio,
              quality.explicit_step / std::sqrt(scene.voxel()),
              static_cast<unsigned long long>(shape.zero_area_faces),
              static_cast<unsigned long long>(mesh::self_intersections({}, mesh).pairs));
  (void)std::fflush(stdout);
}

// ---- ours

void bench_ours(const Scene& scene) {
  for (const auto place : {surface::SnapOptions::Place::mean, surface::SnapOptions::Place::corner})
    for (const double epsilon : {0.0, 0.05, 0.15, 0.25, 0.35, 0.5})
      for (const int rounds : {0, 3, 10}) {
        if (place == surface::SnapOptions::Place::corner && (rounds > 0 || epsilon == 0))
          continue;
        if (rounds > 0 && epsilon != 0 && epsilon != 0.15 && epsilon != 0.5)
          continue;
        TriangleMesh mesh;
        const Times times = measure(
            [&] {
              mesh =
                  surface::snap({}, surface::marching_cubes({}, scene.grid), {epsilon, place}).mesh;
              surface::regularize({}, scene.grid, scene.grid.info().isovalue, mesh, {rounds});
            },
            runs);
        char name[80];
        std::snprintf(name, sizeof name, "epsilon %g%s%s", epsilon,
                      place == surface::SnapOptions::Place::corner ? " corner" : "",
                      rounds > 0 ? (" regularize " + std::to_string(rounds)).c_str() : "");
        report(scene, name, thread_count({}), times, mesh);
      }
}

// ---- peers

void bench_cgal(const Scene& scene) {
  const surface::IsoSurface surface = surface::marching_cubes({}, scene.grid);
  const double edge = mesh::examine_mesh(surface::snap({}, surface, {0.5}).mesh).edge_mean;
  TriangleMesh mesh;
  const Times times = measure(
      [&] {
        Surface work = cgal_mesh(surface.mesh);
        CGAL::Polygon_mesh_processing::isotropic_remeshing(
            faces(work), edge, work,
            CGAL::Polygon_mesh_processing::parameters::number_of_iterations(3));
        mesh = from_cgal(work);
      },
      1);
  report(scene, "CGAL isotropic remeshing", 1, times, mesh);
}

/// The values in the box of what is active and two voxels more; k fastest.
struct Dense {
  Int3 min{}, size{};
  std::vector<float> values;
};

Dense dense(const volume::Grid& grid) {
  Dense result;
  Int3 max{};
  grid.active_box(result.min, max);
  std::size_t count = 1;
  for (std::size_t a = 0; a < 3; ++a) {
    result.min[a] -= 2;
    result.size[a] = max[a] + 3 - result.min[a];
    count *= static_cast<std::size_t>(result.size[a]);
  }
  result.values.reserve(count);
  volume::GridAccessor values(grid);
  for (int i = 0; i < result.size[0]; ++i)
    for (int j = 0; j < result.size[1]; ++j)
      for (int k = 0; k < result.size[2]; ++k)
        result.values.push_back(
            values.value({result.min[0] + i, result.min[1] + j, result.min[2] + k}));
  return result;
}

void bench_openvdb(const Scene& scene, const Dense& values) {
  const auto grid = openvdb::FloatGrid::create(0);
  auto accessor = grid->getAccessor();
  std::size_t n = 0;
  for (int i = 0; i < values.size[0]; ++i)
    for (int j = 0; j < values.size[1]; ++j)
      for (int k = 0; k < values.size[2]; ++k, ++n)
        if (values.values[n] != 0)
          accessor.setValue({values.min[0] + i, values.min[1] + j, values.min[2] + k},
                            values.values[n]);
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec4I> quads;
  const Times times = measure(
      [&] {
        points.clear();
        quads.clear();
        openvdb::tools::volumeToMesh(*grid, points, quads, scene.grid.info().isovalue);
      },
      runs);
  TriangleMesh mesh;
  for (const auto& p : points)
    mesh.points.push_back(scene.grid.info().transform.to_world(
        {static_cast<double>(p.x()), static_cast<double>(p.y()), static_cast<double>(p.z())}));
  for (const auto& q : quads) {
    mesh.triangles.push_back({q[2], q[1], q[0]});
    mesh.triangles.push_back({q[3], q[2], q[0]});
  }
  report(scene, "OpenVDB volumeToMesh", 0, times, mesh);
}

void bench_python(const Scene& scene, const Dense& values, const char* peer, const char* name) {
  const auto path = std::filesystem::temp_directory_path() /
                    ("surface-bench-" + std::to_string(getpid()) + ".mesh");
  {
    std::ofstream file(path, std::ios::binary);
    const double isovalue = scene.grid.info().isovalue;
    file.write(reinterpret_cast<const char*>(values.size.data()), sizeof values.size);
    file.write(reinterpret_cast<const char*>(&isovalue), sizeof isovalue);
    file.write(reinterpret_cast<const char*>(values.values.data()),
               static_cast<std::streamsize>(values.values.size() * sizeof(float)));
  }
  const std::vector<double> times =
      numbers_of_script("tests/bench/surface_quality_peers.py " + std::string(peer) + " '" +
                        path.string() + "' " + std::to_string(runs));
  if (times.size() == static_cast<std::size_t>(runs)) {
    std::ifstream file(path, std::ios::binary);
    std::uint64_t counts[2] = {};
    file.read(reinterpret_cast<char*>(counts), sizeof counts);
    TriangleMesh mesh;
    mesh.points.resize(counts[0]);
    mesh.triangles.resize(counts[1]);
    file.read(reinterpret_cast<char*>(mesh.points.data()),
              static_cast<std::streamsize>(counts[0] * sizeof(Vec3)));
    file.read(reinterpret_cast<char*>(mesh.triangles.data()),
              static_cast<std::streamsize>(counts[1] * sizeof(Triangle)));
    for (Vec3& p : mesh.points)
      p = scene.grid.info().transform.to_world(
          p + Vec3{1.0 * values.min[0], 1.0 * values.min[1], 1.0 * values.min[2]});
    report(scene, name, 1, times_of(times), mesh);
  } else {
    (void)std::fprintf(stderr, "surface quality of %s, %s: skipped, python has none\n",
                       scene.name.c_str(), name);
  }
  std::filesystem::remove(path);
}

} // namespace

int main() {
  openvdb::initialize();
  std::puts("stage,program,voxel,size,threads,median_ms,fastest_ms,slowest_ms,error,measure,"
            "point_largest,centroid_mean,centroid_largest,points,angle_smallest,angle_1_percent,"
            "below_10,edge_ratio,explicit_step,zero_area,self_intersections");
  for (const Scene& scene : make_scenes()) {
    bench_ours(scene);
    bench_cgal(scene);
    const Dense values = dense(scene.grid);
    bench_openvdb(scene, values);
    bench_python(scene, values, "vtk", "VTK FlyingEdges3D");
    bench_python(scene, values, "skimage", "scikit-image marching_cubes");
  }
  return 0;
}
