#include "statics/second_stage.h"

#include <algorithm>
#include <map>
#include <tuple>
#include <utility>

namespace gewebe::statics {

bool same_but_stiffness(const model::Model& first, const model::Model& second) {
  return std::equal(first.nodes.begin(), first.nodes.end(), second.nodes.begin(),
                    second.nodes.end(),
                    [](const model::Node& a, const model::Node& b) {
                      return a.position == b.position && a.fixed == b.fixed;
                    }) &&
         std::equal(first.springs.begin(), first.springs.end(), second.springs.begin(),
                    second.springs.end(),
                    [](const model::Spring& a, const model::Spring& b) {
                      return a.i == b.i && a.j == b.j && a.kind == b.kind;
                    }) &&
         first.triangles == second.triangles && first.tetrahedra == second.tetrahedra &&
         first.middles == second.middles &&
         first.tetrahedron_material == second.tetrahedron_material;
}

model::Model cut_second_stage(const model::Model& cut, std::span<const std::uint32_t> origin,
                              const model::Model& first, const model::Model& second) {
  const auto key = [](const model::Spring& s, std::uint32_t i, std::uint32_t j) {
    return std::tuple(std::min(i, j), std::max(i, j), s.kind);
  };
  std::map<std::tuple<std::uint32_t, std::uint32_t, model::SpringKind>, std::pair<double, double>>
      sums;
  for (std::size_t k = 0; k < first.springs.size(); ++k) {
    const model::Spring& s = first.springs[k];
    auto& [one, two] = sums[key(s, s.i, s.j)];
    one += s.stiffness;
    two += second.springs[k].stiffness;
  }
  model::Model stiff = cut;
  if (!cut.tetrahedra.empty())
    stiff.materials = second.materials;
  for (model::Spring& s : stiff.springs) {
    const auto& [one, two] = sums.at(key(s, origin[s.i], origin[s.j]));
    s.stiffness *= two / one;
  }
  return stiff;
}

} // namespace gewebe::statics
