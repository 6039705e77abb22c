#include "cutting/cut_skin.h"

#include "base/disjoint_sets.h"
#include "base/error.h"
#include "cutting/skin_crossing_internal.h"
#include "geometry/boxes_meet.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <numeric>
#include <optional>
#include <unordered_map>
#include <unordered_set>
#include <utility>

namespace gewebe::cutting {
namespace {

using namespace skins;

constexpr double apart = 1e-6; // of a cell: walls that lie on each other

/// Opens the skin along the curve and gives the wound its walls.
class SkinOpener {
public:
  SkinOpener(const model::Skin& skin, SkinCrossing crossing, double reach)
      : skin_(skin), reach_(reach), x_(std::move(crossing)) {}

  SkinCut carry_out() {
    open();
    write();
    tell_sides();
    return std::move(result_);
  }

private:
  // ---- Coming apart

  /// All triangles, with the skin's points and, of walls, those of the sheet; what of their corners
  /// is one point.
  void open() {
    std::vector<bool> split(skin_.triangles.size());
    for (std::size_t n = 0; n < x_.crossing.a.triangles.size(); ++n)
      if (n >= x_.local.size() || x_.crossing.a.triangles[n] != local_triangle(n))
        split[x_.local[x_.crossing.a.from[n]]] = true;
    for (std::uint32_t t = 0; t < skin_.triangles.size(); ++t)
      if (!split[t]) {
        all_.push_back(skin_.triangles[t]);
        result_.triangle.push_back(t);
      }
    for (std::size_t n = 0; n < x_.crossing.a.triangles.size(); ++n) {
      if (!split[x_.local[x_.crossing.a.from[n]]])
        continue;
      Triangle corners = x_.crossing.a.triangles[n];
      for (std::uint32_t& corner : corners)
        corner = x_.point[corner];
      all_.push_back(corners);
      result_.triangle.push_back(x_.local[x_.crossing.a.from[n]]);
    }
    of_skin_ = static_cast<std::uint32_t>(all_.size());
    result_.region.assign(all_.size(), 0);
    for (std::uint32_t t = 0; t < x_.inside.size(); ++t)
      if (x_.inside[t])
        inside_.push_back(t);
    for (std::size_t side = 0; side < 2; ++side)
      for (const std::uint32_t t : inside_) {
        Triangle corners = x_.crossing.b.triangles[t];
        result_.region.push_back(x_.region[t]);
        if (side == 0) // of the tissue above it looks down
          std::swap(corners[0], corners[1]);
        all_.push_back(corners);
        result_.triangle.push_back(none);
      }
    glue();
  }

  Triangle local_triangle(std::size_t n) const {
    Triangle corners = skin_.triangles[x_.local[n]];
    Triangle is = x_.crossing.a.triangles[n];
    for (std::size_t k = 0; k < 3; ++k)
      is[k] = x_.point[is[k]];
    // CGAL may begin with another corner.
    for (std::size_t turn = 0; turn < 3; ++turn) {
      if (is == corners)
        return x_.crossing.a.triangles[n];
      std::ranges::rotate(is, is.begin() + 1);
    }
    return {none, none, none};
  }

  std::uint32_t corner_at(std::uint32_t triangle, std::uint32_t point) const {
    const Triangle& t = all_[triangle];
    return 3 * triangle + static_cast<std::uint32_t>(std::ranges::find(t, point) - t.begin());
  }

