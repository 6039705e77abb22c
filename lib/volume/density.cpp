#include "volume/density.h"

#include "base/error.h"
#include "base/parallel.h"
#include "volume/density_kernel_internal.h"
#include "volume/lattice.h"

#include <algorithm>
#include <cmath>
#include <tuple>

// Based on: G. Wyvill, C. McPheeters, B. Wyvill, Data structure for soft objects, 1986.

namespace gewebe {
namespace {

/// A particle in index space.
struct IndexParticle {
  Vec3 center;
  double radius;
  float weight;
  Int3 first, last; // leaves in reach, by origin / 8
};

struct Pair {
  Int3 leaf; // origin / 8
  std::uint32_t particle;
  bool operator<(const Pair& other) const {
    return std::tie(leaf, particle) < std::tie(other.leaf, other.particle);
  }
};

struct IndexBox {
  Int3 min, max; // inclusive
};

/// Squared distance from the particle's centre to the box of the leaf's voxel centres.
double distance2(const IndexParticle& particle, const Int3& leaf) {
  double sum = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double low = 8.0 * leaf.at(static_cast<std::size_t>(axis));
    const double c = particle.center[axis];
    const double d = c < low ? low - c : c > low + 7 ? c - low - 7 : 0;
    sum += d * d;
  }
  return sum;
}

/// Leaves that a particle may reach inside `clip`; false if none.
bool leaf_range(IndexParticle& particle, const IndexBox& clip) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double c = particle.center[static_cast<int>(axis)];
    const double low =
        std::max(std::ceil(c - particle.radius), static_cast<double>(clip.min[axis]));
    const double high =
        std::min(std::floor(c + particle.radius), static_cast<double>(clip.max[axis]));
    if (!(low <= high))
      return false;
    particle.first[axis] = static_cast<std::int32_t>(low) >> 3;
    particle.last[axis] = static_cast<std::int32_t>(high) >> 3;
  }
  return true;
}

std::vector<IndexParticle> to_index_space(const Particles& particles,
                                          const GridTransform& transform, const IndexBox& clip) {
  const double voxel = transform.voxel_size().x;
  std::vector<IndexParticle> result;
  result.reserve(particles.size());
  for (const Particle& particle : particles) {
    IndexParticle local{transform.to_index(particle.center),
                        particle.support_radius / voxel,
                        static_cast<float>(particle.weight),
                        {},
                        {}};
    if (leaf_range(local, clip))
      result.push_back(local);
  }
  return result;
}

std::vector<Pair> bin_to_leaves(const std::vector<IndexParticle>& particles) {
  std::vector<Pair> pairs;
  for (std::size_t n = 0; n < particles.size(); ++n) {
    const IndexParticle& p = particles[n];
    const double radius2 = p.radius * p.radius;
    Int3 leaf{};
    for (leaf[0] = p.first[0]; leaf[0] <= p.last[0]; ++leaf[0])
      for (leaf[1] = p.first[1]; leaf[1] <= p.last[1]; ++leaf[1])
        for (leaf[2] = p.first[2]; leaf[2] <= p.last[2]; ++leaf[2])
          if (distance2(p, leaf) < radius2)
            pairs.push_back({leaf, static_cast<std::uint32_t>(n)});
  }
  std::ranges::sort(pairs, std::less<>{});
  return pairs;
}

LeafParticle relative_to(const IndexParticle& particle, const Int3& origin) {
  return {static_cast<float>(particle.center.x - origin[0]),
          static_cast<float>(particle.center.y - origin[1]),
          static_cast<float>(particle.center.z - origin[2]),
          static_cast<float>(1 / (particle.radius * particle.radius)), particle.weight};
}

/// Zeroes what lies outside the clip box and sets the active mask.
void finish_leaf(const LeafRef& leaf, const IndexBox& clip) {
  for (int offset = 0; offset < leaf_voxels; ++offset) {
    const Int3 ijk{leaf.origin[0] + (offset >> 6), leaf.origin[1] + ((offset >> 3) & 7),
                   leaf.origin[2] + (offset & 7)};
    bool inside = true;
    for (std::size_t axis = 0; axis < 3; ++axis)
      inside = inside && ijk[axis] >= clip.min[axis] && ijk[axis] <= clip.max[axis];
    float& value = leaf.values[offset];
    if (!inside)
      value = 0;
    if (value != 0)
      leaf.active[offset >> 6] |= std::uint64_t{1} << (offset & 63);
  }
}

