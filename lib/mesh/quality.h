#pragma once
// How well a mesh is shaped for computing on it: angles, lengths, areas, and the time step that its
// springs allow.

#include "base/context.h"
#include "geometry/mesh.h"
#include "mesh/face_figures.h"
#include "mesh/fans.h"

namespace gewebe::mesh {

struct MeshQuality {
  Histogram smallest_angles; ///< of each face, degrees: 12 bins of 5
  Histogram edge_lengths;    ///< mm: 20 bins up to the longest
  Histogram areas;           ///< of the faces, mm²: 20 bins up to the largest
  double share_below_10 = 0; ///< of faces whose smallest angle is below 10 degrees
  /// The smallest angle that 1 % of the faces stay below (the value at rank floor(n / 100)), 5 %,
  /// and half of them; degrees; 0 without faces.
  double angle_1_percent = 0, angle_5_percent = 0, angle_median = 0;
  double edge_ratio = 0; ///< longest edge over shortest; infinite where one has no length
  /// Time step, s, up to which explicit (central-difference) integration of a spring on each edge
  /// is stable, with stiffness 1/L (L its length in mm) and mass 1 on each node: 2/w, from
  /// Gershgorin's bound w² = max over nodes of sum 2/L on the largest eigenvalue. The true limit is
  /// larger: 1.6 times on a regular mesh, hardly where one short edge decides. 0 where an edge has
  /// no length or there is none.
  double explicit_step = 0;
};

/// Of what was found of the faces and round the points. \throw Cancelled
MeshQuality quality_of(const FaceFigures& faces, const FanFigures& fans, const Context& context);

/// What examine_mesh (mesh/check.h) finds, faces with equal corners left out. \pre, \throw as there
MeshQuality mesh_quality(const TriangleMesh& mesh, const Context& context = {});

} // namespace gewebe::mesh
