#pragma once
// The picture without OpenGL: our own rasteriser, the same bytes on every machine and for any
// number of threads.

#include "base/context.h"
#include "shading/camera.h"
#include "shading/drawing.h"
#include "texture/image.h"
#include "texture/surface_material.h"

#include <cstdint>

namespace gewebe::raster {

/// The largest side of a picture, samples included.
constexpr std::uint32_t max_picture_side = 65536;

struct RenderReport {
  std::uint64_t triangles = 0; ///< drawn: in the view and not without area (GL: all)
  std::uint64_t covered = 0;   ///< pixels, or samples
};

/// Draws `drawing` as width × height pixels of `material`. A pixel has the value at its centre; a
/// triangle owns the centres inside it and those on its top and left edges, on a lattice of 1/256
/// pixel; the nearest surface is seen, from both sides; attributes are linear in space. Of
/// coincident surfaces the first counts. With samples == 4 a pixel is the mean of four samples, in
/// which every surface has its value at the pixel's centre (multisampling). Every CPU level gives
/// the same bytes.
/// \pre width, height <= max_picture_side, samples is 1 or 4   \throw Cancelled
texture::Image render_cpu(const shading::Drawing& drawing, const shading::Projection& projection,
                          const texture::SurfaceMaterial& material, std::uint32_t width,
                          std::uint32_t height, int samples, const Context& context,
                          RenderReport* report = nullptr);

/// Bytes that render_cpu needs for a picture, without its drawing.
double render_cpu_bytes(std::uint32_t width, std::uint32_t height, int samples,
                        const Context& context);

} // namespace gewebe::raster
