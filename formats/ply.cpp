#include "formats/ply.h"

#include "base/error.h"
#include "surface/triangulate.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <span>
#include <utility>
// Based on: Turk, The PLY polygon file format, 1994.

namespace gewebe {
namespace {

static_assert(std::endian::native == std::endian::little, "the codec copies little-endian memory");

// ---- header

enum class Type : std::uint8_t { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

constexpr std::array<std::pair<std::string_view, Type>, 16> type_names{{
    {"char", Type::int8},
    {"int8", Type::int8},
    {"uchar", Type::uint8},
    {"uint8", Type::uint8},
    {"short", Type::int16},
    {"int16", Type::int16},
    {"ushort", Type::uint16},
    {"uint16", Type::uint16},
    {"int", Type::int32},
    {"int32", Type::int32},
    {"uint", Type::uint32},
    {"uint32", Type::uint32},
    {"float", Type::float32},
    {"float32", Type::float32},
    {"double", Type::float64},
    {"float64", Type::float64},
}};

constexpr std::size_t size_of(Type type) {
  switch (type) {
  case Type::int8:
  case Type::uint8:
    return 1;
  case Type::int16:
  case Type::uint16:
    return 2;
  case Type::int32:
  case Type::uint32:
  case Type::float32:
    return 4;
  case Type::float64:
    break;
  }
  return 8;
}

// What a property is to us.
enum class Use : std::uint8_t { skip, x, y, z, nx, ny, nz, indices, texcoord, part, material };

struct Property {
  std::string name;
  Type type = Type::float64;
  std::optional<Type> count_type; // of a list
  Use use = Use::skip;
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
  std::size_t line = 0; // where the header states it
};

enum class Encoding { ascii, little, big };

struct Header {
  Encoding encoding = Encoding::ascii;
  std::vector<Element> elements;
  std::size_t bytes = 0; // up to and with the end of the line end_header
  std::size_t lines = 0;
};

std::string quoted(std::string_view text) {
  std::string out = "\"";
  for (const char c : text.substr(0, 40))
    out += c >= ' ' && c <= '~' ? c : '?';
  if (text.size() > 40)
    out += "...";
  return out + '"';
}

std::vector<std::string_view> split(std::string_view line) {
  std::vector<std::string_view> words;
  std::size_t at = 0;
  while ((at = line.find_first_not_of(" \t\r\v\f", at)) != std::string_view::npos) {
    const std::size_t end = std::min(line.find_first_of(" \t\r\v\f", at), line.size());
    words.push_back(line.substr(at, end - at));
    at = end;
  }
  return words;
}

class HeaderReader {
public:
  HeaderReader(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name) {}

  Header read() {
    if (next_line() != "ply")
      fail("no PLY file, expected \"ply\" as the first line");
    bool has_format = false;
    for (;;) {
      const std::string_view line = next_line();
      const std::vector<std::string_view> words = split(line);
      if (words.empty())
        continue;
      if (words[0] == "comment" || words[0] == "obj_info")
        continue;
      if (words[0] == "end_header" && words.size() == 1)
        break;
      if (words[0] == "format") {
        if (has_format || !header_.elements.empty())
          fail("a second or late format line, expected one, before the elements");
        read_format(words);
        has_format = true;
      } else if (!has_format) {
        fail(quoted(line) +
             ", expected the line \"format ascii|binary_little_endian|binary_big_endian 1.0\"");
      } else if (words[0] == "element") {
        read_element(words);
      } else if (words[0] == "property") {
        read_property(words);
      } else {
        fail(quoted(line) + ", expected element, property, comment or end_header");
      }
    }
    if (!has_format)
      fail("the header ends without a format line, expected one");
    if (std::none_of(header_.elements.begin(), header_.elements.end(),
                     [](const Element& e) { return e.name == "vertex"; }))
      fail("the header ends without vertices, expected \"element vertex COUNT\"");
    header_.bytes = at_;
    header_.lines = line_;
    return std::move(header_);
  }

private:
  static constexpr std::size_t max_line = 4096;
  static constexpr std::size_t max_properties = 4096;

  [[noreturn]] void fail(const std::string& what) const {
    throw Error(name_ + ":" + std::to_string(line_), what);
  }

  std::string_view next_line() {
    ++line_;
    const std::string_view rest = bytes_.substr(at_, max_line);
    const std::size_t end = rest.find('\n');
    if (end == std::string_view::npos) {
      if (rest.size() == max_line)
        fail("a line of over " + std::to_string(max_line) + " bytes, expected a PLY header");
      fail("the file ends inside the header, expected end_header");
    }
    at_ += end + 1;
    std::string_view line = rest.substr(0, end);
    if (line.ends_with('\r'))
      line.remove_suffix(1);
    return line;
  }

