#pragma once
// Random volumes on which marching cubes and snapping must keep their promises, and the check that
// both our own checker and CGAL do. For units compiled with -frounding-math.

#include "cgal_surface.h"
#include "surface_scenes.h"

#include <array>
#include <cstdint>
#include <string>

namespace gewebe::scenes {

inline constexpr std::array<double, 7> stress_epsilons{0, 0.05, 0.15, 0.25, 0.35, 0.45, 0.5};

struct StressScene {
  std::string name;
  volume::Grid grid;
};

/// Scene n of an endless list. Closed: what is inside keeps away from the border of the values;
/// open: it runs out of it, and the background cuts it.
inline StressScene stress_scene(std::uint32_t n) {
  constexpr std::uint32_t kinds = 10;
  const std::uint32_t seed = n / kinds;
  std::mt19937 random(seed);
  const auto box = [](int size, const auto& function) {
    return sample({}, {-1, -1, -1}, {size - 2, size - 2, size - 2}, function);
  };
  // Many values meet the isovalue 0.5 exactly.
  const auto quantise = [](double value, int levels) {
    return std::floor(value * levels + 0.5) / levels;
  };
  const double f = 0.2 + 0.01 * (seed % 60), g = 0.3 + 0.007 * (seed % 90), h = seed % 7;
  const auto waves = [=](int i, int j, int k) {
    return 0.5 + std::sin(f * i + h) * std::sin(g * j) + std::sin(f * k) * std::cos(g * i + h) / 2 +
           0.2 * std::sin(0.9 * j + 1.1 * k);
  };
  const auto near_border = [](int size, int i, int j, int k) {
    return std::min({i, j, k}) < 0 || std::max({i, j, k}) > size - 3;
  };
  switch (n % kinds) {
  case 0:
    return {"metaballs 12", metaballs(12, seed)};
  case 1:
    return {"metaballs 24", metaballs(24, seed)};
  case 2: { // the same, cut by the border of the values
    const std::vector<Ball> balls = five_balls(24, seed);
    return {"open metaballs 24", sample({}, {8, 0, 0}, {16, 16, 24}, [&](int i, int j, int k) {
              return density(
                  balls, {static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)});
            })};
  }
  case 3: {
    const std::vector<Ball> balls = five_balls(12, seed);
    const int levels = 2 + 2 * static_cast<int>(seed % 5);
    return {"quantised metaballs", sample({}, {0, 0, 0}, {12, 12, 12}, [&](int i, int j, int k) {
              return quantise(density(balls, {static_cast<double>(i), static_cast<double>(j),
                                              static_cast<double>(k)}),
                              levels);
            })};
  }
  case 4:
    return {"white noise", noise(12, seed)};
  case 5:
    return {"quantised noise", noise(12, seed, 2 + static_cast<int>(seed % 7))};
  case 6: // 0/1 with few voxels inside, or few outside: ambiguous faces everywhere
    return {"sparse noise", box(12 + static_cast<int>(seed % 3) * 4, [&](int, int, int) {
              return random() % 8 > seed % 8 ? 0.0 : 1.0;
            })};
  case 7:
    return {"open waves", box(16, waves)};
  case 8:
    return {"closed waves", box(16, [&](int i, int j, int k) {
              return near_border(16, i, j, k) ? 0.0 : waves(i, j, k);
            })};
  default: { // with a fine ripple: many crossings near corners
    const int levels = 4 + 2 * static_cast<int>(seed % 4);
    return {"quantised waves", box(16, [&](int i, int j, int k) {
              const double wave = waves(i, j, k) + 1e-4 * std::sin(5.0 * i + 3.0 * j + 2.0 * k);
              return seed % 2 == 0 ? quantise(wave, levels) : 0.5 + 1e-3 * (wave - 0.5);
            })};
  }
  }
}

/// What both judges have against a mesh that was snapped from `before`; "" if nothing.
inline std::string stress_complaint(const TriangleMesh& before, const TriangleMesh& after) {
  const mesh::MeshReport ours = mesh::examine_mesh(before), snapped = mesh::examine_mesh(after);
  if (!is_sound(ours))
    return "broken before snapping";
  if (!is_sound(snapped))
    return "broken by snapping";
  if (!keeps_topology(ours, snapped))
    return "another topology";
  const test::CgalVerdict cgal = test::cgal_verdict(after);
  if (!cgal.manifold || !cgal.closed)
    return "CGAL finds it broken";
  if (cgal.euler != ours.euler || cgal.components != ours.components)
    return "CGAL finds another topology";
  return "";
}

/// The first complaint about a scene at all epsilons; "" if there is none.
inline std::string stress_complaint(const StressScene& scene) {
  const surface::IsoSurface surface = surface::marching_cubes({}, scene.grid);
  for (const double epsilon : stress_epsilons) {
    const std::string complaint =
        stress_complaint(surface.mesh, surface::snap({}, surface, {.epsilon = epsilon}).mesh);
    if (!complaint.empty())
      return scene.name + ", epsilon " + std::to_string(epsilon) + ": " + complaint;
  }
  return "";
}

} // namespace gewebe::scenes
