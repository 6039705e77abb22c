// Cuts of solids: planes at rest, blades where the solid is, piece by piece of their ways.

#include "cutting/cut_skin.h"
#include "cutting/cut_solid.h"
#include "embedding/solid_place.h"
#include "fem/solid_model.h"
#include "geometry/boxes_meet.h"
#include "geometry/vector_at.h"
#include "scene/world_internal.h"
#include "text/number_text.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace gewebe::scene {

namespace {

constexpr double trail_length = 2; // of the longest edge: a wound ends an element before a blade
constexpr double trail_step = 1.0 / 32; // of it, at least, between edges that are kept
constexpr std::size_t most_edges = 256;
constexpr std::array sheet_shifts{0.0, 0.13, 0.29, 0.41}; // of its cell, one after the other
constexpr double row_step = 0.25; // of a sheet's cell, at least, between rows that are kept

/// What would no longer be where it is if it were moved: displaced, as grasped nodes are too, and
/// tied.
std::vector<std::uint32_t> held_nodes(const World& w, std::size_t index) {
  std::vector<std::uint32_t> held;
  for (const auto& [node, u] : w.now.objects[index].load->displacement)
    held.push_back(node);
  for (const Tie& tie : w.now.ties) {
    if (tie.object == index)
      held.push_back(tie.node);
    if (tie.other == index)
      held.push_back(tie.other_node);
  }
  return held;
}

/// Where its nodes are, and elements to carry points along.
class Carried {
public:
  Carried(World& w, Object& object) : model_(object.model()) {
    if (object.body != nullptr) {
      for (const dynamics::NodeMotion& m : motion_of(object))
        u_.insert(u_.end(), {m.displacement.x, m.displacement.y, m.displacement.z});
    } else if (object.method == Method::ffe) {
      const std::span<const double> shape = whole_shape_in_step(w, object);
      u_.assign(shape.begin(), shape.end());
    }
    if (std::ranges::all_of(u_, [](double u) { return u == 0; }))
      u_.clear();
    for (std::size_t i = 0; i < model_.nodes.size(); ++i) {
      const Vec3 place = model_.nodes[i].position + (at_rest() ? Vec3{} : vector_at(u_, i));
      box_.add(place);
      if (!at_rest())
        places_.push_back(place);
    }
  }

  bool at_rest() const { return u_.empty(); }
  const Box3& box() const { return box_; }
  std::span<const Vec3> places() const { return places_; }