bool contains(const IndexBox& box, const Int3& origin) {
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (origin[axis] < box.min[axis] || origin[axis] + 7 > box.max[axis])
      return false;
  return true;
}

/// Sets the active mask of a leaf that lies wholly inside the clip box.
void activate(const LeafRef& leaf) {
  for (int word = 0; word < 8; ++word) {
    std::uint64_t bits = 0;
    for (int bit = 0; bit < 64; ++bit)
      bits |= std::uint64_t{leaf.values[word * 64 + bit] != 0} << bit;
    leaf.active[word] = bits;
  }
}

} // namespace

Grid metaball_density(const Context& context, const Particles& particles,
                      const DensityOptions& options, DensityReport* report) {
  const GridTransform& transform = options.info.transform;
  if (!transform.is_cubic())
    throw Error("the lattice has " + transform.describe() + ", expected cubic voxels");
  if (particles.size() > UINT32_MAX)
    throw Error("more than 4294967295 particles");
  IndexBox clip{};
  DensityReport counts;
  const bool any = index_range(transform, support_box(particles), clip.min, clip.max);
  IndexBox box{};
  const bool clipped = options.clip.has_value();
  const bool any_in_clip = !clipped || index_range(transform, *options.clip, box.min, box.max);
  if (clipped && any && any_in_clip)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      clip.min[axis] = std::max(clip.min[axis], box.min[axis]);
      clip.max[axis] = std::min(clip.max[axis], box.max[axis]);
    }

  std::vector<IndexParticle> local;
  if (any && any_in_clip)
    local = to_index_space(particles, transform, clip);
  counts.particles_out_of_reach = particles.size() - local.size();
  double pair_bound = 0;
  for (const IndexParticle& p : local)
    pair_bound += (1.0 + p.last[0] - p.first[0]) * (1.0 + p.last[1] - p.first[1]) *
                  (1.0 + p.last[2] - p.first[2]);
  require_memory(context, pair_bound * sizeof(Pair), "the list of leaves in reach of a particle");
  const std::vector<Pair> pairs = bin_to_leaves(local);

  std::vector<Int3> origins;
  std::vector<std::size_t> first; // pairs of leaf n: first[n] … first[n + 1]
  for (std::size_t n = 0; n < pairs.size(); ++n)
    if (n == 0 || pairs[n].leaf != pairs[n - 1].leaf) {
      origins.push_back({pairs[n].leaf[0] * 8, pairs[n].leaf[1] * 8, pairs[n].leaf[2] * 8});
      first.push_back(n);
    }
  first.push_back(pairs.size());
  counts.leaves = origins.size();
  counts.leaf_particle_pairs = pairs.size();
  counts.voxel_evaluations = pairs.size() * leaf_voxels;
  counts.predicted_bytes =
      static_cast<double>(origins.size()) * (leaf_voxels * sizeof(float) + 160);
  require_memory(context, counts.predicted_bytes, "the volume");

  const DensityKernel kernel =
      context.cpu == CpuLevel::baseline ? add_density_baseline : add_density_avx2;
  GridBuilder builder(options.info);
  const std::vector<LeafRef> leaves = builder.add_leaves(context, origins);
  parallel_blocks(context, leaves.size(), 64, [&](std::size_t begin, std::size_t end) {
    std::vector<LeafParticle> near;
    for (std::size_t n = begin; n < end; ++n) {
      near.clear();
      for (std::size_t pair = first[n]; pair < first[n + 1]; ++pair)
        near.push_back(relative_to(local[pairs[pair].particle], leaves[n].origin));
      kernel(near.data(), near.size(), leaves[n].values);
      if (clipped && !contains(clip, leaves[n].origin))
        finish_leaf(leaves[n], clip);
      else
        activate(leaves[n]);
    }
  });
  if (report != nullptr)
    *report = counts;
  return builder.finish();
}

} // namespace gewebe
