#include "model/selector.h"

#include "base/error.h"
#include "mesh/border.h"
#include "model/selector_internal.h"
#include "text/number_text.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace gewebe::model {
namespace {

using Op = Selector::Op;
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

/// Evaluation of a selector. Data of the model is computed once, when it is first needed.
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
    for (const std::uint32_t node : mesh::border_points(model_.nodes.size(), model_.triangles))
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

std::string place_text(const Vec3& p) {
  return text::number_text(p.x) + "," + text::number_text(p.y) + "," + text::number_text(p.z);
}

/// Where the model is, for a selector that selects nothing; for one with near: also the node
/// nearest to its point.
std::string model_box(const Model& model, std::size_t surface, const Selector& selector) {
  if (surface == 0)
    return "";
  Box3 box;
  for (std::size_t i = 0; i < surface; ++i)
    box.add(model.nodes[i].position);
  const std::string where =
      "the model's box is " + place_text(box.min) + " to " + place_text(box.max);
  const auto near = std::ranges::find(selector.steps, Selector::Op::near, &Selector::Step::op);
  if (near == selector.steps.end())
    return "; " + where;
  const Vec3 point{near->numbers[0], near->numbers[1], near->numbers[2]};
  std::size_t best = 0;
  for (std::size_t i = 1; i < surface; ++i)
    if (norm(model.nodes[i].position - point) < norm(model.nodes[best].position - point))
      best = i;
  const Vec3& nearest = model.nodes[best].position;
  std::array<char, 32> distance{};
  (void)std::snprintf(distance.data(), distance.size(), "%.3g", norm(nearest - point));
  return "; the nearest is node " + std::to_string(best) + " at " + place_text(nearest) + ", " +
         distance.data() + " mm away, " + where;
}

bool has_numbers_alone(const Selector& selector) {
  const Op first = selector.steps.front().op;
  return selector.steps.size() == 1 && (first == Op::nodes || first == Op::file);
}

/// Fast path for plain node numbers, without a pass over the model: a command for each node is
/// common in interactive scenes.
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
    throw Error("selector " + quoted_selector(selector.text) + ": " + error.what());
  }
  if (selected.empty())
    throw Error("selector " + quoted_selector(selector.text) +
                " selects no node, expected at least one" +
                model_box(model, counts.surface, selector));
  return selected;
}

} // namespace gewebe::model
