#pragma once
// What a factor that follows changes consists of.

#include "linalg/frontal_factor.h"

#include "base/cpu.h"
#include "cholesky/front_tree.h"
#include "geometry/vec3.h"
#include "linalg/spring_graph.h"
#include "linalg/stiffness.h"
#include "linalg/supernodal_solve_internal.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::linalg {

namespace frontal {

inline constexpr std::uint32_t none = cholesky::FrontTree::none;

/// The free axes of a node.
struct FreeAxes {
  std::array<std::uint8_t, 3> axis{};
  std::uint8_t count = 0;
};

/// By the set of fixed ones.
inline constexpr std::array<FreeAxes, 8> all_free_axes = [] {
  std::array<FreeAxes, 8> all;
  for (std::uint8_t set = 0; set < 8; ++set)
    for (std::uint8_t a = 0; a < 3; ++a)
      if ((set >> a & 1) == 0)
        all[set].axis[all[set].count++] = a;
  return all;
}();

/// What K is made of: springs of a model, or a matrix.
struct Source {
  const model::Model* model = nullptr;
  const NodeMatrix* matrix = nullptr;

  std::size_t nodes() const { return model != nullptr ? model->nodes.size() : matrix->nodes(); }
  std::uint8_t fixed(std::size_t node) const {
    return model != nullptr ? model->nodes[node].fixed : matrix->fixed[node];
  }
  SpringGraph graph() const {
    if (model != nullptr)
      return spring_graph(*model);
    return {matrix->start, matrix->node, matrix->at, matrix->axes};
  }
};

inline const FreeAxes& free_axes(const Source& k, std::uint32_t node) {
  return all_free_axes[k.fixed(node) & 7U];
}

/// What a front does to a load that is carried along.
struct FrontLoad {
  std::vector<double> load;   ///< on its own rows
  std::vector<double> values; ///< L⁻¹ of it there, and what the rows below get
  bool current = false;       ///< of L as it is, and with what its children leave now
};

} // namespace frontal

struct FrontalFactor::State {
  using Source = frontal::Source;

  cholesky::FrontTree tree;
  std::vector<cholesky::Front> fronts;
  std::vector<cholesky::FrontMemory> memory; // of L of each front
  cholesky::FrontalWork work;
  CpuLevel cpu = CpuLevel::baseline;

  // Of the model as it was factorised, to tell what changed.
  SpringGraph graph;
  std::vector<model::Spring> springs;
  std::vector<Vec3> position;
  std::vector<std::uint8_t> fixed;

  // L in the solver's layout.
  cholesky::FrontBlocks blocks;
  std::vector<const double*> values; // of each block
  std::vector<std::uint32_t> axis_of_row;
  std::vector<std::uint32_t> row_of_node; // the first of its axes, or none
  std::vector<std::uint32_t> to_root;     // rows eliminated by a front and all above it
  std::size_t entries = 0;
  double weakest = 1;
  std::size_t weakest_row = 0;

  std::vector<frontal::FrontLoad> loads; // of each front, or none: no load is carried

  /// The rows of the nodes that a front eliminates.
  void assemble(const Source& k, const cholesky::FrontAssembly& to) const;

  /// Each block between two nodes of the front comes once.
  void add_blocks(const Source& k, const cholesky::FrontAssembly& to,
                  std::vector<SymmetricBlock>& diagonals) const;

  /// Springs of the nodes that a front eliminates; each spring between two of them comes once.
  void add_springs(const Source& k, const cholesky::FrontAssembly& to,
                   std::vector<SymmetricBlock>& diagonals) const;

  std::size_t axis_at(const Source& k, std::size_t f, std::size_t row) const;

  /// Computes the fronts f with selected[f] != 0, or all where it is empty.
  void factorise(const Source& k, std::span<const char> selected, const Context& context);

  void lay_out(const Source& k);

  SupernodalArrays arrays() const;

  /// The first of the rows of L that a front eliminates.
  std::size_t first_row(std::size_t front) const;

  std::uint32_t front_of_node(std::uint32_t node) const;

  void find_weakest();

  void remember(const Source& k);

  /// Starts again: finds an elimination order and computes all fronts.
  void begin(const Source& k, const Context& context);
  /// Computes all fronts of this tree.
  void begin(const Source& k, cholesky::FrontTree with, const Context& context);

  // ---- a load that is carried along, see FrontalFactor::carry

  std::size_t carry(std::span<const double> over_axes);

  /// L⁻¹ of what a front has in its values. \param row 0, 1, 2 …: as many as it has rows
  void forward(std::size_t front, std::span<const std::int64_t> row, std::span<double> space);

  /// The rows of L that a front has, its own first.
  std::span<const std::int64_t> rows_of(std::size_t front) const;

  // ---- changes

  /// Whether each node is held along the axes along which it was.
  bool held_alike(const Source& k, std::span<const std::uint32_t> origin,
                  std::span<const std::uint32_t> place) const;

  /// By node: whether its row of K is other than it was, its neighbours' numbers aside. Both lists
  /// of springs ascend alike where nodes keep their order, so one pass finds what differs; in
  /// another order more of them seem changed than are.
  std::vector<char> changed_rows(const model::Model& model, std::span<const std::uint32_t> origin,
                                 std::span<const std::uint32_t> place) const;

  /// Whether the tree serves this graph too: the same nodes free, and no spring where none was.
  bool still_fits(const SpringGraph& now, std::span<const std::uint32_t> place) const;

  /// By node of the later graph: in which of the present fronts it is eliminated. A copy that has
  /// neighbours in one branch below its origin's front alone goes down into that: it separates
  /// nothing there.
  std::vector<std::uint32_t> fronts_for(const SpringGraph& now,
                                        std::span<const std::uint32_t> origin,
                                        std::span<const std::uint32_t> place) const;

  /// The order of elimination before, with what came since. A copy is eliminated right behind what
  /// it is a copy of, so that it fills as that does, or at the end of the front it goes down into.
  std::vector<std::uint32_t> order_for(const SpringGraph& now,
                                       std::span<const std::uint32_t> origin,
                                       std::span<const std::uint32_t> place) const;

  /// \param rows that are others, of a matrix
  void refactor(const Source& k, std::span<const std::uint32_t> origin,
                std::span<const std::uint32_t> place, std::span<const std::uint32_t> rows,
                const Context& context);

  /// The tree of this order, with the fronts that are as they were. \return which are not
  std::vector<char> grow(std::span<const std::uint32_t> order, const std::vector<char>& changed,
                         std::span<const std::uint32_t> place);
};

} // namespace gewebe::linalg
