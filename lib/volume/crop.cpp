#include "volume/crop.h"

#include "base/error.h"
#include "base/parallel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace gewebe::volume {
namespace {

constexpr std::array<Int3, 6> steps{
    {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}}};

Int3 operator+(const Int3& a, const Int3& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}

Vec3 real(const Int3& ijk) {
  return {static_cast<double>(ijk[0]), static_cast<double>(ijk[1]), static_cast<double>(ijk[2])};
}

bool contains(const Box3& box, const Vec3& p) {
  return p.x >= box.min.x && p.x <= box.max.x && p.y >= box.min.y && p.y <= box.max.y &&
         p.z >= box.min.z && p.z <= box.max.z;
}

enum class Place { within, across, apart };

class Cropper {
public:
  Cropper(const Grid& grid, const Box3& box, double isovalue)
      : grid_(grid), box_(box), isovalue_(isovalue) {}

  /// Where the voxels of a block lie, and their neighbours.
  Place place(const Int3& origin, std::int32_t dim) const {
    Box3 block;
    bool within = true;
    for (int corner = 0; corner < 8; ++corner) {
      const auto index = [&](std::size_t a) {
        return origin[a] + ((corner >> a & 1) != 0 ? static_cast<double>(dim) : -1.0);
      };
      const Vec3 p = grid_.info().transform.to_world({index(0), index(1), index(2)});
      block.add(p);
      within = within && contains(box_, p);
    }
    if (within)
      return Place::within;
    for (int a = 0; a < 3; ++a)
      if (block.max[a] < box_.min[a] || block.min[a] > box_.max[a])
        return Place::apart;
    return Place::across;
  }

  void fill(const LeafRef& leaf) const {
    GridAccessor old(grid_);
    const GridInfo& info = grid_.info();
    for (int n = 0; n < leaf_voxels; ++n) {
      const Int3 ijk = leaf.origin + Int3{n >> 6, n >> 3 & 7, n & 7};
      const Vec3 p = info.transform.to_world(real(ijk));
      const float value = contains(box_, p) ? old.value(ijk) : beyond(old, ijk, p);
      leaf.values[n] = value;
      if (info.level_set ? std::fabs(value) < std::fabs(info.background) : value != info.background)
        leaf.active[n >> 6] |= std::uint64_t{1} << (n & 63);
    }
  }

private:
  /// Value of a voxel outside the box at world p: background, or what puts the surface on the box.
  float beyond(GridAccessor& old, const Int3& ijk, const Vec3& p) const {
    const GridInfo& info = grid_.info();
    const double sign = info.level_set ? -1 : 1;
    double below = 0; // the isovalue
    for (const Int3& step : steps) {
      const Vec3 q = info.transform.to_world(real(ijk + step));
      if (!contains(box_, q))
        continue;
      const double above = sign * (static_cast<double>(old.value(ijk + step)) - isovalue_);
      if (!(above > 0))
        continue;
      double t = 1; // q + t (p - q) lies on the box; linear interpolation is to give the isovalue
      for (int a = 0; a < 3; ++a) {
        if (p[a] > box_.max[a])
          t = std::fmin(t, (box_.max[a] - q[a]) / (p[a] - q[a]));
        if (p[a] < box_.min[a])
          t = std::fmin(t, (box_.min[a] - q[a]) / (p[a] - q[a]));
      }
      t = std::fmax(t, 1e-3);
      below = std::fmax(below, above * (1 - t) / t);
    }
    return below > 0 ? static_cast<float>(isovalue_ - sign * below) : info.background;
  }

  const Grid& grid_;
  Box3 box_;
  double isovalue_;
};

/// What becomes of the regions of the old grid.
struct Plan {
  std::vector<LeafView> shared;
  std::vector<TileView> tiles;
  std::vector<Int3> leaves; // to be filled
};

void split(const Cropper& cropper, const TileView& tile, Plan& plan) {
  const Place place = cropper.place(tile.origin, tile.dim);
  if (place == Place::apart)
    return;
  if (place == Place::within) {
    plan.tiles.push_back(tile);
  } else if (tile.dim == leaf_dim) {
    plan.leaves.push_back(tile.origin);
  } else {
    const std::int32_t child = tile.dim == 4096 ? 128 : leaf_dim;
    for (std::int32_t i = 0; i < tile.dim; i += child)
      for (std::int32_t j = 0; j < tile.dim; j += child)
        for (std::int32_t k = 0; k < tile.dim; k += child)
          split(cropper, {tile.origin + Int3{i, j, k}, child, tile.value, tile.active}, plan);
  }
}

Plan make_plan(const Cropper& cropper, const Grid& grid) {
  Plan plan;
  for (const LeafView& leaf : grid.leaves()) {
    const Place place = cropper.place(leaf.origin, leaf_dim);
    if (place == Place::within)
      plan.shared.push_back(leaf);
    else if (place == Place::across)
      plan.leaves.push_back(leaf.origin);
  }
  for (const TileView& tile : grid.tiles())
    split(cropper, tile, plan);
  // A voxel beyond the box may lie in a block that the old grid has nothing in.
  const std::size_t own = plan.leaves.size();
  for (std::size_t n = 0; n < own; ++n)
    for (const Int3& step : steps) {
      const Int3 next = plan.leaves[n] + Int3{8 * step[0], 8 * step[1], 8 * step[2]};
      if (cropper.place(next, leaf_dim) == Place::across)
        plan.leaves.push_back(next);
    }
  std::ranges::sort(plan.leaves);
  plan.leaves.erase(std::ranges::unique(plan.leaves).begin(), plan.leaves.end());
  return plan;
}

} // namespace

Grid crop(const Context& context, const Grid& grid, const Box3& box, double isovalue) {
  const GridInfo& info = grid.info();
  if (box.empty())
    throw Error("the box is empty, expected corners with each minimum below its maximum");
  const double volume = info.transform.determinant();
  if (!std::isfinite(volume) || volume == 0)
    throw Error("the transform of the volume is singular, expected an invertible affine map");
  const auto background = static_cast<double>(info.background);
  if (info.level_set ? background < isovalue : background > isovalue)
    throw Error("what surrounds the volume is inside, so that no box can be cut out of it");
  const Cropper cropper(grid, box, isovalue);
  const Plan plan = make_plan(cropper, grid);
  require_memory(context,
                 static_cast<double>(plan.leaves.size()) * (leaf_voxels * sizeof(float) + 200),
                 "the part of the volume");
  GridBuilder builder(info);
  for (const TileView& tile : plan.tiles)
    builder.add_tile(tile);
  for (const LeafView& leaf : plan.shared)
    builder.share_leaf(grid, leaf);
  const std::vector<LeafRef> leaves = builder.add_leaves(context, plan.leaves);
  parallel_blocks(context, leaves.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n)
      cropper.fill(leaves[n]);
  });
  return builder.finish();
}

} // namespace gewebe::volume
