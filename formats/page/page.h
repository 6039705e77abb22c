#pragma once
// A scene as one HTML file with its viewer (viewer.html, viewer.js), which loads nothing else.

#include "formats/page/shown_scene.h"
#include "formats/stream/stream.h"

namespace gewebe::formats {

/// Writes the page; the caller commits. Places have 16 bits across each part's longest side, values
/// of a stored field 65535 steps from its least to its greatest value. \return its size in bytes
/// \throw what Output throws
std::uint64_t write_page(Output& output, const ShownScene& scene);

} // namespace gewebe::formats
