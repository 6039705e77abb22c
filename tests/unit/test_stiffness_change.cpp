// What a cut changes: against matrices, factors and columns made afresh.

#include "update/stiffness_change.h"

#include "columns/compliance_columns.h"
#include "cut_models.h"
#include "fem/model_stiffness.h"
#include "larger.h"
#include "linalg/condition.h"
#include "made_columns.h"
#include "relative_difference.h"
#include "stiffness_models.h"
#include "update/corrected_columns.h"
#include "update/woodbury.h"

#include <gtest/gtest.h>

#include <cmath>

using namespace gewebe;
using namespace gewebe::test;

namespace {

/// K' E c - P e against W Σ Qᵀ c for displacements that are no columns: K' E c - Eᵀ-wise K c.
void expect_identity(const model::Model& before, const HandCut& cut,
                     const update::StiffnessChange& change) {
  const std::vector<double> c = random_vector(change.old_axes, 5);
  std::vector<double> free = c, f(change.old_axes), wide(change.new_axes), pull(change.new_axes);
  for (std::size_t axis = 0; axis < free.size(); ++axis)
    if ((before.nodes[axis / 3].fixed >> (axis % 3) & 1) != 0)
      free[axis] = 0;
  fem::multiply_stiffness(before, free, f);
  update::copy_displacements(change, free, wide);
  fem::multiply_stiffness(cut.model, wide, pull);
  double size = 0;
  for (const double x : pull)
    size = test::larger(size, std::abs(x));
  for (std::size_t i = 0; i < before.nodes.size(); ++i)
    for (std::size_t a = 0; a < 3; ++a)
      pull[3 * std::size_t{change.place[i]} + a] -= f[3 * i + a];
  for (std::size_t r = 0; r < change.rank(); ++r)
    change.load.add_to(r, -change.weight[r] * change.answer.times(r, free), pull);
  for (std::size_t axis = 0; axis < pull.size(); ++axis)
    if ((cut.model.nodes[axis / 3].fixed >> (axis % 3) & 1) == 0) {
      EXPECT_NEAR(pull[axis], 0, 1e-13 * size) << axis;
    }
}

TEST(StiffnessChange, SaysWhatTheMatricesDiffer) {
  for (const double stretch : {1.0, 1.1})
    for (std::size_t seed = 0; seed < 6; ++seed) {
      const model::Model before = stretched(organ_ball(), stretch);
      const HandCut cut = hand_cut(before, seed * 3, 2 * seed, static_cast<unsigned>(seed));
      const update::StiffnessChange change =
          update::stiffness_change(before, cut.model, cut.origin, cut.place);
      EXPECT_EQ(change.copy_axis.size() + change.springs, change.rank());
      if (stretch == 1) {
        EXPECT_LE(change.springs, 2 * seed) << "a removed spring is one column";
      }
      expect_identity(before, cut, change);
    }
}

TEST(StiffnessChange, NothingChangedIsOfRankZero) {
  const model::Model before = organ_ball();
  const HandCut cut = hand_cut(before, 0, 0, 1);
  const update::StiffnessChange change =
      update::stiffness_change(before, cut.model, cut.origin, cut.place);
  EXPECT_EQ(change.rank(), 0u);
  EXPECT_TRUE(change.touched.empty());
}

TEST(StiffnessChange, TouchedNodesAreThoseWhoseRowsDiffer) {
  const model::Model before = organ_ball();
  const HandCut cut = hand_cut(before, 5, 7, 3);
  const update::StiffnessChange change =
      update::stiffness_change(before, cut.model, cut.origin, cut.place);
  // Rows of nodes that aren't touched answer the same, whatever the touched ones do.
  const std::size_t n = cut.model.nodes.size();
  std::vector<std::uint8_t> touched(n, 0);
  for (const std::uint32_t node : change.touched)
    touched[node] = 1;
  std::vector<double> u = random_vector(change.new_axes, 9), was(change.old_axes),
                      f(change.old_axes), g(change.new_axes);
  for (std::size_t i = 0; i < before.nodes.size(); ++i)
    std::copy_n(&u[3 * std::size_t{cut.place[i]}], 3, &was[3 * i]);
  fem::multiply_stiffness(before, was, f);
  fem::multiply_stiffness(cut.model, u, g);
  std::size_t changed = 0;
  for (std::size_t i = 0; i < before.nodes.size(); ++i) {
    const std::size_t p = cut.place[i];
    double max = 0;
    for (std::size_t a = 0; a < 3; ++a)
      max = test::larger(max, std::abs(f[3 * i + a] - g[3 * p + a]));
    EXPECT_EQ(max > 1e-9, touched[p] != 0) << i;
    changed += touched[p];
  }
  EXPECT_GT(changed, 10u);
  EXPECT_LT(changed, n / 2);
}

TEST(StiffnessChange, AnotherModelIsRefused) {
  const model::Model before = organ_ball();
  HandCut cut = hand_cut(before, 3, 0, 3);
  const auto refused = [&](HandCut other) {
    EXPECT_THROW((void)update::stiffness_change(before, other.model, other.origin, other.place),
                 Error);
  };
  HandCut moved = cut, fixed = cut, mapped = cut, out = cut;
  moved.model.nodes[4].position.x += 1e-9;
  fixed.model.nodes[4].fixed ^= model::fixed_x;
  std::swap(mapped.place[1], mapped.place[2]);
  out.origin[3] = 1 << 30;
  refused(moved);
  refused(fixed);
  refused(mapped);
  refused(out);
}

void expect_corrected(const model::Model& before, const HandCut& cut, double tolerance,
                      std::uint32_t step = 5) {
  const update::AxesSolve old_solve = solver(before), new_solve = solver(cut.model);
  const auto made = std::make_shared<Made>(before, old_solve, every(step, before));
  const update::CorrectedColumns corrected(
      made, update::stiffness_change(before, cut.model, cut.origin, cut.place), new_solve,
      Context{});
  const Made afresh(cut.model, new_solve, corrected.nodes());
  ASSERT_GE(corrected.nodes().size(), made->nodes().size() / 2);
  std::vector<double> a(3 * corrected.change().new_axes), b(a.size());
  for (std::size_t k = 0; k < corrected.nodes().size(); ++k) {
    corrected.read(k, a);
    afresh.read(k, b);
    EXPECT_LT(relative_difference(a, b), tolerance) << corrected.nodes()[k];
  }
}

void expect_woodbury(const model::Model& before, const HandCut& cut, double tolerance) {
  const update::AxesSolve new_solve = solver(cut.model);
  const update::WoodburySolver woodbury(
      update::stiffness_change(before, cut.model, cut.origin, cut.place), solver(before),
      Context{});
  std::vector<double> f = random_vector(2 * woodbury.change().new_axes, 11), u = f;
  woodbury.solve(u, 2);
  new_solve(f, 2);
  EXPECT_LT(relative_difference(u, f), tolerance);
}

TEST(StiffnessChange, CorrectedColumnsAreThoseMadeAfresh) {
  for (std::size_t seed = 0; seed < 4; ++seed) {
    const model::Model before = stretched(organ_ball(), seed % 2 == 0 ? 1 : 1.05);
    expect_corrected(before, hand_cut(before, 4 * seed, 3 * seed, static_cast<unsigned>(seed)),
                     1e-9);
  }
}

TEST(StiffnessChange, WoodburyGivesWhatAFreshFactorGives) {
  for (std::size_t seed = 0; seed < 6; ++seed) {
    const model::Model before = stretched(organ_ball(), seed % 2 == 0 ? 1 : 1.05);
    expect_woodbury(before, hand_cut(before, 4 * seed, 3 * seed, static_cast<unsigned>(seed)),
                    1e-9);
  }
}

TEST(StiffnessChange, OrgansToo) {
  for (const auto& [name, unit] : {std::pair{"sofa_liver_smooth.obj", "cm"},
                                   std::pair{"gca90_large_intestine_20k.stl", "mm"}}) {
    const std::string path = shared_file(name);
    if (path.empty())
      GTEST_SKIP() << "no " << name;
    model::Model before = model_of_file(path, unit);
    for (std::size_t i = 0; i < model::surface_count(before); i += 20)
      before.nodes[i].fixed = model::fixed_all;
    const HandCut cut = hand_cut(before, 10, 10, 1);
    expect_corrected(before, cut, 1e-9, 400);
    expect_woodbury(before, cut, 1e-9);
  }
}

TEST(StiffnessChange, ColumnsOfFloat32StayAsExactAsTheyWere) {
  const model::Model before = organ_ball();
  const HandCut cut = hand_cut(before, 8, 20, 2);
  const update::AxesSolve old_solve = solver(before), new_solve = solver(cut.model);
  const auto made = std::make_shared<Made>(before, old_solve, every(5, before), true);
  const update::StiffnessChange change =
      update::stiffness_change(before, cut.model, cut.origin, cut.place);
  const update::CorrectedColumns exact(made, change, new_solve, Context{}, old_solve);
  const update::CorrectedColumns rough(made, change, new_solve, Context{});
  const Made afresh(cut.model, new_solve, exact.nodes());
  EXPECT_EQ(exact.error_gain(), 1);
  EXPECT_GT(rough.error_gain(), 1);
  std::vector<double> a(3 * change.new_axes), b(a.size());
  double max = 0;
  for (std::size_t k = 0; k < exact.nodes().size(); ++k) {
    afresh.read(k, b);
    exact.read(k, a);
    EXPECT_LT(relative_difference(a, b), 6e-8);
    rough.read(k, a);
    max = test::larger(max, relative_difference(a, b));
  }
  EXPECT_LT(max, 6e-8 * rough.error_gain());
  RecordProperty("gain", std::to_string(rough.error_gain()));
  RecordProperty("error", std::to_string(max * 1e8));
}

TEST(StiffnessChange, ThreadsAndCpusGiveTheSameBytes) {
  const model::Model before = organ_ball();
  const HandCut cut = hand_cut(before, 8, 5, 2);
  const update::StiffnessChange change =
      update::stiffness_change(before, cut.model, cut.origin, cut.place);
  const update::AxesSolve old_solve = solver(before), new_solve = solver(cut.model);
  const auto made = std::make_shared<Made>(before, old_solve, every(7, before));
  std::vector<double> first;
  for (const int threads : {1, 4})
    for (const CpuLevel cpu : {CpuLevel::baseline, best_cpu_level()}) {
      Context context;
      context.threads = threads;
      context.cpu = cpu;
      const update::CorrectedColumns corrected(made, change, new_solve, context);
      const std::size_t count = corrected.nodes().size(), size = 3 * change.new_axes;
      std::vector<double> all(count * size), one(size);
      corrected.read(0, count, all);
      corrected.read(3, one);
      EXPECT_EQ(one, std::vector<double>(all.begin() + static_cast<std::ptrdiff_t>(3 * size),
                                         all.begin() + static_cast<std::ptrdiff_t>(4 * size)));
      if (first.empty())
        first = all;
      EXPECT_EQ(first, all);
    }
}

/// A part that was cut off leaves the model: what is left is the same as if it had been computed.
TEST(StiffnessChange, ColumnsOfWhatIsLeftOfACutModel) {
  model::Model before = organ_ball();
  const auto surface = static_cast<std::uint32_t>(model::surface_count(before));
  const auto leaves = [&](std::uint32_t i) {
    return i < surface && before.nodes[i].position.x > 12;
  };
  HandCut cut;
  cut.model = before;
  cut.model.nodes.clear();
  cut.model.springs.clear();
  cut.model.normals.clear();
  cut.model.triangles.clear();
  for (std::uint32_t i = 0; i < before.nodes.size(); ++i) {
    cut.place.push_back(leaves(i) ? cutting::gone_node
                                  : static_cast<std::uint32_t>(cut.origin.size()));
    if (leaves(i))
      continue;
    cut.origin.push_back(i);
    cut.model.nodes.push_back(before.nodes[i]);
  }
  const auto missing = static_cast<std::int32_t>(before.nodes.size() - cut.origin.size());
  EXPECT_GT(missing, 10);
  for (model::Node& node : cut.model.nodes)
    if (node.central >= 0)
      node.central -= missing;
  for (model::Spring s : before.springs)
    if (!leaves(s.i) && !leaves(s.j)) {
      s.i = cut.place[s.i];
      s.j = cut.place[s.j];
      cut.model.springs.push_back(s);
    }
  expect_corrected(before, cut, 1e-9);
  EXPECT_THROW(
      update::WoodburySolver(update::stiffness_change(before, cut.model, cut.origin, cut.place),
                             solver(before), Context{}),
      Error);
}

TEST(StiffnessChange, WoodburyRefusesAPartThatNothingHolds) {
  const model::Model before = organ_ball();
  HandCut cut = hand_cut(before, 0, 0, 1);
  std::erase_if(cut.model.springs, [](const model::Spring& s) { return s.i == 8 || s.j == 8; });
  EXPECT_THROW(
      update::WoodburySolver(update::stiffness_change(before, cut.model, cut.origin, cut.place),
                             solver(before), Context{}),
      Error);
}

TEST(StiffnessChange, WoodburyRefusesWhereOneSpringHeldTheRest) {
  // A node on three springs that none can miss.
  model::Model before;
  before.materials.emplace_back();
  for (const Vec3& p : {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0.3, 0, 1}, Vec3{0, 0, 0}})
    before.nodes.push_back({.position = p, .mass = 1, .fixed = model::fixed_all});
  before.nodes[3].fixed = model::fixed_none;
  for (const std::uint32_t i : {0U, 1U, 2U})
    before.springs.push_back({i, 3, model::SpringKind::edge, 1e3 + i, 0,
                              norm(before.nodes[3].position - before.nodes[i].position)});
  const std::vector<std::uint32_t> same{0, 1, 2, 3};
  model::Model after = before;
  after.springs[2].stiffness = 1; // the control: a weak spring holds it
  const update::StiffnessChange weaker = update::stiffness_change(before, after, same, same);
  ASSERT_EQ(weaker.rank(), 1U);
  EXPECT_NO_THROW(update::WoodburySolver(weaker, solver(before), Context{}));
  after.springs.pop_back();
  const update::StiffnessChange gone = update::stiffness_change(before, after, same, same);
  ASSERT_EQ(gone.rank(), 1U);
  EXPECT_THROW(update::WoodburySolver(gone, solver(before), Context{}), Error);
}

} // namespace
