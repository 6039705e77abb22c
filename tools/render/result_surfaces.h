#pragma once
// What is drawn of a frame of a run: surfaces, solids cut open at their deformed shape, and values
// of a field as texture coordinates of a ramp.

#include "formats/results/results.h"
#include "formats/stream/stream.h"
#include "shading/drawing.h"
#include "texture/color_ramp.h"
#include "texture/texture.h"
#include "tools/render/surface_file.h"

#include <array>
#include <cstdint>
#include <vector>

namespace gewebe::cli {

/// Objects in the order of the scene. With options.clip those that are cut as read_solid() does, at
/// the displaced places of their nodes, quadratic elements as the eight of linear_parts(); the
/// report sums them up. With options.field each corner has its value's place in ramp_texture():
/// where an edge is cut it is interpolated linearly along it. Behind the objects stand the
/// instruments, if options.ring has them: whole, with their own normals, and with their shape
/// around their own origin as the one at rest. \throw Error with place: a pipe, no such frame,
/// object or field; with a plane also an object without tetrahedra, one that is not sound at rest,
/// and a plane that takes all of all away
std::vector<shading::Surface> read_result_surfaces(const formats::Input& input,
                                                   const SurfaceReadOptions& options,
                                                   SolidReport& report);

/// An instrument at its pose, with its own normals and its shape around its own origin as rest.
/// \param ring  corners of its rings, as round_surface has them
shading::Surface instrument_surface(formats::ResultInstrument of, std::size_t ring);

/// The least and the greatest value of options.field at any node of the drawn objects in some
/// frames (-1 is the last). \throw Error as above
std::array<double, 2> result_field_range(const formats::Input& input,
                                         const SurfaceReadOptions& options,
                                         const std::vector<std::int64_t>& frames);

/// A ramp as the base texture of what has such coordinates.
texture::Texture ramp_texture(const texture::ColorRamp& ramp);

} // namespace gewebe::cli
