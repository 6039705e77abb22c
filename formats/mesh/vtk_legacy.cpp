#include "formats/mesh/vtk_legacy.h"

#include "base/error.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <utility>
// Based on: VTK file formats, docs.vtk.org, "Simple legacy formats".

namespace gewebe::formats::vtk {
namespace {

static_assert(std::endian::native == std::endian::little, "binary files are big-endian");

enum class Type {
  integer8,
  natural8,
  integer16,
  natural16,
  integer32,
  natural32,
  integer64,
  natural64,
  real32,
  real64
};

struct TypeName {
  std::string_view name;
  Type type;
};
constexpr std::array<TypeName, 13> type_names{{{"char", Type::integer8},
                                               {"unsigned_char", Type::natural8},
                                               {"short", Type::integer16},
                                               {"unsigned_short", Type::natural16},
                                               {"int", Type::integer32},
                                               {"unsigned_int", Type::natural32},
                                               {"vtkidtype", Type::integer32},
                                               {"long", Type::integer64},
                                               {"unsigned_long", Type::natural64},
                                               {"vtktypeint64", Type::integer64},
                                               {"vtktypeuint64", Type::natural64},
                                               {"float", Type::real32},
                                               {"double", Type::real64}}};

std::size_t bytes_of(Type type) {
  constexpr std::array<std::size_t, 10> sizes{1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
  return sizes[static_cast<std::size_t>(type)];
}

bool is_real(Type type) {
  return type == Type::real32 || type == Type::real64;
}

std::string lower(std::string_view word) {
  std::string text(word);
  for (char& c : text)
    c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return text;
}

bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\n' || c == '\r';
}

/// A number in big-endian bytes.
template <class T>
T big_endian(const char* from) {
  std::array<char, sizeof(T)> turned{};
  std::reverse_copy(from, from + sizeof(T), turned.begin());
  T value{};
  std::memcpy(&value, turned.data(), sizeof value);
  return value;
}

class Reader {
public:
  Reader(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name) {}

  Legacy read() {
    read_head();
    while (true) {
      const std::string keyword = lower(word());
      if (keyword.empty())
        break;
      read_section(keyword);
    }
    if (legacy_.points.empty())
      fail("the file ends without POINTS, expected them");
    if (legacy_.grid && !has_cells_)
      fail("the file ends without CELLS, expected them");
    if (legacy_.grid && legacy_.types.size() != legacy_.cells.size())
      fail(std::to_string(legacy_.types.size()) + " CELL_TYPES, expected " +
           std::to_string(legacy_.cells.size()));
    const std::size_t all = cell_count();
    for (const auto* const array : {&legacy_.material, &legacy_.part})
      if (!array->empty() && array->size() != all)
        fail("data of " + std::to_string(array->size()) + " cells, expected " +
             std::to_string(all));
    return std::move(legacy_);
  }

private:
  [[noreturn]] void fail(const std::string& what) const {
    if (binary_)
      throw Error(name_, "byte " + std::to_string(at_) + ": " + what);
    const auto end = bytes_.begin() + static_cast<std::ptrdiff_t>(last_);
    throw Error(name_ + ":" + std::to_string(1 + std::count(bytes_.begin(), end, '\n')), what);
  }

  std::size_t left() const { return bytes_.size() - at_; }
  std::size_t cell_count() const {
    return legacy_.points_and_lines + legacy_.cells.size() + legacy_.strips.size();
  }

  std::string_view line() {
    last_ = at_;
    const std::size_t end = std::min(bytes_.find('\n', at_), bytes_.size());
    std::string_view text = bytes_.substr(at_, end - at_);
    at_ = std::min(end + 1, bytes_.size());
    if (text.ends_with('\r'))
      text.remove_suffix(1);
    return text;
  }

  std::string_view word() {
    while (at_ < bytes_.size() && is_blank(bytes_[at_]))
      ++at_;
    last_ = at_;
    while (at_ < bytes_.size() && !is_blank(bytes_[at_]))
      ++at_;
    return bytes_.substr(last_, at_ - last_);
  }

  /// The next word of this line, "" at its end.
  std::string_view word_of_line() {
    std::size_t at = at_;
    while (at < bytes_.size() && (bytes_[at] == ' ' || bytes_[at] == '\t' || bytes_[at] == '\r'))
      ++at;
    return at < bytes_.size() && bytes_[at] != '\n' ? word() : std::string_view();
  }

