#include "surface/snap_collapse_internal.h"

#include "base/error.h"
#include "base/huge_pages.h"
#include "base/parallel.h"
#include "surface/snap_patch_internal.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <numeric>
#include <span>

// Based on: Dey, Edelsbrunner, Guha and Nekhayev, Topology Preserving Edge Contraction, 1999.

namespace gewebe::surface {
namespace {

constexpr std::size_t blocks_at_once = 64;

/// A cluster by its corner.
struct Cluster {
  std::uint32_t block = 0, first_member = 0;
  Int3 corner{}; // relative to the block
};

/// What all clusters share.
struct Scene {
  SnapLattice& lattice;
  SnapOptions::Place place;
  SnapMerges& merges;
  IndexMap in_order; // absolute corners of clusters that are taken in order
};

void mark(std::uint64_t& word, unsigned bit) {
  std::atomic_ref(word).fetch_or(std::uint64_t{1} << bit, std::memory_order_relaxed);
}

void mark_crowded(SnapLattice& lattice, const LatticeSpot& at, unsigned axis) {
  mark(lattice.snaps(at.block).crowded[at.word(axis)], at.bit);
}

void drop_faces(SnapMerges& merges, std::uint32_t block, unsigned count) {
  std::atomic_ref(merges.dropped[block]).fetch_add(count, std::memory_order_relaxed);
}

/// A point of a cluster.
struct Member {
  std::uint32_t point = 0;
  LatticeEdge edge; // relative to the cluster's block
  LatticeSpot at;   // of its start
  bool is_fin = false;
};

/// The same as index_position, where it can be inlined.
inline Vec3 position_of(const SnapLattice& lattice, const Int3& origin, const Member& member) {
  const double along = lattice.fraction(member.point);
  const auto part = [&](unsigned axis) {
    return static_cast<double>(origin[axis] + member.edge.start[axis]) +
           (member.edge.axis == axis ? along : 0);
  };
  return {part(0), part(1), part(2)};
}

/// Notes that all but the first of some members were merged into it; they are summed in the order
/// of their points.
void store_group(const Scene& scene, std::size_t n, const Int3& corner, std::span<Member> group,
                 std::vector<SnapMerges::Place>& places) {
  std::sort(group.begin() + 1, group.end(),
            [](const Member& a, const Member& b) { return a.point < b.point; });
  const SnapLattice& lattice = scene.lattice;
  const Int3& origin = lattice.block(n).origin;
  const Vec3 own = position_of(lattice, origin, group[0]);
  bool only_fins = true;
  Vec3 sum;
  double weights = 0;
  for (const Member& member : group) {
    only_fins = only_fins && member.is_fin;
    const double along = lattice.fraction(member.point),
                 weight = 1 - 1.5 * std::min(along, 1 - along);
    sum += (position_of(lattice, origin, member) - own) * weight;
    weights += weight;
    SnapBlock& block = scene.lattice.snaps(member.at.block);
    const std::size_t w = member.at.word(member.edge.axis);
    if (&member == &group[0]) {
      mark(block.looked_at[w], member.at.bit);
    } else {
      mark(block.merged[w], member.at.bit);
      scene.merges.target[member.point] = group[0].point;
    }
  }
  Vec3 position = own + sum / weights;
  if (scene.place == SnapOptions::Place::corner && !only_fins)
    position = {static_cast<double>(origin[0] + corner[0]),
                static_cast<double>(origin[1] + corner[1]),
                static_cast<double>(origin[2] + corner[2])};
  places.push_back({group[0].point, position});
}

/// The clusters of a block that bits can tell of.
class BitCollapse {
public:
  explicit BitCollapse(const Scene& scene) : scene_(scene), patches_(scene.lattice) {}
  void enter(std::size_t n, unsigned slices) {
    block_ = n;
    patches_.enter(n, slices);
    dropped_ = {};
  }
  bool take(unsigned slice, unsigned bit, std::vector<SnapMerges::Place>& places);
  /// Marks the points that move to a corner where the surface isn't a single sheet.
  void mark_moved(unsigned slice, unsigned bit) const {
    if (patches_.is_single_sheet(slice, bit))
      return;
    const Int3 corner{static_cast<int>(slice), static_cast<int>(bit >> 3),
                      static_cast<int>(bit & 7)};
    scene_.lattice.for_members(block_, corner, [&](const LatticeEdge& edge) {
      mark_crowded(scene_.lattice, scene_.lattice.spot(block_, edge.start), edge.axis);
    });
  }
  void leave() {
    for (unsigned back = 0; back < 8; ++back)
      if (dropped_[back] != 0)
        drop_faces(scene_.merges,
                   scene_.lattice.spot(block_, shifted({0, 0, 0}, back, -volume::leaf_dim)).block,
                   dropped_[back]);
  }

private:
  const Scene& scene_;
  SnapPatches patches_;
  PatchMerges found_;
  std::size_t block_ = 0;
  std::array<std::uint32_t, 8> dropped_{}; // faces of the block and of those before it
};

bool BitCollapse::take(unsigned slice, unsigned bit, std::vector<SnapMerges::Place>& places) {
  if (!patches_.take(slice, bit, found_))
    return false;
  const Int3 corner{static_cast<int>(slice), static_cast<int>(bit >> 3), static_cast<int>(bit & 7)};
  std::array<Member, 6> group;
  for (std::size_t g = 0; g < found_.count; ++g) {
    for (std::size_t m = 0; m < found_.groups[g].count; ++m) {
      const unsigned direction = found_.groups[g].members[m];
      Member& member = group[m];
      member.edge = {corner, direction / 2};
      member.edge.start[direction / 2] -= static_cast<int>(direction & 1);
      member.at = scene_.lattice.spot(block_, member.edge.start);
      member.point = scene_.lattice.point_on(member.at, direction / 2);
    }
    store_group(scene_, block_, corner, {group.data(), found_.groups[g].count}, places);
  }
  if (found_.left > 1)
    scene_.lattice.for_members(block_, corner, [&](const LatticeEdge& edge) {
      mark_crowded(scene_.lattice, scene_.lattice.spot(block_, edge.start), edge.axis);
    });
  const unsigned begins =
      (slice == 0 ? 1U : 0U) | (bit >> 3 == 0 ? 2U : 0U) | ((bit & 7) == 0 ? 4U : 0U);
  for (unsigned side = 0; side < 8; ++side)
    dropped_[~side & begins] += found_.vanished[side];
  return true;
}

/// One cluster and the faces around it. Its members are numbered from 0 on.
class Collapse {
public:
  /// Takes a cluster. Where it needs no order, another one may be taken at the same time; answers
  /// whether it was so, else nothing has changed.
  bool in_parallel(const Scene& scene, const Cluster& cluster,
                   std::vector<SnapMerges::Place>& places) {
    return take(scene, cluster, false, places);
  }
  /// \pre of the clusters that are taken in order, those before it have been, none after it
  void in_order(const Scene& scene, const Cluster& cluster,
                std::vector<SnapMerges::Place>& places) {
    (void)take(scene, cluster, true, places);
  }
  std::uint64_t refused() const { return refused_; }

private:
  static constexpr int outside = -1;
  struct Face { // of a member: the corners that follow it
    std::uint32_t block, a, b;
    int member_a, member_b; // or outside
    std::uint64_t label_a;
  };
  struct Neighbour {
    std::uint32_t point;
    std::uint64_t label;
  };
  enum class Answer { yes, no, depends };

