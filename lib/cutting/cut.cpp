#include "cutting/cut.h"

#include "base/disjoint_sets.h"
#include "base/error.h"
#include "model/surface_part.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <utility>

namespace gewebe::cutting {

namespace {

constexpr std::uint32_t none = CutModel::gone;
constexpr double min_share = 1e-3; ///< of a copy: one without mass could not be moved

using Pair = std::array<std::uint32_t, 2>;

Pair ordered(std::uint32_t a, std::uint32_t b) {
  return {std::min(a, b), std::max(a, b)};
}

std::string pair_text(const Pair& p) {
  return std::to_string(p[0]) + " " + std::to_string(p[1]);
}

template <class T>
std::vector<T> joined(const std::vector<T>& a, const std::vector<T>& b) {
  std::vector<T> all;
  all.reserve(a.size() + b.size());
  std::set_union(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(all));
  return all;
}

class Cutter {
public:
  Cutter(const model::Model& model, const Cut& cut)
      : model_(model), cut_(cut), surface_(model::surface_count(model)), part_(near(model, cut)),
        edges_(part_.edges) {}

  CutModel work() {
    check();
    find_triangles();
    part_fans();
    result_.doubled = copies_.size();
    nodes();
    springs();
    triangles();
    keep_left();
    return std::move(result_);
  }

private:
  struct Piece {            ///< of a fan
    std::uint32_t node = 0; ///< new number
    double area = 0;
    std::vector<std::uint32_t> corners;
  };

  static constexpr std::size_t no_edge = mesh::EdgeTable::no_edge;

  /// The surface that the cut may change. A node that comes apart is an end of something severed,
  /// or belongs to a triangle that vanishes; bending springs across edges of its triangles matter.
  static model::SurfacePart near(const model::Model& model, const Cut& cut) {
    std::vector<std::uint8_t> marked(model.nodes.size());
    for (const std::size_t s : cut.springs)
      if (s < model.springs.size() && model.springs[s].kind == model::SpringKind::edge)
        marked[model.springs[s].i] = marked[model.springs[s].j] = 1;
    for (const Pair& ends : cut.edges)
      for (const std::uint32_t node : ends)
        if (node < marked.size())
          marked[node] = 1;
    model::mark_neighbours(model, marked);
    model::mark_neighbours(model, marked);
    return model::surface_part(model, marked);
  }

  std::uint32_t node_of(std::uint32_t corner) const {
    return model_.triangles[corner / 3][corner % 3];
  }
  /// Of the triangle of a corner, the corner at `node`.
  std::uint32_t corner_at(std::uint32_t corner, std::uint32_t node) const {
    const std::uint32_t first = corner - corner % 3;
    return node_of(first) == node ? first : node_of(first + 1) == node ? first + 1 : first + 2;
  }

  void check() {
    for (const std::size_t s : cut_.springs)
      if (s >= model_.springs.size())
        throw Error("spring " + std::to_string(s) + " does not exist, expected 0 to " +
                    std::to_string(model_.springs.size() - 1));
    gone_.assign(model_.springs.size(), 0);
    for (const std::size_t s : cut_.springs)
      gone_[s] = 1;
    opened_.assign(edges_.size(), 0);
    for (const Pair& ends : cut_.edges) {
      const std::size_t e = part_.edges.find(ends);
      if (e == no_edge)
        throw Error("there is no triangle with the edge " + pair_text(ends) +
                    ", expected edges of the surface");
      opened_[e] = 1;
    }
    for (const Cut::Side& side : cut_.sides)
      if (side.corner / 3 >= model_.triangles.size())
        throw Error("triangle " + std::to_string(side.corner / 3) + " does not exist, expected " +
                    std::to_string(model_.triangles.size()) + " in all");
  }

  /// Which triangles stay, and which nodes may come apart.
  void find_triangles() {
    vanished_.assign(model_.triangles.size(), 0);
    touched_.assign(model_.nodes.size(), 0);
    area_.resize(model_.triangles.size());
    for (const std::uint32_t t : part_.triangles) {
      const Triangle& c = model_.triangles[t];
      const Vec3& a = model_.nodes[c[0]].position;
      area_[t] = norm(cross(model_.nodes[c[1]].position - a, model_.nodes[c[2]].position - a)) / 2;
    }
    for (const std::size_t s : cut_.springs) {
      const model::Spring& spring = model_.springs[s];
      const std::size_t e =
          spring.kind == model::SpringKind::edge ? part_.edges.find({spring.i, spring.j}) : no_edge;
      if (e == no_edge)
        continue;
      for (const std::uint32_t c : edges_.around(e)) {
        vanished_[c / 3] = 1;
        for (const std::uint32_t node : model_.triangles[c / 3])
          touched_[node] = 1;
      }
    }
    for (std::size_t e = 0; e < edges_.size(); ++e)
      if (opened_[e] != 0)
        for (const std::uint32_t node : edges_.ends[e])
          touched_[node] = 1;
  }

