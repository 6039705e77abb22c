#pragma once
// Where a solid tears: what its elements bear against what their materials do.
//
// The criterion is Rankine's: the largest principal stress, or strain, in the middle of an element
// against a limit of its material. At the root of a notch, and at the front of a tear, stresses of
// an elastic solid grow as elements shrink, and with them falls the load under which it tears; of a
// length, the limit is compared with means within it (the theory of critical distances: Taylor
// 2007; nonlocal averages: Bazant and Jirasek 2002), which depend on the mesh no more once elements
// are clearly smaller than that length.

#include "cutting/cut_select.h"
#include "fem/stress.h"
#include "model/model.h"

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace gewebe::cutting {

/// What a solid bears before it tears.
struct TearLimit {
  bool stress = false;      ///< of the largest principal stress, Pa; else of the strain
  std::vector<double> most; ///< one per material of the model, or one for all; 0: it does not tear
  double over = 0; ///< mm; means over elements of the same material whose middles are that near

  bool operator==(const TearLimit&) const = default;

  bool any() const;
  /// Of an element of this material; 0: none. \pre most has one limit, or one per material
  double of(std::int32_t material) const;
};

struct SolidTear {
  std::uint32_t tetrahedron = 0; ///< the one that bears most for its limit; of several the first
  double share = 0;              ///< of its limit, > 1
  CutPlane plane;                ///< at rest
  /// Corners of elements, ascending: between these the solid is to be parted along faces near the
  /// plane.
  std::vector<std::uint32_t> nodes;
};

/// Most elements that a tear takes on besides those at the corners of the one that bears most.
inline constexpr std::size_t tear_most_elements = 128;

/// The element that bears more than its limit, by the largest share. The plane is perpendicular to
/// the direction of its largest principal stress or strain in the body at rest. It passes the
/// middle of the element's corners on the surface, so that a tear goes on from its front. If no
/// corner is on the surface, or the plane would miss the element, it passes the middle of all
/// corners. The nodes are those of elements on the plane, at the corners of that one, or that hang
/// together with it and bear more than their limits, the nearest tear_most_elements.
/// \param attempt 1 and up where nothing came apart there: so many rings of neighbours more, and a
/// plane through the element's middle, then beside it on either side
/// \param u displacements of the 3 n axes, mm: in space, with frames of elements; else small ones,
/// or local ones of large rotations \pre check_model(model) passes, it has tetrahedra; limit.any();
/// its sizes are those of the model \throw Error naming the first element whose stress or strain is
/// not finite
std::optional<SolidTear> find_tear(const model::Model& model, std::span<const double> u,
                                   fem::StrainFrames frames, const TearLimit& limit,
                                   int attempt = 0);

} // namespace gewebe::cutting
