#pragma once
// Textures on the shape at rest, as input of the rasteriser's kernels.

#include "raster/raster_kernel_internal.h"
#include "shading/drawing.h"
#include "texture/surface_material.h"

#include <optional>

namespace gewebe::raster {

class RasterRest {
public:
  /// Takes the images that lie on the shape at rest out of `scene`.
  RasterRest(const shading::Drawing& drawing, const texture::SurfaceMaterial& material,
             KernelScene& scene);
  RasterRest(const RasterRest&) = delete;
  RasterRest& operator=(const RasterRest&) = delete;

private:
  KernelRest rest_{};
  std::optional<texture::SolidPlan> base_, detail_, structure_;
};

} // namespace gewebe::raster
