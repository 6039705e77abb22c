// The band volume: exactly the leaves that an isosurface crosses, with the bits of the plain one.

#include "base/error.h"
#include "density/density.h"
#include "density/density_kernel_internal.h"
#include "surface/marching_cubes.h"
#include "surface/snapping.h"
#include "tests/unit/density_scenes.h"
#include "volume/csg.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <random>
#include <set>

using namespace gewebe;
using test::random_particles;

namespace {

density::DensityOptions options_for(double voxel, std::optional<double> band = {}) {
  density::DensityOptions options;
  options.info.transform = volume::uniform_transform(voxel);
  options.band = band;
  return options;
}

/// Origins of the leaves in which an edge of the lattice has an end whose other end lies on the
/// other side. Voxels in no leaf are background, as far as the neighbours of leaves go.
std::set<Int3> crossing_leaves(const volume::Grid& grid, double isovalue) {
  volume::GridAccessor accessor(grid);
  std::set<Int3> crossing;
  const auto inside = [&](const Int3& ijk) {
    return static_cast<double>(accessor.value(ijk)) > isovalue;
  };
  for (const volume::LeafView& leaf : grid.leaves())
    for (int n = 0; n < volume::leaf_voxels; ++n) {
      const Int3 ijk{leaf.origin[0] + (n >> 6), leaf.origin[1] + (n >> 3 & 7),
                     leaf.origin[2] + (n & 7)};
      for (std::size_t axis = 0; axis < 3; ++axis)
        for (const int step : {-1, 1}) {
          Int3 next = ijk;
          next[axis] += step;
          if (inside(ijk) == inside(next))
            continue;
          crossing.insert(leaf.origin);
          crossing.insert(volume::leaf_origin(next));
        }
    }
  return crossing;
}

std::map<Int3, volume::LeafView> by_origin(const volume::Grid& grid) {
  std::map<Int3, volume::LeafView> leaves;
  for (const volume::LeafView& leaf : grid.leaves())
    leaves[leaf.origin] = leaf;
  return leaves;
}

/// What is wrong with a band volume; empty if nothing is.
std::string fault_of_band(const volume::Grid& plain, const volume::Grid& band, double isovalue) {
  const auto all = by_origin(plain), kept = by_origin(band);
  const std::set<Int3> crossing = crossing_leaves(plain, isovalue);
  for (const Int3& origin : crossing) {
    const auto there = all.find(origin);
    if (there == all.end())
      continue; // background, that is 0
    const auto here = kept.find(origin);
    if (here == kept.end())
      return "a crossing leaf is missing";
    if (std::memcmp(here->second.values, there->second.values,
                    sizeof(float) * volume::leaf_voxels) != 0)
      return "values differ";
  }
  for (const auto& [origin, leaf] : kept)
    if (!crossing.contains(origin))
      return "a leaf without crossing";
  volume::GridAccessor a(plain);
  volume::GridAccessor b(band);
  for (const auto& [origin, leaf] : all)
    for (int n = 0; n < volume::leaf_voxels; n += 3) {
      const Int3 ijk{origin[0] + (n >> 6), origin[1] + (n >> 3 & 7), origin[2] + (n & 7)};
      if ((static_cast<double>(a.value(ijk)) > isovalue) !=
          (static_cast<double>(b.value(ijk)) > isovalue))
        return "a voxel changed sides";
    }
  return {};
}

bool same_mesh(const TriangleMesh& a, const TriangleMesh& b) {
  return a.points.size() == b.points.size() && a.triangles == b.triangles &&
         (a.points.empty() ||
          std::memcmp(a.points.data(), b.points.data(), a.points.size() * sizeof(Vec3)) == 0);
}

} // namespace

