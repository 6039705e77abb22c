#include "surface/snapping.h"

#include "base/error.h"
#include "base/huge_pages.h"
#include "base/parallel.h"
#include "surface/flat_faces_internal.h"
#include "surface/snap_collapse_internal.h"
#include "surface/snap_cuts_internal.h"
#include "surface/snap_lattice_internal.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <span>
#include <utility>
#include <vector>

// Based on: report FZKA 7190, Forschungszentrum Karlsruhe, 2006, section 3.1.4.

namespace gewebe::surface {
namespace {

/// A quick test. \param normal  cross(u, v)
/// \pre enough is the square of what the area may be at least, for sides of 1
bool has_much_area(const Vec3& u, const Vec3& v, const Vec3& normal, double enough) {
  const double longest = 2 * (dot(u, u) + dot(v, v)); // of three squares: (v - u)² isn't more
  return dot(normal, normal) > enough * longest * longest;
}

/// The test of has_no_area, but in the world: an affine map changes the ratio of an
/// area to a square by no more than its condition, which is below the product of the norms of the
/// matrix and its inverse; infinite if that is unknown.
double enough_area(const volume::GridTransform& transform) {
  const auto& m = transform.m;
  const Vec3 rows[3]{{m[0], m[1], m[2]}, {m[4], m[5], m[6]}, {m[8], m[9], m[10]}};
  const Vec3 minors[3]{cross(rows[1], rows[2]), cross(rows[2], rows[0]), cross(rows[0], rows[1])};
  double norm2 = 0, minors2 = 0;
  for (int a = 0; a < 3; ++a) {
    norm2 += dot(rows[a], rows[a]);
    minors2 += dot(minors[a], minors[a]);
  }
  const double determinant = transform.determinant(),
               condition2 = norm2 * minors2 / (determinant * determinant);
  const double ratio = 1e-9 * condition2;
  return ratio < 1e-3 ? ratio * ratio : HUGE_VAL;
}

/// The mesh that is left when points have been merged.
class SnappedMesh {
public:
  SnappedMesh(const Context& context, const IsoSurface& surface, const SnapLattice& lattice,
              SnapMerges& merges, SnapOptions::Place place)
      : context_(context), surface_(lattice.surface()), transform_(surface.transform),
        lattice_(lattice), merges_(merges), at_corners_(place == SnapOptions::Place::corner),
        plans_(make_plans(lattice.mirrored())) {
    context_.progress = nullptr;
  }

  void make(SnapResult& result) {
    count(result.mesh);
    write_points(result.mesh.points);
    write_triangles(result.mesh.points, result.mesh.triangles);
    std::vector<std::uint32_t> flat = find_without_area();
    if (at_corners_) {
      flat = flip_flat_faces(result.mesh, std::move(flat));
      move_back(result.mesh, flat);
      std::erase_if(flat, [&](std::uint32_t n) {
        const auto& [a, b, c] = result.mesh.triangles[n];
        const std::vector<Vec3>& points = result.mesh.points;
        return !has_no_area(points[a], points[b], points[c], world_tolerance);
      });
    }
    result.report.zero_area = flat.size();
  }

  /// Faces that cut others, ascending. \pre make(result)
  std::vector<std::uint32_t> find_cuts(const TriangleMesh& mesh) const {
    std::vector<SuspectFace> suspects;
    for (const std::vector<SuspectFace>& part : suspects_)
      suspects.insert(suspects.end(), part.begin(), part.end());
    return find_cutting_faces(context_, {mesh, surface_, transform_, first_triangle_},
                              std::move(suspects));
  }
  /// Appends the corners, absolute, where points of these faces have moved.
  void append_corners(const TriangleMesh& mesh, std::span<const std::uint32_t> faces,
                      std::vector<Int3>& corners) const;

private:
  static constexpr std::size_t blocks_at_once = 64;

