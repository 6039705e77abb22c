#pragma once
// The pairs of a piece of surface with the parts of an instrument's core (surface_point.h).

#include "contact/surface_point.h"

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
/// have it) or a corner of it.
template <class Visit>
void for_parts(const PlacedInstrument& instrument, const Facet& piece, Visit&& visit) {
  visit(CorePart::first_end, piece);
  if (!(instrument.inverse_square > 0))
    return;
  visit(CorePart::second_end, piece);
  const int count = corner_count(piece);
  for (int c = 0; c < count; ++c) {
    const std::uint32_t i = piece[static_cast<std::size_t>(c)];
    visit(CorePart::between, Facet{i, i, i});
    if (count == 1 || (count == 2 && c == 1))
      continue;
    const std::uint32_t j = piece[static_cast<std::size_t>((c + 1) % count)];
    visit(CorePart::between, i < j ? Facet{i, j, j} : Facet{j, i, i});
  }
}

} // namespace gewebe
