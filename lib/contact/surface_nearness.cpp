// How near surfaces are that may touch, so that nobody asks whether they do while they can't have
// come together.

#include "base/vector_at.h"
#include "contact/surface_pairs.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace gewebe {

namespace {

constexpr double far_enough = 2; ///< of an edge: nobody looks further
constexpr double margin = 0.25;  ///< of an edge, for what forces do within a step
constexpr double sudden = 2;     ///< times faster than it was
constexpr double behind = 0.5;   ///< cosine: so far on the inner side of each other
constexpr int wait_when_near = 8;

struct Nearest {
  double distance = HUGE_VAL;
  Vec3 between; ///< from the first to the second
};

void take(Nearest& least, const Vec3& from, const Vec3& to) {
  const double distance = norm(to - from);
  if (distance < least.distance)
    least = {distance, to - from};
}

// After C. Ericson, Real-Time Collision Detection, 2005, 5.1.9.
void take_edges(Nearest& least, const Vec3& p, const Vec3& p2, const Vec3& q, const Vec3& q2) {
  const Vec3 d = p2 - p, e = q2 - q, r = p - q;
  const double dd = dot(d, d), ee = dot(e, e), er = dot(e, r), dr = dot(d, r), de = dot(d, e),
               square = dd * ee - de * de;
  if (!(dd > 0 && ee > 0))
    return; // ends are met as nodes
  double s = square > 0 ? std::clamp((de * er - dr * ee) / square, 0.0, 1.0) : 0;
  double t = (de * s + er) / ee;
  if (t < 0 || t > 1) {
    t = std::clamp(t, 0.0, 1.0);
    s = std::clamp((de * t - dr) / dd, 0.0, 1.0);
  }
  take(least, p + s * d, q + t * e);
}

using Corners = std::array<Vec3, 3>;

void take_nodes(Nearest& least, const Corners& nodes, const Corners& triangle, double sign) {
  for (const Vec3& p : nodes) {
    PlacedInstrument point;
    point.a = p;
    const Vec3 there = nearest_points(point, CorePart::first_end, triangle, 3)->place;
    Nearest here;
    take(here, p, there);
    if (here.distance < least.distance)
      least = {here.distance, sign * here.between};
  }
}

Nearest nearest_of(const Corners& f, const Corners& g) {
  Nearest least;
  take_nodes(least, f, g, 1);
  take_nodes(least, g, f, -1);
  for (std::size_t a = 0; a < 3; ++a)
    for (std::size_t b = 0; b < 3; ++b)
      take_edges(least, f[a], f[(a + 1) % 3], g[b], g[(b + 1) % 3]);
  return least;
}

Vec3 normal_of(const Corners& f) {
  return cross(f[1] - f[0], f[2] - f[0]);
}

} // namespace

/// Of triangles that may touch, where the tree is fitted to looked_at_.
double SurfacePairs::clear_of(const SurfaceMeeting& m) const {
  double least = far_enough * edge_;
  const auto corners_of = [&](const Facet& f) {
    return Corners{looked_at_[f[0]], looked_at_[f[1]], looked_at_[f[2]]};
  };
  for (std::uint32_t k = 0; k < touching_.size(); ++k) {
    const Facet& f = facets_.facets()[touching_[k]];
    if (!m.one.holds(f[0]))
      continue;
    const Corners corners = corners_of(f);
    Box3 box;
    for (const Vec3& p : corners)
      box.add(p);
    box.min -= {least, least, least};
    box.max += {least, least, least};
    const Vec3 middle = (corners[0] + corners[1] + corners[2]) / 3;
    const auto reach_of = [](const Corners& of, const Vec3& from) {
      return std::max({norm(of[0] - from), norm(of[1] - from), norm(of[2] - from)});
    };
    const double reach = reach_of(corners, middle);
    tree_.visit_near(box, [&](std::uint32_t number) {
      const Facet& g = facets_.facets()[touching_[number]];
      if (!m.other.holds(g[0]) || (m.itself() && number <= k))
        return;
      const Corners others = corners_of(g);
      const Vec3 there = (others[0] + others[1] + others[2]) / 3;
      if (!(norm(there - middle) - reach - reach_of(others, there) < least))
        return;
      if (m.itself() &&
          std::ranges::any_of(f, [&](std::uint32_t corner) { return around(corner, g); }))
        return;
      const Nearest nearest = nearest_of(corners, others);
      if (!(nearest.distance < least))
        return;
      // Both sides of a solid's wall do not come to touch.
      const auto is_behind = [&](const Corners& of, double sign) {
        const Vec3 n = normal_of(of);
        return sign * dot(n, nearest.between) < -behind * norm(n) * nearest.distance;
      };
      if (m.itself() && !(is_net(f[0]) && is_net(g[0])) && is_behind(corners, 1) &&
          is_behind(others, -1))
        return;
      least = nearest.distance;
    });
  }
  return least;
}

/// By how much two points of a meeting's surfaces may have come together since a look.
double SurfacePairs::moved_since(const Look& look, const SurfaceMeeting& m,
                                 std::span<const double> places) const {
  Vec3 sum;
  std::size_t count = 0;
  const auto each = [&](auto&& visit) {
    for (std::size_t k = 0; k < surface_.size(); ++k)
      if (m.one.holds(surface_[k]) || m.other.holds(surface_[k]))
        visit(vector_at(places, surface_[k]) - look.at[k]);
  };
  each([&](const Vec3& by) {
    sum += by;
    ++count;
  });
  const Vec3 mean = count > 0 ? sum / static_cast<double>(count) : Vec3{};
  double most = 0;
  each([&](const Vec3& by) {
    const double square = dot(by - mean, by - mean);
    most = square <= most ? most : square;
  });
  return 2 * std::sqrt(most);
}

double SurfacePairs::speed_of(const SurfaceMeeting& m, std::span<const double> velocity) const {
  Look still;
  still.at.resize(surface_.size());
  return moved_since(still, m, velocity);
}

bool SurfacePairs::may_touch(std::span<const double> places, std::span<const double> velocity,
                             double h) {
  bool fitted = false, any = false;
  for (std::size_t k = 0; k < meetings_.size(); ++k) {
    const SurfaceMeeting& m = meetings_[k];
    Look& look = looks_[k];
    if (look.wait > 0) {
      --look.wait;
      any = true;
      continue;
    }
    const double ahead = margin * edge_ + sudden * h * speed_of(m, velocity);
    if (!look.at.empty() && moved_since(look, m, places) + ahead < look.clear)
      continue;
    if (!fitted) {
      looked_at_.resize(rest_.size());
      for (const std::uint32_t node : surface_)
        looked_at_[node] = vector_at(places, node);
      fit_tree(looked_at_, {});
      fitted = true;
    }
    look.at.clear();
    for (const std::uint32_t node : surface_)
      look.at.push_back(looked_at_[node]);
    look.clear = clear_of(m);
    if (!(ahead < look.clear)) {
      look.wait = wait_when_near;
      any = true;
    }
  }
  return any;
}

double SurfacePairs::way_of(std::span<const double> moved) const {
  double most = 0;
  for (const SurfaceMeeting& m : meetings_) {
    const double way = speed_of(m, moved) / edge_;
    most = way <= most ? most : way;
  }
  return most;
}

bool SurfacePairs::may_have_touched(std::span<const double> places) const {
  for (std::size_t k = 0; k < meetings_.size(); ++k)
    if (!(moved_since(looks_[k], meetings_[k], places) < looks_[k].clear))
      return true;
  return false;
}

} // namespace gewebe
