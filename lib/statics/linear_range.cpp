#include "statics/linear_range.h"

#include "geometry/vector_at.h"

#include <algorithm>
#include <cmath>

namespace gewebe::statics {

namespace {

template <class Visit>
void visit_edges(const model::Model& model, const Visit& visit) {
  if (!model.tetrahedra.empty()) {
    for (const Triangle& t : model.triangles)
      for (std::size_t k = 0; k < 3; ++k)
        if (t[k] < t[(k + 1) % 3]) // the other triangle has it the other way around
          visit(t[k], t[(k + 1) % 3]);
    return;
  }
  for (const model::Spring& spring : model.springs) {
    if (spring.kind != model::SpringKind::edge)
      break; // edges come first
    visit(spring.i, spring.j);
  }
}

} // namespace

LinearRange linear_range(const model::Model& model, std::span<const double> displacement) {
  LinearRange range;
  visit_edges(model, [&](std::uint32_t i, std::uint32_t j) {
    const Vec3 along = model.nodes[j].position - model.nodes[i].position;
    const Vec3 by = vector_at(displacement, j) - vector_at(displacement, i);
    const double length = norm(along);
    const double strain = std::abs(norm(along + by) - length) / length;
    const double turn = norm(by - along * (dot(by, along) / (length * length))) / length;
    if (strain > range.strain) {
      range.strain = strain;
      range.strain_edge = {i, j};
    }
    if (turn > range.turn) {
      range.turn = turn;
      range.turn_edge = {i, j};
    }
  });
  return range;
}

double shortest_edge(const model::Model& model) {
  double shortest = HUGE_VAL;
  visit_edges(model, [&](std::uint32_t i, std::uint32_t j) {
    shortest = std::min(shortest, norm(model.nodes[j].position - model.nodes[i].position));
  });
  return shortest;
}

} // namespace gewebe::statics
