// Speed and error of the density: the kernel against the machine's peak of fused multiply-adds in
// the same run; the plain volume against the band at 1024³; how both grow with the resolution; and
// from particles to a mesh against splashsurf, where python3 has pysplashsurf. Times are of whole
// calls without reading files.
//
// Writes CSV to standard output as geometry.cpp does: stage, program, voxel (mm), size (what the
// work follows), threads, median and spread of the times, and a figure whose meaning stands in the
// column `measure`.

#include "density/density.h"
#include "density/density_kernel_internal.h"
#include "surface/marching_cubes.h"
#include "surface/snapping.h"
#include "tests/bench/peer.h"
#include "tests/bench/timing.h"
#include "tests/unit/larger.h"

#include <immintrin.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <random>
#include <unistd.h>

using namespace gewebe;
using namespace gewebe::timing;

namespace {

constexpr int runs = 7;

void report(const char* stage, const char* program, double voxel, double size, int threads,
            const Times& times, double figure, const char* measure) {
  std::printf("%s,%s,%g,%.0f,%d,%.3f,%.3f,%.3f,%.3g,%s\n", stage, program, voxel, size, threads,
              times.median, times.fastest, times.slowest, figure, measure);
  std::fflush(stdout);
}

// ---- the kernel

constexpr int peak_rounds = 400000, peak_chains = 10;

/// Independent chains of fused multiply-adds, more than latency × throughput.
__attribute__((target("avx2,fma"))) void run_peak_avx2() {
  const __m256 factor = _mm256_set1_ps(0.999F), term = _mm256_set1_ps(0.001F);
  __m256 c0 = term, c1 = term, c2 = term, c3 = term, c4 = term, c5 = term, c6 = term, c7 = term,
         c8 = term, c9 = term;
  for (int n = 0; n < peak_rounds; ++n) {
    const auto step = [&](__m256 & chain) __attribute__((target("avx2,fma"))) {
      __asm__ volatile("vfmadd213ps %2, %1, %0" : "+x"(chain) : "x"(factor), "x"(term));
    };
    step(c0);
    step(c1);
    step(c2);
    step(c3);
    step(c4);
    step(c5);
    step(c6);
    step(c7);
    step(c8);
    step(c9);
  }
}

__attribute__((target("avx512f"))) void run_peak_avx512() {
  const __m512 factor = _mm512_set1_ps(0.999F), term = _mm512_set1_ps(0.001F);
  __m512 c0 = term, c1 = term, c2 = term, c3 = term, c4 = term, c5 = term, c6 = term, c7 = term,
         c8 = term, c9 = term;
  for (int n = 0; n < peak_rounds; ++n) {
    const auto step = [&](__m512 & chain) __attribute__((target("avx512f"))) {
      __asm__ volatile("vfmadd213ps %2, %1, %0" : "+v"(chain) : "v"(factor), "v"(term));
    };
    step(c0);
    step(c1);
    step(c2);
    step(c3);
    step(c4);
    step(c5);
    step(c6);
    step(c7);
    step(c8);
    step(c9);
  }
}

/// A level's kernel and what its vectors can do at the most.
struct Level {
  const char* name;
  density::DensityKernel add;
  void (*run_peak)();
  double peak_flops;
};

std::vector<Level> levels() {
  constexpr double flops = 2.0 * peak_chains * peak_rounds;
  std::vector<Level> found;
  if (best_cpu_level() >= CpuLevel::avx2)
    found.push_back({"avx2", density::add_density_avx2, run_peak_avx2, 8 * flops});
  if (best_cpu_level() >= CpuLevel::avx512)
    found.push_back({"avx512", density::add_density_avx512, run_peak_avx512, 16 * flops});
  return found;
}

/// Particles of radius R (voxels) that reach the leaf at the origin, evenly spread.
std::vector<density::LeafParticle> in_reach(double R, std::size_t count) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<density::LeafParticle> particles;
  while (particles.size() < count) {
    double center[3], distance2 = 0;
    for (double& c : center) {
      c = 3.5 + unit(random) * (R + 3.5);
      distance2 += std::pow(std::max({-c, c - 7, 0.0}), 2);
    }
    if (distance2 < R * R)
      particles.push_back({static_cast<float>(center[0]), static_cast<float>(center[1]),
                           static_cast<float>(center[2]), static_cast<float>(1 / R), 1});
  }
  return particles;
}

