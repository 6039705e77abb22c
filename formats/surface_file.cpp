#include "formats/surface_file.h"

#include "base/error.h"
#include "formats/ela.h"
#include "formats/mesh_file.h"

#include <utility>

namespace gewebe {
namespace {

std::vector<Surface> one(TriangleMesh mesh) {
  std::vector<Surface> surfaces(1);
  surfaces[0].mesh = std::move(mesh);
  return surfaces;
}

} // namespace

const std::vector<Kind>& readable_surface_kinds() {
  static const std::vector<Kind> kinds = [] {
    std::vector<Kind> all = readable_mesh_kinds();
    all.push_back(Kind::ela);
    return all;
  }();
  return kinds;
}

const std::vector<std::string>& surface_unit_names() {
  return mesh_unit_names();
}

std::vector<Surface> read_surfaces(Input& input, const SurfaceReadOptions& options,
                                   const Context& context) {
  if (options.kind != Kind::ela)
    return one(read_mesh(input, {options.kind, options.unit, std::nullopt, false}));
  if (!options.unit.empty())
    throw UsageError(input.name(), "--unit for a model, which is in mm, expected no --unit");
  return one(surface_mesh(read_ela(input, context)));
}

} // namespace gewebe
