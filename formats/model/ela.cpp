#include "formats/model/ela.h"

#include "base/error.h"
#include "base/number_text.h"
#include "base/parallel.h"
#include "model/check.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <functional>
#include <initializer_list>

namespace gewebe {

namespace {

constexpr std::string_view kind_letters = "ebc";

// ---- reading

bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\r';
}

/// A word as a message may show it: short, printable.
std::string shown(std::string_view word) {
  std::string text = "'";
  for (const char c : word.substr(0, 24))
    text += c >= 0x20 && c < 0x7f ? c : '?';
  return text + (word.size() > 24 ? "…'" : "'");
}

/// Walks through lines and words; comments and blank lines never show.
class Reader {
public:
  explicit Reader(std::string_view text) : next_(text.data()), end_(text.data() + text.size()) {}

  std::size_t line() const { return line_; }
  std::size_t bytes_left() const { return static_cast<std::size_t>(end_ - next_); }

  /// Goes to the next line that holds a word; false at the end of the text.
  bool next_line() {
    while (next_ != end_) {
      ++line_;
      const void* const newline = std::memchr(next_, '\n', bytes_left());
      if (newline == nullptr)
        throw Error("the last line has no end, expected a complete file");
      at_ = next_;
      line_end_ = static_cast<const char*>(newline);
      next_ = line_end_ + 1;
      skip_blanks();
      if (at_ != line_end_)
        return true;
    }
    at_ = line_end_ = end_;
    return false;
  }

  /// The next word, empty at the end of the line.
  std::string_view word() {
    const char* const begin = at_;
    while (at_ != line_end_ && !is_blank(*at_) && *at_ != '#')
      ++at_;
    const std::string_view result(begin, static_cast<std::size_t>(at_ - begin));
    skip_blanks();
    return result;
  }

  template <class T>
  T number(const char* what) {
    T value{};
    const auto [rest, status] = std::from_chars(at_, line_end_, value);
    if (status != std::errc{} || !(rest == line_end_ || is_blank(*rest) || *rest == '#'))
      throw Error(bad_number(what));
    if constexpr (std::is_floating_point_v<T>)
      if (!std::isfinite(value))
        throw Error(bad_number(what));
    at_ = rest;
    skip_blanks();
    return value;
  }

  std::string quoted(const char* what) {
    if (at_ == line_end_ || *at_ != '"')
      throw Error(std::string("no ") + what + ", expected one in quotes");
    const char* const begin = ++at_;
    const auto* const close = static_cast<const char*>(
        std::memchr(begin, '"', static_cast<std::size_t>(line_end_ - begin)));
    if (close == nullptr)
      throw Error(std::string("the ") + what + " has no closing quote, expected one");
    at_ = close + 1;
    if (at_ != line_end_ && !is_blank(*at_) && *at_ != '#')
      throw Error(std::string("no blank behind the ") + what + ", expected one");
    skip_blanks();
    return {begin, close};
  }

  /// \throw Error if the line holds another word
  void end_line(std::size_t words) {
    if (at_ != line_end_)
      throw Error("surplus word " + shown(word()) + ", expected " + std::to_string(words) +
                  " words");
  }

  bool at_end() const { return at_ == line_end_; }
  bool starts_with_letter() const { return *at_ >= 'a' && *at_ <= 'z'; }
  std::string_view peek_word() const {
    Reader copy = *this;
    return copy.word();
  }

private:
  void skip_blanks() {
    while (at_ != line_end_ && is_blank(*at_))
      ++at_;
    if (at_ != line_end_ && *at_ == '#')
      at_ = line_end_;
  }

  std::string bad_number(const char* what) {
    if (at_ == line_end_)
      return std::string("the line ends before ") + what + ", expected more words";
    return shown(word()) + " is no " + what + ", expected a finite number in range";
  }

