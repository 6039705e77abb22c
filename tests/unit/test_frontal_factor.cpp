// The factor that follows changes: equal to a fresh one, by its solutions and, with the same tree,
// by its bits; cheap where a change is local.

#include "fem/model_stiffness.h"
#include "linalg/frontal_factor.h"

#include "compliance/axis_solver.h"
#include "larger.h"
#include "linalg/factor.h"
#include "mesh_fixtures.h"
#include "relative_difference.h"
#include "stiffness_models.h"

#include <Eigen/SparseCholesky>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <random>
#include <tuple>

using namespace gewebe;
using namespace gewebe::test;

namespace {

model::Model round_organ(int rounds) {
  return model_of(sphere_mesh(rounds, 20, {1, 2, 3}));
}

std::vector<double> loads(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<double> f(count);
  for (double& value : f)
    value = uniform(random);
  return f;
}

std::vector<double> solved(const linalg::FrontalFactor& factor, std::vector<double> f) {
  factor.solve(f, f.size() / factor.axes());
  return f;
}

/// By a factor that shares no code with ours.
std::vector<double> reference(const model::Model& model, const std::vector<double>& f) {
  const linalg::StiffnessMatrix k = fem::stiffness_matrix(model);
  const auto n = static_cast<Eigen::Index>(k.order());
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t c = 0; c < k.order(); ++c)
    for (auto at = static_cast<std::size_t>(k.column_start[c]);
         at < static_cast<std::size_t>(k.column_start[c + 1]); ++at)
      entries.emplace_back(static_cast<int>(k.row[at]), static_cast<int>(c), k.value[at]);
  Eigen::SparseMatrix<double> matrix(n, n);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLLT<Eigen::SparseMatrix<double>> factor(matrix);
  std::vector<double> u(f.size());
  for (std::size_t first = 0; first < f.size(); first += k.row_of_axis.size()) {
    Eigen::VectorXd rows(n);
    for (std::size_t r = 0; r < k.order(); ++r)
      rows[static_cast<Eigen::Index>(r)] = f[first + static_cast<std::size_t>(k.axis_of_row[r])];
    const Eigen::VectorXd solved = factor.solve(rows);
    for (std::size_t r = 0; r < k.order(); ++r)
      u[first + static_cast<std::size_t>(k.axis_of_row[r])] = solved[static_cast<Eigen::Index>(r)];
  }
  return u;
}

bool same_bits(const std::vector<double>& a, const std::vector<double>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), 8 * a.size()) == 0;
}

Context context_of(int threads, CpuLevel cpu = best_cpu_level()) {
  Context context;
  context.threads = threads;
  context.cpu = cpu;
  return context;
}

/// The springs nearest to a node.
std::vector<std::size_t> near(const model::Model& model, std::uint32_t node, std::size_t count) {
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t e = 0; e < model.springs.size(); ++e) {
    const Vec3 d = model.nodes[model.springs[e].i].position - model.nodes[node].position;
    order.emplace_back(dot(d, d), e);
  }
  std::sort(order.begin(), order.end());
  std::vector<std::size_t> springs;
  for (std::size_t k = 0; k < count; ++k)
    springs.push_back(order[k].second);
  return springs;
}

struct Doubled {
  model::Model model;
  std::vector<std::uint32_t> origin, place;
};

/// A node gets a copy that takes every second of its springs, and half of the central one.
Doubled doubled(const model::Model& model, std::uint32_t node) {
  Doubled d{model, {}, {}};
  const auto s = static_cast<std::uint32_t>(model::surface_count(model));
  const auto n = static_cast<std::uint32_t>(model.nodes.size());
  d.model.nodes.insert(d.model.nodes.begin() + s, model.nodes[node]);
  for (std::uint32_t i = 0; i <= n; ++i)
    d.origin.push_back(i < s ? i : i == s ? node : i - 1);
  for (std::uint32_t i = 0; i < n; ++i)
    d.place.push_back(i < s ? i : i + 1);
  d.model.springs.clear();
  std::size_t turn = 0;
  for (model::Spring spring : model.springs) {
    spring.i = d.place[spring.i];
    spring.j = d.place[spring.j];
    const bool here = spring.i == node || spring.j == node;
    model::Spring other = spring;
    std::uint32_t& end = other.i == node ? other.i : other.j;
    if (here && spring.kind == model::SpringKind::central) {
      spring.stiffness /= 2;
      other.stiffness /= 2;
      end = s;
      d.model.springs.push_back(other);
    } else if (here && ++turn % 2 == 0) {
      end = s;
      spring = other;
    }
    d.model.springs.push_back(spring);
  }
  for (model::Spring& spring : d.model.springs)
    if (spring.i > spring.j)
      std::swap(spring.i, spring.j);
  std::sort(d.model.springs.begin(), d.model.springs.end(),
            [](const model::Spring& a, const model::Spring& b) {
              return std::tuple(a.kind, a.i, a.j) < std::tuple(b.kind, b.i, b.j);
            });
  for (model::Node& one : d.model.nodes)
    if (one.central >= 0)
      one.central = static_cast<std::int32_t>(d.place[static_cast<std::size_t>(one.central)]);
  return d;
}

} // namespace