TEST(DensityBand, HoldsExactlyTheCrossingLeavesOfRandomScenes) {
  constexpr std::array isovalues{0.5, 0.2, 1.3, -0.15, 0.0, 1e-4};
  std::uint64_t crossings = 0, skipped = 0;
  for (unsigned scene = 0; scene < 24; ++scene) {
    const double isovalue = isovalues[scene % isovalues.size()];
    const int count = std::array{3, 12, 40, 150}[scene / 6];
    const double voxel = std::array{0.2, 0.35, 0.5, 1.1}[(scene / 3) % 4];
    const Particles particles =
        random_particles(count, 8, 14 / std::cbrt(count), {1.0 * scene, 0.3, -5}, scene);
    density::DensityOptions options = options_for(voxel);
    if (scene % 4 == 3)
      options.clip = Box3{{-4, -6, -9.1}, {9, 4, 1.9}};
    const volume::Grid plain = density::metaball_density({}, particles, options);
    options.band = isovalue;
    density::DensityReport report;
    const volume::Grid band = density::metaball_density({}, particles, options, &report);
    EXPECT_EQ(fault_of_band(plain, band, isovalue), "") << "scene " << scene;
    crossings += band.leaves().size();
    skipped += report.leaves_skipped;
    const surface::IsoSurface expected = surface::marching_cubes({}, plain, isovalue);
    const surface::IsoSurface surface = surface::marching_cubes({}, band);
    EXPECT_TRUE(same_mesh(surface.mesh, expected.mesh)) << "scene " << scene;
    EXPECT_TRUE(
        same_mesh(surface::snap({}, surface, {}).mesh, surface::snap({}, expected, {}).mesh));
  }
  EXPECT_GT(crossings, 5000U);
  EXPECT_GT(skipped, 5000U);
}

TEST(DensityBand, ARegionThatEndsAtFacesOfLeavesHasItsSurfaceThere) {
  // All of the region is on one side: what is stored is the layer of leaves at its faces, beyond
  // which no leaf was ever planned.
  for (const double isovalue : {0.5, -0.5})
    for (const int leaves : {3, 12}) { // few of them proven, most of them proven
      const Particles particles{{{0.3, 1.2, -0.7}, 60.0 * leaves, isovalue > 0 ? 1.0 : -1.0}};
      const int half = leaves / 2;
      const Vec3 first{-8.0 * half - 8, -8.0 * half, 8 - 8.0 * half};
      const double last = 8.0 * leaves - 1;
      density::DensityOptions options = options_for(1);
      options.clip = Box3{first, first + Vec3{last, last, last}};
      const volume::Grid plain = density::metaball_density({}, particles, options);
      options.band = isovalue;
      const volume::Grid band = density::metaball_density({}, particles, options);
      EXPECT_EQ(fault_of_band(plain, band, isovalue), "") << isovalue << ' ' << leaves;
      const auto n = static_cast<std::size_t>(leaves), inner = n - 2;
      EXPECT_EQ(plain.leaves().size(), n * n * n);
      EXPECT_EQ(band.leaves().size(), n * n * n - inner * inner * inner);
      EXPECT_TRUE(same_mesh(surface::marching_cubes({}, band).mesh,
                            surface::marching_cubes({}, plain, isovalue).mesh));
    }
}

TEST(DensityBand, CubesSeeTheParticlesBeyondTheirFaces) {
  // Lone balls of a few voxels: a particle that reaches no voxel of a cube but one beside its face.
  for (unsigned scene = 0; scene < 3; ++scene) {
    const Particles particles = random_particles(1500, 80, 2.5 + scene, {}, 40 + scene, false);
    const volume::Grid plain = density::metaball_density({}, particles, options_for(1));
    const volume::Grid band = density::metaball_density({}, particles, options_for(1, 0.5));
    EXPECT_EQ(fault_of_band(plain, band, 0.5), "") << scene;
    EXPECT_TRUE(
        same_mesh(surface::marching_cubes({}, band).mesh, surface::marching_cubes({}, plain).mesh));
  }
}

TEST(DensityBand, NegativeControlBoundsForAnotherIsovalueMissCrossings) {
  const Particles particles = random_particles(12, 8, 6, {}, 3);
  const volume::Grid plain = density::metaball_density({}, particles, options_for(0.35));
  const volume::Grid band = density::metaball_density({}, particles, options_for(0.35, 0.55));
  EXPECT_EQ(fault_of_band(plain, band, 0.5), "a crossing leaf is missing");
}