  void part_fans() {
    node_at_.resize(3 * model_.triangles.size());
    for (std::uint32_t c = 0; c < node_at_.size(); ++c)
      node_at_[c] = node_of(c);
    DisjointSets before(node_at_.size()), after(node_at_.size());
    for (std::size_t e = 0; e < edges_.size(); ++e)
      for (const std::uint32_t node : edges_.ends[e]) {
        if (touched_[node] == 0)
          continue;
        std::uint32_t first = none, first_left = none;
        for (const std::uint32_t opposite : edges_.around(e)) {
          const std::uint32_t c = corner_at(opposite, node);
          before.join(first == none ? c : first, c);
          first = first == none ? c : first;
          if (opened_[e] != 0 || vanished_[c / 3] != 0)
            continue;
          after.join(first_left == none ? c : first_left, c);
          first_left = first_left == none ? c : first_left;
        }
      }
    // By node, fan before, piece: its corners.
    std::map<std::array<std::uint32_t, 3>, Piece> pieces;
    for (const std::uint32_t t : part_.triangles)
      for (std::uint32_t c = 3 * t; vanished_[t] == 0 && c < 3 * t + 3; ++c) {
        if (touched_[node_at_[c]] == 0)
          continue;
        Piece& piece = pieces[{node_at_[c], before.find(c), after.find(c)}];
        piece.area += area_[t];
        piece.corners.push_back(c);
      }
    // The largest piece of each fan keeps the node: all such together, the others one by one.
    for (auto at = pieces.begin(); at != pieces.end();) {
      const std::uint32_t node = at->first[0];
      std::vector<Piece>& all = fans_[node];
      all.push_back({node, 0, {}});
      while (at != pieces.end() && at->first[0] == node) {
        const std::uint32_t fan = at->first[1];
        auto end = at;
        auto largest = at;
        for (; end != pieces.end() && end->first[0] == node && end->first[1] == fan; ++end)
          if (end->second.area > largest->second.area)
            largest = end;
        for (; at != end; ++at) {
          Piece& piece = at->second;
          if (at == largest) {
            all[0].area += piece.area;
            all[0].corners.insert(all[0].corners.end(), piece.corners.begin(), piece.corners.end());
          } else {
            all.push_back(std::move(piece));
          }
        }
      }
      if (all.size() == 1) {
        fans_.erase(node);
        continue;
      }
      std::sort(all.begin() + 1, all.end(),
                [](const Piece& a, const Piece& b) { return a.corners[0] < b.corners[0]; });
      for (std::size_t k = 1; k < all.size(); ++k) {
        all[k].node = static_cast<std::uint32_t>(surface_ + copies_.size());
        copies_.push_back(node);
        for (const std::uint32_t c : all[k].corners)
          node_at_[c] = all[k].node;
      }
    }
  }

  std::uint32_t number(std::uint32_t node) const {
    return node < surface_ ? node : node + static_cast<std::uint32_t>(copies_.size());
  }

  void nodes() {
    model::Model& m = result_.model;
    m.name = model_.name;
    m.materials = model_.materials;
    const std::size_t count = model_.nodes.size() + copies_.size();
    result_.origin.reserve(count);
    result_.place.reserve(model_.nodes.size());
    m.nodes.reserve(count);
    m.normals.reserve(model_.normals.empty() ? 0 : count);
    for (std::uint32_t i = 0; i < surface_; ++i)
      result_.origin.push_back(i);
    result_.origin.insert(result_.origin.end(), copies_.begin(), copies_.end());
    for (std::uint32_t i = static_cast<std::uint32_t>(surface_); i < model_.nodes.size(); ++i)
      result_.origin.push_back(i);
    for (std::uint32_t i = 0; i < model_.nodes.size(); ++i)
      result_.place.push_back(number(i));
    result_.share.assign(count, 1);
    for (const auto& [node, pieces] : fans_)
      share(pieces);
    for (std::size_t i = 0; i < count; ++i) {
      model::Node node = model_.nodes[result_.origin[i]];
      node.mass *= result_.share[i];
      node.drag *= result_.share[i];
      if (node.central >= 0)
        node.central = static_cast<std::int32_t>(number(static_cast<std::uint32_t>(node.central)));
      m.nodes.push_back(node);
      if (!model_.normals.empty())
        m.normals.push_back(model_.normals[result_.origin[i]]);
    }
  }

