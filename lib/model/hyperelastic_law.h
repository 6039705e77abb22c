#pragma once
// Hyperelastic law of a material: its kind, and parameters relative to the shear modulus of small
// strains, so that E and nu stay those of the material.
//
// mu = E / (2 (1 + nu)) and K = E / (3 (1 - 2 nu)). fem/hyperelastic.h has the energies.

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace gewebe::model {

struct HyperelasticLaw {
  enum Kind : std::uint8_t { stable_neo_hookean, neo_hookean, mooney_rivlin, yeoh, ogden };

  Kind kind = stable_neo_hookean;
  /// By kind; what isn't named is 0.
  /// - mooney_rivlin: C01 / mu; C10 = mu/2 - C01
  /// - yeoh: C20 / mu, C30 / mu; C10 = mu/2
  /// - ogden: alpha1, alpha2, mu2 / mu; mu1 = mu - mu2. One term: alpha2 = mu2 = 0
  std::array<double, 3> parameter{};

  bool operator==(const HyperelasticLaw&) const = default;
};

/// "neo-hookean" of the stable form, "classical-neo-hookean", "mooney-rivlin", "yeoh", "ogden".
std::string_view law_name(HyperelasticLaw::Kind kind);

/// Law of a word such as "neo-hookean", "mooney-rivlin:c01=0.1", "yeoh:c20=0.2,c30=0.05",
/// "ogden:alpha1=4,alpha2=-3,mu2=0.3". Parameters without a value are 0; alpha1 is required.
/// \throw Error naming the word that is wrong and what was expected; as check_law
HyperelasticLaw parse_law(std::string_view text);

/// The word that parse_law() reads as this law, with the shortest numbers; parameters of 0 are left
/// out. \pre check_law(law) passes
std::string law_text(const HyperelasticLaw& law);

/// \throw Error naming the parameter that is out of its range: c01 from -10 to 10, c20 and c30 from
/// -1000 to 1000, alphas from 0.1 to 50 or from -50 to -0.1, mu2 from -10 to 10
void check_law(const HyperelasticLaw& law);

} // namespace gewebe::model
