#include "cutting/skin_parts.h"

#include "base/disjoint_sets.h"
#include "cutting/skin_crossing_internal.h"
#include "embedding/element_boxes.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <map>
#include <numeric>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

namespace gewebe::cutting {
namespace {

using skins::directed;

constexpr std::uint32_t none = CutModel::gone;
constexpr std::size_t lost = 100; // of so many points one may follow another part

class Parter {
public:
  Parter(const model::Model& model, FreeParts& parts) : model_(model), skin_(model.skin) {
    all_.push_back(&*parts.rest);
    for (ModelPart& part : parts.parts)
      all_.push_back(&part);
    std::vector<std::uint32_t> of_node(model.nodes.size(), none);
    for (std::uint32_t k = 0; k < all_.size(); ++k)
      for (const std::uint32_t node : all_[k]->origin)
        of_node[node] = k;
    std::vector<std::uint32_t> count(all_.size());
    for (const Tetrahedron& t : model.tetrahedra) {
      const std::uint32_t k = of_node[t[0]];
      part_.push_back(k);
      number_.push_back(count[k]++);
    }
  }

  SkinPartsReport carry_out() {
    place_triangles();
    for (std::uint32_t k = 1; k < all_.size(); ++k)
      tear_off(k);
    for (std::uint32_t k = 0; k < all_.size(); ++k)
      write(k);
    return report_;
  }

private:
  std::uint32_t part_of_point(std::uint32_t p) const { return part_[skin_.tetrahedron[p]]; }

  /// The part of each triangle.
  void place_triangles() {
    DisjointSets sets(skin_.points.size());
    for (const auto& [a, b, c] : skin_.triangles) {
      sets.join(a, b);
      sets.join(a, c);
    }
    std::vector<std::uint32_t> set;
    const std::uint32_t count = sets.number(set);
    std::vector<std::map<std::uint32_t, std::size_t>> points(count);
    for (std::uint32_t p = 0; p < skin_.points.size(); ++p)
      ++points[set[p]][part_of_point(p)];
    std::vector<std::uint32_t> whole(count, none); // of what is of one part
    for (std::uint32_t s = 0; s < count; ++s) {
      std::size_t sum = 0, most = 0;
      for (const auto& [part, number] : points[s]) {
        sum += number;
        if (number > most) {
          most = number;
          whole[s] = part;
        }
      }
      if ((sum - most) * lost > sum)
        whole[s] = none;
    }
    for (const Triangle& t : skin_.triangles) {
      if (whole[set[t[0]]] != none) {
        of_triangle_.push_back(whole[set[t[0]]]);
        continue;
      }
      const std::uint32_t a = part_of_point(t[0]), b = part_of_point(t[1]), c = part_of_point(t[2]);
      of_triangle_.push_back(b == c ? b : a);
    }
  }

  /// Nearest element of that part, by its number there.
  std::uint32_t element_for(const Vec3& at, std::uint32_t part) {
    if (!boxes_) {
      std::vector<std::uint32_t> every(model_.tetrahedra.size());
      std::iota(every.begin(), every.end(), 0U);
      boxes_.emplace(model_, every);
    }
    ++report_.moved;
    return number_[boxes_->nearest(at, [&](std::uint32_t t) { return part_[t] == part; }).first];
  }

  /// Opens the skin between a part's triangles and others, and closes both sides alike.
  void tear_off(std::uint32_t part) {
    std::unordered_map<std::uint64_t, std::uint32_t> edges; // to triangles
    for (std::uint32_t t = 0; t < skin_.triangles.size(); ++t)
      for (std::size_t k = 0; k < 3; ++k)
        edges.emplace(directed(skin_.triangles[t][k], skin_.triangles[t][(k + 1) % 3]), t);
    std::map<std::uint32_t, std::vector<std::uint32_t>> ways; // along torn edges, as the part has
    std::vector<bool> active(skin_.points.size());
    for (std::uint32_t t = 0; t < skin_.triangles.size(); ++t)
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t u = skin_.triangles[t][k], v = skin_.triangles[t][(k + 1) % 3];
        const auto other = edges.find(directed(v, u));
        if (of_triangle_[t] != part || other == edges.end() || of_triangle_[other->second] == part)
          continue;
        ways[u].push_back(v);
        active[u] = active[v] = true;
        ++report_.torn;
      }
    if (ways.empty())
      return;
    const auto before = static_cast<std::uint32_t>(skin_.triangles.size());
    // Two triangles an edge, of the part and of the others, which stand in a row for each loop.
    std::unordered_map<std::uint64_t, std::uint32_t> closing; // by edge, that of the part
    std::vector<std::array<std::uint32_t, 2>> beside;         // along a loop, those of the part
    for (const std::vector<std::uint32_t>& loop : loops_of(ways)) {
      Vec3 middle;
      for (const std::uint32_t p : loop)
        middle += skin_.points[p];
      const auto centre = static_cast<std::uint32_t>(skin_.points.size());
      skin_.points.push_back(middle / static_cast<double>(loop.size()));
      skin_.tetrahedron.push_back(none);
      active.push_back(true);
      const auto first = static_cast<std::uint32_t>(skin_.triangles.size());
      const auto count = static_cast<std::uint32_t>(loop.size());
      for (std::uint32_t k = 0; k < count; ++k) {
        const std::uint32_t u = loop[k], v = loop[(k + 1) % count];
        closing.emplace(directed(u, v), static_cast<std::uint32_t>(skin_.triangles.size()));
        beside.push_back({first + 2 * k, first + 2 * ((k + 1) % count)});
        const std::uint32_t rest = of_triangle_[edges.at(directed(v, u))];
        add_triangle({v, u, centre}, part);
        add_triangle({u, v, centre}, rest);
      }
    }
    DisjointSets corners(3 * skin_.triangles.size());
    const auto join = [&](std::uint32_t one, std::uint32_t other, std::uint32_t point) {
      corners.join(corner_at(one, point), corner_at(other, point));
    };
    for (std::uint32_t t = 0; t < before; ++t)
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t u = skin_.triangles[t][k], v = skin_.triangles[t][(k + 1) % 3];
        const auto other = edges.find(directed(v, u));
        if ((!active[u] && !active[v]) || other == edges.end())
          continue;
        std::uint32_t to = other->second;
        if (const auto of = closing.find(directed(u, v)); of != closing.end())
          to = of->second;
        else if (const auto back = closing.find(directed(v, u)); back != closing.end())
          to = back->second + 1;
        join(t, to, u);
        join(t, to, v);
      }
    for (const auto& [one, next] : beside)
      for (std::uint32_t side = 0; side < 2; ++side) {
        const Triangle& t = skin_.triangles[one];
        join(one + side, next + side, t[2]); // the middle
        join(one + side, next + side, t[0]); // where the edge ends and the next one begins
      }
    number_points(active, corners);
  }

