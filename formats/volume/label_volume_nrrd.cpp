#include "formats/volume/label_volume_internal.h"
// Based on: G. Kindlmann, Definition of NRRD file format (teem.sourceforge.net/nrrd/format.html).

#include "base/error.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <map>

namespace gewebe::formats {
namespace {

/// The fields of a header by name.
class Fields : public HeaderFields {
public:
  explicit Fields(BufferedBytes& bytes) : HeaderFields(bytes.name(), "NRRD header") {
    std::size_t number = 1;
    std::optional<std::string> line = bytes.line();
    if (!line || line->size() != 8 || !line->starts_with("NRRD000") || (*line)[7] < '1' ||
        (*line)[7] > '5')
      throw Error(name_ + ":1", quoted(line.value_or("")) + ", expected NRRD0001 to NRRD0005");
    for (;;) {
      line = bytes.line();
      ++number;
      if (!line) // a header without data in its own file may end so
        return;
      if (line->empty())
        return;
      add(*line, name_ + ":" + std::to_string(number));
    }
  }

  /// Names of segments that have a value, as 3D Slicer writes them.
  std::vector<std::pair<std::int64_t, std::string>> names() const {
    std::vector<std::pair<std::int64_t, std::string>> all;
    for (const auto& [number, segment] : segments_)
      if (segment.label && !segment.name.empty())
        all.emplace_back(*segment.label, segment.name);
    return all;
  }

private:
  struct Segment {
    std::string name;
    std::optional<std::int64_t> label;
  };

  /// "Segment3_Name" and "Segment3_LabelValue"; other keys are passed over.
  void add_segment(std::string_view key, std::string_view value, const std::string& place) {
    constexpr std::string_view start = "Segment";
    const std::size_t mid = key.find('_');
    std::uint32_t number = 0;
    if (!key.starts_with(start) || mid == std::string_view::npos)
      return;
    const char* const end = key.data() + mid;
    const auto read = std::from_chars(key.data() + start.size(), end, number);
    if (read.ec != std::errc{} || read.ptr != end)
      return;
    if (key.substr(mid) == "_Name")
      segments_[number].name = value;
    else if (key.substr(mid) == "_LabelValue")
      segments_[number].label = whole_of(place, trimmed(value));
  }

