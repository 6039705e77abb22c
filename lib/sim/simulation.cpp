#include "sim/simulation.h"

#include "base/error.h"
#include "base/parallel.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <exception>

namespace gewebe {

namespace {

constexpr double strain_limit = 0.1, turn_limit = 0.2;
constexpr double same_time = 1e-9;          // of a step's length
constexpr double implicit_step = 1.0 / 600; // s, where none is asked for: a tenth of a picture

std::string number_text(double value) {
  std::array<char, 32> text{};
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr};
}

std::string percent(double part) {
  return number_text(std::round(1000 * part) / 10) + " %";
}

} // namespace

struct Simulation::Object {
  std::string name;
  Model model; // never moves: the methods refer to it
  Method method = Method::ela;
  Load load;
  Integration integration = Integration::semi_implicit;
  std::optional<Elastostatic> still;
  Body* body = nullptr;   // of an elastodynamic object
  std::size_t offset = 0; // of its nodes in the body

  std::vector<double> displacement;
  std::vector<NodeVector> forces;
  bool shown = true; // displacement and forces are those of the present state
  double shown_time = 0;
  bool warned_range = false;
};

/// What moves together: one elastodynamic object, or several that are attached to each other.
struct Simulation::Body {
  std::vector<std::size_t> parts; // objects
  std::optional<Model> joined;    // of several; else the object's own
  std::optional<Elastodynamic> moving;
  double safe = 0; // largest stable step
  bool changed = true;
  bool warned_step = false;
  std::uint64_t taken = 0; // by the last advance
  std::exception_ptr failure;
};

Simulation::Simulation(const Context& context, SimulationOptions options)
    : context_(context), options_(std::move(options)) {
  context_.progress = nullptr;
}
Simulation::~Simulation() = default;

void Simulation::add_object(const std::string& name, Model model, Method method,
                            StiffnessParts parts, Integration integration) {
  for (const auto& other : objects_)
    if (other->name == name)
      throw Error("there is an object '" + name + "' already, expected another name");
  auto object = std::make_unique<Object>();
  object->name = name;
  object->model = std::move(model);
  object->method = method;
  object->integration = integration;
  object->displacement.assign(3 * object->model.nodes.size(), 0);
  object->load.gravity = gravity_;
  object->shown = object->load.empty();
  if (method == Method::ffe)
    object->still.emplace(object->model, std::move(parts), context_,
                          ElastostaticOptions{.measure_error = options_.measure_error});
  objects_.push_back(std::move(object));
  if (method == Method::ffe)
    return;
  try {
    bodies_.push_back(make_body({objects_.size() - 1}));
  } catch (...) {
    objects_.pop_back();
    throw;
  }
}