  void share(const std::vector<Piece>& pieces) {
    double total = 0, sum = 0;
    for (const Piece& p : pieces)
      total += p.area;
    const auto part = [&](const Piece& p) {
      return total > 0 ? std::max(p.area / total, min_share) : 1.0;
    };
    for (const Piece& p : pieces)
      sum += part(p);
    double others = 0;
    for (std::size_t k = 1; k < pieces.size(); ++k)
      others += result_.share[pieces[k].node] = part(pieces[k]) / sum;
    result_.share[pieces[0].node] = 1 - others;
  }

  // ---- springs

  /// Springs that keep their ends keep their order; others are put among them in the end.
  void add(const model::Spring& from, const Pair& ends, double part) {
    model::Spring s = from;
    s.i = std::min(ends[0], ends[1]);
    s.j = std::max(ends[0], ends[1]);
    s.stiffness *= part;
    s.damping *= part;
    const bool same = s.i == number(from.i) && s.j == number(from.j);
    (same ? result_.model.springs : moved_).push_back(s);
  }

  /// A spring in parts, whose weights are not negative; it is gone if there is none.
  void add_parts(const model::Spring& from, std::vector<std::pair<Pair, double>>& parts) {
    if (parts.empty()) {
      ++result_.removed;
      return;
    }
    double sum = 0;
    for (const auto& [ends, weight] : parts)
      sum += weight;
    for (const auto& [ends, weight] : parts)
      add(from, ends,
          parts.size() == 1 ? 1.0
          : sum > 0         ? weight / sum
                            : 1.0 / static_cast<double>(parts.size()));
    result_.split += parts.size() > 1 ? 1 : 0;
  }

  void springs() {
    result_.model.springs.reserve(model_.springs.size() + 8 * copies_.size());
    const std::vector<std::array<std::uint32_t, 3>> across = crossings();
    std::vector<std::uint8_t> crossed(touched_); // where springs may be others
    for (const auto& [i, j, e] : across)
      crossed[i] = crossed[j] = 1;
    std::size_t edge = 0;
    for (std::size_t s = 0; s < model_.springs.size(); ++s) {
      const model::Spring& spring = model_.springs[s];
      if (gone_[s] != 0) {
        ++result_.removed;
        continue;
      }
      if (crossed[spring.i] == 0 && crossed[spring.j] == 0) { // as it was
        add(spring, {number(spring.i), number(spring.j)}, 1);
        continue;
      }
      if (spring.kind == model::SpringKind::central) {
        central_spring(spring);
      } else if (spring.kind == model::SpringKind::bend) {
        bend_spring(spring, across);
      } else {
        const Pair ends{spring.i, spring.j};
        if (touched_[spring.i] == 0 && touched_[spring.j] == 0) { // nothing changed beside it
          add(spring, ends, 1);
          continue;
        }
        while (edge < edges_.size() && edges_.ends[edge] < ends)
          ++edge;
        const bool beside = edge < edges_.size() && edges_.ends[edge] == ends;
        if (!(beside && edge_spring(spring, edge)))
          free_spring(spring);
      }
    }
    const auto before = [](const model::Spring& a, const model::Spring& b) {
      return std::tie(a.kind, a.i, a.j) < std::tie(b.kind, b.i, b.j);
    };
    std::vector<model::Spring>& all = result_.model.springs;
    std::sort(moved_.begin(), moved_.end(), before);
    const auto kept = static_cast<std::ptrdiff_t>(all.size());
    all.insert(all.end(), moved_.begin(), moved_.end());
    std::inplace_merge(all.begin(), all.begin() + kept, all.end(), before);
  }

  /// The ends of an edge as a triangle beside it has them.
  Pair ends_in(std::uint32_t opposite, std::size_t edge) const {
    return ordered(node_at_[corner_at(opposite, edges_.ends[edge][0])],
                   node_at_[corner_at(opposite, edges_.ends[edge][1])]);
  }

