#include "surface/snap_lattice_internal.h"

#include "base/huge_pages.h"
#include "base/parallel.h"

#include <algorithm>
#include <bit>
#include <tuple>
#include <utility>

// Based on: report FZKA 7190, Forschungszentrum Karlsruhe, 2006, section 3.1.4.

namespace gewebe {
namespace {

constexpr std::uint64_t first_row = 0xff, last_row = first_row << 56;
constexpr std::uint64_t first_column = 0x0101010101010101U, last_column = first_column << 7;
constexpr std::size_t blocks_at_once = 64;

void classify_block(const SurfaceBlock& block, const double* fraction, double epsilon,
                    SnapBlock& snaps) {
  snaps.merged = {};
  for (std::size_t w = 0; w < 24; ++w) {
    std::uint64_t low = 0, high = 0, extreme = 0;
    for (std::uint64_t bits = block.crossed[w]; bits != 0; bits &= bits - 1, ++fraction) {
      const std::uint64_t bit = bits & (0 - bits);
      const double f = *fraction;
      const bool is_low = f <= epsilon, is_high = !is_low && 1 - f <= epsilon;
      // Two of these near a corner can make a face without area; see `snap`.
      const bool is_extreme = !(f >= 1e-3 && f <= 1 - 1e-3);
      low |= is_low ? bit : 0;
      high |= is_high ? bit : 0;
      extreme |= is_extreme ? bit : 0;
    }
    snaps.low[w] = low;
    snaps.high[w] = high;
    snaps.looked_at[w] = extreme;
  }
}

/// Points that snap nowhere while, as far as this block tells, on each of the four faces of the
/// lattice around their edge another edge's point snaps. The surface joins a point to one on each
/// of these faces, so no other point can have neighbours that all snap.
EdgeWords fin_candidates(const SurfaceBlock& block, const SnapBlock& snaps) {
  // At corner (i, j, k): the face that two axes span from there.
  const auto next_row = [](std::uint64_t word) { return word >> 8 | last_row; };
  const auto next_column = [](std::uint64_t word) {
    return (word >> 1 & ~last_column) | last_column;
  };
  const auto last_row_of = [](std::uint64_t word) { return word << 8 | first_row; };
  const auto last_column_of = [](std::uint64_t word) {
    return (word << 1 & ~first_column) | first_column;
  };
  EdgeWords found;
  std::uint64_t xy_before = ~0ULL, xz_before = ~0ULL;
  for (std::size_t i = 0; i < leaf_dim; ++i) {
    const auto word = [&](std::size_t slice, std::size_t axis) {
      return slice < leaf_dim ? snaps.low[3 * slice + axis] | snaps.high[3 * slice + axis] : ~0ULL;
    };
    const std::uint64_t x = word(i, 0), y = word(i, 1), z = word(i, 2);
    const std::uint64_t xy = x | next_row(x) | y | word(i + 1, 1),
                        xz = x | next_column(x) | z | word(i + 1, 2),
                        yz = y | next_column(y) | z | next_row(z);
    const auto* const crossed = &block.crossed[3 * i];
    found[3 * i] = crossed[0] & ~x & xy & last_row_of(xy) & xz & last_column_of(xz);
    found[3 * i + 1] = crossed[1] & ~y & xy & xy_before & yz & last_column_of(yz);
    found[3 * i + 2] = crossed[2] & ~z & xz & xz_before & yz & last_row_of(yz);
    xy_before = xy;
    xz_before = xz;
  }
  return found;
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
                         bool mirrored)
    : surface_(surface), mirrored_(mirrored) {
  Context quiet = context;
  quiet.progress = nullptr;
  classify(quiet, epsilon);
  apply_fin_rule(quiet);
}

void SnapLattice::classify(const Context& context, double epsilon) {
  const std::size_t real = surface_.blocks.size();
  snaps_ = std::make_unique_for_overwrite<SnapBlock[]>(real);
  prefer_huge_pages(snaps_.get(), real * sizeof(SnapBlock));
  parallel_blocks(context, real, blocks_at_once, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      const SurfaceBlock& block = *surface_.blocks[n];
      classify_block(block, surface_.fractions.data() + block.first_point, epsilon, snaps_[n]);
    }
  });
  add_further_blocks();
}

/// Blocks that no surface crosses, but with a corner that draws points of blocks before them.
void SnapLattice::add_further_blocks() {
  struct Missing {
    Int3 origin{};
    std::uint32_t found_by = 0;
    unsigned axis = 0;
  };
  std::vector<Missing> missing;
  const std::size_t real = surface_.blocks.size();
  for (std::size_t n = 0; n < real; ++n) {
    const SurfaceBlock& block = *surface_.blocks[n];
    const auto add = [&](std::size_t place, unsigned axis, std::uint64_t draws) {
      if (draws != 0 && block.neighbours.at(place) == SurfaceBlock::none)
        missing.push_back(
            {shifted(block.origin, 1U << axis, leaf_dim), static_cast<std::uint32_t>(n), axis});
    };
    const EdgeWords& high = snaps_[n].high;
    std::uint64_t y = 0, z = 0;
    for (std::size_t i = 0; i < leaf_dim; ++i) {
      y |= high[3 * i + 1];
      z |= high[3 * i + 2];
    }
    add(SurfaceBlock::neighbour_place(1, 0, 0), 0, high[21]);
    add(SurfaceBlock::neighbour_place(0, 1, 0), 1, y & last_row);
    add(SurfaceBlock::neighbour_place(0, 0, 1), 2, z & last_column);
  }
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

std::uint64_t SnapLattice::from_below(std::size_t n, std::size_t i, unsigned axis) const {
  const auto& around = block(n).neighbours;
  const auto high = [&](std::uint32_t number, std::size_t slice) {
    return number == SurfaceBlock::none ? 0 : snaps(number).high[3 * slice + axis];
  };
  const auto here = static_cast<std::uint32_t>(n);
  if (axis == 0)
    return i > 0 ? high(here, i - 1) : high(around[SurfaceBlock::neighbour_place(-1, 0, 0)], 7);
  if (axis == 1)
    return high(here, i) << 8 | high(around[SurfaceBlock::neighbour_place(0, -1, 0)], i) >> 56;
  return (high(here, i) & ~last_column) << 1 |
         (high(around[SurfaceBlock::neighbour_place(0, 0, -1)], i) >> 7 & first_column);
}

SnapLattice::Corners SnapLattice::corners(std::size_t n, std::size_t i) const {
  Corners result;
  for (unsigned axis = 0; axis < 3; ++axis)
    for (const std::uint64_t word : {snaps(n).low[3 * i + axis], from_below(n, i, axis)}) {
      result.several |= result.some & word;
      result.some |= word;
    }
  if (!fin_draws_.empty())
    result.several |= fin_draws_[n][i];
  return result;
}

LatticeSpot SnapLattice::spot(std::size_t n, const Int3& corner) const {
  const int x = corner[0] >> 3, y = corner[1] >> 3, z = corner[2] >> 3;
  const std::size_t place = SurfaceBlock::neighbour_place(x, y, z);
  return {place == 13 ? static_cast<std::uint32_t>(n) : block(n).neighbours.at(place),
          static_cast<unsigned>(corner[0] & 7),
          static_cast<unsigned>(8 * (corner[1] & 7) + (corner[2] & 7))};
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
      const EdgeWords candidates = fin_candidates(*surface_.blocks[n], snaps_[n]);
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
      at.block = further_numbers_.find(leaf_origin(f.corner));
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

} // namespace gewebe
