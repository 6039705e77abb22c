#include "shading/tissue_color.h"

#include <array>
#include <utility>

namespace gewebe {
namespace {

constexpr std::array<std::pair<std::string_view, Vec3>, 4> named{{
    {"generic", {0.86, 0.66, 0.58}},
    {"liver", {0.66, 0.31, 0.25}},
    {"gallbladder", {0.58, 0.66, 0.36}},
    {"uterus", {0.86, 0.54, 0.52}},
}};

/// Neighbours differ in hue and in brightness.
constexpr std::array<Vec3, 8> in_turn{{{0.86, 0.66, 0.58},
                                       {0.70, 0.28, 0.26},
                                       {0.93, 0.83, 0.56},
                                       {0.42, 0.52, 0.74},
                                       {0.60, 0.72, 0.46},
                                       {0.66, 0.50, 0.70},
                                       {0.90, 0.88, 0.82},
                                       {0.52, 0.38, 0.30}}};

} // namespace

Vec3 tissue_color(std::string_view name, std::size_t number) {
  for (const auto& [known, color] : named)
    if (name == known)
      return color;
  return in_turn[number % in_turn.size()];
}

} // namespace gewebe
