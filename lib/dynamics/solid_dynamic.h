#pragma once
// The elastodynamic method of a solid, a model of tetrahedra, perhaps with springs beside them, and
// of a net of springs alone that is too stiff for explicit steps: they move by the implicit steps
// of solid/solid_motion.h, under what acts on objects of a scene.
//
// Nodes have the masses of their tetrahedra and the model's drag per mass; weight acts by the loads
// that statics has (weight_of), so that at rest a solid stands where statics says. Forces and
// pressures of a step are those at its end, pressures on the shape at its beginning. Displaced
// nodes stand at their displacement, or are on their way there. Instruments push within each step
// (dynamics/solid_contact.h); what one jumps over, or passes by more than half its radius in a
// step, is moved along before, without speed. Elastostatic objects that stand beside it
// (dynamics/standing.h) stand at each step's end as their loads say then. The same bytes for any
// number of threads.

#include "base/context.h"
#include "base/copy_on_write.h"
#include "contact/load.h"
#include "dynamics/body_motion.h"
#include "dynamics/solid_contact.h"
#include "model/model.h"
#include "solid/solid_motion.h"

#include <any>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace gewebe {

class SolidDynamic final : public BodyMotion {
public:
  /// At rest. Keeps a reference to the model.
  /// \pre check_model(model) passes \throw Error if a node can move but has no mass, or, in a
  /// model with tetrahedra, is in none of them and of no spring, or has another mass than its
  /// tetrahedra's; as SolidMotion
  SolidDynamic(const Model& model, const SolidChoice& choice, const Context& context);

  void set_load(const Load& load, double time) override;
  std::uint64_t advance(double duration, double largest_step, const Context& context,
                        double start = 0) override;

  /// At rest two steps in a row moved nothing by more than 1e-9 of the largest displacement, or
  /// 1e-13 of its size.
  bool resting() const noexcept override { return state_.resting; }
  void wake() override { state_.resting = false; }

  std::span<const NodeMotion> motion() const override;
  void set_motion(std::span<const NodeMotion> motion) override;

  std::any snapshot() const override { return state_; }
  void go_back(const std::any& snapshot) override;
  void renew() override;

  std::vector<NodeVector> contact_forces() const override;

  void set_instruments(std::vector<std::optional<MovingInstrument>> instruments) override;
  std::optional<LedInstrument> led(std::size_t instrument) const override;
  void set_meetings(std::vector<SurfaceMeeting> meetings) override;
  void stand_beside(const StandingStart& start) override;
  void set_standing(Standing* beside) override { standing_ = beside; }
  std::span<const double> standing_shape() const override { return *state_.stands; }
  std::vector<NodeTouch> standing_touches() const override;
  void rest_on(double duration) override;
  std::vector<NodeTouch> take_impulses() override;
  bool touches_exact() const override { return state_.exact; }
  std::optional<std::vector<NodeTouch>> held_touches(double duration) const override;

  SolidStepCounts take_counts() override;
  std::optional<MotionEnergies> energies() const override;

private:
  /// What a snapshot holds.
  struct State {
    std::shared_ptr<const Load> load = std::make_shared<const Load>();
    double time = 0;
    CopyOnWrite<std::vector<double>> places{}, velocity{}, reactions{}; ///< 3 n
    CopyOnWrite<std::vector<double>> stands{}; ///< displacements of what stands beside it
    MotionEnergies energies;
    std::uint64_t version = 0; ///< of all these
    int quiet = 0;             ///< steps in a row that moved next to nothing
    bool resting = false;

    std::vector<std::optional<MovingInstrument>> instruments{};
    std::vector<NodeTouch> touched{};  ///< forces in the last step
    std::vector<SurfacePush> pushes{}; ///< of surfaces, in the last step
    std::vector<NodeTouch> impulses{}; ///< of steps since they were taken
    double held_time = 0;              ///< s that `touched` acted at rest since then
    bool exact = true;                 ///< all forces so far
    int tries = 64;                    ///< that steps in halves have yet
  };

  void read_load();
  void apply_load(double time);
  void take_over();
  void lead_instruments(double to, double h);
  SolidMotion& engine(const Context& context);
  std::vector<double> forces_at(double time) const;
  Vec3 held_at(std::uint32_t node, double time) const;
  void step_in_parts(double h, double from, double to, bool first, int halvings,
                     const Context& context);
  bool step(double h, double from, double to, bool first, const Context& context);
  bool instruments_move(bool first, double from, double to) const;
  /// What a step did.
  struct Pushed {
    SolidStep took;
    bool met = true;   ///< surfaces touch as they should
    bool exact = true; ///< forces of contact are what was asked for
  };
  Pushed push(const std::vector<double>& forces, const std::vector<double>& target, double h,
              double from, double to, bool first, const Context& context);
  /// Where a step began.
  struct Began {
    double energy = 0;                       ///< where there are instruments
    std::vector<double> places;              ///< 3 n
    std::vector<Pose> stood;                 ///< by instrument
    CopyOnWrite<std::vector<double>> stands; ///< what stands beside it
  };
  Began began(double from) const;
  bool thrown(const Began& start, std::span<const double> forces, double to) const;

  // What stands beside it.
  const Model& model_of_all() const { return beside_model_ ? *beside_model_ : model_; }
  std::span<const double> with_beside(std::span<const double> own, bool places,
                                      std::vector<double>& room) const;
  std::map<std::uint32_t, Vec3> displaced(double time) const;
  void let_stand(double from, double to);
  double moved_beside(const Began& start) const;

  const Model& model_;
  SolidMotionOptions options_;
  double bulk_ = 0; ///< of what fills a net; 0: nothing
  Context context_;
  double size_ = 0; ///< longest side of the box at rest
  State state_;
  std::uint64_t versions_ = 0;

  // Of the load.
  std::vector<std::uint8_t> held_; ///< 3 n
  bool all_held_ = false;
  std::optional<Vec3> weighed_; ///< gravity that weight_ is of
  std::vector<double> weight_, steady_;
  std::vector<PressedCorner> pressed_;

  std::vector<SurfaceMeeting> meetings_;
  std::shared_ptr<const Model> beside_model_; ///< of the body and of what stands beside it
  Standing* standing_ = nullptr;              ///< that, during advances

  std::optional<SolidMotion> engine_;
  double last_step_ = 0;                  ///< of the engine
  std::unique_ptr<SolidContact> contact_; ///< of the engine, while anything may touch
  SolidStepCounts counts_;
  mutable std::vector<NodeMotion> motion_;
  mutable bool motion_shown_ = false;
};

} // namespace gewebe
