#include "surface/snap_collapse_internal.h"

#include "base/error.h"
#include "base/parallel.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <memory>
#include <numeric>
#include <span>
#include <utility>

// Based on: Dey, Edelsbrunner, Guha and Nekhayev, Topology Preserving Edge Contraction, 1999.

namespace gewebe {
namespace {

constexpr std::uint32_t none = SnapMerges::none;

/// Faces of each slot's point, ascending.
struct Stars {
  std::vector<std::uint32_t> first;
  std::unique_ptr<std::uint32_t[]> faces;
  std::span<const std::uint32_t> operator[](std::size_t slot) const {
    return {faces.get() + first[slot], faces.get() + first[slot + 1]};
  }
};

Stars make_stars(const Context& context, const std::vector<Triangle>& triangles,
                 const SnapClusters& clusters) {
  const std::size_t slots = clusters.members.size();
  // Each range of faces counts on its own, so that faces stay in order.
  const auto ranges = static_cast<std::size_t>(std::clamp(thread_count(context), 1, 16));
  const std::size_t grain = triangles.size() / ranges + 1;
  std::vector<std::vector<std::uint16_t>> counts(ranges);
  // Which corners are in a cluster can't be predicted, so they are picked without a branch.
  const auto for_slots = [&](std::size_t begin, std::size_t end, auto&& visit) {
    constexpr std::size_t at_once = 2048;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> picked(3 * at_once + 1);
    for (; begin < end; begin += at_once) {
      std::size_t count = 0;
      for (std::size_t f = begin; f < std::min(end, begin + at_once); ++f)
        for (const std::uint32_t p : triangles[f]) {
          picked[count] = {p, static_cast<std::uint32_t>(f)};
          count += clusters.flags[p] / clustered % 2;
        }
      for (std::size_t n = 0; n < count; ++n)
        visit(clusters.slot[picked[n].first], picked[n].second);
    }
  };
  parallel_blocks(context, triangles.size(), grain, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint16_t>& own = counts[begin / grain];
    own.resize(slots);
    for_slots(begin, end, [&](std::uint32_t slot, std::uint32_t) { ++own[slot]; });
  });
  Stars stars;
  stars.first.resize(slots + 1);
  std::uint64_t total = 0;
  for (std::size_t slot = 0; slot < slots; ++slot) {
    stars.first[slot] = static_cast<std::uint32_t>(total);
    std::uint16_t before = 0;
    for (std::vector<std::uint16_t>& own : counts)
      if (!own.empty())
        before = static_cast<std::uint16_t>(before + std::exchange(own[slot], before));
    total += before;
  }
  if (total > UINT32_MAX)
    throw Error("the surface has too many points to snap at once, expected a smaller epsilon");
  stars.first[slots] = static_cast<std::uint32_t>(total);
  stars.faces = std::make_unique_for_overwrite<std::uint32_t[]>(total);
  parallel_blocks(context, triangles.size(), grain, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint16_t>& own = counts[begin / grain];
    for_slots(begin, end, [&](std::uint32_t slot, std::uint32_t f) {
      stars.faces[stars.first[slot] + own[slot]++] = f;
    });
  });
  return stars;
}

/// What all clusters share.
struct Scene {
  const std::vector<Triangle>& triangles;
  const SnapClusters& clusters;
  Stars stars;
  std::vector<std::uint8_t> done; // of each cluster: it went without order
  SnapMerges& merges;
};

void drop_face(SnapMerges& merges, std::uint32_t f) {
  std::atomic_ref(merges.dropped[f / SnapMerges::faces_at_once])
      .fetch_add(1, std::memory_order_relaxed);
}

/// Clusters of two or three points, nearly all that there are, with few comparisons.
class SmallCollapse {
public:
  static constexpr std::size_t most_members = 3;
  /// Takes cluster n, if the conditions of merge_snap_clusters can be told to hold; else it changes
  /// nothing and answers false.
  bool take(Scene& scene, std::uint32_t n);

private:
  /// Neighbours and their labels.
  struct Ring {
    static constexpr std::size_t most = 26;
    std::array<std::uint32_t, most> points;
    std::array<std::uint64_t, most> labels;
    std::size_t count = 0;
    bool has(std::uint32_t point) const {
      bool found = false;
      for (std::size_t n = 0; n < count; ++n)
        found = found || points[n] == point;
      return found;
    }
    void add(std::uint32_t point, std::uint64_t label) {
      points[count] = point;
      labels[count++] = label;
    }
  };
  static constexpr int outside = -1;

