#include "tools/model/solid_cell.h"

#include <cmath>

namespace gewebe::cli {
namespace {

constexpr double usual_tetrahedra = 10000, most_tetrahedra = 80000; // without a grade
constexpr double cells_across = 2;

double cell_of(double volume, double tetrahedra) {
  return std::cbrt(tetrahedra_per_cell * volume / tetrahedra);
}

} // namespace

SolidCell default_cell(double volume, double area) {
  SolidCell result{cell_of(volume, usual_tetrahedra), 2 * volume / area, false};
  const double across = result.thickness / cells_across;
  if (across < result.cell) {
    const double least = cell_of(volume, most_tetrahedra);
    result.capped = across < least;
    result.cell = result.capped ? least : across;
  }
  return result;
}

} // namespace gewebe::cli
