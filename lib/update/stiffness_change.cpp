#include "update/stiffness_change.h"

#include "base/error.h"
#include "base/parallel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

// Based on: Hager, Updating the Inverse of a Matrix, 1989 (a matrix changed by a low rank); that
// copies move with their origins at first, so that shared springs are no change, is our own.

namespace gewebe::update {

namespace {

constexpr double rounding = std::numeric_limits<double>::epsilon();

[[noreturn]] void not_cut(const std::string& why) {
  throw Error("the later model is not cut from the earlier one: " + why);
}

bool is_free(const model::Node& node, std::size_t axis) {
  return (node.fixed >> axis & 1) == 0;
}

/// What a spring answers to a stretch along its direction and across it.
struct Pull {
  double along = 0, across = 0;
};

Pull pull_of(const model::Spring& s, double length) {
  const double across = 1 - s.rest / length;
  // A rest length that was written as the length differs by roundings of its square root.
  return {s.stiffness, std::abs(across) <= 8 * rounding ? 0 : s.stiffness * across};
}

/// A spring that isn't the same in both models, by the old nodes that its ends come from.
struct Changed {
  std::uint32_t i = 0, j = 0; ///< old nodes, i < j
  std::uint32_t spring = 0;
  bool later = false;

  bool operator<(const Changed& o) const {
    return std::pair(i, j) != std::pair(o.i, o.j)
               ? std::pair(i, j) < std::pair(o.i, o.j)
               : std::pair(later, spring) < std::pair(o.later, o.spring);
  }
};

void check_maps(const model::Model& before, const model::Model& after,
                std::span<const std::uint32_t> origin, std::vector<std::uint32_t>& place) {
  if (origin.size() != after.nodes.size() || place.size() != before.nodes.size())
    not_cut("the maps of nodes have " + std::to_string(origin.size()) + " and " +
            std::to_string(place.size()) + " entries, expected " +
            std::to_string(after.nodes.size()) + " and " + std::to_string(before.nodes.size()));
  std::vector<std::uint32_t> lowest(before.nodes.size(), cutting::gone_node);
  for (std::uint32_t i = 0; i < origin.size(); ++i) {
    if (origin[i] >= before.nodes.size())
      not_cut("node " + std::to_string(i) + " comes from node " + std::to_string(origin[i]) +
              ", expected one below " + std::to_string(before.nodes.size()));
    lowest[origin[i]] = std::min(lowest[origin[i]], i);
    const model::Node& was = before.nodes[origin[i]];
    const model::Node& is = after.nodes[i];
    if (!(was.position == is.position))
      not_cut("node " + std::to_string(i) + " is not at the place of node " +
              std::to_string(origin[i]) + ", which it comes from");
    if (was.fixed != is.fixed)
      not_cut("node " + std::to_string(i) + " is fixed otherwise than node " +
              std::to_string(origin[i]) + ", which it comes from");
  }
  for (std::uint32_t i = 0; i < place.size(); ++i) {
    if (place[i] >= origin.size())
      place[i] = lowest[i];
    else if (origin[place[i]] != i)
      not_cut("node " + std::to_string(i) + " is said to be node " + std::to_string(place[i]) +
              " now, which comes from node " + std::to_string(origin[place[i]]));
  }
}

/// The springs that one of both models has alone, ordered by the old nodes that they join. Both
/// lists ascend alike where no node was renumbered, so one pass finds them.
std::vector<Changed> changed_springs(const model::Model& before, const model::Model& after,
                                     const StiffnessChange& change) {
  std::vector<Changed> changed;
  const auto earlier = [&](std::size_t e) {
    const model::Spring& s = before.springs[e];
    changed.push_back({s.i, s.j, static_cast<std::uint32_t>(e), false});
  };
  const auto later = [&](std::size_t e) {
    const model::Spring& s = after.springs[e];
    const auto [i, j] = std::minmax(change.origin[s.i], change.origin[s.j]);
    changed.push_back({i, j, static_cast<std::uint32_t>(e), true});
  };
  using Key = std::array<std::uint32_t, 3>;
  std::size_t a = 0, b = 0;
  while (a < before.springs.size() || b < after.springs.size()) {
    if (a == before.springs.size()) {
      later(b++);
      continue;
    }
    const model::Spring& was = before.springs[a];
    const std::uint32_t i = change.place[was.i], j = change.place[was.j];
    if (i == cutting::gone_node || j == cutting::gone_node || b == after.springs.size()) {
      earlier(a++);
      continue;
    }
    const model::Spring& is = after.springs[b];
    const Key old_key{static_cast<std::uint32_t>(was.kind), std::min(i, j), std::max(i, j)};
    const Key new_key{static_cast<std::uint32_t>(is.kind), is.i, is.j};
    if (old_key < new_key) {
      earlier(a++);
    } else if (new_key < old_key) {
      later(b++);
    } else {
      if (was.stiffness != is.stiffness || was.rest != is.rest) {
        earlier(a);
        later(b);
      }
      ++a;
      ++b;
    }
  }
  std::sort(changed.begin(), changed.end());
  return changed;
}

/// Entries of one row, which may come several times.
class Row {
public:
  void add(std::size_t axis, double value) {
    if (value != 0)
      entries_.emplace_back(static_cast<std::uint32_t>(axis), value);
  }
  void flush(SparseRows& rows) {
    std::stable_sort(entries_.begin(), entries_.end(),
                     [](const auto& x, const auto& y) { return x.first < y.first; });
    for (std::size_t k = 0; k < entries_.size(); ++k)
      if (k > 0 && entries_[k].first == entries_[k - 1].first)
        rows.value.back() += entries_[k].second;
      else {
        rows.axis.push_back(entries_[k].first);
        rows.value.push_back(entries_[k].second);
      }
    rows.start.push_back(rows.axis.size());
    entries_.clear();
  }

private:
  std::vector<std::pair<std::uint32_t, double>> entries_;
};

/// Two unit vectors that make a right-handed frame with n.
std::array<Vec3, 2> across(const Vec3& n) {
  int smallest = 0;
  for (int a = 1; a < 3; ++a)
    if (std::abs(n[a]) < std::abs(n[smallest]))
      smallest = a;
  const Vec3 axis{smallest == 0 ? 1.0 : 0.0, smallest == 1 ? 1.0 : 0.0, smallest == 2 ? 1.0 : 0.0};
  const Vec3 u = cross(n, axis);
  const Vec3 first = u / norm(u);
  return {first, cross(n, first)};
}

class Builder {
public:
  Builder(const model::Model& before, const model::Model& after, StiffnessChange& change)
      : before_(before), after_(after), change_(change),
        changed_(changed_springs(before, after, change)) {}

