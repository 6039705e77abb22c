#include "base/error.h"
#include "base/parallel.h"
#include "formats/model/ela.h"
#include "formats/model/ela_internal.h"
#include "formats/model/ela_reader_internal.h"
#include "model/check.h"

#include <algorithm>
#include <array>
#include <initializer_list>
#include <optional>
#include <utility>
#include <vector>

namespace gewebe::formats {

namespace {

Vec3 vector(Reader& in, const char* what) {
  Vec3 v;
  v.x = in.number<double>(what);
  v.y = in.number<double>(what);
  v.z = in.number<double>(what);
  return v;
}

template <std::size_t n>
std::array<std::uint32_t, n> corners(Reader& in) {
  std::array<std::uint32_t, n> result{};
  for (std::uint32_t& corner : result)
    corner = in.number<std::uint32_t>("corner");
  return result;
}

std::uint8_t fixed_axes(Reader& in) {
  const std::string_view word = in.word();
  const std::optional<std::uint8_t> fixed = model::fixed_axes_from_name(word);
  if (!fixed)
    throw Error(shown(word) + " is no set of axes, expected -, x, y, z, xy, xz, yz or xyz");
  return *fixed;
}

// Whole lines.

model::Node node_of(Reader& in) {
  model::Node node;
  node.position = vector(in, "coordinate");
  node.mass = in.number<double>("mass");
  node.drag = in.number<double>("drag");
  node.fixed = fixed_axes(in);
  node.central = in.number<std::int32_t>("central");
  node.material = in.number<std::int32_t>("material");
  in.end_line(8);
  return node;
}

Vec3 normal_of(Reader& in) {
  const Vec3 normal = vector(in, "normal");
  in.end_line(3);
  return normal;
}

model::Spring spring_of(Reader& in) {
  model::Spring s;
  s.i = in.number<std::uint32_t>("node");
  s.j = in.number<std::uint32_t>("node");
  const std::string_view letter = in.word();
  const std::size_t kind = letter.size() == 1 ? kind_letters.find(letter[0]) : std::string::npos;
  if (kind == std::string::npos)
    throw Error(shown(letter) + " is no kind of spring, expected e, b or c");
  s.kind = static_cast<model::SpringKind>(kind);
  s.stiffness = in.number<double>("stiffness");
  s.damping = in.number<double>("damping");
  s.rest = in.number<double>("rest length");
  in.end_line(6);
  return s;
}

Triangle triangle_of(Reader& in) {
  const Triangle triangle = corners<3>(in);
  in.end_line(3);
  return triangle;
}

std::array<double, 6> texcoords_of(Reader& in) {
  std::array<double, 6> values{};
  for (double& value : values)
    value = in.number<double>("texture coordinate");
  in.end_line(6);
  return values;
}

constexpr std::array<std::string_view, 11> section_names{
    "name",      "materials",  "nodes", "normals",        "springs",       "triangles",
    "texcoords", "tetrahedra", "skin",  "skin_triangles", "skin_texcoords"};

bool is_section(std::string_view word) {
  return word == "end" ||
         std::find(section_names.begin(), section_names.end(), word) != section_names.end();
}

/// The lines of a section read side by side, a piece of text each.
template <class T>
struct PieceOfSection {
  std::vector<T> elements;
  std::size_t lines = 0, bytes = 0; ///< of the text, or up to the last element where it ends
  bool ends = false;                ///< another section begins
  bool wrong = false;
};

template <class T, class ElementOf>
PieceOfSection<T> piece_of_section(std::string_view text, const ElementOf& element_of) {
  PieceOfSection<T> piece;
  Reader in(text);
  try {
    while (!piece.ends && in.next_line()) {
      piece.ends = in.starts_with_letter() && is_section(in.peek_word());
      if (!piece.ends) {
        piece.elements.push_back(element_of(in));
        piece.lines = in.line();
        piece.bytes = text.size() - in.bytes_left();
      }
    }
    if (!piece.ends) {
      piece.lines = in.line();
      piece.bytes = text.size();
    }
  } catch (const Error&) {
    piece.wrong = true; // reading line by line finds the error
  }
  return piece;
}

/// Reads `count` elements of a section from `text`; its bytes and lines, or nothing if they are not
/// all there or one is wrong.
template <class T, class ElementOf>
std::optional<std::pair<std::size_t, std::size_t>>
read_section(std::string_view text, std::size_t count, std::vector<T>& elements,
             const ElementOf& element_of, const Context& context) {
  constexpr std::size_t piece_bytes = 1 << 18, pieces_at_once = 32;
  std::size_t bytes = 0, lines = 0;
  while (elements.size() < count) {
    std::vector<std::string_view> texts;
    for (std::size_t at = bytes; at < text.size() && texts.size() < pieces_at_once;) {
      const std::size_t newline = text.find('\n', std::min(text.size(), at + piece_bytes));
      const std::size_t end = newline == std::string_view::npos ? text.size() : newline + 1;
      texts.push_back(text.substr(at, end - at));
      at = end;
    }
    std::vector<PieceOfSection<T>> pieces(texts.size());
    parallel_blocks(context, texts.size(), 1, [&](std::size_t n, std::size_t) {
      pieces[n] = piece_of_section<T>(texts[n], element_of);
    });
    const std::size_t before = elements.size();
    for (std::size_t n = 0; n < pieces.size(); ++n) {
      const PieceOfSection<T>& piece = pieces[n];
      if (piece.wrong || piece.elements.size() > count - elements.size())
        return {};
      elements.insert(elements.end(), piece.elements.begin(), piece.elements.end());
      lines += piece.lines;
      bytes += piece.bytes;
      if (piece.ends)
        break;
    }
    if (elements.size() == before)
      return {};
  }
  return std::pair(bytes, lines);
}

class Parser {
public:
  Parser(std::string_view text, const Context& context)
      : in_(text), check_(model_), context_(context) {
    context_.progress = nullptr; // that of parts means nothing
  }

