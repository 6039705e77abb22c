// Instruments slid over a net and over solids: their forces are continuous, push, and brake.

#include "contact/instrument.h"
#include "fem/solid_model.h"
#include "geometry/vector_at.h"
#include "model/build.h"
#include "statics/elastostatic.h"
#include "stuffing/stuffing.h"
#include "tests/bench/timing.h"
#include "tests/unit/contact_checks.h"
#include "tests/unit/mesh_fixtures.h"
#include "tests/validate/checks.h"
#include "tests/validate/organs.h"
#include "tests/validate/pressed_body.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace gewebe::validate {

namespace {

constexpr double along = 0.04;   ///< mm, of a step
constexpr double deep = 1.0 / 3; ///< of its radius an instrument is pressed in
constexpr double young = 10000, poisson = 0.4;

/// A body, and a way over it.
struct Body {
  std::string name;
  model::Model model;
  double edge = 0;                                      ///< mean one of its triangles, mm
  std::function<std::pair<Vec3, Vec3>(double)> surface; ///< point at a way, mm, and normal there
  std::shared_ptr<statics::Elastostatic> solver{};
};

/// A way over a ball about 0 that meets edges and nodes in all ways, past its top.
std::pair<Vec3, Vec3> over_ball(double radius, double way) {
  const Vec3 top = Vec3{0.13, -0.21, 1} / norm(Vec3{0.13, -0.21, 1}),
             side = cross(top, Vec3{0.3, 1, 0}) / norm(cross(top, Vec3{0.3, 1, 0}));
  const double angle = way / radius;
  const Vec3 normal = std::cos(angle) * top + std::sin(angle) * side;
  return {radius * normal, normal};
}

void finish(Body& body, double held) {
  double sum = 0;
  for (const auto& t : body.model.triangles)
    for (std::size_t k = 0; k < 3; ++k)
      sum += norm(body.model.nodes[t[k]].position - body.model.nodes[t[(k + 1) % 3]].position);
  body.edge = sum / (3 * static_cast<double>(body.model.triangles.size()));
  for (model::Node& node : body.model.nodes)
    if (node.position.z <= held)
      node.fixed = model::fixed_all;
  body.solver =
      std::make_shared<statics::Elastostatic>(body.model, nullptr, timing::with_threads(1));
}

Body net() {
  constexpr double radius = 60;
  model::BuildOptions options;
  options.bend = true;
  Body body{
      "net",
      model::build_model(test::sphere_mesh(4, radius, {}), options, timing::with_threads(1)).model,
      0, [](double way) { return over_ball(radius, way); }};
  finish(body, -0.7 * radius);
  return body;
}

fem::SolidModelOptions tissue(bool quadratic) {
  fem::SolidModelOptions options;
  options.material.materials[0].young = young;
  options.material.materials[0].poisson = poisson;
  options.quadratic = quadratic;
  return options;
}

Body ball() {
  constexpr double radius = 30;
  stuffing::StuffingOptions options;
  options.cell = 4.5;
  tetrahedra::TetMesh mesh =
      stuffing::stuff(timing::with_threads(1),
                      organ_volume({test::sphere_mesh(5, radius, {}), 0, {}, {}}, 1), options);
  Body body{"solid ball", fem::solid_model(std::move(mesh), tissue(false), timing::with_threads(1)),
            0, [](double way) { return over_ball(radius, way); }};
  finish(body, -0.7 * radius);
  return body;
}

Body block(bool quadratic) {
  const std::uint32_t across = quadratic ? 6 : 12;
  const double cell = quadratic ? 8 : 4, height = cell * (quadratic ? 4 : 8);
  tetrahedra::TetMesh mesh = test::box_tetrahedra(across, across, quadratic ? 4 : 8, cell);
  const double middle = cell * across / 2;
  for (Vec3& p : mesh.points)
    p -= {middle, middle, height};
  Body body{quadratic ? "quadratic block" : "block",
            fem::solid_model(std::move(mesh), tissue(quadratic), timing::with_threads(1)), 0,
            [](double way) {
              const double turn = 0.35;
              return std::pair(Vec3{way * std::cos(turn), way * std::sin(turn), 0}, Vec3{0, 0, 1});
            }};
  finish(body, -height);
  return body;
}

/// What is worst on a way.
struct Slide {
  Curve force;      ///< along the surface's normal over the way
  double jump = 0;  ///< change of a step, over the force
  double depth = 0; ///< over the radius
  double pull = 0;  ///< over the largest force
  double cone = 0;  ///< friction on a sphere over what its normal forces allow, less 1
  double gain = 0;  ///< work of friction in a step, over what the largest force does
  std::size_t steps = 0, failed = 0; ///< not solved
};

void worse(double& worst, double one) {
  worst = test::larger(worst, one);
}

/// What one step's forces violate.
void judge(const PressedBody& pressed, const Body& body, std::span<const double> before,
           const contact::InstrumentShape& shape, const contact::Pose& from, Slide& slide) {
  const std::span<const double> now = pressed.displacement();
  std::vector<double> u(3 * body.model.nodes.size());
  std::ranges::copy(now, u.begin());
  worse(slide.depth, test::surface_depth(body.model, u, shape, pressed.pose()));
  const contact::PlacedInstrument placed(shape, pressed.pose());
  // Sums over nodes are those over pairs of a force each: of normal forces f along the radius d,
  // f d; of friction t across it, the torque d t.
  double largest = 0, work = 0, reach = 0;
  Vec3 torque;
  for (const PressedBody::Force& f : pressed.forces())
    worse(largest, norm(f.normal));
  for (const PressedBody::Force& f : pressed.forces()) {
    const Vec3 was = vector_at(before, f.node), is = vector_at(now, f.node);
    const Vec3 p = body.model.nodes[f.node].position + is;
    worse(slide.pull, -dot(f.normal, placed.normal(p)) / largest);
    reach += dot(f.normal, p - pressed.pose().place);
    torque += cross(p - pressed.pose().place, f.friction);
    work += dot(f.friction, is - was - (pressed.pose().place - from.place));
  }
  if (largest > 0 && shape.friction > 0 && shape.axis == Vec3{})
    worse(slide.cone, norm(torque) / (shape.friction * reach) - 1);
  if (largest > 0)
    worse(slide.gain, work / (largest * along));
}

/// Pressed in at the beginning of the way, then slid. \param length of a capsule's segment
Slide slide(const Body& body, double radius, double friction, double length, double way) {
  Slide result;
  const contact::InstrumentShape shape{radius, {0.8 * length, -0.6 * length, 0}, friction};
  const auto pose = [&](double depth, double at) {
    const auto [point, normal] = body.surface(at);
    return contact::Pose{point + (radius - depth) * normal - 0.5 * shape.axis, {}};
  };
  PressedBody pressed(body.model, *body.solver, shape,
                      pose(-0.01 * radius - 0.5 * length, -way / 2));
  const auto go = [&](const contact::Pose& to) {
    const std::vector<double> before(pressed.displacement().begin(), pressed.displacement().end());
    const contact::Pose from = pressed.pose();
    ++result.steps;
    if (!pressed.move(to))
      ++result.failed;
    else
      judge(pressed, body, before, shape, from, result);
    return pressed.force_on_instrument();
  };
  for (double depth = along; depth < deep * radius - along / 2; depth += along)
    (void)go(pose(depth, -way / 2));
  double force = HUGE_VAL;
  for (double at = -way / 2; at <= way / 2; at += along) {
    const Vec3 sum = go(pose(deep * radius, at)), normal = body.surface(at).second;
    const double push = dot(sum, normal);
    if (force < HUGE_VAL)
      worse(result.jump, std::abs(push - force) / std::min(push, force));
    force = push;
    result.force.points.push_back({at + way / 2, push});
  }
  return result;
}

} // namespace

