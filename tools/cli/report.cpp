#include "tools/cli/report.h"

#include "base/digest.h"
#include "volume/volume_stats.h"

namespace gewebe::cli {

void report_volume(Run& run, const volume::Grid& grid) {
  if (!run.stats_wanted())
    return;
  const volume::VolumeStats volume = volume::volume_stats(run.context(), grid);
  Stats& stats = run.stats();
  stats.set("voxel_size", grid.info().transform.voxel_size());
  stats.set("isovalue", grid.info().isovalue);
  stats.set("leaves", volume.leaves);
  stats.set("tiles", volume.tiles);
  stats.set("active_voxels", volume.active_voxels);
  stats.set("inside_voxels", volume.inside_voxels);
  stats.set("volume", volume.volume);
  stats.set("inside_volume", volume.inside_volume);
  stats.set("min", volume.min);
  stats.set("max", volume.max);
  if (!volume.box.empty()) {
    stats.set("box_min", volume.box.min);
    stats.set("box_max", volume.box.max);
  }
  stats.set("digest", digest_text(grid.digest()));
}

} // namespace gewebe::cli
