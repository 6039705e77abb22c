#pragma once
// Pictures of surfaces as emboss-render was told to make them.

#include "render/image.h"
#include "render/picture.h"
#include "tools/cli.h"
#include "tools/render_arguments.h"

#include <memory>
#include <optional>
#include <vector>

namespace gewebe::cli {

/// Camera and light stand where the first surfaces at rest place them. What a sequence keeps is
/// kept: textures, and the picture where no point moved.
class Pictures {
public:
  /// Reads the textures. \throw Error with place
  Pictures(Run& run, const RenderArguments& arguments);
  Image of(std::vector<Surface> surfaces);
  /// What is known at the end.
  void tell(Stats& stats, const Image& last) const;

private:
  struct Mode {
    std::unique_ptr<Painter> painter;
    PictureReport report;
  };
  void start(const std::vector<Surface>& surfaces);
  void tell_groups(const Drawing& drawing);
  std::vector<Surface> styled(std::vector<Surface> surfaces) const;

  Run& run_;
  const RenderArguments& arguments_;
  Look look_;
  std::vector<PictureOptions> options_; ///< of the modes to compare, or one
  std::vector<Mode> modes_;
  std::optional<Camera> camera_;
  DrawingOptions drawing_;
  std::vector<std::vector<Vec3>> drawn_points_;
  Image last_;
  bool groups_told_ = false;
  std::uint64_t pictures_ = 0, kept_ = 0, mapped_ = 0;
};

} // namespace gewebe::cli
