// New walls of cuts and tears in contact: both sides of a cut begin at the same place, where no
// barrier can part them. Their nodes are moved apart by a small part of an edge.

#include "base/error.h"
#include "contact/parameters.h"
#include "geometry/vector_at.h"
#include "scene/world_internal.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace gewebe::scene {

namespace {

/// Distance by which each side is moved, over the activation distance of contact: together they
/// stand apart by a bit more than a half of it.
constexpr double moved_apart = 0.3;
/// Difference of two unit directions below which both sides face alike.
constexpr double least_difference = 0.1;

/// A node of a surface.
struct SurfaceNode {
  std::size_t object = 0;
  std::uint32_t node = 0;
  Vec3 place;
  Vec3 normal; ///< unit, outward: of the walls around, else of all triangles around
  Vec3 inward; ///< at a rim: unit, between the perpendiculars of both of its edges
  bool held = false;
  bool beside_free = false; ///< a triangle around has a node that is not held
};

Vec3 unit(const Vec3& v) {
  const double length = norm(v);
  return length > 0 ? v / length : Vec3{};
}

Vec3 displacement_of(const Object& object, const Motions& motions, std::size_t index,
                     std::uint32_t node) {
  if (const auto own = motions.find(index); own != motions.end())
    return own->second[node].displacement;
  return vector_at(*object.shown.displacement, node);
}

/// Nodes nearer than this part of the median edge are at one place: rounding parts the middles of
/// edges of both sides.
constexpr double same_place = 1e-9;

/// Unit vector along which nodes are swept: of no mesh's axes, so that few share a coordinate.
constexpr Vec3 sweep_direction{0.36, 0.48, 0.8};

/// Nodes at one place, and the median edge of all surfaces. Triangles of such nodes alone are
/// walls; they tell where to part better than those of an outer surface that ends in a sharp rim.
class SharedPlaces {
public:
  SharedPlaces(const World& w, std::span<const std::size_t> objects, const Motions& motions) {
    for (const std::size_t index : objects)
      add(w.now.objects[index], index, motions);
  }

  /// Each with nodes of ascending object and number.
  std::vector<std::vector<SurfaceNode>> groups() {
    const double room = same_place * median_edge();
    const auto along = [](const SurfaceNode& node) { return dot(sweep_direction, node.place); };
    std::ranges::stable_sort(nodes_, {}, along);
    std::vector<std::vector<SurfaceNode>> all;
    std::size_t first = 0; // of the groups that are near along the direction
    for (const SurfaceNode& node : nodes_) {
      while (first < all.size() && along(all[first].back()) < along(node) - room)
        ++first;
      const auto found = std::find_if(all.begin() + static_cast<std::ptrdiff_t>(first), all.end(),
                                      [&](const std::vector<SurfaceNode>& group) {
                                        return norm(group.front().place - node.place) <= room;
                                      });
      if (found != all.end())
        found->push_back(node);
      else
        all.push_back({node});
    }
    std::erase_if(all, [](const std::vector<SurfaceNode>& group) { return group.size() < 2; });
    for (std::vector<SurfaceNode>& group : all)
      std::ranges::sort(group, {},
                        [](const SurfaceNode& node) { return std::pair(node.object, node.node); });
    use_walls(all);
    return all;
  }
  double median_edge() {
    if (edges_.empty())
      return 0;
    const auto middle = edges_.begin() + static_cast<std::ptrdiff_t>(edges_.size() / 2);
    std::ranges::nth_element(edges_, middle);
    return *middle;
  }

private:
  struct Face {
    std::size_t object = 0;
    Triangle nodes;
    Vec3 area;
  };

  void use_walls(std::vector<std::vector<SurfaceNode>>& groups) const {
    std::map<std::pair<std::size_t, std::uint32_t>, Vec3> area;
    for (const std::vector<SurfaceNode>& group : groups)
      for (const SurfaceNode& node : group)
        area[{node.object, node.node}] = {};
    for (const Face& face : faces_)
      if (std::ranges::all_of(face.nodes, [&](std::uint32_t node) {
            return area.contains({face.object, node});
          }))
        for (const std::uint32_t node : face.nodes)
          area.at({face.object, node}) += face.area;
    for (std::vector<SurfaceNode>& group : groups)
      for (SurfaceNode& node : group)
        if (const Vec3 wall = unit(area.at({node.object, node.node})); wall != Vec3{})
          node.normal = wall;
  }

