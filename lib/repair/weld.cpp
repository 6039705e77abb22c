#include "repair/weld.h"

#include "base/disjoint_sets.h"
#include "mesh/border.h"
#include "mesh/edges.h"

#include <algorithm>
#include <bit>
#include <functional>

namespace gewebe::repair {
namespace {

// From (position, part) to the first point seen there. Open addressing, at most half full.
class PositionTable {
public:
  PositionTable(const std::vector<Vec3>& points, std::size_t keys)
      : points_(points), slots_(std::bit_ceil(2 * keys + 2)) {}

  /// The point entered first at the position of `point` with this part; enters `point` if there is
  /// none.
  std::uint32_t first_at(std::uint32_t point, std::int32_t part) {
    const Vec3& p = points_[point];
    std::size_t at = hash(p, part) & (slots_.size() - 1);
    while (slots_[at].point != free) {
      if (slots_[at].part == part && points_[slots_[at].point] == p)
        return slots_[at].point;
      at = (at + 1) & (slots_.size() - 1);
    }
    slots_[at] = {point, part};
    return point;
  }

private:
  static constexpr std::uint32_t free = UINT32_MAX;
  struct Slot {
    std::uint32_t point = free;
    std::int32_t part = 0;
  };

  static std::size_t hash(const Vec3& p, std::int32_t part) {
    std::uint64_t h = static_cast<std::uint32_t>(part);
    for (int axis = 0; axis < 3; ++axis) {
      h ^= std::bit_cast<std::uint64_t>(p[axis] + 0.0); // -0 + 0 is 0
      h *= 0x9e3779b97f4a7c15u;
      h ^= h >> 29;
      h *= 0xbf58476d1ce4e5b9u;
      h ^= h >> 32;
    }
    return h;
  }

  const std::vector<Vec3>& points_;
  std::vector<Slot> slots_;
};

void join_within_parts(const TriangleMesh& mesh, DisjointSets& sets) {
  const std::size_t corners = 3 * mesh.triangles.size();
  PositionTable table(mesh.points,
                      mesh.part.empty() ? std::min(corners, mesh.points.size()) : corners);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (const std::uint32_t point : mesh.triangles[t])
      sets.join(point, table.first_at(point, mesh.part.empty() ? 0 : mesh.part[t]));
}

void join_everywhere(const TriangleMesh& mesh, DisjointSets& sets) {
  PositionTable table(mesh.points, mesh.points.size());
  for (std::uint32_t p = 0; p < mesh.points.size(); ++p)
    sets.join(p, table.first_at(p, 0));
}

std::uint64_t join_borders(const TriangleMesh& mesh, DisjointSets& sets) {
  std::vector<Triangle> joined_so_far = mesh.triangles;
  for (Triangle& t : joined_so_far)
    for (std::uint32_t& corner : t)
      corner = sets.find(corner);
  const std::vector<std::uint32_t> border = mesh::border_points(mesh.points.size(), joined_so_far);
  PositionTable table(mesh.points, border.size());
  std::uint64_t joined = 0;
  for (const std::uint32_t p : border)
    joined += sets.join(p, table.first_at(p, 0));
  return joined;
}

bool has_several_parts(const TriangleMesh& mesh) {
  return std::adjacent_find(mesh.part.begin(), mesh.part.end(), std::not_equal_to<>()) !=
         mesh.part.end();
}

template <class T>
void keep(std::vector<T>& values, std::size_t from, std::size_t to) {
  if (!values.empty())
    values[to] = values[from];
}

template <class T>
void shrink(std::vector<T>& values, std::size_t size) {
  if (!values.empty())
    values.resize(size);
}

std::uint64_t remove_degenerate(TriangleMesh& mesh) {
  std::size_t kept = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (mesh::has_equal_corners(mesh.triangles[t]))
      continue;
    keep(mesh.triangles, t, kept);
    keep(mesh.texcoords, t, kept);
    keep(mesh.part, t, kept);
    keep(mesh.material, t, kept);
    ++kept;
  }
  const std::uint64_t removed = mesh.triangles.size() - kept;
  shrink(mesh.triangles, kept);
  shrink(mesh.texcoords, kept);
  shrink(mesh.part, kept);
  shrink(mesh.material, kept);
  return removed;
}

// Keeps the points marked in `used` and renumbers the corners.
void compact_points(TriangleMesh& mesh, const std::vector<char>& used) {
  std::vector<std::uint32_t> new_index(mesh.points.size());
  std::uint32_t count = 0;
  for (std::size_t p = 0; p < mesh.points.size(); ++p) {
    if (!used[p])
      continue;
    keep(mesh.points, p, count);
    keep(mesh.normals, p, count);
    new_index[p] = count++;
  }
  shrink(mesh.points, count);
  shrink(mesh.normals, count);
  for (Triangle& t : mesh.triangles)
    for (std::uint32_t& corner : t)
      corner = new_index[corner];
}

} // namespace

WeldResult weld(TriangleMesh& mesh, const WeldOptions& options) {
  WeldResult result;
  result.points_before = mesh.points.size();
  DisjointSets sets(mesh.points.size());
  if (options.mode == Weld::all)
    join_everywhere(mesh, sets);
  if (options.mode == Weld::part || options.mode == Weld::borders)
    join_within_parts(mesh, sets);
  if (options.mode == Weld::borders && has_several_parts(mesh))
    result.welded_across_parts = join_borders(mesh, sets);

  for (Triangle& t : mesh.triangles)
    for (std::uint32_t& corner : t)
      corner = sets.find(corner);
  if (options.drop_degenerate)
    result.degenerate_removed = remove_degenerate(mesh);

  std::vector<char> used(mesh.points.size());
  for (std::uint32_t p = 0; p < mesh.points.size(); ++p) {
    used[p] = sets.find(p) == p;
    result.welded += !used[p];
  }
  if (options.drop_unused) {
    std::fill(used.begin(), used.end(), 0);
    for (const Triangle& t : mesh.triangles)
      for (const std::uint32_t corner : t)
        used[corner] = 1;
  }
  compact_points(mesh, used);
  result.points_after = mesh.points.size();
  result.unused_removed = result.points_before - result.welded - result.points_after;
  return result;
}

} // namespace gewebe::repair
