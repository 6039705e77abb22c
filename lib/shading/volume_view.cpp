#include "shading/volume_view.h"

#include "base/error.h"
#include "base/parallel.h"
#include "volume/field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <string>

namespace gewebe::shading {
namespace {

/// The linear part of world → index.
std::array<Vec3, 3> inverse_of(const volume::GridTransform& transform) {
  const auto& m = transform.m;
  const Vec3 x{m[0], m[4], m[8]}, y{m[1], m[5], m[9]}, z{m[2], m[6], m[10]};
  const double volume = transform.determinant();
  if (!std::isfinite(volume) || volume == 0)
    throw Error("the transform of the volume is singular, expected an invertible affine map");
  return {cross(y, z) / volume, cross(z, x) / volume, cross(x, y) / volume};
}

Box3 world_box(const volume::Grid& grid) {
  Int3 min{}, max{};
  Box3 box;
  if (grid.active_box(min, max))
    for (std::size_t corner = 0; corner < 8; ++corner) {
      Vec3 index;
      for (std::size_t a = 0; a < 3; ++a)
        index[static_cast<int>(a)] = (corner >> a & 1) != 0 ? max[a] + 0.5 : min[a] - 0.5;
      box.add(grid.info().transform.to_world(index));
    }
  return box;
}

/// Upper bounds of what the field reaches in blocks of 8³ cells; a cell lies between a voxel's
/// centre and those of the next ones.
class Bounds {
public:
  Bounds(const volume::Grid& grid, const Context& context) {
    const std::vector<volume::LeafView> leaves = grid.leaves();
    const std::vector<volume::TileView> tiles = grid.tiles();
    const float background = grid.info().background;
    Int3 low{INT32_MAX, INT32_MAX, INT32_MAX}, high{INT32_MIN, INT32_MIN, INT32_MIN};
    const auto enclose = [&](const Int3& origin, std::int32_t dim) {
      for (std::size_t a = 0; a < 3; ++a) {
        low[a] = std::min(low[a], (origin[a] >> 3) - 1); // the cells that end in it
        high[a] = std::max(high[a], (origin[a] + dim - 1) >> 3);
      }
    };
    for (const volume::LeafView& leaf : leaves)
      enclose(leaf.origin, volume::leaf_dim);
    for (const volume::TileView& tile : tiles)
      enclose(tile.origin, tile.dim);
    if (leaves.empty() && tiles.empty())
      return;
    min_ = low;
    max_ = high;
    double count = 1;
    for (std::size_t a = 0; a < 3; ++a)
      count *= static_cast<double>(max_[a]) - min_[a] + 1;
    require_memory(context, 2 * count * sizeof(float), "the bounds of the volume's blocks");
    std::vector<float> own(static_cast<std::size_t>(count), background);
    bound_ = own;
    for (const volume::LeafView& leaf : leaves)
      own[slot({leaf.origin[0] >> 3, leaf.origin[1] >> 3, leaf.origin[2] >> 3})] =
          *std::max_element(leaf.values, leaf.values + volume::leaf_voxels);
    for (const volume::TileView& tile : tiles)
      for_blocks(tile, [&](const Int3& block) { own[slot(block)] = tile.value; });
    spread(own);
  }

  bool empty() const { return bound_.empty(); }
  const Int3& min() const { return min_; }
  const Int3& max() const { return max_; }
  float at(const Int3& block) const { return bound_[slot(block)]; }

private:
  std::size_t slot(const Int3& block) const {
    const auto part = [&](std::size_t a) { return static_cast<std::size_t>(block[a] - min_[a]); };
    const auto size = [&](std::size_t a) {
      return static_cast<std::size_t>(max_[a] - min_[a] + 1);
    };
    return (part(0) * size(1) + part(1)) * size(2) + part(2);
  }
  template <class Visit>
  static void for_blocks(const volume::TileView& tile, const Visit& visit) {
    const std::int32_t n = tile.dim >> 3;
    for (std::int32_t i = 0; i < n; ++i)
      for (std::int32_t j = 0; j < n; ++j)
        for (std::int32_t k = 0; k < n; ++k)
          visit(Int3{(tile.origin[0] >> 3) + i, (tile.origin[1] >> 3) + j,
                     (tile.origin[2] >> 3) + k});
  }
  /// A block's last cells end in the next blocks.
  void spread(const std::vector<float>& own) {
    for (std::int32_t i = min_[0]; i <= max_[0]; ++i)
      for (std::int32_t j = min_[1]; j <= max_[1]; ++j)
        for (std::int32_t k = min_[2]; k <= max_[2]; ++k) {
          float& bound = bound_[slot({i, j, k})]; // background, beyond the last block too
          for (std::int32_t n = 0; n < 8; ++n) {
            const Int3 next{i + (n & 1), j + (n >> 1 & 1), k + (n >> 2)};
            if (next[0] <= max_[0] && next[1] <= max_[1] && next[2] <= max_[2])
              bound = std::max(bound, own[slot(next)]);
          }
        }
  }

