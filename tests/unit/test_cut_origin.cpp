// Where the nodes of cut models come from: found again as the cut had it.

#include "cutting/cut_origin.h"

#include "base/error.h"
#include "cutting/cut.h"
#include "stiffness_models.h"
#include "update/stiffness_change.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>

using namespace gewebe;
using namespace gewebe::test;

namespace {

/// Opens the surface between triangles on both sides of a plane, where they are in front of
/// another.
cutting::Cut opened(const model::Model& model, double x, double above) {
  cutting::Cut cut;
  std::map<std::array<std::uint32_t, 2>, int> sides;
  for (const Triangle& t : model.triangles) {
    Vec3 middle;
    for (const std::uint32_t corner : t)
      middle = middle + model.nodes[corner].position;
    if (middle.z / 3 < above)
      continue;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [i, j] = std::minmax(t[k], t[(k + 1) % 3]);
      sides[{i, j}] |= middle.x / 3 < x ? 1 : 2;
    }
  }
  for (const auto& [edge, both] : sides)
    if (both == 3)
      cut.edges.push_back(edge);
  return cut;
}

model::Model ball_model() {
  model::Model model = model_of(ball(3, 20));
  for (std::size_t i = 0; i < model::surface_count(model); i += 17)
    model.nodes[i].fixed = model::fixed_all;
  return model;
}

TEST(CutOrigin, FindsWhatTheCutSays) {
  const model::Model before = ball_model();
  const cutting::CutModel cut = cutting::cut_model(before, opened(before, 1, 5));
  ASSERT_GT(cut.doubled, 5u);
  const cutting::CutOrigin found = cutting::find_cut_origin(before, cut.model);
  EXPECT_EQ(found.origin, cut.origin);
  EXPECT_EQ(found.place, cut.place);
}

TEST(CutOrigin, CopiesOfCopiesGoToTheirSide) {
  const model::Model before = ball_model();
  const cutting::CutModel first = cutting::cut_model(before, opened(before, 1, 8));
  const cutting::CutModel second = cutting::cut_model(first.model, opened(first.model, 1, 0));
  ASSERT_GT(second.doubled, 1u);
  const cutting::CutOrigin found = cutting::find_cut_origin(first.model, second.model);
  EXPECT_EQ(found.origin, second.origin);
  EXPECT_EQ(found.place, second.place);
}

TEST(CutOrigin, TheRankIsThreeForEachCopyAndOneForEachSeveredSpring) {
  const model::Model before = ball_model();
  cutting::Cut cut = opened(before, 1, 5);
  const cutting::CutModel open = cutting::cut_model(before, cut);
  std::size_t fixed = 0;
  for (std::size_t i = 0; i < open.model.nodes.size(); ++i)
    if (open.place[open.origin[i]] != i && open.model.nodes[i].fixed == model::fixed_all)
      ++fixed;
  const update::StiffnessChange change =
      update::stiffness_change(before, open.model, open.origin, open.place);
  EXPECT_LE(change.rank(), 3 * (open.doubled - fixed) + open.removed);
  EXPECT_GE(change.rank(), 3 * (open.doubled - fixed));
}

TEST(CutOrigin, AnotherModelIsRefused) {
  const model::Model before = ball_model();
  model::Model other = before;
  other.nodes[7].position.z += 1e-12;
  EXPECT_THROW((void)cutting::find_cut_origin(before, other), Error);
}

} // namespace
