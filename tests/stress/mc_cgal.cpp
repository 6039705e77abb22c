// Hunts for volumes whose mesh marching cubes or snapping would break. Each scene is meshed,
// snapped at seven epsilons, and every mesh must be closed, manifold and oriented with the Euler
// number and the components of the unsnapped one, as our own checker and CGAL see it. Argument:
// number of scenes (default 2000); `make check` runs a few.

#include "base/parallel.h"
#include "tests/unit/surface_stress.h"

#include <charconv>
#include <cstdio>
#include <exception>
#include <map>
#include <string>
#include <string_view>

namespace {

using namespace gewebe;

/// Counts how many scenes of each kind naive snapping breaks: the same check must see that.
unsigned broken_by_naive(std::uint32_t count) {
  unsigned broken = 0;
  for (std::uint32_t n = 0; n < count; ++n) {
    const surface::IsoSurface surface = surface::marching_cubes({}, scenes::stress_scene(n).grid);
    broken +=
        scenes::stress_complaint(surface.mesh, scenes::snap_naively(surface, 0.35)).empty() ? 0 : 1;
  }
  return broken;
}

} // namespace

int main(int argc, char** argv) {
  std::uint32_t count = 2000;
  if (argc > 1) {
    const std::string_view word = argv[1];
    const auto [end, status] = std::from_chars(word.data(), word.data() + word.size(), count);
    if (argc > 2 || status != std::errc{} || end != word.data() + word.size()) {
      std::fputs("usage: stress_mc_cgal [SCENES]\n", stderr);
      return 2;
    }
  }
  unsigned passed = 0, failed = 0;
  try {
    std::vector<std::string> complaints(count), names(count);
    parallel_blocks({}, count, 1, [&](std::size_t begin, std::size_t) {
      const scenes::StressScene scene = scenes::stress_scene(static_cast<std::uint32_t>(begin));
      complaints[begin] = scenes::stress_complaint(scene);
      names[begin] = scene.name;
    });
    std::map<std::string, unsigned> kinds;
    for (std::uint32_t n = 0; n < count; ++n) {
      ++kinds[names[n]];
      ++(complaints[n].empty() ? passed : failed);
      if (!complaints[n].empty())
        std::printf("scene %u: %s\n", static_cast<unsigned>(n), complaints[n].c_str());
    }
    for (const auto& [name, scenes] : kinds)
      std::printf("%s: %u scenes at %zu epsilons\n", name.c_str(), scenes,
                  scenes::stress_epsilons.size());
    const unsigned naive = broken_by_naive(100);
    std::printf("negative control: naive snapping breaks %u of 100 scenes\n", naive);
    ++(naive > 30 ? passed : failed);
  } catch (const std::exception& error) {
    std::printf("failed: %s\n", error.what());
    ++failed;
  }
  std::printf("%u passed, %u failed\n", passed, failed);
  return failed == 0 ? 0 : 1;
}