std::unique_ptr<Simulation::Body> Simulation::make_body(std::vector<std::size_t> parts) {
  auto body = std::make_unique<Body>();
  std::vector<std::size_t> offset;
  const Model* model = &objects_[parts[0]]->model;
  if (parts.size() > 1) {
    Model& joined = body->joined.emplace();
    for (const std::size_t part : parts) {
      const Model& from = objects_[part]->model;
      const auto base = static_cast<std::uint32_t>(joined.nodes.size());
      offset.push_back(base);
      joined.nodes.insert(joined.nodes.end(), from.nodes.begin(), from.nodes.end());
      for (Spring s : from.springs) {
        s.i += base;
        s.j += base;
        joined.springs.push_back(s);
      }
      for (Triangle t : from.triangles) {
        for (std::uint32_t& corner : t)
          corner += base;
        joined.triangles.push_back(t);
      }
    }
    model = &joined;
  } else {
    offset.push_back(0);
  }
  std::vector<NodeMotion> motion;
  for (const std::size_t part : parts) {
    const Object& object = *objects_[part];
    if (object.body == nullptr) {
      motion.resize(motion.size() + object.model.nodes.size());
      continue;
    }
    const auto from =
        object.body->moving->motion().subspan(object.offset, object.model.nodes.size());
    motion.insert(motion.end(), from.begin(), from.end());
  }
  for (const Tie& tie : ties_) {
    const auto a = std::find(parts.begin(), parts.end(), tie.object);
    const auto b = std::find(parts.begin(), parts.end(), tie.other);
    if (a == parts.end() || b == parts.end())
      continue;
    const auto index = [&](auto part, std::uint32_t node) {
      return static_cast<std::uint32_t>(offset[static_cast<std::size_t>(part - parts.begin())]) +
             node;
    };
    Spring s{
        index(a, tie.node), index(b, tie.other_node), SpringKind::edge, tie.stiffness, 0, tie.rest};
    const Node &m = body->joined->nodes[s.i], &n = body->joined->nodes[s.j];
    const auto ratio = [&](const Object& o, const Node& node) {
      return o.model.materials[static_cast<std::size_t>(node.material)].damping_ratio;
    };
    const double mass = m.fixed == fixed_all   ? n.mass
                        : n.fixed == fixed_all ? m.mass
                                               : m.mass * (n.mass / (m.mass + n.mass));
    s.damping = (ratio(*objects_[tie.object], m) + ratio(*objects_[tie.other], n)) *
                std::sqrt(s.stiffness * mass);
    if (s.i > s.j)
      std::swap(s.i, s.j);
    body->joined->springs.push_back(s);
  }
  body->moving.emplace(*model, objects_[parts[0]]->integration);
  body->moving->set_motion(motion);
  body->safe = safe_step(*model);
  for (std::size_t k = 0; k < parts.size(); ++k) {
    objects_[parts[k]]->body = body.get();
    objects_[parts[k]]->offset = offset[k];
  }
  body->parts = std::move(parts);
  return body;
}

void Simulation::attach(const Attach& tie) {
  Object &a = *objects_[tie.object], &b = *objects_[tie.other];
  const auto place = [](const Object& o, std::uint32_t node) {
    return o.model.nodes[node].position + o.body->moving->motion()[o.offset + node].displacement;
  };
  for (const std::uint32_t node : tie.nodes) {
    const Vec3 here = place(a, node);
    std::uint32_t nearest = tie.others[0];
    double least = HUGE_VAL;
    for (const std::uint32_t other : tie.others) {
      const Vec3 d = place(b, other) - here;
      if (dot(d, d) < least) {
        least = dot(d, d);
        nearest = other;
      }
    }
    ties_.push_back({tie.object, tie.other, node, nearest, tie.stiffness, std::sqrt(least)});
  }
  std::vector<std::size_t> parts = a.body->parts;
  if (a.body != b.body)
    parts.insert(parts.end(), b.body->parts.begin(), b.body->parts.end());
  std::sort(parts.begin(), parts.end());
  const Body *const first = a.body, *const second = b.body;
  std::unique_ptr<Body> body = make_body(std::move(parts));
  std::erase_if(bodies_,
                [&](const auto& old) { return old.get() == first || old.get() == second; });
  bodies_.push_back(std::move(body));
}

const std::string& Simulation::name(std::size_t object) const {
  return objects_.at(object)->name;
}

const Model& Simulation::model(std::size_t object) const {
  return objects_.at(object)->model;
}

Method Simulation::method(std::size_t object) const {
  return objects_.at(object)->method;
}

std::size_t Simulation::find(const std::string& name) const {
  std::string list;
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    if (objects_[i]->name == name)
      return i;
    list += (list.empty() ? "" : ", ") + objects_[i]->name;
  }
  throw Error("there is no object '" + name + "', expected " +
              (list.empty() ? "an object command first" : "one of " + list));
}

void Simulation::check(const Change& change) const {
  if (const auto* const tie = std::get_if<Attach>(&change)) {
    const Object &a = *objects_.at(tie->object), &b = *objects_.at(tie->other);
    for (const Object* const o : {&a, &b})
      if (o->method != Method::ela)
        throw Error("object " + o->name +
                    " is elastostatic (ffe) and has no motion to tie, expected ela objects");
    if (&a == &b)
      throw Error("object " + a.name + " can't be attached to itself, expected two objects");
    if (a.integration != b.integration)
      throw Error("one of " + a.name + " and " + b.name +
                  " is implicit and the other is not, expected both alike");
    return;
  }
  const auto* const set = std::get_if<SetDisplacement>(&change);
  if (set == nullptr)
    return;
  const Model& model = objects_.at(set->object)->model;
  for (const std::uint32_t node : set->nodes)
    for (int a = 0; a < 3; ++a)
      if (is_fixed(model, node, a) && set->displacement[a] != 0)
        throw Error("node " + std::to_string(node) + " is fixed along " + "xyz"[a] +
                    ", expected a displacement of 0 there");
}

