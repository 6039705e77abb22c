#pragma once
// Forces between instruments and pieces of surface (contact/surface_point.h) whose nodes' places
// depend linearly on forces at them.
//
// In turn: the pairs' nearest points where the nodes were last; the contact of these points with
// the planes that support the instrument there (contact_solver.h); where the forces put the nodes.
// Forces turn and wander over the surface with the nodes they push: with H = ∂(Bᵀf)/∂x at the last
// forces, B the weights of the points, x = (1 - W H)⁻¹ (x_free + W (Bᵀ f - H x_last)), which is
// Newton's method on the conditions of the energy's minimum. Less of it is taken where it isn't
// stable; near the end, where that is so only but for the contacts, these hold their points. Near
// it, parts far from each other are solved each for itself (bent_parts_internal.h). Turns that
// begin with the last forces end before one that would change less than 1e-9, by what the last ones
// changed, if that was 1e-7 at most; where they do not end so near, they begin without them.

#include "contact/surface_parts.h"
#include "contact/surface_point.h"
#include "statics/elastostatic.h"
#include "statics/static_contact.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace gewebe {

/// A part of an instrument and a piece of surface, by numbers of ContactNodes.
struct TouchPair {
  std::uint32_t instrument = 0;
  CorePart part = CorePart::first_end;
  Facet piece{};
  SurfacePoint point;
  Vec3 normal; ///< 0: not known yet
  Vec3 force;  ///< on the piece
};

/// The nodes of all pieces that may touch: first those that the Delassus operator has, then others,
/// which don't give way; both ascending.
struct ContactNodes {
  std::vector<std::uint32_t> node;
  std::size_t moving = 0;
  std::vector<Vec3> was;    ///< where the instruments' ways began
  std::vector<Vec3> inward; ///< directions to move out by where nothing else says
  std::vector<Facet> pieces;
  /// Instruments meet those pieces alone that are seen by the same; empty: all meet all.
  std::vector<std::uint32_t> piece_seen_by{}, seen_by{}; ///< by piece, by instrument

  bool meet(std::uint32_t instrument, std::size_t piece) const {
    return seen_by.empty() || seen_by[instrument] == piece_seen_by[piece];
  }
};

struct ContactTurns {
  std::vector<TouchPair> last; ///< what pushed the nodes to where they were, if that was near
  /// Where the nodes would be if they went on as they came, and the same of `last`; or empty.
  std::vector<Vec3> guess;
  std::vector<Vec3> grown;      ///< what the forces of `last` would change
  std::vector<TouchPair> pairs; ///< in and out: all that were ever nearer than the radius
  std::vector<Vec3> at;         ///< the nodes' places
  bool solved = true;
  int turns = 0;
  double change = 0; ///< of what pushes, in the last turn: of normals, of points over the radius
  std::optional<TouchPair> stuck; ///< a piece that can't be moved out
};

/// \param free of all nodes \param placed, moved by instrument
void take_turns(const DelassusOperator& delassus, const ContactNodes& nodes,
                std::span<const Vec3> free, std::span<const std::optional<PlacedInstrument>> placed,
                std::span<const std::optional<MovedInstrument>> moved, ContactTurns& turns);

} // namespace gewebe
