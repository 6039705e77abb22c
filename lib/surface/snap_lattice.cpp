#include "surface/snap_lattice_internal.h"

#include "base/huge_pages.h"
#include "base/parallel.h"

#include <algorithm>
#include <bit>
#include <emmintrin.h>
#include <tuple>
#include <utility>

// Based on: report FZKA 7190, Forschungszentrum Karlsruhe, 2006, section 3.1.4.

namespace gewebe::surface {
namespace {

constexpr std::uint64_t last_row = std::uint64_t{0xff} << 56;
constexpr std::uint64_t first_column = 0x0101010101010101U, last_column = first_column << 7;
constexpr std::size_t blocks_at_once = 64;

/// Bit n: distance(fraction n) <= limit. \pre count <= 64
template <class Distance>
std::uint64_t near_ones(const double* fractions, std::size_t count, double limit,
                        Distance&& distance) {
  std::uint64_t bits = 0;
  const __m128d limits = _mm_set1_pd(limit);
  std::size_t n = 0;
  for (; n + 2 <= count; n += 2) {
    const __m128d near = _mm_cmple_pd(distance(_mm_loadu_pd(fractions + n)), limits);
    bits |= static_cast<std::uint64_t>(_mm_movemask_pd(near)) << n;
  }
  if (n < count) {
    const __m128d near = _mm_cmple_sd(distance(_mm_load_sd(fractions + n)), limits);
    bits |= static_cast<std::uint64_t>(_mm_movemask_pd(near) & 1) << n;
  }
  return bits;
}

void set(EdgeWords& words, std::uint64_t points, const BlockEdge* edges) {
  for (; points != 0; points &= points - 1) {
    const BlockEdge edge = edges[std::countr_zero(points)];
    words[edge.word()] |= std::uint64_t{1} << edge.bit();
  }
}

void classify_block(const SurfaceBlock& block, const SurfaceBlocks& surface, double epsilon,
                    SnapBlock& snaps) {
  snaps = {};
  const auto to_start = [](__m128d f) { return f; };
  const auto to_end = [](__m128d f) { return _mm_sub_pd(_mm_set1_pd(1), f); };
  // Two points nearer to a corner than that can make a face without area; see `snap`.
  constexpr double extreme = 1e-3;
  for (std::uint32_t p = block.first_point; p < block.first_point + block.points; p += 64) {
    const std::size_t count = std::min<std::size_t>(64, block.first_point + block.points - p);
    const double* const fractions = surface.fractions.data() + p;
    const BlockEdge* const edges = surface.edges.data() + p;
    const std::uint64_t low = near_ones(fractions, count, epsilon, to_start),
                        high = near_ones(fractions, count, epsilon, to_end) & ~low;
    set(snaps.low, low, edges);
    set(snaps.high, high, edges);
    set(snaps.looked_at,
        near_ones(fractions, count, extreme, to_start) |
            near_ones(fractions, count, extreme, to_end),
        edges);
  }
}

/// A cell at an edge, by its place relative to some block, and which of its edges that is.
struct EdgeCell {
  Int3 cell{};
  std::size_t edge = 0;
};

std::array<EdgeCell, 4> cells_around(const LatticeEdge& edge) {
  std::array<EdgeCell, 4> cells;
  const std::size_t b = edge.axis == 0 ? 1 : 0, d = edge.axis == 2 ? 1 : 2;
  for (std::size_t n = 0; n < 4; ++n) {
    cells.at(n).cell = edge.start;
    cells.at(n).cell.at(b) -= static_cast<int>(n & 1);
    cells.at(n).cell.at(d) -= static_cast<int>(n >> 1);
    cells.at(n).edge = std::size_t{4} * edge.axis + n;
  }
  return cells;
}

LatticeEdge edge_of(const Int3& cell, std::size_t edge) {
  const CellEdge& e = cell_edges.at(edge);
  return {shifted(cell, e.corner, 1), e.axis};
}

} // namespace

SnapLattice::SnapLattice(const Context& context, const SurfaceBlocks& surface, double epsilon,
                         bool mirrored, std::span<const Int3> kept)
    : surface_(surface), mirrored_(mirrored) {
  Context quiet = context;
  quiet.progress = nullptr;
  classify(quiet, epsilon);
  keep(kept);
  apply_fin_rule(quiet);
}

void SnapLattice::classify(const Context& context, double epsilon) {
  const std::size_t real = surface_.blocks.size();
  snaps_ = std::make_unique_for_overwrite<SnapBlock[]>(real);
  prefer_huge_pages(snaps_.get(), real * sizeof(SnapBlock));
  std::vector<std::vector<Missing>> missing((real + blocks_at_once - 1) / blocks_at_once);
  parallel_blocks(context, real, blocks_at_once, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      const SurfaceBlock& block = *surface_.blocks[n];
      classify_block(block, surface_, epsilon, snaps_[n]);
      const auto add = [&](std::size_t place, unsigned axis, std::uint64_t draws) {
        if (draws != 0 && block.neighbours.at(place) == SurfaceBlock::none)
          missing[begin / blocks_at_once].push_back(
              {shifted(block.origin, 1U << axis, volume::leaf_dim), static_cast<std::uint32_t>(n),
               axis});
      };
      const EdgeWords& high = snaps_[n].high;
      std::uint64_t y = 0, z = 0;
      for (std::size_t i = 0; i < volume::leaf_dim; ++i) {
        y |= high[3 * i + 1];
        z |= high[3 * i + 2];
      }
      add(SurfaceBlock::neighbour_place(1, 0, 0), 0, high[21]);
      add(SurfaceBlock::neighbour_place(0, 1, 0), 1, y & last_row);
      add(SurfaceBlock::neighbour_place(0, 0, 1), 2, z & last_column);
    }
  });
  std::vector<Missing> all;
  for (const std::vector<Missing>& part : missing)
    all.insert(all.end(), part.begin(), part.end());
  add_further_blocks(std::move(all));
}