void Simulation::apply(const Change& change) {
  check(change);
  Object* touched = nullptr;
  if (const auto* const force = std::get_if<SetForce>(&change)) {
    touched = objects_.at(force->object).get();
    for (const std::uint32_t node : force->nodes) {
      touched->load.force_period.erase(node);
      if (force->force == Vec3{}) {
        touched->load.force.erase(node);
        continue;
      }
      touched->load.force[node] = force->force;
      if (force->period > 0)
        touched->load.force_period[node] = force->period;
    }
  } else if (const auto* const press = std::get_if<SetPressure>(&change)) {
    touched = objects_.at(press->object).get();
    for (const std::uint32_t node : press->nodes)
      if (press->pressure.pressure == 0)
        touched->load.pressure.erase(node);
      else
        touched->load.pressure[node] = press->pressure;
  } else if (const auto* const set = std::get_if<SetDisplacement>(&change)) {
    touched = objects_.at(set->object).get();
    displace(*touched, *set);
  } else if (const auto* const tie = std::get_if<Attach>(&change)) {
    attach(*tie);
  } else if (const auto* const release = std::get_if<Release>(&change)) {
    touched = objects_.at(release->object).get();
    for (const std::uint32_t node : release->nodes) {
      touched->load.force.erase(node);
      touched->load.force_period.erase(node);
      touched->load.pressure.erase(node);
      touched->load.displacement.erase(node);
      touched->load.travel.erase(node);
    }
  } else if (const auto* const pull = std::get_if<SetGravity>(&change)) {
    gravity_ = pull->gravity;
    for (const auto& object : objects_) {
      object->load.gravity = gravity_;
      object->shown = false;
      if (object->body != nullptr)
        object->body->changed = true;
    }
  } else if (const auto* const wish = std::get_if<SetTimestep>(&change)) {
    timestep_ = wish->dt;
  } else if (std::get<Emit>(change).forces) {
    emit_forces_ = true;
  } else {
    emit_shapes_ = true;
  }
  if (touched == nullptr)
    return;
  touched->shown = false;
  if (touched->body != nullptr)
    touched->body->changed = true;
}

void Simulation::displace(Object& object, const SetDisplacement& set) {
  for (const std::uint32_t node : set.nodes) {
    Vec3 from;
    if (object.body != nullptr)
      from = object.body->moving->motion()[object.offset + node].displacement;
    else if (const auto old = object.load.displacement.find(node);
             old != object.load.displacement.end())
      from = old->second;
    object.load.displacement[node] = set.displacement;
    object.load.travel.erase(node);
    if (set.over > 0)
      object.load.travel[node] = {from, set.displacement, time_, time_ + set.over};
  }
}

void Simulation::schedule(double time, const Change& change) {
  if (!(time >= time_))
    throw Error("the time " + number_text(time) + " s is past, expected " + number_text(time_) +
                " s or later");
  if (time == time_) {
    apply(change);
    return;
  }
  check(change);
  events_.emplace(time, Event{change});
}

void Simulation::schedule_every(double period, const Change& change) {
  check(change);
  events_.emplace(time_ + period, Event{change, time_, period, 1});
}

std::size_t Simulation::pending() const noexcept {
  return static_cast<std::size_t>(std::count_if(
      events_.begin(), events_.end(), [](const auto& e) { return e.second.period == 0; }));
}

void Simulation::step(double dt) {
  // Neumaier's sum: ten steps of 0.1 s end at 1 s.
  const double sum = sum_ + dt;
  const double lost = lost_ + (sum_ >= dt ? (sum_ - sum) + dt : (dt - sum) + sum_);
  advance(std::max(sum + lost, time_));
  sum_ = sum;
  lost_ = lost;
}

