#pragma once
// ELA_EXPL, the text form of the deformable model; the grammar is in ela_expl(5).

#include "base/context.h"
#include "formats/stream/stream.h"
#include "geometry/space.h"
#include "model/model.h"

#include <string>
#include <string_view>

namespace gewebe::formats {

/// The model that `text` holds; all invariants of model.h hold for it.
/// \throw Error, place "NAME:LINE", for anything that the grammar or an invariant forbids. Takes no
/// more memory than a small multiple of the text's size, whatever counts it claims. `space` gets
/// the space that the text states.
model::Model parse_ela(std::string_view text, const std::string& name, const Context& context = {},
                       Space* space = nullptr);

/// Reads all of the input. \throw as parse_ela, what Input throws, and where text and model exceed
/// context.max_memory
model::Model read_ela(Input& input, const Context& context, Space* space = nullptr);

/// The text of a model. Numbers are the shortest that read back exactly, so parse_ela(ela_text(m))
/// == m. \pre the invariants of model.h hold
std::string ela_text(const model::Model& model);

/// Writes the same bytes, piece by piece. \throw what Output throws
void write_ela(Output& output, const model::Model& model, const Context& context,
               Space space = Space::unknown);

} // namespace gewebe::formats
