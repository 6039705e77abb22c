#include "statics/linear_range.h"

#include <algorithm>
#include <cmath>

namespace gewebe {

LinearRange linear_range(const Model& model, std::span<const double> displacement) {
  const auto moved = [&](std::size_t node) {
    return Vec3{displacement[3 * node], displacement[3 * node + 1], displacement[3 * node + 2]};
  };
  LinearRange range;
  for (std::size_t s = 0; s < model.springs.size(); ++s) {
    const Spring& spring = model.springs[s];
    if (spring.kind != SpringKind::edge)
      break; // edges come first
    const Vec3 along = model.nodes[spring.j].position - model.nodes[spring.i].position;
    const Vec3 by = moved(spring.j) - moved(spring.i);
    const double length = norm(along);
    const double strain = std::abs(norm(along + by) - length) / length;
    const double turn = norm(by - along * (dot(by, along) / (length * length))) / length;
    if (strain > range.strain) {
      range.strain = strain;
      range.strain_spring = s;
    }
    if (turn > range.turn) {
      range.turn = turn;
      range.turn_spring = s;
    }
  }
  return range;
}

double shortest_edge(const Model& model) {
  double shortest = HUGE_VAL;
  for (const Spring& spring : model.springs)
    if (spring.kind == SpringKind::edge)
      shortest =
          std::min(shortest, norm(model.nodes[spring.j].position - model.nodes[spring.i].position));
  return shortest;
}

} // namespace gewebe