  std::uint64_t count_of(std::string_view text, const char* what) {
    std::uint64_t value = 0;
    const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (text.empty() || status != std::errc() || end != text.data() + text.size())
      fail("'" + std::string(text.substr(0, 40)) + "', expected " + what);
    return value;
  }
  std::uint64_t count(const char* what) { return count_of(word(), what); }

  Type type() {
    const std::string_view text = word();
    const std::string wanted = lower(text);
    const auto* const found = std::ranges::find(type_names, wanted, &TypeName::name);
    if (found == type_names.end())
      fail("numbers of type '" + std::string(text.substr(0, 40)) +
           "', expected int, float, double or another type of numbers");
    return found->type;
  }

  /// \throw Error unless `count` numbers may follow
  void require(std::uint64_t count, Type type) {
    const std::size_t each = binary_ ? bytes_of(type) : 2;
    if (count > left() / each + 1)
      fail(std::to_string(count) + " numbers, expected at most those that fit in the file's " +
           std::to_string(left()) + " last bytes");
  }

  /// Calls take(number as the largest type of its kind) for each of the numbers that follow.
  template <class Take>
  void numbers(std::uint64_t count, Type type, const Take& take) {
    require(count, type);
    if (!binary_) {
      for (std::uint64_t n = 0; n < count; ++n)
        is_real(type) ? take(real_of(word())) : take(static_cast<double>(integer_of(word())));
      return;
    }
    if (at_ < bytes_.size() && bytes_[at_] == '\r')
      ++at_;
    if (at_ < bytes_.size() && bytes_[at_] == '\n')
      ++at_;
    if (count * bytes_of(type) > left())
      fail("the file ends within " + std::to_string(count) + " numbers");
    for (std::uint64_t n = 0; n < count; ++n, at_ += bytes_of(type))
      take(number_at(type));
  }

  double number_at(Type type) {
    const char* const from = bytes_.data() + at_;
    switch (type) {
    case Type::integer8:
      return static_cast<double>(static_cast<signed char>(*from));
    case Type::natural8:
      return static_cast<double>(static_cast<unsigned char>(*from));
    case Type::integer16:
      return static_cast<double>(big_endian<std::int16_t>(from));
    case Type::natural16:
      return static_cast<double>(big_endian<std::uint16_t>(from));
    case Type::integer32:
      return static_cast<double>(big_endian<std::int32_t>(from));
    case Type::natural32:
      return static_cast<double>(big_endian<std::uint32_t>(from));
    case Type::integer64:
      return static_cast<double>(big_endian<std::int64_t>(from));
    case Type::natural64:
      return static_cast<double>(big_endian<std::uint64_t>(from));
    case Type::real32:
      return static_cast<double>(big_endian<float>(from));
    case Type::real64:
      return big_endian<double>(from);
    }
    return 0;
  }

  double real_of(std::string_view text) {
    double value = 0;
    const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (text.empty() || status != std::errc() || end != text.data() + text.size())
      fail("'" + std::string(text.substr(0, 40)) + "', expected a number");
    return value;
  }
  std::int64_t integer_of(std::string_view text) {
    std::int64_t value = 0;
    const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (text.empty() || status != std::errc() || end != text.data() + text.size())
      fail("'" + std::string(text.substr(0, 40)) + "', expected an integer");
    return value;
  }

  std::vector<std::int64_t> integers(std::uint64_t count, Type type) {
    std::vector<std::int64_t> values;
    require(count, type);
    values.reserve(count);
    numbers(count, type, [&](double value) {
      // Beyond 2^53 no number of a point or a material is valid.
      if (!(std::fabs(value) <= 9007199254740992.0) || value != std::floor(value))
        fail("a number that is no integer up to 2^53, expected one");
      values.push_back(static_cast<std::int64_t>(value));
    });
    return values;
  }

  void skip(std::uint64_t count, Type type) {
    numbers(count, type, [](double) {});
  }

  void read_head() {
    if (!line().starts_with("# vtk DataFile Version"))
      fail("no legacy file of VTK, expected '# vtk DataFile Version'");
    (void)line(); // a title
    const std::string coding = lower(word());
    if (coding != "ascii" && coding != "binary")
      fail("'" + coding.substr(0, 40) + "', expected ASCII or BINARY");
    if (lower(word()) != "dataset")
      fail("expected DATASET");
    const std::string dataset = lower(word());
    if (dataset != "polydata" && dataset != "unstructured_grid")
      fail("a dataset " + dataset.substr(0, 40) + ", expected POLYDATA or UNSTRUCTURED_GRID");
    legacy_.grid = dataset == "unstructured_grid";
    binary_ = coding == "binary";
  }

