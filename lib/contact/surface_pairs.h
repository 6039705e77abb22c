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

#include "base/vec3.h"
#include "contact/surface_facets.h"
#include "contact/surface_point.h"
#include "model/model.h"

#include <array>
#include <cstdint>
#include <span>
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

struct SurfacePair {
  std::uint32_t meeting = 0, node = 0;
  bool first_side = true; ///< the node is one of the meeting's first part
  Facet piece{};
  std::array<double, 3> weights{}; ///< of the triangle's nearest point
  Vec3 normal;                     ///< there, out of the object
  double gap = 0;                  ///< along it
};

class SurfacePairs {
public:
  /// Keeps a reference to the model. \pre check_model(model) passes
  SurfacePairs(const Model& model, std::vector<SurfaceMeeting> meetings);

  const std::vector<SurfaceMeeting>& meetings() const noexcept { return meetings_; }
  /// Where nodes are with these displacements; those beyond, at rest.
  std::vector<Vec3> places_of(std::span<const double> displacement) const;
  std::span<const Vec3> rest() const noexcept { return rest_; }
  /// Mean length at rest of the edges of triangles that may touch; 0 without triangles.
  double edge() const noexcept { return edge_; }

  /// Whether surfaces that move with these velocities for h s may then be nearer to each other
  /// than an edge; true of one that may touch itself. \param places, velocity 3 n
  bool may_touch(std::span<const double> places, std::span<const double> velocity, double h) const;

  /// Pairs whose gap is below `margin`, and over -edge(): of each node and meeting the nearest.
  /// \param displacement 3 n, of the surface's nodes at least \param was as well: where nodes were
  /// outside
  std::vector<SurfacePair> find(std::span<const double> displacement, std::span<const double> was,
                                double margin);

  /// Takes a pair to the nearest triangle around its own one, with its point, normal and gap, for
  /// nodes at these places. \param at by node, of the surface's at least
  void follow(SurfacePair& pair, std::span<const Vec3> at) const;

private:
  Vec3 face_normal(const Facet& f, std::span<const Vec3> at) const;
  Vec3 node_normal(std::uint32_t node, std::span<const Vec3> at) const;
  Vec3 normal_at(const Facet& f, const std::array<double, 3>& weights,
                 std::span<const Vec3> at) const;
  bool around(std::uint32_t node, const Facet& f) const;
  void find_side(std::uint32_t meeting, bool first, std::span<const Vec3> at,
                 std::span<const Vec3> was, double margin, std::vector<SurfacePair>& found) const;

  const Model& model_;
  std::vector<SurfaceMeeting> meetings_;
  SurfaceFacets facets_;
  std::vector<std::uint32_t> surface_; ///< nodes of triangles, ascending
  std::vector<Vec3> rest_;
  double edge_ = 0;
};

} // namespace gewebe
