#pragma once
// Organs that are pressed together, and tubes that are folded, as solids and as nets; and what came
// of it, from what scenes tell.

#include "fem/solid_model.h"
#include "geometry/vector_at.h"
#include "larger.h"
#include "mesh_fixtures.h"
#include "model/build.h"
#include "overlap.h"
#include "scene/simulation.h"
#include "sim_models.h"
#include "simulation_scenes.h"
#include "stuffing/stuffing.h"
#include "tet_organs.h"
#include "touching_blocks.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

namespace gewebe::test {

inline const std::vector<model::Material>& soft_tissue() {
  static const std::vector<model::Material> all{{"tissue", 1e-3, 2e4, 1, 0.2, 0.4}};
  return all;
}

constexpr double tissue_drag = 40; ///< 1/s: it comes to rest soon

inline model::Model solid_of(const tetrahedra::TetMesh& mesh) {
  fem::SolidModelOptions options;
  options.material.materials = soft_tissue();
  options.quadratic = false;
  options.drag_rate = tissue_drag;
  return fem::solid_model(mesh, options, {});
}

inline model::Model net_of(const TriangleMesh& mesh) {
  model::BuildOptions options;
  options.material.materials = soft_tissue();
  options.drag_rate = tissue_drag;
  options.bend = true;
  options.centrals_free = true;
  return model::build_model(mesh, options, Context{}).model;
}

/// So that its box is so long, and stands on this place by the middle of its lower side.
inline TriangleMesh placed(TriangleMesh mesh, double size, const Vec3& on) {
  Box3 box;
  for (const Triangle& t : mesh.triangles)
    for (const std::uint32_t i : t)
      box.add(mesh.points[i]);
  const double scale = size / box.longest_side();
  const Vec3 low{(box.min.x + box.max.x) / 2, (box.min.y + box.max.y) / 2, box.min.z};
  for (Vec3& p : mesh.points)
    p = on + scale * (p - low);
  return mesh;
}

/// The part of its nodes below (or above), of its height.
inline std::vector<std::uint32_t> ends_of(const model::Model& model, bool below,
                                          double part = 0.2) {
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (const model::Node& n : model.nodes) {
    low = numeric::smaller(low, n.position.z);
    high = numeric::larger(high, n.position.z);
  }
  std::vector<std::uint32_t> all;
  for (std::uint32_t i = 0; i < model.nodes.size(); ++i) {
    const double height = (model.nodes[i].position.z - low) / (high - low);
    if (below ? height <= part : height >= 1 - part)
      all.push_back(i);
  }
  return all;
}

/// A closed tube along these middles, each ring of so many nodes.
inline TriangleMesh tube_round(const std::vector<Vec3>& middles, std::uint32_t around,
                               double radius) {
  TriangleMesh mesh;
  const std::size_t count = middles.size();
  Vec3 side{0, 1, 0};
  for (std::size_t k = 0; k < count; ++k) {
    const Vec3 way = middles[std::min(k + 1, count - 1)] - middles[k > 0 ? k - 1 : 0];
    const Vec3 along = way / norm(way);
    side -= dot(side, along) * along;
    side = side / norm(side);
    const Vec3 up = cross(along, side);
    for (std::uint32_t a = 0; a < around; ++a) {
      const double angle = 2 * std::numbers::pi * a / around;
      mesh.points.push_back(middles[k] + radius * (std::cos(angle) * side + std::sin(angle) * up));
    }
  }
  for (std::uint32_t k = 0; k + 1 < count; ++k)
    for (std::uint32_t a = 0; a < around; ++a) {
      const std::uint32_t b = (a + 1) % around, here = k * around, there = here + around;
      mesh.triangles.push_back({here + a, here + b, there + b});
      mesh.triangles.push_back({here + a, there + b, there + a});
    }
  for (const bool end : {false, true}) {
    const auto middle = static_cast<std::uint32_t>(mesh.points.size());
    const auto ring = static_cast<std::uint32_t>(end ? (count - 1) * around : 0);
    mesh.points.push_back(end ? middles.back() : middles.front());
    for (std::uint32_t a = 0; a < around; ++a) {
      const std::uint32_t b = (a + 1) % around;
      mesh.triangles.push_back(end ? Triangle{middle, ring + a, ring + b}
                                   : Triangle{middle, ring + b, ring + a});
    }
  }
  return mesh;
}

/// Middles of a hairpin: two legs along x, one above the other.
inline std::vector<Vec3> hairpin(double leg, double apart, double step) {
  std::vector<Vec3> all;
  const double bend = apart / 2;
  const auto count = static_cast<int>(std::lround(leg / step));
  for (int k = 0; k < count; ++k)
    all.push_back({leg - k * step, 0, 0});
  const auto turns = static_cast<int>(std::ceil(std::numbers::pi * bend / step));
  for (int k = 0; k <= turns; ++k) {
    const double angle = std::numbers::pi * k / turns;
    all.push_back({-bend * std::sin(angle), 0, bend - bend * std::cos(angle)});
  }
  for (int k = 1; k <= count; ++k)
    all.push_back({k * step, 0, apart});
  return all;
}

inline tetrahedra::TetMesh stuffed(const TriangleMesh& surface, double cells) {
  return surface.triangles.empty() ? tetrahedra::TetMesh{} : surface_tetrahedra(surface, cells);
}

/// Of an object as a scene has it.
inline TriangleMesh surface_of(const scene::Simulation& s, std::size_t object, bool moved = true) {
  TriangleMesh mesh = model::surface_mesh(s.model(object));
  if (!moved)
    return mesh;
  const std::span<const double> u = s.displacement(object);
  for (std::size_t i = 0; i < mesh.points.size() && 3 * i < u.size(); ++i)
    mesh.points[i] += vector_at(u, i);
  return mesh;
}

/// Of all that is told of an object's nodes: nothing holds them but what the model fixes.
struct Pushed {
  Vec3 sum;
  double size = 0; ///< of all forces
  std::size_t nodes = 0;
};

inline Pushed pushed(const scene::Simulation& s, std::size_t object) {
  Pushed all;
  for (const contact::NodeVector& f : s.contact_forces(object)) {
    all.sum += f.value;
    all.size += norm(f.value);
    ++all.nodes;
  }
  return all;
}

struct Rest {
  bool rests = false;
  Vec3 up;                 ///< force on the upper one
  double size = 0;         ///< of all forces on it, or on what touches itself
  double off = 0;          ///< of that: the most in any step that nobody answers
  Overlap inside;          ///< at rest
  std::size_t touched = 0; ///< its nodes at rest
};

constexpr double press_step = 1.0 / 60;
constexpr double rest_speed = 0.02; ///< mm/s: a fifth of the slip speed up to which friction sticks

/// Steps until nothing moves faster than rest_speed. \param look of each step
template <class Look>
bool come_to_rest(scene::Simulation& s, double edge, double longest, Look&& look) {
  const double before = s.time();
  std::vector<std::vector<double>> was(s.object_count());
  while (s.time() - before < longest) {
    s.step(press_step);
    look();
    double most = 0;
    for (std::size_t k = 0; k < s.object_count(); ++k) {
      std::vector<double> now = shape(s, k);
      for (std::size_t a = 0; a < now.size(); ++a)
        most = numeric::larger(most, was[k].empty() ? edge : std::abs(now[a] - was[k][a]));
      was[k] = std::move(now);
    }
    if (most <= rest_speed * press_step)
      return true;
  }
  return false;
}

/// How far the upper one may go down, by a geometry of its own, until it meets the lower one.
inline double clearance(const model::Model& below, const model::Model& above) {
  const TriangleMesh low = model::surface_mesh(below), high = model::surface_mesh(above);
  const auto meets = [&](double down) {
    TriangleMesh moved = high;
    for (Vec3& p : moved.points)
      p.z -= down;
    Overlap both = depth_inside(moved, low, 1);
    both.add(depth_inside(low, moved, 1));
    return numeric::larger(both.nodes, both.edges) > 0;
  };
  double apart = 0, together = 1;
  while (!meets(together) && together < 1e3)
    apart = std::exchange(together, 2 * together);
  while (together - apart > 1e-2) {
    const double middle = (apart + together) / 2;
    (meets(middle) ? together : apart) = middle;
  }
  return apart;
}

struct Press {
  double force = 1e5;  ///< 1e-6 N, in all
  double longest = 3;  ///< s that it may take to rest
  double friction = 0; ///< Coulomb's
  bool meet = true;
  /// The lower one is elastostatic. Halves of steps tell means of the other's forces, so that the
  /// last step's count alone.
  bool still = false;
};

/// Presses the upper end of an object straight down.
inline void press_down(scene::Simulation& s, std::size_t object,
                       const std::vector<std::uint32_t>& led, double force) {
  s.apply(scene::SetForce{object, led, {0, 0, -force / static_cast<double>(led.size())}});
}

/// Presses the upper one, by its upper end, onto the lower one, which is held below.
inline Rest pressed_together(model::Model below, model::Model above, const Press& press) {
  const double down = clearance(below, above) - 0.1;
  for (model::Node& n : above.nodes)
    n.position.z -= down;
  for (const std::uint32_t i : ends_of(below, true))
    below.nodes[i].fixed = model::fixed_all;
  const std::vector<std::uint32_t> led = ends_of(above, false);
  for (const std::uint32_t i : led)
    above.nodes[i].fixed = model::fixed_x | model::fixed_y;
  scene::Simulation s(one_thread(), {});
  if (press.still) {
    s.add_object("below", below, scene::Method::ffe);
    s.apply(scene::SetTimestep{press_step});
  } else {
    add(s, "below", below);
  }
  add(s, "above", above);
  if (press.meet)
    s.apply(scene::SetContact{1, 0, press.friction});
  press_down(s, 1, led, press.force);
  const double edge =
      numeric::smaller(mean_edge(surface_of(s, 0, false)), mean_edge(surface_of(s, 1, false)));
  Rest rest;
  const auto overlap_now = [&] {
    const TriangleMesh a = surface_of(s, 0), b = surface_of(s, 1);
    Overlap most = depth_inside(a, b, edge);
    most.add(depth_inside(b, a, edge));
    return most;
  };
  rest.rests = come_to_rest(s, edge, press.longest, [&] {
    const Pushed one = pushed(s, 1), other = pushed(s, 0);
    rest.up = one.sum;
    rest.size = one.size;
    rest.touched = one.nodes;
    if (one.size > 0 || other.size > 0) {
      const double off = norm(one.sum + other.sum) / numeric::smaller(one.size, other.size);
      rest.off = press.still ? off : numeric::larger(rest.off, off);
    }
  });
  rest.inside = overlap_now();
  return rest;
}

/// Presses an object that is held at its lower end, by its upper one, until it touches itself.
inline Rest folded(model::Model model, const std::vector<std::uint32_t>& held,
                   const std::vector<std::uint32_t>& led, const Press& press) {
  for (const std::uint32_t i : led)
    model.nodes[i].fixed = model::fixed_x | model::fixed_y;
  for (const std::uint32_t i : held)
    model.nodes[i].fixed = model::fixed_all;
  scene::Simulation s(one_thread(), {});
  add(s, "tube", model);
  if (press.meet)
    s.apply(scene::SetContact{0, 0, press.friction});
  press_down(s, 0, led, press.force);
  const double edge = mean_edge(surface_of(s, 0, false));
  Rest rest;
  rest.rests = come_to_rest(s, edge, press.longest, [&] {
    const Pushed all = pushed(s, 0);
    rest.size = all.size;
    rest.touched = all.nodes;
    if (all.size > 0)
      rest.off = numeric::larger(rest.off, norm(all.sum) / all.size);
  });
  rest.inside.edges = depth_in_itself(surface_of(s, 0), edge);
  return rest;
}

} // namespace gewebe::test
