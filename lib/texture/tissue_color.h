#pragma once
// Default colours of tissue in pictures.

#include "geometry/mesh.h"
#include "geometry/vec3.h"

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>

namespace gewebe::texture {

/// The colour, 0 … 1, of the material `number` of a model: that of its name, where it is one of the
/// presets (model/material.h), else one of eight that numbers have in turn. A choice: organs in
/// books look so.
Vec3 tissue_color(std::string_view name, std::size_t number);

/// Colours of the materials of a mesh, by number: tissue_color(), but where a material of a lower
/// number that shares a point with it has that colour, the next of sixteen that none of these has.
/// Named presets keep theirs. \param names  of materials 0, 1, …; may be shorter
std::map<std::int32_t, Vec3> tissue_colors(const TriangleMesh& mesh,
                                           std::span<const std::string> names);

} // namespace gewebe::texture
