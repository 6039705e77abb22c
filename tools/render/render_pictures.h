#pragma once
// Draws the pictures of surfaces that emboss-render's options request.

#include "render/picture.h"
#include "texture/image.h"
#include "tools/cli/cli.h"
#include "tools/render/render_arguments.h"
#include "tools/render/render_materials.h"

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

namespace gewebe::cli {

/// Camera and light stand where the first surfaces at rest place them, and turn by the options.
/// What a sequence keeps is kept: textures; coordinates and vertices as they are split while the
/// triangles are the same; frames of tangents while no point moves; the picture while camera and
/// light stand still too.
class Pictures {
public:
  Pictures(Run& run, const RenderArguments& arguments);
  /// Draws a picture; the first time it reads the textures. \throw Error with place
  const texture::Image& of(std::vector<shading::Surface> surfaces);
  /// Whether the last picture is that before it.
  bool kept() const { return kept_last_; }
  /// That of the last picture. \pre there is one
  const shading::Camera& camera() const { return *camera_; }
  /// What is known at the end.
  void tell(Stats& stats, const texture::Image& last) const;

private:
  struct Drawn {
    std::vector<Vec3> points;
    std::vector<Triangle> triangles;
  };
  struct Mode {
    std::unique_ptr<render::Painter> painter;
    render::PictureReport report;
  };
  void start(const std::vector<shading::Surface>& surfaces);
  shading::Camera camera_of(std::uint64_t number) const;
  bool place(std::uint64_t number);
  std::optional<shading::DrawingChange> take(std::vector<shading::Surface> surfaces, bool placed);
  void tell_groups(const shading::Drawing& drawing);
  std::vector<shading::Surface> styled(std::vector<shading::Surface> surfaces) const;

  Run& run_;
  const RenderArguments& arguments_;
  texture::SurfaceMaterial material_;
  std::vector<render::PictureOptions> options_; ///< of the modes to compare, or one
  std::vector<Mode> modes_;
  std::optional<shading::Camera> camera_;
  shading::DrawingOptions drawing_;
  std::optional<TissueColors> tissue_;
  std::array<shading::DrawingMaker, 2> makers_; ///< without and with frames for each pixel
  std::vector<shading::Surface> surfaces_;      ///< as they are drawn
  std::vector<Drawn> plain_;                    ///< surfaces drawn in another style
  Box3 box_;                                    ///< at rest
  Vec3 first_light_;
  texture::Image last_;
  bool kept_last_ = false;
  bool groups_told_ = false;
  std::uint64_t pictures_ = 0, kept_ = 0, mapped_ = 0;
};

} // namespace gewebe::cli
