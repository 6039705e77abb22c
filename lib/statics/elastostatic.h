#pragma once
// Elastostatic method (fast finite elements; Bro-Nielsen 1998, report 3.3.2, 3.3.3). The shape
// follows the load at once: u = C f with C = K⁻¹ of the model linearised at rest.
//
// Prescribed displacements d of m nodes: the block C_cc on their free axes gives the forces
// f_c = C_cc⁻¹ (d - u_c of all other loads). Its factor is updated when nodes join and leave. If
// columns are not available and nodes are many, these axes are held in K:
// K_ff u_f = f - K_fc d, f_c = K_cf u_f + K_cc d. Both ways are exact, and the cheaper one is used.
// Displaced nodes then stand at exactly d.
//
// Forces are computed first, the shape when it is first read. Earlier results are reused: a grasp
// that moves rigidly costs as much for a hundred nodes as for twelve.
//
// The stored columns of a solid may have rows for its surface only (columns/columns.h). Forces and
// the shape of the surface then cost as much as those of a net with as many nodes. One solve finds
// the displacements inside when the whole shape is first read.

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

namespace gewebe::columns {
struct NodeClusters;
} // namespace gewebe::columns

namespace gewebe::compliance {
class ComplianceSource;
} // namespace gewebe::compliance

namespace gewebe::statics {

/// Displacements of some nodes under forces on them: u = free + compliance f.
struct DelassusOperator {
  std::vector<std::uint32_t> nodes;
  std::vector<double> compliance; ///< (3 m)^2, by columns; row 3 k + a is axis a of nodes[k]
  std::vector<double> free;       ///< 3 m, under the load without these forces
};

/// Backward error of a shape: ‖Ku - f‖ / (‖K‖‖u‖ + ‖f‖). If the surface was computed by itself,
/// also its difference from that of the whole shape, over the largest entry.
struct ShapeError {
  double error = 0;
  /// Allowed error. A wrong solution has an error of 1; columns of float32 give 1e-7.
  /// Compressed columns add the largest error of an entry, from their bound and the shape's forces.
  double limit = 1e-6;
  double relative = 0; ///< requested error bound of compressed columns; 0: not compressed

  bool within() const noexcept { return error <= limit; }
  /// Whether the error over its limit is larger than that of `other`, or is NaN.
  bool worse_than(const ShapeError& other) const noexcept {
    return std::isnan(error) ||
           (!std::isnan(other.error) && error * other.limit > other.error * limit);
  }
};

/// Work and accuracy of an elastostatic object.
struct ElastostaticCounts {
  std::uint64_t updates = 0, unchanged = 0; ///< calls of update; those with the last load again
  std::uint64_t shapes = 0;                 ///< computed shapes
  std::uint64_t solves = 0;                 ///< right-hand sides solved with a factor
  std::uint64_t columns_read = 0;           ///< nodes whose columns were read
  std::uint64_t factors = 0;                ///< factors computed or loaded
  std::uint64_t terms = 0, skipped = 0; ///< products of columns and blocks of rows: added, left out
  double backward_error = 0;            ///< largest ShapeError::error, with measure_error
  ShapeError worst_shape;               ///< the one with the largest error over its limit
  double contact_error = 0; ///< largest error of a prescribed displacement, over the largest one
  std::uint64_t rounds = 0; ///< iterations with large rotations, see warped_statics.h
  double change = 0;        ///< largest change by a last iteration, over the largest entry
  double shape_error = 0; ///< largest effect of the tolerance on an entry, over the largest entry,
                          ///< with measure_error
};

struct ElastostaticOptions {
  /// Measures the backward error, and the effect of the tolerance, of every new shape and of those
  /// of verify(). Forces and shapes are the same to the bit with and without.
  bool measure_error = false;
  /// Number of displaced nodes up to which the block C_cc is used; by default the cheaper way.
  std::size_t block_limit = SIZE_MAX;
  /// Allowed error of an entry of rough_surface(), over the largest displacement. It lets blocks of
  /// rows be left out. The bound holds for the sum of all parts left out of a row. All other
  /// results are the same to the bit with any tolerance.
  double tolerance = 0;
  /// Allows a singular K. Loads whose displacements hold the model have a solution nevertheless.
  bool may_be_free = false;
};

/// Elastostatic solver of one model. It caches columns, factors and the last result.
class Elastostatic {
public:
  /// Keeps a reference to the model.
  /// \param source  of its compliance; null: K is factorised
  /// \pre check_model(model) passes; the source belongs to the model
  /// \throw Error as the factor: K singular (except with `may_be_free`), memory
  Elastostatic(const model::Model& model, std::shared_ptr<compliance::ComplianceSource> source,
               const Context& context, const ElastostaticOptions& options = {});
  ~Elastostatic();
  Elastostatic(Elastostatic&&) noexcept;

