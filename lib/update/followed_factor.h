#pragma once
// Factor of K of an object that is cut repeatedly. Each cut changes it in place, by a partial
// refactorisation. Factors of earlier models stay usable: an earlier one that is read again is
// computed again with the tree that it had, which gives the same bits.

#include "base/context.h"
#include "linalg/frontal_factor.h"
#include "model/model.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

namespace gewebe::update {

/// Factor of one model. All that follow from one another share one place in memory.
class FollowedFactor {
public:
  /// Factor with a tree of its own. \throw as FrontalFactor
  FollowedFactor(std::shared_ptr<const model::Model> model, const Context& context);

  /// Factor of the next model, in the place of this one. \param origin, place  as CutModel
  /// \throw as FrontalFactor
  std::shared_ptr<const FollowedFactor> follow(std::shared_ptr<const model::Model> next,
                                               std::span<const std::uint32_t> origin,
                                               std::span<const std::uint32_t> place,
                                               const Context& context) const;

  /// Safe from many threads at once. It is valid until another factor of the same place is read.
  /// \throw as FrontalFactor
  linalg::FrontalFactor& factor() const;
  const model::Model& model() const noexcept { return *model_; }
  const cholesky::FrontalWork& work() const noexcept { return work_; } ///< of its first computation
  std::size_t entries() const noexcept { return entries_; }
  std::size_t axes() const noexcept { return 3 * model_->nodes.size(); }
  double norm() const noexcept { return norm_; } ///< bound of ‖K‖₁

private:
  struct Place;
  FollowedFactor() = default;
  void note();

  std::shared_ptr<Place> at_;
  std::shared_ptr<const model::Model> model_;
  cholesky::FrontTree tree_;
  Context context_;
  std::uint64_t number_ = 0; ///< see base/unique_number.h
  cholesky::FrontalWork work_{};
  std::size_t entries_ = 0;
  double norm_ = 0;
};

} // namespace gewebe::update
