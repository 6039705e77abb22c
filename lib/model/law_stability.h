#pragma once
// Stability of hyperelastic laws under large strains.

#include "model/hyperelastic_law.h"

#include <string>
#include <string_view>
#include <vector>

namespace gewebe::model {

/// Where a law stops being stable on one path.
struct LawInstability {
  std::string_view path; ///< "uniaxial tension", "planar compression", ...
  double stretch = 0;    ///< along the pull, nearest to 1
};

/// Paths from rest on which an incompressible material of this law becomes unstable between the
/// stretches 0.3 and 3: uniaxial, equibiaxial and planar, in tension and in compression.
///
/// Stable is, by Drucker's postulate (Drucker, J. Appl. Mech. 26, 1959) in the form of Hill
/// for logarithmic strains (J. Mech. Phys. Solids 16, 1968): the second derivative of the energy by
/// the two free principal logarithmic strains is positive definite. Neo-Hookean laws always are.
/// \pre check_law(law) passes
std::vector<LawInstability> law_instabilities(const HyperelasticLaw& law);

/// "uniaxial tension beyond a strain of 35.2 %, ..."; empty where the law is stable.
std::string instability_text(const HyperelasticLaw& law);

} // namespace gewebe::model
