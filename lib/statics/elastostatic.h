#pragma once
// The elastostatic method (fast finite elements; Bro-Nielsen 1998, report 3.3.2, 3.3.3): the shape
// follows the load at once, u = C f with C = K⁻¹ of the model linearised at rest.
//
// Prescribed displacements d of m nodes: the block C_cc on their free axes gives the forces
// f_c = C_cc⁻¹ (d - u_c of all other loads); its factor follows the set as nodes join and leave.
// Where columns are not at hand and nodes are many: K with these axes held, K_ff u_f = f - K_fc d,
// f_c = K_cf u_f + K_cc d. Both are exact; which is cheaper decides. Displaced nodes then stand at
// exactly d.
//
// Forces come first, the shape when it is asked for. What was asked before is not asked again: a
// grasp that moves rigidly costs as much for a hundred nodes as for twelve.
//
// Of a solid whose stored columns have rows for its surface alone (base/columns.h), forces and the
// shape of the surface take what they take of a net of as many nodes; what is inside is found by
// one solve when the whole shape is asked for.

#include "base/context.h"
#include "contact/load.h"
#include "model/model.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace gewebe {

class ComplianceSource;

/// Displacements of some nodes under forces there: u = free + compliance f.
struct DelassusOperator {
  std::vector<std::uint32_t> nodes;
  std::vector<double> compliance; ///< (3 m)^2, by columns; row 3 k + a is axis a of nodes[k]
  std::vector<double> free;       ///< 3 m, under the load alone
};

/// How well a shape balances its forces: ‖Ku - f‖ / (‖K‖‖u‖ + ‖f‖), and by how much a surface that
/// is found alone differs from that of the whole shape, over the largest entry.
struct ShapeError {
  double error = 0;
  /// What it may be: a wrong solution has one of 1, columns of float32 give 1e-7. Compressed
  /// columns add what their bound lets an entry be wrong by under the forces of this shape.
  double limit = 1e-6;
  double relative = 0; ///< the bound that these columns were asked for; 0: they aren't compressed

  bool within() const noexcept { return error <= limit; }
  /// Whether it comes nearer to its limit than another, or is beyond it by more, or is NaN.
  bool worse_than(const ShapeError& other) const noexcept {
    return std::isnan(error) ||
           (!std::isnan(other.error) && error * other.limit > other.error * limit);
  }
};

/// How an elastostatic object came to its shapes.
struct ElastostaticCounts {
  std::uint64_t updates = 0, unchanged = 0; ///< asked for; answered without work
  std::uint64_t shapes = 0;                 ///< computed
  std::uint64_t solves = 0;                 ///< right-hand sides solved with a factor
  std::uint64_t columns_read = 0;           ///< nodes whose columns were read
  std::uint64_t factors = 0;                ///< factorised or loaded
  std::uint64_t terms = 0, skipped = 0;     ///< of columns and blocks of rows: added, left out
  double backward_error = 0; ///< largest ShapeError::error seen, where it was asked for
  ShapeError worst_shape;    ///< that which comes nearest to its limit
  double contact_error = 0;  ///< largest miss of a prescribed displacement, over the largest one
  std::uint64_t rounds = 0;  ///< of answers with large rotations, see warped_statics.h
  double change = 0;      ///< the largest that a last round of these made, over the largest entry
  double shape_error = 0; ///< largest effect of the tolerance on an entry, over the largest entry,
                          ///< where errors were asked for
};

struct ElastostaticOptions {
  /// Backward error, and effect of the tolerance, of every new shape, and of those of verify().
  /// Forces and shapes are the same to the bit with and without.
  bool measure_error = false;
  /// Displaced nodes up to which the block C_cc is used; by default what is cheaper.
  std::size_t block_limit = SIZE_MAX;
  /// How much of the largest displacement an entry of rough_surface() may be wrong by, so that
  /// blocks of rows need not be computed: the sum of what was left out of each row is bounded, not
  /// each part alone. All else is the same to the bit with any tolerance.
  double tolerance = 0;
  /// K may be singular: loads whose displacements hold the model have answers nevertheless.
  bool may_be_free = false;
};

class Elastostatic {
public:
  /// Keeps a reference to the model. \param source of its compliance; null: K is factorised
  /// \pre check_model(model) passes; the source belongs to it
  /// \throw Error as the factor: K singular (but for `may_be_free`), memory
  Elastostatic(const Model& model, std::shared_ptr<ComplianceSource> source, const Context& context,
               const ElastostaticOptions& options = {});
  ~Elastostatic();
  Elastostatic(Elastostatic&&) noexcept;

  /// The forces under `load`; nothing is done if it is the last one. Only what changed is computed
  /// again. \pre nodes exist, no displacement along an axis that the model holds
  /// \throw Error if columns can't be read, memory does not suffice, forces are not finite, or
  /// displacements are not met within 1e-6 of the largest; SingularStiffness if nothing holds the
  /// model; the load is the one before then
  void update(const Load& load);

  /// The shape: 3 n numbers, mm; exactly the prescribed ones at displaced nodes. Computed by the
  /// first call behind an update. \throw Error as update, or if the shape is not finite
  std::span<const double> displacement();
  /// Of the first m nodes, which columns have rows for: 3 m numbers, all of the surface among them.
  /// Where m is n the same as displacement(); else it doesn't depend on whether that was asked for.
  /// \throw as displacement
  std::span<const double> surface_displacement();
  /// The same within the tolerance: what is shown, but not what a scene goes on by.
  std::span<const double> rough_surface();
  /// Measures the error of the shape, where no caller has asked for it; else nothing.
  void verify();

  /// What holds the displaced nodes, as Elastodynamic::contact_forces.
  const std::vector<NodeVector>& contact_forces() const noexcept;

  /// Compliance between `node` and each of `rows`, the nodes that `load` displaces held: the
  /// displacement of a row under a force on the node, row-major. \pre as update; no node is
  /// displaced by the load   \throw Error as update, and if memory does not hold the node's columns
  void compliance_blocks(const Load& load, std::uint32_t node, std::span<const std::uint32_t> rows,
                         std::span<std::array<double, 9>> blocks);

  /// Number of the matrix that compliance_blocks has for this load, see base/unique_number.h.
  std::uint64_t compliance_id(const Load& load);
  /// \pre as update; the load displaces nothing; nodes ascending \throw as compliance_blocks
  DelassusOperator delassus_operator(const Load& load, std::span<const std::uint32_t> nodes);

  /// Solves for the columns of these nodes, unless they are stored, so that contacts there need
  /// not: updates, shapes and forces are the same to the bit with and without.
  /// \pre nodes exist, no other twice   \throw Error if memory does not hold them, or as update
  void prepare(std::span<const std::uint32_t> nodes);
  /// Reads all compressed columns that the source has, so that contacts wherever they are first
  /// need not; else as prepare.
  void read_compressed();

  /// K is singular, see ElastostaticOptions::may_be_free.
  bool is_free() const noexcept;
  ElastostaticCounts counts() const noexcept;

private:
  struct State;
  std::unique_ptr<State> state_;
};

} // namespace gewebe