  void read_format(const std::vector<std::string_view>& words) {
    if (words.size() != 3 || words[2] != "1.0")
      fail("unknown format line, expected version 1.0");
    if (words[1] == "ascii")
      header_.encoding = Encoding::ascii;
    else if (words[1] == "binary_little_endian")
      header_.encoding = Encoding::little;
    else if (words[1] == "binary_big_endian")
      header_.encoding = Encoding::big;
    else
      fail("format " + quoted(words[1]) +
           ", expected ascii, binary_little_endian or binary_big_endian");
  }

  void read_element(const std::vector<std::string_view>& words) {
    if (words.size() != 3)
      fail("expected \"element NAME COUNT\"");
    Element element;
    element.name = words[1];
    element.line = line_;
    const char* end = words[2].data() + words[2].size();
    const auto [stop, error] = std::from_chars(words[2].data(), end, element.count);
    if (error != std::errc() || stop != end)
      fail("element count " + quoted(words[2]) + ", expected an integer from 0");
    for (const Element& other : header_.elements)
      if (other.name == element.name)
        fail("a second element " + quoted(element.name) + ", expected one");
    header_.elements.push_back(std::move(element));
  }

  Type type_from(std::string_view name) const {
    for (const auto& [text, type] : type_names)
      if (text == name)
        return type;
    fail("unknown type " + quoted(name) +
         ", expected char, uchar, short, ushort, int, uint, float or double");
  }

  void read_property(const std::vector<std::string_view>& words) {
    if (header_.elements.empty())
      fail("a property before any element, expected an element");
    Element& element = header_.elements.back();
    if (++properties_ > max_properties)
      fail("over " + std::to_string(max_properties) + " properties, expected fewer");
    Property property;
    if (words.size() == 5 && words[1] == "list") {
      property.count_type = type_from(words[2]);
      if (*property.count_type == Type::float32 || *property.count_type == Type::float64)
        fail("a list counted by " + std::string(words[2]) + ", expected an integer type");
      property.type = type_from(words[3]);
    } else if (words.size() == 3) {
      property.type = type_from(words[1]);
    } else {
      fail("expected \"property TYPE NAME\" or \"property list TYPE TYPE NAME\"");
    }
    property.name = words.back();
    for (const Property& other : element.properties)
      if (other.name == property.name)
        fail("a second property " + quoted(property.name) + ", expected one");
    property.use = use_of(element, property);
    element.properties.push_back(std::move(property));
  }

  Use use_of(const Element& element, const Property& property) const {
    struct Known {
      std::string_view element, name;
      bool list;
      Use use;
    };
    static constexpr std::array<Known, 11> known{{
        {"vertex", "x", false, Use::x},
        {"vertex", "y", false, Use::y},
        {"vertex", "z", false, Use::z},
        {"vertex", "nx", false, Use::nx},
        {"vertex", "ny", false, Use::ny},
        {"vertex", "nz", false, Use::nz},
        {"face", "vertex_indices", true, Use::indices},
        {"face", "vertex_index", true, Use::indices},
        {"face", "texcoord", true, Use::texcoord},
        {"face", "part", false, Use::part},
        {"face", "material", false, Use::material},
    }};
    for (const Known& k : known) {
      if (k.element != element.name || k.name != property.name)
        continue;
      if (k.list != property.count_type.has_value())
        fail("property " + property.name + " of " + element.name + " is " +
             (k.list ? "no list, expected a list" : "a list, expected a scalar"));
      if (k.use == Use::indices)
        for (const Property& other : element.properties)
          if (other.use == Use::indices)
            fail("both vertex_indices and vertex_index, expected one");
      return k.use;
    }
    return Use::skip;
  }

  std::string_view bytes_;
  const std::string& name_;
  Header header_;
  std::size_t at_ = 0, line_ = 0, properties_ = 0;
};

// ---- body

// Both sources give the numbers of the body one after the other as double, which holds every type
// exactly.

class BinarySource {
public:
  BinarySource(std::string_view bytes, const std::string& name, std::size_t at, bool swap)
      : bytes_(bytes), name_(name), at_(at), swap_(swap) {}

  [[noreturn]] void fail(const std::string& what) const {
    throw Error(name_, "byte " + std::to_string(at_) + ": " + what);
  }

