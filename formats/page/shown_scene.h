#pragma once
// Surfaces over time as a viewer shows them: what pages (.html) and glTF files (.glb) are made of.

#include "geometry/mesh.h"
#include "geometry/vec3.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace gewebe::formats {

/// Consecutive triangles of one colour.
struct ShownPaint {
  std::size_t triangles = 0;
  Vec3 color; ///< 0 … 1 each, as in picture files
};

/// An object or instrument in consecutive frames with the same triangles.
struct ShownPart {
  std::string name;
  bool instrument = false;
  std::size_t first = 0; ///< frame
  std::vector<Triangle> triangles;
  std::vector<ShownPaint> paints; ///< of all triangles, in their order
  std::vector<Vec3> rest;
  std::vector<std::vector<Vec3>> points; ///< by frame, as many as `rest`
  /// Values of ShownScene::stored at the points, by frame; empty where there are none.
  std::vector<std::vector<double>> values;
};

/// A field, and the values of the ramp's ends.
struct ShownField {
  std::string name, unit;
  double least = 0, greatest = 1;
};

/// An instrument's position (mm) and the force on it (N), by frame; nothing while it is absent.
struct ShownInstrument {
  std::string name;
  std::vector<std::optional<std::array<Vec3, 2>>> place_and_force;
};

/// A quantity over time.
struct ShownCurve {
  std::string name, unit;
  std::vector<std::optional<double>> values; ///< by frame
};

/// How a page begins.
struct ShownView {
  Vec3 eye, target, up; ///< mm
  double fov = 30;      ///< degrees across the shorter side
  Vec3 background;
  bool endoscope = false;
  std::optional<double> reach;             ///< of the endoscope's light, mm
  std::optional<std::array<Vec3, 2>> clip; ///< point and normal of a plane
  std::string field;                       ///< name; "": materials
};

struct ShownScene {
  std::string title;
  std::vector<double> times; ///< s, by frame; one at least
  std::vector<ShownPart> parts;
  std::optional<ShownField> displacement; ///< |point - rest| of parts that are no instruments
  std::optional<ShownField> stored;       ///< of ShownPart::values
  std::vector<ShownInstrument> instruments;
  std::vector<ShownCurve> curves;
  Box3 box;                                      ///< of the parts at rest
  std::vector<std::array<std::uint8_t, 3>> ramp; ///< 256 colours
  ShownView view;
};

/// Bytes of its points and values.
double scene_bytes(const ShownScene& scene);

} // namespace gewebe::formats
