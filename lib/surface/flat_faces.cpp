#include "surface/flat_faces_internal.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <unordered_map>

namespace gewebe::surface {
namespace {

/// Faces round points, while edges are flipped.
class Stars {
public:
  explicit Stars(const TriangleMesh& mesh)
      : mesh_(mesh), first_(mesh.points.size() + 1), faces_(3 * mesh.triangles.size()) {
    for (const Triangle& t : mesh.triangles)
      for (const std::uint32_t corner : t)
        ++first_[corner + 1];
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
    for (std::uint32_t n = 0; n < mesh.triangles.size(); ++n)
      for (const std::uint32_t corner : mesh.triangles[n])
        faces_[next[corner]++] = n;
  }
  void add(std::uint32_t point, std::uint32_t face) { added_[point].push_back(face); }
  /// Calls visit(face, place of the point in it) for each face round a point until it answers true.
  template <class Visit>
  bool any(std::uint32_t point, const Visit& visit) const {
    const auto look = [&](std::uint32_t face) {
      const Triangle& t = mesh_.triangles[face];
      const auto at = std::ranges::find(t, point);
      return at != t.end() && visit(face, static_cast<std::size_t>(at - t.begin()));
    };
    if (std::any_of(faces_.begin() + first_[point], faces_.begin() + first_[point + 1], look))
      return true;
    const auto more = added_.find(point);
    return more != added_.end() && std::ranges::any_of(more->second, look);
  }

private:
  const TriangleMesh& mesh_;
  std::vector<std::uint32_t> first_, faces_;
  std::unordered_map<std::uint32_t, std::vector<std::uint32_t>> added_;
};

double squared_length(const TriangleMesh& mesh, std::uint32_t a, std::uint32_t b) {
  const Vec3 edge = mesh.points[b] - mesh.points[a];
  return dot(edge, edge);
}

/// The place in the face from which its longest edge runs to the next.
std::size_t longest_edge(const TriangleMesh& mesh, const Triangle& t) {
  std::size_t longest = 0;
  for (std::size_t n = 1; n < 3; ++n)
    if (squared_length(mesh, t[n], t[(n + 1) % 3]) >
        squared_length(mesh, t[longest], t[(longest + 1) % 3]))
      longest = n;
  return longest;
}

bool is_flat(const TriangleMesh& mesh, const Triangle& t) {
  return has_no_area(mesh.points[t[0]], mesh.points[t[1]], mesh.points[t[2]], world_tolerance);
}

/// Flips the longest edge of a face; false if that is impossible or would not make the flat faces
/// smaller. \param made  the face and its former neighbour
bool flip(TriangleMesh& mesh, Stars& stars, std::uint32_t face,
          std::array<std::uint32_t, 2>& made) {
  const Triangle t = mesh.triangles[face];
  const std::size_t at = longest_edge(mesh, t);
  const std::uint32_t a = t[at], c = t[(at + 1) % 3], b = t[(at + 2) % 3];
  if (a == b || b == c || c == a)
    return false;
  std::uint32_t other = face, d = 0; // on the other side of the edge, which it runs from c to a
  const bool found = stars.any(c, [&](std::uint32_t n, std::size_t place) {
    const Triangle& u = mesh.triangles[n];
    if (u[(place + 1) % 3] != a)
      return false;
    other = n;
    d = u[(place + 2) % 3];
    return true;
  });
  if (!found || d == b || stars.any(b, [&](std::uint32_t n, std::size_t) {
        return std::ranges::find(mesh.triangles[n], d) != mesh.triangles[n].end();
      }))
    return false;
  const Triangle first{a, d, b}, second{b, d, c};
  const double longest = squared_length(mesh, a, c);
  for (const Triangle& next : {first, second}) {
    const std::size_t edge = longest_edge(mesh, next);
    if (is_flat(mesh, next) && !(squared_length(mesh, next[edge], next[(edge + 1) % 3]) < longest))
      return false;
  }
  mesh.triangles[face] = first;
  mesh.triangles[other] = second;
  stars.add(d, face);
  stars.add(b, other);
  made = {face, other};
  return true;
}

} // namespace

bool has_no_area(const Vec3& a, const Vec3& b, const Vec3& c, double tolerance) {
  const Vec3 u = b - a, v = c - a, w = c - b;
  const double longest = std::max({dot(u, u), dot(v, v), dot(w, w)});
  return !(norm(cross(u, v)) > tolerance * longest);
}

std::vector<std::uint32_t> flip_flat_faces(TriangleMesh& mesh, std::vector<std::uint32_t> flat) {
  if (flat.empty())
    return flat;
  Stars stars(mesh);
  for (bool changed = true; changed;) {
    changed = false;
    std::vector<std::uint32_t> left;
    for (const std::uint32_t face : flat) {
      std::array<std::uint32_t, 2> made{};
      if (!is_flat(mesh, mesh.triangles[face]))
        continue;
      if (!flip(mesh, stars, face, made)) {
        left.push_back(face);
        continue;
      }
      changed = true;
      for (const std::uint32_t n : made)
        if (is_flat(mesh, mesh.triangles[n]))
          left.push_back(n);
    }
    std::ranges::sort(left);
    left.erase(std::unique(left.begin(), left.end()), left.end());
    flat = std::move(left);
  }
  return flat;
}

} // namespace gewebe::surface
