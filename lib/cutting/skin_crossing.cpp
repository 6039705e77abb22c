#include "cutting/skin_crossing_internal.h"

#include "base/disjoint_sets.h"
#include "base/error.h"
#include "collision/bvh.h"
#include "collision/inside.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <set>

namespace gewebe::cutting::skins {
namespace {

constexpr double whole = 0.01; // how far a closed surface's winding number is from an integer

using Key = std::array<double, 3>;
Key key_of(const Vec3& p) {
  return {p.x, p.y, p.z};
}

class Crosser {
public:
  Crosser(const model::Skin& skin, std::span<const std::uint32_t> shell, std::uint32_t cut,
          const RegionSheet& sheet, double gap)
      : skin_(skin), shell_(shell), cut_(cut), sheet_(sheet), gap_(gap),
        materials_(sheet.material) {
    x_.places = skin.points;
  }

  SkinCrossing carry_out() {
    find_local();
    if (x_.local.empty()) {
      x_.refined = sheet_;
      return std::move(x_);
    }
    hold_walls_apart();
    cross();
    find_inside();
    x_.refined = refined_sheet();
    part_fronts();
    return std::move(x_);
  }

private:
  // ---- What is near

  void find_local() {
    std::vector<Box3> boxes;
    for (const Triangle& t : sheet_.surface.triangles)
      boxes.push_back(box_of(sheet_.surface.points, t));
    const collision::Bvh tree(boxes);
    const auto any = [](std::uint32_t) { return true; };
    for (std::uint32_t t = 0; t < skin_.triangles.size(); ++t)
      if (shell_[t] == cut_ && tree.any_overlapping(box_of(skin_.points, skin_.triangles[t]), any))
        x_.local.push_back(t);
  }

  /// Walls at rest lie on each other, back to back.
  void hold_walls_apart() {
    std::vector<std::pair<std::array<Key, 3>, std::uint32_t>> named;
    for (const std::uint32_t t : x_.local) {
      std::array<Key, 3> key;
      for (std::size_t k = 0; k < 3; ++k)
        key[k] = key_of(skin_.points[skin_.triangles[t][k]]);
      std::ranges::sort(key);
      named.emplace_back(key, t);
    }
    std::ranges::sort(named);
    std::map<std::uint32_t, Vec3> outwards;
    for (std::size_t n = 0; n < named.size(); ++n) {
      const bool twin = (n > 0 && named[n - 1].first == named[n].first) ||
                        (n + 1 < named.size() && named[n + 1].first == named[n].first);
      if (!twin)
        continue;
      const Triangle& t = skin_.triangles[named[n].second];
      const Vec3& a = skin_.points[t[0]];
      Vec3 normal = gewebe::cross(skin_.points[t[1]] - a, skin_.points[t[2]] - a);
      if (const double length = norm(normal); length > 0)
        normal = normal / length;
      for (const std::uint32_t corner : t)
        outwards[corner] += normal;
    }
    for (const auto& [point, normal] : outwards)
      if (const double length = norm(normal); length > 0.1) // else both sides are its own: a front
        x_.places[point] = x_.places[point] - gap_ / length * normal;
  }

  // ---- Where both meet

  void cross() {
    TriangleMesh local;
    std::vector<std::uint32_t> number(skin_.points.size(), none);
    for (const std::uint32_t t : x_.local) {
      Triangle corners = skin_.triangles[t];
      for (std::uint32_t& corner : corners) {
        if (number[corner] == none) {
          number[corner] = static_cast<std::uint32_t>(x_.point.size());
          x_.point.push_back(corner);
          local.points.push_back(x_.places[corner]);
        }
        corner = number[corner];
      }
      local.triangles.push_back(corners);
    }
    x_.crossing = mesh::cross_surfaces(local, sheet_.surface);
    for (std::size_t p = x_.point.size(); p < x_.crossing.a.points.size(); ++p) {
      x_.point.push_back(static_cast<std::uint32_t>(x_.places.size()));
      x_.places.push_back(x_.crossing.a.points[p]);
    }
    for (const mesh::SurfaceCrossing::Edge& edge : x_.crossing.curve)
      for (std::size_t k = 0; k < 2; ++k)
        x_.on_skin[directed(edge.b[k], edge.b[1 - k])] = {x_.point[edge.a[k]],
                                                          x_.point[edge.a[1 - k]]};
  }

