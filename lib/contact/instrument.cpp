#include "contact/instrument.h"

#include "contact/convex_core.h"
#include "contact/load.h"

#include <algorithm>
#include <cmath>

namespace gewebe::contact {

namespace {

Quaternion operator*(const Quaternion& p, const Quaternion& q) {
  return {
      p.w * q.w - p.x * q.x - p.y * q.y - p.z * q.z, p.w * q.x + p.x * q.w + p.y * q.z - p.z * q.y,
      p.w * q.y - p.x * q.z + p.y * q.w + p.z * q.x, p.w * q.z + p.x * q.y - p.y * q.x + p.z * q.w};
}

Vec3 rotated_by(double w, const Vec3& v, const Vec3& p) {
  const Vec3 t = 2 * cross(v, p);
  return p + w * t + cross(v, t);
}

/// Some vector across v that is not small.
Vec3 across(const Vec3& v) {
  const Vec3 size{std::abs(v.x), std::abs(v.y), std::abs(v.z)};
  return size.x <= size.y && size.x <= size.z ? cross(v, {1, 0, 0})
         : size.y <= size.z                   ? cross(v, {0, 1, 0})
                                              : cross(v, {0, 0, 1});
}

} // namespace

double length(const Quaternion& q) {
  return std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
}

Quaternion unit(const Quaternion& q) {
  const double large =
      std::max({std::abs(q.w), std::abs(q.x), std::abs(q.y), std::abs(q.z)}); // no overflow
  const Quaternion p{q.w / large, q.x / large, q.y / large, q.z / large};
  const double size = length(p);
  return {p.w / size, p.x / size, p.y / size, p.z / size};
}

Quaternion turn_about(const Vec3& axis, double degrees) {
  const double half = degrees * (3.14159265358979323846 / 360), s = std::sin(half);
  const Quaternion along = unit({0, axis.x, axis.y, axis.z});
  return unit({std::cos(half), s * along.x, s * along.y, s * along.z});
}

Vec3 rotated(const Quaternion& q, const Vec3& v) {
  return rotated_by(q.w, {q.x, q.y, q.z}, v);
}

Vec3 rotated_back(const Quaternion& q, const Vec3& v) {
  return rotated_by(q.w, {-q.x, -q.y, -q.z}, v);
}

Pose between(const Pose& a, const Pose& b, double x) {
  if (x <= 0)
    return a;
  if (x >= 1)
    return b;
  const Quaternion &p = a.turn, &q = b.turn;
  const double same = p.w * q.w + p.x * q.x + p.y * q.y + p.z * q.z;
  const double y = same < 0 ? -x : x; // q and -q turn alike
  const Quaternion mean{(1 - x) * p.w + y * q.w, (1 - x) * p.x + y * q.x, (1 - x) * p.y + y * q.y,
                        (1 - x) * p.z + y * q.z};
  return {a.place + x * (b.place - a.place), p == q ? p : unit(mean)};
}

Pose PoseWay::at(double time) const {
  if (!(time < end))
    return to;
  const double x = time > start ? (time - start) / (end - start) : 0;
  return between(from, to, even ? x : smooth_step(x));
}

InstrumentKind kind_of(const InstrumentShape& shape) {
  return shape.blade             ? InstrumentKind::blade
         : shape.core != nullptr ? InstrumentKind::mesh
         : shape.axis == Vec3{}  ? InstrumentKind::sphere
                                 : InstrumentKind::capsule;
}

const char* instrument_kind_name(InstrumentKind kind) {
  switch (kind) {
  case InstrumentKind::sphere:
    return "sphere";
  case InstrumentKind::capsule:
    return "capsule";
  case InstrumentKind::mesh:
    return "mesh";
  default:
    return "blade";
  }
}

double reach_of(const InstrumentShape& shape) {
  return shape.core ? shape.core->reach() : norm(shape.axis);
}

PlacedInstrument::PlacedInstrument(const InstrumentShape& shape, const Pose& pose)
    : a(pose.place), ab(rotated(pose.turn, shape.axis)), radius(shape.radius),
      friction(shape.friction), core(shape.core), turn(pose.turn) {
  const double square = dot(ab, ab);
  inverse_square = square > 0 && std::isfinite(1 / square) ? 1 / square : 0;
}

Vec3 PlacedInstrument::nearest(const Vec3& p) const {
  return a + std::clamp(dot(p - a, ab) * inverse_square, 0.0, 1.0) * ab;
}

double PlacedInstrument::distance(const Vec3& p) const {
  return (core ? core->nearest(pose().inverse(p)).distance : norm(p - nearest(p))) - radius;
}

double PlacedInstrument::support(const Vec3& n) const {
  if (!core)
    return dot(n, a) + std::fmax(0, dot(n, ab)) + radius;
  const Vec3 own = rotated_back(turn, n);
  double most = -HUGE_VAL;
  for (const Vec3& corner : core->corners())
    most = std::fmax(most, dot(own, corner));
  return dot(n, a) + most + radius;
}

Vec3 PlacedInstrument::normal(const Vec3& p, const Vec3& wish) const {
  if (core)
    return rotated(turn, core->nearest(pose().inverse(p)).normal);
  const Vec3 out = p - nearest(p);
  const double size = norm(out);
  if (size > 1e-9 * radius)
    return out / size;
  Vec3 n = wish - dot(wish, ab) * inverse_square * ab;
  if (!(norm(n) > 1e-6 * norm(wish)))
    n = inverse_square > 0 ? across(ab) : Vec3{0, 0, 1};
  return n / norm(n);
}

Box3 PlacedInstrument::box() const {
  const Vec3 r{radius, radius, radius};
  Box3 b;
  if (core) {
    const Pose stands = pose();
    for (const Vec3& corner : core->corners())
      b.add(stands(corner));
  } else {
    b.add(a);
    b.add(a + ab);
  }
  b.min -= r;
  b.max += r;
  return b;
}

double path_length(const InstrumentShape& shape, const Pose& from, const Pose& to) {
  // A turn by q from p moves a point at distance r along an arc of at most r times the angle, which
  // is 2 asin of what follows, at most π times it.
  const Quaternion back{from.turn.w, -from.turn.x, -from.turn.y, -from.turn.z};
  const Quaternion by = from.turn == to.turn ? Quaternion{} : back * to.turn;
  const double sine = std::sqrt(by.x * by.x + by.y * by.y + by.z * by.z);
  return norm(to.place - from.place) + 3.2 * sine * reach_of(shape);
}

} // namespace gewebe::contact
