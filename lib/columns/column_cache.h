#pragma once
// Cache of columns of the compliance matrix C = K⁻¹ in memory, as many as fit, and sums of them.

#include "base/context.h"
#include "base/copy_on_write.h"
#include "columns/columns.h"
#include "columns/slot_pool.h"
#include "contact/load.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <vector>

namespace gewebe::columns {

/// Computes the columns of one to eight nodes: 9 m numbers each, node by node.
using ColumnSolve =
    std::function<void(std::span<const std::uint32_t> nodes, std::span<double> columns)>;

class ColumnCache {
public:
  struct Columns { ///< of a node, [axis][3 m]; one of both
    std::shared_ptr<double> wide{};
    std::shared_ptr<float> narrow{};
    std::vector<float> bound{}; ///< [axis][block], rounded up
  };
  /// Which columns are in memory, on which choices depend. Copies share the columns.
  struct Past {
    CopyOnWrite<std::vector<std::shared_ptr<const Columns>>> columns{}; ///< by node; null: absent
    CopyOnWrite<std::vector<std::uint64_t>> used{};                     ///< by node: when
    CopyOnWrite<std::map<std::uint32_t, std::shared_ptr<double>>> ahead{}; ///< see prepare()
    std::size_t count = 0;
    std::uint64_t clock = 0;
  };
  /// Creates a cache of columns with rows for the first m = `nodes` nodes.
  /// \param source  of stored columns, or null; kept by reference
  /// \param bytes  limit of columns in memory; those of two nodes always fit
  /// \param bounded  whether add() may be called with `allowed` > 0
  ColumnCache(std::size_t nodes, const ColumnSource* source, ColumnSolve solve, double bytes,
              bool bounded);

  /// Number of nodes whose columns fit in memory.
  std::size_t capacity() const noexcept { return capacity_; }
  bool stored(std::uint32_t node) const;
  bool resident(std::uint32_t node) const { return (*now_.columns)[node] != nullptr; }
  const Past& past() const noexcept { return now_; }
  void restore(const Past& past) { now_ = past; }
  std::uint64_t columns_read() const noexcept { return read_; }

  /// Brings columns to memory. If there is no room, the least recently used ones are dropped.
  /// \pre at most capacity() nodes   \throw Error if columns can't be read or solved for
  void need(std::span<const std::uint32_t> nodes);

  /// Solves, ahead of `need`, for columns that are neither stored nor resident. Only `need` uses
  /// these columns, and they are dropped before those that were needed.
  /// \throw Error if they do not all fit
  void prepare(std::span<const std::uint32_t> nodes);

  /// Entry of a row (axis 3 i + a) in the column of a node's axis. \pre the node is resident
  double entry(std::uint32_t node, int axis, std::size_t row) const;

  /// sum += C f for forces at resident nodes, in their order. The result is the same bytes for any
  /// number of threads. In each block of rows, contributions are left out whose bounds add up to at
  /// most `allowed` (mm).
  /// \return largest sum of bounds left out of a row
  /// \pre sum.size() == 3 m; allowed is 0 unless bounded
  double add(std::span<const contact::NodeVector> forces, double allowed, const Context& context,
             std::span<double> sum) const;

  /// Number of contributions of a node's column to a block of rows that sums took, or skipped, so
  /// far.
  std::uint64_t taken() const noexcept { return taken_; }
  std::uint64_t skipped() const noexcept { return skipped_; }

private:
  struct Term;
  void put(std::uint32_t node, Columns columns);
  void drop(std::uint32_t node);
  void make_room(std::size_t count);
  void
  solve_for(std::span<const std::uint32_t> nodes,
            const std::function<void(std::uint32_t node, std::shared_ptr<double> columns)>& take);

  std::size_t axes_ = 0; ///< 3 m
  const ColumnSource* source_ = nullptr;
  ColumnSolve solve_;
  bool bounded_ = false;
  std::size_t capacity_ = 0;
  std::shared_ptr<SlotPool<double>> wide_;
  std::shared_ptr<SlotPool<float>> narrow_;
  Past now_;
  std::uint64_t read_ = 0;
  mutable std::uint64_t taken_ = 0, skipped_ = 0;
};

} // namespace gewebe::columns