/// Lets points of these corners stay where they are, unless they lie in the corner.
void SnapLattice::keep(std::span<const Int3> corners) {
  for (const Int3& corner : corners)
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (const int back : {0, 1}) {
        Int3 start = corner;
        start.at(axis) -= back;
        const Int3 origin = volume::leaf_origin(start);
        const auto found = std::ranges::lower_bound(
            surface_.blocks, origin, {}, [](const SurfaceBlock* block) { return block->origin; });
        if (found == surface_.blocks.end() || (*found)->origin != origin)
          continue;
        const std::size_t w = 3 * static_cast<std::size_t>(start[0] - origin[0]) + axis;
        const auto bit = static_cast<unsigned>(8 * (start[1] - origin[1]) + start[2] - origin[2]);
        if (((*found)->crossed.at(w) >> bit & 1) == 0 ||
            fraction((*found)->point(w, bit)) == static_cast<double>(back))
          continue;
        SnapBlock& snaps = snaps_[static_cast<std::size_t>(found - surface_.blocks.begin())];
        (back != 0 ? snaps.high : snaps.low).at(w) &= ~(std::uint64_t{1} << bit);
      }
}

/// Blocks that no surface crosses, but with a corner that draws points of blocks before them.
void SnapLattice::add_further_blocks(std::vector<Missing> missing) {
  const std::size_t real = surface_.blocks.size();
  std::ranges::sort(missing, [](const Missing& a, const Missing& b) {
    return std::tie(a.origin, a.found_by) < std::tie(b.origin, b.found_by);
  });
  // A block round such a corner is a neighbour of one of those that found it.
  for (const Missing& m : missing) {
    if (further_.empty() || further_.back().origin != m.origin) {
      SurfaceBlock& block = further_.emplace_back();
      block.origin = m.origin;
      // All its corners are on the side of the ends of those edges.
      const SurfaceBlock& before = *surface_.blocks[m.found_by];
      block.outer = (before.outer >> (1U << m.axis) & 1) != 0 ? 0xff : 0;
      block.inside.fill(block.outer != 0 ? ~0ULL : 0);
    }
    SurfaceBlock& block = further_.back();
    const auto& around = surface_.blocks[m.found_by]->neighbours;
    for (int x = -1; x < 2; ++x)
      for (int y = -1; y < 2; ++y)
        for (int z = -1; z < 2; ++z) {
          Int3 from{x, y, z};
          if (++from.at(m.axis) > 1)
            continue;
          const std::uint32_t number =
              from == Int3{0, 0, 0}
                  ? m.found_by
                  : around.at(SurfaceBlock::neighbour_place(from[0], from[1], from[2]));
          if (number != SurfaceBlock::none)
            block.neighbours.at(SurfaceBlock::neighbour_place(x, y, z)) = number;
        }
  }
  further_numbers_ = IndexMap(further_.size());
  for (std::size_t n = 0; n < further_.size(); ++n)
    further_numbers_.insert(further_[n].origin, static_cast<std::uint32_t>(real + n));
}

