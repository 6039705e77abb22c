#pragma once
// A deformable model from a triangle mesh (report FZKA 7190, section 3.1.3; exp2ela(1)).

#include "base/context.h"
#include "geometry/mesh.h"
#include "model/material.h"
#include "model/model.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace gewebe::model {

struct BuildOptions {
  MaterialChoice material{{material_presets()[0]}, {}};
  std::optional<double> stiffness; ///< of every edge spring, g/s²; else from Young's modulus
  std::optional<double> mass;      ///< of every surface node, g; else density × thickness × area
  double drag_rate = 1;            ///< drag of a node per mass, 1/s
  bool bend = false;               ///< springs across edges
  double bend_factor = 0.1;        ///< their stiffness over that of the edge they cross
  std::int64_t centrals = 4;       ///< central nodes per component, 0 or more
  /// Stiffness of a central spring over that of an edge spring, where the node has a thousandth of
  /// its component's area.
  double central_factor = 0.1;
  bool centrals_free = false; ///< else they can't move
  bool normals = false;       ///< area-weighted vertex normals

  bool operator==(const BuildOptions&) const = default;
};

/// Elements of the mesh that were left out or mended, and properties of the mesh.
struct BuildReport {
  std::size_t isolated_points = 0;   ///< points of no face: left out
  std::size_t degenerate_faces = 0;  ///< faces with two equal corners: left out
  std::size_t duplicate_faces = 0;   ///< faces with the same corners as an earlier one: left out
  std::size_t zero_length_edges = 0; ///< edges between coincident points: no spring
  std::size_t light_nodes = 0;       ///< nodes raised to 1/1000 of the mean mass
  std::size_t slack_springs = 0;     ///< edge springs with stiffness 0, between faces without area
  std::size_t boundary_edges = 0;    ///< edges of one face
  std::size_t nonmanifold_edges = 0; ///< edges of more than two faces

  /// A count with its name; `warning` is the text for the user if the count needs a warning.
  struct Line {
    const char* key;
    std::size_t count;
    const char* warning;
  };
  std::vector<Line> lines() const;
};

struct BuiltModel {
  Model model;
  BuildReport report;
};

/// Builds a model from a mesh. Nodes are the mesh's points in its order, then central nodes.
///
/// Edge springs are the mesh's unique edges with k = E h ΣA / l² summed over their faces (Van
/// Gelder 1998). Bending springs join the corners opposite an edge of two faces, unless an edge
/// joins them. Central springs tie each node to the nearest central node of its component: k = 1000
/// F s A_i / A. A_i is a third of the area of the faces at the node, A the component's area, F the
/// central factor. s is the given stiffness, or √3/2 E h, that of an edge spring in a net of
/// equilateral triangles. The stiffness per area therefore does not depend on the number of nodes.
///
/// Rest lengths are distances. A spring damps with c = 2 ζ √(k μ), μ = m_i m_j / (m_i + m_j), or
/// the other's mass if one end is fixed along all axes; ζ is the mean of its nodes' materials. The
/// result is the same for any number of threads. \pre check_mesh(mesh) passes
/// \throw Error if there is no usable triangle or a result is not finite; Cancelled
BuiltModel build_model(const TriangleMesh& mesh, const BuildOptions& options,
                       const Context& context);

/// Peak memory of build_model, bytes.
double model_bytes(double points, double triangles, bool bend);

/// Positions of at most `count` central nodes for these points, and the nearest one for each point.
///
/// Seeds are farthest points; the first is farthest from the mean. Lloyd's iteration follows, until
/// nothing changes or for 100 rounds. Seeds whose distances agree to a hundredth are chosen by
/// their positions; other ties go to the lowest index. Each center has a point. Means are weighted
/// if `weights` has a number > 0 for each point, so that the centers do not depend on local
/// refinement of a net.
struct Clusters {
  std::vector<Vec3> centers;
  std::vector<std::uint32_t> of_point;
};
Clusters cluster_points(const std::vector<Vec3>& points, std::size_t count, const Context& context,
                        std::span<const double> weights = {});

/// The nearest of these centers for each point, ties to the lowest. Centers without a point are
/// removed.
Clusters nearest_clusters(const std::vector<Vec3>& points, const std::vector<Vec3>& centers,
                          const Context& context);

} // namespace gewebe::model
