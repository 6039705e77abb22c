// Work against error of the grey values of voxelization at 128³: the fraction of each voxel, the
// volume, and the place of the isosurface after marching cubes, for every filter and for the
// report's own way done literally (a volume of 768³ scaled to 128³). One thread; whole calls, from
// the mesh to the sparse volume. CSV on standard output: stage, program, voxel (mm), size
// (triangles), threads, median and spread of the times, error (what it means stands in `measure`).
//
// `bench_antialias FOLDER` draws in place of that a slice of each volume, FOLDER/MESH-FILTER.png.
//
// Meshes are the liver and the colon of $GEWEBE_SHARED/data where they are, else made ones.

#include "antialiasing/coverage.h"
#include "antialiasing/distance_band_internal.h"
#include "antialiasing/distance_ramp.h"
#include "formats/image/image_file.h"
#include "formats/mesh/mesh_file.h"
#include "surface/marching_cubes.h"
#include "tests/bench/timing.h"
#include "tests/unit/larger.h"
#include "tests/unit/mesh_fixtures.h"
#include "volume/lattice.h"
#include "volume/volume_stats.h"
#include "voxelization/voxelize.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>

using namespace gewebe;
using namespace gewebe::timing;

namespace {

constexpr int dim = 128, report_samples = 6, runs = 7;

const Context one_thread = [] {
  Context context;
  context.threads = 1;
  return context;
}();

struct Filter {
  std::string name;
  std::function<volume::Grid()> work;
  volume::Grid grid;
};

/// Runs all filters in turn, round by round, so that a busy machine is busy for all of them. Times
/// are the processor's for this one thread: other programs don't count.
std::vector<Times> measure(std::vector<Filter>& filters) {
  const auto now = [] { return 1e3 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC; };
  std::vector<std::vector<double>> times(filters.size());
  for (int run = 0; run < runs; ++run)
    for (std::size_t n = 0; n < filters.size(); ++n) {
      filters[n].grid = volume::Grid();
      const double start = now();
      filters[n].grid = filters[n].work();
      times[n].push_back(now() - start);
    }
  std::vector<Times> result;
  for (auto& t : times)
    result.push_back(times_of(std::move(t)));
  return result;
}

// ---- the report's way

/// Adds count samples of value 1 along k from fine index k on to row (i, j) of the coarse counts.
class Counts {
public:
  Counts(const Int3& min, const Int3& max) : min_(min) {
    for (std::size_t a = 0; a < 3; ++a)
      size_[a] = static_cast<std::size_t>(max[a] - min[a] + 1);
    counts_.assign(size_[0] * size_[1] * size_[2], 0);
  }
  std::uint8_t* row(std::int32_t i, std::int32_t j) {
    return &counts_[(static_cast<std::size_t>(i - min_[0]) * size_[1] +
                     static_cast<std::size_t>(j - min_[1])) *
                    size_[2]];
  }
  std::int32_t k_min() const { return min_[2]; }

private:
  Int3 min_;
  std::array<std::size_t, 3> size_{};
  std::vector<std::uint8_t> counts_;
};

std::int32_t coarse(std::int32_t fine) {
  return fine / report_samples - (fine % report_samples < 0 ? 1 : 0);
}

/// The binary volume at 768³, then the means of 6³ of its voxels, as section 4.1 of the report
/// says.
volume::Grid literally(const TriangleMesh& mesh, const volume::GridTransform& lattice) {
  volume::GridTransform fine = lattice; // sample f at (f + ½)/6 - ½
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t a = 0; a < 3; ++a) {
      fine.m[4 * row + 3] += lattice.m[4 * row + a] * (0.5 / report_samples - 0.5);
      fine.m[4 * row + a] /= report_samples;
    }
  }
  const volume::Grid grid = voxelization::voxelize(one_thread, mesh, fine, {});
  Int3 min{}, max{};
  volume::GridInfo info;
  info.transform = lattice;
  volume::GridBuilder builder(info);
  if (!grid.active_box(min, max))
    return builder.finish();
  Int3 low{}, high{};
  for (std::size_t a = 0; a < 3; ++a) {
    low[a] = coarse(min[a]) & ~7;
    high[a] = coarse(max[a]) | 7;
  }
  Counts counts(low, high);
  const auto add_cube = [&](const Int3& origin, std::int32_t cube, auto&& value) {
    for (std::int32_t i = 0; i < cube; ++i)
      for (std::int32_t j = 0; j < cube; ++j) {
        std::uint8_t* const row = counts.row(coarse(origin[0] + i), coarse(origin[1] + j));
        std::int32_t at = coarse(origin[2]);
        std::int32_t left = (at + 1) * report_samples - origin[2];
        for (std::int32_t k = 0; k < cube; ++k) {
          row[at - counts.k_min()] =
              static_cast<std::uint8_t>(row[at - counts.k_min()] + value(i, j, k));
          if (--left == 0) {
            ++at;
            left = report_samples;
          }
        }
      }
  };
  for (const volume::TileView& tile : grid.tiles())
    add_cube(tile.origin, tile.dim, [](std::int32_t, std::int32_t, std::int32_t) { return 1; });
  for (const volume::LeafView& leaf : grid.leaves())
    add_cube(leaf.origin, volume::leaf_dim, [&](std::int32_t i, std::int32_t j, std::int32_t k) {
      return leaf.values[64 * i + 8 * j + k] > 0.5f ? 1 : 0;
    });
  std::vector<Int3> origins;
  for (std::int32_t i = low[0]; i < high[0]; i += volume::leaf_dim)
    for (std::int32_t j = low[1]; j < high[1]; j += volume::leaf_dim)
      for (std::int32_t k = low[2]; k < high[2]; k += volume::leaf_dim)
        origins.push_back({i, j, k});
  constexpr int full = report_samples * report_samples * report_samples;
  for (const volume::LeafRef& leaf : builder.add_leaves(one_thread, origins))
    for (std::int32_t v = 0; v < volume::leaf_voxels; ++v) {
      const std::uint8_t count =
          counts.row(leaf.origin[0] + (v >> 6),
                     leaf.origin[1] + (v >> 3 & 7))[leaf.origin[2] + (v & 7) - counts.k_min()];
      leaf.values[v] = static_cast<float>(count) / static_cast<float>(full);
      leaf.active[v >> 6] |= static_cast<std::uint64_t>(count > 0) << (v & 63);
    }
  return builder.finish();
}

