#pragma once
// Large displacements of a linear solid from the factor, or the columns, that small ones need.
//
// A body bends and turns far while its strains stay moderate: its energy is then that of the small
// strains in local frames, and its shape that of statics/rotation_strain.h. With the linear
// displacements v (K v the forces in the local frames) and the shape x(v), what is found makes
//   ½ vᵀ K v - fᵀ x(v)  stationary:  K v = (dx/dv)ᵀ f,
// the load turned back into the local frames, where lever arms count as they are on the deformed
// body. (Modal warping takes the arms of the body at rest, since it turns each force by the
// rotation of its node alone: Choi, Ko, Modal warping, IEEE TVCG 11(1), 2005.) Under small loads it
// is the linear answer, which the first round gives. The equation is a fixed point, v <- K⁻¹
// (dx/dv)ᵀ f; two or three more rounds do, mixed by Anderson's method.
//
// Against converged Neo-Hookean bodies of the same elements, beam 100 × 30 × 30 held at one end,
// nu = 0.45, load on the other end, largest error over largest displacement:
//
//   | end turns by     | linear | whole  | by columns | 2, 3, 4 rounds           |
//   |------------------|--------|--------|------------|--------------------------|
//   | 15°, bent        | 10.6 % | 0.3 %  | 0.4 %      | 0.6 %, 0.4 %, 0.4 %      |
//   | 30°, bent        | 23.4 % | 1.0 %  | 1.2 %      | 3.7 %, 1.0 %, 1.2 %      |
//   | 45°, bent        | 41.7 % | 1.7 %  | 2.3 %      | 17 %, 0.9 %, 2.8 %       |
//   | 36°, twisted     | 38.5 % | 2.7 %  | 2.8 %      | 11 %, 3.5 %, 2.7 %       |
//
// Loads come in two kinds. A whole load, as weight or a pressure, is turned back and solved for
// with K's factor. Forces on a few nodes, given or those that hold nodes at places, count by the
// columns of these nodes alone: of the columns' combinations the one with the least energy. Both
// add up, in one frame.
//
// A round costs a pass over the columns, a quarter of one (corners take part, not the middles of
// quadratic elements), four over the surface's triangles, four solutions on the surface's corners;
// and where there is a whole load that has turned further than the tolerance since it was solved
// for, a solution with K's factor. Near the last answer, as from step to step, one round does, for
// what earlier rounds differed by is kept. 30 displaced nodes of a surface of 3,458, moved slowly
// and far: forces and shape cost some 3 times the linear ones with quadratic elements, 6 to 8 times
// with linear ones, whose nodes are all corners (bench_solid_contact).
//
// Loads inside count as they are in K v, and on the surface (RotationStrain::on_surface) in how
// they turn.

#include "base/context.h"
#include "fem/assembly.h"
#include "statics/rotation_strain.h"
#include "tetrahedra/tet_mesh.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace gewebe::statics {

/// u = K⁻¹ f in place, over all 3 n axes; 0 on fixed ones.
using WarpSolve = std::function<void(std::span<double>)>;

struct WarpOptions {
  int max_rounds = 8;
  double tolerance = 1e-3; ///< of a round's change over the largest displacement
};

/// Columns of K⁻¹ of some nodes of the surface, at the nodes of the surface; all of them counted as
/// RotationStrain::nodes() does. Along an axis that is fixed they are 0.
class WarpColumns {
public:
  explicit WarpColumns(std::size_t surface_nodes) : rows_(3 * surface_nodes) {}

  /// These and no others, in any order; of new ones `column_of` gives the three columns.
  void set(std::span<const std::uint32_t> nodes,
           const std::function<void(std::uint32_t node, std::span<double> columns)>& column_of);
  const std::vector<std::uint32_t>& nodes() const noexcept { return nodes_; }
  std::size_t count() const noexcept { return 3 * nodes_.size(); }
  const float* values() const noexcept { return values_.data(); } ///< [column][row]
  double entry(std::size_t column, std::size_t row) const {
    return static_cast<double>(values_[column * rows_ + row]);
  }

  /// Where a column's own axis stands among the rows.
  std::size_t row_of(std::size_t column) const {
    return 3 * std::size_t{nodes_[column / 3]} + column % 3;
  }

  /// Their rows and columns among each other: x = block x; x = block⁻¹ x, of all, or of those nodes
  /// alone that are held (the others' entries of x are not used, and 0 behind it).
  void multiply(std::span<double> x) const;
  void solve(std::span<double> x) const;
  void solve_held(std::span<const std::uint8_t> held, std::span<double> x) const;

private:
  std::vector<double> block_of(std::span<const std::size_t> columns) const;
  std::vector<double> inverse_of(std::span<const std::size_t> columns) const;