TEST(FrontalFactor, SolvesAsAnyOther) {
  for (const bool partly : {false, true}) {
    model::Model model = round_organ(4);
    if (partly)
      for (std::size_t i = 0; i < 300; ++i)
        model.nodes[7 * i].fixed = static_cast<std::uint8_t>(i % 8);
    const linalg::FrontalFactor factor(model, Context{});
    const std::vector<double> f = loads(3 * model.nodes.size(), 1);
    EXPECT_LT(relative_difference(solved(factor, f), reference(model, f)), 1e-9);
    EXPECT_EQ(factor.work().computed, factor.work().fronts);
  }
}

TEST(FrontalFactor, AllRightHandSidesAlike) {
  const model::Model model = round_organ(3);
  const linalg::FrontalFactor factor(model, Context{});
  const std::size_t axes = factor.axes();
  const std::vector<double> f = loads(30 * axes, 2), all = solved(factor, f);
  for (const std::size_t c : std::array<std::size_t, 4>{0, 7, 24, 29}) {
    const auto at = static_cast<std::ptrdiff_t>(c * axes);
    const std::vector<double> one(f.begin() + at,
                                  f.begin() + at + static_cast<std::ptrdiff_t>(axes));
    EXPECT_EQ(std::memcmp(solved(factor, one).data(), all.data() + at, 8 * axes), 0) << c;
  }
}

TEST(FrontalFactor, ThreadsAndProcessorsGiveTheSameBits) {
  const model::Model model = round_organ(4);
  const std::vector<double> f = loads(3 * model.nodes.size(), 3);
  const std::vector<double> once = solved(linalg::FrontalFactor(model, context_of(1)), f);
  EXPECT_TRUE(same_bits(once, solved(linalg::FrontalFactor(model, context_of(2)), f)));
  EXPECT_TRUE(
      same_bits(once, solved(linalg::FrontalFactor(model, context_of(2, CpuLevel::baseline)), f)));
}

TEST(FrontalFactor, FollowsStiffnessesAndComesBackToTheSameBits) {
  const model::Model model = round_organ(4);
  const std::vector<double> f = loads(3 * model.nodes.size(), 4);
  linalg::FrontalFactor factor(model, Context{});
  const std::vector<double> first = solved(factor, f);
  model::Model other = model;
  for (const std::size_t e : near(model, 100, 24))
    other.springs[e].stiffness *= 0.01;
  const cholesky::FrontalWork work = factor.refactor(other, {}, {}, Context{});
  EXPECT_GT(work.computed, 0u);
  EXPECT_LT(work.computed, work.fronts / 5) << "a local change";
  EXPECT_LT(work.operations, 0.7 * work.all_operations);
  EXPECT_LT(relative_difference(solved(factor, f), reference(other, f)), 1e-9);
  EXPECT_GT(relative_difference(solved(factor, f), first), 1e-6) << "the change must show";
  (void)factor.refactor(model, {}, {}, Context{});
  EXPECT_TRUE(same_bits(solved(factor, f), first));
  EXPECT_EQ(factor.refactor(model, {}, {}, Context{}).computed, 0u);
}

