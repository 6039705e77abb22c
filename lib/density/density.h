#pragma once
// Density of soft objects on a lattice: report FZKA 7190 eq. 3.1, after Wyvill, McPheeters, Wyvill
// (1986).
//
//   D(x) = Σ_i w_i (1−t)² (1 − 4t/9),  t = |x−c_i|² / R_i²  for t < 1, else 0
//
// which equals 1 − 22/9 t + 17/9 t² − 4/9 t³ but keeps its sign and its digits near t = 1.

#include "base/context.h"
#include "geometry/particles.h"
#include "volume/grid.h"

#include <cstdint>
#include <functional>
#include <optional>

namespace gewebe::density {

struct DensityReport {
  // Known before the work.
  std::uint64_t particles_out_of_reach = 0; ///< touch no voxel centre inside the clip box
  double predicted_voxels = 0;              ///< of the leaves to evaluate; a band keeps fewer
  double predicted_bytes = 0;               ///< of the grid's tree with these leaves
  double predicted_evaluations = 0;         ///< of all voxels in reach, on average over positions
  std::uint64_t leaves_skipped = 0;         ///< proven by the band's bounds to lie on one side
  // Known after it.
  std::uint64_t leaves_evaluated = 0;
  std::uint64_t leaves = 0;              ///< stored
  std::uint64_t leaf_particle_pairs = 0; ///< terms summed, for a whole leaf each
  std::uint64_t voxel_evaluations = 0;   ///< pairs × 512
};

struct DensityOptions {
  volume::GridInfo info;      ///< lattice and metadata of the result; the transform must be cubic
  std::optional<Box3> clip;   ///< voxel centres outside this world box stay background
  std::optional<double> band; ///< an isovalue: keep only what its isosurface needs
  std::function<void(const DensityReport&)> planned; ///< gets what is known before the work
};

/// Density in mm⁰ of `particles` on the lattice; sums in the order of the particles, so any thread
/// count gives the same bytes. Float arithmetic in leaf-local coordinates, the leaf's origin
/// subtracted in double: error below 1e-6 per unit weight in reach, wherever in the world they lie.
/// Only leaves in reach of a particle exist. Voxels are active where the density is not 0.
///
/// With a band (isovalue v) the result is the same grid as far as marching cubes at v can tell, and
/// says so (info().isovalue and band_isovalue are v). A leaf is stored exactly where an edge of the
/// lattice, whose ends lie on different sides of v (inside: value > v), has an end in it; it has
/// the bits of the plain evaluation. Everything else is the background on the background's side,
/// and on the other side tiles of one constant: 1 or, beyond v = 1, 2v; below a negative v −1 or
/// 2v. Interval bounds spare most evaluations, first on large cubes, last on parts of 4³ voxels;
/// where they don't pay they are left out. They are proven for single precision, so what is stored
/// doesn't depend on them.
///
/// \throw Error if the lattice is not cubic, an index leaves ±2^30, a band's isovalue exceeds 1e30,
/// or memory does not suffice
volume::Grid metaball_density(const Context& context, const Particles& particles,
                              const DensityOptions& options, DensityReport* report = nullptr);

} // namespace gewebe::density
