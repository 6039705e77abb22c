#include "dynamics/solid_law.h"

#include "base/error.h"
#include "model/hyperelastic_law.h"
#include "model/prony.h"

#include <algorithm>

namespace gewebe::dynamics {

std::optional<integrator::SolidLaw> law_of(const model::Model& model,
                                           const std::optional<integrator::SolidLaw>& chosen) {
  std::optional<integrator::SolidLaw> law = chosen;
  for (const model::Material& m : model.materials) {
    if (!m.prony.empty() && !model.tetrahedra.empty()) {
      if (law == integrator::SolidLaw::corotational)
        throw Error("material '" + m.name + "' is viscoelastic (" + model::prony_text(m.prony) +
                    "), expected no law= or law=neo-hookean");
      law = integrator::SolidLaw::hyperelastic;
    }
    if (!m.law || law == integrator::SolidLaw::corotational)
      continue;
    if (m.law->kind == model::HyperelasticLaw::neo_hookean ||
        (chosen && m.law->kind != model::HyperelasticLaw::stable_neo_hookean))
      throw Error("material '" + m.name + "' has the law " + model::law_text(*m.law) +
                  ", expected " +
                  (chosen ? "no law= or law=corotational" : "another one, such as neo-hookean"));
    law = integrator::SolidLaw::hyperelastic;
  }
  return law;
}

bool is_viscoelastic(const model::Model& model) {
  return !model.tetrahedra.empty() &&
         std::ranges::any_of(model.materials,
                             [](const model::Material& m) { return !m.prony.empty(); });
}

} // namespace gewebe::dynamics
