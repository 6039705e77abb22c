#pragma once
// Models for the tests of stiffness, factor, condition and store.

#include "base/error.h"
#include "base/parallel.h"
#include "formats/mesh/mesh_file.h"
#include "model/build.h"
#include "model_meshes.h"
#include "solve/stiffness.h"

#include <cstdlib>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

namespace gewebe::test {

inline Model model_of(const TriangleMesh& mesh, std::int64_t centrals = 4,
                      const BuildOptions& more = {}) {
  BuildOptions options = more;
  options.centrals = centrals;
  Model model = build_model(mesh, options, Context{}).model;
  model.name = "ball";
  return model;
}

/// A point cloud's worth of random springs: every kind of direction, and rest lengths that differ
/// from the lengths where `stretch` isn't 1.
inline Model stretched(Model model, double stretch) {
  for (Spring& s : model.springs)
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

inline Model model_of_file(const std::string& path, const std::string& unit) {
  Input input(path);
  const Kind kind = input_kind(input.peek(4096), path, "");
  return model_of(read_mesh(input, {kind, unit, weld_from_name("auto")}));
}

} // namespace gewebe::test
