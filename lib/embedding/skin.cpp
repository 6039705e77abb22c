#include "embedding/skin.h"

#include "base/error.h"
#include "base/parallel.h"
#include "embedding/element_boxes.h"
#include "text/number_text.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

namespace gewebe::embedding {
namespace {

using namespace elements;

} // namespace

SkinWeights skin_weights(const model::Model& model) {
  SkinWeights all;
  all.nodes = model.middles.empty() ? 4 : 10;
  const model::Skin& skin = model.skin;
  all.node.reserve(all.nodes * skin.points.size());
  all.weight.reserve(all.nodes * skin.points.size());
  for (std::size_t p = 0; p < skin.points.size(); ++p) {
    const std::uint32_t t = skin.tetrahedron[p];
    const Corners corners = corners_of(model, t);
    const Barycentric there = barycentric(corners, skin.points[p]);
    const Barycentric l = barycentric(corners, nearest_in(corners, skin.points[p]));
    Barycentric d{}; // from the nearest point on
    for (std::size_t a = 0; a < 4; ++a)
      d[a] = there[a] - l[a];
    const auto& nodes = model.tetrahedra[t];
    all.node.insert(all.node.end(), nodes.begin(), nodes.end());
    if (model.middles.empty()) {
      all.weight.insert(all.weight.end(), there.begin(), there.end());
      continue;
    }
    all.node.insert(all.node.end(), model.middles[t].begin(), model.middles[t].end());
    for (std::size_t a = 0; a < 4; ++a)
      all.weight.push_back(l[a] * (2 * l[a] - 1) + (4 * l[a] - 1) * d[a]);
    for (const auto& [a, b] : tetrahedra::tetrahedron_edges)
      all.weight.push_back(4 * l[a] * l[b] + 4 * (l[a] * d[b] + l[b] * d[a]));
  }
  return all;
}

std::vector<Vec3> displaced_skin(const SkinWeights& weights, std::span<const Vec3> rest,
                                 std::span<const double> displacement) {
  std::vector<Vec3> points(rest.begin(), rest.end());
  for (std::size_t p = 0; p < points.size(); ++p)
    for (std::size_t k = weights.nodes * p; k < weights.nodes * (p + 1); ++k) {
      const double* const u = &displacement[3 * std::size_t{weights.node[k]}];
      points[p] += Vec3{u[0], u[1], u[2]} * weights.weight[k];
    }
  return points;
}

SkinReport add_skin(model::Model& model, const TriangleMesh& surface,
                    std::span<const std::int32_t> material, const Context& context) {
  SkinReport report;
  model::Skin skin;
  std::vector<std::uint32_t> number(surface.points.size(), UINT32_MAX);
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const auto& [a, b, c] = surface.triangles[t];
    if (a == b || b == c || c == a) {
      ++report.dropped_triangles;
      continue;
    }
    for (const std::uint32_t corner : {a, b, c})
      number[corner] = 0;
    skin.triangles.push_back(surface.triangles[t]);
    skin.material.push_back(material.empty() ? 0 : material[t]);
    if (!surface.texcoords.empty())
      std::ranges::transform(surface.texcoords[t], skin.texcoords.emplace_back().begin(),
                             [](float value) { return text::decimal_of(value); });
  }
  if (skin.triangles.empty())
    throw Error("the surface has no triangle of three different points, expected some");
  for (std::size_t p = 0; p < number.size(); ++p)
    if (number[p] == 0) {
      number[p] = static_cast<std::uint32_t>(skin.points.size());
      skin.points.push_back(surface.points[p]);
    }
  for (Triangle& triangle : skin.triangles)
    for (std::uint32_t& corner : triangle)
      corner = number[corner];

  Context quiet = context;
  quiet.progress = nullptr;
  std::vector<std::uint32_t> all(model.tetrahedra.size());
  std::iota(all.begin(), all.end(), 0U);
  const ElementBoxes boxes(model, all);
  skin.tetrahedron.resize(skin.points.size());
  std::vector<double> squared(skin.points.size());
  parallel_blocks(quiet, skin.points.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p)
      std::tie(skin.tetrahedron[p], squared[p]) =
          boxes.nearest(skin.points[p], [](std::uint32_t) { return true; });
  });
  for (const double one : squared)
    if (one > 0) {
      ++report.points_outside;
      report.farthest = std::max(report.farthest, std::sqrt(one));
    }
  model.skin = std::move(skin);
  return report;
}

} // namespace gewebe::embedding
