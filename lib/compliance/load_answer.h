#pragma once
// Displacement u = C f for the forces and the weight of successive loads. Sums are updated by the
// changes of the load. If a caller reads a few rows, only these are computed. Inner nodes of a
// solid, which sums of the compliance have no rows for, are solved for when they are first read.

#include "base/copy_on_write.h"
#include "compliance/compliance.h"
#include "contact/load.h"
#include "model/model.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

namespace gewebe::compliance {

/// Forces and weights of a load over all 3 n axes, without its displacements.
std::vector<double> forces_over_axes(const model::Model& model, const contact::Load& load);

/// Keys of a map by node, in their order; and the map as a list.
std::vector<std::uint32_t> nodes_of(const std::map<std::uint32_t, Vec3>& values);
std::vector<contact::NodeVector> as_vectors(const std::map<std::uint32_t, Vec3>& values);

/// Displacement ("answer") under the last load, and its update for the next one.
class LoadAnswer {
public:
  /// The running sum, whose bits depend on the loads before. Copies share it.
  struct Past {
    CopyOnWrite<std::map<std::uint32_t, Vec3>> force{}; ///< load of the answer, once it is settled
    Vec3 gravity{};
    CopyOnWrite<std::vector<double>> answer{};
    std::uint64_t increments = 0; ///< number of updates of the answer
    // Deferred work: first all of these forces, then the increments.
    CopyOnWrite<std::optional<std::vector<contact::NodeVector>>> fresh{};
    CopyOnWrite<std::vector<std::vector<contact::NodeVector>>> pending{};
  };
  const Past& past() const noexcept { return now_; }
  void restore(const Past& past) { now_ = past; }

  /// Keeps references to both.
  LoadAnswer(const model::Model& model, Compliance& compliance);

  /// Whether the last answer is that for this load.
  bool known(const contact::Load& load) const {
    return load.gravity == now_.gravity && load.force == *now_.force;
  }
  /// Answer at the first rows() of the compliance.
  const std::vector<double>& whole(const contact::Load& load);
  /// Deferred form of whole(load): later answers have the same bits as after whole(load), but the
  /// work is done when one of them is first read.
  void note(const contact::Load& load);
  /// Answer for the weight only; empty without gravity.
  const std::vector<double>& weight(const Vec3& gravity);
  /// Rows of the answer, at any axes. The bits do not depend on earlier calls.
  std::vector<double> at(const contact::Load& load, std::span<const std::size_t> rows);
  /// The same for nodes whose blocks the compliance has prepared. If possible it uses a solution
  /// that the factor updates, so that the bits differ from those of at().
  std::vector<double> at_blocks(const contact::Load& load, std::span<const std::size_t> rows);

private:
  std::vector<contact::NodeVector> changed_forces(const std::map<std::uint32_t, Vec3>& now) const;
  const std::vector<double>& everywhere(const contact::Load& load);
  bool follows(const contact::Load& load, std::size_t changed) const;
  void settle();
  void forget() { now_.gravity = {HUGE_VAL, HUGE_VAL, HUGE_VAL}; }

  const model::Model& model_;
  Compliance& compliance_;
  Vec3 weight_gravity_;
  std::vector<double> weight_;
  Past now_;
  contact::Load solved_; ///< load of everywhere_
  std::vector<double> everywhere_;
  contact::Load carried_; ///< load of carried_at_
  std::map<std::uint32_t, Vec3> carried_at_;
};

} // namespace gewebe::compliance
