#include "formats/tetrahedra/tet_file_internal.h"
#include "text/limited_text.h"

#include <algorithm>
#include <cctype>
#include <map>
#include <optional>
#include <set>
// Based on: Abaqus Analysis User's Guide, "Input syntax rules", *NODE, *ELEMENT, *ELSET,
// *SOLID SECTION; ccx (dhondt.de) reads the same words.

namespace gewebe::formats::tet {
namespace {

/// Tetrahedra of 4 and of 10 nodes; C3D10's middles are those of VTK.
constexpr std::array<std::string_view, 3> linear{"C3D4", "C3D4H", "C3D4T"};
constexpr std::array<std::string_view, 8> quadratic{"C3D10",   "C3D10M", "C3D10H", "C3D10MH",
                                                    "C3D10HS", "C3D10I", "C3D10T", "C3D10MT"};
/// Lines, shells, membranes, masses: passed over. All begin with one of these.
constexpr std::array<std::string_view, 17> lower{"S3",  "S4",   "S6",   "S8",     "STRI", "SFM",
                                                 "M3D", "T2D",  "T3D",  "B31",    "B32",  "MASS",
                                                 "R3D", "CPS3", "CPS6", "SPRING", "DC2D"};

std::string upper(std::string_view word) {
  std::string text(word);
  for (char& c : text)
    c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return text;
}

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos)
    return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

/// The parts of a line between commas, without blanks; one that ends with a comma has no last one.
std::vector<std::string_view> parts_of(std::string_view line) {
  std::vector<std::string_view> parts;
  for (std::size_t from = 0; from < line.size();) {
    const std::size_t end = std::min(line.find(',', from), line.size());
    parts.push_back(trimmed(line.substr(from, end - from)));
    from = end + 1;
  }
  return parts;
}

/// "*ELEMENT, TYPE=C3D4, ELSET=liver".
struct Keyword {
  std::string name;
  std::map<std::string, std::string> values; ///< upper case, by name

  std::string value(const std::string& key) const {
    const auto found = values.find(key);
    return found == values.end() ? "" : found->second;
  }
};

/// A set of elements: numbers, ranges, and names of other sets.
struct ElementSet {
  std::vector<std::int64_t> numbers;
  std::vector<std::array<std::int64_t, 3>> ranges; ///< first, last, step
  std::vector<std::string> sets;
};

class InpReader {
public:
  InpReader(std::string_view bytes, const std::string& name, TetReadStats& stats)
      : bytes_(bytes), name_(name), stats_(stats) {}

  tetrahedra::TetMesh read() {
    while (const std::optional<std::string_view> line = next_line()) {
      if (line->starts_with('*'))
        begin(keyword_of(*line));
      else if (state_ != State::skip)
        add(*line);
    }
    require_whole_element();
    if (result_.mesh.tetrahedra.empty())
      throw Error(name_, "no tetrahedra, expected *ELEMENT, TYPE=C3D4 or C3D10");
    set_materials();
    return std::move(result_.mesh);
  }

private:
  enum class State { skip, nodes, elements, lower_elements, set };

  [[noreturn]] void fail(const std::string& what) const {
    throw Error(name_ + ":" + std::to_string(line_), what);
  }

  /// The next line that is no comment and not empty, without blanks at its ends.
  std::optional<std::string_view> next_line() {
    while (at_ < bytes_.size()) {
      const std::size_t end = std::min(bytes_.find('\n', at_), bytes_.size());
      const std::string_view line = trimmed(bytes_.substr(at_, end - at_));
      at_ = end + 1;
      ++line_;
      if (!line.empty() && !line.starts_with("**"))
        return line;
    }
    return std::nullopt;
  }

  /// A keyword whose line ends with a comma goes on in the next one.
  Keyword keyword_of(std::string_view line) {
    std::string whole(line.substr(1));
    while (whole.ends_with(',')) {
      const std::optional<std::string_view> more = next_line();
      if (!more)
        break;
      whole += *more;
    }
    Keyword keyword;
    for (const std::string_view part : parts_of(whole)) {
      if (keyword.name.empty()) {
        keyword.name = upper(part);
        continue;
      }
      const std::size_t mid = std::min(part.find('='), part.size());
      keyword.values[upper(trimmed(part.substr(0, mid)))] =
          mid < part.size() ? upper(trimmed(part.substr(mid + 1))) : "";
    }
    return keyword;
  }

  void begin(const Keyword& keyword) {
    require_whole_element();
    state_ = State::skip;
    const std::string& word = keyword.name;
    if ((word == "NODE" || word == "ELEMENT" || word == "ELSET") &&
        keyword.values.contains("INPUT"))
      fail("*" + word + " in another file, expected its lines here");
    if (word == "NODE") {
      if (keyword.values.contains("SYSTEM") && keyword.value("SYSTEM") != "R")
        fail("nodes in cylindrical or spherical coordinates, expected rectangular ones");
      state_ = State::nodes;
    } else if (word == "ELEMENT") {
      begin_elements(keyword);
    } else if (word == "ELSET") {
      set_ = keyword.value("ELSET");
      generate_ = keyword.values.contains("GENERATE");
      state_ = State::set;
    } else if (word == "SOLID SECTION") {
      add_section(keyword.value("ELSET"), keyword.value("MATERIAL"));
    } else if ((word == "INSTANCE" && ++instances_ > 1) || (word == "PART" && ++parts_ > 1)) {
      fail("a second *" + word + ", expected a mesh of one part");
    } else if (word == "INCLUDE" || word == "NGEN" || word == "NFILL" || word == "NCOPY" ||
               word == "ELGEN" || word == "ELCOPY") {
      fail("*" + word + ", expected nodes and elements line by line");
    }
  }

