#include "surface/regularize.h"

#include "base/error.h"
#include "base/parallel.h"
#include "mesh/edges.h"
#include "mesh/self_intersections.h"
#include "volume/field.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

// Based on: Botsch and Kobbelt, A Remeshing Approach to Multiresolution Modeling, 2004.

namespace gewebe::surface {
namespace {

using Index = std::uint32_t;

/// A point that would move by less than this, relative to its edges, stays.
constexpr double still = 1e-3;
constexpr double cos_30 = 0.86602540378443864676, cos_45 = 0.70710678118654752440;

/// Cosine of the smallest angle; 1 where the face has no area.
double largest_cosine(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 u = b - a, v = c - a, w = c - b;
  const double uu = dot(u, u), vv = dot(v, v), ww = dot(w, w);
  const double cosine = uu <= vv && uu <= ww ? dot(v, w) / std::sqrt(vv * ww)
                        : vv <= ww           ? -dot(u, w) / std::sqrt(uu * ww)
                                             : dot(u, v) / std::sqrt(uu * vv);
  return cosine < 1 ? cosine : 1; // NaN too
}

Vec3 area_vector(const Vec3& a, const Vec3& b, const Vec3& c) {
  return cross(b - a, c - a);
}

/// Are two directions less than the angle apart? Not if one has no length.
bool within(const Vec3& a, const Vec3& b, double cosine) {
  return dot(a, b) > cosine * std::sqrt(dot(a, a) * dot(b, b));
}

/// A closed mesh whose edges can be flipped. Half-edge 3 f + n runs from corner n of face f to the
/// next one.
class FlippingMesh {
public:
  /// Edges stay whose two faces have more than one point with a nonzero `kept`.
  FlippingMesh(TriangleMesh& mesh, const std::vector<std::uint8_t>& kept)
      : points_(mesh.points), faces_(mesh.triangles), kept_(kept), twin_(3 * faces_.size()),
        outgoing_(points_.size(), 0), valence_(points_.size(), 0) {
    for (Index h = 0; h < twin_.size(); ++h) {
      outgoing_[start(h)] = h;
      ++valence_[start(h)];
    }
    mesh::EdgeSides(points_.size(), faces_)
        .for_each_edge([&](std::uint32_t, std::span<const mesh::EdgeSide> edge) {
          if (edge.size() != 2 || mesh::surplus(edge) != 0)
            throw Error("the mesh has an edge of " + std::to_string(edge.size()) +
                        (mesh::surplus(edge) != 0 ? " faces that do not agree" : " faces") +
                        ", expected a closed mesh with two at each");
          const Index h = mesh::next_corner(edge[0].corner()),
                      back = mesh::next_corner(edge[1].corner());
          twin_[h] = back;
          twin_[back] = h;
        });
  }

  static Index following(Index h) { return mesh::next_corner(h); }
  static Index preceding(Index h) { return mesh::previous_corner(h); }
  Index start(Index h) const { return faces_[h / 3][h % 3]; }

  /// Calls visit(h) for each half-edge that leaves p.
  template <class Visit>
  void for_outgoing(Index p, const Visit& visit) const {
    const Index begin = outgoing_[p];
    Index h = begin;
    do {
      visit(h);
      h = twin_[preceding(h)];
    } while (h != begin);
  }

  /// Flips every edge that improves its faces; returns how many.
  std::uint64_t flip_pass() {
    std::uint64_t flips = 0;
    for (Index h = 0; h < twin_.size(); ++h)
      if (h < twin_[h] && improves(h)) {
        flip(h);
        ++flips;
      }
    return flips;
  }

private:
  bool joined(Index p, Index q) const {
    bool found = false;
    for_outgoing(p, [&](Index h) { found = found || start(following(h)) == q; });
    return found;
  }