  /// The point on an edge, by its block.
  struct PointRef {
    std::uint32_t block = 0;
    std::uint8_t word = 0, bit = 0;
  };
  /// A face with hardly an area: the block of its cell, which of its faces that was, and its number
  /// in the mesh.
  struct SmallFace {
    std::uint32_t block = 0, face = 0, triangle = 0;
  };
  /// By edge of a block: the point's new number. Bit 32 is set if a face of it may have no area,
  /// bit 33 if it is crowded.
  using PlaceNumbers = std::array<std::uint64_t, edge_places>;

  void count(TriangleMesh& mesh);
  void write_points(std::vector<Vec3>& points);
  void note_points(std::size_t n, PlaceNumbers& numbers) const;
  void write_triangles(const std::vector<Vec3>& points, std::vector<Triangle>& triangles);
  std::vector<std::uint32_t> find_without_area();
  void move_back(TriangleMesh& mesh, std::span<const std::uint32_t> flat) const;
  PointRef point_at(std::size_t n, unsigned place) const;
  std::array<PointRef, 3> corners_of(const SmallFace& face) const;
  Vec3 position(const PointRef& ref) const;

  std::uint64_t is_doubtful(const SnapBlock& block, std::size_t w) const {
    return block.merged[w] | block.looked_at[w] | (at_corners_ ? block.low[w] | block.high[w] : 0);
  }

  Context context_;
  const SurfaceBlocks& surface_;
  volume::GridTransform transform_;
  const SnapLattice& lattice_;
  SnapMerges& merges_;
  bool at_corners_;
  CellPlans plans_;
  std::vector<std::uint32_t> first_point_, first_triangle_; // of each block, after snapping
  std::vector<std::vector<SmallFace>> small_;
  std::vector<std::vector<SuspectFace>> suspects_; // that may cut another one
};

void SnappedMesh::count(TriangleMesh& mesh) {
  const std::size_t blocks = surface_.blocks.size();
  first_point_.resize(blocks + 1);
  first_triangle_.resize(blocks + 1);
  parallel_blocks(context_, blocks, 1024, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      std::uint32_t merged = 0;
      for (const std::uint64_t word : lattice_.snaps(n).merged)
        merged += word != 0 ? count_bits(word) : 0;
      first_point_[n + 1] = surface_.blocks[n]->points - merged;
      first_triangle_[n + 1] = surface_.blocks[n]->triangles - merges_.dropped[n];
    }
  });
  for (std::size_t n = 0; n < blocks; ++n) {
    first_point_[n + 1] += first_point_[n];
    first_triangle_[n + 1] += first_triangle_[n];
  }
  resize_all(context_, resizing(mesh.points, first_point_.back()),
             resizing(mesh.triangles, first_triangle_.back()));
}

/// Numbers the remaining points, too: merges_.target of those.
void SnappedMesh::write_points(std::vector<Vec3>& points) {
  const std::array<double, 12> transform = transform_.m;
  const auto write_block = [&](std::size_t n) {
    const SurfaceBlock& block = *surface_.blocks[n];
    const SnapBlock& snaps = lattice_.snaps(n);
    std::uint32_t number = first_point_[n];
    for (std::uint32_t p = block.first_point; p < block.first_point + block.points; ++p) {
      const BlockEdge edge = surface_.edges[p];
      const unsigned w = edge.word(), bit = edge.bit(), axis = edge.axis();
      if ((snaps.merged[w] >> bit & 1) != 0)
        continue;
      double along = surface_.fractions[p];
      if (at_corners_ && ((snaps.low[w] | snaps.high[w]) >> bit & 1) != 0)
        along = (snaps.high[w] >> bit & 1) != 0 ? 1 : 0;
      const Vec3 place{static_cast<double>(block.origin[0] + static_cast<int>(edge.i())),
                       static_cast<double>(block.origin[1] + static_cast<int>(edge.j())),
                       static_cast<double>(block.origin[2] + static_cast<int>(edge.k()))};
      points[number] = world_position(transform, {place.x + (axis == 0 ? along : 0),
                                                  place.y + (axis == 1 ? along : 0),
                                                  place.z + (axis == 2 ? along : 0)});
      merges_.target[p] = number++;
    }
  };
  parallel_blocks(context_, surface_.blocks.size(), blocks_at_once,
                  [&](std::size_t begin, std::size_t end) {
                    for (std::size_t n = begin; n < end; ++n)
                      write_block(n);
                  });
  parallel_blocks(context_, merges_.places.size(), 1, [&](std::size_t n, std::size_t) {
    for (const SnapMerges::Place& place : merges_.places[n])
      points[merges_.target[place.point]] = world_position(transform, place.position);
  });
}

