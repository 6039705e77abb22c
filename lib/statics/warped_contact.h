#pragma once
// What gives way to instruments with large rotations: solved as if it were linear around the last
// answer, until the warped shape stands where that puts its nodes.

#include "contact/load.h"
#include "model/model.h"
#include "statics/static_contact.h"
#include "statics/warped_statics.h"

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace gewebe {

class WarpedYielding final : public Yielding {
public:
  /// \param solver asked for when needed   \param load what acts beside instruments
  /// \param last what they pushed with before
  WarpedYielding(const Model& model, std::function<WarpedStatics&()> solver, const Load& load,
                 std::span<const NodeTouch> last);

  DelassusOperator delassus_operator(std::span<const std::uint32_t> nodes) override;
  bool push(std::span<const NodeTouch> touches, std::span<const Vec3> at) override;
  std::span<const double> shape() override;

  /// Whether all pushes so far ended where they should.
  bool solved() const noexcept { return solved_; }

private:
  const Model& model_;
  std::function<WarpedStatics&()> solver_;
  const Load& load_;
  Load pushed_;
  std::vector<std::uint32_t> nodes_;
  int rounds_ = 0; ///< since nodes joined
  bool solved_ = true;
};

} // namespace gewebe