  void read_section(const std::string& keyword) {
    if (keyword == "points")
      return read_points();
    if (keyword == "metadata")
      return skip_metadata();
    if (keyword == "field")
      return read_field();
    if (keyword == "cell_data" || keyword == "point_data") {
      of_cells_ = keyword == "cell_data";
      tuples_ = count("the number of tuples");
      const std::size_t expected = of_cells_ ? cell_count() : legacy_.points.size();
      if (tuples_ != expected)
        fail(std::to_string(tuples_) + " tuples, expected " + std::to_string(expected));
      return;
    }
    if (legacy_.grid && keyword == "cells") {
      has_cells_ = true;
      return read_cells(legacy_.cells);
    }
    if (legacy_.grid && keyword == "cell_types") {
      legacy_.types = integers(count("the number of types"), Type::integer32);
      return;
    }
    if (!legacy_.grid && keyword == "polygons")
      return read_cells(legacy_.cells);
    if (!legacy_.grid && keyword == "triangle_strips")
      return read_cells(legacy_.strips);
    if (!legacy_.grid && (keyword == "vertices" || keyword == "lines")) {
      LegacyCells unused;
      read_cells(unused);
      legacy_.points_and_lines += unused.size();
      return;
    }
    read_attribute(keyword);
  }

  void read_points() {
    if (!legacy_.points.empty())
      fail("a second section POINTS, expected one");
    const std::uint64_t n = count("the number of points");
    const Type of = type();
    if (n > left() / 3)
      fail(std::to_string(n) + " points, expected at most those that fit in the file");
    std::vector<double> places;
    places.reserve(3 * n);
    numbers(3 * n, is_real(of) || binary_ ? of : Type::real64, [&](double value) {
      if (!std::isfinite(value))
        fail("a coordinate that is not finite");
      places.push_back(value);
    });
    for (std::size_t p = 0; p < n; ++p)
      legacy_.points.push_back({places[3 * p], places[3 * p + 1], places[3 * p + 2]});
  }

  /// Before version 5 each cell has its size before its points; then OFFSETS and CONNECTIVITY.
  void read_cells(LegacyCells& cells) {
    if (!cells.ends.empty())
      fail("a second section of the same cells, expected one");
    const std::uint64_t rows = count("the number of cells"), all = count("the number of integers");
    const std::size_t back = at_, last = last_;
    if (lower(word()) == "offsets")
      return read_offsets(cells, rows, all);
    at_ = back;
    last_ = last;
    const std::vector<std::int64_t> list = integers(all, Type::integer32);
    std::size_t at = 0;
    for (std::uint64_t c = 0; c < rows; ++c) {
      if (at >= list.size() || list[at] < 0 ||
          static_cast<std::uint64_t>(list[at]) > list.size() - at - 1)
        fail("cell " + std::to_string(c) + " goes beyond the section's " + std::to_string(all) +
             " integers");
      const auto size = static_cast<std::size_t>(list[at]);
      const auto from = list.begin() + static_cast<std::ptrdiff_t>(at) + 1;
      cells.nodes.insert(cells.nodes.end(), from, from + static_cast<std::ptrdiff_t>(size));
      cells.ends.push_back(cells.nodes.size());
      at += size + 1;
    }
    if (at != list.size())
      fail("the cells have " + std::to_string(at) + " integers, expected " + std::to_string(all));
  }

  void read_offsets(LegacyCells& cells, std::uint64_t rows, std::uint64_t all) {
    const std::vector<std::int64_t> offsets = integers(rows, type());
    if (lower(word()) != "connectivity")
      fail("expected CONNECTIVITY");
    cells.nodes = integers(all, type());
    if (rows == 0)
      return;
    for (std::size_t c = 0; c < rows; ++c)
      if (offsets[c] < (c == 0 ? 0 : offsets[c - 1]) ||
          static_cast<std::uint64_t>(offsets[c]) > all || (c == 0 && offsets[c] != 0))
        fail("offset " + std::to_string(offsets[c]) + " of cell " + std::to_string(c) +
             ", expected ascending ones from 0 to " + std::to_string(all));
    for (std::size_t c = 1; c < rows; ++c)
      cells.ends.push_back(static_cast<std::uint64_t>(offsets[c]));
    if (static_cast<std::uint64_t>(offsets.back()) != all)
      fail("the last offset is " + std::to_string(offsets.back()) + ", expected " +
           std::to_string(all));
  }

