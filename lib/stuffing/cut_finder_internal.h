#pragma once
// Where a segment passes the isosurface. For the room alone.

#include "base/error.h"
#include "stuffing/lattice_internal.h"
#include "volume/field.h"

#include <cmath>

namespace gewebe::stuffing {

/// Roots of value - isovalue along segments of the grid's index space; for one thread.
class CutFinder {
public:
  CutFinder(const volume::Grid& grid, const StuffingLattice& lattice)
      : field_(grid), isovalue_(lattice.isovalue), sign_(lattice.below ? -1 : 1) {}

  /// Above 0 inside.
  double excess(const Vec3& index) { return sign_ * (field_.value(index) - isovalue_); }

  /// The share of the way from a place inside to one outside, to 1e-9. Regula falsi in the Illinois
  /// form (Dowell and Jarratt 1971), every third step a bisection, so that a field with a jump ends
  /// as well. \pre excess_inside == excess(inside) > 0, excess(outside) <= 0 \throw Error if a
  /// value is not finite
  double find(const Vec3& inside, const Vec3& outside, double excess_inside) {
    constexpr double tolerance = 1e-9;
    double low = 0, high = 1, at_low = excess_inside, at_high = excess(outside);
    if (!std::isfinite(at_low) || !std::isfinite(at_high))
      throw Error("the volume has a value beside the surface that is not finite");
    int side = 0;
    for (int round = 1; high - low > tolerance && round < 100; ++round) {
      const double share =
          round % 3 == 0 ? (low + high) / 2 : low + (high - low) * (at_low / (at_low - at_high));
      if (!(share > low) || !(share < high))
        break;
      const double here = excess(inside + (outside - inside) * share);
      if (here == 0)
        return share;
      const double moved = here > 0 ? share - low : high - share;
      (here > 0 ? low : high) = share;
      (here > 0 ? at_low : at_high) = here;
      if (moved < tolerance)
        return share;
      // An end that stays for a second time counts half.
      if (side == (here > 0 ? 1 : -1))
        (here > 0 ? at_high : at_low) /= 2;
      side = here > 0 ? 1 : -1;
    }
    return low + (high - low) * (at_low / (at_low - at_high));
  }

private:
  volume::Field field_;
  double isovalue_, sign_;
};

} // namespace gewebe::stuffing