TEST(FrontalFactor, FollowsWhateverChangesARow) {
  const model::Model model = round_organ(3);
  const std::vector<double> f = loads(3 * model.nodes.size(), 4);
  const std::uint32_t node = 100;
  struct Change {
    const char* name;
    void (*make)(model::Model&);
  };
  for (const Change& change : std::vector<Change>{
           {"a rest length", [](model::Model& m) { m.springs[200].rest *= 0.5; }},
           {"a place",
            [](model::Model& m) {
              m.nodes[node].position += Vec3{0.02, 0.01, -0.03};
            }},
           {"an axis held", [](model::Model& m) { m.nodes[node].fixed = model::fixed_x; }},
           {"another axis held", [](model::Model& m) { m.nodes[node].fixed = model::fixed_z; }},
           {"a node held", [](model::Model& m) { m.nodes[node].fixed = model::fixed_all; }}}) {
    model::Model before = model;
    if (std::string(change.name) == "another axis held")
      before.nodes[node].fixed = model::fixed_x;
    model::Model after = before;
    change.make(after);
    linalg::FrontalFactor factor(before, Context{});
    const std::vector<double> first = solved(factor, f);
    const cholesky::FrontalWork work = factor.refactor(after, {}, {}, Context{});
    EXPECT_GT(work.computed, 0U) << change.name;
    EXPECT_LT(relative_difference(solved(factor, f), reference(after, f)), 1e-9) << change.name;
    EXPECT_GT(relative_difference(solved(factor, f), first), 1e-6) << change.name;
    (void)factor.refactor(before, {}, {}, Context{});
    EXPECT_LT(relative_difference(solved(factor, f), first), 1e-9) << change.name;
  }
}

TEST(FrontalFactor, FollowsCutSprings) {
  model::Model model = round_organ(3);
  linalg::FrontalFactor factor(model, Context{});
  std::mt19937 random(5);
  for (int cut = 0; cut < 20; ++cut) {
    for (const std::size_t e :
         near(model, static_cast<std::uint32_t>(random() % model.nodes.size()), 1 + random() % 5))
      if (model.springs[e].kind != model::SpringKind::central)
        model.springs[e].stiffness = 0;
    std::erase_if(model.springs, [](const model::Spring& s) { return s.stiffness == 0; });
    (void)factor.refactor(model, {}, {}, Context{});
    const std::vector<double> f = loads(3 * model.nodes.size(), 6);
    ASSERT_LT(relative_difference(solved(factor, f), reference(model, f)), 1e-8) << cut;
  }
}

TEST(FrontalFactor, FollowsDoubledNodes) {
  model::Model model = round_organ(4);
  linalg::FrontalFactor factor(model, Context{});
  std::mt19937 random(7);
  for (int cut = 0; cut < 20; ++cut) {
    const Doubled now =
        doubled(model, static_cast<std::uint32_t>(random() % model::surface_count(model)));
    model = now.model;
    ASSERT_NO_THROW(model::check_model(model));
    const cholesky::FrontalWork work = factor.refactor(model, now.origin, now.place, Context{});
    EXPECT_LT(work.computed, work.fronts / 3);
    ASSERT_EQ(factor.axes(), 3 * model.nodes.size());
    const std::vector<double> f = loads(3 * model.nodes.size(), 8);
    ASSERT_LT(relative_difference(solved(factor, f), reference(model, f)), 1e-8) << cut;
  }
}

/// Nodes in a cube, each held by springs to its corners, with some springs between near ones.
model::Model held_cloud(std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(0.1, 0.9);
  model::Model model;
  model.materials.emplace_back();
  for (unsigned k = 0; k < 8; ++k)
    model.nodes.push_back({.position = {k & 1 ? 1.0 : 0.0, k & 2 ? 1.0 : 0.0, k & 4 ? 1.0 : 0.0},
                           .mass = 1,
                           .fixed = model::fixed_all});
  for (int k = 0; k < 60; ++k)
    model.nodes.push_back(
        {.position = {uniform(random), uniform(random), uniform(random)}, .mass = 1});
  for (std::uint32_t i = 0; i < model.nodes.size(); ++i)
    for (std::uint32_t j = std::max(i + 1, 8U); j < model.nodes.size(); ++j) {
      const double length = norm(model.nodes[i].position - model.nodes[j].position);
      if (i < 8 || length < 0.25)
        model.springs.push_back({i, j, model::SpringKind::edge, 1 + length, 0, length});
    }
  return model;
}

TEST(FrontalFactor, FollowsSpringsThenNodes) {
  // Springs that go leave the tree as it is; the next copy makes another one, in which a front may
  // have lost a child that reached it by those springs alone, though none of its rows has changed.
  std::mt19937 random(1);
  for (int round = 0; round < 200; ++round) {
    model::Model model = held_cloud(random);
    linalg::FrontalFactor factor(model, Context{});
    std::erase_if(model.springs,
                  [&](const model::Spring& s) { return s.i >= 8 && random() % 3 == 0; });
    (void)factor.refactor(model, {}, {}, Context{});
    const Doubled next = doubled(model, static_cast<std::uint32_t>(8 + random() % 60));
    (void)factor.refactor(next.model, next.origin, next.place, Context{});
    const std::vector<double> f = loads(3 * next.model.nodes.size(), 5);
    ASSERT_TRUE(relative_difference(solved(factor, f), reference(next.model, f)) < 1e-12) << round;
  }
}

