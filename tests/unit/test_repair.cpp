#include "repair/repair.h"

#include "base/error.h"
#include "mesh/check.h"
#include "mesh_fixtures.h"
#include "repair/weld.h"
#include "tests/unit/sanitizers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

namespace gewebe::test {
namespace {

const TriangleMesh& whole_sphere() {
  static const TriangleMesh mesh = test::sphere_mesh(3, 10, {3, -2, 1});
  return mesh;
}

TriangleMesh with_hole() {
  TriangleMesh mesh = whole_sphere(); // without the faces at two neighbours
  const std::uint32_t a = mesh.triangles[5][0], b = mesh.triangles[5][1];
  std::erase_if(mesh.triangles, [&](const Triangle& t) {
    return std::any_of(t.begin(), t.end(), [&](std::uint32_t c) { return c == a || c == b; });
  });
  repair::weld(mesh, {repair::Weld::none, false, true});
  return mesh;
}

TriangleMesh with_flipped_face() {
  TriangleMesh mesh = whole_sphere();
  std::swap(mesh.triangles[7][1], mesh.triangles[7][2]);
  return mesh;
}

TriangleMesh with_duplicate() {
  TriangleMesh mesh = whole_sphere();
  const auto [a, b, c] = mesh.triangles[9];
  mesh.triangles.insert(mesh.triangles.begin() + 40, Triangle{b, c, a});
  return mesh;
}

/// A face whose corners are on one line: a point on an edge that only the one side has.
TriangleMesh with_flat_face(double away) {
  TriangleMesh mesh = whole_sphere();
  const auto [a, b, c] = mesh.triangles[11];
  const auto m = static_cast<std::uint32_t>(mesh.points.size());
  mesh.points.push_back(mesh.points[a] * (1 - away) + mesh.points[b] * away);
  mesh.triangles[11] = {a, m, c};
  mesh.triangles.push_back({m, b, c});
  mesh.triangles.push_back({a, b, m});
  return mesh;
}

/// A point that stands twice, a rounding apart.
TriangleMesh with_crack() {
  TriangleMesh mesh = whole_sphere();
  const std::uint32_t from = mesh.triangles[3][0];
  mesh.points.push_back(mesh.points[from] + Vec3{1e-6, -1e-6, 1e-6});
  mesh.triangles[3][0] = static_cast<std::uint32_t>(mesh.points.size() - 1);
  return mesh;
}

std::uint64_t total(const repair::RepairReport& report) {
  std::uint64_t sum = 0;
  for (const repair::RepairReport::Line& line : report.lines())
    sum += line.count;
  return sum;
}

void expect_sound(const TriangleMesh& mesh, const std::string& what) {
  const mesh::MeshReport report = mesh::examine_mesh(mesh);
  EXPECT_TRUE(report.closed() && report.manifold() && report.oriented() && report.outward())
      << what;
  EXPECT_EQ(report.euler, 2) << what;
  EXPECT_EQ(report.zero_area_faces, 0U) << what;
  EXPECT_EQ(report.unused_points, 0U) << what;
}

struct Fault {
  const char* word;
  TriangleMesh mesh;
  std::uint64_t repair::RepairReport::*count;
  std::uint64_t faults = 1;
};
std::vector<Fault> faults() {
  return {{"weld", with_crack(), &repair::RepairReport::welded_points},
          {"duplicates", with_duplicate(), &repair::RepairReport::duplicate_faces},
          {"orientation", with_flipped_face(), &repair::RepairReport::turned_faces},
          {"degenerate", with_flat_face(0.4), &repair::RepairReport::degenerate_faces},
          {"degenerate", with_flat_face(5e-5), &repair::RepairReport::degenerate_faces, 2},
          {"holes", with_hole(), &repair::RepairReport::holes}};
}

TEST(Repair, EachWordMendsItsOwnFaultAndLeavesTheOthersAlone) {
  expect_sound(whole_sphere(), "the ball");
  for (const Fault& fault : faults())
    for (const char* const word : {"weld", "duplicates", "orientation", "degenerate", "holes"}) {
      const std::string what = std::string(word) + " of " + fault.word;
      TriangleMesh mesh = fault.mesh;
      const repair::RepairReport report =
          repair::repair_mesh(mesh, repair::parse_repair(word), Context{});
      if (std::string(word) == fault.word) {
        EXPECT_EQ(report.*fault.count, fault.faults) << what;
        expect_sound(mesh, what);
      } else if (std::string(word) == "holes" && std::string(fault.word) == "weld") {
        EXPECT_EQ(report.holes + report.holes_left, 1U) << "a crack is a hole";
      } else {
        EXPECT_EQ(total(report), 0U) << what;
        EXPECT_EQ(mesh.points, fault.mesh.points) << what;
        EXPECT_EQ(mesh.triangles, fault.mesh.triangles) << what;
      }
    }
}

TEST(Repair, AllMendsAllAtOnceAndASecondTimeNothing) {
  TriangleMesh mesh;
  for (const Fault& fault : faults()) {
    TriangleMesh moved = fault.mesh;
    const double x = 0.05 * static_cast<double>(mesh.points.size());
    for (Vec3& p : moved.points)
      p.x += x;
    test::append(mesh, moved);
  }
  const repair::RepairReport report =
      repair::repair_mesh(mesh, repair::parse_repair("all,weld:1e-4"), Context{});
  EXPECT_EQ(report.welded_points, 1U + 1U); // the crack, and the short edge
  EXPECT_EQ(report.duplicate_faces, 1U);
  EXPECT_EQ(report.turned_faces, 1U);
  EXPECT_EQ(report.degenerate_faces, 1U);
  EXPECT_EQ(report.holes, 1U);
  const mesh::MeshReport after = mesh::examine_mesh(mesh);
  EXPECT_TRUE(after.closed() && after.manifold() && after.outward());
  EXPECT_EQ(after.components, faults().size());
  const TriangleMesh before = mesh;
  EXPECT_EQ(total(repair::repair_mesh(mesh, repair::parse_repair("all"), Context{})), 0U);
  EXPECT_EQ(mesh.points, before.points);
  EXPECT_EQ(mesh.triangles, before.triangles);
}

TEST(Repair, AFilledHoleIsLikeItsSurroundings) {
  TriangleMesh mesh = with_hole();
  mesh.part.assign(mesh.triangles.size(), 3);
  mesh.material.assign(mesh.triangles.size(), 2);
  mesh.texcoords.assign(mesh.triangles.size(), {0.25F, 0.5F, 0.25F, 0.5F, 0.25F, 0.5F});
  const std::size_t faces = mesh.triangles.size();
  const repair::RepairReport report =
      repair::repair_mesh(mesh, repair::parse_repair("holes"), Context{});
  EXPECT_EQ(report.hole_faces, mesh.triangles.size() - faces);
  EXPECT_EQ(mesh.part, std::vector<std::int32_t>(mesh.triangles.size(), 3));
  EXPECT_EQ(mesh.material, std::vector<std::int32_t>(mesh.triangles.size(), 2));
  for (const auto& st : mesh.texcoords)
    EXPECT_EQ(st, (std::array<float, 6>{0.25F, 0.5F, 0.25F, 0.5F, 0.25F, 0.5F}));
  EXPECT_NEAR(signed_volume(mesh), signed_volume(whole_sphere()),
              0.02 * signed_volume(whole_sphere()));
}

TEST(Repair, HolesAreFilledUpToTheirSize) {
  TriangleMesh mesh = with_hole(); // of eight edges
  repair::RepairReport report =
      repair::repair_mesh(mesh, repair::parse_repair("holes:7"), Context{});
  EXPECT_EQ(report.holes, 0U);
  EXPECT_EQ(report.holes_left, 1U);
  EXPECT_EQ(mesh.triangles, with_hole().triangles);
  report = repair::repair_mesh(mesh, repair::parse_repair("holes:8"), Context{});
  EXPECT_EQ(report.holes, 1U);
  TriangleMesh alone;
  alone.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  alone.triangles = {{0, 1, 2}};
  EXPECT_EQ(repair::repair_mesh(alone, repair::parse_repair("all"), Context{}).holes_left, 1U);
  EXPECT_EQ(alone.triangles.size(), 1U);
}

/// A cone over a rim of so many edges that goes up and down at random.
TriangleMesh bent_cone(std::uint32_t edges) {
  std::mt19937 random(edges);
  TriangleMesh mesh;
  mesh.points.push_back({0, 0, 50});
  for (std::uint32_t n = 0; n < edges; ++n) {
    const double angle = 2 * M_PI * n / edges, r = 25 + static_cast<double>(random() % 1000) / 100;
    mesh.points.push_back({r * std::cos(angle), r * std::sin(angle),
                           static_cast<double>(random() % 4000) / 100 - 20});
    mesh.triangles.push_back({0, 1 + n, 1 + (n + 1) % edges});
  }
  return mesh;
}

TEST(Repair, HolesThatWouldBeSearchedForMinutesAreLeft) {
  repair::RepairOptions options = repair::parse_repair("holes");
  TriangleMesh mesh = bent_cone(100);
  repair::RepairReport report = repair::repair_mesh(mesh, options, Context{});
  EXPECT_EQ(report.holes, 1U);
  EXPECT_EQ(report.holes_bent, 0U);
  EXPECT_TRUE(mesh::examine_mesh(mesh).closed());
  mesh = bent_cone(static_cast<std::uint32_t>(options.searched_edges) + 1);
  report = repair::repair_mesh(mesh, options, Context{});
  EXPECT_EQ(report.holes, 0U);
  EXPECT_EQ(report.holes_left, 1U);
  EXPECT_EQ(report.holes_bent, 1U);
  // The limit is that of all together.
  mesh = {};
  for (int n = 0; n < 5; ++n) {
    TriangleMesh one = bent_cone(200);
    for (Vec3& p : one.points)
      p.x += 100 * n;
    test::append(mesh, one);
  }
  options.searched_edges = 300;
  report = repair::repair_mesh(mesh, options, Context{});
  EXPECT_EQ(report.holes, 3U); // 300³ / 200³
  EXPECT_EQ(report.holes_bent, 2U);
  // A long border alone is none.
  mesh = {};
  mesh.points.push_back({0, 0, 50});
  for (std::uint32_t n = 0; n < 10000; ++n) {
    const double angle = 2 * M_PI * n / 10000;
    mesh.points.push_back({30 * std::cos(angle), 30 * std::sin(angle), 5 * std::sin(7 * angle)});
    mesh.triangles.push_back({0, 1 + n, 1 + (n + 1) % 10000});
  }
  report = repair::repair_mesh(mesh, repair::parse_repair("holes"), Context{});
  EXPECT_EQ(report.holes, 1U);
  EXPECT_TRUE(mesh::examine_mesh(mesh).closed());
}

/// Double cones side by side, so high that all faces are needles, their faces in any order.
TriangleMesh double_cones(std::uint32_t count, std::uint32_t edges, double height) {
  TriangleMesh mesh;
  for (std::uint32_t cone = 0; cone < count; ++cone) {
    const auto first = static_cast<std::uint32_t>(mesh.points.size());
    const double x = 100 * cone;
    mesh.points.insert(mesh.points.end(), {{x, 0, height}, {x, 0, -height}});
    for (std::uint32_t n = 0; n < edges; ++n) {
      const double angle = 2 * M_PI * n / edges;
      const std::uint32_t a = first + 2 + n, b = first + 2 + (n + 1) % edges;
      mesh.points.push_back({x + 30 * std::cos(angle), 30 * std::sin(angle), 0});
      mesh.triangles.push_back({first, a, b});
      mesh.triangles.push_back({first + 1, b, a});
    }
  }
  std::shuffle(mesh.triangles.begin(), mesh.triangles.end(), std::mt19937(1));
  return mesh;
}

TEST(Repair, FacesThatMeetInAPointCostWhatTheyDoElsewhere) {
  for (const bool together : {false, true}) {
    TriangleMesh mesh = together ? double_cones(1, 4000, 1000) : double_cones(8, 500, 10000);
    const double volume = signed_volume(mesh);
    const repair::RepairReport report =
        repair::repair_mesh(mesh, repair::parse_repair("all"), Context{});
    EXPECT_EQ(report.degenerate_faces, 8000U);
    EXPECT_EQ(report.degenerate_left, 0U);
    const std::size_t gone = 8000 - mesh.triangles.size();
    EXPECT_GT(gone, 4000U);
    // An edge that goes takes two faces with it, and has few neighbours, but for one at the tips.
    EXPECT_GE(report.neighbours_asked, gone);
    EXPECT_LE(report.neighbours_asked, 8 * gone) << together;
    const mesh::MeshReport after = mesh::examine_mesh(mesh);
    EXPECT_TRUE(after.closed() && after.manifold() && after.outward());
    EXPECT_NEAR(signed_volume(mesh), volume, 1e-3 * volume);
  }
}

TEST(Repair, SheetsThatMeetInAnEdgeStayJoinedAndAreNoHoles) {
  // Three fans round one edge, and a flat face in the first.
  TriangleMesh mesh;
  mesh.points = {{0, 0, 0}, {0, 0, 4}, {5, 0, 2}, {-3, 4, 2}, {-3, -4, 2}, {2.5, 0, 1}};
  mesh.triangles = {{0, 5, 1}, {5, 2, 1}, {0, 2, 5}, {0, 1, 3}, {1, 0, 4}};
  const repair::RepairReport report =
      repair::repair_mesh(mesh, repair::parse_repair("degenerate,holes"), Context{});
  EXPECT_EQ(report.degenerate_faces, 1U);
  EXPECT_EQ(report.holes, 0U);
  EXPECT_GT(report.holes_left, 0U);
  const mesh::MeshReport after = mesh::examine_mesh(mesh);
  EXPECT_EQ(after.nonmanifold_edges, 1U);
  EXPECT_EQ(after.components, 1U);
}

TEST(Repair, WeldKeepsClosedPartsApartAndJoinsPatches) {
  TriangleMesh two = whole_sphere();
  test::append(two, whole_sphere());
  two.part.assign(two.triangles.size(), 0);
  std::fill(two.part.begin() + static_cast<std::ptrdiff_t>(whole_sphere().triangles.size()),
            two.part.end(), 1);
  for (std::size_t p = whole_sphere().points.size(); p < two.points.size(); ++p)
    two.points[p].x += 1e-7;
  TriangleMesh mesh = two;
  EXPECT_EQ(repair::repair_mesh(mesh, repair::parse_repair("weld"), Context{}).welded_points, 0U);
  EXPECT_EQ(mesh::examine_mesh(mesh).components, 2U);

  // One ball in two patches with points of their own, a rounding apart.
  TriangleMesh patches = whole_sphere();
  patches.part.resize(patches.triangles.size());
  std::vector<std::uint32_t> copy(patches.points.size(), UINT32_MAX);
  for (std::size_t t = 0; t < patches.triangles.size(); ++t) {
    const Vec3 middle = patches.points[patches.triangles[t][0]];
    if (middle.z < 1)
      continue;
    patches.part[t] = 1;
    for (std::uint32_t& corner : patches.triangles[t]) {
      if (copy[corner] == UINT32_MAX) {
        copy[corner] = static_cast<std::uint32_t>(patches.points.size());
        patches.points.push_back(patches.points[corner] + Vec3{0, 0, 1e-7});
      }
      corner = copy[corner];
    }
  }
  EXPECT_GT(mesh::examine_mesh(patches).boundary_edges, 0U);
  EXPECT_GT(repair::repair_mesh(patches, repair::parse_repair("weld"), Context{}).welded_points,
            0U);
  const mesh::MeshReport joined = mesh::examine_mesh(patches);
  EXPECT_TRUE(joined.closed() && joined.manifold());
  EXPECT_EQ(joined.components, 1U);
}

TEST(Repair, WeldReachesAsFarAsItsDistance) {
  // Crosswise too: the points lie in one cell of the search, in the next, and round corners.
  for (int seed = 0; seed < 40; ++seed) {
    const double angle = 0.37 * seed, z = std::sin(1.7 * seed), r = std::sqrt(1 - z * z);
    const Vec3 out{r * std::cos(angle), r * std::sin(angle), z};
    for (const double part : {0.98, 1.02}) {
      TriangleMesh mesh = whole_sphere();
      const std::uint32_t from = mesh.triangles[3][0];
      mesh.points.push_back(mesh.points[from] + out * (0.01 * part));
      mesh.triangles[3][0] = static_cast<std::uint32_t>(mesh.points.size() - 1);
      const repair::RepairReport report =
          repair::repair_mesh(mesh, repair::parse_repair("weld:0.01"), Context{});
      EXPECT_EQ(report.welded_points, part < 1 ? 1U : 0U) << seed;
    }
  }
}

TEST(Repair, WhatBelongsToFacesStaysWithThem) {
  // Two faces stand twice and one is turned; each face has its own numbers.
  TriangleMesh mesh = whole_sphere();
  const auto mark = [](const TriangleMesh& m, const Triangle& t, std::size_t corner) {
    return static_cast<float>(m.points[t[corner]].x + 3 * m.points[t[corner]].z);
  };
  mesh.triangles.insert(mesh.triangles.begin() + 20, mesh.triangles[4]);
  mesh.triangles.insert(mesh.triangles.begin() + 90, mesh.triangles[60]);
  std::swap(mesh.triangles[150][1], mesh.triangles[150][2]);
  std::swap(mesh.triangles[7][0], mesh.triangles[7][1]);
  const auto number = [](const Triangle& t) {
    return static_cast<std::int32_t>(t[0] + t[1] + t[2]);
  };
  for (const Triangle& t : mesh.triangles) {
    mesh.part.push_back(0);
    mesh.material.push_back(number(t));
    mesh.texcoords.push_back({mark(mesh, t, 0), 1, mark(mesh, t, 1), 2, mark(mesh, t, 2), 3});
    for (std::size_t c = 0; c < 3; ++c)
      mesh.texcoords.back()[2 * c + 1] = mark(mesh, t, c) / 2;
  }
  const repair::RepairReport report =
      repair::repair_mesh(mesh, repair::parse_repair("duplicates,orientation"), Context{});
  EXPECT_EQ(report.duplicate_faces, 2U);
  EXPECT_EQ(report.turned_faces, 2U);
  ASSERT_EQ(mesh.triangles.size(), whole_sphere().triangles.size());
  ASSERT_EQ(mesh.material.size(), mesh.triangles.size());
  ASSERT_EQ(mesh.texcoords.size(), mesh.triangles.size());
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    const Triangle& t = mesh.triangles[f];
    EXPECT_EQ(mesh.material[f], number(t)) << f;
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_EQ(mesh.texcoords[f][2 * c], mark(mesh, t, c)) << f;
      EXPECT_EQ(mesh.texcoords[f][2 * c + 1], mark(mesh, t, c) / 2) << f;
    }
  }
}