  /// Bit m: it is member m. Without a branch, since none could be predicted.
  unsigned member_bit(std::uint32_t point) const {
    return (point == points_[0] ? 1U : 0U) | (point == points_[1] ? 2U : 0U) |
           (point == points_[2] ? 4U : 0U);
  }
  bool find_ring(const Scene& scene, std::uint32_t slot, std::size_t m);
  static bool always_collapses(const Ring& p, const Ring& q);
  void store(Scene& scene, std::uint32_t first_slot, std::size_t p, std::size_t s, int t) const;

  std::span<const std::uint32_t> members_;
  std::array<std::uint32_t, most_members> points_{}; // the same, then none
  std::array<Ring, most_members> rings_;
};

bool SmallCollapse::find_ring(const Scene& scene, std::uint32_t slot, std::size_t m) {
  Ring& ring = rings_.at(m);
  ring.count = 0;
  const std::span<const std::uint32_t> star = scene.stars[slot];
  if (star.size() > Ring::most / 2)
    return false;
  for (const std::uint32_t f : star) {
    const Triangle& t = scene.triangles[f];
    const std::uint32_t point = t[0] == members_[m] ? t[1] : t[1] == members_[m] ? t[2] : t[0];
    std::uint64_t label = point;
    if ((scene.clusters.flags[point] & clustered) != 0 && member_bit(point) == 0)
      label = std::uint64_t{1} << 32 | scene.clusters.cluster[scene.clusters.slot[point]];
    ring.add(point, label);
  }
  return true;
}

/// Do (1) to (3) hold for an edge between points with these neighbours?
bool SmallCollapse::always_collapses(const Ring& p, const Ring& q) {
  std::array<std::uint64_t, Ring::most> others; // labels of p's own neighbours
  std::size_t count = 0, common = 0, single = 0;
  for (std::size_t n = 0; n < p.count; ++n) {
    single += p.labels[n] <= UINT32_MAX ? 1 : 0;
    const bool both = q.has(p.points[n]);
    others[count] = p.labels[n];
    common += both ? 1 : 0;
    count += both ? 0 : 1;
  }
  // Points that are no cluster's have a label each.
  if (common != 2 || single + (single < p.count ? 1 : 0) < 4)
    return false;
  bool met = false;
  for (std::size_t n = 0; n < q.count; ++n) {
    bool here = false;
    for (std::size_t m = 0; m < count; ++m)
      here = here || others[m] == q.labels[n];
    met = met || (here && !p.has(q.points[n]));
  }
  return !met;
}

bool SmallCollapse::take(Scene& scene, std::uint32_t n) {
  members_ = scene.clusters.members_of(n);
  const std::uint32_t first_slot = scene.clusters.begin[n];
  points_ = {members_[0], members_[1], members_.size() > 2 ? members_[2] : none};
  for (std::size_t m = 0; m < members_.size(); ++m)
    if (!find_ring(scene, first_slot + static_cast<std::uint32_t>(m), m))
      return false;
  // The first member with a neighbour in the cluster, and the first such neighbour.
  std::size_t p = 0;
  int found = outside;
  for (; p + 1 < members_.size(); ++p) {
    const Ring& ring = rings_.at(p);
    for (std::size_t at = 0; at < ring.count && found == outside; ++at)
      if (const unsigned bit = member_bit(ring.points[at]); bit != 0)
        found = std::countr_zero(bit);
    if (found != outside)
      break;
  }
  if (found == outside)
    return true;
  const auto s = static_cast<std::size_t>(found);
  if (!always_collapses(rings_.at(p), rings_.at(s)))
    return false;
  int third = outside;
  if (members_.size() == 3 && p == 0) {
    const std::size_t t = 3 - s;
    Ring merged;
    for (const std::size_t m : {p, s})
      for (std::size_t at = 0; at < rings_.at(m).count; ++at) {
        const std::uint32_t point = rings_.at(m).points[at];
        if (point != members_[p] && point != members_[s] && !merged.has(point))
          merged.add(point, rings_.at(m).labels[at]);
      }
    if (merged.has(members_[t])) {
      Ring last;
      const Ring& ring = rings_.at(t);
      for (std::size_t at = 0; at < ring.count; ++at)
        if (ring.points[at] != members_[s] && ring.points[at] != members_[p])
          last.add(ring.points[at], ring.labels[at]);
      last.add(members_[p], members_[p]);
      if (!always_collapses(merged, last))
        return false;
      third = static_cast<int>(t);
    }
  }
  store(scene, first_slot, p, s, third);
  return true;
}

