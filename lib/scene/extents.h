#pragma once
// Where objects' surfaces are, and how fast they move: gathered over their nodes once on the way to
// a time, when somebody first asks; of a body at rest, once while it rests.

#include "base/vec3.h"

#include <cstddef>
#include <map>

namespace gewebe::simulation {

struct World;
struct Object;

struct Extent {
  Box3 box;         ///< of the nodes that have all of the surface
  double speed = 0; ///< of the fastest of them, mm/s
};

/// As the object is now; at rest, if nothing has moved it. \pre its model is known
Extent extent_of(const Object& object);

/// Extents of a scene's objects during one way of it.
class Extents {
public:
  /// Keeps a reference to it.
  explicit Extents(World& world) : w_(world) {}

  const Extent& of(std::size_t index);
  /// It has been moved.
  void forget(std::size_t object) { known_.erase(object); }

private:
  World& w_;
  std::map<std::size_t, Extent> known_;
};

} // namespace gewebe::simulation
