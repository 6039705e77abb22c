#pragma once
// Command line of emboss-render.

#include "render/picture.h"
#include "shading/camera.h"
#include "shading/drawing.h"
#include "shading/uv.h"
#include "shading/volume_view.h"
#include "texture/color_ramp.h"
#include "texture/surface_material.h"
#include "tools/cli/cli.h"
#include "tools/render/surface_file.h"

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace gewebe::cli {

/// One of the four textures.
struct RenderLayer {
  std::string path;                           ///< "": absent
  std::optional<texture::SolidTexture> solid; ///< instead of a file
  texture::TextureOptions options;
};

struct TextureLayers {
  RenderLayer base, detail, reflection, structure;
};

/// What a material, a part or an object has for itself; the rest is as for all.
struct RenderMaterial : TextureLayers {
  std::optional<Vec3> color;
  std::optional<double> wet, wet_roughness;
};

/// Options of volumes, as words and as their meaning.
struct RenderVolume {
  std::string slice, maximum, translucent, ramp;
  std::vector<double> range;
  shading::VolumeViewOptions view; ///< its mode, axis and place
};

/// How surfaces look, and their light.
struct RenderLook {
  std::string style = "textured";
  bool field_material = false; ///< --field material: colours of materials
  bool tissue_colors = false;  ///< what has neither colour nor texture has that of its material
  std::optional<double> wet, wet_roughness; ///< the film on all
  std::optional<double> occlusion_radius;   ///< mm
  std::optional<Vec3> inside;               ///< colour of what is seen of surfaces from within
  double offset = 0.02;
  std::optional<double> offset_texels; ///< of the structure instead
  std::optional<double> crease;        ///< degrees
  std::optional<Vec3> light;
  bool endoscope = false;               ///< the light goes with the camera, the field is round
  std::optional<double> reach;          ///< where its light is full, mm
  bool no_instruments = false;          ///< of a result
  std::optional<Vec3> instrument_color; ///< else that of steel
};

/// Several pictures.
struct RenderFilm {
  std::string frames;                           ///< of a result, "": one
  std::optional<std::int64_t> turn, turn_light; ///< pictures in one turn
  std::optional<double> rate;                   ///< of a film, pictures per second
  std::vector<std::string> compare;             ///< modes side by side
};

/// Options of pictures and their textures that declare() turns into RenderArguments.
struct PictureWords {
  std::string size = "512", backend = "auto", uv = "auto", passes = "shader", target = "float",
              tbn = "auto", filter = "mipmap", wrap = "repeat", sphere = "reflection";
  std::int64_t msaa = 1, rgb_scale = 2;
  std::optional<std::int64_t> supersample; ///< nothing: what is fit for a surface
  bool plain = false;
  std::optional<std::int64_t> uv_sharpness;
};

/// Those of the camera, the light and what is shown.
struct ViewWords {
  std::string view, by = "material", compare, legend = "auto";
  std::vector<double> orbit{0, 0};
  std::optional<Vec3> light_direction, color, background;
  std::optional<double> shade, fill, fov;
  std::vector<double> clip; ///< point and normal
};

struct RenderArguments {
  std::string surface = "-";
  TextureLayers layers;
  std::map<std::int32_t, RenderMaterial> materials;
  texture::SurfaceMaterial common; ///< colours; its textures are read later
  RenderLook look;
  RenderFilm film;
  SurfaceReadOptions reading;
  shading::CameraOptions camera;
  shading::DrawingOptions drawing;
  shading::UvOptions mapping;
  render::PictureOptions picture;
  RenderVolume volume;
  texture::ColorRamp ramp;               ///< of a field, see take_field
  bool legend = false;                   ///< pictures have one
  std::vector<std::string> look_options; ///< given options of looks and views
  PictureWords words;
  ViewWords view_words;
};

/// Declares the options and the checks that hold them against each other.
void declare(Program& program, RenderArguments& arguments);

} // namespace gewebe::cli
