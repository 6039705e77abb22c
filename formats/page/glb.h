#pragma once
// A scene as binary glTF 2.0 (.glb), animated by morph targets.

#include "formats/page/shown_scene.h"
#include "formats/stream/stream.h"

#include <cstdint>
#include <vector>

namespace gewebe::formats {

/// Times of the animation in s: those of the frames, or 1/25 s each where the frames' times, as
/// float32, do not grow strictly, as glTF requires.
std::vector<float> animation_times(const std::vector<double>& times);

/// Writes the scene; the caller commits. A node scales mm to m and turns z up to y up. Each part is
/// a mesh: its first frame with normals, and a morph target for each later frame that differs from
/// the one before. Weights are animated linearly; a part that is not in all frames has an animated
/// scale of 0 or 1. With scene.view.field the values are colours of points (COLOR_0), morphed too;
/// points without value are grey. \return its size in bytes
/// \throw Error if the file would have 4 GiB or more; what Output throws
std::uint64_t write_glb(Output& output, const ShownScene& scene);

} // namespace gewebe::formats