  Int3 min_{}, max_{};
  std::vector<float> bound_;
};

struct Ray { // of index space
  Vec3 from, along;

  Vec3 at(double t) const { return from + along * t; }
};

/// The part t0 … t1 of the ray that lies in a box; false if none.
bool clip(const Ray& ray, const Vec3& min, const Vec3& max, double& t0, double& t1) {
  t0 = -HUGE_VAL;
  t1 = HUGE_VAL;
  for (int a = 0; a < 3; ++a) {
    if (ray.along[a] == 0) {
      if (ray.from[a] < min[a] || ray.from[a] > max[a])
        return false;
      continue;
    }
    const double one = (min[a] - ray.from[a]) / ray.along[a];
    const double other = (max[a] - ray.from[a]) / ray.along[a];
    t0 = std::max(t0, std::min(one, other));
    t1 = std::min(t1, std::max(one, other));
  }
  return t0 < t1;
}

/// Visits the cubes of edge `size` between min and max that the ray meets from t0 to t1, in order.
/// Places are computed from whole numbers at each step, so that nothing drifts.
template <class Visit>
void walk(const Ray& ray, double size, const Int3& min, const Int3& max, double t0, double t1,
          const Visit& visit) {
  const Vec3 start = ray.at(t0);
  Int3 at{};
  Vec3 next;
  const auto set_next = [&](int a) {
    const auto n = static_cast<std::size_t>(a);
    next[a] = ray.along[a] == 0
                  ? HUGE_VAL
                  : ((at[n] + (ray.along[a] > 0 ? 1 : 0)) * size - ray.from[a]) / ray.along[a];
  };
  for (int a = 0; a < 3; ++a) {
    const auto n = static_cast<std::size_t>(a);
    const double cube = std::floor(start[a] / size);
    at[n] = static_cast<std::int32_t>(
        std::clamp(cube, static_cast<double>(min[n]), static_cast<double>(max[n])));
    set_next(a);
  }
  for (double t = t0;;) {
    const int a = next.x <= next.y && next.x <= next.z ? 0 : next.y <= next.z ? 1 : 2;
    const auto n = static_cast<std::size_t>(a);
    const double end = std::max(t, std::min(next[a], t1));
    visit(at, t, end);
    if (!(next[a] < t1))
      return;
    t = end;
    at[n] += ray.along[a] > 0 ? 1 : -1;
    if (at[n] < min[n] || at[n] > max[n])
      return;
    set_next(a);
  }
}

/// The field in one cell.
struct Cell {
  Int3 at{};
  std::array<double, 8> corner{}; // n & 1 along i, 2 along j, 4 along k

  double value(const Vec3& index) const {
    std::array<double, 3> f{};
    for (std::size_t a = 0; a < 3; ++a)
      f[a] = std::clamp(index[static_cast<int>(a)] - at[a], 0.0, 1.0);
    std::array<double, 4> k{};
    for (std::size_t n = 0; n < 4; ++n)
      k[n] = corner[n] + (corner[n + 4] - corner[n]) * f[2];
    const double j0 = k[0] + (k[2] - k[0]) * f[1], j1 = k[1] + (k[3] - k[1]) * f[1];
    return j0 + (j1 - j0) * f[0];
  }

  /// The greatest value on the ray from t0 to t1.
  double max(const Ray& ray, double t0, double t1) const {
    const auto f = [&](double u) { return value(ray.at(t0 + (t1 - t0) * u)); };
    const double a = f(0), b = f(1.0 / 3), c = f(2.0 / 3), d = f(1);
    double best = std::max(a, d);
    const auto look = [&](double u) {
      if (u > 0 && u < 1)
        best = std::max(best, f(u));
    };
    // Where p + 2 q u + 3 r u² = 0, the slope of the cubic through the four values.
    const double p = -5.5 * a + 9 * b - 4.5 * c + d, q = 9 * a - 22.5 * b + 18 * c - 4.5 * d,
                 r = 4.5 * (d - a) + 13.5 * (b - c);
    const double inside = q * q - 3 * r * p;
    if (inside >= 0) {
      const double sum = -(q + std::copysign(std::sqrt(inside), q));
      if (r != 0)
        look(sum / (3 * r));
      if (sum != 0)
        look(p / sum);
    }
    return best;
  }
};

/// e^-x for x >= 0 by + * and /, so that it is the same with every libm; relative error below
/// 1e-13.
double faded(double x) {
  if (!(x < 700))
    return 0;
  int halved = 0;
  while (x > 0.0625) {
    x *= 0.5;
    ++halved;
  }
  double sum = 1;
  for (int k = 9; k > 0; --k)
    sum = 1 - x / k * sum;
  for (; halved > 0; --halved)
    sum *= sum;
  return sum;
}

class Projector {
public:
  Projector(const volume::Grid& grid, const Bounds& bounds)
      : values_(grid), bounds_(bounds), background_(static_cast<double>(grid.info().background)) {
    for (int a = 0; a < 3; ++a) {
      min_[a] = 8.0 * bounds.min()[static_cast<std::size_t>(a)];
      max_[a] = 8.0 * (bounds.max()[static_cast<std::size_t>(a)] + 1.0);
    }
  }