TEST(FrontalFactor, NamesTheAxisOfAPivotThatVanishes) {
  model::Model model = round_organ(3);
  linalg::FrontalFactor factor(model, Context{});
  std::erase_if(model.springs, [](const model::Spring& s) { return s.i == 11 || s.j == 11; });
  try {
    (void)factor.refactor(model, {}, {}, Context{});
    FAIL() << "node 11 hangs at nothing";
  } catch (const linalg::NotPositiveDefinite& error) {
    EXPECT_EQ(error.row() / 3, 11u);
  }
}

TEST(FrontalFactor, RefusesWhatDoesNotFit) {
  const model::Model model = round_organ(3);
  Context context;
  context.max_memory = 100000;
  EXPECT_THROW(linalg::FrontalFactor(model, context), Error);
  model::Model fixed = model;
  for (model::Node& node : fixed.nodes)
    node.fixed = model::fixed_all;
  EXPECT_THROW(linalg::FrontalFactor(fixed, Context{}), Error);
}

TEST(FrontalFactor, FollowsNodesThatAreGone) {
  const model::Model model = round_organ(3);
  linalg::FrontalFactor factor(model, Context{});
  // Without node 5 and its springs, and what was drawn with it.
  model::Model less = model;
  std::vector<std::uint32_t> origin, place;
  for (std::uint32_t i = 0; i < model.nodes.size(); ++i) {
    place.push_back(i < 5 ? i : i == 5 ? UINT32_MAX : i - 1);
    if (i != 5)
      origin.push_back(i);
  }
  less.nodes.erase(less.nodes.begin() + 5);
  std::erase_if(less.springs, [](const model::Spring& s) { return s.i == 5 || s.j == 5; });
  for (model::Spring& s : less.springs) {
    s.i = place[s.i];
    s.j = place[s.j];
  }
  const cholesky::FrontalWork work = factor.refactor(less, origin, place, Context{});
  EXPECT_LT(work.computed, work.fronts);
  const std::vector<double> f = loads(3 * less.nodes.size(), 9);
  EXPECT_LT(relative_difference(solved(factor, f), reference(less, f)), 1e-9);
}

TEST(FrontalFactor, ForwardSolvesGiveBlocksOfTheCompliance) {
  model::Model model = round_organ(4);
  model.nodes[70].fixed = model::fixed_y;
  model.nodes[71].fixed = model::fixed_all;
  const std::size_t axes = 3 * model.nodes.size();
  const std::vector<std::uint32_t> nodes{0,
                                         5,
                                         70,
                                         71,
                                         300,
                                         301,
                                         333,
                                         500,
                                         512,
                                         600,
                                         static_cast<std::uint32_t>(model.nodes.size() - 1)};
  for (const CpuLevel cpu : {CpuLevel::baseline, best_cpu_level()}) {
    const linalg::FrontalFactor factor(model, context_of(1, cpu));
    const auto solutions = factor.forward_solves(nodes);
    ASSERT_EQ(solutions.size(), nodes.size());
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      std::vector<double> columns(3 * axes);
      for (std::size_t a = 0; a < 3; ++a)
        columns[a * axes + 3 * std::size_t{nodes[k]} + a] = 1;
      compliance::factorise_axes(model, Context{}).solve(columns, 3);
      double size = 0;
      for (const double value : columns)
        size = test::larger(size, std::abs(value));
      // One by one they are the same bits.
      const std::array<std::uint32_t, 1> one{nodes[k]};
      EXPECT_EQ(factor.forward_solves(one)[0].values, solutions[k].values);
      for (std::size_t m = 0; m < nodes.size(); ++m) {
        const auto block = factor.compliance(solutions[k], solutions[m]);
        for (std::size_t a = 0; a < 3; ++a)
          for (std::size_t b = 0; b < 3; ++b) {
            const double error =
                std::abs(block[a][b] - columns[a * axes + 3 * std::size_t{nodes[m]} + b]);
            EXPECT_TRUE(error <= 1e-11 * size) << nodes[k] << " " << nodes[m];
          }
      }
    }
  }
}

