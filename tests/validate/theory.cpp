// Against theory: constant strain, order of convergence.

#include "tests/validate/checks.h"
#include "tests/validate/peers.h"

#include <cmath>
#include <optional>

namespace gewebe::validate {

Section constant_strain() {
  Section section{
      "Patch test",
      "The sides of a box of distorted tetrahedra are displaced by a linear function. Every inner "
      "node must follow it. The error is the largest deviation over the largest displacement.",
      {},
      {}};
  for (const bool quadratic : {false, true})
    for (const double poisson : {0.0, 0.3, 0.4999}) {
      const auto [error, cost] = figure_of(test::patch(quadratic, poisson));
      section.checks.push_back(
          {std::string(quadratic ? "quadratic" : "linear") + " elements, ν = " + text_of(poisson),
           "Irons, Razzaque, Experience with the patch test for convergence of "
           "finite elements, 1972",
           "linear displacements", "the same", error, 1e-12, text_of(error, 2), cost});
    }
  return section;
}

Section manufactured() {
  Section section{
      "Order of convergence",
      "Manufactured solution: two standing waves in a cube, one of shear and one of volume. The "
      "error is the relative L2 norm. In theory it falls with the square (linear) or cube "
      "(quadratic) of the edge length, at every ν < 1/2 if the elements do not lock. The order is "
      "that of the two finest meshes and may be 0.2 lower. Linear elements beyond ν = 0.3 are "
      "shown without a bound, because they lock.",
      {},
      {}};
  const std::string source =
      "Roache, Code verification by the method of manufactured solutions, 2002";
  Plot plot{"order.svg",
            "Manufactured solution, ν = 0.499",
            "seconds of one processor",
            "L2 error of displacements",
            {}};
  const auto add = [&](bool quadratic, double poisson, std::initializer_list<std::uint32_t> sides,
                       bool judged) {
    Curve curve{std::string("Gewebe, ") + (quadratic ? "quadratic" : "linear"), {}};
    double before = 0, order = 0, sides_before = 0;
    Cost cost;
    for (const std::uint32_t n : sides) {
      const auto [error, spent] = figure_of(test::waves(n, quadratic, poisson));
      order = std::log(before / error) / std::log(n / sides_before);
      before = error;
      sides_before = n;
      cost = spent;
      curve.points.push_back({spent.total() / 1000, error});
    }
    const double wanted = quadratic ? 3 : 2;
    Check check{std::string(quadratic ? "quadratic" : "linear") +
                    " elements, ν = " + text_of(poisson) + ", order",
                source,
                text_of(wanted),
                text_of(order, 3),
                wanted - order,
                0.2,
                judged ? text_of(std::abs(wanted - order), 2) : "",
                cost};
    check.judged = judged;
    section.checks.push_back(check);
    return curve;
  };
  for (const double poisson : {0.3, 0.49, 0.499}) {
    Curve ours = add(true, poisson, {2, 3, 4, 6, 9, 12}, true);
    if (poisson == 0.499)
      plot.curves.push_back(ours);
  }
  (void)add(false, 0.3, {4, 6, 9, 14, 20}, true);
  (void)add(false, 0.49, {4, 6, 9, 14, 20}, false);
  plot.curves.push_back(add(false, 0.499, {4, 6, 9, 14, 20}, false));
  for (const bool mixed : {false, true}) {
    Curve peer{mixed ? "scikit-fem, our element" : "scikit-fem, plain quadratic", {}};
    for (const std::uint32_t n : {2U, 3U, 4U, 6U, 8U})
      if (const auto figure = figure_by_peer(test::waves(n, true, 0.499, !mixed),
                                             mixed ? PeerElement::mixed : PeerElement::plain))
        peer.points.push_back({figure->cost.total() / 1000, figure->value});
    if (!peer.points.empty())
      plot.curves.push_back(peer);
  }
  section.plots.push_back(plot);
  return section;
}

} // namespace gewebe::validate
