#include "formats/mesh/ply_header.h"
#include "base/error.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <utility>
// Based on: Turk, The PLY polygon file format, 1994.

namespace gewebe::formats::ply {

std::string quoted(std::string_view text) {
  std::string out = "\"";
  for (const char c : text.substr(0, 40))
    out += c >= ' ' && c <= '~' ? c : '?';
  if (text.size() > 40)
    out += "...";
  return out + '"';
}

namespace {

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

} // namespace

Header read_header(std::string_view bytes, const std::string& name) {
  return HeaderReader(bytes, name).read();
}

} // namespace gewebe::formats::ply
