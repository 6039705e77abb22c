#include "cholesky/front_tree.h"

#include <algorithm>
#include <utility>

// Based on: Liu, The role of elimination trees in sparse factorization, 1990 (the tree, postorder),
// and Ashcraft & Grimes, The influence of relaxed supernode partitions on the multifrontal method,
// 1989 (joining fronts).

namespace gewebe::cholesky {

namespace {

constexpr std::uint32_t none = FrontTree::none;

std::vector<std::uint32_t> positions(std::size_t nodes, std::span<const std::uint32_t> order) {
  std::vector<std::uint32_t> position(nodes, none);
  for (std::uint32_t k = 0; k < order.size(); ++k)
    position[order[k]] = k;
  return position;
}

/// By position: the position of the parent, or none.
std::vector<std::uint32_t> elimination_tree(const BlockGraph& graph,
                                            std::span<const std::uint32_t> order,
                                            std::span<const std::uint32_t> position) {
  std::vector<std::uint32_t> parent(order.size(), none), ancestor(order.size(), none), earlier;
  for (std::uint32_t k = 0; k < order.size(); ++k) {
    // Which they are is as good as random, so that they are sorted out without a branch.
    const auto others = graph.of(order[k]);
    earlier.resize(std::max(earlier.size(), others.size()));
    std::size_t count = 0;
    for (const std::uint32_t other : others) {
      earlier[count] = position[other];
      count += earlier[count] < k ? 1U : 0U;
    }
    for (std::uint32_t at : std::span(earlier).first(count))
      while (at < k) { // climbs, and shortens the path for later searches
        const std::uint32_t next = std::exchange(ancestor[at], k);
        if (next == none) {
          parent[at] = k;
          break;
        }
        at = next;
      }
  }
  return parent;
}

/// Positions, children right before their parents, the smaller ones first.
std::vector<std::uint32_t> postorder(std::span<const std::uint32_t> parent) {
  const std::size_t n = parent.size();
  // Lists of children from the largest to the smallest, so that a stack ends with the smallest.
  std::vector<std::uint32_t> child(n + 1, none), sibling(n, none), sorted, stack;
  for (std::uint32_t k = 0; k < n; ++k) {
    const std::size_t under = parent[k] == none ? n : parent[k];
    sibling[k] = std::exchange(child[under], k);
  }
  const auto push_children = [&](std::size_t of) {
    for (std::uint32_t c = std::exchange(child[of], none); c != none; c = sibling[c])
      stack.push_back(c);
  };
  sorted.reserve(n);
  push_children(n);
  while (!stack.empty()) {
    const std::uint32_t at = stack.back();
    if (child[at] != none) {
      push_children(at);
      continue;
    }
    sorted.push_back(at);
    stack.pop_back();
  }
  return sorted;
}

/// Of a run of positions, which are eliminated together.
struct Run {
  std::uint32_t first = 0, last = 0;
  std::vector<std::uint32_t> boundary; // positions, in any order; those up to `last` don't count
  std::uint64_t zeros = 0;             // entries of L that are there for nothing
  std::uint64_t rows = 0;              // axes: eliminated, and
  std::uint64_t below = 0;             // in the boundary
};

std::uint64_t entries(std::uint64_t rows, std::uint64_t below) {
  return rows * (rows + 1) / 2 + rows * below;
}

/// Whether a run of so many axes may hold this share of zeros: what made solving and factoring of
/// nets and lattices quickest, about as CHOLMOD has it.
bool may_hold(std::uint64_t rows, double share) {
  return rows <= 6 || (rows <= 16 && share < 0.5) || (rows <= 48 && share < 0.1) || share < 0.03;
}

} // namespace

namespace {

/// Runs as they grow, position by position.
class Runs {
public:
  Runs(const BlockGraph& graph, const FrontTree& tree, std::span<const std::uint32_t> parent)
      : graph_(graph), tree_(tree), mark_(parent.size(), none), run_of_(parent.size()),
        child_(parent.size(), none), sibling_(parent.size(), none), added_(parent.size() + 1) {
    for (std::size_t k = parent.size(); k-- > 0;)
      if (parent[k] != none)
        sibling_[k] = std::exchange(child_[parent[k]], static_cast<std::uint32_t>(k));
    runs_.reserve(parent.size() / 2);
    for (std::uint32_t k = 0; k < parent.size(); ++k)
      add(k);
  }

  std::vector<Run>& runs() { return runs_; }

private:
  std::uint64_t axes(std::uint32_t k) const { return graph_.axes[tree_.sequence[k]]; }