  bool take(const Scene& scene, const Cluster& cluster, bool careful,
            std::vector<SnapMerges::Place>& places);
  void gather(const Scene& scene, const Cluster& cluster, bool careful);
  bool collapse_all(bool careful);
  void find_neighbours(int p, std::vector<Neighbour>& neighbours) const;
  Answer can_collapse(int p, int q, bool careful);
  void collapse(int p, int q);
  void store(const Scene& scene, const Cluster& cluster, std::vector<SnapMerges::Place>& places);

  int target(int member) const {
    return member == outside ? outside : target_[static_cast<std::size_t>(member)];
  }
  bool is_gone(const Face& face, int p) const {
    const int a = target(face.member_a), b = target(face.member_b);
    return a == p || b == p || (a != outside && a == b);
  }
  std::span<const Face> star(int member) const {
    const auto m = static_cast<std::size_t>(member);
    return {faces_.data() + begin_[m], faces_.data() + begin_[m + 1]};
  }
  /// Calls visit(face) for the faces that p has now until it answers false.
  template <class Visit>
  void for_faces(int p, Visit&& visit) const {
    for (int member = p; member != outside; member = next_[static_cast<std::size_t>(member)])
      for (const Face& face : star(member))
        if (!is_gone(face, p) && !visit(face))
          return;
  }

