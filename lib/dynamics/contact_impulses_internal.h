#pragma once
// Impulses between instruments and pieces of surface (contact/surface_point.h) whose nodes have
// masses: one behind the other in sweeps, each with what the ones before have left (Gauss and
// Seidel's way), which converges to the velocities that meet all conditions.

#include "contact/instrument.h"
#include "contact/surface_point.h"

#include <cstdint>
#include <span>
#include <vector>

namespace gewebe {

/// Nodes of pieces near instruments.
struct MassPoints {
  std::vector<Vec3> place, velocity;
  std::vector<Vec3> inverse_mass; ///< by axis; 0: held
  std::vector<Vec3> inward;       ///< the way out where nothing else says
  std::vector<Facet> pieces;      ///< of these nodes
};

/// An instrument, and its way since `before` when `step` s ago.
struct MovingCore {
  PlacedInstrument placed;
  Pose from, to;
  double step = 0; ///< 0: it stands
  /// Of one that gives way: velocity per impulse on it beyond the one that it goes `to` there with.
  double gives = 0;
  Vec3 expected{};
};

/// Where an instrument is nearer to a piece than its radius.
struct PieceTouch {
  std::uint32_t instrument = 0;
  CorePart part = CorePart::first_end;
  Facet piece{};
  SurfacePoint point;
  Vec3 normal;
  Vec3 impulse; ///< on the piece; before, a guess that pushes
};

/// All of them that are nearer than the radius times 1 + `margin`, in the pieces' order.
std::vector<PieceTouch> touches_of(const MassPoints& points, std::span<const MovingCore> cores,
                                   double margin);

/// Takes a touch's point and normal from where the nodes are now, if they have one.
void locate(const MassPoints& points, std::span<const MovingCore> cores, PieceTouch& touch);

/// Moves nodes out of the instruments, the less the heavier they are, until no piece is deeper than
/// `depth` of a radius, or for `sweeps`. \return whether none is
bool move_out(MassPoints& points, std::span<const MovingCore> cores, double depth, int sweeps);

/// Velocities behind the contact: no point leads into an instrument, against its own surface, but
/// for what was left to it when the step began, and friction (Coulomb) brakes what slides along it.
/// To `exact` of the largest impulse, or for `sweeps`. Instruments that give way have the velocity
/// that goes with what they feel, by Newton's method.
void exchange_impulses(MassPoints& points, std::span<const MovingCore> cores,
                       std::span<PieceTouch> touches, double exact, int sweeps);

} // namespace gewebe
