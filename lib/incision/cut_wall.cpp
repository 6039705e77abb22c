#include "incision/cut_wall_internal.h"

#include "incision/cut_link_internal.h"
#include "tetrahedra/faces.h"

#include <algorithm>
#include <compare>
#include <cstddef>
#include <span>
#include <utility>

namespace gewebe::incision {
namespace {

struct PartFace {
  Triangle corners{}; // ascending
  std::uint32_t number = 0;

  auto operator<=>(const PartFace&) const = default;
};

/// A corner of a part at a node of the wall.
struct Use {
  std::uint32_t node = 0, corner = 0; // 4 part + k

  auto operator<=>(const Use&) const = default;
};

class Parter {
public:
  Parter(const CutRegion& region, const SnappedRegion& snapped)
      : region_(region), snapped_(snapped) {}

  PartedRegion part() {
    make_parts();
    find_neighbours();
    find_wall();
    fall_apart();
    return std::move(result_);
  }

private:
  bool on_blade(std::uint32_t node) const {
    return node >= snapped_.on.size() || snapped_.on[node];
  }
  const Vec3& place(std::uint32_t node) const {
    const std::size_t nodes = snapped_.points.size();
    return node < nodes ? snapped_.points[node] : region_.edges[node - nodes].point;
  }
  const RegionTet& parent_of(const TetPart& part) const { return region_.tets[part.parent]; }

  void make_parts() {
    for (std::uint32_t r = 0; r < region_.tets.size(); ++r) {
      const RegionTet& tet = region_.tets[r];
      const std::vector<EdgeNode> nodes = edge_nodes(region_, snapped_.on, tet);
      split_tetrahedron(tet.corners, nodes, [&](const Tetrahedron& corners) {
        TetPart part{corners, r, side_of(tet, corners), {}, {}, {}};
        part.neighbour.fill(no_neighbour);
        result_.parts.push_back(part);
      });
    }
  }

  /// That of its corners off the blade, which are all on one side; of one that lies in the blade
  /// with all its corners, the side where most of them were.
  std::int8_t side_of(const RegionTet& tet, const Tetrahedron& corners) const {
    if (!tet.separated())
      return 0;
    int sum = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      sum += tet.side[k];
      if (!on_blade(tet.corners[k]) && std::ranges::find(corners, tet.corners[k]) != corners.end())
        return tet.side[k];
    }
    return sum >= 0 ? 1 : -1;
  }

  void find_neighbours() {
    std::vector<PartFace> faces;
    faces.reserve(4 * result_.parts.size());
    for (std::uint32_t p = 0; p < result_.parts.size(); ++p)
      for (std::uint32_t k = 0; k < 4; ++k) {
        Triangle corners = tetrahedra::corners_of_face(result_.parts[p].corners, k);
        std::ranges::sort(corners);
        faces.push_back({corners, 4 * p + k});
      }
    std::ranges::sort(faces);
    for (std::size_t n = 1; n < faces.size(); ++n)
      if (faces[n].corners == faces[n - 1].corners) {
        const std::uint32_t a = faces[n - 1].number, b = faces[n].number;
        result_.parts[a / 4].neighbour[a % 4] = b;
        result_.parts[b / 4].neighbour[b % 4] = a;
      }
  }

  /// On which side of the blade a part lies at a face all of whose corners are on it. A tetrahedron
  /// that the blade does not touch lies where the other one says that the face did.
  std::int8_t side_at(const TetPart& part, const TetPart& other, const Triangle& face) const {
    if (part.side != 0 || parent_of(part).touched || !parent_of(other).separated())
      return part.side;
    const RegionTet& tet = parent_of(other);
    for (std::size_t k = 0; k < 4; ++k)
      if (std::ranges::find(face, tet.corners[k]) != face.end())
        return tet.side[k];
    return 0;
  }

  void find_wall() {
    for (std::uint32_t p = 0; p < result_.parts.size(); ++p)
      for (std::uint32_t k = 0; k < 4; ++k) {
        TetPart& part = result_.parts[p];
        const std::uint32_t other = part.neighbour[k];
        if (other == no_neighbour || other / 4 < p)
          continue;
        const Triangle face = tetrahedra::corners_of_face(part.corners, k);
        if (!std::ranges::all_of(face, [&](std::uint32_t node) { return on_blade(node); }))
          continue;
        TetPart& beyond = result_.parts[other / 4];
        if (side_at(part, beyond, face) * side_at(beyond, part, face) < 0)
          part.wall[k] = beyond.wall[other % 4] = true;
      }
    join_crumbs();
  }