  void glue() {
    const auto walls = static_cast<std::uint32_t>(inside_.size());
    const std::uint32_t above = of_skin_, below = of_skin_ + walls;
    std::unordered_map<std::uint64_t, std::uint32_t> beside; // of the sheet's inside
    const auto edge_of = [&](std::uint32_t n, std::size_t k) {
      const Triangle& t = x_.crossing.b.triangles[inside_[n]];
      return std::pair(t[k], t[(k + 1) % 3]);
    };
    for (std::uint32_t n = 0; n < walls; ++n)
      for (std::size_t k = 0; k < 3; ++k) {
        const auto [p, q] = edge_of(n, k);
        beside[directed(p, q)] = n;
      }
    const auto neighbour = [&](std::uint32_t n, std::size_t k) {
      const auto [p, q] = edge_of(n, k);
      const auto other = beside.find(directed(q, p));
      return other == beside.end() ? none : other->second;
    };
    // Edges of the skin that come apart.
    std::unordered_set<std::uint64_t> opened;
    std::vector<bool> active(x_.places.size());
    for (std::uint32_t n = 0; n < walls; ++n)
      for (std::size_t k = 0; k < 3; ++k) {
        const auto [p, q] = edge_of(n, k);
        const auto on = x_.on_skin.find(directed(p, q));
        if (on == x_.on_skin.end() || neighbour(n, k) != none)
          continue;
        const auto& [u, v] = on->second;
        opened.insert(directed(u, v));
        opened.insert(directed(v, u));
        active[u] = active[v] = true;
      }

    sets_.emplace(3 * all_.size());
    const auto join = [&](std::uint32_t one, std::uint32_t p, std::uint32_t other,
                          std::uint32_t q) { sets_->join(corner_at(one, p), corner_at(other, q)); };
    std::unordered_map<std::uint64_t, std::uint32_t> edges; // of the skin at active points
    for (std::uint32_t t = 0; t < of_skin_; ++t)
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t u = all_[t][k], v = all_[t][(k + 1) % 3];
        if (!active[u] && !active[v])
          continue;
        if (!edges.emplace(directed(u, v), t).second)
          throw Error("an edge of the skin at the blade has more than two triangles, or two that "
                      "run along it the same way, expected a surface with one inside");
      }
    for (const auto& [edge, t] : edges) {
      const auto u = static_cast<std::uint32_t>(edge >> 32), v = static_cast<std::uint32_t>(edge);
      const auto other = edges.find(directed(v, u));
      if (other == edges.end() || opened.contains(edge) || u > v)
        continue;
      join(t, u, other->second, u);
      join(t, v, other->second, v);
    }
    for (std::uint32_t n = 0; n < walls; ++n)
      for (std::size_t k = 0; k < 3; ++k) {
        const auto [p, q] = edge_of(n, k);
        if (const std::uint32_t other = neighbour(n, k); other != none) {
          for (const std::uint32_t first : {above, below}) {
            join(first + n, p, first + other, p);
            join(first + n, q, first + other, q);
          }
          continue;
        }
        const auto on = x_.on_skin.find(directed(p, q));
        if (on == x_.on_skin.end()) { // the front
          join(above + n, p, below + n, p);
          join(above + n, q, below + n, q);
          continue;
        }
        const auto& [u, v] = on->second;
        const auto up = edges.find(directed(u, v)), down = edges.find(directed(v, u));
        if (up == edges.end() || down == edges.end())
          throw Error(not_closed);
        join(above + n, p, up->second, u);
        join(above + n, q, up->second, v);
        join(below + n, p, down->second, u);
        join(below + n, q, down->second, v);
      }
    number_points(active);
  }

  /// One of what was a point keeps its number.
  void number_points(const std::vector<bool>& active) {
    const std::size_t before = skin_.points.size(), given = x_.places.size();
    std::vector<std::uint32_t> of_root(3 * all_.size(), none);
    std::vector<bool> taken(given);
    origin_.resize(given);
    for (std::uint32_t p = 0; p < given; ++p)
      origin_[p] = p;
    result_.fresh.assign(given, false);
    for (std::size_t p = before; p < given; ++p)
      result_.fresh[p] = true;
    for (std::uint32_t t = 0; t < all_.size(); ++t)
      for (std::uint32_t k = 0; k < 3; ++k) {
        const std::uint32_t point = all_[t][k];
        const bool wall = t >= of_skin_;
        if (!wall && !active[point])
          continue;
        std::uint32_t& number = of_root[sets_->find(3 * t + k)];
        if (number == none) {
          if (!wall && !taken[point]) {
            number = point;
            taken[point] = true;
            result_.fresh[point] = true;
          } else {
            number = static_cast<std::uint32_t>(x_.places.size());
            x_.places.push_back(wall             ? x_.crossing.b.points[point]
                                : point < before ? skin_.points[point]
                                                 : x_.places[point]);
            origin_.push_back(wall ? none : point);
            result_.fresh.push_back(true);
          }
        }
        renamed_.emplace_back(3 * t + k, number);
      }
    for (const auto& [corner, number] : renamed_)
      all_[corner / 3][corner % 3] = number;
  }

