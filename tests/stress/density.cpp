// Strains the accuracy of the density: far offsets, eighteen decades of radii, a million particles,
// cancelling weights, voxel centres at the edge of a support. Errors are against long double and
// relative to the weights in reach. Argument: number of particles (default 1000000).

#include "tests/unit/density_stress.h"

#include <charconv>
#include <cstdio>
#include <exception>
#include <string_view>

namespace {

using namespace gewebe;

int run(int particles) {
  std::vector<test::StressResult> results;
  for (const double offset : {1e3, 1e5, 1e6})
    for (const double voxel : {0.25, 0.1, 0.03})
      results.push_back(test::stress_offset(offset, voxel));
  for (int decade = -9; decade <= 9; ++decade)
    results.push_back(test::stress_scale(std::pow(10.0, decade)));
  results.push_back(test::stress_mixed(150));
  for (const double reach : {4.0, 30.0, 120.0})
    results.push_back(test::stress_many(particles, reach, 1500));
  results.push_back(test::stress_cancelling(300));
  results.push_back(test::stress_edge(3000));
  int failures = 0;
  for (const test::StressResult& result : results) {
    std::printf("%-28s error %.3g of %.3g%s%s\n", result.name.c_str(), result.error, result.allowed,
                result.never_negative ? "" : ", negative", result.passed() ? "" : "  FAILED");
    failures += result.passed() ? 0 : 1;
  }
  return failures == 0 ? 0 : 1;
}

} // namespace

int main(int argc, char** argv) {
  int particles = 1000000;
  if (argc > 1) {
    const std::string_view text = argv[1];
    const auto parsed = std::from_chars(text.data(), text.data() + text.size(), particles);
    if (parsed.ec != std::errc() || parsed.ptr != text.data() + text.size() || particles < 1) {
      (void)std::fputs("stress_density: expected a number of particles\n", stderr);
      return 2;
    }
  }
  try {
    return run(particles);
  } catch (const std::exception& error) {
    (void)std::fprintf(stderr, "stress_density: %s\n", error.what());
    return 1;
  }
}
