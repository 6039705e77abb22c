#pragma once
// The stiffness of an object that is cut again and again: whatever is cheapest keeps its solutions
// exact, and columns of a net as it came go on to serve. A solid's factor is refactored in part,
// after K was assembled anew for the nodes of the elements that the cut has changed.

#include "base/context.h"
#include "compliance/compliance_source.h"
#include "cutting/woodbury.h"
#include "model/model.h"
#include "solve/frontal_factor.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace gewebe {

/// How a cut was followed.
enum class CutWay : std::uint8_t {
  woodbury, ///< the factor stays, its solutions are corrected (Sherman–Morrison–Woodbury)
  refactor, ///< partial refactorisation: the fronts that the cut reaches are computed again
  fresh,    ///< everything is
};

struct CutWork {
  CutWay way = CutWay::fresh;
  bool unprepared = false; ///< the factor of the model before was made for it
  std::size_t rank = 0;    ///< for Woodbury, all cuts since the factor counted
  FrontalWork factor;      ///< of refactor and fresh
};

class CutStiffness {
public:
  /// Of a model that has not been cut. \param source of it, whose columns go on to serve, or null
  CutStiffness(std::shared_ptr<const Model> first, std::shared_ptr<const ComplianceSource> source,
               const Context& context);

  /// Factorises the present model, so that the next cut need not. \throw as FrontalFactor
  void prepare();

  /// Goes over to the model of the next cut; see CutModel for origin and place. Which way is taken
  /// depends on the models alone, so that a run repeated is the same to the bit. \param way to
  /// take; none: the cheapest
  /// \throw SingularStiffness naming what moves freely, and as FrontalFactor; nothing serves then
  CutWork cut(std::shared_ptr<const Model> next, std::span<const std::uint32_t> origin,
              std::span<const std::uint32_t> place, std::optional<CutWay> way = {});

  /// The compliance of the present model, which serves until the next cut.
  /// \pre a cut was made, or it was prepared
  std::shared_ptr<ComplianceSource> compliance() const;

private:
  bool is_solid() const { return !now_->tetrahedra.empty(); }
  std::vector<std::uint32_t> follow_matrix();
  bool woodbury_pays(std::size_t rank) const;
  std::function<void()> still_valid() const;
  AxesSolve solver() const;
  void require_condition();
  void factorise(const std::function<void()>& work);
  std::shared_ptr<const Model> first_, factored_, now_;
  std::shared_ptr<const ComplianceSource> source_;
  Context context_;
  std::vector<std::uint32_t> first_origin_, first_place_; ///< from first_ to now_
  std::vector<std::uint32_t> origin_, place_;             ///< from factored_ to now_
  NodeMatrix matrix_;                                     ///< of a solid: that of factor_
  std::vector<double> row_norm_;                          ///< of its nodes
  std::shared_ptr<FrontalFactor> factor_;
  std::shared_ptr<const WoodburySolver> woodbury_;
  std::shared_ptr<std::uint64_t> generation_ = std::make_shared<std::uint64_t>(0); ///< of factor_
  double norm_ = 0;             ///< bound of ‖K‖₁
  double fresh_operations_ = 0; ///< of the last factor with an order of its own
  double reached_ = 0;          ///< operations of the last refactorisation
  double accepted_pivot_ = 1; ///< the weakest for which the condition was found to be small enough
};

} // namespace gewebe
