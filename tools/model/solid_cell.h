#pragma once
// The cells that fill a surface where --cell doesn't say it.

namespace gewebe::cli {

inline constexpr double tetrahedra_per_cell = 12; // of a body-centred lattice

struct SolidCell {
  double cell = 0;      ///< mm
  double thickness = 0; ///< mean, 2 V / A: of a plate its thickness, of a rod its radius
  bool capped = false;  ///< more cells across the thickness would be too many
};

/// Cells for a solid of this volume (mm³) and surface (mm²). About ten thousand tetrahedra fill it,
/// or smaller ones, so that two cells lie across the mean thickness; at most eighty thousand.
/// Thickness counts only with an area above 0.
///
/// The mean thickness needs the volume and the area (mm²) alone, and is that of a sheet whatever
/// its shape: a thin wall round a cavity has it too. The largest ball inside would not see a thin
/// wall beside a thick part, and the least thickness of all would let a sharp rim decide. A ball
/// keeps its ten thousand: across its mean thickness, 2/3 of the radius, they are 3.9.
SolidCell default_cell(double volume, double area);

} // namespace gewebe::cli
