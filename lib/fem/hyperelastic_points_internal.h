#pragma once
// The points at which quadratic elements of fem/hyperelastic.h are integrated.

#include <array>
#include <vector>

namespace gewebe::fem {

struct IntegrationPoint {
  std::array<double, 4> at{}; ///< barycentric
  double weight = 0;          ///< of a volume of 1
};

/// 24 points, exact to degree 6: three classes of 4 with equal weights each, then one of 12.
const std::vector<IntegrationPoint>& quadratic_points();

} // namespace gewebe::fem
