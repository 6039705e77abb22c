#include "voxelization/voxelize.h"

#include "base/error.h"
#include "base/parallel.h"
#include "geometry/exact_predicates.h"
#include "mesh/border.h"
#include "voxelization/depth_buffers_internal.h"
#include "voxelization/inside_scan_internal.h"
#include "voxelization/parity_scan_internal.h"
#include "voxelization/voxelize_input.h"
#include "voxelization/winding_scan_internal.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

namespace gewebe::voxelization {
namespace {

constexpr double index_limit = 1 << 30;

/// Surface area in faces of voxels, the longest triangle and the box of the points in voxels.
struct Extent {
  double area = 0;
  double longest = 0; ///< sum of the edges of a triangle's box
  Box3 box;

  void add(const Vec3& p) {
    box.min = {std::min(box.min.x, p.x), std::min(box.min.y, p.y), std::min(box.min.z, p.z)};
    box.max = {std::max(box.max.x, p.x), std::max(box.max.y, p.y), std::max(box.max.z, p.z)};
  }
};

/// The mesh in the index space of the voxels.
struct IndexMesh {
  std::vector<Vec3> points;
  Extent extent;
};

IndexMesh index_mesh(const Context& context, const TriangleMesh& mesh,
                     const volume::GridTransform& transform) {
  constexpr std::size_t grain = 8192;
  IndexMesh index;
  index.points.resize(mesh.points.size());
  std::vector<Extent> parts(mesh.points.size() / grain + mesh.triangles.size() / grain + 2);
  const auto blocks = [&](std::size_t count, std::size_t first, auto&& work) {
    gewebe::Context quiet = context;
    quiet.progress = nullptr;
    gewebe::parallel_blocks(quiet, count, grain, [&](std::size_t begin, std::size_t end) {
      gewebe::voxelization::Extent extent;
      for (std::size_t n = begin; n < end; ++n)
        work(n, extent);
      parts[first + begin / grain] = extent;
    });
  };
  blocks(mesh.points.size(), 0, [&](std::size_t n, Extent& extent) {
    index.points[n] = transform.to_index(mesh.points[n]);
    extent.add(index.points[n]);
  });
  blocks(mesh.triangles.size(), mesh.points.size() / grain + 1, [&](std::size_t n, Extent& extent) {
    const Triangle& t = mesh.triangles[n];
    const Vec3& a = index.points[t[0]];
    const Vec3 &b = index.points[t[1]], &c = index.points[t[2]];
    extent.area += norm(cross(b - a, c - a)) / 2;
    double edges = 0;
    for (int axis = 0; axis < 3; ++axis)
      edges += std::max({a[axis], b[axis], c[axis]}) - std::min({a[axis], b[axis], c[axis]});
    extent.longest = std::max(extent.longest, edges);
  });
  for (const Extent& part : parts) {
    index.extent.area += part.area;
    index.extent.longest = std::max(index.extent.longest, part.longest);
    if (!part.box.empty()) {
      index.extent.add(part.box.min);
      index.extent.add(part.box.max);
    }
  }
  return index;
}

/// Takes points of index space to that of the samples: f = samples x + (samples - 1)/2.
void refine(std::vector<Vec3>& points, int samples) {
  const double scale = samples, shift = (samples - 1) / 2.0;
  for (std::size_t n = 0; n < points.size(); ++n)
    for (int a = 0; a < 3; ++a) {
      const double x = std::fma(points[n][a], scale, shift);
      if (!(std::fabs(x) < index_limit))
        throw Error(
            "point " + std::to_string(n) + " lies " + std::to_string(std::fabs(x)) +
            " samples from the lattice's origin, expected less than 2^30: choose a larger voxel");
      points[n][a] = predicate_coordinate(x);
    }
}

double scan_bytes(const Extent& extent, const TriangleMesh& mesh, int samples) {
  const auto cells = [&](double edge) { // that the surface meets, at most all of the box
    const Vec3 size = extent.box.size() * (1 / edge);
    // A patch meets |nx| + |ny| + |nz| <= sqrt(3) cells for each face's area of it, more at its
    // rim: a needle as many as the planes between cells that it crosses.
    return std::fmin(std::fmax(1.75 * extent.area / (edge * edge), extent.longest / edge) + 8,
                     (size.x + 2) * (size.y + 2) * (size.z + 2));
  };
  const double leaf_bytes =
      (samples == 1 ? 64 : 2 * 4 * volume::leaf_voxels) + 4 * volume::leaf_voxels + 200;
  const double node_bytes = 4096.0 * (sizeof(volume::TileView) + 8);
  const double solid_nodes =
      extent.box.size().x * extent.box.size().y * extent.box.size().z / 0x1p21;
  const double fine_rows = std::fmin(64, 8 * samples), slabs = extent.box.size().x / 8 + 1;
  const double crossings_at_once =
      extent.area * samples * samples / slabs * fine_rows / (8 * samples);
  const double top_bytes = 32768 * 8.25; // a node of 4096³ voxels, one for each octant at least
  return cells(volume::leaf_dim) * leaf_bytes + cells(128) * node_bytes + cells(4096) * top_bytes +
         solid_nodes * 40 + 200 * slabs + (samples == 1 ? 0 : 64 * crossings_at_once) +
         60.0 * static_cast<double>(mesh.points.size() + mesh.triangles.size());
}

/// The eight bits of each byte as floats, the lowest first.
constexpr std::array<std::array<float, 8>, 256> floats_of_bits() {
  std::array<std::array<float, 8>, 256> floats{};
  for (unsigned byte = 0; byte < 256; ++byte)
    for (unsigned bit = 0; bit < 8; ++bit)
      floats[byte][bit] = static_cast<float>(byte >> bit & 1);
  return floats;
}

} // namespace

double voxelize_bytes(const TriangleMesh& mesh, const volume::GridTransform& transform,
                      int samples) {
  return scan_bytes(index_mesh(Context{}, mesh, transform).extent, mesh, samples);
}

void check_voxelize_input(const TriangleMesh& mesh, const volume::GridTransform& transform) {
  if (mesh.triangles.empty())
    throw Error("the mesh has no triangle, expected at least one");
  if (const double edge = transform.voxel_size().x; !(edge >= 1e-100 && edge <= 1e100))
    throw Error("the voxels are too " + std::string(edge < 1 ? "small" : "large") +
                ", expected an edge from 1e-100 to 1e100 mm");
  if (!transform.is_cubic())
    throw Error("the lattice is not cubic (" + transform.describe() +
                "), expected voxels with equal edges");
}

InsideScan scan_inside(const Context& context, const TriangleMesh& mesh,
                       const volume::GridTransform& transform, const VoxelizeOptions& options,
                       VoxelizeReport* report) {
  if (options.samples < 1 || options.samples > 64)
    throw Error("voxelize: " + std::to_string(options.samples) +
                " samples along an edge, expected 1 to 64");
  check_voxelize_input(mesh, transform);
  IndexMesh index = index_mesh(context, mesh, transform);
  require_memory(
      context,
      scan_bytes(index.extent, mesh, options.rule == VoxelRule::winding ? 2 : options.samples),
      "the voxelized mesh");
  refine(index.points, options.samples);

  VoxelizeReport local;
  VoxelizeReport& r = report != nullptr ? *report : local;
  r = {};
  r.triangles = mesh.triangles.size();
  const auto look_at_border = [&] {
    if (mesh::closed_by_index(index.points.size(), mesh.triangles))
      return std::vector<std::array<std::uint32_t, 2>>();
    auto border = mesh::odd_edges(index.points, mesh.triangles);
    r.boundary_edges = border.size();
    std::vector<std::uint32_t> group;
    r.holes = mesh::edge_groups(border, group);
    return border;
  };
  SampleMesh samples{options.samples, index.points, mesh.triangles, context.cpu};
  std::vector<Triangle> closed;
  const bool looked = options.on_open == OpenMesh::fill || options.rule != VoxelRule::parity;
  if (looked)
    if (const auto border = look_at_border();
        options.on_open == OpenMesh::fill && !border.empty()) {
      closed = mesh.triangles;
      mesh::close_with_cones(border, index.points, closed);
      samples.points = index.points;
      samples.triangles = closed;
    }
  const auto counted = [&](InsideScan&& scan) {
    return options.samples == 1 ? std::move(scan) : count_samples(context, scan, options.samples);
  };
  if (options.rule != VoxelRule::parity)
    samples.samples = 1; // on the lattice of the samples
  if (options.rule == VoxelRule::winding) {
    // Cones that fill holes belong to no part, so with them edges alone connect.
    const std::span<const std::int32_t> part(mesh.part.data(),
                                             closed.empty() ? mesh.part.size() : 0);
    return counted(winding_scan(context, index.points, samples.triangles, part,
                                options.keep_windings && options.samples == 1, r));
  }
  if (options.rule == VoxelRule::zbuffer)
    return counted(depth_buffer_scan(context, samples, r));
  InsideScan scan = parity_scan(context, samples, r, [&] {
    if (!looked)
      (void)look_at_border();
  });
  if (r.boundary_edges > 0 && options.on_open == OpenMesh::refuse)
    throw Error("the mesh is open: " + std::to_string(r.boundary_edges) + " boundary edges in " +
                std::to_string(r.holes) + (r.holes == 1 ? " hole, " : " holes, ") +
                std::to_string(r.odd_rays) +
                " odd rays, expected a closed mesh (or --rule winding, or --on-open warn|fill)");
  return scan;
}

volume::Grid grid_from_scan(const Context& context, const InsideScan& scan,
                            const volume::GridTransform& transform) {
  volume::GridInfo info;
  info.transform = transform;
  volume::GridBuilder builder(info);
  for (const volume::TileView& tile : scan.tiles)
    builder.add_tile(tile);
  const std::vector<volume::LeafRef> leaves = builder.add_leaves(context, scan.origins);
  static constexpr std::array<std::array<float, 8>, 256> floats = floats_of_bits();
  const double full = scan.samples * scan.samples * scan.samples;
  parallel_blocks(context, leaves.size(), 1024, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n)
      for (std::size_t w = 0; w < 8; ++w) {
        float* values = leaves[n].values + 64 * w;
        std::uint64_t active = 0;
        if (scan.samples == 1) {
          active = scan.bits[n][w];
          for (std::size_t byte = 0; byte < 8; ++byte)
            std::memcpy(values + 8 * byte, &floats[active >> 8 * byte & 0xff], 8 * sizeof(float));
        } else {
          for (std::size_t v = 0; v < 64; ++v) {
            const std::uint32_t count = scan.counts[n][64 * w + v];
            values[v] = static_cast<float>(count / full);
            active |= static_cast<std::uint64_t>(count != 0) << v;
          }
        }
        leaves[n].active[w] = active;
      }
  });
  return builder.finish(false);
}

volume::Grid voxelize(const Context& context, const TriangleMesh& mesh,
                      const volume::GridTransform& transform, const VoxelizeOptions& options,
                      VoxelizeReport* report) {
  return grid_from_scan(context, scan_inside(context, mesh, transform, options, report), transform);
}

void close_or_refuse(const Context& context, const TriangleMesh& mesh,
                     const volume::GridTransform& transform, OpenMesh on_open,
                     std::vector<Vec3>& points, std::vector<Triangle>& triangles,
                     VoxelizeReport& report) {
  const auto border = mesh::odd_edges(points, triangles);
  report.boundary_edges = border.size();
  if (border.empty())
    return;
  std::vector<std::uint32_t> group;
  report.holes = mesh::edge_groups(border, group);
  if (on_open == OpenMesh::refuse)
    scan_inside(context, mesh, transform, {}); // refuses it, with the number of odd rays
  if (on_open == OpenMesh::fill)
    mesh::close_with_cones(border, points, triangles);
}

} // namespace gewebe::voxelization
