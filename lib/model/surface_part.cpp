#include "model/surface_part.h"

namespace gewebe::model {

namespace {

bool has_marked(const Triangle& t, std::span<const std::uint8_t> marked) {
  return (marked[t[0]] | marked[t[1]] | marked[t[2]]) != 0;
}

} // namespace

SurfacePart surface_part(const Model& model, std::span<const std::uint8_t> marked) {
  SurfacePart part;
  std::vector<Triangle> corners;
  for (std::uint32_t t = 0; t < model.triangles.size(); ++t)
    if (has_marked(model.triangles[t], marked)) {
      part.triangles.push_back(t);
      corners.push_back(model.triangles[t]);
    }
  part.edges = mesh::edge_table(corners, model.nodes.size());
  for (std::uint32_t& corner : part.edges.corners)
    corner = 3 * part.triangles[corner / 3] + corner % 3;
  return part;
}

void mark_neighbours(const Model& model, std::vector<std::uint8_t>& marked) {
  const std::vector<std::uint8_t> before = marked;
  for (const Triangle& t : model.triangles)
    if (has_marked(t, before))
      for (const std::uint32_t corner : t)
        marked[corner] = 1;
}

} // namespace gewebe::model
