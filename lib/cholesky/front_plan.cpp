#include "cholesky/front_plan_internal.h"

#include <algorithm>

namespace gewebe::cholesky {

namespace {

constexpr std::uint32_t none = FrontTree::none;

/// What a matrix takes on a stack: each begins at a line of the cache.
std::size_t stacked(std::size_t below) {
  constexpr std::size_t line = 64 / sizeof(double);
  return (packed_triangle(below) + line - 1) / line * line;
}

} // namespace

double front_operations(const Front& front) {
  const auto c = static_cast<double>(front.columns), b = static_cast<double>(front.below());
  return c * c * c / 3 + c * c * b + c * b * b;
}

FrontPlan front_plan(const FrontTree& tree, std::span<const double> under, double all, int threads,
                     bool keep_updates) {
  FrontPlan p;
  const std::size_t count = tree.fronts();
  const double share = threads == 1 ? 2 * all : all / 16;
  std::vector<std::size_t> smallest(count); // front of each subtree
  for (std::size_t f = 0; f < count; ++f)
    smallest[f] = f;
  for (std::size_t f = 0; f < count; ++f)
    if (const std::uint32_t parent = tree.parent[f]; parent != none)
      smallest[parent] = std::min(smallest[parent], smallest[f]);
  p.children.resize(count);
  for (std::uint32_t f = 0; f < count; ++f)
    if (tree.parent[f] != none)
      p.children[tree.parent[f]].push_back(f);
  p.place.assign(count, keep_updates ? FrontPlan::own : 0);
  for (std::size_t f = count; f-- > 0 && !keep_updates;)
    if (tree.parent[f] != none)
      p.place[f] = p.place[tree.parent[f]] == 0 ? 1 : 0;
  for (std::size_t f = 0; f < count; ++f)
    if (under[f] > share) {
      p.above.push_back(f);
    } else if (under[f] > 0 && (tree.parent[f] == none || under[tree.parent[f]] > share)) {
      p.subtrees.emplace_back(smallest[f], f + 1);
      p.place[f] = FrontPlan::own; // another thread may take it, when the stacks are gone
    }
  std::stable_sort(p.subtrees.begin(), p.subtrees.end(), [&](const auto& a, const auto& b) {
    return under[a.second - 1] > under[b.second - 1];
  });
  return p;
}

void UpdateStacks::Size::push(std::uint8_t stack, std::size_t below) {
  now.at(stack) += stacked(below);
  peak.at(stack) = std::max(peak.at(stack), now.at(stack));
}

void UpdateStacks::Size::pop(std::uint8_t stack, std::size_t below) {
  now.at(stack) -= stacked(below);
}

void UpdateStacks::Size::compute(const FrontPlan& plan, std::span<const Front> fronts,
                                 std::size_t f) {
  if (plan.place[f] != FrontPlan::own)
    push(plan.place[f], fronts[f].below());
  for (const std::uint32_t child : plan.children[f])
    if (plan.place[child] != FrontPlan::own)
      pop(plan.place[child], fronts[child].below());
}

void UpdateStacks::prepare(const Size& size) {
  for (std::size_t stack = 0; stack < 2; ++stack)
    (void)memory_.at(stack).reserve(size.peak.at(stack), false);
}

double* UpdateStacks::push(std::uint8_t stack, std::size_t below) {
  double* const at = memory_.at(stack).data() + size_.now.at(stack);
  size_.push(stack, below);
  return at;
}

void UpdateStacks::pop(std::uint8_t stack, std::size_t below) {
  size_.pop(stack, below);
}

} // namespace gewebe::cholesky
