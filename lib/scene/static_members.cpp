#include "scene/static_members_internal.h"

#include "base/vector_at.h"
#include "statics/elastostatic_yielding.h"

#include <algorithm>
#include <memory>
#include <utility>

namespace gewebe::simulation {

namespace {

/// Where a node is, if the shape has it.
Vec3 place_in(std::span<const double> shape, std::uint32_t node, const Vec3& else_there) {
  return 3 * std::size_t{node} < shape.size() ? vector_at(shape, node) : else_there;
}

/// Names its object where it fails.
class OfObject final : public Yielding {
public:
  OfObject(const World& w, Object& object, std::unique_ptr<Yielding> own)
      : w_(w), object_(object), own_(std::move(own)) {}
  DelassusOperator delassus_operator(std::span<const std::uint32_t> nodes) override {
    DelassusOperator all;
    at_object(w_, object_, [&] { all = own_->delassus_operator(nodes); });
    return all;
  }
  bool push(std::span<const NodeTouch> touches, std::span<const Vec3> at) override {
    bool agreed = true;
    at_object(w_, object_, [&] { agreed = own_->push(touches, at); });
    return agreed;
  }
  std::span<const double> shape() override {
    std::span<const double> u;
    at_object(w_, object_, [&] { u = own_->shape(); });
    return u;
  }

private:
  const World& w_;
  Object& object_;
  std::unique_ptr<Yielding> own_;
};

} // namespace

Load load_before(const Object& object, const Load& next) {
  Load load = *object.shown.load;
  std::map<std::uint32_t, Vec3> held = std::exchange(load.displacement, {});
  std::erase_if(held, [&](const auto& entry) { return next.displacement.contains(entry.first); });
  for (const NodeVector& f : *object.shown.forces)
    if (held.contains(f.node))
      load.force[f.node] = f.value; // its support has borne what else acted there
  for (const NodeTouch& t : object.shown.touches)
    if (held.contains(t.node))
      load.force[t.node] -= t.force;
  for (const auto& [node, u] : next.displacement)
    load.displacement[node] = place_in(*object.shown.displacement, node, u);
  return load;
}

Load load_from(Load last, std::span<const double> shape, const Load& next) {
  last.displacement.clear();
  for (const auto& [node, u] : next.displacement)
    last.displacement[node] = place_in(shape, node, u);
  return last;
}

Load load_between(const Load& from, const Load& to, double part) {
  if (part == 1)
    return to;
  Load load = to;
  for (auto& [node, f] : load.force)
    f *= part;
  for (const auto& [node, f] : from.force)
    load.force[node] += (1 - part) * f;
  for (auto& [node, u] : load.displacement)
    u = from.displacement.at(node) + part * (u - from.displacement.at(node));
  load.gravity = from.gravity + part * (to.gravity - from.gravity);
  return load;
}

std::vector<NodeTouch> by_instruments(std::vector<NodeTouch> touches) {
  std::erase_if(touches, [](const NodeTouch& t) { return t.instrument == other_surface; });
  return touches;
}

PointTouch shifted(PointTouch point, std::uint32_t up, std::uint32_t down) {
  for (std::uint32_t& node : point.nodes)
    node = node + up - down;
  return point;
}

StaticMembers::StaticMembers(World& w, std::vector<Object*> objects)
    : w_(w), objects_(std::move(objects)) {
  for (Object* const object : objects_) {
    stages_.emplace_back([&w, object]() -> std::pair<Elastostatic&, TwoStep&> {
      Elastostatic& solver = solver_of(w, *object);
      return {solver, two_step_of(w, *object)};
    });
    first_.push_back(static_cast<std::uint32_t>(nodes_));
    nodes_ += object->model().nodes.size();
  }
}

std::size_t StaticMembers::of(std::uint32_t node) const {
  return static_cast<std::size_t>(std::ranges::upper_bound(first_, node) - first_.begin()) - 1;
}

std::vector<double> StaticMembers::shape() const {
  std::vector<double> all(3 * nodes_);
  for (std::size_t k = 0; k < objects_.size(); ++k)
    std::ranges::copy(*objects_[k]->shown.displacement, all.begin() + std::ptrdiff_t{3} * first(k));
  return all;
}

std::vector<NodeTouch> StaticMembers::touches() const {
  std::vector<NodeTouch> all;
  for (std::size_t k = 0; k < objects_.size(); ++k)
    for (NodeTouch t : objects_[k]->shown.touches) {
      t.node += first(k);
      all.push_back(t);
    }
  return all;
}

std::vector<PointTouch> StaticMembers::points() const {
  std::vector<PointTouch> all;
  for (std::size_t k = 0; k < objects_.size(); ++k)
    for (const PointTouch& p : objects_[k]->shown.points)
      all.push_back(shifted(p, first(k), 0));
  return all;
}

std::map<std::uint32_t, Vec3> StaticMembers::displaced() const {
  std::map<std::uint32_t, Vec3> all;
  for (std::size_t k = 0; k < objects_.size(); ++k)
    for (const auto& [node, u] : loads_[k].displacement)
      all.emplace_hint(all.end(), first(k) + node, u);
  return all;
}

JoinedYielding StaticMembers::joined(std::span<const NodeTouch> last) {
  std::vector<JoinedYielding::Part> parts;
  both_.clear();
  for (std::size_t k = 0; k < objects_.size(); ++k) {
    Object& object = *objects_[k];
    const Load& load = loads_[k];
    const std::vector<NodeTouch> own = touches_of_part(last, first(k), end(k));
    std::unique_ptr<Yielding> one;
    if (object.stages.options) {
      auto both = std::make_unique<TwoStepYielding>(object.model(), stages_[k], load);
      both_.push_back(both.get());
      one = std::move(both);
      at_object(w_, object, [&] { (void)one->push({}, {}); });
    } else {
      one = std::make_unique<ElastostaticYielding>(
          [this, &object]() -> Elastostatic& { return solver_of(w_, object); }, load, own);
    }
    parts.push_back({std::make_unique<OfObject>(w_, object, std::move(one)), first(k)});
  }
  return {std::move(parts), nodes_};
}

bool StaticMembers::solved() const {
  return std::ranges::all_of(both_, [](const TwoStepYielding* both) { return both->solved(); });
}

} // namespace gewebe::simulation
