#include "tetrahedra/check.h"

#include "base/disjoint_sets.h"
#include "base/error.h"
#include "mesh/edges.h"
#include "tetrahedra/boundary.h"
#include "tetrahedra/faces.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace gewebe::tetrahedra {
namespace {

/// The side on which corner d lies of the triangle abc: 1 as in a positive tetrahedron, -1, or 0 if
/// it is flat.
int side(const TetMesh& mesh, const Tetrahedron& t) {
  if (has_equal_corners(t))
    return 0;
  const Vec3 &a = mesh.points[t[0]], &b = mesh.points[t[1]], &c = mesh.points[t[2]],
             &d = mesh.points[t[3]];
  double longest = 0;
  for (const auto& edge : tetrahedron_edges)
    longest = std::fmax(longest, norm(mesh.points[t[edge[1]]] - mesh.points[t[edge[0]]]));
  const double volume = tetrahedron_volume(a, b, c, d);
  if (!(std::fabs(volume) > 1e-12 * longest * longest * longest))
    return 0;
  return volume > 0 ? 1 : -1;
}

/// Those with the same four corners as an earlier one, by the faces opposite to the largest corner:
/// equal tetrahedra have that face in common.
std::vector<bool> repeated(const TetMesh& mesh, const TetFaces& faces) {
  std::vector<bool> again(mesh.tetrahedra.size());
  std::vector<std::pair<std::uint32_t, std::uint32_t>> tips; // largest corner, tetrahedron
  faces.for_each_face([&](std::uint32_t, std::span<const TetFace> face) {
    if (face.size() < 2)
      return;
    tips.clear();
    for (const TetFace& one : face) {
      const std::uint32_t tip = mesh.tetrahedra[one.tetrahedron()][one.opposite()];
      if (tip > one.high)
        tips.emplace_back(tip, one.tetrahedron());
    }
    std::sort(tips.begin(), tips.end());
    for (std::size_t n = 1; n < tips.size(); ++n)
      if (tips[n].first == tips[n - 1].first)
        again[tips[n].second] = true;
  });
  return again;
}

/// Whether the corners of face k, in its order, are an even permutation of ascending ones.
bool even(const Tetrahedron& t, std::uint32_t k) {
  const auto [a, b, c] = corners_of_face(t, k);
  return (a < b) == ((b < c) == (a < c));
}

class Examiner {
public:
  explicit Examiner(const TetMesh& mesh) : mesh_(mesh) {}

  TetReport examine() {
    report_.points = mesh_.points.size();
    report_.tetrahedra = mesh_.tetrahedra.size();
    examine_volumes();
    {
      const TetFaces faces(mesh_.points.size(), mesh_.tetrahedra);
      again_ = repeated(mesh_, faces);
      for (std::size_t t = 0; t < again_.size(); ++t)
        if (again_[t])
          report_.duplicates.add(static_cast<std::uint32_t>(t));
      examine_faces(faces);
    }
    examine_boundary();
    if (!mesh_.middles.empty())
      examine_middles();
    examine_points();
    return report_;
  }

private:
  void examine_volumes() {
    side_.resize(mesh_.tetrahedra.size());
    for (std::size_t t = 0; t < mesh_.tetrahedra.size(); ++t) {
      const Tetrahedron& corners = mesh_.tetrahedra[t];
      side_[t] = static_cast<std::int8_t>(side(mesh_, corners));
      if (side_[t] == 0)
        report_.flat.add(static_cast<std::uint32_t>(t));
      if (side_[t] < 0)
        report_.inverted.add(static_cast<std::uint32_t>(t));
      report_.volume += tetrahedron_volume(mesh_.points[corners[0]], mesh_.points[corners[1]],
                                           mesh_.points[corners[2]], mesh_.points[corners[3]]);
    }
  }