  /// The least room that one value of the type takes.
  static std::size_t least_size(Type type) { return size_of(type); }
  std::size_t left() const { return bytes_.size() - at_; }
  void begin_record(const Element&) {}
  void end_record() {}

  double value(Type type) {
    switch (type) {
    case Type::int8:
      return take<std::int8_t>();
    case Type::uint8:
      return take<std::uint8_t>();
    case Type::int16:
      return take<std::int16_t>();
    case Type::uint16:
      return take<std::uint16_t>();
    case Type::int32:
      return take<std::int32_t>();
    case Type::uint32:
      return take<std::uint32_t>();
    case Type::float32:
      return static_cast<double>(take<float>());
    case Type::float64:
      break;
    }
    return take<double>();
  }

  void skip(Type type, std::size_t count) {
    require(count * size_of(type));
    at_ += count * size_of(type);
  }

  void finish() {
    if (left() != 0)
      fail(std::to_string(left()) + " bytes after the last element, expected the end");
  }

private:
  void require(std::size_t size) const {
    if (left() < size)
      fail("the file ends here, expected " + std::to_string(size - left()) + " more bytes");
  }

  template <class T>
  T take() {
    require(sizeof(T));
    std::array<char, sizeof(T)> raw;
    std::memcpy(raw.data(), bytes_.data() + at_, sizeof(T));
    if (swap_)
      std::reverse(raw.begin(), raw.end());
    at_ += sizeof(T);
    return std::bit_cast<T>(raw);
  }

  std::string_view bytes_;
  const std::string& name_;
  std::size_t at_;
  bool swap_;
};

class AsciiSource {
public:
  AsciiSource(std::string_view bytes, const std::string& name, std::size_t at, std::size_t lines)
      : bytes_(bytes), name_(name), at_(at), line_(lines) {}

  [[noreturn]] void fail(const std::string& what) const {
    throw Error(name_ + ":" + std::to_string(line_), what);
  }

  // A digit and the blank or line end behind it; the very last may lack that.
  static std::size_t least_size(Type) { return 2; }
  std::size_t left() const { return bytes_.size() - at_ + 1 + rest_.size(); }

  /// An element is one line; blank lines between are passed over.
  void begin_record(const Element& element) {
    if (element.properties.empty())
      return;
    do {
      if (!next_line())
        fail("the file ends here, expected another " + element.name);
    } while (rest_.empty());
  }
  void end_record() {
    if (!rest_.empty())
      fail(quoted(rest_) + " is left on the line, expected its end");
  }

  double value(Type) {
    if (rest_.empty())
      fail("the line ends here, expected another number");
    std::size_t size = 0;
    while (size < rest_.size() && !is_blank(rest_[size]))
      ++size;
    std::string_view word = rest_.substr(0, size);
    const std::string_view shown = word;
    if (word.starts_with('+'))
      word.remove_prefix(1);
    double number = 0;
    const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), number);
    if (error != std::errc() || stop != word.data() + word.size() || word.starts_with("+-"))
      fail(quoted(shown) + ", expected a number");
    rest_.remove_prefix(size);
    trim();
    return number;
  }

  void skip(Type type, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i)
      value(type);
  }

  void finish() {
    while (next_line())
      if (!rest_.empty())
        fail(quoted(rest_) + " after the last element, expected the end");
  }

private:
  static bool is_blank(char c) {
    return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f';
  }
  void trim() {
    while (!rest_.empty() && is_blank(rest_.front()))
      rest_.remove_prefix(1);
  }
  bool next_line() {
    ++line_;
    rest_ = {};
    if (at_ == bytes_.size())
      return false;
    const std::size_t end = std::min(bytes_.find('\n', at_), bytes_.size());
    rest_ = bytes_.substr(at_, end - at_);
    at_ = std::min(end + 1, bytes_.size());
    trim();
    return true;
  }

  std::string_view bytes_;
  const std::string& name_;
  std::size_t at_, line_;
  std::string_view rest_; // of the line, from a word on
};

// The faces before they become triangles.
struct Faces {
  std::vector<std::uint32_t> sizes;   // corners of each face; empty while all have three
  std::vector<std::uint32_t> corners; // all faces one after the other
  std::vector<float> texcoords;       // two per corner, or none
  std::vector<std::int32_t> part, material;
  std::size_t count = 0;
};

bool has(const Element& element, Use use) {
  return std::any_of(element.properties.begin(), element.properties.end(),
                     [&](const Property& p) { return p.use == use; });
}

