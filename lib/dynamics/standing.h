#pragma once
// Elastostatic objects beside a body that moves, as its steps meet them (dynamics/solid_contact.h).
// They have no motion of their own: at each time they stand as their loads of then and what touches
// them say, so that a step that is taken back leaves nothing of them behind.

#include "contact/load.h"
#include "model/model.h"
#include "statics/static_contact.h"

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <vector>

namespace gewebe {

/// Nodes have their own numbers, those of one object behind those of the other.
class Standing {
public:
  Standing() = default;
  Standing(const Standing&) = delete;
  Standing& operator=(const Standing&) = delete;
  virtual ~Standing() = default;

  /// How they give way under their loads of a time; good until anything of another is asked for.
  /// \param last what pushes them until they are pushed
  virtual std::unique_ptr<Yielding> yielding(double time, std::span<const NodeTouch> last) = 0;
  /// Whether the last one found all that was asked of it. \pre it lives
  virtual bool solved() const = 0;
  /// Nodes that stand where they must.
  virtual std::map<std::uint32_t, Vec3> displaced(double time) = 0;
  /// Whether loads are others at the second time.
  virtual bool changes(double from, double to) const = 0;
};

/// How they begin.
struct StandingStart {
  std::shared_ptr<const Model> model; ///< of the body and behind it of these
  std::vector<double> shape;          ///< displacements of their nodes
  std::vector<NodeTouch> touches;     ///< by instruments, by numbers of the model
};

} // namespace gewebe
