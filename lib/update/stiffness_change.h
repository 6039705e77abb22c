#pragma once
// Low-rank change of a stiffness matrix by a cut.
//
// Before the cut there are n nodes, K and C = K⁻¹; after it n' nodes, K' and C'. Each new node i'
// is an old one or a copy of one, origin(i'). A copy has the position of its origin. Let E (n' × n)
// map displacements so that every copy gets those of its origin. Springs that were only shared out
// between copies then pull as before. Let c be a column of C, the displacements under a load. The
// part of this load that K' E c does not balance is W w:
//
//   w = Σ Qᵀ c,   so   C' P = E C - C' W Σ Qᵀ C   on columns,   (1)
//
// with P c's loads at the kept copies. W, Q and Σ have a column, or an entry, for
//   - each axis of each copy: it and the kept copy of its origin pull apart with what the copy's
//     springs pull at it, W = e_copy - e_kept, Q = the copy's row of K' E, Σ = 1;
//   - each spring whose stiffness, summed over copies, has changed (by -k where it was removed):
//     W = Q = n(e_i - e_j), Σ the change; one column where the rest length is the length, otherwise
//     up to three.
// No term is a difference of large numbers. The rank is three for each copy and one for each
// severed spring, independent of the number of springs at the copies.

#include "base/context.h"
#include "cutting/cut_origin.h"
#include "model/model.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace gewebe::update {

/// Solves for right-hand sides over all axes of a model, one after the other, in place, as
/// AxisSolver::solve. Forces on fixed axes are ignored, displacements there are 0.
using AxesSolve = std::function<void(std::span<double> over_axes, std::size_t columns)>;

/// Sparse rows, entries ascending by axis.
struct SparseRows {
  std::vector<std::size_t> start{0};
  std::vector<std::uint32_t> axis;
  std::vector<double> value;

  std::size_t count() const noexcept { return start.size() - 1; }
  /// Row r times a dense vector.
  double times(std::size_t r, std::span<const double> x) const;
  /// x += factor row r.
  void add_to(std::size_t r, double factor, std::span<double> x) const;
};

/// Change of a stiffness matrix; see above for Σ, W and Q.
struct StiffnessChange {
  std::size_t old_axes = 0, new_axes = 0; ///< 3 n, 3 n'
  std::vector<std::uint32_t> origin;      ///< by new node
  std::vector<std::uint32_t> place;       ///< by old node: the kept copy, or gone_node
  std::vector<std::uint32_t> touched; ///< new nodes whose rows of K' aren't those of K, ascending
  std::size_t springs = 0;    ///< number of columns below that are of springs; these come first
  SparseRows load;            ///< Wᵀ: rows over new axes, 0 on fixed ones
  SparseRows answer;          ///< Qᵀ: rows over old axes, 0 on fixed ones
  std::vector<double> weight; ///< Σ
  std::vector<std::uint32_t> copy_axis; ///< of the columns after those of springs: new axes
  SparseRows copy_block;                ///< K' among copy_axis; `axis` has indices into copy_axis

  std::size_t rank() const noexcept { return weight.size(); }
  bool copy(std::uint32_t node) const { return place[origin[node]] != node; }
};

/// Finds the change between a model and the cut one.
/// \param origin  by node of `after`
/// \param place  by node of `before`: the copy that keeps its loads, or gone_node if the later
/// model has none (a part that was cut free). If the node does not exist, the lowest copy is used.
/// \pre check_model passes for both
/// \throw Error that names the node if `after` is not cut from `before`: a copy differs from its
/// origin in position or constraints, or the maps contradict each other
StiffnessChange stiffness_change(const model::Model& before, const model::Model& after,
                                 std::span<const std::uint32_t> origin,
                                 std::span<const std::uint32_t> place);

/// x' = E x: each copy as its origin. \pre sizes are those of the change
void copy_displacements(const StiffnessChange& change, std::span<const double> x,
                        std::span<double> on_new);

/// C' W, column by column: rank() solves of the new matrix, up to 24 at a time.
/// \param solve  of K'; called from several threads unless context.threads is 1
/// \throw Error if memory exceeds the context's; Cancelled
std::vector<double> change_response(const StiffnessChange& change, const AxesSolve& solve,
                                    const Context& context);

} // namespace gewebe::update
