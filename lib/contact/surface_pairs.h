#pragma once
// Nodes of one surface near triangles of another one, or of the same one elsewhere: pairs whose
// gaps contact keeps from falling below 0.
//
// With q the point of the triangle nearest to the node's place p, with weights w, and n the normal
// there, the gap is n · (p - q). Normals at the triangle's corners are means of the triangles
// around that stand at less than 60° to it, by their areas, and n is their mean by w: it turns
// without a jump as the node slides over a smooth surface, and edges stay sharp (Wriggers,
// Computational contact mechanics, 2006, chapter 9, on smoothed surfaces). A node at rest is on the
// triangle itself, for n · (p - q) = 0 where q is the nearest point means p = q.
//
// Only surfaces that face each other meet: the node's own normal, the mean of its triangles, leads
// against n. Of the same surface, nodes do not meet what is around them: triangles that share a
// node with theirs, and walls that they are behind of: a node is outside of what it was outside of
// before.
//
// What a node passes within a step is found along its straight way (swept, as R. Bridson, R.
// Fedkiw, J. Anderson, Robust treatment of collisions, contact and friction for cloth animation,
// ACM TOG 21(3), 2002): when it was in the plane of the triangle, and whether it was inside; and
// likewise pairs of edges that cross, whose normal is along both edges' vector product. Each knows
// the side that it came from. Surfaces are passed from outside; a net's own walls from either side.

#include "base/vec3.h"
#include "contact/box_tree.h"
#include "contact/surface_facets.h"
#include "contact/surface_point.h"
#include "model/model.h"

#include <array>
#include <cstdint>
#include <span>
#include <tuple>
#include <vector>

namespace gewebe {

/// Nodes of a part of a model, from `first` to the one before `end`.
struct NodeRange {
  std::uint32_t first = 0, end = 0;

  bool holds(std::uint32_t node) const { return first <= node && node < end; }
  bool operator==(const NodeRange&) const = default;
};

/// Two parts that may touch, or one that may touch itself, where both are the same.
struct SurfaceMeeting {
  NodeRange one, other;
  double friction = 0; ///< Coulomb's coefficient

  bool itself() const { return one == other; }
  bool operator==(const SurfaceMeeting&) const = default;
};

/// A node and a triangle, or two edges: with x the places of the four nodes, sum(share x) leads
/// from a point of the second to one of the first.
struct SurfacePair {
  std::uint32_t meeting = 0;
  bool first_side = true; ///< the node, or the first edge, is one of the meeting's first part
  bool edges = false;
  /// 1: outside; -1: a node behind its triangle, where a net's inner side keeps it; of edges, which
  /// way the vector product leads
  int side = 1;
  std::array<std::uint32_t, 4> nodes{}; ///< the node and the corners, or two and two ends
  std::array<double, 4> share{};        ///< 1 and -weights, or weights and -weights
  Vec3 normal;                          ///< out of the second
  double gap = 0;                       ///< along it
  bool apart = false;                   ///< beside each other: whatever the gap is, they don't meet
  /// A node and a triangle that it has passed while another one beside that held it, as in a valley
  /// between both: it meets this one beside its nearest, and along its plane's normal.
  bool more = false;

  auto key() const {
    return std::tuple(meeting, edges, !first_side, side, nodes[0], rest_of_key());
  }

private:
  /// Of a node one triangle is met, and such as it has passed beside.
  std::array<std::uint32_t, 3> rest_of_key() const {
    return edges || more ? std::array{nodes[1], nodes[2], nodes[3]}
                         : std::array<std::uint32_t, 3>{};
  }
};

class SurfacePairs {
public:
  /// \pre check_model(model) passes
  SurfacePairs(const Model& model, std::vector<SurfaceMeeting> meetings);

  const std::vector<SurfaceMeeting>& meetings() const noexcept { return meetings_; }
  /// Where nodes are with these displacements; those beyond, at rest.
  std::vector<Vec3> places_of(std::span<const double> displacement) const;
  std::span<const Vec3> rest() const noexcept { return rest_; }
  /// Mean length at rest of the edges of triangles that may touch; 0 without triangles.
  double edge() const noexcept { return edge_; }

