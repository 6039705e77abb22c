#pragma once
// The stiffness store, an HDF5 file with one group per object; stiffness_store(5).

#include "base/columns.h"
#include "formats/stream.h"
#include "model/model.h"
#include "sim/factor.h"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace gewebe {

/// What one says of an object's stiffness, beside the arrays.
struct StiffnessFacts {
  std::string object;      ///< the model's name: the group
  std::uint64_t hash = 0;  ///< stiffness_hash of the model
  std::uint64_t nodes = 0; ///< n, central nodes too
  double norm = 0;         ///< ‖K‖₁
  double condition = 0;    ///< estimate of cond₁(K)
  double residual = 0;     ///< largest backward error seen of the checks made
  bool single = false;     ///< columns are float32
};

/// XXH3-64 of what K and gravity depend on: nodes, springs, constraints, materials.
std::uint64_t stiffness_hash(const Model& model);

/// Opens and checks a store for reading; columns are read when asked for.
class StiffnessStore {
public:
  /// \throw Error, place = path: missing, no HDF5, no store, truncated, of a newer version, damaged
  explicit StiffnessStore(const std::string& path);
  ~StiffnessStore();
  StiffnessStore(StiffnessStore&&) noexcept;

  const std::string& path() const;
  std::vector<std::string> objects() const;
  /// The object that belongs to this model, by hash. \throw Error "is of another model …"
  StiffnessFacts facts(const Model& model) const;
  Factor factor(const StiffnessFacts& facts) const;
  /// Null where the object has none.
  std::unique_ptr<ColumnSource> columns(const StiffnessFacts& facts) const;

private:
  struct State;
  std::unique_ptr<State> state_;
};

} // namespace gewebe