  void begin_elements(const Keyword& keyword) {
    const std::string type = keyword.value("TYPE");
    set_ = keyword.value("ELSET");
    const auto is = [&](const auto& names) {
      return std::ranges::find(names, type) != names.end();
    };
    size_ = is(linear) ? 4 : is(quadratic) ? 10 : 0;
    const auto begins = [&](std::string_view name) { return type.starts_with(name); };
    if (size_ == 0 && !std::ranges::any_of(lower, begins))
      fail("elements of type " + quoted(type) + ", expected C3D4 or C3D10");
    state_ = size_ == 0 ? State::lower_elements : State::elements;
    if (size_ > 0 && !set_.empty() && std::ranges::find(named_, set_) == named_.end())
      named_.push_back(set_);
    goes_on_ = false;
  }

  /// Without materials the set itself counts as one.
  void add_section(const std::string& set, const std::string& material) {
    if (!set.empty())
      sections_.emplace_back(set, material.empty() ? set : material);
  }

  void add(std::string_view line) {
    const std::vector<std::string_view> parts = parts_of(line);
    if (state_ == State::nodes)
      return add_node(parts);
    if (state_ == State::set)
      return add_to_set(parts);
    if (state_ == State::elements)
      return add_element(parts);
    stats_.skipped_elements += goes_on_ ? 0 : 1;
    goes_on_ = line.ends_with(',');
  }

  std::int64_t integer(std::string_view text, const char* what) const {
    std::int64_t value = 0;
    const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (text.empty() || status != std::errc() || end != text.data() + text.size())
      fail(quoted(text) + ", expected " + what);
    return value;
  }

  double coordinate(std::string_view text) const {
    if (text.starts_with('+'))
      text.remove_prefix(1);
    double value = 0;
    const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (text.empty() || status != std::errc() || end != text.data() + text.size() ||
        !std::isfinite(value))
      fail(quoted(text) + ", expected a coordinate, a finite number");
    return value;
  }

  void add_node(const std::vector<std::string_view>& parts) {
    if (parts.size() < 4)
      fail(std::to_string(parts.size()) + " numbers of a node, expected its number, x, y and z");
    const std::int64_t number = integer(parts[0], "the number of a node");
    if (!node_.try_emplace(number, static_cast<std::uint32_t>(node_.size())).second)
      fail("a second node " + std::to_string(number) + ", expected different numbers");
    result_.mesh.points.push_back(
        {coordinate(parts[1]), coordinate(parts[2]), coordinate(parts[3])});
  }

  void require_whole_element() const {
    if (!open_.empty())
      fail("an element of " + std::to_string(open_.size() - 1) + " nodes, expected " +
           std::to_string(size_));
  }

  /// Elements may go on in the next lines.
  void add_element(const std::vector<std::string_view>& parts) {
    for (const std::string_view part : parts)
      open_.push_back(integer(part, "the number of an element or a node"));
    if (open_.size() <= size_)
      return;
    if (open_.size() > size_ + 1)
      require_whole_element();
    std::array<std::uint32_t, 10> nodes{};
    for (std::size_t k = 0; k < size_; ++k) {
      const auto found = node_.find(open_[k + 1]);
      if (found == node_.end())
        fail("node " + std::to_string(open_[k + 1]) + ", expected one that *NODE defines before");
      nodes[k] = found->second;
    }
    if (!element_.try_emplace(open_[0], element_.size()).second)
      fail("a second element " + std::to_string(open_[0]) + ", expected different numbers");
    if (!set_.empty())
      sets_[set_].numbers.push_back(open_[0]);
    result_.add(std::span(nodes).first(size_), 0, [&](const std::string& what) { fail(what); });
    open_.clear();
  }

  void add_to_set(const std::vector<std::string_view>& parts) {
    ElementSet& set = sets_[set_];
    if (generate_) {
      if (parts.size() < 2)
        fail("*ELSET with GENERATE, expected first, last and step");
      const std::int64_t first = integer(parts[0], "an element"),
                         last = integer(parts[1], "an element"),
                         step = parts.size() > 2 ? integer(parts[2], "a step") : 1;
      if (step < 1 || first < 0 || last < first)
        fail("*ELSET with GENERATE, expected first, last and a step from 1");
      set.ranges.push_back({first, last, step});
      return;
    }
    for (const std::string_view part : parts)
      if (!part.empty() && part[0] >= '0' && part[0] <= '9')
        set.numbers.push_back(integer(part, "an element"));
      else if (!part.empty())
        set.sets.push_back(upper(part));
  }

