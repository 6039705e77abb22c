#include "formats/mesh/vtk_xml.h"

#include "base/error.h"
#include "formats/mesh/ply_header.h"

#include <algorithm>
#include <charconv>
#include <optional>
#include <system_error>
#include <utility>
// Based on: VTK file formats, docs.vtk.org, "XML file formats".

namespace gewebe::formats::vtk {

using ply::quoted;

namespace {

struct Tag {
  std::string name; // of an end "/name"
  std::map<std::string, std::string, std::less<>> attributes;
  bool empty = false; // <name/>
  std::size_t at = 0, end = 0;
};

/// The tags of XML, one after the other; comments and declarations are passed over.
class Tags {
public:
  Tags(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name) {}

  [[noreturn]] void fail(std::size_t at, const std::string& what) const {
    const std::string_view before = bytes_.substr(0, at);
    throw Error(name_ + ":" + std::to_string(1 + std::ranges::count(before, '\n')), what);
  }

  std::optional<Tag> next() {
    for (;;) {
      const std::size_t at = bytes_.find('<', at_);
      if (at == std::string_view::npos)
        return std::nullopt;
      if (bytes_.substr(at).starts_with("<!--"))
        pass(at, "-->");
      else if (bytes_.substr(at).starts_with("<?") || bytes_.substr(at).starts_with("<!"))
        pass(at, ">");
      else
        return read(at);
    }
  }

private:
  void pass(std::size_t at, std::string_view end) {
    const std::size_t found = bytes_.find(end, at);
    if (found == std::string_view::npos)
      fail(at, "the file ends within a comment or declaration");
    at_ = found + end.size();
  }

  static bool is_blank(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }
  static bool is_name(char c) {
    return !is_blank(c) && c != '>' && c != '/' && c != '=' && c != '<';
  }

  Tag read(std::size_t at) {
    Tag tag;
    tag.at = at;
    at_ = at + 1;
    if (current() == '/')
      tag.name += bytes_[at_++];
    tag.name += word(at);
    for (;;) {
      blanks();
      if (current() == '>' || (current() == '/' && bytes_.substr(at_).starts_with("/>"))) {
        tag.empty = current() == '/';
        at_ += tag.empty ? 2 : 1;
        tag.end = at_;
        return tag;
      }
      const std::string name = word(at);
      blanks();
      if (current() != '=')
        fail(at, "attribute " + quoted(name) + " without a value");
      ++at_;
      blanks();
      const char quote = current();
      if (quote != '"' && quote != '\'')
        fail(at, "attribute " + quoted(name) + " without quotes");
      const std::size_t end = bytes_.find(quote, at_ + 1);
      if (end == std::string_view::npos || end - at_ > longest)
        fail(at, "the value of " + quoted(name) + " does not end");
      if (!tag.attributes.emplace(name, bytes_.substr(at_ + 1, end - at_ - 1)).second)
        fail(at, "a second attribute " + quoted(name) + ", expected one");
      at_ = end + 1;
    }
  }

  char current() const { return at_ < bytes_.size() ? bytes_[at_] : '\0'; }
  void blanks() {
    while (at_ < bytes_.size() && is_blank(bytes_[at_]))
      ++at_;
  }
  std::string word(std::size_t tag) {
    const std::size_t begin = at_;
    while (at_ < bytes_.size() && is_name(bytes_[at_]) && at_ - begin <= longest)
      ++at_;
    if (at_ == begin || at_ - begin > longest || at_ == bytes_.size())
      fail(tag, "a tag that does not end, expected XML");
    return std::string(bytes_.substr(begin, at_ - begin));
  }

  static constexpr std::size_t longest = 4096;
  std::string_view bytes_;
  const std::string& name_;
  std::size_t at_ = 0;
};

} // namespace

class PieceReader {
public:
  PieceReader(Piece& piece, const char* type, std::initializer_list<std::string_view> sections)
      : piece_(piece), bytes_(piece.bytes_), name_(piece.name_), type_(type), sections_(sections),
        tags_(bytes_, name_) {}

