#include "surface/snap_cuts_internal.h"

#include "base/parallel.h"
#include "collision/bvh.h"
#include "geometry/boxes_meet.h"
#include "mesh/self_intersections.h"

#include <algorithm>
#include <iterator>

namespace gewebe::surface {
namespace {

Box3 box_of(const TriangleMesh& mesh, std::uint32_t face) {
  Box3 box;
  for (const std::uint32_t p : mesh.triangles[face])
    box.add(mesh.points[p]);
  return box;
}

/// Box of the world around a block's cells and what their faces may reach when they move.
Box3 box_of(const SurfaceBlock& block, const volume::GridTransform& transform) {
  Box3 box;
  for (unsigned corner = 0; corner < 8; ++corner) {
    Vec3 at;
    for (int a = 0; a < 3; ++a)
      at[a] = block.origin[static_cast<std::size_t>(a)] +
              ((corner >> a & 1) != 0 ? volume::leaf_dim + 1.0 : -1.0);
    box.add(transform.to_world(at));
  }
  return box;
}

/// Finds pairs of a suspect and a face whose boxes meet.
class PairSearch {
public:
  PairSearch(const Context& context, const SnappedFaces& snapped,
             const std::vector<SuspectFace>& suspects)
      : context_(context), snapped_(snapped), blocks_(blocks_near(suspects)) {
    boxes_.reserve(suspects.size());
    for (const SuspectFace& suspect : suspects)
      boxes_.push_back(box_of(snapped.mesh, suspect.face));
    tree_ = collision::Bvh(boxes_);
  }

  /// Calls visit(found, block, face, number of the suspect) for each pair and puts together what
  /// it appends to `found`.
  template <class Item, class Visit>
  std::vector<Item> collect(const Visit& visit) const {
    std::vector<std::vector<Item>> found((blocks_.size() + blocks_at_once - 1) / blocks_at_once);
    parallel_blocks(context_, blocks_.size(), blocks_at_once,
                    [&](std::size_t begin, std::size_t end) {
                      for (std::size_t b = begin; b < end; ++b)
                        for_pairs(blocks_[b], [&](std::uint32_t face, std::uint32_t suspect) {
                          visit(found[begin / blocks_at_once], blocks_[b], face, suspect);
                        });
                    });
    std::vector<Item> all;
    for (const std::vector<Item>& part : found)
      all.insert(all.end(), part.begin(), part.end());
    return all;
  }

private:
  static constexpr std::size_t blocks_at_once = 16;

  /// Blocks with a suspect and those beside them, ascending.
  std::vector<std::uint32_t> blocks_near(const std::vector<SuspectFace>& suspects) const {
    const auto& all = snapped_.surface.blocks;
    std::vector<std::uint32_t> blocks;
    for (const SuspectFace& suspect : suspects)
      if (blocks.empty() || blocks.back() != suspect.block)
        blocks.push_back(suspect.block);
    for (std::size_t n = 0, own = blocks.size(); n < own; ++n)
      for (const std::uint32_t number : all[blocks[n]]->neighbours)
        if (number < all.size())
          blocks.push_back(number);
    std::ranges::sort(blocks);
    blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
    return blocks;
  }

  template <class Visit>
  void for_pairs(std::uint32_t block, const Visit& visit) const {
    Box3 near; // around the suspects that may meet faces of the block
    tree_.for_each_overlapping(box_of(*snapped_.surface.blocks[block], snapped_.transform),
                               [&](std::uint32_t suspect) {
                                 near.add(boxes_[suspect].min);
                                 near.add(boxes_[suspect].max);
                               });
    if (near.empty())
      return;
    for (std::uint32_t face = snapped_.first_face[block]; face < snapped_.first_face[block + 1];
         ++face) {
      const Box3 box = box_of(snapped_.mesh, face);
      if (meet(near, box))
        tree_.for_each_overlapping(box, [&](std::uint32_t suspect) { visit(face, suspect); });
    }
  }

  const Context& context_;
  const SnappedFaces& snapped_;
  std::vector<std::uint32_t> blocks_;
  std::vector<Box3> boxes_;
  collision::Bvh tree_;
};

} // namespace

CellDirections make_directions(const volume::GridTransform& transform) {
  const auto& m = transform.m;
  CellDirections directions{};
  for (unsigned c = 0; c < directions.size(); ++c) {
    Vec3 out;
    for (unsigned corner = 0; corner < 8; ++corner)
      for (unsigned a = 0; a < 3; ++a)
        out[static_cast<int>(a)] += (corner >> a & 1) == (c >> corner & 1) ? -1 : 1;
    const Vec3 world{m[0] * out.x + m[1] * out.y + m[2] * out.z,
                     m[4] * out.x + m[5] * out.y + m[6] * out.z,
                     m[8] * out.x + m[9] * out.y + m[10] * out.z};
    const double length = norm(world);
    directions[c] = length > 0 ? world / length : Vec3{};
  }
  return directions;
}

std::vector<std::uint32_t> find_cutting_faces(const Context& context, const SnappedFaces& snapped,
                                              std::vector<SuspectFace> suspects) {
  // Where one face is turned over, those round it lie on each other.
  std::vector<SuspectFace> turned;
  std::ranges::copy_if(suspects, std::back_inserter(turned), &SuspectFace::turned);
  if (!turned.empty()) {
    const auto near =
        PairSearch(context, snapped, turned)
            .collect<SuspectFace>([](std::vector<SuspectFace>& found, std::uint32_t block,
                                     std::uint32_t face, std::uint32_t) {
              if (found.empty() || found.back().face != face)
                found.push_back({block, face, false});
            });
    suspects.insert(suspects.end(), near.begin(), near.end());
    std::ranges::sort(suspects, {}, &SuspectFace::face);
    const auto repeated = std::ranges::unique(suspects, {}, &SuspectFace::face);
    suspects.erase(repeated.begin(), repeated.end());
  }
  if (suspects.empty())
    return {};
  const mesh::FaceIntersections exact(snapped.mesh);
  std::vector<std::uint8_t> is_suspect(snapped.mesh.triangles.size());
  for (const SuspectFace& suspect : suspects)
    is_suspect[suspect.face] = 1;
  std::vector<std::uint8_t> degenerate(suspects.size());
  for (std::size_t n = 0; n < suspects.size(); ++n)
    degenerate[n] = exact.degenerate(suspects[n].face) ? 1 : 0;
  std::vector<std::uint32_t> cutting =
      PairSearch(context, snapped, suspects)
          .collect<std::uint32_t>([&](std::vector<std::uint32_t>& found, std::uint32_t,
                                      std::uint32_t face, std::uint32_t suspect) {
            const std::uint32_t other = suspects[suspect].face;
            if (other != face && (is_suspect[face] == 0 || other < face) &&
                degenerate[suspect] == 0 && !exact.degenerate(face) && exact.meet(face, other))
              found.insert(found.end(), {face, other});
          });
  std::ranges::sort(cutting);
  cutting.erase(std::unique(cutting.begin(), cutting.end()), cutting.end());
  return cutting;
}

} // namespace gewebe::surface
