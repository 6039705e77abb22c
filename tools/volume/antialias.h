#pragma once
// --antialias of voxelize: which grey values, and the way to them.

#include "antialiasing/coverage.h"
#include "tools/cli/cli.h"

#include <string>

namespace gewebe::cli {

enum class Antialias { exact, lines, box, jones, sramek, none };

struct AntialiasChoice {
  Antialias filter = Antialias::jones;
  int count = 1; ///< N of lines:N and box:N
};

/// "exact", "lines:N", "box:N", "jones", "sramek" or "none" (`=` for `:` too), N from 1 to 64.
/// \throw UsageError
AntialiasChoice antialias_from_text(const std::string& text);

/// The volume. Where `exact` cannot be, lines:4 take its place and `instead` says so and why; warns
/// about open meshes. Errors name `place`.
volume::Grid antialiased(cli::Run& run, const std::string& place, const TriangleMesh& mesh,
                         const volume::GridTransform& transform, const AntialiasChoice& choice,
                         const voxelization::VoxelizeOptions& options,
                         antialiasing::CoverageReport& report);

} // namespace gewebe::cli