void SnappedMesh::note_points(std::size_t n, PlaceNumbers& numbers) const {
  const std::uint32_t* const target = merges_.target.get();
  const SurfaceBlock& block = *surface_.blocks[n];
  const SnapBlock& snaps = lattice_.snaps(n);
  const EdgeWords merged = snaps.merged;
  EdgeWords looked_at;
  for (std::size_t w = 0; w < looked_at.size(); ++w)
    looked_at[w] = is_doubtful(snaps, w);
  const auto marks = [](std::uint64_t looked_at_word, std::uint64_t crowded_word, unsigned bit) {
    return (looked_at_word >> bit & 1) << 32 | (crowded_word >> bit & 1) << 33;
  };
  for (std::uint32_t p = block.first_point; p < block.first_point + block.points; ++p) {
    const BlockEdge edge = surface_.edges[p];
    const unsigned w = edge.word(), bit = edge.bit();
    const std::uint32_t last = (merged[w] >> bit & 1) != 0 ? target[p] : p;
    numbers[edge.place()] = target[last] | marks(looked_at[w], snaps.crowded[w], bit);
  }
  for_far_edges(
      surface_, block,
      [&](const SurfaceBlock& far, std::uint32_t number, unsigned w, unsigned bit, unsigned place) {
        const SnapBlock& far_snaps = lattice_.snaps(number);
        const std::uint32_t p = far.point(w, bit),
                            last = (far_snaps.merged[w] >> bit & 1) != 0 ? target[p] : p;
        numbers[place] = target[last] | marks(is_doubtful(far_snaps, w), far_snaps.crowded[w], bit);
      });
}

/// What a block's faces become before they go to the mesh.
struct BlockFaces {
  static constexpr std::size_t max_made = std::size_t{max_cell_triangles} * volume::leaf_voxels;
  std::array<Triangle, max_made + 1> made;
  std::array<std::uint16_t, max_made + 1> picked, picked_from; ///< of `made`; of the block's faces
  std::array<std::uint8_t, max_made + 1> picked_case, crowded; ///< of its cell; has such a point
  std::size_t made_count = 0, picked_count = 0;
};

/// Those that stay, and of these the ones that may have no area. Which faces do so can't be
/// predicted, so there is no branch.
void make_faces(const SurfaceBlock& block, const std::uint64_t* numbers, const CellPlans& plans,
                BlockFaces& faces) {
  const std::uint8_t* cell = block.cases;
  std::size_t made = 0, picked = 0;
  std::uint16_t face = 0;
  for (unsigned i = 0; i < volume::leaf_dim; ++i)
    for (std::uint64_t active = block.active[i]; active != 0; active &= active - 1) {
      const auto bit = static_cast<unsigned>(std::countr_zero(active));
      const std::uint64_t* const at = numbers + edge_place(i, bit >> 3, bit & 7);
      const std::uint8_t cell_case = *cell++;
      const CellPlan& plan = plans[cell_case];
      const std::uint16_t* corner = plan.corner.data();
      for (unsigned t = 0; t < plan.triangles; ++t, corner += 3) {
        const std::uint64_t a = at[corner[0]], b = at[corner[1]], c = at[corner[2]];
        const Triangle next{static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b),
                            static_cast<std::uint32_t>(c)};
        const auto differ = [](std::uint32_t p, std::uint32_t q) {
          return static_cast<std::uint64_t>(p ^ q) + UINT32_MAX; // from bit 32 on: 1 or 0
        };
        const std::uint64_t stays =
            (differ(next[0], next[1]) & differ(next[1], next[2]) & differ(next[2], next[0])) >> 32;
        faces.made[made] = next;
        faces.picked[picked] = static_cast<std::uint16_t>(made);
        faces.picked_from[picked] = face++;
        faces.picked_case[picked] = cell_case;
        faces.crowded[picked] = static_cast<std::uint8_t>((a | b | c) >> 33);
        made += stays;
        picked += stays & (a | b | c) >> 32;
      }
    }
  faces.made_count = made;
  faces.picked_count = picked;
}

