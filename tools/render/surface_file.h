#pragma once
// Whatever has a surface to draw: a mesh, a model, a frame of a run, tetrahedra.

#include "base/context.h"
#include "formats/stream/kind.h"
#include "formats/stream/stream.h"
#include "shading/drawing.h"
#include "tetrahedra/clip.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace gewebe::cli {

struct SurfaceReadOptions {
  formats::Kind kind = formats::Kind::unknown; ///< of input_kind()
  std::string unit;                            ///< of a mesh, as in MeshReadOptions
  std::string object;                          ///< of a result, by name; "": all
  std::optional<std::int64_t> frame; ///< of a result, from 0; -1 is the last one, and the default
  std::optional<tetrahedra::ClipPlane> clip; ///< of tetrahedra
  std::size_t ring = 0; ///< of a result: corners of the rings of its instruments, as round_surface
                        ///< has them; 0: they are left out
  std::string field;    ///< of a result, of result_field_names(); "": none
  std::optional<std::array<double, 2>>
      field_range; ///< the values of the ramp's ends, if there is one
};

/// What was found in a tetrahedral mesh; all 0 of anything else.
struct SolidReport {
  std::uint64_t tetrahedra = 0, curved_edges = 0;
  std::uint64_t tetrahedra_cut = 0, tetrahedra_removed = 0; ///< by the plane
  std::uint64_t cut_triangles = 0;
  double cut_area = 0; ///< mm²
};

/// Kinds of meshes and of tetrahedral ones, ela and h5.
const std::vector<formats::Kind>& readable_surface_kinds();

/// The words of --unit.
const std::vector<std::string>& surface_unit_names();

/// The frames of a result that a word stands for: "all", "K", "A:B" or "A:B:STEP", both ends
/// included, negative ones counted from the last (-1).
/// \throw Error with place if there are no such frames; UsageError if it is none of these words
std::vector<std::int64_t> result_frames(const formats::Input& input, const std::string& word);

/// The surfaces of `input` in mm, in order; those of a result with their points at rest
/// (result_surfaces.h). A PLY with the element tetrahedron is tetrahedra, whatever faces it has
/// (solid_surface.h); a model is where options.clip is given.
/// \throw Error with place, also if a result comes by a pipe, or has no such object or frame;
/// UsageError for options that the kind has no use for
std::vector<shading::Surface> read_surfaces(formats::Input& input,
                                            const SurfaceReadOptions& options,
                                            const Context& context, SolidReport* solid = nullptr);

} // namespace gewebe::cli