  /// \return false if no triangle is left beside it
  bool edge_spring(const model::Spring& spring, std::size_t edge) {
    std::vector<std::pair<Pair, double>> parts;
    for (const std::uint32_t c : edges_.around(edge)) {
      if (vanished_[c / 3] != 0)
        continue;
      const Pair ends = ends_in(c, edge);
      const auto same = std::find_if(parts.begin(), parts.end(),
                                     [&](const auto& one) { return one.first == ends; });
      if (same != parts.end())
        same->second += area_[c / 3];
      else
        parts.emplace_back(ends, area_[c / 3]);
    }
    if (parts.empty())
      return false;
    add_parts(spring, parts);
    return true;
  }

  /// Nodes opposite to edges where the cut may matter, and the edge between.
  std::vector<std::array<std::uint32_t, 3>> crossings() const {
    std::vector<std::array<std::uint32_t, 3>> all;
    for (std::uint32_t e = 0; e < edges_.size(); ++e) {
      const auto around = edges_.around(e);
      if (around.size() != 2)
        continue;
      const Pair ends = ordered(node_of(around[0]), node_of(around[1]));
      const bool near = touched_[edges_.ends[e][0]] != 0 || touched_[edges_.ends[e][1]] != 0 ||
                        touched_[ends[0]] != 0 || touched_[ends[1]] != 0;
      if (near)
        all.push_back({ends[0], ends[1], e});
    }
    std::sort(all.begin(), all.end());
    return all;
  }

  void bend_spring(const model::Spring& spring,
                   const std::vector<std::array<std::uint32_t, 3>>& across) {
    auto at = std::lower_bound(across.begin(), across.end(),
                               std::array<std::uint32_t, 3>{spring.i, spring.j, 0});
    bool known = false;
    for (; at != across.end() && (*at)[0] == spring.i && (*at)[1] == spring.j; ++at) {
      known = true;
      const std::size_t e = (*at)[2];
      const auto around = edges_.around(e);
      if (vanished_[around[0] / 3] == 0 && vanished_[around[1] / 3] == 0 &&
          ends_in(around[0], e) == ends_in(around[1], e)) {
        add(spring, {node_at_[around[0]], node_at_[around[1]]}, 1);
        return;
      }
    }
    if (known)
      ++result_.removed;
    else
      free_spring(spring);
  }

  /// Whether the cut leaves this piece its part of the spring to `other`, and by which weight.
  std::optional<double> open_area(const Piece& piece, std::uint32_t other) const {
    std::optional<double> area;
    for (const std::uint32_t c : piece.corners)
      if (!std::binary_search(cut_.sides.begin(), cut_.sides.end(), Cut::Side{c, other}))
        area = area.value_or(0) + area_[c / 3];
    return area;
  }

  void central_spring(const model::Spring& spring) {
    std::vector<std::pair<Pair, double>> parts;
    const auto fan = fans_.find(spring.i);
    if (fan == fans_.end()) {
      add(spring, {spring.i, number(spring.j)}, 1);
      return;
    }
    for (const Piece& piece : fan->second)
      if (const auto area = open_area(piece, spring.j))
        parts.push_back({{piece.node, number(spring.j)}, *area});
    add_parts(spring, parts);
  }

  /// The copy of `node` that a spring without a triangle to `other` goes with.
  std::uint32_t copy_towards(std::uint32_t node, std::uint32_t other) const {
    return copy_towards(node, model_.nodes[other].position, other);
  }
  std::uint32_t copy_towards(std::uint32_t node, const Vec3& place, std::uint32_t other) const {
    const auto fan = fans_.find(node);
    if (fan == fans_.end())
      return number(node);
    std::uint32_t best = none;
    double max = 0;
    const Vec3& here = model_.nodes[node].position;
    for (const Piece& piece : fan->second) {
      if (!open_area(piece, other))
        continue;
      Vec3 way;
      for (const std::uint32_t c : piece.corners)
        for (const std::uint32_t corner : model_.triangles[c / 3])
          way += area_[c / 3] * (model_.nodes[corner].position - here);
      const double size = norm(way);
      const double cosine = size > 0 ? dot(way, place - here) / size : 0;
      if (best == none || cosine > max) {
        best = piece.node;
        max = cosine;
      }
    }
    return best;
  }

  void free_spring(const model::Spring& spring) {
    const std::uint32_t i = copy_towards(spring.i, spring.j), j = copy_towards(spring.j, spring.i);
    if (i == none || j == none)
      ++result_.removed;
    else
      add(spring, {i, j}, 1);
  }

