// Against answers of others: a slender beam, Cook's membrane, NAFEMS LE10.

#include "tests/bench/peer.h"
#include "tests/validate/checks.h"
#include "tests/validate/peers.h"

#include <cmath>

namespace gewebe::validate {

namespace {

struct Size {
  std::uint32_t radial, around, through;
};

void beams(Section& section) {
  const std::string source = "Timoshenko, Goodier, Theory of elasticity; shear coefficient of "
                             "Cowper, The shear coefficient in Timoshenko's beam theory, 1966";
  for (const double poisson : {0.0, 0.3}) {
    const auto [droop, cost] = figure_of(test::slender_beam(true, poisson, 2));
    section.checks.push_back({"slender beam, ν = " + text_of(poisson) + ", droop over theory",
                              source,
                              "1",
                              text_of(droop),
                              std::abs(droop - 1),
                              0.01,
                              {},
                              cost});
  }
  // Theory leaves out that the held end can't thicken: the bound is wider, and the finer mesh
  // tells.
  const auto [droop, cost] = figure_of(test::slender_beam(true, 0.499, 2));
  const auto [fine, ignored] = figure_of(test::slender_beam(true, 0.499, 3));
  section.checks.push_back({"slender beam, ν = 0.499, droop over that of a finer mesh",
                            "the same elements, cubes of two thirds",
                            text_of(fine),
                            text_of(droop),
                            std::abs(droop / fine - 1),
                            0.01,
                            {},
                            cost});
}

void cook(Section& section) {
  const double expected = test::cooks_rise;
  Plot plot{"cook.svg",
            "Cook's membrane, ν = 0.4999",
            "seconds of one processor",
            "error of the corner's rise",
            {}};
  Curve ours{"Gewebe, quadratic", {}}, linear{"Gewebe, linear", {}},
      peer{"scikit-fem, plain quadratic", {}};
  for (const std::uint32_t n : {4U, 6U, 8U, 12U, 16U, 20U, 28U}) {
    const auto [rise, cost] = figure_of(test::cooks_membrane(n, true));
    ours.points.push_back({cost.total() / 1000, std::abs(rise / expected - 1)});
    if (n == 28)
      section.checks.push_back(
          {"Cook's membrane, plane strain, ν = 0.4999, rise of the corner, mm",
           "problem: Cook, Improved two-dimensional finite element, 1974; reference: plane "
           "Taylor-Hood elements, finer towards the corners (`tests/validate/cook_reference.py`)",
           text_of(expected, 5),
           text_of(rise, 5),
           std::abs(rise / expected - 1),
           0.01,
           {},
           cost});
  }
  for (const std::uint32_t n : {8U, 16U, 32U, 48U}) {
    const auto [rise, cost] = figure_of(test::cooks_membrane(n, false));
    linear.points.push_back({cost.total() / 1000, std::abs(rise / expected - 1)});
  }
  for (const std::uint32_t n : {4U, 8U, 12U, 16U, 20U})
    if (const auto figure = figure_by_peer(test::cooks_membrane(n, true), PeerElement::plain))
      peer.points.push_back({figure->cost.total() / 1000, std::abs(figure->value / expected - 1)});
  plot.curves = {ours, linear};
  if (!peer.points.empty())
    plot.curves.push_back(peer);
  section.plots.push_back(plot);
}

/// Is the reference that of the program that is said to have found it?
void cooks_reference(Section& section) {
  const std::string what = "the reference of Cook's membrane, with sides in 16, mm",
                    source = "`tests/validate/cook_reference.py`";
  if (peer_name().empty()) {
    section.checks.push_back(skipped(what, source, no_peer));
    return;
  }
  const auto numbers = timing::numbers_of_script("tests/validate/cook_reference.py");
  const double rise = numbers.empty() ? NAN : numbers[0];
  Cost cost;
  cost.unknowns = numbers.size() < 2 ? 0 : static_cast<std::size_t>(numbers[1]);
  section.checks.push_back({what,
                            source,
                            text_of(test::cooks_rise, 5),
                            text_of(rise, 6),
                            std::abs(rise / test::cooks_rise - 1),
                            1e-4,
                            {},
                            cost});
}

void plate(Section& section) {
  const double expected = test::le10_stress;
  Plot plot{"le10.svg", "NAFEMS LE10", "seconds of one processor", "error of stress yy at D", {}};
  Curve ours{"Gewebe, quadratic", {}}, linear{"Gewebe, linear", {}},
      peer{"scikit-fem, plain quadratic", {}};
  for (const auto [radial, around, through] :
       {Size{3, 4, 1}, Size{6, 8, 1}, Size{8, 10, 2}, Size{12, 16, 2}}) {
    const auto [stress, cost] = figure_of(test::le10(radial, around, through, true));
    ours.points.push_back({cost.total() / 1000, std::abs(stress / expected - 1)});
    if (radial == 12)
      section.checks.push_back({"LE10, stress yy at D, MPa",
                                "NAFEMS, The standard NAFEMS benchmarks, 1990: LE10",
                                text_of(expected),
                                text_of(stress),
                                std::abs(stress / expected - 1),
                                0.01,
                                {},
                                cost});
  }
  for (const auto [radial, around, through] :
       {Size{6, 8, 2}, Size{12, 16, 4}, Size{18, 24, 6}, Size{24, 32, 8}}) {
    const auto [stress, cost] = figure_of(test::le10(radial, around, through, false));
    linear.points.push_back({cost.total() / 1000, std::abs(stress / expected - 1)});
  }
  for (const auto [radial, around, through] :
       {Size{3, 4, 1}, Size{6, 8, 1}, Size{8, 10, 2}, Size{12, 16, 2}}) {
    const test::SolidCase c = test::le10(radial, around, through, true);
    PeerWish wish{nullptr, c.solid.node_at({2, 0, 0.6})};
    if (const auto answer = solve_by_peer(c, PeerElement::plain, &wish))
      peer.points.push_back(
          {answer->cost.total() / 1000, std::abs(wish.stress[3] / 1e6 / expected - 1)});
  }
  plot.curves = {ours, linear};
  if (!peer.points.empty())
    plot.curves.push_back(peer);
  section.plots.push_back(plot);
}

} // namespace

Section benchmarks() {
  Section section{"Benchmarks",
                  "A beam of 200 × 10 × 10 mm under a force at its end; a tapered, nearly "
                  "incompressible panel that is clamped and sheared (Cook's membrane); a thick "
                  "elliptic plate under pressure (NAFEMS LE10).",
                  {},
                  {}};
  beams(section);
  cook(section);
  cooks_reference(section);
  plate(section);
  return section;
}

} // namespace gewebe::validate
