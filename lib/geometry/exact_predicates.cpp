#include "geometry/exact_predicates.h"
// Based on: J. R. Shewchuk, Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric
// Predicates, 1997 (expansions: sections 2.4 to 2.6, filters: section 4).

#include <array>
#include <cmath>

namespace gewebe {
namespace {

constexpr double unit_roundoff = 0x1p-53;

int sign_of(double x) {
  return (x > 0) - (x < 0);
}

/// A number as the exact sum of at most N doubles that don't overlap, smallest first, none of them
/// 0.
template <int N>
struct Expansion {
  std::array<double, N> part;
  int size = 0;

  void push(double x) {
    if (x != 0)
      part[static_cast<std::size_t>(size++)] = x;
  }
  double operator[](int n) const { return part[static_cast<std::size_t>(n)]; }
  int sign() const { return size == 0 ? 0 : sign_of((*this)[size - 1]); }
};

struct Pair {
  double high, low;
};

/// a + b = high + low exactly (Knuth).
Pair two_sum(double a, double b) {
  const double high = a + b;
  const double virtual_b = high - a;
  return {high, (a - (high - virtual_b)) + (b - virtual_b)};
}

/// The same for |a| >= |b| or a = 0 (Dekker).
Pair fast_two_sum(double a, double b) {
  const double high = a + b;
  return {high, b - (high - a)};
}

/// a b = high + low exactly, as long as nothing underflows.
Pair two_product(double a, double b) {
  const double high = a * b;
  return {high, std::fma(a, b, -high)};
}

Expansion<2> difference(double a, double b) {
  const Pair d = two_sum(a, -b);
  Expansion<2> result;
  result.push(d.low);
  result.push(d.high);
  return result;
}

/// Merges the parts by magnitude and adds them up in one sweep.
template <int M, int N>
Expansion<M + N> operator+(const Expansion<M>& e, const Expansion<N>& f) {
  Expansion<M + N> result;
  int m = 0, n = 0;
  const auto next = [&] {
    const bool from_e = n == f.size || (m < e.size && std::fabs(e[m]) < std::fabs(f[n]));
    return from_e ? e[m++] : f[n++];
  };
  if (e.size + f.size == 0)
    return result;
  double sum = next();
  while (m < e.size || n < f.size) {
    const Pair s = two_sum(sum, next());
    result.push(s.low);
    sum = s.high;
  }
  result.push(sum);
  return result;
}

template <int N>
Expansion<N> operator-(Expansion<N> e) {
  for (int n = 0; n < e.size; ++n)
    e.part[static_cast<std::size_t>(n)] = -e[n];
  return e;
}

template <int N>
Expansion<2 * N> operator*(const Expansion<N>& e, double factor) {
  Expansion<2 * N> result;
  if (e.size == 0)
    return result;
  Pair carry = two_product(e[0], factor);
  result.push(carry.low);
  for (int n = 1; n < e.size; ++n) {
    const Pair product = two_product(e[n], factor);
    const Pair middle = two_sum(carry.high, product.low);
    result.push(middle.low);
    carry = fast_two_sum(product.high, middle.high);
    result.push(carry.low);
  }
  result.push(carry.high);
  return result;
}

template <int N>
Expansion<4 * N> operator*(const Expansion<N>& e, const Expansion<2>& f) {
  Expansion<2 * N> none;
  return (f.size > 0 ? e * f[0] : none) + (f.size > 1 ? e * f[1] : none);
}

/// a d - b c
Expansion<16> minor_of(const Expansion<2>& a, const Expansion<2>& b, const Expansion<2>& c,
                       const Expansion<2>& d) {
  return a * d + -(b * c);
}

int turn_sign_exact(double ax, double ay, double bx, double by, double cx, double cy) {
  return minor_of(difference(ax, cx), difference(bx, cx), difference(ay, cy), difference(by, cy))
      .sign();
}

int side_sign_exact(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& q) {
  const Expansion<2> ax = difference(a.x, q.x), ay = difference(a.y, q.y),
                     az = difference(a.z, q.z);
  const Expansion<2> bx = difference(b.x, q.x), by = difference(b.y, q.y),
                     bz = difference(b.z, q.z);
  const Expansion<2> cx = difference(c.x, q.x), cy = difference(c.y, q.y),
                     cz = difference(c.z, q.z);
  const auto sum = minor_of(bx, cx, by, cy) * az + minor_of(cx, ax, cy, ay) * bz;
  return -(sum + minor_of(ax, bx, ay, by) * cz).sign();
}

} // namespace

int turn_sign(double ax, double ay, double bx, double by, double cx, double cy,
              std::uint64_t& exact_tests) {
  const double left = (ax - cx) * (by - cy);
  const double right = (ay - cy) * (bx - cx);
  const double det = left - right;
  // Two roundings in each product's factors, one in it, one in the difference: 3 u and second
  // order.
  const double bound =
      (3 + 16 * unit_roundoff) * unit_roundoff * (std::fabs(left) + std::fabs(right));
  if (det > bound || -det > bound)
    return sign_of(det);
  ++exact_tests;
  return turn_sign_exact(ax, ay, bx, by, cx, cy);
}

int side_sign(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& q,
              std::uint64_t& exact_tests) {
  const Vec3 ad = a - q, bd = b - q, cd = c - q;
  const double bc = bd.x * cd.y, cb = cd.x * bd.y;
  const double ca = cd.x * ad.y, ac = ad.x * cd.y;
  const double ab = ad.x * bd.y, ba = bd.x * ad.y;
  const double det = ad.z * (bc - cb) + bd.z * (ca - ac) + cd.z * (ab - ba);
  const double permanent = (std::fabs(bc) + std::fabs(cb)) * std::fabs(ad.z) +
                           (std::fabs(ca) + std::fabs(ac)) * std::fabs(bd.z) +
                           (std::fabs(ab) + std::fabs(ba)) * std::fabs(cd.z);
  const double bound = (7 + 56 * unit_roundoff) * unit_roundoff * permanent;
  if (det > bound || -det > bound)
    return -sign_of(det);
  ++exact_tests;
  return side_sign_exact(a, b, c, q);
}

} // namespace gewebe
