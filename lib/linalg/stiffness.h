#pragma once
// The stiffness matrix of springs, linearised at rest (Bro-Nielsen 1998; report 3.3.2). That of a
// model, which may hold tetrahedra too: fem/model_stiffness.h.
//
// Per spring from i to j with rest length l0, length l and direction n: the block
// k [n nᵀ + (1 - l0/l)(I - n nᵀ)] at (i,i) and (j,j), its negative at (i,j) and (j,i); all springs
// count, edge, bending and central. Axis a of node i has the number 3 i + a; rows of K are the
// free axes in ascending order. Units: g/s² = 1e-3 N/m.

#include "base/context.h"
#include "model/model.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::linalg {

/// The lower triangle of K on free axes, by columns, rows ascending, the diagonal always present,
/// springs of stiffness 0 left out.
struct StiffnessMatrix {
  std::vector<std::int64_t> column_start; ///< order() + 1
  std::vector<std::int64_t> row;
  std::vector<double> value;
  std::vector<std::int64_t> row_of_axis; ///< 3 n: row of an axis, or -1 where it is fixed
  std::vector<std::int64_t> axis_of_row; ///< order()

  std::size_t order() const noexcept { return axis_of_row.size(); }
};

/// K of the model's springs. `fixed` (empty, or 3 n flags) names further axes to leave out, as
/// where displacements are prescribed. The same bytes on every machine. \pre check_model(model)
/// passes \throw Error if no axis is free, or a sum isn't finite
StiffnessMatrix spring_stiffness(const model::Model& model,
                                 std::span<const std::uint8_t> fixed = {});

/// A symmetric 3 × 3 matrix, entries xx xy xz yy yz zz.
using SymmetricBlock = std::array<double, 6>;

/// What a spring of the model adds to K.
SymmetricBlock stiffness_block(const model::Model& model, const model::Spring& spring);

/// The sum over the springs of blocks[e] at (i,i) and (j,j) and its negative at (i,j) and (j,i),
/// plus diagonal[i] (where there is one) on the axes of node i. Springs without stiffness and
/// damping make no entry, so that models of one structure have matrices of one pattern. \pre a
/// block for each spring   \throw Error as spring_stiffness
StiffnessMatrix spring_matrix(const model::Model& model, std::span<const SymmetricBlock> blocks,
                              std::span<const double> diagonal,
                              std::span<const std::uint8_t> fixed = {});

/// What each spring adds to K.
std::vector<SymmetricBlock> stiffness_blocks(const model::Model& model);
/// f = K u of the springs over all 3 n axes, the fixed ones too. \pre blocks are those of the
/// model, u.size() == f.size() == 3 n
void multiply_springs(const model::Model& model, std::span<const SymmetricBlock> blocks,
                      std::span<const double> u, std::span<double> f);

/// y = K x. \pre x.size() == y.size() == matrix.order(), they don't overlap
void multiply(const StiffnessMatrix& matrix, std::span<const double> x, std::span<double> y);

/// ‖K‖∞ (= ‖K‖₁) of the matrix.
double stiffness_norm(const StiffnessMatrix& matrix);

} // namespace gewebe::linalg
