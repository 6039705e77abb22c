#pragma once
// A sparse Cholesky factor of K that follows changes of the model: cuts, new nodes, other
// stiffnesses. It keeps what each front of the elimination tree left to its parent (Liu 1992), so
// that after a change only the fronts of changed nodes and their ancestors are computed again: an
// exact factor, whatever the rank of the change, and no rounding adds up from change to change.
//
// A cut that is local leaves most fronts alone, wherever it is; what is computed again is a way to
// the root of the tree. Memory is about three times that of the factor alone.

#include "base/context.h"
#include "cholesky/front_tree.h"
#include "cholesky/multifrontal.h"
#include "linalg/node_matrix.h"
#include "model/model.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace gewebe::linalg {

class FrontalFactor {
public:
  /// The factor of K of the model at rest. Nodes are eliminated in an order of its own finding
  /// (nested dissection or minimum degree, whichever fills less).
  /// \pre check_model(model) passes
  /// \throw NotPositiveDefinite (linalg/factor.h; its row is an axis, 3 i + a) where a pivot is
  /// less than its diagonal entry over max_condition, so that K's condition exceeds that; Error if
  /// no axis is free or memory exceeds the context's; Cancelled
  FrontalFactor(const model::Model& model, const Context& context);
  /// The same of a matrix, such as a solid's. \throw as above
  FrontalFactor(const NodeMatrix& matrix, const Context& context);
  /// The factor with a tree that another one of this matrix had: with its bits. \throw as above
  FrontalFactor(const model::Model& model, cholesky::FrontTree tree, const Context& context);
  FrontalFactor(const NodeMatrix& matrix, cholesky::FrontTree tree, const Context& context);
  ~FrontalFactor();
  FrontalFactor(FrontalFactor&&) noexcept;
  FrontalFactor& operator=(FrontalFactor&&) noexcept;

  /// Updates the factor to a model that came from the one before. `origin` is the earlier number of
  /// each node; `place` is the present number of each earlier node, or states that it is gone (see
  /// CutModel). Both may be empty where nodes stayed. Equal to a fresh factor with the same tree,
  /// bit by bit; where nodes are held along other axes than before, it is one.
  /// \throw as the constructor; then the factor is of no use
  cholesky::FrontalWork refactor(const model::Model& model, std::span<const std::uint32_t> origin,
                                 std::span<const std::uint32_t> place, const Context& context);

  /// The same of a matrix. A node that is new counts as a copy of its origin, right behind which it
  /// is eliminated. \param rows ascending: nodes whose rows are others, new ones among them
  /// \pre it is the factor of a matrix
  cholesky::FrontalWork refactor(const NodeMatrix& matrix, std::span<const std::uint32_t> origin,
                                 std::span<const std::uint32_t> place,
                                 std::span<const std::uint32_t> rows, const Context& context);

  const cholesky::FrontTree& tree() const noexcept;
  std::size_t axes() const noexcept;    ///< 3 n
  std::size_t entries() const noexcept; ///< doubles in L
  const cholesky::FrontalWork& work() const noexcept;
  /// The least pivot of all, over its diagonal entry of K: the reciprocal bounds the condition of K
  /// from below.
  double weakest_pivot() const noexcept;
  /// The axis, 3 i + a, that it eliminates: if something is nearly free, then this moves with it.
  std::size_t weakest_axis() const noexcept;

  /// In place, for right-hand sides over all axes one behind the other; 0 on fixed ones. Safe from
  /// many threads at once; the bits of each don't depend on the others. \pre over_axes.size() ==
  /// axes() * columns
  void solve(std::span<double> over_axes, std::size_t columns = 1) const;

  /// Forward solves: L⁻¹ of unit loads along the axes of a node, nothing but the way of its front
  /// to the root. Two of them give a block of C = K⁻¹, for C = L⁻ᵀ L⁻¹: that costs a few hundredths
  /// of what columns of C do.
  struct ForwardSolve {
    std::uint32_t front = none;                ///< that eliminates the node; none: fixed
    std::vector<std::array<double, 3>> values; ///< by rows of L that the way eliminates, and axis
    static constexpr std::uint32_t none = UINT32_MAX;
  };
  std::vector<ForwardSolve> forward_solves(std::span<const std::uint32_t> nodes) const;
  /// C at the axes of one node and of another, [axis of a][axis of b]. \pre both of this factor
  std::array<std::array<double, 3>, 3> compliance(const ForwardSolve& a,
                                                  const ForwardSolve& b) const;

  /// L⁻¹ of a load, kept front by front. Where the load or the factor has changed since, only the
  /// fronts that the change reaches are solved again; the bits are those of a full solution. With
  /// it, C f at a few nodes costs their paths to the root. Loads on fixed axes are ignored.
  /// \pre over_axes.size() == axes() \return how many fronts were solved
  std::size_t carry(std::span<const double> over_axes);
  /// C f at the axes of a node, of the load carried last. \pre `at` is of this factor, which
  /// carries a load and has not been refactored since
  std::array<double, 3> carried(const ForwardSolve& at) const;

private:
  struct State;
  std::unique_ptr<State> state_;
};

} // namespace gewebe::linalg