template <class Source>
class BodyReader {
public:
  BodyReader(Source source, const Header& header, const std::string& name)
      : source_(std::move(source)), header_(header), name_(name) {}

  TriangleMesh read(PlyStats& stats) {
    for (const Element& element : header_.elements) {
      check_room(element);
      if (element.name == "vertex")
        read_vertices(element);
      else if (element.name == "face")
        read_faces(element);
      else
        skip_element(element, stats);
      if (element.name == "vertex" || element.name == "face")
        stats.skipped_properties += static_cast<std::uint64_t>(
            std::count_if(element.properties.begin(), element.properties.end(),
                          [](const Property& p) { return p.use == Use::skip; }));
    }
    source_.finish();
    make_triangles(stats);
    return std::move(mesh_);
  }

private:
  // Nothing is reserved for a count that the bytes left can't hold.
  void check_room(const Element& element) const {
    std::size_t least = 0;
    for (const Property& p : element.properties) {
      least += Source::least_size(p.count_type.value_or(p.type));
      if (p.use == Use::indices)
        least += 3 * Source::least_size(p.type);
    }
    if (least > 0 && element.count > source_.left() / least)
      source_.fail(std::to_string(element.count) + " elements " + quoted(element.name) + " in " +
                   std::to_string(source_.left()) + " bytes, expected at least " +
                   std::to_string(least) + " bytes for each");
    if (least > 0 && element.count >= UINT32_MAX)
      source_.fail(std::to_string(element.count) + " elements, expected fewer than " +
                   std::to_string(UINT32_MAX));
  }

  std::size_t list_size(const Property& property) {
    const double count = source_.value(*property.count_type);
    if (!(count >= 0 && count <= UINT32_MAX && count == std::floor(count)))
      source_.fail("a list of " + number(count) + " values, expected a count from 0");
    const std::size_t size = static_cast<std::size_t>(count);
    if (size > source_.left() / Source::least_size(property.type))
      source_.fail("a list of " + std::to_string(size) + " values in " +
                   std::to_string(source_.left()) + " bytes, expected a count that fits");
    return size;
  }

  static std::string number(double value) {
    std::array<char, 32> text;
    const auto [end, error] = std::to_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc() ? std::string(text.data(), end) : "?";
  }

  double finite(const Property& property) {
    const double value = source_.value(property.type);
    if (!std::isfinite(value))
      source_.fail(property.name + " is not finite, expected a finite number");
    return value;
  }

  float finite_float(double value, const Property& property) const {
    if (!(std::fabs(value) <= static_cast<double>(std::numeric_limits<float>::max())))
      source_.fail(property.name + " is not finite, expected a finite number");
    return static_cast<float>(value);
  }

  std::int32_t whole(const Property& property) {
    const double value = source_.value(property.type);
    if (!(value >= 0 && value <= INT32_MAX && value == std::floor(value)))
      source_.fail(property.name + " is " + number(value) + ", expected an integer from 0");
    return static_cast<std::int32_t>(value);
  }

  void skip(const Property& property) {
    source_.skip(property.type, property.count_type ? list_size(property) : 1);
  }

  void skip_element(const Element& element, PlyStats& stats) {
    ++stats.skipped_elements;
    if (element.properties.empty())
      return;
    for (std::uint64_t i = 0; i < element.count; ++i) {
      source_.begin_record(element);
      for (const Property& property : element.properties)
        skip(property);
      source_.end_record();
    }
  }

  void read_vertices(const Element& element) {
    const bool normals = has(element, Use::nx) && has(element, Use::ny) && has(element, Use::nz);
    for (const auto& [use, axis] :
         {std::pair(Use::x, "x"), std::pair(Use::y, "y"), std::pair(Use::z, "z")})
      if (!has(element, use))
        header_fail(element, std::string("vertices without ") + axis + ", expected x, y and z");
    mesh_.points.reserve(element.count);
    if (normals)
      mesh_.normals.reserve(element.count);
    for (std::uint64_t i = 0; i < element.count; ++i) {
      Vec3 point, normal;
      source_.begin_record(element);
      for (const Property& property : element.properties) {
        switch (property.use) {
        case Use::x:
          point.x = finite(property);
          break;
        case Use::y:
          point.y = finite(property);
          break;
        case Use::z:
          point.z = finite(property);
          break;
        case Use::nx:
          normal.x = finite(property);
          break;
        case Use::ny:
          normal.y = finite(property);
          break;
        case Use::nz:
          normal.z = finite(property);
          break;
        default:
          skip(property);
        }
      }
      source_.end_record();
      mesh_.points.push_back(point);
      if (normals)
        mesh_.normals.push_back(unit(normal));
    }
  }