  float maximum(const Ray& ray) {
    double best = background_, t0 = 0, t1 = 0;
    if (bounds_.empty() || !clip(ray, min_, max_, t0, t1))
      return static_cast<float>(best);
    // The most promising block first, so that most of the others need no look.
    parts_.clear();
    walk(ray, volume::leaf_dim, bounds_.min(), bounds_.max(), t0, t1,
         [&](const Int3& block, double from, double to) {
           const auto bound = static_cast<double>(bounds_.at(block));
           if (bound > best)
             parts_.push_back({bound, from, to, block});
         });
    std::ranges::stable_sort(parts_, std::ranges::greater(), &Part::bound);
    for (const Part& part : parts_) {
      if (part.bound <= best)
        break;
      const Int3& block = part.block;
      const Int3 low{8 * block[0], 8 * block[1], 8 * block[2]};
      const Int3 high{low[0] + 7, low[1] + 7, low[2] + 7};
      float tile = 0;
      const float* const leaf = values_.leaf_at(low, tile).values;
      walk(ray, 1, low, high, part.from, part.to, [&](const Int3& at, double enter, double leave) {
        take(at, leaf);
        if (*std::ranges::max_element(cell_.corner) > best)
          best = std::max(best, cell_.max(ray, enter, leave));
      });
    }
    return static_cast<float>(best);
  }

  /// Adds the light of the volume; returns what is left of that behind it.
  double translucent(const Ray& ray, const TransferFunction& transfer, double extinction,
                     float* color) {
    constexpr int steps = 4;
    constexpr double least = 1.0 / 4096;
    const auto [low, high] = *transfer.range;
    double left = 1, t0 = 0, t1 = 0;
    std::array<double, 3> sum{};
    if (!bounds_.empty() && clip(ray, min_, max_, t0, t1))
      walk(ray, volume::leaf_dim, bounds_.min(), bounds_.max(), t0, t1,
           [&](const Int3& block, double from, double to) {
             if (left < least || static_cast<double>(bounds_.at(block)) <= low)
               return;
             const Int3 first{8 * block[0], 8 * block[1], 8 * block[2]};
             const Int3 last{first[0] + 7, first[1] + 7, first[2] + 7};
             float tile = 0;
             const float* const leaf = values_.leaf_at(first, tile).values;
             walk(ray, 1, first, last, from, to, [&](const Int3& at, double enter, double leave) {
               take(at, leaf);
               const auto [min, max] = std::ranges::minmax(cell_.corner);
               if (left < least || max <= low)
                 return;
               const int count = min == max ? 1 : steps;
               const double step = (leave - enter) / count;
               for (int n = 0; n < count; ++n) {
                 const double value = cell_.value(ray.at(enter + (n + 0.5) * step));
                 const double u = std::clamp((value - low) / (high - low), 0.0, 1.0);
                 const double through = faded(extinction * u * step);
                 const std::array<double, 3> c = texture::ramp_color(transfer.ramp, u);
                 for (std::size_t k = 0; k < 3; ++k)
                   sum[k] += left * (1 - through) * (c[k] / 255);
                 left *= through;
               }
             });
           });
    for (std::size_t k = 0; k < 3; ++k)
      color[k] = static_cast<float>(sum[k]);
    return left;
  }

private:
  struct Part { // of a ray, in a block
    double bound, from, to;
    Int3 block;
  };

  /// `leaf` holds the values of the block around, if it is there.
  void take(const Int3& at, const float* leaf) {
    cell_.at = at;
    const int corner = volume::leaf_offset(at);
    const bool within = (at[0] & 7) < 7 && (at[1] & 7) < 7 && (at[2] & 7) < 7;
    for (std::int32_t n = 0; n < 8; ++n)
      cell_.corner[static_cast<std::size_t>(n)] = static_cast<double>(
          within && leaf != nullptr
              ? leaf[corner + ((n & 1) << 6) + ((n >> 1 & 1) << 3) + (n >> 2)]
              : values_.value({at[0] + (n & 1), at[1] + (n >> 1 & 1), at[2] + (n >> 2)}));
  }

