#pragma once
// Where materials meet inside a stuffed volume: lattice points beside the interface, where it cuts
// their edges, and which of them are moved onto it. For the room alone.

#include "base/context.h"
#include "stuffing/bcc_internal.h"
#include "stuffing/lattice_internal.h"
#include "stuffing/stuffing.h"
#include "stuffing/warp_internal.h"

#include <array>
#include <cstdint>
#include <vector>

namespace gewebe::stuffing {

/// By block, word and bit: the material of points inside. Nothing for blocks without any.
using BlockMaterials = std::vector<std::vector<std::int32_t>>;
inline std::int32_t material_at(const BlockMaterials& materials, const PlaceInBlock& place) {
  return materials[place.block][64 * std::size_t{place.word} + place.bit];
}

BlockMaterials materials_of(const Context& context, const StuffingLattice& lattice,
                            const StuffingBlocks& blocks, const MaterialSource& source);

/// Sets `interface` of the blocks: points inside with a neighbour inside of another material.
/// \return how many there are \throw Error from 2^32 - 1
std::uint32_t find_interface(const Context& context, const BlockMaterials& materials,
                             StuffingBlocks& blocks);

struct InterfacePoint {
  static constexpr std::uint8_t stays = BoundaryLatticePoint::stays;
  static constexpr std::uint32_t none = UINT32_MAX;

  std::uint32_t block = 0;
  std::uint16_t word = 0, bit = 0;
  std::int32_t material = 0;
  bool free = false;         ///< no edge leads outside: it may be moved, and its edges may be cut
  bool on = false;           ///< on the interface: moved there, or the interface comes to it
  bool refused = false;      ///< a warp of it was undone
  std::uint8_t warp = stays; ///< the direction that it is moved along
  std::array<std::uint32_t, bcc::directions> neighbours{}; ///< interface points, or none
  /// By direction, where the neighbour is of another material: how far along the edge that begins.
  std::array<double, bcc::directions> cuts{};

  bool warped() const { return warp != stays; }
};

/// The interface of a stuffed volume, for stencils on both sides of it.
///
/// An edge between two materials is cut where both ends are free and no third material lies round
/// it. Elsewhere, at the boundary of the solid and where three materials meet, the interface runs
/// along faces of the lattice: of the ends of such an edge the one nearer to the interface counts
/// as on it, in its place. So no tetrahedron that the boundary cuts has two materials, and none has
/// three. A free end nearer to a cut than alpha is moved there. A tetrahedron with four moved
/// corners could be of any shape: warps are undone until there is none, and cuts then keep
/// alpha away from both ends.
struct MaterialInterface {
  std::vector<InterfacePoint> points; ///< by block, word, bit

  bool differs(const InterfacePoint& point, unsigned direction) const {
    const std::uint32_t n = point.neighbours[direction];
    return n != InterfacePoint::none && points[n].material != point.material;
  }
  bool is_cut(const InterfacePoint& point, unsigned direction) const {
    return !point.on && differs(point, direction) && !points[point.neighbours[direction]].on;
  }
};

/// \pre find_interface was called
MaterialInterface follow_interface(const Context& context, const StuffingLattice& lattice,
                                   const StuffingBlocks& blocks, const SurfacePoints& surface,
                                   const BlockMaterials& materials, const MaterialSource& source);

} // namespace gewebe::stuffing
