#include "shading/tangents.h"

#include "base/error.h"
#include "base/parallel.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

// Based on: Lengyel, Mathematics for 3D Game Programming and Computer Graphics, 2nd edition, 2003
// (tangent vectors from texture coordinates).

namespace gewebe::shading {
namespace {

constexpr std::size_t grain = 4096;

Vec3 unit_or_zero(const Vec3& v) {
  const double length = norm(v);
  return length > 0 && std::isfinite(length) ? v / length : Vec3{};
}

/// Twice the signed area of a triangle in its texture, 0 where it is lost in rounding: negative
/// where s, t and the normal are left-handed.
double texture_turn(const std::array<float, 6>& st) {
  const double s1 = double{st[2]} - st[0], t1 = double{st[3]} - st[1];
  const double s2 = double{st[4]} - st[0], t2 = double{st[5]} - st[1];
  const double det = s1 * t2 - s2 * t1;
  return std::fabs(det) > 1e-12 * (std::fabs(s1 * t2) + std::fabs(s2 * t1)) ? det : 0;
}

/// Unit vector of growing s on a triangle, times its area; 0 where the texture gives none.
Vec3 face_tangent(const TriangleMesh& mesh, std::size_t t, const std::array<float, 6>& st) {
  const double turn = texture_turn(st);
  if (turn == 0)
    return {};
  const Triangle& corner = mesh.triangles[t];
  const Vec3 e1 = mesh.points[corner[1]] - mesh.points[corner[0]];
  const Vec3 e2 = mesh.points[corner[2]] - mesh.points[corner[0]];
  const double t1 = double{st[3]} - st[1], t2 = double{st[5]} - st[1];
  const Vec3 direction = (e1 * t2 - e2 * t1) * (turn < 0 ? -1.0 : 1.0);
  return unit_or_zero(direction) * (norm(cross(e1, e2)) / 2);
}

/// The corners (3 t + c) of each point, ascending: corners[start[p]] … corners[start[p + 1] - 1].
struct Corners {
  std::vector<std::size_t> start;
  std::vector<std::size_t> corner;
};

Corners corners_by_point(const TriangleMesh& mesh) {
  Corners lists;
  lists.start.resize(mesh.points.size() + 1);
  for (const Triangle& t : mesh.triangles)
    for (const std::uint32_t p : t)
      ++lists.start[p + 1];
  for (std::size_t p = 0; p < mesh.points.size(); ++p)
    lists.start[p + 1] += lists.start[p];
  lists.corner.resize(3 * mesh.triangles.size());
  std::vector<std::size_t> next(lists.start.begin(), lists.start.end() - 1);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (std::size_t c = 0; c < 3; ++c)
      lists.corner[next[mesh.triangles[t][c]]++] = 3 * t + c;
  return lists;
}

} // namespace

std::vector<Vec3> area_normals(std::span<const Vec3> points, std::span<const Triangle> triangles) {
  std::vector<Vec3> normals(points.size());
  for (const Triangle& t : triangles) {
    const Vec3 n = cross(points[t[1]] - points[t[0]], points[t[2]] - points[t[0]]);
    for (const std::uint32_t corner : t)
      normals[corner] += n;
  }
  for (Vec3& n : normals)
    n = unit_or_zero(n);
  return normals;
}

std::vector<Vec3> render_normals(const TriangleMesh& mesh) {
  std::vector<Vec3> normals = area_normals(mesh.points, mesh.triangles);
  for (std::size_t p = 0; p < mesh.normals.size(); ++p)
    if (const Vec3 own{mesh.normals[p][0], mesh.normals[p][1], mesh.normals[p][2]}; norm(own) > 0)
      normals[p] = unit_or_zero(own);
  return normals;
}

TexturedVertices split_vertices(const TriangleMesh& mesh,
                                std::span<const std::array<float, 6>> texcoords,
                                const std::vector<Vec3>* normals, const Context& context) {
  std::vector<std::uint8_t> mirrored(mesh.triangles.size());
  if (normals != nullptr)
    parallel_blocks(context, mirrored.size(), grain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t t = begin; t < end; ++t)
        mirrored[t] = texture_turn(texcoords[t]) < 0 ? 1 : 0;
    });

  const auto key = [&](std::size_t corner) {
    const std::array<float, 6>& st = texcoords[corner / 3];
    const std::size_t c = corner % 3;
    return std::tuple(st[2 * c], st[2 * c + 1], mirrored[corner / 3]);
  };
  // Each point's corners in order of their keys; equal ones share a vertex.
  Corners lists = corners_by_point(mesh);
  const std::size_t points = mesh.points.size();
  std::vector<std::size_t> first(points + 1);
  parallel_blocks(context, points, grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) {
      const auto from = lists.corner.begin() + static_cast<std::ptrdiff_t>(lists.start[p]);
      const auto to = lists.corner.begin() + static_cast<std::ptrdiff_t>(lists.start[p + 1]);
      std::sort(from, to, [&](std::size_t a, std::size_t b) {
        return std::tuple_cat(key(a), std::tuple(a)) < std::tuple_cat(key(b), std::tuple(b));
      });
      for (auto at = from; at != to; ++at)
        first[p + 1] += at == from || key(*at) != key(*(at - 1)) ? 1U : 0U;
    }
  });
  for (std::size_t p = 0; p < points; ++p)
    first[p + 1] += first[p];
  const std::size_t count = first[points];
  if (count > UINT32_MAX)
    throw Error(std::to_string(count) + " vertices, expected at most " +
                std::to_string(UINT32_MAX));

  TexturedVertices out;
  out.point.resize(count);
  out.st.resize(count);
  out.triangles.resize(mesh.triangles.size());
  if (normals != nullptr)
    out.first_corner.resize(count + 1, lists.corner.size());
  parallel_blocks(context, points, grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) {
      std::size_t vertex = first[p];
      for (std::size_t at = lists.start[p]; at < lists.start[p + 1];) {
        const auto shared = key(lists.corner[at]);
        out.point[vertex] = static_cast<std::uint32_t>(p);
        out.st[vertex] = {std::get<0>(shared), std::get<1>(shared)};
        if (normals != nullptr)
          out.first_corner[vertex] = at;
        for (; at < lists.start[p + 1] && key(lists.corner[at]) == shared; ++at)
          out.triangles[lists.corner[at] / 3][lists.corner[at] % 3] =
              static_cast<std::uint32_t>(vertex);
        ++vertex;
      }
    }
  });
  if (normals != nullptr) {
    out.mirrored.resize(count);
    for (std::size_t v = 0; v < count; ++v)
      out.mirrored[v] = mirrored[lists.corner[out.first_corner[v]] / 3] != 0;
    out.corner = std::move(lists.corner);
    renew_frames(out, mesh, texcoords, *normals, context);
  }
  return out;
}

void renew_frames(TexturedVertices& vertices, const TriangleMesh& mesh,
                  std::span<const std::array<float, 6>> texcoords, const std::vector<Vec3>& normals,
                  const Context& context) {
  std::vector<Vec3> faces(mesh.triangles.size());
  parallel_blocks(context, faces.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t)
      faces[t] = face_tangent(mesh, t, texcoords[t]);
  });
  const std::size_t count = vertices.point.size();
  vertices.tangent.assign(count, {});
  vertices.bitangent.assign(count, {});
  parallel_blocks(context, count, grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) {
      Vec3 sum;
      for (std::size_t at = vertices.first_corner[v]; at < vertices.first_corner[v + 1]; ++at)
        sum += faces[vertices.corner[at] / 3];
      const Vec3& n = normals[vertices.point[v]];
      const Vec3 flat = sum - n * dot(n, sum);
      if (norm(n) > 0 && norm(flat) > 1e-9 * norm(sum)) {
        vertices.tangent[v] = unit_or_zero(flat);
        vertices.bitangent[v] = cross(n, vertices.tangent[v]) * (vertices.mirrored[v] ? -1.0 : 1.0);
      }
    }
  });
}

} // namespace gewebe::shading
