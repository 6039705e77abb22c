#include "cutting/skin_sheet.h"

#include "geometry/perpendicular.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

namespace gewebe::cutting {

SkinSheet plane_sheet(const model::Skin& skin, const CutPlane& plane, double cell, double shift) {
  constexpr double most = 1000;  // cells along a side
  constexpr double there = 1e-6; // of a cell: on the plane
  constexpr double beside = 1e-6;
  const Vec3 normal = plane.normal / norm(plane.normal);
  Vec3 u = some_perpendicular(normal);
  u = u / norm(u);
  const Vec3 v = cross(normal, u);
  // Where triangles pass it.
  std::array<double, 2> low{HUGE_VAL, HUGE_VAL}, high{-HUGE_VAL, -HUGE_VAL};
  for (const Triangle& t : skin.triangles) {
    double lowest = HUGE_VAL, highest = -HUGE_VAL;
    for (const std::uint32_t corner : t) {
      const double d = dot(normal, skin.points[corner] - plane.point);
      lowest = std::min(lowest, d);
      highest = std::max(highest, d);
    }
    if (lowest > cell * there || highest < -cell * there)
      continue;
    for (const std::uint32_t corner : t) {
      const Vec3 at = skin.points[corner] - plane.point;
      const std::array<double, 2> here{dot(u, at), dot(v, at)};
      for (std::size_t a = 0; a < 2; ++a) {
        low[a] = std::min(low[a], here[a]);
        high[a] = std::max(high[a], here[a]);
      }
    }
  }
  SkinSheet sheet;
  if (!(low[0] <= high[0]))
    return sheet;
  std::array<std::uint32_t, 2> count{};
  for (std::size_t a = 0; a < 2; ++a) {
    // So that neither lines nor diagonals are mirror images of each other.
    const double by = a == 0 ? shift : 0.73 * shift;
    low[a] -= (0.5 + by) * cell;
    high[a] += (0.5 + 0.61 * by) * cell;
    count[a] =
        static_cast<std::uint32_t>(std::clamp(std::ceil((high[a] - low[a]) / cell), 1.0, most));
  }
  for (std::uint32_t j = 0; j <= count[1]; ++j)
    for (std::uint32_t i = 0; i <= count[0]; ++i)
      sheet.surface.points.push_back(plane.point + shift * beside * cell * normal +
                                     (low[0] + (high[0] - low[0]) * i / count[0]) * u +
                                     (low[1] + (high[1] - low[1]) * j / count[1]) * v);
  const std::uint32_t row = count[0] + 1;
  for (std::uint32_t j = 0; j < count[1]; ++j)
    for (std::uint32_t i = 0; i < count[0]; ++i) {
      const std::uint32_t p = row * j + i;
      sheet.surface.triangles.push_back({p, p + 1, p + row + 1});
      sheet.surface.triangles.push_back({p, p + row + 1, p + row});
    }
  return sheet;
}

SkinSheet strip_sheet(std::span<const std::vector<Vec3>> rows) {
  SkinSheet sheet;
  std::vector<Vec3>& points = sheet.surface.points;
  std::vector<std::vector<std::uint32_t>> number(rows.size());
  std::vector<std::vector<double>> share(rows.size());
  for (std::size_t n = 0; n < rows.size(); ++n) {
    for (const Vec3& p : rows[n]) { // a blade that turns about a point passes that again
      const auto same = n == 0
                            ? std::vector<std::uint32_t>::const_iterator{}
                            : std::ranges::find_if(std::as_const(number[n - 1]),
                                                   [&](std::uint32_t k) { return points[k] == p; });
      if (n > 0 && same != number[n - 1].end()) {
        number[n].push_back(*same);
        continue;
      }
      number[n].push_back(static_cast<std::uint32_t>(points.size()));
      points.push_back(p);
    }
    double length = 0;
    for (std::size_t k = 0; k < rows[n].size(); ++k) {
      length += k > 0 ? norm(rows[n][k] - rows[n][k - 1]) : 0;
      share[n].push_back(length);
    }
    for (double& s : share[n])
      s /= length > 0 ? length : 1;
  }
  for (std::size_t n = 1; n < rows.size(); ++n) {
    std::size_t i = 0, j = 0;
    const std::size_t a = rows[n - 1].size(), b = rows[n].size();
    while (i + 1 < a || j + 1 < b) {
      const std::uint32_t p = number[n - 1][i], q = number[n][j];
      const bool first = j + 1 == b || (i + 1 < a && share[n - 1][i + 1] <= share[n][j + 1]);
      const std::uint32_t r = first ? number[n - 1][++i] : number[n][++j];
      if (p != q && q != r && r != p)
        sheet.surface.triangles.push_back({p, q, r});
    }
  }
  if (!rows.empty())
    sheet.end = number.back();
  return sheet;
}

} // namespace gewebe::cutting