  // ---- What it becomes

  void write() {
    model::Skin& skin = result_.skin;
    const std::size_t before = skin_.points.size();
    skin.points.assign(skin_.points.begin(), skin_.points.end());
    skin.points.insert(skin.points.end(), x_.places.begin() + static_cast<std::ptrdiff_t>(before),
                       x_.places.end());
    skin.tetrahedron = skin_.tetrahedron;
    skin.tetrahedron.resize(skin.points.size(), none);
    for (std::size_t p = before; p < skin.points.size(); ++p)
      if (origin_[p] != none && origin_[p] < before)
        skin.tetrahedron[p] = skin_.tetrahedron[origin_[p]];
    skin.triangles = std::move(all_);
    for (std::size_t t = 0; t < skin.triangles.size(); ++t) {
      const std::uint32_t from = result_.triangle[t];
      skin.material.push_back(from == none ? 0 : skin_.material[from]);
      if (!skin_.texcoords.empty())
        skin.texcoords.push_back(from == none ? std::array<double, 6>{} : texcoords_of(t, from));
    }
  }

  std::array<double, 6> texcoords_of(std::size_t t, std::uint32_t from) const {
    const std::array<double, 6>& old = skin_.texcoords[from];
    const Triangle& before = skin_.triangles[from];
    std::array<double, 6> now{};
    const Vec3 &a = skin_.points[before[0]], &b = skin_.points[before[1]],
               &c = skin_.points[before[2]];
    const Vec3 normal = gewebe::cross(b - a, c - a);
    const double squared = dot(normal, normal);
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t corner = result_.skin.triangles[t][k];
      const std::uint32_t origin = origin_[corner] == none ? corner : origin_[corner];
      const auto same = std::ranges::find(before, origin);
      std::array<double, 3> weight{};
      if (same != before.end() || !(squared > 0)) {
        weight[same != before.end() ? static_cast<std::size_t>(same - before.begin()) : 0] = 1;
      } else {
        const Vec3& p = result_.skin.points[corner];
        weight[1] = dot(gewebe::cross(p - a, c - a), normal) / squared;
        weight[2] = dot(gewebe::cross(b - a, p - a), normal) / squared;
        weight[0] = 1 - weight[1] - weight[2];
      }
      for (std::size_t axis = 0; axis < 2; ++axis)
        for (std::size_t c2 = 0; c2 < 3; ++c2)
          now[2 * k + axis] += weight[c2] * old[2 * c2 + axis];
    }
    return now;
  }

