// Tetrahedra of a volume in memory: time, angles, distance from the isosurface and memory of ours,
// over their number, and beside peers at about as many: CGAL's Mesh_3 on the same volume, with and
// without its optimisers; TetGen (Debian's program, -pq) and fTetWild (pytetwild, where $PYTHON has
// it), which fill a surface, on ours at edges of about a cell. What peers take for reading and
// writing is not counted, nor what making that surface takes.
//
// Volumes: five metaballs at 64³; the liver of $GEWEBE_SHARED/data where it is, by exact volume
// fractions at 96 voxels.
//
// CSV on standard output as geometry.cpp writes it: `cell` in mm, `size` counts tetrahedra, `error`
// is the mean distance of the boundary's triangles from the isosurface in cells. Then: the largest
// such distance, smallest and largest dihedral angle, radius-edge ratio, points, MiB that it took
// at most. Rows "times of ours" hold a peer's time over that of ours on two threads; rows "over
// tetrahedra" are for scripts/plot.
//
// Arguments: some of size, cgal, tetgen, ftetwild, all where there are none; and few, which leaves
// out the larger number of tetrahedra.

#include "antialiasing/coverage.h"
#include "formats/mesh/mesh_file.h"
#include "formats/tetrahedra/tet_file.h"
#include "stuffing/stuffing.h"
#include "stuffing/surface_distance.h"
#include "surface/marching_cubes.h"
#include "surface/snapping.h"
#include "tests/bench/peer.h"
#include "tests/bench/timing.h"
#include "tests/unit/mesh_fixtures.h"
#include "tests/unit/surface_scenes.h"
#include "tetrahedra/boundary.h"
#include "tetrahedra/check.h"
#include "tetrahedra/quality.h"
#include "volume/field.h"
#include "volume/lattice.h"
#include "volume/resample.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Labeled_mesh_domain_3.h>
#include <CGAL/Mesh_complex_3_in_triangulation_3.h>
#include <CGAL/Mesh_criteria_3.h>
#include <CGAL/Mesh_triangulation_3.h>
#include <CGAL/make_mesh_3.h>
#include <malloc.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

using namespace gewebe;
using namespace gewebe::timing;

