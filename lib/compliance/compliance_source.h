#pragma once
// Source of the compliance C = K⁻¹ of a model: its springs, a factor, stored columns with a factor,
// or a correction of these after a cut. The functions below create sources. Their user
// (compliance/compliance.h) is the same for all.

#include "base/context.h"
#include "columns/columns.h"
#include "linalg/factor.h"
#include "model/model.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>

namespace gewebe::compliance {

class ForwardBlocks;

/// C at the axes of a node and of another, [axis][axis of the other].
using ComplianceBlock = std::array<std::array<double, 3>, 3>;

/// Source of one Compliance. It is used from one thread at a time.
class ComplianceSource {
public:
  ComplianceSource() = default;
  ComplianceSource(const ComplianceSource&) = delete;
  ComplianceSource& operator=(const ComplianceSource&) = delete;
  virtual ~ComplianceSource() = default;

  /// To be called before any solve. Keeps a reference to the model. \pre it is that of this source
  /// \throw Error as factorise_axes, if no factor was made beforehand
  virtual void open(const model::Model& model, const Context& context) = 0;
  /// As AxisSolver::solve. The first call loads a factor that was made beforehand.
  /// \throw as AxisSolver::solve
  virtual void solve(std::span<double> over_axes, std::size_t columns) = 0;
  /// Number of doubles that a solve reads twice for a right-hand side. Before the first solve it is
  /// an estimate.
  virtual std::size_t entries() const = 0;
  /// Number of times that K was factorised or its factor loaded.
  virtual std::uint64_t factors() const { return 0; }
  /// Columns of some nodes or of all, or null. They may be read without open.
  virtual const columns::ColumnSource* columns() const { return nullptr; }
  /// Whether work that is done once has been done, on which costs, and so choices, depend. A
  /// rollback restores it; the work stays done.
  virtual bool is_warm() const = 0;
  virtual void set_warm(bool warm) = 0;
  /// Source of blocks between nodes that costs less than their columns, or null.
  virtual ForwardBlocks* blocks() { return nullptr; }
};

/// Precomputed columns and factor of a model.
struct StoredStiffness {
  std::unique_ptr<columns::ColumnSource> columns; ///< null: of no node
  std::function<linalg::Factor()> factor;         ///< called once, when the factor is first needed
};

/// Source without stored data: K is factorised when the source is opened.
std::shared_ptr<ComplianceSource> compliance_of_model();
/// Source with a factor of K. \param factor  called when the factor is first needed; not empty
std::shared_ptr<ComplianceSource> compliance_of_factor(std::function<linalg::Factor()> factor);
/// Source with columns and a factor. \pre stored.factor is not empty
std::shared_ptr<ComplianceSource> compliance_of_store(StoredStiffness stored);

} // namespace gewebe::compliance