Section sliding() {
  Section section{
      "Instruments slid over a surface",
      "Spheres, and capsules three radii long, are pressed in by a third of their radius and slide "
      "in steps of 0.04 mm over a net (ball of 60 mm, 2,562 nodes), a ball of tetrahedra (30 mm) "
      "and blocks of tetrahedra, by the static contact of `ffe-run`. The figures are the largest "
      "change of the normal force in a step; the forces on each node are checked at each step.",
      {},
      {}};
  const std::string source = "own bounds";
  Slide worst;
  for (const double share : {0.5, 2.0}) {
    Plot plot{share < 1 ? "sliding-half.svg" : "sliding-two.svg",
              "A sphere of " + std::string(share < 1 ? "half an edge" : "two edges") +
                  " slid along",
              "way, edges",
              "normal force over its mean",
              {},
              true};
    for (const Body& body : std::array{net(), ball(), block(false), block(true)}) {
      const double radius = share * body.edge, way = 3 * body.edge;
      for (const auto& [friction, length] :
           {std::pair(0.0, 0.0), std::pair(0.3, 0.0), std::pair(0.3, 3 * radius)}) {
        const Slide s = slide(body, radius, friction, length, way);
        const std::string what = body.name + ", " + (length > 0 ? "capsule" : "sphere") + " of " +
                                 (share < 1 ? "½ edge" : "2 edges") +
                                 (friction > 0 ? ", friction 0.3" : "");
        section.checks.push_back({what + ": change of force a step", source, "0", percent(s.jump),
                                  s.jump, share < 1 ? 0.02 : 0.005});
        section.checks.back().judged = length == 0;
        worse(worst.depth, s.depth);
        worse(worst.pull, s.pull);
        worse(worst.cone, s.cone);
        worse(worst.gain, s.gain);
        worst.failed += s.failed;
        worst.steps += s.steps;
        if (friction > 0 || length > 0)
          continue;
        double mean = 0;
        for (const Point& p : s.force.points)
          mean += p.y / static_cast<double>(s.force.points.size());
        Curve curve = s.force;
        curve.name = body.name;
        for (Point& p : curve.points)
          p = {p.x / body.edge, p.y / mean};
        plot.curves.push_back(std::move(curve));
      }
    }
    section.plots.push_back(std::move(plot));
  }
  const auto all = [&](const std::string& what, double error, double bound) {
    section.checks.push_back(
        {"all steps: " + what, source, "0", text_of(error, 2), error, bound, text_of(error, 2)});
  };
  all("depth of the surface in an instrument, over its radius", worst.depth, test::depth_allowed);
  all("pull, over the largest force", worst.pull, 1e-9);
  all("friction on a sphere over what its normal forces allow, less 1", worst.cone, 0.01);
  all("work that friction gives in a step, over that of the largest force", worst.gain, 1e-6);
  all("steps of " + std::to_string(worst.steps) + " not solved", static_cast<double>(worst.failed),
      0);
  return section;
}

} // namespace gewebe::validate
