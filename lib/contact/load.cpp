#include "contact/load.h"

#include <algorithm>

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

Load load_at(const Load& load, const Model& model, double time) {
  Load now{.force = load.force, .displacement = load.displacement, .gravity = load.gravity};
  for (const auto& [node, period] : load.force_period)
    now.force[node] *= pulse(time, period);
  for (const auto& [node, way] : load.ramp)
    now.displacement[node] = way.at(time);
  if (load.pressure.empty())
    return now;
  for (const Triangle& t : model.triangles) {
    const Vec3 &a = model.nodes[t[0]].position, &b = model.nodes[t[1]].position,
               &c = model.nodes[t[2]].position;
    const Vec3 third = cross(b - a, c - a) / 6;
    for (const std::uint32_t corner : t)
      if (const auto p = load.pressure.find(corner); p != load.pressure.end())
        now.force[corner] += p->second.pressure * pulse(time, p->second.period) * third;
  }
  return now;
}

} // namespace gewebe
