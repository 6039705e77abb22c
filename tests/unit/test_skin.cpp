// Surfaces that follow the elements of a solid: which element, how, in files.

#include "base/error.h"
#include "embedding/skin.h"
#include "fem/solid_model.h"
#include "formats/model/ela.h"
#include "mesh/nearest_point.h"
#include "model_meshes.h"
#include "tests/unit/complaint.h"
#include "tests/unit/larger.h"
#include "tet_fixtures.h"
#include "tetrahedra/boundary.h"
#include "tetrahedra/tet_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <vector>

namespace gewebe::test {
namespace {

/// A box 2 × 2 × 2 whose inner nodes stand anywhere, of two materials.
model::Model box_model(bool quadratic) {
  tetrahedra::TetMesh mesh = test::distorted_box();
  fem::SolidModelOptions options;
  options.material.materials = {{"gel", 1.1e-3, 5000, 1, 0.2, 0.4},
                                {"stone", 2e-3, 20000, 1, 0.2, 0.2}};
  options.quadratic = quadratic;
  return fem::solid_model(std::move(mesh), options, {});
}

/// A ball about the box's middle with texture coordinates: of radius 0.8 inside it, of 1.3 in and
/// out.
TriangleMesh textured_ball(double radius) {
  TriangleMesh mesh = test::ball(3, radius, {1, 1, 1});
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    mesh.texcoords.push_back({0.1F, 0, 1, 0.25F, 0.5F, static_cast<float>(t % 7)});
  return mesh;
}

template <class Field>
std::vector<double> displacement(const model::Model& model, const Field& field) {
  std::vector<double> u;
  for (const model::Node& node : model.nodes) {
    const Vec3 at = field(node.position);
    u.insert(u.end(), {at.x, at.y, at.z});
  }
  return u;
}

Vec3 affine(const Vec3& p) {
  return {1 + 2 * p.x - p.y, 0.5 * p.z - 3 * p.x, p.x + p.y + p.z};
}
Vec3 bent(const Vec3& p) {
  return {p.x * p.x - 2 * p.y * p.z, p.z * p.z + p.x * p.y, 3 * p.y * p.y - p.x * p.z};
}

/// The largest distance of the displaced skin from its points displaced by `field`.
template <class Field>
double error_of(model::Model& model, const TriangleMesh& surface, const Field& field) {
  (void)embedding::add_skin(model, surface, {}, {});
  model::check_model(model);
  const std::vector<Vec3> moved = embedding::displaced_skin(
      embedding::skin_weights(model), model.skin.points, displacement(model, field));
  double most = 0;
  for (std::size_t p = 0; p < moved.size(); ++p)
    most = test::larger(most, norm(moved[p] - model.skin.points[p] - field(model.skin.points[p])));
  return most;
}

bool inside(const Vec3& p) {
  return p.x >= 0 && p.y >= 0 && p.z >= 0 && p.x <= 2 && p.y <= 2 && p.z <= 2;
}

TEST(Skin, FollowsWhatElementsHoldExactly) {
  for (const bool quadratic : {false, true}) {
    model::Model model = box_model(quadratic);
    EXPECT_LT(error_of(model, textured_ball(0.8), affine), 1e-13) << quadratic;
    EXPECT_LT(error_of(model, textured_ball(1.3), affine), 1e-12) << quadratic; // outside too
    if (quadratic)
      EXPECT_LT(error_of(model, textured_ball(0.8), bent), 1e-12);
    else
      EXPECT_GT(error_of(model, textured_ball(0.8), bent), 1e-2); // linear elements hold no bend
  }
}

TEST(Skin, GoesOnOutsideWithTheStrainThatItLeft) {
  model::Model model = box_model(true);
  TriangleMesh surface;
  surface.points = {{1.2, 0.9, 3.5}, {4, 1.1, 0.7}, {-3, -2, 1.4}};
  surface.triangles = {{0, 1, 2}};
  const embedding::SkinReport report = embedding::add_skin(model, surface, {}, {});
  EXPECT_EQ(report.points_outside, 3U);
  EXPECT_NEAR(report.farthest, std::sqrt(13.0), 1e-12);
  const std::vector<Vec3> moved = embedding::displaced_skin(
      embedding::skin_weights(model), model.skin.points, displacement(model, bent));
  for (std::size_t p = 0; p < moved.size(); ++p) {
    const Vec3 x = surface.points[p];
    Vec3 q = x; // the nearest point of the box
    for (int axis = 0; axis < 3; ++axis)
      q[axis] = std::clamp(x[axis], 0.0, 2.0);
    // The field is quadratic: half of the difference of both sides is its slope.
    const Vec3 slope = (bent(q + (x - q)) - bent(q - (x - q))) * 0.5;
    EXPECT_LT(norm(moved[p] - x - bent(q) - slope), 1e-11) << p;
    EXPECT_GT(norm(moved[p] - x - bent(x)), 1) << p; // the functions themselves leave all bounds
  }
}

TEST(Skin, PointsFollowTheNearestElementOfAll) {
  for (const double radius : {0.8, 1.3, 9.0}) {
    model::Model model = box_model(false);
    const TriangleMesh surface = textured_ball(radius);
    const embedding::SkinReport report = embedding::add_skin(model, surface, {}, {});
    ASSERT_EQ(model.skin.points, surface.points);
    EXPECT_EQ(model.skin.triangles, surface.triangles);
    std::uint64_t outside = 0;
    double farthest = 0;
    for (std::size_t p = 0; p < surface.points.size(); ++p) {
      const Vec3& x = surface.points[p];
      const Vec3 away{x.x - std::clamp(x.x, 0.0, 2.0), x.y - std::clamp(x.y, 0.0, 2.0),
                      x.z - std::clamp(x.z, 0.0, 2.0)};
      farthest = test::larger(farthest, norm(away));
      outside += inside(x) ? 0 : 1;
      // The nearest point of the box lies in the element.
      const Tetrahedron& t = model.tetrahedra[model.skin.tetrahedron[p]];
      std::array<Vec3, 4> c;
      for (std::size_t a = 0; a < 4; ++a)
        c[a] = model.nodes[t[a]].position;
      const double whole = tetrahedra::tetrahedron_volume(c[0], c[1], c[2], c[3]);
      for (std::size_t a = 0; a < 4; ++a) {
        std::array<Vec3, 4> with = c;
        with[a] = x - away;
        EXPECT_GE(tetrahedra::tetrahedron_volume(with[0], with[1], with[2], with[3]) / whole,
                  -1e-12)
            << p;
      }
    }
    EXPECT_EQ(report.points_outside, outside);
    EXPECT_NEAR(report.farthest, farthest, 1e-14 * radius);
  }
}

TEST(Skin, FindsTheNearestElementAcrossAHollow) {
  tetrahedra::TetMesh mesh = test::box_tetrahedra(9, 9, 9);
  std::erase_if(mesh.tetrahedra, [&](const Tetrahedron& t) {
    Vec3 sum;
    for (const std::uint32_t corner : t)
      sum += mesh.points[corner];
    return norm(sum / 4 - Vec3{4.6, 4.4, 4.5}) < 3.3;
  });
  const TriangleMesh walls = tetrahedra::boundary(mesh).mesh;
  fem::SolidModelOptions options;
  options.material.materials[0].poisson = 0.3;
  options.quadratic = false;
  model::Model model = fem::solid_model(std::move(mesh), options, {});
  const TriangleMesh surface = test::ball(2, 1.7, {4.9, 4.2, 4.5});
  const embedding::SkinReport report = embedding::add_skin(model, surface, {}, {});
  EXPECT_EQ(report.points_outside, surface.points.size());
  const embedding::SkinWeights weights = embedding::skin_weights(model);
  double farthest = 0;
  for (std::size_t p = 0; p < surface.points.size(); ++p) {
    const Vec3& x = surface.points[p];
    const auto away = [&](const std::array<Vec3, 3>& c) {
      return norm(x - mesh::nearest_on_triangle(x, c[0], c[1], c[2]).point);
    };
    double all = HUGE_VAL, own = HUGE_VAL;
    for (const auto& [a, b, c] : walls.triangles)
      all = test::smaller(all, away({walls.points[a], walls.points[b], walls.points[c]}));
    const std::uint32_t* const node = &weights.node[4 * p];
    for (const auto& [a, b, c] : tetrahedra::tetrahedron_faces)
      own = test::smaller(own, away({model.nodes[node[a]].position, model.nodes[node[b]].position,
                                     model.nodes[node[c]].position}));
    EXPECT_EQ(own, all) << p;
    farthest = test::larger(farthest, all);
  }
  EXPECT_NEAR(report.farthest, farthest, 1e-14);
}

TEST(Skin, IsTheSameOnAnyNumberOfThreads) {
  model::Model one = box_model(true), four = one;
  Context context;
  context.threads = 1;
  (void)embedding::add_skin(one, textured_ball(1.3), {}, context);
  context.threads = 4;
  (void)embedding::add_skin(four, textured_ball(1.3), {}, context);
  EXPECT_EQ(one, four);
}

TEST(Skin, LeavesOutWhatIsNoSurface) {
  model::Model model = box_model(false);
  TriangleMesh surface;
  surface.points = {{9, 9, 9}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  surface.triangles = {{1, 1, 2}, {1, 2, 3}};
  surface.texcoords = {{1, 1, 1, 1, 1, 1}, {0, 0.1F, 1, 0, 0, 1}};
  const std::vector<std::int32_t> material{0, 1};
  EXPECT_EQ(embedding::add_skin(model, surface, material, {}).dropped_triangles, 1U);
  EXPECT_EQ(model.skin.points.size(), 3U);
  EXPECT_EQ(model.skin.triangles, (std::vector<Triangle>{{0, 1, 2}}));
  EXPECT_EQ(model.skin.material, (std::vector<std::int32_t>{1}));
  EXPECT_EQ(model.skin.texcoords[0][1], 0.1);
  surface.triangles.resize(1);
  surface.texcoords.resize(1);
  EXPECT_THROW(embedding::add_skin(model, surface, {}, {}), Error);
}

TEST(Skin, IsReadAsItIsWritten) {
  model::Model model = box_model(true);
  const std::string bare = model::model_digest(model);
  TriangleMesh surface = textured_ball(1.3);
  const std::vector<std::int32_t> material(surface.triangles.size(), 1);
  (void)embedding::add_skin(model, surface, material, {});
  EXPECT_NE(model::model_digest(model), bare);
  EXPECT_EQ(formats::parse_ela(formats::ela_text(model), "M"), model);
  const TriangleMesh shown = model::shown_mesh(model);
  EXPECT_EQ(shown.points, surface.points);
  EXPECT_EQ(shown.texcoords, surface.texcoords);
  EXPECT_EQ(shown.material, material);
  model.skin.texcoords.clear();
  EXPECT_EQ(formats::parse_ela(formats::ela_text(model), "M"), model);
}

TEST(Skin, IsCheckedLineByLine) {
  const std::string head = "ela_expl 1\nname \"e\"\nmaterials 1\n0 \"a\" 0.001 1000 1 0.2 0.3\n"
                           "nodes 4\n0 0 0 1 0 - -1 0\n2 0 0 1 0 - -1 0\n0 2 0 1 0 - -1 0\n"
                           "0 0 2 1 0 - -1 0\nsprings 0\ntriangles 0\n";
  const std::string elements = "tetrahedra 1\n0 1 2 3 0\n";
  const std::string skin = "skin 3\n0 0 0 0\n1 0 0 0\n0 1 0 0\nskin_triangles 1\n0 1 2 0\n"
                           "skin_texcoords 1\n0 0 1 0 0 1\n";
  const auto complaint = [&](const std::string& text) {
    const std::string said = test::complaint([&] { return formats::parse_ela(text, "M"); });
    return said.empty() ? said : said.substr(2);
  };
  EXPECT_EQ(complaint(head + elements + skin + "end\n"), "");
  EXPECT_EQ(complaint(head + skin + "end\n"),
            "12: section 'skin', expected 'texcoords', 'tetrahedra' or 'end' after 0 triangles");
  struct Case {
    std::string from, to, expected;
  };
  const Case cases[] = {
      {"1 0 0 0\n", "1 0 0 1\n", "16: tetrahedron 1 does not exist, expected 0 to 0"},
      {"1 0 0 0\n", "1 0 nan 0\n", "16: 'nan' is no coordinate"},
      {"1 0 0 0\n", "1 0 0\n", "16: "},
      {"skin 3", "skin 4", "18: section 'skin_triangles' after 3 of 4 skin"},
      {"skin 3\n0 0 0 0\n1 0 0 0\n0 1 0 0\n", "skin 0\n", "14: 'skin' 0, expected the section"},
      {"0 1 2 0\nskin", "0 1 3 0\nskin", "19: point 3 does not exist, expected 0 to 2"},
      {"0 1 2 0\nskin", "0 1 1 0\nskin", "19: corner 1 stands twice"},
      {"0 1 2 0\nskin", "0 1 2 1\nskin", "19: material 1 does not exist, expected 0 to 0"},
      {"skin_triangles 1\n0 1 2 0\n", "",
       "18: section 'skin_texcoords', expected 'skin_triangles'"},
      {"skin_texcoords 1", "skin_texcoords 2", "20: 2 skin_texcoords, but only 16 bytes follow"},
      {"0 0 1 0 0 1\n", "0 0 1 0 0 inf\n", "21: 'inf' is no texture coordinate"},
  };
  for (const Case& c : cases) {
    std::string text = skin;
    const std::size_t at = text.find(c.from);
    ASSERT_NE(at, std::string::npos) << c.from;
    text.replace(at, c.from.size(), c.to);
    const std::string said = complaint(head + elements + text + "end\n");
    EXPECT_EQ(said.substr(0, c.expected.size()), c.expected) << said;
    EXPECT_NE(said.find("expected"), std::string::npos) << said;
  }
}

} // namespace
} // namespace gewebe::test