  bool improves(Index h) const {
    const Index t = twin_[h];
    const Index a = start(h), b = start(t), c = start(preceding(h)), d = start(preceding(t));
    if (kept_[a] + kept_[b] + kept_[c] + kept_[d] > 1)
      return false;
    const Vec3 &pa = points_[a], &pb = points_[b], &pc = points_[c], &pd = points_[d];
    const double before = std::fmax(largest_cosine(pa, pb, pc), largest_cosine(pb, pa, pd)),
                 after = std::fmax(largest_cosine(pa, pd, pc), largest_cosine(pb, pc, pd));
    if (!(after < before - 1e-9))
      return false;
    const Vec3 old_1 = area_vector(pa, pb, pc), old_2 = area_vector(pb, pa, pd),
               new_1 = area_vector(pa, pd, pc), new_2 = area_vector(pb, pc, pd);
    // A face without area has no normal: the other one's stands for both.
    const Vec3 both = old_1 + old_2;
    return within(new_1, new_2, cos_30) && within(new_1, both, cos_30) &&
           within(new_2, both, cos_30) && nearly_flat(old_1, both) && nearly_flat(old_2, both) &&
           valence_[a] > 3 && valence_[b] > 3 && c != d && !joined(c, d);
  }
  static bool nearly_flat(const Vec3& face, const Vec3& both) {
    return dot(face, face) <= 1e-3 * dot(both, both) || within(face, both, cos_30);
  }

  /// a b c, b a d become a d c, b c d.
  void flip(Index h) {
    const Index t = twin_[h];
    const Index a = start(h), b = start(t), c = start(preceding(h)), d = start(preceding(t));
    const Index bc = twin_[following(h)], ca = twin_[preceding(h)], ad = twin_[following(t)],
                db = twin_[preceding(t)];
    const Index f = h / 3 * 3, g = t / 3 * 3;
    faces_[f / 3] = {a, d, c};
    faces_[g / 3] = {b, c, d};
    const auto join = [&](Index x, Index y) {
      twin_[x] = y;
      twin_[y] = x;
    };
    join(f, ad);
    join(f + 1, g + 1); // d c, c d
    join(f + 2, ca);
    join(g, bc);
    join(g + 2, db);
    outgoing_[a] = f;
    outgoing_[d] = f + 1;
    outgoing_[c] = f + 2;
    outgoing_[b] = g;
    --valence_[a];
    --valence_[b];
    ++valence_[c];
    ++valence_[d];
  }

  std::vector<Vec3>& points_;
  std::vector<Triangle>& faces_;
  const std::vector<std::uint8_t>& kept_;
  std::vector<Index> twin_, outgoing_, valence_;
};

/// The isosurface of the volume's trilinear interpolation; for one thread.
class IsoField {
public:
  IsoField(const volume::Grid& grid, double isovalue)
      : field_(grid), transform_(grid.info().transform), isovalue_(isovalue) {
    const Vec3 edges = transform_.voxel_size();
    voxel_ = std::fmin(edges.x, std::fmin(edges.y, edges.z));
  }

