#include "base/error.h"
#include "model/selector.h"
#include "model/selector_internal.h"

#include <algorithm>
#include <array>
#include <charconv>

namespace gewebe::model {

namespace {

using Op = Selector::Op;

constexpr int max_depth =
    64; // of parentheses: bounds the parser's stack and the evaluator's memory

bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\n' || c == '\r';
}
bool is_digit(char c) {
  return c >= '0' && c <= '9';
}
bool is_letter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
}

/// At most `longest` bytes, and what is missing of the last UTF-8 character.
std::string printable(std::string_view text, std::size_t longest) {
  std::size_t end = std::min(longest, text.size());
  while (end < text.size() && (static_cast<unsigned char>(text[end]) & 0xc0U) == 0x80)
    ++end;
  std::string result;
  for (const char c : text.substr(0, end))
    result += static_cast<unsigned char>(c) >= 0x20 && c != 0x7f ? c : '?';
  return text.size() > end ? result + "…" : result;
}

struct Shape {
  std::string_view name;
  Op op;
  std::size_t numbers;
  std::string_view expected;
};
constexpr std::array<Shape, 4> shapes{{{"box", Op::box, 6, "box:x0,y0,z0,x1,y1,z1"},
                                       {"sphere", Op::sphere, 4, "sphere:x,y,z,r"},
                                       {"plane", Op::plane, 4, "plane:nx,ny,nz,d"},
                                       {"near", Op::near, 4, "near:x,y,z,r"}}};

struct Word {
  std::string_view name;
  Op op;
};
constexpr std::array<Word, 5> words{{{"all", Op::all},
                                     {"surface", Op::surface},
                                     {"inside", Op::inside},
                                     {"central", Op::central},
                                     {"boundary", Op::boundary}}};

class Parser {
public:
  explicit Parser(std::string_view text) : text_(text) { result_.text = text; }

  Selector parse() {
    skip_blanks();
    expression(0);
    if (at_ != text_.size())
      fail(text_[at_] == ')' ? "')' without '(', expected an end"
                             : "no operator, expected 'and' or 'or'");
    return std::move(result_);
  }

private:
  [[noreturn]] void fail(const std::string& what) const { fail_at(at_, what); }
  [[noreturn]] void fail_at(std::size_t where, const std::string& what) const {
    throw Error("selector " + quoted_selector(text_) + ": column " + std::to_string(where + 1) +
                ": " + what);
  }

  char peek() const { return at_ < text_.size() ? text_[at_] : '\0'; }
  void skip_blanks() {
    while (is_blank(peek()))
      ++at_;
  }
  std::string_view word_ahead() const {
    std::size_t end = at_;
    while (end < text_.size() && (is_letter(text_[end]) || is_digit(text_[end])))
      ++end;
    return text_.substr(at_, end - at_);
  }
  bool take_word(std::string_view word) {
    if (word_ahead() != word)
      return false;
    at_ += word.size();
    skip_blanks();
    return true;
  }

  Selector::Step& add(Op op) {
    Selector::Step& step = result_.steps.emplace_back();
    step.op = op;
    return step;
  }

  // expression = term { "or" term }, term = factor { "and" factor }
  void expression(int depth) {
    term(depth);
    while (take_word("or")) {
      term(depth);
      add(Op::logical_or);
    }
  }

  void term(int depth) {
    factor(depth);
    while (take_word("and")) {
      factor(depth);
      add(Op::logical_and);
    }
  }

  // factor = { "not" } ( "(" expression ")" | atom )
  void factor(int depth) {
    bool negated = false;
    while (take_word("not"))
      negated = !negated;
    if (peek() == '(') {
      if (depth == max_depth)
        fail("parentheses too deep, expected at most " + std::to_string(max_depth));
      const std::size_t open = at_++;
      skip_blanks();
      expression(depth + 1);
      if (peek() != ')') {
        if (at_ == text_.size())
          fail_at(open, "'(' without ')', expected one");
        fail("no operator, expected 'and', 'or' or ')'");
      }
      ++at_;
      skip_blanks();
    } else {
      atom();
      skip_blanks();
    }
    if (negated)
      add(Op::logical_not);
  }