  std::size_t rows_;
  std::vector<std::uint32_t> nodes_;
  std::vector<float> values_;
  std::vector<double> block_, inverse_;
  mutable std::vector<std::uint8_t> held_; ///< that the next ones are of
  mutable std::vector<std::size_t> held_columns_;
  mutable std::vector<double> held_inverse_;
};

/// A load on all 3 n axes.
struct WarpWholeLoad {
  std::vector<double> over_axes;
  std::vector<double> on_surface, spread; ///< as RotationStrain has it
};

/// What acts on a body.
struct WarpLoad {
  const WarpColumns& columns;
  std::span<const double> forces{};     ///< 3 for each column node; 0 where held
  std::span<const std::uint8_t> held{}; ///< of each column node; empty: none
  std::span<const double> targets{};    ///< 3 for each column node: where those stand
  const WarpWholeLoad* whole = nullptr;
};

/// What two rounds differed by: in what they changed, and where they came to.
struct WarpPair {
  std::vector<double> off, to;
};

/// An answer, and what the next one starts from.
struct WarpState {
  std::vector<double> local;        ///< of the surface: the small strains' displacements, mm
  std::vector<double> u;            ///< of the surface, mm
  std::vector<double> frames;       ///< as RotationStrain::turning(local)
  std::vector<double> whole_local;  ///< what the whole load has of `local`
  std::vector<double> whole_forces; ///< the whole load turned back, on the surface
  std::vector<std::uint32_t> nodes; ///< the columns', by which the next ones count
  std::vector<double> local_forces; ///< 3 each: forces in the local frames
  std::vector<double> holding;      ///< 3 each: what holds the held ones, else 0
  std::vector<std::uint8_t> held;   ///< of each, as the load had it
  std::vector<WarpPair> pairs;      ///< of the last rounds, the latest first
  /// Of the last round, over the largest displacement: > tolerance, if they ran out. What held
  /// nodes miss their places by is among it, and a tenth of how the forces there changed over the
  /// largest.
  double change = 0;
  int rounds = 0; ///< of this answer
  int solves = 0; ///< with K's factor, as well
};

struct WarpKernel;

class RotationWarp {
public:
  /// Costs what RotationStrain does. \pre K is that of the mesh's elements, or of these and what
  /// else acts between its nodes; `solve` is of it, and outlives this   \throw as RotationStrain
  RotationWarp(const tetrahedra::TetMesh& mesh, std::span<const fem::SolidElement> elements,
               std::span<const std::uint8_t> fixed, WarpSolve solve, const Context& context = {});

  const RotationStrain& surface() const noexcept { return surface_; }

  /// By two solutions of Laplacians. \pre 3 n numbers
  WarpWholeLoad whole_load(std::vector<double> over_axes) const;
  /// The columns of a node by three solutions with K's factor, for WarpColumns::set.
  void column_of(std::uint32_t node, std::span<double> columns) const;

  /// The shape under a load, and the forces that hold nodes at places. \param state the last
  /// answer, or nothing; the one found behind it
  void answer(const WarpLoad& load, WarpState& state, const WarpOptions& options = {}) const;

  /// Compliance of the surface at column nodes that are not held, by place among them: the change
  /// of their 3 m displacements for their 3 m forces near a state, while held nodes stay.
  /// Symmetric.
  std::vector<double> compliance_at(const WarpLoad& load, const WarpState& state,
                                    std::span<const std::size_t> places) const;

  /// whole_local: the displacements of small strains on all 3 n axes, by one solution with K's
  /// factor; a state's `local` is their part on the surface. whole_shape: the body's displacements,
  /// inside too, where the part that rotations add is continued harmonically from the surface.
  std::vector<double> whole_local(const WarpLoad& load, const WarpState& state) const;
  std::vector<double> whole_shape(const WarpState& state,
                                  std::span<const double> whole_local) const;

private:
  void follow_whole(const WarpWholeLoad& whole, const WarpOptions& options, WarpState& state) const;
  std::vector<double> forces_in_frames(const WarpColumns& columns, std::span<const double> on_nodes,
                                       const WarpState& state) const;
  void combine(const WarpColumns& columns, std::span<const double> forces,
               std::span<const double> whole, std::size_t from, std::size_t to,
               std::span<double> local) const;
  void hold(const WarpLoad& load, const WarpState& state, std::span<const double> missed,
            std::span<const double> placed, std::span<double> local,
            std::span<double> holding) const;

  RotationStrain surface_;
  WarpSolve solve_;
  const WarpKernel& kernel_;
};

} // namespace gewebe::statics