  /// One with all corners on the blade was said to be on one side, and all around it is on the
  /// other.
  void join_crumbs() {
    for (std::uint32_t p = 0; p < result_.parts.size(); ++p) {
      const TetPart& part = result_.parts[p];
      bool alone = std::ranges::all_of(part.corners, [&](std::uint32_t c) { return on_blade(c); });
      for (std::uint32_t k = 0; k < 4; ++k)
        alone = alone && (part.wall[k] || part.neighbour[k] == no_neighbour);
      for (std::uint32_t k = 0; alone && k < 4; ++k)
        if (part.wall[k])
          rejoin(4 * p + k);
    }
  }

  // ---- Pieces

  /// Opening comes first, for so the wounds meet; joining again always ends.
  void fall_apart() {
    constexpr int rounds_of_opening = 8;
    for (int round = 0;; ++round) {
      gather_uses();
      find_pieces();
      rejoin_whole_faces();
      if (!mend_pinches(round < rounds_of_opening))
        break;
    }
    // A node that lost its last face of the wall is in one piece.
    std::erase_if(result_.nodes, [](const PartedRegion::Piece& n) { return n.pieces == 1; });
  }

  void gather_uses() {
    uses_.clear();
    result_.nodes.clear();
    std::vector<std::uint32_t> nodes;
    for (TetPart& part : result_.parts) {
      part.piece.fill(0);
      for (std::uint32_t k = 0; k < 4; ++k)
        if (part.wall[k]) {
          const Triangle face = tetrahedra::corners_of_face(part.corners, k);
          nodes.insert(nodes.end(), face.begin(), face.end());
        }
    }
    std::ranges::sort(nodes);
    const auto repeated = std::ranges::unique(nodes);
    nodes.erase(repeated.begin(), repeated.end());
    for (std::uint32_t p = 0; p < result_.parts.size(); ++p)
      for (std::uint32_t k = 0; k < 4; ++k)
        if (std::ranges::binary_search(nodes, result_.parts[p].corners[k]))
          uses_.push_back({result_.parts[p].corners[k], 4 * p + k});
    std::ranges::sort(uses_);
    for (const std::uint32_t node : nodes)
      result_.nodes.push_back({node, 1, 0});
  }

  /// Calls visit(n, corners at it) for each node of the wall.
  template <class Visit>
  void for_each_node(Visit&& visit) {
    std::size_t begin = 0;
    for (std::size_t n = 0; n < result_.nodes.size(); ++n) {
      std::size_t end = begin;
      while (end < uses_.size() && uses_[end].node == result_.nodes[n].node)
        ++end;
      visit(n, std::span<const Use>(uses_).subspan(begin, end - begin));
      begin = end;
    }
  }

  std::uint32_t& piece(std::uint32_t corner) { return result_.parts[corner / 4].piece[corner % 4]; }
  /// The corner of a part at a node.
  std::uint32_t corner_at(std::uint32_t part, std::uint32_t node) const {
    const Tetrahedron& corners = result_.parts[part].corners;
    return 4 * part +
           static_cast<std::uint32_t>(std::ranges::find(corners, node) - corners.begin());
  }

  void find_pieces() {
    constexpr std::uint32_t none = UINT32_MAX;
    std::vector<std::uint32_t> open;
    for_each_node([&](std::size_t n, std::span<const Use> uses) {
      for (const Use& use : uses)
        piece(use.corner) = none;
      PartedRegion::Piece& node = result_.nodes[n];
      node.pieces = 0;
      double most = 0;
      for (const Use& use : uses) {
        if (piece(use.corner) != none)
          continue;
        double volume = 0;
        piece(use.corner) = node.pieces;
        open.push_back(use.corner);
        while (!open.empty()) {
          const std::uint32_t corner = open.back();
          open.pop_back();
          const TetPart& part = result_.parts[corner / 4];
          volume += volume_of(part.corners);
          for (std::uint32_t k = 0; k < 4; ++k) {
            if (k == corner % 4 || part.wall[k] || part.neighbour[k] == no_neighbour)
              continue;
            const std::uint32_t next = corner_at(part.neighbour[k] / 4, use.node);
            if (piece(next) == none) {
              piece(next) = node.pieces;
              open.push_back(next);
            }
          }
        }
        if (node.pieces == 0 || volume > most) {
          most = volume;
          node.largest = node.pieces;
        }
        ++node.pieces;
      }
    });
  }

  double volume_of(const Tetrahedron& t) const {
    return tetrahedra::tetrahedron_volume(place(t[0]), place(t[1]), place(t[2]), place(t[3]));
  }

