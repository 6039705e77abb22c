#include "cutting/skin_binding.h"

#include "embedding/element_boxes.h"
#include "tetrahedra/faces.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <utility>

namespace gewebe::cutting {
namespace {

/// Elements whose boxes meet one.
std::vector<std::uint32_t> elements_in(const model::Model& model, const Box3& box) {
  std::vector<std::uint32_t> found;
  for (std::uint32_t t = 0; t < model.tetrahedra.size(); ++t) {
    Box3 own;
    for (const std::uint32_t node : model.tetrahedra[t])
      own.add(model.nodes[node].position);
    bool meets = true;
    for (int a = 0; a < 3; ++a)
      meets = meets && own.min[a] <= box.max[a] && box.min[a] <= own.max[a];
    if (meets)
      found.push_back(t);
  }
  return found;
}

Box3 wider(const Box3& box, double by) {
  const Vec3 all{by, by, by};
  return {box.min - all, box.max + all};
}

/// Of walls: in a surface inside another one its own; else those of the elements that their first
/// corners follow, but where most of what the curve encloses is of one, all of it is.
void give_materials(model::Model& model, const SkinCut& cut) {
  constexpr double most = 0.8; // of the area
  model::Skin& skin = model.skin;
  std::map<std::uint32_t, std::map<std::int32_t, double>> areas; // by region
  for (std::size_t t = 0; t < skin.triangles.size(); ++t) {
    if (cut.triangle[t] != SkinCut::none)
      continue;
    const auto& [a, b, c] = skin.triangles[t];
    const std::int32_t material = model.tetrahedron_material[skin.tetrahedron[a]];
    skin.material[t] = material;
    areas[cut.region[t]][material] +=
        norm(cross(skin.points[b] - skin.points[a], skin.points[c] - skin.points[a]));
  }
  for (std::size_t t = 0; t < skin.triangles.size(); ++t) {
    if (cut.triangle[t] != SkinCut::none)
      continue;
    if (const std::int32_t own = cut.material[cut.region[t]]; own >= 0) {
      skin.material[t] = own;
      continue;
    }
    double sum = 0;
    for (const auto& [material, area] : areas[cut.region[t]])
      sum += area;
    for (const auto& [material, area] : areas[cut.region[t]])
      if (area > most * sum)
        skin.material[t] = material;
  }
}

} // namespace

std::vector<std::int8_t> sides_of_elements(const model::Model& model,
                                           std::span<const incision::WallTriangle> wall,
                                           double reach, int steps) {
  std::vector<std::int8_t> side(model.tetrahedra.size());
  if (wall.empty())
    return side;
  Box3 box;
  std::vector<std::uint8_t> seen(side.size()); // 1 above, 2 below
  std::vector<std::uint32_t> work;
  for (const incision::WallTriangle& w : wall)
    for (std::size_t s = 0; s < 2; ++s) {
      for (const std::uint32_t corner : w.corners[s])
        box.add(model.nodes[corner].position);
      std::uint8_t& here = seen[w.tetrahedron[s]];
      if (here == 0)
        work.push_back(w.tetrahedron[s]);
      here = static_cast<std::uint8_t>(here | (s == 0 ? 1 : 2));
    }
  const std::vector<std::uint32_t> near = elements_in(model, wider(box, reach));
  std::vector<std::pair<std::array<std::uint32_t, 3>, std::uint32_t>> faces;
  for (const std::uint32_t t : near)
    for (std::uint32_t k = 0; k < 4; ++k) {
      Triangle face = tetrahedra::corners_of_face(model.tetrahedra[t], k);
      std::ranges::sort(face);
      faces.emplace_back(face, t);
    }
  std::ranges::sort(faces);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> beside;
  for (std::size_t n = 1; n < faces.size(); ++n)
    if (faces[n].first == faces[n - 1].first) {
      beside.emplace_back(faces[n].second, faces[n - 1].second);
      beside.emplace_back(faces[n - 1].second, faces[n].second);
    }
  std::ranges::sort(beside);
  for (int step = 0; step < steps; ++step) {
    std::vector<std::pair<std::uint32_t, std::uint8_t>> next;
    for (const std::uint32_t t : work)
      for (auto at = std::ranges::lower_bound(beside, std::pair(t, 0U));
           at != beside.end() && at->first == t; ++at)
        if (seen[at->second] == 0)
          next.emplace_back(at->second, seen[t]);
    work.clear();
    for (const auto& [t, sides] : next) {
      if (seen[t] == 0)
        work.push_back(t);
      seen[t] = static_cast<std::uint8_t>(seen[t] | sides);
    }
  }
  for (std::size_t t = 0; t < side.size(); ++t)
    side[t] = static_cast<std::int8_t>(seen[t] == 1 ? 1 : seen[t] == 2 ? -1 : 0);
  return side;
}

SkinSheet sheet_beside(const model::Model& model, std::span<const incision::WallTriangle> wall,
                       const SkinSheet& sheet) {
  SkinSheet beside;
  std::vector<bool> of_wall(model.nodes.size());
  for (const incision::WallTriangle& w : wall)
    for (const Triangle& corners : w.corners)
      for (const std::uint32_t corner : corners)
        of_wall[corner] = true;
  std::vector<std::uint32_t> every(model.tetrahedra.size());
  std::iota(every.begin(), every.end(), 0U);
  const embedding::elements::ElementBoxes boxes(model, every);
  beside.surface.points = sheet.surface.points;
  for (const Triangle& t : sheet.surface.triangles) {
    Vec3 middle;
    for (const std::uint32_t corner : t)
      middle += sheet.surface.points[corner] / 3;
    const auto found = boxes.nearest(middle, [](std::uint32_t) { return true; });
    const Tetrahedron& element = model.tetrahedra[found.first];
    if (std::ranges::count_if(element, [&](std::uint32_t n) { return of_wall[n]; }) > 1)
      beside.surface.triangles.push_back(t);
  }
  return beside;
}

void bind_skin(model::Model& model, const SkinCut& cut, std::span<const std::int8_t> elements,
               std::span<const std::uint32_t> changed) {
  model::Skin& skin = model.skin;
  std::vector<std::uint32_t> points;
  Box3 box;
  double longest = 0;
  for (std::uint32_t p = 0; p < skin.points.size(); ++p) {
    const std::uint32_t t = skin.tetrahedron[p];
    if (!cut.fresh[p] && !std::ranges::binary_search(changed, t) && cut.side[p] * elements[t] >= 0)
      continue;
    points.push_back(p);
    box.add(skin.points[p]);
  }
  if (points.empty())
    return;
  for (std::size_t t = 0; t < elements.size(); ++t)
    if (elements[t] != 0)
      for (const auto& [a, b] : tetrahedra::tetrahedron_edges)
        longest = std::max(longest, norm(model.nodes[model.tetrahedra[t][b]].position -
                                         model.nodes[model.tetrahedra[t][a]].position));
  const std::vector<std::uint32_t> near = elements_in(model, wider(box, longest));
  std::optional<embedding::elements::ElementBoxes> boxes, all;
  if (!near.empty())
    boxes.emplace(model, near);
  for (const std::uint32_t p : points) {
    const auto may = [&](std::uint32_t t) { return cut.side[p] * elements[t] >= 0; };
    std::pair<std::uint32_t, double> found{0, HUGE_VAL};
    if (boxes)
      found = boxes->nearest(skin.points[p], may);
    if (!(found.second <= longest * longest)) {
      if (!all) {
        std::vector<std::uint32_t> every(model.tetrahedra.size());
        std::iota(every.begin(), every.end(), 0U);
        all.emplace(model, every);
      }
      found = all->nearest(skin.points[p], may);
    }
    skin.tetrahedron[p] = found.first;
  }
  give_materials(model, cut);
}

} // namespace gewebe::cutting