TEST(Repair, OrientationTurnsWholePartsOutwardAndCavitiesInward) {
  TriangleMesh mesh = whole_sphere();
  TriangleMesh inner = test::sphere_mesh(2, 5, {3, -2, 1});
  test::append(mesh, inner); // a cavity, but facing outward
  const auto faces = static_cast<std::ptrdiff_t>(whole_sphere().triangles.size());
  TriangleMesh one = mesh;
  EXPECT_EQ(repair::repair_mesh(one, repair::parse_repair("orientation"), Context{}).turned_faces,
            inner.triangles.size());
  EXPECT_TRUE(mesh::examine_mesh(one).outward());
  // As parts both are solids.
  mesh.part.assign(mesh.triangles.size(), 0);
  std::fill(mesh.part.begin() + faces, mesh.part.end(), 1);
  EXPECT_EQ(repair::repair_mesh(mesh, repair::parse_repair("orientation"), Context{}).turned_faces,
            0U);
  for (Triangle& t : mesh.triangles)
    std::swap(t[0], t[1]);
  EXPECT_EQ(repair::repair_mesh(mesh, repair::parse_repair("orientation"), Context{}).turned_faces,
            mesh.triangles.size());
}

TEST(Repair, UnderstandsWordsAndRefusesOthers) {
  EXPECT_EQ(repair::parse_repair(""), repair::RepairOptions{});
  EXPECT_EQ(repair::parse_repair("all"),
            repair::parse_repair("weld,duplicates,orientation,degenerate,holes"));
  EXPECT_EQ(repair::parse_repair("all,weld:0.5").weld, 0.5);
  EXPECT_EQ(repair::parse_repair("weld:0.5,all").weld, 0.5);
  EXPECT_EQ(repair::parse_repair("holes:12,all").holes, 12U);
  EXPECT_EQ(repair::parse_repair("all,holes:12").holes, 12U);
  for (const char* const text :
       {"wled", "all,", ",all", "weld:", "weld:0", "weld:-1", "weld:nan", "weld:inf", "weld:1x",
        "holes:2.5", "holes:0", "all:3", "duplicates:1", "holes:1e300"})
    EXPECT_THROW((void)repair::parse_repair(text), Error) << text;
  TriangleMesh mesh = whole_sphere();
  EXPECT_THROW((void)repair::repair_mesh(mesh, repair::parse_repair("weld:1e-300"), Context{}),
               Error);
}

