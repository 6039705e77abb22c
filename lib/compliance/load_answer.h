#pragma once
// u = C f for the forces and the weight of a load, where loads follow one another: sums follow
// their changes, and where only a few rows are asked for these alone are computed. What is inside
// a solid, behind the rows that the compliance's sums have, is solved for when it is asked for.

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

namespace gewebe {

/// The forces and weights of a load over all 3 n axes, its displacements left out.
std::vector<double> forces_over_axes(const Model& model, const Load& load);

/// The nodes of a list by node, in their order, and its vectors as a list.
std::vector<std::uint32_t> nodes_of(const std::map<std::uint32_t, Vec3>& values);
std::vector<NodeVector> as_vectors(const std::map<std::uint32_t, Vec3>& values);

class LoadAnswer {
public:
  /// Keeps references to both.
  LoadAnswer(const Model& model, Compliance& compliance);

  /// Whether the answer to this load is the last one.
  bool known(const Load& load) const { return load.gravity == gravity_ && load.force == force_; }
  /// The answer at the first rows() of the compliance.
  const std::vector<double>& whole(const Load& load);
  /// Answers to come are to the bit what they are behind whole(load), which is put off until one is
  /// asked for.
  void note(const Load& load);
  /// That to the weight alone; empty for none.
  const std::vector<double>& weight(const Vec3& gravity);
  /// Rows of the answer at all axes. The same bits whatever answers were asked for.
  std::vector<double> at(const Load& load, std::span<const std::size_t> rows);
  /// The same of nodes whose blocks the compliance has made ready, to other bits: where it can, by
  /// a load that its factor carries along.
  std::vector<double> at_blocks(const Load& load, std::span<const std::size_t> rows);

private:
  std::vector<NodeVector> changed_forces(const std::map<std::uint32_t, Vec3>& now) const;
  const std::vector<double>& everywhere(const Load& load);
  bool follows(const Load& load, std::size_t changed) const;
  void settle();
  void forget() { gravity_ = {HUGE_VAL, HUGE_VAL, HUGE_VAL}; }

  const Model& model_;
  Compliance& compliance_;
  Vec3 weight_gravity_;
  std::vector<double> weight_;
  std::map<std::uint32_t, Vec3> force_; ///< that the answer is to, once it is settled
  Vec3 gravity_;
  std::vector<double> answer_;
  std::uint64_t increments_ = 0; ///< by which it came to be
  // What it lacks: all of these forces first, then increments.
  std::optional<std::vector<NodeVector>> fresh_;
  std::vector<std::vector<NodeVector>> pending_;
  Load solved_; ///< whose answer over all axes is known
  std::vector<double> everywhere_;
  Load carried_; ///< whose answer is known at some nodes
  std::map<std::uint32_t, Vec3> carried_at_;
};

} // namespace gewebe
