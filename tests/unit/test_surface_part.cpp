// A part of a surface knows of its own edges what the whole one does.

#include "model/surface_part.h"

#include "mesh_fixtures.h"
#include "stiffness_models.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

using namespace gewebe;
using namespace gewebe::test;

namespace {

TEST(SurfacePart, EdgesAtMarkedNodesHaveAllTheirFaces) {
  const model::Model model = model_of(sphere_mesh(3, 20, {1, 2, 3}));
  const mesh::EdgeTable whole = mesh::edge_table(model.triangles, model.nodes.size(), Context{});
  std::vector<std::uint8_t> marked(model.nodes.size());
  for (const std::uint32_t node : {3U, 77U, 78U})
    marked[node] = 1;
  const model::SurfacePart part = model::surface_part(model, marked);
  EXPECT_TRUE(std::ranges::is_sorted(part.triangles));
  EXPECT_LT(part.triangles.size(), 25U);
  std::size_t complete = 0;
  for (std::size_t e = 0; e < whole.size(); ++e) {
    const auto [i, j] = whole.ends[e];
    const std::size_t here = part.edges.find({i, j});
    if (marked[i] == 0 && marked[j] == 0)
      continue;
    ASSERT_NE(here, mesh::EdgeTable::no_edge) << i << " " << j;
    EXPECT_TRUE(std::ranges::equal(part.edges.around(here), whole.around(e))) << i << " " << j;
    ++complete;
  }
  EXPECT_GE(complete, 15U);
  EXPECT_EQ(part.edges.find({3, 4000}), mesh::EdgeTable::no_edge);
  EXPECT_TRUE(
      model::surface_part(model, std::vector<std::uint8_t>(model.nodes.size())).triangles.empty());
}

TEST(SurfacePart, ARingMoreHasTheNeighboursOfWhatIsMarked) {
  const model::Model model = model_of(sphere_mesh(2, 20, {}));
  std::vector<std::uint8_t> marked(model.nodes.size());
  marked[7] = 1;
  std::vector<std::uint8_t> expected = marked;
  for (const Triangle& t : model.triangles)
    if (t[0] == 7 || t[1] == 7 || t[2] == 7)
      for (const std::uint32_t corner : t)
        expected[corner] = 1;
  model::mark_neighbours(model, marked);
  EXPECT_EQ(marked, expected);
  EXPECT_GE(std::ranges::count(marked, 1), 6);
}

} // namespace