void Simulation::step_to(double time) {
  if (!(time >= time_))
    throw Error("the time " + number_text(time) + " s is past, expected " + number_text(time_) +
                " s or later");
  advance(time);
  sum_ = time;
  lost_ = 0;
}

template <class Work>
void Simulation::at_object(const Object& object, Work&& work) {
  try {
    work();
  } catch (const Cancelled&) {
    throw;
  } catch (const Error& error) {
    throw Error("object " + object.name + " at " + number_text(time_) +
                " s: " + (error.place().empty() ? "" : error.place() + ": ") + error.what());
  }
}

double Simulation::integration_step(Body& body) {
  if (objects_[body.parts[0]]->integration == Integration::implicit)
    return timestep_.value_or(implicit_step);
  const double usual = safe_step_fraction * body.safe;
  if (!timestep_)
    return usual;
  if (*timestep_ <= body.safe)
    return *timestep_;
  if (!body.warned_step && options_.warn)
    options_.warn("object " + objects_[body.parts[0]]->name + ": the timestep " +
                  number_text(*timestep_) + " s is beyond the safe " + number_text(body.safe) +
                  " s, it takes smaller ones");
  body.warned_step = true;
  return usual;
}

void Simulation::move_bodies(double to) {
  const double duration = to - time_;
  for (const auto& body : bodies_) {
    if (!body->changed)
      continue;
    Load load; // of all parts
    for (const std::size_t part : body->parts) {
      const Object& object = *objects_[part];
      const auto add = [&](const auto& from, auto& all) {
        for (const auto& [node, value] : from)
          all[static_cast<std::uint32_t>(object.offset) + node] = value;
      };
      add(object.load.force, load.force);
      add(object.load.displacement, load.displacement);
      add(object.load.force_period, load.force_period);
      add(object.load.pressure, load.pressure);
      add(object.load.travel, load.travel);
      load.gravity = object.load.gravity;
    }
    body->moving->set_load(load, time_);
    body->changed = false;
  }
  if (!(duration > 0))
    return;
  std::vector<Body*> awake;
  std::vector<double> step;
  for (const auto& body : bodies_) {
    body->taken = 0;
    if (body->moving->resting())
      continue;
    awake.push_back(body.get());
    step.push_back(integration_step(*body));
  }
  // One body has all threads, several have one each.
  Context context = context_;
  if (awake.size() > 1)
    context.threads = 1;
  parallel_blocks(context_, awake.size(), 1, [&](std::size_t k, std::size_t) {
    try {
      awake[k]->taken = awake[k]->moving->advance(duration, step[k], context, time_);
    } catch (...) {
      awake[k]->failure = std::current_exception();
    }
  });
  for (Body* const body : awake)
    if (body->failure)
      raise(*body);
  for (const auto& body : bodies_)
    for (const std::size_t part : body->parts) {
      counts_.integration += body->taken;
      counts_.resting += body->taken == 0 ? 1 : 0;
      counts_.moving += body->taken == 0 ? 0 : 1;
      objects_[part]->shown = objects_[part]->shown && body->taken == 0;
    }
}

/// What ended a body's motion, with its object's name.
void Simulation::raise(const Body& body) const {
  const auto owner = [&](std::uint32_t node) {
    std::size_t found = body.parts[0];
    for (const std::size_t part : body.parts)
      if (objects_[part]->offset <= node)
        found = part;
    return found;
  };
  try {
    std::rethrow_exception(body.failure);
  } catch (const Cancelled&) {
    throw;
  } catch (const MotionError& error) {
    const Object& object = *objects_[owner(error.node())];
    throw Error("object " + object.name + " at " + number_text(error.time()) + " s: node " +
                std::to_string(error.node() - object.offset) + " " + error.what());
  } catch (const Error& error) {
    throw Error("object " + objects_[body.parts[0]]->name + " at " + number_text(time_) +
                " s: " + error.what());
  }
}

