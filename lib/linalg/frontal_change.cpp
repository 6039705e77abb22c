// What of a factor stays when its matrix changes.

#include "linalg/frontal_factor_internal.h"

#include <algorithm>
#include <tuple>
#include <utility>

namespace gewebe::linalg {

using namespace frontal;

namespace {

/// 0, 1, 2 …: nothing has moved.
bool ascend_by_one(std::span<const std::uint32_t> numbers) {
  for (std::size_t i = 0; i < numbers.size(); ++i)
    if (numbers[i] != i)
      return false;
  return true;
}

} // namespace

bool FrontalFactor::State::held_alike(const Source& k, std::span<const std::uint32_t> origin,
                                      std::span<const std::uint32_t> place) const {
  for (std::size_t i = 0; i < k.nodes(); ++i) {
    const std::uint32_t old = origin.empty() ? static_cast<std::uint32_t>(i) : origin[i];
    const bool put = k.matrix != nullptr && !place.empty() && place[old] != i;
    if (!put && k.fixed(i) != fixed[old])
      return false;
  }
  return true;
}

std::vector<char> FrontalFactor::State::changed_rows(const model::Model& model,
                                                     std::span<const std::uint32_t> origin,
                                                     std::span<const std::uint32_t> place) const {
  const std::size_t n = model.nodes.size();
  std::vector<char> changed(n, 0), moved(n, 0);
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t old = origin.empty() ? i : origin[i];
    const bool copy = !place.empty() && place[old] != i;
    moved[i] = !(model.nodes[i].position == position[old]);
    changed[i] = copy || moved[i];
  }
  const auto mark = [&](std::uint32_t node) {
    if (node != none)
      changed[node] = 1;
  };
  const auto placed = [&](std::uint32_t old) { return place.empty() ? old : place[old]; };
  std::size_t b = 0;
  for (const model::Spring& was : springs) {
    const std::uint32_t i = placed(was.i), j = placed(was.j);
    const auto key = std::tuple(was.kind, i, j);
    for (; b < model.springs.size(); ++b) {
      const model::Spring& is = model.springs[b];
      if (i == none || j == none || !(std::tie(is.kind, is.i, is.j) < key))
        break;
      mark(is.i);
      mark(is.j);
    }
    if (i != none && j != none && b < model.springs.size()) {
      const model::Spring& is = model.springs[b];
      if (std::tie(is.kind, is.i, is.j) == key) {
        ++b;
        if (is.stiffness == was.stiffness && is.rest == was.rest && !moved[i] && !moved[j])
          continue;
      }
    }
    mark(i);
    mark(j);
  }
  for (; b < model.springs.size(); ++b) {
    mark(model.springs[b].i);
    mark(model.springs[b].j);
  }
  return changed;
}

bool FrontalFactor::State::still_fits(const SpringGraph& now,
                                      std::span<const std::uint32_t> place) const {
  if (!place.empty() || now.axes != graph.axes)
    return false;
  std::vector<std::uint32_t> mark(now.axes.size(), none);
  for (std::uint32_t i = 0; i < now.axes.size(); ++i) {
    for (const std::uint32_t other : graph.view().of(i))
      mark[other] = i;
    for (const std::uint32_t other : now.view().of(i))
      if (mark[other] != i)
        return false;
  }
  return true;
}

std::vector<std::uint32_t>
FrontalFactor::State::fronts_for(const SpringGraph& now, std::span<const std::uint32_t> origin,
                                 std::span<const std::uint32_t> place) const {
  std::vector<std::uint32_t> smallest(tree.fronts()); // of the branch of each front
  for (std::uint32_t f = 0; f < tree.fronts(); ++f)
    smallest[f] = f;
  for (std::uint32_t f = 0; f < tree.fronts(); ++f)
    if (const std::uint32_t parent = tree.parent[f]; parent != none)
      smallest[parent] = std::min(smallest[parent], smallest[f]);
  std::vector<std::uint32_t> old_front(graph.axes.size(), none);
  for (std::uint32_t f = 0; f < tree.fronts(); ++f)
    for (const std::uint32_t node : tree.eliminated(f))
      old_front[node] = f;
  std::vector<std::uint32_t> front(now.axes.size(), none);
  for (std::uint32_t i = 0; i < front.size(); ++i)
    if (const std::uint32_t old = origin.empty() ? i : origin[i]; old < old_front.size())
      front[i] = old_front[old];
  for (std::uint32_t i = 0; i < origin.size(); ++i) {
    if (place[origin[i]] == i || front[i] == none)
      continue;
    std::uint32_t lowest = none;
    for (const std::uint32_t other : now.view().of(i)) {
      std::uint32_t f = front[other];
      if (f == none || f < smallest[front[i]] || f > front[i])
        continue; // eliminated later
      if (lowest == none)
        lowest = f;
      while (f != lowest)
        (f < lowest ? f : lowest) = tree.parent[std::min(f, lowest)];
    }
    if (lowest != none)
      front[i] = lowest;
  }
  return front;
}