  volume::GridAccessor values_;
  const Bounds& bounds_;
  double background_;
  Vec3 min_, max_;
  Cell cell_;
  std::vector<Part> parts_;
};

Camera camera_of(const VolumeViewOptions& options, const Box3& box) {
  static const std::array<const char*, 3> views{"right", "front", "top"};
  CameraOptions camera = options.camera;
  if (options.axis != VolumeAxis::view) {
    camera.view = views[static_cast<std::size_t>(options.axis)];
    camera.eye.reset();
    camera.azimuth = camera.elevation = 0;
  }
  return make_camera(camera, box, options.width, options.height);
}

/// Half the picture's sides.
void set_extent(VolumeView& view, const VolumeViewOptions& options, const Box3& box) {
  const Camera& camera = view.camera;
  double distance = norm(camera.eye - camera.target);
  if (!options.camera.distance && !options.camera.eye && !box.empty()) {
    distance = 0;
    for (int corner = 0; corner < 8; ++corner) {
      const Vec3 p =
          Vec3{(corner & 1) != 0 ? box.max.x : box.min.x, (corner & 2) != 0 ? box.max.y : box.min.y,
               (corner & 4) != 0 ? box.max.z : box.min.z} -
          camera.target;
      distance = std::max({distance, 1.05 * std::fabs(dot(p, camera.right)) / camera.tan_x,
                           1.05 * std::fabs(dot(p, camera.up)) / camera.tan_y});
    }
  }
  view.half_width = distance * camera.tan_x;
  view.half_height = distance * camera.tan_y;
}

} // namespace

VolumeView view_volume(const volume::Grid& grid, const VolumeViewOptions& options,
                       const Context& context) {
  const volume::GridTransform& transform = grid.info().transform;
  const std::array<Vec3, 3> inverse = inverse_of(transform);
  const Box3 box = world_box(grid);
  VolumeView view;
  view.width = options.width;
  view.height = options.height;
  view.camera = camera_of(options, box);
  set_extent(view, options, box);
  const volume::ValueSummary& values = grid.summary(context);
  view.min = static_cast<double>(std::min(values.min, grid.info().background));
  view.max = static_cast<double>(std::max(values.max, grid.info().background));
  const bool translucent = options.mode == VolumeMode::translucent;
  require_memory(context, (translucent ? 4.0 : 1.0) * view.width * view.height * sizeof(float),
                 "the picture");
  view.values.resize(std::size_t{view.width} * view.height);
  TransferFunction transfer = options.transfer;
  if (translucent) {
    view.colors.resize(3 * view.values.size());
    view.range = transfer.range.value_or(std::array{view.min, view.max});
    if (!(view.range[0] < view.range[1]))
      view.range[1] = view.range[0] + 1;
    transfer.range = view.range;
    const double side = box.longest_side();
    view.extinction = transfer.extinction.value_or(side > 0 ? 8 / side : 1);
  }

  const Camera& camera = view.camera;
  Vec3 middle = camera.target;
  if (options.place && options.mode == VolumeMode::slice) {
    if (options.axis == VolumeAxis::view)
      middle -= camera.back * *options.place;
    else
      middle[static_cast<int>(options.axis)] = *options.place;
  }
  const Vec3 along{-dot(inverse[0], camera.back), -dot(inverse[1], camera.back),
                   -dot(inverse[2], camera.back)};
  // Places in the volume's box are what integers hold; beyond it is background.
  const auto far = [](const Vec3& p) {
    return !(std::max({std::fabs(p.x), std::fabs(p.y), std::fabs(p.z)}) < (1 << 30));
  };
  const Bounds bounds =
      options.mode == VolumeMode::slice ? Bounds(volume::Grid(), context) : Bounds(grid, context);
  parallel_blocks(context, view.height, 4, [&](std::size_t begin, std::size_t end) {
    volume::Field field(grid);
    Projector projector(grid, bounds);
    for (std::size_t y = begin; y < end; ++y)
      for (std::size_t x = 0; x < view.width; ++x) {
        const double right = (2 * (static_cast<double>(x) + 0.5) / view.width - 1);
        const double up = (1 - 2 * (static_cast<double>(y) + 0.5) / view.height);
        const Vec3 p = transform.to_index(middle + camera.right * (right * view.half_width) +
                                          camera.up * (up * view.half_height));
        float& value = view.values[y * view.width + x];
        if (options.mode == VolumeMode::maximum)
          value = projector.maximum({p, along});
        else if (translucent)
          value = static_cast<float>(projector.translucent({p, along}, transfer, view.extinction,
                                                           &view.colors[3 * (y * view.width + x)]));
        else
          value = far(p) ? grid.info().background : static_cast<float>(field.value(p));
      }
  });
  return view;
}

} // namespace gewebe::shading
