#pragma once
// Makes a stiffness store; stiffness_store(5).

#include "base/columns.h"
#include "formats/stiffness_store.h"
#include "formats/stream.h"
#include "sim/factor.h"
#include "sim/stiffness.h"

#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace gewebe {

/// Bytes of a store: what its arrays take. `nodes` columns are wanted.
double stiffness_store_bytes(const StiffnessMatrix& matrix, const Factor& factor, std::size_t nodes,
                             bool single);

/// Writes a store, object by object: matrix and factor at once, columns as they come.
class StiffnessStoreWriter final : public ColumnSink {
public:
  /// `output`, which must outlive this, is committed by the caller after `close`.
  /// \throw Error, place = name of the output, if that is no file or can't be written
  explicit StiffnessStoreWriter(Output& output);
  ~StiffnessStoreWriter() override;

  /// Begins an object. `facts.group` may be empty: it follows from the name. `nodes`, ascending,
  /// are those whose columns will come; none makes an object without columns. \throw Error too if
  /// the disk has no room, or the group is there already
  void begin(const StiffnessFacts& facts, const StiffnessMatrix& matrix, const Factor& factor,
             std::span<const std::uint32_t> nodes);
  /// \throw Error too if a number doesn't fit float32
  void write(std::size_t k, std::span<const double> columns) override;
  /// After an object's last column; `residual` is the largest backward error of all checks made.
  void end(double residual);
  /// After the last object.
  void close();

  /// XXH3-64 of K, L and the columns of all objects, decoded, in order; and of the K alone, which
  /// are the same on any machine.
  std::uint64_t digest() const;
  std::uint64_t matrix_digest() const;

private:
  struct State;
  std::unique_ptr<State> state_;
};

} // namespace gewebe