  void build() {
    for (std::size_t first = 0; first < changed_.size();) {
      std::size_t end = first + 1;
      while (end < changed_.size() && changed_[end].i == changed_[first].i &&
             changed_[end].j == changed_[first].j)
        ++end;
      group(first, end);
      first = end;
    }
    change_.springs = change_.rank();
    copies();
    std::sort(change_.touched.begin(), change_.touched.end());
    change_.touched.erase(std::unique(change_.touched.begin(), change_.touched.end()),
                          change_.touched.end());
  }

private:
  void touch(std::uint32_t node) {
    if (node != cutting::gone_node)
      change_.touched.push_back(node);
  }

  /// Springs between two old nodes and their copies.
  void group(std::size_t first, std::size_t end) {
    const std::uint32_t i = changed_[first].i, j = changed_[first].j;
    if (i == j)
      return; // between copies of one node, which move alike at first
    const Vec3 way = before_.nodes[j].position - before_.nodes[i].position;
    const double length = norm(way);
    Pull net, size;
    bool same = end - first == 2 && !changed_[first].later && changed_[first + 1].later;
    for (std::size_t k = first; k < end; ++k) {
      const bool later = changed_[k].later;
      const model::Spring& s = (later ? after_ : before_).springs[changed_[k].spring];
      const Pull pull = pull_of(s, length);
      const double sign = later ? 1 : -1;
      net.along += sign * pull.along;
      net.across += sign * pull.across;
      size.along += std::abs(pull.along);
      size.across += std::abs(pull.across);
    }
    if (same) { // renumbered, or of another kind
      const model::Spring& is = after_.springs[changed_[first + 1].spring];
      const auto [p, q] = std::minmax(change_.place[i], change_.place[j]);
      same = is.i == p && is.j == q && net.along == 0 && net.across == 0;
    }
    if (same)
      return;
    touch(change_.place[i]);
    touch(change_.place[j]);
    for (std::size_t k = first; k < end; ++k)
      if (changed_[k].later) {
        touch(after_.springs[changed_[k].spring].i);
        touch(after_.springs[changed_[k].spring].j);
      }
    const Vec3 n = way / length;
    // What is left of shares that add up to the whole is rounding.
    if (!(std::abs(net.along) <= 4 * rounding * size.along))
      spring(i, j, n, net.along);
    if (!(std::abs(net.across) <= 4 * rounding * (size.along + size.across)))
      for (const Vec3& t : across(n))
        spring(i, j, t, net.across);
  }

