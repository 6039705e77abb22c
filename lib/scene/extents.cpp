#include "scene/extents.h"

#include "geometry/vector_at.h"
#include "scene/world_internal.h"

#include <algorithm>
#include <cmath>

namespace gewebe::scene {

Extent extent_of(const Object& object) {
  Extent all;
  const std::vector<model::Node>& nodes = object.model().nodes;
  const std::size_t count = model::surface_count(object.model());
  if (object.body == nullptr) {
    for (std::size_t k = 0; k < count; ++k)
      all.box.add(nodes[k].position + vector_at(*object.shown.displacement, k));
    return all;
  }
  const std::span<const dynamics::NodeMotion> motion = motion_of(object);
  for (std::size_t k = 0; k < count; ++k) {
    all.box.add(nodes[k].position + motion[k].displacement);
    all.speed = std::max(all.speed, dot(motion[k].velocity, motion[k].velocity));
  }
  all.speed = std::sqrt(all.speed);
  return all;
}

const Extent& Extents::of(std::size_t index) {
  if (const auto known = known_.find(index); known != known_.end())
    return known->second;
  const Object& object = w_.now.objects[index];
  const bool rests =
      object.body != nullptr && object.body->moving->resting() && !object.body->changed;
  if (!rests)
    return known_.emplace(index, extent_of(object)).first->second;
  std::map<std::size_t, Extent>& kept = object.body->rest_extents;
  if (const auto there = kept.find(index); there != kept.end())
    return there->second;
  return kept.emplace(index, extent_of(object)).first->second;
}

} // namespace gewebe::scene
