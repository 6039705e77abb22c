#pragma once
// The volumes that tell where the materials of a solid are.

#include "formats/stream/stream.h"
#include "formats/volume/label_volume.h"
#include "geometry/space.h"
#include "labels/label_runs.h"
#include "stuffing/stuffing.h"
#include "tools/cli/cli.h"
#include "tools/mesh/mesh_arguments.h"
#include "volume/grid.h"

#include <vector>

namespace gewebe::cli {

/// The volumes of --materials, opened before the work: one of labels, or any number of others.
struct MaterialVolumes {
  /// \throw UsageError, Error if they don't go together
  explicit MaterialVolumes(const MeshArguments& arguments);
  /// \param space  of the positions given to source()
  void read(cli::Run& run, Space space);
  /// Nothing where there are none. \pre read; `solid`, which is meshed at `isovalue`, outlives it
  stuffing::MaterialSource source(const volume::Grid& solid, double isovalue) const;

  std::vector<formats::Input> inputs;
  bool is_labels = false;
  std::vector<formats::LabelRange> wanted; ///< of the labels; empty: all
  labels::LabelRuns labels;
  std::vector<volume::Grid> volumes;
  std::vector<bool> turned; ///< per input: it is in the other space
};

} // namespace gewebe::cli
