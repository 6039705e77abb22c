#pragma once
// Volumes as dense images of float32: NIfTI-1 (.nii, .nii.gz), NRRD and MetaImage (.mha).

#include "base/context.h"
#include "formats/stream/kind.h"
#include "formats/stream/stream.h"
#include "geometry/space.h"
#include "volume/grid.h"

namespace gewebe::formats {

/// nii, nrrd, mha.
const std::vector<Kind>& dense_image_kinds();

struct DenseImageOptions {
  Kind kind = Kind::nifti;
  bool compressed = false;  ///< NIfTI and NRRD by gzip, MetaImage by zlib
  Space space = Space::ras; ///< of the grid, ras or lps; NIfTI holds RAS, MetaImage LPS
};

/// Writes the voxels of the box of active voxels and one more on each side, x fastest; the caller
/// commits. \return the sizes of the image
/// \throw Error if no voxel is active, or the image would have more than 2^33 voxels or, in NIfTI,
/// more than 32767 along an axis; what Output throws
Int3 write_dense_image(Output& output, const volume::Grid& grid, const DenseImageOptions& options);

} // namespace gewebe::formats
