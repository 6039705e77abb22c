// Scrambles solids: bodies of either law and order, up to 162 tetrahedra, nu from 0 to 0.49, whose
// nodes are anywhere in their box, are let go and must find back.
//
// Of every one: no number is lost; energy (of motion and of elements) doesn't grow, by more than
// 1e-10 of the first, in any step, and has fallen in the end; no element stays inside out, by its
// corners. Counted, not judged, is whether it rests in its own shape ("recovered": by less than
// 1e-6 of the energy it began with) or in a minimum of its own ("wound up").
//
// Usage: stress_scrambled [COUNT] [law=corotational|neo-hookean] [order=1|2] [seed=FIRST]
// COUNT (default 100) bodies of each kind that the law and order leave, with these seeds from FIRST
// (default 0) on; where they leave more than one, a quarter of COUNT of the two slower ones and a
// hundredth of quadratic Neo-Hookean ones. Each that fails is named with its seed. Status 1 if one
// did, 2 if the arguments are others.

#include "integrator/solid_motion.h"
#include "tests/stress/motion_bodies.h"

#include <charconv>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <optional>
#include <string_view>
#include <vector>

namespace {

using namespace gewebe;
using namespace gewebe::test;
using Numbers = std::vector<double>;

constexpr double energy_tolerance = 1e-10;
constexpr int most_steps = 1000;

struct Ends {
  std::uint64_t bodies = 0, recovered = 0, wound_up = 0, stuck = 0, grown = 0, lost = 0, steps = 0;

  std::uint64_t failed() const { return stuck + grown + lost; }
};

void scramble(std::uint32_t seed, const Kind& kind, Ends& ends) {
  const Scrambled of = scrambled(seed, kind);
  const tetrahedra::TetMesh& mesh = of.mesh;
  integrator::SolidMotion body(mesh, std::vector<fem::SolidMaterial>{of.material}, of.options);
  body.set_state(of.displacement, Numbers(of.displacement.size()));
  ++ends.bodies;
  const double first = body.elastic_energy();
  const auto failed = [&](std::uint64_t& count, const char* how) {
    ++count;
    std::printf("%s, seed %u: FAILED (%zu elements, nu %g, %d inside out, energy %.6g of the "
                "first): %s\n",
                kind.name(), seed, mesh.tetrahedra.size(), of.material.poisson,
                inverted(mesh, body.places()), body.elastic_energy() / first, how);
  };
  Context one_thread; // bodies are small
  one_thread.threads = 1;
  double before = first;
  int still = 0;
  for (int n = 0; n < most_steps && still < 25 && !(body.elastic_energy() <= 1e-9 * first); ++n) {
    (void)body.step(0.05, one_thread);
    ++ends.steps;
    const double after = body.kinetic_energy() + body.elastic_energy();
    if (!sound(body.places()) || !sound(body.velocity()))
      return failed(ends.lost, "numbers were lost");
    if (!(after <= before + energy_tolerance * first))
      return failed(ends.grown, "energy grew");
    still = before - after < 1e-7 * after ? still + 1 : 0;
    before = after;
  }
  if (inverted(mesh, body.places()) > 0)
    failed(ends.stuck, "stuck");
  else if (!(body.elastic_energy() < first))
    failed(ends.grown, "energy did not fall");
  else
    ++(body.elastic_energy() <= 1e-6 * first ? ends.recovered : ends.wound_up);
}

struct Arguments {
  std::uint32_t count = 100, seed = 0;
  std::optional<integrator::SolidLaw> law;
  std::optional<bool> quadratic;

  bool wants(const Kind& kind) const {
    return law.value_or(kind.law) == kind.law &&
           quadratic.value_or(kind.quadratic) == kind.quadratic;
  }
};

bool read(std::string_view text, std::uint32_t& to) {
  const auto parsed = std::from_chars(text.data(), text.data() + text.size(), to);
  return parsed.ec == std::errc() && parsed.ptr == text.data() + text.size();
}

bool read(std::string_view text, Arguments& to) {
  if (text == "law=corotational")
    to.law = integrator::SolidLaw::corotational;
  else if (text == "law=neo-hookean")
    to.law = integrator::SolidLaw::hyperelastic;
  else if (text == "order=1")
    to.quadratic = false;
  else if (text == "order=2")
    to.quadratic = true;
  else if (text.starts_with("seed="))
    return read(text.substr(5), to.seed);
  else
    return read(text, to.count) && to.count > 0;
  return true;
}

std::uint32_t count_of(const Kind& kind, const Arguments& arguments) {
  if (arguments.law && arguments.quadratic)
    return arguments.count;
  const bool quick = kind.law == integrator::SolidLaw::corotational && !kind.quadratic;
  return quick         ? arguments.count
         : kind.slow() ? (arguments.count + 99) / 100
                       : (arguments.count + 3) / 4;
}

int run(const Arguments& arguments) {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  std::uint64_t failed = 0;
  for (const Kind& kind : kinds) {
    if (!arguments.wants(kind))
      continue;
    Ends ends;
    for (std::uint32_t k = 0; k < count_of(kind, arguments); ++k)
      scramble(arguments.seed + k, kind, ends);
    const auto number = [](std::uint64_t n) { return static_cast<unsigned long long>(n); };
    std::printf("%s: %llu scrambled, %llu steps: %llu recovered, %llu wound up, %llu stuck inside "
                "out, %llu of which energy grew, %llu of which numbers were lost\n",
                kind.name(), number(ends.bodies), number(ends.steps), number(ends.recovered),
                number(ends.wound_up), number(ends.stuck), number(ends.grown), number(ends.lost));
    failed += ends.failed();
  }
  return failed == 0 ? 0 : 1;
}

} // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  for (int k = 1; k < argc; ++k)
    if (!read(std::string_view(argv[k]), arguments)) {
      (void)std::fputs("usage: stress_scrambled [COUNT] [law=corotational|neo-hookean] [order=1|2] "
                       "[seed=FIRST]\n",
                       stderr);
      return 2;
    }
  try {
    return run(arguments);
  } catch (const std::exception& error) {
    (void)std::fprintf(stderr, "stress_scrambled: %s\n", error.what());
    return 1;
  }
}
