#pragma once
// A deformable model of finite elements from a tetrahedral mesh, and back.

#include "base/context.h"
#include "fem/assembly.h"
#include "model/material.h"
#include "model/model.h"
#include "tetrahedra/tet_mesh.h"

#include <vector>

namespace gewebe::fem {

struct SolidModelOptions {
  model::MaterialChoice material{{model::material_presets()[0]},
                                 {}}; ///< part p: tetrahedra of material p
  bool quadratic = true;
  double drag_rate = 1; ///< drag of a node per mass, 1/s
  bool normals = false; ///< area-weighted, of the surface; 0 inside
};

/// Nodes in the order of order_nodes(): of the surface corners, then middles of edges, then inside
/// corners, then middles; a point of no tetrahedron is left out. Elements are those of the mesh in
/// its order, quadratic ones with a middle on each edge; triangles are the boundary's, each as four
/// (at the corners, then in the middle) where elements are quadratic.
/// Masses are those of solid_masses(). A node has the material of the first element that uses it.
/// No springs, no central nodes. \pre check_mesh(mesh) passes, require_sound() too
/// \throw Error if the mesh is quadratic and the options are not, a middle is away from its edge's,
/// a material has no Poisson's ratio, or there are too many nodes; Cancelled
model::Model solid_model(tetrahedra::TetMesh mesh, const SolidModelOptions& options,
                         const Context& context);

/// The elements of a model as a mesh whose points are its nodes, all of them.
tetrahedra::TetMesh element_mesh(const model::Model& model);
/// A material without a law is stable Neo-Hookean under large strains. Prony series stay those of
/// the model, which outlives the result.
/// \pre check_model(model) passes, each material that an element has has a Poisson's ratio
std::vector<SolidMaterial> element_materials(const model::Model& model);

} // namespace gewebe::fem
