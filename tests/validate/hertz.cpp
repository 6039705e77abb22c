// Contact against theory: a rigid ball pressed into a block (Hertz 1881).

#include "contact/instrument.h"
#include "fem/solid_model.h"
#include "statics/elastostatic.h"
#include "tests/bench/timing.h"
#include "tests/validate/checks.h"
#include "tests/validate/pressed_body.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace gewebe::validate {

namespace {

constexpr double ball = 100, deep = 0.04;           // mm: its radius, and how far it is pressed in
constexpr double young = 10000;                     // Pa
constexpr double fine_gap = 1e-4, usual_gap = 1e-3; // over the cells: activation distance
const char* const theory = "Hertz, Über die Berührung fester elastischer Körper, 1881; Johnson, "
                           "Contact mechanics, 1985, section 4.2";

double force_of_theory(double poisson, double depth) {
  return 4.0 / 3 * young / (1 - poisson * poisson) * std::sqrt(ball * depth * depth * depth);
}
double radius_of_theory(double depth) {
  return std::sqrt(ball * depth);
}

/// A quarter of a block: cells of even width to beyond the touched circle, then wider and wider,
/// until the block is 300 times as large as that. Held by its symmetry, and on its far sides.
model::Model quarter_of_block(std::uint32_t across, bool quadratic, double poisson) {
  const double contact = radius_of_theory(deep), cell = contact / across;
  std::vector<double> at{0};
  while (at.back() < 1.2 * contact)
    at.push_back(at.back() + cell);
  const double ratio = std::pow(2.0, 3.0 / across);
  for (double width = cell * ratio; at.back() < 300 * contact; width *= ratio)
    at.push_back(at.back() + width);
  const auto n = static_cast<std::uint32_t>(at.size() - 1);
  tetrahedra::TetMesh mesh = test::box_tetrahedra(n, n, n);
  for (Vec3& p : mesh.points)
    p = {at[static_cast<std::size_t>(p.x)], at[static_cast<std::size_t>(p.y)],
         -at[static_cast<std::size_t>(n - p.z)]};
  fem::SolidModelOptions options;
  options.material.materials[0].young = young;
  options.material.materials[0].poisson = poisson;
  options.quadratic = quadratic;
  model::Model model = fem::solid_model(std::move(mesh), options, timing::with_threads(2));
  for (model::Node& node : model.nodes) {
    const auto& [x, y, z] = node.position;
    if (x == at.back() || y == at.back() || z == -at.back())
      node.fixed = model::fixed_all;
    else
      node.fixed =
          static_cast<std::uint8_t>((x == 0 ? model::fixed_x : 0) | (y == 0 ? model::fixed_y : 0));
  }
  return model;
}

struct Pressed {
  double force = 0;  ///< on the whole ball, 1e-6 N
  double radius = 0; ///< of the touched circle, by the second moment of the forces, mm
  Cost cost;
};

/// A block, and what it takes to press a ball into it.
class Block {
public:
  Block(std::uint32_t across, bool quadratic, double poisson)
      : model_(quarter_of_block(across, quadratic, poisson)),
        cell_(radius_of_theory(deep) / across) {
    for (const model::Node& node : model_.nodes)
      for (int axis = 0; axis < 3; ++axis)
        cost_.unknowns += (node.fixed >> axis & 1) == 0 ? 1 : 0;
    cost_.factor = timing::processor_milliseconds(
        [&] { solver_.emplace(model_, nullptr, timing::with_threads(1)); });
  }

