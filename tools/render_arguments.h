#pragma once
// What emboss-render is told.

#include "formats/surface_file.h"
#include "render/camera.h"
#include "render/drawing.h"
#include "render/look.h"
#include "render/picture.h"
#include "render/uv.h"
#include "tools/cli.h"

#include <cstdint>
#include <optional>
#include <string>

namespace gewebe::cli {

struct RenderArguments {
  std::string surface = "-", base, structure, uv = "auto", view, backend = "auto", size = "512";
  std::string passes = "2"; // the only algorithm so far
  std::optional<Vec3> light;
  std::int64_t supersample = 1;
  Look look;
  SurfaceReadOptions reading;
  CameraOptions camera;
  DrawingOptions drawing;
  UvOptions mapping;
  PictureOptions picture;
};

/// Declares the options and the checks that hold them against each other.
void declare(Program& program, RenderArguments& arguments);

} // namespace gewebe::cli
