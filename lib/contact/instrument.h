#pragma once
// Rigid instruments that touch objects: a sphere, a capsule or a convex mesh (all points within a
// radius of a point, a segment, a polyhedron), where it stands and how it moves; and blades, which
// push nothing. All are convex, so that for any unit vector n all that lies beyond the support
// plane n·y = support(n) is outside.

#include "geometry/vec3.h"

#include <cstdint>
#include <memory>

namespace gewebe::contact {

/// A rotation; need not be of unit length until made so.
struct Quaternion {
  double w = 1, x = 0, y = 0, z = 0;

  bool operator==(const Quaternion&) const = default;
};

double length(const Quaternion& q);
/// \pre length(q) > 0 and finite
Quaternion unit(const Quaternion& q);
/// By `degrees` about `axis`. \pre norm(axis) > 0
Quaternion turn_about(const Vec3& axis, double degrees);
/// \pre length(q) == 1
Vec3 rotated(const Quaternion& q, const Vec3& v);
Vec3 rotated_back(const Quaternion& q, const Vec3& v);

/// Where a rigid body's own point r stands: place + rotated(turn, r).
struct Pose {
  Vec3 place; ///< of its origin
  Quaternion turn;

  Vec3 operator()(const Vec3& r) const { return place + rotated(turn, r); }
  Vec3 inverse(const Vec3& p) const { return rotated_back(turn, p - place); }
  bool operator==(const Pose&) const = default;
};

/// On the straight way from a to b, by the shorter rotation; exact at 0 and 1. \pre 0 <= x <= 1
Pose between(const Pose& a, const Pose& b, double x);

/// From one pose to another, from `start` to `end` s: smoothly, or evenly.
struct PoseWay {
  Pose from, to;
  double start = 0, end = 0;
  bool even = false;

  Pose at(double time) const;
  bool operator==(const PoseWay&) const = default;
};

class ConvexCore;

/// The origin is a sphere's centre, the first end of a capsule's segment, or that of the mesh.
struct InstrumentShape {
  double radius = 1;   ///< mm, > 0; of a blade 0
  Vec3 axis;           ///< from the first end to the second; 0: a sphere
  double friction = 0; ///< Coulomb's coefficient
  bool blade = false;  ///< an edge along the axis, without radius: it cuts what it sweeps over
  /// Of a mesh, which the radius rounds outwards; its axis is 0.
  std::shared_ptr<const ConvexCore> core{};
};

/// Numbers are those that results hold; 0 is none there.
enum class InstrumentKind : std::uint8_t { sphere = 1, capsule = 2, blade = 3, mesh = 4 };
InstrumentKind kind_of(const InstrumentShape& shape);
/// "sphere", "capsule", "blade", "mesh".
const char* instrument_kind_name(InstrumentKind kind);
/// Distance of the shape's farthest point from its origin, without the radius.
double reach_of(const InstrumentShape& shape);

/// An instrument at one moment.
struct PlacedInstrument {
  Vec3 a, ab;                ///< first end of the segment, and from there to the second
  double inverse_square = 0; ///< 1/|ab|², or 0
  double radius = 0, friction = 0;
  std::shared_ptr<const ConvexCore> core; ///< of a mesh, whose origin is at `a`
  Quaternion turn;                        ///< of a mesh

  PlacedInstrument() = default;
  PlacedInstrument(const InstrumentShape& shape, const Pose& pose);

  Pose pose() const { return {a, turn}; }
  /// Of p from the surface, below 0 inside.
  double distance(const Vec3& p) const;
  /// The largest n·y of all its points. \pre norm(n) == 1
  double support(const Vec3& n) const;
  /// Out of the surface nearest to p; where p is on the segment (within 1e-9 of the radius) any way
  /// out that is perpendicular to it, along `wish` as far as may be.
  Vec3 normal(const Vec3& p, const Vec3& wish = {}) const;
  Box3 box() const;

private:
  /// The point of the segment nearest to p.
  Vec3 nearest(const Vec3& p) const;
};

/// No point of the shape moves further between the two poses than this.
double path_length(const InstrumentShape& shape, const Pose& from, const Pose& to);

/// Where p on a rigid body goes when the body moves.
inline Vec3 carried(const Pose& from, const Pose& to, const Vec3& p) {
  return from == to ? p : to(from.inverse(p));
}

/// Whether a point of one box may be a point of the other, grown by `margin` all around.
inline bool near(const Box3& a, const Box3& b, double margin = 0) {
  return a.min.x - margin <= b.max.x && b.min.x - margin <= a.max.x &&
         a.min.y - margin <= b.max.y && b.min.y - margin <= a.max.y &&
         a.min.z - margin <= b.max.z && b.min.z - margin <= a.max.z;
}

} // namespace gewebe::contact
