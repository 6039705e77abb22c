#include "tools/cli/filling_rule.h"

namespace gewebe::cli {

voxelization::VoxelRule voxel_rule_from_text(const std::string& text) {
  return text == "winding"   ? voxelization::VoxelRule::winding
         : text == "zbuffer" ? voxelization::VoxelRule::zbuffer
                             : voxelization::VoxelRule::parity;
}

voxelization::OpenMesh open_mesh_from_text(const std::string& text) {
  return text == "error"  ? voxelization::OpenMesh::refuse
         : text == "warn" ? voxelization::OpenMesh::skip
                          : voxelization::OpenMesh::fill;
}

std::string mesh_defects(const voxelization::VoxelizeReport& mesh,
                         const voxelization::VoxelizeOptions& options) {
  std::string text;
  const auto add = [&](std::uint64_t count, const char* one, const char* many) {
    if (count > 0)
      text += (text.empty() ? "" : ", ") + std::to_string(count) + " " + (count == 1 ? one : many);
  };
  const bool open = mesh.boundary_edges > 0;
  add(mesh.boundary_edges, "boundary edge", "boundary edges");
  if (open && options.on_open == voxelization::OpenMesh::fill)
    add(mesh.holes, "hole closed", "holes closed");
  else if (open && options.rule == voxelization::VoxelRule::parity)
    text += ", " + std::to_string(mesh.odd_rays) + " odd rays left empty";
  else
    add(mesh.holes, "hole", "holes");
  add(mesh.parts_turned, "part turned outward", "parts turned outward");
  add(mesh.triangles_turned, "triangle turned", "triangles turned");
  add(mesh.triangles_duplicate, "duplicate triangle left out", "duplicate triangles left out");
  return text.empty() ? text : (open ? "the mesh is open: " : "the mesh had ") + text;
}

} // namespace gewebe::cli
