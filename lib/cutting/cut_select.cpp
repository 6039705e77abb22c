#include "cutting/cut_select.h"

#include "base/error.h"
#include "model/surface_part.h"
#include "text/number_text.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <string>
#include <utility>

namespace gewebe::cutting {

namespace {

constexpr int max_rounds = 8; ///< of tidying the rim of a cut

void put_in_order(Cut& cut) {
  const auto tidy = [](auto& list) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  };
  tidy(cut.springs);
  tidy(cut.edges);
  tidy(cut.sides);
}

std::vector<Vec3> positions(const model::Model& model, std::span<const double> displacement) {
  std::vector<Vec3> all;
  all.reserve(model.nodes.size());
  for (const model::Node& n : model.nodes)
    all.push_back(n.position);
  for (std::size_t i = 0; i < displacement.size() / 3; ++i)
    all[i] += {displacement[3 * i], displacement[3 * i + 1], displacement[3 * i + 2]};
  return all;
}

/// A whole plane, but only near some nodes.
struct PlaneArea {
  static constexpr bool bounded = false;
  Vec3 point, normal;
  std::vector<std::uint8_t> nodes; ///< by node; empty: all

  double side(const Vec3& p) const { return dot(normal, p - point); }
  bool near(const Vec3& min, const Vec3& max) const {
    const Vec3 half = 0.5 * (max - min);
    double reach = 0;
    for (int a = 0; a < 3; ++a)
      reach += std::abs(normal[a]) * half[a];
    return !(std::abs(side(0.5 * (min + max))) > reach);
  }
  bool has(std::uint32_t node) const { return nodes.empty() || nodes[node] != 0; }
  bool parts(const Vec3&, const Vec3& a, const Vec3& b) const {
    return (side(a) > 0) != (side(b) > 0);
  }
  bool pierced(const Vec3& a, const Vec3& b) const { return parts({}, a, b); }
};

/// Four-sided pieces.
class QuadArea {
public:
  static constexpr bool bounded = true;
  explicit QuadArea(std::span<const SweptQuad> quads) {
    for (const SweptQuad& q : quads) {
      const Vec3 n = cross(q[2] - q[0], q[3] - q[1]);
      const double size = norm(n);
      if (!(size > 0))
        continue;
      pieces_.push_back({q, n / size});
      for (const Vec3& p : q)
        box_.add(p);
    }
  }
  bool empty() const { return pieces_.empty(); }
  const Box3& box() const { return box_; }
  /// Whether a box reaches this one.
  bool near(const Vec3& min, const Vec3& max) const {
    for (int a = 0; a < 3; ++a)
      if (!(min[a] <= box_.max[a] && max[a] >= box_.min[a]))
        return false;
    return true;
  }
  bool has(std::uint32_t) const { return true; }
  bool parts(const Vec3& middle, const Vec3& a, const Vec3& b) const {
    return std::any_of(pieces_.begin(), pieces_.end(), [&](const Piece& p) {
      return (p.side(a) > 0) != (p.side(b) > 0) && p.covers(middle);
    });
  }
  bool pierced(const Vec3& a, const Vec3& b) const {
    return std::any_of(pieces_.begin(), pieces_.end(), [&](const Piece& p) {
      const double s = p.side(a), t = p.side(b);
      return (s > 0) != (t > 0) && p.covers(a + s / (s - t) * (b - a));
    });
  }

private:
  struct Piece {
    SweptQuad corner;
    Vec3 normal;

    double side(const Vec3& p) const { return dot(normal, p - corner[0]); }
    /// Whether the point projects into one of the two triangles.
    bool covers(const Vec3& p) const {
      return covers(p, corner[1], corner[2]) || covers(p, corner[2], corner[3]);
    }
    bool covers(const Vec3& p, const Vec3& b, const Vec3& c) const {
      const Vec3& a = corner[0];
      const double u = dot(normal, cross(b - a, p - a)), v = dot(normal, cross(c - b, p - b)),
                   w = dot(normal, cross(a - c, p - c));
      return (u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0);
    }
  };
  std::vector<Piece> pieces_;
  Box3 box_;
};

/// The corners of triangles at each node.
struct CornersOfNodes {
  std::vector<std::uint32_t> first, corners;