  /// Whether surfaces that move with these velocities for h s may then touch: looks how near they
  /// are only where they have moved against each other, since the last look, by what was between.
  /// \param places, velocity 3 n
  bool may_touch(std::span<const double> places, std::span<const double> velocity, double h);
  /// Behind a step that was held for free: whether they may have touched nevertheless.
  bool may_have_touched(std::span<const double> places) const;

  /// How far surfaces move against each other if nodes move so far, at most, over an edge.
  double way_of(std::span<const double> moved) const;

  /// Nodes and triangles whose gap is below `margin`, and over -edge(): of each node and meeting
  /// the nearest. \param displacement 3 n, of the surface's nodes at least \param was as well:
  /// where nodes were outside
  std::vector<SurfacePair> find(std::span<const double> displacement, std::span<const double> was,
                                double margin);

  /// Pairs that have passed each other by more than `depth`, edges by 10 times as much, on the
  /// straight way from `was` to `displacement`: with their points then and normals now. Edges only
  /// where no node has.
  std::vector<SurfacePair> find_passed(std::span<const double> displacement,
                                       std::span<const double> was, double depth);

  /// Takes a pair's points, normal and gap to nodes at these places; that of a node to the nearest
  /// triangle around its own one, unless it has more. \param at by node, of the surface's at least
  void follow(SurfacePair& pair, std::span<const Vec3> at) const;

private:
  /// Of the triangles that may touch.
  struct Edge {
    std::uint32_t a = 0, b = 0;
    std::array<std::uint32_t, 2> facets{}; ///< on both sides; the same twice at a border
  };
  /// When a meeting was last looked at.
  struct Look {
    std::vector<Vec3> at; ///< of surface_; empty: never
    double clear = 0;     ///< all that may touch was so far apart; at most far_enough
    int wait = 0;         ///< times that nobody looks, since they were near
  };
  double clear_of(const SurfaceMeeting& m) const;
  double moved_since(const Look& look, const SurfaceMeeting& m,
                     std::span<const double> places) const;
  double speed_of(const SurfaceMeeting& m, std::span<const double> velocity) const;
  void add_edges();
  void fit_tree(std::span<const Vec3> at, std::span<const Vec3> more);
  bool is_net(std::uint32_t node) const { return in_element_[node] == 0; }
  /// Beside an edge a node is not behind the triangle. \param off from its point to the node
  bool is_beside(const SurfacePair& pair, const Vec3& off, std::span<const Vec3> at) const;
  Vec3 edge_normal(const Edge& e, std::span<const Vec3> at) const;
  void follow_node(SurfacePair& pair, std::span<const Vec3> at) const;
  void follow_edges(SurfacePair& pair, std::span<const Vec3> at) const;
  void nodes_passed(std::uint32_t meeting, bool first, std::span<const Vec3> at,
                    std::span<const Vec3> was, double depth, std::vector<SurfacePair>& found) const;
  void edges_passed(std::uint32_t meeting, std::span<const Vec3> at, std::span<const Vec3> was,
                    double depth, std::vector<SurfacePair>& found) const;
  Vec3 face_normal(const Facet& f, std::span<const Vec3> at) const;
  Vec3 node_normal(std::uint32_t node, std::span<const Vec3> at) const;
  Vec3 normal_at(const Facet& f, const std::array<double, 3>& weights,
                 std::span<const Vec3> at) const;
  bool around(std::uint32_t node, const Facet& f) const;
  void find_side(std::uint32_t meeting, bool first, std::span<const Vec3> at,
                 std::span<const Vec3> was, double margin, std::vector<SurfacePair>& found) const;

  std::vector<SurfaceMeeting> meetings_;
  SurfaceFacets facets_;
  std::vector<std::uint32_t> touching_; ///< triangles of facets_ that may touch
  std::vector<Edge> edges_;
  std::vector<std::array<std::uint32_t, 3>> own_edges_; ///< by triangle of touching_: those that it
                                                        ///< comes first of; none: UINT32_MAX
  BoxTree tree_{{}};                                    ///< over touching_
  std::vector<std::uint8_t> in_element_;                ///< by node
  std::vector<std::uint32_t> surface_;                  ///< nodes of triangles, ascending
  std::vector<Vec3> rest_;
  std::vector<Look> looks_;     ///< by meeting
  std::vector<Vec3> looked_at_; ///< places of all nodes, in a look
  double edge_ = 0;
};

} // namespace gewebe
