#pragma once
// How programs that make a volume write it.

#include "formats/stream/stream.h"
#include "geometry/space.h"
#include "tools/cli/cli.h"
#include "volume/grid.h"

namespace gewebe::cli {

struct VolumeOutput {
  bool uncompressed = false;
  Space space = Space::unknown; ///< stated in the volume
};

/// Declares --to and --uncompressed.
void declare(cli::Program& program, VolumeOutput& options);

/// Opens what --output names. \throw UsageError if --to or its suffix says a kind that is none of
/// volumes
formats::Output open_volume(const cli::Run& run);

/// Writes and commits.
void write(cli::Run& run, formats::Output& output, const volume::Grid& grid,
           const VolumeOutput& options);

} // namespace gewebe::cli