  /// \param gap  activation distance over the touched cells
  Pressed press(double depth, double gap = fine_gap) {
    Pressed found;
    found.cost = cost_;
    // The gap by the narrow cells, since most edges of the block are far away and long.
    contact::Parameters parameters;
    parameters.lengths.activation_distance = 1;
    parameters.lengths.activation_over_radius = gap * cell_ / ball;
    PressedBody pressed(model_, *solver_, {ball, {}, 0}, {{0, 0, 1.001 * ball}, {}}, parameters);
    bool solved = false;
    found.cost.solve = timing::processor_milliseconds([&] {
      solved = pressed.move({{0, 0, ball - depth}, {}});
    });
    // A force F at a point p of the ball is along p - c, so that F (x^2 + y^2) is its moment
    // F_x x + F_y y times the ball's height; and moments may be taken at the nodes that share F.
    double sum = 0, moment = 0;
    for (const PressedBody::Force& f : pressed.forces()) {
      const Vec3& p = model_.nodes[f.node].position;
      sum -= f.normal.z;
      moment += (f.normal.x * p.x + f.normal.y * p.y) * (ball - depth);
    }
    found.force = solved ? 4 * sum : NAN;
    // The pressure goes by sqrt(1 - r^2/a^2), so that the mean of r^2 over it is 2/5 a^2.
    found.radius = solved ? std::sqrt(2.5 * moment / sum) : NAN;
    return found;
  }

private:
  model::Model model_;
  double cell_; ///< of the touched circle
  std::optional<statics::Elastostatic> solver_;
  Cost cost_;
};

/// Force and radius over the depth, in one mesh.
template <class Check>
void over_depth(Block& block, double poisson, Section& section, Check&& check) {
  Plot force{
      "hertz-depth.svg", "A ball pressed into a block, ν = 0.3", "depth, mm", "force, mN", {}},
      radius{"hertz-radius.svg",
             "A ball pressed into a block, ν = 0.3",
             "depth, mm",
             "radius of the touched circle, mm",
             {}};
  Curve force_found{"Gewebe", {}}, force_known{"Hertz", {}}, radius_found = force_found,
                                                             radius_known = force_known;
  double force_off = 0, radius_off = 0;
  for (const double share : {0.25, 0.35, 0.5, 0.7, 1.0}) {
    const double depth = share * deep;
    const Pressed p = block.press(depth);
    const double f = force_of_theory(poisson, depth), a = radius_of_theory(depth);
    force_off = test::larger(force_off, std::abs(p.force / f - 1));
    radius_off = test::larger(radius_off, std::abs(p.radius / a - 1));
    force_found.points.push_back({depth, p.force / 1000});
    force_known.points.push_back({depth, f / 1000});
    radius_found.points.push_back({depth, p.radius});
    radius_known.points.push_back({depth, a});
  }
  check("force over depth, from a quarter of it on", "1", 1 + force_off, force_off, 0.04);
  check("radius over depth, from a quarter of it on", "1", 1 + radius_off, radius_off, 0.04);
  force.curves = {std::move(force_found), std::move(force_known)};
  radius.curves = {std::move(radius_found), std::move(radius_known)};
  section.plots = {std::move(force), std::move(radius)};
}

} // namespace

Section hertz() {
  Section section{
      "A ball pressed into a block",
      "Hertz contact: a rigid ball of 100 mm is pressed 0.04 mm into a quarter of a block, 300 "
      "times as large as the contact circle, without friction, by the contact of `ffe-run` with an "
      "activation distance of 1e-4 cells (1e-3 is usual). The radius of the circle comes from the "
      "second moment of the pressure. The plots also show linear elements. Flat facets touch the "
      "ball in their middles, so their corners are pressed in deeper; this error falls nearly with "
      "the square of their width.",
      {},
      {}};
  const auto check = [&](const std::string& what, const std::string& reference, double figure,
                         double error, double bound, const Cost& cost = {}) {
    section.checks.push_back(
        {"ball in a block, " + what, theory, reference, text_of(figure), error, bound, {}, cost});
  };
  for (const double poisson : {0.3, 0.49}) {
    const std::string name = "ν = " + text_of(poisson);
    Plot plot{poisson < 0.4 ? "hertz.svg" : "hertz-049.svg",
              "A ball pressed into a block, " + name,
              "seconds of one processor",
              "error of the force",
              {}};
    for (const bool quadratic : {true, false}) {
      const std::string elements = quadratic ? "quadratic" : "linear";
      Curve curve{elements, {}};
      for (const std::uint32_t across :
           quadratic ? std::array{2U, 3U, 4U} : std::array{3U, 4U, 6U}) {
        Block block(across, quadratic, poisson);
        const Pressed p = block.press(deep);
        const double force = p.force / force_of_theory(poisson, deep),
                     radius = p.radius / radius_of_theory(deep), seconds = p.cost.total() / 1000;
        curve.points.push_back({seconds, std::abs(force - 1)});
        if (!quadratic || across < 4)
          continue;
        check(name + ", force over theory", "1", force, std::abs(force - 1), 0.02, p.cost);
        check(name + ", force over theory at the usual activation distance", "1",
              block.press(deep, usual_gap).force / force_of_theory(poisson, deep), 0, 0);
        section.checks.back().judged = false;
        check(name + ", radius over theory", "1", radius, std::abs(radius - 1), 0.01, p.cost);
        if (poisson < 0.4)
          over_depth(block, poisson, section, check);
      }
      // From cells twice as wide to the narrowest.
      const double order = std::log2(curve.points.front().y / curve.points.back().y);
      check(name + ", " + elements + " elements, order of the force's convergence", "2", order,
            test::larger(0.0, 2 - order), 0.3);
      section.checks.back().judged = quadratic || poisson < 0.4; // linear ones lock
      plot.curves.push_back(std::move(curve));
    }
    section.plots.insert(section.plots.begin() + (poisson < 0.4 ? 0 : 1), std::move(plot));
  }
  return section;
}

} // namespace gewebe::validate
