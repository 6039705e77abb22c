#pragma once
// Laws in modified invariants at one deformation gradient, for fem/hyperelastic.cpp.

#include "fem/element.h"
#include "model/hyperelastic_law.h"

#include <Eigen/Core>

namespace gewebe {

/// A second derivative by F: rows and columns 3 i + j of F_ij.
using SecondDerivative = Eigen::Matrix<double, 9, 9>;

struct LawResponse {
  double energy = 0;
  SolidBlock stress{};     ///< dW/dF, row-major
  SecondDerivative second; ///< d²W/dF², if requested
};

/// W of fem/hyperelastic.h without its projected part, of a Mooney-Rivlin, Yeoh or Ogden material.
/// \param cofactor  dJ/dF
void modified_law(const HyperelasticLaw& law, double mu, const SolidBlock& f,
                  const SolidBlock& cofactor, double j, bool wants_second, LawResponse& response);

/// m += scale d²J/dF².
void add_cofactor_slope(const SolidBlock& f, double scale, SecondDerivative& m);

} // namespace gewebe
