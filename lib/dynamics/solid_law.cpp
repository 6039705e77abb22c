#include "dynamics/solid_law.h"

#include "base/error.h"
#include "model/hyperelastic_law.h"
#include "model/prony.h"

#include <algorithm>

namespace gewebe {

std::optional<SolidLaw> law_of(const Model& model, const std::optional<SolidLaw>& chosen) {
  std::optional<SolidLaw> law = chosen;
  for (const Material& m : model.materials) {
    if (!m.prony.empty() && !model.tetrahedra.empty()) {
      if (law == SolidLaw::corotational)
        throw Error("material '" + m.name + "' is viscoelastic (" + prony_text(m.prony) +
                    "), expected no law= or law=neo-hookean");
      law = SolidLaw::hyperelastic;
    }
    if (!m.law || law == SolidLaw::corotational)
      continue;
    if (m.law->kind == HyperelasticLaw::neo_hookean ||
        (chosen && m.law->kind != HyperelasticLaw::stable_neo_hookean))
      throw Error("material '" + m.name + "' has the law " + law_text(*m.law) + ", expected " +
                  (chosen ? "no law= or law=corotational" : "another one, such as neo-hookean"));
    law = SolidLaw::hyperelastic;
  }
  return law;
}

bool is_viscoelastic(const Model& model) {
  return !model.tetrahedra.empty() &&
         std::ranges::any_of(model.materials, [](const Material& m) { return !m.prony.empty(); });
}

} // namespace gewebe
