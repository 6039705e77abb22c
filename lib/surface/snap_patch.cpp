#include "surface/snap_patch_internal.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <emmintrin.h>

namespace gewebe::surface {
namespace {

constexpr PatchCorners all_corners = (1U << 27) - 1;
constexpr std::array<unsigned, 3> stride{3, 9, 1};
constexpr unsigned centre = 9 + 3 + 1;

constexpr PatchEdges operator&(const PatchEdges& a, const PatchEdges& b) {
  return {a.xy & b.xy, a.z & b.z};
}
constexpr PatchEdges operator|(const PatchEdges& a, const PatchEdges& b) {
  return {a.xy | b.xy, a.z | b.z};
}
constexpr PatchEdges without(const PatchEdges& a, const PatchEdges& b) {
  return {a.xy & ~b.xy, a.z & ~b.z};
}
constexpr bool any(const PatchEdges& a) {
  return (a.xy | a.z) != 0;
}
/// Edges of the cell at the patch's origin move to another one.
constexpr PatchEdges moved(const PatchEdges& a, unsigned by) {
  return {a.xy << by, a.z << by};
}
unsigned count_edges(const PatchEdges& a) {
  return count_bits(a.xy) + count_bits(a.z);
}
constexpr PatchEdges single(unsigned place, unsigned axis) {
  return axis == 2 ? PatchEdges{0, 1U << place}
                   : PatchEdges{std::uint64_t{1} << (place + 27 * axis), 0};
}

bool are_two(const PatchEdges& a) {
  // The lowest of all is taken away twice.
  const std::uint64_t x = a.xy & (a.xy - 1);
  const std::uint32_t z = a.z & (a.z - 1);
  if (a.xy == 0 || a.z == 0) // two in one word
    return (a.xy == 0 ? z != 0 && (z & (z - 1)) == 0 : x != 0 && (x & (x - 1)) == 0);
  return x == 0 && z == 0;
}

/// The corners that points on these edges snap to.
PatchCorners targets(const PatchEdges& edges, const PatchEdges& low, const PatchEdges& high) {
  const PatchEdges down = edges & low, up = edges & high;
  const auto x = static_cast<PatchCorners>(down.xy & all_corners),
             y = static_cast<PatchCorners>(down.xy >> 27),
             up_x = static_cast<PatchCorners>(up.xy & all_corners),
             up_y = static_cast<PatchCorners>(up.xy >> 27);
  return x | up_x << stride[0] | y | up_y << stride[1] | down.z | up.z << stride[2];
}

/// Where the cell on side n of the corner starts.
constexpr unsigned cell_place(unsigned n) {
  return (n & 1) * stride[0] + (n >> 1 & 1) * stride[1] + (n >> 2) * stride[2];
}

struct PatchCell {
  std::uint8_t side = 0, edge = 0; ///< its side of the corner, and an edge in it
};

/// What is known beforehand.
struct Tables {
  /// Of each case and edge: the edges joined to it, for the cell at the patch's origin.
  std::array<std::array<PatchEdges, 12>, 256> joined{};
  /// Of each case, corner and set of axes: faces with points on two or more of the edges of these
  /// axes at this corner.
  std::array<std::array<std::array<std::uint8_t, 8>, 8>, 256> vanished{};
  /// Bits of a case for corners (0,0,0), (0,0,1), -, (1,0,0), (1,0,1).
  std::array<std::uint8_t, 32> flat{};
  /// The edge of each direction.
  std::array<PatchEdges, 6> edge{};
  /// Of each side of the corner and set of directions: the axes along which that cell has one.
  std::array<std::array<std::uint8_t, 64>, 8> axes{};
  // By the axes along which a block begins at the corner, which decides about the order:
  std::array<std::array<std::uint8_t, 6>, 8> directions{};        ///< of points
  std::array<std::array<std::array<PatchCell, 4>, 6>, 8> cells{}; ///< round each direction's edge
};

Tables make_tables() {
  Tables t;
  for (unsigned c = 0; c < 256; ++c) {
    const CellCase& plan = marching_cubes_table().at(c);
    for (unsigned f = 0; f < plan.count; ++f) {
      const auto& triangle = plan.triangles.at(f);
      for (const std::uint8_t a : triangle)
        for (const std::uint8_t b : triangle)
          if (a != b) {
            const CellEdge& e = cell_edges.at(b);
            PatchEdges& joined = t.joined.at(c).at(a);
            joined = joined | single(cell_place(e.corner), e.axis);
          }
      for (unsigned corner = 0; corner < 8; ++corner)
        for (unsigned axes = 0; axes < 8; ++axes) {
          unsigned met = 0;
          for (const std::uint8_t a : triangle) {
            const CellEdge& e = cell_edges.at(a);
            const bool here = e.corner == corner || (e.corner | 1U << e.axis) == corner;
            met += here && (axes >> e.axis & 1) != 0 ? 1 : 0;
          }
          t.vanished.at(c).at(corner).at(axes) =
              static_cast<std::uint8_t>(t.vanished.at(c).at(corner).at(axes) + (met > 1 ? 1 : 0));
        }
    }
  }
  for (unsigned n = 0; n < 32; ++n)
    t.flat.at(n) = static_cast<std::uint8_t>((n & 1) | (n >> 1 & 1) << 4 | (n >> 3 & 1) << 1 |
                                             (n >> 4 & 1) << 5);
  for (unsigned d = 0; d < 6; ++d)
    t.edge.at(d) = single(centre - (d & 1) * stride.at(d / 2), d / 2);
  for (unsigned side = 0; side < 8; ++side)
    for (unsigned set = 0; set < 64; ++set)
      for (unsigned axis = 0; axis < 3; ++axis)
        if ((set >> (2 * axis + ((side >> axis & 1) != 0 ? 0 : 1)) & 1) != 0)
          t.axes.at(side).at(set) = static_cast<std::uint8_t>(t.axes.at(side).at(set) | 1U << axis);
  for (unsigned begins = 0; begins < 8; ++begins) {
    // Points go by the origin of their block, then by slice, axis and place in it.
    const auto key = [&](const Int3& start, unsigned axis) {
      std::array<int, 7> k{};
      for (unsigned a = 0; a < 3; ++a)
        k.at(a) = (begins >> a & 1) != 0 ? start.at(a) : 0;
      k[3] = start[0];
      k[4] = static_cast<int>(axis);
      k[5] = start[1];
      k[6] = start[2];
      return k;
    };
    const auto start_of = [](unsigned d) {
      Int3 start{0, 0, 0};
      start.at(d / 2) -= static_cast<int>(d & 1);
      return start;
    };
    auto& directions = t.directions.at(begins);
    for (unsigned d = 0; d < 6; ++d)
      directions.at(d) = static_cast<std::uint8_t>(d);
    std::ranges::sort(directions, {}, [&](unsigned d) { return key(start_of(d), d / 2); });
    for (unsigned d = 0; d < 6; ++d) {
      std::size_t found = 0;
      auto& cells = t.cells.at(begins).at(d);
      for (unsigned e = 0; e < 12; ++e) {
        if (cell_edges.at(e).axis != d / 2)
          continue;
        const unsigned back = static_cast<unsigned>(cell_edges.at(e).corner); // from start to cell
        const unsigned side = (~back & 7U & ~(1U << d / 2)) | ((d & 1) != 0 ? 0U : 1U << d / 2);
        cells.at(found++) = {static_cast<std::uint8_t>(side), static_cast<std::uint8_t>(e)};
      }
      std::ranges::sort(cells, {}, [&](const PatchCell& cell) {
        Int3 start{};
        for (unsigned a = 0; a < 3; ++a)
          start.at(a) = static_cast<int>(cell.side >> a & 1) - 1;
        return key(start, 0);
      });
    }
  }
  return t;
}

const Tables& tables() {
  static const Tables t = make_tables();
  return t;
}

/// Rows 0 … 7, each with the last bit of the row before and the first of the one after it.
void spread(std::uint16_t* rows, std::uint64_t before, std::uint64_t here, std::uint64_t after) {
  constexpr std::uint64_t first_column = 0x0101010101010101U;
  const __m128i zero = _mm_setzero_si128();
  const auto word = [](std::uint64_t bits) {
    return _mm_cvtsi64_si128(static_cast<long long>(bits));
  };
  const __m128i b = word(before >> 7 & first_column), h = word(here),
                a = word(after & first_column);
  const auto join = [](__m128i x, __m128i y, __m128i z) {
    return _mm_or_si128(x, _mm_or_si128(_mm_slli_epi16(y, 1), _mm_slli_epi16(z, 9)));
  };
  _mm_storeu_si128(
      reinterpret_cast<__m128i*>(rows),
      join(_mm_unpacklo_epi8(b, zero), _mm_unpacklo_epi8(h, zero), _mm_unpacklo_epi8(a, zero)));
}

/// Row 7 of what lies before or row 0 of what lies after, with the same bits at its ends.
std::uint16_t row(std::uint64_t before, std::uint64_t here, std::uint64_t after, unsigned shift) {
  return static_cast<std::uint16_t>((before >> shift >> 7 & 1) | (here >> shift & 0xff) << 1 |
                                    (after >> shift & 1) << 9);
}

/// Bits round corner (i, j, k) of the block.
inline PatchCorners window(const std::uint16_t* set, unsigned i, unsigned j, unsigned k) {
  std::uint64_t bits = 0;
  for (unsigned x = 0; x < 3; ++x) {
    std::uint64_t rows;
    std::memcpy(&rows, set + SnapPatches::padded * (i + x) + j, sizeof rows);
    bits |= (rows >> k & 0x0000000700070007U) << (3 * x);
  }
  return static_cast<PatchCorners>((bits & 0x1ff) | (bits >> 7 & 0x3fe00) |
                                   (bits >> 14 & 0x7fc0000));
}

/// The same of three sets, one for each axis.
template <class Rows>
inline PatchEdges edges_window(const Rows* sets, unsigned i, unsigned j, unsigned k) {
  return {window(sets[0].data(), i, j, k) | std::uint64_t{window(sets[1].data(), i, j, k)} << 27,
          window(sets[2].data(), i, j, k)};
}

/// One cluster while it is merged. Its members are numbered by their order.
struct Cluster {
  const Tables& table;
  bool mirrored;
  unsigned begins; // bit a: a block begins at the corner along axis a
  std::array<unsigned, 8> cases{};
  std::size_t count = 0;
  std::array<std::uint8_t, 6> direction{}; // of each member
  std::array<std::uint8_t, 6> member{};    // of each direction, or 6
  std::array<std::uint8_t, 7> target{0, 1, 2, 3, 4, 5, 6};
  std::array<PatchEdges, 6> near{};          // neighbours of each member
  std::array<PatchMerges::Group, 6> chain{}; // by target

