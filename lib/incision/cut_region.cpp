#include "incision/cut_region_internal.h"

#include "base/error.h"
#include "geometry/exact_predicates.h"

#include <algorithm>
#include <cmath>
#include <compare>
#include <numeric>
#include <optional>
#include <string>
#include <utility>

namespace gewebe::incision {
namespace {

/// An edge of a candidate.
struct EdgeUse {
  std::uint32_t low = 0, high = 0;
  std::uint32_t slot = 0; // 6 candidate + k

  bool same_edge(const EdgeUse& other) const { return low == other.low && high == other.high; }
  auto operator<=>(const EdgeUse&) const = default;
};

/// A passed edge, nodes numbered as in the mesh.
struct Passed {
  std::uint32_t low = 0, high = 0;
  double share = 0;
  int direction = 0;
  bool used = false;
};

struct Candidate {
  std::uint32_t number = 0;
  std::array<std::uint32_t, 6> crossing{};
  std::array<std::int8_t, 4> side{};
  bool touched = false;
};

class Finder {
public:
  Finder(const tetrahedra::TetMesh& mesh, const BladeCutOptions& options, const Blade& blade)
      : mesh_(mesh),
        places_(options.places.empty() ? std::span<const Vec3>(mesh.points) : options.places),
        among_(options.among), blade_(blade) {}

  CutRegion find(bool wide) {
    find_candidates();
    find_passed();
    for (Candidate& candidate : candidates_)
      separate(candidate);
    gather(wide);
    return std::move(region_);
  }

private:
  /// Bits for the planes of the blade's box beyond which each node lies: tetrahedra whose nodes
  /// share one are done with, which most are.
  std::vector<std::uint8_t> beyond_box() const {
    const Box3& box = blade_.box();
    std::vector<std::uint8_t> beyond(places_.size());
    for (std::size_t n = 0; n < beyond.size(); ++n) {
      const Vec3& p = places_[n];
      beyond[n] = static_cast<std::uint8_t>(
          (p.x < box.min.x ? 1 : 0) | (p.x > box.max.x ? 2 : 0) | (p.y < box.min.y ? 4 : 0) |
          (p.y > box.max.y ? 8 : 0) | (p.z < box.min.z ? 16 : 0) | (p.z > box.max.z ? 32 : 0));
    }
    return beyond;
  }

  void find_candidates() {
    const std::vector<std::uint8_t> beyond = beyond_box();
    for (std::uint32_t t = 0; t < mesh_.tetrahedra.size(); ++t) {
      const auto& [a, b, c, d] = mesh_.tetrahedra[t];
      if ((beyond[a] & beyond[b] & beyond[c] & beyond[d]) != 0)
        continue;
      if (!among_.empty() && among_[a] + among_[b] + among_[c] + among_[d] < 2)
        continue; // none of its edges is passed
      Box3 box;
      for (const std::uint32_t corner : mesh_.tetrahedra[t])
        box.add(places_[corner]);
      if (!blade_.meets(box))
        continue;
      for (const std::uint32_t corner : mesh_.tetrahedra[t])
        for (int axis = 0; axis < 3; ++axis)
          if (!(std::fabs(places_[corner][axis]) <= predicate_largest))
            throw Error("point " + std::to_string(corner) + " is farther away than 2^40 mm");
      candidates_.push_back({t, {}, {}, false});
    }
  }

  void find_passed() {
    std::vector<EdgeUse> uses;
    uses.reserve(6 * candidates_.size());
    for (std::size_t c = 0; c < candidates_.size(); ++c) {
      const Tetrahedron& t = mesh_.tetrahedra[candidates_[c].number];
      for (std::size_t k = 0; k < 6; ++k) {
        const auto [low, high] = std::minmax(t[tetrahedra::tetrahedron_edges[k][0]],
                                             t[tetrahedra::tetrahedron_edges[k][1]]);
        uses.push_back({low, high, static_cast<std::uint32_t>(6 * c + k)});
      }
    }
    std::ranges::sort(uses);
    std::uint32_t crossing = no_crossing;
    for (std::size_t n = 0; n < uses.size(); ++n) {
      if (n == 0 || !uses[n].same_edge(uses[n - 1]))
        crossing = pass(uses[n].low, uses[n].high);
      Candidate& candidate = candidates_[uses[n].slot / 6];
      candidate.crossing[uses[n].slot % 6] = crossing;
      candidate.touched = candidate.touched || crossing != no_crossing;
    }
  }

  std::uint32_t pass(std::uint32_t low, std::uint32_t high) {
    if (!among_.empty() && (among_[low] & among_[high]) == 0)
      return no_crossing;
    ++region_.tested;
    const BladeCrossing found = blade_.crossing(places_[low], places_[high]);
    region_.folded += found.passes > 1 ? 1 : 0;
    if (found.direction == 0)
      return no_crossing;
    passed_.push_back({low, high, found.share, found.direction, false});
    return static_cast<std::uint32_t>(passed_.size() - 1);
  }

  /// The blade separates a tetrahedron whose corners fall into two sets so that the passed edges
  /// are those between them, all passed from the same side.
  void separate(Candidate& candidate) {
    if (!candidate.touched)
      return;
    const Tetrahedron& t = mesh_.tetrahedra[candidate.number];
    std::array<std::int8_t, 4> side{};
    for (std::size_t k = 0; k < 6; ++k) {
      if (candidate.crossing[k] == no_crossing)
        continue;
      const Passed& edge = passed_[candidate.crossing[k]];
      for (const std::uint8_t c : tetrahedra::tetrahedron_edges[k]) {
        const std::int8_t above = (t[c] == edge.high) == (edge.direction > 0) ? 1 : -1;
        if (side[c] == -above)
          return;
        side[c] = above;
      }
    }
    for (std::size_t k = 0; k < 6; ++k) {
      const auto& [a, b] = tetrahedra::tetrahedron_edges[k];
      if (side[a] == 0 || side[b] == 0 ||
          (side[a] != side[b]) != (candidate.crossing[k] != no_crossing))
        return;
    }
    candidate.side = side;
    for (const std::uint32_t crossing : candidate.crossing)
      if (crossing != no_crossing)
        passed_[crossing].used = true;
  }

