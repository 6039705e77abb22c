// The factor: C = K⁻¹ to rounding, from any thread, taken apart and put together again.

#include "fem/model_stiffness.h"
#include "linalg/factor.h"

#include "cholesky/fused_internal.h"
#include "columns/compliance_columns.h"
#include "larger.h"
#include "linalg/condition.h"
#include "stiffness_models.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <gtest/gtest.h>
#include <random>

using namespace gewebe;
using namespace gewebe::test;

namespace {

/// Keeps columns in memory.
class KeptColumns final : public columns::ColumnSink {
public:
  void write(std::size_t k, std::span<const double> columns, double) override {
    EXPECT_EQ(k, kept.size());
    kept.emplace_back(columns.begin(), columns.end());
  }
  std::vector<std::vector<double>> kept;
};

Context threads(int count) {
  Context context;
  context.threads = count;
  return context;
}

Context memory(std::uint64_t bytes) {
  Context context;
  context.max_memory = bytes;
  return context;
}

std::vector<std::uint32_t> every(std::size_t count, std::uint32_t step) {
  std::vector<std::uint32_t> nodes;
  for (std::uint32_t i = 0; i < count; i += step)
    nodes.push_back(i);
  return nodes;
}

/// max |K C - I| over the free axes of some nodes.
double identity_error(const model::Model& model, std::uint32_t step) {
  const linalg::StiffnessMatrix k = fem::stiffness_matrix(model);
  const linalg::Factor factor(k, {});
  KeptColumns sink;
  const auto nodes = every(model.nodes.size(), step);
  EXPECT_LE(columns::compliance_columns(k, factor, linalg::stiffness_norm(k), nodes, {}, sink),
            linalg::max_backward_error);
  double worst = 0;
  std::vector<double> f(3 * model.nodes.size());
  for (std::size_t c = 0; c < nodes.size(); ++c)
    for (std::size_t a = 0; a < 3; ++a) {
      const std::size_t axis = 3 * std::size_t{nodes[c]} + a;
      const std::span<const double> u(sink.kept[c].data() + a * f.size(), f.size());
      if (k.row_of_axis[axis] < 0) {
        EXPECT_TRUE(std::all_of(u.begin(), u.end(), [](double value) { return value == 0; }));
        continue;
      }
      fem::multiply_stiffness(model, u, f);
      for (std::size_t i = 0; i < f.size(); ++i)
        if (k.row_of_axis[i] >= 0)
          worst = test::larger(worst, std::abs(f[i] - (i == axis ? 1 : 0)));
    }
  return worst;
}

TEST(Factor, InvertsTheMatrixOfABall) {
  EXPECT_LT(identity_error(model_of(ball(3)), 7), 1e-9);
  EXPECT_LT(identity_error(model_of(joined(ball(2), ball(3, 2, {5, 0, 0})), 5), 5), 1e-9);
}

TEST(Factor, InvertsTheMatrixOfALiver) {
  const std::string liver = shared_file("sofa_liver_smooth.obj");
  if (liver.empty())
    GTEST_SKIP() << "no shared data";
  EXPECT_LT(identity_error(model_of_file(liver, "cm"), 100), 1e-9);
}

TEST(Factor, InvertsTheMatrixOfAColon) {
  const std::string colon = shared_file("gca90_large_intestine_20k.stl");
  if (colon.empty())
    GTEST_SKIP() << "no shared data";
  EXPECT_LT(identity_error(model_of_file(colon, "mm"), 1000), 1e-9);
}

TEST(Factor, SolvesTheSameBitsWhateverIsBesideIt) {
  const linalg::StiffnessMatrix k = fem::stiffness_matrix(model_of(ball(3)));
  Context baseline;
  baseline.cpu = CpuLevel::baseline;
  const linalg::Factor factor(k, {}), plain(k, baseline);
  const std::size_t n = k.order(), count = 19;
  std::vector<double> f = random_vector(n * count, 1), all(f.size()), one(n), u(f.size());
  std::fill_n(f.begin() + static_cast<std::ptrdiff_t>(3 * n), n, -0.0); // a zero right-hand side
  f[5 * n] = 0;
  factor.solve(f, all, count);
  EXPECT_EQ(factor.data().x, plain.data().x); // the factorisation repeats, bit by bit
  EXPECT_EQ(factor.data().permutation, plain.data().permutation);
  plain.solve(f, u, count);
  EXPECT_EQ(0, std::memcmp(u.data(), all.data(), u.size() * sizeof(double)));
  for (std::size_t c = 0; c < count; ++c) {
    factor.solve({f.data() + c * n, n}, one);
    EXPECT_EQ(0, std::memcmp(one.data(), all.data() + c * n, n * sizeof(double))) << c;
    plain.solve({f.data() + c * n, n}, one);
    EXPECT_EQ(0, std::memcmp(one.data(), all.data() + c * n, n * sizeof(double))) << c;
  }
  // Many threads at once.
  std::vector<double> again(f.size() * 8);
  parallel_blocks(threads(2), 8 * count, 1, [&](std::size_t c, std::size_t) {
    factor.solve({f.data() + c % count * n, n}, {again.data() + c * n, n});
  });
  for (std::size_t c = 0; c < 8 * count; ++c)
    EXPECT_TRUE(std::equal(again.begin() + static_cast<std::ptrdiff_t>(c * n),
                           again.begin() + static_cast<std::ptrdiff_t>((c + 1) * n),
                           all.begin() + static_cast<std::ptrdiff_t>(c % count * n)));
}

bool same_numbers(const linalg::Factor& a, const linalg::Factor& b) {
  return a.entries() == b.entries() &&
         std::memcmp(a.view().x.data(), b.view().x.data(), 8 * a.entries()) == 0;
}

/// Whether supernode k is of the front that the one before it is of: it has the rest of its rows.
bool goes_on(const linalg::FactorView& l, std::size_t k) {
  if (k == 0)
    return false;
  const std::int64_t columns = l.super[k] - l.super[k - 1];
  return l.pi[k + 1] - l.pi[k] == l.pi[k] - l.pi[k - 1] - columns &&
         std::equal(l.s.begin() + l.pi[k], l.s.begin() + l.pi[k + 1],
                    l.s.begin() + l.pi[k - 1] + columns);
}

std::size_t blocks_of_widest_front(const linalg::FactorView& l) {
  std::size_t most = 0, blocks = 0;
  for (std::size_t k = 0; k + 1 < l.super.size(); ++k) {
    blocks = goes_on(l, k) ? blocks + 1 : 1;
    most = test::larger(most, blocks);
  }
  return most;
}

/// The same with one supernode a front, as stores held it before.
linalg::FactorData by_fronts(const linalg::Factor& factor) {
  const linalg::FactorView l = factor.view();
  linalg::FactorData d = factor.data();
  d.super = d.pi = d.px = {0};
  d.s.clear();
  d.x.clear();
  d.max_row_size = 1;
  for (std::size_t first = 0, end = 0; first + 1 < l.super.size(); first = end) {
    for (end = first + 1; end + 1 < l.super.size() && goes_on(l, end);)
      ++end;
    const std::int64_t rows = l.pi[first + 1] - l.pi[first];
    const std::int64_t columns = l.super[end] - l.super[first];
    d.s.insert(d.s.end(), l.s.begin() + l.pi[first], l.s.begin() + l.pi[first + 1]);
    for (std::size_t k = first; k < end; ++k) {
      const std::int64_t above = l.super[k] - l.super[first];
      for (std::int64_t c = 0; c < l.super[k + 1] - l.super[k]; ++c) {
        const auto column = l.x.begin() + l.px[k] + c * (rows - above);
        d.x.insert(d.x.end(), static_cast<std::size_t>(above), 0.0);
        d.x.insert(d.x.end(), column, column + (rows - above));
      }
    }
    d.super.push_back(l.super[end]);
    d.pi.push_back(static_cast<std::int64_t>(d.s.size()));
    d.px.push_back(static_cast<std::int64_t>(d.x.size()));
    d.max_row_size = test::larger(d.max_row_size, rows - columns);
  }
  d.max_column_size = d.max_row_size * d.max_row_size;
  return d;
}

TEST(Factor, OfAStoreMayHaveSupernodesOfAnyWidth) {
  const linalg::StiffnessMatrix k = fem::stiffness_matrix(block_of_material(13));
  const linalg::Factor factor(k, {}), wide(by_fronts(factor), {});
  EXPECT_LT(wide.view().super.size(), factor.view().super.size());
  EXPECT_GT(wide.entries(), factor.entries() * 11 / 10);
  const std::vector<double> f = random_vector(k.order(), 4);
  std::vector<double> u(f.size());
  wide.solve(f, u);
  EXPECT_LE(linalg::backward_error(k, linalg::stiffness_norm(k), u, f), 1e-15);
}

TEST(Factor, HoldsLittleMoreThanTheEntriesOfL) {
  const linalg::Factor factor(fem::stiffness_matrix(block_of_material(13)), {});
  const linalg::FactorView l = factor.view();
  std::int64_t entries = 0, widest = 0;
  for (const std::int64_t count : l.column_count)
    entries += count;
  for (std::size_t k = 0; k + 1 < l.super.size(); ++k)
    widest = test::larger(widest, l.super[k + 1] - l.super[k]);
  EXPECT_EQ(widest, 128);
  EXPECT_GT(blocks_of_widest_front(l), 2U);
  // Above the diagonal of a block there is room for half of its square.
  EXPECT_LE(static_cast<std::int64_t>(factor.entries()), entries + l.order * (widest - 1) / 2);
  EXPECT_LT(static_cast<double>(factor.entries()), 1.1 * static_cast<double>(entries));
}

TEST(Factor, SolvesForABlockOfMaterialAndAShiftedOne) {
  const linalg::StiffnessMatrix k = fem::stiffness_matrix(block_of_material(13));
  linalg::Factor factor(k, {});
  const linalg::FactorView l = factor.view();
  EXPECT_GT(blocks_of_widest_front(l), 2U);
  const std::vector<double> f = random_vector(k.order(), 4);
  std::vector<double> u(f.size());
  factor.solve(f, u);
  EXPECT_LE(linalg::backward_error(k, linalg::stiffness_norm(k), u, f), 1e-15);
  linalg::StiffnessMatrix shifted = k;
  for (std::size_t c = 0; c < k.order(); ++c)
    shifted.value[static_cast<std::size_t>(k.column_start[c])] += 0.01 * static_cast<double>(c % 5);
  factor.refactor(shifted, {});
  factor.solve(f, u);
  EXPECT_LE(linalg::backward_error(shifted, linalg::stiffness_norm(shifted), u, f), 1e-15);
  EXPECT_FALSE(linalg::backward_error(k, linalg::stiffness_norm(k), u, f) <= 1e-12);
  EXPECT_TRUE(same_numbers(factor, linalg::Factor(shifted, {})));
  shifted.value[static_cast<std::size_t>(k.column_start[1000])] = -1;
  try {
    factor.refactor(shifted, {});
    ADD_FAILURE();
  } catch (const linalg::NotPositiveDefinite& error) {
    EXPECT_LT(error.row(), k.order());
  }
}

TEST(Factor, IsTheSameOnAnyThreadsAndProcessors) {
  const linalg::StiffnessMatrix k = fem::stiffness_matrix(block_of_material(11));
  Context one = threads(1);
  const linalg::Factor factor(k, one);
  for (const int count : {2, 3, 7})
    EXPECT_TRUE(same_numbers(factor, linalg::Factor(k, threads(count)))) << count;
  const linalg::StiffnessMatrix small = fem::stiffness_matrix(block_of_material(8));
  Context baseline;
  baseline.cpu = CpuLevel::baseline;
  EXPECT_TRUE(same_numbers(linalg::Factor(small, {}), linalg::Factor(small, baseline)));
}

TEST(Factor, NamesTheSamePivotOnAnyThreads) {
  linalg::StiffnessMatrix k = fem::stiffness_matrix(block_of_material(13));
  linalg::Factor factor(k, {});
  const linalg::FactorView l = factor.view();
  for (std::size_t f = 0; f < l.super.size() / 2; f += 20) { // in many subtrees
    const auto row = static_cast<std::size_t>(l.permutation[static_cast<std::size_t>(l.super[f])]);
    k.value[static_cast<std::size_t>(k.column_start[row])] = -1;
  }
  for (const int count : {1, 2, 3, 7})
    try {
      factor.refactor(k, threads(count));
      ADD_FAILURE() << count;
    } catch (const linalg::NotPositiveDefinite& error) {
      EXPECT_EQ(static_cast<std::int64_t>(error.row()), l.permutation[0]) << count;
    }
}

TEST(Factor, RoundsOnceWhereTheProcessorRoundsTwice) {
  std::mt19937_64 random(3);
  const auto number = [&](std::int64_t range) {
    std::uint64_t digits = random() >> 12;
    switch (random() % 4) { // few digits, all digits, many ones
    case 0:
      digits &= ~std::uint64_t{0} << random() % 52;
      break;
    case 1:
      digits |= ~std::uint64_t{0} >> 12 >> random() % 52;
      break;
    default:
      break;
    }
    const auto exponent = static_cast<int>(random() % (2 * static_cast<std::uint64_t>(range) + 1));
    const double value =
        std::ldexp(1 + static_cast<double>(digits) * 0x1p-52, exponent - static_cast<int>(range));
    return random() % 32 == 0 ? 0.0 : random() % 2 == 0 ? value : -value;
  };
  std::size_t different = 0;
  for (const std::int64_t range : {0, 2, 30, 60, 1020})
    for (int round = 0; round < 100000; ++round) {
      const cholesky::Pair a{number(range), number(range)}, b{number(range), number(range)};
      cholesky::Pair sum{number(range), number(range)};
      if (round % 2 == 0) // much is cancelled, or little is missing to half a digit
        sum = cholesky::Pair{std::ldexp(a[0] * b[0], round % 108 - 54),
                             std::nextafter(a[1] * b[1], 0)};
      const cholesky::Pair fused = cholesky::lose_fused(sum, a, b);
      for (std::size_t lane = 0; lane < 2; ++lane) {
        const double expected = std::fma(-a[lane], b[lane], sum[lane]), got = fused[lane];
        different += std::memcmp(&expected, &got, sizeof got) != 0 &&
                             !(std::isnan(expected) && std::isnan(got))
                         ? 1
                         : 0;
      }
    }
  EXPECT_EQ(different, 0u);
}

TEST(Factor, KeepsTheBackwardErrorAndItsMeasureCanFail) {
  const linalg::StiffnessMatrix k = fem::stiffness_matrix(model_of(ball(3)));
  const linalg::Factor factor(k, {});
  const double norm = linalg::stiffness_norm(k);
  const std::vector<double> f = random_vector(k.order(), 3);
  std::vector<double> x(k.order());
  factor.solve(f, x);
  EXPECT_LE(linalg::backward_error(k, norm, x, f), 1e-15);
  x[7] *= 1 + 1e-10;
  EXPECT_FALSE(linalg::backward_error(k, norm, x, f) <= linalg::max_backward_error);
  x[7] = NAN;
  EXPECT_FALSE(linalg::backward_error(k, norm, x, f) <= linalg::max_backward_error);
}

TEST(Factor, SolvesOnAllAxes) {
  const model::Model model = model_of(ball(2));
  const linalg::StiffnessMatrix k = fem::stiffness_matrix(model);
  const linalg::Factor factor(k, {});
  const std::vector<double> f = random_vector(3 * model.nodes.size(), 3);
  std::vector<double> u(f.size()), g(f.size());
  linalg::solve_axes(k, factor, f, u);
  fem::multiply_stiffness(model, u, g);
  Vec3 sum; // applied forces and the reactions of the supports cancel
  for (std::size_t i = 0; i < f.size(); ++i) {
    if (k.row_of_axis[i] >= 0) {
      EXPECT_NEAR(g[i], f[i], 1e-12);
    } else {
      EXPECT_EQ(u[i], 0);
    }
    sum[static_cast<int>(i % 3)] += g[i];
  }
  EXPECT_LE(gewebe::norm(sum), 1e-10);
}

TEST(Factor, OrderAndUnitsDoNotMatterBeyondTheCondition) {
  const model::Model model = stretched(model_of(ball(3)), 1.05);
  const linalg::StiffnessMatrix k = fem::stiffness_matrix(model);
  linalg::StiffnessCheck check;
  const linalg::Factor factor = linalg::checked_factor(model, k, {}, check);
  const std::vector<double> f = random_vector(k.order(), 6);
  std::vector<double> u(f.size());
  factor.solve(f, u);
  const double size = *std::max_element(u.begin(), u.end());
  const double tolerance = 10 * 0x1p-52 * check.condition * size;

  // Backwards: row r becomes row n - 1 - r.
  const std::size_t n = k.order();
  std::vector<std::vector<std::pair<std::int64_t, double>>> columns(n);
  for (std::size_t c = 0; c < n; ++c)
    for (auto at = static_cast<std::size_t>(k.column_start[c]);
         at < static_cast<std::size_t>(k.column_start[c + 1]); ++at)
      columns[n - 1 - static_cast<std::size_t>(k.row[at])].emplace_back(
          static_cast<std::int64_t>(n - 1 - c), k.value[at]);
  linalg::StiffnessMatrix back;
  back.axis_of_row = k.axis_of_row;
  for (auto& column : columns) {
    std::sort(column.begin(), column.end());
    back.column_start.push_back(static_cast<std::int64_t>(back.row.size()));
    for (const auto& [row, value] : column) {
      back.row.push_back(row);
      back.value.push_back(value);
    }
  }
  back.column_start.push_back(static_cast<std::int64_t>(back.row.size()));
  std::vector<double> g(f.rbegin(), f.rend()), v(n);
  linalg::Factor(back, {}).solve(g, v);
  for (std::size_t r = 0; r < n; ++r)
    EXPECT_NEAR(v[n - 1 - r], u[r], tolerance);

  for (const double scale : {1e-9, 1e9}) {
    model::Model scaled = model;
    for (model::Node& node : scaled.nodes)
      node.position *= scale;
    for (model::Spring& s : scaled.springs)
      s.rest *= scale;
    const linalg::StiffnessMatrix ks = fem::stiffness_matrix(scaled);
    linalg::Factor(ks, {}).solve(f, v);
    for (std::size_t r = 0; r < n; ++r)
      EXPECT_NEAR(v[r], u[r], tolerance);
  }
}

TEST(Factor, ComesApartAndTogether) {
  const linalg::StiffnessMatrix k = fem::stiffness_matrix(model_of(ball(2)));
  const linalg::Factor factor(k, {});
  const linalg::Factor again(factor.data());
  const std::vector<double> f = random_vector(k.order(), 1);
  std::vector<double> a(f.size()), b(f.size());
  factor.solve(f, a);
  again.solve(f, b);
  EXPECT_EQ(a, b);
  EXPECT_EQ(again.order(), factor.order());
  EXPECT_EQ(again.entries(), factor.entries());
}

TEST(Factor, OfAFileMayReachRowsThatItsParentDoesNot) { // no factorisation makes such a one
  linalg::FactorData d;
  d.order = 3;
  d.max_row_size = 2;
  d.permutation = {0, 1, 2};
  d.column_count = {3, 1, 1};
  d.super = {0, 1, 2, 3};
  d.pi = {0, 3, 4, 5};
  d.px = d.pi;
  d.s = {0, 1, 2, 1, 2};
  d.x = {2, 3, 5, 1, 1};
  const linalg::Factor factor(d);
  const std::array<std::int64_t, 1> place{0};
  std::vector<double> x(3, NAN);
  ASSERT_EQ(factor.solve_units(place, x), 1u);
  std::vector<double> f{1, 0, 0}, u(3);
  factor.solve(f, u);
  EXPECT_EQ(x, u);
  EXPECT_EQ(u, (std::vector<double>{8.75, -1.5, -2.5}));
}

TEST(Factor, RefusesArraysThatContradictThemselves) {
  const linalg::FactorData good =
      linalg::Factor(fem::stiffness_matrix(model_of(ball(1))), {}).data();
  EXPECT_NO_THROW(linalg::Factor{good});
  using Spoil = std::function<void(linalg::FactorData&)>;
  const std::vector<Spoil> spoils{
      [](linalg::FactorData& d) { ++d.order; },
      [](linalg::FactorData& d) { d.order = 0; },
      [](linalg::FactorData& d) { d.order = -1; },
      [](linalg::FactorData& d) { d.order = INT64_MAX; },
      [](linalg::FactorData& d) { d.permutation[0] = d.permutation[1]; },
      [](linalg::FactorData& d) { d.permutation[0] = -1; },
      [](linalg::FactorData& d) { d.permutation[0] = d.order; },
      [](linalg::FactorData& d) { d.permutation.pop_back(); },
      [](linalg::FactorData& d) { d.column_count[2] = 0; },
      [](linalg::FactorData& d) { d.column_count[2] = d.order + 1; },
      [](linalg::FactorData& d) { d.super[1] = 0; },
      [](linalg::FactorData& d) { d.super[0] = 1; },
      [](linalg::FactorData& d) { d.super.back() -= 1; },
      [](linalg::FactorData& d) { d.super[1] = d.super[2] + 1; },
      [](linalg::FactorData& d) { d.super = {0}; },
      [](linalg::FactorData& d) { d.super.clear(); },
      [](linalg::FactorData& d) { d.pi[1] += 1; },
      [](linalg::FactorData& d) { d.pi[1] = INT64_MAX; },
      [](linalg::FactorData& d) { d.pi[1] = INT64_MIN; },
      [](linalg::FactorData& d) { d.pi.back() = 1; },
      [](linalg::FactorData& d) { d.px[1] -= 1; },
      [](linalg::FactorData& d) { d.px.back() = -1; },
      [](linalg::FactorData& d) { d.s[0] = 1; },
      [](linalg::FactorData& d) { d.s[static_cast<std::size_t>(d.pi[1] - 1)] = d.order; },
      [](linalg::FactorData& d) { d.s[static_cast<std::size_t>(d.pi[1] - 1)] = -5; },
      [](linalg::FactorData& d) { d.s.pop_back(); },
      [](linalg::FactorData& d) { d.x.pop_back(); },
      [](linalg::FactorData& d) { d.x[0] = 0; },
      [](linalg::FactorData& d) { d.x[0] = NAN; },
      [](linalg::FactorData& d) { d.x[1] = HUGE_VAL; },
      [](linalg::FactorData& d) { d.max_row_size = 0; },
      [](linalg::FactorData& d) { d.max_column_size = -1; },
  };
  for (std::size_t i = 0; i < spoils.size(); ++i) {
    linalg::FactorData bad = good;
    spoils[i](bad);
    EXPECT_THROW(linalg::Factor{bad}, Error) << i;
  }
}

TEST(Factor, RefusesTooMuchMemory) {
  const linalg::StiffnessMatrix k = fem::stiffness_matrix(model_of(ball(3)));
  EXPECT_THROW(linalg::Factor(k, memory(10000)), Error);
  Context stopped;
  stopped.cancelled = [] { return true; };
  EXPECT_THROW(linalg::Factor(k, stopped), Cancelled);
}

TEST(ComplianceColumns, AreTheSameForAnyNumberOfThreadsAndNeighbours) {
  const model::Model model = model_of(ball(3));
  const linalg::StiffnessMatrix k = fem::stiffness_matrix(model);
  const linalg::Factor factor(k, {});
  const double norm = linalg::stiffness_norm(k);
  std::array<KeptColumns, 4> sinks;
  const auto nodes = every(model.nodes.size(), 1);
  const auto some = every(model.nodes.size(), 13);
  int told = 0;
  Context single = threads(1);
  single.progress = [&](double) { ++told; };
  columns::compliance_columns(k, factor, norm, nodes, single, sinks[0]);
  columns::compliance_columns(k, factor, norm, nodes, threads(2), sinks[1]);
  columns::compliance_columns(k, factor, norm, nodes, threads(7), sinks[2]);
  columns::compliance_columns(k, factor, norm, some, threads(2), sinks[3]);
  EXPECT_GT(told, 2);
  EXPECT_EQ(sinks[0].kept.size(), nodes.size());
  EXPECT_EQ(sinks[0].kept, sinks[1].kept);
  EXPECT_EQ(sinks[0].kept, sinks[2].kept);
  for (std::size_t i = 0; i < some.size(); ++i)
    EXPECT_EQ(sinks[3].kept[i], sinks[0].kept[some[i]]);
  // C is symmetric.
  const std::size_t row = 3 * model.nodes.size();
  const std::size_t x4 = 12, z9 = 29;
  EXPECT_NEAR(sinks[0].kept[4][z9], sinks[0].kept[9][2 * row + x4], 1e-18);
}

TEST(ComplianceColumns, AreWhatSolvingForUnitForcesGives) {
  const model::Model model = model_of(ball(2));
  const linalg::StiffnessMatrix k = fem::stiffness_matrix(model);
  const linalg::Factor factor(k, {});
  KeptColumns sink;
  const auto nodes = every(model.nodes.size(), 1); // the last block isn't full
  (void)columns::compliance_columns(k, factor, linalg::stiffness_norm(k), nodes, {}, sink);
  std::size_t different = 0;
  std::vector<double> f(3 * model.nodes.size()), u(f.size());
  for (const std::uint32_t node : nodes)
    for (std::size_t a = 0; a < 3; ++a) {
      std::fill(f.begin(), f.end(), 0.0);
      f[3 * std::size_t{node} + a] = 1;
      linalg::solve_axes(k, factor, f, u);
      different +=
          std::memcmp(u.data(), sink.kept[node].data() + a * u.size(), 8 * u.size()) != 0 ? 1 : 0;
    }
  EXPECT_EQ(different, 0u);
}

TEST(ComplianceColumns, AreTheSameOnAnyProcessorAndWithFewerRows) {
  const model::Model model = model_of(ball(3));
  const linalg::StiffnessMatrix k = fem::stiffness_matrix(model);
  const double norm = linalg::stiffness_norm(k);
  const auto nodes = every(model.nodes.size(), 3);
  KeptColumns all;
  (void)columns::compliance_columns(k, linalg::Factor(k, {}), norm, nodes, {}, all);
  for (const CpuLevel level : {CpuLevel::baseline, CpuLevel::avx2}) {
    if (level > best_cpu_level())
      continue;
    Context context;
    context.cpu = level;
    KeptColumns kept;
    (void)columns::compliance_columns(k, linalg::Factor(k, context), norm, nodes, context, kept);
    EXPECT_EQ(kept.kept, all.kept);
  }
  for (const std::size_t rows : {1u, 10u, 101u}) { // blocks of rows that end anywhere
    KeptColumns kept;
    (void)columns::compliance_columns(k, linalg::Factor(k, {}), norm, nodes, {}, kept, rows);
    for (std::size_t i = 0; i < nodes.size(); ++i)
      for (std::size_t a = 0; a < 3; ++a)
        ASSERT_EQ(0, std::memcmp(kept.kept[i].data() + a * 3 * rows,
                                 all.kept[i].data() + a * 3 * model.nodes.size(),
                                 3 * rows * sizeof(double)))
            << rows << ' ' << nodes[i];
  }
}

TEST(ComplianceColumns, StopsWhereTheSinkFailsOrMemoryIsShort) {
  struct Full final : columns::ColumnSink {
    void write(std::size_t k, std::span<const double>, double) override {
      if (k == 20)
        throw Error("full");
    }
  } full;
  const model::Model model = model_of(ball(3));
  const linalg::StiffnessMatrix k = fem::stiffness_matrix(model);
  const linalg::Factor factor(k, {});
  const auto nodes = every(100, 1);
  EXPECT_THROW(columns::compliance_columns(k, factor, linalg::stiffness_norm(k), nodes, {}, full),
               Error);
  KeptColumns sink;
  EXPECT_THROW(
      columns::compliance_columns(k, factor, linalg::stiffness_norm(k), nodes, memory(1000), sink),
      Error);
  EXPECT_TRUE(sink.kept.empty());
  EXPECT_EQ(columns::compliance_columns(k, factor, linalg::stiffness_norm(k), {}, {}, sink), 0);
}

} // namespace
