#include "compliance/compliance_source.h"

#include "columns/costs.h"
#include "compliance/axis_solver.h"

#include <optional>
#include <utility>

namespace gewebe::compliance {

namespace {

/// One factor; of the model where none was made beforehand.
class FactorSource final : public ComplianceSource {
public:
  explicit FactorSource(StoredStiffness stored) : stored_(std::move(stored)) {}

  void open(const model::Model& model, const Context& context) override {
    model_ = &model;
    if (stored_.factor)
      return;
    ++factors_;
    solver_.emplace(factorise_axes(model, context));
    warm_ = true;
  }
  void solve(std::span<double> over_axes, std::size_t columns) override {
    if (!solver_) {
      ++factors_;
      solver_.emplace(stored_axes(*model_, stored_.factor()));
    }
    warm_ = true;
    solver_->solve(over_axes, columns);
  }
  std::size_t entries() const override {
    return warm_ ? solver_->factor.entries()
                 : columns::costs::usual_entries(3 * model_->nodes.size());
  }
  std::uint64_t factors() const override { return factors_; }
  const columns::ColumnSource* columns() const override { return stored_.columns.get(); }
  bool is_warm() const override { return warm_; }
  void set_warm(bool warm) override { warm_ = warm; }

private:
  StoredStiffness stored_;
  const model::Model* model_ = nullptr;
  std::optional<AxisSolver> solver_;
  bool warm_ = false; ///< it counts as loaded
  std::uint64_t factors_ = 0;
};

} // namespace

std::shared_ptr<ComplianceSource> compliance_of_model() {
  return std::make_shared<FactorSource>(StoredStiffness{});
}

std::shared_ptr<ComplianceSource> compliance_of_factor(std::function<linalg::Factor()> factor) {
  return std::make_shared<FactorSource>(StoredStiffness{nullptr, std::move(factor)});
}

std::shared_ptr<ComplianceSource> compliance_of_store(StoredStiffness stored) {
  return std::make_shared<FactorSource>(std::move(stored));
}

} // namespace gewebe::compliance
