// Contact of an elastostatic object with instruments on the part of its surface that they can
// reach: the part follows from bounds of all displacements, which cost much less than the shape.

#include "geometry/vector_at.h"
#include "scene/island_members_internal.h"

#include <algorithm>
#include <utility>

namespace gewebe::scene {

namespace {

constexpr std::size_t kept_parts = 4;

/// Whether an object's shape is a sum of responses to forces which its part can be found from.
bool is_sum_of_forces(const World& w, std::size_t index) {
  const Object& object = w.now.objects[index];
  if (object.method != Method::ffe || object.in_motion || object.warp || object.stages.options ||
      object.shown.deferred || !object.matter->known || has_law(object))
    return false;
  const contact::Load &load = *object.load, &shown = *object.shown.load;
  if (!load.displacement.empty() || load.gravity != Vec3{} || !load.pressure.empty() ||
      !load.force_period.empty() || !shown.displacement.empty() || shown.force != load.force)
    return false;
  return std::ranges::none_of(w.now.contacts,
                              [&](const ContactRule& rule) {
                                return rule.object == index || rule.other == index;
                              }) &&
         !is_held_altogether(object);
}

} // namespace

std::shared_ptr<ContactReach> contact_reach(World& w, std::size_t index) {
  if (!is_sum_of_forces(w, index))
    return nullptr;
  Object& object = w.now.objects[index];
  const columns::NodeClusters* const clusters = solver_of(w, object).clusters();
  if (clusters == nullptr || std::ranges::any_of(object.load->force, [&](const auto& f) {
        return f.first >= clusters->node.size();
      }))
    return nullptr;
  if (!object.statics.reach)
    object.statics.reach =
        std::make_shared<ContactReach>(contact::model_surface(object.model()), *clusters);
  return object.statics.reach;
}

const std::vector<double>& bounds_under(World& w, std::size_t index, ContactReach& reach,
                                        std::span<const contact::NodalContactForce> contact) {
  Object& object = w.now.objects[index];
  std::map<std::uint32_t, Vec3> all = object.load->force;
  for (const contact::NodalContactForce& f : contact)
    all[f.node] += f.force;
  std::vector<contact::NodeVector> forces;
  forces.reserve(all.size());
  for (const auto& [node, force] : all)
    forces.push_back({node, force});
  if (reach.bounds.empty() || forces != reach.forces) {
    reach.bounds = solver_of(w, object).displacement_bounds(forces);
    reach.forces = std::move(forces);
  }
  return reach.bounds;
}

Box3 contact_box(World& w, std::size_t index) {
  Object& object = w.now.objects[index];
  need_model(object);
  if (!is_sum_of_forces(w, index))
    return shown_box(w, index);
  if (object.touching.empty() && object.load->force.empty()) {
    std::optional<Box3>& box = object.matter->box;
    if (!box) {
      box.emplace();
      const std::size_t count = model::surface_count(object.model());
      for (std::size_t i = 0; i < count; ++i)
        box->add(object.model().nodes[i].position);
    }
    return *box;
  }
  const std::shared_ptr<ContactReach> reach = contact_reach(w, index);
  if (!reach)
    return shown_box(w, index);
  return reach->tiles.box(bounds_under(w, index, *reach, object.touching));
}

Vec3 contact_displacement(const Object& object, std::uint32_t node) {
  const auto found = object.shown.touched.find(node);
  return found != object.shown.touched.end() ? found->second
                                             : vector_at(*object.shown.displacement, node);
}

PartIsland& part_island(IslandCache& whole, const std::shared_ptr<const ContactReach>& reach,
                        std::vector<std::uint32_t> tiles) {
  for (PartIsland& one : whole.parts)
    if (one.reach == reach && one.tiles == tiles)
      return one;
  PartIsland& made = whole.parts.emplace_back();
  made.reach = reach;
  made.part = reach->tiles.part(tiles);
  made.tiles = std::move(tiles);
  std::vector<const contact::BodySurface*> surfaces{&made.part.surface.surface};
  for (const contact::BodySurface& one : whole.surfaces)
    surfaces.push_back(&one);
  collision::OwnerTable<double> table(surfaces.size(), -1);
  for (std::size_t a = 0; a < surfaces.size(); ++a)
    for (std::size_t b = 0; b <= a; ++b)
      table.set(a, b, whole.friction[a * surfaces.size() + b]);
  made.motion = std::make_unique<contact::IslandMotion>(surfaces, table, contact::Parameters{},
                                                        whole.motion->island().edge);
  if (whole.parts.size() > kept_parts)
    whole.parts.pop_front();
  return whole.parts.back();
}

} // namespace gewebe::scene
