#pragma once
// Large displacements of a linear solid from the factor, or the columns, that small ones need.
//
// A body bends and turns far while its strains stay moderate: its energy is then that of the small
// strains in local frames, and its shape that of solid/rotation_strain.h. With the linear
// displacements v (K v the forces in the local frames) and the shape x(v), what is found makes
//   ½ vᵀ K v - fᵀ x(v)  stationary:  K v = (dx/dv)ᵀ f,
// the load turned back into the local frames, where lever arms count as they are on the deformed
// body. (Turning each force by the rotation of its node alone, as modal warping does - Choi, Ko,
// Modal warping, IEEE TVCG 11(1), 2005 -, takes the arms of the body at rest.) Under small loads it
// is the linear answer. The equation is a fixed point, v <- K⁻¹ (dx/dv)ᵀ f; two or three rounds
// from the linear answer do, mixed by Anderson's method.
//
// Against converged Neo-Hookean bodies of the same elements, beam 100 × 30 × 30 held at one end,
// nu = 0.45, load on the other end, largest error over largest displacement:
//
//   | end turns by     | linear | all loads | by columns | 1, 2, 3 rounds           |
//   |------------------|--------|-----------|------------|--------------------------|
//   | 15°, bent        | 10.6 % | 0.4 %     | 0.4 %      | 0.6 %, 0.4 %, 0.4 %      |
//   | 30°, bent        | 23.4 % | 1.0 %     | 1.2 %      | 3.6 %, 1.1 %, 1.0 %      |
//   | 45°, bent        | 41.7 % | 1.8 %     | 2.3 %      | 17 %, 2.4 %, 1.7 %       |
//   | 36°, twisted     | 38.5 % | 3.4 %     | 3.5 %      | 9.6 %, 3.3 %, 3.4 %      |
//
// Cost, a surface of 3,842 nodes, 28 of them loaded, columns in the cache, one core: the linear
// shape is a pass over the columns, 0.15 ms; with one round from a start 0.46 ms (3 times), with
// two from nothing 0.61 ms (4 times). By the factor of the same body, 45,084 unknowns, one round
// from a start costs 1.1 linear solutions, two from nothing 3.2. Corners alone, a quarter of the
// nodes of quadratic elements, take part in rounds.
//
// Loads inside count as they are in K v, and on the surface (RotationStrain::on_surface) in how
// they turn. Shapes are those of the surface; nodes inside have none.

#include "base/context.h"
#include "solid/assembly.h"
#include "solid/rotation_strain.h"
#include "solve/factor.h"
#include "solve/stiffness.h"
#include "tetrahedra/tet_mesh.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe {

struct WarpOptions {
  int max_rounds = 8;
  double tolerance = 1e-3; ///< of a round's change over the largest displacement
};

/// Columns of K⁻¹ for some nodes of the surface, at the nodes of the surface: what a store has. And
/// what whole loads, as gravity's along an axis, displace there, as further columns.
struct WarpColumns {
  std::vector<std::uint32_t> nodes;       ///< among RotationStrain::nodes()
  std::vector<std::vector<double>> loads; ///< on_surface
  std::vector<float> values;              ///< 3 columns for each node, one for each load
  std::vector<double> inverse;            ///< of the work of each column's load in each, by rows

  std::size_t count() const noexcept { return 3 * nodes.size() + loads.size(); }
};

/// A shape, and how far the last round still changed it.
struct WarpedShape {
  std::vector<double> u; ///< of the surface's nodes, mm
  /// What a next answer may start from: the surface's displacements of small strains that the shape
  /// stands for; by columns, their coefficients, forces in the local frames.
  std::vector<double> local;
  double change = 0; ///< over the largest displacement: > tolerance, if rounds ran out
  int rounds = 0;
};

/// Forces that hold nodes at places, on the deformed body, and its shape.
struct WarpedForces {
  std::vector<double> forces; ///< 3 for each node, g mm/s²
  WarpedShape shape;
};

struct WarpKernel;

class RotationWarp {
public:
  /// The factor must outlive it. Costs what RotationStrain does.
  /// \pre matrix is solid_stiffness(mesh, elements, fixed), the factor is its   \throw as
  /// RotationStrain
  RotationWarp(const TetMesh& mesh, std::span<const SolidElement> elements,
               std::span<const std::uint8_t> fixed, const StiffnessMatrix& matrix,
               const Factor& factor, const Context& context = {});

  const RotationStrain& surface() const noexcept { return surface_; }

  /// Under loads on the 3 n axes. A round costs a solution with K's factor and a pass over the
  /// surface's triangles, a start another solution where none is given; all of it two solutions of
  /// the surface's Laplacian, and one of the inside's where loads are there.
  WarpedShape shape(std::span<const double> load, std::span<const double> start = {},
                    const WarpOptions& options = {}) const;

  /// By three solutions with K's factor for each node, one for each load on the 3 n axes, where
  /// loads are one behind the other. \throw Error if a node is fixed along an axis
  WarpColumns columns(std::span<const std::uint32_t> nodes,
                      std::span<const double> loads = {}) const;

  /// Under loads on the columns' nodes, 3 numbers each, and factors of their loads, by the columns
  /// alone: the least energy that their combinations have. A round costs two passes over the
  /// columns at corners (one of them at all nodes, if there are loads) and one over triangles; all
  /// of it a pass over the columns, as a linear shape, and two solutions of the surface's
  /// Laplacian. Near the start, as from step to step, one round does.
  WarpedShape shape(const WarpColumns& columns, std::span<const double> load,
                    std::span<const double> start = {}, const WarpOptions& options = {}) const;

  /// What holds the columns' nodes displaced by `targets`, 3 numbers each: of the columns'
  /// combinations the one that is there, and the forces whose work balances its energy. A round
  /// costs one pass over the columns, one over triangles, a solution of the surface's Laplacian;
  /// the forces, then, a few rounds of the same.
  WarpedForces forces(const WarpColumns& columns, std::span<const double> targets,
                      std::span<const double> start = {}, const WarpOptions& options = {}) const;

private:
  /// Σ coefficients × columns at the first nodes.
  void combine(const WarpColumns& columns, std::span<const double> coefficients, std::size_t nodes,
               std::span<double> u) const;
  /// The work with each column of forces on corners and on the columns' nodes, or on the surface
  /// where the columns have loads.
  std::vector<double> project(const WarpColumns& columns, std::span<const double> forces) const;

  RotationStrain surface_;
  const StiffnessMatrix& matrix_;
  const Factor& factor_;
  const WarpKernel& kernel_;
};

} // namespace gewebe
