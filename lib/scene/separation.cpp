// Moves surfaces that overlap apart, so that contact can begin: each vertex goes as little as
// possible, in the mean square.
//
// The same barrier as in steps parts them, with a spring from each vertex to where it was in place
// of the bodies. It has to begin where nothing intersects: with all surfaces drawn in along their
// normals.

#include "base/error.h"
#include "contact/island.h"
#include "geometry/vector_at.h"
#include "scene/world_internal.h"
#include "text/number_text.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace gewebe::scene {

namespace {

/// Farthest that a surface is drawn in, over the median edge: farther than this, elements behind it
/// would turn over.
constexpr double farthest = 0.5;
/// Stiffness of the springs, 1e-6 N/mm; any other gives the same positions.
constexpr double spring = 1;

/// Vertices on springs. Those that are held do not move.
class VertexSprings final : public contact::ContactBody, public contact::IslandMember {
public:
  VertexSprings(std::vector<Vec3> from, std::vector<Vec3> to, std::vector<std::uint8_t> held,
                double typical_force)
      : at_(std::move(from)), to_(std::move(to)), held_(std::move(held)), typical_(typical_force) {}

  ContactBody& begin(const contact::Interval& /*step*/, const Context& /*context*/) override {
    return *this;
  }
  void end(std::span<const Force> /*forces*/, const contact::Interval& /*step*/,
           const Context& /*context*/) override {}

  std::size_t vertex_count() const override { return at_.size(); }
  void positions(std::span<Vec3> x) override { std::ranges::copy(at_, x.begin()); }
  double linearise(std::span<const contact::VertexForce> forces, std::span<Vec3> step) override {
    begin_ = at_;
    double energy = 0;
    for (std::size_t v = 0; v < at_.size(); ++v) {
      step[v] = to_[v] - at_[v];
      energy += spring * dot(step[v], step[v]);
    }
    for (const contact::VertexForce& f : forces)
      if (held_[f.vertex] == 0)
        step[f.vertex] += f.force / spring;
    return energy;
  }
  void compliance(std::uint32_t vertex, std::span<const std::uint32_t> rows,
                  std::span<contact::Block3> blocks) override {
    for (std::size_t k = 0; k < rows.size(); ++k) {
      const double c = rows[k] == vertex && held_[vertex] == 0 ? 1 / spring : 0;
      blocks[k] = {c, 0, 0, 0, c, 0, 0, 0, c};
    }
  }
  void move(double share, std::span<const contact::VertexForce> forces) override {
    for (std::size_t v = 0; v < at_.size(); ++v)
      at_[v] = to_[v] + share * (begin_[v] - to_[v]);
    for (const contact::VertexForce& f : forces)
      if (held_[f.vertex] == 0)
        at_[f.vertex] += f.force / spring;
  }
  bool is_linear() const override { return true; }
  double typical_force() const override { return typical_; }
  double vertex_stiffness() const override { return spring; }

private:
  std::vector<Vec3> at_, to_, begin_;
  std::vector<std::uint8_t> held_;
  double typical_ = 0;
};

/// One object's surface as it stands.
struct StandingSurface {
  std::size_t object = 0;
  contact::ModelSurface model;
  std::vector<Vec3> x;
  std::vector<std::uint8_t> held;