  /// The place at rest of what stands here: of what stands off the solid as its nearest element
  /// has it.
  Vec3 rest_of(const Vec3& place) {
    if (at_rest())
      return place;
    if (!deformed_) {
      deformed_ = fem::element_mesh(model_);
      deformed_->points = places_;
    }
    const embedding::SolidPlace found = embedding::find_place(*deformed_, place);
    Vec3 rest;
    for (std::size_t k = 0; k < found.count; ++k)
      rest += found.weight[k] * model_.nodes[found.node[k]].position;
    return rest;
  }
  Vec3 place_of(const Vec3& rest) {
    if (at_rest())
      return rest;
    if (!rest_)
      rest_ = fem::element_mesh(model_);
    return rest + embedding::displacement_at(embedding::find_place(*rest_, rest), u_);
  }

private:
  const model::Model& model_;
  std::vector<double> u_; // 3 n, or none at rest
  std::vector<Vec3> places_;
  Box3 box_;
  std::optional<tetrahedra::TetMesh> rest_, deformed_;
};

double longest_edge(const model::Model& model) {
  double longest = 0;
  for (const Tetrahedron& t : model.tetrahedra)
    for (const auto& [a, b] : tetrahedra::tetrahedron_edges) {
      const Vec3 d = model.nodes[t[b]].position - model.nodes[t[a]].position;
      longest = std::max(longest, dot(d, d));
    }
  return std::sqrt(longest);
}

using Edge = std::array<Vec3, 2>;

bool finite(const Edge& edge) {
  return is_finite(edge[0]) && is_finite(edge[1]);
}

double way(const Edge& from, const Edge& to) {
  return std::max(norm(to[0] - from[0]), norm(to[1] - from[1]));
}

/// Of the area between two edges; 0 where there is none.
Vec3 normal_of(const Edge& from, const Edge& to) {
  return cross(to[1] - from[0], to[0] - from[1]);
}

TriangleMesh strip_of(const std::vector<Edge>& edges) {
  TriangleMesh strip;
  for (std::uint32_t n = 0; n < edges.size(); ++n) {
    strip.points.insert(strip.points.end(), {edges[n][0], edges[n][1]});
    if (n == 0)
      continue;
    const std::uint32_t p = 2 * n - 2;
    strip.triangles.push_back({p, p + 2, p + 1});
    strip.triangles.push_back({p + 2, p + 3, p + 1});
  }
  return strip;
}

struct CutByBlade {
  cutting::CutModel cut;
  std::vector<Vec3> skin_end; ///< SkinCut::end
};

/// Nothing where it comes nowhere apart.
std::optional<CutByBlade> cut_by(const World& w, std::size_t index, const TriangleMesh& blade,
                                 incision::BladeCutOptions options,
                                 const cutting::SkinSheet& sheet) {
  const model::Model& model = w.now.objects[index].model();
  const std::vector<std::uint32_t> held = held_nodes(w, index);
  options.held = held;
  cutting::SolidCut cut = cutting::cut_solid(model, blade, options, &sheet);
  if (cut.report.doubled == 0)
    return std::nullopt;
  std::vector<Vec3> end = std::move(cut.skin_end);
  return CutByBlade{cutting::as_cut_model(model, std::move(cut)), std::move(end)};
}

// ---- Where blades pass a skin: rows of points at rest

using Row = std::vector<Vec3>;

Row row_of(const model::Model& model, const Edge& edge, double cell, Carried& carried) {
  if (model.skin.points.empty())
    return {};
  const double length = norm(edge[1] - edge[0]);
  const auto count = static_cast<std::size_t>(
      std::clamp(std::ceil(length / cell), 1.0, static_cast<double>(most_edges)));
  Row row;
  for (std::size_t k = 0; k <= count; ++k) {
    const double share = static_cast<double>(k) / static_cast<double>(count);
    row.push_back(carried.rest_of((1 - share) * edge[0] + share * edge[1]));
  }
  return row;
}

void add_row(std::vector<Row>& rows, Row row, double cell) {
  if (row.empty() || !std::ranges::all_of(row, [](const Vec3& p) { return is_finite(p); }))
    return;
  if (rows.size() > 1) {
    const Row& before = rows[rows.size() - 2];
    if (way({before.front(), before.back()}, {rows.back().front(), rows.back().back()}) <
        row_step * cell)
      rows.pop_back();
  }
  rows.push_back(std::move(row));
  if (rows.size() > most_edges)
    rows.erase(rows.begin());
}

/// Those since the skin was cut last by a blade that goes on from where it ended.
std::vector<Row> rows_before(const Object& object, const BladeArea& area) {
  const Edge start{area.corners[0], area.corners[1]};
  for (const BladeTrail& trail : object.cut.trails)
    if (trail.instrument == area.instrument && trail.last == start)
      return trail.rows;
  return {};
}

/// The trail of a blade that goes on from where it ended: of the solid, for that may have moved
/// since. A new one where it does not.
std::vector<Edge> trail_before(const Object& object, const BladeArea& area, Carried& carried) {
  const Edge start{area.corners[0], area.corners[1]};
  for (const BladeTrail& trail : object.cut.trails) {
    if (trail.instrument != area.instrument || trail.last != start)
      continue;
    std::vector<Edge> edges;
    for (const Edge& rest : trail.edges)
      edges.push_back({carried.place_of(rest[0]), carried.place_of(rest[1])});
    if (std::ranges::all_of(edges, finite))
      return edges;
  }
  return {start};
}

/// Keeps the part of a trail that later cuts may need, at rest.
/// \pre the object has no trail of this blade
void leave_trail(Object& object, std::size_t instrument, const std::vector<Edge>& edges,
                 std::vector<Row> rows, Carried& carried) {
  BladeTrail trail{instrument, {}, edges.back(), std::move(rows)};
  const double longest = longest_edge(object.model());
  double length = 0;
  std::vector<Edge> kept{edges.back()};
  for (std::size_t n = edges.size() - 1; n-- > 0 && length <= trail_length * longest;) {
    const double step = way(edges[n], kept.back());
    if (step < trail_step * longest && n > 0)
      continue;
    length += step;
    kept.push_back(edges[n]);
    if (kept.size() == most_edges)
      break;
  }
  for (auto edge = kept.rbegin(); edge != kept.rend(); ++edge)
    trail.edges.push_back({carried.rest_of((*edge)[0]), carried.rest_of((*edge)[1])});
  if (std::ranges::all_of(trail.edges, finite))
    object.cut.trails.push_back(std::move(trail));
}

/// Within which a blade may come to a solid that moves.
Box3 wider(const Box3& box) {
  const double by = 0.25 * box.longest_side();
  return {box.min - Vec3{by, by, by}, box.max + Vec3{by, by, by}};
}

} // namespace

std::optional<cutting::CutModel> cut_by_plane(const World& w, std::size_t index,
                                              const PlaneToCut& plane, bool skin_too) {
  const model::Model& model = w.now.objects[index].model();
  incision::BladeCutOptions options;
  options.along_faces = plane.along_faces;
  std::vector<std::uint8_t> among;
  if (plane.nodes) {
    among.resize(model.nodes.size());
    for (const std::uint32_t node : *plane.nodes)
      among[node] = 1;
    options.among = among;
  }
  const TriangleMesh blade = cutting::plane_blade(model, plane.plane);
  const auto cut_with = [&](const cutting::SkinSheet& sheet) -> std::optional<cutting::CutModel> {
    std::optional<CutByBlade> cut = cut_by(w, index, blade, options, sheet);
    return cut ? std::optional(std::move(cut->cut)) : std::nullopt;
  };
  if (!skin_too || model.skin.points.empty())
    return cut_with({});
  const auto cut_shifted = [&](double shift) {
    return cut_with(
        cutting::plane_sheet(model.skin, plane.plane, cutting::sheet_cell(model), shift));
  };
  for (const double shift : std::span(sheet_shifts).first(sheet_shifts.size() - 1))
    try {
      return cut_shifted(shift);
    } catch (const mesh::MeetingOfNoSheets&) { // its lines meet the embedded surface's edges up to
      continue;                                // rounding; the next shift may avoid them
    }
  return cut_shifted(sheet_shifts.back());
}

