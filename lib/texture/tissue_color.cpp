#include "texture/tissue_color.h"

#include <algorithm>
#include <array>
#include <set>
#include <utility>
#include <vector>

namespace gewebe::texture {
namespace {

constexpr std::array<std::pair<std::string_view, Vec3>, 4> named{{
    {"generic", {0.86, 0.66, 0.58}},
    {"liver", {0.66, 0.31, 0.25}},
    {"gallbladder", {0.58, 0.66, 0.36}},
    {"uterus", {0.86, 0.54, 0.52}},
}};

/// Neighbours differ in hue and in brightness.
constexpr std::size_t usual = 8; ///< the others are for neighbours alone
constexpr std::array<Vec3, 16> in_turn{{{0.86, 0.66, 0.58},
                                        {0.70, 0.28, 0.26},
                                        {0.93, 0.83, 0.56},
                                        {0.42, 0.52, 0.74},
                                        {0.60, 0.72, 0.46},
                                        {0.66, 0.50, 0.70},
                                        {0.90, 0.88, 0.82},
                                        {0.52, 0.38, 0.30},
                                        {0.36, 0.62, 0.62},
                                        {0.86, 0.46, 0.24},
                                        {0.30, 0.36, 0.52},
                                        {0.74, 0.80, 0.88},
                                        {0.84, 0.40, 0.56},
                                        {0.36, 0.46, 0.28},
                                        {0.80, 0.74, 0.28},
                                        {0.44, 0.26, 0.42}}};

bool is_named(std::string_view name) {
  return std::ranges::any_of(named, [&](const auto& known) { return known.first == name; });
}

} // namespace

Vec3 tissue_color(std::string_view name, std::size_t number) {
  for (const auto& [known, color] : named)
    if (name == known)
      return color;
  return in_turn[number % usual];
}

std::map<std::int32_t, Vec3> tissue_colors(const TriangleMesh& mesh,
                                           std::span<const std::string> names) {
  const auto name_of = [&](std::int32_t number) {
    return number >= 0 && static_cast<std::size_t>(number) < names.size()
               ? std::string_view(names[static_cast<std::size_t>(number)])
               : std::string_view();
  };
  std::vector<std::pair<std::uint32_t, std::int32_t>> at_points;
  std::map<std::int32_t, Vec3> colors;
  for (std::size_t t = 0; t < mesh.material.size(); ++t) {
    const std::int32_t number = mesh.material[t];
    colors.try_emplace(number, tissue_color(name_of(number), static_cast<std::size_t>(number)));
    for (const std::uint32_t corner : mesh.triangles[t])
      at_points.emplace_back(corner, number);
  }
  if (colors.size() < 2)
    return colors;
  std::ranges::sort(at_points);
  const auto [first, last] = std::ranges::unique(at_points);
  at_points.erase(first, last);
  std::map<std::int32_t, std::set<std::int32_t>> near;
  for (std::size_t n = 0; n < at_points.size(); ++n)
    for (std::size_t m = n + 1; m < at_points.size() && at_points[m].first == at_points[n].first;
         ++m) {
      near[at_points[n].second].insert(at_points[m].second);
      near[at_points[m].second].insert(at_points[n].second);
    }
  for (auto& [number, color] : colors) {
    if (is_named(name_of(number)))
      continue;
    const auto is_taken = [&, n = number](const Vec3& wanted) {
      return std::ranges::any_of(near[n], [&](std::int32_t other) {
        return (other < n || is_named(name_of(other))) && colors.at(other) == wanted;
      });
    };
    for (std::size_t k = 0; k < in_turn.size() && is_taken(color); ++k)
      color = in_turn[(static_cast<std::size_t>(number) % usual + k + 1) % in_turn.size()];
  }
  return colors;
}

} // namespace gewebe::texture