  /// Where the line through p along the gradient meets the surface, within a voxel.
  std::optional<Vec3> project(const Vec3& p) {
    const Vec3 gradient = field_.gradient(transform_.to_index(p));
    const double slope = norm(gradient);
    if (!(slope > 0))
      return std::nullopt;
    const Vec3 direction = gradient / slope;
    const auto above = [&](double t) {
      return field_.value(transform_.to_index(p + direction * t)) - isovalue_;
    };
    double near = 0, f_near = above(0);
    if (f_near == 0)
      return p;
    const double sign = f_near > 0 ? -1 : 1;
    double far = sign * std::clamp(1.25 * std::fabs(f_near) / slope, 1e-3 * voxel_, voxel_);
    double f_far = above(far);
    while (!(f_near * f_far <= 0)) {
      if (std::fabs(far) >= voxel_)
        return std::nullopt;
      near = far;
      f_near = f_far;
      far = sign * std::fmin(2 * std::fabs(far), voxel_);
      f_far = above(far);
    }
    // Illinois method
    for (int step = 0; step < 30 && std::fabs(far - near) > 1e-9 * voxel_; ++step) {
      const double middle = (near * f_far - far * f_near) / (f_far - f_near), f = above(middle);
      if (f == 0)
        return p + direction * middle;
      if (f * f_far < 0) {
        near = far;
        f_near = f_far;
      } else {
        f_near /= 2;
      }
      far = middle;
      f_far = f;
    }
    return p + direction * far;
  }

private:
  volume::Field field_;
  const volume::GridTransform& transform_;
  double isovalue_, voxel_ = 0;
};

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr Vec3 nowhere{nan, nan, nan};

/// Where one point would go; not finite if nowhere.
struct Wish {
  Vec3 target = nowhere;
  bool off_surface = false;
};

Wish wish(const FlippingMesh& mesh, const TriangleMesh& shape, IsoField& field, Index p) {
  const Vec3& here = shape.points[p];
  Vec3 normal, mean;
  double weight = 0, count = 0;
  mesh.for_outgoing(p, [&](Index h) {
    const Triangle& t = shape.triangles[h / 3];
    const Vec3 area = area_vector(shape.points[t[0]], shape.points[t[1]], shape.points[t[2]]);
    const double size = norm(area);
    normal += area;
    weight += size;
    ++count;
    mean += (shape.points[t[0]] + shape.points[t[1]] + shape.points[t[2]] - here * 3) * (size / 3);
  });
  const double length = norm(normal);
  if (!(weight > 0) || !(length > 0))
    return {};
  normal = normal / length;
  Vec3 move = mean * (0.5 / weight);
  move -= normal * dot(move, normal);
  if (dot(move, move) < still * still * weight / count)
    return {};
  if (const std::optional<Vec3> place = field.project(here + move))
    return {*place, false};
  return {nowhere, true};
}

/// May p move there? Faces must not turn, nor angles become smaller than they are.
bool may_move(const FlippingMesh& mesh, const TriangleMesh& shape, Index p, const Vec3& target) {
  if (!is_finite(target))
    return false;
  double before = -1, after = -1;
  bool turned = false;
  mesh.for_outgoing(p, [&](Index h) {
    const Vec3 &b = shape.points[mesh.start(FlippingMesh::following(h))],
               &c = shape.points[mesh.start(FlippingMesh::preceding(h))];
    const Vec3& a = shape.points[p];
    before = std::fmax(before, largest_cosine(a, b, c));
    after = std::fmax(after, largest_cosine(target, b, c));
    const Vec3 old_area = area_vector(a, b, c), new_area = area_vector(target, b, c);
    turned = turned || !(within(old_area, new_area, cos_45) || !(dot(old_area, old_area) > 0));
  });
  return !turned && after <= std::fmax(before, cos_30);
}

/// The rounds of one attempt, in which some points are kept.
class Attempt {
public:
  Attempt(const Context& context, const volume::Grid& grid, double isovalue, TriangleMesh& mesh,
          const std::vector<std::uint8_t>& kept)
      : context_(context), grid_(grid), isovalue_(isovalue), mesh_(mesh), kept_(kept),
        flipping_(mesh, kept), field_(grid, isovalue), wishes_(mesh.points.size()) {
    context_.progress = {}; // one loop of many
  }

  void flip() { report.flips += flipping_.flip_pass(); }

  void round() {
    flip();
    parallel_blocks(context_, wishes_.size(), 1024, [&](std::size_t begin, std::size_t end) {
      IsoField field(grid_, isovalue_);
      for (std::size_t p = begin; p < end; ++p)
        if (kept_[p] == 0)
          wishes_[p] = wish(flipping_, mesh_, field, static_cast<Index>(p));
    });
    // In turn, so that each move is judged by its neighbours' new places.
    for (Index p = 0; p < wishes_.size(); ++p) {
      report.off_surface += wishes_[p].off_surface ? 1 : 0;
      if (is_finite(wishes_[p].target))
        move(p, wishes_[p].target);
    }
  }

