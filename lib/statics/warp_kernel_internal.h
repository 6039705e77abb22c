#pragma once
// The inner loops of statics/rotation_strain.h and statics/rotation_warp.h: triangles four at a
// time, and columns. Compiled once per CPU level; every level gives the same bits.

#include "base/cpu.h"

#include <cstddef>
#include <cstdint>

namespace gewebe::statics {

/// Four triangles side by side; those that fill up the last group are all 0.
struct TriangleGroup {
  std::uint32_t node[3][4];
  double gradient[2][3][4]; ///< of the second and third shape function, 1/mm, by axis
  double normal[3][4];
  double area[4];
};

/// Four middles of edges, between the nodes a and b of two triangles.
struct MiddleGroup {
  std::uint32_t node[4], a[4], b[4];
  std::uint32_t triangle[2][4];
  double free[3][4]; ///< 1, or 0 along an axis that is held
};

struct WarpKernel {
  /// Puts half of the curl in triangle t to w[3 t].
  void (*find_rotations)(const TriangleGroup* groups, std::size_t count, const double* local,
                         double* w);
  /// Adds area (R (I + E + E² / 2 + [r]) - I) ∇N to the nodes of each triangle, in frames that are
  /// turned by w, r the rotation beyond that. It is the divergence of the gradients that `local`
  /// prescribes for the surface.
  void (*ask)(const TriangleGroup* groups, std::size_t count, const double* local, const double* w,
              double* divergence);
  /// Middles of edges whose ends are displaced by u: as far from the middle of those as in `local`,
  /// turned by the triangles' mean w.
  void (*turn_middles)(const MiddleGroup* groups, std::size_t count, const double* w,
                       const double* local, double* u);
  /// The transposed derivative of the same, times y: by w, over the area, of triangle t to
  /// moments[3 t]; and added to forces that by `local`, where moments, over the area, act on its
  /// rotations besides.
  void (*find_moments)(const TriangleGroup* groups, std::size_t count, const double* local,
                       const double* w, const double* y, double* moments);
  void (*take_back)(const TriangleGroup* groups, std::size_t count, const double* local,
                    const double* w, const double* y, const double* moments, double* forces);
  /// sum[k] = Σ factor[c] columns[stride c + k] of the first `rows` k.
  void (*combine)(const float* columns, std::size_t stride, std::size_t rows, const double* factor,
                  std::size_t count, double* sum);
  /// product[c] = Σ columns[stride c + k] by[k] over the first `rows` k.
  void (*project)(const float* columns, std::size_t stride, std::size_t rows, const double* by,
                  std::size_t count, double* product);
};

extern const WarpKernel warp_kernel_baseline, warp_kernel_avx2;

inline const WarpKernel& warp_kernel(CpuLevel level) {
  return level == CpuLevel::baseline ? warp_kernel_baseline : warp_kernel_avx2;
}

} // namespace gewebe::statics