  std::uint32_t local(std::uint32_t node) const {
    return static_cast<std::uint32_t>(std::ranges::lower_bound(region_.nodes, node) -
                                      region_.nodes.begin());
  }

  void gather(bool wide) {
    if (std::ranges::none_of(passed_, &Passed::used))
      return;
    std::vector<std::uint8_t> marked(mesh_.points.size());
    for (const Passed& edge : passed_)
      if (edge.used)
        marked[edge.low] = marked[edge.high] = 1;
    if (wide)
      marked = with_neighbours(marked);
    std::size_t next = 0; // candidate
    for (std::uint32_t t = 0; t < mesh_.tetrahedra.size(); ++t) {
      const Tetrahedron& corners = mesh_.tetrahedra[t];
      const auto& [a, b, c, d] = corners;
      if ((marked[a] | marked[b] | marked[c] | marked[d]) == 0)
        continue;
      while (next < candidates_.size() && candidates_[next].number < t)
        ++next;
      RegionTet tet{t, corners, {}, {}, false};
      tet.crossing.fill(no_crossing);
      if (next < candidates_.size() && candidates_[next].number == t) {
        tet.crossing = candidates_[next].crossing;
        tet.side = candidates_[next].side;
        tet.touched = candidates_[next].touched;
      }
      region_.tets.push_back(tet);
      region_.nodes.insert(region_.nodes.end(), corners.begin(), corners.end());
    }
    std::ranges::sort(region_.nodes);
    const auto repeated = std::ranges::unique(region_.nodes);
    region_.nodes.erase(repeated.begin(), repeated.end());
    for (const std::uint32_t node : region_.nodes)
      region_.whole.push_back(marked[node]);
    take_used_edges();
    make_stars();
  }

  std::vector<std::uint8_t> with_neighbours(const std::vector<std::uint8_t>& marked) const {
    std::vector<std::uint8_t> wider = marked;
    for (const auto& [a, b, c, d] : mesh_.tetrahedra)
      if ((marked[a] | marked[b] | marked[c] | marked[d]) != 0)
        wider[a] = wider[b] = wider[c] = wider[d] = 1;
    return wider;
  }

  void take_used_edges() {
    std::vector<std::uint32_t> place(passed_.size(), no_crossing);
    for (std::size_t e = 0; e < passed_.size(); ++e) {
      const Passed& edge = passed_[e];
      if (!edge.used)
        continue;
      place[e] = static_cast<std::uint32_t>(region_.edges.size());
      const Vec3 &low = mesh_.points[edge.low], &high = mesh_.points[edge.high];
      // From the nearer end, so that what is close to it keeps its digits.
      const Vec3 point = edge.share <= 0.5 ? low + (high - low) * edge.share
                                           : high + (low - high) * (1 - edge.share);
      region_.edges.push_back({{local(edge.low), local(edge.high)},
                               edge.share,
                               point,
                               norm(high - low),
                               0,
                               no_crossing,
                               0});
    }
    std::vector<std::uint32_t> order(region_.edges.size());
    std::iota(order.begin(), order.end(), 0U);
    std::ranges::stable_sort(order, [&](std::uint32_t a, std::uint32_t b) {
      return region_.edges[a].length > region_.edges[b].length;
    });
    for (std::size_t n = 0; n < order.size(); ++n)
      region_.edges[order[n]].rank = static_cast<std::uint32_t>(n);
    for (std::uint32_t r = 0; r < region_.tets.size(); ++r) {
      RegionTet& tet = region_.tets[r];
      for (std::uint32_t& corner : tet.corners)
        corner = local(corner);
      for (std::uint32_t k = 0; k < 6; ++k) {
        std::uint32_t& crossing = tet.crossing[k];
        crossing = crossing == no_crossing ? no_crossing : place[crossing];
        if (crossing == no_crossing || region_.edges[crossing].tet != no_crossing)
          continue;
        region_.edges[crossing].tet = r;
        region_.edges[crossing].edge = k;
      }
    }
  }

  void make_stars() {
    region_.first.assign(region_.nodes.size() + 1, 0);
    for (const RegionTet& tet : region_.tets)
      for (const std::uint32_t corner : tet.corners)
        ++region_.first[corner + 1];
    std::partial_sum(region_.first.begin(), region_.first.end(), region_.first.begin());
    region_.star.resize(4 * region_.tets.size());
    std::vector<std::uint32_t> next(region_.first.begin(), region_.first.end() - 1);
    for (std::uint32_t r = 0; r < region_.tets.size(); ++r)
      for (const std::uint32_t corner : region_.tets[r].corners)
        region_.star[next[corner]++] = r;
  }

  const tetrahedra::TetMesh& mesh_;
  std::span<const Vec3> places_;
  std::span<const std::uint8_t> among_;
  const Blade& blade_;
  std::vector<Candidate> candidates_;
  std::vector<Passed> passed_; // by low, then high
  CutRegion region_;
};

} // namespace

CutRegion cut_region(const tetrahedra::TetMesh& mesh, const BladeCutOptions& options,
                     const Blade& blade, bool wide) {
  return Finder(mesh, options, blade).find(wide);
}

} // namespace gewebe::incision
