#include "formats/mesh/obj_stl.h"

#include "base/error.h"
#include "formats/stream/pieces.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <string>
#include <unordered_map>
#include <vector>

namespace gewebe::formats {
namespace {

// Writes each distinct pair s t once, in order of first use; gives the number of each corner's,
// from 1.
std::vector<std::array<std::uint32_t, 3>> write_texcoords(const TriangleMesh& mesh, Pieces& out) {
  std::vector<std::array<std::uint32_t, 3>> numbers(mesh.texcoords.size());
  std::unordered_map<std::uint64_t, std::uint32_t> seen;
  for (std::size_t t = 0; t < mesh.texcoords.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      const float s_value = mesh.texcoords[t][2 * k];
      const float t_value = mesh.texcoords[t][2 * k + 1];
      const std::uint64_t key = std::uint64_t{std::bit_cast<std::uint32_t>(s_value)} << 32 |
                                std::bit_cast<std::uint32_t>(t_value);
      const auto [entry, fresh] =
          seen.try_emplace(key, static_cast<std::uint32_t>(seen.size() + 1));
      if (fresh)
        out << "vt " << s_value << " " << t_value << "\n";
      numbers[t][k] = entry->second;
    }
  return numbers;
}

float single(double value) {
  const float result = static_cast<float>(value);
  if (!std::isfinite(result))
    throw Error("a coordinate beyond single precision, expected one below 3e38");
  return result;
}

} // namespace

void write_obj(const TriangleMesh& mesh, const Sink& sink) {
  Pieces out(sink);
  out << "# gewebe_mesh, millimetres\n";
  for (const Vec3& p : mesh.points)
    out << "v " << p.x << " " << p.y << " " << p.z << "\n";
  for (const auto& n : mesh.normals)
    out << "vn " << n[0] << " " << n[1] << " " << n[2] << "\n";
  const std::vector<std::array<std::uint32_t, 3>> texcoords = write_texcoords(mesh, out);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (!mesh.part.empty() && (t == 0 || mesh.part[t] != mesh.part[t - 1]))
      out << "o part" << mesh.part[t] << "\n";
    if (!mesh.material.empty() && (t == 0 || mesh.material[t] != mesh.material[t - 1] ||
                                   (!mesh.part.empty() && mesh.part[t] != mesh.part[t - 1])))
      out << "usemtl material" << mesh.material[t] << "\n";
    out << "f";
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint64_t point = std::uint64_t{mesh.triangles[t][k]} + 1;
      out << " " << point;
      if (!texcoords.empty())
        out << "/" << texcoords[t][k];
      if (!mesh.normals.empty())
        out << (texcoords.empty() ? "//" : "/") << point;
    }
    out << "\n";
  }
  out.flush();
}

void write_stl(const TriangleMesh& mesh, const Sink& sink) {
  if (mesh.triangles.size() > UINT32_MAX)
    throw Error(std::to_string(mesh.triangles.size()) + " triangles, expected at most " +
                std::to_string(UINT32_MAX) + " in an STL file");
  Pieces out(sink);
  std::array<char, 80> head{}; // must not begin with "solid"
  const std::string_view title = "binary STL by gewebe, millimetres";
  std::copy(title.begin(), title.end(), head.begin());
  out.put(head);
  out.put(static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const Triangle& t : mesh.triangles) {
    const Vec3 a = mesh.points[t[0]];
    Vec3 normal = cross(mesh.points[t[1]] - a, mesh.points[t[2]] - a);
    const double length = norm(normal);
    normal = length > 0 && std::isfinite(length) ? normal / length : Vec3{};
    out.put(std::array{static_cast<float>(normal.x), static_cast<float>(normal.y),
                       static_cast<float>(normal.z)});
    for (const std::uint32_t corner : t) {
      const Vec3& p = mesh.points[corner];
      out.put(std::array{single(p.x), single(p.y), single(p.z)});
    }
    out.put(std::uint16_t{0});
  }
  out.flush();
}

} // namespace gewebe::formats