SnapLattice::Corners SnapLattice::corners(std::size_t n) const {
  const SurfaceBlock& own = block(n);
  const SnapBlock &here = snaps(n), &x_before = neighbour(own, -1, 0, 0),
                  &y_before = neighbour(own, 0, -1, 0), &z_before = neighbour(own, 0, 0, -1);
  Corners result;
  for (std::size_t i = 0; i < volume::leaf_dim; ++i) {
    const std::size_t w = 3 * i;
    const std::array<std::uint64_t, 6> words{here.low[w],
                                             here.low[w + 1],
                                             here.low[w + 2],
                                             i > 0 ? here.high[w - 3] : x_before.high[21],
                                             here.high[w + 1] << 8 | y_before.high[w + 1] >> 56,
                                             (here.high[w + 2] & ~last_column) << 1 |
                                                 (z_before.high[w + 2] >> 7 & first_column)};
    std::uint64_t some = 0, several = 0;
    for (const std::uint64_t word : words) {
      several |= some & word;
      some |= word;
    }
    result.some[i] = some;
    result.several[i] = several | (fin_draws_.empty() ? 0 : fin_draws_[n][i]);
  }
  return result;
}

bool SnapLattice::snap_corner(std::size_t n, const LatticeEdge& edge, Int3& corner) const {
  const LatticeSpot at = spot(n, edge.start);
  const SnapBlock& snaps = this->snaps(at.block);
  corner = edge.start;
  if ((snaps.low.at(at.word(edge.axis)) >> at.bit & 1) != 0)
    return true;
  ++corner.at(edge.axis);
  return (snaps.high.at(at.word(edge.axis)) >> at.bit & 1) != 0;
}

std::uint32_t SnapLattice::first_member(std::size_t n, const Int3& corner) const {
  std::uint32_t first = SurfaceBlock::none;
  for_members(n, corner, [&](const LatticeEdge& edge) {
    first = std::min(first, point_on(spot(n, edge.start), edge.axis));
  });
  return first;
}

Int3 SnapLattice::from_origin(std::size_t n, const Int3& corner) const {
  const Int3& origin = block(n).origin;
  return {corner[0] - origin[0], corner[1] - origin[1], corner[2] - origin[2]};
}

Int3 SnapLattice::absolute(std::size_t n, const Int3& corner) const {
  const Int3& origin = block(n).origin;
  return {corner[0] + origin[0], corner[1] + origin[1], corner[2] + origin[2]};
}

void SnapLattice::append_star(std::size_t n, const LatticeEdge& edge,
                              std::vector<StarFace>& faces) const {
  struct Cell {
    LatticeSpot at;
    EdgeCell cell;
    unsigned cell_case = 0;
    auto key() const { return std::tuple(at.block, at.slice, at.bit); }
  };
  std::array<Cell, 4> cells;
  std::size_t count = 0;
  for (const EdgeCell& cell : cells_around(edge)) {
    const LatticeSpot at = spot(n, cell.cell);
    if (at.block != SurfaceBlock::none)
      cells.at(count++) = {at, cell, block(at.block).cell_case(at.slice, at.bit)};
  }
  for (std::size_t c = 1; c < count; ++c)
    for (std::size_t d = c; d > 0 && cells.at(d).key() < cells.at(d - 1).key(); --d)
      std::swap(cells.at(d), cells.at(d - 1));
  for (std::size_t c = 0; c < count; ++c) {
    const CellCase& plan = marching_cubes_table().at(cells.at(c).cell_case);
    for (std::size_t t = 0; t < plan.count; ++t)
      for (std::size_t at = 0; at < 3; ++at) {
        const auto& triangle = plan.triangles.at(t);
        if (triangle.at(at) != cells.at(c).cell.edge)
          continue;
        const std::size_t next = triangle.at((at + 1) % 3), last = triangle.at((at + 2) % 3);
        const Int3& cell = cells.at(c).cell.cell;
        faces.push_back({cells.at(c).at.block, edge_of(cell, mirrored_ ? last : next),
                         edge_of(cell, mirrored_ ? next : last)});
      }
  }
}

// ---- the fin rule

