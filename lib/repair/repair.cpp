#include "repair/repair.h"

#include "base/disjoint_sets.h"
#include "base/error.h"
#include "mesh/border.h"
#include "mesh/edges.h"
#include "mesh/repeated_faces.h"
#include "repair/orient_closed.h"
#include "repair/oriented_surface.h"
#include "repair/repair_internal.h"
#include "repair/weld.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <span>
#include <unordered_map>
#include <utility>

namespace gewebe::repair {

namespace {

using Cell = std::array<double, 3>;
struct CellHash {
  std::size_t operator()(const Cell& cell) const {
    std::uint64_t h = 0;
    for (const double c : cell) {
      h ^= std::bit_cast<std::uint64_t>(c + 0.0); // -0 + 0 is 0
      h *= 0x9e3779b97f4a7c15U;
      h ^= h >> 32;
    }
    return h;
  }
};

/// Moves each of the points to the first one that a chain of distances up to `distance` leads to;
/// only points with equal labels meet.
void gather(std::vector<Vec3>& points, const std::vector<std::uint32_t>& some,
            const std::vector<std::uint32_t>& label, double distance) {
  std::unordered_map<Cell, std::vector<std::uint32_t>, CellHash> cells;
  DisjointSets sets(points.size());
  for (const std::uint32_t p : some) {
    const Vec3 at = points[p];
    const Cell own{std::floor(at.x / distance), std::floor(at.y / distance),
                   std::floor(at.z / distance)};
    for (unsigned n = 0; n < 27; ++n) {
      const std::array<unsigned, 3> step{n % 3, n / 3 % 3, n / 9};
      const auto near =
          cells.find({own[0] + step[0] - 1, own[1] + step[1] - 1, own[2] + step[2] - 1});
      if (near == cells.end())
        continue;
      for (const std::uint32_t q : near->second)
        if (label[q] == label[p] && norm(points[q] - at) <= distance)
          sets.join(p, q);
    }
    cells[own].push_back(p);
  }
  for (const std::uint32_t p : some)
    points[p] = points[sets.find(p)];
}

void weld_near(TriangleMesh& mesh, double distance, RepairReport& report) {
  const double side = bounding_box(mesh).longest_side();
  if (distance == 0)
    distance = repair_weld_share * side;
  if (!(side > 0))
    return; // all at one place, or no point: equal points are no nearer than that
  if (!(distance >= 1e-12 * side))
    throw Error("a distance below 1e-12 of the mesh's size, expected a longer one");
  const auto join = [&](Weld mode) {
    const WeldResult result = weld(mesh, {mode, true, false});
    report.welded_points += result.welded;
    report.collapsed_faces += result.degenerate_removed;
  };
  constexpr std::uint32_t unused = UINT32_MAX;
  std::vector<std::uint32_t> label(mesh.points.size(), unused), used;
  std::unordered_map<std::int32_t, std::uint32_t> of_part;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (const std::uint32_t corner : mesh.triangles[t]) {
      const std::int32_t part = mesh.part.empty() ? 0 : mesh.part[t];
      const auto next = static_cast<std::uint32_t>(of_part.size());
      label[corner] = std::min(label[corner], of_part.emplace(part, next).first->second);
    }
  for (std::uint32_t p = 0; p < label.size(); ++p)
    if (label[p] != unused)
      used.push_back(p);
  gather(mesh.points, used, label, distance);
  join(Weld::part);
  if (of_part.size() < 2)
    return;
  label.assign(mesh.points.size(), 0);
  gather(mesh.points, mesh::border_points(mesh.points.size(), mesh.triangles), label, distance);
  join(Weld::borders);
}

template <class T>
void drop_marked(std::vector<T>& values, const std::vector<bool>& marked) {
  if (values.empty())
    return;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < marked.size(); ++i)
    if (!marked[i])
      values[kept++] = values[i];
  values.resize(kept);
}

void drop_duplicates(TriangleMesh& mesh, RepairReport& report) {
  const std::vector<bool> repeated =
      mesh::repeated_faces(mesh.points.size(), mesh.triangles, mesh::SameFace::corners);
  report.duplicate_faces = static_cast<std::uint64_t>(std::ranges::count(repeated, true));
  if (report.duplicate_faces == 0)
    return;
  drop_marked(mesh.triangles, repeated);
  drop_marked(mesh.texcoords, repeated);
  drop_marked(mesh.part, repeated);
  drop_marked(mesh.material, repeated);
}

void turn(TriangleMesh& mesh, std::uint32_t face) {
  std::swap(mesh.triangles[face][1], mesh.triangles[face][2]);
  if (mesh.texcoords.empty())
    return;
  auto& st = mesh.texcoords[face];
  std::swap(st[2], st[4]);
  std::swap(st[3], st[5]);
}

/// Orients what hangs together by edges or is one part: solids that lie in each other as different
/// parts are no cavities.
void orient(TriangleMesh& mesh, RepairReport& report) {
  DisjointSets sets(mesh.triangles.size());
  mesh::EdgeSides(mesh.points.size(), mesh.triangles)
      .for_each_edge([&](std::uint32_t, std::span<const mesh::EdgeSide> edge) {
        for (const mesh::EdgeSide& side : edge)
          sets.join(edge[0].face(), side.face());
      });
  std::vector<std::uint32_t> connected;
  (void)sets.number(connected);
  std::unordered_map<std::int32_t, std::uint32_t> first_of_part;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
    sets.join(t, first_of_part.emplace(mesh.part.empty() ? 0 : mesh.part[t], t).first->second);
  std::vector<std::uint32_t> group;
  std::vector<std::vector<std::uint32_t>> faces(sets.number(group));
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
    faces[group[t]].push_back(t);
  for (const std::vector<std::uint32_t>& own : faces) {
    std::vector<Triangle> before, after;
    for (const std::uint32_t t : own)
      before.push_back(mesh.triangles[t]);
    std::vector<std::uint32_t> turned;
    after = before;
    if (orient_closed(mesh.points, after)) {
      for (std::size_t n = 0; n < own.size(); ++n)
        if (after[n] != before[n])
          turned.push_back(own[n]);
    } else {
      std::vector<std::int32_t> label; // touching is not hanging together
      for (const std::uint32_t t : own)
        label.push_back(static_cast<std::int32_t>(connected[t]));
      const OrientedSurface surface = orient_surface(mesh.points, before, label);
      for (std::size_t n = 0; n < surface.source.size(); ++n) {
        const std::uint32_t source = surface.source[n];
        if (mesh.points[surface.triangles[n][1]] != mesh.points[before[source][1]])
          turned.push_back(own[source]);
      }
    }
    for (const std::uint32_t t : turned)
      turn(mesh, t);
    report.turned_faces += turned.size();
  }
}

std::optional<double> number_of(std::string_view word) {
  double value = 0;
  const auto [rest, status] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (status != std::errc{} || rest != word.data() + word.size() || !(value > 0) ||
      !std::isfinite(value))
    return std::nullopt;
  return value;
}

} // namespace

