#pragma once
// Scenes that strain the density's accuracy, each with its error against long double. Unit tests
// run them small, tests/stress/density.cpp large.

#include "density/density.h"
#include "tests/unit/density_scenes.h"
#include "tests/unit/larger.h"

#include <algorithm>
#include <string>
#include <vector>

namespace gewebe::test {

struct StressResult {
  std::string name;
  double error;   ///< NaN where a value is
  double allowed; ///< relative to the data: to the sum of |weights| that reach a voxel
  bool never_negative = true;
  bool passed() const { return error <= allowed && never_negative; }
};

inline volume::Grid density_grid(const Particles& particles, double voxel) {
  density::DensityOptions options;
  options.info.transform = volume::uniform_transform(voxel);
  return density::metaball_density({}, particles, options);
}

/// Offsets to 1e6 with R about 1.
inline StressResult stress_offset(double offset, double voxel) {
  Particles particles = random_particles(8, 1, 0.5, {offset, -offset, offset}, 11);
  for (Particle& p : particles)
    p.support_radius = 1;
  return {"offset 1e" + std::to_string(std::lround(std::log10(offset))) + ", R/" +
              std::to_string(std::lround(1 / voxel)),
          largest_leaf_error(density_grid(particles, voxel), particles, 3), 1e-6};
}

/// The same scene at another scale.
inline StressResult stress_scale(double scale) {
  const Particles particles = random_particles(9, 1.5 * scale, scale, {}, 12);
  return {"R about 1e" + std::to_string(std::lround(std::log10(scale))),
          largest_leaf_error(density_grid(particles, scale / 9), particles, 5), 1e-6};
}

/// Radii from one voxel to a thousand in one scene.
inline StressResult stress_mixed(double largest) {
  Particles particles;
  for (int n = 0; std::pow(3.7, n) <= largest; ++n) {
    const double R = std::pow(3.7, n);
    particles.push_back({{0.3 * R, -0.1 * R, 0.2}, R, 1});
  }
  return {"R from 1 to " + std::to_string(std::lround(largest)) + " voxels",
          largest_leaf_error(density_grid(particles, 1), particles, 101), 1e-6};
}

/// Many particles; a sample of voxels against the sum over all of them.
inline StressResult stress_many(int count, double reach_count, int samples) {
  // reach_count particles reach a voxel on average.
  const double R = 1, side = std::cbrt(count * 4.18879 * R * R * R / reach_count);
  const Particles particles = [&] {
    std::mt19937 random(13);
    std::uniform_real_distribution<double> unit(0, 1);
    Particles list;
    for (int n = 0; n < count; ++n)
      list.push_back({{side * unit(random), side * unit(random), side * unit(random)}, R, 1});
    return list;
  }();
  const volume::Grid grid = density_grid(particles, 0.2);
  volume::GridAccessor accessor(grid);
  std::mt19937 random(14);
  double error = 0;
  bool never_negative = true;
  for (int n = 0; n < samples; ++n) {
    Int3 ijk{};
    for (std::int32_t& index : ijk)
      index = static_cast<std::int32_t>(static_cast<double>(random() % 100000) * 1e-5 * side / 0.2);
    const float value = accessor.value(ijk);
    const long double exact = exact_density(
        particles, grid.info().transform.to_world({1.0 * ijk[0], 1.0 * ijk[1], 1.0 * ijk[2]}));
    const auto here = static_cast<double>(std::fabs(static_cast<long double>(value) - exact));
    error = test::larger(error, here);
    never_negative = never_negative && value >= 0;
  }
  return {std::to_string(count) + " particles, " + std::to_string(std::lround(reach_count)) +
              " in reach",
          error, 2e-7 * reach_count + 1e-6, never_negative};
}

/// Weights of up to ±1e6 that leave next to nothing of each other.
inline StressResult stress_cancelling(int pairs) {
  std::mt19937 random(15);
  std::uniform_real_distribution<double> unit(-1, 1);
  Particles particles;
  double total = 0;
  for (int n = 0; n < pairs; ++n) {
    const double weight = std::pow(10.0, 6 * std::fabs(unit(random)));
    const Vec3 center{unit(random), unit(random), unit(random)};
    const double R = 1.5 + unit(random);
    particles.push_back({center, R, weight});
    particles.push_back({center + Vec3{1e-6, 0, 0}, R, -weight});
    total += 2 * weight;
  }
  const volume::Grid grid = density_grid(particles, 0.1);
  return {"cancelling weights", largest_leaf_error(grid, particles, 3) / total, 2e-6};
}

/// Voxel centres at squared relative distances within 1e-7 of 1, where the expanded polynomial
/// loses its sign: never negative, and no larger than (5/9) (5e-7)².
inline StressResult stress_edge(int count) {
  std::mt19937 random(16);
  std::uniform_real_distribution<double> unit(-1, 1);
  StressResult result{"t within 1e-7 of 1", 0, 5.0 / 9 * 25e-14};
  for (int n = 0; n < count; ++n) {
    const Vec3 center{unit(random), unit(random), unit(random)};
    const Int3 ijk{static_cast<int>(random() % 40) - 20, static_cast<int>(random() % 40) - 20,
                   static_cast<int>(random() % 40) - 20};
    const Vec3 x{1.0 * ijk[0], 1.0 * ijk[1], 1.0 * ijk[2]};
    const double t = 1 + 1e-7 * unit(random);
    const Particles particles{{center, norm(x - center) / std::sqrt(t), 1}};
    const volume::Grid grid = density_grid(particles, 1);
    const auto value = static_cast<double>(volume::GridAccessor(grid).value(ijk));
    result.error = test::larger(result.error, value);
    for (const volume::LeafView& leaf : grid.leaves())
      for (int m = 0; m < volume::leaf_voxels; ++m)
        result.never_negative = result.never_negative && leaf.values[m] >= 0;
  }
  return result;
}

} // namespace gewebe::test
