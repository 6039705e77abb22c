#pragma once
// The smooth density of labelled voxels.
//
// A label volume states for each voxel's centre if it lies in an organ, and no more. The boundary
// of its voxels is a stair; blurring it would shrink what is curved, lose what is thin, and keep
// the wide terraces of slices that are nearly parallel to the surface. Here a function F is sought
// whose zero surface passes between the labelled and the other centres and bends as little as that
// allows (V. Lempitsky, Surface extraction from binary volumes with higher-order smoothness, 2010):
//
//   minimise  sum over axes a, voxels of w_a (F(v - e_a) - 2 F(v) + F(v + e_a))² + m (F - F')²
//   so that   max(D/10, D - g) <= F <= 2 D at labelled voxels, the same for -F at the others.
//
// D is the distance of the centre to the nearest voxel (box) of the other kind in mm, g half a
// voxel's diagonal, w_a = (smallest spacing / spacing of a)⁴, m = 1/128, so that terraces up to
// some twenty voxels wide are levelled. F is close to a signed distance. The bounds hold the
// distances that a surface may have which separates the centres; so no centre changes sides, thin
// vessels stay whole, and what may be a plane within the voxels' precision becomes nearly plane.
//
// Solved on a band of some voxels about the boundary, coarse to fine: every second centre along the
// axes of finer spacing until the spacings are alike, then once more along all. F' is D with its
// sign on the coarsest level; on the others the coarser F, where it respects the finer bounds. Each
// level takes projected gradient steps with Nesterov's momentum. At last F is shifted, by amounts
// that vary over some 16 voxels or eight slices, so that the volume about each place is that of the
// labels: what bends strongly (a ball of three voxels' radius) would be shrunk otherwise.
//
// Measured: balls of radius 5, 10 and 20 voxels are right to 0.04, 0.05 and 0.03 voxels rms
// and 1.7, 0.8 and 0.2 % of volume; of radius 20 mm in voxels of 1 x 1 x 3 mm to 0.09 mm and 0.1 %.
// A plane of slope 1:10 leaves a ninth of the stairs' rms, one of slope 1:5 in slices of 5 mm and
// voxels of 1 mm a thirteenth, one of 1:20 two thirds.
//
// The density is ½ + F/2S, clamped to [0, 1]: linear over two voxels of edge S, so that marching
// cubes finds the zero surface of F exactly where F is linear.

#include "labels/label_mask.h"

#include <cstdint>
#include <optional>

namespace gewebe::labels {

struct LabelDensityOptions {
  std::optional<double> voxel; ///< edge S in mm; the smallest spacing if absent
};

struct LabelDensityReport {
  std::uint64_t voxels = 0;         ///< labelled
  double volume = 0;                ///< of them, mm³
  std::uint64_t levels = 0;         ///< of the solution
  std::uint64_t band_voxels = 0;    ///< unknowns of the finest level
  std::uint64_t leaves_skipped = 0; ///< blocks of 8³ voxels of the label volume without boundary
  std::uint64_t steps = 0;          ///< of all levels
  double last_change = 0;           ///< mm, of the finest level's last step
  double shear = 0; ///< mm: how far right angles move the volume's corners from the file's affine
};

/// The lattice of label_density: along the mask's axes made perpendicular (the nearest rotation, by
/// polar decomposition, about the volume's centre), with cubic voxels of edge `voxel` and voxel
/// (0, 0, 0) on that of the mask. \param shear receives LabelDensityReport::shear
/// \throw Error if the axes are so oblique that a corner would move by more than a tenth of the
/// smallest spacing
volume::GridTransform label_lattice(const LabelMask& mask, double voxel, double* shear = nullptr);

/// What can be said against a density before a voxel is known: `mask` needs no bits yet. Memory is
/// that of the copy of the mask, of its blocks and of the lattice; what the boundary takes comes to
/// it. \throw Error as label_density
void check_label_density(const Context& context, const LabelMask& mask,
                         const LabelDensityOptions& options);

/// The density of the set voxels: background 0, isovalue 0.5, on label_lattice. Voxels outside the
/// mask count as unlabelled, so the surface closes half a voxel beyond the volume's edge. The
/// result has the same bytes for any number of threads and on every CPU level.
///
/// Memory: one byte of directory per 128 voxels and 10 kB for each 8³ block at the boundary, beside
/// the result. \pre mask.transform is finite and not singular
/// \throw Error if the lattice is too oblique, if S is more than 6 times the smallest spacing, if
/// an index would leave ±2^30, if context.max_memory would not do
volume::Grid label_density(const Context& context, const LabelMask& mask,
                           const LabelDensityOptions& options,
                           LabelDensityReport* report = nullptr);

} // namespace gewebe::labels