void Simulation::advance(double to) {
  const double slack = same_time * (to - time_);
  const auto move_to = [&](double time) {
    move_bodies(time);
    time_ = std::max(time_, time);
  };
  while (!events_.empty() && events_.begin()->first <= to + slack) {
    move_to(std::min(events_.begin()->first, to));
    Event event = std::move(events_.begin()->second);
    events_.erase(events_.begin());
    apply(event.change);
    if (event.period > 0) {
      ++event.round;
      const double next = event.origin + event.round * event.period;
      if (!(next > time_))
        throw Error("the period " + number_text(event.period) +
                    " s is lost in the rounding of the time, expected a longer one");
      events_.emplace(next, std::move(event));
    }
  }
  move_to(to);
  for (const auto& object : objects_)
    if (!object->shown || (object->still && object->load.changes_until() > object->shown_time))
      at_object(*object, [&] { show(*object); });
  ++counts_.steps;
}

void Simulation::show(Object& object) {
  if (object.still) {
    object.still->update(load_at(object.load, object.model, time_));
    const std::span<const double> u = object.still->displacement();
    object.displacement.assign(u.begin(), u.end());
    object.forces = object.still->contact_forces();
    if (!object.warned_range)
      warn_of_range(object);
  } else {
    const std::span<const NodeMotion> motion =
        object.body->moving->motion().subspan(object.offset, object.model.nodes.size());
    for (std::size_t i = 0; i < motion.size(); ++i)
      for (int a = 0; a < 3; ++a)
        object.displacement[3 * i + static_cast<std::size_t>(a)] = motion[i].displacement[a];
    object.forces.clear();
    for (const NodeVector& f : object.body->moving->contact_forces())
      if (f.node >= object.offset && f.node - object.offset < object.model.nodes.size())
        object.forces.push_back({f.node - static_cast<std::uint32_t>(object.offset), f.value});
  }
  object.shown_time = time_;
  object.shown = true;
}

void Simulation::warn_of_range(Object& object) {
  const LinearRange range = linear_range(object.model, object.displacement);
  const bool strained = !(range.strain <= strain_limit), turned = !(range.turn <= turn_limit);
  if (!strained && !turned)
    return;
  object.warned_range = true;
  if (!options_.warn)
    return;
  const Spring& spring = object.model.springs[strained ? range.strain_spring : range.turn_spring];
  options_.warn("object " + object.name + " at " + number_text(time_) +
                " s: beyond the linear range, the edge " + std::to_string(spring.i) + "-" +
                std::to_string(spring.j) +
                (strained ? " is strained by " + percent(range.strain)
                          : " is turned by " + percent(range.turn)) +
                ", the shape is not to be trusted there");
}

std::span<const double> Simulation::displacement(std::size_t object) const {
  return objects_.at(object)->displacement;
}

const std::vector<NodeVector>& Simulation::contact_forces(std::size_t object) const {
  return objects_.at(object)->forces;
}

SimulationCounts Simulation::counts() const {
  SimulationCounts all = counts_;
  ElastostaticCounts& sum = all.elastostatic;
  for (const auto& object : objects_) {
    if (!object->still)
      continue;
    const ElastostaticCounts& c = object->still->counts();
    sum.updates += c.updates;
    sum.unchanged += c.unchanged;
    sum.solves += c.solves;
    sum.columns_read += c.columns_read;
    sum.factors += c.factors;
    sum.backward_error = std::max(sum.backward_error, c.backward_error);
    sum.contact_error = std::max(sum.contact_error, c.contact_error);
  }
  return all;
}

SimulationState Simulation::state() const {
  SimulationState state;
  for (const auto& object : objects_) {
    state.strain = std::max(state.strain, linear_range(object->model, object->displacement).strain);
    if (object->body == nullptr)
      continue;
    const auto motion =
        object->body->moving->motion().subspan(object->offset, object->model.nodes.size());
    state.kinetic_energy += kinetic_energy(object->model, motion);
    state.elastic_energy += elastic_energy(object->model, motion);
    state.safe_step = std::min(state.safe_step, object->body->safe);
  }
  return state;
}

} // namespace gewebe
