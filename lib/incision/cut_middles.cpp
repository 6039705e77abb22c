#include "incision/cut_middles_internal.h"

#include "base/error.h"
#include "tetrahedra/check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace gewebe::incision {
namespace {

using Ends = std::array<std::uint32_t, 2>;

Ends ascending(std::uint32_t a, std::uint32_t b) {
  return {std::min(a, b), std::max(a, b)};
}

/// An edge of a changed tetrahedron.
struct EdgeOf {
  Ends original{}, ends{};
  std::uint32_t tetrahedron = 0, k = 0;

  auto operator<=>(const EdgeOf&) const = default;
};

/// An edge before, with its middle.
struct EdgeBefore {
  Ends ends{};
  std::uint32_t middle = 0;

  auto operator<=>(const EdgeBefore&) const = default;
};

std::size_t edge_between(std::size_t a, std::size_t b) {
  std::size_t k = 0;
  while (ascending(tetrahedra::tetrahedron_edges[k][0], tetrahedra::tetrahedron_edges[k][1]) !=
         ascending(static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b)))
    ++k;
  return k;
}

class Adder {
public:
  Adder(const tetrahedra::TetMesh& before, std::span<const std::uint32_t> original, TetCut& cut)
      : before_(before), original_(original), cut_(cut), changed_(before.tetrahedra.size()) {
    for (const std::uint32_t t : cut.changed)
      changed_[t] = true;
  }

  void add() {
    gather();
    for (std::size_t begin = 0; begin < edges_.size();) {
      std::size_t end = begin;
      while (end < edges_.size() && edges_[end].original == edges_[begin].original)
        ++end;
      number(std::span<const EdgeOf>(edges_).subspan(begin, end - begin));
      begin = end;
    }
    for (WallTriangle& wall : cut_.wall)
      for (std::size_t side = 0; side < 2; ++side)
        wall.middles[side] = middles_of(wall.tetrahedron[side], wall.corners[side]);
    for (CutFace& face : cut_.surface)
      face.middles = middles_of(face.tetrahedron, face.corners);
  }

private:
  void gather() {
    for (const std::uint32_t t : cut_.changed)
      for (std::size_t k = 0; k < 6; ++k)
        old_.push_back({ascending(before_.tetrahedra[t][tetrahedra::tetrahedron_edges[k][0]],
                                  before_.tetrahedra[t][tetrahedra::tetrahedron_edges[k][1]]),
                        before_.middles[t][k]});
    std::ranges::sort(old_);
    elsewhere_.resize(before_.points.size());
    for (std::uint32_t t = 0; t < cut_.mesh.tetrahedra.size(); ++t) {
      if (!changed_[cut_.tetrahedron[t]]) {
        for (const std::uint32_t middle : before_.middles[t])
          elsewhere_[middle] = 1;
        continue;
      }
      for (std::uint32_t k = 0; k < 6; ++k) {
        const std::uint32_t a = cut_.mesh.tetrahedra[t][tetrahedra::tetrahedron_edges[k][0]],
                            b = cut_.mesh.tetrahedra[t][tetrahedra::tetrahedron_edges[k][1]];
        edges_.push_back({ascending(original_[a], original_[b]), ascending(a, b), t, k});
      }
    }
    std::ranges::sort(edges_);
  }

  /// The middle before of an edge, or none.
  std::uint32_t middle_before(const Ends& ends) const {
    const auto at = std::ranges::lower_bound(old_, ends, {}, &EdgeBefore::ends);
    return at != old_.end() && at->ends == ends ? at->middle : TetNodeOrigin::none;
  }

  bool has_moved(std::uint32_t node) const { return cut_.origin[node].node == TetNodeOrigin::none; }

