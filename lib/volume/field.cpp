#include "volume/field.h"

#include <cmath>
#include <cstddef>

namespace gewebe::volume {
namespace {

/// The voxel at or below a place, and how far beyond it the place lies.
Int3 voxel_below(const Vec3& index, Vec3& fraction) {
  Int3 voxel{};
  for (int a = 0; a < 3; ++a) {
    const double whole = std::floor(index[a]);
    voxel[static_cast<std::size_t>(a)] = static_cast<std::int32_t>(whole);
    fraction[a] = index[a] - whole;
  }
  return voxel;
}

double mix(double a, double b, double t) {
  return a + (b - a) * t;
}

} // namespace

Field::Field(const Grid& grid) : values_(grid) {
  const auto& m = grid.info().transform.m;
  const Vec3 x{m[0], m[4], m[8]}, y{m[1], m[5], m[9]}, z{m[2], m[6], m[10]};
  const double volume = grid.info().transform.determinant();
  inverse_ = {cross(y, z) / volume, cross(z, x) / volume, cross(x, y) / volume};
}

double Field::value(const Vec3& index) {
  Vec3 t;
  const Int3 v = voxel_below(index, t);
  const auto at = [&](int i, int j, int k) {
    return static_cast<double>(values_.value({v[0] + i, v[1] + j, v[2] + k}));
  };
  const auto along_k = [&](int i, int j) { return mix(at(i, j, 0), at(i, j, 1), t.z); };
  const auto along_j = [&](int i) { return mix(along_k(i, 0), along_k(i, 1), t.y); };
  return mix(along_j(0), along_j(1), t.x);
}

Vec3 Field::gradient(const Vec3& index) {
  Vec3 t;
  const Int3 v = voxel_below(index, t);
  // The 4³ voxels round the cell without those that no difference needs.
  std::array<double, 64> values{};
  const auto slot = [](int i, int j, int k) {
    return static_cast<std::size_t>(((i + 1) * 4 + j + 1) * 4 + k + 1);
  };
  for (int i = -1; i <= 2; ++i)
    for (int j = -1; j <= 2; ++j)
      for (int k = -1; k <= 2; ++k)
        if ((i == -1 || i == 2) + (j == -1 || j == 2) + (k == -1 || k == 2) <= 1)
          values[slot(i, j, k)] =
              static_cast<double>(values_.value({v[0] + i, v[1] + j, v[2] + k}));
  Vec3 sum;
  for (int corner = 0; corner < 8; ++corner) {
    const int i = corner & 1, j = corner >> 1 & 1, k = corner >> 2 & 1;
    const double weight =
        (i != 0 ? t.x : 1 - t.x) * (j != 0 ? t.y : 1 - t.y) * (k != 0 ? t.z : 1 - t.z);
    sum += Vec3{values[slot(i + 1, j, k)] - values[slot(i - 1, j, k)],
                values[slot(i, j + 1, k)] - values[slot(i, j - 1, k)],
                values[slot(i, j, k + 1)] - values[slot(i, j, k - 1)]} *
           (weight / 2);
  }
  return inverse_[0] * sum.x + inverse_[1] * sum.y + inverse_[2] * sum.z;
}

} // namespace gewebe::volume
