#include "tools/volume/volume_output.h"

#include "formats/stream/kind.h"
#include "formats/volume/volume_file.h"

namespace gewebe {

void declare(cli::Program& program, VolumeOutput& options) {
  program.output_kinds({Kind::vdb});
  program.flag("-u,--uncompressed", options.uncompressed, "do not compress; faster in pipes");
}

Output open_volume(const cli::Run& run) {
  (void)output_kind(run.to(), run.output(), Kind::vdb, {Kind::vdb});
  return {run.output(), run.output_options(true)};
}

void write(cli::Run& run, Output& output, const Grid& grid, const VolumeOutput& options) {
  run.timed("write", [&] {
    write_volume(output, grid, run.context(), options.uncompressed ? Packing::none : Packing::blosc,
                 options.space);
    if (options.space != Space::unknown)
      run.stats().set("space", std::string(space_name(options.space)));
  });
  output.commit();
}

} // namespace gewebe