/// Points that snap nowhere while on each of the four faces of the lattice around their edge the
/// point of another edge snaps, or might. The surface joins a point to one on each of these faces,
/// so no other point can have neighbours that all snap.
EdgeWords SnapLattice::fin_candidates(std::size_t n) const {
  const SurfaceBlock& block = *surface_.blocks[n];
  const SnapBlock &here = snaps_[n], &x_after = neighbour(block, 1, 0, 0),
                  &y_after = neighbour(block, 0, 1, 0), &z_after = neighbour(block, 0, 0, 1),
                  &x_before = neighbour(block, -1, 0, 0), &y_before = neighbour(block, 0, -1, 0),
                  &z_before = neighbour(block, 0, 0, -1);
  const auto word = [](const SnapBlock& snaps, std::size_t i, std::size_t axis) {
    return snaps.low[3 * i + axis] | snaps.high[3 * i + axis];
  };
  const auto next_row = [](std::uint64_t bits, std::uint64_t after) {
    return bits >> 8 | after << 56;
  };
  const auto next_column = [](std::uint64_t bits, std::uint64_t after) {
    return (bits >> 1 & ~last_column) | (after & first_column) << 7;
  };
  const auto row_before = [](std::uint64_t bits, std::uint64_t before) {
    return bits << 8 | before >> 56;
  };
  const auto column_before = [](std::uint64_t bits, std::uint64_t before) {
    return (bits << 1 & ~first_column) | (before >> 7 & first_column);
  };
  // What edges of `axis` of the next slice do; further blocks than six might do anything.
  const auto next_slice = [&](const SnapBlock& snaps, std::size_t i, std::size_t axis) {
    return i < 7 ? word(snaps, i + 1, axis) : &snaps == &here ? word(x_after, 0, axis) : ~0ULL;
  };
  // At corner (i, j, k): the faces that two axes span from there, and those from the slice before.
  std::uint64_t xy_below = word(x_before, 7, 0) | next_row(word(x_before, 7, 0), ~0ULL) |
                           word(x_before, 7, 1) | word(here, 0, 1),
                xz_below = word(x_before, 7, 0) | next_column(word(x_before, 7, 0), ~0ULL) |
                           word(x_before, 7, 2) | word(here, 0, 2);
  EdgeWords found;
  for (std::size_t i = 0; i < volume::leaf_dim; ++i) {
    const std::uint64_t x = word(here, i, 0), y = word(here, i, 1), z = word(here, i, 2);
    const std::uint64_t xy = x | next_row(x, word(y_after, i, 0)) | y | next_slice(here, i, 1),
                        xz = x | next_column(x, word(z_after, i, 0)) | z | next_slice(here, i, 2),
                        yz = y | next_column(y, word(z_after, i, 1)) | z |
                             next_row(z, word(y_after, i, 2));
    // The last row of the block before and the last column: with the row and column that follow.
    const std::uint64_t row_xy = word(y_before, i, 0) | x << 56 | word(y_before, i, 1) |
                                 next_slice(y_before, i, 1),
                        row_yz = word(y_before, i, 1) | next_column(word(y_before, i, 1), ~0ULL) |
                                 word(y_before, i, 2) | z << 56,
                        column_xz = word(z_before, i, 0) | x << 7 | word(z_before, i, 2) |
                                    next_slice(z_before, i, 2),
                        column_yz = word(z_before, i, 1) | y << 7 | word(z_before, i, 2) |
                                    next_row(word(z_before, i, 2), ~0ULL);
    const auto* const crossed = &block.crossed[3 * i];
    found[3 * i] =
        crossed[0] & ~x & xy & row_before(xy, row_xy) & xz & column_before(xz, column_xz);
    found[3 * i + 1] = crossed[1] & ~y & xy & xy_below & yz & column_before(yz, column_yz);
    found[3 * i + 2] = crossed[2] & ~z & xz & xz_below & yz & row_before(yz, row_yz);
    xy_below = xy;
    xz_below = xz;
  }
  return found;
}

namespace {

double squared_distance(const Int3& start, unsigned axis, double fraction, const Int3& corner) {
  Vec3 d;
  for (int a = 0; a < 3; ++a)
    d[a] = static_cast<double>(start[static_cast<std::size_t>(a)]) -
           corner[static_cast<std::size_t>(a)];
  d[static_cast<int>(axis)] += fraction;
  return dot(d, d);
}

/// For each case and edge, the edges whose points are joined to it: bit e.
using CellJoins = std::array<std::array<std::uint16_t, 12>, 256>;

const CellJoins& cell_joins() {
  static const CellJoins joins = [] {
    CellJoins result{};
    for (std::size_t c = 0; c < result.size(); ++c) {
      const CellCase& plan = marching_cubes_table().at(c);
      for (std::size_t t = 0; t < plan.count; ++t)
        for (const std::uint8_t e : plan.triangles.at(t))
          for (const std::uint8_t f : plan.triangles.at(t))
            if (e != f)
              result.at(c).at(e) = static_cast<std::uint16_t>(result.at(c).at(e) | 1U << f);
    }
    return result;
  }();
  return joins;
}

} // namespace

