// The picture of an object at the end of a step.

#include "scene/world_internal.h"
#include "statics/linear_range.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

namespace gewebe::scene {

namespace {

constexpr double strain_limit = 0.1, turn_limit = 0.2;
constexpr double warp_strain_limit = 0.2; // of a shape that may turn as it likes
constexpr double max_sizes = 1e6;         // of an object, that a node may be displaced by
constexpr int slow_enough = 10;           // updates in a row, the first ones read and factorise

std::string percent(double part) {
  return text::number_text(std::round(1000 * part) / 10) + " %";
}

/// What is shown of it.
void require_bounded(Object& object) {
  if (object.shown.shaped)
    require_bounded(object, *object.shown.displacement);
  for (const contact::NodeVector& f : *object.shown.forces)
    for (int a = 0; a < 3; ++a)
      if (!(std::abs(f.value[a]) <= largest_number))
        throw Error("the force at node " + std::to_string(f.node) +
                    " leaves single precision, expected a smaller load or timestep");
}

/// Of what stands still, or of a body.
void show_motion(Object& object) {
  std::vector<double>& u = object.shown.displacement.replace();
  u.assign(3 * object.model().nodes.size(), 0);
  object.shown.load = {};
  object.shown.shaped = true;
  if (object.body == nullptr)
    return;
  const std::span<const dynamics::NodeMotion> motion = motion_of(object);
  for (std::size_t i = 0; i < motion.size(); ++i)
    for (int a = 0; a < 3; ++a)
      u[3 * i + static_cast<std::size_t>(a)] = motion[i].displacement[a];
  std::vector<contact::NodeVector>& forces = object.shown.forces.write();
  for (const contact::NodeVector& f : object.body->moving->contact_forces())
    if (f.node >= object.offset && f.node - object.offset < object.model().nodes.size())
      forces.push_back({f.node - static_cast<std::uint32_t>(object.offset), f.value});
}

void update_in_time(World& w, Object& object) {
  const std::size_t displaced = object.load->displacement.size();
  const bool watched = w.options.rate > 0 && w.options.warn && displaced > 0;
  int& slow = object.statics.slow;
  if (!watched || slow == slow_enough) {
    update_solver(w, object, *object.shown.load);
    return;
  }
  const auto start = std::chrono::steady_clock::now();
  update_solver(w, object, *object.shown.load);
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
  slow = taken.count() * w.options.rate > 1 ? slow + 1 : 0;
  if (slow == slow_enough)
    w.options.warn("object " + object.name() + " at " + text::number_text(w.now.clock.time) +
                   " s: its " + std::to_string(displaced) + " displaced nodes are too many for " +
                   text::number_text(w.options.rate) + " steps a second, the last step took " +
                   text::number_text(std::round(1e6 * taken.count()) / 1e3) + " ms for it");
}

} // namespace

/// mm that a node may be displaced by: beyond it an object is not bent but has exploded.
double displacement_limit(Object& object) {
  if (object.matter->size == 0) {
    Box3 box;
    for (const model::Node& node : object.model().nodes)
      box.add(node.position);
    object.matter->size = box.empty() || !(box.longest_side() > 0) ? 1 : box.longest_side();
  }
  return std::min(max_sizes * object.matter->size, largest_number);
}

/// \param displacement 3 n numbers, of a shape that is found now, or of `nodes`
void require_bounded(Object& object, std::span<const double> displacement,
                     std::span<const std::uint32_t> nodes) {
  const double max = displacement_limit(object);
  for (std::size_t k = 0; k < displacement.size(); ++k)
    if (!(std::abs(displacement[k]) <= max))
      throw Error("node " + std::to_string(nodes.empty() ? k / 3 : nodes[k / 3]) +
                  " is displaced by over " + text::number_text(max) +
                  " mm, a million times the size of the object, expected a smaller load or "
                  "timestep");
}

namespace {

/// Whether it is worth to look at all edges where the largest displacement is this (mm).
bool may_leave_range(Object& object, double max) {
  if (object.matter->shortest_edge == 0)
    object.matter->shortest_edge = statics::shortest_edge(object.model());
  // Ends that move less than this against each other can do no harm; beyond, a look at all edges
  // would cost as much as the shape, so not every time.
  return !(2 * std::sqrt(3.0) * max <= strain_limit * object.matter->shortest_edge) &&
         (!(max <= 1.02 * object.range.looked_at) || ++object.range.not_looked >= 64);
}

} // namespace

/// Once, where the shape that is shown is not to be trusted.
void warn_of_range(World& w, Object& object) {
  if (object.range.warned || has_law(object))
    return;
  // The range can be left only where something moves far.
  double max = 0;
  for (const double u : *object.shown.displacement)
    max = std::max(max, std::abs(u));
  if (!may_leave_range(object, max))
    return;
  object.range.looked_at = max;
  object.range.not_looked = 0;
  const statics::LinearRange range =
      statics::linear_range(object.model(), *object.shown.displacement);
  const bool strained = !(range.strain <= (object.warp ? warp_strain_limit : strain_limit)),
             rotated = !object.warp && !(range.turn <= turn_limit);
  if (!strained && !rotated)
    return;
  object.range.warned = true;
  const auto& tell = w.options.distrust ? w.options.distrust : w.options.warn;
  if (!tell)
    return;
  const auto& edge = strained ? range.strain_edge : range.turn_edge;
  tell("object " + object.name() + " at " + text::number_text(w.now.clock.time) +
       " s: beyond the linear range, the edge " + std::to_string(edge[0]) + "-" +
       std::to_string(edge[1]) +
       (strained ? " is strained by " + percent(range.strain)
                 : " is turned by " + percent(range.turn)) +
       ", the shape is not to be trusted there");
}

void warn_of_range(World& w, Object& object, double largest) {
  if (!object.range.warned && may_leave_range(object, largest))
    shape_in_step(w, object); // looks at it
}

namespace {

void find_shape(World& w, Object& object, std::span<const double> (*surface)(Object&)) {
  Shown& shown = object.shown;
  at_object(w, object, [&] {
    // As it is, but where a change of method looked ahead.
    update_stages(w, object, acting_load(shown));
    const std::span<const double> u = surface(object);
    require_bounded(object, u);
    shown.displacement.replace().assign(u.begin(), u.end());
  });
  shown.box.reset();
  shown.shaped = true;
}

} // namespace

void shape(World& w, Object& object) {
  Shown& shown = object.shown;
  if (shown.shaped)
    return;
  if (shown.deferred) {
    at_object(w, object, [&] { find_deferred_shape(w, object); });
    return;
  }
  find_shape(w, object, static_rough_surface);
  shown.rough = w.options.tolerance > 0 && !object.warp && !has_law(object);
  warn_of_range(w, object);
}

void shape_in_step(World& w, Object& object) {
  Shown& shown = object.shown;
  if (shown.shaped && !shown.rough)
    return;
  if (shown.deferred)
    return shape(w, object);
  const bool known = shown.shaped;
  shown.rough = false;
  find_shape(w, object, static_surface);
  if (!known)
    warn_of_range(w, object);
}

contact::Load acting_load(const Shown& shown) {
  contact::Load load = *shown.load;
  for (const contact::NodalContactForce& f : shown.contact)
    if (!load.displacement.contains(f.node))
      load.force[f.node] += f.force;
  return load;
}

std::span<const double> whole_shape(World& w, Object& object) {
  shape(w, object);
  Shown& shown = object.shown;
  if (shown.displacement->size() == 3 * object.model().nodes.size())
    return *shown.displacement;
  if (shown.whole->empty())
    at_object(w, object, [&] {
      update_stages(w, object, acting_load(shown));
      const std::span<const double> u = static_shape(object);
      require_bounded(object, u);
      std::vector<double>& whole = shown.whole.replace();
      whole.assign(u.begin(), u.end());
      // Contact has moved the surface by its model of the object, which agrees with `u` up to a
      // tolerance.
      if (!shown.rough)
        std::ranges::copy(*shown.displacement, whole.begin());
    });
  return *shown.whole;
}

std::span<const double> whole_shape_in_step(World& w, Object& object) {
  shape_in_step(w, object);
  return whole_shape(w, object);
}

std::span<const double> known_shape(const Object& object) {
  const Shown& shown = object.shown;
  return shown.whole->empty() ? *shown.displacement : *shown.whole;
}

void begin_showing(World& w, Object& object) {
  Shown& shown = object.shown;
  shown.deferred = nullptr;
  leave_shown(w, object);
  shown.rough = false; // it is left
  shown.whole = {};
  shown.forces = {};
  shown.box.reset();
  shown.touched.clear();
  shown.largest = 0;
}

contact::Load acting_at(const Object& object, double time) {
  contact::Load given = *object.load;
  std::map<std::uint32_t, contact::NodePressure> pressures;
  if (has_law(object)) // pressures follow the surface
    pressures = std::exchange(given.pressure, {});
  contact::Load load = contact::load_at(given, object.model(), time);
  for (const auto& [node, p] : pressures)
    load.pressure[node] = {p.pressure * contact::pulse(time, p.period), 0};
  if (load.gravity != Vec3{})
    for (const auto& [node, mass] : *object.hung)
      load.force[node] += mass * load.gravity;
  return load;
}

void load_shown(const World& w, Object& object) {
  object.shown.load = acting_at(object, w.now.clock.time);
}

void end_showing(World& w, Object& object) {
  add_contact_forces(object);
  require_bounded(object);
  object.shown.time = w.now.clock.time;
  object.shown.valid = true;
}

void show_in_motion(World& w, Object& object) {
  begin_showing(w, object);
  load_shown(w, object);
  object.shown.contact = object.touching;
  object.shown.shaped = true;
  warn_of_range(w, object);
  if (object.statics.made())
    object.shown.forces = static_forces(object);
  end_showing(w, object);
}

void show(World& w, Object& object) {
  if (object.body != nullptr || !object.load->empty())
    need_model(object);
  begin_showing(w, object);
  Shown& shown = object.shown;
  const bool acted_on =
      object.statics.made() || (!object.load->empty() && !is_held_altogether(object));
  if (object.method == Method::ffe) {
    shown.contact.clear();
    object.touching.clear();
  }
  if (object.method == Method::ffe && acted_on) {
    load_shown(w, object);
    update_in_time(w, object);
    shown.forces = static_forces(object);
    shown.shaped = false; // computed when it is first read
    // A shape that is never read causes a warning too, if its displaced nodes may leave the range.
    double max = 0;
    for (const auto& [node, d] : shown.load->displacement)
      max = std::max({max, std::abs(d.x), std::abs(d.y), std::abs(d.z)});
    if (!object.range.warned && may_leave_range(object, max))
      shape(w, object);
  } else {
    show_motion(object);
  }
  end_showing(w, object);
}

/// Among the forces that are shown. What holds a displaced node has contact among it.
void add_contact_forces(Object& object) {
  if (object.shown.contact.empty())
    return;
  std::vector<contact::NodeVector>& forces = object.shown.forces.write();
  for (const contact::NodalContactForce& f : object.shown.contact) {
    if (object.method == Method::ffe && object.shown.load->displacement.contains(f.node))
      continue;
    const auto at = std::lower_bound(
        forces.begin(), forces.end(), f.node,
        [](const contact::NodeVector& v, std::uint32_t node) { return v.node < node; });
    if (at != forces.end() && at->node == f.node)
      at->value += f.force;
    else
      forces.insert(at, {f.node, f.force});
  }
}

} // namespace gewebe::scene
