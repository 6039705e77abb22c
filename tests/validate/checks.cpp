#include "tests/validate/checks.h"

#include "base/context.h"
#include "tests/bench/timing.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>

namespace gewebe::validate {

std::string text_of(double number, int digits) {
  char text[40];
  (void)std::snprintf(text, sizeof text, "%.*g", digits, number);
  return text;
}

std::string percent(double share) {
  char text[40];
  (void)std::snprintf(text, sizeof text, std::abs(share) < 0.001 ? "%.3f %%" : "%.2f %%",
                      100 * share);
  return text;
}

Check skipped(const std::string& what, const std::string& source, const std::string& why) {
  Check check;
  check.what = what;
  check.source = source;
  check.figure = "skipped: " + why;
  check.skipped = true;
  return check;
}

Answer solve(const test::SolidCase& c) {
  const Context one = timing::with_threads(1);
  Answer answer;
  linalg::StiffnessMatrix k;
  std::optional<linalg::Factor> factor;
  answer.cost.unknowns = c.solid.unknowns();
  answer.cost.assembly = timing::processor_milliseconds([&] {
    const auto elements = fem::solid_elements(c.solid.mesh, c.solid.materials, one);
    k = fem::solid_stiffness(c.solid.mesh, elements, c.solid.fixed, one);
  });
  answer.cost.factor = timing::processor_milliseconds([&] { factor.emplace(k, one); });
  answer.cost.factor_mb = 8e-6 * static_cast<double>(factor->entries());
  answer.cost.solve = timing::processor_milliseconds(
      [&] { answer.u = test::displacements(c.solid, c.load, c.given, k, *factor); });
  return answer;
}

Figure figure_of(const test::SolidCase& c) {
  const Answer answer = solve(c);
  return {c.read(c.solid, answer.u), answer.cost};
}

} // namespace gewebe::validate