void SnappedMesh::write_triangles(const std::vector<Vec3>& points,
                                  std::vector<Triangle>& triangles) {
  const double enough = enough_area(transform_);
  const std::size_t blocks = surface_.blocks.size();
  small_.resize((blocks + blocks_at_once - 1) / blocks_at_once);
  suspects_.resize(small_.size());
  const CellDirections directions = make_directions(transform_);
  // Faces between points that stayed in place at 0.001 or more from the ends of their edges have an
  // area (see the test of the table): three edges of a cell that lie in no face of it in common.
  parallel_blocks(context_, blocks, blocks_at_once, [&](std::size_t begin, std::size_t end) {
    const auto numbers = std::make_unique_for_overwrite<PlaceNumbers>();
    const auto faces = std::make_unique_for_overwrite<BlockFaces>();
    for (std::size_t n = begin; n < end; ++n) {
      note_points(n, *numbers);
      make_faces(*surface_.blocks[n], numbers->data(), plans_, *faces);
      std::copy_n(faces->made.data(), faces->made_count, triangles.data() + first_triangle_[n]);
      for (std::size_t p = 0; p < faces->picked_count; ++p) {
        const Triangle& t = faces->made[faces->picked[p]];
        const std::uint32_t number = first_triangle_[n] + faces->picked[p];
        const Vec3 u = points[t[1]] - points[t[0]], v = points[t[2]] - points[t[0]],
                   normal = cross(u, v);
        if (!has_much_area(u, v, normal, enough))
          small_[begin / blocks_at_once].push_back(
              {static_cast<std::uint32_t>(n), faces->picked_from[p], number});
        const bool turned = is_turned(normal, directions[faces->picked_case[p]]);
        if (faces->crowded[p] != 0 || turned)
          suspects_[begin / blocks_at_once].push_back(
              {static_cast<std::uint32_t>(n), number, turned});
      }
    }
  });
}

SnappedMesh::PointRef SnappedMesh::point_at(std::size_t n, unsigned place) const {
  const unsigned axis = place / 729;
  const LatticeSpot at =
      lattice_.spot(n, {static_cast<int>(place / 81 % 9), static_cast<int>(place / 9 % 9),
                        static_cast<int>(place % 9)});
  return {at.block, static_cast<std::uint8_t>(at.word(axis)), static_cast<std::uint8_t>(at.bit)};
}

std::array<SnappedMesh::PointRef, 3> SnappedMesh::corners_of(const SmallFace& face) const {
  const SurfaceBlock& block = *surface_.blocks[face.block];
  const std::uint8_t* cell = block.cases;
  std::uint32_t after = 0;
  for (unsigned i = 0; i < volume::leaf_dim; ++i)
    for (std::uint64_t active = block.active[i]; active != 0; active &= active - 1, ++cell) {
      const CellPlan& plan = plans_[*cell];
      after += plan.triangles;
      if (face.face >= after)
        continue;
      const auto bit = static_cast<unsigned>(std::countr_zero(active));
      const unsigned own = edge_place(i, bit >> 3, bit & 7);
      const std::size_t first = std::size_t{3} * (face.face + plan.triangles - after);
      return {point_at(face.block, own + plan.corner.at(first)),
              point_at(face.block, own + plan.corner.at(first + 1)),
              point_at(face.block, own + plan.corner.at(first + 2))};
    }
  return {};
}