  void add(const Object& object, std::size_t index, const Motions& motions) {
    const model::Model& model = object.model();
    std::map<std::uint32_t, SurfaceNode> nodes;
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> triangles_of_edge;
    for (const Triangle& t : model.triangles)
      for (std::size_t k = 0; k < 3; ++k)
        ++triangles_of_edge[std::minmax(t[k], t[(k + 1) % 3])];
    const auto place = [&](std::uint32_t node) {
      return model.nodes[node].position + displacement_of(object, motions, index, node);
    };
    const auto is_held = [&](std::uint32_t node) {
      return model.nodes[node].fixed == model::fixed_all ||
             object.load->displacement.contains(node);
    };
    for (const Triangle& t : model.triangles) {
      const bool has_free = !std::ranges::all_of(t, is_held);
      const std::array<Vec3, 3> x{place(t[0]), place(t[1]), place(t[2])};
      const Vec3 area = cross(x[1] - x[0], x[2] - x[0]);
      faces_.push_back({index, t, area});
      for (std::size_t k = 0; k < 3; ++k) {
        SurfaceNode& node = nodes[t[k]];
        node.normal += area;
        node.beside_free = node.beside_free || has_free;
        edges_.push_back(norm(model.nodes[t[(k + 1) % 3]].position - model.nodes[t[k]].position));
      }
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t a = t[k], b = t[(k + 1) % 3];
        if (triangles_of_edge.at(std::minmax(a, b)) > 1)
          continue;
        const Vec3 across = unit(cross(area, x[(k + 1) % 3] - x[k]));
        nodes[a].inward += across;
        nodes[b].inward += across;
      }
    }
    for (auto& [number, node] : nodes) {
      node.object = index;
      node.node = number;
      node.normal = unit(node.normal);
      node.inward = unit(node.inward);
      node.held = is_held(number);
      node.place = place(number);
      nodes_.push_back(node);
    }
  }

  std::vector<SurfaceNode> nodes_;
  std::vector<Face> faces_;
  std::vector<double> edges_;
};

/// Directions in which nodes at one place part: at rims of sheets along these, else against the
/// surface's normal.
std::vector<Vec3> parting_directions(std::span<const SurfaceNode> group) {
  const auto count = static_cast<double>(group.size());
  Vec3 normal, inward;
  bool rims = true;
  for (const SurfaceNode& node : group) {
    normal += node.normal / count;
    inward += node.inward / count;
    rims = rims && node.inward != Vec3{};
  }
  std::vector<Vec3> directions;
  for (const SurfaceNode& node : group) {
    const Vec3 off = rims ? node.inward - inward : normal - node.normal;
    directions.push_back(unit(norm(off) >= least_difference ? off : node.inward - inward));
  }
  return directions;
}

} // namespace

void move_node(World& w, std::size_t index, std::uint32_t node, Vec3 by, Motions& motions) {
  Object& object = w.now.objects[index];
  for (int a = 0; a < 3; ++a)
    if (contact::is_fixed(object.model(), node, a))
      by[a] = 0;
  object.shown.valid = false;
  object.shown.whole = {};
  object.shown.box.reset();
  if (object.method == Method::ela) {
    std::vector<dynamics::NodeMotion>& motion = motions[index];
    motion.resize(object.model().nodes.size());
    motion[node].displacement += by;
    return;
  }
  std::vector<double>& u = object.shown.displacement.write();
  for (int a = 0; a < 3; ++a)
    u[axis_of(node, a)] += by[a];
}

void require_parted_holds(const World& w, const SetContact& c, const Motions& motions) {
  std::vector<std::size_t> objects{c.object};
  if (c.other != c.object)
    objects.push_back(c.other);
  SharedPlaces places(w, objects, motions);
  const auto name = [&](const SurfaceNode& node) {
    return std::to_string(node.node) + " of object " + w.now.objects[node.object].name();
  };
  for (const std::vector<SurfaceNode>& group : places.groups())
    for (std::size_t k = 1; k < group.size(); ++k)
      for (std::size_t j = 0; j < k; ++j) {
        const SurfaceNode &a = group[j], &b = group[k];
        if (a.held && b.held && (a.beside_free || b.beside_free) &&
            (a.object != b.object || c.object == c.other))
          throw Error("nodes " + name(a) + " and " + name(b) +
                      " stand at one place and are held there, expected nodes that can move apart "
                      "for contact");
      }
}

std::vector<std::size_t> separate_walls(World& w, std::span<const std::size_t> objects,
                                        Motions& motions) {
  SharedPlaces places(w, objects, motions);
  const double distance =
      moved_apart * contact::Parameters{}.lengths.activation_distance * places.median_edge();
  std::set<std::size_t> moved;
  for (const std::vector<SurfaceNode>& group : places.groups()) {
    const std::vector<Vec3> directions = parting_directions(group);
    const auto free = std::ranges::count(group, false, &SurfaceNode::held);
    const double way = free < std::ssize(group) ? 2 * distance : distance;
    for (std::size_t k = 0; k < group.size(); ++k) {
      if (group[k].held)
        continue;
      move_node(w, group[k].object, group[k].node, way * directions[k], motions);
      moved.insert(group[k].object);
    }
  }
  return {moved.begin(), moved.end()};
}

} // namespace gewebe::scene
