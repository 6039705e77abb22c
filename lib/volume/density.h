#pragma once
// Density of soft objects on a lattice: report FZKA 7190 eq. 3.1, after Wyvill, McPheeters, Wyvill
// (1986).
//
//   D(x) = Σ_i w_i (1−t)² (1 − 4t/9),  t = |x−c_i|² / R_i²  for t < 1, else 0
//
// which equals 1 − 22/9 t + 17/9 t² − 4/9 t³ but keeps its sign and its digits near t = 1.

#include "base/context.h"
#include "base/particles.h"
#include "volume/grid.h"

#include <cstdint>
#include <optional>

namespace gewebe {

struct DensityOptions {
  GridInfo info;            ///< lattice and metadata of the result; the transform must be cubic
  std::optional<Box3> clip; ///< voxel centres outside this world box stay background
};

struct DensityReport {
  std::uint64_t leaves = 0;                 ///< leaves in reach of a particle
  std::uint64_t leaf_particle_pairs = 0;    ///< kernel calls
  std::uint64_t voxel_evaluations = 0;      ///< pairs × 512
  std::uint64_t particles_out_of_reach = 0; ///< touch no voxel centre inside the clip box
  double predicted_bytes = 0;               ///< of the grid, before the work
};

/// Density in mm⁰ of `particles` on the lattice; sums in the order of the particles, so any thread
/// count gives the same bytes. Float arithmetic in leaf-local coordinates, the leaf's origin
/// subtracted in double: error below 2e-6 per unit weight, wherever in the world the particles lie.
/// Only leaves in reach of a particle exist. Voxels are active where the density is not 0. \throw
/// Error if the lattice is not cubic, an index leaves ±2^30, or memory does not suffice
Grid metaball_density(const Context& context, const Particles& particles,
                      const DensityOptions& options, DensityReport* report = nullptr);

} // namespace gewebe