// ---- errors

struct Range {
  Int3 min, max;
};

Range range_of(const TriangleMesh& mesh, const volume::GridTransform& lattice) {
  Range range{{INT32_MAX, INT32_MAX, INT32_MAX}, {INT32_MIN, INT32_MIN, INT32_MIN}};
  for (const Vec3& point : mesh.points) {
    const Vec3 p = lattice.to_index(point);
    for (int a = 0; a < 3; ++a) {
      const auto s = static_cast<std::size_t>(a);
      range.min[s] = test::smaller(range.min[s], static_cast<std::int32_t>(std::floor(p[a])) - 3);
      range.max[s] = test::larger(range.max[s], static_cast<std::int32_t>(std::ceil(p[a])) + 3);
    }
  }
  return range;
}

struct Error2 {
  double mean = 0, max = 0;
};

/// Difference of all voxels; the mean is over those that the surface meets.
Error2 fraction_error(const Range& range, const std::function<double(const Int3&)>& tested,
                      const std::function<double(const Int3&)>& exact) {
  Error2 error;
  double surface = 0;
  for (std::int32_t i = range.min[0]; i <= range.max[0]; ++i)
    for (std::int32_t j = range.min[1]; j <= range.max[1]; ++j)
      for (std::int32_t k = range.min[2]; k <= range.max[2]; ++k) {
        const double wanted = exact({i, j, k});
        const double difference = std::fabs(tested({i, j, k}) - wanted);
        surface += wanted > 0 && wanted < 1 ? 1 : 0;
        error.mean += difference;
        error.max = test::larger(error.max, difference);
      }
  error.mean /= surface;
  return error;
}

std::function<double(const Int3&)> values_of(const volume::Grid& grid) {
  return [accessor = std::make_shared<volume::GridAccessor>(grid)](const Int3& ijk) {
    return static_cast<double>(accessor->value(ijk));
  };
}