/// \throw Error where it parts nothing
cutting::CutModel plane_through(const World& w, std::size_t index, const PlaneToCut& plane) {
  std::optional<cutting::CutModel> cut;
  try {
    cut = cut_by_plane(w, index, plane);
  } catch (const mesh::MeetingOfNoSheets& error) {
    throw Error("the skin can't be cut there: " + std::string(error.what()) +
                ": another plane, or a model without its skin (exp2ela --no-skin)");
  }
  if (!cut)
    throw Error("the plane through " + text::number_text(plane.plane.point.x) + " " +
                text::number_text(plane.plane.point.y) + " " +
                text::number_text(plane.plane.point.z) + " across " +
                text::number_text(plane.plane.normal.x) + " " +
                text::number_text(plane.plane.normal.y) + " " +
                text::number_text(plane.plane.normal.z) + " parts no tetrahedra" +
                (plane.nodes ? " of these nodes" : "") + ", expected one that is not cut yet");
  return std::move(*cut);
}

/// Runs of a blade's way that don't turn back are cut with one after the other.
void sweep_solid(World& w, std::size_t index, std::span<const BladeArea> areas) {
  const auto near = [&](const Box3& box, const BladeArea& area) {
    Box3 swept;
    for (const Vec3& corner : area.corners)
      swept.add(corner);
    return meet(box, swept);
  };
  std::optional<Carried> carried;
  for (std::size_t n = 0; n < areas.size();) {
    if (!carried)
      carried.emplace(w, w.now.objects[index]);
    const std::size_t instrument = areas[n].instrument;
    const model::Model& model = w.now.objects[index].model();
    const double cell = model.skin.points.empty() ? 0 : cutting::sheet_cell(model);
    std::vector<Edge> edges = trail_before(w.now.objects[index], areas[n], *carried);
    std::vector<Row> rows = rows_before(w.now.objects[index], areas[n]);
    if (rows.empty())
      add_row(rows, row_of(model, edges.back(), cell, *carried), cell);
    Vec3 normal = edges.size() < 2 ? Vec3{} : normal_of(edges[edges.size() - 2], edges.back());
    bool meets = false, comes_near = false;
    std::size_t first = n;
    for (; n < areas.size() && areas[n].instrument == instrument; ++n) {
      const Edge next{areas[n].corners[3], areas[n].corners[2]};
      if (next == edges.back())
        continue; // it stands still
      const Vec3 here = normal_of(edges.back(), next);
      if (dot(normal, here) < 0) {
        if (n > first)
          break; // the rest is another run
        edges = {edges.back()};
        if (!rows.empty())
          rows = {rows.back()};
      }
      normal = here;
      edges.push_back(next);
      add_row(rows, row_of(model, next, cell, *carried), cell);
      meets = meets || near(carried->box(), areas[n]);
      comes_near = comes_near || near(wider(carried->box()), areas[n]);
    }
    Object& object = w.now.objects[index];
    std::erase_if(object.cut.trails,
                  [&](const BladeTrail& trail) { return trail.instrument == instrument; });
    if (!comes_near || (meets && !may_cut(w, object, Feature::blade)))
      continue;
    if (!meets && !rows.empty())
      rows = {rows.back()};
    leave_trail(object, instrument, meets ? edges : std::vector<Edge>{edges.back()}, rows,
                *carried);
    if (!meets)
      continue;
    at_object(w, object, [&] {
      incision::BladeCutOptions options;
      options.places = carried->places();
      std::optional<CutByBlade> cut;
      bool skin_too = !rows.empty();
      try {
        cut = cut_by(w, index, strip_of(edges), options, cutting::strip_sheet(rows));
      } catch (const mesh::MeetingOfNoSheets& error) { // it may be with the rows to come
        skin_too = false;
        cut = cut_by(w, index, strip_of(edges), options, {});
        if (w.options.warn)
          w.options.warn("object " + object.name() + " at " + text::number_text(w.now.clock.time) +
                         " s: its skin is not cut by this step: " + error.what());
      }
      if (cut) {
        for (BladeTrail& trail : object.cut.trails)
          if (trail.instrument == instrument && skin_too)
            trail.rows = {std::move(cut->skin_end)};
        carry_out(w, index, std::move(cut->cut));
        carried.reset();
      }
    });
  }
}

} // namespace gewebe::scene
