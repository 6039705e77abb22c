// Parts that a cut has freed.

#include "base/disjoint_sets.h"
#include "cutting/cut.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace gewebe::cutting {

namespace {

constexpr std::uint32_t none = CutModel::gone;

/// The set of each node, connected by springs, triangles and tetrahedra; returns how many.
std::uint32_t connected(const model::Model& model, std::vector<std::uint32_t>& set) {
  DisjointSets sets(model.nodes.size());
  for (const model::Spring& s : model.springs)
    sets.join(s.i, s.j);
  for (const Triangle& t : model.triangles) {
    sets.join(t[0], t[1]);
    sets.join(t[0], t[2]);
  }
  for (const Tetrahedron& t : model.tetrahedra)
    for (std::size_t k = 1; k < 4; ++k)
      sets.join(t[0], t[k]);
  for (std::size_t t = 0; t < model.middles.size(); ++t)
    for (const std::uint32_t middle : model.middles[t])
      sets.join(model.tetrahedra[t][0], middle);
  return sets.number(set);
}

/// The nodes with that mark. A central node to which none of them belongs is left out.
ModelPart part_of(const model::Model& model, const std::vector<std::uint32_t>& mark,
                  std::uint32_t value) {
  const std::size_t body = model::body_count(model);
  std::vector<bool> named(model.nodes.size());
  for (std::size_t i = 0; i < body; ++i)
    if (mark[i] == value && model.nodes[i].central >= 0)
      named[static_cast<std::size_t>(model.nodes[i].central)] = true;
  std::vector<std::uint32_t> place(model.nodes.size(), none);
  ModelPart part;
  model::Model& m = part.model;
  m.name = model.name;
  m.materials = model.materials;
  for (std::uint32_t i = 0; i < model.nodes.size(); ++i)
    if (mark[i] == value && (i < body || named[i])) {
      place[i] = static_cast<std::uint32_t>(part.origin.size());
      part.origin.push_back(i);
    }
  for (const std::uint32_t i : part.origin) {
    model::Node& node = m.nodes.emplace_back(model.nodes[i]);
    if (node.central >= 0)
      node.central = static_cast<std::int32_t>(place[static_cast<std::size_t>(node.central)]);
    if (!model.normals.empty())
      m.normals.push_back(model.normals[i]);
  }
  for (model::Spring s : model.springs) {
    s.i = place[s.i];
    s.j = place[s.j];
    if (s.i != none && s.j != none)
      m.springs.push_back(s);
  }
  for (std::size_t k = 0; k < model.triangles.size(); ++k) {
    Triangle t = model.triangles[k];
    for (std::uint32_t& corner : t)
      corner = place[corner];
    if (t[0] == none)
      continue;
    m.triangles.push_back(t);
    if (!model.texcoords.empty())
      m.texcoords.push_back(model.texcoords[k]);
  }
  const auto placed = [&](auto nodes) {
    for (std::uint32_t& node : nodes)
      node = place[node];
    return nodes;
  };
  for (std::size_t t = 0; t < model.tetrahedra.size(); ++t) {
    if (place[model.tetrahedra[t][0]] == none)
      continue;
    m.tetrahedra.push_back(placed(model.tetrahedra[t]));
    m.tetrahedron_material.push_back(model.tetrahedron_material[t]);
    if (!model.middles.empty())
      m.middles.push_back(placed(model.middles[t]));
  }
  return part;
}

} // namespace

FreeParts free_parts(const model::Model& before, const CutModel& cut) {
  const model::Model& model = cut.model;
  const std::size_t body = model::body_count(model);
  std::vector<std::uint32_t> old_set, set;
  const std::uint32_t count = connected(model, set);
  if (count == 1)
    return {};
  const std::uint32_t olds = connected(before, old_set);
  struct Group {
    std::uint32_t old = none, nodes = 0; // no central ones
    bool held = false, stays = false;
  };
  std::vector<Group> groups(count);
  for (std::uint32_t i = 0; i < model.nodes.size(); ++i) {
    Group& g = groups[set[i]];
    g.held = g.held || model.nodes[i].fixed != model::fixed_none;
    if (i >= body)
      continue;
    g.old = old_set[cut.origin[i]];
    ++g.nodes;
  }
  std::vector<bool> held(olds);
  std::vector<std::uint32_t> largest(olds, none);
  for (std::uint32_t k = 0; k < count; ++k) {
    const Group& g = groups[k];
    if (g.nodes == 0)
      continue; // a central node alone
    held[g.old] = held[g.old] || g.held;
    if (largest[g.old] == none || g.nodes > groups[largest[g.old]].nodes)
      largest[g.old] = k;
  }
  for (std::uint32_t k = 0; k < count; ++k) {
    Group& g = groups[k];
    if (g.nodes == 0)
      g.stays = g.held;
    else
      g.stays = held[g.old] ? g.held : largest[g.old] == k;
  }
  // Marks: 0 for the rest, others by smallest node, which is the order of the sets.
  std::vector<std::uint32_t> mark_of_set(count, 0);
  std::uint32_t marks = 1;
  for (std::uint32_t k = 0; k < count; ++k)
    if (!groups[k].stays)
      mark_of_set[k] = groups[k].nodes == 0 ? none : marks++;
  std::vector<std::uint32_t> mark(model.nodes.size());
  for (std::size_t i = 0; i < mark.size(); ++i)
    mark[i] = mark_of_set[set[i]];
  FreeParts result;
  if (std::all_of(mark.begin(), mark.end(), [](std::uint32_t m) { return m == 0; }))
    return result;
  result.rest = part_of(model, mark, 0);
  for (std::uint32_t k = 1; k < marks; ++k)
    result.parts.push_back(part_of(model, mark, k));
  return result;
}

CutModel without_parts(CutModel cut, std::optional<ModelPart> rest) {
  if (!rest)
    return cut;
  std::vector<std::uint32_t> place(cut.model.nodes.size(), none);
  for (std::uint32_t i = 0; i < rest->origin.size(); ++i)
    place[rest->origin[i]] = i;
  for (std::uint32_t& p : cut.place)
    p = p == none ? none : place[p];
  std::vector<std::uint32_t> origin;
  std::vector<double> share;
  for (const std::uint32_t i : rest->origin) {
    origin.push_back(cut.origin[i]);
    share.push_back(cut.share[i]);
  }
  std::vector<CutModel::Between> between;
  for (CutModel::Between& b : cut.between)
    if (place[b.node] != none)
      between.push_back({place[b.node], std::move(b.of)});
  cut.between = std::move(between);
  // Edges that wait to come apart keep their triangles' numbers only if none is gone.
  Cut left;
  for (const auto& [i, j] : cut.left.edges)
    if (place[i] != none && place[j] != none)
      left.edges.push_back({place[i], place[j]});
  std::vector<std::uint32_t> triangle(cut.model.triangles.size(), none);
  std::uint32_t next = 0;
  for (std::size_t t = 0; t < triangle.size(); ++t)
    if (place[cut.model.triangles[t][0]] != none)
      triangle[t] = next++;
  for (const Cut::Side& side : cut.left.sides)
    if (triangle[side.corner / 3] != none && place[side.other] != none)
      left.sides.push_back({3 * triangle[side.corner / 3] + side.corner % 3, place[side.other]});
  cut.left = std::move(left);
  cut.origin = std::move(origin);
  cut.share = std::move(share);
  cut.model = std::move(rest->model);
  return cut;
}

} // namespace gewebe::cutting