/// Of a voxel and a particle the kernel's inner loop makes: 1 subtraction, 1 multiplication, 2
/// fused multiply-adds: 6 floating-point operations; its clamp is not counted, nor what is made
/// once for a row. Only evaluations that can give something else than 0 count: those in the rows in
/// reach.
void bench_kernel() {
  constexpr std::size_t count = 96;
  constexpr int repeats = 200;
  for (const double R : {3.0, 6.0, 12.0, 40.0, 1000.0}) {
    const std::vector<density::LeafParticle> particles = in_reach(R, count);
    std::uint64_t useful = 0; // voxels in rows that meet the support
    for (const density::LeafParticle& p : particles)
      for (int row = 0; row < 64; ++row) {
        const double x = (row >> 3) - static_cast<double>(p.x),
                     y = (row & 7) - static_cast<double>(p.y),
                     z = std::max({-static_cast<double>(p.z), static_cast<double>(p.z) - 7, 0.0});
        useful += x * x + y * y + z * z < R * R ? 8 : 0;
      }
    const double evaluations = static_cast<double>(useful) * repeats;
    for (const Level& level : levels()) {
      std::vector<double> times, peaks, fractions;
      alignas(64) std::array<float, volume::leaf_voxels> values{};
      for (int run = 0; run < 21; ++run) {
        const double peak = milliseconds(level.run_peak);
        const double time = milliseconds([&] {
          for (int repeat = 0; repeat < repeats; ++repeat)
            level.add(particles.data(), particles.size(), values.data());
        });
        peaks.push_back(peak);
        times.push_back(time);
        fractions.push_back(6.0 * evaluations / time / (level.peak_flops / peak));
      }
      std::ranges::sort(fractions);
      char name[64];
      (void)std::snprintf(name, sizeof name, "fma peak %s", level.name);
      report("kernel", name, 1, level.peak_flops, 1, times_of(peaks),
             level.peak_flops / times_of(peaks).median * 1e-6, "GFLOP/s");
      (void)std::snprintf(name, sizeof name, "density %s R %g", level.name, R);
      report("kernel", name, 1, evaluations, 1, times_of(times),
             evaluations / times_of(times).median * 1e-6, "G evaluations/s");
      report("kernel of peak", name, 1, evaluations, 1, times_of(times),
             fractions[fractions.size() / 2], "fraction of its fma peak");
    }
  }
}

// ---- plain and band

/// Balls of support R(1 ± 0.25) in a cube of 100 mm that their supports fill.
Particles random_scene(int count, double R) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  Particles particles;
  for (int n = 0; n < count; ++n) {
    const double support = R * (0.75 + 0.5 * unit(random));
    const auto place = [&] { return support + unit(random) * (100 - 2 * support); };
    const double x = place(), y = place(), z = place();
    particles.push_back({{x, y, z}, support, 1});
  }
  return particles;
}

struct Measured {
  Times times;
  density::DensityReport report;
  double error; // over a sample of the voxels, against double
};

Measured measure_density(const Particles& particles, double voxel, bool band, int threads) {
  density::DensityOptions options;
  options.info.transform = volume::uniform_transform(voxel);
  if (band)
    options.band = 0.5;
  Measured result{};
  std::vector<double> times;
  for (int run = 0; run < runs; ++run) {
    volume::Grid grid; // its memory is given back outside the measurement
    times.push_back(milliseconds([&] {
      grid = density::metaball_density(with_threads(threads), particles, options, &result.report);
    }));
    if (run > 0)
      continue;
    const std::vector<volume::LeafView> leaves = grid.leaves();
    for (std::size_t n = 0; n < leaves.size(); n += 1 + leaves.size() / 2000) {
      const int offset = static_cast<int>(n * 61 % volume::leaf_voxels);
      const Int3& o = leaves[n].origin;
      const Vec3 x = options.info.transform.to_world({1.0 * (o[0] + (offset >> 6)),
                                                      1.0 * (o[1] + (offset >> 3 & 7)),
                                                      1.0 * (o[2] + (offset & 7))});
      double sum = 0;
      for (const Particle& p : particles) {
        const double t = dot(x - p.center, x - p.center) / (p.support_radius * p.support_radius);
        if (t < 1)
          sum += (1 - t) * (1 - t) * (1 - 4 * t / 9);
      }
      const double error = std::fabs(sum - static_cast<double>(leaves[n].values[offset]));
      result.error = test::larger(result.error, error);
    }
  }
  result.times = times_of(times);
  return result;
}

void bench_band() {
  struct Case {
    int count;
    double R;
  };
  for (const auto& [count, R] : {Case{5, 30}, Case{20, 22}, Case{100, 12}, Case{1000, 6},
                                 Case{20000, 1.2}, Case{100000, 0.4}}) {
    const Particles particles = random_scene(count, R);
    const double voxel = 100.0 / 1024;
    for (const int threads : {1, 2}) {
      const Measured plain = measure_density(particles, voxel, false, threads);
      const Measured band = measure_density(particles, voxel, true, threads);
      report("1024^3", "plain", voxel, count, threads, plain.times, plain.error,
             "max |D - double|");
      report("1024^3", "band", voxel, count, threads, band.times, band.error, "max |D - double|");
      report("1024^3 plain/band", "band", voxel, count, threads, band.times,
             plain.times.median / band.times.median, "times faster");
    }
  }
}