  const PatchEdges& edge(std::size_t m) const { return table.edge[direction[m]]; }
  /// The target of the point on an edge of a cell at the corner; 6 where that is no member.
  std::size_t target_in(unsigned side, unsigned e) const {
    const unsigned corner = ~side & 7, axis = cell_edges[e].axis;
    if (cell_edges[e].corner != (corner & ~(1U << axis)))
      return 6;
    return target[member[2 * axis + ((side >> axis & 1) != 0 ? 0 : 1)]];
  }
  std::size_t first_partner(std::size_t p) const;
};

/// It is the first of p's faces, in their order, whose next corner is in the cluster.
std::size_t Cluster::first_partner(std::size_t p) const {
  for (std::size_t n = 0; n < chain[p].count; ++n) {
    const std::size_t m = chain[p].members[n];
    for (const PatchCell& cell : table.cells[begins][direction[m]]) {
      const CellCase& plan = marching_cubes_table()[cases[cell.side]];
      for (std::size_t t = 0; t < plan.count; ++t)
        for (std::size_t at = 0; at < 3; ++at) {
          const auto& triangle = plan.triangles[t];
          if (triangle[at] != cell.edge)
            continue;
          std::size_t a = target_in(cell.side, triangle[(at + 1) % 3]),
                      b = target_in(cell.side, triangle[(at + 2) % 3]);
          if (mirrored)
            std::swap(a, b);
          const bool is_gone = a == p || b == p || (a == b && a != 6);
          if (a != 6 && !is_gone)
            return a;
        }
    }
  }
  return 6;
}

/// The conditions (1) to (3) of merge_snap_clusters for the edge p q.
struct Snapping {
  PatchEdges low, high, own; // own: the cluster's members
};
bool always_collapses(const Cluster& c, const Snapping& snaps, std::size_t p, std::size_t q) {
  const PatchEdges common = c.near[p] & c.near[q];
  if (!are_two(common))
    return false;
  const auto others = [&](std::size_t m) {
    return targets(without(without(c.near[m], common), snaps.own), snaps.low, snaps.high);
  };
  if ((others(p) & others(q)) != 0) // other points have no label in common
    return false;
  const auto has_four = [&](const PatchEdges& near) {
    const PatchEdges drawn = without(near & (snaps.low | snaps.high), snaps.own);
    return count_edges(without(near, drawn)) + count_bits(targets(drawn, snaps.low, snaps.high)) >=
           4;
  };
  return has_four(c.near[p]) || has_four(c.near[q]);
}

/// Merges q into p.
void collapse(Cluster& c, std::size_t p, std::size_t q) {
  const PatchEdges both = c.edge(p) | c.edge(q);
  c.near[p] = without(c.near[p] | c.near[q], both);
  c.target[q] = static_cast<std::uint8_t>(p);
  c.chain[p].members[c.chain[p].count++] = static_cast<std::uint8_t>(q);
  for (std::size_t m = 0; m < c.count; ++m)
    if (any(c.near[m] & c.edge(q)))
      c.near[m] = without(c.near[m], c.edge(q)) | c.edge(p);
}

} // namespace

void SnapPatches::enter(std::size_t n, unsigned slices) {
  static constexpr CornerWords none{}, all{~0ULL, ~0ULL, ~0ULL, ~0ULL, ~0ULL, ~0ULL, ~0ULL, ~0ULL};
  const SurfaceBlock& block = lattice_.block(n);
  std::array<const SnapBlock*, 27> snaps;
  std::array<const CornerWords*, 27> corners;
  bool has_fins = !lattice_.fins().empty();
  std::array<const EdgeWords*, 27> fins{};
  for (unsigned place = 0; place < 27; ++place) {
    const std::uint32_t number =
        place == 13 ? static_cast<std::uint32_t>(n) : block.neighbours[place];
    if (number == SurfaceBlock::none) {
      // Uncrossed: all its corners are on the side of those that both have.
      const unsigned corner =
          (place / 9 == 2 ? 1U : 0U) | (place / 3 % 3 == 2 ? 2U : 0U) | (place % 3 == 2 ? 4U : 0U);
      snaps[place] = &SnapLattice::nothing;
      corners[place] = (block.outer >> corner & 1) != 0 ? &all : &none;
      fins[place] = &SnapLattice::nothing.low;
    } else {
      snaps[place] = &lattice_.snaps(number);
      corners[place] = &lattice_.block(number).inside;
      if (has_fins)
        fins[place] = &lattice_.fins_in(number);
    }
  }
  has_fins_ = has_fins;
  const unsigned wanted = slices | slices << 1 | slices << 2; // of the padded ones
  for (unsigned s = 0; s < padded; ++s) {
    if ((wanted >> s & 1) == 0)
      continue;
    const std::size_t first = s == 0 ? 0 : s < 9 ? 9 : 18, slice = (s + 7) % 8;
    const auto fill = [&](Rows& rows, auto&& word) {
      std::uint16_t* const out = rows.data() + padded * s;
      out[0] = gewebe::surface::row(word(first), word(first + 1), word(first + 2), 56);
      gewebe::surface::spread(out + 1, word(first + 3), word(first + 4), word(first + 5));
      out[9] = gewebe::surface::row(word(first + 6), word(first + 7), word(first + 8), 0);
    };
    fill(rows_[inside], [&](std::size_t place) { return (*corners[place])[slice]; });
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t w = 3 * slice + axis;
      fill(rows_[low + axis], [&](std::size_t place) { return snaps[place]->low[w]; });
      fill(rows_[high + axis], [&](std::size_t place) { return snaps[place]->high[w]; });
      if (has_fins)
        fill(rows_[fin + axis], [&](std::size_t place) { return (*fins[place])[w]; });
    }
  }
}