  /// \param depth  of the way along the normals of vertices, mm
  std::vector<Vec3> drawn_in(double depth) const {
    std::vector<Vec3> normal(x.size());
    for (const auto& t : model.surface.triangles) {
      const Vec3 area = cross(x[t[1]] - x[t[0]], x[t[2]] - x[t[0]]);
      for (const std::uint32_t v : t)
        normal[v] += area;
    }
    std::vector<Vec3> moved = x;
    for (std::size_t v = 0; v < x.size(); ++v)
      if (const double length = norm(normal[v]); held[v] == 0 && length > 0)
        moved[v] -= normal[v] * (depth / length);
    return moved;
  }
};

/// \param still  its vertices do not move
StandingSurface standing_surface(World& w, std::size_t index, const Motions& motions, bool still) {
  Object& object = w.now.objects[index];
  StandingSurface s;
  s.object = index;
  s.model = contact::model_surface(object.model());
  std::span<const dynamics::NodeMotion> motion;
  if (const auto own = motions.find(index); own != motions.end())
    motion = own->second;
  else if (object.body != nullptr)
    motion = motion_of(object);
  else
    shape_in_step(w, object);
  for (const std::uint32_t node : s.model.node) {
    s.x.push_back(
        object.model().nodes[node].position +
        (motion.empty() ? vector_at(*object.shown.displacement, node) : motion[node].displacement));
    bool held = still || object.load->displacement.contains(node);
    for (int a = 0; a < 3; ++a)
      held = held || contact::is_fixed(object.model(), node, a);
    s.held.push_back(held ? 1 : 0);
  }
  return s;
}

/// Positions of all vertices, one surface behind the other.
std::vector<Vec3> joined(const std::vector<std::vector<Vec3>>& all) {
  std::vector<Vec3> x;
  for (const std::vector<Vec3>& one : all)
    x.insert(x.end(), one.begin(), one.end());
  return x;
}

/// Where surfaces intersect or touch.
std::optional<Vec3> find_overlap(const contact::IslandMotion& motion, std::span<const Vec3> x) {
  const std::optional<Vec3> found = motion.find_intersection(x);
  return found ? found : motion.find_touching(x);
}

} // namespace

std::vector<std::size_t> separate_overlaps(World& w, std::span<const ContactRule> rules,
                                           std::span<const std::size_t> movable, Motions& motions) {
  std::vector<std::size_t> objects;
  for (const ContactRule& rule : rules)
    for (const std::size_t index : {rule.object, rule.other})
      if (std::ranges::find(objects, index) == objects.end())
        objects.push_back(index);
  std::deque<StandingSurface> all;
  std::vector<const contact::BodySurface*> surfaces;
  std::vector<std::vector<Vec3>> target;
  for (const std::size_t index : objects) {
    const bool still = std::ranges::find(movable, index) == movable.end();
    all.push_back(standing_surface(w, index, motions, still));
    surfaces.push_back(&all.back().model.surface);
    target.push_back(all.back().x);
  }
  collision::OwnerTable<double> friction(objects.size(), -1);
  const auto place = [&](std::size_t index) {
    return static_cast<std::size_t>(std::ranges::find(objects, index) - objects.begin());
  };
  for (const ContactRule& rule : rules)
    friction.set(place(rule.object), place(rule.other), 0);
  contact::IslandMotion motion(surfaces, friction);
  const std::optional<Vec3> where = find_overlap(motion, joined(target));
  if (!where)
    return {};
  const auto fail = [&](const std::string& why) {
    std::string names;
    for (const std::size_t index : objects)
      names += (names.empty() ? "" : ", ") + w.now.objects[index].name();
    return Error("surfaces of " + names + " overlap near " + text::number_text(where->x) + " " +
                 text::number_text(where->y) + " " + text::number_text(where->z) + " and " + why);
  };
  const double most = farthest * motion.island().edge;
  std::vector<std::vector<Vec3>> start;
  double drawn = motion.activation_distance();
  const auto draw_in = [&] {
    start.clear();
    for (const StandingSurface& s : all)
      start.push_back(s.drawn_in(drawn));
    return !find_overlap(motion, joined(start));
  };
  while (!draw_in()) {
    drawn *= 2;
    if (drawn > most)
      throw fail("stand in each other by more than " + text::number_text(2 * most) +
                 " mm, or where they are held, expected surfaces that can be moved apart");
  }
  std::deque<VertexSprings> bodies;
  std::vector<contact::IslandMember*> members;
  for (std::size_t k = 0; k < all.size(); ++k)
    members.push_back(&bodies.emplace_back(start[k], target[k], all[k].held, spring * drawn));
  try {
    motion.advance(members, 0, 0, w.context);
  } catch (const contact::NotSolved& error) {
    throw fail("are not parted: " + std::string(error.what()));
  }
  std::vector<std::size_t> moved;
  for (std::size_t k = 0; k < all.size(); ++k) {
    bodies[k].positions(start[k]);
    bool any = false;
    for (std::size_t v = 0; v < start[k].size(); ++v)
      if (start[k][v] != target[k][v]) {
        move_node(w, all[k].object, all[k].model.node[v], start[k][v] - target[k][v], motions);
        any = true;
      }
    if (any)
      moved.push_back(all[k].object);
  }
  return moved;
}

} // namespace gewebe::scene
