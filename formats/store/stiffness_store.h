#pragma once
// The stiffness store, an HDF5 file with one group per object; stiffness_store(5). This header is
// what readers need.

#include "columns/columns.h"
#include "linalg/factor.h"
#include "model/model.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace gewebe::formats {

/// How columns were computed.
struct StiffnessMethod {
  std::string name = "direct"; ///< or "relax", "relax-fixed"
  double force = 0;            ///< of a relaxation, 1e-6 N; 0: each pull its own
  double threshold = 0;        ///< of "relax", of speeds
  std::uint64_t steps = 0;     ///< of "relax-fixed"

  bool operator==(const StiffnessMethod&) const = default;
};

/// Attributes of an object's stiffness in a store.
struct StiffnessFacts {
  std::string object;      ///< the model's name
  std::string group;       ///< what the store calls it
  std::uint64_t hash = 0;  ///< stiffness_hash of the model
  std::uint64_t rest = 0;  ///< rest_hash of it
  std::uint64_t nodes = 0; ///< n, central nodes too
  std::uint64_t order = 0; ///< of K
  double norm = 0;         ///< ‖K‖₁
  double condition = 0;    ///< estimate of cond₁(K)
  double residual = 0;     ///< largest backward error seen of the checks made
  bool single = false;     ///< columns are float32
  double compressed = 0;   ///< what entries of compressed columns may be wrong by, over the largest
  /// m: columns have rows for the first so many nodes; 0: for all n
  std::uint64_t row_nodes = 0;
  StiffnessMethod method{};
};

/// m, of all n nodes where none are left out.
inline std::uint64_t rows_of(const StiffnessFacts& facts) {
  return facts.row_nodes == 0 ? facts.nodes : facts.row_nodes;
}

/// Which part of the whole a store holds: number `index` of `count`, from 1.
struct StoreShard {
  std::uint64_t index = 1, count = 1;
};

/// How much of an object stands in the store; nothing of it has to be read for that.
struct StiffnessSizes {
  std::uint64_t matrix = 0;  ///< numbers in the lower triangle of K
  std::uint64_t factor = 0;  ///< numbers in L
  std::uint64_t touched = 0; ///< nodes with columns
  std::uint64_t column_bytes = 0;
};

/// XXH3-64 of what K and gravity depend on: rest positions, masses and constraints of the nodes,
/// stiffness and rest length of the springs, nodes and elasticity and density of the tetrahedra.
/// Neither names nor damping count.
std::uint64_t stiffness_hash(const model::Model& model);

/// XXH3-64 of rest positions and constraints of the nodes: what the two stages of an object share.
std::uint64_t rest_hash(const model::Model& model);

/// Where a store keeps the second stage of an object: OBJECT/stage2.
std::string second_stage_group(const std::string& group);

/// Opens and checks a store for reading; factors and columns are read on demand, and their
/// checksums compared. Not to be used from several threads at once, nor beside another HDF5 file.
class StiffnessStore {
public:
  /// \throw Error, place = path: missing, no HDF5, no store, truncated, of a newer version, damaged
  explicit StiffnessStore(const std::string& path);
  /// One that stands in memory; `name` is what messages call it.
  StiffnessStore(std::span<const std::uint8_t> bytes, const std::string& name);
  ~StiffnessStore();
  StiffnessStore(StiffnessStore&&) noexcept;
  StiffnessStore& operator=(StiffnessStore&&) noexcept;

  const std::string& path() const;
  /// Groups, in order of the alphabet.
  std::vector<std::string> objects() const;
  /// \throw Error if there is no such group, or what it says contradicts itself
  StiffnessFacts facts(const std::string& group) const;
  /// The object that belongs to this model, by hash. \throw Error "is of another model …"
  StiffnessFacts facts(const model::Model& model) const;
  /// The second matrix of an object, stored with it, for the two-step method; or nothing.
  std::optional<StiffnessFacts> second_stage(const StiffnessFacts& facts) const;
  StoreShard shard() const;
  StiffnessSizes sizes(const StiffnessFacts& facts) const;
  /// The matrix itself. \throw Error if it is damaged
  linalg::StiffnessMatrix matrix(const StiffnessFacts& facts) const;
  /// Its order is facts.order. \throw Error if it is damaged
  linalg::Factor factor(const StiffnessFacts& facts) const;
  /// Null where the object has none. They may outlive the store. Those that are compressed are read
  /// chunk by chunk. \throw Error if they are damaged
  std::unique_ptr<columns::ColumnSource> columns(const StiffnessFacts& facts) const;

private:
  struct State;
  std::shared_ptr<State> state_;
};

} // namespace gewebe::formats
