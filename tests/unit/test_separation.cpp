// Surfaces that overlap where contact begins are moved apart, each vertex as little as possible.

#include "base/error.h"
#include "larger.h"
#include "scene/simulation.h"
#include "simulation_scenes.h"
#include "touching_blocks.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace gewebe::test {
namespace {

using namespace test;

constexpr double overlap = 0.9; // of edges of 4 mm

/// A block that is held below and another one, by default held above, `depth` deep in it.
std::unique_ptr<scene::Simulation> two_blocks(scene::Method method, double depth,
                                              bool hold_faces = false, bool hold_top = true) {
  auto made = std::make_unique<scene::Simulation>(one_thread(), scene::SimulationOptions{});
  scene::Simulation& s = *made;
  model::Model below = block(4, 4, 2, {}, true);
  model::Model above = block(3, 3, 2, {1.7, 2.3, 8 - depth});
  for (model::Node& node : above.nodes)
    if (hold_top && node.position.z > 15.9 - depth)
      node.fixed = model::fixed_all;
  if (hold_faces)
    for (model::Model* const model : {&below, &above})
      for (model::Node& node : model->nodes)
        if (node.position.z > 7 - depth && node.position.z < 9)
          node.fixed = model::fixed_all;
  for (const auto& [name, model] : {std::pair("below", below), std::pair("above", above)})
    s.add_object(name, model, method, {},
                 method == scene::Method::ela ? scene::Integration::implicit
                                              : scene::Integration::automatic);
  return made;
}

std::string refusal(scene::Simulation& s, const scene::SetContact& contact) {
  try {
    s.apply(contact);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

class Separation : public testing::TestWithParam<scene::Method> {};

TEST_P(Separation, OverlapsArePartedByHalfOfTheirDepthEach) {
  const auto s_made = two_blocks(GetParam(), overlap);
  scene::Simulation& s = *s_made;
  EXPECT_LT(least_gap(s, 0, 1), 0);
  const std::string said = refusal(s, {0, 1, 0});
  EXPECT_NE(said.find("contact below above separate"), std::string::npos) << said;
  s.apply(scene::SetContact{0, 1, 0, true});
  if (GetParam() == scene::Method::ela)
    s.step(1e-6); // it shows where it is
  EXPECT_GT(least_gap(s, 0, 1), 0);
  EXPECT_LE(least_gap(s, 0, 1), gap_allowed);
  const std::vector<double> u = shape(s, 1);
  const model::Model& above = s.model(1);
  double moved = 0, faces = 0;
  for (std::size_t i = 0; i < above.nodes.size(); ++i) {
    const Vec3 way = vector_at(u, i);
    if (above.nodes[i].position.z > 8 - overlap + 0.1) {
      EXPECT_LE(norm(way), 0.3 * overlap) << "beside the overlap";
      continue;
    }
    EXPECT_LE(std::hypot(way.x, way.y), 0.3 * overlap);
    moved += way.z;
    ++faces;
  }
  // The lower face is wider: its vertices share their part with fewer of the upper one's.
  EXPECT_NEAR(moved / faces, overlap / 2, 0.25 * overlap);
}

TEST_P(Separation, TheyPressEachOtherByTheirOverlap) {
  const auto s_made = two_blocks(GetParam(), overlap);
  scene::Simulation& s = *s_made;
  s.apply(scene::SetContact{0, 1, 0, true});
  for (int k = 0; k < 30; ++k) {
    s.step(1.0 / 60);
    EXPECT_GT(least_gap(s, 0, 1), 0);
    const Vec3 up = sum_of_forces(s, 1), down = sum_of_forces(s, 0);
    EXPECT_LE(norm(up + down), 1e-12 * norm(up));
  }
  // The same blocks, pushed together from where they just touch.
  const auto pushed_made = two_blocks(scene::Method::ffe, -0.01, false, false);
  scene::Simulation& pushed = *pushed_made;
  pushed.apply(scene::SetContact{0, 1, 0});
  std::vector<std::uint32_t> top;
  for (std::uint32_t i = 0; i < pushed.model(1).nodes.size(); ++i)
    if (pushed.model(1).nodes[i].position.z > 15.9)
      top.push_back(i);
  pushed.apply(scene::SetDisplacement{1, top, {0, 0, -(overlap + 0.01)}, 1.0 / 60});
  pushed.step(1.0 / 60);
  pushed.step(1.0 / 60);
  const double expected = -sum_of_forces(pushed, 0).z; // the other one is displaced
  EXPECT_GT(expected, 0);
  EXPECT_NEAR(sum_of_forces(s, 1).z, expected,
              (GetParam() == scene::Method::ffe ? 0.01 : 0.05) * expected);
}

TEST_P(Separation, TooDeepOrHeldIsRefusedByName) {
  const auto deep_made = two_blocks(GetParam(), 6.5);
  scene::Simulation& deep = *deep_made;
  const std::string one = refusal(deep, {0, 1, 0, true});
  EXPECT_NE(one.find("below, above overlap near "), std::string::npos) << one;
  EXPECT_NE(one.find("stand in each other by more than"), std::string::npos) << one;
  const auto held_made = two_blocks(GetParam(), overlap, true);
  scene::Simulation& held = *held_made;
  const std::string other = refusal(held, {0, 1, 0, true});
  EXPECT_NE(other.find("or where they are held"), std::string::npos) << other;
}

TEST_P(Separation, ABodyInsideAnotherIsRefused) {
  scene::Simulation s(one_thread(), {});
  s.add_object("outer", block(4, 4, 4, {}), GetParam(), {},
               GetParam() == scene::Method::ela ? scene::Integration::implicit
                                                : scene::Integration::automatic);
  s.add_object("inner", block(1, 1, 1, {5.3, 6.1, 7.2}), GetParam(), {},
               GetParam() == scene::Method::ela ? scene::Integration::implicit
                                                : scene::Integration::automatic);
  for (const bool separate : {true, false}) {
    const std::string said = refusal(s, {0, 1, 0, separate});
    EXPECT_NE(said.find("the surface of object inner is inside object outer near "),
              std::string::npos)
        << said;
  }
}

TEST_P(Separation, SurfacesThatStandApartAreLeftAlone) {
  const auto s_made = two_blocks(GetParam(), -0.5);
  scene::Simulation& s = *s_made;
  s.apply(scene::SetContact{0, 1, 0, true});
  for (const std::size_t object : {std::size_t{0}, std::size_t{1}})
    for (const double u : shape(s, object))
      EXPECT_EQ(u, 0);
}

INSTANTIATE_TEST_SUITE_P(Methods, Separation,
                         testing::Values(scene::Method::ffe, scene::Method::ela),
                         [](const auto& method) {
                           return method.param == gewebe::scene::Method::ffe ? "ffe" : "ela";
                         });

} // namespace
} // namespace gewebe::test
