#pragma once
// What the programs of tests/stress that cut have in common: the number of cuts, 1000 if not given.

#include <charconv>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <string_view>
#include <system_error>

namespace gewebe::test {

/// main() of the program `name`; run(cuts) gives its status.
template <class Run>
int stress_cuts(const char* name, int argc, char** argv, const Run& run) {
  std::uint64_t cuts = 1000;
  if (argc > 1) {
    const std::string_view text = argv[1];
    const auto parsed = std::from_chars(text.data(), text.data() + text.size(), cuts);
    if (parsed.ec != std::errc() || parsed.ptr != text.data() + text.size() || cuts < 1) {
      (void)std::fprintf(stderr, "%s: expected a number of cuts\n", name);
      return 2;
    }
  }
  try {
    return run(cuts);
  } catch (const std::exception& error) {
    (void)std::fprintf(stderr, "%s: %s\n", name, error.what());
    return 1;
  }
}

} // namespace gewebe::test
