#pragma once
// Cuts at random places: springs around a node, or the surface opened by a small blade.

#include "cutting/cut.h"
#include "cutting/cut_select.h"
#include "model/model.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <random>
#include <span>
#include <utility>
#include <vector>

namespace gewebe::test {

/// Edge and bending springs around a node, every fourth of the nearest, so that nothing hangs
/// loose.
inline cutting::Cut springs_around(const model::Model& model, std::uint32_t node,
                                   std::size_t count) {
  std::vector<std::pair<double, std::size_t>> order;
  const Vec3 here = model.nodes[node].position;
  for (std::size_t e = 0; e < model.springs.size(); ++e) {
    const model::Spring& s = model.springs[e];
    if (s.kind == model::SpringKind::central)
      continue;
    const Vec3 d = 0.5 * (model.nodes[s.i].position + model.nodes[s.j].position) - here;
    order.emplace_back(dot(d, d), e);
  }
  const std::size_t near = std::min(4 * count, order.size());
  std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(near), order.end());
  cutting::Cut cut;
  for (std::size_t k = 0; k < near; k += 4)
    cut.springs.push_back(order[k].second);
  std::sort(cut.springs.begin(), cut.springs.end());
  return cut;
}

/// A rectangle across the surface at a triangle, `length` long and `depth` deep to both sides.
inline cutting::SweptQuad blade_at(const model::Model& model, std::size_t triangle, double angle,
                                   double length, double depth) {
  const Triangle& t = model.triangles[triangle];
  const Vec3 a = model.nodes[t[0]].position, b = model.nodes[t[1]].position,
             c = model.nodes[t[2]].position;
  const Vec3 n = cross(b - a, c - a) / std::max(norm(cross(b - a, c - a)), 1e-300);
  const Vec3 u = (b - a) / norm(b - a), v = cross(n, u);
  const Vec3 way = 0.5 * length * (std::cos(angle) * u + std::sin(angle) * v), down = depth * n;
  const Vec3 middle = (a + b + c) / 3;
  return {middle - way + down, middle + way + down, middle + way - down, middle - way - down};
}

/// Mean length of the edges.
inline double mean_edge(const model::Model& model) {
  double sum = 0;
  std::size_t count = 0;
  for (const model::Spring& s : model.springs)
    if (s.kind == model::SpringKind::edge) {
      sum += norm(model.nodes[s.j].position - model.nodes[s.i].position);
      ++count;
    }
  return sum / static_cast<double>(std::max<std::size_t>(count, 1));
}

/// The next one, without what comes off; nothing where nothing comes apart or a fixed node would be
/// left alone. \param most springs, or edges that a blade crosses
inline std::optional<cutting::CutModel> random_cut(const model::Model& model, std::mt19937& random,
                                                   std::size_t max) {
  const std::size_t size = 1 + random() % max;
  cutting::Cut cut;
  if (random() % 2 == 0) {
    cut = springs_around(model, static_cast<std::uint32_t>(random() % model::surface_count(model)),
                         size);
  } else {
    const double edge = mean_edge(model);
    const cutting::SweptQuad area = blade_at(
        model, random() % model.triangles.size(), static_cast<double>(random() % 628) / 100,
        edge * (1 + static_cast<double>(size) / 3), 1.5 * edge);
    cut = cutting::swept_cut(model, {}, std::span(&area, 1));
  }
  if (cut.empty())
    return std::nullopt;
  cutting::CutModel next = cutting::cut_model(model, cut);
  if (!next.changed())
    return std::nullopt;
  cutting::FreeParts free = cutting::free_parts(model, next);
  return cutting::without_parts(std::move(next), std::move(free.rest));
}

} // namespace gewebe::test
