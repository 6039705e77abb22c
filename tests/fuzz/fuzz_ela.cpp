// Any bytes as ELA_EXPL: an Error, or a model that is written and read back exactly.

#include "base/error.h"
#include "formats/model/ela.h"
#include "model/figures.h"

#include <cstddef>
#include <cstdint>
#include <cstdlib>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    const gewebe::model::Model model = gewebe::formats::parse_ela(text, "fuzz");
    try {
      if (gewebe::formats::parse_ela(gewebe::formats::ela_text(model), "again") != model)
        std::abort();
      gewebe::model::check_model(model);
    } catch (const gewebe::Error&) { // what is read must be valid, and valid when written
      std::abort();
    }
    gewebe::Context context;
    context.threads = 1;
    (void)gewebe::model::model_counts(model, context);
    (void)gewebe::model::surface_mesh(model);
    (void)gewebe::model::shown_mesh(model);
  } catch (const gewebe::Error&) { // what bad input is for
  }
  return 0;
}