/// Index position of a point after snapping, itself if nothing was merged here.
Vec3 SnappedMesh::position(const PointRef& ref) const {
  const SurfaceBlock& block = *surface_.blocks[ref.block];
  const SnapBlock& snaps = lattice_.snaps(ref.block);
  EdgeCrossing crossing{{block.origin[0] + ref.word / 3, block.origin[1] + (ref.bit >> 3),
                         block.origin[2] + (ref.bit & 7)},
                        ref.word % 3,
                        surface_.fractions[block.point(ref.word, ref.bit)]};
  if (at_corners_ && ((snaps.low.at(ref.word) | snaps.high.at(ref.word)) >> ref.bit & 1) != 0)
    crossing.fraction = (snaps.high.at(ref.word) >> ref.bit & 1) != 0 ? 1 : 0;
  return index_position(crossing);
}

/// Faces without area, ascending, judged in index space.
std::vector<std::uint32_t> SnappedMesh::find_without_area() {
  bool none = true;
  for (const auto& part : small_)
    none = none && part.empty();
  if (none)
    return {};
  std::vector<std::pair<std::uint32_t, Vec3>> merged; // by their new number
  for (const auto& part : merges_.places)
    for (const SnapMerges::Place& place : part)
      merged.emplace_back(merges_.target[place.point], place.position);
  const auto by_number = [](const auto& a, const auto& b) { return a.first < b.first; };
  std::ranges::sort(merged, by_number);
  std::vector<std::vector<std::uint32_t>> flat(small_.size());
  parallel_blocks(context_, small_.size(), 1, [&](std::size_t part, std::size_t) {
    for (const SmallFace& face : small_[part]) {
      const std::array<PointRef, 3> refs = corners_of(face);
      std::array<Vec3, 3> p;
      for (std::size_t a = 0; a < 3; ++a) {
        const PointRef& ref = refs.at(a);
        std::uint32_t number = merges_.target[surface_.blocks[ref.block]->point(ref.word, ref.bit)];
        if ((lattice_.snaps(ref.block).merged.at(ref.word) >> ref.bit & 1) != 0)
          number = merges_.target[number];
        const auto found = std::ranges::lower_bound(merged, std::pair(number, Vec3{}), by_number);
        p.at(a) = found != merged.end() && found->first == number ? found->second : position(ref);
      }
      if (has_no_area(p[0], p[1], p[2]))
        flat[part].push_back(face.triangle);
    }
  });
  std::vector<std::uint32_t> all;
  for (const auto& part : flat)
    all.insert(all.end(), part.begin(), part.end());
  return all;
}

/// Puts the points of faces that are still flat at the mean of their crossings (Place::mean) in
/// place of a corner.
void SnappedMesh::move_back(TriangleMesh& mesh, std::span<const std::uint32_t> flat) const {
  struct Mean {
    Vec3 sum;
    double weights = 0;
  };
  std::map<std::uint32_t, Mean> means;
  for (const std::uint32_t n : flat)
    for (const std::uint32_t corner : mesh.triangles[n])
      means[corner] = {};
  if (means.empty())
    return;
  for (std::size_t n = 0; n < surface_.blocks.size(); ++n) {
    const SurfaceBlock& block = *surface_.blocks[n];
    for (std::uint32_t p = block.first_point; p < block.first_point + block.points; ++p) {
      const BlockEdge edge = surface_.edges[p];
      const bool merged = (lattice_.snaps(n).merged.at(edge.word()) >> edge.bit() & 1) != 0;
      const auto mean = means.find(merges_.target[merged ? merges_.target[p] : p]);
      if (mean == means.end())
        continue;
      const double along = surface_.fractions[p], weight = 1 - 1.5 * std::min(along, 1 - along);
      const EdgeCrossing crossing{{block.origin[0] + static_cast<int>(edge.i()),
                                   block.origin[1] + static_cast<int>(edge.j()),
                                   block.origin[2] + static_cast<int>(edge.k())},
                                  static_cast<std::int32_t>(edge.axis()),
                                  along};
      mean->second.sum += index_position(crossing) * weight;
      mean->second.weights += weight;
    }
  }
  for (const auto& [point, mean] : means)
    mesh.points[point] = world_position(transform_.m, mean.sum / mean.weights);
}