  /// Finds the triangles of the sheet that are inside, from the components beside the curve.
  void find_inside() {
    const std::vector<Triangle>& triangles = x_.crossing.b.triangles;
    std::unordered_map<std::uint64_t, std::uint32_t> beside;
    for (std::uint32_t t = 0; t < triangles.size(); ++t)
      for (std::size_t k = 0; k < 3; ++k)
        beside[directed(triangles[t][k], triangles[t][(k + 1) % 3])] = t;
    DisjointSets sets(triangles.size());
    const auto each_pair = [&](bool on_curve, auto&& work) {
      for (std::uint32_t t = 0; t < triangles.size(); ++t)
        for (std::size_t k = 0; k < 3; ++k) {
          const std::uint32_t p = triangles[t][k], q = triangles[t][(k + 1) % 3];
          const auto other = beside.find(directed(q, p));
          if (other != beside.end() && x_.on_skin.contains(directed(p, q)) == on_curve)
            work(t, other->second);
        }
    };
    each_pair(false, [&](std::uint32_t t, std::uint32_t other) { sets.join(t, other); });
    const std::uint32_t count = sets.number(set_);
    each_pair(true, [&](std::uint32_t t, std::uint32_t other) {
      if (set_[t] == set_[other])
        throw Error(not_closed);
    });
    std::vector<std::uint32_t> largest(count, none);
    std::vector<double> size(count, -1);
    const std::vector<Vec3>& at = x_.crossing.b.points;
    for (std::uint32_t t = 0; t < triangles.size(); ++t) {
      const auto& [p, q, r] = triangles[t];
      const double area = norm(gewebe::cross(at[q] - at[p], at[r] - at[p]));
      if (area > size[set_[t]]) {
        size[set_[t]] = area;
        largest[set_[t]] = t;
      }
    }
    std::vector<Triangle> shell;
    for (std::uint32_t t = 0; t < skin_.triangles.size(); ++t)
      if (shell_[t] == cut_)
        shell.push_back(skin_.triangles[t]);
    Box3 skin_box;
    for (const Vec3& p : skin_.points)
      skin_box.add(p);
    std::vector<bool> holds(count);
    for (std::uint32_t s = 0; s < count; ++s) {
      const auto& [p, q, r] = triangles[largest[s]];
      const Vec3 middle = (at[p] + at[q] + at[r]) / 3;
      Box3 box;
      box.add(middle);
      if (!meet(box, skin_box))
        continue;
      const double winds = collision::winding_number(shell, x_.places, middle);
      if (!(std::abs(winds - std::round(winds)) < whole))
        throw Error(not_closed);
      holds[s] = std::abs(winds) > 0.5;
    }
    for (std::uint32_t t = 0; t < triangles.size(); ++t) {
      x_.inside.push_back(holds[set_[t]]);
      x_.region.push_back(region_of(t, holds[set_[t]]));
    }
  }

  /// A number for where it lies now and lay before.
  std::uint32_t region_of(std::uint32_t t, bool inside) {
    const std::uint32_t before = sheet_.region[x_.crossing.b.from[t]];
    if (!inside)
      return before;
    const auto [at, added] = regions_.emplace(std::pair(before, set_[t]), materials_.size());
    if (added)
      materials_.push_back(materials_[before] >= 0 || cut_ == 1 ? materials_[before]
                                                                : usual_material());
    return static_cast<std::uint32_t>(at->second);
  }

  /// That most triangles of the shell have near the sheet.
  std::int32_t usual_material() const {
    std::map<std::int32_t, std::size_t> count;
    for (const std::uint32_t t : x_.local)
      ++count[skin_.material[t]];
    return std::ranges::max_element(count, {}, [](const auto& one) { return one.second; })->first;
  }

  RegionSheet refined_sheet() const {
    RegionSheet refined;
    refined.surface.points = x_.crossing.b.points;
    refined.surface.triangles = x_.crossing.b.triangles;
    refined.region = x_.region;
    refined.material = materials_;
    refined.end = sheet_.end;
    if (sheet_.end.empty())
      return refined;
    // Along the border from the first of the end to its last.
    std::vector<std::uint64_t> edges;
    for (const Triangle& t : x_.crossing.b.triangles)
      for (std::size_t k = 0; k < 3; ++k)
        edges.push_back(directed(t[k], t[(k + 1) % 3]));
    std::ranges::sort(edges);
    std::unordered_map<std::uint32_t, std::uint32_t> next;
    for (const std::uint64_t edge : edges) {
      const auto p = static_cast<std::uint32_t>(edge >> 32), q = static_cast<std::uint32_t>(edge);
      if (!std::ranges::binary_search(edges, directed(q, p)))
        next[p] = q;
    }
    std::vector<std::uint32_t> end{sheet_.end.front()};
    while (end.back() != sheet_.end.back() && end.size() <= next.size()) {
      const auto to = next.find(end.back());
      if (to == next.end())
        return refined;
      end.push_back(to->second);
    }
    refined.end = std::move(end);
    return refined;
  }