namespace {

struct Scene {
  std::string name;
  volume::Grid grid;
  double volume = 0; ///< mm³
  /// Of cells, each of 12 tetrahedra, of which so many fill it.
  double cell(double tetrahedra) const { return std::cbrt(12 * volume / tetrahedra); }
};

std::vector<Scene> make_scenes() {
  std::vector<Scene> result{{"metaballs", scenes::metaballs(64, 3), 0}};
  const std::string path = test::shared_folder() + "/data/sofa_liver_smooth.obj";
  if (std::filesystem::exists(path)) {
    formats::Input input(path);
    formats::MeshReadOptions options;
    options.kind = formats::Kind::obj;
    options.unit = "cm";
    const TriangleMesh mesh = formats::read_mesh(input, options);
    antialiasing::CoverageReport report;
    const std::optional<volume::Grid> grid =
        antialiasing::exact_coverage({}, mesh, volume::lattice_for_dim(bounding_box(mesh), 96),
                                     voxelization::OpenMesh::refuse, &report);
    if (grid)
      result.push_back({"liver", *grid, 0});
  } else {
    (void)std::fputs("stuffing: liver skipped, no such file\n", stderr);
  }
  for (Scene& scene : result)
    scene.volume = signed_volume(surface::marching_cubes({}, scene.grid).mesh);
  return result;
}

/// MiB that the process holds at most while `work` runs, beyond what it held before.
double peak_mib(const std::function<void()>& work) {
  const auto status = [](const char* key) {
    std::ifstream file("/proc/self/status");
    for (std::string line; std::getline(file, line);)
      if (line.starts_with(key))
        return std::strtod(line.c_str() + std::string(key).size(), nullptr) / 1024;
    return 0.0;
  };
  (void)malloc_trim(0);
  std::ofstream("/proc/self/clear_refs") << "5"; // forgets the peak
  const double before = status("VmRSS:");
  work();
  return status("VmHWM:") - before;
}

/// What was measured of one program.
struct Run {
  std::string program;
  int threads = 1;
  double cell = 0; ///< mm
  Times times{};
  double mib = 0;
  tetrahedra::TetMesh mesh;
};

void row(const std::string& stage, const Run& run, double first, double figure, const char* measure,
         const std::string& rest = ",,,,,") {
  std::printf("%s,%s,%g,%zu,%d,%.3f,%.3f,%.3f,%.5g,%s,%s\n", stage.c_str(), run.program.c_str(),
              first, run.mesh.tetrahedra.size(), run.threads, run.times.median, run.times.fastest,
              run.times.slowest, figure, measure, rest.c_str());
  (void)std::fflush(stdout);
}

void report(const Scene& scene, Run& run) {
  // Peers' files may hold points of no tetrahedron, and tetrahedra without volume.
  (void)tetrahedra::repair_tetrahedra(run.mesh);
  const tetrahedra::TetBoundary surface = tetrahedra::boundary(run.mesh);
  const tetrahedra::TetQuality quality = tetrahedra::tet_quality(run.mesh, surface);
  const stuffing::SurfaceDistance distance =
      stuffing::surface_distance({}, scene.grid, {{}, run.cell}, surface.mesh);
  char rest[120];
  (void)std::snprintf(rest, sizeof rest, "%.4f,%.2f,%.2f,%.3f,%zu,%.0f",
                      distance.largest / run.cell, quality.smallest_angle, quality.largest_angle,
                      quality.radius_edge_ratio, run.mesh.points.size(), run.mib);
  row("tetrahedra of " + scene.name, run, run.cell, distance.mean / run.cell,
      "mean distance of triangles (cells)", rest);
}

/// Several runs of what is quick, one of what takes over three seconds.
Times measure_some(const std::function<void()>& work) {
  std::vector<double> times{milliseconds(work)};
  while (times.size() < 5 && times.front() < 3000)
    times.push_back(milliseconds(work));
  return times_of(times);
}

Run ours(const Scene& scene, double cell, int threads) {
  Run run{"ours", threads, cell, {}, 0, {}};
  const auto work = [&] {
    run.mesh = stuffing::stuff(with_threads(threads), scene.grid, {{}, cell});
  };
  run.mib = peak_mib(work);
  run.times = measure_some(work);
  return run;
}

void bench_size(const Scene& scene) {
  for (const double wanted : {1e4, 3e4, 1e5, 3e5, 1e6, 3e6})
    for (const int threads : {1, 2}) {
      Run run = ours(scene, scene.cell(wanted), threads);
      report(scene, run);
      const auto count = static_cast<double>(run.mesh.tetrahedra.size());
      run.program += " " + scene.name;
      row("time over tetrahedra (log)", run, count, run.times.median, "ms");
      row("memory over tetrahedra (log)", run, count, run.mib, "MiB");
    }
}

void compare(const Scene& scene, const Run& peer, const Run& reference) {
  row("tetrahedra of " + scene.name + " times of ours", peer, peer.cell,
      peer.times.median / reference.times.median, "times of ours");
}

// ---- CGAL

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Domain = CGAL::Labeled_mesh_domain_3<Kernel>;
using Triangulation = CGAL::Mesh_triangulation_3<Domain>::type;
using Complex = CGAL::Mesh_complex_3_in_triangulation_3<Triangulation>;
using Criteria = CGAL::Mesh_criteria_3<Triangulation>;

tetrahedra::TetMesh from_cgal(const Complex& complex) {
  tetrahedra::TetMesh mesh;
  std::map<Triangulation::Vertex_handle, std::uint32_t> number;
  for (auto cell = complex.cells_in_complex_begin(); cell != complex.cells_in_complex_end();
       ++cell) {
    Tetrahedron t{};
    for (int k = 0; k < 4; ++k) {
      const auto vertex = cell->vertex(k);
      const auto [at, fresh] =
          number.try_emplace(vertex, static_cast<std::uint32_t>(mesh.points.size()));
      if (fresh)
        mesh.points.push_back({vertex->point().x(), vertex->point().y(), vertex->point().z()});
      t[static_cast<std::size_t>(k)] = at->second;
    }
    mesh.tetrahedra.push_back(t);
  }
  return mesh;
}

/// A place far inside, and the diagonal of the box of what is not background.
struct Extent {
  Vec3 center;
  double diagonal = 0;
};

Extent extent_of(const volume::Grid& grid) {
  volume::Field field(grid);
  const volume::GridTransform& transform = grid.info().transform;
  Int3 low{}, high{};
  (void)grid.active_box(low, high);
  Box3 box;
  for (int corner = 0; corner < 8; ++corner)
    box.add(transform.to_world({static_cast<double>((corner & 1) != 0 ? high[0] : low[0]),
                                static_cast<double>((corner & 2) != 0 ? high[1] : low[1]),
                                static_cast<double>((corner & 4) != 0 ? high[2] : low[2])}));
  Extent extent{{}, norm(box.size())};
  std::optional<double> best;
  for (const volume::LeafView& leaf : grid.leaves()) {
    const Vec3 index{leaf.origin[0] + 4.0, leaf.origin[1] + 4.0, leaf.origin[2] + 4.0};
    const double value = field.value(index);
    if (!best || value > *best) {
      best = value;
      extent.center = transform.to_world(index);
    }
  }
  return extent;
}

void bench_cgal(const Scene& scene, const Run& reference) {
  namespace p = CGAL::parameters;
  volume::Field field(scene.grid);
  const volume::GridInfo& info = scene.grid.info();
  const Extent extent = extent_of(scene.grid);
  const auto value = [&](const Kernel::Point_3& at) {
    return info.isovalue - field.value(info.transform.to_index({at.x(), at.y(), at.z()}));
  };
  const Kernel::Sphere_3 sphere({extent.center.x, extent.center.y, extent.center.z},
                                extent.diagonal * extent.diagonal);
  const Domain domain =
      Domain::create_implicit_mesh_domain(value, sphere, p::relative_error_bound = 1e-6);
  double size = reference.cell;
  const auto mesh_with = [&](bool optimised) {
    const Criteria criteria(p::facet_angle = 30, p::facet_size = size,
                            p::facet_distance = size / 20, p::cell_radius_edge_ratio = 2,
                            p::cell_size = size);
    return optimised ? CGAL::make_mesh_3<Complex>(domain, criteria)
                     : CGAL::make_mesh_3<Complex>(domain, criteria, p::no_perturb(), p::no_exude());
  };
  const auto wanted = static_cast<double>(reference.mesh.tetrahedra.size());
  for (int round = 0; round < 3; ++round) {
    const double ratio =
        static_cast<double>(mesh_with(false).number_of_cells_in_complex()) / wanted;
    if (std::fabs(ratio - 1) < 0.03)
      break;
    size *= std::cbrt(ratio);
  }
  for (const bool optimised : {false, true}) {
    if (optimised && wanted > 1e5) // its exuder takes minutes
      continue;
    Complex complex;
    Run run{optimised ? "CGAL Mesh_3" : "CGAL Mesh_3 without perturb and exude",
            1,
            reference.cell,
            {},
            0,
            {}};
    run.mib = peak_mib([&] { run.times = measure_some([&] { complex = mesh_with(optimised); }); });
    run.mesh = from_cgal(complex);
    report(scene, run);
    compare(scene, run, reference);
  }
}

// ---- from a surface

/// Our surface at edges of about a cell, as OFF.
void write_surface(const Scene& scene, double cell, const std::filesystem::path& path) {
  surface::SnapOptions options;
  options.epsilon = 0.5;
  const volume::Grid coarse = volume::resample({}, scene.grid, volume::uniform_transform(cell));
  const TriangleMesh mesh =
      surface::snap({}, surface::marching_cubes_to_snap({}, coarse), options).mesh;
  std::ofstream file(path);
  file.precision(17);
  file << "OFF\n" << mesh.points.size() << " " << mesh.triangles.size() << " 0\n";
  for (const Vec3& p : mesh.points)
    file << p.x << " " << p.y << " " << p.z << "\n";
  for (const auto& [a, b, c] : mesh.triangles)
    file << "3 " << a << " " << b << " " << c << "\n";
}

struct Shell {
  std::string output;
  double mib = 0; ///< of the largest of its processes
};

/// What a command prints.
Shell shell(const std::string& command, const std::filesystem::path& log) {
  Shell result;
  const pid_t child = fork();
  if (child == 0) {
    execlp("sh", "sh", "-c", (command + " > '" + log.string() + "' 2>&1").c_str(), nullptr);
    _exit(127);
  }
  int status = 0;
  rusage usage{};
  if (child < 0 || wait4(child, &status, 0, &usage) != child || status != 0)
    return result;
  std::ostringstream text;
  text << std::ifstream(log).rdbuf();
  result.output = text.str();
  result.mib = static_cast<double>(usage.ru_maxrss) / 1024;
  return result;
}

tetrahedra::TetMesh read_tetrahedra(const std::filesystem::path& path, formats::Kind kind) {
  formats::Input input(path.string());
  formats::TetReadOptions options;
  options.kind = kind;
  return formats::read_tet_mesh(input, options);
}

bool near(const Run& run, const Run& reference) {
  const double ratio = static_cast<double>(run.mesh.tetrahedra.size()) /
                       static_cast<double>(reference.mesh.tetrahedra.size());
  return std::fabs(ratio - 1) < 0.05;
}

/// Its own clock, ms, without reading and writing; nothing if it made no mesh.
std::optional<double> run_tetgen(const std::filesystem::path& folder, double largest, Run& run) {
  char command[400];
  (void)std::snprintf(command, sizeof command, "cd '%s' && tetgen -pqa%.6f surface.off",
                      folder.c_str(), largest);
  const Shell made = shell(command, folder / "log");
  const auto seconds = [&](const std::string& key) -> std::optional<double> {
    const std::size_t at = made.output.find(key);
    if (at == std::string::npos)
      return std::nullopt;
    return std::strtod(made.output.c_str() + at + key.size(), nullptr);
  };
  const std::optional<double> total = seconds("Total running seconds:"),
                              output = seconds("Output seconds:");
  if (!total || !output)
    return std::nullopt;
  run.mib = made.mib;
  return 1e3 * (*total - *output);
}

void bench_tetgen(const Scene& scene, const Run& reference, const std::filesystem::path& folder) {
  const auto wanted = static_cast<double>(reference.mesh.tetrahedra.size());
  Run run{"TetGen -pq", 1, reference.cell, {}, 0, {}};
  double largest = 1.5 * scene.volume / wanted; // volume of one
  std::optional<double> time;
  for (int round = 0; round < 6; ++round) {
    time = run_tetgen(folder, largest, run);
    if (!time) {
      (void)std::fprintf(stderr, "tetrahedra of %s, TetGen: skipped, no program or no mesh\n",
                         scene.name.c_str());
      return;
    }
    run.mesh = read_tetrahedra(folder / "surface.1.node", formats::Kind::tetgen);
    if (near(run, reference))
      break;
    largest *= static_cast<double>(run.mesh.tetrahedra.size()) / wanted;
  }
  std::vector<double> times{*time};
  while (times.size() < 5 && times.front() < 3000)
    times.push_back(run_tetgen(folder, largest, run).value_or(times.front()));
  run.times = times_of(times);
  report(scene, run);
  compare(scene, run, reference);
}

void bench_ftetwild(const Scene& scene, const Run& reference, const std::filesystem::path& folder) {
  Run run{"fTetWild", 2, reference.cell, {}, 0, {}};
  double edge = reference.cell;
  for (int round = 0; round < 5; ++round) {
    const std::vector<double> figures = numbers_of_script(
        "tests/bench/stuffing_ftetwild.py '" + (folder / "surface.off").string() + "' '" +
        (folder / "ftetwild.mesh").string() + "' " + std::to_string(edge));
    if (figures.size() != 2) {
      (void)std::fprintf(stderr, "tetrahedra of %s, fTetWild: skipped, python has no pytetwild\n",
                         scene.name.c_str());
      return;
    }
    run.times = times_of({figures[0]});
    run.mib = figures[1];
    run.mesh = read_tetrahedra(folder / "ftetwild.mesh", formats::Kind::medit);
    if (near(run, reference))
      break;
    edge *= std::cbrt(static_cast<double>(run.mesh.tetrahedra.size()) /
                      static_cast<double>(reference.mesh.tetrahedra.size()));
  }
  report(scene, run);
  compare(scene, run, reference);
}

} // namespace

int main(int argc, char** argv) {
  const auto wanted = [&](const char* name) {
    return argc == 1 || std::any_of(argv + 1, argv + argc,
                                    [&](const char* word) { return std::string(word) == name; });
  };
  std::puts("stage,program,cell,size,threads,median_ms,fastest_ms,slowest_ms,error,measure,"
            "distance_largest,angle_smallest,angle_largest,radius_edge_ratio,points,memory_mib");
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("gewebe-tetrahedra-" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  for (const Scene& scene : make_scenes()) {
    for (const double count : {3e4, 3e5}) {
      if (count > 1e5 && argc > 1 && wanted("few"))
        continue;
      Run reference = ours(scene, scene.cell(count), 2);
      report(scene, reference);
      write_surface(scene, reference.cell, folder / "surface.off");
      if (wanted("cgal"))
        bench_cgal(scene, reference);
      if (wanted("tetgen"))
        bench_tetgen(scene, reference, folder);
      if (wanted("ftetwild") && count < 1e5) // minutes for more
        bench_ftetwild(scene, reference, folder);
    }
    if (wanted("size"))
      bench_size(scene);
  }
  std::filesystem::remove_all(folder);
  return 0;
}