  void spring(std::uint32_t i, std::uint32_t j, const Vec3& n, double by) {
    const auto ends = [&](Row& row, const std::uint32_t p, const std::uint32_t q) {
      for (std::size_t a = 0; a < 3; ++a) {
        const double value = n[static_cast<int>(a)];
        if (p != cutting::gone_node && is_free(before_.nodes[i], a))
          row.add(3 * std::size_t{p} + a, value);
        if (q != cutting::gone_node && is_free(before_.nodes[j], a))
          row.add(3 * std::size_t{q} + a, -value);
      }
    };
    Row load;
    ends(load, change_.place[i], change_.place[j]);
    const std::size_t size = change_.load.axis.size();
    load.flush(change_.load);
    if (change_.load.axis.size() == size) { // nothing of it can move
      change_.load.start.pop_back();
      return;
    }
    Row answer;
    ends(answer, i, j);
    answer.flush(change_.answer);
    change_.weight.push_back(by);
  }

  /// Rows of K' E and of K' for the axes of copies, whose springs are all among the changed ones.
  void copies() {
    struct End {
      std::uint32_t copy, other;
      std::uint32_t spring;
    };
    std::vector<End> ends;
    std::vector<std::uint32_t> copies;
    for (std::uint32_t node = 0; node < change_.origin.size(); ++node)
      if (change_.copy(node))
        copies.push_back(node);
    std::vector<std::size_t> index(change_.origin.size(), SIZE_MAX); // of its first axis
    std::size_t next = 0;
    for (const std::uint32_t node : copies) {
      index[node] = next;
      for (std::size_t a = 0; a < 3; ++a)
        if (is_free(after_.nodes[node], a)) {
          change_.copy_axis.push_back(static_cast<std::uint32_t>(3 * std::size_t{node} + a));
          ++next;
        }
    }
    for (const Changed& c : changed_) {
      if (!c.later)
        continue;
      const model::Spring& s = after_.springs[c.spring];
      if (index[s.i] != SIZE_MAX)
        ends.push_back({s.i, s.j, c.spring});
      if (index[s.j] != SIZE_MAX)
        ends.push_back({s.j, s.i, c.spring});
    }
    std::stable_sort(ends.begin(), ends.end(),
                     [](const End& x, const End& y) { return x.copy < y.copy; });
    std::size_t first = 0;
    for (const std::uint32_t node : copies) {
      while (first < ends.size() && ends[first].copy < node)
        ++first;
      std::size_t end = first;
      while (end < ends.size() && ends[end].copy == node)
        ++end;
      const std::uint32_t origin = change_.origin[node], kept = change_.place[origin];
      touch(node);
      touch(kept);
      for (std::size_t a = 0; a < 3; ++a) {
        if (!is_free(after_.nodes[node], a))
          continue;
        Row load, answer, block;
        load.add(3 * std::size_t{node} + a, 1);
        load.add(3 * std::size_t{kept} + a, -1);
        for (std::size_t k = first; k < end; ++k) {
          const Vec3 way = after_.nodes[ends[k].other].position - after_.nodes[node].position;
          const double length = norm(way);
          const Vec3 n = way / length;
          const Pull pull = pull_of(after_.springs[ends[k].spring], length);
          const std::uint32_t other = ends[k].other, far = change_.origin[other];
          std::size_t own_at = index[node], far_at = index[other];
          for (std::size_t b = 0; b < 3; ++b) {
            const double nn = n[static_cast<int>(a)] * n[static_cast<int>(b)];
            const double value = pull.along * nn + pull.across * ((a == b ? 1 : 0) - nn);
            if (is_free(after_.nodes[node], b)) {
              answer.add(3 * std::size_t{origin} + b, value);
              block.add(own_at++, value);
            }
            if (is_free(after_.nodes[other], b)) {
              answer.add(3 * std::size_t{far} + b, -value);
              if (index[other] != SIZE_MAX)
                block.add(far_at++, -value);
            }
          }
        }
        load.flush(change_.load);
        answer.flush(change_.answer);
        block.flush(change_.copy_block);
        change_.weight.push_back(1);
      }
      first = end;
    }
  }