namespace {

/// C f at these nodes, of the load that the factor carries.
std::vector<double> carried_at(const linalg::FrontalFactor& factor,
                               const std::vector<std::uint32_t>& nodes) {
  std::vector<double> u;
  for (const linalg::FrontalFactor::ForwardSolve& at : factor.forward_solves(nodes))
    for (const double value : factor.carried(at))
      u.push_back(value);
  return u;
}

std::vector<double> solved_at(const linalg::FrontalFactor& factor, const std::vector<double>& f,
                              const std::vector<std::uint32_t>& nodes) {
  const std::vector<double> all = solved(factor, f);
  std::vector<double> u;
  for (const std::uint32_t node : nodes)
    for (std::size_t a = 0; a < 3; ++a)
      u.push_back(all[3 * std::size_t{node} + a]);
  return u;
}

} // namespace

TEST(FrontalFactor, ALoadThatIsCarriedAlongFollowsTheFactorAndItself) {
  for (const CpuLevel cpu : {CpuLevel::baseline, best_cpu_level()}) {
    const Context context = context_of(1, cpu);
    model::Model model = round_organ(4);
    model.nodes[70].fixed = model::fixed_y;
    model.nodes[71].fixed = model::fixed_all;
    const std::vector<std::uint32_t> nodes{0, 5, 70, 71, 300, 500};
    linalg::FrontalFactor factor(model, context),
        twin(model, context); // which begins anew at the end
    std::vector<double> f = loads(3 * model.nodes.size(), 9);
    EXPECT_EQ(factor.carry(f), factor.work().fronts);
    EXPECT_LT(relative_difference(carried_at(factor, nodes), solved_at(factor, f, nodes)), 1e-12);
    EXPECT_EQ(factor.carry(f), 0U);
    f[3 * 300] += 1;
    const std::size_t way = factor.carry(f); // from that node's front to the root
    EXPECT_GT(way, 0U);
    EXPECT_LT(way, factor.work().fronts / 5);
    EXPECT_LT(relative_difference(carried_at(factor, nodes), solved_at(factor, f, nodes)), 1e-12);
    std::mt19937 random(7);
    for (int cut = 0; cut < 12; ++cut) {
      cholesky::FrontalWork work;
      if (cut % 3 == 1) { // springs alone: the tree stays
        for (const std::size_t e : near(model, static_cast<std::uint32_t>(random() % 600), 8))
          model.springs[e].stiffness *= 0.5;
        work = factor.refactor(model, {}, {}, context);
        (void)twin.refactor(model, {}, {}, context);
      } else {
        const Doubled now = doubled(model, 1000 + static_cast<std::uint32_t>(random() % 200));
        model = now.model;
        work = factor.refactor(model, now.origin, now.place, context);
        (void)twin.refactor(model, now.origin, now.place, context);
        std::vector<double> followed; // the load of a node stays where it is
        for (const std::uint32_t old : now.origin)
          for (std::size_t a = 0; a < 3; ++a)
            followed.push_back(f[3 * std::size_t{old} + a]);
        f = std::move(followed);
      }
      if (cut % 4 == 3)
        continue; // two changes at once
      const std::size_t solved = factor.carry(f);
      EXPECT_GE(solved, work.computed) << cut;
      EXPECT_LT(solved, work.fronts / 2) << cut;
      EXPECT_LT(relative_difference(carried_at(factor, nodes), solved_at(factor, f, nodes)), 1e-12)
          << cut;
    }
    (void)factor.carry(f);
    EXPECT_EQ(twin.carry(f), twin.work().fronts);
    EXPECT_TRUE(same_bits(carried_at(factor, nodes), carried_at(twin, nodes)));
  }
}

TEST(FrontalFactor, TheWeakestAxisIsThatOfWhatHangsLoosely) {
  model::Model model = round_organ(3);
  const std::uint32_t loose = 40;
  for (model::Spring& s : model.springs)
    if (s.i == loose || s.j == loose)
      s.stiffness *= 1e-9;
  const linalg::FrontalFactor factor(model, Context{});
  EXPECT_LT(factor.weakest_pivot(), 1); // its own diagonal is as weak
  model::Model hinge = round_organ(3);
  int kept = 0;
  for (model::Spring& s : hinge.springs)
    if ((s.i == loose || s.j == loose) && ++kept > 1)
      s.stiffness *= 1e-8;
  const linalg::FrontalFactor weak(hinge, Context{});
  EXPECT_LT(weak.weakest_pivot(), 1e-6);
  EXPECT_EQ(weak.weakest_axis() / 3, loose);
}
