#include "mesh_fixtures.h"

#include "repair/weld.h"

#include <cstring>
#include <iterator>
#include <sstream>
#include <tuple>

namespace gewebe::test {

TriangleMesh load_test_mesh(const std::string& name) {
  TriangleMesh mesh;
  std::ifstream file(shared_folder() + "/data/" + name, std::ios::binary);
  if (!file)
    return mesh;
  if (name.ends_with(".obj")) {
    for (std::string line, word; std::getline(file, line);) {
      std::istringstream words(line);
      words >> word;
      if (word == "v") {
        Vec3 p;
        words >> p.x >> p.y >> p.z;
        mesh.points.push_back(p);
      } else if (word == "f") {
        std::vector<std::uint32_t> face;
        while (words >> word)
          face.push_back(static_cast<std::uint32_t>(std::stoul(word)) - 1);
        for (std::size_t c = 2; c < face.size(); ++c)
          mesh.triangles.push_back({face[0], face[c - 1], face[c]});
      }
    }
    repair::weld(mesh, {}); // seams of texture coordinates
    return mesh;
  }
  const std::string bytes((std::istreambuf_iterator<char>(file)), {});
  std::vector<float> corners; // x y z of all corners of all facets
  std::uint32_t facets = 0;
  if (bytes.size() >= 84)
    std::memcpy(&facets, bytes.data() + 80, 4);
  if (bytes.size() == 84 + 50 * std::size_t{facets}) {
    for (std::size_t at = 84; at < bytes.size(); at += 50) {
      corners.resize(corners.size() + 9);
      std::memcpy(&corners[corners.size() - 9], bytes.data() + at + 12, 36);
    }
  } else {
    std::istringstream words(bytes);
    for (std::string word; words >> word;)
      if (word == "vertex") {
        corners.resize(corners.size() + 3);
        float* const p = &corners[corners.size() - 3];
        words >> p[0] >> p[1] >> p[2];
      }
  }
  std::map<std::tuple<float, float, float>, std::uint32_t> index;
  for (std::size_t at = 0; at + 9 <= corners.size(); at += 9) {
    Triangle t{};
    for (std::size_t c = 0; c < 3; ++c) {
      const float x = corners[at + 3 * c], y = corners[at + 3 * c + 1], z = corners[at + 3 * c + 2];
      const auto [it, fresh] =
          index.try_emplace({x, y, z}, static_cast<std::uint32_t>(mesh.points.size()));
      if (fresh)
        mesh.points.push_back({x, y, z});
      t[c] = it->second;
    }
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0])
      mesh.triangles.push_back(t);
  }
  return mesh;
}

} // namespace gewebe::test