  void read() {
    read_tags();
    const std::size_t end = bytes_.find_last_not_of(" \t\r\n\v\f");
    if (!bytes_.substr(0, end + 1).ends_with("</VTKFile>"))
      throw Error(name_, "the file does not end with </VTKFile>, expected that");
    if (!has_piece_)
      throw Error(name_, "no Piece, expected one");
    for (const auto& [name, count] : piece_.counts_)
      if (count >= UINT32_MAX)
        throw Error(name_, name + " is " + std::to_string(count) + ", expected less than " +
                               std::to_string(UINT32_MAX));
  }

private:
  void read_tags() {
    std::vector<std::string> path;
    bool has_file = false;
    while (std::optional<Tag> tag = tags_.next()) {
      if (tag->name.starts_with('/')) {
        if (path.empty() || path.back() != tag->name.substr(1))
          tags_.fail(tag->at, quoted("<" + tag->name + ">") + ", expected " +
                                  (path.empty() ? "no end" : "the end of " + path.back()));
        if (path.back() == "DataArray")
          array_ = nullptr;
        path.pop_back();
        if (!path.empty() && path.back() == "DataArray")
          take_text(*tag);
        continue;
      }
      if (!has_file) {
        read_file(*tag);
        has_file = true;
      } else if (path.empty()) {
        tags_.fail(tag->at, "a second element, expected one, VTKFile");
      } else {
        read_tag(*tag, path.back());
      }
      if (tag->name == "AppendedData") {
        read_appended(*tag);
        return;
      }
      if (!tag->empty) {
        if (path.size() >= 32)
          tags_.fail(tag->at, "over 32 elements in one another, expected fewer");
        path.push_back(tag->name);
      } else if (tag->name == "DataArray") {
        array_ = nullptr;
      }
      if (!path.empty() && path.back() == "DataArray")
        take_text(*tag);
    }
    if (!has_file || !path.empty())
      throw Error(name_, "the file ends within XML, expected </VTKFile>");
  }

  static std::string attribute(const Tag& tag, std::string_view name, const char* otherwise = "") {
    const auto at = tag.attributes.find(name);
    return at == tag.attributes.end() ? otherwise : at->second;
  }

  std::uint64_t number(const Tag& tag, std::string_view name, std::uint64_t otherwise) const {
    const auto at = tag.attributes.find(name);
    if (at == tag.attributes.end())
      return otherwise;
    std::uint64_t value = 0;
    const char* const end = at->second.data() + at->second.size();
    const auto [stop, error] = std::from_chars(at->second.data(), end, value);
    if (error != std::errc() || stop != end)
      tags_.fail(tag.at,
                 std::string(name) + " is " + quoted(at->second) + ", expected an integer from 0");
    return value;
  }

  void read_file(const Tag& tag) {
    if (tag.name != "VTKFile" || attribute(tag, "type") != type_)
      tags_.fail(tag.at, "expected <VTKFile type=\"" + type_ + "\">");
    const std::string order = attribute(tag, "byte_order", "LittleEndian"),
                      header = attribute(tag, "header_type", "UInt32"),
                      compressor = attribute(tag, "compressor");
    if (order != "LittleEndian" && order != "BigEndian")
      tags_.fail(tag.at, "byte_order " + quoted(order) + ", expected LittleEndian or BigEndian");
    if (header != "UInt32" && header != "UInt64")
      tags_.fail(tag.at, "header_type " + quoted(header) + ", expected UInt32 or UInt64");
    if (!compressor.empty() && compressor != "vtkZLibDataCompressor")
      tags_.fail(tag.at, "data packed by " + quoted(compressor) +
                             ", expected vtkZLibDataCompressor or none");
    piece_.encoding_.big_endian = order == "BigEndian";
    piece_.encoding_.wide_header = header == "UInt64";
    piece_.encoding_.zlib = !compressor.empty();
  }

  void read_tag(const Tag& tag, const std::string& parent) {
    if (tag.name == "Piece") {
      if (has_piece_)
        tags_.fail(tag.at, "a second Piece, expected one");
      has_piece_ = true;
      for (const auto& [name, value] : tag.attributes)
        if (name.starts_with("NumberOf"))
          piece_.counts_.emplace(name, number(tag, name, 0));
    } else if (tag.name == "PointData" || tag.name == "CellData") {
      for (const auto& [what, array] : tag.attributes)
        piece_.active_.emplace(tag.name + "/" + what, array);
    } else if (tag.name == "DataArray" && std::ranges::find(sections_, parent) != sections_.end()) {
      Array array;
      array.name = attribute(tag, "Name");
      array.type = attribute(tag, "type");
      array.format = attribute(tag, "format", "ascii");
      array.components = number(tag, "NumberOfComponents", 1);
      array.offset = number(tag, "offset", 0);
      array.at = tag.at;
      // The first of a name; points have any.
      const std::string key = parent == "Points" ? parent : parent + "/" + array.name;
      const auto [at, fresh] = piece_.arrays_.emplace(key, std::move(array));
      array_ = fresh ? &at->second : nullptr;
    }
  }

