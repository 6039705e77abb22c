#pragma once
// Images from and to any format we know.

#include "base/context.h"
#include "formats/stream/kind.h"
#include "formats/stream/stream.h"
#include "texture/image.h"

#include <string>
#include <vector>

namespace gewebe::formats {

/// Reads a PNG or PNM; the first bytes tell which.
/// \throw Error with place: neither of them, damaged, or beyond context.max_memory
texture::Image read_image(Input& input, const Context& context);

/// Its brightness with all bits that it has, up to 16. \throw as read_image
texture::Heights read_heights(Input& input, const Context& context);

/// png, ppm, rgb.
const std::vector<Kind>& picture_kinds();

/// The bytes of a png or ppm.
std::string image_bytes(const texture::Image& image, Kind kind);
/// Writes a picture of three channels as png, ppm (P6) or rgb (the bare values); the caller
/// commits. \throw what Output throws
void write_image(Output& output, const texture::Image& image, Kind kind);

} // namespace gewebe::formats