  /// Edges that are one and its copies.
  void number(std::span<const EdgeOf> edges) {
    const Ends& original = edges.front().original;
    const std::uint32_t old = middle_before(original);
    const bool first_of_all = std::ranges::find(edges, original, &EdgeOf::ends) == edges.end() &&
                              old != TetNodeOrigin::none && elsewhere_[old] == 0;
    for (std::size_t begin = 0; begin < edges.size();) {
      const EdgeOf& edge = edges[begin];
      const bool keeps =
          old != TetNodeOrigin::none && (edge.ends == original || (first_of_all && begin == 0));
      const std::uint32_t middle = keeps ? old : add_node();
      place(middle, old, edge);
      for (; begin < edges.size() && edges[begin].ends == edge.ends; ++begin)
        cut_.mesh.middles[edges[begin].tetrahedron][edges[begin].k] = middle;
    }
  }

  std::uint32_t add_node() {
    if (cut_.mesh.points.size() >= UINT32_MAX - 1)
      throw Error("too many nodes after the cut, expected fewer than " +
                  std::to_string(UINT32_MAX));
    cut_.mesh.points.emplace_back();
    cut_.origin.emplace_back();
    return static_cast<std::uint32_t>(cut_.mesh.points.size() - 1);
  }

  void place(std::uint32_t middle, std::uint32_t old, const EdgeOf& edge) {
    const auto& [a, b] = edge.ends;
    if (old != TetNodeOrigin::none && !has_moved(a) && !has_moved(b)) {
      cut_.mesh.points[middle] = before_.points[old];
      cut_.origin[middle] = {old, TetNodeOrigin::none, {}};
      return;
    }
    cut_.mesh.points[middle] = (cut_.mesh.points[a] + cut_.mesh.points[b]) * 0.5;
    const std::uint32_t parent = cut_.tetrahedron[edge.tetrahedron];
    TetNodeOrigin origin{TetNodeOrigin::none, parent, {}};
    const std::array<double, 4> at_a = weights_in(parent, a), at_b = weights_in(parent, b);
    for (std::size_t k = 0; k < 4; ++k)
      origin.weights[k] = (at_a[k] + at_b[k]) * 0.5;
    if (!(std::ranges::min(origin.weights) >= 0))
      look_around(cut_.mesh.points[middle], origin);
    cut_.origin[middle] = origin;
  }

  /// Where nodes have moved a middle can lie beside its tetrahedron: it is in a neighbour then, or
  /// nearest to one.
  void look_around(const Vec3& place, TetNodeOrigin& origin) {
    if (stars_.empty()) {
      for (const std::uint32_t t : cut_.changed)
        for (const std::uint32_t corner : before_.tetrahedra[t])
          stars_.push_back({corner, t});
      std::ranges::sort(stars_);
    }
    const Tetrahedron corners = before_.tetrahedra[origin.tetrahedron];
    for (const std::uint32_t corner : corners)
      for (auto at = std::ranges::lower_bound(stars_, Ends{corner, 0});
           at != stars_.end() && (*at)[0] == corner; ++at) {
        const std::array<double, 4> weights = weights_at((*at)[1], place);
        if (std::ranges::min(weights) > std::ranges::min(origin.weights))
          origin = {TetNodeOrigin::none, (*at)[1], weights};
      }
  }

  /// Barycentric coordinates of a corner in a tetrahedron before.
  std::array<double, 4> weights_in(std::uint32_t t, std::uint32_t node) const {
    const TetNodeOrigin& origin = cut_.origin[node];
    const Tetrahedron& corners = before_.tetrahedra[t];
    if (origin.tetrahedron == t)
      return origin.weights;
    const auto at = std::ranges::find(corners, origin.node);
    if (at == corners.end())
      return weights_at(t, cut_.mesh.points[node]);
    std::array<double, 4> weights{};
    weights[static_cast<std::size_t>(at - corners.begin())] = 1;
    return weights;
  }

  std::array<double, 4> weights_at(std::uint32_t t, const Vec3& place) const {
    std::array<Vec3, 4> p;
    for (std::size_t k = 0; k < 4; ++k)
      p[k] = before_.points[before_.tetrahedra[t][k]];
    const double whole = tetrahedra::tetrahedron_volume(p[0], p[1], p[2], p[3]);
    std::array<double, 4> weights{};
    double rest = 1;
    for (std::size_t k = 1; k < 4; ++k) {
      std::array<Vec3, 4> q = p;
      q[k] = place;
      weights[k] = tetrahedra::tetrahedron_volume(q[0], q[1], q[2], q[3]) / whole;
      rest -= weights[k];
    }
    weights[0] = rest;
    return weights;
  }

