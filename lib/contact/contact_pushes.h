#pragma once
// Contact without friction: pushes λ along normals whose gaps depend linearly on them,
//
//   g = gap + A λ,   0 <= λ,  0 <= g,  λ g = 0,
//
// A symmetric and positive semidefinite: a convex quadratic programme. Solved by block principal
// pivoting, and where that fails, as where many contacts share what few of them could do, by an
// interior-point method (contact_interior_internal.h).

#include <span>
#include <vector>

namespace gewebe {

struct PushForces {
  std::vector<double> push; ///< λ
  double residual = 0;      ///< largest |λ - max(0, λ - g/A_ii)|, over the largest λ
  bool solved = false;      ///< residual is at most contact_solver_tolerance
};

inline constexpr double contact_solver_tolerance = 1e-10;

/// \param compliance A, n² numbers \param start a guess, or empty   \pre sizes agree
PushForces solve_pushes(std::span<const double> compliance, std::span<const double> gap,
                        std::span<const double> start = {});

} // namespace gewebe
