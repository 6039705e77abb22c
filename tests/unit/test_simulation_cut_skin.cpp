// Scenes in which solids with skins are cut: skins stay closed and as large as they were, and their
// points stay with the tissue on their side.

#include "base/error.h"
#include "cut_bars.h"
#include "cutting/cut_solid.h"
#include "cutting/skin_parts.h"
#include "larger.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

namespace gewebe::test {
namespace {

using test::expect_skins_sound, test::models_of, test::notch, test::off, test::one_thread,
    test::skinned_bar;

Vec3 middle_of(const model::Model& model, std::uint32_t element) {
  Vec3 middle;
  for (const std::uint32_t node : model.tetrahedra[element])
    middle += model.nodes[node].position / 4;
  return middle;
}

double skin_volume(const model::Model& model) {
  return signed_volume(model::shown_mesh(model));
}

class SkinCuts : public testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Orders, SkinCuts, testing::Bool());

TEST_P(SkinCuts, APieceTakesItsSkinWithIt) {
  for (const scene::Method method : {scene::Method::ffe, scene::Method::ela}) {
    scene::Simulation s(one_thread(), {});
    const model::Model whole = skinned_bar(GetParam());
    s.add_object("bar", model::Model(whole), method);
    for (const double x : {14.0, 9.7}) {
      s.apply(off(x));
      expect_skins_sound(models_of(s), skin_volume(whole));
    }
    ASSERT_EQ(s.object_count(), 3U);
    // The rim is in the plane, the wall has the material of the tissue there.
    const model::Model held = s.model(0);
    std::size_t rim = 0;
    for (const Vec3& p : held.skin.points)
      rim += std::abs(dot(p - Vec3{9.7, 5, 5}, Vec3{1, 0.1, 0.2})) < 1e-9 ? 1 : 0;
    EXPECT_GT(rim, 60U);
    for (const Vec3& p : held.skin.points)
      EXPECT_LT(dot(p - Vec3{9.7, 5, 5}, Vec3{1, 0.1, 0.2}), 1e-9);
    s.step(0.01);
    expect_skins_sound(models_of(s), skin_volume(whole));
  }
}

TEST_P(SkinCuts, PointsStayOnTheirSideOfANotch) {
  scene::Simulation s(one_thread(), {});
  const model::Model whole = skinned_bar(GetParam());
  s.add_object("bar", model::Model(whole), scene::Method::ffe);
  const scene::CutObject what = notch(whole, 8.9);
  s.apply(what);
  const model::Model cut = s.model(0);
  expect_skins_sound({&cut, 1}, skin_volume(whole));
  // Walls that look to +x are of what lies at -x; points of both are of the front.
  const Vec3 way = Vec3{1, 0.1, 0.05} / norm(Vec3{1, 0.1, 0.05});
  const auto height = [&](const Vec3& p) { return dot(p - Vec3{8.9, 0, 0}, way); };
  std::vector<int> looks(cut.skin.points.size());
  for (const Triangle& t : cut.skin.triangles) {
    const Vec3 &a = cut.skin.points[t[0]], &b = cut.skin.points[t[1]], &c = cut.skin.points[t[2]];
    const Vec3 normal = cross(b - a, c - a);
    if (std::abs(height(a)) > 1e-9 || std::abs(height(b)) > 1e-9 || std::abs(height(c)) > 1e-9 ||
        norm(normal) < 1e-6)
      continue;
    for (const std::uint32_t p : t)
      looks[p] |= dot(normal, way) > 0 ? 1 : 2;
  }
  std::size_t checked = 0;
  double most = -10;
  for (std::size_t p = 0; p < looks.size(); ++p)
    if (looks[p] == 1 || looks[p] == 2) {
      const double away = height(middle_of(cut, cut.skin.tetrahedron[p]));
      most = test::larger(most, looks[p] == 1 ? away : -away);
      ++checked;
    }
  EXPECT_GT(checked, 100U);
  EXPECT_LT(most, 0); // each element's middle lies behind the wall that follows it
}

TEST_P(SkinCuts, ABladeCutsInOneStepAndInMany) {
  for (const double low : {4.0, -3.0}) // down to here
    for (const int steps : {1, 7, 40}) {
      SCOPED_TRACE(steps);
      scene::Simulation s(one_thread(), {});
      const model::Model whole = skinned_bar(GetParam());
      s.add_object("bar", model::Model(whole),
                   steps == 7 ? scene::Method::ela : scene::Method::ffe);
      contact::InstrumentShape edge;
      edge.radius = 0;
      edge.blade = true;
      edge.axis = {0, 0, 16};
      s.apply(scene::SetInstrument{0, edge, {{9.6, -4, low}, {}}, "knife"});
      s.step(0);
      s.apply(scene::MoveInstrument{0, {9.9, 14, low}, {}, 0.1});
      for (int k = 0; k < steps; ++k)
        s.step(0.1 / steps);
      EXPECT_EQ(s.object_count(), low > 0 ? 1U : 2U);
      expect_skins_sound(models_of(s), skin_volume(whole));
      // The rim runs where the blade did.
      const model::Model cut = s.model(0);
      double left = 20, right = 0;
      for (const Vec3& at : cut.skin.points)
        if (at.z > low && std::abs(at.x - (9.6 + 0.3 * (at.y + 4) / 18)) < 1e-6) {
          left = test::smaller(left, at.y);
          right = test::larger(right, at.y);
        }
      EXPECT_LT(left, 0);
      EXPECT_GT(right, 10);
    }
}

TEST(SkinCutScenes, ABladeCutsWhereTheSolidIs) {
  scene::Simulation s(one_thread(), {});
  const model::Model whole = skinned_bar(false);
  s.add_object("bar", model::Model(whole), scene::Method::ffe);
  s.apply(scene::SetGravity{{0, 0, -30000}});
  s.step(0.1); // it hangs
  contact::InstrumentShape edge;
  edge.radius = 0;
  edge.blade = true;
  edge.axis = {0, 30, 0};
  const auto place = [](int k) { return Vec3{12.0 + 0.1 * k, -10, 14 - 0.8 * k}; };
  s.apply(scene::SetInstrument{0, edge, {place(0), {}}, "knife"});
  for (int k = 1; k <= 20; ++k) {
    s.apply(scene::MoveInstrument{0, place(k), {}, 0});
    s.step(0.01);
    expect_skins_sound(models_of(s), skin_volume(whole));
  }
}

TEST(SkinCutScenes, RestoreMakesItWholeAgain) {
  scene::Simulation s(one_thread(), {});
  const model::Model whole = skinned_bar(true);
  s.add_object("bar", model::Model(whole), scene::Method::ffe);
  s.apply(notch(whole, 8.9));
  EXPECT_NE(s.model(0).skin, whole.skin);
  s.apply(scene::Restore{0});
  EXPECT_EQ(s.model(0).skin, whole.skin);
}

TEST(SkinCutScenes, AlongFacesTheSkinIsCutByThePlane) {
  scene::Simulation s(one_thread(), {});
  const model::Model whole = skinned_bar(false);
  s.add_object("bar", model::Model(whole), scene::Method::ffe);
  s.apply(scene::CutObject{0, scene::PlaneToCut{{{9.7, 5, 5}, {1, 0.1, 0.2}}, {}, true}});
  EXPECT_EQ(s.object_count(), 2U);
  expect_skins_sound(models_of(s), skin_volume(whole));
}

TEST(SkinCutScenes, ASkinThatIsOpenIsRefused) {
  scene::Simulation s(one_thread(), {});
  model::Model model = skinned_bar(false);
  model.skin.triangles.resize(model.skin.triangles.size() / 2);
  model.skin.material.resize(model.skin.triangles.size());
  s.add_object("bar", model::Model(model), scene::Method::ffe);
  try {
    s.apply(off(9.7));
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("bar: the skin is not closed"), std::string::npos)
        << error.what();
  }
  EXPECT_EQ(s.model(0), model);
}

/// What elements have parted and no blade has.
TEST(SkinParts, WhatIsNotCutIsTornAndClosed) {
  model::Model model = skinned_bar(false);
  const model::Skin skin = model.skin;
  model.skin = {};
  cutting::CutModel cut = cutting::as_cut_model(
      model, cutting::cut_solid(model, cutting::plane_blade(model, {{9.7, 5, 5}, {1, 0.1, 0.2}})));
  cut.model.skin = skin;
  cutting::FreeParts free = cutting::free_parts(model, cut);
  ASSERT_EQ(free.parts.size(), 1U);
  const cutting::SkinPartsReport report = cutting::part_skin(cut.model, free);
  EXPECT_GT(report.torn, 50U);
  const std::vector<model::Model> pieces{free.rest->model, free.parts[0].model};
  model.skin = skin;
  expect_skins_sound(pieces, skin_volume(model));
}

} // namespace
} // namespace gewebe::test