/// Distances to a mesh of points that are near it, in voxels.
class Distances {
public:
  Distances(const TriangleMesh& mesh, const volume::GridTransform& lattice)
      : triangles_(mesh.triangles), lattice_(lattice) {
    for (const Vec3& p : mesh.points)
      points_.push_back(lattice.to_index(p));
    for (std::uint32_t n = 0; n < triangles_.size(); ++n) {
      Box3 box;
      for (const std::uint32_t corner : triangles_[n])
        box.add(points_[corner]);
      const auto low = cell(box.min - Vec3{reach, reach, reach});
      const auto high = cell(box.max + Vec3{reach, reach, reach});
      for (std::int32_t i = low[0]; i <= high[0]; ++i)
        for (std::int32_t j = low[1]; j <= high[1]; ++j)
          for (std::int32_t k = low[2]; k <= high[2]; ++k)
            near_[{i, j, k}].push_back(n);
    }
  }
  double at(const Vec3& world) const {
    const Vec3 p = lattice_.to_index(world);
    double min = HUGE_VAL;
    if (const auto found = near_.find(cell(p)); found != near_.end())
      for (const std::uint32_t n : found->second)
        min = test::smaller(min, to(n, p));
    if (min <= reach)
      return min;
    for (std::uint32_t n = 0; n < triangles_.size(); ++n)
      min = test::smaller(min, to(n, p));
    return min;
  }

private:
  static constexpr double reach = 1;
  static Int3 cell(const Vec3& p) {
    return {static_cast<std::int32_t>(std::floor(p.x)), static_cast<std::int32_t>(std::floor(p.y)),
            static_cast<std::int32_t>(std::floor(p.z))};
  }
  double to(std::uint32_t n, const Vec3& p) const {
    const Triangle& t = triangles_[n];
    return norm(p -
                mesh::nearest_on_triangle(p, points_[t[0]], points_[t[1]], points_[t[2]]).point);
  }
  const std::vector<Triangle>& triangles_;
  volume::GridTransform lattice_;
  std::vector<Vec3> points_;
  std::map<Int3, std::vector<std::uint32_t>> near_;
};

Error2 position_error(const Distances& distances, const volume::Grid& grid) {
  const surface::IsoSurface surface = surface::marching_cubes({}, grid);
  Error2 error;
  for (const Vec3& p : surface.mesh.points) {
    const double d = distances.at(p);
    error.mean += d / static_cast<double>(surface.mesh.points.size());
    error.max = test::larger(error.max, d);
  }
  return error;
}

// ---- one mesh

/// The slice through the middle across the second axis, a voxel 4 x 4 pixels, black to white.
texture::Image slice(const Range& range, const std::function<double(const Int3&)>& value) {
  constexpr std::int32_t edge = 4;
  texture::Image image;
  image.width = static_cast<std::uint32_t>(edge * (range.max[0] - range.min[0] + 1));
  image.height = static_cast<std::uint32_t>(edge * (range.max[2] - range.min[2] + 1));
  const std::int32_t j = (range.min[1] + range.max[1]) / 2;
  for (std::uint32_t y = 0; y < image.height; ++y)
    for (std::uint32_t x = 0; x < image.width; ++x) {
      const double v = value({range.min[0] + static_cast<std::int32_t>(x) / edge, j,
                              range.max[2] - static_cast<std::int32_t>(y) / edge});
      image.values.insert(image.values.end(), 3, static_cast<std::uint8_t>(std::lround(255 * v)));
    }
  return image;
}

std::vector<Filter> filters_of(const TriangleMesh& mesh, const volume::GridTransform& lattice) {
  constexpr auto refuse = voxelization::OpenMesh::refuse;
  std::vector<Filter> filters;
  filters.push_back({"exact",
                     [&mesh, &lattice] {
                       return *antialiasing::exact_coverage(one_thread, mesh, lattice, refuse);
                     },
                     {}});
  for (const int n : {2, 4, 6})
    filters.push_back({"lines:" + std::to_string(n),
                       [&mesh, &lattice, n] {
                         return antialiasing::line_coverage(one_thread, mesh, lattice, n, refuse);
                       },
                       {}});
  for (const int n : {2, 4, 6, 8})
    filters.push_back({"box:" + std::to_string(n),
                       [&mesh, &lattice, n] {
                         voxelization::VoxelizeOptions options;
                         options.samples = n;
                         return voxelization::voxelize(one_thread, mesh, lattice, options);
                       },
                       {}});
  filters.push_back(
      {"jones",
       [&mesh, &lattice] { return antialiasing::jones_density(one_thread, mesh, lattice, refuse); },
       {}});
  filters.push_back({"sramek",
                     [&mesh, &lattice] {
                       return antialiasing::sramek_density(one_thread, mesh, lattice, refuse);
                     },
                     {}});
  filters.push_back(
      {"none",
       [&mesh, &lattice] { return voxelization::voxelize(one_thread, mesh, lattice, {}); },
       {}});
  filters.push_back({"768 to 128", [&mesh, &lattice] { return literally(mesh, lattice); }, {}});
  return filters;
}

