#include "formats/volume/label_volume_internal.h"
// Based on: MetaIO (itk.org/Wiki/MetaIO/Documentation); the frame as ITK 5 reads it.

#include "base/error.h"

#include <algorithm>
#include <array>
#include <map>

namespace gewebe::formats {
namespace {

/// "Key = value" lines up to ElementDataFile, the last one.
class Fields : public HeaderFields {
public:
  explicit Fields(BufferedBytes& bytes) : HeaderFields(bytes.name(), "MetaImage header") {
    for (std::size_t number = 1;; ++number) {
      const std::optional<std::string> line = bytes.line();
      if (!line)
        throw Error(name_, "the header ends without ElementDataFile, expected that last line");
      const std::string place = name_ + ":" + std::to_string(number);
      const std::size_t equals = line->find('=');
      if (equals == std::string::npos) {
        if (trimmed(*line).empty())
          continue;
        throw Error(place, quoted(*line) + ", expected 'Key = value'");
      }
      const std::string key(trimmed(std::string_view(*line).substr(0, equals)));
      const std::string value(trimmed(std::string_view(*line).substr(equals + 1)));
      // Of one meaning, as MetaIO says.
      static const std::map<std::string_view, std::string_view> aliases{
          {"Position", "Offset"},
          {"Origin", "Offset"},
          {"Orientation", "TransformMatrix"},
          {"Rotation", "TransformMatrix"},
          {"ElementByteOrderMSB", "BinaryDataByteOrderMSB"}};
      const auto alias = aliases.find(key);
      const std::string usual(alias == aliases.end() ? std::string_view(key) : alias->second);
      if (!fields_.try_emplace(usual, HeaderField{value, place}).second)
        throw Error(place, "a second " + quoted(key) + ", expected one");
      if (key == "ElementDataFile")
        return;
    }
  }

