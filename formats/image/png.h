#pragma once
// PNG, by libpng.

#include "texture/image.h"

#include <string>
#include <string_view>

namespace gewebe::formats {

/// The image: 8 or 16 bits (rounded to 8), gray of any depth, colour, palette; interlaced too.
/// Alpha is dropped, gamma and colour profiles are not applied: what stands in the file counts.
/// \throw Error, place `name`, for anything that libpng refuses, sides above 32768, and headers
/// that claim more pixels than the bytes can hold
texture::Image read_png(std::string_view bytes, const std::string& name);
/// The same in 16 bits; 8 bits v become 257 v.
texture::DeepImage read_deep_png(std::string_view bytes, const std::string& name);

/// 8 bits a channel, no time stamp, fixed compression: equal images give equal bytes with one zlib.
/// \throw Error where memory ends
std::string write_png(const texture::Image& image);

} // namespace gewebe::formats
