#pragma once
// Scans of grey values, CT or MR: the formats of formats/volume/label_volume.h, read for their
// values.

#include "base/context.h"
#include "formats/stream/stream.h"
#include "labels/grey_volume.h"

#include <string>
#include <string_view>
#include <vector>

namespace gewebe::formats {

struct GreyScan {
  labels::GreyVolume volume; ///< the file's values after its slope and intercept, rounded to float
  std::string format;        ///< as LabelVolume::format
  std::vector<std::string> warnings;
};

/// Where the voxels of a volume of any of these formats lie, by its header alone: what stands
/// behind that is not read. RAS, mm. \throw Error with the place, as below, for a wrong header
struct VolumePlace {
  Int3 size{};
  volume::GridTransform transform;
  std::vector<std::string> warnings;
};
VolumePlace read_volume_place(Input& input, const Context& context);

/// Reads forwards, from a pipe too; only files of two parts need a name. RAS, mm.
/// \throw Error with the place if it is none of the formats, is cut off or goes on beyond its end,
/// if the affine is singular, or if the values would need more than context.max_memory
GreyScan read_grey_volume(Input& input, const Context& context);

/// The same for bytes that are there already; `name` is for messages. Files of two parts are
/// refused.
GreyScan grey_volume_from_bytes(std::string_view bytes, const std::string& name,
                                const Context& context);

} // namespace gewebe::formats
