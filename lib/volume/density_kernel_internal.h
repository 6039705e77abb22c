#pragma once
// The density kernel for one leaf, once per CPU level; every level gives the same bits.

#include <cstddef>

namespace gewebe {

/// A particle as a leaf sees it: index units, relative to the centre of the leaf's first voxel.
struct LeafParticle {
  float x, y, z;
  float inverse_r2; ///< 1 / R², index units
  float weight;
};

/// Adds the particles' densities, in order, to values[512] (k runs fastest).
using DensityKernel = void (*)(const LeafParticle* particles, std::size_t count, float* values);

void add_density_baseline(const LeafParticle* particles, std::size_t count, float* values);
void add_density_avx2(const LeafParticle* particles, std::size_t count, float* values);

} // namespace gewebe