TEST(Repair, OfDirtyOrgans) {
  if (test::under_sanitizers())
    GTEST_SKIP() << "takes 40 s with sanitizers";
  for (const char* const name : {"hubmap_M_liver_dirty.obj", "hubmap_female_reproductive.obj"}) {
    TriangleMesh mesh = test::load_test_mesh(name);
    if (mesh.triangles.empty())
      GTEST_SKIP() << "no " << name;
    const mesh::MeshReport before = mesh::examine_mesh(mesh);
    repair::RepairReport report = repair::repair_mesh(mesh, repair::parse_repair("all"), Context{});
    const mesh::MeshReport after = mesh::examine_mesh(mesh);
    EXPECT_GE(report.duplicate_faces, before.duplicate_faces) << name;
    EXPECT_GT(report.holes, 0U) << name;
    EXPECT_EQ(after.duplicate_faces, 0U) << name;
    EXPECT_LT(after.boundary_edges, before.boundary_edges) << name;
    EXPECT_LE(after.misoriented_edges, before.misoriented_edges) << name;
    EXPECT_EQ(after.unused_points, 0U) << name;
    report = repair::repair_mesh(mesh, repair::parse_repair("duplicates,orientation"), Context{});
    EXPECT_EQ(report.duplicate_faces, 0U) << name;
  }
}

} // namespace
} // namespace gewebe::test
