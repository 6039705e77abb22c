// Ten thousand random scenes (tests/unit/fuzzed_scenes.h). Arguments: how many, and the first seed;
// with a third, `show`, the lines of that one scene.

#include "tests/unit/fuzzed_scenes.h"

#include <array>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <unistd.h>

using namespace gewebe;

namespace {

volatile std::uint64_t seed_now = 0;

/// A crash names its scene.
void tell_seed(int signal_number) {
  std::array<char, 64> text{};
  std::size_t at = text.size();
  text[--at] = '\n';
  std::uint64_t seed = seed_now;
  do {
    text[--at] = static_cast<char>('0' + seed % 10);
    seed /= 10;
  } while (seed > 0);
  const char said[] = "crashed: seed ";
  (void)!::write(2, said, sizeof said - 1);
  (void)!::write(2, text.data() + at, text.size() - at);
  std::signal(signal_number, SIG_DFL);
  (void)std::raise(signal_number);
}

/// Every other one fails in between.
std::vector<std::string> lines_of(std::uint64_t seed) {
  return seed % 2 == 0 ? test::failing_scene(seed / 2) : test::FuzzedScene(seed).lines();
}

} // namespace

int main(int argc, char** argv) {
  const std::uint64_t count = argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 10000;
  const std::uint64_t first = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
  if (argc > 3) {
    for (const std::string& line : lines_of(first))
      std::puts(line.c_str());
    return 0;
  }
  for (const int s : {SIGSEGV, SIGABRT, SIGFPE, SIGBUS, SIGILL})
    std::signal(s, tell_seed);
  test::FuzzedCounts seen;
  std::uint64_t failed = 0;
  for (std::uint64_t seed = first; seed < first + count; ++seed) {
    seed_now = seed;
    const std::uint64_t slow = seen.slow;
    const std::string fault = test::fault_of_scene(lines_of(seed), seen);
    if (seen.slow > slow) {
      std::printf("slow: seed %llu\n", static_cast<unsigned long long>(seed));
      std::fflush(stdout);
    }
    if (fault.empty())
      continue;
    ++failed;
    std::printf("failed: seed %llu: %s\n", static_cast<unsigned long long>(seed), fault.c_str());
    std::fflush(stdout);
  }
  std::printf("%llu scenes from seed %llu, %llu steps, %llu refused lines, %llu too slow to end; "
              "%llu failed\n",
              static_cast<unsigned long long>(count), static_cast<unsigned long long>(first),
              static_cast<unsigned long long>(seen.steps),
              static_cast<unsigned long long>(seen.errors),
              static_cast<unsigned long long>(seen.slow), static_cast<unsigned long long>(failed));
  // Scenes in which next to nothing happens would show next to nothing.
  return failed == 0 && seen.steps > count && seen.slow <= count / 50 ? 0 : 1;
}
