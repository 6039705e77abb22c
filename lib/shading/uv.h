#pragma once
// Texture coordinates for meshes that have none.

#include "base/context.h"
#include "geometry/mesh.h"
#include "geometry/vec3.h"
#include "shading/drawing.h"

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace gewebe::shading {

enum class UvMapping { box, sphere, cylinder };

/// "box", "sphere", "cylinder".
const std::vector<std::string>& uv_mapping_names();
/// \throw Error if there is no such mapping
UvMapping uv_mapping_from_name(std::string_view name);

struct UvFrame {
  UvMapping mapping = UvMapping::box;
  Box3 box;         ///< of all that shares the texture, at rest
  double edge = 10; ///< box: the texture's edge in mm, > 0
};

/// Six coordinates per triangle, s0 t0 s1 t1 s2 t2, from the points at rest, so that the texture
/// sticks to the tissue when it moves. No image is mirrored seen from outside.
/// - box: a triangle is projected along the largest component of the sum of its corners' normals,
///   the texture repeats every `edge` mm; sharp seams where the largest component changes.
/// - sphere: longitude around the axis z through the box's centre, latitude -90° … 90° is t = 0
/// … 1.
/// - cylinder: longitude, and t = 0 … 1 from the box's bottom to its top.
/// A triangle across the longitude of the seam goes on beyond s = 1; a corner on the axis takes the
/// mean longitude of the others.
/// \pre the triangles' corners index `rest`
std::vector<std::array<float, 6>> make_texcoords(std::span<const Vec3> rest,
                                                 std::span<const Triangle> triangles,
                                                 const UvFrame& frame, const Context& context);

struct UvOptions {
  std::optional<UvMapping> mapping; ///< nothing: box, for surfaces without coordinates alone
  std::optional<double> edge;       ///< of box, mm; nothing: half the longest side of the box
};

/// Gives the surfaces coordinates by one common frame around all of them at rest, and returns how
/// many got them; instruments get zeros and don't count.
std::uint64_t add_texcoords(std::vector<Surface>& surfaces, const UvOptions& options,
                            const Context& context);

} // namespace gewebe::shading
