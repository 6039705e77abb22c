#pragma once
// Dense columns of a compliance matrix C = K⁻¹, node by node: who makes them and who keeps them
// know nothing of each other. formats/store implements both interfaces over HDF5, lib/compliance
// uses them.
//
// The columns of a node are three rows of 3m doubles: entry [axis][3 i + a] is the displacement
// (mm) of node i along a under a unit force (1e-6 N) along `axis` at that node; 0 where either axis
// is fixed. m is n, or less where the last nodes are left out: those inside a solid, whose surface
// alone touches anything. Columns of surface nodes are then the surface's block of K⁻¹, the inverse
// of the stiffness condensed to it (Bro-Nielsen 1998; report eq. 3.3).

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe {

class CompressedColumns;

/// What entries may be wrong by beside their rounding; 0 where that is all.
struct EntryBound {
  double relative = 0; ///< what was asked for, over the largest entry of C
  double entry = 0;    ///< mm for 1e-6 N
};

class ColumnSource {
public:
  ColumnSource() = default;
  ColumnSource(const ColumnSource&) = delete;
  ColumnSource& operator=(const ColumnSource&) = delete;
  virtual ~ColumnSource() = default;

  /// n, of all nodes of the model.
  virtual std::size_t node_count() const = 0;
  /// m: the first so many nodes are those that columns have rows for.
  virtual std::size_t row_nodes() const { return node_count(); }
  /// The nodes that have columns, ascending, below row_nodes().
  virtual const std::vector<std::uint32_t>& nodes() const = 0;
  /// Whether to read those of so many nodes is cheaper than to solve for them.
  virtual bool pays(std::size_t count) const { return count > 0; }
  /// Reads the columns of nodes()[k]. \pre out.size() == 9 m \throw Error if they can't be read or
  /// are damaged
  virtual void read(std::size_t k, std::span<double> out) const = 0;
  /// Themselves, if sums and entries of them come for less than whole columns; or null.
  virtual const CompressedColumns* compressed() const { return nullptr; }
  virtual EntryBound bound() const { return {}; }
  /// Whether they are kept as float32, so that nothing is lost by read_single.
  virtual bool single() const { return false; }
  /// As read. \pre single()
  virtual void read_single(std::size_t k, std::span<float> out) const;
};

inline void ColumnSource::read_single(std::size_t k, std::span<float> out) const {
  std::vector<double> wide(out.size());
  read(k, wide);
  for (std::size_t r = 0; r < out.size(); ++r)
    out[r] = static_cast<float>(wide[r]);
}

class ColumnSink {
public:
  ColumnSink() = default;
  ColumnSink(const ColumnSink&) = delete;
  ColumnSink& operator=(const ColumnSink&) = delete;
  virtual ~ColumnSink() = default;

  /// Takes the columns of the k-th node asked for; k ascends by one from call to call. `residual`
  /// is the backward error of the check that they took part in. \pre columns.size() == 9 m \throw
  /// Error if they can't be written
  virtual void write(std::size_t k, std::span<const double> columns, double residual) = 0;
};

} // namespace gewebe
