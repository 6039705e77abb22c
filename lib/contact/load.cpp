#include "contact/load.h"

#include <algorithm>
#include <vector>

namespace gewebe {

double Load::changes_until() const {
  if (!force_period.empty())
    return HUGE_VAL;
  double end = 0;
  for (const auto& [node, p] : pressure)
    if (p.period > 0)
      return HUGE_VAL;
  for (const auto& [node, way] : ramp)
    end = std::max(end, way.end);
  return end;
}

namespace {

/// Flags of the nodes that are middles of quadratic elements; empty where there is none.
std::vector<std::uint8_t> middles_of(const Model& model) {
  std::vector<std::uint8_t> flags(model.middles.empty() ? 0 : model.nodes.size());
  for (const EdgeMiddles& middles : model.middles)
    for (const std::uint32_t middle : middles)
      flags[middle] = 1;
  return flags;
}

/// A traction puts no force on the corners of a quadratic face: what a triangle has for its corner
/// goes to its middles, which so carry a third of the face each under an even pressure.
void hand_on(const Triangle& t, std::uint32_t corner, const std::vector<std::uint8_t>& is_middle,
             const Vec3& force, std::map<std::uint32_t, Vec3>& forces) {
  int middles = 0;
  if (!is_middle.empty() && is_middle[corner] == 0)
    middles = is_middle[t[0]] + is_middle[t[1]] + is_middle[t[2]];
  if (middles == 0) {
    forces[corner] += force;
    return;
  }
  for (const std::uint32_t node : t)
    if (is_middle[node] != 0)
      forces[node] += force / middles;
}

} // namespace

Load load_at(const Load& load, const Model& model, double time) {
  Load now{.force = load.force, .displacement = load.displacement, .gravity = load.gravity};
  for (const auto& [node, period] : load.force_period)
    now.force[node] *= pulse(time, period);
  for (const auto& [node, way] : load.ramp)
    now.displacement[node] = way.at(time);
  if (load.pressure.empty())
    return now;
  const std::vector<std::uint8_t> is_middle = middles_of(model);
  for (const Triangle& t : model.triangles) {
    const Vec3 &a = model.nodes[t[0]].position, &b = model.nodes[t[1]].position,
               &c = model.nodes[t[2]].position;
    const Vec3 third = cross(b - a, c - a) / 6;
    for (const std::uint32_t corner : t)
      if (const auto p = load.pressure.find(corner); p != load.pressure.end())
        hand_on(t, corner, is_middle, p->second.pressure * pulse(time, p->second.period) * third,
                now.force);
  }
  return now;
}

} // namespace gewebe
