#pragma once
// An instrument pressed into one elastostatic object at rest, by the contact of ffe-run, with the
// normal and friction forces apart.

#include "contact/instrument.h"
#include "contact/island.h"
#include "contact/load.h"
#include "contact/step.h"
#include "model/model.h"
#include "statics/elastostatic.h"

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace gewebe::validate {

class PressedBody {
public:
  /// Keeps references to the model and its solver. \param start  the instrument stands apart there
  PressedBody(const model::Model& model, statics::Elastostatic& solver,
              const contact::InstrumentShape& shape, const contact::Pose& start,
              const contact::Parameters& parameters = {});

  /// Moves the instrument, in halves of the way where contact is not solved, as ffe-run does.
  /// \return whether it was solved; else the instrument is on its way
  bool move(const contact::Pose& to) { return move(to, max_halvings); }

  struct Force {
    std::uint32_t node = 0;
    Vec3 normal, friction; ///< on the node, 1e-6 N
  };
  /// By ascending node.
  const std::vector<Force>& forces() const { return forces_; }
  /// On the instrument.
  Vec3 force_on_instrument() const;
  /// Of the surface's nodes.
  std::span<const double> displacement() const { return displacement_; }
  const contact::Pose& pose() const { return pose_; }
  double activation_distance() const { return island_.activation_distance; }

private:
  static constexpr int max_halvings = 8;
  bool move(const contact::Pose& to, int halvings);
  bool step(const contact::Pose& to);

  const model::Model& model_;
  statics::Elastostatic& solver_;
  contact::InstrumentShape shape_;
  contact::Pose pose_;
  contact::Parameters parameters_;
  contact::ModelSurface body_;
  contact::BodySurface tool_;
  contact::Island island_;
  std::optional<contact::StepSolver> steps_;
  contact::Load load_;
  std::vector<double> displacement_;
  std::vector<contact::VertexForce> last_;
  std::vector<Force> forces_;
};

} // namespace gewebe::validate
