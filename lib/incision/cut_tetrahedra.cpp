#include "incision/cut_tetrahedra.h"

#include "base/error.h"
#include "incision/cut_blade_internal.h"
#include "incision/cut_middles_internal.h"
#include "incision/cut_region_internal.h"
#include "incision/cut_snap_internal.h"
#include "incision/cut_surface_internal.h"
#include "incision/cut_wall_internal.h"
#include "tetrahedra/faces.h"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <optional>
#include <string>
#include <utility>

namespace gewebe::incision {
namespace {

void check(const tetrahedra::TetMesh& mesh, const BladeCutOptions& options) {
  if (!options.places.empty() && options.places.size() != mesh.points.size())
    throw Error(std::to_string(options.places.size()) +
                " places, expected none or one for each of "
                "the " +
                std::to_string(mesh.points.size()) + " nodes");
  for (std::size_t n = 0; n < options.places.size(); ++n)
    if (!is_finite(options.places[n]))
      throw Error("the place of node " + std::to_string(n) + " is not finite");
  if (!options.among.empty() && options.among.size() != mesh.points.size())
    throw Error(std::to_string(options.among.size()) +
                " marks of nodes, expected none or one for "
                "each of the " +
                std::to_string(mesh.points.size()));
  if (!(options.snap >= 0 && options.snap <= 0.5))
    throw Error("a share of " + std::to_string(options.snap) +
                " of an edge to move nodes within, expected 0 to 0.5");
  if (!(options.least_angle >= 0 && options.least_angle < 60))
    throw Error("a least angle of " + std::to_string(options.least_angle) +
                " degrees, expected 0 to below 60");
  for (const std::uint32_t node : options.held)
    if (node >= mesh.points.size())
      throw Error("node " + std::to_string(node) + " is to be held, expected one below " +
                  std::to_string(mesh.points.size()));
}

/// Writes the parts of a region back into the mesh.
class Assembler {
public:
  Assembler(const tetrahedra::TetMesh& mesh, const CutRegion& region, const SnappedRegion& snapped,
            const PartedRegion& parted)
      : before_(mesh), region_(region), snapped_(snapped), parted_(parted) {
    cut_.mesh = mesh;
    cut_.origin.resize(mesh.points.size());
    for (std::uint32_t n = 0; n < cut_.origin.size(); ++n)
      cut_.origin[n].node = n;
    cut_.tetrahedron.resize(mesh.tetrahedra.size());
    for (std::uint32_t t = 0; t < cut_.tetrahedron.size(); ++t)
      cut_.tetrahedron[t] = t;
    cut_.report.tested = region.tested;
    cut_.report.folded = region.folded;
    cut_.report.moved = snapped.moved;
    cut_.report.kept = snapped.kept;
    cut_.report.largest_miss = snapped.largest_miss;
    cut_.report.rejoined = parted.rejoined;
    cut_.report.opened = parted.opened;
  }

  TetCut assemble() {
    move_nodes();
    add_crossings();
    add_copies();
    write_parts();
    write_wall();
    write_surface();
    if (!before_.middles.empty())
      add_middles(before_, original_, cut_);
    return std::move(cut_);
  }

private:
  std::uint32_t add_node(const Vec3& point, const TetNodeOrigin& origin) {
    if (cut_.mesh.points.size() >= UINT32_MAX - 1)
      throw Error("too many nodes after the cut, expected fewer than " +
                  std::to_string(UINT32_MAX));
    cut_.mesh.points.push_back(point);
    cut_.origin.push_back(origin);
    return static_cast<std::uint32_t>(cut_.mesh.points.size() - 1);
  }

  /// In a tetrahedron at a crossed edge, on that edge.
  TetNodeOrigin origin_on(std::uint32_t e) const {
    const CrossedEdge& edge = region_.edges[e];
    const RegionTet& tet = region_.tets[edge.tet];
    TetNodeOrigin origin{TetNodeOrigin::none, tet.number, {}};
    for (std::size_t k = 0; k < 4; ++k)
      origin.weights[k] = tet.corners[k] == edge.ends[0]   ? 1 - edge.share
                          : tet.corners[k] == edge.ends[1] ? edge.share
                                                           : 0;
    return origin;
  }

  void move_nodes() {
    number_ = region_.nodes;
    for (std::size_t n = 0; n < region_.nodes.size(); ++n)
      if (snapped_.along[n] != no_crossing) {
        cut_.mesh.points[number_[n]] = snapped_.points[n];
        cut_.origin[number_[n]] = origin_on(snapped_.along[n]);
      }
  }

