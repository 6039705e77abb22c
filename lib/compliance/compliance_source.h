#pragma once
// What the compliance C = K⁻¹ of a model is had from: its springs alone, a factor, columns beside
// it, or what a cut made of them. Who has it says so by one of the functions below; who asks
// (compliance/compliance.h) does not see which it is.

#include "base/columns.h"
#include "base/context.h"
#include "model/model.h"
#include "solve/factor.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>

namespace gewebe {

class ForwardBlocks;

/// C at the axes of a node and of another, [axis][axis of the other].
using ComplianceBlock = std::array<std::array<double, 3>, 3>;

/// Serves one Compliance, from one thread at a time.
class ComplianceSource {
public:
  ComplianceSource() = default;
  ComplianceSource(const ComplianceSource&) = delete;
  ComplianceSource& operator=(const ComplianceSource&) = delete;
  virtual ~ComplianceSource() = default;

  /// Comes before any solve. Keeps a reference to the model. \pre it is that of this source
  /// \throw Error as factorise_axes, where nothing was made beforehand
  virtual void open(const Model& model, const Context& context) = 0;
  /// As AxisSolver::solve. What was made beforehand is loaded by the first call. \throw as that
  virtual void solve(std::span<double> over_axes, std::size_t columns) = 0;
  /// Doubles that a solve reads twice for a right-hand side: an estimate before the first one.
  virtual std::size_t entries() const = 0;
  /// How often K was factorised or its factor loaded.
  virtual std::uint64_t factors() const { return 0; }
  /// Columns of some nodes or of all, or null. They may be read without open.
  virtual const ColumnSource* columns() const { return nullptr; }
  /// Blocks between nodes for less than their columns cost, or null.
  virtual ForwardBlocks* blocks() { return nullptr; }
};

/// What was computed beforehand and kept. The factor is asked for when first needed, once.
struct StoredStiffness {
  std::unique_ptr<ColumnSource> columns; ///< null: of no node
  std::function<Factor()> factor;
};

/// K is factorised when the source is opened.
std::shared_ptr<ComplianceSource> compliance_of_model();
/// With a factor of K, asked for when first needed. \pre factor
std::shared_ptr<ComplianceSource> compliance_of_factor(std::function<Factor()> factor);
/// With columns too. \pre stored.factor
std::shared_ptr<ComplianceSource> compliance_of_store(StoredStiffness stored);

} // namespace gewebe
