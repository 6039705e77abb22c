#include "density/density_kernel_internal.h"

#include <cmath>

namespace gewebe::density {
namespace {

/// Accumulated over the particles, one slot a child.
struct Sums {
  float lower[8] = {}, upper[8] = {}, absolute[8] = {}, weight[8] = {};
  float value[8] = {}, gradient[3][8] = {}, curvature[8] = {};
};

float larger(float a, float b) {
  return a > b ? a : b;
}

float density(float u) {
  return u * u * (4.0F / 9 * u + 5.0F / 9);
}

/// Distance of the particle from the child's centre along each axis.
void offsets(const IndexParticle& p, const Children& children, int child, float offset[3]) {
  const double center[3] = {p.x, p.y, p.z};
  const float half = (children.size - 1) / 2;
  for (int axis = 0; axis < 3; ++axis) {
    const bool far = (child >> (2 - axis) & 1) != 0;
    offset[axis] = (far ? children.size + half : half) -
                   static_cast<float>(center[axis] - children.origin[axis]);
  }
}

void add_child(const IndexParticle& p, const Children& children, int child, Sums& sums) {
  float offset[3];
  offsets(p, children, child, offset);
  const float inverse2 = p.inverse_radius * p.inverse_radius;
  const float half = (children.size - 1) / 2 + children.size * box_slack;
  float nearest2 = 0, farthest2 = 0, center2 = 0, nearer2 = 0, farthest = 0;
  for (const float o : offset) {
    const float d = std::fabs(o);
    const float low = larger(d - half, 0);
    const float lower = larger(d - half - 1, 0); // one voxel further out
    const float high = d + half;
    nearest2 += low * low;
    nearer2 = larger(nearer2, low * low - lower * lower);
    farthest2 += high * high;
    farthest = larger(farthest, high);
    center2 += d * d;
  }
  const float u_near = larger(1 - inverse2 * (nearest2 - nearer2), 0);
  const float u_far = larger(1 - inverse2 * (farthest2 + 2 * farthest + 1), 0);
  const float u = larger(1 - inverse2 * center2, 0);
  const float max = p.weight * density(u_near);
  const float min = p.weight * density(u_far);
  sums.upper[child] += p.weight > 0 ? max : min;
  sums.lower[child] += p.weight > 0 ? min : max;
  sums.absolute[child] += std::fabs(max);
  if (!(inverse2 * (nearest2 - nearer2) < reach_limit))
    return;
  sums.weight[child] += std::fabs(p.weight);
  sums.curvature[child] += std::fabs(p.weight) * inverse2;
  sums.value[child] += p.weight * density(u);
  // d density/d t = -u (10 + 12 u)/9
  const float slope = -2 * p.weight * inverse2 * u * (10.0F / 9 + 12.0F / 9 * u);
  for (int axis = 0; axis < 3; ++axis)
    sums.gradient[axis][child] += slope * offset[axis];
}

} // namespace

void add_density_baseline(const LeafParticle* particles, std::size_t count, float* values) {
  for (std::size_t n = 0; n < count; ++n) {
    const LeafParticle p = particles[n];
    const float cubic = p.weight * (4.0F / 9);
    const float square = p.weight * (5.0F / 9);
    float x2[8], y2[8], z2[8];
    for (int i = 0; i < 8; ++i) {
      const float x = (static_cast<float>(i) - p.x) * p.inverse_radius;
      const float y = (static_cast<float>(i) - p.y) * p.inverse_radius;
      const float z = (static_cast<float>(i) - p.z) * p.inverse_radius;
      x2[i] = x * x;
      y2[i] = y * y;
      z2[i] = z * z;
    }
    for (int i = 0; i < 8; ++i)
      for (int j = 0; j < 8; ++j) {
        const float rest = (1 - x2[i]) - y2[j];
        if (!(rest > 0))
          continue;
        float* const row = values + (i * 64 + j * 8);
        for (int k = 0; k < 8; ++k) {
          const float u = rest - z2[k];
          if (u > 0)
            row[k] = std::fma(u * u, std::fma(cubic, u, square), row[k]);
        }
      }
  }
}

void reach_children_baseline(const IndexParticle* particles, const std::uint32_t* list,
                             std::size_t count, const Children& children, float margin,
                             std::uint8_t* masks) {
  const float half = (children.size - 1) / 2 + children.size * box_slack + margin;
  for (std::size_t n = 0; n < count; ++n) {
    const IndexParticle& p = particles[list[n]];
    unsigned mask = 0;
    for (int child = 0; child < 8; ++child) {
      float offset[3];
      offsets(p, children, child, offset);
      float nearest2 = 0;
      for (const float o : offset) {
        const float low = larger(std::fabs(o) - half, 0) * p.inverse_radius;
        nearest2 += low * low;
      }
      mask |= (nearest2 < reach_limit ? 1U : 0U) << child;
    }
    masks[n] = static_cast<std::uint8_t>(mask);
  }
}

void bound_children_baseline(const IndexParticle* particles, const std::uint32_t* list,
                             std::size_t count, const Children& children, std::uint8_t* masks,
                             ChildBounds& bounds) {
  reach_children_baseline(particles, list, count, children, 1, masks);
  Sums sums;
  for (std::size_t n = 0; n < count; ++n)
    for (int child = 0; child < 8; ++child)
      add_child(particles[list[n]], children, child, sums);
  const float half = (children.size - 1) / 2 + children.size * box_slack;
  const float reach2 = 2 * half * half + (half + 1) * (half + 1);
  const float terms = accumulation_rounding * static_cast<float>(count + 8);
  for (int c = 0; c < 8; ++c) {
    const float gx = std::fabs(sums.gradient[0][c]), gy = std::fabs(sums.gradient[1][c]),
                gz = std::fabs(sums.gradient[2][c]);
    const float spread = half * (gx + gy + gz) + larger(larger(gx, gy), gz) +
                         0.5F * curvature_bound * reach2 * sums.curvature[c];
    const float rounding = term_rounding * sums.weight[c] + terms * sums.absolute[c];
    const float low = sums.value[c] - spread, high = sums.value[c] + spread;
    bounds.lower[c] = larger(sums.lower[c], low) - rounding;
    bounds.upper[c] = (sums.upper[c] < high ? sums.upper[c] : high) + rounding;
  }
}

} // namespace gewebe::density
