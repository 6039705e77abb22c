#pragma once
// A model of finite elements cut by a blade: elements, masses, supports and surface follow.

#include "model/cut.h"
#include "model/cut_select.h"
#include "model/model.h"
#include "tetrahedra/cut_tetrahedra.h"

#include <cstdint>
#include <vector>

namespace gewebe {

struct SolidCut {
  /// In `triangle`: of the wall.
  static constexpr std::uint32_t wall = UINT32_MAX;

  Model model;
  std::vector<TetNodeOrigin> origin; ///< of each node; tetrahedra are those of the model before
  std::vector<std::uint32_t> tetrahedron; ///< of each: that before which it is (a part of)
  std::vector<std::uint32_t> triangle;    ///< of each: that before in which it lies, or wall
  std::vector<std::uint32_t> changed;     ///< tetrahedra before, as in TetCut
  BladeCutReport report;

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
/// Pieces that come off stay in the model. Nodes of the wall stand behind all others, so that
/// surface_count() rises to the number of nodes.
/// \pre check_model(model) passes
/// \throw Error as cut_tetrahedra; if the model has no tetrahedra, has springs, central nodes or a
/// skin; if a face of its boundary at the blade is not among its triangles
SolidCut cut_solid(const Model& model, const TriangleMesh& blade,
                   const BladeCutOptions& options = {});

/// The cut as one of any model (model/cut.h): copies share what their node had by their masses.
/// \pre `cut` is of this model
CutModel as_cut_model(const Model& before, SolidCut cut);

/// Two triangles of the plane that reach beyond the model at rest. \pre the model has nodes
TriangleMesh plane_blade(const Model& model, const CutPlane& plane);

} // namespace gewebe