  /// Of the edges 01, 12, 20 of a face of a tetrahedron.
  Triangle middles_of(std::uint32_t t, const Triangle& face) const {
    const Tetrahedron& corners = cut_.mesh.tetrahedra[t];
    std::array<std::size_t, 3> at{};
    for (std::size_t c = 0; c < 3; ++c)
      at[c] = static_cast<std::size_t>(std::ranges::find(corners, face[c]) - corners.begin());
    const EdgeMiddles& middles = cut_.mesh.middles[t];
    return {middles[edge_between(at[0], at[1])], middles[edge_between(at[1], at[2])],
            middles[edge_between(at[2], at[0])]};
  }

  const tetrahedra::TetMesh& before_;
  std::span<const std::uint32_t> original_;
  TetCut& cut_;
  std::vector<bool> changed_;           // tetrahedra before
  std::vector<std::uint8_t> elsewhere_; // is it a middle of an unchanged tetrahedron?
  std::vector<EdgeBefore> old_;         // of changed tetrahedra
  std::vector<EdgeOf> edges_;
  std::vector<Ends> stars_; // corners with their changed tetrahedra
};

} // namespace

void check_straight(const tetrahedra::TetMesh& mesh, const CutRegion& region) {
  for (const RegionTet& tet : region.tets)
    for (std::size_t k = 0; k < 6; ++k) {
      const std::uint32_t a = mesh.tetrahedra[tet.number][tetrahedra::tetrahedron_edges[k][0]],
                          b = mesh.tetrahedra[tet.number][tetrahedra::tetrahedron_edges[k][1]];
      const Vec3 &p = mesh.points[a], &q = mesh.points[b];
      const Vec3& middle = mesh.points[mesh.middles[tet.number][k]];
      if (!(norm(middle - (p + q) * 0.5) <= tetrahedra::curved_edge * norm(q - p)))
        throw Error("the edge from node " + std::to_string(a) + " to " + std::to_string(b) +
                    " near the blade is curved, expected straight ones");
    }
}

void add_middles(const tetrahedra::TetMesh& before, std::span<const std::uint32_t> original,
                 TetCut& cut) {
  Adder(before, original, cut).add();
}

std::vector<std::pair<std::uint32_t, double>> shares_of(const tetrahedra::TetMesh& before,
                                                        const TetNodeOrigin& origin) {
  if (origin.node != TetNodeOrigin::none)
    return {{origin.node, 1}};
  std::vector<std::pair<std::uint32_t, double>> shares;
  const auto add = [&](std::uint32_t node, double share) {
    if (share != 0)
      shares.emplace_back(node, share);
  };
  constexpr double rounding = 1e-13; // of volumes: on a face a place has no share of what is off it
  std::array<double, 4> w = origin.weights;
  for (double& weight : w)
    weight = std::fabs(weight) < rounding ? 0 : weight;
  const bool quadratic = !before.middles.empty();
  for (std::size_t k = 0; k < 4; ++k)
    add(before.tetrahedra[origin.tetrahedron][k], quadratic ? w[k] * (2 * w[k] - 1) : w[k]);
  for (std::size_t k = 0; quadratic && k < 6; ++k)
    add(before.middles[origin.tetrahedron][k],
        4 * w[tetrahedra::tetrahedron_edges[k][0]] * w[tetrahedra::tetrahedron_edges[k][1]]);
  return shares;
}

std::vector<Vec3> carry_over(const tetrahedra::TetMesh& before,
                             std::span<const TetNodeOrigin> origin, std::span<const Vec3> field) {
  std::vector<Vec3> carried;
  carried.reserve(origin.size());
  for (const TetNodeOrigin& from : origin) {
    if (from.node != TetNodeOrigin::none) {
      carried.push_back(field[from.node]);
      continue;
    }
    Vec3 sum;
    for (const auto& [node, share] : shares_of(before, from))
      sum += field[node] * share;
    carried.push_back(sum);
  }
  return carried;
}

} // namespace gewebe::incision
