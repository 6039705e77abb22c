#pragma once
// The pairs of a piece of surface with the parts of an instrument's core (surface_point.h).

#include "contact/convex_core.h"
#include "contact/surface_point.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace gewebe {

/// What is left of a piece without some of its corners; none of no corner.
template <class Keep>
std::optional<Facet> part_of(const Facet& piece, Keep&& keep) {
  Facet left{};
  std::size_t count = 0;
  for (int c = 0; c < corner_count(piece); ++c)
    if (const std::uint32_t i = piece[static_cast<std::size_t>(c)]; keep(i))
      left[count++] = i;
  if (count == 0)
    return std::nullopt;
  for (std::size_t c = count; c < 3; ++c)
    left[c] = left[count - 1];
  return left;
}

/// Calls visit(part, piece) for each: `piece` itself, an edge (ascending, as pieces that share it
/// have it) or a corner of it. \param corners where those of the piece are \param reach pairs of a
/// polyhedron that are farther apart may be left out
template <class Visit>
void for_parts(const PlacedInstrument& instrument, const Facet& piece,
               const std::array<Vec3, 3>& corners, double reach, Visit&& visit) {
  const auto count = static_cast<std::size_t>(corner_count(piece));
  const auto corner = [&](std::size_t c) { return Facet{piece[c], piece[c], piece[c]}; };
  const auto edge = [&](std::size_t c) { // from this corner to the next
    const std::uint32_t i = piece[c], j = piece[(c + 1) % count];
    return i < j ? Facet{i, j, j} : Facet{j, i, i};
  };
  const std::size_t edges = count == 3 ? 3 : count - 1;
  if (instrument.core) {
    const Pose pose = instrument.pose();
    Box3 box;
    for (const Vec3& p : corners)
      box.add(pose.inverse(p));
    box.min -= {reach, reach, reach};
    box.max += {reach, reach, reach};
    if (!near(box, instrument.core->box()))
      return;
    for (std::size_t c = 0; c < count; ++c)
      visit(CorePart::whole, corner(c));
    if (count == 1)
      return;
    instrument.core->visit_corners(box, [&](std::uint32_t number) {
      visit(CorePart{CorePart::Kind::corner, number}, piece);
    });
    instrument.core->visit_edges(box, [&](std::uint32_t number) {
      for (std::size_t c = 0; c < edges; ++c)
        visit(CorePart{CorePart::Kind::edge, number}, edge(c));
    });
    return;
  }
  visit(CorePart::first_end, piece);
  if (!(instrument.inverse_square > 0))
    return;
  visit(CorePart::second_end, piece);
  for (std::size_t c = 0; c < count; ++c) {
    visit(CorePart::between, corner(c));
    if (c < edges)
      visit(CorePart::between, edge(c));
  }
}

} // namespace gewebe
