// The finite elements of lib/fem, and contact with instruments, against theory, benchmarks,
// another program and an experiment.
//
// Prints its checks, writes a page with curves into FOLDER, and ends with status 1 where a bound is
// not kept. Usage: validate FOLDER [SECTION…], sections by the words below; all where there are
// none. Real organs and the measured beam are read from $GEWEBE_SHARED (else ../shared), scikit-fem
// by $PYTHON (else python3); what is absent is skipped.

#include "tests/validate/checks.h"
#include "tests/validate/peers.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <exception>
#include <string>
#include <utility>
#include <vector>

int main(int count, char** words) {
  using namespace gewebe::validate;
  const std::array<std::pair<std::string, Section (*)()>, 14> all{
      {{"patch", constant_strain},
       {"order", manufactured},
       {"benchmarks", benchmarks},
       {"estimates", error_estimates},
       {"contact", hertz},
       {"potentials", contact_potentials},
       {"sliding", sliding},
       {"passivity", passivity},
       {"hand", hand},
       {"peers", peers},
       {"strains", strained_peers},
       {"beam", silicone},
       {"swing", swings},
       {"organs", organs}}};
  if (count < 2) {
    (void)std::fputs("usage: validate FOLDER [SECTION…]\n", stderr);
    return 2;
  }
  const std::vector<std::string> asked(words + 2, words + count);
  for (const std::string& word : asked)
    if (std::ranges::none_of(all, [&](const auto& s) { return s.first == word; })) {
      (void)std::fprintf(stderr, "validate: no section is called '%s'\n", word.c_str());
      return 2;
    }
  try {
    std::vector<Section> sections;
    std::size_t passed = 0, failed = 0, skipped = 0, shown = 0;
    for (const auto& [name, make] : all) {
      if (!asked.empty() && std::ranges::find(asked, name) == asked.end())
        continue;
      try {
        sections.push_back(make());
      } catch (const std::exception& error) { // the others are of interest still
        Check check;
        check.what = name;
        check.figure = error.what();
        check.error = NAN;
        sections.push_back({name, "", {check}, {}});
      }
      print(sections.back());
      for (const Check& c : sections.back().checks)
        ++(c.skipped ? skipped : !c.passes() ? failed : c.judged ? passed : shown);
    }
    write_page(words[1], sections);
    std::printf("%s/README.md: %zu passed, %zu failed, %zu skipped, %zu shown\n", words[1], passed,
                failed, skipped, shown);
    return failed == 0 && passed > 0 ? 0 : 1;
  } catch (const std::exception& error) {
    (void)std::fprintf(stderr, "validate: %s\n", error.what());
    return 1;
  }
}