  /// Information about arrays, up to an empty line.
  void skip_metadata() {
    (void)line();
    while (at_ < bytes_.size() && !line().empty()) {
    }
  }

  /// Where an array of cells goes, or nullptr.
  std::vector<std::int64_t>* wanted(std::string_view name, std::uint64_t components) {
    if (!of_cells_ || components != 1)
      return nullptr;
    return name == "material" ? &legacy_.material : name == "part" ? &legacy_.part : nullptr;
  }

  void take(std::vector<std::int64_t>* to, std::uint64_t count, Type type) {
    if (to == nullptr)
      return skip(count, type);
    if (!to->empty())
      fail("two arrays of that name, expected one");
    *to = integers(count, type);
  }

  /// Arrays of any sizes.
  void read_field() {
    (void)word();
    const std::uint64_t arrays = count("the number of arrays");
    for (std::uint64_t a = 0; a < arrays; ++a) {
      std::string_view name = word();
      if (lower(name) == "metadata") {
        skip_metadata();
        name = word();
      }
      const std::uint64_t components = count("the number of components"),
                          tuples = count("the number of tuples");
      const Type of = type();
      if (components > 0 && tuples > bytes_.size() / components)
        fail("an array of " + std::to_string(tuples) + " tuples, expected one that fits the file");
      take(tuples == tuples_ ? wanted(name, components) : nullptr, components * tuples, of);
    }
  }

  void read_attribute(const std::string& keyword) {
    if (tuples_ == 0 && keyword != "lookup_table")
      fail("'" + keyword.substr(0, 40) + "', expected a keyword of this dataset");
    const auto skip_each = [&](std::uint64_t each, Type type) { skip(each * tuples_, type); };
    const std::string name(word());
    if (keyword == "scalars") {
      const Type of = type();
      const std::string_view more = word_of_line();
      const std::uint64_t components = more.empty() ? 1 : count_of(more, "components");
      if (components < 1 || components > 4)
        fail(std::to_string(components) + " components, expected 1 to 4");
      if (lower(word()) != "lookup_table")
        fail("no LOOKUP_TABLE of SCALARS, expected one, such as default");
      (void)word();
      return take(wanted(name, components), components * tuples_, of);
    }
    if (keyword == "lookup_table")
      return skip(4 * checked(count("the size of the table")),
                  binary_ ? Type::natural8 : Type::real64);
    if (keyword == "color_scalars")
      return skip_each(checked(count("components")), binary_ ? Type::natural8 : Type::real64);
    if (keyword == "vectors" || keyword == "normals")
      return skip_each(3, type());
    if (keyword == "tensors")
      return skip_each(9, type());
    if (keyword == "tensors6")
      return skip_each(6, type());
    if (keyword == "global_ids" || keyword == "pedigree_ids" || keyword == "edge_flags")
      return skip_each(1, type());
    if (keyword == "texture_coordinates") {
      const std::uint64_t each = checked(count("the dimension"));
      return skip_each(each, type());
    }
    fail("'" + keyword.substr(0, 40) + "', expected a keyword of VTK's legacy files");
  }

  std::uint64_t checked(std::uint64_t each) {
    if (each > left())
      fail(std::to_string(each) + " numbers, expected at most those that fit in the file");
    return each;
  }

  std::string_view bytes_;
  const std::string& name_;
  std::size_t at_ = 0, last_ = 0;
  bool binary_ = false, of_cells_ = false, has_cells_ = false;
  std::uint64_t tuples_ = 0;
  Legacy legacy_;
};

} // namespace

Legacy read_legacy(std::string_view bytes, const std::string& name) {
  return Reader(bytes, name).read();
}

bool is_legacy_grid(std::string_view first_bytes) {
  if (!first_bytes.starts_with("# vtk DataFile Version"))
    return false;
  const std::string text = lower(first_bytes.substr(0, 1024));
  const std::size_t at = text.find("\ndataset");
  return at != std::string::npos && text.find("unstructured_grid", at) < at + 40;
}

} // namespace gewebe::formats::vtk
