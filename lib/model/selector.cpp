#include "model/selector.h"

#include "base/error.h"
#include "base/number_text.h"
#include "mesh/border.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>

namespace gewebe {

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

std::string printable(std::string_view text, std::size_t longest) {
  std::string result;
  for (const char c : text.substr(0, longest))
    result += static_cast<unsigned char>(c) >= 0x20 && c != 0x7f ? c : '?';
  return text.size() > longest ? result + "…" : result;
}

std::string quote(std::string_view text) {
  return "'" + printable(text, 60) + "'";
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
    throw Error("selector " + quote(text_) + ": column " + std::to_string(where + 1) + ": " + what);
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
    fail(word.empty() ? "'" + printable(text_.substr(at_, 1), 1) + "' starts no selector"
                      : quote(word) + " is no selector, see gewebe_selector(7)");
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

using Flags = std::vector<std::uint8_t>;

NodeRanges load_ranges(const std::string& name, const LoadNodeList& load) {
  if (!load)
    throw Error("@" + name + ": no files can be read here, expected node numbers");
  return parse_node_list(load(name), name);
}

void require_nodes(const NodeRanges& ranges, std::size_t nodes) {
  for (const auto& [first, last] : ranges)
    if (last >= nodes)
      throw Error("node " + std::to_string(last) + " does not exist, expected 0 to " +
                  std::to_string(nodes - 1));
}

/// Ranges may overlap.
std::vector<std::uint32_t> nodes_of(NodeRanges ranges) {
  std::ranges::sort(ranges);
  std::vector<std::uint32_t> nodes;
  for (const auto& [first, last] : ranges)
    for (std::size_t node = nodes.empty() ? first : std::max(first, nodes.back() + 1); node <= last;
         ++node)
      nodes.push_back(static_cast<std::uint32_t>(node));
  return nodes;
}

/// What evaluation needs to know of a model, found out once and only where asked for.
class Evaluator {
public:
  Evaluator(const Model& model, const NodeCounts& counts, const Selector& selector,
            const LoadNodeList& load, SelectorScope scope)
      : model_(model), surface_(counts.surface), body_(counts.body),
        scope_(scope == SelectorScope::body ? body_ : surface_) {
    ranges_.reserve(selector.steps.size());
    for (const Selector::Step& step : selector.steps) {
      ranges_.push_back(step.op == Op::file ? load_ranges(step.file_name, load) : step.ranges);
      if (step.op == Op::central || step.op == Op::all)
        scope_ = model.nodes.size();
      if (step.op == Op::inside)
        scope_ = std::max(scope_, body_);
      require_nodes(ranges_.back(), model.nodes.size());
      for (const auto& [first, last] : ranges_.back())
        if (last >= scope_)
          scope_ = last < body_ ? body_ : model.nodes.size();
    }
  }

  std::vector<std::uint32_t> run(const Selector& selector) {
    std::vector<Flags> stack;
    for (std::size_t s = 0; s < selector.steps.size(); ++s) {
      const Selector::Step& step = selector.steps[s];
      switch (step.op) {
      case Op::logical_not:
        for (std::uint8_t& flag : stack.back())
          flag ^= 1;
        break;
      case Op::logical_and:
      case Op::logical_or: {
        const Flags right = std::move(stack.back());
        stack.pop_back();
        Flags& left = stack.back();
        for (std::size_t i = 0; i < scope_; ++i)
          left[i] = step.op == Op::logical_and ? left[i] & right[i] : left[i] | right[i];
        break;
      }
      default:
        stack.push_back(atom(step, ranges_[s]));
      }
    }
    std::vector<std::uint32_t> selected;
    for (std::uint32_t i = 0; i < scope_; ++i)
      if (stack.back()[i] != 0)
        selected.push_back(i);
    return selected;
  }

private:
  template <class Test>
  Flags where(Test&& test) const {
    Flags flags(scope_);
    for (std::size_t i = 0; i < scope_; ++i)
      flags[i] = test(model_.nodes[i].position) ? 1 : 0;
    return flags;
  }

  Flags range(std::size_t begin, std::size_t end) const {
    Flags flags(scope_);
    std::fill(flags.begin() + static_cast<std::ptrdiff_t>(std::min(begin, scope_)),
              flags.begin() + static_cast<std::ptrdiff_t>(std::min(end, scope_)), std::uint8_t{1});
    return flags;
  }

  Flags atom(const Selector::Step& step, const NodeRanges& ranges) {
    const std::vector<double>& n = step.numbers;
    const int axis = static_cast<int>(step.index);
    switch (step.op) {
    case Op::all:
      return range(0, scope_);
    case Op::surface:
      return range(0, surface_);
    case Op::inside:
      return range(surface_, body_);
    case Op::central:
      return range(body_, scope_);
    case Op::boundary:
      return boundary();
    case Op::box:
      return where([&](const Vec3& p) {
        return n[0] <= p.x && p.x <= n[3] && n[1] <= p.y && p.y <= n[4] && n[2] <= p.z &&
               p.z <= n[5];
      });
    case Op::sphere:
      return where([&](const Vec3& p) { return norm(p - Vec3{n[0], n[1], n[2]}) <= n[3]; });
    case Op::plane:
      return where([&](const Vec3& p) { return dot(p, {n[0], n[1], n[2]}) > n[3]; });
    case Op::near:
      return nearest({n[0], n[1], n[2]}, n[3]);
    case Op::less:
      return where([&](const Vec3& p) { return p[axis] < n[0]; });
    case Op::less_equal:
      return where([&](const Vec3& p) { return p[axis] <= n[0]; });
    case Op::greater:
      return where([&](const Vec3& p) { return p[axis] > n[0]; });
    case Op::greater_equal:
      return where([&](const Vec3& p) { return p[axis] >= n[0]; });
    case Op::component:
      return component(step.index);
    default: { // nodes and file
      // Ranges may overlap many times: count how many are open instead of painting each.
      std::vector<std::int64_t> opened(scope_ + 1);
      for (const auto& [first, last] : ranges) {
        ++opened[first];
        --opened[last + std::size_t{1}];
      }
      Flags flags(scope_);
      std::int64_t open = 0;
      for (std::size_t i = 0; i < scope_; ++i)
        flags[i] = (open += opened[i]) > 0 ? 1 : 0;
      return flags;
    }
    }
  }

  Flags nearest(const Vec3& point, double radius) const {
    Flags flags(scope_);
    std::size_t best = scope_;
    double best_distance = radius;
    for (std::size_t i = 0; i < scope_; ++i) {
      const double distance = norm(model_.nodes[i].position - point);
      if (best == scope_ ? distance <= radius : distance < best_distance) {
        best = i;
        best_distance = distance;
      }
    }
    if (best != scope_)
      flags[best] = 1;
    return flags;
  }

  Flags boundary() {
    Flags flags(scope_);
    for (const std::uint32_t node : border_points(model_.nodes.size(), model_.triangles))
      flags[node] = 1;
    return flags;
  }

  Flags component(std::uint32_t index) {
    if (components_.of_node.empty())
      components_ = components(model_);
    if (index >= components_.count)
      throw Error("component " + std::to_string(index) + " does not exist, expected 0 to " +
                  std::to_string(components_.count - 1));
    Flags flags(scope_);
    for (std::size_t i = 0; i < scope_; ++i)
      flags[i] = components_.of_node[i] == index ? 1 : 0;
    return flags;
  }

  const Model& model_;
  std::size_t surface_, body_;
  std::size_t scope_; ///< nodes below this one are considered
  std::vector<NodeRanges> ranges_;
  Components components_;
};

} // namespace

Selector parse_selector(std::string_view text) {
  return Parser(text).parse();
}

std::vector<std::string> node_list_names(const Selector& selector) {
  std::vector<std::string> names;
  for (const Selector::Step& step : selector.steps)
    if (step.op == Op::file)
      names.push_back(step.file_name);
  return names;
}

namespace {

std::string place_text(const Vec3& p) {
  return number_text(p.x) + "," + number_text(p.y) + "," + number_text(p.z);
}

/// What a near: that misses may have meant: the node next to its point, and where the model is.
std::string nearest_to(const Model& model, std::size_t surface, const Selector& selector) {
  const auto near = std::ranges::find(selector.steps, Selector::Op::near, &Selector::Step::op);
  if (near == selector.steps.end() || surface == 0)
    return "";
  const Vec3 point{near->numbers[0], near->numbers[1], near->numbers[2]};
  std::size_t best = 0;
  Box3 box;
  for (std::size_t i = 0; i < surface; ++i) {
    const Vec3& p = model.nodes[i].position;
    box.add(p);
    if (norm(p - point) < norm(model.nodes[best].position - point))
      best = i;
  }
  const Vec3& nearest = model.nodes[best].position;
  std::array<char, 32> distance{};
  (void)std::snprintf(distance.data(), distance.size(), "%.3g", norm(nearest - point));
  return "; the nearest is node " + std::to_string(best) + " at " + place_text(nearest) + ", " +
         distance.data() + " mm away, the model's box is " + place_text(box.min) + " to " +
         place_text(box.max);
}

bool has_numbers_alone(const Selector& selector) {
  const Op first = selector.steps.front().op;
  return selector.steps.size() == 1 && (first == Op::nodes || first == Op::file);
}

/// Without a look at the model: who drives a scene names a node in each line.
std::vector<std::uint32_t> numbered_nodes(const Model& model, const Selector& selector,
                                          const LoadNodeList& load) {
  const Selector::Step& only = selector.steps.front();
  NodeRanges ranges = only.op == Op::file ? load_ranges(only.file_name, load) : only.ranges;
  require_nodes(ranges, model.nodes.size());
  return nodes_of(std::move(ranges));
}

} // namespace

std::vector<std::uint32_t> select_nodes(const Model& model, const Selector& selector,
                                        const LoadNodeList& load, SelectorScope scope) {
  const NodeCounts counts = has_numbers_alone(selector) ? NodeCounts{} : node_counts(model);
  return select_nodes(model, counts, selector, load, scope);
}

std::vector<std::uint32_t> select_nodes(const Model& model, const NodeCounts& counts,
                                        const Selector& selector, const LoadNodeList& load,
                                        SelectorScope scope) {
  std::vector<std::uint32_t> selected;
  try {
    selected = has_numbers_alone(selector)
                   ? numbered_nodes(model, selector, load)
                   : Evaluator(model, counts, selector, load, scope).run(selector);
  } catch (const Error& error) {
    if (!error.place().empty())
      throw;
    throw Error("selector " + quote(selector.text) + ": " + error.what());
  }
  if (selected.empty())
    throw Error("selector " + quote(selector.text) + " selects no node, expected at least one" +
                nearest_to(model, counts.surface, selector));
  return selected;
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
                  quote(std::string_view(
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

} // namespace gewebe
