#pragma once
// Contact of an object under the two-step method: for a given s the answer to forces is linear (see
// two_step.h), its contacts are solved as those of one stage, and s is found so that s |f| = f0,
// the forces of contact among f. Below the threshold it is that of the first stage, to the bit.

#include "contact/load.h"
#include "model/model.h"
#include "statics/static_contact.h"
#include "statics/two_step.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

namespace gewebe {

class TwoStepYielding final : public Yielding {
public:
  using Stages = std::function<std::pair<Elastostatic&, TwoStep&>()>;
  /// Keeps references to all. \param stages the first, and both; asked for when needed
  TwoStepYielding(const Model& model, const Stages& stages, const Load& load)
      : model_(model), stages_(stages), load_(load), outer_(load) {
    outer_.displacement.clear();
  }

  DelassusOperator delassus_operator(std::span<const std::uint32_t> nodes) override;
  bool push(std::span<const NodeTouch> touches, std::span<const Vec3> at) override;
  std::span<const double> shape() override;
  /// Whether an s was found for all forces: with friction there may be none.
  bool solved() const noexcept { return solved_; }

private:
  DelassusOperator combined();
  std::vector<NodeVector> held_forces(std::span<const NodeTouch> touches);
  bool next(double value);

  const Model& model_;
  const Stages& stages_;
  const Load& load_;
  Load outer_;                           ///< without displacements
  std::vector<std::uint32_t> nodes_;     ///< of the last operator
  DelassusOperator one_, two_;           ///< of these and the displaced nodes, by stage
  std::vector<std::size_t> rows_, held_; ///< of `nodes_`, and of what is displaced, in them
  std::vector<double> of_free_;          ///< held forces without touches
  std::vector<double> of_touch_;         ///< what touches take from them, by columns
  double s_ = 1, low_ = 0, high_ = 1, low_value_ = 0, high_value_ = 0;
  int rounds_ = 0;
  bool scanning_ = true, solved_ = true;
};

} // namespace gewebe