RepairOptions parse_repair(std::string_view text) {
  RepairOptions options;
  if (text.empty())
    return options;
  const auto refuse = [](std::string_view word) {
    throw Error("'" + std::string(word) +
                "', expected weld[:MM], duplicates, orientation, degenerate, holes[:EDGES] or all");
  };
  for (;;) {
    const std::size_t comma = std::min(text.find(','), text.size());
    const std::string_view word = text.substr(0, comma);
    const std::size_t colon = std::min(word.find(':'), word.size());
    const std::string_view name = word.substr(0, colon);
    std::optional<double> number;
    if (colon < word.size()) {
      number = number_of(word.substr(colon + 1));
      if (!number || (name != "weld" && name != "holes") ||
          (name == "holes" && (*number != std::floor(*number) || *number > 1e9)))
        refuse(word);
    }
    const bool all = name == "all";
    if (all || name == "weld")
      options.weld = number.value_or(options.weld.value_or(0));
    if (all || name == "duplicates")
      options.duplicates = true;
    if (all || name == "orientation")
      options.orientation = true;
    if (all || name == "degenerate")
      options.degenerate = true;
    if (number && name == "holes")
      options.holes = static_cast<std::uint64_t>(*number);
    else if ((all || name == "holes") && !options.holes)
      options.holes = UINT64_MAX;
    if (!all && name != "weld" && name != "duplicates" && name != "orientation" &&
        name != "degenerate" && name != "holes")
      refuse(word);
    if (comma == text.size())
      return options;
    text.remove_prefix(comma + 1);
  }
}

std::vector<RepairReport::Line> RepairReport::lines() const {
  return {{"repaired_points", welded_points, "points were welded", false},
          {"repaired_collapsed", collapsed_faces, "faces had no extent after welding", false},
          {"repaired_duplicates", duplicate_faces, "faces stood twice", false},
          {"repaired_orientation", turned_faces, "faces were turned", false},
          {"repaired_degenerate", degenerate_faces, "faces without area were removed", false},
          {"repaired_holes", holes, "holes were filled", false},
          {"hole_points", hole_points, "points are new in them", false},
          {"hole_faces", hole_faces, "faces are new in them", false},
          {"degenerate_left", degenerate_left, "faces without area could not be removed", true},
          {"holes_left", holes_left, "holes were not filled", true},
          {"holes_bent", holes_bent,
           "of these are so long and bent that the search for triangles would take minutes", true}};
}

RepairReport repair_mesh(TriangleMesh& mesh, const RepairOptions& options, const Context& context) {
  const auto pause = [&] {
    if (context.cancelled && context.cancelled())
      throw Cancelled();
  };
  RepairReport report;
  const std::size_t points = mesh.points.size(), faces = mesh.triangles.size();
  if (options.weld)
    weld_near(mesh, *options.weld, report);
  pause();
  if (options.duplicates)
    drop_duplicates(mesh, report);
  if (options.orientation)
    orient(mesh, report);
  pause();
  if (options.degenerate || options.holes) {
    const auto bytes = 1000 * static_cast<double>(mesh.triangles.size());
    require_memory(context, bytes, "the repair of the mesh");
    repair::with_cgal(mesh, options, report);
  }
  if (mesh.points.size() != points || mesh.triangles.size() != faces || report.turned_faces != 0 ||
      report.degenerate_faces != 0)
    mesh.normals.clear();
  return report;
}

} // namespace gewebe::repair