std::vector<std::uint32_t>
FrontalFactor::State::order_for(const SpringGraph& now, std::span<const std::uint32_t> origin,
                                std::span<const std::uint32_t> place) const {
  const std::size_t n = now.axes.size();
  const std::vector<std::uint32_t> front = fronts_for(now, origin, place);
  std::vector<std::uint32_t> copy(graph.axes.size(), none), next(n, none); // lists of copies
  std::vector<std::uint32_t> down(tree.fronts(), none); // and of those that went down into a front
  for (std::size_t i = origin.size(); i-- > 0;)
    if (place[origin[i]] != i) {
      const std::uint32_t of = front[i];
      const std::uint32_t at = tree.position[origin[i]];
      const bool stays =
          of == none || (tree.first[of] <= at && at < tree.first[of + std::size_t{1}]);
      next[i] = std::exchange(stays ? copy[origin[i]] : down[of], static_cast<std::uint32_t>(i));
    }
  std::vector<std::uint32_t> order;
  order.reserve(n);
  std::vector<char> ordered(n, 0);
  const auto put = [&](std::uint32_t node) {
    if (node == none || ordered[node])
      return;
    if (now.axes[node] > 0)
      order.push_back(node);
    ordered[node] = 1;
  };
  const auto put_all = [&](std::uint32_t first) {
    for (std::uint32_t c = first; c != none; c = next[c])
      put(c);
  };
  for (std::uint32_t f = 0; f < tree.fronts(); ++f) {
    for (const std::uint32_t old : tree.eliminated(f)) {
      put(place.empty() ? old : place[old]);
      put_all(copy[old]);
    }
    put_all(down[f]);
  }
  for (std::uint32_t i = 0; i < n; ++i) // what was not free before
    put(i);
  return order;
}

void FrontalFactor::State::refactor(const Source& k, std::span<const std::uint32_t> origin,
                                    std::span<const std::uint32_t> place,
                                    std::span<const std::uint32_t> rows, const Context& context) {
  if (!held_alike(k, origin, place)) // rows come and go within fronts
    return begin(k, context);
  cpu = context.cpu;
  SpringGraph now = k.graph();
  const std::size_t n = k.nodes();
  if (n == graph.axes.size() && ascend_by_one(origin) && ascend_by_one(place))
    origin = place = {};
  std::vector<char> changed(n, 0);
  if (k.model != nullptr)
    changed = changed_rows(*k.model, origin, place);
  for (const std::uint32_t row : rows)
    changed[row] = 1;
  std::vector<char> selected;
  if (still_fits(now, place)) {
    graph = std::move(now);
    selected.assign(tree.fronts(), 0);
    for (std::size_t f = 0; f < tree.fronts(); ++f) {
      for (const std::uint32_t node : tree.eliminated(f))
        selected[f] = static_cast<char>(selected[f] | changed[node]);
      if (selected[f] && tree.parent[f] != none)
        selected[tree.parent[f]] = 1;
    }
    factorise(k, selected, context);
    find_weakest();
  } else {
    const std::vector<std::uint32_t> order = order_for(now, origin, place);
    graph = std::move(now);
    selected = grow(order, changed, place);
    factorise(k, selected, context);
    lay_out(k);
  }
  remember(k);
}

std::vector<char> FrontalFactor::State::grow(std::span<const std::uint32_t> order,
                                             const std::vector<char>& changed,
                                             std::span<const std::uint32_t> place) {
  const cholesky::FrontTree before = std::exchange(tree, cholesky::front_tree(graph.view(), order));
  std::vector<cholesky::Front> had =
      std::exchange(fronts, std::vector<cholesky::Front>(tree.fronts()));
  std::vector<cholesky::FrontMemory> held =
      std::exchange(memory, std::vector<cholesky::FrontMemory>(tree.fronts()));
  std::vector<FrontLoad> carried =
      std::exchange(loads, std::vector<FrontLoad>(loads.empty() ? 0 : tree.fronts()));
  const auto placed = [&](std::uint32_t old) { return place.empty() ? old : place[old]; };
  // Old fronts by the first node that they eliminated.
  std::vector<std::uint32_t> front_of(graph.axes.size(), none);
  for (std::uint32_t f = 0; f < before.fronts(); ++f)
    if (const std::uint32_t node = placed(before.eliminated(f)[0]); node != none)
      front_of[node] = f;
  const auto same = [&](std::span<const std::uint32_t> a, std::span<const std::uint32_t> b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [&](std::uint32_t x, std::uint32_t y) { return x == placed(y); });
  };
  // A front is as it was only with the children that it had. Where springs went while the tree
  // stayed, a child may hang elsewhere now though no row of this front has changed since. A child
  // that is kept has kept its parent, if that is kept too: the parent eliminates the first node of
  // the child's boundary, which is the same.
  std::vector<std::uint32_t> had_children(before.fronts(), 0), kept_children(tree.fronts(), 0);
  for (const std::uint32_t parent : before.parent)
    if (parent != none)
      ++had_children[parent];
  std::vector<char> selected(tree.fronts(), 0);
  for (std::size_t f = 0; f < tree.fronts(); ++f) {
    const auto own = tree.eliminated(f);
    const std::uint32_t old = front_of[own[0]], parent = tree.parent[f];
    if (old != none) { // if only for its memory
      fronts[f] = std::move(had[old]);
      memory[f] = std::move(held[old]);
      if (!carried.empty())
        loads[f] = std::move(carried[old]);
    }
    const bool kept =
        !selected[f] && old != none && kept_children[f] == had_children[old] &&
        same(own, before.eliminated(old)) && same(tree.boundary_of(f), before.boundary_of(old)) &&
        std::none_of(own.begin(), own.end(), [&](std::uint32_t i) { return changed[i] != 0; });
    selected[f] = !kept;
    if (parent == none)
      continue;
    kept_children[parent] += kept ? 1 : 0;
    selected[parent] = static_cast<char>(selected[parent] | !kept);
  }
  return selected;
}

} // namespace gewebe::linalg
