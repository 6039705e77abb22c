#pragma once
// Models for the tests of stiffness, factor, condition and store.

#include "base/error.h"
#include "base/parallel.h"
#include "formats/mesh/mesh_file.h"
#include "linalg/stiffness.h"
#include "model/build.h"
#include "model_meshes.h"

#include <cstdlib>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

namespace gewebe::test {

inline model::Model model_of(const TriangleMesh& mesh, std::int64_t centrals = 4,
                             const model::BuildOptions& more = {}) {
  model::BuildOptions options = more;
  options.centrals = centrals;
  model::Model model = model::build_model(mesh, options, Context{}).model;
  model.name = "ball";
  return model;
}

/// A point cloud's worth of random springs: every kind of direction, and rest lengths that differ
/// from the lengths where `stretch` isn't 1.
inline model::Model stretched(model::Model model, double stretch) {
  for (model::Spring& s : model.springs)
    s.rest = norm(model.nodes[s.j].position - model.nodes[s.i].position) / stretch;
  return model;
}

inline std::vector<double> random_vector(std::size_t size, unsigned seed) {
  std::mt19937 engine(seed);
  std::vector<double> values(size);
  for (double& value : values)
    value = static_cast<double>(engine()) / 2147483648.0 - 1;
  return values;
}

/// Real data, "" where there is none.
inline std::string shared_file(const std::string& name) {
  const char* const folder = std::getenv("GEWEBE_SHARED");
  const std::string path = std::string(folder != nullptr ? folder : "../shared") + "/data/" + name;
  return std::filesystem::exists(path) ? path : "";
}

inline model::Model model_of_file(const std::string& path, const std::string& unit) {
  formats::Input input(path);
  const formats::Kind kind = formats::input_kind(input.peek(4096), path, "");
  return model_of(formats::read_mesh(input, {kind, unit, formats::weld_from_name("auto")}));
}

/// A block of material: nodes on a lattice, coupled as the corners of tetrahedra are. Its fronts
/// are as large as those of solids.
inline model::Model block_of_material(std::size_t side) {
  model::Model model;
  const auto number = [&](std::size_t x, std::size_t y, std::size_t z) {
    return static_cast<std::uint32_t>((x * side + y) * side + z);
  };
  std::mt19937 random(1);
  for (std::size_t k = 0; k < side * side * side; ++k) {
    const auto off = [&] { return 1e-10 * static_cast<double>(random()); };
    const std::size_t x = k / (side * side), y = k / side % side, z = k % side;
    model::Node node;
    node.position = {static_cast<double>(x) + off(), static_cast<double>(y) + off(),
                     static_cast<double>(z) + off()};
    node.fixed = z == 0 ? 7 : static_cast<std::uint8_t>(k % 97 == 1 ? 2 : 0);
    model.nodes.push_back(node);
  }
  for (std::size_t x = 0; x < side; ++x)
    for (std::size_t y = 0; y < side; ++y)
      for (std::size_t z = 0; z < side; ++z)
        for (std::size_t way = 1; way < 8; ++way) {
          const std::size_t a = x + way % 2, b = y + way / 2 % 2, c = z + way / 4;
          if (std::max({a, b, c}) == side)
            continue;
          model::Spring spring;
          spring.i = std::min(number(x, y, z), number(a, b, c));
          spring.j = std::max(number(x, y, z), number(a, b, c));
          spring.stiffness = 1 + 1e-10 * static_cast<double>(random());
          spring.rest = norm(model.nodes[spring.j].position - model.nodes[spring.i].position);
          model.springs.push_back(spring);
        }
  return model;
}

} // namespace gewebe::test
