#pragma once
// --transform: meshes, tetrahedra and models moved, turned, scaled and mirrored.

#include "geometry/affine.h"
#include "geometry/mesh.h"
#include "model/model.h"
#include "tetrahedra/tet_mesh.h"
#include "tools/cli/cli.h"

#include <string>

namespace gewebe::cli {

/// Declares --transform.
void declare_transform(cli::Program& program, std::string& transform);

/// Steps ("translate 0 0 5; rotate z 30; scale 1000; mirror x"), or the name of a file with a 4 x 4
/// matrix. \throw UsageError for wrong steps; Error with place for a wrong file
Affine transform_from_text(const std::string& text);

/// Faces and elements of what is mirrored keep their outside. \throw Error if a coordinate is not
/// finite afterwards
void apply(const Affine& map, TriangleMesh& mesh);
void apply(const Affine& map, tetrahedra::TetMesh& mesh);
/// \throw Error also if the map changes lengths, on which masses and stiffness depend, or turns an
/// axis that a node is held along out of the axes
void apply(const Affine& map, model::Model& model);

} // namespace gewebe::cli
