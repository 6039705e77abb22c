#pragma once
// The elastodynamic method: masses and springs in time by semi-implicit Euler (report 3.1.3).
//
//   v += h/m (F(u, v) + f + m g),   u += h v
//
// with all F of the old state. Axes that the model holds stay, a displaced node stands at its
// displacement with velocity 0. The same bytes for any number of threads.

#include "base/context.h"
#include "model/model.h"
#include "sim/load.h"
#include "sim/spring_force.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe {

/// The default integration step over safe_step(model): below 1, since stability is proven for the
/// model at rest alone.
inline constexpr double safe_step_fraction = 0.9;

class Elastodynamic {
public:
  /// At rest. Keeps a reference to the model.
  /// \pre check_model(model) passes   \throw Error if a node can move but has no mass
  explicit Elastodynamic(const Model& model);

  /// What acts from now on. Displaced nodes stand where they must at once. An unchanged load wakes
  /// nobody. \pre nodes exist, no displacement along an axis that the model holds
  void set_load(const Load& load);

  /// Integrates over `duration` in equal steps of at most `largest_step`. An object that rests (see
  /// resting()) takes none. \return steps taken \pre duration >= 0, largest_step > 0
  /// \throw Error if there would be over 1e9 steps or the state is no longer finite ("… after …
  /// s"); Cancelled
  std::uint64_t advance(double duration, double largest_step, const Context& context);

  /// Whether the object was found at rest: no speed, and acceleration (times the square of the
  /// step) under 1e-14 of its size; so it stays until its load changes.
  bool resting() const noexcept { return resting_; }

  std::span<const NodeMotion> motion() const noexcept { return motion_; }
  /// Gives the nodes another state; it wakes. \pre as many as nodes; 0 where the model holds them
  void set_motion(std::vector<NodeMotion> motion);

  /// What holds the displaced nodes: the force on the object, per node in ascending order; 0 along
  /// axes that the model holds.
  std::vector<NodeVector> contact_forces() const;

private:
  void apply_load();
  bool found_at_rest(double h) const;
  bool step(double h, const Context& context); ///< whether the state is still finite

  const Model& model_;
  SpringNetwork network_;
  Load load_;
  std::vector<Vec3> inverse_mass_; ///< 0 along axes that can't move
  std::vector<Vec3> constant_;     ///< f + m g of each node
  std::vector<NodeMotion> motion_, next_;
  double size_ = 0; ///< longest side of the box at rest
  bool resting_ = false;
};

} // namespace gewebe
