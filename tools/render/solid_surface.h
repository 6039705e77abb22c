#pragma once
// What is drawn of a tetrahedral mesh: its boundary, whole or cut open.

#include "base/context.h"
#include "formats/stream/stream.h"
#include "shading/drawing.h"
#include "tetrahedra/clip.h"
#include "tools/cli/cli.h"
#include "tools/render/surface_file.h"

namespace gewebe::cli {

/// The boundary of the tetrahedra of `input`, in mm, with their materials. Where options.clip is
/// given, what is left of it is part 0 and the faces of the cut are part 1, which has points of its
/// own, so that the rim is an edge. Quadratic tetrahedra are drawn by their corners.
/// \throw Error with place: what read_tet_mesh, require_sound and clip_tetrahedra refuse; a plane
/// that takes all away
shading::Surface read_solid(formats::Input& input, const SurfaceReadOptions& options,
                            SolidReport& report, const Context& context);

/// Adds to the report. \throw Error if require_sound refuses
void examine_solid(const tetrahedra::TetMesh& mesh, SolidReport& report);
/// What the plane leaves of tetrahedra, quadratic ones taken by their corners: parts and points as
/// above. Adds to the report; a mesh without points where nothing is left.
/// \pre as for clip_tetrahedra   \throw Error as it
tetrahedra::TetClip cut_open(const tetrahedra::TetMesh& mesh, const tetrahedra::ClipPlane& plane,
                             SolidReport& report);
/// The mesh of that. \throw Error too if nothing is left
TriangleMesh open_mesh(const tetrahedra::TetMesh& mesh, const tetrahedra::ClipPlane& plane,
                       SolidReport& report);

inline constexpr const char* takes_all_away =
    "--clip takes all of it away, expected a plane with some on the side that its normal points "
    "away from";

/// Into the stats, with warnings of edges that are drawn straight and a plane that takes nothing
/// away; nothing where there are no tetrahedra.
void tell_solid(Run& run, const std::string& name, const SurfaceReadOptions& options,
                const SolidReport& report);

} // namespace gewebe::cli
