// Instruments slid over a net and over solids: their forces are continuous, push, and brake.

#include "contact/instrument.h"
#include "model/build.h"
#include "solid/solid_model.h"
#include "statics/elastostatic.h"
#include "statics/static_contact.h"
#include "stuffing/stuffing.h"
#include "tests/bench/timing.h"
#include "tests/unit/contact_checks.h"
#include "tests/unit/mesh_fixtures.h"
#include "tests/validate/checks.h"
#include "tests/validate/node_contact.h"
#include "tests/validate/organs.h"

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
  Model model;
  double edge = 0;                                      ///< mean one of its triangles, mm
  std::function<std::pair<Vec3, Vec3>(double)> surface; ///< point at a way, mm, and normal there
  std::shared_ptr<Elastostatic> solver{};
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
  for (Node& node : body.model.nodes)
    if (node.position.z <= held)
      node.fixed = fixed_all;
  body.solver = std::make_shared<Elastostatic>(body.model, nullptr, timing::with_threads(1));
}

Body net() {
  constexpr double radius = 60;
  BuildOptions options;
  options.bend = true;
  Body body{"net",
            build_model(test::sphere_mesh(4, radius, {}), options, timing::with_threads(1)).model,
            0, [](double way) { return over_ball(radius, way); }};
  finish(body, -0.7 * radius);
  return body;
}

SolidModelOptions tissue(bool quadratic) {
  SolidModelOptions options;
  options.material.materials[0].young = young;
  options.material.materials[0].poisson = poisson;
  options.quadratic = quadratic;
  return options;
}

Body ball() {
  constexpr double radius = 30;
  StuffingOptions options;
  options.cell = 4.5;
  TetMesh mesh = stuff(timing::with_threads(1),
                       organ_volume({test::sphere_mesh(5, radius, {}), 0, {}, {}}, 1), options);
  Body body{"solid ball", solid_model(std::move(mesh), tissue(false), timing::with_threads(1)), 0,
            [](double way) { return over_ball(radius, way); }};
  finish(body, -0.7 * radius);
  return body;
}

