#pragma once
// Displacement fields as NIfTI-1, as ITK and ANTs read them; gewebe_results(5).

#include "tetrahedra/lattice_field.h"
#include "volume/grid.h"

#include <functional>
#include <string>
#include <string_view>

namespace gewebe::formats {

/// Places at the centres of voxels 0 … size - 1. \pre size is positive, the transform not singular
tetrahedra::PlaceLattice voxel_centres(const Int3& size, const volume::GridTransform& transform);

/// Writes a field in mm, its vectors in RAS, as an image of five dimensions, x y z 1 3, of
/// float32, intent VECTOR (1007), whose vectors are LPS; the affine (sform, and qform where axes
/// are at right angles) is `transform`, RAS and mm. Where no element holds a place stands `outside`
/// three times. \param what a description of up to 79 bytes \param gzip packed, without a time
/// \pre sizes up to nifti_longest
void write_nifti_field(const tetrahedra::LatticeField& field, const Int3& size,
                       const volume::GridTransform& transform, float outside,
                       const std::string& what, bool gzip,
                       const std::function<void(std::string_view)>& sink);

inline constexpr int nifti_longest = 32767; ///< voxels along an axis

} // namespace gewebe::formats