  std::size_t line() const { return std::max<std::size_t>(in_.line(), 1); }
  Space stated_space() const { return space_; }

  model::Model parse() {
    header();
    name();
    if (section_ == "space")
      space();
    materials();
    nodes();
    if (section_ == "normals")
      normals();
    springs();
    triangles();
    if (section_ == "texcoords")
      texcoords();
    if (section_ == "tetrahedra") {
      tetrahedra();
      if (section_ == "skin")
        skin();
      else
        expect({"skin", "end"});
    }
    expect({"end"});
    in_.end_line(1);
    if (in_.next_line())
      throw Error(shown(in_.word()) + " behind 'end', expected nothing");
    return std::move(model_);
  }

private:
  void header() {
    if (!in_.next_line() || in_.word() != "ela_expl")
      throw Error("no model, expected 'ela_expl 1'");
    const auto version = in_.number<unsigned>("version");
    if (version != 1)
      throw Error("version " + std::to_string(version) + ", expected 1");
    in_.end_line(2);
    next_section();
  }

  void next_section() {
    if (!in_.next_line())
      throw Error("the file ends before 'end', expected a complete file");
    section_ = in_.word();
  }

  /// \throw Error unless the present section is one of these
  void expect(std::initializer_list<std::string_view> names) {
    if (std::find(names.begin(), names.end(), section_) != names.end())
      return;
    std::string list;
    for (const std::string_view& n : names)
      list += (list.empty() ? "'" : &n == names.end() - 1 ? " or '" : ", '") + std::string(n) + "'";
    const bool known = is_section(section_);
    throw Error((known ? "section " : "") + shown(section_) + (known ? "" : " is no section") +
                ", expected " + list +
                (last_.empty() ? "" : " after " + std::to_string(last_count_) + " " + last_));
  }

  /// The count of the present section, of whose lines each takes at least `bytes`.
  std::size_t count(std::size_t bytes) {
    const auto n = in_.number<std::uint64_t>("count");
    in_.end_line(2);
    if (n > in_.bytes_left() / bytes)
      throw Error(std::to_string(n) + " " + std::string(section_) + ", but only " +
                  std::to_string(in_.bytes_left()) + " bytes follow, expected a complete file");
    last_ = section_;
    last_count_ = static_cast<std::size_t>(n);
    return last_count_;
  }