  void atom() {
    if (is_digit(peek()))
      return node_list();
    if (peek() == '@')
      return file();
    const std::string_view word = word_ahead();
    for (const Word& w : words)
      if (word == w.name) {
        at_ += word.size();
        add(w.op);
        return end_atom();
      }
    for (const Shape& shape : shapes)
      if (word == shape.name)
        return shape_atom(shape);
    if (word == "component") {
      at_ += word.size();
      if (peek() != ':')
        fail("no ':', expected component:N");
      ++at_;
      const std::uint32_t index = integer("component");
      add(Op::component).index = index;
      return end_atom();
    }
    if (word == "x" || word == "y" || word == "z")
      return comparison();
    if (at_ == text_.size())
      fail("nothing there, expected a selector");
    fail(word.empty() ? "'" + first_character() + "' starts no selector"
                      : quoted_selector(word) + " is no selector, see gewebe_selector(7)");
  }

  /// What stands here, whole where it takes several bytes.
  std::string first_character() const {
    std::size_t end = at_ + 1;
    while (end < text_.size() && (static_cast<unsigned char>(text_[end]) & 0xc0U) == 0x80)
      ++end;
    return printable(text_.substr(at_, end - at_), end - at_);
  }

  /// An atom ends at a blank, a parenthesis or the end.
  void end_atom() const {
    if (at_ != text_.size() && !is_blank(text_[at_]) && text_[at_] != ')' && text_[at_] != '(')
      fail("surplus text, expected a blank or the end");
  }

  void shape_atom(const Shape& shape) {
    at_ += shape.name.size();
    std::vector<double> numbers;
    for (std::size_t i = 0; i < shape.numbers; ++i) {
      const char separator = i == 0 ? ':' : ',';
      if (peek() != separator)
        fail(std::to_string(i) + " numbers, expected " + std::string(shape.expected));
      ++at_;
      numbers.push_back(number());
    }
    if (peek() == ',')
      fail("surplus number, expected " + std::string(shape.expected));
    const std::size_t radius = 3;
    if (shape.op == Op::sphere || shape.op == Op::near)
      if (!(numbers[radius] >= 0))
        fail("negative radius, expected 0 or more");
    if (shape.op == Op::box)
      for (std::size_t a = 0; a < 3; ++a)
        if (!(numbers[a] <= numbers[a + 3]))
          fail("empty box, expected its low corner first, " + std::string(shape.expected));
    if (shape.op == Op::plane && numbers[0] == 0 && numbers[1] == 0 && numbers[2] == 0)
      fail("the plane has no normal, expected one that is not 0,0,0");
    add(shape.op).numbers = std::move(numbers);
    end_atom();
  }

  void comparison() {
    const auto axis = static_cast<std::uint32_t>(text_[at_++] - 'x');
    skip_blanks();
    const bool less = peek() == '<';
    if (!less && peek() != '>')
      fail("no comparison, expected <, <=, > or >=");
    ++at_;
    const bool equal = peek() == '=';
    if (equal)
      ++at_;
    skip_blanks();
    const double bound = number();
    Selector::Step& step =
        add(less ? (equal ? Op::less_equal : Op::less) : (equal ? Op::greater_equal : Op::greater));
    step.index = axis;
    step.numbers = {bound};
    end_atom();
  }

  void node_list() {
    NodeRanges ranges;
    do {
      if (!ranges.empty())
        ++at_; // the comma
      const std::uint32_t first = integer("node");
      std::uint32_t last = first;
      if (peek() == '-') {
        ++at_;
        const std::size_t where = at_;
        last = integer("node");
        if (last < first)
          fail_at(where, "the range ends before it starts, expected LOW-HIGH");
      }
      ranges.emplace_back(first, last);
    } while (peek() == ',');
    add(Op::nodes).ranges = std::move(ranges);
    end_atom();
  }

