#include "formats/tetrahedra/tet_file_internal.h"
#include "formats/tetrahedra/vtu_array_internal.h"

#include <algorithm>
#include <map>
#include <optional>
// Based on: VTK file formats, docs.vtk.org, "XML file formats"; types of cells: vtkCellType.h.

namespace gewebe::tet {
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

constexpr int linear = 10, quadratic = 24;

/// Points, lines, triangles, polygons: passed over.
bool is_lower(std::int64_t type) {
  constexpr std::array<std::int64_t, 18> types{0, 1,  2,  3,  4,  5,  6,  7,  8,
                                               9, 21, 22, 23, 28, 30, 34, 35, 36};
  return std::ranges::find(types, type) != types.end();
}

std::string refused_name(std::int64_t type) {
  switch (type) {
  case 11:
    return "voxels";
  case 12:
  case 25:
  case 29:
  case 33:
  case 72:
  case 79:
    return "hexahedra";
  case 13:
  case 26:
  case 31:
  case 32:
  case 73:
  case 80:
    return "wedges";
  case 14:
  case 27:
  case 37:
  case 74:
  case 81:
    return "pyramids";
  case 42:
    return "polyhedra";
  case 71:
  case 78:
    return "tetrahedra of any order";
  default:
    return "cells of type " + std::to_string(type);
  }
}

class VtuReader {
public:
  VtuReader(std::string_view bytes, const std::string& name, TetReadStats& stats)
      : bytes_(bytes), name_(name), stats_(stats), tags_(bytes, name) {}

  TetMesh read() {
    read_tags();
    const std::size_t end = bytes_.find_last_not_of(" \t\r\n\v\f");
    if (!bytes_.substr(0, end + 1).ends_with("</VTKFile>"))
      throw Error(name_, "the file does not end with </VTKFile>, expected that");
    if (!has_piece_)
      throw Error(name_, "no Piece, expected one");
    if (point_count_ >= UINT32_MAX || cell_count_ >= UINT32_MAX)
      throw Error(name_, std::to_string(point_count_) + " points and " +
                             std::to_string(cell_count_) + " cells, expected fewer than " +
                             std::to_string(UINT32_MAX));
    read_points();
    read_cells();
    return std::move(result_.mesh);
  }

private:
  // ---- The tree

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
    if (tag.name != "VTKFile" || attribute(tag, "type") != "UnstructuredGrid")
      tags_.fail(tag.at, "expected <VTKFile type=\"UnstructuredGrid\">");
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
    encoding_.big_endian = order == "BigEndian";
    encoding_.wide_header = header == "UInt64";
    encoding_.zlib = !compressor.empty();
  }

