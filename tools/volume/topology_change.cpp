#include "tools/volume/topology_change.h"

#include "base/disjoint_sets.h"
#include "mesh/check.h"
#include "mesh/self_intersections.h"
#include "repair/weld.h"
#include "tools/cli/distrust.h"

#include <algorithm>
#include <cstdint>
#include <vector>

namespace gewebe::cli {
namespace {

/// The boxes of the components, the empty ones of other points left out.
std::vector<Box3> component_boxes(const TriangleMesh& mesh) {
  DisjointSets sets(mesh.points.size());
  for (const Triangle& t : mesh.triangles) {
    sets.join(t[0], t[1]);
    sets.join(t[0], t[2]);
  }
  std::vector<Box3> boxes(mesh.points.size());
  for (std::uint32_t p = 0; p < boxes.size(); ++p)
    boxes[sets.find(p)].add(mesh.points[p]);
  std::erase_if(boxes, [](const Box3& box) { return box.empty(); });
  return boxes;
}

bool lies_within(const Box3& inner, const Box3& outer) {
  for (int axis = 0; axis < 3; ++axis)
    if (inner.min[axis] < outer.min[axis] || inner.max[axis] > outer.max[axis])
      return false;
  return true;
}

/// Whether a component may lie within another: by their boxes, of very many always.
bool may_be_nested(const TriangleMesh& mesh) {
  const std::vector<Box3> boxes = component_boxes(mesh);
  if (boxes.size() > 10000)
    return true;
  for (const Box3& inner : boxes)
    for (const Box3& outer : boxes)
      if (&inner != &outer && lies_within(inner, outer))
        return true;
  return false;
}

std::string topology_text(const mesh::Topology& topology) {
  return std::to_string(topology.components) +
         (topology.components == 1 ? " component" : " components") + " and Euler number " +
         std::to_string(topology.euler);
}

} // namespace

void compare_topology(Run& run, const std::string& tool, const std::string& place,
                      const std::string& option, const mesh::Topology& before,
                      const mesh::Topology& after, const std::string& unit) {
  run.stats().set("components_before", before.components);
  run.stats().set("euler_before", before.euler);
  if (before == after)
    return;
  distrust(run, tool,
           (place.empty() ? "" : place + ": ") + option + " changes the surface from " +
               topology_text(before) + " to " + std::to_string(after.components) + " and " +
               std::to_string(after.euler) + ", expected the same of finer " + unit);
}

FilledTopology filled_topology(const TriangleMesh& mesh) {
  FilledTopology result;
  result.welded.points = mesh.points;
  result.welded.triangles = mesh.triangles;
  repair::weld(result.welded,
               {.mode = repair::Weld::all, .drop_degenerate = true, .drop_unused = true});
  result.topology = mesh::topology(result.welded);
  return result;
}

bool is_surface_of_volume(const Context& context, const FilledTopology& filled,
                          voxelization::VoxelRule rule) {
  const TriangleMesh& mesh = filled.welded;
  if (rule == voxelization::VoxelRule::zbuffer ||
      (rule == voxelization::VoxelRule::winding && may_be_nested(mesh)))
    return false;
  const mesh::MeshReport report = mesh::examine_mesh(mesh, context);
  return report.closed() && report.manifold() && mesh::self_intersections(context, mesh).pairs == 0;
}

} // namespace gewebe::cli
