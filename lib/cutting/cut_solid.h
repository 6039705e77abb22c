#pragma once
// A model of finite elements cut by a blade: elements, masses, supports and surface follow.

#include "cutting/cut.h"
#include "cutting/cut_select.h"
#include "cutting/cut_skin.h"
#include "incision/cut_tetrahedra.h"
#include "model/model.h"

#include <cstdint>
#include <vector>

namespace gewebe::cutting {

struct SolidCut {
  /// In `triangle`: of the wall.
  static constexpr std::uint32_t wall = UINT32_MAX;

  model::Model model;
  std::vector<incision::TetNodeOrigin>
      origin; ///< of each node; tetrahedra are those of the model before
  std::vector<std::uint32_t> tetrahedron; ///< of each: that before which it is (a part of)
  std::vector<std::uint32_t> triangle;    ///< of each: that before in which it lies, or wall
  std::vector<std::uint32_t> changed;     ///< tetrahedra before, as in TetCut
  std::vector<Vec3> skin_end;             ///< SkinCut::end
  incision::BladeCutReport report;

  bool cut() const { return !changed.empty(); }
};

/// cut_tetrahedra() of the model's elements (see there for numbers, what is snapped, `options`).
/// Nodes that are held along any axis are not moved.
///
/// Masses at nodes of changed elements lose what these gave and get what their parts give
/// (solid_masses), so that their sum stays, and what else a node carries stays with it; drag per
/// mass stays, too, and is carried over to new nodes. A new node is held along the axes along which
/// all nodes are that it stands between, and has the material of the first element that uses it.
///
/// Triangles of the surface that are cut make room for their parts, behind the others in order; the
/// wall follows, of each place the upper side, then the lower. Texture coordinates of parts are
/// those of the triangle before, at their places; those of the wall are 0 (solid textures go by
/// places). Normals, where there are any, are area-weighted where triangles have changed.
///
/// A skin is cut by the sheet, exactly where that passes (cut_skin), while the elements' wall is
/// off it where no way to cut them is sound (BladeCutReport); points of either wall follow the
/// nearest element on their side of the wound, so that they may lie outside of it, as points of
/// skins do. Its walls have the materials of the elements there, their texture coordinates are 0.
/// A sheet that reaches farther than the elements come apart leaves both of its walls together
/// there. With `options.among` it goes no farther than elements beside their wall.
///
/// Pieces that come off stay in the model. Nodes of the wall stand behind all others, so that
/// surface_count() rises to the number of nodes.
/// \pre check_model(model) passes
/// \param sheet what cuts the skin, at rest: where nothing is given the blade itself. Not looked at
/// without a skin
/// \throw Error as cut_tetrahedra and cut_skin; if the model has no tetrahedra, has springs or
/// central nodes; if a face of its boundary at the blade is not among its triangles
SolidCut cut_solid(const model::Model& model, const TriangleMesh& blade,
                   const incision::BladeCutOptions& options = {}, const SkinSheet* sheet = nullptr);

/// The cut as one of any model (cutting/cut.h): copies share what their node had by their masses.
/// \pre `cut` is of this model
CutModel as_cut_model(const model::Model& before, SolidCut cut);

/// How large the triangles of a sheet should be: mean length of the edges of elements, mm.
double sheet_cell(const model::Model& model);

/// Two triangles of the plane that reach beyond the model at rest. \pre the model has nodes
TriangleMesh plane_blade(const model::Model& model, const CutPlane& plane);

} // namespace gewebe::cutting