  std::size_t optional_count(std::size_t bytes, std::size_t expected, const char* of) {
    const std::size_t n = count(bytes);
    if (n == 0)
      throw Error(shown(section_) + " 0, expected the section to be absent");
    if (of != nullptr && n != expected)
      throw Error(std::to_string(n) + " " + last_ + ", expected as many as " + of + ", " +
                  std::to_string(expected));
    return n;
  }

  /// Goes to line `i` of the present section.
  void element(std::size_t i) {
    if (!in_.next_line())
      throw Error("the file ends after " + std::to_string(i) + " of " +
                  std::to_string(last_count_) + " " + last_ + ", expected a complete file");
    if (in_.starts_with_letter() && is_section(in_.peek_word()))
      throw Error("section " + shown(in_.peek_word()) + " after " + std::to_string(i) + " of " +
                  std::to_string(last_count_) + " " + last_ + ", expected all of them");
  }

  /// Reads the elements of the present section: side by side, and if something is wrong once more
  /// line by line, to say what and where.
  template <class T, class ElementOf, class Check, class CheckAll>
  void elements(std::size_t n, std::vector<T>& all, const ElementOf& element_of, const Check& check,
                const CheckAll& check_all) {
    constexpr std::size_t few = 4096;
    all.reserve(n);
    if (n > few) {
      const auto read = read_section(in_.rest(), n, all, element_of, context_);
      try {
        if (read) {
          check_all();
          in_.skip(read->first, read->second);
          return;
        }
      } catch (const Cancelled&) {
        throw;
      } catch (const Error&) { // said below
      }
      all.clear();
    }
    for (std::size_t i = 0; i < n; ++i) {
      element(i);
      all.push_back(element_of(in_));
      check(i);
    }
  }
  template <class T, class ElementOf, class Check>
  void elements(std::size_t n, std::vector<T>& all, const ElementOf& element_of,
                const Check& check) {
    elements(n, all, element_of, check, [&] {
      for (std::size_t i = 0; i < n; ++i)
        check(i);
    });
  }
  template <class T, class ElementOf>
  void elements(std::size_t n, std::vector<T>& all, const ElementOf& element_of) {
    elements(n, all, element_of, [](std::size_t) {});
  }

  void name() {
    expect({"name"});
    model_.name = in_.quoted("name");
    in_.end_line(2);
    check_.name();
    next_section();
  }

  void space() {
    const std::string_view word = in_.word();
    space_ = space_from_name(word);
    if (space_ == Space::unknown)
      throw Error(shown(word) + " is no space, expected RAS or LPS");
    in_.end_line(2);
    next_section();
  }

  /// One of both, or both.
  void law_and_prony(model::Material& m) {
    std::string word(in_.word());
    if (!model::is_prony(word)) {
      m.law = model::parse_law(word);
      if (in_.at_end())
        return;
      word = in_.word();
    }
    m.prony = model::parse_prony(word);
  }

  void materials() {
    expect({"space", "materials"});
    const std::size_t n = count(13);
    model_.materials.reserve(n);
    for (std::size_t i = 0; i < n; ++i) {
      element(i);
      const auto index = in_.number<std::uint64_t>("material index");
      if (index != i)
        throw Error("material index " + std::to_string(index) + ", expected " + std::to_string(i));
      model::Material m;
      m.name = in_.quoted("material name");
      m.density = in_.number<double>("density");
      m.young = in_.number<double>("Young's modulus");
      m.thickness = in_.number<double>("thickness");
      m.damping_ratio = in_.number<double>("damping ratio");
      if (!in_.at_end())
        m.poisson = in_.number<double>("Poisson's ratio");
      if (!in_.at_end())
        law_and_prony(m);
      in_.end_line(9);
      model_.materials.push_back(std::move(m));
      check_.material(i);
    }
    next_section();
  }

  void nodes() {
    expect({"nodes"});
    const std::size_t n = count(16);
    check_.begin_nodes(n);
    elements(n, model_.nodes, node_of, [&](std::size_t i) {
      if (i == 0)
        check_.begin_nodes(n); // for the second time where the first found something
      check_.node(i);
    });
    check_.all_nodes();
    next_section();
    expect({"normals", "springs"});
  }

  void normals() {
    const std::size_t n = optional_count(6, model_.nodes.size(), "nodes");
    elements(n, model_.normals, normal_of);
    next_section();
  }

