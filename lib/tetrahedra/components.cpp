#include "tetrahedra/components.h"

#include "base/disjoint_sets.h"
#include "tetrahedra/check.h"

#include <algorithm>
#include <numeric>

namespace gewebe::tetrahedra {
namespace {

/// Of each tetrahedron the number of its component; components are numbered by their first point.
std::vector<std::uint32_t> components(const TetMesh& mesh, std::uint32_t& count) {
  DisjointSets sets(mesh.points.size());
  for (const Tetrahedron& t : mesh.tetrahedra)
    for (std::size_t k = 1; k < 4; ++k)
      sets.join(t[0], t[k]);
  std::vector<std::uint32_t> number(mesh.points.size(), UINT32_MAX);
  std::vector<bool> used(mesh.points.size());
  for (const Tetrahedron& t : mesh.tetrahedra)
    used[sets.find(t[0])] = true;
  count = 0;
  for (std::size_t p = 0; p < number.size(); ++p)
    if (used[p])
      number[p] = count++;
  std::vector<std::uint32_t> result(mesh.tetrahedra.size());
  for (std::size_t t = 0; t < result.size(); ++t)
    result[t] = number[sets.find(mesh.tetrahedra[t][0])];
  return result;
}

template <class Element>
void keep(std::vector<Element>& elements, const std::vector<std::uint32_t>& component,
          const std::vector<bool>& stays) {
  if (elements.empty())
    return;
  std::size_t next = 0;
  for (std::size_t t = 0; t < elements.size(); ++t)
    if (stays[component[t]])
      elements[next++] = elements[t];
  elements.resize(next);
}

} // namespace

std::uint64_t component_count(const TetMesh& mesh) {
  std::uint32_t count = 0;
  components(mesh, count);
  return count;
}

TetComponentReport keep_components(TetMesh& mesh, const mesh::ComponentChoice& choice) {
  std::uint32_t count = 0;
  const std::vector<std::uint32_t> component = components(mesh, count);
  std::vector<double> volumes(count);
  for (std::size_t t = 0; t < component.size(); ++t) {
    const Tetrahedron& at = mesh.tetrahedra[t];
    volumes[component[t]] += tetrahedron_volume(mesh.points[at[0]], mesh.points[at[1]],
                                                mesh.points[at[2]], mesh.points[at[3]]);
  }
  std::vector<std::uint32_t> order(count);
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return volumes[a] > volumes[b]; });
  TetComponentReport report;
  std::vector<bool> stays(count);
  for (const std::uint32_t n : order) {
    stays[n] = volumes[n] >= choice.min_volume && report.kept < choice.largest;
    if (stays[n]) {
      ++report.kept;
      continue;
    }
    ++report.dropped;
    report.dropped_volume += volumes[n];
    report.largest_dropped = std::max(report.largest_dropped, volumes[n]);
  }
  if (report.dropped == 0)
    return report;
  const std::size_t before = mesh.tetrahedra.size();
  keep(mesh.middles, component, stays);
  keep(mesh.material, component, stays);
  keep(mesh.tetrahedra, component, stays);
  report.dropped_tetrahedra = before - mesh.tetrahedra.size();
  report.dropped_points = drop_unused_points(mesh);
  return report;
}

} // namespace gewebe::tetrahedra