Body block(bool quadratic) {
  const std::uint32_t across = quadratic ? 6 : 12;
  const double cell = quadratic ? 8 : 4, height = cell * (quadratic ? 4 : 8);
  TetMesh mesh = test::box_tetrahedra(across, across, quadratic ? 4 : 8, cell);
  const double middle = cell * across / 2;
  for (Vec3& p : mesh.points)
    p -= {middle, middle, height};
  Body body{quadratic ? "quadratic block" : "block",
            solid_model(std::move(mesh), tissue(quadratic), timing::with_threads(1)), 0,
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
  double cone = 0;  ///< drag beyond the cone, over the largest force
  double slip = 0;  ///< of what sticks, over a step; of what slides, drag along its slip
  std::size_t steps = 0, failed = 0; ///< not solved
};

void worse(double& worst, double one) {
  worst = test::larger(worst, one);
}

/// What one step's points violate.
void judge(const StaticContact& contact, const Body& body, std::span<const double> before,
           std::span<const double> now, const MovedInstrument& moved, Slide& slide) {
  const PlacedInstrument placed(moved.shape, moved.now);
  double largest = 0;
  for (const PointTouch& t : contact.points())
    worse(largest, norm(t.force));
  const auto place = [&](const PointTouch& t, std::span<const double> u) {
    Vec3 p;
    for (std::size_t c = 0; c < 3; ++c) {
      const std::size_t i = t.nodes[c];
      p += t.weights[c] *
           (body.model.nodes[i].position + Vec3{u[3 * i], u[3 * i + 1], u[3 * i + 2]});
    }
    return p;
  };
  worse(slide.depth, test::surface_depth(body.model, now, placed));
  for (const PointTouch& t : contact.points()) {
    const Vec3 p = place(t, now), n = placed.normal(p);
    const double push = dot(t.force, n), most = moved.shape.friction * push;
    const Vec3 drag = t.force - push * n;
    worse(slide.pull, -push / largest);
    worse(slide.cone, (norm(drag) - most) / largest);
    if (!(moved.shape.friction > 0) || !(push > 1e-6 * largest))
      continue;
    const Vec3 way = p - carried(moved.before, moved.now, place(t, before)),
               slip = way - dot(way, n) * n;
    if (norm(drag) < most - 1e-6 * largest)
      worse(slide.slip, norm(slip) / along);
    else if (norm(slip) > 1e-6 * along)
      worse(slide.slip, norm(drag / norm(drag) + slip / norm(slip)));
  }
}

/// Pressed in at the beginning of the way, then slid. \param length of a capsule's segment
Slide slide(const Body& body, double radius, double friction, double length, double way) {
  Slide result;
  const InstrumentShape shape{radius, {0.8 * length, -0.6 * length, 0}, friction};
  const auto pose = [&](double depth, double at) {
    const auto [point, normal] = body.surface(at);
    return Pose{point + (radius - depth) * normal - 0.5 * shape.axis, {}};
  };
  std::vector<double> u(3 * body.model.nodes.size()), before;
  StaticContact contact(body.model, u);
  Pose last = pose(0, -way / 2);
  const auto go = [&](const Pose& to) {
    const MovedInstrument moved{shape, last, to};
    before = u;
    contact.update([&]() -> Elastostatic& { return *body.solver; }, {},
                   std::vector<std::optional<MovedInstrument>>{moved}, u);
    judge(contact, body, before, u, moved, result);
    ++result.steps;
    result.failed += contact.solved() ? 0 : 1;
    last = to;
    Vec3 sum;
    for (const NodeTouch& t : contact.touches())
      sum -= t.force;
    return sum;
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

/// The same with nodes alone.
Curve among_nodes(const Body& body, double radius, double way) {
  std::vector<std::uint32_t> nodes;
  for (std::uint32_t i = 0; i < surface_count(body.model); ++i)
    if (body.model.nodes[i].fixed == fixed_none) {
      double least = HUGE_VAL;
      for (double at = -way / 2; at <= way / 2; at += 1)
        least = test::smaller(least, norm(body.model.nodes[i].position - body.surface(at).first));
      if (least < radius + 1.5 * body.edge)
        nodes.push_back(i);
    }
  NodeContact contact(body.model, body.solver->delassus_operator({}, nodes));
  Curve curve;
  const auto press = [&](double depth, double at) {
    const auto [point, normal] = body.surface(at);
    return -dot(contact.press(point + (radius - depth) * normal, radius), normal);
  };
  for (double depth = along; depth < deep * radius - along / 2; depth += along)
    (void)press(depth, -way / 2);
  for (double at = -way / 2; at <= way / 2; at += along)
    curve.points.push_back({at + way / 2, press(deep * radius, at)});
  return curve;
}

} // namespace

Section sliding() {
  Section section{
      "Instruments slid over a surface",
      "Spheres, and capsules of three radii's length, pressed in by a third of their radius, then "
      "slid "
      "in steps of 0.04 mm over a net (a ball of 60 mm, 2,562 nodes), a ball of tetrahedra (30 mm) "
      "and blocks of tetrahedra, over edges and nodes as they come, by the static contact of "
      "`ffe-run`. A step changes the normal force by so much at most; each touched point is judged "
      "at "
      "each step. In the plots beside it the force where nodes alone are kept out of the sphere.",
      {},
      {}};
  const std::string source = "own bounds";
  Slide worst;
  for (const double share : {0.5, 2.0}) {
    Plot plot{share < 1 ? "sliding-half.svg" : "sliding-two.svg",
              "A sphere of " + std::string(share < 1 ? "half an edge" : "two edges") +
                  " slid along",
              "way, edges",
              "normal force over its mean with the surface",
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
        worse(worst.slip, s.slip);
        worst.failed += s.failed;
        worst.steps += s.steps;
        if (friction > 0 || length > 0)
          continue;
        double mean = 0;
        for (const Point& p : s.force.points)
          mean += p.y / static_cast<double>(s.force.points.size());
        Curve before = among_nodes(body, radius, way), now = s.force;
        const auto [low, high] = std::ranges::minmax(before.points, {}, &Point::y);
        section.checks.push_back(
            {what + ": force with nodes alone, over that of the surface", source, "1",
             text_of(std::abs(low.y / mean), 2) + " to " + text_of(high.y / mean, 2)});
        section.checks.back().judged = false;
        for (Curve* const curve : {&now, &before}) {
          curve->name = body.name + (curve == &now ? "" : ", nodes alone");
          for (Point& p : curve->points)
            p = {p.x / body.edge, p.y / mean};
          plot.curves.push_back(*curve);
        }
      }
    }
    section.plots.push_back(std::move(plot));
  }
  const auto all = [&](const std::string& what, double error, double bound) {
    section.checks.push_back(
        {"all steps: " + what, source, "0", text_of(error, 2), error, bound, text_of(error, 2)});
  };
  all("depth of the surface in an instrument, over its radius", worst.depth, 1e-6);
  all("pull, over the largest force", worst.pull, 1e-9);
  all("drag beyond the cone of friction, over the largest force", worst.cone, 1e-8);
  all("slip of what sticks over a step; drag beside the slip's way back", worst.slip, 1e-5);
  all("steps of " + std::to_string(worst.steps) + " not solved", static_cast<double>(worst.failed),
      0);
  return section;
}

} // namespace gewebe::validate