bool SnapPatches::is_single_sheet(unsigned slice, unsigned bit) const {
  // The corners of a patch with a next one along each axis.
  static constexpr std::array<PatchCorners, 3> starts{0x0fc7e3f, 0x003ffff, 0x36db6db};
  const PatchCorners corners = window(rows_[inside].data(), slice, bit >> 3, bit & 7);
  bool found = false;
  for (unsigned axis = 0; axis < 3; ++axis) {
    const PatchCorners next = corners >> stride[axis];
    const bool leads_out = (corners >> (centre - stride[axis]) & 1) != 0,
               leads_in = (next >> centre & 1) != 0;
    if (leads_out == leads_in && leads_in != ((corners >> centre & 1) != 0))
      return false;
    found = found || (leads_out != leads_in &&
                      ((leads_out ? ~corners & next : corners & ~next) & starts[axis]) == 0);
  }
  return found;
}

bool SnapPatches::take(unsigned slice, unsigned bit, PatchMerges& result) {
  const Tables& table = tables();
  const unsigned j = bit >> 3, k = bit & 7;
  Cluster c{table, lattice_.mirrored(),
            (slice == 0 ? 1U : 0U) | (j == 0 ? 2U : 0U) | (k == 0 ? 4U : 0U)};
  const PatchCorners sides = window(rows_[inside].data(), slice, j, k);
  Snapping snaps{
      edges_window(&rows_[low], slice, j, k), edges_window(&rows_[high], slice, j, k), {}};
  for (unsigned side = 0; side < 8; ++side) {
    const PatchCorners cell = sides >> cell_place(side);
    c.cases[side] = table.flat[cell & 31] | static_cast<unsigned>(table.flat[cell >> 9 & 31]) << 2;
  }
  for (const std::uint8_t d : table.directions[c.begins]) {
    c.member[d] = 6;
    if (!any(table.edge[d] & ((d & 1) != 0 ? snaps.high : snaps.low)))
      continue;
    const std::size_t m = c.count++;
    c.direction[m] = d;
    c.member[d] = static_cast<std::uint8_t>(m);
    c.chain[m] = {1, {static_cast<std::uint8_t>(m)}};
    for (const PatchCell& cell : table.cells[c.begins][d])
      c.near[m] =
          c.near[m] | moved(table.joined[c.cases[cell.side]][cell.edge], cell_place(cell.side));
    snaps.own = snaps.own | table.edge[d];
  }
  if (has_fins_) {
    const PatchEdges fins = edges_window(&rows_[fin], slice, j, k);
    for (std::size_t m = 0; m < c.count; ++m)
      if (any(c.near[m] & fins))
        return false;
  }
  result.count = 0;
  result.left = 0;
  result.vanished = {};
  for (std::size_t p = 0; p < c.count; ++p) {
    while (c.target[p] == p && any(c.near[p] & snaps.own)) {
      std::size_t q = 6, partners = 0;
      for (std::size_t m = 0; m < c.count; ++m)
        if (any(c.near[p] & c.edge(m))) {
          q = m;
          ++partners;
        }
      if (partners > 1)
        q = c.first_partner(p);
      if (q == 6 || !always_collapses(c, snaps, p, q))
        return false;
      collapse(c, p, q);
    }
    if (c.target[p] != p)
      continue;
    ++result.left;
    if (c.chain[p].count < 2)
      continue;
    PatchMerges::Group& group = result.groups[result.count++];
    group = c.chain[p];
    unsigned directions = 0;
    for (std::size_t n = 0; n < group.count; ++n) {
      group.members[n] = c.direction[group.members[n]];
      directions |= 1U << group.members[n];
    }
    for (unsigned side = 0; side < 8; ++side)
      result.vanished[side] = static_cast<std::uint8_t>(
          result.vanished[side] +
          table.vanished[c.cases[side]][~side & 7][table.axes[side][directions]]);
  }
  return true;
}

} // namespace gewebe::surface