  static std::array<float, 3> unit(Vec3 n) {
    const double length = norm(n);
    if (length > 0 && std::isfinite(length) && !(std::fabs(length - 1) <= 1e-5))
      n = n / length;
    if (!std::isfinite(length))
      n = {};
    return {static_cast<float>(n.x), static_cast<float>(n.y), static_cast<float>(n.z)};
  }

  void read_faces(const Element& element) {
    if (!has(element, Use::indices))
      header_fail(element, "faces without vertex_indices, expected that list");
    const bool with_texcoords = has(element, Use::texcoord);
    faces_.corners.reserve(3 * element.count);
    if (with_texcoords)
      faces_.texcoords.reserve(6 * element.count);
    if (has(element, Use::part))
      faces_.part.reserve(element.count);
    if (has(element, Use::material))
      faces_.material.reserve(element.count);
    for (std::uint64_t i = 0; i < element.count; ++i) {
      std::size_t corners = 0, texcoords = 0;
      source_.begin_record(element);
      for (const Property& property : element.properties) {
        switch (property.use) {
        case Use::indices:
          corners = read_indices(property);
          break;
        case Use::texcoord:
          texcoords = read_texcoords(property);
          break;
        case Use::part:
          faces_.part.push_back(whole(property));
          break;
        case Use::material:
          faces_.material.push_back(whole(property));
          break;
        default:
          skip(property);
        }
      }
      source_.end_record();
      if (with_texcoords && texcoords != 2 * corners)
        source_.fail("a face with " + std::to_string(corners) + " corners and " +
                     std::to_string(texcoords) + " texture coordinates, expected two a corner");
      add_size(corners);
    }
  }

  void add_size(std::size_t corners) {
    if (corners != 3 && faces_.sizes.empty())
      faces_.sizes.assign(faces_.count, 3);
    ++faces_.count;
    if (corners != 3 || !faces_.sizes.empty())
      faces_.sizes.push_back(static_cast<std::uint32_t>(corners));
  }

  std::size_t read_indices(const Property& property) {
    const std::size_t size = list_size(property);
    if (size < 3)
      source_.fail("a face with " + std::to_string(size) + " corners, expected at least 3");
    for (std::size_t k = 0; k < size; ++k) {
      const double index = source_.value(property.type);
      if (!(index >= 0 && index < vertex_count() && index == std::floor(index)))
        source_.fail("a face with corner " + number(index) + ", expected an index below " +
                     number(vertex_count()));
      faces_.corners.push_back(static_cast<std::uint32_t>(index));
    }
    return size;
  }

  std::size_t read_texcoords(const Property& property) {
    const std::size_t size = list_size(property);
    for (std::size_t k = 0; k < size; ++k)
      faces_.texcoords.push_back(finite_float(source_.value(property.type), property));
    return size;
  }

  // As the header states it, for the faces may come first.
  double vertex_count() {
    if (!vertex_count_) {
      vertex_count_ = 0;
      for (const Element& element : header_.elements)
        if (element.name == "vertex")
          vertex_count_ = static_cast<double>(element.count);
    }
    return *vertex_count_;
  }

  [[noreturn]] void header_fail(const Element& element, const std::string& what) const {
    throw Error(name_ + ":" + std::to_string(element.line), what);
  }

