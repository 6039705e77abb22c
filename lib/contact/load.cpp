#include "contact/load.h"

#include <algorithm>
#include <vector>

namespace gewebe::contact {

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
std::vector<std::uint8_t> middles_of(const model::Model& model) {
  std::vector<std::uint8_t> flags(model.middles.empty() ? 0 : model.nodes.size());
  for (const EdgeMiddles& middles : model.middles)
    for (const std::uint32_t middle : middles)
      flags[middle] = 1;
  return flags;
}

} // namespace

Load load_at(const Load& load, const model::Model& model, double time) {
  Load now{.force = load.force, .displacement = load.displacement, .gravity = load.gravity};
  for (const auto& [node, period] : load.force_period)
    now.force[node] *= pulse(time, period);
  for (const auto& [node, way] : load.ramp)
    now.displacement[node] = way.at(time);
  press(
      pressed_corners(load, model), time,
      [&](std::uint32_t node) { return model.nodes[node].position; },
      [&](std::uint32_t node, const Vec3& force) { now.force[node] += force; });
  return now;
}

std::vector<PressedCorner> pressed_corners(const Load& load, const model::Model& model) {
  std::vector<PressedCorner> all;
  if (load.pressure.empty())
    return all;
  const std::vector<std::uint8_t> is_middle = middles_of(model);
  for (const Triangle& t : model.triangles)
    for (const std::uint32_t corner : t) {
      const auto p = load.pressure.find(corner);
      if (p == load.pressure.end())
        continue;
      PressedCorner one{.triangle = t, .pressure = p->second};
      if (!is_middle.empty() && is_middle[corner] == 0)
        for (const std::uint32_t node : t)
          if (is_middle[node] != 0)
            one.bearers[one.count++] = node;
      if (one.count == 0)
        one.bearers[one.count++] = corner;
      all.push_back(one);
    }
  return all;
}

} // namespace gewebe::contact