void bench_scaling() {
  const Particles particles = random_scene(20, 22);
  for (const int dim : {256, 512, 1024, 2048}) {
    const double voxel = 100.0 / dim;
    for (const int threads : {1, 2}) {
      const Measured band = measure_density(particles, voxel, true, threads);
      const auto stored = static_cast<double>(band.report.leaves);
      report("scaling", "band", voxel, stored, threads, band.times,
             band.times.median * 1e6 / stored, "ns a stored leaf");
    }
    if (dim > 1024) // 10 GB
      continue;
    const Measured plain = measure_density(particles, voxel, false, 1);
    const auto stored = static_cast<double>(plain.report.leaves);
    report("scaling", "plain", voxel, stored, 1, plain.times, plain.times.median * 1e6 / stored,
           "ns a stored leaf");
  }
}

// ---- from particles to a mesh

/// A ball of fluid: particles about a cubic lattice of unit distance.
Particles fluid(int count, double R) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(-0.2, 0.2);
  const double radius = std::cbrt(count * 3 / (4 * 3.14159265358979));
  const int half = static_cast<int>(radius) + 1;
  Particles particles;
  for (int i = -half; i <= half; ++i)
    for (int j = -half; j <= half; ++j)
      for (int k = -half; k <= half; ++k)
        if (i * i + j * j + k * k < radius * radius)
          particles.push_back({{i + unit(random), j + unit(random), k + unit(random)}, R, 1});
  return particles;
}

/// A lone particle of splashsurf's has radius 0.5, one of ours 0.6, just enough that the lattice
/// leaves no hole inside. Meshes of about equal numbers of vertices, ours with snapping.
void bench_splashsurf() {
  const Particles particles = fluid(100000, 1.2);
  const double voxel = support_box(particles).longest_side() / 512;
  const std::string path =
      (std::filesystem::temp_directory_path() / ("density-" + std::to_string(getpid()))).string();
  {
    FILE* const file = std::fopen(path.c_str(), "wb");
    if (file == nullptr)
      return;
    for (const Particle& p : particles) {
      const float xyz[3] = {static_cast<float>(p.center.x), static_cast<float>(p.center.y),
                            static_cast<float>(p.center.z)};
      std::fwrite(xyz, sizeof xyz, 1, file);
    }
    std::fclose(file);
  }
  for (const int threads : {1, 2}) {
    double fastest = 0;
    std::size_t vertices = 0;
    for (const bool band : {false, true}) {
      density::DensityOptions options;
      options.info.transform = volume::uniform_transform(voxel);
      if (band)
        options.band = 0.5;
      std::vector<double> times;
      for (int run = 0; run < runs; ++run) {
        volume::Grid grid;
        surface::IsoSurface surface;
        surface::SnapResult snapped;
        times.push_back(milliseconds([&] {
          grid = density::metaball_density(with_threads(threads), particles, options);
          surface = surface::marching_cubes_to_snap(with_threads(threads), grid);
          snapped = surface::snap(with_threads(threads), surface, {});
        }));
        vertices = snapped.mesh.points.size();
      }
      const Times ours = times_of(times);
      report("particles to mesh", band ? "metaball2vol --band | mc-opt" : "metaball2vol | mc-opt",
             voxel, static_cast<double>(vertices), threads, ours, 1, "times of ours");
      fastest = band ? std::min(fastest, ours.median) : ours.median;
    }
    char call[512];
    (void)std::snprintf(call, sizeof call,
                        "tests/bench/density_splashsurf.py '%s' 0.5 %.17g %zu %d %d", path.c_str(),
                        voxel, vertices, threads, runs);
    std::vector<double> numbers = numbers_of_script(call); // the times, then the vertices
    if (numbers.size() == runs + 1) {
      const double found = numbers.back();
      numbers.pop_back();
      const Times times = times_of(numbers);
      report("particles to mesh", "splashsurf", voxel, found, threads, times,
             times.median / fastest, "times of ours");
    } else
      (void)std::fputs("density: splashsurf skipped, python3 has no pysplashsurf\n", stderr);
  }
  std::filesystem::remove(path);
}

} // namespace

/// Arguments: some of kernel, band, scaling, splashsurf; all where there are none.
int main(int argc, char** argv) {
  const auto wanted = [&](const char* name) {
    return argc == 1 || std::any_of(argv + 1, argv + argc,
                                    [&](const char* word) { return std::string(word) == name; });
  };
  std::puts("stage,program,voxel,size,threads,median_ms,fastest_ms,slowest_ms,error,measure");
  if (wanted("kernel"))
    bench_kernel();
  if (wanted("band"))
    bench_band();
  if (wanted("scaling"))
    bench_scaling();
  if (wanted("splashsurf"))
    bench_splashsurf();
  return 0;
}