  /// From the walls on over the skin, as far as it is near.
  void tell_sides() {
    const model::Skin& skin = result_.skin;
    std::vector<std::int8_t>& side = result_.side;
    side.assign(skin.points.size(), 0);
    std::vector<std::uint8_t> seen(skin.points.size());
    const std::size_t walls = inside_.size();
    for (std::size_t t = of_skin_; t < skin.triangles.size(); ++t)
      for (const std::uint32_t p : skin.triangles[t])
        seen[p] = static_cast<std::uint8_t>(seen[p] | (t < of_skin_ + walls ? 1 : 2));
    std::vector<std::uint32_t> work;
    std::vector<std::uint32_t> source(skin.points.size(), none);
    for (std::uint32_t p = 0; p < skin.points.size(); ++p)
      if (seen[p] != 0) {
        side[p] = static_cast<std::int8_t>(seen[p] == 1 ? 1 : seen[p] == 2 ? -1 : 0);
        source[p] = p;
        work.push_back(p);
      }
    // Triangles that are near, by their points.
    Box3 box;
    for (const std::uint32_t p : work)
      box.add(skin.points[p]);
    const Vec3 wide{reach_, reach_, reach_};
    box = {box.min - wide, box.max + wide};
    std::vector<std::pair<std::uint32_t, std::uint32_t>> around;
    for (const Triangle& t : skin.triangles)
      if (meet(box, box_of(skin.points, t)))
        for (std::size_t k = 0; k < 3; ++k) {
          around.emplace_back(t[k], t[(k + 1) % 3]);
          around.emplace_back(t[(k + 1) % 3], t[k]);
        }
    std::ranges::sort(around);
    for (std::size_t n = 0; n < work.size(); ++n) {
      const std::uint32_t p = work[n];
      if (side[p] == 0)
        continue;
      for (auto at = std::ranges::lower_bound(around, std::pair(p, 0U));
           at != around.end() && at->first == p; ++at) {
        const std::uint32_t q = at->second;
        if (source[q] != none || !(norm(skin.points[q] - skin.points[source[p]]) <= reach_))
          continue;
        side[q] = side[p];
        source[q] = source[p];
        work.push_back(q);
      }
    }
  }

  const model::Skin& skin_;
  double reach_;
  SkinCrossing x_;
  std::vector<std::uint32_t> inside_; // triangles of the sheet inside
  std::vector<Triangle> all_;
  std::uint32_t of_skin_ = 0; // triangles, before the walls
  std::optional<DisjointSets> sets_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> renamed_;
  std::vector<std::uint32_t> origin_; // of places: the point whose copy it is
  SkinCut result_;
};

} // namespace

SkinCut cut_skin(const model::Skin& skin, const SkinSheet& sheet, double cell, double reach) {
  SkinCut result;
  result.skin = skin;
  result.side.assign(skin.points.size(), 0);
  result.fresh.assign(skin.points.size(), false);
  result.triangle.resize(skin.triangles.size());
  std::iota(result.triangle.begin(), result.triangle.end(), 0U);
  result.region.assign(skin.triangles.size(), 0);
  std::vector<std::uint32_t> shell = shells_of(skin);
  RegionSheet now{sheet.surface, std::vector<std::uint32_t>(sheet.surface.triangles.size(), 0),
                  sheet.end};
  // What is inside first, so that the sheet has its curve where what is outside is cut.
  const std::uint32_t last = shell.empty() ? 0 : *std::ranges::max_element(shell);
  for (std::uint32_t n = last; n > 0 && !now.surface.triangles.empty(); --n) {
    SkinCrossing crossing = cross_skin(result.skin, shell, n, now, apart * cell);
    now = crossing.refined;
    if (!crossing.cut())
      continue;
    SkinCut cut = SkinOpener(result.skin, std::move(crossing), reach).carry_out();
    std::vector<std::uint32_t> shell_now;
    for (std::size_t t = 0; t < cut.triangle.size(); ++t) {
      std::uint32_t& from = cut.triangle[t];
      shell_now.push_back(from == none ? n : shell[from]);
      if (from == none)
        continue;
      cut.region[t] = result.region[from];
      from = result.triangle[from];
    }
    shell = std::move(shell_now);
    for (std::size_t p = 0; p < result.side.size(); ++p) {
      if (cut.side[p] == 0)
        cut.side[p] = result.side[p];
      cut.fresh[p] = cut.fresh[p] || result.fresh[p];
    }
    result = std::move(cut);
  }
  result.material = now.material;
  for (const std::uint32_t p : now.end)
    result.end.push_back(now.surface.points[p]);
  return result;
}

} // namespace gewebe::cutting
