#pragma once
// Makes a stiffness store; stiffness_store(5).

#include "columns/column_compression.h"
#include "columns/columns.h"
#include "formats/store/stiffness_store.h"
#include "formats/stream/stream.h"
#include "linalg/factor.h"
#include "linalg/stiffness.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace gewebe::formats {

/// Bytes of the columns of so many nodes with rows for `row_nodes`, and of their bounds.
double stored_columns_bytes(std::size_t nodes, std::size_t row_nodes, bool single);

/// Bytes of a store: what its arrays take. `nodes` columns are requested, with rows for the first
/// `row_nodes` nodes, or for all if there are fewer.
double stiffness_store_bytes(const linalg::StiffnessMatrix& matrix, const linalg::Factor& factor,
                             std::size_t nodes, bool single, std::size_t row_nodes = SIZE_MAX);

/// Writes a store, object by object: matrix and factor at once, columns as they come.
///
/// Where the output is a part (Output::Options::part) finished columns are kept whatever ends the
/// program: they stand in FILE.part at the places that they will have in the store, and
/// FILE.part.log says which. A writer that meets them takes up those whose checksums hold; all else
/// is made again in a nameless file beside, and copied to FILE.part by `close`, so that a store
/// made in several goes has the bytes of one made in one.
class StiffnessStoreWriter final : public columns::ColumnSink {
public:
  /// `output`, which must outlive this, is committed by the caller after `close`.
  /// \throw Error, place = name of the output, if that is no file or can't be written; place = its
  /// journal if that is damaged
  explicit StiffnessStoreWriter(Output& output, const StoreShard& shard = {});
  ~StiffnessStoreWriter() override;

  /// Begins an object. `facts.group` may be empty: it follows from the name. `nodes`, ascending,
  /// are those that shall have columns; none makes an object without columns, and where they will
  /// come compressed, room for them is taken later. Returns those of them
  /// whose columns are still to come: all, or what FILE.part doesn't hold. \throw Error too if the
  /// disk has no room, the group is there already, or FILE.part is of another model or was begun
  /// with other options
  std::vector<std::uint32_t> begin(const StiffnessFacts& facts,
                                   const linalg::StiffnessMatrix& matrix,
                                   const linalg::Factor& factor,
                                   std::span<const std::uint32_t> nodes);
  /// k counts what begin() returned. \throw Error too if a number doesn't fit float32
  void write(std::size_t k, std::span<const double> columns, double residual) override;
  /// Columns of an object for which facts.compressed was set. Neither FILE.part nor its journal
  /// know of them.
  void write_compressed(const columns::CompressedMade& columns);
  /// After an object's last column; `residual` is the largest backward error of all other checks
  /// made. Returns the largest of all.
  double end(double residual);
  /// After the last object.
  void close();
  /// After the output was committed.
  void remove_journal();

  /// Nodes whose columns were taken up, of all objects so far; and those of the object last begun
  /// whose columns stood there but were damaged.
  std::uint64_t kept() const;
  const std::vector<std::uint32_t>& damaged() const;

  /// XXH3-64 of K, L and the digests of each node's columns of all objects, decoded, in order; and
  /// of the K alone, which are the same on any machine.
  std::uint64_t digest() const;
  std::uint64_t matrix_digest() const;

private:
  struct State;
  std::unique_ptr<State> state_;
};

} // namespace gewebe::formats