  // ---- Fronts

  struct Edge {
    std::uint32_t p = 0, q = 0;
    auto operator<=>(const Edge&) const = default;
  };

  /// Edges of the sheet's triangles inside, each with one of these.
  std::vector<std::pair<Edge, std::uint32_t>> sides_of_inside() const {
    std::vector<std::pair<Edge, std::uint32_t>> sides;
    for (std::uint32_t t = 0; t < x_.inside.size(); ++t)
      for (std::size_t k = 0; x_.inside[t] && k < 3; ++k) {
        const Triangle& c = x_.crossing.b.triangles[t];
        const auto [low, high] = std::minmax(c[k], c[(k + 1) % 3]);
        sides.push_back({{low, high}, t});
      }
    std::ranges::sort(sides);
    return sides;
  }

  /// Both walls share the points of a front, so no other edge may run between two of these: it
  /// would have four triangles. Such edges get a point in their middle.
  void part_fronts() {
    for (;;) {
      const std::vector<std::pair<Edge, std::uint32_t>> sides = sides_of_inside();
      const auto is_front = [&](std::size_t n) {
        const Edge& edge = sides[n].first;
        return (n == 0 || sides[n - 1].first != edge) &&
               (n + 1 == sides.size() || sides[n + 1].first != edge) &&
               !x_.on_skin.contains(directed(edge.p, edge.q));
      };
      std::vector<bool> front(x_.crossing.b.points.size());
      std::map<std::uint32_t, int> fronts_of; // by triangle
      for (std::size_t n = 0; n < sides.size(); ++n)
        if (is_front(n)) {
          front[sides[n].first.p] = front[sides[n].first.q] = true;
          ++fronts_of[sides[n].second];
        }
      std::set<Edge> bad;
      for (std::size_t n = 0; n < sides.size(); ++n)
        if (front[sides[n].first.p] && front[sides[n].first.q] && !is_front(n))
          bad.insert(sides[n].first);
      if (!bad.empty()) {
        halve(bad);
        continue;
      }
      for (const auto& [t, count] : fronts_of)
        if (count == 3)
          fan_out(t);
      return;
    }
  }

  std::uint32_t add_sheet_point(const Vec3& at) {
    x_.crossing.b.points.push_back(at);
    return static_cast<std::uint32_t>(x_.crossing.b.points.size() - 1);
  }

  static void halve(mesh::RefinedSurface& of, std::uint32_t t, const Edge& edge,
                    std::uint32_t middle) {
    Triangle one = of.triangles[t], other = one;
    std::ranges::replace(one, edge.p, middle);
    std::ranges::replace(other, edge.q, middle);
    of.triangles[t] = one;
    of.triangles.push_back(other);
    of.from.push_back(of.from[t]);
  }

  /// Of these edges those that have no triangle in common.
  void halve(const std::set<Edge>& edges) {
    std::vector<bool> used(x_.inside.size());
    const std::vector<std::pair<Edge, std::uint32_t>> sides = sides_of_inside();
    for (const Edge& edge : edges) {
      std::vector<std::uint32_t> beside;
      for (auto at = std::ranges::lower_bound(sides, std::pair(edge, 0U));
           at != sides.end() && at->first == edge; ++at)
        beside.push_back(at->second);
      if (std::ranges::any_of(beside, [&](std::uint32_t t) { return used[t]; }))
        continue;
      for (const std::uint32_t t : beside)
        used[t] = true;
      halve(edge, beside);
    }
  }