  void read_tag(const Tag& tag, const std::string& parent) {
    if (tag.name == "Piece") {
      if (has_piece_)
        tags_.fail(tag.at, "a second Piece, expected one");
      has_piece_ = true;
      point_count_ = number(tag, "NumberOfPoints", 0);
      cell_count_ = number(tag, "NumberOfCells", 0);
    } else if (tag.name == "DataArray" &&
               (parent == "Points" || parent == "Cells" || parent == "CellData")) {
      VtuArray array;
      array.name = attribute(tag, "Name");
      array.type = attribute(tag, "type");
      array.format = attribute(tag, "format", "ascii");
      array.components = number(tag, "NumberOfComponents", 1);
      array.offset = number(tag, "offset", 0);
      array.at = tag.at;
      // The first of a name; points have any.
      const std::string key = parent == "Points" ? parent : parent + "/" + array.name;
      const auto [at, fresh] = arrays_.emplace(key, std::move(array));
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
    encoding_.appended_base64 = encoding == "base64";
    encoding_.appended = bytes_.substr(mark + 1);
  }

  // ---- The numbers

  const VtuArray& need(const std::string& key) const {
    const auto at = arrays_.find(key);
    if (at == arrays_.end())
      throw Error(name_, "no DataArray " + key + ", expected one");
    return at->second;
  }
  std::string place(const VtuArray& array) const {
    const std::string_view before = bytes_.substr(0, array.at);
    return name_ + ":" + std::to_string(1 + std::ranges::count(before, '\n'));
  }

  void read_points() {
    const VtuArray& array = need("Points");
    if (array.components != 3)
      throw Error(place(array),
                  "points of " + std::to_string(array.components) + " components, expected 3");
    const std::vector<double> numbers = vtu_reals(array, encoding_, 3 * point_count_, place(array));
    std::vector<Vec3>& points = result_.mesh.points;
    points.reserve(point_count_);
    for (std::size_t p = 0; p < point_count_; ++p)
      points.push_back({numbers[3 * p], numbers[3 * p + 1], numbers[3 * p + 2]});
  }

  std::vector<std::int64_t> integers(const VtuArray& array, std::uint64_t count) const {
    return vtu_integers(array, encoding_, count, place(array));
  }

  /// By our name, or those that meshio gives to Gmsh's and Medit's.
  const VtuArray* material() const {
    for (const char* const name : {"material", "gmsh:physical", "medit:ref"})
      if (const auto at = arrays_.find(std::string("CellData/") + name); at != arrays_.end()) {
        if (at->second.components != 1)
          throw Error(place(at->second), "materials of " + std::to_string(at->second.components) +
                                             " components, expected 1");
        return &at->second;
      }
    return nullptr;
  }

  void read_cells() {
    const VtuArray &offsets_array = need("Cells/offsets"), &types_array = need("Cells/types"),
                   &nodes_array = need("Cells/connectivity");
    const std::vector<std::int64_t> types = integers(types_array, cell_count_),
                                    offsets = integers(offsets_array, cell_count_);
    std::int64_t last = 0;
    for (std::size_t c = 0; c < cell_count_; ++c) {
      if (offsets[c] < last || offsets[c] > std::int64_t{1} << 36U)
        throw Error(place(offsets_array), "offset " + std::to_string(offsets[c]) + " of cell " +
                                              std::to_string(c) + ", expected " +
                                              std::to_string(last) + " or more");
      last = offsets[c];
    }
    const std::vector<std::int64_t> nodes = integers(nodes_array, static_cast<std::uint64_t>(last));
    const VtuArray* const material_array = material();
    std::vector<std::int64_t> materials;
    if (material_array != nullptr)
      materials = integers(*material_array, cell_count_);
    for (std::size_t c = 0; c < cell_count_; ++c) {
      const std::size_t begin = c == 0 ? 0 : static_cast<std::size_t>(offsets[c - 1]),
                        end = static_cast<std::size_t>(offsets[c]);
      if (is_lower(types[c])) {
        ++stats_.skipped_elements;
        continue;
      }
      if (types[c] != linear && types[c] != quadratic)
        throw Error(place(types_array),
                    refused_name(types[c]) + ", expected tetrahedra of 4 or 10 nodes");
      add(c, std::span(nodes).subspan(begin, end - begin), types[c],
          materials.empty() ? 0 : materials[c]);
    }
    if (material_array == nullptr)
      result_.mesh.material = {};
  }

  void add(std::size_t cell, std::span<const std::int64_t> nodes, std::int64_t type,
           std::int64_t material) {
    const auto fail = [&](const std::string& what) {
      throw Error(name_, "cell " + std::to_string(cell) + ": " + what);
    };
    const std::size_t size = type == linear ? 4 : 10;
    if (nodes.size() != size)
      fail(std::to_string(nodes.size()) + " nodes, expected " + std::to_string(size));
    std::array<std::uint32_t, 10> numbers{};
    for (std::size_t k = 0; k < size; ++k) {
      if (nodes[k] < 0 || static_cast<std::uint64_t>(nodes[k]) >= point_count_)
        fail("point " + std::to_string(nodes[k]) + ", expected 0 to below " +
             std::to_string(point_count_));
      numbers[k] = static_cast<std::uint32_t>(nodes[k]);
    }
    result_.add(std::span(numbers).first(size), material, fail);
  }

  std::string_view bytes_;
  const std::string& name_;
  TetReadStats& stats_;
  Tags tags_;
  Tetrahedra result_;
  VtuEncoding encoding_;
  std::map<std::string, VtuArray> arrays_; // "Points", "Cells/types", "CellData/material", …
  VtuArray* array_ = nullptr;              // the one that we are in
  std::uint64_t point_count_ = 0, cell_count_ = 0;
  bool has_piece_ = false;
};

} // namespace

TetMesh read_vtu(std::string_view bytes, const std::string& name, TetReadStats& stats) {
  return VtuReader(bytes, name, stats).read();
}

} // namespace gewebe::tet