  void springs() {
    expect({"springs"});
    const std::size_t n = count(12);
    elements(
        n, model_.springs, spring_of, [&](std::size_t i) { check_.spring(i); },
        [&] {
          parallel_blocks(context_, n, 1 << 14,
                          [&](std::size_t begin, std::size_t end) { check_.springs(begin, end); });
        });
    next_section();
  }

  void triangles() {
    expect({"triangles"});
    const std::size_t n = count(6);
    elements(n, model_.triangles, triangle_of, [&](std::size_t i) { check_.triangle(i); });
    next_section();
    expect({"texcoords", "tetrahedra", "end"});
  }

  void texcoords() {
    const std::size_t n = optional_count(12, model_.triangles.size(), "triangles");
    elements(n, model_.texcoords, texcoords_of);
    next_section();
    expect({"tetrahedra", "end"});
  }

  void tetrahedra() {
    const std::size_t n = optional_count(10, 0, nullptr);
    model_.tetrahedra.reserve(n);
    bool quadratic = false;
    for (std::size_t i = 0; i < n; ++i) {
      element(i);
      model_.tetrahedra.push_back(corners<4>(in_));
      auto word = in_.number<std::uint32_t>("material");
      if (i == 0)
        quadratic = !in_.at_end();
      if (quadratic) {
        EdgeMiddles& middles = model_.middles.emplace_back();
        middles[0] = word;
        for (std::size_t m = 1; m < 6; ++m)
          middles[m] = in_.number<std::uint32_t>("middle");
        word = in_.number<std::uint32_t>("material");
      }
      in_.end_line(quadratic ? 11 : 5);
      model_.tetrahedron_material.push_back(
          static_cast<std::int32_t>(std::min(word, static_cast<std::uint32_t>(INT32_MAX))));
      check_.tetrahedron(i);
    }
    next_section();
  }

  void skin() {
    model::Skin& skin = model_.skin;
    const std::size_t points = optional_count(8, 0, nullptr);
    skin.points.reserve(points);
    for (std::size_t i = 0; i < points; ++i) {
      element(i);
      skin.points.push_back(vector(in_, "coordinate"));
      skin.tetrahedron.push_back(in_.number<std::uint32_t>("tetrahedron"));
      in_.end_line(4);
      check_.skin_point(i);
    }
    next_section();
    expect({"skin_triangles"});
    const std::size_t triangles = optional_count(8, 0, nullptr);
    skin.triangles.reserve(triangles);
    for (std::size_t i = 0; i < triangles; ++i) {
      element(i);
      skin.triangles.push_back(corners<3>(in_));
      skin.material.push_back(in_.number<std::int32_t>("material"));
      in_.end_line(4);
      check_.skin_triangle(i);
    }
    next_section();
    if (section_ != "skin_texcoords")
      return expect({"skin_texcoords", "end"});
    skin.texcoords.reserve(optional_count(12, triangles, "skin_triangles"));
    for (std::size_t i = 0; i < triangles; ++i) {
      element(i);
      for (double& value : skin.texcoords.emplace_back())
        value = in_.number<double>("texture coordinate");
      in_.end_line(6);
    }
    next_section();
  }

  Reader in_;
  model::Model model_;
  model::ModelChecker check_;
  Context context_;
  Space space_ = Space::unknown;
  std::string_view section_;
  std::string last_;
  std::size_t last_count_ = 0;
};

} // namespace

model::Model parse_ela(std::string_view text, const std::string& name, const Context& context,
                       Space* space) {
  Parser parser(text, context);
  try {
    model::Model model = parser.parse();
    if (space != nullptr)
      *space = parser.stated_space();
    return model;
  } catch (const Error& error) {
    throw Error(name + ":" + std::to_string(parser.line()), error.what());
  }
}

model::Model read_ela(Input& input, const Context& context, Space* space) {
  const std::string text = input.read_all(context.max_memory);
  // The lines that we write take more bytes as text than as data.
  const std::string what = "the model in " + std::to_string(text.size()) + " bytes of text";
  gewebe::at(input.name(),
             [&] { require_memory(context, 2 * static_cast<double>(text.size()), what.c_str()); });
  return parse_ela(text, input.name(), context, space);
}

} // namespace gewebe::formats