  void examine_faces(const TetFaces& faces) {
    std::vector<TetFace> proper;
    faces.for_each_face([&](std::uint32_t, std::span<const TetFace> face) {
      proper.clear();
      for (const TetFace& one : face)
        if (!again_[one.tetrahedron()])
          proper.push_back(one);
      if (proper.size() > 2)
        report_.crowded_faces.add(proper[0].tetrahedron());
      if (proper.size() == 2) {
        const std::array<int, 2> sides{side_of(proper[0]), side_of(proper[1])};
        if (sides[0] * sides[1] > 0)
          report_.overlapping_faces.add(proper[0].tetrahedron());
      }
      if (proper.size() == 1)
        outer_.push_back(proper[0].number);
    });
    std::sort(outer_.begin(), outer_.end());
    report_.boundary_triangles = outer_.size();
  }

  int side_of(const TetFace& face) const {
    const std::uint32_t t = face.tetrahedron();
    return even(mesh_.tetrahedra[t], face.opposite()) ? side_[t] : -side_[t];
  }

  void examine_boundary() {
    std::vector<Triangle> triangles;
    triangles.reserve(outer_.size());
    for (const std::uint32_t number : outer_)
      triangles.push_back(corners_of_face(mesh_.tetrahedra[number / 4], number % 4));
    DisjointSets corners(3 * triangles.size());
    const mesh::EdgeSides edges(mesh_.points.size(), triangles);
    edges.for_each_edge([&](std::uint32_t low, std::span<const mesh::EdgeSide> edge) {
      if (edge.size() != 2)
        report_.nonmanifold_edges.add(low);
      for (const mesh::EdgeSide& other : edge.subspan(1)) {
        corners.join(edge[0].low_corner(), other.low_corner());
        corners.join(edge[0].high_corner(), other.high_corner());
      }
    });
    constexpr std::uint32_t unseen = UINT32_MAX, split = UINT32_MAX - 1;
    std::vector<std::uint32_t> fan(mesh_.points.size(), unseen);
    for (std::uint32_t f = 0; f < triangles.size(); ++f)
      for (std::uint32_t k = 0; k < 3; ++k) {
        std::uint32_t& seen = fan[triangles[f][k]];
        const std::uint32_t root = corners.find(3 * f + k);
        if (seen == unseen) {
          seen = root;
        } else if (seen != split && seen != root) {
          seen = split;
          report_.nonmanifold_points.add(triangles[f][k]);
        }
      }
  }

  void examine_middles() {
    // The role of each node: a corner, the middle of the edge of that number, or several.
    constexpr std::uint32_t none = UINT32_MAX, corner = UINT32_MAX - 1;
    std::vector<std::uint32_t> role(mesh_.points.size(), none);
    for (const Tetrahedron& t : mesh_.tetrahedra)
      for (const std::uint32_t node : t)
        role[node] = corner;
    std::vector<bool> reused(mesh_.points.size());
    std::uint32_t number = 0;
    const TetEdges edges(mesh_.points.size(), mesh_.tetrahedra);
    edges.for_each_edge([&](std::uint32_t low, std::span<const TetEdge> edge) {
      bool split = false, curved = false;
      std::uint32_t node = none, first = none;
      for (const TetEdge& one : edge) {
        const std::uint32_t t = one.tetrahedron();
        if (again_[t])
          continue;
        const std::uint32_t middle = mesh_.middles[t][one.edge()];
        if (node == none)
          first = t;
        split = split || (node != none && middle != node);
        node = middle;
        curved = curved || is_curved(low, one.high, middle);
        if (role[middle] == none)
          role[middle] = number;
        else if (role[middle] != number)
          reused[middle] = true;
      }
      if (split)
        report_.split_edges.add(first);
      if (curved)
        report_.curved_edges.add(first);
      ++number;
    });
    for (std::size_t p = 0; p < reused.size(); ++p)
      if (reused[p])
        report_.reused_middles.add(static_cast<std::uint32_t>(p));
  }

  bool is_curved(std::uint32_t a, std::uint32_t b, std::uint32_t middle) const {
    const Vec3 &p = mesh_.points[a], &q = mesh_.points[b];
    const Vec3 straight = p * 0.5 + q * 0.5;
    return !(norm(mesh_.points[middle] - straight) <= curved_edge * norm(q - p));
  }

