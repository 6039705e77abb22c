#pragma once
// An elastostatic object as what gives way to contact: linear, so that one solution is that for any
// forces.

#include "contact/load.h"
#include "statics/elastostatic.h"
#include "statics/static_contact.h"

#include <cstdint>
#include <functional>
#include <span>

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

private:
  std::function<Elastostatic&()> solver_;
  const Load& load_;
  Load pushed_;
};

} // namespace gewebe
