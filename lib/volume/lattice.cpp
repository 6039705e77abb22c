#include "volume/lattice.h"

#include "base/error.h"
#include "text/number_text.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace gewebe::volume {
namespace {

constexpr double index_limit = 1 << 30;

} // namespace

GridTransform lattice_for_dim(const Box3& box, std::int64_t dim) {
  if (dim < 1)
    throw Error("a lattice of " + std::to_string(dim) + " voxels, expected at least 1");
  if (box.empty())
    throw Error("there is nothing to lay a lattice over, expected at least one point");
  const double side = box.longest_side();
  const double voxel = side / static_cast<double>(dim);
  if (!(side > 0 && std::isfinite(side)) || !(voxel > 0))
    throw Error("the box has no extent (" + text::six_digits(side) +
                " mm), so --dim has nothing to divide");
  return uniform_transform(voxel);
}

bool index_range(const GridTransform& transform, const Box3& box, Int3& min, Int3& max) {
  if (box.empty())
    return false;
  Box3 index_box;
  for (int corner = 0; corner < 8; ++corner)
    index_box.add(transform.to_index({(corner & 1) != 0 ? box.max.x : box.min.x,
                                      (corner & 2) != 0 ? box.max.y : box.min.y,
                                      (corner & 4) != 0 ? box.max.z : box.min.z}));
  bool some = true;
  for (int a = 0; a < 3; ++a) {
    const double low = std::ceil(index_box.min[a]), high = std::floor(index_box.max[a]);
    if (!(std::fabs(low) < index_limit && std::fabs(high) < index_limit))
      throw Error("the lattice would need the voxel index " +
                  text::six_digits(std::fabs(low) < index_limit ? high : low) +
                  ", expected at most 2^30 in magnitude: choose a larger voxel");
    const auto n = static_cast<std::size_t>(a);
    min[n] = static_cast<std::int32_t>(low);
    max[n] = static_cast<std::int32_t>(high);
    some = some && min[n] <= max[n];
  }
  return some;
}

} // namespace gewebe::volume
