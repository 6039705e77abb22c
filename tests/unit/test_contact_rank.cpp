#include "contact/contact_rank_internal.h"

#include <cmath>
#include <gtest/gtest.h>
#include <random>

namespace gewebe {
namespace {

using Eigen::Index, Eigen::Matrix3d, Eigen::MatrixXd, Eigen::VectorXd;

MatrixXd random_matrix(Index rows, Index columns, unsigned seed) {
  std::mt19937 engine(seed);
  MatrixXd m(rows, columns);
  for (Index c = 0; c < columns; ++c)
    for (Index r = 0; r < rows; ++r)
      m(r, c) = static_cast<double>(engine()) / 2147483648.0 - 1;
  return m;
}

/// Contacts of 3 rows or 1, in turn, whose compliance has this rank; blocks as an interior-point
/// method has them: from those of contacts that push to those far away.
struct Problem {
  MatrixXd w, whole, g_w;
  std::vector<Index> first, size;
  std::vector<Matrix3d> g, d;
  VectorXd b;

  Problem(std::size_t contacts, Index rank, double spread, unsigned seed) {
    Index rows = 0;
    for (std::size_t i = 0; i < contacts; ++i) {
      first.push_back(rows);
      size.push_back(i % 4 == 3 ? 1 : 3);
      rows += size.back();
    }
    const MatrixXd l = random_matrix(rows, rank, seed);
    w = l * l.transpose();
    g_w = whole = MatrixXd::Zero(rows, rows);
    b = random_matrix(rows, 1, seed + 1);
    for (std::size_t i = 0; i < contacts; ++i) {
      const Index k = first[i], n = size[i];
      Matrix3d slip = Matrix3d::Identity();
      slip.block<1, 2>(0, 1) = random_matrix(1, 2, seed + 2 + static_cast<unsigned>(i));
      g.push_back(slip);
      const double scale = std::pow(
          10.0, spread * (static_cast<double>(i) / static_cast<double>(contacts - 1) - 0.5));
      const Matrix3d root = random_matrix(3, 3, 7 * seed + static_cast<unsigned>(i));
      d.emplace_back(scale * (root * root.transpose() + Matrix3d::Identity()));
      b.segment(k, n) *= std::max(1.0, scale);
      g_w.middleRows(k, n) = slip.topLeftCorner(n, n) * w.middleRows(k, n);
      whole.middleRows(k, n) = g_w.middleRows(k, n);
      whole.block(k, k, n, n) += d.back().topLeftCorner(n, n);
    }
  }
};

TEST(ContactRank, IsThatOfTheNodes) {
  const Problem p(60, 17, 0, 1);
  const auto shared = shared_compliance(p.w, 50, 1e-12);
  ASSERT_TRUE(shared);
  EXPECT_EQ(shared->l.cols(), 17);
  EXPECT_GE(shared->rest.minCoeff(), 0);
  EXPECT_LE(shared->rest.maxCoeff(), 1e-12 * p.w.diagonal().maxCoeff());
  EXPECT_LE((p.w - shared->l * shared->l.transpose()).cwiseAbs().maxCoeff(),
            1e-11 * p.w.diagonal().maxCoeff());
  EXPECT_FALSE(shared_compliance(p.w, 16, 1e-12));
}

TEST(ContactRank, SolvesAsTheWholeMatrixDoes) {
  for (unsigned seed = 1; seed <= 10; ++seed)
    for (const double spread : {0.0, 8.0, 20.0}) {
      const Problem p(60, 24, spread, seed);
      const auto shared = shared_compliance(p.w, 50, 1e-12);
      ASSERT_TRUE(shared);
      const auto x = SharedSolver(*shared, p.g_w, p.first, p.size, p.g, p.d).solve(p.b, 1e-13);
      ASSERT_TRUE(x) << seed << " " << spread;
      // Each row by its own size: those of contacts that push are the smallest.
      const VectorXd left = p.b - p.whole * *x,
                     size = p.whole.cwiseAbs() * x->cwiseAbs() + p.b.cwiseAbs();
      EXPECT_LE((left.array().abs() / size.array()).maxCoeff(), 1e-12) << seed << " " << spread;
      const VectorXd there = p.whole.partialPivLu().solve(p.b);
      if (spread <= 8) {
        EXPECT_LE((*x - there).cwiseAbs().maxCoeff(), 1e-6 * there.cwiseAbs().maxCoeff());
      }
    }
}

TEST(ContactRank, AnotherMatrixIsNotSolved) {
  const Problem p(60, 24, 4, 3);
  const auto shared = shared_compliance(p.w, 50, 1e-12);
  ASSERT_TRUE(shared);
  const MatrixXd other = 3 * p.g_w;
  EXPECT_FALSE(SharedSolver(*shared, other, p.first, p.size, p.g, p.d).solve(p.b, 1e-13));
}

} // namespace
} // namespace gewebe