  void halve(const Edge& edge, const std::vector<std::uint32_t>& beside) {
    const Vec3 at = (x_.crossing.b.points[edge.p] + x_.crossing.b.points[edge.q]) / 2;
    const std::uint32_t middle = add_sheet_point(at);
    for (const std::uint32_t t : beside) {
      copy_state(t);
      halve(x_.crossing.b, t, edge, middle);
    }
    const auto on = x_.on_skin.find(directed(edge.p, edge.q));
    if (on == x_.on_skin.end())
      return;
    const auto [u, v] = on->second; // a rim of one edge
    const auto on_skin = static_cast<std::uint32_t>(x_.places.size());
    x_.places.push_back(at);
    const auto local = [&](std::uint32_t point) {
      return static_cast<std::uint32_t>(std::ranges::find(x_.point, point) - x_.point.begin());
    };
    const Edge own{local(u), local(v)};
    const auto number = static_cast<std::uint32_t>(x_.point.size());
    x_.point.push_back(on_skin);
    x_.crossing.a.points.push_back(at);
    const std::size_t count = x_.crossing.a.triangles.size();
    for (std::uint32_t t = 0; t < count; ++t) {
      const Triangle& c = x_.crossing.a.triangles[t];
      if (std::ranges::find(c, own.p) != c.end() && std::ranges::find(c, own.q) != c.end())
        halve(x_.crossing.a, t, own, number);
    }
    const auto join = [&](std::uint32_t p, std::uint32_t u2, std::uint32_t q, std::uint32_t v2) {
      x_.on_skin[directed(p, q)] = {u2, v2};
      x_.on_skin[directed(q, p)] = {v2, u2};
    };
    join(edge.p, u, middle, on_skin);
    join(middle, on_skin, edge.q, v);
    x_.on_skin.erase(directed(edge.p, edge.q));
    x_.on_skin.erase(directed(edge.q, edge.p));
  }

  /// Of a triangle for its next part.
  void copy_state(std::uint32_t t) {
    x_.inside.push_back(x_.inside[t]);
    x_.region.push_back(x_.region[t]);
  }

  /// A triangle with fronts all round.
  void fan_out(std::uint32_t t) {
    mesh::RefinedSurface& sheet = x_.crossing.b;
    const auto [a, b, c] = sheet.triangles[t];
    const std::uint32_t middle =
        add_sheet_point((sheet.points[a] + sheet.points[b] + sheet.points[c]) / 3);
    sheet.triangles[t] = {a, b, middle};
    for (const Triangle& other : {Triangle{b, c, middle}, Triangle{c, a, middle}}) {
      copy_state(t);
      sheet.triangles.push_back(other);
      sheet.from.push_back(sheet.from[t]);
    }
  }

  const model::Skin& skin_;
  std::span<const std::uint32_t> shell_;
  std::uint32_t cut_;
  const RegionSheet& sheet_;
  double gap_;
  std::vector<std::uint32_t> set_; // of triangles of the sheet: what hangs together
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::size_t> regions_;
  std::vector<std::int32_t> materials_; // of regions
  SkinCrossing x_;
};

} // namespace

std::vector<std::uint32_t> shells_of(const model::Skin& skin) {
  DisjointSets sets(skin.points.size());
  for (const auto& [a, b, c] : skin.triangles) {
    sets.join(a, b);
    sets.join(a, c);
  }
  std::vector<std::uint32_t> set, shell(skin.triangles.size(), 1);
  (void)sets.number(set);
  std::map<std::uint32_t, std::vector<Triangle>> parts;
  for (const Triangle& t : skin.triangles)
    parts[set[t[0]]].push_back(t);
  if (parts.size() < 2)
    return shell;
  Box3 box;
  for (const Vec3& p : skin.points)
    box.add(p);
  const double size = box.longest_side();
  std::map<std::uint32_t, std::uint32_t> shell_of;
  for (const auto& [one, triangles] : parts) {
    double volume = 0;
    for (const auto& [a, b, c] : triangles)
      volume +=
          dot(skin.points[a] - box.min, cross(skin.points[b] - box.min, skin.points[c] - box.min)) /
          6;
    // Where two walls lie on each other its point may stand on another one.
    double round = 0;
    for (std::size_t n = 0; n < 16; ++n) {
      const Vec3& at = skin.points[triangles[n * triangles.size() / 16][0]];
      round = 0;
      for (const auto& [other, of] : parts)
        if (other != one)
          round += collision::winding_number(of, skin.points, at);
      if (std::abs(round - std::round(round)) < whole)
        break;
    }
    const bool outward = volume > 1e-9 * size * size * size;
    shell_of[one] =
        static_cast<std::uint32_t>(std::max(1.0, std::round(std::abs(round)) + (outward ? 1 : 0)));
  }
  for (std::size_t t = 0; t < shell.size(); ++t)
    shell[t] = shell_of[set[skin.triangles[t][0]]];
  return shell;
}

bool SkinCrossing::cut() const {
  return std::ranges::find(inside, true) != inside.end();
}

SkinCrossing cross_skin(const model::Skin& skin, std::span<const std::uint32_t> shell,
                        std::uint32_t cut, const RegionSheet& sheet, double gap) {
  return Crosser(skin, shell, cut, sheet, gap).carry_out();
}

} // namespace gewebe::cutting::skins
