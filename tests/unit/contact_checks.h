#pragma once
// What contact with instruments has to meet, whatever it was found by.

#include "contact/surface_parts.h"
#include "larger.h"
#include "model/model.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <span>

namespace gewebe::test {

/// How deep the surface between nodes that can move is in an instrument, over its radius; below 0
/// where it isn't. \param u 3 n displacements
inline double surface_depth(const Model& model, std::span<const double> u,
                            const PlacedInstrument& placed) {
  double least = HUGE_VAL;
  const auto place = [&](std::uint32_t i) {
    return model.nodes[i].position +
           Vec3{u[3 * std::size_t{i}], u[3 * std::size_t{i} + 1], u[3 * std::size_t{i} + 2]};
  };
  const auto look = [&](const Facet& f) {
    for (const std::uint32_t i : f)
      if (model.nodes[i].fixed != fixed_none)
        return;
    const std::array<Vec3, 3> corners{place(f[0]), place(f[1]), place(f[2])};
    if (placed.core && goes_through(placed, corners))
      least = smaller(least, 0.0);
    for_parts(placed, f, corners, 2 * placed.radius, [&](CorePart part, const Facet& piece) {
      if (const auto found =
              nearest_points(placed, part, {place(piece[0]), place(piece[1]), place(piece[2])},
                             corner_count(piece));
          found && !found->behind)
        least = smaller(least, found->distance);
    });
  };
  for (const Triangle& t : model.triangles)
    look({t[0], t[1], t[2]});
  for (std::uint32_t i = 0; i < surface_count(model); ++i)
    look({i, i, i});
  return 1 - least / placed.radius;
}

} // namespace gewebe::test
