// Compliance of springs whose answer is known by hand: a chain, a truss, a net.

#include "columns/compliance_columns.h"

#include "dynamics/relaxation.h"
#include "fem/model_stiffness.h"
#include "larger.h"
#include "linalg/condition.h"
#include "mesh_fixtures.h"
#include "stiffness_models.h"
#include "tests/unit/relative_difference.h"

#include <cmath>
#include <gtest/gtest.h>
#include <numbers>
#include <utility>

using namespace gewebe;
using namespace gewebe::test;

namespace {

class Kept final : public columns::ColumnSink {
public:
  void write(std::size_t k, std::span<const double> columns, double) override {
    EXPECT_EQ(k, nodes.size());
    nodes.emplace_back(columns.begin(), columns.end());
  }
  Kept() = default;
  Kept(Kept&& other) noexcept : nodes(std::move(other.nodes)) {}
  double at(std::size_t k, std::size_t axis, std::size_t node, std::size_t along) const {
    return nodes[k][axis * nodes[k].size() / 3 + 3 * node + along];
  }
  std::vector<std::vector<double>> nodes;
};

struct Net {
  model::Model model;

  std::uint32_t add(const Vec3& position, std::uint8_t fixed) {
    model.nodes.push_back({.position = position, .mass = 1, .fixed = fixed});
    return static_cast<std::uint32_t>(model.nodes.size() - 1);
  }
  void join(std::uint32_t i, std::uint32_t j, double stiffness, double rest_over_length = 1) {
    const double l = norm(model.nodes[j].position - model.nodes[i].position);
    model.springs.push_back({.i = std::min(i, j),
                             .j = std::max(i, j),
                             .stiffness = stiffness,
                             .rest = rest_over_length * l});
  }
};

Kept columns_of(const model::Model& model, const std::vector<std::uint32_t>& nodes) {
  const linalg::StiffnessMatrix k = fem::stiffness_matrix(model);
  linalg::StiffnessCheck check;
  const linalg::Factor factor = linalg::checked_factor(model, k, {}, check);
  Kept kept;
  (void)columns::compliance_columns(k, factor, check.norm, nodes, {}, kept);
  return kept;
}

} // namespace

TEST(ComplianceAnalytic, ATwoNodeChain) {
  Net net;
  net.add({}, model::fixed_all);
  net.add({2, 0, 0}, model::fixed_y | model::fixed_z);
  net.join(0, 1, 8);
  const Kept c = columns_of(net.model, {0, 1});
  EXPECT_DOUBLE_EQ(c.at(1, 0, 1, 0), 1.0 / 8);
  EXPECT_EQ(c.at(1, 1, 1, 1), 0); // fixed
  EXPECT_EQ(c.at(0, 0, 1, 0), 0);
}

/// Springs in a row: the pull at one end stretches all that are nearer to the wall.
TEST(ComplianceAnalytic, ALongChain) {
  Net net;
  const std::uint32_t n = 40;
  std::vector<double> sum{0};
  std::vector<std::uint32_t> nodes{net.add({}, model::fixed_all)};
  for (std::uint32_t i = 1; i <= n; ++i) {
    nodes.push_back(net.add({static_cast<double>(i), 0, 0}, model::fixed_y | model::fixed_z));
    const double stiffness = 1 + i % 7;
    net.join(i - 1, i, stiffness);
    sum.push_back(sum.back() + 1 / stiffness);
  }
  const Kept c = columns_of(net.model, nodes);
  for (std::uint32_t i = 0; i <= n; ++i)
    for (std::uint32_t j = 0; j <= n; ++j)
      EXPECT_NEAR(c.at(i, 0, j, 0), sum[std::min(i, j)], 1e-13 * sum[n]);
}

/// A truss of square bays, one diagonal each, held at its left end: statically determinate, so that
/// the tip sinks under a unit load there by the sum of N²/k over the bars, with their forces N by
/// the method of sections.
TEST(ComplianceAnalytic, ACantilever) {
  for (const std::uint32_t bays : {1U, 2U, 10U}) {
    Net net;
    for (std::uint32_t i = 0; i <= bays; ++i)
      for (const double y : {0.0, 1.0})
        net.add({static_cast<double>(i), y, 0},
                static_cast<std::uint8_t>(i == 0 ? model::fixed_all : model::fixed_z));
    const double top = 3, bottom = 5, diagonal = 7, post = 11, m = bays;
    double sinks = (m - 1) / post; // the last post bears nothing
    for (std::uint32_t i = 1; i <= bays; ++i) {
      net.join(2 * i - 2, 2 * i, bottom);
      net.join(2 * i - 1, 2 * i + 1, top);
      net.join(2 * i - 2, 2 * i + 1, diagonal);
      net.join(2 * i, 2 * i + 1, post);
      const double j = i;
      sinks += (m - j + 1) * (m - j + 1) / top + (m - j) * (m - j) / bottom + 2 / diagonal;
    }
    const std::uint32_t tip = 2 * bays + 1;
    const Kept c = columns_of(net.model, {tip});
    EXPECT_NEAR(c.at(0, 1, tip, 1), sinks, 1e-12 * sinks) << bays << " bays";
    EXPECT_EQ(c.at(0, 2, tip, 2), 0);
  }
}

