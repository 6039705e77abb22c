#pragma once
// What acts on one object, whichever method simulates it.

#include "contact/instrument.h"
#include "geometry/vec3.h"
#include "model/model.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

namespace gewebe::contact {

/// A node's own vector.
struct NodeVector {
  std::uint32_t node = 0;
  Vec3 value;

  bool operator==(const NodeVector&) const = default;
};

/// From 0 to 1 without a jump in speed. \pre 0 <= x <= 1
inline double smooth_step(double x) {
  return x * x * (3 - 2 * x);
}

/// Factor of a load that pulses with `period` s: 0 at every whole period, 1 in the middle of it,
/// near to (1 - cos)/2 but the same bytes on every machine. 1 for period 0. \pre time >= 0
inline double pulse(double time, double period) {
  if (!(period > 0))
    return 1;
  const double phase = time / period - std::floor(time / period);
  return smooth_step(1 - std::abs(2 * phase - 1));
}

/// A pressure in Pa along the vertex normals, as from inside, pulsing unless period is 0.
struct NodePressure {
  double pressure = 0, period = 0;

  bool operator==(const NodePressure&) const = default;
};

/// What takes a node along: a point of a rigid body on its way, and where the node rests.
struct Carrier {
  PoseWay way;
  Vec3 point, rest;

  Vec3 at(double time) const { return way.at(time)(point) - rest; }
  bool operator==(const Carrier&) const = default;
};

/// A displaced node's way, taken smoothly from `start` to `end` s, straight or with a rigid body.
struct Ramp {
  Vec3 from, to;
  double start = 0, end = 0;
  std::optional<Carrier> by{};

  Vec3 at(double time) const {
    if (!(time < end))
      return to;
    if (by)
      return by->at(time);
    const double x = time > start ? (time - start) / (end - start) : 0;
    return from + smooth_step(x) * (to - from);
  }
  bool operator==(const Ramp&) const = default;
};

/// Nodes without a force have none, nodes without a displacement are free. Where both are given the
/// displacement holds, and its support carries the force too.
struct Load {
  std::map<std::uint32_t, Vec3> force{};          ///< 1e-6 N
  std::map<std::uint32_t, Vec3> displacement{};   ///< from rest, mm
  Vec3 gravity{};                                 ///< mm/s²
  std::map<std::uint32_t, double> force_period{}; ///< of the forces that pulse, s
  std::map<std::uint32_t, NodePressure>
      pressure{};                       ///< on a third of each triangle at the node (load_at)
  std::map<std::uint32_t, Ramp> ramp{}; ///< of displaced nodes that are on their way

  bool operator==(const Load&) const = default;
  bool empty() const {
    return force.empty() && displacement.empty() && gravity == Vec3{} && pressure.empty();
  }
  /// Until when it changes with time: the end of the last ramp, or for ever.
  double changes_until() const;
};

/// The load at one time: forces without a period, with the pressures among them, along the normals
/// at rest, and displacements.
Load load_at(const Load& load, const model::Model& model, double time);

/// A corner of a triangle under a pressure, and the nodes that carry its force. On a quadratic face
/// these are the middles of its edges: an even traction puts a third of the force on each middle
/// and none on the corners.
struct PressedCorner {
  Triangle triangle{};
  NodePressure pressure;
  std::array<std::uint32_t, 3> bearers{};
  std::uint32_t count = 0; ///< of bearers
};
std::vector<PressedCorner> pressed_corners(const Load& load, const model::Model& model);

/// Calls add(node, force) for all that pressures do at a time, with nodes where place(node) says.
template <class Place, class Add>
void press(std::span<const PressedCorner> corners, double time, Place&& place, Add&& add) {
  for (const PressedCorner& c : corners) {
    const Vec3 at = place(c.triangle[0]);
    const Vec3 third = cross(place(c.triangle[1]) - at, place(c.triangle[2]) - at) / 6;
    const Vec3 force = c.pressure.pressure * pulse(time, c.pressure.period) * third;
    for (std::uint32_t k = 0; k < c.count; ++k)
      add(c.bearers[k], force / static_cast<double>(c.count));
  }
}

/// Whether the model holds `node` along `axis` (0 to 2).
inline bool is_fixed(const model::Model& model, std::size_t node, int axis) {
  return (model.nodes[node].fixed >> axis & 1) != 0;
}

} // namespace gewebe::contact
