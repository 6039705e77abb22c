#include "formats/image/image_file.h"

#include "base/error.h"
#include "formats/image/png.h"
#include "formats/image/pnm.h"

#include <string>

namespace gewebe::formats {

namespace {

template <class Value, class Png, class Pnm>
texture::Pixels<Value> read(Input& input, const Context& context, const Png& png, const Pnm& pnm) {
  const bool is_png = kind_from_magic(input.peek(8)) == Kind::png;
  const std::string_view start = input.peek(2);
  if (!is_png && !(start.size() == 2 && start[0] == 'P' && start[1] >= '2' && start[1] <= '6' &&
                   start[1] != '4'))
    throw Error(input.name(), "byte 0: no image, expected PNG or PNM (P2, P3, P5, P6)");
  const std::string bytes = input.read_all(context.max_memory);
  texture::Pixels<Value> image = is_png ? png(bytes, input.name()) : pnm(bytes, input.name());
  gewebe::at(input.name(), [&] {
    const std::size_t size = bytes.size() + image.values.size() * sizeof(Value);
    require_memory(context, static_cast<double>(size), "the image");
  });
  return image;
}

} // namespace

texture::Image read_image(Input& input, const Context& context) {
  return read<std::uint8_t>(input, context, read_png, read_pnm);
}

texture::Heights read_heights(Input& input, const Context& context) {
  return texture::heights_from(read<std::uint16_t>(input, context, read_deep_png, read_deep_pnm));
}

const std::vector<Kind>& picture_kinds() {
  static const std::vector<Kind> kinds{Kind::png, Kind::ppm, Kind::rgb};
  return kinds;
}

std::string image_bytes(const texture::Image& image, Kind kind) {
  return kind == Kind::ppm ? write_ppm(image) : write_png(image);
}

void write_image(Output& output, const texture::Image& image, Kind kind) {
  if (kind == Kind::rgb)
    output.write(image.values.data(), image.values.size());
  else
    output.write(image_bytes(image, kind));
}

} // namespace gewebe::formats