  /// Gives a material to the elements of a set and of the sets in it.
  void mark(const std::string& name, std::int32_t material, int depth) {
    if (depth > 8)
      throw Error(name_, "sets of elements that nest more than 8 deep, expected fewer");
    const auto put = [&](std::int64_t element) {
      if (const auto found = element_.find(element); found != element_.end())
        result_.mesh.material[found->second] = material;
    };
    const auto found = sets_.find(name);
    if (found == sets_.end())
      return;
    std::ranges::for_each(found->second.numbers, put);
    for (const auto& [first, last, step] : found->second.ranges)
      for (auto it = element_.lower_bound(first); it != element_.end() && it->first <= last; ++it)
        if ((it->first - first) % step == 0)
          put(it->first);
    for (const std::string& inner : found->second.sets)
      mark(inner, material, depth + 1);
  }

  /// The N of a set MATERIAL-N, as we write it.
  std::optional<std::int32_t> own_number(const std::string& set) const {
    constexpr std::string_view begin = "MATERIAL-";
    std::int32_t number = 0;
    if (!set.starts_with(begin))
      return std::nullopt;
    const auto [end, status] =
        std::from_chars(set.data() + begin.size(), set.data() + set.size(), number);
    return status == std::errc() && end == set.data() + set.size() && number >= 0
               ? std::optional(number)
               : std::nullopt;
  }

  /// Those of sections of solids in their order, else of sets that lines *ELEMENT name.
  void set_materials() {
    if (sections_.empty())
      for (const std::string& set : named_)
        sections_.emplace_back(set, set);
    std::vector<std::string> materials;
    bool ours = !sections_.empty();
    for (const auto& [set, material] : sections_) {
      ours = ours && own_number(set);
      if (std::ranges::find(materials, material) == materials.end())
        materials.push_back(material);
    }
    for (const auto& [set, material] : sections_) {
      const auto place = std::ranges::find(materials, material) - materials.begin();
      mark(set, ours ? *own_number(set) : static_cast<std::int32_t>(place), 0);
    }
    if (!ours && materials.size() < 2)
      result_.mesh.material = {};
  }

  std::string_view bytes_;
  const std::string& name_;
  TetReadStats& stats_;
  std::size_t at_ = 0, line_ = 0, size_ = 0;
  State state_ = State::skip;
  bool generate_ = false, goes_on_ = false;
  int instances_ = 0, parts_ = 0;
  std::string set_;                                           ///< of the lines that follow
  std::vector<std::string> named_;                            ///< by lines *ELEMENT
  std::vector<std::pair<std::string, std::string>> sections_; ///< set and material
  std::map<std::string, ElementSet> sets_;
  std::vector<std::int64_t> open_; ///< an element that is not whole yet
  std::map<std::int64_t, std::uint32_t> node_;
  std::map<std::int64_t, std::size_t> element_;
  Tetrahedra result_;
};

} // namespace

tetrahedra::TetMesh read_inp(std::string_view bytes, const std::string& name, TetReadStats& stats) {
  return InpReader(bytes, name, stats).read();
}

namespace {

/// Abaqus and CalculiX read 20 characters of a number.
std::string number(double value) {
  constexpr std::size_t most = 20;
  return gewebe::text::limited_text(value, most);
}

} // namespace

void write_inp(const tetrahedra::TetMesh& mesh, const Sink& sink) {
  Pieces out(sink);
  out << "*HEADING\ngewebe_tetmesh, millimetres\n*NODE, NSET=NALL\n";
  for (std::size_t p = 0; p < mesh.points.size(); ++p)
    out << p + 1 << ", " << number(mesh.points[p].x) << ", " << number(mesh.points[p].y) << ", "
        << number(mesh.points[p].z) << "\n";
  out << (mesh.middles.empty() ? "*ELEMENT, TYPE=C3D4, ELSET=EALL\n"
                               : "*ELEMENT, TYPE=C3D10, ELSET=EALL\n");
  std::map<std::int32_t, std::vector<std::size_t>> elements_of;
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
    out << t + 1;
    const TetNodes nodes(mesh, t);
    for (const std::uint32_t node : nodes.in_order())
      out << ", " << std::uint64_t{node} + 1;
    out << "\n";
    if (!mesh.material.empty())
      elements_of[mesh.material[t]].push_back(t + 1);
  }
  constexpr std::size_t most = 16; // numbers in a line
  for (const auto& [material, elements] : elements_of) {
    out << "*ELSET, ELSET=MATERIAL-" << material << "\n";
    for (std::size_t n = 0; n < elements.size(); ++n)
      out << elements[n] << (n + 1 == elements.size() || n % most == most - 1 ? "\n" : ", ");
  }
  for (const auto& [material, elements] : elements_of)
    out << "*SOLID SECTION, ELSET=MATERIAL-" << material << ", MATERIAL=MATERIAL-" << material
        << "\n";
  out.flush();
}

} // namespace gewebe::formats::tet
