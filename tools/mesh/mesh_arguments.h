#pragma once
// Command line of mc-opt.

#include "formats/stream/kind.h"
#include "tetrahedra/refinement.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace gewebe::cli {

struct MeshArguments {
  std::string volume = "-", place, components, materials, interface, labels, space, refine;
  std::optional<double> isovalue, voxel, epsilon, cell;
  std::vector<double> box; // x0 y0 z0 x1 y1 z1
  std::int64_t rounds = 0, grade = 0;
  bool tets = false, normals = false, self_intersections = false;
};

/// \throw UsageError for options that don't go together
void check(const MeshArguments& arguments);

/// The regions of --refine. \throw UsageError for a wrong text
std::vector<tetrahedra::RefinedRegion> refined_regions(const MeshArguments& arguments);

/// The files of --materials. \throw UsageError if one has no name
std::vector<std::string> material_paths(const MeshArguments& arguments);

/// The kinds of surfaces and of tetrahedra.
std::vector<formats::Kind> writable_kinds();

} // namespace gewebe::cli