/// Merges s, and t where there is one, into p.
void SmallCollapse::store(Scene& scene, std::uint32_t first_slot, std::size_t p, std::size_t s,
                          int t) const {
  SnapMerges& merges = scene.merges;
  const auto slot = [&](std::size_t m) { return first_slot + static_cast<std::uint32_t>(m); };
  merges.target[slot(s)] = members_[p];
  merges.next[slot(p)] = slot(s);
  if (t != outside) {
    const auto third = static_cast<std::size_t>(t);
    merges.target[slot(third)] = members_[p];
    merges.next[slot(p)] = slot(std::min(s, third));
    merges.next[slot(std::min(s, third))] = slot(std::max(s, third));
  }
  // Faces with two of them vanish; each is counted at its first one.
  const unsigned all = 1U << p | 1U << s | (t != outside ? 1U << t : 0U);
  for (std::size_t m = 0; m < members_.size(); ++m) {
    if ((all >> m & 1) == 0)
      continue;
    for (const std::uint32_t f : scene.stars[slot(m)]) {
      const Triangle& corners = scene.triangles[f];
      const unsigned here =
          all & (member_bit(corners[0]) | member_bit(corners[1]) | member_bit(corners[2]));
      if ((here & (here - 1)) != 0 && (here & (0 - here)) == 1U << m)
        drop_face(merges, f);
    }
  }
}

/// One cluster and the faces around it. Its members are numbered from 0 on.
class Collapse {
public:
  /// Takes cluster n. Where it `needs_no_order`, another cluster may be taken at the same time;
  /// answers whether it was so, else nothing has changed.
  bool in_parallel(Scene& scene, std::uint32_t n) { return take(scene, n, false); }
  /// \pre the clusters before it that aren't done have been taken, none after it
  void in_order(Scene& scene, std::uint32_t n) { (void)take(scene, n, true); }
  std::uint64_t refused() const { return refused_; }

private:
  static constexpr int outside = -1;
  struct Face { // of a member: the corners that follow it
    std::uint32_t number, a, b;
    int member_a, member_b; // or outside
    std::uint64_t label_a;
  };
  struct Neighbour {
    std::uint32_t point;
    std::uint64_t label;
  };
  enum class Answer { yes, no, depends };

  bool take(Scene& scene, std::uint32_t n, bool careful);
  void gather(const Scene& scene, std::uint32_t n, bool careful);
  bool collapse_all(bool careful);
  void find_neighbours(int p, std::vector<Neighbour>& neighbours) const;
  Answer can_collapse(int p, int q, bool careful);
  void collapse(int p, int q);
  void store(Scene& scene, std::uint32_t n);

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

  std::span<const std::uint32_t> members_;
  std::vector<Face> faces_;
  std::vector<std::size_t> begin_; // of each member's faces
  std::vector<int> target_, next_, last_;
  std::vector<Neighbour> of_p_, of_q_;
  std::vector<std::uint64_t> labels_;
  std::uint64_t refused_ = 0;
};

bool Collapse::take(Scene& scene, std::uint32_t n, bool careful) {
  members_ = scene.clusters.members_of(n);
  gather(scene, n, careful);
  refused_ = 0;
  if (!collapse_all(careful))
    return false;
  store(scene, n);
  return true;
}

