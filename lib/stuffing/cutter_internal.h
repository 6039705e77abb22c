#pragma once
// What is inside of a block's cells, as tetrahedra. For the room alone.

#include "stuffing/bcc_internal.h"
#include "stuffing/grading_internal.h"
#include "stuffing/interface_internal.h"
#include "stuffing/lattice_internal.h"
#include "stuffing/numbering_internal.h"
#include "stuffing/stencils_internal.h"
#include "stuffing/warp_internal.h"

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace gewebe::stuffing {

/// All that a mesh is made of.
struct StuffingParts {
  const StuffingBlocks& blocks;
  const Grading& grading;
  const SurfacePoints& surface;
  const BlockMaterials& materials; ///< empty where no interface is followed
  const MaterialInterface& interface;
  const StuffingNodes& nodes;

  bool follows() const { return !materials.empty(); }
};

/// The points of a block's cells, those on its far sides included.
struct BlockPoints {
  static constexpr unsigned dim = volume::leaf_dim + 1, count = 2 * dim * dim * dim;
  static constexpr unsigned at(unsigned kind, unsigned i, unsigned j, unsigned k) {
    return ((kind * dim + i) * dim + j) * dim + k;
  }
  std::array<int, count> sign{};
  std::array<std::uint32_t, count> node{};    ///< where the sign isn't -1
  std::array<std::uint32_t, count> surface{}; ///< number of the surface point
  // Where an interface is followed and the sign isn't -1:
  std::array<std::optional<std::int32_t>, count> material{}; ///< nothing: on the interface
  std::array<std::uint32_t, count> interface {};             ///< number of the interface point
};

/// A tetrahedron of the lattice and the stencil of what is inside, or of both sides of an
/// interface.
struct CutTetrahedron {
  const Stencil* stencil = nullptr;
  const Stencil* beyond = nullptr; ///< of an interface, where one cuts it: of the larger material
  std::optional<std::int32_t> material, material_beyond; ///< nothing: that of the centroid
  std::size_t number = 0;                                ///< among those of the cell
  std::array<unsigned, 4> at{};                          ///< its corners in BlockPoints

  std::uint64_t count() const {
    return std::uint64_t{stencil->count} + (beyond != nullptr ? beyond->count : 0U);
  }
};

/// The tetrahedra of blocks, by cell, then as in bcc::cell_tetrahedra, then by stencil; with a
/// grading those between leaves in their place.
class BlockCutter {
public:
  explicit BlockCutter(const StuffingParts& parts);

  void gather(std::size_t block, BlockPoints& points) const;

  /// Calls cut(tetrahedron) for what isn't outside, and whole(nodes) for a tetrahedron between
  /// leaves that aren't both single cells.
  template <class Cut, class Whole>
  void for_each(std::size_t b, const BlockPoints& points, Cut&& cut, Whole&& whole) const {
    const StuffingBlock& block = parts_.blocks[b];
    const bool fine = parts_.grading.none() || parts_.grading.is_fine(block);
    for (unsigned i = 0; i < volume::leaf_dim; ++i)
      for (unsigned j = 0; j < volume::leaf_dim; ++j)
        for (unsigned k = 0; k < volume::leaf_dim; ++k) {
          const unsigned base = BlockPoints::at(0, i, j, k);
          int inside = 0;
          for (const unsigned offset : offset_)
            inside += points.sign[base + offset] > 0 ? 1 : 0;
          if (inside == 0)
            continue;
          if (fine)
            cut_cell(points, i, j, k, 0, 3, cut);
          else
            cut_leaf(block, points, i, j, k, cut, whole);
        }
  }

  /// \param of of one of the stencils of `cut`
  Tetrahedron nodes_of(const std::array<StencilNode, 4>& of, const CutTetrahedron& cut,
                       const BlockPoints& points) const;

private:
  /// Those round the long edges from a cell's centre along axes begin … end - 1.
  template <class Cut>
  void cut_cell(const BlockPoints& points, unsigned i, unsigned j, unsigned k, std::size_t begin,
                std::size_t end, Cut&& cut) const {
    const unsigned base = BlockPoints::at(0, i, j, k);
    const bool even = ((i + j + k) & 1) == 0; // so is the sum of a block's origin
    const bool follows = parts_.follows();
    CutTetrahedron tetrahedron;
    for (std::size_t t = 4 * begin; t < 4 * end; ++t) {
      std::array<int, 4> signs{};
      for (std::size_t c = 0; c < 4; ++c) {
        tetrahedron.at[c] = base + offset_[bcc::cell_tetrahedra[t][c]];
        signs[c] = points.sign[tetrahedron.at[c]];
      }
      const unsigned octant = bcc::cell_tetrahedra[t][2] - 4U;
      const bool even2 = even == ((std::popcount(octant) & 1) == 0);
      if (follows)
        choose(points, signs, even, even2, tetrahedron);
      else
        tetrahedron.stencil = &stencil(signs, even, even2);
      if (tetrahedron.stencil->count != 0) {
        tetrahedron.number = t;
        cut(tetrahedron);
      }
    }
  }
  /// Fills in stencils and materials where an interface is followed.
  void choose(const BlockPoints& points, std::array<int, 4> signs, bool even, bool even2,
              CutTetrahedron& tetrahedron) const;

  template <class Cut, class Whole>
  void cut_leaf(const StuffingBlock& block, const BlockPoints& points, unsigned i, unsigned j,
                unsigned k, Cut&& cut, Whole&& whole) const {
    const Int3 cell{static_cast<int>(i), static_cast<int>(j), static_cast<int>(k)};
    const unsigned level = parts_.grading.level(block, cell);
    if (((i | j | k) & ((1U << level) - 1)) != 0)
      return;
    for (unsigned axis = 0; axis < 3; ++axis) {
      Int3 next = cell;
      ++next[axis];
      if (level == 0 && parts_.grading.level(block, next) == 0) {
        cut_cell(points, i, j, k, axis, axis + 1, cut);
        continue;
      }
      for_each_between(
          parts_.grading, block, cell, axis,
          [&](const Int3& corner) {
            return find(block, {0, corner}).is_node;
          },
          [&](const LatticeTetrahedron& tetrahedron) {
            Tetrahedron result{};
            for (std::size_t n = 0; n < 4; ++n)
              result[n] = find(block, tetrahedron[n]).number;
            whole(result);
          });
    }
  }

  struct Found {
    bool is_node = false;
    std::uint32_t number = 0;
  };
  Found find(const StuffingBlock& block, const bcc::Point& point) const;
  /// The node on the edge between corners of two materials.
  std::uint32_t interface_node(const CutTetrahedron& cut, unsigned i, unsigned j,
                               const BlockPoints& points) const;

  const StuffingParts& parts_;
  std::array<unsigned, bcc::cell_points> offset_{};
};

} // namespace gewebe::stuffing