namespace {

/// Does every value of the children and of their neighbours across a face lie in its bounds, which
/// were made for children of `bounded` voxels?
bool bounds_hold(density::BoundKernel kernel, float bounded, unsigned seed, double iso_scale) {
  constexpr int size = 8;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<density::IndexParticle> particles;
  std::vector<std::uint32_t> list;
  const double scale = std::exp(2.5 * unit(random));
  for (std::uint32_t n = 0; n < 1 + random() % 60; ++n) {
    const double R = 12 * scale * (1.1 + unit(random));
    particles.push_back({8 + (8 + R) * unit(random), 8 + (8 + R) * unit(random),
                         8 + (8 + R) * unit(random), R, static_cast<float>(1 / R),
                         static_cast<float>(iso_scale * (n % 4 == 3 ? -0.8 : 1))});
    list.push_back(n);
  }
  std::vector<std::uint8_t> masks(list.size());
  density::ChildBounds bounds{};
  kernel(particles.data(), list.data(), list.size(), {{0, 0, 0}, bounded}, masks.data(), bounds);
  // Values of the leaves around, evaluated as they are in grids.
  std::map<Int3, std::array<float, volume::leaf_voxels>> leaves;
  for (int i = -8; i <= 16; i += 8)
    for (int j = -8; j <= 16; j += 8)
      for (int k = -8; k <= 16; k += 8) {
        std::vector<density::LeafParticle> near;
        for (const density::IndexParticle& p : particles)
          near.push_back({static_cast<float>(p.x - i), static_cast<float>(p.y - j),
                          static_cast<float>(p.z - k), p.inverse_radius, p.weight});
        auto& values = leaves[{i, j, k}];
        values.fill(0);
        density::add_density_baseline(near.data(), near.size(), values.data());
      }
  for (int child = 0; child < 8; ++child) {
    const Int3 first{(child >> 2) * size, (child >> 1 & 1) * size, (child & 1) * size};
    for (int i = -1; i <= size; ++i)
      for (int j = -1; j <= size; ++j)
        for (int k = -1; k <= size; ++k) {
          const int out =
              int{i < 0 || i == size} + int{j < 0 || j == size} + int{k < 0 || k == size};
          if (out > 1)
            continue;
          const Int3 ijk{first[0] + i, first[1] + j, first[2] + k};
          const float value = leaves.at(
              volume::leaf_origin(ijk))[static_cast<std::size_t>(volume::leaf_offset(ijk))];
          if (!(value >= bounds.lower[child] && value <= bounds.upper[child]))
            return false;
        }
  }
  return true;
}

std::vector<density::BoundKernel> bound_kernels() {
  std::vector<density::BoundKernel> kernels{density::bound_children_baseline};
  if (best_cpu_level() != CpuLevel::baseline)
    kernels.push_back(density::bound_children_avx2);
  return kernels;
}

} // namespace

TEST(DensityBand, BoundsHoldForEveryVoxelOfTheCubesAndAcrossTheirFaces) {
  for (const density::BoundKernel kernel : bound_kernels())
    for (unsigned seed = 0; seed < 120; ++seed)
      EXPECT_TRUE(bounds_hold(kernel, 8, seed, seed % 3 == 0 ? 1e4 : 1)) << seed;
}

TEST(DensityBand, NegativeControlBoundsOfSmallerCubesFail) {
  for (const density::BoundKernel kernel : bound_kernels()) {
    int failures = 0;
    for (unsigned seed = 0; seed < 40; ++seed)
      failures += bounds_hold(kernel, 6, seed, 1) ? 0 : 1;
    EXPECT_GT(failures, 30);
  }
}