  // "@name" up to a blank or a parenthesis, or quoted
  void file() {
    const std::size_t where = at_++;
    std::size_t end = at_;
    std::string name;
    if (peek() == '"' || peek() == '\'') {
      const char close = text_[at_++];
      end = text_.find(close, at_);
      if (end == std::string_view::npos)
        fail_at(where + 1, "the file name has no closing quote, expected one");
      name = text_.substr(at_, end - at_);
      at_ = end + 1;
    } else {
      while (end < text_.size() && !is_blank(text_[end]) && text_[end] != '(' && text_[end] != ')')
        ++end;
      name = text_.substr(at_, end - at_);
      at_ = end;
    }
    if (name.empty())
      fail_at(where, "no file name, expected @FILE");
    add(Op::file).file_name = std::move(name);
    end_atom();
  }

  double number() {
    double value = 0;
    const char* const begin = text_.data() + at_;
    const auto [rest, status] = std::from_chars(begin, text_.data() + text_.size(), value);
    if (status != std::errc{} || !std::isfinite(value))
      fail("no finite number, expected one");
    at_ += static_cast<std::size_t>(rest - begin);
    return value;
  }

  std::uint32_t integer(const char* what) {
    std::uint32_t value = 0;
    const char* const begin = text_.data() + at_;
    const auto [rest, status] = std::from_chars(begin, text_.data() + text_.size(), value);
    if (status != std::errc{})
      fail(std::string("no ") + what + " number, expected 0 to " + std::to_string(UINT32_MAX));
    at_ += static_cast<std::size_t>(rest - begin);
    return value;
  }

  std::string_view text_;
  std::size_t at_ = 0;
  Selector result_;
};

} // namespace

std::string quoted_selector(std::string_view text) {
  return "'" + printable(text, 60) + "'";
}

Selector parse_selector(std::string_view text) {
  return Parser(text).parse();
}

bool has_node_numbers(const Selector& selector) {
  return std::ranges::any_of(selector.steps, [](const Selector::Step& step) {
    return step.op == Selector::Op::nodes || step.op == Selector::Op::file;
  });
}

std::vector<std::string> node_list_names(const Selector& selector) {
  std::vector<std::string> names;
  for (const Selector::Step& step : selector.steps)
    if (step.op == Op::file)
      names.push_back(step.file_name);
  return names;
}

NodeRanges parse_node_list(std::string_view text, const std::string& name) {
  NodeRanges ranges;
  std::size_t line = 1;
  const char* at = text.data();
  const char* const end = at + text.size();
  const auto integer = [&] {
    std::uint32_t value = 0;
    const auto [rest, status] = std::from_chars(at, end, value);
    if (status != std::errc{})
      throw Error(name + ":" + std::to_string(line),
                  quoted_selector(std::string_view(
                      at, std::min<std::size_t>(8, static_cast<std::size_t>(end - at)))) +
                      " starts no node number, expected 0 to " + std::to_string(UINT32_MAX));
    at = rest;
    return value;
  };
  while (at != end) {
    if (*at == '\n')
      ++line;
    if (*at == '#') {
      at = std::find(at, end, '\n');
    } else if (is_blank(*at) || *at == ',') {
      ++at;
    } else {
      const std::uint32_t first = integer();
      std::uint32_t last = first;
      if (at != end && *at == '-') {
        ++at;
        last = integer();
      }
      if (last < first || (at != end && !is_blank(*at) && *at != ',' && *at != '#'))
        throw Error(
            name + ":" + std::to_string(line),
            "neither node number nor range, expected N or LOW-HIGH between blanks or commas");
      ranges.emplace_back(first, last);
    }
  }
  if (ranges.empty())
    throw Error(name, "no node number, expected at least one");
  return ranges;
}

} // namespace gewebe::model
