#pragma once
// What each face of a mesh is like, and what can be said of all: areas, angles, volumes.

#include "base/context.h"
#include "geometry/mesh.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::mesh {

/// Counts of values in equal bins over [0, top]; a value at a border counts above it, one at the
/// top in the last bin.
struct Histogram {
  double top = 0;
  std::vector<std::uint64_t> counts;
};

/// Of values in pieces; those below 0 are left out.
Histogram histogram(std::span<const std::span<const float>> pieces, std::size_t bins, double top,
                    const Context& context);

/// The smallest angles of faces, degrees.
struct AngleFigures {
  Histogram smallest_angles; ///< 12 bins of 5
  double share_below_10 = 0;
  double at_1_percent = 0, at_5_percent = 0, median = 0;
};
/// The faces of a mesh, except those with equal corners.
struct FaceFigures {
  std::uint64_t degenerate = 0; ///< with equal corners
  std::uint64_t zero_area = 0;  ///< area <= 1e-12 longest edge²
  double area = 0;              ///< sum, mm²
  double area_max = 0;
  double smallest_angle = 0; ///< degrees; 0 with zero-area faces; 180 without faces
  /// Of each face, rounded, for counting; -1 of those with equal corners.
  std::vector<float> areas;
  AngleFigures angles;
  /// Consecutive faces of one component.
  struct Run {
    std::uint32_t component = 0; ///< by its point
    std::uint32_t largest = 0;   ///< the first face of the largest area
    double square = -1;          ///< of twice its area
    double six_volumes = 0;      ///< of the tetrahedra over them to the component's point, signed
  };
  std::vector<Run> runs;
};
/// `component` names a point for each point: that of its component. \throw Cancelled
FaceFigures examine_faces(const TriangleMesh& mesh, const std::vector<std::uint32_t>& component,
                          const Context& context);

} // namespace gewebe::mesh