  void add_crossings() {
    for (std::uint32_t e = 0; e < region_.edges.size(); ++e) {
      const CrossedEdge& edge = region_.edges[e];
      if (snapped_.on[edge.ends[0]] || snapped_.on[edge.ends[1]]) {
        number_.push_back(UINT32_MAX); // given up
        continue;
      }
      if (before_.middles.empty()) {
        number_.push_back(add_node(edge.point, origin_on(e)));
        continue;
      }
      number_.push_back(before_.middles[region_.tets[edge.tet].number][edge.edge]);
      cut_.mesh.points[number_.back()] = edge.point;
      cut_.origin[number_.back()] = origin_on(e);
    }
  }

  /// The largest piece keeps the number, the others get new ones in their order.
  void add_copies() {
    original_.resize(cut_.mesh.points.size());
    std::iota(original_.begin(), original_.end(), 0U);
    for (const PartedRegion::Piece& node : parted_.nodes) {
      first_copy_.push_back(static_cast<std::uint32_t>(cut_.mesh.points.size()));
      const std::uint32_t number = number_[node.node];
      for (std::uint32_t copy = 1; copy < node.pieces; ++copy) {
        const Vec3 point = cut_.mesh.points[number];
        const TetNodeOrigin origin = cut_.origin[number];
        add_node(point, origin);
        original_.push_back(number);
        ++cut_.report.doubled;
      }
    }
  }

  std::uint32_t node_at(const TetPart& part, std::size_t corner) const {
    const std::uint32_t local = part.corners[corner];
    const auto at = std::ranges::lower_bound(parted_.nodes, local, {}, &PartedRegion::Piece::node);
    if (at == parted_.nodes.end() || at->node != local || part.piece[corner] == at->largest)
      return number_[local];
    const std::uint32_t before =
        part.piece[corner] < at->largest ? part.piece[corner] : part.piece[corner] - 1;
    return first_copy_[static_cast<std::size_t>(at - parted_.nodes.begin())] + before;
  }

  void write_parts() {
    for (std::size_t p = 0; p < parted_.parts.size(); ++p) {
      const TetPart& part = parted_.parts[p];
      const RegionTet& tet = region_.tets[part.parent];
      const bool first = p == 0 || parted_.parts[p - 1].parent != part.parent;
      Tetrahedron corners{};
      bool changed = false;
      for (std::size_t k = 0; k < 4; ++k) {
        corners[k] = node_at(part, k);
        const std::uint32_t local = part.corners[k];
        changed = changed || corners[k] != cut_.mesh.tetrahedra[tet.number][k] ||
                  (local < snapped_.along.size() && snapped_.along[local] != no_crossing);
      }
      if (first) {
        number_of_part_.push_back(tet.number);
        cut_.report.separated += tet.separated() ? 1 : 0;
        if (changed)
          cut_.changed.push_back(tet.number);
        cut_.mesh.tetrahedra[tet.number] = corners;
        continue;
      }
      if (cut_.mesh.tetrahedra.size() >= UINT32_MAX / 4)
        throw Error("too many tetrahedra after the cut");
      cut_.report.split += number_of_part_.back() == tet.number ? 1 : 0;
      number_of_part_.push_back(static_cast<std::uint32_t>(cut_.mesh.tetrahedra.size()));
      cut_.mesh.tetrahedra.push_back(corners);
      cut_.tetrahedron.push_back(tet.number);
      if (!cut_.mesh.material.empty())
        cut_.mesh.material.push_back(cut_.mesh.material[tet.number]);
      if (!before_.middles.empty())
        cut_.mesh.middles.emplace_back();
    }
  }

  void write_wall() {
    for (std::uint32_t p = 0; p < parted_.parts.size(); ++p)
      for (std::uint32_t k = 0; k < 4; ++k) {
        const TetPart& part = parted_.parts[p];
        if (!part.wall[k] || part.neighbour[k] / 4 < p)
          continue;
        const TetPart& beyond = parted_.parts[part.neighbour[k] / 4];
        WallTriangle wall;
        // Turned so that corner c here is 2 - c there.
        for (std::size_t c = 0; c < 3; ++c) {
          const std::size_t here = tetrahedra::tetrahedron_faces[k][c];
          wall.corners[0][c] = node_at(part, here);
          const auto there = std::ranges::find(beyond.corners, part.corners[here]);
          wall.corners[1][2 - c] =
              node_at(beyond, static_cast<std::size_t>(there - beyond.corners.begin()));
        }
        wall.tetrahedron = {number_of_part_[p], number_of_part_[part.neighbour[k] / 4]};
        if (!is_above(part, beyond)) {
          std::swap(wall.corners[0], wall.corners[1]);
          std::swap(wall.tetrahedron[0], wall.tetrahedron[1]);
        }
        cut_.wall.push_back(wall);
      }
  }

