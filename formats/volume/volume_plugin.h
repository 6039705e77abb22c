#pragma once
// Volumes for programs that seldom need them: OpenVDB takes longer to load than a picture to draw,
// so what reads it is a library of its own, gewebe-volume.so, that is loaded when a volume comes.

#include "base/context.h"
#include "shading/volume_view.h"

#include <string>

namespace gewebe {

/// volume_from_bytes (formats/volume/volume_file.h) and view_volume, in gewebe-volume.so, which
/// stands beside the program or in ../lib/gewebe from there. It stays loaded. \throw Error with
/// place `name` for what they throw, and if the library is missing or of another version
VolumeView view_volume_bytes(std::string bytes, const std::string& name,
                             const VolumeViewOptions& options, const Context& context);

} // namespace gewebe
