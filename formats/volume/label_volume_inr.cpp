#include "formats/volume/label_volume_internal.h"
// Based on: the header of INRIMAGE-4 as INRIA's Inrimage manual and CGAL's Image_3 have it.

#include "base/error.h"

#include <array>
#include <map>

namespace gewebe::formats {
namespace {

constexpr std::string_view first_line = "#INRIMAGE-4#{";

/// "KEY=value" lines between #INRIMAGE-4#{ and ##}; the header fills blocks of 256 bytes with empty
/// lines.
class Fields : public HeaderFields {
public:
  explicit Fields(BufferedBytes& bytes) : HeaderFields(bytes.name(), "INR header") {
    (void)bytes.line(); // is_inr saw it
    for (std::size_t number = 2;; ++number) {
      const std::optional<std::string> line = bytes.line();
      if (!line)
        throw Error(name_, "the header ends without ##}, expected that last line");
      const std::string place = name_ + ":" + std::to_string(number);
      const std::string_view text = trimmed(*line);
      if (text == "##}")
        return;
      if (text.empty() || text.starts_with('#'))
        continue;
      const std::size_t equals = text.find('=');
      if (equals == std::string_view::npos)
        throw Error(place, quoted(text) + ", expected KEY=value");
      if (!fields_
               .try_emplace(std::string(trimmed(text.substr(0, equals))),
                            HeaderField{std::string(trimmed(text.substr(equals + 1))), place})
               .second)
        throw Error(place, "a second " + quoted(text.substr(0, equals)) + ", expected one");
    }
  }

  double number_or(const std::string& key, double otherwise) const {
    const HeaderField* const field = find(key);
    return field == nullptr ? otherwise : number_of(field->place, field->value);
  }
};

ScalarType scalar_type(const Fields& fields) {
  const HeaderField& type = fields.need("TYPE");
  const HeaderField& size = fields.need("PIXSIZE");
  static const std::map<std::pair<std::string_view, std::string_view>, ScalarType> types{
      {{"unsigned fixed", "8 bits"}, ScalarType::u8},
      {{"unsigned fixed", "16 bits"}, ScalarType::u16},
      {{"unsigned fixed", "32 bits"}, ScalarType::u32},
      {{"signed fixed", "8 bits"}, ScalarType::i8},
      {{"signed fixed", "16 bits"}, ScalarType::i16},
      {{"signed fixed", "32 bits"}, ScalarType::i32},
      {{"float", "32 bits"}, ScalarType::f32},
      {{"float", "64 bits"}, ScalarType::f64}};
  const auto found = types.find({type.value, size.value});
  if (found == types.end())
    throw Error(type.place, "TYPE " + quoted(type.value) + " with PIXSIZE " + quoted(size.value) +
                                ", expected unsigned fixed, signed fixed or float of 8 to 64 bits");
  return found->second;
}

bool big_endian(const Fields& fields) {
  const HeaderField& cpu = fields.need("CPU");
  if (cpu.value == "decm" || cpu.value == "alpha" || cpu.value == "pc")
    return false;
  if (cpu.value == "sun" || cpu.value == "sgi")
    return true;
  throw Error(cpu.place, "CPU " + quoted(cpu.value) + ", expected decm, alpha, pc, sun or sgi");
}

} // namespace

bool is_inr(std::string_view bytes) {
  return bytes.starts_with(first_line);
}

LabelVolume read_inr(BufferedBytes& bytes, const LabelRequest& request) {
  const std::string& name = bytes.name();
  const Fields fields(bytes);
  if (const HeaderField* const components = fields.find("VDIM");
      components != nullptr && whole_of(components->place, components->value) != 1)
    throw Error(components->place, components->value + " values a voxel, expected one");
  if (const HeaderField* const scale = fields.find("SCALE");
      scale != nullptr && scale->value != "2**0")
    throw Error(scale->place, "SCALE " + quoted(scale->value) + ", expected 2**0");
  for (const char* const key : {"RX", "RY", "RZ"})
    if (fields.number_or(key, 0) != 0)
      throw Error(fields.need(key).place, std::string("a rotation ") + key + ", expected none");

  VoxelLayout layout;
  const HeaderField& first = fields.need("XDIM");
  std::array<std::int64_t, 3> size{};
  for (std::size_t a = 0; a < 3; ++a) {
    const std::string axis(1, "XYZ"[a]);
    const HeaderField& dim = fields.need(axis + "DIM");
    size.at(a) = whole_of(dim.place, dim.value);
    layout.transform.m.at(4 * a + a) = fields.number_or("V" + axis, 1);
    layout.transform.m.at(4 * a + 3) = fields.number_or("T" + axis, 0);
  }
  layout.size = checked_size(first.place, size);
  check_affine(first.place, layout.transform);
  layout.type = scalar_type(fields);
  layout.big_endian = big_endian(fields);

  LabelVolume volume = read_voxels(bytes, name, layout, request);
  volume.format = "INR";
  volume.warnings.push_back(name + ": INR has no anatomical space: coordinates are taken as right, "
                                   "anterior, superior");
  return volume;
}

} // namespace gewebe::formats
