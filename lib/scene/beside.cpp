// Elastostatic objects that may touch what moves: they stand beside its body, whose steps find
// their shapes with its own (dynamics/standing.h). Their loads go their way in the course of a
// step; they are shown at its end.

#include "base/vector_at.h"
#include "dynamics/standing.h"
#include "scene/static_members_internal.h"

#include <algorithm>
#include <optional>
#include <utility>

namespace gewebe::simulation {

/// Those beside a body, on its way.
class BesideBody final : public Standing {
public:
  /// Keeps a reference to the scene. \param objects as they are shown
  BesideBody(World& w, std::vector<std::size_t> objects) : w_(w), objects_(std::move(objects)) {
    for (const std::size_t index : objects_)
      known_.push_back(w_.now.objects[index].shown.displacement->size());
  }

  /// \param shape the present one of all
  void begin(double from, double to, std::span<const double> shape) {
    from_ = from;
    to_ = to;
    before_.clear();
    next_.clear();
    std::vector<Object*> objects;
    std::size_t first = 0;
    for (const std::size_t index : objects_) {
      Object& object = w_.now.objects[index];
      const std::size_t count = 3 * object.model().nodes.size();
      object.statics->ahead = true;
      next_.push_back(load_at(*object.load, object.model(), to));
      before_.push_back(object.stood_under ? load_from(*object.stood_under,
                                                       shape.subspan(first, count), next_.back())
                                           : load_before(object, next_.back()));
      first += count;
      objects.push_back(&object);
    }
    changes_ = before_ != next_;
    members_.emplace(w_, std::move(objects));
  }
  void end() {
    for (std::size_t k = 0; k < objects_.size(); ++k)
      w_.now.objects[objects_[k]].stood_under = std::make_shared<const Load>(next_[k]);
    members_.reset();
  }
  /// Of an object, the first ones of so many numbers, which are known.
  std::size_t known(std::size_t k) const { return known_[k]; }

  std::unique_ptr<Yielding> yielding(double time, std::span<const NodeTouch> last) override {
    set_loads(time);
    return std::make_unique<Kept>(*members_, last, known_);
  }
  bool solved() const override { return members_->solved(); }
  std::map<std::uint32_t, Vec3> displaced(double time) override {
    set_loads(time);
    return members_->displaced();
  }
  bool changes(double from, double to) const override {
    return from < to && from < to_ && changes_;
  }

private:
  /// Notes how much it knows.
  class Kept final : public Yielding {
  public:
    Kept(StaticMembers& members, std::span<const NodeTouch> last, std::vector<std::size_t>& known)
        : all_(members.joined(last)), known_(known) {}
    DelassusOperator delassus_operator(std::span<const std::uint32_t> nodes) override {
      return all_.delassus_operator(nodes);
    }
    bool push(std::span<const NodeTouch> touches, std::span<const Vec3> at) override {
      return all_.push(touches, at);
    }
    std::span<const double> shape() override {
      const std::span<const double> u = all_.shape();
      for (std::size_t k = 0; k < known_.size(); ++k)
        known_[k] = std::max(known_[k], all_.known(k));
      return u;
    }

  private:
    JoinedYielding all_;
    std::vector<std::size_t>& known_;
  };

  void set_loads(double time) {
    const double part = time < to_ ? std::max(0.0, (time - from_) / (to_ - from_)) : 1;
    std::vector<Load> loads;
    for (std::size_t k = 0; k < objects_.size(); ++k)
      loads.push_back(load_between(before_[k], next_[k], part));
    members_->set_loads(std::move(loads));
  }

