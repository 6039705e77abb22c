// In gewebe-volume.so alone.

#include "base/error.h"
#include "formats/volume/volume_file.h"
#include "formats/volume/volume_plugin_internal.h"

#include <utility>

using namespace gewebe;

const char* const gewebe_volume_version = GEWEBE_VERSION;

void gewebe_view_volume(std::string* bytes, const std::string* name,
                        const VolumeViewOptions* options, const Context* context,
                        VolumeView* view) {
  const Grid grid = volume_from_bytes(std::move(*bytes), *name, *context);
  *view = at(*name, [&] { return view_volume(grid, *options, *context); });
}
