#pragma once
// What our rasteriser's kernels are told of textures on the shape at rest.

#include "render/drawing.h"
#include "render/look.h"
#include "render/raster_kernel_internal.h"

#include <optional>

namespace gewebe {

class RasterRest {
public:
  /// Takes the images that lie on the shape at rest out of `scene`.
  RasterRest(const Drawing& drawing, const Look& look, KernelScene& scene);
  RasterRest(const RasterRest&) = delete;
  RasterRest& operator=(const RasterRest&) = delete;

private:
  KernelRest rest_{};
  std::optional<SolidPlan> base_, detail_, structure_;
};

} // namespace gewebe