  // ---- faces

  void triangles() {
    result_.model.triangles.reserve(model_.triangles.size());
    result_.model.texcoords.reserve(model_.texcoords.size());
    for (std::size_t t = 0; t < model_.triangles.size(); ++t) {
      if (vanished_[t] != 0)
        continue;
      result_.model.triangles.push_back(
          {node_at_[3 * t], node_at_[3 * t + 1], node_at_[3 * t + 2]});
      if (!model_.texcoords.empty())
        result_.model.texcoords.push_back(model_.texcoords[t]);
    }
  }

  void keep_left() {
    for (std::size_t e = 0; e < edges_.size(); ++e) {
      if (opened_[e] == 0)
        continue;
      std::optional<Pair> first;
      for (const std::uint32_t c : edges_.around(e)) {
        if (vanished_[c / 3] != 0)
          continue;
        const Pair ends = ends_in(c, e);
        if (first == ends)
          result_.left.edges.push_back(ends);
        first = ends;
      }
    }
    std::sort(result_.left.edges.begin(), result_.left.edges.end());
    std::vector<std::uint32_t> renumbered(model_.triangles.size());
    std::uint32_t next = 0;
    for (std::size_t t = 0; t < renumbered.size(); ++t)
      renumbered[t] = vanished_[t] != 0 ? none : next++;
    const std::vector<model::Spring>& springs = result_.model.springs;
    for (const Cut::Side& side : cut_.sides) {
      if (vanished_[side.corner / 3] != 0 || side.other >= model_.nodes.size())
        continue;
      const Pair ends = ordered(node_at_[side.corner], number(side.other));
      for (const model::SpringKind kind :
           {model::SpringKind::edge, model::SpringKind::bend, model::SpringKind::central}) {
        const auto key = std::tie(kind, ends[0], ends[1]);
        const auto at = std::lower_bound(springs.begin(), springs.end(), key,
                                         [](const gewebe::model::Spring& s, const auto& k) {
                                           return std::tie(s.kind, s.i, s.j) < k;
                                         });
        if (at != springs.end() && std::tie(at->kind, at->i, at->j) == key)
          result_.left.sides.push_back(
              {3 * renumbered[side.corner / 3] + side.corner % 3, number(side.other)});
      }
    }
    std::sort(result_.left.sides.begin(), result_.left.sides.end());
  }

  const model::Model& model_;
  const Cut& cut_;
  std::size_t surface_ = 0;
  model::SurfacePart part_;
  const mesh::EdgeTable& edges_;
  std::vector<std::uint8_t> gone_;                   ///< by spring
  std::vector<std::uint8_t> opened_;                 ///< by edge
  std::vector<std::uint8_t> vanished_;               ///< by triangle
  std::vector<std::uint8_t> touched_;                ///< by node: its fan may fall apart
  std::vector<double> area_;                         ///< by triangle of the part
  std::vector<std::uint32_t> node_at_;               ///< by corner: its node now
  std::map<std::uint32_t, std::vector<Piece>> fans_; ///< of doubled nodes, what keeps it first
  std::vector<std::uint32_t> copies_;                ///< by copy: its node
  std::vector<model::Spring> moved_;                 ///< with ends that they had not before
  CutModel result_;
};

} // namespace

Cut merged(const Cut& a, const Cut& b) {
  return {joined(a.springs, b.springs), joined(a.edges, b.edges), joined(a.sides, b.sides)};
}

void require_held(const model::Model& before, const CutModel& cut) {
  const std::size_t surface = model::surface_count(before);
  std::vector<std::uint8_t> held(before.nodes.size());
  for (const model::Spring& s : cut.model.springs)
    for (const std::uint32_t i : {s.i, s.j})
      held[cut.origin[i]] = 1;
  for (const model::Spring& s : before.springs)
    for (const std::uint32_t i : {s.i, s.j})
      if (i < surface && held[i] == 0 && before.nodes[i].fixed != model::fixed_none)
        throw Error("node " + std::to_string(i) +
                    " is fixed and would lose its last spring, expected a cut that leaves it one");
}

CutModel cut_model(const model::Model& model, const Cut& cut) {
  if (!model.tetrahedra.empty())
    throw Error("the model holds " + std::to_string(model.tetrahedra.size()) +
                " tetrahedra, expected springs and triangles alone to cut");
  return Cutter(model, cut).work();
}

} // namespace gewebe::cutting
