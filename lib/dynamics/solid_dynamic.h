#pragma once
// Implicit integration of solids, and of nets that are too stiff for explicit steps. A solid is a
// model with tetrahedra, perhaps with springs beside them. The steps are those of
// integrator/solid_motion.h, under the loads of a scene.
//
// Nodes have the masses of their tetrahedra and the model's drag per mass. Weight acts by the same
// nodal loads as in statics (weight_of), so that a solid at rest has its static shape. Forces and
// pressures of a step are those at its end; pressures act on the shape at its beginning. Displaced
// nodes stand at their displacement, or are on their way there. In an island the object takes part
// in steps with contact (contact/step.h). Results are the same bytes for any number of threads.

#include "base/context.h"
#include "base/copy_on_write.h"
#include "contact/held_body.h"
#include "contact/load.h"
#include "dynamics/body_motion.h"
#include "dynamics/solid_contact_body.h"
#include "integrator/solid_motion.h"
#include "model/model.h"

#include <any>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace gewebe::dynamics {

/// Implicit integration of one body.
class SolidDynamic final : public BodyMotion {
public:
  /// Starts at rest. Keeps a reference to the model.
  /// \pre check_model(model) passes
  /// \throw Error if a node can move but has no mass
  /// \throw Error if a node of a model with tetrahedra belongs to no tetrahedron and no spring, or
  /// if its mass differs from that of its tetrahedra
  /// \throw Error as SolidMotion
  SolidDynamic(const model::Model& model, const integrator::SolidChoice& choice,
               const Context& context);

  void set_load(const contact::Load& load, double time) override;
  std::uint64_t advance(double duration, const TimeSteps& of, const Context& context,
                        double start = 0) override;

  /// The object is at rest if two steps in a row moved no node by more than 1e-9 of the largest
  /// displacement, or 1e-13 of the object's size.
  bool resting() const noexcept override { return state_.resting; }
  void wake() override { state_.resting = false; }

  std::span<const NodeMotion> motion() const override;
  void set_motion(std::span<const NodeMotion> motion) override;

  std::any memory() override;
  void remember(const std::any& memory) override;

  std::any snapshot() const override;
  void go_back(const std::any& snapshot) override;

  std::vector<contact::NodeVector> contact_forces() const override;

  bool has_contact_steps() const override { return true; }
  const contact::ModelSurface& collision_surface() override;
  contact::ContactBody& begin_contact_step(const contact::Interval& step,
                                           const Context& context) override;
  bool has_first_stage() const override;
  void end_contact_step(std::span<const contact::VertexForce> forces, bool still,
                        const Context& context) override;
  void clear_contact() override;

  SolidStepCounts take_counts() override;
  std::optional<MotionEnergies> energies() const override;

private:
  /// Contents of a snapshot.
  struct State {
    std::shared_ptr<const contact::Load> load = std::make_shared<const contact::Load>();
    double time = 0;
    CopyOnWrite<std::vector<double>> places{}, velocity{}, reactions{}; ///< 3 n
    MotionEnergies energies;
    std::uint64_t version = 0; ///< of all these
    int quiet = 0;             ///< number of steps in a row with almost no motion
    bool resting = false;
    double last_step = 0; ///< of the engine
    /// What earlier steps left to the engine; null in the present state, which the engine has.
    std::shared_ptr<const integrator::SolidMotion::Past> past{};

    /// Contact forces at the end of the last step, by ascending vertex.
    std::vector<contact::VertexForce> contact{};
  };

  void read_load();
  void apply_load(double time);
  void take_over();
  void begin_anew();
  integrator::SolidMotion& engine(const Context& context);
  std::vector<double> forces_at(double time, double ahead = 0) const;
  Vec3 held_at(std::uint32_t node, double time) const;
  double typical_force(double h, double strained) const;
  double keep_length(double h);
  void move(double h, const contact::Interval& step, const Context& context);
  void step(double h, const contact::Interval& step, const Context& context);
  void two_stages(double h, const contact::Interval& step, const Context& context);
  std::vector<double> begin_step(const contact::Interval& step);
  void hold_all(std::span<const double> target, double h, const Context& context);
  void settle(std::span<const double> before, double to, double room, const Context& context);

  const model::Model& model_;
  integrator::SolidMotionOptions options_;
  double bulk_ = 0; ///< bulk modulus of the filling of a net; 0: not filled
  Context context_;
  double size_ = 0; ///< longest side of the box at rest
  State state_;
  std::uint64_t versions_ = 0;

  // Of the load.
  std::vector<std::uint8_t> held_; ///< 3 n
  bool all_held_ = false;
  std::optional<Vec3> weighed_; ///< gravity of weight_
  std::vector<double> weight_, steady_;
  std::vector<contact::PressedCorner> pressed_;

  std::optional<integrator::SolidMotion> engine_;
  bool behind_ = false; ///< the engine has to go back to the state first
  std::optional<contact::ModelSurface> surface_;
  std::optional<contact::TypicalContact> typical_; ///< of the model
  std::unique_ptr<SolidContactBody> body_;         ///< of the engine
  std::unique_ptr<contact::HeldBody> held_body_;   ///< if all nodes are held
  std::vector<double> load_;                       ///< forces of the step, 3 n
  std::vector<double> target_; ///< displacements at its end, if all nodes are held
  contact::Interval step_;     ///< with contact that was begun
  std::vector<double> begun_;  ///< places where it began, or the first one of its stages
  SolidStepCounts counts_;
  mutable std::vector<NodeMotion> motion_;
  mutable bool motion_shown_ = false;
};

} // namespace gewebe::dynamics
