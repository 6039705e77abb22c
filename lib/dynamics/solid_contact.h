#pragma once
// Instruments in a step of a solid that moves (solid/solid_motion.h), and surfaces that touch.
//
// In turn the step under the last forces λ of the instruments;
// W = H A⁻¹ Hᵀ of the touched nodes, with the constant matrix A of the step, in frames that turn
// with the nodes; λ for where W puts them (statics/static_contact.h); the step under these, until
// its nodes stand where W put them, within 1e-4 of the smallest radius. A is not the tangent,
// where tissue is pressed in deeply by far, so W is corrected by what each round's forces have
// moved (the update of BFGS: Nocedal, Wright, Numerical optimization, 2006, 6.1), and each round
// starts from the last one's end. Surfaces of parts that may touch push each other in it
// (statics/meeting_yielding.h), to 1e-4 of an edge; of a net A has the tangent of its springs
// there, whose bound lets W know nothing of how easily a wall gives way across itself. Nothing of a
// step's velocity into an instrument is left at its end, and friction acts against the slip over
// the step. Elastostatic objects that stand beside the body (dynamics/standing.h) are touched and
// touch with it, as one.

#include "base/context.h"
#include "dynamics/dynamic_contact.h"
#include "dynamics/standing.h"
#include "model/model.h"
#include "solid/solid_motion.h"
#include "statics/meeting_yielding.h"
#include "statics/static_contact.h"

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace gewebe {

class SolidContact {
public:
  /// Keeps a reference to the model. \param own nodes of it that move, the first ones; those behind
  /// are of what stands beside \param meetings parts whose surfaces may touch
  SolidContact(const Model& model, std::size_t own, std::vector<SurfaceMeeting> meetings = {});

  /// Whether surfaces may touch each other within a step of h from these places of all nodes.
  bool may_meet(std::span<const double> places, std::span<const double> velocity, double h) {
    return pairs_ && pairs_->may_touch(places, velocity, h);
  }
  /// Behind a step where they may not: whether they may have done so nevertheless.
  bool may_have_met(std::span<const double> places) const {
    return pairs_ && pairs_->may_have_touched(places);
  }

  /// How far surfaces that may touch move against each other, of what moves so far, over an edge.
  double way_of(std::span<const double> moved) const { return pairs_ ? pairs_->way_of(moved) : 0; }

  struct Step {
    SolidMotion& engine;                            ///< where the step begins
    std::span<const double> forces;                 ///< on the 3 n axes, without instruments
    std::span<const double> target;                 ///< of held axes; empty: they stay
    const std::map<std::uint32_t, Vec3>& displaced; ///< of all, nodes whose axes are all held
    std::span<const std::optional<MovedInstrument>> instruments; ///< during the step
    double h = 0;
    SolidMotionOptions options; ///< of the engine
    bool clearing = false;      ///< only what is in the way moves, from rest, and keeps its speed
    bool meets = false;         ///< surfaces may touch: see may_meet
    Standing* beside = nullptr; ///< what stands beside the body
    double time = 0;            ///< of its loads
  };
  struct Result {
    SolidStep took; ///< of all rounds
    bool exact = true;
    bool met = true; ///< surfaces touch as they should
  };
  /// Takes the engine on by a step; one that clears, where something is in the way. \param touches,
  /// pushes of the last step, then of this one \param stands displacements of what stands beside,
  /// before and behind it \throw as SolidMotion::step, and as what stands beside
  Result step(const Step& step, std::vector<NodeTouch>& touches, std::vector<SurfacePush>& pushes,
              std::vector<double>& stands, const Context& context);
  /// Of contacts since the last call.
  TouchCounts take_counts() {
    TouchCounts all = contact_.take_counts();
    all.add(std::exchange(met_, {}));
    return all;
  }
  /// Forgets the columns of A⁻¹, which serve for some steps.
  void renew() {
    columns_.clear();
    learned_of_.clear();
  }

private:
  class Object;
  /// Where a step began.
  struct Began {
    std::vector<double> places; ///< of the body's nodes
    std::vector<double> shape;  ///< of all
  };
  std::vector<double> shape_of(std::span<const double> places,
                               std::span<const double> stands) const;
  bool meet(const Step& step, Yielding& all, std::vector<NodeTouch>& touches,
            std::vector<SurfacePush>& pushes, std::vector<double>& shape);
  bool overlaps(std::span<const double> shape);
  void hold_back(const Step& step, const Began& began, std::vector<double>& stands, double excess,
                 const Context& context);

  const Model& model_;
  std::size_t own_ = 0;
  StaticContact contact_;
  std::optional<SurfacePairs> pairs_;
  TouchCounts met_; ///< of surfaces
  /// By node three columns of A⁻¹, 3 n numbers each.
  std::map<std::uint32_t, std::vector<double>> columns_;
  std::vector<std::uint32_t> learned_of_; ///< nodes
  std::vector<double> learned_;           ///< their W, as rounds have corrected it
};

} // namespace gewebe