  /// Faces none of whose nodes has all its tetrahedra in the region can have neighbours outside of
  /// the region; they stay as they were.
  void write_surface() {
    const std::vector<std::uint8_t>& whole = region_.whole;
    const auto is_known = [&](std::uint32_t node) {
      return node >= whole.size() || whole[node] != 0;
    };
    for (std::uint32_t p = 0; p < parted_.parts.size(); ++p)
      for (std::uint32_t k = 0; k < 4; ++k) {
        const TetPart& part = parted_.parts[p];
        const Triangle face = tetrahedra::corners_of_face(part.corners, k);
        if (part.neighbour[k] == no_neighbour && std::ranges::any_of(face, is_known))
          cut_.surface.push_back(surface_face(part, k, number_of_part_[p]));
      }
  }

  CutFace surface_face(const TetPart& part, std::uint32_t k, std::uint32_t tetrahedron) const {
    const RegionTet& tet = region_.tets[part.parent];
    std::array<TetSupport, 3> supports;
    CutFace face;
    face.tetrahedron = tetrahedron;
    for (std::size_t c = 0; c < 3; ++c) {
      const std::size_t corner = tetrahedra::tetrahedron_faces[k][c];
      face.corners[c] = node_at(part, corner);
      supports[c] = support_of(part.corners[corner], tet);
    }
    const std::uint32_t before = face_of(supports);
    face.face_before = 4 * tet.number + before;
    const Triangle corners = tetrahedra::corners_of_face(before_.tetrahedra[tet.number], before);
    for (std::size_t c = 0; c < 3; ++c)
      face.weights[c] = weights_in_face(
          {before_.points[corners[0]], before_.points[corners[1]], before_.points[corners[2]]},
          cut_.mesh.points[face.corners[c]]);
    return face;
  }

  /// The corners of a tetrahedron of the region between which a node of a part of it stands.
  TetSupport support_of(std::uint32_t node, const RegionTet& tet) const {
    TetSupport support{};
    const std::size_t nodes = region_.nodes.size();
    for (std::size_t k = 0; k < 4; ++k)
      support[k] = node < nodes
                       ? tet.corners[k] == node
                       : std::ranges::count(region_.edges[node - nodes].ends, tet.corners[k]) > 0;
    return support;
  }

  /// At least one of both has a side.
  static bool is_above(const TetPart& part, const TetPart& beyond) {
    return part.side != 0 ? part.side > 0 : beyond.side < 0;
  }

  const tetrahedra::TetMesh& before_;
  const CutRegion& region_;
  const SnappedRegion& snapped_;
  const PartedRegion& parted_;
  std::vector<std::uint32_t> number_;         // of local nodes and crossings, in the cut mesh
  std::vector<std::uint32_t> original_;       // of each corner: the node that it is, or a copy of
  std::vector<std::uint32_t> first_copy_;     // of parted_.nodes
  std::vector<std::uint32_t> number_of_part_; // in the cut mesh
  TetCut cut_;
};

/// Cuts near the blade; empty if a wider neighbourhood of the blade is needed.
std::optional<TetCut> cut_near(const tetrahedra::TetMesh& mesh, const Blade& blade,
                               const BladeCutOptions& options, bool wide) {
  const CutRegion region = cut_region(mesh, options, blade, wide);
  if (!mesh.middles.empty())
    check_straight(mesh, region);
  const SnappedRegion snapped = snap_region(mesh, region, options);
  const PartedRegion parted = part_region(region, snapped);
  if (parted.needs_more && !wide)
    return std::nullopt;
  return Assembler(mesh, region, snapped, parted).assemble();
}

} // namespace

TetCut cut_tetrahedra(const tetrahedra::TetMesh& mesh, const TriangleMesh& blade,
                      const BladeCutOptions& options) {
  check(mesh, options);
  const Blade swept(blade);
  std::optional<TetCut> cut = cut_near(mesh, swept, options, false);
  // Seldom: faces beside the blade are to be opened whose neighbours are not known.
  return cut ? std::move(*cut) : std::move(*cut_near(mesh, swept, options, true));
}

} // namespace gewebe::incision
