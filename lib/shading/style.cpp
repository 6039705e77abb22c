#include "shading/style.h"

#include <algorithm>
#include <utility>

namespace gewebe {

Surface faceted(const Surface& surface) {
  Surface out;
  out.instrument = surface.instrument;
  out.mesh.texcoords = surface.mesh.texcoords;
  out.mesh.part = surface.mesh.part;
  out.mesh.material = surface.mesh.material;
  out.mesh.points.reserve(3 * surface.mesh.triangles.size());
  out.mesh.triangles.reserve(surface.mesh.triangles.size());
  for (const Triangle& t : surface.mesh.triangles) {
    const auto first = static_cast<std::uint32_t>(out.mesh.points.size());
    out.mesh.triangles.push_back({first, first + 1, first + 2});
    for (const std::uint32_t corner : t) {
      out.mesh.points.push_back(surface.mesh.points[corner]);
      if (!surface.rest.empty())
        out.rest.push_back(surface.rest[corner]);
    }
  }
  return out;
}

Surface wireframe(const Surface& surface, const Camera& camera, double pixels,
                  std::uint32_t height) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
  edges.reserve(3 * surface.mesh.triangles.size());
  for (const Triangle& t : surface.mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k)
      edges.emplace_back(std::minmax(t[k], t[(k + 1) % 3]));
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());

  Surface out;
  out.instrument = surface.instrument;
  const double half_pixel = camera.tan_y / height; // at distance 1
  const auto depth = [&](const Vec3& p) { return -dot(p - camera.eye, camera.back); };
  for (const auto& [a, b] : edges) {
    const Vec3 p = surface.mesh.points[a], q = surface.mesh.points[b];
    Vec3 across = cross(q - p, p - camera.eye);
    if (!(norm(across) > 0) || !(depth(p) > 0) || !(depth(q) > 0))
      continue;
    across = across / norm(across) * (half_pixel * pixels);
    const auto first = static_cast<std::uint32_t>(out.mesh.points.size());
    for (const Vec3& end : {p, q}) {
      out.mesh.points.push_back(end - across * depth(end));
      out.mesh.points.push_back(end + across * depth(end));
    }
    out.mesh.triangles.push_back({first, first + 2, first + 3});
    out.mesh.triangles.push_back({first, first + 3, first + 1});
  }
  return out;
}

} // namespace gewebe
