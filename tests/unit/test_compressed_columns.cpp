// Compressed columns: every entry within its bound, symmetric, the same bytes on any number of
// threads, sums as of plain columns.

#include "base/error.h"
#include "columns/column_compression.h"
#include "columns/compliance_columns.h"
#include "columns/crosses.h"
#include "compliance/axis_solver.h"
#include "fem/assembly.h"
#include "fem/model_stiffness.h"
#include "linalg/condition.h"
#include "linalg/factor.h"
#include "made_columns.h"
#include "stuffing/stuffing.h"
#include "surface_scenes.h"
#include "tests/unit/larger.h"
#include "tests/unit/stuffing_checks.h"
#include "tet_fixtures.h"
#include "tetrahedra/boundary.h"
#include "update/corrected_columns.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>
#include <initializer_list>
#include <limits>
#include <numeric>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace gewebe::test {
namespace {

/// A body whose compliance is known.
struct Body {
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> nodes; ///< that shall have columns
  linalg::StiffnessMatrix matrix;
  std::unique_ptr<linalg::Factor> factor;
  double norm = 0;

  void finish(linalg::StiffnessMatrix k) {
    matrix = std::move(k);
    factor = std::make_unique<linalg::Factor>(matrix, Context{});
    norm = linalg::stiffness_norm(matrix);
  }
  columns::ColumnMaker maker(const Context& context = {}, std::size_t rows = SIZE_MAX) const {
    return [this, context, rows](std::span<const std::uint32_t> of, columns::ColumnSink& sink) {
      return columns::compliance_columns(matrix, *factor, norm, of, context, sink, rows);
    };
  }
  columns::CompressedMade compress(double relative, int threads = 0) const {
    Context context;
    context.threads = threads;
    return columns::compress_columns(positions, nodes, relative, maker(context), context);
  }
};

class Collected final : public columns::ColumnSink {
public:
  std::vector<std::vector<double>> columns;
  void write(std::size_t /*k*/, std::span<const double> of, double /*residual*/) override {
    columns.emplace_back(of.begin(), of.end());
  }
};

/// Held where x is least.
Body solid(const tetrahedra::TetMesh& mesh, bool surface_only) {
  Body body;
  body.positions = mesh.points;
  Box3 box;
  for (const Vec3& p : mesh.points)
    box.add(p);
  std::vector<std::uint8_t> fixed(3 * mesh.points.size());
  for (std::size_t i = 0; i < mesh.points.size(); ++i)
    for (std::size_t a = 0; a < 3 && mesh.points[i].x < box.min.x + 0.1 * box.size().x; ++a)
      fixed[3 * i + a] = 1;
  const std::size_t count =
      surface_only ? tetrahedra::boundary(mesh).mesh.points.size() : mesh.points.size();
  body.nodes.resize(count);
  std::iota(body.nodes.begin(), body.nodes.end(), 0U);
  const std::vector<fem::SolidMaterial> material{{5000, 0.45, 1e-3}};
  body.finish(fem::solid_stiffness(mesh, fem::solid_elements(mesh, material), fixed));
  return body;
}

/// A ball of tetrahedra, whose surface nodes come first.
Body stuffed_ball(double cell) {
  return solid(stuffing::stuff({}, ball_grid(5, cell, {}), {}), true);
}

Body net() {
  const model::Model model = test::organ_ball(3);
  Body body;
  for (const model::Node& node : model.nodes)
    body.positions.push_back(node.position);
  for (std::uint32_t i = 0; i < model.nodes.size(); i += i % 3 == 0 ? 1 : 2)
    body.nodes.push_back(i);
  body.finish(fem::stiffness_matrix(model));
  return body;
}

Body bar() {
  return solid(test::box_tetrahedra(20, 4, 4, 0.5), false);
}

double largest(const std::vector<std::vector<double>>& columns) {
  double most = 0;
  for (const auto& column : columns)
    for (const double x : column)
      most = test::larger(most, std::abs(x));
  return most;
}

/// How far columns are from those that they stand for, over the largest entry.
double error_of(const columns::ColumnSource& columns,
                const std::vector<std::vector<double>>& exact) {
  double worst = 0;
  std::vector<double> read(9 * columns.row_nodes());
  for (std::size_t k = 0; k < exact.size(); ++k) {
    columns.read(k, read);
    for (std::size_t r = 0; r < read.size(); ++r)
      worst = test::larger(worst, std::abs(read[r] - exact[k][r]));
  }
  return worst / largest(exact);
}

/// Of all chunks.
std::size_t bytes(const columns::CompressedMade& made) {
  std::size_t sum = 0;
  for (const auto& chunk : made.chunks)
    sum += chunk.size();
  return sum;
}

void expect_within(const char* name, const Body& body, std::initializer_list<double> bounds) {
  Collected exact;
  body.maker()(body.nodes, exact);
  for (const double relative : bounds) {
    columns::CompressedMade made = body.compress(relative);
    columns::check_layout(made.layout, body.positions.size());
    EXPECT_LE(made.residual, linalg::max_backward_error);
    EXPECT_LE(made.layout.bound, relative * largest(exact.columns) * (1 + 1e-12)) << name;
    const auto columns = columns::compressed_columns(std::move(made), body.positions.size());
    ASSERT_EQ(columns->nodes(), body.nodes);
    const double error = error_of(*columns, exact.columns);
    EXPECT_LE(error, relative) << name;
    EXPECT_GE(error, relative / 10) << name << ": less would have done";
  }
}

TEST(CompressedColumns, EveryEntryOfASolidIsWithinTheBound) {
  expect_within("ball", stuffed_ball(1.5), {1e-2, 1e-3, 1e-4, 1e-5, 1e-6});
  expect_within("bar", bar(), {1e-3, 1e-5});
}

TEST(CompressedColumns, OfTheSurfaceAloneAreWithinTheBoundAndTakeLess) {
  const Body body = stuffed_ball(1.1);
  const std::size_t rows = body.nodes.size(), n = body.positions.size();
  ASSERT_LT(rows + 100, n);
  Collected exact;
  body.maker({}, rows)(body.nodes, exact);
  columns::CompressedMade made = columns::compress_columns(
      std::span(body.positions).first(rows), body.nodes, 1e-4, body.maker({}, rows), {});
  columns::check_layout(made.layout, rows);
  EXPECT_THROW(columns::check_layout(made.layout, n), Error);
  EXPECT_LT(bytes(made), 0.8 * static_cast<double>(bytes(body.compress(1e-4))));
  const auto columns = columns::compressed_columns(std::move(made), n);
  EXPECT_EQ(columns->node_count(), n);
  EXPECT_EQ(columns->row_nodes(), rows);
  EXPECT_TRUE(columns->has(static_cast<std::uint32_t>(rows - 1)));
  EXPECT_FALSE(columns->has(static_cast<std::uint32_t>(rows)));
  EXPECT_FALSE(columns->has(static_cast<std::uint32_t>(n - 1)));
  EXPECT_LE(error_of(*columns, exact.columns), 1e-4);
  EXPECT_GE(error_of(*columns, exact.columns), 1e-5) << "less would have done";
}

TEST(CompressedColumns, EveryEntryOfANetIsWithinTheBound) {
  expect_within("net", net(), {1e-2, 1e-4, 1e-6});
}

TEST(CompressedColumns, TakeLessOfLargerSolids) {
  const auto share = [](const Body& body, double relative) {
    return static_cast<double>(bytes(body.compress(relative))) /
           static_cast<double>(36 * body.nodes.size() * body.positions.size());
  };
  const Body small = stuffed_ball(1.5), large = stuffed_ball(1.1);
  EXPECT_LT(share(large, 1e-4), 0.8 * share(small, 1e-4));
  EXPECT_LT(share(large, 1e-4), 0.25);
  EXPECT_LT(share(large, 1e-2), 0.3 * share(large, 1e-4));
}

TEST(CompressedColumns, AnyNumberOfThreadsGivesTheSameBytes) {
  for (const Body& body : {stuffed_ball(1.5), net()}) {
    const columns::CompressedMade one = body.compress(1e-4, 1), five = body.compress(1e-4, 5);
    EXPECT_EQ(one.chunks, five.chunks);
    EXPECT_EQ(one.layout.count, five.layout.count);
    EXPECT_EQ(one.layout.clusters.node, five.layout.clusters.node);
    EXPECT_EQ(one.layout.bound, five.layout.bound);
  }
}

TEST(CompressedColumns, AreSymmetricBitByBitAndZeroOnFixedAxes) {
  const Body body = net();
  const auto columns = columns::compressed_columns(body.compress(1e-3), body.positions.size());
  double most = 0;
  for (std::size_t k = 0; k < body.nodes.size(); k += 7)
    for (std::uint32_t other = 0; other < body.positions.size(); other += 5) {
      const std::uint32_t node = body.nodes[k];
      const auto c = columns->block(node, other);
      for (std::size_t a = 0; a < 3; ++a)
        for (std::size_t b = 0; b < 3; ++b) {
          EXPECT_EQ(c[a][b], columns->entry(node, static_cast<int>(a), 3 * std::size_t{other} + b));
          if (columns->has(other)) {
            EXPECT_EQ(c[a][b], columns->block(other, node)[b][a]);
            EXPECT_EQ(c[a][b],
                      columns->entry(other, static_cast<int>(b), 3 * std::size_t{node} + a));
          }
          if (body.matrix.row_of_axis[3 * node + a] < 0 ||
              body.matrix.row_of_axis[3 * other + b] < 0) {
            EXPECT_EQ(c[a][b], 0);
          }
          most = test::larger(most, std::abs(c[a][b]));
        }
    }
  EXPECT_GT(most, 0);
}

TEST(CompressedColumns, BlocksColumnsAndSumsAreOfOneMatrix) {
  const Body body = stuffed_ball(1.5);
  const auto columns = columns::compressed_columns(body.compress(1e-4), body.positions.size());
  const std::size_t axes = 3 * body.positions.size();
  std::vector<double> read(3 * axes), expected(axes, 0.25), one(expected), five(expected);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(-1, 1);
  std::vector<contact::NodeVector> forces;
  double most = 0;
  for (std::size_t k = 0; k < body.nodes.size(); k += 9) {
    contact::NodeVector force{body.nodes[k], {any(random), any(random), any(random)}};
    if (k % 2 == 0)
      force.value.y = 0;
    forces.push_back(force);
    columns->read(k, read);
    for (std::size_t a = 0; a < 3; ++a)
      for (std::size_t r = 0; r < axes; ++r) {
        expected[r] += force.value[static_cast<int>(a)] * read[a * axes + r];
        most = test::larger(most, std::abs(expected[r]));
      }
    for (std::uint32_t other = 0; other < body.positions.size(); other += 11) {
      const auto block = columns->block(force.node, other);
      for (std::size_t a = 0; a < 3; ++a)
        for (std::size_t b = 0; b < 3; ++b)
          EXPECT_NEAR(block[a][b], read[a * axes + 3 * other + b], 1e-15);
    }
  }
  Context context;
  context.threads = 1;
  columns->add(forces, context, one);
  context.threads = 5;
  columns->add(forces, context, five);
  EXPECT_EQ(one, five);
  for (std::size_t r = 0; r < axes; ++r)
    EXPECT_NEAR(one[r], expected[r], 1e-13 * most);
}

/// Nothing is smooth here, so that every direction needs a cross.
TEST(CompressedColumns, AnyMatrixIsWithinTheBound) {
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  std::vector<Vec3> positions(120);
  for (Vec3& p : positions)
    p = {normal(random), normal(random), normal(random)};
  std::vector<double> c(360 * 360);
  for (std::size_t i = 0; i < 360; ++i)
    for (std::size_t j = 0; j <= i; ++j)
      c[i * 360 + j] = c[j * 360 + i] = i == j ? 4 + normal(random) : normal(random) / 3;
  std::vector<std::uint32_t> nodes(120);
  std::iota(nodes.begin(), nodes.end(), 0U);
  double most = 0;
  const columns::ColumnMaker maker = [&](std::span<const std::uint32_t> of,
                                         columns::ColumnSink& sink) {
    for (std::size_t k = 0; k < of.size(); ++k)
      sink.write(k, std::span(c).subspan(std::size_t{of[k]} * 1080, 1080), 0);
    return 0.0;
  };
  for (const double x : c)
    most = test::larger(most, std::abs(x));
  for (const double relative : {0.3, 1e-2, 1e-5}) {
    const auto columns = columns::compressed_columns(
        columns::compress_columns(positions, nodes, relative, maker, {}), 120);
    std::vector<double> read(1080);
    double worst = 0;
    for (std::size_t k = 0; k < 120; ++k) {
      columns->read(k, read);
      for (std::size_t r = 0; r < 1080; ++r)
        worst = test::larger(worst, std::abs(read[r] - c[k * 1080 + r]));
    }
    EXPECT_LE(worst, relative * most);
    EXPECT_GE(worst, relative * most / 10);
  }
  c[5 * 360 + 300] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(columns::compress_columns(positions, nodes, 1e-3, maker, {}), Error);
}

TEST(CompressedColumns, WhatContradictsItselfIsRefused) {
  const Body body = net();
  const columns::CompressedMade made = body.compress(1e-2);
  const auto refuses = [&](const std::function<void(columns::CompressedLayout&)>& spoil) {
    columns::CompressedLayout layout = made.layout;
    spoil(layout);
    EXPECT_THROW(columns::check_layout(layout, body.positions.size()), Error);
  };
  refuses([](columns::CompressedLayout& l) { l.clusters.node[3] = l.clusters.node[4]; });
  refuses([](columns::CompressedLayout& l) { l.clusters.node[3] = 1U << 30; });
  refuses([](columns::CompressedLayout& l) { l.clusters.node.pop_back(); });
  refuses([](columns::CompressedLayout& l) { l.clusters.first.back() += 1; });
  refuses(
      [](columns::CompressedLayout& l) { std::swap(l.clusters.first[1], l.clusters.first[2]); });
  refuses([](columns::CompressedLayout& l) { l.clusters.first.clear(); });
  refuses([](columns::CompressedLayout& l) { l.with_columns = l.clusters.size() + 1; });
  refuses([](columns::CompressedLayout& l) { l.count.pop_back(); });
  refuses([](columns::CompressedLayout& l) { l.count[1].narrow = 1U << 30; });
  refuses([](columns::CompressedLayout& l) { l.bound = std::numeric_limits<double>::quiet_NaN(); });
  columns::CompressedMade cut = made;
  cut.chunks[0].pop_back();
  const auto columns = columns::compressed_columns(std::move(cut), body.positions.size());
  std::vector<double> read(9 * body.positions.size());
  EXPECT_THROW(columns->read(0, read), Error);
  columns::CompressedMade loud = made;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  std::memcpy(loud.chunks[0].data(), &nan, sizeof nan);
  const auto damaged = columns::compressed_columns(std::move(loud), body.positions.size());
  EXPECT_THROW(damaged->read(0, read), Error);
  EXPECT_EQ(columns::chunk_sizes(made.layout).size(), made.chunks.size());
  for (std::size_t k = 0; k < made.chunks.size(); ++k)
    EXPECT_EQ(columns::chunk_sizes(made.layout)[k], made.chunks[k].size());
}

} // namespace
} // namespace gewebe::test
