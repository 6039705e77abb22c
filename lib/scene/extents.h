#pragma once
// Cache of the bounding boxes and largest speeds of objects' surfaces. An entry is computed from
// the nodes at its first use in an advance. The entry of a body at rest is kept while the body
// rests.

#include "geometry/vec3.h"

#include <cstddef>
#include <map>

namespace gewebe::scene {

struct World;
struct Object;

/// Bounding box and largest speed of a surface.
struct Extent {
  Box3 box;         ///< of the nodes of the surface
  double speed = 0; ///< of the fastest of these nodes, mm/s
};

/// Extent of the object's present positions, or of those at rest if it never moved.
/// \pre its model is known
Extent extent_of(const Object& object);

/// Extents of a scene's objects during one advance.
class Extents {
public:
  /// Keeps a reference to the world.
  explicit Extents(World& world) : w_(world) {}

  const Extent& of(std::size_t index);
  /// To be called when an object has been moved.
  void forget(std::size_t object) { known_.erase(object); }

private:
  World& w_;
  std::map<std::size_t, Extent> known_;
};

} // namespace gewebe::scene
