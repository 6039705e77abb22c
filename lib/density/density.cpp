#include "density/density.h"

#include "base/error.h"
#include "base/parallel.h"
#include "density/density_blocks_internal.h"
#include "volume/lattice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>

// Based on: G. Wyvill, C. McPheeters, B. Wyvill, Data structure for soft objects, 1986.

namespace gewebe::density {
namespace {

/// The voxel centres inside the supports' box and `clip`; false if there are none.
bool index_box(const Particles& particles, const DensityOptions& options, IndexBox& box) {
  if (!volume::index_range(options.info.transform, support_box(particles), box.min, box.max))
    return false;
  if (!options.clip)
    return true;
  IndexBox clip{};
  if (!volume::index_range(options.info.transform, *options.clip, clip.min, clip.max))
    return false;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    box.min[axis] = std::max(box.min[axis], clip.min[axis]);
    box.max[axis] = std::min(box.max[axis], clip.max[axis]);
  }
  return true;
}

/// Leaves that one particle fills at the least, by the cube in its ball: refuses absurd radii
/// before anything is listed.
double min_leaves(std::span<const IndexParticle> particles, const IndexBox& clip) {
  double max = 0;
  for (const IndexParticle& p : particles) {
    const double center[3] = {p.x, p.y, p.z};
    const double half = p.radius / std::numbers::sqrt3;
    double voxels = 1;
    for (std::size_t axis = 0; axis < 3; ++axis)
      voxels *=
          std::max(0.0, std::min(center[axis] + half, static_cast<double>(clip.max[axis])) -
                            std::max(center[axis] - half, static_cast<double>(clip.min[axis])));
    max = std::max(max, voxels / volume::leaf_voxels);
  }
  return max;
}

/// Leaves within the support of a particle that lies anywhere in its leaf, on average (Steiner's
/// formula for the ball around a cube of 7 voxels).
double expected_pairs(std::span<const IndexParticle> particles) {
  double sum = 0;
  for (const IndexParticle& p : particles) {
    const double r = p.radius, edge = volume::leaf_dim - 1, pi = std::numbers::pi;
    sum += (edge * edge * edge + 6 * edge * edge * r + 3 * pi * edge * r * r +
            4 * pi / 3 * r * r * r) /
           volume::leaf_voxels;
  }
  return sum;
}

/// Bytes of a tree with these leaves: its inner nodes hold 16³ and 32³ pointers.
double tree_bytes(const std::vector<LeafLists>& plans) {
  double bytes = 0;
  for (const int shift : {7, 12}) {
    std::vector<Int3> nodes;
    for (const LeafLists& plan : plans)
      for (const Int3& leaf : plan.leaves) {
        const Int3 node{leaf[0] >> shift, leaf[1] >> shift, leaf[2] >> shift};
        if (nodes.empty() || nodes.back() != node)
          nodes.push_back(node);
      }
    std::ranges::sort(nodes);
    const auto rest = std::ranges::unique(nodes);
    const auto count = static_cast<double>(nodes.size() - rest.size());
    bytes += count * (shift == 7 ? 4096 : 32768) * (sizeof(void*) + 0.25);
  }
  for (const LeafLists& plan : plans)
    bytes += static_cast<double>(plan.leaves.size()) * leaf_bytes;
  return bytes;
}

volume::Grid plain_grid(const Context& context, std::span<const IndexParticle> particles,
                        const Blocks& blocks, const std::vector<LeafLists>& plans,
                        const IndexBox& clip, const volume::GridInfo& info, DensityReport& report) {
  volume::GridBuilder builder(info);
  std::size_t leaves = 0;
  for (const LeafLists& plan : plans)
    leaves += plan.leaves.size();
  std::vector<std::uint8_t> filled(leaves);
  const EvaluatedLeaves evaluated = evaluate_plans(
      context, builder, particles, blocks, plans, clip,
      [&](std::size_t leaf, const volume::LeafRef& ref) { filled[leaf] = activate(ref) ? 1 : 0; });
  for (const std::uint8_t one : filled)
    report.leaves += one;
  report.leaf_particle_pairs += evaluated.pairs;
  report.leaves_evaluated = leaves;
  return builder.finish();
}

} // namespace

volume::Grid metaball_density(const Context& context, const Particles& particles,
                              const DensityOptions& options, DensityReport* report) {
  const volume::GridTransform& transform = options.info.transform;
  if (!transform.is_cubic())
    throw Error("the lattice has " + transform.describe() + ", expected cubic voxels");
  if (particles.size() > UINT32_MAX)
    throw Error("more than 4294967295 particles");
  volume::GridInfo info = options.info;
  if (options.band) {
    if (!(std::fabs(*options.band) <= 1e30)) {
      std::array<char, 32> text{};
      (void)std::snprintf(text.data(), text.size(), "%g", *options.band);
      throw Error("the band's isovalue is " + std::string(text.data()) +
                  ", expected a number up to 1e30");
    }
    info.isovalue = *options.band;
    info.band_isovalue = options.band;
  }
  IndexBox clip{};
  std::vector<IndexParticle> local;
  if (index_box(particles, options, clip))
    local = to_index_space(context, particles, transform, clip);
  DensityReport counts;
  counts.particles_out_of_reach = particles.size() - local.size();
  counts.predicted_evaluations = expected_pairs(local) * volume::leaf_voxels;
  if (!options.band)
    require_memory(context, min_leaves(local, clip) * leaf_bytes, "the volume, at the least,");

  // Bounds over leaves of particles below two leaves spare less than they cost. They need the voxel
  // beside each face too.
  const bool bounding = options.band && std::ranges::any_of(local, [](const IndexParticle& p) {
                          return p.radius > 2 * volume::leaf_dim;
                        });
  const Blocks blocks = sort_into_blocks(context, local, clip, bounding ? 1 : 0);
  const std::vector<LeafLists> plans =
      plan_blocks(context, local, blocks, clip, bounding ? options.band : std::nullopt);
  double planned = 0;
  for (const LeafLists& plan : plans) {
    planned += static_cast<double>(plan.leaves.size());
    counts.leaves_skipped += plan.skipped;
  }
  counts.predicted_voxels = planned * volume::leaf_voxels;
  counts.predicted_bytes = tree_bytes(plans);
  require_memory(context, counts.predicted_bytes, "the volume");
  if (options.planned)
    options.planned(counts);

  volume::Grid grid = options.band ? band_grid(context, local, blocks, plans, clip, info, counts)
                                   : plain_grid(context, local, blocks, plans, clip, info, counts);
  counts.voxel_evaluations = counts.leaf_particle_pairs * volume::leaf_voxels;
  if (report != nullptr)
    *report = counts;
  return grid;
}

} // namespace gewebe::density