  /// What later results depend on, to the bit: running sums, factors that nodes have joined, which
  /// columns are in memory, the last result. Copies share it.
  struct Past;
  std::shared_ptr<const Past> past() const;
  /// Goes back. \pre a past of this object
  void restore(const Past& past);

  /// Computes the forces under `load`. Only changed parts are computed again; for the last load
  /// nothing is done. After an exception the previous load remains.
  /// \pre nodes exist, no displacement along an axis that the model holds
  /// \throw Error if columns can't be read, memory does not suffice, forces are not finite, or
  /// displacements are not met within 1e-6 of the largest
  /// \throw SingularStiffness if nothing holds the model
  void update(const contact::Load& load);

  /// Displacement of all nodes: 3 n numbers, mm. Displaced nodes have exactly their prescribed
  /// displacements. It is computed by the first call after an update.
  /// \throw Error as update, or if the shape is not finite
  std::span<const double> displacement();
  /// Displacement of the first m nodes, those that columns have rows for: 3 m numbers, all of the
  /// surface among them. If m is n, it is the same as displacement(). Else it does not depend on
  /// whether displacement() was called. \throw as displacement
  std::span<const double> surface_displacement();
  /// surface_displacement within the tolerance: for output, not for the state of a scene.
  std::span<const double> rough_surface();
  /// Measures the error of the shape if no caller has read the shape; else does nothing.
  void verify();

  /// Reactions of the displaced nodes, as Elastodynamic::contact_forces.
  const std::vector<contact::NodeVector>& contact_forces() const noexcept;

  /// Compliance between `node` and each of `rows`, with the nodes held that `load` displaces: the
  /// displacement of a row under a force on the node, row-major.
  /// \pre as update; none of these nodes is displaced by the load
  /// \throw Error as update, and if memory does not hold the node's columns
  void compliance_blocks(const contact::Load& load, std::uint32_t node,
                         std::span<const std::uint32_t> rows,
                         std::span<std::array<double, 9>> blocks);

  /// Number of the matrix that compliance_blocks uses for this load, see base/unique_number.h.
  std::uint64_t compliance_id(const contact::Load& load);
  /// Delassus operator of some nodes under a load.
  /// \pre as update; the load displaces nothing; nodes ascending
  /// \throw as compliance_blocks
  DelassusOperator delassus_operator(const contact::Load& load,
                                     std::span<const std::uint32_t> nodes);

  /// Clusters of neighbours among the first m nodes, see surface_displacement, where parts of a
  /// shape can be computed alone; else null. It does not change.
  const columns::NodeClusters* clusters() const noexcept;
  /// Displacement of the nodes of some clusters under forces, cluster by cluster: 3 numbers for
  /// each node. It neither uses nor changes the last load. \pre clusters(); forces at the first m
  /// nodes, ascending   \throw Error if columns can't be read
  std::vector<double> displacement_of_clusters(std::span<const std::uint32_t> clusters,
                                               std::span<const contact::NodeVector> forces);
  /// Bound of the length of these displacements, by cluster, mm. \pre as displacement_of_clusters
  std::vector<double> displacement_bounds(std::span<const contact::NodeVector> forces);

  /// Solves in advance for the columns of these nodes, unless they are stored, so that later
  /// contacts there need no solve. Updates, shapes and forces are the same to the bit with and
  /// without.
  /// \pre nodes exist, none twice
  /// \throw Error if memory does not hold them, or as update
  void prepare(std::span<const std::uint32_t> nodes);
  /// Reads all compressed columns of the source in advance, so that later contacts read none; else
  /// as prepare.
  void read_compressed();

  /// Whether K is singular, see ElastostaticOptions::may_be_free.
  bool is_free() const noexcept;
  ElastostaticCounts counts() const noexcept;

private:
  struct State;
  std::unique_ptr<State> state_;
};

} // namespace gewebe::statics
