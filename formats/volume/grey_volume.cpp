#include "formats/volume/grey_volume.h"

#include "formats/volume/label_volume_internal.h"

#include <utility>

namespace gewebe::formats {
namespace {

GreyScan read(ByteSource& source, const std::string& name, const Context& context,
              bool side_files) {
  const std::vector<LabelRange> no_labels;
  const LabelCheck no_check;
  GreyScan scan;
  LabelVolume volume = read_radiology(
      source, name, {no_labels, context, no_check, side_files, nullptr, &scan.volume});
  scan.format = std::move(volume.format);
  scan.warnings = std::move(volume.warnings);
  return scan;
}

} // namespace

VolumePlace read_volume_place(Input& input, const Context& context) {
  (void)input.peek(1); // says that it is empty
  StreamBytes source(input.stream(), input.name());
  const std::vector<LabelRange> no_labels;
  const LabelCheck no_check;
  VoxelLayout layout;
  const LabelVolume volume = read_radiology(
      source, input.name(),
      {no_labels, context, no_check, input.name() != "-", nullptr, nullptr, &layout});
  return {layout.size, layout.transform, volume.warnings};
}

GreyScan read_grey_volume(Input& input, const Context& context) {
  (void)input.peek(1); // says that it is empty
  StreamBytes source(input.stream(), input.name());
  return read(source, input.name(), context, input.name() != "-");
}

GreyScan grey_volume_from_bytes(std::string_view bytes, const std::string& name,
                                const Context& context) {
  MemoryBytes source(bytes);
  return read(source, name, context, false);
}

} // namespace gewebe::formats