  std::vector<Member> members_, group_;
  std::vector<StarFace> star_;
  std::vector<Face> faces_;
  std::vector<std::size_t> begin_; // of each member's faces
  std::vector<int> target_, next_, last_;
  std::vector<Neighbour> of_p_, of_q_;
  std::vector<std::uint64_t> labels_;
  std::uint64_t refused_ = 0;
};

bool Collapse::take(const Scene& scene, const Cluster& cluster, bool careful,
                    std::vector<SnapMerges::Place>& places) {
  gather(scene, cluster, careful);
  refused_ = 0;
  if (!collapse_all(careful))
    return false;
  store(scene, cluster, places);
  return true;
}

/// What stands for a corner near block n; no number of a point does.
std::uint64_t label_of(const Int3& corner) {
  std::uint64_t label = 1;
  for (const std::int32_t c : corner)
    label = label << 8 | static_cast<std::uint8_t>(c);
  return label << 32;
}

void Collapse::gather(const Scene& scene, const Cluster& cluster, bool careful) {
  const SnapLattice& lattice = scene.lattice;
  const std::size_t n = cluster.block;
  members_.clear();
  lattice.for_members(n, cluster.corner, [&](const LatticeEdge& edge) {
    const LatticeSpot at = lattice.spot(n, edge.start);
    members_.push_back({lattice.point_on(at, edge.axis), edge, at, false});
  });
  for (const SnapFin& f : lattice.fins_at(lattice.absolute(n, cluster.corner))) {
    const LatticeEdge edge{lattice.from_origin(n, f.start), f.axis};
    members_.push_back({f.point, edge, lattice.spot(n, edge.start), true});
  }
  std::ranges::sort(members_, {}, &Member::point);
  struct Corner {
    std::uint32_t point;
    int member;
    std::uint64_t label;
  };
  const auto look_up = [&](const LatticeEdge& edge) -> Corner {
    const LatticeSpot at = lattice.spot(n, edge.start);
    const std::uint32_t p = lattice.point_on(at, edge.axis);
    Int3 corner;
    if (lattice.is_fin(n, edge))
      corner = lattice.from_origin(n, lattice.fin_of(p).corner);
    else if (!lattice.snap_corner(n, edge, corner))
      return {p, outside, p};
    if (corner == cluster.corner)
      return {p,
              static_cast<int>(std::ranges::lower_bound(members_, p, {}, &Member::point) -
                               members_.begin()),
              p};
    const std::uint64_t label = label_of(corner);
    if (!careful || (lattice.snaps(at.block).merged.at(at.word(edge.axis)) >> at.bit & 1) == 0 ||
        // A later cluster may be done already.
        (scene.in_order.find(lattice.absolute(n, corner)) == IndexMap::none &&
         lattice.first_member(n, corner) > cluster.first_member))
      return {p, outside, label};
    return {scene.merges.target[p], outside, label};
  };
  faces_.clear();
  begin_.clear();
  for (const Member& member : members_) {
    begin_.push_back(faces_.size());
    star_.clear();
    lattice.append_star(n, member.edge, star_);
    for (const StarFace& face : star_) {
      const Corner a = look_up(face.a), b = look_up(face.b);
      if (a.member != outside || b.member != outside || a.point != b.point)
        faces_.push_back({face.block, a.point, b.point, a.member, b.member, a.label});
    }
  }
  begin_.push_back(faces_.size());
  target_.resize(members_.size());
  last_.resize(members_.size());
  std::iota(target_.begin(), target_.end(), 0);
  std::iota(last_.begin(), last_.end(), 0);
  next_.assign(members_.size(), outside);
}

/// Collapses what can be collapsed; answers false if that might depend on other clusters.
bool Collapse::collapse_all(bool careful) {
  std::size_t alive = members_.size();
  for (bool changed = alive > 1; changed;) {
    changed = false;
    refused_ = 0;
    for (int p = 0; p < static_cast<int>(members_.size()); ++p) {
      for (bool again = target(p) == p; again;) {
        again = false;
        int partner = outside;
        bool depends = false;
        std::uint64_t kept = 0;
        for_faces(p, [&](const Face& face) {
          const int q = target(face.member_a);
          if (q == outside)
            return true;
          ++kept;
          const Answer answer = can_collapse(p, q, careful);
          depends = answer == Answer::depends;
          if (answer == Answer::yes)
            partner = q;
          return answer == Answer::no;
        });
        if (depends)
          return false;
        if (partner != outside) {
          collapse(p, partner);
          if (--alive == 1) {
            refused_ = 0;
            return true;
          }
          changed = again = true;
        } else {
          refused_ += kept;
        }
      }
    }
  }
  refused_ /= 2; // seen from both ends
  return true;
}

void Collapse::find_neighbours(int p, std::vector<Neighbour>& neighbours) const {
  neighbours.clear();
  for_faces(p, [&](const Face& face) {
    const int member = target(face.member_a);
    if (member == outside) {
      neighbours.push_back({face.a, face.label_a});
    } else {
      const std::uint32_t point = members_[static_cast<std::size_t>(member)].point;
      neighbours.push_back({point, point});
    }
    return true;
  });
}

/// Link condition for the edge p q of a closed 2-manifold.
Collapse::Answer Collapse::can_collapse(int p, int q, bool careful) {
  find_neighbours(p, of_p_);
  find_neighbours(q, of_q_);
  const auto has = [](const std::vector<Neighbour>& neighbours, std::uint32_t point) {
    return std::ranges::any_of(neighbours, [&](const Neighbour& n) { return n.point == point; });
  };
  const auto common =
      std::ranges::count_if(of_q_, [&](const Neighbour& n) { return has(of_p_, n.point); });
  if (careful)
    return common == 2 && !(of_p_.size() == 3 && of_q_.size() == 3) ? Answer::yes : Answer::no;
  if (common != 2)
    return Answer::depends;
  for (const Neighbour& u : of_p_)
    for (const Neighbour& v : of_q_)
      if (u.label == v.label && u.point != v.point && !has(of_q_, u.point) && !has(of_p_, v.point))
        return Answer::depends;
  const auto has_four_labels = [&](const std::vector<Neighbour>& neighbours) {
    labels_.clear();
    for (const Neighbour& n : neighbours)
      if (std::ranges::find(labels_, n.label) == labels_.end())
        labels_.push_back(n.label);
    return labels_.size() >= 4;
  };
  return has_four_labels(of_p_) || has_four_labels(of_q_) ? Answer::yes : Answer::depends;
}

/// Moves q into p.
void Collapse::collapse(int p, int q) {
  for (int member = q; member != outside; member = next_[static_cast<std::size_t>(member)])
    target_[static_cast<std::size_t>(member)] = p;
  next_[static_cast<std::size_t>(last_[static_cast<std::size_t>(p)])] = q;
  last_[static_cast<std::size_t>(p)] = last_[static_cast<std::size_t>(q)];
}

void Collapse::store(const Scene& scene, const Cluster& cluster,
                     std::vector<SnapMerges::Place>& places) {
  std::size_t left = 0;
  for (std::size_t m = 0; m < members_.size(); ++m)
    left += target_[m] == static_cast<int>(m) ? 1 : 0;
  if (left > 1)
    for (const Member& member : members_)
      mark_crowded(scene.lattice, member.at, member.edge.axis);
  for (std::size_t m = 0; m < members_.size(); ++m) {
    const auto member = static_cast<int>(m);
    for (const Face& face : star(member)) {
      const bool is_first = (face.member_a == outside || face.member_a > member) &&
                            (face.member_b == outside || face.member_b > member);
      if (is_first && is_gone(face, target_[m]))
        drop_faces(scene.merges, face.block, 1);
    }
    if (target_[m] != member || next_[m] == outside)
      continue;
    group_.clear();
    for (int at = member; at != outside; at = next_[static_cast<std::size_t>(at)])
      group_.push_back(members_[static_cast<std::size_t>(at)]);
    store_group(scene, cluster.block, cluster.corner, group_, places);
  }
}

} // namespace

SnapMerges merge_snap_clusters(const Context& context, SnapLattice& lattice,
                               SnapOptions::Place place, bool always_careful) {
  struct Part {
    std::vector<Cluster> rest;
    std::uint64_t clusters = 0, corners = 0;
  };
  SnapMerges merges;
  merges.target = std::make_unique_for_overwrite<std::uint32_t[]>(lattice.surface().points);
  prefer_huge_pages(merges.target.get(), lattice.surface().points * sizeof(std::uint32_t));
  merges.dropped.resize(lattice.surface().blocks.size());
  std::vector<Part> parts((lattice.count() + blocks_at_once - 1) / blocks_at_once);
  merges.places.resize(parts.size() + 1);
  Scene scene{lattice, place, merges, IndexMap()};
  parallel_blocks(
      context, lattice.count(), blocks_at_once, [&](std::size_t begin, std::size_t end) {
        BitCollapse bits(scene);
        Collapse collapse;
        Part& part = parts[begin / blocks_at_once];
        std::vector<SnapMerges::Place>& places = merges.places[begin / blocks_at_once];
        for (std::size_t n = begin; n < end; ++n) {
          SnapLattice::Corners corners = lattice.corners(n);
          CornerWords& several = corners.several;
          const CornerWords& entered = place == SnapOptions::Place::corner ? corners.some : several;
          unsigned slices = 0;
          for (unsigned i = 0; i < volume::leaf_dim; ++i) {
            part.corners += count_bits(corners.some[i]);
            part.clusters += count_bits(several[i]);
            slices |= (several[i] | entered[i]) != 0 ? 1U << i : 0U;
          }
          if (slices == 0)
            continue;
          bits.enter(n, slices);
          if (place == SnapOptions::Place::corner)
            for (unsigned i = 0; i < volume::leaf_dim; ++i)
              for (std::uint64_t left = corners.some[i]; left != 0; left &= left - 1)
                bits.mark_moved(i, static_cast<unsigned>(std::countr_zero(left)));
          for (unsigned i = 0; i < volume::leaf_dim; ++i)
            for (; several[i] != 0; several[i] &= several[i] - 1) {
              const auto bit = static_cast<unsigned>(std::countr_zero(several[i]));
              const LatticeSpot at{static_cast<std::uint32_t>(n), i, bit};
              if (!always_careful && !lattice.draws_fin(n, at) && bits.take(i, bit, places))
                continue;
              Cluster cluster{
                  at.block,
                  0,
                  {static_cast<int>(i), static_cast<int>(bit >> 3), static_cast<int>(bit & 7)}};
              if (!always_careful && collapse.in_parallel(scene, cluster, places))
                continue;
              cluster.first_member = lattice.first_member(n, cluster.corner);
              part.rest.push_back(cluster);
            }
          bits.leave();
        }
      });
  std::vector<Cluster> rest;
  for (const Part& part : parts) {
    merges.corners += part.corners;
    merges.clusters += part.clusters;
    rest.insert(rest.end(), part.rest.begin(), part.rest.end());
  }
  std::ranges::sort(rest, {}, &Cluster::first_member);
  merges.careful = rest.size();
  scene.in_order = IndexMap(rest.size());
  for (const Cluster& cluster : rest)
    scene.in_order.insert(lattice.absolute(cluster.block, cluster.corner), 0);
  Collapse collapse;
  for (std::size_t n = 0; n < rest.size(); ++n) {
    if (n % 65536 == 0 && context.cancelled && context.cancelled())
      throw Cancelled();
    collapse.in_order(scene, rest[n], merges.places.back());
    merges.refused += collapse.refused();
  }
  return merges;
}

} // namespace gewebe::surface
