// Bodies: what moves as one.

#include "base/parallel.h"
#include "scene/rules_internal.h"

#include <algorithm>
#include <any>
#include <cmath>
#include <memory>
#include <set>
#include <tuple>
#include <utility>

namespace gewebe::scene {

namespace {

constexpr double worth_implicit = 20;       ///< explicit steps for one implicit one
constexpr double implicit_step = 1.0 / 600; // s, default: a tenth of a frame

} // namespace

model::Model joined_model(const World& w, std::span<const std::size_t> parts,
                          std::vector<std::size_t>& offset) {
  model::Model all;
  for (const std::size_t part : parts) {
    const model::Model& from = w.now.objects[part].model();
    const auto base = static_cast<std::uint32_t>(all.nodes.size());
    offset.push_back(base);
    all.nodes.insert(all.nodes.end(), from.nodes.begin(), from.nodes.end());
    for (const auto& [node, mass] : *w.now.objects[part].hung)
      all.nodes[base + node].mass += mass;
    for (model::Spring s : from.springs) {
      s.i += base;
      s.j += base;
      all.springs.push_back(s);
    }
    const auto shifted = [&](auto corners) {
      for (std::uint32_t& corner : corners)
        corner += base;
      return corners;
    };
    for (const Triangle& t : from.triangles)
      all.triangles.push_back(shifted(t));
    for (const Tetrahedron& t : from.tetrahedra)
      all.tetrahedra.push_back(shifted(t));
    for (const EdgeMiddles& middles : from.middles)
      all.middles.push_back(shifted(middles));
    const auto materials = static_cast<std::int32_t>(all.materials.size());
    all.materials.insert(all.materials.end(), from.materials.begin(), from.materials.end());
    for (const std::int32_t material : from.tetrahedron_material)
      all.tetrahedron_material.push_back(materials + material);
    for (std::size_t i = base; i < all.nodes.size(); ++i)
      all.nodes[i].material += materials;
  }
  return all;
}

model::Model weighed_model(const Object& object) {
  model::Model model = object.model();
  for (const auto& [node, mass] : *object.hung)
    model.nodes[node].mass += mass;
  return model;
}

namespace {

void add_ties(const World& w, const std::vector<std::size_t>& parts,
              const std::vector<std::size_t>& offset, model::Model& all) {
  for (const Tie& tie : w.now.ties) {
    const auto a = std::find(parts.begin(), parts.end(), tie.object);
    const auto b = std::find(parts.begin(), parts.end(), tie.other);
    if (a == parts.end() || b == parts.end())
      continue;
    const auto index = [&](auto part, std::uint32_t node) {
      return static_cast<std::uint32_t>(offset[static_cast<std::size_t>(part - parts.begin())]) +
             node;
    };
    model::Spring s{index(a, tie.node),
                    index(b, tie.other_node),
                    model::SpringKind::edge,
                    tie.stiffness,
                    0,
                    tie.rest};
    const model::Node &m = all.nodes[s.i], &n = all.nodes[s.j];
    const auto ratio = [&](const model::Node& node) {
      return all.materials[static_cast<std::size_t>(node.material)].damping_ratio;
    };
    const double mass = m.fixed == model::fixed_all   ? n.mass
                        : n.fixed == model::fixed_all ? m.mass
                                                      : m.mass * (n.mass / (m.mass + n.mass));
    s.damping = (ratio(m) + ratio(n)) * std::sqrt(s.stiffness * mass);
    if (s.i > s.j)
      std::swap(s.i, s.j);
    all.springs.push_back(s);
  }
}

} // namespace

double integration_step(World& w, Body& body) {
  const std::optional<double> wish = w.now.settings.timestep;
  if (moves_implicitly(w.now.objects[body.parts[0]]))
    return wish.value_or(implicit_step);
  if (w.now.settings.order > 1)
    throw Error("object " + w.now.objects[body.parts[0]].name() +
                ": moves by explicit steps, which are of first order, expected "
                "integration=implicit or auto for order=2");
  const double usual = dynamics::safe_step_fraction * body.safe;
  if (!wish)
    return usual;
  if (*wish <= body.safe)
    return *wish;
  if (!body.warned_step && w.options.warn)
    w.options.warn("object " + w.now.objects[body.parts[0]].name() + ": the timestep " +
                   text::number_text(*wish) + " s is beyond the safe " +
                   text::number_text(body.safe) + " s, it takes smaller ones");
  body.warned_step = true;
  return usual;
}

void load_body(const World& w, Body& body) {
  contact::Load load;
  for (const std::size_t part : body.parts) {
    const Object& object = w.now.objects[part];
    const auto add = [&](const auto& from, auto& all) {
      for (const auto& [node, value] : from)
        all[static_cast<std::uint32_t>(object.offset) + node] = value;
    };
    add(object.load->force, load.force);
    add(object.load->displacement, load.displacement);
    add(object.load->force_period, load.force_period);
    add(object.load->pressure, load.pressure);
    add(object.load->ramp, load.ramp);
    load.gravity = object.load->gravity;
  }
  body.moving->set_load(load, w.now.clock.time);
  body.changed = false;
}

void raise(const World& w, const Body& body) {
  const auto owner = [&](std::uint32_t node) {
    std::size_t found = body.parts[0];
    for (const std::size_t part : body.parts)
      if (w.now.objects[part].offset <= node)
        found = part;
    return found;
  };
  try {
    std::rethrow_exception(body.failure);
  } catch (const Cancelled&) {
    throw;
  } catch (const dynamics::MotionError& error) {
    const Object& object = w.now.objects[owner(error.node())];
    throw Error("object " + object.name() + " at " + text::number_text(error.time()) + " s: node " +
                std::to_string(error.node() - object.offset) + " " + error.what());
  } catch (const ObjectError&) { // of one beside it
    throw;
  } catch (const Error& error) {
    throw Error("object " + w.now.objects[body.parts[0]].name() + " at " +
                text::number_text(w.now.clock.time) + " s: " + error.what());
  }
}

std::span<const dynamics::NodeMotion> motion_of(const Object& object) {
  return object.body->moving->motion().subspan(object.offset, object.model().nodes.size());
}

namespace {

/// What moves a body of this model: by the steps of a solid if one of its parts is one.
std::unique_ptr<dynamics::BodyMotion>
motion_for(const World& w, const std::vector<std::size_t>& parts, const model::Model& model) {
  const auto solid =
      std::ranges::find_if(parts, [&](std::size_t part) { return is_solid(w.now.objects[part]); });
  const Object& object = w.now.objects[solid != parts.end() ? *solid : parts[0]];
  if (solid == parts.end()) {
    if (object.matter->solid.said())
      throw Error("object " + object.name() +
                  " has no tetrahedra, expected a solid for law=, damping= and tolerance=");
    if (!moves_implicitly(object) && object.matter->solid.bulk)
      throw Error("object " + object.name() +
                  " moves by explicit steps, expected integration=implicit or auto for bulk=");
    if (!moves_implicitly(object))
      return std::make_unique<dynamics::Elastodynamic>(model);
  }
  try {
    return std::make_unique<dynamics::SolidDynamic>(model, object.matter->solid, w.context);
  } catch (const Cancelled&) {
    throw;
  } catch (const Error& error) {
    throw Error("object " + object.name() + ": " + error.what());
  }
}

/// How it moves from now on, where it is free to choose: by steps of solids where explicit ones
/// would be many for each.
Integration chosen_integration(const World& w, const Object& object) {
  if (object.integration != Integration::automatic)
    return object.integration;
  const double wish = w.now.settings.timestep.value_or(implicit_step);
  const bool asks = object.matter->solid.bulk.has_value();
  return !is_solid(object) && (asks || w.now.settings.order > 1 ||
                               model::safe_step(object.model()) * worth_implicit < wish)
             ? Integration::implicit
             : Integration::semi_implicit;
}

bool moves_implicitly(const Object& object, Integration way) {
  return way == Integration::implicit || is_solid(object);
}

/// Integration of two objects that are to be attached. An object with automatic integration takes
/// that of the other one. If both are automatic, both are implicit if one alone would be.
std::pair<Integration, Integration> chosen_together(const World& w, const Object& a,
                                                    const Object& b) {
  const bool is_free = a.integration == Integration::automatic,
             other_is = b.integration == Integration::automatic;
  Integration way = chosen_integration(w, a), other_way = chosen_integration(w, b);
  const auto follow = [](const Object& one, Integration& its, bool implicitly) {
    if (!is_solid(one))
      its = implicitly ? Integration::implicit : Integration::semi_implicit;
  };
  if (is_free && (!other_is || moves_implicitly(b, other_way)))
    follow(a, way, moves_implicitly(b, other_way));
  else if (other_is)
    follow(b, other_way, moves_implicitly(a, way));
  return {way, other_way};
}

} // namespace

/// \param motions of parts, by object; none: as they move now
std::shared_ptr<Body> make_body(World& w, std::vector<std::size_t> parts, const Motions* motions) {
  auto body = std::make_shared<Body>();
  std::vector<std::size_t> offset;
  if (parts.size() > 1) {
    model::Model all = joined_model(w, parts, offset);
    add_ties(w, parts, offset, all);
    body->model = std::make_shared<const model::Model>(std::move(all));
  } else {
    offset.push_back(0);
    const Object& object = w.now.objects[parts[0]];
    body->model = object.hung->empty()
                      ? object.matter->model
                      : std::make_shared<const model::Model>(weighed_model(object));
  }
  std::vector<dynamics::NodeMotion> motion;
  for (const std::size_t part : parts) {
    Object& object = w.now.objects[part];
    object.integration = chosen_integration(w, object);
    if (motions == nullptr && object.body == nullptr) {
      motion.resize(motion.size() + object.model().nodes.size());
      continue;
    }
    const std::span<const dynamics::NodeMotion> from =
        motions != nullptr ? std::span<const dynamics::NodeMotion>(motions->at(part))
                           : motion_of(object);
    motion.insert(motion.end(), from.begin(), from.end());
  }
  const Object& first = w.now.objects[parts[0]];
  body->moving = motion_for(w, parts, *body->model);
  body->moving->set_motion(motion);
  body->safe = moves_implicitly(first) ? HUGE_VAL : model::safe_step(*body->model);
  for (std::size_t k = 0; k < parts.size(); ++k) {
    w.now.objects[parts[k]].body = body;
    w.now.objects[parts[k]].offset = offset[k];
  }
  body->parts = std::move(parts);
  return body;
}

/// An elastodynamic object has a body from when something first acts on it.
void need_body(World& w, std::size_t object) {
  if (w.now.objects[object].body != nullptr)
    return;
  need_model(w.now.objects[object]);
  w.now.bodies.push_back(make_body(w, {object}));
}

void add_counts(dynamics::SolidStepCounts& sum, const dynamics::SolidStepCounts& more) {
  sum.steps += more.steps;
  sum.rounds += more.rounds;
  sum.factors += more.factors;
  sum.unfinished += more.unfinished;
  sum.limited += more.limited;
  sum.seconds += more.seconds;
}

void drop_body(World& w, const Body* body) {
  std::erase_if(w.now.bodies, [&](const auto& one) { return one.get() == body; });
}

void make_body_again(World& w, std::size_t object) {
  const std::shared_ptr<Body> before = w.now.objects[object].body;
  Motions motions;
  for (const std::size_t part : before->parts) {
    const std::span<const dynamics::NodeMotion> motion = motion_of(w.now.objects[part]);
    motions[part].assign(motion.begin(), motion.end());
  }
  const std::shared_ptr<Body> next = make_body(w, before->parts, &motions);
  next->moving->remember(before->moving->memory());
  std::ranges::replace(w.now.bodies, before, next);
}

void make_implicit(World& w, std::shared_ptr<Body>& body) {
  const std::shared_ptr<Body> before = body;
  Motions motions;
  for (const std::size_t part : before->parts) {
    Object& object = w.now.objects[part];
    const std::span<const dynamics::NodeMotion> motion = motion_of(object);
    motions[part].assign(motion.begin(), motion.end());
    object.integration = Integration::implicit;
  }
  body = make_body(w, before->parts, &motions);
  std::ranges::replace(w.now.bodies, before, body);
}

void advance_freely(World& w, std::span<Body* const> bodies, double to) {
  const double duration = to - w.now.clock.time;
  std::vector<Body*> awake;
  std::vector<double> step;
  for (Body* const body : bodies) {
    if (body->moving->resting())
      continue;
    body->rest_extents.clear();
    awake.push_back(body);
    step.push_back(integration_step(w, *body));
  }
  // One body has all threads, several have one each.
  Context context = w.context;
  if (awake.size() > 1)
    context.threads = 1;
  parallel_blocks(w.context, awake.size(), 1, [&](std::size_t k, std::size_t) {
    try {
      awake[k]->taken = awake[k]->moving->advance(duration, {step[k], w.now.settings.order},
                                                  context, w.now.clock.time);
    } catch (...) {
      awake[k]->failure = std::current_exception();
    }
  });
  for (Body* const body : awake)
    if (body->failure)
      raise(w, *body);
}

// ---- attachments

void require_like_solids(const World& w, std::span<const std::size_t> objects) {
  const Object* first = nullptr;
  for (const std::size_t index : objects) {
    const Object& object = w.now.objects[index];
    if (!object.matter->known || !is_solid(object) || object.method == Method::ffe)
      continue;
    if (first == nullptr)
      first = &object;
    const std::string both = "of " + first->name() + " and " + object.name();
    if (first->model().middles.empty() != object.model().middles.empty())
      throw Error("one " + both + " is linear and the other quadratic, expected both alike");
    if (!(first->matter->solid == object.matter->solid))
      throw Error("law=, damping= and tolerance= " + both + " differ, expected both alike");
  }
}

void Rule<Attach>::check(World& w, const Attach& c) {
  Object &a = w.now.objects.at(c.object), &b = w.now.objects.at(c.other);
  for (Object* const o : {&a, &b}) {
    need_model(*o);
    require_support(w, *o, Feature::attach);
  }
  if (&a == &b)
    throw Error("object " + a.name() + " can't be attached to itself, expected two objects");
  const auto [way, other_way] = chosen_together(w, a, b);
  if (moves_implicitly(a, way) != moves_implicitly(b, other_way))
    throw Error("one of " + a.name() + " and " + b.name() +
                " is implicit and the other is not, expected both alike");
  std::vector<std::size_t> all = together(w, c.object);
  const std::vector<std::size_t> others = together(w, c.other);
  all.insert(all.end(), others.begin(), others.end());
  require_like_solids(w, all);
}

void Rule<Attach>::enter(World& w, const Attach& c) {
  Object &a = w.now.objects.at(c.object), &b = w.now.objects.at(c.other);
  std::tie(a.integration, b.integration) = chosen_together(w, a, b);
}

void Rule<Attach>::apply(World& w, const Attach& c) {
  need_body(w, c.object);
  need_body(w, c.other);
  Object &a = w.now.objects[c.object], &b = w.now.objects[c.other];
  const std::size_t ties = w.now.ties.size();
  const auto position = [](const Object& o, std::uint32_t node) {
    return o.model().nodes[node].position + motion_of(o)[node].displacement;
  };
  for (const std::uint32_t node : c.nodes) {
    const Vec3 here = position(a, node);
    std::uint32_t nearest = c.others[0];
    double min = HUGE_VAL;
    for (const std::uint32_t other : c.others) {
      const Vec3 d = position(b, other) - here;
      if (dot(d, d) < min) {
        min = dot(d, d);
        nearest = other;
      }
    }
    w.now.ties.push_back({c.object, c.other, node, nearest, c.stiffness, std::sqrt(min)});
  }
  std::vector<std::size_t> parts = a.body->parts;
  if (a.body != b.body)
    parts.insert(parts.end(), b.body->parts.begin(), b.body->parts.end());
  std::sort(parts.begin(), parts.end());
  const std::shared_ptr<Body> first = a.body, second = b.body;
  std::shared_ptr<Body> body;
  try {
    body = make_body(w, std::move(parts));
  } catch (...) {
    w.now.ties.resize(ties);
    throw;
  }
  drop_body(w, first.get());
  drop_body(w, second.get());
  w.now.bodies.push_back(std::move(body));
}

void Rule<Attach>::log(const World&, const Attach& c, ChangeRow& row) {
  row.what = "attach";
  row.value = c.stiffness;
}

} // namespace gewebe::scene
