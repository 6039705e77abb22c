// Contact against theory: a rigid ball pressed into a block (Hertz 1881).

#include "contact/instrument.h"
#include "solid/solid_model.h"
#include "statics/elastostatic.h"
#include "statics/static_contact.h"
#include "tests/bench/timing.h"
#include "tests/validate/checks.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace gewebe::validate {

namespace {

constexpr double ball = 100, deep = 0.04; // mm: its radius, and how far it is pressed in
constexpr double young = 10000;           // Pa
const char* const theory = "Hertz, Über die Berührung fester elastischer Körper, 1881; Johnson, "
                           "Contact mechanics, 1985, section 4.2";

double force_of_theory(double poisson) {
  return 4.0 / 3 * young / (1 - poisson * poisson) * std::sqrt(ball * deep * deep * deep);
}
double radius_of_theory() {
  return std::sqrt(ball * deep);
}

/// A quarter of a block: cells of even width to beyond the touched circle, then wider and wider,
/// until the block is 300 times as large as that. Held by its symmetry, and on its far sides.
Model quarter_of_block(std::uint32_t across, bool quadratic, double poisson) {
  const double contact = radius_of_theory(), cell = contact / across;
  std::vector<double> at{0};
  while (at.back() < 1.2 * contact)
    at.push_back(at.back() + cell);
  const double ratio = std::pow(2.0, 3.0 / across);
  for (double width = cell * ratio; at.back() < 300 * contact; width *= ratio)
    at.push_back(at.back() + width);
  const auto n = static_cast<std::uint32_t>(at.size() - 1);
  TetMesh mesh = test::box_tetrahedra(n, n, n);
  for (Vec3& p : mesh.points)
    p = {at[static_cast<std::size_t>(p.x)], at[static_cast<std::size_t>(p.y)],
         -at[static_cast<std::size_t>(n - p.z)]};
  SolidModelOptions options;
  options.material.materials[0].young = young;
  options.material.materials[0].poisson = poisson;
  options.quadratic = quadratic;
  Model model = solid_model(std::move(mesh), options, timing::with_threads(2));
  for (Node& node : model.nodes) {
    const auto& [x, y, z] = node.position;
    if (x == at.back() || y == at.back() || z == -at.back())
      node.fixed = fixed_all;
    else
      node.fixed = static_cast<std::uint8_t>((x == 0 ? fixed_x : 0) | (y == 0 ? fixed_y : 0));
  }
  return model;
}

struct Pressed {
  double force = 0;  ///< on the whole ball, 1e-6 N
  double radius = 0; ///< of the touched circle, by the second moment of the forces, mm
  Cost cost;
};

Pressed press(std::uint32_t across, bool quadratic, double poisson) {
  const Model model = quarter_of_block(across, quadratic, poisson);
  Pressed found;
  for (const Node& node : model.nodes)
    for (int axis = 0; axis < 3; ++axis)
      found.cost.unknowns += (node.fixed >> axis & 1) == 0 ? 1 : 0;
  std::vector<double> u(3 * model.nodes.size());
  StaticContact contact(model, u);
  std::optional<Elastostatic> solver;
  const Pose before{{0, 0, ball}, {}}, now{{0, 0, ball - deep}, {}};
  const std::vector<std::optional<MovedInstrument>> moved{
      MovedInstrument{{ball, {}, 0}, before, now}};
  found.cost.solve = timing::processor_milliseconds([&] {
    solver.emplace(model, nullptr, timing::with_threads(1));
    contact.update([&]() -> Elastostatic& { return *solver; }, {}, moved, u);
  });
  double sum = 0, moment = 0;
  for (const NodeTouch& t : contact.touches()) {
    const Vec3& p = model.nodes[t.node].position;
    sum -= t.force.z;
    moment -= t.force.z * (p.x * p.x + p.y * p.y);
  }
  found.force = contact.solved() ? 4 * sum : NAN;
  // The pressure goes by sqrt(1 - r^2/a^2), so that the mean of r^2 over it is 2/5 a^2.
  found.radius = contact.solved() ? std::sqrt(2.5 * moment / sum) : NAN;
  return found;
}

} // namespace

Section hertz() {
  Section section{
      "A ball pressed into a block",
      "A rigid ball of 100 mm, pressed 0.04 mm into a quarter of a block that is 300 times as "
      "large "
      "as the touched circle, by the contact of `ffe-run`: the surface against the ball, "
      "without friction. The radius of the circle is that of the pressure's second moment. Linear elements "
      "are beside it in the plot.",
      {},
      {}};
  for (const double poisson : {0.3, 0.49}) {
    const std::string name = "ν = " + text_of(poisson);
    Plot plot{poisson < 0.4 ? "hertz.svg" : "hertz-049.svg",
              "A ball pressed into a block, " + name,
              "seconds of one processor",
              "error of the force",
              {}};
    for (const bool quadratic : {true, false}) {
      Curve curve{quadratic ? "Gewebe, quadratic" : "Gewebe, linear", {}};
      for (const std::uint32_t across :
           quadratic ? std::array{2U, 3U, 4U} : std::array{3U, 4U, 6U}) {
        const Pressed p = press(across, quadratic, poisson);
        const double force = p.force / force_of_theory(poisson),
                     radius = p.radius / radius_of_theory();
        curve.points.push_back({p.cost.total() / 1000, std::abs(force - 1)});
        if (!quadratic || across < 4)
          continue;
        section.checks.push_back({"ball in a block, " + name + ", force over theory",
                                  theory,
                                  "1",
                                  text_of(force),
                                  std::abs(force - 1),
                                  0.03,
                                  {},
                                  p.cost});
        section.checks.push_back({"ball in a block, " + name + ", radius over theory",
                                  theory,
                                  "1",
                                  text_of(radius),
                                  std::abs(radius - 1),
                                  0.03,
                                  {},
                                  p.cost});
      }
      plot.curves.push_back(std::move(curve));
    }
    section.plots.push_back(std::move(plot));
  }
  return section;
}

} // namespace gewebe::validate