  const model::Model& before_;
  const model::Model& after_;
  StiffnessChange& change_;
  std::vector<Changed> changed_;
};

} // namespace

double SparseRows::times(std::size_t r, std::span<const double> x) const {
  double sum = 0;
  for (std::size_t k = start[r]; k < start[r + 1]; ++k)
    sum += value[k] * x[axis[k]];
  return sum;
}

void SparseRows::add_to(std::size_t r, double factor, std::span<double> x) const {
  for (std::size_t k = start[r]; k < start[r + 1]; ++k)
    x[axis[k]] += factor * value[k];
}

StiffnessChange stiffness_change(const model::Model& before, const model::Model& after,
                                 std::span<const std::uint32_t> origin,
                                 std::span<const std::uint32_t> place) {
  StiffnessChange change;
  change.old_axes = 3 * before.nodes.size();
  change.new_axes = 3 * after.nodes.size();
  change.origin.assign(origin.begin(), origin.end());
  change.place.assign(place.begin(), place.end());
  check_maps(before, after, origin, change.place);
  Builder(before, after, change).build();
  return change;
}

void copy_displacements(const StiffnessChange& change, std::span<const double> x,
                        std::span<double> on_new) {
  for (std::size_t i = 0; i < change.origin.size(); ++i)
    std::copy_n(x.begin() + static_cast<std::ptrdiff_t>(3 * std::size_t{change.origin[i]}), 3,
                on_new.begin() + static_cast<std::ptrdiff_t>(3 * i));
}

std::vector<double> change_response(const StiffnessChange& change, const AxesSolve& solve,
                                    const Context& context) {
  constexpr std::size_t at_once = 24;
  const std::size_t axes = change.new_axes;
  require_memory(context, 16.0 * static_cast<double>(axes * change.rank()),
                 "the responses to a cut");
  std::vector<double> response(axes * change.rank());
  parallel_blocks(context, change.rank(), at_once, [&](std::size_t begin, std::size_t end) {
    const std::span<double> some = std::span(response).subspan(begin * axes, (end - begin) * axes);
    for (std::size_t k = begin; k < end; ++k)
      change.load.add_to(k, 1, some.subspan((k - begin) * axes, axes));
    solve(some, end - begin);
  });
  return response;
}

} // namespace gewebe::update