  /// The text behind a tag is the array's, if it is the first there.
  void take_text(const Tag& tag) {
    if (array_ == nullptr || !array_->text.empty())
      return;
    const std::size_t end = std::min(bytes_.find('<', tag.end), bytes_.size());
    const std::string_view text = bytes_.substr(tag.end, end - tag.end);
    if (text.find_first_not_of(" \t\r\n\v\f") != std::string_view::npos)
      array_->text = text;
  }

  void read_appended(const Tag& tag) {
    const std::string encoding = attribute(tag, "encoding", "base64");
    if (encoding != "raw" && encoding != "base64")
      tags_.fail(tag.at, "appended data in " + quoted(encoding) + ", expected raw or base64");
    const std::size_t mark = bytes_.find_first_not_of(" \t\r\n\v\f", tag.end);
    if (mark == std::string_view::npos || bytes_[mark] != '_')
      tags_.fail(tag.at, "appended data without an underscore before it, expected that");
    piece_.encoding_.appended_base64 = encoding == "base64";
    piece_.encoding_.appended = bytes_.substr(mark + 1);
  }

  Piece& piece_;
  std::string_view bytes_;
  const std::string& name_;
  std::string type_;
  std::vector<std::string_view> sections_;
  Tags tags_;
  Array* array_ = nullptr; // the one that we are in
  bool has_piece_ = false;
};

Piece::Piece(std::string_view bytes, const std::string& name, const char* type,
             std::initializer_list<std::string_view> sections)
    : bytes_(bytes), name_(name) {
  PieceReader(*this, type, sections).read();
}

std::uint64_t Piece::count(std::string_view attribute) const {
  const auto at = counts_.find(attribute);
  return at == counts_.end() ? 0 : at->second;
}

std::string Piece::active(const std::string& section, const std::string& what) const {
  const auto at = active_.find(section + "/" + what);
  return at == active_.end() ? "" : at->second;
}

const Array* Piece::find(const std::string& key) const {
  const auto at = arrays_.find(key);
  return at == arrays_.end() ? nullptr : &at->second;
}

const Array& Piece::need(const std::string& key) const {
  const Array* const array = find(key);
  if (array == nullptr)
    throw Error(name_, "no DataArray " + key + ", expected one");
  return *array;
}

std::string Piece::place(const Array& array) const {
  const std::string_view before = bytes_.substr(0, array.at);
  return name_ + ":" + std::to_string(1 + std::ranges::count(before, '\n'));
}

std::vector<Vec3> Piece::points() const {
  const Array& array = need("Points");
  if (array.components != 3)
    throw Error(place(array),
                "points of " + std::to_string(array.components) + " components, expected 3");
  const std::uint64_t count = this->count("NumberOfPoints");
  const std::vector<double> numbers = reals(array, 3 * count);
  std::vector<Vec3> points;
  points.reserve(count);
  for (std::size_t p = 0; p < count; ++p)
    points.push_back({numbers[3 * p], numbers[3 * p + 1], numbers[3 * p + 2]});
  return points;
}

std::vector<std::int64_t> Piece::integers(const Array& array, std::uint64_t count) const {
  return vtk::integers(array, encoding_, count, place(array));
}

std::vector<double> Piece::reals(const Array& array, std::uint64_t count) const {
  return vtk::reals(array, encoding_, count, place(array));
}

Cells Piece::cells(const std::string& section, std::uint64_t count) const {
  const Array &ends = need(section + "/offsets"), &nodes = need(section + "/connectivity");
  Cells cells{integers(ends, count), {}};
  std::int64_t last = 0;
  for (std::size_t c = 0; c < count; ++c) {
    if (cells.ends[c] < last || cells.ends[c] > std::int64_t{1} << 36U)
      throw Error(place(ends), "offset " + std::to_string(cells.ends[c]) + " of cell " +
                                   std::to_string(c) + ", expected " + std::to_string(last) +
                                   " or more");
    last = cells.ends[c];
  }
  cells.nodes = integers(nodes, static_cast<std::uint64_t>(last));
  return cells;
}

} // namespace gewebe::formats::vtk
