#pragma once
// Portable anymaps: read as text or binary, gray or colour (P2, P3, P5, P6); written as P6.

#include "texture/image.h"

#include <string>
#include <string_view>

namespace gewebe::formats {

/// The image, values scaled from 0 … maxval to 0 … 255.
/// \throw Error, place "NAME:LINE" in text and "NAME" ("byte N: …") in binary: no such file, sides
/// of 0 or above 32768, a value above maxval, fewer or more values than the header says. Takes no
/// more memory than the bytes justify.
texture::Image read_pnm(std::string_view bytes, const std::string& name);
/// The same, values scaled to 0 … 65535.
texture::DeepImage read_deep_pnm(std::string_view bytes, const std::string& name);

/// P6 with maxval 255. \pre three channels
std::string write_ppm(const texture::Image& image);

} // namespace gewebe::formats