  /// A face of the wall with the same nodes on both sides is none.
  void rejoin_whole_faces() {
    for (std::uint32_t p = 0; p < result_.parts.size(); ++p)
      for (std::uint32_t k = 0; k < 4; ++k) {
        TetPart& part = result_.parts[p];
        if (!part.wall[k])
          continue;
        const std::uint32_t other = part.neighbour[k];
        bool same = true;
        for (std::uint32_t c = 0; c < 4; ++c)
          same = same && (c == k || part.piece[c] == piece(corner_at(other / 4, part.corners[c])));
        if (same)
          rejoin(4 * p + k);
      }
  }

  void rejoin(std::uint32_t number) {
    const std::uint32_t other = result_.parts[number / 4].neighbour[number % 4];
    result_.parts[number / 4].wall[number % 4] = false;
    result_.parts[other / 4].wall[other % 4] = false;
  }

  void open(std::uint32_t number) {
    const std::uint32_t other = result_.parts[number / 4].neighbour[number % 4];
    result_.parts[number / 4].wall[number % 4] = true;
    result_.parts[other / 4].wall[other % 4] = true;
  }

  /// Where the link of a piece is neither a disc nor a sphere, the piece hangs together at its node
  /// alone, or at another edge. Where the front of an earlier wound touches the wall at the node,
  /// so that there are two loops, faces between them are opened; else faces of the wall are joined
  /// again. True if there were any.
  bool mend_pinches(bool may_open) {
    std::vector<std::uint32_t> faces, ways;
    for_each_node([&](std::size_t n, std::span<const Use> uses) {
      for (std::uint32_t number = 0; number < result_.nodes[n].pieces; ++number) {
        const NodeLink link = link_of(uses, number);
        if (link.euler_number() >= 1)
          continue;
        constexpr std::size_t farthest = 4;
        const std::vector<std::uint32_t> way =
            may_open ? link.ways_across(farthest) : std::vector<std::uint32_t>();
        if (!way.empty() &&
            std::ranges::all_of(way, [&](std::uint32_t f) { return is_known(f); })) {
          ways.insert(ways.end(), way.begin(), way.end());
          continue;
        }
        result_.needs_more = result_.needs_more || !way.empty();
        for (const Use& use : uses)
          for (std::uint32_t k = 0; k < 4; ++k)
            if (piece(use.corner) == number && k != use.corner % 4 &&
                result_.parts[use.corner / 4].wall[k])
              faces.push_back(4 * (use.corner / 4) + k);
      }
    });
    for (const std::uint32_t face : ways)
      if (!result_.parts[face / 4].wall[face % 4]) {
        open(face);
        ++result_.opened;
      }
    if (!ways.empty())
      return true;
    for (const std::uint32_t face : faces)
      if (result_.parts[face / 4].wall[face % 4]) {
        rejoin(face);
        ++result_.rejoined;
      }
    return !faces.empty();
  }

  /// Are all tetrahedra at the corners of a face in the region?
  bool is_known(std::uint32_t number) const {
    return std::ranges::all_of(
        tetrahedra::corners_of_face(result_.parts[number / 4].corners, number % 4),
        [&](std::uint32_t node) {
          return node >= region_.whole.size() || region_.whole[node] != 0;
        });
  }

  NodeLink link_of(std::span<const Use> uses, std::uint32_t number) {
    NodeLink link;
    for (const Use& use : uses) {
      if (piece(use.corner) != number)
        continue;
      const std::uint32_t p = use.corner / 4;
      const TetPart& part = result_.parts[p];
      std::array<NodeLink::Face, 3> faces;
      std::size_t count = 0;
      for (std::uint32_t k = 0; k < 4; ++k) {
        if (k == use.corner % 4)
          continue;
        NodeLink::Face& face = faces[count++];
        std::size_t end = 0;
        for (std::uint32_t c = 0; c < 4; ++c)
          if (c != k && c != use.corner % 4)
            face.ends[end++] = {part.corners[c], part.piece[c]};
        face.number = 4 * p + k;
        face.old = part.neighbour[k] == no_neighbour;
        face.open = face.old || part.wall[k];
      }
      link.add(faces);
    }
    return link;
  }

  const CutRegion& region_;
  const SnappedRegion& snapped_;
  std::vector<Use> uses_; // at nodes of the wall
  PartedRegion result_;
};

} // namespace

PartedRegion part_region(const CutRegion& region, const SnappedRegion& snapped) {
  return Parter(region, snapped).part();
}

} // namespace gewebe::incision
