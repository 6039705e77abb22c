#pragma once
// Interfaces to read and to write dense columns of a compliance matrix C = K⁻¹, node by node. They
// separate the computation of columns from their storage: formats/store implements both over HDF5,
// lib/columns and lib/compliance use them.
//
// The columns of a node are three rows of 3m doubles: entry [axis][3 i + a] is the displacement
// (mm) of node i along a under a unit force (1e-6 N) along `axis` at that node; 0 where either axis
// is fixed. m is n, or less if the inner nodes of a solid, which come last, are left out. Columns
// of surface nodes are then the surface's block of K⁻¹, the inverse of the stiffness condensed to
// the surface (Bro-Nielsen 1998; report eq. 3.3).

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::columns {

class CompressedColumns;

/// Bound of the error of entries, beside their rounding; 0 if rounding is the only error.
struct EntryBound {
  double relative = 0; ///< requested bound, over the largest entry of C
  double entry = 0;    ///< bound of an entry, mm for 1e-6 N
};

/// Source of columns.
class ColumnSource {
public:
  ColumnSource() = default;
  ColumnSource(const ColumnSource&) = delete;
  ColumnSource& operator=(const ColumnSource&) = delete;
  virtual ~ColumnSource() = default;

  /// n: number of all nodes of the model.
  virtual std::size_t node_count() const = 0;
  /// m: number of nodes that columns have rows for; these nodes come first.
  virtual std::size_t row_nodes() const { return node_count(); }
  /// The nodes that have columns, ascending, below row_nodes().
  virtual const std::vector<std::uint32_t>& nodes() const = 0;
  /// Whether reading the columns of `count` nodes is cheaper than solving for them.
  virtual bool pays(std::size_t count) const { return count > 0; }
  /// Reads the columns of nodes()[k]. \pre out.size() == 9 m
  /// \throw Error if they can't be read or are damaged
  virtual void read(std::size_t k, std::span<double> out) const = 0;
  /// This object, if it computes sums and entries without whole columns; else null.
  virtual const CompressedColumns* compressed() const { return nullptr; }
  virtual EntryBound bound() const { return {}; }
  /// Whether columns are stored as float32, so that read_single loses no precision.
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

/// Destination of columns.
class ColumnSink {
public:
  ColumnSink() = default;
  ColumnSink(const ColumnSink&) = delete;
  ColumnSink& operator=(const ColumnSink&) = delete;
  virtual ~ColumnSink() = default;

  /// Writes the columns of the k-th requested node; k ascends by one from call to call. `residual`
  /// is the backward error of the check that they took part in. \pre columns.size() == 9 m
  /// \throw Error if they can't be written
  virtual void write(std::size_t k, std::span<const double> columns, double residual) = 0;
};

} // namespace gewebe::columns