  /// What is marked with a run's number is in its boundary, or eliminated by it; a run that grows
  /// keeps its marks.
  void add(std::uint32_t k) {
    // The last child ends right before k; what it reaches is most of what k does.
    Run* last = nullptr;
    std::uint32_t mark = static_cast<std::uint32_t>(runs_.size());
    count_ = 0;
    if (child_[k] != none) {
      last = &runs_.back();
      --mark;
      mark_[k] = mark;
      for (std::uint32_t c = child_[k]; c != k - 1; c = sibling_[c])
        for (const std::uint32_t b : runs_[run_of_[c]].boundary)
          reach(b, b > k, mark);
    }
    for (const std::uint32_t other : graph_.of(tree_.sequence[k])) {
      const std::uint32_t b = tree_.position[other];
      const bool later = b + 1 > k + 1; // none + 1 is 0
      reach(later ? b : k, later, mark);
    }
    const std::span<const std::uint32_t> added = std::span(added_).first(count_);
    std::uint64_t below = 0;
    for (const std::uint32_t b : added)
      below += axes(b);
    if (last != nullptr) {
      below += last->below - axes(k);
      // Joined, the run's columns reach over all of it.
      const std::uint64_t rows = last->rows + axes(k);
      const std::uint64_t zeros = last->zeros + last->rows * (below + axes(k) - last->below);
      if (may_hold(rows, static_cast<double>(zeros) / static_cast<double>(entries(rows, below)))) {
        last->boundary.insert(last->boundary.end(), added.begin(), added.end());
        last->last = k;
        last->zeros = zeros;
        last->rows = rows;
        last->below = below;
        run_of_[k] = mark;
        return;
      }
    }
    Run run{k, k, {}, 0, axes(k), below};
    run.boundary.reserve(added.size() + (last == nullptr ? 0 : last->boundary.size()));
    if (last != nullptr)
      for (const std::uint32_t b : last->boundary)
        if (b > k)
          run.boundary.push_back(b);
    run.boundary.insert(run.boundary.end(), added.begin(), added.end());
    run_of_[k] = static_cast<std::uint32_t>(runs_.size());
    for (const std::uint32_t b : run.boundary)
      mark_[b] = run_of_[k];
    runs_.push_back(std::move(run));
  }

  /// Without a branch, since the processor cannot predict which are new. Marks of nodes that are
  /// not later than the added position are not read again.
  void reach(std::uint32_t b, bool later, std::uint32_t mark) {
    added_[count_] = b;
    count_ += std::size_t{later} & std::size_t{mark_[b] != mark};
    mark_[b] = mark;
  }

  const BlockGraph& graph_;
  const FrontTree& tree_;
  std::vector<Run> runs_; // ascending
  std::vector<std::uint32_t> mark_, run_of_, child_, sibling_;
  std::vector<std::uint32_t> added_; // the first count_, by the position that is added
  std::size_t count_ = 0;
};

} // namespace

FrontTree front_tree(const BlockGraph& graph, std::span<const std::uint32_t> order) {
  FrontTree tree;
  std::vector<std::uint32_t> parent;
  {
    const std::vector<std::uint32_t> position = positions(graph.axes.size(), order);
    const std::vector<std::uint32_t> above = elimination_tree(graph, order, position);
    tree.sequence = postorder(above);
    const std::vector<std::uint32_t> moved = positions(order.size(), tree.sequence);
    parent.resize(order.size());
    for (std::size_t k = 0; k < order.size(); ++k)
      parent[moved[k]] = above[k] == none ? none : moved[above[k]];
    for (std::uint32_t& k : tree.sequence)
      k = order[k];
  }
  tree.position = positions(graph.axes.size(), tree.sequence);
  Runs all(graph, tree, parent);
  std::vector<Run>& runs = all.runs();
  std::vector<std::uint32_t> front_of(parent.size());
  // Boundaries ascend when they are filled position by position.
  std::vector<std::size_t> reached(parent.size() + 1, 0); // how many fronts reach each position
  tree.first.reserve(runs.size() + 1);
  tree.start.reserve(runs.size() + 1);
  tree.first.push_back(0);
  tree.start.push_back(0);
  for (std::uint32_t f = 0; f < runs.size(); ++f) {
    Run& run = runs[f];
    std::fill(front_of.begin() + run.first, front_of.begin() + run.last + 1, f);
    std::erase_if(run.boundary, [&](std::uint32_t b) { return b <= run.last; });
    for (const std::uint32_t b : run.boundary)
      ++reached[b + std::size_t{1}];
    tree.first.push_back(run.last + 1);
    tree.start.push_back(tree.start.back() + run.boundary.size());
  }
  for (std::size_t b = 0; b < parent.size(); ++b)
    reached[b + 1] += reached[b];
  std::vector<std::uint32_t> fronts(tree.start.back()); // that reach each position
  {
    std::vector<std::size_t> next(reached.begin(), reached.end() - 1);
    for (std::uint32_t f = 0; f < runs.size(); ++f)
      for (const std::uint32_t b : runs[f].boundary)
        fronts[next[b]++] = f;
  }
  tree.boundary.resize(fronts.size());
  std::vector<std::size_t> next(tree.start.begin(), tree.start.end() - 1);
  tree.parent.assign(runs.size(), none);
  for (std::size_t b = 0; b < parent.size(); ++b)
    for (std::size_t k = reached[b]; k < reached[b + 1]; ++k) {
      const std::uint32_t f = fronts[k];
      if (next[f] == tree.start[f])
        tree.parent[f] = front_of[b];
      tree.boundary[next[f]++] = tree.sequence[b];
    }
  return tree;
}

} // namespace gewebe::cholesky
