#pragma once
// What gewebe-volume.so offers. One compiler makes it and its programs.

#include "base/context.h"
#include "formats/volume/volume_plugin.h"
#include "geometry/mesh.h"
#include "shading/volume_view.h"
#include "tetrahedra/tet_mesh.h"

#include <string>

extern "C" {
extern const char* const gewebe_volume_version;
void gewebe_view_volume(std::string* bytes, const std::string* name,
                        const gewebe::shading::VolumeViewOptions* options,
                        const gewebe::Context* context, gewebe::shading::VolumeView* view);
void gewebe_fill_surface(const gewebe::TriangleMesh* mesh, const std::string* name,
                         const gewebe::formats::SurfaceFilling* filling,
                         const gewebe::Context* context, gewebe::formats::FilledSurface* filled);
}
