#include "labels/contour_density.h"

#include "base/error.h"
#include "base/parallel.h"
#include "text/number_text.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>

namespace gewebe::labels {
namespace {

using Point = std::array<double, 2>; // in the plane of a slice, voxels

struct Edge {
  Point a{}, b{};
};

struct Slice {
  double height = 0; // voxels
  std::vector<Edge> edges;
  std::vector<float> distance; // voxels, by [v][u]
  double deepest = 0;          // largest distance, voxels
};

/// Pixels of all slices: lattice indices from `low` on, in whole tiles of 8.
struct Window {
  std::array<std::int32_t, 2> low{}, count{};
  std::size_t size() const {
    return static_cast<std::size_t>(count[0]) * static_cast<std::size_t>(count[1]);
  }
};

constexpr double flat = 1e-6;   // of the contours' size: written coordinates are rounded
constexpr double half_tile = 4; // voxels
constexpr double inf = std::numeric_limits<double>::infinity();
constexpr const char* axis_names[] = {"x", "y", "z"};

double box_size(std::span<const Contour> contours) {
  double low = inf, high = -inf, size = 0;
  for (int a = 0; a < 3; ++a) {
    low = inf, high = -inf;
    for (const Contour& contour : contours)
      for (const Vec3& p : contour) {
        low = std::fmin(low, p[a]);
        high = std::fmax(high, p[a]);
      }
    size = std::fmax(size, high - low);
  }
  return size;
}

bool is_across(const Contour& contour, int axis, double tolerance) {
  return std::ranges::all_of(contour, [&](const Vec3& p) {
    return std::fabs(p[axis] - contour.front()[axis]) <= tolerance;
  });
}

/// The axis across all contours. One that is flat in two directions has no area and fits both.
int common_axis(std::span<const Contour> contours, double tolerance) {
  for (const int axis : {2, 1, 0})
    if (std::ranges::all_of(contours,
                            [&](const Contour& c) { return is_across(c, axis, tolerance); }))
      return axis;
  for (std::size_t n = 0; n < contours.size(); ++n)
    if (!is_across(contours[n], 0, tolerance) && !is_across(contours[n], 1, tolerance) &&
        !is_across(contours[n], 2, tolerance))
      throw Error("contour " + std::to_string(n + 1) +
                  " is not flat, expected one in a plane of constant x, y or z");
  throw Error("contours lie across different axes, expected parallel slices");
}

std::vector<Slice> slices_of(std::span<const Contour> contours, int axis, double tolerance,
                             double voxel) {
  std::vector<std::pair<double, const Contour*>> order;
  for (const Contour& contour : contours)
    order.emplace_back(contour.front()[axis], &contour);
  std::ranges::stable_sort(order, {}, &std::pair<double, const Contour*>::first);
  std::vector<Slice> slices;
  double last = -inf;
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  for (const auto& [height, contour] : order) {
    if (slices.empty() || !(height - last <= tolerance))
      slices.push_back({height / voxel, {}, {}, 0});
    last = height;
    for (std::size_t n = 0; n < contour->size(); ++n) {
      const Vec3 &a = (*contour)[n], &b = (*contour)[(n + 1) % contour->size()];
      slices.back().edges.push_back({{a[u] / voxel, a[v] / voxel}, {b[u] / voxel, b[v] / voxel}});
    }
  }
  return slices;
}

double squared_distance(const Point& p, const Edge& e) {
  const double x = e.b[0] - e.a[0], y = e.b[1] - e.a[1];
  const double length = x * x + y * y;
  double t = length > 0 ? ((p[0] - e.a[0]) * x + (p[1] - e.a[1]) * y) / length : 0;
  t = std::clamp(t, 0.0, 1.0);
  const double dx = p[0] - e.a[0] - t * x, dy = p[1] - e.a[1] - t * y;
  return dx * dx + dy * dy;
}

/// Whether the ray from p towards +u crosses the edge. Of the ends only the lower counts, so that a
/// corner is crossed once.
bool is_crossed(const Point& p, const Edge& e) {
  if ((e.a[1] <= p[1]) == (e.b[1] <= p[1]))
    return false;
  const double t = (p[1] - e.a[1]) / (e.b[1] - e.a[1]);
  return e.a[0] + t * (e.b[0] - e.a[0]) > p[0];
}

/// Distances at the pixels of a tile of 8 x 8. `near` and `right` are work space: edges that may be
/// the nearest of a pixel, and those that rays may cross.
void measure_tile(const Slice& slice, const Window& window, const std::array<std::int32_t, 2>& tile,
                  std::vector<double>& far, std::vector<Edge>& near, std::vector<Edge>& right,
                  float* distance) {
  const Point low{window.low[0] + 8.0 * tile[0], window.low[1] + 8.0 * tile[1]};
  const Point middle{low[0] + half_tile, low[1] + half_tile};
  const double radius = half_tile * std::sqrt(2.0);
  far.clear();
  near.clear();
  right.clear();
  for (const Edge& e : slice.edges)
    far.push_back(std::sqrt(squared_distance(middle, e)));
  const double nearest = *std::ranges::min_element(far);
  for (std::size_t n = 0; n < slice.edges.size(); ++n) {
    const Edge& e = slice.edges[n];
    if (far[n] <= nearest + 2 * radius)
      near.push_back(e);
    if (std::fmax(e.a[1], e.b[1]) >= low[1] && std::fmin(e.a[1], e.b[1]) <= low[1] + 7 &&
        std::fmax(e.a[0], e.b[0]) >= low[0])
      right.push_back(e);
  }
  for (int j = 0; j < 8; ++j)
    for (int i = 0; i < 8; ++i) {
      const Point p{low[0] + i, low[1] + j};
      double least = inf;
      for (const Edge& e : near)
        least = std::fmin(least, squared_distance(p, e));
      bool inside = false;
      for (const Edge& e : right)
        inside ^= is_crossed(p, e);
      const std::size_t at =
          static_cast<std::size_t>(8 * tile[1] + j) * static_cast<std::size_t>(window.count[0]) +
          static_cast<std::size_t>(8 * tile[0] + i);
      distance[at] = static_cast<float>(inside ? std::sqrt(least) : -std::sqrt(least));
    }
}

void measure(const Context& context, const Window& window, Slice& slice) {
  slice.distance.resize(window.size());
  const std::int32_t across = window.count[0] / 8, rows = window.count[1] / 8;
  parallel_blocks(context, static_cast<std::size_t>(rows), 1,
                  [&](std::size_t begin, std::size_t end) {
                    std::vector<double> far;
                    std::vector<Edge> near, right;
                    for (std::size_t row = begin; row < end; ++row)
                      for (std::int32_t column = 0; column < across; ++column)
                        measure_tile(slice, window, {column, static_cast<std::int32_t>(row)}, far,
                                     near, right, slice.distance.data());
                  });
  slice.deepest = std::fmax(0.0, *std::ranges::max_element(slice.distance));
}

/// F at one height: offset + sum of weight · distance over up to four slices.
struct Layer {
  std::array<const float*, 4> distance{};
  std::array<double, 4> weight{};
  double offset = 0;
  double at(std::size_t pixel) const {
    double sum = offset;
    for (std::size_t n = 0; n < 4; ++n)
      if (distance[n] != nullptr)
        sum += weight[n] * distance[n][pixel];
    return sum;
  }
};

/// Adds slope · factor to a layer, the slope at slice k in units of distance per height.
void add_slope(const std::vector<Slice>& slices, std::size_t k, double factor, std::size_t first,
               Layer& layer) {
  const auto add = [&](std::size_t slice, double weight) {
    layer.distance.at(slice - first) = slices[slice].distance.data();
    layer.weight.at(slice - first) += factor * weight;
  };
  const bool before = k > 0, behind = k + 1 < slices.size();
  const double h0 = before ? slices[k].height - slices[k - 1].height : 0;
  const double h1 = behind ? slices[k + 1].height - slices[k].height : 0;
  // Slope of the parabola through three slices: weighted mean of both differences, with the larger
  // weight for the shorter interval.
  const double w0 = before ? (behind ? h1 / (h0 + h1) : 1) : 0, w1 = 1 - w0;
  if (before) {
    add(k, w0 / h0);
    add(k - 1, -w0 / h0);
  }
  if (behind) {
    add(k + 1, w1 / h1);
    add(k, -w1 / h1);
  }
}

Layer cap_of(const Slice& slice, double way, double spacing) {
  Layer layer;
  layer.distance[0] = slice.distance.data();
  layer.weight[0] = 1;
  const double tau = way / spacing;
  layer.offset =
      tau < 1 ? -slice.deepest * (1 - std::sqrt(1 - tau * tau)) : -slice.deepest - (way - spacing);
  return layer;
}

Layer layer_at(const std::vector<Slice>& slices, double height) {
  const std::size_t last = slices.size() - 1;
  if (height < slices[0].height)
    return cap_of(slices[0], slices[0].height - height, slices[1].height - slices[0].height);
  if (height > slices[last].height)
    return cap_of(slices[last], height - slices[last].height,
                  slices[last].height - slices[last - 1].height);
  std::size_t k = 0;
  while (k + 1 < last && slices[k + 1].height <= height)
    ++k;
  const double h = slices[k + 1].height - slices[k].height, t = (height - slices[k].height) / h;
  const std::size_t first = k > 0 ? k - 1 : 0;
  Layer layer;
  const auto add = [&](std::size_t slice, double weight) {
    layer.distance.at(slice - first) = slices[slice].distance.data();
    layer.weight.at(slice - first) += weight;
  };
  add(k, (1 + 2 * t) * (1 - t) * (1 - t));
  add(k + 1, t * t * (3 - 2 * t));
  add_slope(slices, k, h * t * (1 - t) * (1 - t), first, layer);
  add_slope(slices, k + 1, -h * t * t * (1 - t), first, layer);
  return layer;
}

struct Leaf {
  Int3 origin{};
  std::array<float, volume::leaf_voxels> values{};
};

/// Leaves and tiles of one row of cubes of 8 voxels along the first axis of the slices.
struct Row {
  std::vector<volume::TileView> tiles;
  std::vector<Leaf> leaves;
};

/// Whether density is 1 (or 0) in the whole cube. |F| changes by no more than the sum of the
/// weights' sizes, below 1.5, per voxel in a slice.
bool is_far(const std::array<Layer, 8>& layers, std::size_t middle, bool inside) {
  constexpr double reach = 1.5 * half_tile * 1.42 + 1;
  return std::ranges::all_of(layers, [&](const Layer& layer) {
    const double f = layer.at(middle);
    return inside ? f > reach : f < -reach;
  });
}

void fill_row(const std::array<Layer, 8>& layers, const Window& window, std::int32_t tile_v,
              std::int32_t base, int axis, Row& row) {
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  const auto width = static_cast<std::size_t>(window.count[0]);
  for (std::int32_t tile_u = 0; tile_u < window.count[0] / 8; ++tile_u) {
    const std::size_t corner =
        static_cast<std::size_t>(8 * tile_v) * width + static_cast<std::size_t>(8 * tile_u);
    Int3 origin{};
    origin[static_cast<std::size_t>(u)] = window.low[0] + 8 * tile_u;
    origin[static_cast<std::size_t>(v)] = window.low[1] + 8 * tile_v;
    origin[static_cast<std::size_t>(axis)] = base;
    if (is_far(layers, corner + 4 * width + 4, false))
      continue;
    if (is_far(layers, corner + 4 * width + 4, true)) {
      row.tiles.push_back({origin, 8, 1.0F, true});
      continue;
    }
    Leaf leaf{origin, {}};
    bool empty = true, full = true;
    for (std::int32_t w = 0; w < 8; ++w)
      for (std::int32_t j = 0; j < 8; ++j)
        for (std::int32_t i = 0; i < 8; ++i) {
          const double f =
              layers.at(static_cast<std::size_t>(w))
                  .at(corner + static_cast<std::size_t>(j) * width + static_cast<std::size_t>(i));
          const auto value = static_cast<float>(std::clamp(0.5 + 0.5 * f, 0.0, 1.0));
          Int3 at{};
          at[static_cast<std::size_t>(u)] = i;
          at[static_cast<std::size_t>(v)] = j;
          at[static_cast<std::size_t>(axis)] = w;
          leaf.values.at(static_cast<std::size_t>(volume::leaf_offset(at))) = value;
          empty = empty && value == 0;
          full = full && value == 1;
        }
    if (full)
      row.tiles.push_back({origin, 8, 1.0F, true});
    else if (!empty)
      row.leaves.push_back(leaf);
  }
}

Window window_of(const std::vector<Slice>& slices) {
  std::array<double, 2> low{inf, inf}, high{-inf, -inf};
  for (const Slice& slice : slices)
    for (const Edge& e : slice.edges)
      for (std::size_t a = 0; a < 2; ++a) {
        low.at(a) = std::fmin(low.at(a), e.a.at(a));
        high.at(a) = std::fmax(high.at(a), e.a.at(a));
      }
  if (!(low[0] > -0x1p30 && low[1] > -0x1p30 && high[0] < 0x1p30 && high[1] < 0x1p30))
    throw Error("an index of the volume would leave ±2^30, expected a larger voxel");
  Window window;
  for (std::size_t a = 0; a < 2; ++a) {
    window.low.at(a) = static_cast<std::int32_t>(std::floor(low.at(a))) - 2;
    window.low.at(a) -= ((window.low.at(a) % 8) + 8) % 8; // whole leaves
    window.count.at(a) =
        (static_cast<std::int32_t>(std::floor(high.at(a))) + 3 - window.low.at(a) + 7) / 8 * 8;
  }
  return window;
}

/// Heights of the grid: whole leaves around the caps.
std::array<std::int32_t, 2> heights_of(const std::vector<Slice>& slices) {
  const std::size_t last = slices.size() - 1;
  const double low = slices[0].height - (slices[1].height - slices[0].height) - 2,
               high = slices[last].height + (slices[last].height - slices[last - 1].height) + 2;
  if (!(low > -0x1p30 && high < 0x1p30))
    throw Error("an index of the volume would leave ±2^30, expected a larger voxel");
  auto first = static_cast<std::int32_t>(std::floor(low));
  first -= ((first % 8) + 8) % 8;
  return {first, (static_cast<std::int32_t>(std::floor(high)) - first) / 8 + 1};
}

void describe(std::span<const Contour> contours, const std::vector<Slice>& slices, double voxel,
              int axis, ContourDensityReport& report) {
  report = {axis, slices.size(), contours.size(), 0, inf, 0};
  for (const Contour& contour : contours)
    report.points += contour.size();
  for (std::size_t k = 1; k < slices.size(); ++k) {
    const double spacing = (slices[k].height - slices[k - 1].height) * voxel;
    report.least_spacing = std::fmin(report.least_spacing, spacing);
    report.greatest_spacing = std::fmax(report.greatest_spacing, spacing);
  }
}

} // namespace

volume::Grid contour_density(const Context& context, std::span<const Contour> contours,
                             double voxel, ContourDensityReport* report) {
  const double tolerance = flat * box_size(contours);
  const int axis = common_axis(contours, tolerance);
  std::vector<Slice> slices = slices_of(contours, axis, tolerance, voxel);
  if (slices.size() < 2)
    throw Error("contours in one slice alone, at " + std::string(axis_names[axis]) + " = " +
                text::six_digits(slices.empty() ? 0 : slices[0].height * voxel) +
                " mm, expected two slices or more");
  const Window window = window_of(slices);
  const auto [base, layers_of_leaves] = heights_of(slices);
  const std::int32_t rows = window.count[1] / 8;
  require_memory(context,
                 4.0 * static_cast<double>(window.size()) * static_cast<double>(slices.size()) +
                     48.0 * rows * layers_of_leaves,
                 "the distances to the contours");
  for (Slice& slice : slices)
    measure(context, window, slice);
  if (report != nullptr)
    describe(contours, slices, voxel, axis, *report);

  std::vector<Row> parts(static_cast<std::size_t>(rows) *
                         static_cast<std::size_t>(layers_of_leaves));
  const std::int32_t bottom = base; // bindings can't be captured
  parallel_blocks(context, parts.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      const auto level = static_cast<std::int32_t>(n / static_cast<std::size_t>(rows));
      std::array<Layer, 8> layers;
      for (std::int32_t w = 0; w < 8; ++w)
        layers.at(static_cast<std::size_t>(w)) = layer_at(slices, bottom + 8 * level + w);
      fill_row(layers, window, static_cast<std::int32_t>(n % static_cast<std::size_t>(rows)),
               bottom + 8 * level, axis, parts[n]);
    }
  });
  volume::GridInfo info;
  info.transform = volume::uniform_transform(voxel);
  volume::GridBuilder builder(info);
  std::vector<Int3> origins;
  std::vector<const Leaf*> filled;
  for (const Row& row : parts) {
    for (const volume::TileView& tile : row.tiles)
      builder.add_tile(tile);
    for (const Leaf& leaf : row.leaves) {
      origins.push_back(leaf.origin);
      filled.push_back(&leaf);
    }
  }
  const std::vector<volume::LeafRef> leaves = builder.add_leaves(context, origins);
  for (std::size_t n = 0; n < leaves.size(); ++n)
    for (std::size_t o = 0; o < volume::leaf_voxels; ++o) {
      leaves[n].values[o] = filled[n]->values.at(o);
      if (filled[n]->values.at(o) != 0)
        leaves[n].active[o / 64] |= std::uint64_t{1} << (o % 64);
    }
  return builder.finish();
}

} // namespace gewebe::labels
