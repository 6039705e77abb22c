#pragma once
// Laws of large strains at one deformation gradient, for fem/hyperelastic.cpp.

#include "fem/element.h"
#include "model/hyperelastic_law.h"

#include <Eigen/Core>

#include <cstddef>

namespace gewebe::fem {

/// A second derivative by F: rows and columns 3 i + j of F_ij.
using SecondDerivative = Eigen::Matrix<double, 9, 9>;

struct LawResponse {
  double energy = 0;
  SolidBlock stress{};     ///< dW/dF, row-major
  SecondDerivative second; ///< d²W/dF², if requested
};

/// W of fem/hyperelastic.h without its projected part, of a Mooney-Rivlin, Yeoh or Ogden material.
/// \param cofactor  dJ/dF
void modified_law(const model::HyperelasticLaw& law, double mu, const SolidBlock& f,
                  const SolidBlock& cofactor, double j, bool wants_second, LawResponse& response);

/// Of Neo-Hookean laws dW/dF = a F + d cof F and d²W/dF² = a 1 + b F ⊗ F + c cof F ⊗ cof F + d
/// d²J/dF².
struct NeoHookeanLaw {
  double energy = 0, a = 0, b = 0, c = 0, d = 0;
};

/// Both forms of it.
bool is_neo_hookean(const model::HyperelasticLaw& law);
/// \pre is_neo_hookean(law)
NeoHookeanLaw neo_hookean_law(const model::HyperelasticLaw& law, double mu, double i_c, double j);

/// W without its projected part, of any law.
void law_at(const model::HyperelasticLaw& law, double mu, const SolidBlock& f,
            const SolidBlock& cofactor, double j, bool wants_second, LawResponse& response);

/// The same of a viscoelastic element, at its point n. \param response  of the law alone, becomes
/// that with the memory
void remember(const ElementMemory& memory, std::size_t n, double mu, const SolidBlock& f,
              const SolidBlock& cofactor, double j, bool wants_second, LawResponse& response);

/// m += scale d²J/dF².
void add_cofactor_slope(const SolidBlock& f, double scale, SecondDerivative& m);

} // namespace gewebe::fem