  RegularizeReport report;

private:
  void move(Index p, Vec3 target) {
    if (!may_move(flipping_, mesh_, p, target)) {
      target = field_.project((mesh_.points[p] + target) * 0.5).value_or(nowhere);
      if (!may_move(flipping_, mesh_, p, target)) {
        ++report.refused_moves;
        return;
      }
    }
    mesh_.points[p] = target;
    ++report.moves;
  }

  Context context_;
  const volume::Grid& grid_;
  double isovalue_;
  TriangleMesh& mesh_;
  const std::vector<std::uint8_t>& kept_;
  FlippingMesh flipping_;
  IsoField field_;
  std::vector<Wish> wishes_;
};

/// Marks the points of these faces and what lies within `rings` edges of them; returns how many are
/// new.
std::uint64_t keep_around(const TriangleMesh& mesh, const std::vector<std::uint32_t>& faces,
                          int rings, std::vector<std::uint8_t>& kept) {
  std::vector<std::uint8_t> touched(mesh.points.size(), 0);
  for (const std::uint32_t f : faces)
    for (const Index p : mesh.triangles[f])
      touched[p] = 1;
  for (int ring = 0; ring < rings && !faces.empty(); ++ring) {
    std::vector<std::uint8_t> wider = touched;
    for (const Triangle& t : mesh.triangles)
      if (touched[t[0]] + touched[t[1]] + touched[t[2]] > 0)
        wider[t[0]] = wider[t[1]] = wider[t[2]] = 1;
    touched = std::move(wider);
  }
  std::uint64_t fresh = 0;
  for (std::size_t p = 0; p < kept.size(); ++p)
    if (touched[p] != 0 && kept[p] == 0) {
      kept[p] = 1;
      ++fresh;
    }
  return fresh;
}

} // namespace

RegularizeReport regularize(const Context& context, const volume::Grid& grid, double isovalue,
                            TriangleMesh& mesh, const RegularizeOptions& options) {
  if (options.rounds < 0)
    throw Error("the number of rounds is negative, expected 0 or more");
  require_memory(context,
                 static_cast<double>(mesh.points.size()) * (sizeof(Wish) + sizeof(Vec3) + 16) +
                     static_cast<double>(mesh.triangles.size()) * 44,
                 "the regularization");
  RegularizeReport report;
  if (options.rounds == 0 || mesh.triangles.empty())
    return report;
  std::vector<std::uint8_t> kept(mesh.points.size(), 0);
  std::uint64_t kept_points = 0;
  Context quiet = context;
  quiet.progress = {};
  for (int rings = 1;; rings *= 2) { // ends, since each time more points are kept
    TriangleMesh better;
    better.points = mesh.points;
    better.triangles = mesh.triangles;
    Attempt attempt(context, grid, isovalue, better, kept);
    std::uint64_t fresh = 0;
    for (int round = 1; round <= options.rounds && fresh == 0; ++round) {
      if (context.progress)
        context.progress(static_cast<double>(round - 1) / options.rounds);
      attempt.round();
      if (round == options.rounds)
        attempt.flip();
      // Most cuts come early: looked for after 1, 2, 4 … rounds, so that little is done in vain.
      if (std::has_single_bit(static_cast<unsigned>(round)) || round == options.rounds)
        fresh = keep_around(better, mesh::self_intersections(quiet, better).faces, rings, kept);
    }
    kept_points += fresh;
    if (fresh == 0) {
      mesh.points = std::move(better.points);
      mesh.triangles = std::move(better.triangles);
      attempt.report.kept_points = kept_points;
      return attempt.report;
    }
  }
}

} // namespace gewebe::surface
