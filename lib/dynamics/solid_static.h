#pragma once
// A solid of tetrahedra at rest under large strains: corotational or stable Neo-Hookean elements.
//
// The shape at rest is where a step of infinite length ends (integrator/solid_motion.h): a minimum
// of elastic energy less the work of the load, sought from the last shape. Pressures follow the
// surface. Where the way to a load is lost, it is taken in parts, of a quarter
// each time. A shape counts where what is left is below 1e-6 of the displacement, and at most
// a hundredth of the volume is inside out.
//
// With contact the same step is taken in parts, as that of a moving solid (solid_contact_body.h):
// rounds of quadratic models, each with the forces of all bodies that touch.
//
// A viscoelastic solid rests in a time that passes: a load that changes acts suddenly at the start
// of that time, or changes over it, and then the shape relaxes in steps that grow as the time since
// the change does, each a minimum too (viscous/solid_memory.h). In contact, a part of the way is
// one such step.
//
// An answer is a value, from which the next one is sought, and a rollback restores it. The same
// answer and load give the same next one, to the bit.

#include "base/context.h"
#include "contact/contact_body.h"
#include "contact/island.h"
#include "contact/load.h"
#include "dynamics/solid_contact_body.h"
#include "integrator/solid_motion.h"
#include "model/model.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace gewebe::dynamics {

/// Shape of a solid at rest.
struct SolidRest {
  contact::Load load;            ///< that it balances, with contact forces
  std::vector<double> places;    ///< of all nodes, 3 n, mm
  std::vector<double> reactions; ///< on held axes, 3 n, else 0
  bool balanced = true;          ///< else only the start of the next one, as behind a cut
  bool sharp = false;            ///< contact took a tangent: the next one begins with its own
  // Of a viscoelastic solid:
  viscous::MemoryState memory{};
  double time = 0;  ///< s, of this shape
  double since = 0; ///< ... and of the last change of its load
};

/// The time that passes until an answer.
struct RestTime {
  double start = 0, end = 0; ///< s; start: if there is no answer yet
  bool gradual = false;      ///< the load changes over this time; else at its start
};

/// Work of a SolidStatic.
struct SolidStaticCounts {
  std::uint64_t updates = 0, unchanged = 0, shapes = 0; ///< as ElastostaticCounts
  std::uint64_t rounds = 0, factors = 0;                ///< solutions; factors made
};

class SolidStatic {
public:
  /// Keeps a reference to the model.
  /// \pre check_model(model) passes, the model has tetrahedra, and no springs beside them
  /// \throw Error as SolidMotion
  SolidStatic(const model::Model& model, integrator::SolidLaw law, const Context& context);
  ~SolidStatic();
  SolidStatic(SolidStatic&&) noexcept;

  /// Finds the shape under `load`. For the last load nothing is done.
  /// \pre forces do not pulse, nor do pressures; nodes exist, no displacement along an axis that
  /// the model holds \throw SingularStiffness if what holds the model and the load leaves it free
  /// to move \throw Error if no shape is found, with the share of the way to the load that was;
  /// Cancelled
  /// \param time  of a viscoelastic solid
  void update(const contact::Load& load, const RestTime& time = {});
  /// Makes what the first update under this load needs. \throw as update
  void prepare(const contact::Load& load);
  std::shared_ptr<const SolidRest> answer() const noexcept;
  /// Rolls back to an earlier answer; null: to none.
  void restore(std::shared_ptr<const SolidRest> answer);

  /// Displacement of all nodes, 3 n, mm. Displaced nodes have exactly their displacements.
  std::span<const double> displacement();
  /// Reactions of the displaced nodes, by ascending node; contact forces there included.
  std::vector<contact::NodeVector> holding_forces() const;

  /// Begins a step with contact, from the last answer to the shape under this load. A step that was
  /// begun is abandoned. Vertices are those of contact::model_surface.
  /// \param last  contact forces at its beginning \return valid until the next step
  /// \throw as update
  /// \param time  at the end of the step, of a viscoelastic solid
  contact::ContactBody& begin_contact(const contact::Load& load,
                                      std::vector<contact::VertexForce> last,
                                      const RestTime& time = {});
  /// Ends it: the answer is where contact has moved the body to.
  void end_contact();

  SolidStaticCounts counts() const noexcept;

private:
  struct State;
  std::unique_ptr<State> state_;
};

} // namespace gewebe::dynamics