  void make_triangles(PlyStats& stats) {
    std::size_t triangles = 0;
    for (const std::uint32_t size : faces_.sizes)
      triangles += size - 2;
    if (faces_.sizes.empty())
      triangles = faces_.count;
    mesh_.triangles.reserve(triangles);
    if (!faces_.texcoords.empty())
      mesh_.texcoords.reserve(triangles);
    if (!faces_.sizes.empty() && !faces_.part.empty())
      mesh_.part.reserve(triangles);
    if (!faces_.sizes.empty() && !faces_.material.empty())
      mesh_.material.reserve(triangles);

    std::vector<Vec3> polygon;
    std::vector<Triangle> cut;
    std::size_t first = 0;
    for (std::size_t f = 0; f < faces_.count; ++f) {
      const std::uint32_t size = faces_.sizes.empty() ? 3 : faces_.sizes[f];
      const std::span<const std::uint32_t> corners(faces_.corners.data() + first, size);
      cut.clear();
      if (size == 3) {
        cut.push_back({0, 1, 2});
      } else {
        ++stats.polygons;
        polygon.clear();
        for (const std::uint32_t corner : corners)
          polygon.push_back(mesh_.points[corner]);
        at(name_, [&] { triangulate_polygon(polygon, cut); });
      }
      for (const Triangle& t : cut) {
        mesh_.triangles.push_back({corners[t[0]], corners[t[1]], corners[t[2]]});
        if (!faces_.texcoords.empty()) {
          const float* st = faces_.texcoords.data() + 2 * first;
          const std::size_t a = t[0], b = t[1], c = t[2];
          mesh_.texcoords.push_back(
              {st[2 * a], st[2 * a + 1], st[2 * b], st[2 * b + 1], st[2 * c], st[2 * c + 1]});
        }
        if (!faces_.sizes.empty() && !faces_.part.empty())
          mesh_.part.push_back(faces_.part[f]);
        if (!faces_.sizes.empty() && !faces_.material.empty())
          mesh_.material.push_back(faces_.material[f]);
      }
      first += size;
    }
    if (faces_.sizes.empty()) {
      mesh_.part = std::move(faces_.part);
      mesh_.material = std::move(faces_.material);
    }
  }

  Source source_;
  const Header& header_;
  const std::string& name_;
  TriangleMesh mesh_;
  Faces faces_;
  std::optional<double> vertex_count_;
};

// ---- writing

class PieceWriter {
public:
  explicit PieceWriter(const std::function<void(std::string_view)>& sink) : sink_(sink) {}

  void text(std::string_view bytes) { buffer_.append(bytes); }
  template <class T>
  void put(const T& value) {
    buffer_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  void end_record() {
    if (buffer_.size() >= piece)
      flush();
  }
  void flush() {
    sink_(buffer_);
    buffer_.clear();
  }

private:
  static constexpr std::size_t piece = 1 << 18;
  const std::function<void(std::string_view)>& sink_;
  std::string buffer_;
};

std::string header_of(const TriangleMesh& mesh) {
  std::string text = "ply\nformat binary_little_endian 1.0\ncomment gewebe_mesh, millimetres\n";
  text += "element vertex " + std::to_string(mesh.points.size()) + "\n";
  text += "property double x\nproperty double y\nproperty double z\n";
  if (!mesh.normals.empty())
    text += "property float nx\nproperty float ny\nproperty float nz\n";
  text += "element face " + std::to_string(mesh.triangles.size()) + "\n";
  text += "property list uchar int vertex_indices\n";
  if (!mesh.texcoords.empty())
    text += "property list uchar float texcoord\n";
  if (!mesh.part.empty())
    text += "property int part\n";
  if (!mesh.material.empty())
    text += "property int material\n";
  return text + "end_header\n";
}

} // namespace

TriangleMesh read_ply(std::string_view bytes, const std::string& name, PlyStats* stats) {
  PlyStats unused;
  PlyStats& counts = stats == nullptr ? unused : *stats;
  const Header header = HeaderReader(bytes, name).read();
  if (header.encoding == Encoding::ascii)
    return BodyReader(AsciiSource(bytes, name, header.bytes, header.lines), header, name)
        .read(counts);
  const bool swap = header.encoding == Encoding::big;
  return BodyReader(BinarySource(bytes, name, header.bytes, swap), header, name).read(counts);
}

void write_ply(const TriangleMesh& mesh, const std::function<void(std::string_view)>& sink) {
  if (mesh.points.size() > INT32_MAX)
    throw Error(std::to_string(mesh.points.size()) + " points, expected at most " +
                std::to_string(INT32_MAX) + " in a PLY file");
  PieceWriter out(sink);
  out.text(header_of(mesh));
  for (std::size_t p = 0; p < mesh.points.size(); ++p) {
    out.put(mesh.points[p]);
    if (!mesh.normals.empty())
      out.put(mesh.normals[p]);
    out.end_record();
  }
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    out.put(std::uint8_t{3});
    out.put(mesh.triangles[t]);
    if (!mesh.texcoords.empty()) {
      out.put(std::uint8_t{6});
      out.put(mesh.texcoords[t]);
    }
    if (!mesh.part.empty())
      out.put(mesh.part[t]);
    if (!mesh.material.empty())
      out.put(mesh.material[t]);
    out.end_record();
  }
  out.flush();
}

std::string write_ply(const TriangleMesh& mesh) {
  std::string bytes;
  write_ply(mesh, [&](std::string_view piece) { bytes += piece; });
  return bytes;
}

} // namespace gewebe
