#include "mesh/quality.h"

#include "mesh/check.h"

#include <algorithm>
#include <cmath>

// Based on: Gershgorin's circle theorem for the springs' stiffness matrix, whose off-diagonal
// blocks have the norm of their springs' stiffness.

namespace gewebe::mesh {
namespace {

constexpr std::size_t grain = 1 << 15;

std::vector<std::span<const float>> pieces_of(const std::vector<float>& values) {
  std::vector<std::span<const float>> pieces;
  for (std::size_t begin = 0; begin < values.size(); begin += grain)
    pieces.emplace_back(&values[begin], std::min(grain, values.size() - begin));
  return pieces;
}

} // namespace

MeshQuality quality_of(const FaceFigures& faces, const FanFigures& fans, const Context& context) {
  MeshQuality quality;
  const AngleFigures& angles = faces.angles;
  quality.smallest_angles = angles.smallest_angles;
  const std::vector<std::span<const float>> lengths(fans.lengths.begin(), fans.lengths.end());
  quality.edge_lengths = histogram(lengths, 20, fans.edge_max, context);
  quality.areas = histogram(pieces_of(faces.areas), 20, faces.area_max, context);
  if (fans.edges == 0)
    return quality;
  quality.share_below_10 = angles.share_below_10;
  quality.angle_1_percent = angles.at_1_percent;
  quality.angle_5_percent = angles.at_5_percent;
  quality.angle_median = angles.median;
  quality.edge_ratio = fans.edge_max / fans.edge_min;
  quality.explicit_step = 2 / std::sqrt(2 * fans.stiffness_max);
  return quality;
}

MeshQuality mesh_quality(const TriangleMesh& mesh, const Context& context) {
  MeshQuality quality;
  (void)examine_mesh(mesh, context, &quality);
  return quality;
}

} // namespace gewebe::mesh