  explicit CornersOfNodes(const model::Model& model) : first(model.nodes.size() + 1) {
    for (const Triangle& t : model.triangles)
      for (const std::uint32_t node : t)
        ++first[node + std::size_t{1}];
    std::partial_sum(first.begin(), first.end(), first.begin());
    corners.resize(3 * model.triangles.size());
    std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
    for (std::uint32_t t = 0; t < model.triangles.size(); ++t)
      for (std::uint32_t k = 0; k < 3; ++k)
        corners[next[model.triangles[t][k]]++] = 3 * t + k;
  }
  std::span<const std::uint32_t> of(std::uint32_t node) const {
    return {corners.data() + first[node], corners.data() + first[node + std::size_t{1}]};
  }
};

/// Pairs of nodes opposite to each other across an edge, ascending.
std::vector<std::array<std::uint32_t, 2>> opposite_pairs(const model::Model& model,
                                                         const mesh::EdgeTable& edges) {
  std::vector<std::array<std::uint32_t, 2>> pairs;
  for (std::size_t e = 0; e < edges.size(); ++e)
    if (const auto around = edges.around(e); around.size() == 2) {
      const std::uint32_t a = model.triangles[around[0] / 3][around[0] % 3],
                          b = model.triangles[around[1] / 3][around[1] % 3];
      pairs.push_back({std::min(a, b), std::max(a, b)});
    }
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

/// Nodes of all that may come apart. \param far that it may be from the area
template <class Area>
std::vector<std::uint8_t> marked_near(const std::vector<Vec3>& at, const Area& area, double far) {
  const Vec3 grown{far, far, far};
  std::vector<std::uint8_t> marked(at.size());
  for (std::uint32_t i = 0; i < at.size(); ++i)
    marked[i] = area.has(i) && area.near(at[i] - grown, at[i] + grown) ? 1 : 0;
  return marked;
}

/// How far a corner is from its triangle's middle, at most.
double longest_reach(const model::Model& model, const std::vector<Vec3>& at,
                     const std::vector<Vec3>& middle) {
  double square = 0;
  for (std::size_t t = 0; t < middle.size(); ++t)
    for (const std::uint32_t corner : model.triangles[t]) {
      const Vec3 d = at[corner] - middle[t];
      square = std::max(square, dot(d, d));
    }
  return std::sqrt(square);
}

std::vector<Vec3> middles(const model::Model& model, const std::vector<Vec3>& at) {
  std::vector<Vec3> all;
  all.reserve(model.triangles.size());
  for (const Triangle& t : model.triangles)
    all.push_back((at[t[0]] + at[t[1]] + at[t[2]]) / 3);
  return all;
}

template <class Area>
class AreaCutter {
public:
  AreaCutter(const model::Model& model, const std::vector<Vec3>& at, const Area& area)
      : model_(model), at_(at), area_(area), middle_(middles(model, at)) {
    // A triangle reaches so far from the midpoint of its edge. Each round that tidies the rim moves
    // it by a triangle, bending springs reach over two.
    const double reach = longest_reach(model, at, middle_);
    const double far = (2 * max_rounds + 8) * reach;
    edges_ = model::surface_part(model, marked_near(at, area, far)).edges;
    const double around_edge = Area::bounded ? 2 * reach : far;
    grown_ = {around_edge, around_edge, around_edge};
  }

  Cut cut() {
    Cut cut;
    for (const std::size_t e : opened_edges())
      cut.edges.push_back(edges_.ends[e]);
    cut_springs(cut);
    put_in_order(cut);
    return cut;
  }

private:
  bool opens(std::size_t e) const {
    const auto [i, j] = edges_.ends[e];
    const auto around = edges_.around(e);
    const Vec3 here = 0.5 * (at_[i] + at_[j]);
    if (around.size() < 2 || !area_.has(i) || !area_.has(j) ||
        !area_.near(here - grown_, here + grown_))
      return false;
    for (std::size_t k = 1; k < around.size(); ++k)
      if (area_.parts(here, middle_[around[0] / 3], middle_[around[k] / 3]))
        return true;
    return false;
  }

  std::vector<std::size_t> opened_edges() {
    std::vector<std::size_t> opened;
    for (int round = 0;; ++round) {
      opened.clear();
      for (std::size_t e = 0; e < edges_.size(); ++e)
        if (opens(e))
          opened.push_back(e);
      if (round == max_rounds || !move_teeth(opened))
        return opened;
    }
  }

  /// A triangle that would be left with one neighbour on its side goes to the other one: it counts
  /// as standing where its neighbour there does. So the rim has no teeth that hang loosely. Returns
  /// whether there was any.
  bool move_teeth(const std::vector<std::size_t>& opened) {
    std::map<std::uint32_t, std::pair<int, std::uint32_t>> teeth; // opened edges, triangle across
    for (const std::size_t e : opened) {
      const auto around = edges_.around(e);
      if (around.size() != 2)
        continue;
      for (const std::size_t k : {0U, 1U}) {
        auto& [count, across] = teeth[around[k] / 3];
        across = count++ == 0 ? around[1 - k] / 3 : across;
      }
    }
    std::set<std::uint32_t> moved;
    for (const auto& [t, tooth] : teeth)
      if (tooth.first > 1 && !moved.contains(tooth.second)) {
        middle_[t] = middle_[tooth.second];
        moved.insert(t);
      }
    return !moved.empty();
  }

  /// Whether all sides of `from` lie across the area from `to`, and which do.
  bool passes(std::uint32_t from, std::uint32_t to, std::vector<Cut::Side>& sides) const {
    const std::span<const std::uint32_t> corners = fans_.of(from);
    if (corners.empty())
      return area_.pierced(at_[from], at_[to]);
    std::size_t count = 0;
    for (const std::uint32_t c : corners)
      if (area_.pierced(middle_[c / 3], at_[to])) {
        sides.push_back({c, to});
        ++count;
      }
    return count == corners.size();
  }

  bool is_near(const model::Spring& spring) const {
    Vec3 low = at_[spring.i], high = low;
    for (int a = 0; a < 3; ++a) {
      low[a] = std::min(low[a], at_[spring.j][a]);
      high[a] = std::max(high[a], at_[spring.j][a]);
    }
    return area_.near(low - grown_, high + grown_);
  }

  /// Those without a triangle.
  void cut_springs(Cut& cut) const {
    std::vector<std::array<std::uint32_t, 2>> across;
    std::size_t edge = 0;
    for (std::size_t s = 0; s < model_.springs.size(); ++s) {
      const model::Spring& spring = model_.springs[s];
      const std::array<std::uint32_t, 2> ends{spring.i, spring.j};
      if (spring.kind == model::SpringKind::edge) {
        while (edge < edges_.size() && edges_.ends[edge] < ends)
          ++edge;
        if (edge < edges_.size() && edges_.ends[edge] == ends)
          continue;
      }
      const bool central = spring.kind == model::SpringKind::central;
      if (!area_.has(spring.i) || !(central || area_.has(spring.j)) || !is_near(spring))
        continue;
      std::vector<Cut::Side> sides;
      const bool severed =
          passes(spring.i, spring.j, sides) || (!central && passes(spring.j, spring.i, sides));
      if (!severed && sides.empty())
        continue;
      if (spring.kind == model::SpringKind::bend) {
        if (across.empty())
          across = opposite_pairs(model_, edges_);
        if (std::binary_search(across.begin(), across.end(), ends))
          continue; // gone with the edge that it crosses
      }
      if (severed)
        cut.springs.push_back(s);
      else
        cut.sides.insert(cut.sides.end(), sides.begin(), sides.end());
    }
  }

  const model::Model& model_;
  const std::vector<Vec3>& at_;
  const Area& area_;
  std::vector<Vec3> middle_;
  mesh::EdgeTable edges_;
  Vec3 grown_;
  CornersOfNodes fans_{model_};
};

template <class Area>
Cut area_cut(const model::Model& model, const std::vector<Vec3>& at, const Area& area) {
  return AreaCutter<Area>(model, at, area).cut();
}

std::string text(const Vec3& v) {
  return text::number_text(v.x) + " " + text::number_text(v.y) + " " + text::number_text(v.z);
}

std::vector<std::uint8_t> flags(const model::Model& model, std::span<const std::uint32_t> nodes) {
  std::vector<std::uint8_t> all(model.nodes.size());
  for (const std::uint32_t node : nodes)
    all[node] = 1;
  return all;
}

} // namespace

Cut springs_between(const model::Model& model, std::span<const std::uint32_t> from,
                    std::span<const std::uint32_t> to) {
  const std::vector<std::uint8_t> a = flags(model, from), b = flags(model, to);
  Cut cut;
  for (std::size_t s = 0; s < model.springs.size(); ++s) {
    const auto [i, j] = std::pair(model.springs[s].i, model.springs[s].j);
    if ((a[i] != 0 && b[j] != 0) || (a[j] != 0 && b[i] != 0))
      cut.springs.push_back(s);
  }
  if (cut.springs.empty())
    throw Error("no spring joins these nodes, expected at least one that is not cut yet");
  return cut;
}

Cut plane_cut(const model::Model& model, const CutPlane& plane,
              std::span<const std::uint32_t> nodes) {
  PlaneArea area{plane.point, plane.normal / norm(plane.normal), {}};
  if (!nodes.empty())
    area.nodes = flags(model, nodes);
  Cut cut = area_cut(model, positions(model, {}), area);
  if (cut.empty())
    throw Error("the plane through " + text(plane.point) + " across " + text(plane.normal) +
                " meets no edge between triangles" + (nodes.empty() ? "" : " of these nodes") +
                " and no spring, expected one that is not cut yet");
  return cut;
}

Cut swept_cut(const model::Model& model, std::span<const double> displacement,
              std::span<const SweptQuad> areas) {
  const QuadArea area(areas);
  if (area.empty())
    return {};
  const std::vector<Vec3> at = positions(model, displacement);
  Box3 box;
  for (const Vec3& p : at)
    box.add(p);
  if (!area.near(box.min, box.max))
    return {};
  return area_cut(model, at, area);
}

namespace {

/// Opens the fan of `node` across the way to `far`. \return whether it can
bool open_across(const model::Model& model, const std::vector<Vec3>& at,
                 const mesh::EdgeTable& edges, const CornersOfNodes& fans, std::uint32_t node,
                 std::uint32_t far, std::vector<std::array<std::uint32_t, 2>>& opened) {
  const Vec3 way = at[far] - at[node];
  Vec3 normal;
  for (const std::uint32_t c : fans.of(node)) {
    const Triangle& t = model.triangles[c / 3];
    normal += cross(at[t[1]] - at[t[0]], at[t[2]] - at[t[0]]);
  }
  const Vec3 aside = cross(normal, way);
  struct Choice {
    double cosine = 2;
    std::array<std::uint32_t, 2> edge{};
  };
  std::array<Choice, 2> best; // on either side
  bool border = false;
  for (const std::uint32_t c : fans.of(node))
    for (std::uint32_t k = 1; k < 3; ++k) {
      const std::uint32_t other = model.triangles[c / 3][(c + k - c / 3 * 3) % 3];
      const std::array<std::uint32_t, 2> ends{std::min(node, other), std::max(node, other)};
      if (edges.around(edges.find(ends)).size() != 2) {
        border = true;
        continue;
      }
      const Vec3 d = at[other] - at[node];
      const double size = norm(d) * norm(way);
      if (other == far || !(size > 0))
        continue;
      Choice& choice = best[dot(d, aside) > 0 ? 1 : 0];
      const double cosine = std::abs(dot(d, way)) / size;
      if (cosine < choice.cosine)
        choice = {cosine, ends};
    }
  // At the border of the surface one edge is enough to part the fan.
  if (border && best[0].cosine > best[1].cosine)
    std::swap(best[0], best[1]);
  if (best[0].cosine > 1 || (!border && best[1].cosine > 1))
    return false;
  opened.push_back(best[0].edge);
  if (!border)
    opened.push_back(best[1].edge);
  return true;
}

} // namespace

Cut torn_cut(const model::Model& model, std::span<const double> displacement, double strain) {
  const std::vector<Vec3> at = positions(model, displacement);
  std::vector<std::size_t> torn;
  std::vector<double> pull(model.nodes.size());
  for (std::size_t s = 0; s < model.springs.size(); ++s) {
    const model::Spring& spring = model.springs[s];
    const double length = norm(at[spring.j] - at[spring.i]), more = length - spring.rest;
    if (more > 0) {
      pull[spring.i] += spring.stiffness * more;
      pull[spring.j] += spring.stiffness * more;
    }
    if (length > (1 + strain) * spring.rest)
      torn.push_back(s);
  }
  Cut cut;
  if (torn.empty())
    return cut;
  std::vector<std::uint8_t> ends_of_torn(model.nodes.size());
  for (const std::size_t s : torn)
    ends_of_torn[model.springs[s].i] = ends_of_torn[model.springs[s].j] = 1;
  const mesh::EdgeTable edges = model::surface_part(model, ends_of_torn).edges;
  const CornersOfNodes fans(model);
  for (const std::size_t s : torn) {
    const model::Spring& spring = model.springs[s];
    const bool beside = spring.kind == model::SpringKind::edge &&
                        edges.find({spring.i, spring.j}) != mesh::EdgeTable::no_edge;
    const bool i_first = pull[spring.i] >= pull[spring.j];
    const std::uint32_t first = i_first ? spring.i : spring.j,
                        second = i_first ? spring.j : spring.i;
    if (!beside || !(open_across(model, at, edges, fans, first, second, cut.edges) ||
                     open_across(model, at, edges, fans, second, first, cut.edges)))
      cut.springs.push_back(s);
  }
  put_in_order(cut);
  return cut;
}

} // namespace gewebe::cutting