void Collapse::gather(const Scene& scene, std::uint32_t n, bool careful) {
  const SnapClusters& clusters = scene.clusters;
  const std::uint32_t first_slot = clusters.begin[n];
  struct Corner {
    std::uint32_t point;
    int member;
    std::uint64_t label;
  };
  const auto look_up = [&](std::uint32_t p) -> Corner {
    if ((clusters.flags[p] & clustered) == 0)
      return {p, outside, p};
    const std::uint32_t slot = clusters.slot[p], cluster = clusters.cluster[slot];
    if (cluster == n)
      return {p, static_cast<int>(slot - first_slot), p};
    const std::uint64_t label = std::uint64_t{1} << 32 | cluster;
    if (!careful || // a later cluster may be done already
        (scene.done[cluster] != 0 && clusters.first_member[cluster] > clusters.first_member[n]))
      return {p, outside, label};
    return {scene.merges.target[slot], outside, label};
  };
  faces_.clear();
  begin_.clear();
  for (std::size_t m = 0; m < members_.size(); ++m) {
    begin_.push_back(faces_.size());
    for (const std::uint32_t f : scene.stars[first_slot + m]) {
      const Triangle& t = scene.triangles[f];
      const std::uint32_t p = members_[m];
      const std::size_t at = t[0] == p ? 0 : t[1] == p ? 1 : 2;
      const Corner a = look_up(t.at((at + 1) % 3)), b = look_up(t.at((at + 2) % 3));
      if (a.member != outside || b.member != outside || a.point != b.point)
        faces_.push_back({f, a.point, b.point, a.member, b.member, a.label});
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
      const std::uint32_t point = members_[static_cast<std::size_t>(member)];
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

void Collapse::store(Scene& scene, std::uint32_t n) {
  const std::uint32_t first_slot = scene.clusters.begin[n];
  SnapMerges& merges = scene.merges;
  std::iota(last_.begin(), last_.end(), 0); // what was merged where is linked by its number
  for (std::size_t m = 0; m < members_.size(); ++m) {
    const auto member = static_cast<int>(m);
    const auto target = static_cast<std::size_t>(target_[m]);
    merges.target[first_slot + m] = members_[target];
    if (target_[m] != member) {
      merges.next[first_slot + static_cast<std::uint32_t>(last_[target])] =
          first_slot + static_cast<std::uint32_t>(m);
      last_[target] = member;
    }
    for (const Face& face : star(member)) {
      const bool is_first = (face.member_a == outside || face.member_a > member) &&
                            (face.member_b == outside || face.member_b > member);
      if (is_first && is_gone(face, target_[m]))
        drop_face(merges, face.number);
    }
  }
}

} // namespace

SnapMerges merge_snap_clusters(const Context& context, const std::vector<Triangle>& triangles,
                               const SnapClusters& clusters, bool always_careful) {
  SnapMerges merges;
  merges.target = clusters.members;
  merges.next.assign(clusters.members.size(), none);
  merges.dropped.resize(triangles.size() / SnapMerges::faces_at_once + 1);
  Context quiet = context;
  quiet.progress = nullptr;
  Scene scene{triangles, clusters, make_stars(quiet, triangles, clusters),
              std::vector<std::uint8_t>(clusters.count()), merges};
  if (!always_careful)
    parallel_blocks(context, clusters.count(), 1024, [&](std::size_t begin, std::size_t end) {
      SmallCollapse small;
      Collapse collapse;
      for (auto n = static_cast<std::uint32_t>(begin); n < end; ++n)
        scene.done[n] = (clusters.members_of(n).size() <= SmallCollapse::most_members &&
                         small.take(scene, n)) ||
                                collapse.in_parallel(scene, n)
                            ? 1
                            : 0;
    });
  std::vector<std::uint32_t> rest;
  for (std::size_t n = 0; n < clusters.count(); ++n)
    if (scene.done[n] == 0)
      rest.push_back(static_cast<std::uint32_t>(n));
  std::ranges::sort(rest, {}, [&](std::uint32_t n) { return clusters.first_member[n]; });
  merges.careful = rest.size();
  Collapse collapse;
  for (std::size_t n = 0; n < rest.size(); ++n) {
    if (n % 65536 == 0 && context.cancelled && context.cancelled())
      throw Cancelled();
    collapse.in_order(scene, rest[n]);
    merges.refused += collapse.refused();
  }
  return merges;
}

} // namespace gewebe