  void add_triangle(const Triangle& corners, std::uint32_t part) {
    skin_.triangles.push_back(corners);
    skin_.material.push_back(-1); // of the tissue there
    if (!skin_.texcoords.empty())
      skin_.texcoords.emplace_back();
    of_triangle_.push_back(part);
  }

  std::uint32_t corner_at(std::uint32_t triangle, std::uint32_t point) const {
    const Triangle& t = skin_.triangles[triangle];
    return 3 * triangle + static_cast<std::uint32_t>(std::ranges::find(t, point) - t.begin());
  }

  /// Through no point twice.
  static std::vector<std::vector<std::uint32_t>>
  loops_of(std::map<std::uint32_t, std::vector<std::uint32_t>>& ways) {
    std::vector<std::vector<std::uint32_t>> loops;
    while (!ways.empty()) {
      std::vector<std::uint32_t> path{ways.begin()->first};
      while (!path.empty()) {
        const auto at = ways.find(path.back());
        if (at == ways.end())
          break; // the skin is open there
        const std::uint32_t to = at->second.back();
        at->second.pop_back();
        if (at->second.empty())
          ways.erase(at);
        const auto again = std::ranges::find(path, to);
        if (again == path.end()) {
          path.push_back(to);
          continue;
        }
        loops.emplace_back(again, path.end());
        path.erase(again + 1, path.end());
        if (path.size() == 1 && !ways.contains(path[0]))
          break;
      }
    }
    return loops;
  }

  /// One of what was a point keeps its number.
  void number_points(const std::vector<bool>& active, DisjointSets& corners) {
    std::vector<bool> taken(skin_.points.size());
    std::vector<std::uint32_t> number(3 * skin_.triangles.size(), none);
    std::vector<Triangle> now = skin_.triangles;
    for (std::uint32_t t = 0; t < now.size(); ++t)
      for (std::uint32_t k = 0; k < 3; ++k) {
        const std::uint32_t point = skin_.triangles[t][k];
        if (!active[point])
          continue;
        std::uint32_t& to = number[corners.find(3 * t + k)];
        if (to == none) {
          to = taken[point] ? static_cast<std::uint32_t>(skin_.points.size()) : point;
          if (taken[point]) {
            skin_.points.push_back(skin_.points[point]);
            skin_.tetrahedron.push_back(skin_.tetrahedron[point]);
          }
          taken[point] = true;
        }
        now[t][k] = to;
      }
    skin_.triangles = std::move(now);
  }

  void write(std::uint32_t part) {
    model::Skin& skin = all_[part]->model.skin;
    std::vector<std::uint32_t> number(skin_.points.size(), none);
    for (std::uint32_t t = 0; t < skin_.triangles.size(); ++t) {
      if (of_triangle_[t] != part)
        continue;
      Triangle corners = skin_.triangles[t];
      for (std::uint32_t& corner : corners) {
        std::uint32_t& to = number[corner];
        if (to == none) {
          to = static_cast<std::uint32_t>(skin.points.size());
          const Vec3& at = skin_.points[corner];
          const std::uint32_t element = skin_.tetrahedron[corner];
          skin.points.push_back(at);
          skin.tetrahedron.push_back(
              element != none && part_[element] == part ? number_[element] : element_for(at, part));
        }
        corner = to;
      }
      skin.triangles.push_back(corners);
      const std::int32_t material = skin_.material[t];
      skin.material.push_back(
          material >= 0 ? material
                        : all_[part]->model.tetrahedron_material[skin.tetrahedron[corners[2]]]);
      if (!skin_.texcoords.empty())
        skin.texcoords.push_back(skin_.texcoords[t]);
    }
  }

  const model::Model& model_;
  model::Skin skin_;
  std::vector<ModelPart*> all_;
  std::vector<std::uint32_t> part_, number_; // of each element: its part, its number there
  std::vector<std::uint32_t> of_triangle_;   // the part of each
  std::optional<embedding::elements::ElementBoxes> boxes_;
  SkinPartsReport report_;
};

} // namespace

SkinPartsReport part_skin(const model::Model& model, FreeParts& parts) {
  if (model.skin.points.empty() || !parts.rest)
    return {};
  return Parter(model, parts).carry_out();
}

} // namespace gewebe::cutting