/// Does the point on this edge, which snaps nowhere, snap by the fin rule?
bool SnapLattice::find_fin(std::size_t n, const LatticeEdge& edge, SnapFin& fin) const {
  std::array<Int3, 2> found{};
  std::size_t count = 0;
  for (const EdgeCell& cell : cells_around(edge)) {
    const LatticeSpot at = spot(n, cell.cell);
    if (at.block == SurfaceBlock::none)
      continue;
    const unsigned cell_case = block(at.block).cell_case(at.slice, at.bit);
    for (unsigned joined = cell_joins()[cell_case].at(cell.edge); joined != 0;
         joined &= joined - 1) {
      Int3 corner;
      if (!snap_corner(n, edge_of(cell.cell, static_cast<std::size_t>(std::countr_zero(joined))),
                       corner))
        return false;
      if ((count > 0 && corner == found[0]) || (count > 1 && corner == found[1]))
        continue;
      if (count == 2) // and it doesn't matter whether all others snap
        return false;
      found.at(count++) = corner;
    }
  }
  fin.start = absolute(n, edge.start);
  fin.axis = edge.axis;
  fin.point = point_on(spot(n, edge.start), edge.axis);
  Int3 corner = found[0];
  if (count == 2) {
    const double fraction = surface_.fractions[fin.point],
                 a = squared_distance(edge.start, edge.axis, fraction, found[0]),
                 b = squared_distance(edge.start, edge.axis, fraction, found[1]);
    if (b < a || (!(a < b) && first_member(n, found[1]) < first_member(n, found[0])))
      corner = found[1];
  }
  fin.corner = absolute(n, corner);
  return true;
}

/// A fin has no neighbour outside the clusters, so no fin makes or unmakes another: all at once.
void SnapLattice::apply_fin_rule(const Context& context) {
  const std::size_t real = surface_.blocks.size();
  std::vector<std::vector<SnapFin>> found((real + blocks_at_once - 1) / blocks_at_once);
  parallel_blocks(context, real, blocks_at_once, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      const EdgeWords candidates = fin_candidates(n);
      for (unsigned w = 0; w < 24; ++w)
        for (std::uint64_t bits = candidates[w]; bits != 0; bits &= bits - 1) {
          const int bit = std::countr_zero(bits);
          SnapFin fin;
          if (find_fin(n, {{static_cast<int>(w / 3), bit >> 3, bit & 7}, w % 3}, fin))
            found[begin / blocks_at_once].push_back(fin);
        }
    }
  });
  for (const std::vector<SnapFin>& part : found)
    fins_.insert(fins_.end(), part.begin(), part.end());
  if (fins_.empty())
    return;
  fins_by_point_ = fins_; // blocks and words in their order: that of the points
  std::ranges::sort(fins_, {}, [](const SnapFin& f) { return std::tuple(f.corner, f.point); });
  fin_.resize(count());
  fin_draws_.resize(count());
  for (const SnapFin& f : fins_) {
    // Its block by its number.
    const auto after = std::ranges::upper_bound(
        surface_.blocks, f.point, {}, [](const SurfaceBlock* block) { return block->first_point; });
    const auto n = static_cast<std::size_t>(after - surface_.blocks.begin()) - 1;
    const LatticeSpot own = spot(n, from_origin(n, f.start));
    fin_[n].at(own.word(f.axis)) |= std::uint64_t{1} << own.bit;
    LatticeSpot at = spot(n, from_origin(n, f.corner));
    if (at.block == SurfaceBlock::none)
      at.block = further_numbers_.find(volume::leaf_origin(f.corner));
    fin_draws_[at.block].at(at.slice) |= std::uint64_t{1} << at.bit;
  }
}

std::span<const SnapFin> SnapLattice::fins_at(const Int3& corner) const {
  const auto range = std::ranges::equal_range(fins_, corner, {}, &SnapFin::corner);
  return {range.begin(), range.end()};
}

const SnapFin& SnapLattice::fin_of(std::uint32_t point) const {
  return *std::ranges::lower_bound(fins_by_point_, point, {}, &SnapFin::point);
}

} // namespace gewebe::surface