  /// `count` numbers.
  std::vector<double> numbers(const HeaderField& field, std::size_t count) const {
    std::vector<double> values;
    for (const std::string_view word : words_of(field.value))
      values.push_back(number_of(field.place, word));
    if (values.size() != count)
      throw Error(field.place,
                  std::to_string(values.size()) + " numbers, expected " + std::to_string(count));
    return values;
  }
  bool flag(const std::string& key) const {
    const HeaderField* const field = find(key);
    if (field == nullptr)
      return false;
    if (field->value == "True" || field->value == "true" || field->value == "1")
      return true;
    if (field->value == "False" || field->value == "false" || field->value == "0")
      return false;
    throw Error(field->place, key + " is " + quoted(field->value) + ", expected True or False");
  }
  /// \throw Error unless absent or of this value
  void expect(const std::string& key, std::string_view value) const {
    if (const HeaderField* const field = find(key); field != nullptr && field->value != value)
      throw Error(field->place,
                  key + " is " + quoted(field->value) + ", expected " + std::string(value));
  }
};

ScalarType scalar_type(const HeaderField& field) {
  static const std::map<std::string_view, ScalarType> types{
      {"MET_CHAR", ScalarType::i8},       {"MET_UCHAR", ScalarType::u8},
      {"MET_SHORT", ScalarType::i16},     {"MET_USHORT", ScalarType::u16},
      {"MET_INT", ScalarType::i32},       {"MET_UINT", ScalarType::u32},
      {"MET_LONG_LONG", ScalarType::i64}, {"MET_ULONG_LONG", ScalarType::u64},
      {"MET_FLOAT", ScalarType::f32},     {"MET_DOUBLE", ScalarType::f64}};
  const auto found = types.find(field.value);
  if (found == types.end())
    throw Error(field.place,
                "ElementType " + quoted(field.value) + ", expected MET_UCHAR or another scalar");
  return found->second;
}

double unit_of(const Fields& fields) {
  const HeaderField* const field = fields.find("DistanceUnits");
  if (field == nullptr || field->value == "mm" || field->value == "?" || field->value.empty())
    return 1;
  if (field->value == "cm")
    return 10;
  if (field->value == "um")
    return 0.001;
  throw Error(field->place, "unit " + quoted(field->value) + ", expected mm, cm or um");
}

/// World (LPS) = offset + sum over axes of index · spacing · direction; the direction of axis n is
/// the n-th triple of TransformMatrix.
volume::GridTransform affine(const Fields& fields) {
  const double unit = unit_of(fields);
  const std::vector<double> spacing = fields.numbers(fields.need("ElementSpacing"), 3);
  std::vector<double> matrix{1, 0, 0, 0, 1, 0, 0, 0, 1}, offset{0, 0, 0};
  if (const HeaderField* const field = fields.find("TransformMatrix"))
    matrix = fields.numbers(*field, 9);
  if (const HeaderField* const field = fields.find("Offset"))
    offset = fields.numbers(*field, 3);
  volume::GridTransform t;
  for (std::size_t row = 0; row < 3; ++row) {
    const double sign = row < 2 ? -unit : unit;
    for (std::size_t a = 0; a < 3; ++a)
      t.m[4 * row + a] = sign * matrix[3 * a + row] * spacing[a];
    t.m[4 * row + 3] = sign * offset[row];
  }
  check_affine(fields.need("ElementSpacing").place, t);
  return t;
}

LabelVolume read_data(BufferedBytes& bytes, const Fields& fields, const VoxelLayout& layout,
                      const LabelRequest& request) {
  if (const HeaderField* const field = fields.find("HeaderSize")) {
    const std::int64_t skip = whole_of(field->place, field->value);
    if (skip < 0 || skip > 1000000000)
      throw Error(field->place, "HeaderSize " + std::to_string(skip) + ", expected 0 to 1e9");
    bytes.skip(static_cast<std::uint64_t>(skip));
  }
  if (!fields.flag("CompressedData"))
    return read_voxels(bytes, bytes.name(), layout, request);
  InflatedBytes inflated(bytes, bytes.name());
  return read_voxels(inflated, bytes.name(), layout, request);
}

} // namespace

bool is_meta_image(std::string_view bytes) {
  // Its first line is one of these in all files that are known.
  const std::string_view line = bytes.substr(0, bytes.find('\n'));
  const std::size_t equals = line.find('=');
  if (equals == std::string_view::npos)
    return false;
  const std::string_view key = trimmed(line.substr(0, equals));
  return key == "ObjectType" || key == "NDims" || key == "Comment" || key == "ObjectSubType";
}

LabelVolume read_meta_image(BufferedBytes& bytes, const LabelRequest& request) {
  const std::string& name = bytes.name();
  const Fields fields(bytes);
  fields.expect("ObjectType", "Image");
  fields.expect("NDims", "3");
  fields.expect("ElementNumberOfChannels", "1");
  if (fields.find("BinaryData") != nullptr && !fields.flag("BinaryData"))
    throw Error(fields.need("BinaryData").place, "voxels as text, expected BinaryData = True");
  VoxelLayout layout;
  const HeaderField& sizes = fields.need("DimSize");
  const std::vector<std::string_view> words = words_of(sizes.value);
  if (words.size() != 3)
    throw Error(sizes.place, std::to_string(words.size()) + " sizes, expected 3");
  layout.size =
      checked_size(sizes.place, {whole_of(sizes.place, words[0]), whole_of(sizes.place, words[1]),
                                 whole_of(sizes.place, words[2])});
  layout.type = scalar_type(fields.need("ElementType"));
  layout.big_endian = fields.flag("BinaryDataByteOrderMSB");
  layout.transform = affine(fields);

  LabelVolume volume;
  const HeaderField& file = fields.need("ElementDataFile");
  if (file.value == "LOCAL" || file.value == "Local" || file.value == "local") {
    volume = read_data(bytes, fields, layout, request);
  } else {
    volume = read_side_file(name, file, request, [&](BufferedBytes& data) {
      return read_data(data, fields, layout, request);
    });
  }
  volume.format = "MetaImage";
  return volume;
}

} // namespace gewebe::formats
