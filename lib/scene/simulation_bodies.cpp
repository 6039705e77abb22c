// Bodies: what is tied together and moves as one.

#include "base/parallel.h"
#include "scene/simulation_internal.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <tuple>
#include <utility>

namespace gewebe {

using simulation::number_text;

namespace {

constexpr double implicit_step = 1.0 / 600; // s, where none is asked for: a tenth of a picture

} // namespace

/// \param motions of parts, by object; none: as they move now
std::unique_ptr<Simulation::Body> Simulation::make_body(std::vector<std::size_t> parts,
                                                        const Motions* motions) {
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
    if (motions != nullptr) {
      motion.insert(motion.end(), motions->at(part).begin(), motions->at(part).end());
      continue;
    }
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
  need_body(tie.object);
  need_body(tie.other);
  Object &a = *objects_[tie.object], &b = *objects_[tie.other];
  const std::size_t ties = ties_.size();
  const auto position = [](const Object& o, std::uint32_t node) {
    return o.model.nodes[node].position + o.body->moving->motion()[o.offset + node].displacement;
  };
  for (const std::uint32_t node : tie.nodes) {
    const Vec3 here = position(a, node);
    std::uint32_t nearest = tie.others[0];
    double least = HUGE_VAL;
    for (const std::uint32_t other : tie.others) {
      const Vec3 d = position(b, other) - here;
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
  for (Body* const body : {a.body, b.body})
    gather_impulses(*body);
  const Body *const first = a.body, *const second = b.body;
  std::unique_ptr<Body> body;
  std::vector<std::pair<Object*, std::pair<Body*, std::size_t>>> were;
  for (const std::size_t part : parts)
    were.push_back({objects_[part].get(), {objects_[part]->body, objects_[part]->offset}});
  try {
    body = make_body(std::move(parts));
  } catch (...) {
    ties_.resize(ties);
    throw;
  }
  // Back in their places, for what was noted before counts on the order.
  for (const Body* const gone : {first, second}) {
    const auto at = std::find_if(bodies_.begin(), bodies_.end(),
                                 [&](const auto& one) { return one.get() == gone; });
    if (at == bodies_.end())
      continue; // both are one
    // Shared, for what can be called can be copied.
    undo_->note([this, place = at - bodies_.begin(),
                 old = std::make_shared<std::unique_ptr<Body>>(std::move(*at))] {
      bodies_.insert(bodies_.begin() + place, std::move(*old));
    });
    bodies_.erase(at);
  }
  bodies_.push_back(std::move(body));
  undo_->note([this, were] {
    bodies_.pop_back();
    for (const auto& [object, place] : were)
      std::tie(object->body, object->offset) = place;
  });
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
  for (std::size_t i = 0; i < objects_.size(); ++i)
    if (objects_[i]->method == Method::ela && (!objects_[i]->load.empty() || instruments_there()))
      need_body(i);
  for (const auto& body : bodies_) {
    if (!body->changed)
      continue;
    keep_body(*body);
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
    keep_body(*body);
    guide(*body, to);
    if (body->moving->resting()) {
      body->moving->rest_on(duration);
      continue;
    }
    keep_body(*body);
    body->rest_box.reset();
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
  end_guiding(to);
  for (const auto& object : objects_)
    counts_.resting += object->method == Method::ela && object->body == nullptr ? 1 : 0;
  for (const auto& body : bodies_) {
    for (const std::size_t part : body->parts) {
      counts_.integration += body->taken;
      counts_.resting += body->taken == 0 ? 1 : 0;
      counts_.moving += body->taken == 0 ? 0 : 1;
      objects_[part]->shown = objects_[part]->shown && body->taken == 0;
    }
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

} // namespace gewebe