/// A flat net under tension, held at its border, answers a push across it as a discrete membrane:
/// by sines.
TEST(ComplianceAnalytic, AHangingNet) {
  const std::uint32_t n = 12;
  const double stiffness = 6, rest = 0.25, across = stiffness * (1 - rest);
  Net net;
  for (std::uint32_t y = 0; y <= n; ++y)
    for (std::uint32_t x = 0; x <= n; ++x)
      net.add({static_cast<double>(x), static_cast<double>(y), 0},
              x % n == 0 || y % n == 0 ? model::fixed_all : model::fixed_none);
  const auto node = [&](std::uint32_t x, std::uint32_t y) { return y * (n + 1) + x; };
  for (std::uint32_t y = 0; y <= n; ++y)
    for (std::uint32_t x = 0; x <= n; ++x) {
      if (x < n)
        net.join(node(x, y), node(x + 1, y), stiffness, rest);
      if (y < n)
        net.join(node(x, y), node(x, y + 1), stiffness, rest);
    }
  const auto sine = [&](std::uint32_t p, std::uint32_t x) {
    return std::sin(std::numbers::pi * p * x / n);
  };
  const auto expected = [&](std::uint32_t x, std::uint32_t y, std::uint32_t u, std::uint32_t v) {
    double sum = 0;
    for (std::uint32_t p = 1; p < n; ++p)
      for (std::uint32_t q = 1; q < n; ++q)
        sum +=
            sine(p, x) * sine(q, y) * sine(p, u) * sine(q, v) /
            (4 - 2 * std::cos(std::numbers::pi * p / n) - 2 * std::cos(std::numbers::pi * q / n));
    return sum * 4 / (n * n) / across;
  };
  const Kept c = columns_of(net.model, {node(3, 5)});
  const double scale = expected(3, 5, 3, 5);
  for (std::uint32_t y = 1; y < n; ++y)
    for (std::uint32_t x = 1; x < n; ++x)
      EXPECT_NEAR(c.at(0, 2, node(x, y), 2), expected(3, 5, x, y), 1e-13 * scale);
  EXPECT_GT(std::abs(expected(3, 5, 4, 5) - scale), 0.1 * scale); // the check sees neighbours
}

// ---- by relaxation

namespace {

double largest_column_difference(const Kept& a, const Kept& b) {
  double worst = 0;
  for (std::size_t k = 0; k < a.nodes.size(); ++k)
    worst = test::larger(worst, test::relative_difference(a.nodes[k], b.nodes[k]));
  return worst;
}

struct Relaxed {
  model::Model model = model_of(sphere_mesh(1, 10, {}));
  linalg::StiffnessMatrix k = fem::stiffness_matrix(model);
  linalg::StiffnessCheck check;
  linalg::Factor factor = linalg::checked_factor(model, k, {}, check);
  std::vector<std::uint32_t> nodes{0, 7, 20};

  dynamics::RelaxFigures run(const dynamics::RelaxOptions& options, Kept& kept,
                             int threads = 1) const {
    Context context;
    context.threads = threads;
    return dynamics::relaxed_columns(model, k, factor, check.norm, nodes, options, context, kept);
  }
};

} // namespace

TEST(Relaxation, ComesToTheDirectColumns) {
  const Relaxed r;
  const Kept direct = columns_of(r.model, r.nodes);
  Kept relaxed, again;
  const dynamics::RelaxFigures figures = r.run({}, relaxed);
  EXPECT_EQ(figures.pulls, 18U);
  EXPECT_LT(largest_column_difference(relaxed, direct), 1e-6);
  EXPECT_GT(largest_column_difference(relaxed, direct), 1e-15); // it is another way
  (void)r.run({}, again, 3);
  EXPECT_EQ(relaxed.nodes, again.nodes);
}

TEST(Relaxation, TooFewStepsAreWrongAndManyAreNot) {
  const Relaxed r;
  const Kept direct = columns_of(r.model, r.nodes);
  double before = 1e300;
  for (const std::uint64_t steps : {5U, 50U, 200U}) {
    Kept kept;
    (void)r.run({.steps = steps}, kept);
    EXPECT_LT(largest_column_difference(kept, direct), before);
    before = largest_column_difference(kept, direct);
    if (steps == 5) {
      EXPECT_GT(before, 0.01);
    }
  }
  Kept kept;
  const dynamics::RelaxFigures figures = r.run({.steps = 5000}, kept);
  EXPECT_EQ(figures.steps, 18U * 5000);
  EXPECT_LT(largest_column_difference(kept, direct), 1e-6);
}

TEST(Relaxation, SaysWhatNeverRests) {
  const Relaxed r;
  Kept kept;
  EXPECT_THROW((void)r.run({.threshold = 1e-300}, kept), Error);
  EXPECT_THROW((void)r.run({.force = 1e300}, kept), Error);
}
