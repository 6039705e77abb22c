#pragma once
// Points and vectors of the world, in millimetres unless a header says otherwise.

#include <array>
#include <cmath>
#include <cstdint>

namespace gewebe {

/// Integer index (i, j, k) of a voxel or a cell.
using Int3 = std::array<std::int32_t, 3>;

struct Vec3 {
  double x = 0, y = 0, z = 0;

  double& operator[](int axis) { return axis == 0 ? x : axis == 1 ? y : z; }
  double operator[](int axis) const { return axis == 0 ? x : axis == 1 ? y : z; }
  bool operator==(const Vec3&) const = default;

  Vec3& operator+=(const Vec3& b) { return *this = {x + b.x, y + b.y, z + b.z}; }
  Vec3& operator-=(const Vec3& b) { return *this = {x - b.x, y - b.y, z - b.z}; }
  Vec3& operator*=(double s) { return *this = {x * s, y * s, z * s}; }
};

inline Vec3 operator+(Vec3 a, const Vec3& b) {
  return a += b;
}
inline Vec3 operator-(Vec3 a, const Vec3& b) {
  return a -= b;
}
inline Vec3 operator-(const Vec3& a) {
  return {-a.x, -a.y, -a.z};
}
inline Vec3 operator*(Vec3 a, double s) {
  return a *= s;
}
inline Vec3 operator*(double s, Vec3 a) {
  return a *= s;
}
inline Vec3 operator/(const Vec3& a, double s) {
  return {a.x / s, a.y / s, a.z / s};
}

inline double dot(const Vec3& a, const Vec3& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double norm(const Vec3& a) {
  return std::sqrt(dot(a, a));
}
inline bool is_finite(const Vec3& a) {
  return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z);
}

/// Axis-aligned box of the world; empty while min > max.
struct Box3 {
  Vec3 min{HUGE_VAL, HUGE_VAL, HUGE_VAL};
  Vec3 max{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};

  bool empty() const { return !(min.x <= max.x && min.y <= max.y && min.z <= max.z); }
  /// Numbers that are none are left out, as std::fmin does, whose call would cost the most here.
  void add(const Vec3& p) {
    min = {p.x <= min.x ? p.x : min.x, p.y <= min.y ? p.y : min.y, p.z <= min.z ? p.z : min.z};
    max = {p.x >= max.x ? p.x : max.x, p.y >= max.y ? p.y : max.y, p.z >= max.z ? p.z : max.z};
  }
  Vec3 size() const { return empty() ? Vec3{} : max - min; }
  double longest_side() const { return std::fmax(size().x, std::fmax(size().y, size().z)); }
};

} // namespace gewebe
