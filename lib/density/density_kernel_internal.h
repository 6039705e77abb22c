#pragma once
// The kernels of the density, once per CPU level. The density has the same bits on every level; the
// bounds may differ in their last bits, which no result shows.

#include <cstddef>
#include <cstdint>

namespace gewebe::density {

/// A particle as a leaf sees it: index units, relative to the centre of the leaf's first voxel.
struct LeafParticle {
  float x, y, z;
  float inverse_radius;
  float weight;
};

/// Adds the particles' densities, in order, to values[512] (k runs fastest). With s = |x−c|/R a
/// term is u² (4w/9 u + 5w/9), u = max(1 − s², 0): the factored form of density.h, whose sign can't
/// be lost, and which adds exactly nothing outside the support. So the sum's bits don't depend on
/// how many particles out of reach stand in the list.
using DensityKernel = void (*)(const LeafParticle* particles, std::size_t count, float* values);

void add_density_baseline(const LeafParticle* particles, std::size_t count, float* values);
void add_density_avx2(const LeafParticle* particles, std::size_t count, float* values);
void add_density_avx512(const LeafParticle* particles, std::size_t count, float* values);

/// A particle in index space.
struct IndexParticle {
  double x, y, z;
  double radius;
  float inverse_radius; ///< at most 1e18, so that no product overflows to NaN
  float weight;
};

/// The eight children of a cube of the lattice: child c begins at origin + size · (c>>2, c>>1 & 1,
/// c & 1) and holds size³ voxel centres.
struct Children {
  double origin[3];
  float size;
};

/// Bounds of the summed density over each child and the voxels that share a face with it.
struct ChildBounds {
  float lower[8];
  float upper[8];
};

/// Bit c of masks[n] is set if particle list[n] may reach child c, enlarged on all sides by
/// `margin` voxels; never too few.
using ReachKernel = void (*)(const IndexParticle* particles, const std::uint32_t* list,
                             std::size_t count, const Children& children, float margin,
                             std::uint8_t* masks);

/// The same with bounds, enlarged as these are. Two are made and the tighter one taken: the sum
/// over the particles of each one's least and largest density (monotone in the distance), and value
/// and gradient at the child's centre with the second derivatives bounded by 44/9 |w|/R² (their
/// largest magnitude, at the particle's centre). They hold for the sums in single precision that
/// the density kernel makes: its rounding and that of the bounds themselves are added. NaN where a
/// sum overflows.
using BoundKernel = void (*)(const IndexParticle* particles, const std::uint32_t* list,
                             std::size_t count, const Children& children, std::uint8_t* masks,
                             ChildBounds& bounds);

void reach_children_baseline(const IndexParticle* particles, const std::uint32_t* list,
                             std::size_t count, const Children& children, float margin,
                             std::uint8_t* masks);
void reach_children_avx2(const IndexParticle* particles, const std::uint32_t* list,
                         std::size_t count, const Children& children, float margin,
                         std::uint8_t* masks);
void bound_children_baseline(const IndexParticle* particles, const std::uint32_t* list,
                             std::size_t count, const Children& children, std::uint8_t* masks,
                             ChildBounds& bounds);
void bound_children_avx2(const IndexParticle* particles, const std::uint32_t* list,
                         std::size_t count, const Children& children, std::uint8_t* masks,
                         ChildBounds& bounds);

// What the bounds allow for, shared by the levels.
inline constexpr float reach_limit = 1.0001F;         ///< squared relative distance still in reach
inline constexpr float box_slack = 1e-6F;             ///< × child size: rounding of coordinates
inline constexpr float curvature_bound = 4.9F;        ///< > 44/9
inline constexpr float term_rounding = 8e-6F;         ///< × Σ |w|
inline constexpr float accumulation_rounding = 2e-7F; ///< × count × Σ |w| largest density

} // namespace gewebe::density
