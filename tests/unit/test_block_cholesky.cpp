// Cholesky factorisation of matrices of dense blocks, against Eigen's.

#include "cholesky/block_cholesky.h"

#include "base/cpu.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <span>
#include <vector>

namespace gewebe::test {
namespace {

using Eigen::Index, Eigen::MatrixXd, Eigen::VectorXd;

struct Blocks {
  MatrixXd matrix;
  std::vector<std::uint32_t> group;
  std::vector<std::uint8_t> coupled;
};

/// Positive definite, of groups of these sizes with unknowns in any order, coupled where the table
/// says.
Blocks blocks(const std::vector<std::size_t>& sizes, const std::vector<std::uint8_t>& coupled,
              unsigned seed) {
  std::mt19937 random(seed);
  Blocks all{{}, {}, coupled};
  for (std::uint32_t g = 0; g < sizes.size(); ++g)
    all.group.insert(all.group.end(), sizes[g], g);
  std::ranges::shuffle(all.group, random);
  const auto order = static_cast<Index>(all.group.size());
  std::normal_distribution<double> number;
  all.matrix = MatrixXd::Zero(order, order);
  for (Index i = 0; i < order; ++i)
    for (Index j = 0; j <= i; ++j) {
      const std::size_t a = all.group[static_cast<std::size_t>(i)],
                        b = all.group[static_cast<std::size_t>(j)];
      if (a == b || coupled[a * sizes.size() + b] != 0)
        all.matrix(i, j) = all.matrix(j, i) = number(random);
    }
  all.matrix.diagonal().array() += 4 * std::sqrt(static_cast<double>(order) + 1);
  return all;
}

/// \return whether the factor finds it positive definite
bool factored(const Blocks& of, CpuLevel cpu, cholesky::BlockCholesky& factor) {
  factor.begin(of.group, of.coupled);
  const std::size_t groups = static_cast<std::size_t>(std::sqrt(of.coupled.size()) + 0.5);
  for (std::uint32_t i = 0; i < of.group.size(); ++i)
    for (std::uint32_t j = 0; j <= i; ++j)
      if (of.group[i] == of.group[j] || of.coupled[of.group[i] * groups + of.group[j]] != 0)
        (i % 2 == 0 ? factor.entry(i, j) : factor.entry(j, i)) += of.matrix(i, j);
  return factor.factor(cpu);
}

VectorXd solved(const Blocks& of, const VectorXd& f, CpuLevel cpu,
                cholesky::BlockCholesky& factor) {
  EXPECT_TRUE(factored(of, cpu, factor));
  MatrixXd x(f.size(), 2); // two at a time are what each is alone
  x << -2 * f, f;
  factor.solve({x.data(), static_cast<std::size_t>(x.size())});
  VectorXd alone = f;
  factor.solve({alone.data(), static_cast<std::size_t>(alone.size())});
  EXPECT_EQ(alone, x.col(1));
  EXPECT_EQ(-2 * alone, x.col(0));
  return alone;
}

TEST(BlockCholesky, SolvesAnyGraphOfGroupsAsADenseFactorDoes) {
  std::mt19937 random(5);
  cholesky::BlockCholesky factor; // one for all: it keeps memory
  for (unsigned n = 0; n < 60; ++n) {
    const std::size_t groups = 1 + random() % 7;
    std::vector<std::size_t> sizes;
    for (std::size_t g = 0; g < groups; ++g)
      sizes.push_back(n % 10 == 9 ? random() % 200 : random() % 20); // some are empty
    std::vector<std::uint8_t> coupled(groups * groups);
    for (std::size_t a = 0; a < groups; ++a)
      for (std::size_t b = 0; b < a; ++b)
        coupled[a * groups + b] = coupled[b * groups + a] =
            n % 3 == 0 ? (a == b + 1) : random() % 3 == 0; // chains, and anything
    const Blocks all = blocks(sizes, coupled, n);
    const VectorXd f = VectorXd::Random(all.matrix.rows());
    const VectorXd x = solved(all, f, best_cpu_level(), factor);
    if (f.size() == 0)
      continue;
    const VectorXd expected = all.matrix.llt().solve(f);
    EXPECT_LE((x - expected).norm(), 1e-13 * expected.norm()) << n;
    EXPECT_EQ(x, solved(all, f, CpuLevel::baseline, factor)) << n;
  }
}

TEST(BlockCholesky, AddsABlockInAnyOrder) {
  const std::vector<std::uint8_t> coupled{0, 1, 0, 1, 0, 1, 0, 1, 0};
  Blocks all = blocks({7, 5, 3}, coupled, 2);
  std::vector<std::uint32_t> unknowns; // of two groups
  for (std::uint32_t u = 0; u < all.group.size(); ++u)
    if (all.group[u] != 0)
      unknowns.push_back(u);
  std::ranges::reverse(unknowns);
  const auto order = static_cast<Index>(unknowns.size());
  const MatrixXd half = MatrixXd::Random(order, order);
  const MatrixXd block = half * half.transpose();
  cholesky::BlockCholesky factor;
  EXPECT_TRUE(factored(all, best_cpu_level(), factor));
  factor.begin(all.group, all.coupled);
  for (std::uint32_t i = 0; i < all.group.size(); ++i)
    for (std::uint32_t j = 0; j <= i; ++j)
      if (all.matrix(i, j) != 0)
        factor.entry(j, i) += all.matrix(i, j);
  factor.add_block(unknowns, {block.data(), static_cast<std::size_t>(block.size())});
  EXPECT_TRUE(factor.factor(best_cpu_level()));
  for (Index i = 0; i < order; ++i)
    for (Index j = 0; j < order; ++j)
      all.matrix(unknowns[static_cast<std::size_t>(i)], unknowns[static_cast<std::size_t>(j)]) +=
          block(i, j);
  const VectorXd f = VectorXd::Random(all.matrix.rows());
  VectorXd x = f;
  factor.solve({x.data(), static_cast<std::size_t>(x.size())});
  EXPECT_LE((all.matrix * x - f).norm(), 1e-12 * f.norm());
}

TEST(BlockCholesky, RefusesWhatIsNotPositiveDefinite) {
  const std::vector<std::uint8_t> chain{0, 1, 0, 1, 0, 1, 0, 1, 0};
  const Blocks all = blocks({4, 5, 6}, chain, 1);
  for (Index at = 0; at < all.matrix.rows(); ++at) {
    Blocks wrong = all;
    wrong.matrix(at, at) = -wrong.matrix(at, at);
    cholesky::BlockCholesky factor;
    EXPECT_FALSE(factored(wrong, best_cpu_level(), factor));
    wrong.matrix(at, at) = NAN;
    EXPECT_FALSE(factored(wrong, best_cpu_level(), factor));
  }
}

} // namespace
} // namespace gewebe::test
