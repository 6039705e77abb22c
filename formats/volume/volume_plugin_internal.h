#pragma once
// What gewebe-volume.so offers. One compiler makes it and its programs.

#include "base/context.h"
#include "shading/volume_view.h"

#include <string>

extern "C" {
extern const char* const gewebe_volume_version;
void gewebe_view_volume(std::string* bytes, const std::string* name,
                        const gewebe::VolumeViewOptions* options, const gewebe::Context* context,
                        gewebe::VolumeView* view);
}
