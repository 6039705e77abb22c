#pragma once
// An elastostatic object as what gives way to contact: linear, so that one solution is that for any
// forces.

#include "contact/load.h"
#include "statics/elastostatic.h"
#include "statics/static_contact.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <utility>

namespace gewebe {

class ElastostaticYielding final : public Yielding {
public:
  /// Keeps a reference to the load. \param solver asked for when needed \param last what pushed
  /// before, until the first push
  ElastostaticYielding(std::function<Elastostatic&()> solver, const Load& load,
                       std::span<const NodeTouch> last = {});

  DelassusOperator delassus_operator(std::span<const std::uint32_t> nodes) override;
  bool push(std::span<const NodeTouch> touches, std::span<const Vec3> at) override;
  std::span<const double> shape() override;
  std::optional<NodeReach> reach() override;
  void keep_shape() override { kept_ = acting(); }
  void copy_shape(std::span<const std::uint32_t> nodes, std::span<double> shape,
                  Moment moment) override;
  /// All that acts in the shape before the first push, where some of that will be asked for.
  void set_before(std::shared_ptr<const Load> load) { before_ = std::move(load); }
  /// All that acts in the shape as it is.
  std::shared_ptr<const Load> acting() const { return before_ ? before_ : pushed_; }

private:
  std::function<Elastostatic&()> solver_;
  const Load& load_;
  std::shared_ptr<const Load> pushed_;
  std::shared_ptr<const Load> before_; ///< until the first push
  std::shared_ptr<const Load> kept_;
  bool updated_ = false; ///< by reach, to what is pushed: updates are counted
};

} // namespace gewebe