  World& w_;
  std::vector<std::size_t> objects_;
  std::vector<std::size_t> known_;
  double from_ = 0, to_ = 0; ///< of a way
  std::vector<Load> before_, next_;
  bool changes_ = false;                 ///< whether these differ
  std::optional<StaticMembers> members_; ///< during a way
};

namespace {

std::size_t place_in(const Body& body, const World& w, const Object& object) {
  return static_cast<std::size_t>(
      std::ranges::find(body.beside, &object,
                        [&](std::size_t index) { return &w.now.objects[index]; }) -
      body.beside.begin());
}

/// Its first node among those beside a body.
std::uint32_t first_of(const Body& body, const World& w, std::size_t k) {
  std::size_t first = 0;
  for (std::size_t before = 0; before < k; ++before)
    first += w.now.objects[body.beside[before]].model().nodes.size();
  return static_cast<std::uint32_t>(first);
}

/// As its body's last step has left it. \return what touches it
std::vector<NodeTouch> take_standing(const World& w, Object& object) {
  const Body& body = *object.beside;
  const std::size_t k = place_in(body, w, object);
  const std::uint32_t first = first_of(body, w, k);
  const auto count = static_cast<std::uint32_t>(object.model().nodes.size());
  const std::span<const double> own =
      body.moving->standing_shape().subspan(3 * std::size_t{first}, body.standing->known(k));
  object.shown.displacement.replace().assign(own.begin(), own.end());
  return touches_of_part(body.moving->standing_touches(), first, first + count);
}

} // namespace

std::vector<std::size_t> all_of(const Body& body) {
  std::vector<std::size_t> all = body.parts;
  all.insert(all.end(), body.beside.begin(), body.beside.end());
  return all;
}

std::vector<std::size_t> near_beside(const World& w, std::span<const std::size_t> parts) {
  std::vector<std::size_t> reached(parts.begin(), parts.end()), beside;
  for (std::size_t k = 0; k < reached.size(); ++k)
    for (const Meeting& m : w.now.meetings) {
      if (!m.near || (m.object != reached[k] && m.other != reached[k]))
        continue;
      const std::size_t other = m.object == reached[k] ? m.other : m.object;
      if (w.now.objects[other].method == Method::ffe &&
          std::ranges::find(reached, other) == reached.end()) {
        reached.push_back(other);
        beside.push_back(other);
      }
    }
  std::ranges::sort(beside);
  return beside;
}

void stand_beside(World& w, const std::shared_ptr<Body>& body, std::vector<std::size_t> objects) {
  StandingStart start;
  std::vector<std::size_t> first;
  body->beside = objects;
  start.model = std::make_shared<const Model>(joined_model(w, all_of(*body), first));
  for (std::size_t k = 0; k < objects.size(); ++k) {
    Object& object = w.now.objects[objects[k]];
    shape_in_step(w, object); // that it comes from
    std::vector<NodeTouch> touches = object.shown.touches;
    if (object.beside != nullptr && has_stood(object))
      touches = take_standing(w, object);
    for (NodeTouch t : by_instruments(std::move(touches))) {
      t.node += static_cast<std::uint32_t>(first[body->parts.size() + k]);
      start.touches.push_back(t);
    }
    const std::vector<double>& shape = *object.shown.displacement;
    start.shape.insert(start.shape.end(), shape.begin(), shape.end());
    start.shape.resize(start.shape.size() + 3 * object.model().nodes.size() - shape.size());
    object.contact = nullptr;
  }
  for (const std::size_t index : objects)
    w.now.objects[index].beside = body;
  body->standing = std::make_shared<BesideBody>(w, std::move(objects));
  body->moving->stand_beside(start);
}

void leave_body(World& w, Object& object) {
  if (has_stood(object)) // in the course of a step
    object.shown.touches = take_standing(w, object);
  object.shown.touches = by_instruments(std::move(object.shown.touches));
  object.beside = nullptr;
  object.stood_under = nullptr;
  object.contact = std::make_shared<StaticContact>(object.model(), *object.shown.displacement,
                                                   object.shown.touches);
  object.shown.points.clear();
  object.shown.box.reset();
  object.shown.valid = false;
}

std::vector<SurfaceMeeting> meetings_of(const World& w, const Body& body) {
  const std::vector<std::size_t> all = all_of(body);
  std::vector<std::size_t> offset;
  std::size_t nodes = 0;
  for (const std::size_t index : all)
    offset.push_back(std::exchange(nodes, nodes + w.now.objects[index].model().nodes.size()));
  return meetings_of(w, all, offset);
}

void wake_by_beside(const World& w, Body& body) {
  if (std::ranges::any_of(body.beside, [&](std::size_t index) {
        const Object& object = w.now.objects[index];
        return !object.shown.valid || object.load->changes_until() > object.shown.time;
      }))
    body.moving->wake();
}

void begin_standing(World& w, Body& body, double to) {
  if (body.standing == nullptr)
    return;
  body.standing->begin(w.now.clock.time, to, body.moving->standing_shape());
  body.moving->set_standing(body.standing.get());
}

void end_standing(Body& body) {
  if (body.standing == nullptr)
    return;
  body.moving->set_standing(nullptr);
  body.standing->end();
}

void show_standing(World& w, Object& object) {
  begin_showing(w, object);
  Shown& shown = object.shown;
  shown.load = *std::exchange(object.stood_under, nullptr);
  shown.touches = take_standing(w, object);
  shown.points.clear();
  shown.shaped = true;
  warn_of_range(w, object);
  if (object.statics->made()) {
    if (!shown.load->displacement.empty()) // whatever was asked of it in between
      update_solver(w, object, acting_load(shown));
    shown.forces = static_forces(object);
  }
  end_showing(w, object);
}

} // namespace gewebe::simulation
