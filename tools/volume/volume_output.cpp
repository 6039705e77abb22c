#include "tools/volume/volume_output.h"

#include "formats/stream/kind.h"
#include "formats/volume/dense_image.h"
#include "formats/volume/volume_file.h"

#include <vector>

namespace gewebe::cli {
namespace {

std::vector<formats::Kind> volume_kinds() {
  std::vector<formats::Kind> kinds{formats::Kind::vdb};
  kinds.insert(kinds.end(), formats::dense_image_kinds().begin(),
               formats::dense_image_kinds().end());
  return kinds;
}

formats::Kind kind_of(const cli::Run& run) {
  return formats::output_kind(run.to(), run.output(), formats::Kind::vdb, volume_kinds());
}

bool names_gzip(const cli::Run& run) {
  return run.output().ends_with(".gz");
}

void write_image_of(cli::Run& run, formats::Output& output, const volume::Grid& grid,
                    formats::Kind kind, const VolumeOutput& options) {
  formats::DenseImageOptions image;
  image.kind = kind;
  image.compressed = kind == formats::Kind::nifti ? names_gzip(run) : !options.uncompressed;
  image.space = options.space;
  if (options.space == Space::unknown) {
    run.warn(output.name() + ": the volume states no space; the image takes its axes as RAS");
    image.space = Space::ras;
  }
  const Int3 size = formats::write_dense_image(output, grid, image);
  run.stats().set("image_size", std::vector<std::uint64_t>{static_cast<std::uint64_t>(size[0]),
                                                           static_cast<std::uint64_t>(size[1]),
                                                           static_cast<std::uint64_t>(size[2])});
}

} // namespace

void declare(cli::Program& program, VolumeOutput& options) {
  program.output_kinds(volume_kinds());
  program.flag("-u,--uncompressed", options.uncompressed, "do not compress; faster in pipes");
}

formats::Output open_volume(const cli::Run& run) {
  (void)kind_of(run);
  return {run.output(), run.output_options(true)};
}

void write(cli::Run& run, formats::Output& output, const volume::Grid& grid,
           const VolumeOutput& options) {
  const formats::Kind kind = kind_of(run);
  if (options.uncompressed && kind == formats::Kind::nifti && names_gzip(run))
    throw UsageError(output.name() + ": --uncompressed for .gz, expected one of them");
  run.timed("write", [&] {
    if (kind != formats::Kind::vdb)
      write_image_of(run, output, grid, kind, options);
    else
      formats::write_volume(output, grid, run.context(),
                            options.uncompressed ? formats::Packing::none : formats::Packing::blosc,
                            options.space);
    if (options.space != Space::unknown)
      run.stats().set("space", std::string(space_name(options.space)));
  });
  output.commit();
}

} // namespace gewebe::cli
