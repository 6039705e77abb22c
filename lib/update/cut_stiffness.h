#pragma once
// Stiffness of an object that is cut repeatedly. After each cut the cheapest method updates the
// factor, so that solutions stay exact. Stored columns of the uncut net remain in use. A solid's
// factor is refactored in part, after K was assembled again for the nodes of changed elements.
// A copy made before a cut stays that of the model before (update/followed_factor.h).

#include "base/context.h"
#include "compliance/compliance_source.h"
#include "linalg/frontal_factor.h"
#include "model/model.h"
#include "update/followed_factor.h"
#include "update/woodbury.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace gewebe::update {

/// Method that updates the stiffness after a cut.
enum class CutWay : std::uint8_t {
  woodbury, ///< the factor stays, its solutions are corrected (Sherman–Morrison–Woodbury)
  refactor, ///< partial refactorisation: the fronts that the cut affects are computed again
  fresh,    ///< all fronts are computed again
};

/// Work of an update.
struct CutWork {
  CutWay way = CutWay::fresh;
  bool unprepared = false;      ///< the previous model had to be factorised first
  std::size_t rank = 0;         ///< for Woodbury, all cuts since the factor counted
  cholesky::FrontalWork factor; ///< of refactor and fresh
};

/// Factor of a model and its cuts.
class CutStiffness {
public:
  /// Starts with a model that has not been cut.
  /// \param source  of its compliance, whose columns remain in use; or null
  CutStiffness(std::shared_ptr<const model::Model> first,
               std::shared_ptr<const compliance::ComplianceSource> source, const Context& context);

  /// Factorises the present model in advance of the next cut. \throw as FrontalFactor
  void prepare();

  /// Updates the stiffness to the model after the next cut; see CutModel for origin and place. The
  /// choice of the method depends on the models only, so that repeated runs are the same to the
  /// bit.
  /// \param way  the method; empty: the cheapest
  /// \throw SingularStiffness that names the free nodes; as FrontalFactor. The object is then
  /// unusable, its copies are not
  CutWork cut(std::shared_ptr<const model::Model> next, std::span<const std::uint32_t> origin,
              std::span<const std::uint32_t> place, std::optional<CutWay> way = {});

  /// Compliance of the present model.
  /// \pre cut() or prepare() was called
  std::shared_ptr<compliance::ComplianceSource> compliance() const;

private:
  bool woodbury_pays(std::size_t rank) const;
  AxesSolve solver() const;
  void require_condition();
  void factorise(const std::function<std::shared_ptr<const FollowedFactor>()>& work);
  std::shared_ptr<const model::Model> first_, now_;
  std::shared_ptr<const compliance::ComplianceSource> source_;
  Context context_;
  std::vector<std::uint32_t> first_origin_, first_place_; ///< from first_ to now_
  std::vector<std::uint32_t> origin_, place_;             ///< from the factor's model to now_
  std::shared_ptr<const FollowedFactor> factor_;          ///< null: none yet
  std::shared_ptr<const WoodburySolver> woodbury_;
  double fresh_operations_ = 0; ///< of the last factor with an order of its own
  double reached_ = 0;          ///< operations of the last refactorisation
  double accepted_pivot_ = 1;   ///< smallest pivot for which the condition was small enough
};

} // namespace gewebe::update