  void examine_points() {
    std::vector<bool> used(mesh_.points.size());
    for (const Tetrahedron& t : mesh_.tetrahedra)
      for (const std::uint32_t node : t)
        used[node] = true;
    for (const EdgeMiddles& m : mesh_.middles)
      for (const std::uint32_t node : m)
        used[node] = true;
    for (std::size_t p = 0; p < used.size(); ++p)
      if (!used[p])
        report_.unused_points.add(static_cast<std::uint32_t>(p));
  }

  const TetMesh& mesh_;
  TetReport report_;
  std::vector<std::int8_t> side_; // of each tetrahedron
  std::vector<bool> again_;       // repeats an earlier one
  std::vector<std::uint32_t> outer_;
};

} // namespace

TetReport examine_tetrahedra(const TetMesh& mesh) {
  return Examiner(mesh).examine();
}

void require_sound(const TetReport& report) {
  if (report.tetrahedra == 0)
    throw Error("no tetrahedra, expected at least one");
  std::string text;
  const auto add = [&](const TetFinding& finding, const char* what, const char* first) {
    if (finding.count > 0)
      text += (text.empty() ? "" : ", ") + std::to_string(finding.count) + " " + what +
              " (first: " + first + " " + std::to_string(finding.first) + ")";
  };
  add(report.inverted, "inverted tetrahedra", "tetrahedron");
  add(report.flat, "flat tetrahedra", "tetrahedron");
  add(report.duplicates, "repeated tetrahedra", "tetrahedron");
  add(report.crowded_faces, "faces of more than two tetrahedra", "at tetrahedron");
  add(report.overlapping_faces, "faces with both tetrahedra on one side", "at tetrahedron");
  add(report.split_edges, "edges with several middles", "at tetrahedron");
  add(report.reused_middles, "middles of several edges", "point");
  if (!text.empty())
    throw Error(text + ", expected none");
}

std::uint64_t drop_unused_points(TetMesh& mesh) {
  std::vector<std::uint32_t> number(mesh.points.size(), UINT32_MAX);
  const auto use = [&](const auto& elements) {
    for (const auto& element : elements)
      for (const std::uint32_t node : element)
        number[node] = 0;
  };
  use(mesh.tetrahedra);
  use(mesh.middles);
  std::uint32_t kept = 0;
  for (std::size_t p = 0; p < number.size(); ++p)
    if (number[p] == 0) {
      mesh.points[kept] = mesh.points[p];
      number[p] = kept++;
    }
  const std::uint64_t dropped = mesh.points.size() - kept;
  if (dropped == 0)
    return 0;
  mesh.points.resize(kept);
  const auto renumber = [&](auto& elements) {
    for (auto& element : elements)
      for (std::uint32_t& node : element)
        node = number[node];
  };
  renumber(mesh.tetrahedra);
  renumber(mesh.middles);
  return dropped;
}

TetRepair repair_tetrahedra(TetMesh& mesh, const TetRepairOptions& options) {
  TetRepair done;
  const std::vector<bool> again = repeated(mesh, TetFaces(mesh.points.size(), mesh.tetrahedra));
  std::size_t kept = 0;
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
    const int at = side(mesh, mesh.tetrahedra[t]);
    if ((options.flat && at == 0) || (options.duplicates && again[t])) {
      ++(options.flat && at == 0 ? done.dropped_flat : done.dropped_duplicates);
      continue;
    }
    Tetrahedron corners = mesh.tetrahedra[t];
    const bool turn = options.turn && at < 0;
    if (turn) {
      ++done.turned;
      std::swap(corners[0], corners[1]);
    }
    mesh.tetrahedra[kept] = corners;
    if (!mesh.material.empty())
      mesh.material[kept] = mesh.material[t];
    if (!mesh.middles.empty()) {
      EdgeMiddles middles = mesh.middles[t];
      if (turn) {
        std::swap(middles[1], middles[2]); // of 12 and 02
        std::swap(middles[3], middles[4]); // of 03 and 13
      }
      mesh.middles[kept] = middles;
    }
    ++kept;
  }
  mesh.tetrahedra.resize(kept);
  mesh.material.resize(mesh.material.empty() ? 0 : kept);
  mesh.middles.resize(mesh.middles.empty() ? 0 : kept);
  done.dropped_points = drop_unused_points(mesh);
  return done;
}

} // namespace gewebe::tetrahedra