void SnappedMesh::append_corners(const TriangleMesh& mesh, std::span<const std::uint32_t> faces,
                                 std::vector<Int3>& corners) const {
  std::vector<std::uint32_t> points;
  for (const std::uint32_t n : faces)
    points.insert(points.end(), mesh.triangles[n].begin(), mesh.triangles[n].end());
  std::ranges::sort(points);
  for (std::size_t n = 0; n < surface_.blocks.size(); ++n) {
    const SurfaceBlock& block = *surface_.blocks[n];
    const SnapBlock& snaps = lattice_.snaps(n);
    for (std::uint32_t p = block.first_point; p < block.first_point + block.points; ++p) {
      const BlockEdge at = surface_.edges[p];
      const bool merged = (snaps.merged.at(at.word()) >> at.bit() & 1) != 0;
      if (!std::ranges::binary_search(points, merges_.target[merged ? merges_.target[p] : p]))
        continue;
      const LatticeEdge edge{
          {static_cast<int>(at.i()), static_cast<int>(at.j()), static_cast<int>(at.k())},
          at.axis()};
      Int3 corner;
      if (lattice_.is_fin(n, edge))
        corners.push_back(lattice_.fin_of(p).corner);
      else if (lattice_.snap_corner(n, edge, corner))
        corners.push_back(lattice_.absolute(n, corner));
    }
  }
}

/// Snaps but at these corners, ascending, and appends those where faces cut each other then.
SnapResult snap_but_at(const Context& context, const IsoSurface& surface,
                       const SnapOptions& options, std::vector<Int3>& kept) {
  const SurfaceBlocks& blocks = *surface.lattice;
  SnapResult result;
  SnapLattice lattice(context, blocks, options.epsilon, surface.transform.determinant() < 0, kept);
  SnapMerges merges = merge_snap_clusters(context, lattice, options.place);
  SnappedMesh snapped(context, surface, lattice, merges, options.place);
  snapped.make(result);
  SnapReport& report = result.report;
  report.corners = merges.corners;
  report.fins = lattice.fins().size();
  report.refused = merges.refused;
  report.points_before = blocks.points;
  report.points_after = result.mesh.points.size();
  report.triangles_before = blocks.triangles;
  report.triangles_after = result.mesh.triangles.size();
  report.kept_corners = kept.size();
  if (options.epsilon > 0 && !options.may_cut) {
    const std::vector<std::uint32_t> cutting = snapped.find_cuts(result.mesh);
    report.cutting_faces = cutting.size();
    if (!cutting.empty())
      snapped.append_corners(result.mesh, cutting, kept);
  }
  return result;
}

} // namespace

SnapResult snap(const Context& context, const IsoSurface& surface, const SnapOptions& options) {
  if (!(options.epsilon >= 0 && options.epsilon <= 0.5))
    throw Error("epsilon must lie within 0 ... 0.5");
  if (surface.lattice == nullptr)
    return {};
  const SurfaceBlocks& blocks = *surface.lattice;
  const double points = static_cast<double>(blocks.points),
               triangles = static_cast<double>(blocks.triangles);
  require_memory(context,
                 static_cast<double>(blocks.blocks.size()) * sizeof(SnapBlock) +
                     points * (2 * sizeof(std::uint32_t) + 2 * sizeof(Vec3)) +
                     triangles * sizeof(Triangle),
                 "snapping");
  std::vector<Int3> kept;
  SnapResult best = snap_but_at(context, surface, options, kept);
  while (best.report.cutting_faces > 0) {
    std::ranges::sort(kept);
    kept.erase(std::unique(kept.begin(), kept.end()), kept.end());
    SnapResult next = snap_but_at(context, surface, options, kept);
    if (next.report.cutting_faces >= best.report.cutting_faces)
      break; // these faces touch without snapping, too
    best = std::move(next);
  }
  return best;
}

} // namespace gewebe::surface
