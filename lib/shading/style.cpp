#include "shading/style.h"

#include "base/disjoint_sets.h"
#include "shading/angles.h"
#include "shading/tangents.h"

#include <algorithm>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <utility>

namespace gewebe::shading {

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

Surface creased(const Surface& surface, double degrees) {
  const TriangleMesh& mesh = surface.mesh;
  const std::vector<Vec3>& at = surface.rest.empty() ? mesh.points : surface.rest;
  std::vector<Vec3> normal;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vec3 n = cross(at[b] - at[a], at[c] - at[a]);
    const double length = norm(n);
    normal.push_back(length > 0 ? n / length : Vec3{});
  }
  struct Side {
    std::uint32_t low = 0, high = 0, corner = 0; // that the edge leaves
    auto operator<=>(const Side&) const = default;
  };
  std::vector<Side> sides;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
    for (std::uint32_t k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(mesh.triangles[t][k], mesh.triangles[t][(k + 1) % 3]);
      sides.push_back({low, high, 3 * t + k});
    }
  std::ranges::sort(sides);
  const double least = cos_sin(degrees)[0];
  const auto next = [](std::uint32_t corner) { return corner % 3 == 2 ? corner - 2 : corner + 1; };
  const auto point = [&](std::uint32_t corner) { return mesh.triangles[corner / 3][corner % 3]; };
  DisjointSets corners(3 * mesh.triangles.size());
  for (std::size_t n = 1; n < sides.size(); ++n) {
    const Side &a = sides[n - 1], &b = sides[n];
    if (a.low != b.low || a.high != b.high)
      continue;
    const Vec3 &one = normal[a.corner / 3], &other = normal[b.corner / 3];
    if (dot(one, other) < least && dot(one, one) > 0 && dot(other, other) > 0)
      continue;
    const bool along = point(a.corner) == point(b.corner);
    corners.join(a.corner, along ? b.corner : next(b.corner));
    corners.join(next(a.corner), along ? next(b.corner) : b.corner);
  }
  Surface out = surface;
  std::vector<bool> taken(mesh.points.size());
  std::vector<std::uint32_t> number(3 * mesh.triangles.size(), UINT32_MAX);
  for (std::uint32_t corner = 0; corner < number.size(); ++corner) {
    const std::uint32_t was = point(corner);
    std::uint32_t& is = number[corners.find(corner)];
    if (is == UINT32_MAX) {
      is = was;
      if (taken[was]) {
        is = static_cast<std::uint32_t>(out.mesh.points.size());
        out.mesh.points.push_back(mesh.points[was]);
        if (!surface.rest.empty())
          out.rest.push_back(surface.rest[was]);
        if (!mesh.normals.empty()) {
          out.mesh.normals.emplace_back();
          out.mesh.normals[was] = {};
        }
      }
      taken[was] = true;
    }
    out.mesh.triangles[corner / 3][corner % 3] = is;
  }
  return out;
}

namespace {

/// Takes the triangles of `front` that face away from the eye.
Surface taken_inside(Surface& front, const Vec3& eye) {
  Surface inside;
  inside.inside = true;
  TriangleMesh& mesh = front.mesh;
  const std::vector<Vec3> normals = render_normals(mesh);
  mesh.normals.clear();
  for (const Vec3& n : normals) {
    mesh.normals.push_back(
        {static_cast<float>(n.x), static_cast<float>(n.y), static_cast<float>(n.z)});
    inside.mesh.normals.push_back(
        {static_cast<float>(-n.x), static_cast<float>(-n.y), static_cast<float>(-n.z)});
  }
  std::size_t kept = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto [a, b, c] = mesh.triangles[t];
    const Vec3& p = mesh.points[a];
    if (dot(cross(mesh.points[b] - p, mesh.points[c] - p), eye - p) < 0) {
      inside.mesh.triangles.push_back({a, c, b});
      continue;
    }
    mesh.triangles[kept] = mesh.triangles[t];
    if (!mesh.texcoords.empty())
      mesh.texcoords[kept] = mesh.texcoords[t];
    if (!mesh.part.empty())
      mesh.part[kept] = mesh.part[t];
    if (!mesh.material.empty())
      mesh.material[kept] = mesh.material[t];
    ++kept;
  }
  const auto shorten = [kept](auto& values) { values.resize(std::min(values.size(), kept)); };
  shorten(mesh.triangles);
  shorten(mesh.texcoords);
  shorten(mesh.part);
  shorten(mesh.material);
  inside.mesh.points = mesh.points;
  inside.rest = front.rest;
  return inside;
}

} // namespace

std::vector<Surface> two_sided(std::vector<Surface> surfaces, const Vec3& eye) {
  std::vector<Surface> insides;
  for (Surface& surface : surfaces) {
    if (surface.instrument)
      continue;
    Surface inside = taken_inside(surface, eye);
    if (!inside.mesh.triangles.empty())
      insides.push_back(std::move(inside));
  }
  std::ranges::move(insides, std::back_inserter(surfaces));
  return surfaces;
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

} // namespace gewebe::shading