  const char* next_;
  const char* end_;
  const char* at_ = nullptr;
  const char* line_end_ = nullptr;
  std::size_t line_ = 0;
};

constexpr std::array<std::string_view, 11> section_names{
    "name",      "materials",  "nodes", "normals",        "springs",       "triangles",
    "texcoords", "tetrahedra", "skin",  "skin_triangles", "skin_texcoords"};

bool is_section(std::string_view word) {
  return word == "end" ||
         std::find(section_names.begin(), section_names.end(), word) != section_names.end();
}

class Parser {
public:
  explicit Parser(std::string_view text) : in_(text), check_(model_) {}

  std::size_t line() const { return std::max<std::size_t>(in_.line(), 1); }

  Model parse() {
    header();
    name();
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

  void name() {
    expect({"name"});
    model_.name = in_.quoted("name");
    in_.end_line(2);
    check_.name();
    next_section();
  }

  void materials() {
    expect({"materials"});
    const std::size_t n = count(13);
    model_.materials.reserve(n);
    for (std::size_t i = 0; i < n; ++i) {
      element(i);
      const auto index = in_.number<std::uint64_t>("material index");
      if (index != i)
        throw Error("material index " + std::to_string(index) + ", expected " + std::to_string(i));
      Material m;
      m.name = in_.quoted("material name");
      m.density = in_.number<double>("density");
      m.young = in_.number<double>("Young's modulus");
      m.thickness = in_.number<double>("thickness");
      m.damping_ratio = in_.number<double>("damping ratio");
      if (!in_.at_end())
        m.poisson = in_.number<double>("Poisson's ratio");
      in_.end_line(7);
      model_.materials.push_back(std::move(m));
      check_.material(i);
    }
    next_section();
  }

  void nodes() {
    expect({"nodes"});
    const std::size_t n = count(16);
    check_.begin_nodes(n);
    model_.nodes.reserve(n);
    for (std::size_t i = 0; i < n; ++i) {
      element(i);
      Node node;
      node.position = vector("coordinate");
      node.mass = in_.number<double>("mass");
      node.drag = in_.number<double>("drag");
      node.fixed = fixed_axes();
      node.central = in_.number<std::int32_t>("central");
      node.material = in_.number<std::int32_t>("material");
      in_.end_line(8);
      model_.nodes.push_back(node);
      check_.node(i);
    }
    check_.all_nodes();
    next_section();
    expect({"normals", "springs"});
  }

  void normals() {
    const std::size_t n = optional_count(6, model_.nodes.size(), "nodes");
    model_.normals.reserve(n);
    for (std::size_t i = 0; i < n; ++i) {
      element(i);
      model_.normals.push_back(vector("normal"));
      in_.end_line(3);
    }
    next_section();
  }

  void springs() {
    expect({"springs"});
    const std::size_t n = count(12);
    model_.springs.reserve(n);
    for (std::size_t i = 0; i < n; ++i) {
      element(i);
      Spring s;
      s.i = in_.number<std::uint32_t>("node");
      s.j = in_.number<std::uint32_t>("node");
      const std::string_view letter = in_.word();
      const std::size_t kind =
          letter.size() == 1 ? kind_letters.find(letter[0]) : std::string::npos;
      if (kind == std::string::npos)
        throw Error(shown(letter) + " is no kind of spring, expected e, b or c");
      s.kind = static_cast<SpringKind>(kind);
      s.stiffness = in_.number<double>("stiffness");
      s.damping = in_.number<double>("damping");
      s.rest = in_.number<double>("rest length");
      in_.end_line(6);
      model_.springs.push_back(s);
      check_.spring(i);
    }
    next_section();
  }

  void triangles() {
    expect({"triangles"});
    const std::size_t n = count(6);
    model_.triangles.reserve(n);
    for (std::size_t i = 0; i < n; ++i) {
      element(i);
      model_.triangles.push_back(corners<3>());
      in_.end_line(3);
      check_.triangle(i);
    }
    next_section();
    expect({"texcoords", "tetrahedra", "end"});
  }

  void texcoords() {
    const std::size_t n = optional_count(12, model_.triangles.size(), "triangles");
    model_.texcoords.reserve(n);
    for (std::size_t i = 0; i < n; ++i) {
      element(i);
      for (double& value : model_.texcoords.emplace_back())
        value = in_.number<double>("texture coordinate");
      in_.end_line(6);
    }
    next_section();
    expect({"tetrahedra", "end"});
  }

  void tetrahedra() {
    const std::size_t n = optional_count(10, 0, nullptr);
    model_.tetrahedra.reserve(n);
    bool quadratic = false;
    for (std::size_t i = 0; i < n; ++i) {
      element(i);
      model_.tetrahedra.push_back(corners<4>());
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
    Skin& skin = model_.skin;
    const std::size_t points = optional_count(8, 0, nullptr);
    skin.points.reserve(points);
    for (std::size_t i = 0; i < points; ++i) {
      element(i);
      skin.points.push_back(vector("coordinate"));
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
      skin.triangles.push_back(corners<3>());
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

  Vec3 vector(const char* what) {
    Vec3 v;
    v.x = in_.number<double>(what);
    v.y = in_.number<double>(what);
    v.z = in_.number<double>(what);
    return v;
  }

  template <std::size_t n>
  std::array<std::uint32_t, n> corners() {
    std::array<std::uint32_t, n> result{};
    for (std::uint32_t& corner : result)
      corner = in_.number<std::uint32_t>("corner");
    return result;
  }

  std::uint8_t fixed_axes() {
    const std::string_view word = in_.word();
    const std::optional<std::uint8_t> fixed = fixed_axes_from_name(word);
    if (!fixed)
      throw Error(shown(word) + " is no set of axes, expected -, x, y, z, xy, xz, yz or xyz");
    return *fixed;
  }

  Reader in_;
  Model model_;
  ModelChecker check_;
  std::string_view section_;
  std::string last_;
  std::size_t last_count_ = 0;
};

// ---- writing

/// Appends words to a line of a preallocated block.
class LineWriter {
public:
  explicit LineWriter(std::string& text) : text_(text) {}

  template <class T>
  LineWriter& number(T value) {
    const auto end = std::to_chars(at_, line_.data() + line_.size(), value).ptr;
    at_ = end;
    *at_++ = ' ';
    return *this;
  }
  LineWriter& vector(const Vec3& v) { return number(v.x).number(v.y).number(v.z); }
  LineWriter& word(std::string_view word) {
    at_ = std::copy(word.begin(), word.end(), at_);
    *at_++ = ' ';
    return *this;
  }
  void end() {
    at_[-1] = '\n'; // in place of the last blank
    text_.append(line_.data(), at_);
    at_ = line_.data();
  }

private:
  std::string& text_;
  std::array<char, 256> line_; // 8 numbers of at most 24 characters
  char* at_ = line_.data();
};

using Sink = std::function<void(std::string_view)>;
using LineOf = std::function<void(std::size_t, LineWriter&)>;

/// A section's lines, made in blocks side by side, given to the sink in order.
void emit(const Sink& sink, const Context& context, std::string_view section, std::size_t count,
          const LineOf& line_of) {
  sink(std::string(section) + " " + std::to_string(count) + "\n");
  Context quiet = context;
  quiet.progress = nullptr; // the progress of parts of a section means nothing
  constexpr std::size_t grain = 4096, batch = grain * 64;
  std::vector<std::string> blocks(batch / grain);
  for (std::size_t begin = 0; begin < count; begin += batch) {
    const std::size_t lines = std::min(batch, count - begin);
    parallel_blocks(quiet, lines, grain, [&](std::size_t first, std::size_t last) {
      std::string& block = blocks[first / grain];
      block.clear();
      LineWriter line(block);
      for (std::size_t i = first; i < last; ++i)
        line_of(begin + i, line);
    });
    for (std::size_t b = 0; b * grain < lines; ++b)
      sink(blocks[b]);
  }
}

void emit_skin(const Sink& sink, const Skin& skin, const Context& context) {
  emit(sink, context, "skin", skin.points.size(), [&](std::size_t i, LineWriter& line) {
    line.vector(skin.points[i]).number(skin.tetrahedron[i]).end();
  });
  emit(sink, context, "skin_triangles", skin.triangles.size(),
       [&](std::size_t i, LineWriter& line) {
         const Triangle& t = skin.triangles[i];
         line.number(t[0]).number(t[1]).number(t[2]).number(skin.material[i]).end();
       });
  if (!skin.texcoords.empty())
    emit(sink, context, "skin_texcoords", skin.texcoords.size(),
         [&](std::size_t i, LineWriter& line) {
           for (const double value : skin.texcoords[i])
             line.number(value);
           line.end();
         });
}

void emit_model(const Sink& sink, const Model& m, const Context& context) {
  sink("ela_expl 1\nname \"" + m.name + "\"\nmaterials " + std::to_string(m.materials.size()) +
       "\n");
  for (std::size_t i = 0; i < m.materials.size(); ++i) {
    const Material& k = m.materials[i];
    sink(std::to_string(i) + " \"" + k.name + "\" " + number_text(k.density) + " " +
         number_text(k.young) + " " + number_text(k.thickness) + " " +
         number_text(k.damping_ratio) + (k.poisson ? " " + number_text(*k.poisson) : "") + "\n");
  }
  emit(sink, context, "nodes", m.nodes.size(), [&](std::size_t i, LineWriter& line) {
    const Node& n = m.nodes[i];
    line.vector(n.position).number(n.mass).number(n.drag).word(fixed_axes_name(n.fixed));
    line.number(n.central).number(n.material).end();
  });
  if (!m.normals.empty())
    emit(sink, context, "normals", m.normals.size(),
         [&](std::size_t i, LineWriter& line) { line.vector(m.normals[i]).end(); });
  emit(sink, context, "springs", m.springs.size(), [&](std::size_t i, LineWriter& line) {
    const Spring& s = m.springs[i];
    line.number(s.i).number(s.j).word(kind_letters.substr(static_cast<std::size_t>(s.kind), 1));
    line.number(s.stiffness).number(s.damping).number(s.rest).end();
  });
  emit(sink, context, "triangles", m.triangles.size(), [&](std::size_t i, LineWriter& line) {
    const Triangle& t = m.triangles[i];
    line.number(t[0]).number(t[1]).number(t[2]).end();
  });
  if (!m.texcoords.empty())
    emit(sink, context, "texcoords", m.texcoords.size(), [&](std::size_t i, LineWriter& line) {
      for (const double value : m.texcoords[i])
        line.number(value);
      line.end();
    });
  if (!m.tetrahedra.empty())
    emit(sink, context, "tetrahedra", m.tetrahedra.size(), [&](std::size_t i, LineWriter& line) {
      for (const std::uint32_t corner : m.tetrahedra[i])
        line.number(corner);
      if (!m.middles.empty())
        for (const std::uint32_t middle : m.middles[i])
          line.number(middle);
      line.number(m.tetrahedron_material[i]).end();
    });
  if (!m.skin.points.empty())
    emit_skin(sink, m.skin, context);
  sink("end\n");
}

} // namespace

Model parse_ela(std::string_view text, const std::string& name) {
  Parser parser(text);
  try {
    return parser.parse();
  } catch (const Error& error) {
    throw Error(name + ":" + std::to_string(parser.line()), error.what());
  }
}

Model read_ela(Input& input, const Context& context) {
  const std::string text = input.read_all(context.max_memory);
  // The lines that we write take more bytes as text than as data.
  const std::string what = "the model in " + std::to_string(text.size()) + " bytes of text";
  at(input.name(),
     [&] { require_memory(context, 2 * static_cast<double>(text.size()), what.c_str()); });
  return parse_ela(text, input.name());
}

Model read_spring_model(Input& input, const Context& context) {
  Model model = read_ela(input, context);
  if (!model.tetrahedra.empty())
    throw Error(input.name(), "the model '" + model.name + "' holds " +
                                  std::to_string(model.tetrahedra.size()) +
                                  " tetrahedra, expected springs and triangles alone");
  return model;
}

std::string ela_text(const Model& model) {
  std::string text;
  emit_model([&](std::string_view piece) { text += piece; }, model, Context{});
  return text;
}

void write_ela(Output& output, const Model& model, const Context& context) {
  emit_model([&](std::string_view piece) { output.write(piece); }, model, context);
}

} // namespace gewebe