TEST(DensityBand, SameBitsForAnyThreadCountAndCpuLevel) {
  const Particles particles = random_particles(120, 12, 4, {}, 4);
  Context one;
  one.threads = 1;
  const std::uint64_t expected =
      density::metaball_density(one, particles, options_for(0.3, 0.5)).digest();
  for (const int threads : {1, 2, 3})
    for (const CpuLevel level : {CpuLevel::baseline, best_cpu_level()}) {
      Context context;
      context.threads = threads;
      context.cpu = level;
      EXPECT_EQ(density::metaball_density(context, particles, options_for(0.3, 0.5)).digest(),
                expected);
    }
  EXPECT_NE(density::metaball_density(one, particles, options_for(0.3, 0.6)).digest(), expected);
}

TEST(DensityBand, SparesWhatLiesOnOneSide) {
  const Particles particles{{{0.1, 0.2, 0.3}, 60, 1}, {{30, 5, 0}, 50, 1}, {{-9, 40, 9}, 45, -0.8}};
  density::DensityReport plain;
  density::DensityReport band;
  (void)density::metaball_density({}, particles, options_for(0.5), &plain);
  const volume::Grid grid = density::metaball_density({}, particles, options_for(0.5, 0.5), &band);
  EXPECT_LT(band.voxel_evaluations * 8, plain.voxel_evaluations);
  EXPECT_LT(static_cast<double>(band.leaves_evaluated), 1.3 * static_cast<double>(band.leaves));
  EXPECT_LT(grid.memory_bytes() * 4, plain.predicted_bytes);
  EXPECT_GE(static_cast<double>(plain.leaves), plain.predicted_voxels / volume::leaf_voxels * 0.98);
  EXPECT_GT(plain.predicted_evaluations * 1.1, static_cast<double>(plain.voxel_evaluations));
  EXPECT_LT(plain.predicted_evaluations, 1.1 * static_cast<double>(plain.voxel_evaluations));
}

TEST(DensityBand, IsRefusedWhereItIsNotExact) {
  const Particles particles{{{0, 0, 0}, 9, 1}};
  const volume::Grid plain = density::metaball_density({}, particles, options_for(0.5));
  const volume::Grid band = density::metaball_density({}, particles, options_for(0.5, 0.5));
  EXPECT_EQ(band.info().band_isovalue, 0.5);
  EXPECT_NO_THROW((void)surface::marching_cubes({}, band));
  EXPECT_THROW((void)surface::marching_cubes({}, band, 0.4), Error);
  EXPECT_NO_THROW((void)surface::marching_cubes({}, plain, 0.4));
  const auto combine = [&](volume::CsgOperation operation) {
    const std::vector<volume::CsgOperand> operands{{plain, "plain"}, {band, "band"}};
    return volume::csg({}, operation, operands);
  };
  EXPECT_THROW((void)combine(volume::CsgOperation::add), Error);
  EXPECT_THROW((void)combine(volume::CsgOperation::subtract), Error);
  EXPECT_EQ(combine(volume::CsgOperation::unite).info().band_isovalue, 0.5);
  const volume::Grid other = density::metaball_density({}, particles, options_for(0.5, 0.3));
  EXPECT_EQ(other.info().isovalue, 0.3);
  EXPECT_NO_THROW((void)surface::marching_cubes({}, other));
  EXPECT_THROW((void)density::metaball_density({}, particles, options_for(0.5, NAN)), Error);
  EXPECT_THROW((void)density::metaball_density({}, particles, options_for(0.5, 1e31)), Error);
}

TEST(DensityBand, NothingToKeep) {
  const Particles particles{{{0, 0, 0}, 9, 1}};
  for (const double isovalue : {3.0, -1.0, 1e30, -1e30}) {
    const volume::Grid band = density::metaball_density({}, particles, options_for(0.5, isovalue));
    EXPECT_TRUE(band.leaves().empty()) << isovalue;
    EXPECT_TRUE(band.tiles().empty()) << isovalue;
  }
}

TEST(DensityBand, AbsurdRadiiAreRefusedBeforeMemoryIsGone) {
  Context context;
  context.max_memory = 64 << 20;
  const Particles particles{{{0, 0, 0}, 4e8, 1}};
  EXPECT_THROW((void)density::metaball_density(context, particles, options_for(1, 0.5)), Error);
  EXPECT_THROW((void)density::metaball_density(context, particles, options_for(1)), Error);
}