  void add(const std::string& line, const std::string& place) {
    if (line.starts_with('#'))
      return;
    const std::size_t colon = line.find(':');
    if (colon == std::string::npos)
      throw Error(place, quoted(line) + ", expected 'field: value'");
    if (colon + 1 < line.size() && line[colon + 1] == '=') // key:=value of the user's own
      return add_segment(std::string_view(line).substr(0, colon),
                         std::string_view(line).substr(colon + 2), place);
    std::string key = line.substr(0, colon);
    std::transform(key.begin(), key.end(), key.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    // The format allows both spellings of these.
    for (const auto& [other, usual] :
         {std::pair("datafile", "data file"), std::pair("lineskip", "line skip"),
          std::pair("byteskip", "byte skip"), std::pair("axismins", "axis mins"),
          std::pair("axismaxs", "axis maxs"), std::pair("sampleunits", "sample units"),
          std::pair("oldmin", "old min"), std::pair("oldmax", "old max"),
          std::pair("blocksize", "block size"), std::pair("centerings", "centers")})
      if (key == other)
        key = usual;
    static constexpr std::array known{"dimension",
                                      "type",
                                      "block size",
                                      "encoding",
                                      "endian",
                                      "content",
                                      "old min",
                                      "old max",
                                      "data file",
                                      "line skip",
                                      "byte skip",
                                      "number",
                                      "sample units",
                                      "sizes",
                                      "spacings",
                                      "thicknesses",
                                      "axis mins",
                                      "axis maxs",
                                      "centers",
                                      "labels",
                                      "units",
                                      "min",
                                      "max",
                                      "kinds",
                                      "space",
                                      "space dimension",
                                      "space units",
                                      "space origin",
                                      "space directions",
                                      "measurement frame"};
    if (std::find(known.begin(), known.end(), key) == known.end())
      throw Error(place, "no field " + quoted(key) + " is known, expected one of the NRRD format");
    if (!fields_.try_emplace(key, HeaderField{std::string(trimmed(line.substr(colon + 1))), place})
             .second)
      throw Error(place, "a second field '" + key + "', expected one");
  }

  std::map<std::uint32_t, Segment> segments_;
};

ScalarType scalar_type(const HeaderField& field) {
  static const std::map<std::string_view, ScalarType> types{
      {"signed char", ScalarType::i8},
      {"int8", ScalarType::i8},
      {"int8_t", ScalarType::i8},
      {"uchar", ScalarType::u8},
      {"unsigned char", ScalarType::u8},
      {"uint8", ScalarType::u8},
      {"uint8_t", ScalarType::u8},
      {"short", ScalarType::i16},
      {"short int", ScalarType::i16},
      {"signed short", ScalarType::i16},
      {"signed short int", ScalarType::i16},
      {"int16", ScalarType::i16},
      {"int16_t", ScalarType::i16},
      {"ushort", ScalarType::u16},
      {"unsigned short", ScalarType::u16},
      {"unsigned short int", ScalarType::u16},
      {"uint16", ScalarType::u16},
      {"uint16_t", ScalarType::u16},
      {"int", ScalarType::i32},
      {"signed int", ScalarType::i32},
      {"int32", ScalarType::i32},
      {"int32_t", ScalarType::i32},
      {"uint", ScalarType::u32},
      {"unsigned int", ScalarType::u32},
      {"uint32", ScalarType::u32},
      {"uint32_t", ScalarType::u32},
      {"longlong", ScalarType::i64},
      {"long long", ScalarType::i64},
      {"long long int", ScalarType::i64},
      {"signed long long", ScalarType::i64},
      {"signed long long int", ScalarType::i64},
      {"int64", ScalarType::i64},
      {"int64_t", ScalarType::i64},
      {"ulonglong", ScalarType::u64},
      {"unsigned long long", ScalarType::u64},
      {"unsigned long long int", ScalarType::u64},
      {"uint64", ScalarType::u64},
      {"uint64_t", ScalarType::u64},
      {"float", ScalarType::f32},
      {"double", ScalarType::f64}};
  const auto found = types.find(field.value);
  if (found == types.end())
    throw Error(field.place, "type " + quoted(field.value) + ", expected a whole number or float");
  return found->second;
}

/// "(1,0,0) (0,1,0) none (0,0,1)": the vectors, "none" as nothing.
std::vector<std::optional<Vec3>> vectors_of(const HeaderField& field) {
  std::vector<std::optional<Vec3>> vectors;
  std::string_view rest = trimmed(field.value);
  while (!rest.empty()) {
    if (rest.starts_with("none")) {
      vectors.emplace_back();
      rest = trimmed(rest.substr(4));
      continue;
    }
    const std::size_t end = rest.find(')');
    if (rest.front() != '(' || end == std::string_view::npos)
      throw Error(field.place, quoted(rest) + ", expected (x,y,z)");
    std::string_view inner = rest.substr(1, end - 1);
    Vec3 vector;
    for (int a = 0; a < 3; ++a) {
      const std::size_t comma = inner.find(',');
      if ((comma == std::string_view::npos) != (a == 2))
        throw Error(field.place, quoted(rest.substr(0, end + 1)) + ", expected three coordinates");
      vector[a] = number_of(field.place, trimmed(inner.substr(0, comma)));
      inner = a < 2 ? inner.substr(comma + 1) : std::string_view();
    }
    vectors.emplace_back(vector);
    rest = trimmed(rest.substr(end + 1));
  }
  return vectors;
}

/// Signs that turn the space's axes to right, anterior, superior.
Vec3 to_ras(const Fields& fields, const std::string& name, LabelVolume& volume) {
  const HeaderField* const space = fields.find("space");
  const std::string text = space != nullptr ? space->value : "";
  std::string lower;
  for (const char c : text)
    lower += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (lower == "right-anterior-superior" || lower == "ras")
    return {1, 1, 1};
  if (lower == "left-anterior-superior" || lower == "las")
    return {-1, 1, 1};
  if (lower == "left-posterior-superior" || lower == "lps")
    return {-1, -1, 1};
  if (space == nullptr || lower == "scanner-xyz" || lower == "3d-right-handed") {
    volume.warnings.push_back(name + ": no anatomical space: coordinates are taken as right, "
                                     "anterior, superior");
    return {1, 1, 1};
  }
  throw Error(space->place, "space " + quoted(text) +
                                ", expected right-anterior-superior, left-anterior-superior or "
                                "left-posterior-superior");
}

/// Millimetres of units that are all alike; absent ones are mm.
double unit_of(const HeaderField* field) {
  if (field == nullptr)
    return 1;
  std::vector<std::string> units;
  for (const std::string_view word : words_of(field->value)) {
    const std::string unit(word.size() >= 2 && word.front() == '"' && word.back() == '"'
                               ? word.substr(1, word.size() - 2)
                               : word);
    if (!unit.empty())
      units.push_back(unit);
  }
  for (const std::string& unit : units)
    if (unit != units.front())
      throw Error(field->place, "units differ, expected one for all axes");
  if (units.empty() || units.front() == "mm" || units.front() == "millimeter")
    return 1;
  if (units.front() == "cm")
    return 10;
  if (units.front() == "m")
    return 1000;
  if (units.front() == "um" || units.front() == "microns" || units.front() == "\xc2\xb5m")
    return 0.001;
  throw Error(field->place, "unit " + quoted(units.front()) + ", expected mm, cm, m or um");
}

/// The three axes among `sizes` that span the volume; the others must have size 1.
std::array<std::size_t, 3> space_axes(const HeaderField& sizes,
                                      const std::vector<std::int64_t>& size,
                                      const std::vector<std::optional<Vec3>>& directions) {
  std::array<std::size_t, 3> axes{0, 1, 2};
  std::size_t count = 0;
  for (std::size_t n = 0; n < size.size(); ++n) {
    const bool spatial = directions.empty() ? size.size() == 3 : directions[n].has_value();
    if (spatial && count < 3)
      axes.at(count++) = n;
    else if (spatial || size[n] != 1)
      throw Error(sizes.place, "axis " + std::to_string(n + 1) + " has " + std::to_string(size[n]) +
                                   " samples, expected one volume of three axes in space");
  }
  if (count < 3)
    throw Error(sizes.place, std::to_string(count) + " axes in space, expected 3");
  return axes;
}

volume::GridTransform affine(const Fields& fields, const std::string& name,
                             const std::vector<std::optional<Vec3>>& directions,
                             const std::array<std::size_t, 3>& axes, LabelVolume& volume) {
  std::array<Vec3, 3> column;
  Vec3 origin;
  const Vec3 sign = to_ras(fields, name, volume);
  double unit = unit_of(fields.find("space units"));
  if (!directions.empty()) {
    const HeaderField& field = fields.need("space origin");
    const auto vectors = vectors_of(field);
    if (vectors.size() != 1 || !vectors.front())
      throw Error(field.place, quoted(field.value) + ", expected one origin (x,y,z)");
    origin = *vectors.front();
    for (std::size_t a = 0; a < 3; ++a)
      column.at(a) = *directions[axes.at(a)];
  } else {
    const HeaderField& field = fields.need("spacings");
    if (const HeaderField* const mins = fields.find("axis mins"))
      throw Error(mins->place, "axis mins, expected space directions and space origin");
    const std::vector<std::string_view> words = words_of(field.value);
    if (words.size() != 3)
      throw Error(field.place, std::to_string(words.size()) + " spacings, expected 3");
    for (std::size_t a = 0; a < 3; ++a)
      column.at(a)[static_cast<int>(a)] = number_of(field.place, words[a]);
    if (const HeaderField* const units = fields.find("units"); units != nullptr && unit == 1)
      unit = unit_of(units);
  }
  volume::GridTransform t;
  for (int row = 0; row < 3; ++row) {
    for (std::size_t a = 0; a < 3; ++a)
      t.m[static_cast<std::size_t>(4 * row) + a] = sign[row] * column.at(a)[row] * unit;
    t.m[static_cast<std::size_t>(4 * row + 3)] = sign[row] * origin[row] * unit;
  }
  check_affine(directions.empty() ? fields.need("spacings").place
                                  : fields.need("space directions").place,
               t);
  return t;
}

bool big_endian_of(const Fields& fields, ScalarType type) {
  if (bytes_of(type) == 1)
    return false;
  const HeaderField& field = fields.need("endian");
  if (field.value != "little" && field.value != "big")
    throw Error(field.place, quoted(field.value) + ", expected little or big");
  return field.value == "big";
}

/// Reads the voxels of `bytes` after the skips of the header.
LabelVolume read_data(BufferedBytes& bytes, const Fields& fields, const VoxelLayout& layout,
                      const LabelRequest& request) {
  const HeaderField& encoding = fields.need("encoding");
  const bool gzip = encoding.value == "gzip" || encoding.value == "gz";
  if (!gzip && encoding.value != "raw")
    throw Error(encoding.place, "encoding " + quoted(encoding.value) + ", expected raw or gzip");
  const auto skip_of = [&](const char* key) {
    const HeaderField* const field = fields.find(key);
    const std::int64_t n = field == nullptr ? 0 : whole_of(field->place, field->value);
    if (n < 0 || n > 1000000000)
      throw Error(field->place, std::to_string(n) + ", expected 0 to 1e9");
    return static_cast<std::uint64_t>(n);
  };
  for (std::uint64_t lines = skip_of("line skip"); lines > 0; --lines)
    if (!bytes.line())
      throw Error(bytes.name(), "ends before its voxels begin");
  if (!gzip) {
    bytes.skip(skip_of("byte skip"));
    return read_voxels(bytes, bytes.name(), layout, request);
  }
  InflatedBytes inflated(bytes, bytes.name()); // byte skip counts what was unpacked
  BufferedBytes voxels(inflated, bytes.name());
  voxels.skip(skip_of("byte skip"));
  return read_voxels(voxels, bytes.name(), layout, request);
}

} // namespace

bool is_nrrd(std::string_view bytes) {
  return bytes.starts_with("NRRD000");
}

LabelVolume read_nrrd(BufferedBytes& bytes, const LabelRequest& request) {
  const std::string& name = bytes.name();
  const Fields fields(bytes);
  const HeaderField& dimension = fields.need("dimension");
  const HeaderField& sizes = fields.need("sizes");
  std::vector<std::int64_t> size;
  for (const std::string_view word : words_of(sizes.value))
    size.push_back(whole_of(sizes.place, word));
  if (whole_of(dimension.place, dimension.value) != static_cast<std::int64_t>(size.size()))
    throw Error(sizes.place, std::to_string(size.size()) + " sizes, expected " +
                                 quoted(dimension.value) + " as dimension says");
  std::vector<std::optional<Vec3>> directions;
  if (const HeaderField* const field = fields.find("space directions")) {
    directions = vectors_of(*field);
    if (directions.size() != size.size())
      throw Error(field->place, std::to_string(directions.size()) + " directions, expected " +
                                    std::to_string(size.size()));
  }
  const std::array<std::size_t, 3> axes = space_axes(sizes, size, directions);

  LabelVolume head;
  VoxelLayout layout;
  layout.size = checked_size(sizes.place, {size[axes[0]], size[axes[1]], size[axes[2]]});
  layout.type = scalar_type(fields.need("type"));
  layout.big_endian = big_endian_of(fields, layout.type);
  layout.transform = affine(fields, name, directions, axes, head);

  std::vector<LabelRange> labels;
  for (const LabelRange& range : request.labels)
    labels.push_back(numbered_label(range, fields.names(), name));
  const LabelRequest numbered{labels,      request.context, request.check, request.side_files,
                              request.all, request.grey,    request.layout};

  LabelVolume volume;
  if (const HeaderField* const file = fields.find("data file")) {
    volume = read_side_file(name, *file, numbered, [&](BufferedBytes& data) {
      return read_data(data, fields, layout, numbered);
    });
  } else {
    volume = read_data(bytes, fields, layout, numbered);
  }
  volume.names = fields.names();
  volume.format = "NRRD";
  volume.warnings = head.warnings;
  return volume;
}

} // namespace gewebe::formats