void draw(const std::string& folder, const std::string& name, const TriangleMesh& mesh) {
  const volume::GridTransform lattice = volume::lattice_for_dim(bounding_box(mesh), dim);
  for (const Filter& filter : filters_of(mesh, lattice)) {
    std::string file = filter.name;
    std::ranges::replace_if(
        file, [](char c) { return c == ' ' || c == ':'; }, '-');
    formats::Output output(folder + "/" + name + "-" + file + ".png", {});
    formats::write_image(output, slice(range_of(mesh, lattice), values_of(filter.work())),
                         formats::Kind::png);
    output.commit();
  }
}

void bench(const char* name, const TriangleMesh& mesh) {
  const volume::GridTransform lattice = volume::lattice_for_dim(bounding_box(mesh), dim);
  std::vector<Filter> filters = filters_of(mesh, lattice);
  const std::vector<Times> times = measure(filters);

  // How far rounding goes in `exact` itself: the sums run along another axis.
  volume::GridTransform rotated = lattice;
  for (std::size_t row = 0; row < 3; ++row) {
    rotated.m[4 * row] = lattice.m[4 * row + 1];
    rotated.m[4 * row + 1] = lattice.m[4 * row + 2];
    rotated.m[4 * row + 2] = lattice.m[4 * row];
  }
  const volume::Grid other =
      *antialiasing::exact_coverage(one_thread, mesh, rotated, voxelization::OpenMesh::refuse);
  const auto exact = values_of(filters[0].grid);
  const Range range = range_of(mesh, lattice);
  const Distances distances(mesh, lattice);
  const double volume = std::fabs(signed_volume(mesh));
  for (std::size_t n = 0; n < filters.size(); ++n) {
    const Filter& filter = filters[n];
    const auto row = [&](const char* what, double error, const char* measure) {
      std::printf("%s %s,%s,%g,%zu,1,%.3f,%.3f,%.3f,%.3g,%s\n", name, what, filter.name.c_str(),
                  lattice.voxel_size().x, mesh.triangles.size(), times[n].median, times[n].fastest,
                  times[n].slowest, error, measure);
    };
    const auto rotated_values = values_of(other);
    const auto tested = n == 0 ? std::function<double(const Int3&)>([&](const Int3& v) {
      return rotated_values({v[1], v[2], v[0]});
    })
                               : values_of(filter.grid);
    const Error2 fraction = fraction_error(range, tested, exact);
    row("fraction mean", fraction.mean, "mean error of a surface voxel's fraction");
    row("fraction max", fraction.max, "largest error of a voxel's fraction");
    row("volume", std::fabs(volume::volume_stats(one_thread, filter.grid).volume / volume - 1),
        "relative error of the volume");
    const Error2 position = position_error(distances, filter.grid);
    row("position mean", position.mean, "mean distance of the isosurface in voxels");
    row("position max", position.max, "largest distance of the isosurface in voxels");
  }
  std::fflush(stdout);
}

/// A bent tube of changing width, or a lumpy ball.
TriangleMesh made(bool tube) {
  TriangleMesh mesh = test::sphere_mesh(5, 1, {0, 0, 0});
  for (Vec3& p : mesh.points) {
    const double lump = 1 + 0.1 * std::sin(5 * p.x) * std::sin(4 * p.y + 1) * std::cos(6 * p.z);
    const double bend = 0.6 * std::sin(3 * p.z);
    p = tube ? Vec3{0.15 * lump * p.x + bend, 0.15 * lump * p.y, p.z} : p * lump;
    p *= 100;
  }
  return mesh;
}

TriangleMesh organ(const char* file, bool tube) {
  const std::string path = test::shared_folder() + "/data/" + file;
  if (!std::filesystem::exists(path))
    return made(tube);
  formats::Input input(path);
  formats::MeshReadOptions options;
  options.kind = formats::input_kind(input.peek(4096), path, "");
  options.drop_unused = true;
  return formats::read_mesh(input, options);
}

} // namespace

int main(int argc, char** argv) {
  const TriangleMesh liver = organ("sofa_liver_smooth.obj", false);
  const TriangleMesh colon = organ("gca90_large_intestine_20k.stl", true);
  if (argc > 1) {
    draw(argv[1], "liver", liver);
    draw(argv[1], "colon", colon);
    return 0;
  }
  std::puts("stage,program,voxel,size,threads,median_ms,fastest_ms,slowest_ms,error,measure");
  bench("liver", liver);
  bench("colon", colon);
  return 0;
}
