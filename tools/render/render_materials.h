#pragma once
// Textures by material, part or object.

#include "shading/drawing.h"
#include "tools/render/render_arguments.h"

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace gewebe::cli {

/// Gives the textures of materials the options of those of all, and the drawing what they need.
/// \throw UsageError
void complete_materials(RenderArguments& arguments);

/// Whether the structure of some material, or of all, is solid.
bool has_solid_structure(const RenderArguments& arguments);

/// Their files.
std::vector<std::string> material_paths(const RenderArguments& arguments);

/// Adds the materials of the groups 1, 2, … to `common`, which holds what is for all. Textures of
/// groups without a triangle are not read, unless other frames may bring some. \param surfaces the
/// first ones that are drawn \throw Error with place
void add_group_materials(texture::SurfaceMaterial& common, const RenderArguments& arguments,
                         const std::vector<shading::Surface>& surfaces, const Context& context);

/// Reads, or not, the instruments that a result has. \throw UsageError if the input is no result
/// and words about instruments were given; Error with place
void take_instruments(RenderArguments& arguments, const formats::Input& input);

/// Adds the group of instruments behind all others, if they are read.
void add_instrument_material(texture::SurfaceMaterial& common, const RenderArguments& arguments,
                             shading::DrawingOptions& drawing);

/// Colours for materials that were given neither colour nor image, see tissue_color().
/// Where no number was given there is a group for each colour, whatever `--by` says: the triangles'
/// materials are renumbered.
class TissueColors {
public:
  /// \param surfaces the first ones that are drawn
  TissueColors(const RenderArguments& arguments, const std::vector<shading::Surface>& surfaces,
               texture::SurfaceMaterial& common, shading::DrawingOptions& drawing);
  void number_materials(std::vector<shading::Surface>& surfaces) const;

private:
  bool renumbers_ = false;
  std::vector<std::map<std::int32_t, Vec3>> of_surfaces_; ///< of the first surfaces' materials
  std::vector<Vec3> colors_;                              ///< of the groups
};

} // namespace gewebe::cli
