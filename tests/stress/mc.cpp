// Hunts for volumes whose mesh marching cubes or snapping would break. Each scene is meshed,
// snapped at seven epsilons, and every mesh must be closed, manifold and oriented with the Euler
// number and the components of the unsnapped one. Argument: number of scenes (default 2000).

#include "tests/unit/surface_scenes.h"

#include <charconv>
#include <cstdio>
#include <exception>
#include <string>
#include <string_view>

namespace {

using namespace gewebe;

struct Scene {
  std::string name;
  Grid grid;
};

Scene make_scene(std::uint32_t n) {
  const std::uint32_t seed = n / 5;
  const int size = 12 + static_cast<int>(seed % 3) * 4;
  switch (n % 5) {
  case 0:
    return {"metaballs", scenes::metaballs(16 + static_cast<int>(seed % 5) * 8, seed)};
  case 1:
    return {"white noise", scenes::noise(12, seed)};
  case 2:
    return {"quantised noise", scenes::noise(12, seed, 2 + static_cast<int>(seed % 7))};
  case 3: { // 0/1 with few voxels inside, or few outside: ambiguous faces everywhere
    std::mt19937 random(seed);
    return {"sparse noise", scenes::sample({}, {0, 0, 0}, {size, size, size}, [&](int, int, int) {
              return random() % 8 > seed % 8 ? 0.0 : 1.0;
            })};
  }
  default: { // smooth waves with a fine ripple: many crossings near corners
    const double f = 0.2 + 0.01 * (seed % 60);
    return {"waves", scenes::sample({}, {-1, -1, -1}, {size, size, size}, [&](int i, int j, int k) {
              const double wave = std::sin(f * i) + std::sin(f * j + seed) + std::sin(f * k);
              return 0.5 + wave * (seed % 2 == 0 ? 1.0 : 1e-3) +
                     1e-4 * std::sin(5.0 * i + 3.0 * j + 2.0 * k);
            })};
  }
  }
}

bool passes(const Scene& scene, std::uint32_t n) {
  const IsoSurface surface = marching_cubes({}, scene.grid);
  const MeshReport before = examine_mesh(surface.mesh);
  for (const double epsilon : {0.0, 0.05, 0.15, 0.25, 0.35, 0.45, 0.5}) {
    const MeshReport after = examine_mesh(snap({}, surface, {.epsilon = epsilon}).mesh);
    if (scenes::keeps_topology(before, after))
      continue;
    std::printf("scene %u (%s), epsilon %g: %s\n", static_cast<unsigned>(n), scene.name.c_str(),
                epsilon,
                scenes::is_sound(before) ? "broken by snapping" : "broken before snapping");
    return false;
  }
  return true;
}

/// The same check must fail for snapping without guard.
bool naive_fails() {
  const IsoSurface surface = marching_cubes({}, scenes::noise(12, 1));
  return !scenes::keeps_topology(examine_mesh(surface.mesh),
                                 examine_mesh(scenes::snap_naively(surface, 0.15)));
}

} // namespace

int main(int argc, char** argv) {
  std::uint32_t count = 2000;
  if (argc > 1) {
    const std::string_view word = argv[1];
    const auto [end, status] = std::from_chars(word.data(), word.data() + word.size(), count);
    if (argc > 2 || status != std::errc{} || end != word.data() + word.size()) {
      std::fputs("usage: stress_mc [SCENES]\n", stderr);
      return 2;
    }
  }
  unsigned passed = 0, failed = 0;
  try {
    for (std::uint32_t n = 0; n < count; ++n)
      ++(passes(make_scene(n), n) ? passed : failed);
    if (!naive_fails()) {
      std::puts("negative control: naive snapping passed");
      ++failed;
    } else {
      ++passed;
    }
  } catch (const std::exception& error) {
    std::printf("failed: %s\n", error.what());
    ++failed;
  }
  std::printf("%u passed, %u failed\n", passed, failed);
  return failed == 0 ? 0 : 1;
}
