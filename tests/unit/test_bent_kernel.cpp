#include "statics/bent_compliance_internal.h"
#include "statics/bent_kernel_internal.h"

#include <Eigen/LU>

#include <cstddef>
#include <cstdint>
#include <gtest/gtest.h>
#include <random>
#include <vector>

namespace gewebe {
namespace {

using Eigen::Index, Eigen::MatrixXd, Eigen::VectorXd;

class BentKernels : public testing::Test {
protected:
  MatrixXd matrix(Index rows, Index columns) {
    return MatrixXd::NullaryExpr(rows, columns, [&] { return in_(random_); });
  }
  static MatrixXd solved(const BentKernel& kernel, MatrixXd a, MatrixXd columns) {
    std::vector<std::uint32_t> swapped(static_cast<std::size_t>(a.rows()));
    kernel.factor(a.data(), swapped.size(), swapped.data());
    kernel.solve(a.data(), swapped.data(), swapped.size(), columns.data(),
                 static_cast<std::size_t>(columns.cols()));
    return columns;
  }
  static MatrixXd product(const BentKernel& kernel, const MatrixXd& a, const MatrixXd& b) {
    MatrixXd all(a.rows(), b.cols());
    kernel.multiply(a.data(), static_cast<std::size_t>(a.rows()),
                    static_cast<std::size_t>(a.cols()), b.data(),
                    static_cast<std::size_t>(b.cols()), all.data());
    return all;
  }

private:
  std::mt19937 random_{11};
  std::uniform_real_distribution<double> in_{-1, 1};
};

TEST_F(BentKernels, SolveSystemsOfAllTheirSizes) {
  const BentKernel& kernel = bent_kernel(best_cpu_level());
  for (Index n = 1; n < static_cast<Index>(bent_kernel_rows); ++n) {
    const MatrixXd a = matrix(n, n), x = matrix(n, 1 + n % 7), b = a * x;
    const MatrixXd eigens = a.partialPivLu().solve(b), own = solved(kernel, a, b);
    EXPECT_LT((own - eigens).norm(), 1e-12 * a.norm() * a.inverse().norm() * x.norm()) << n;
  }
}

TEST_F(BentKernels, SolveWhatHasNoPivotInPlace) {
  MatrixXd a = MatrixXd::Zero(20, 20); // rows in another order
  for (Index r = 0; r < 20; ++r)
    a(r, (7 * r + 3) % 20) = static_cast<double>(1 + r);
  const MatrixXd x = matrix(20, 3);
  EXPECT_LT((solved(bent_kernel(best_cpu_level()), a, a * x) - x).norm(), 1e-14);
}

TEST_F(BentKernels, MultiplyAllShapes) {
  const BentKernel& kernel = bent_kernel(best_cpu_level());
  for (const Index rows : {1, 3, 4, 6, 9, 15, 33})
    for (const Index depth : {1, 3, 8, 9, 21, 64})
      for (const Index columns : {1, 2, 4, 7, 12}) {
        const MatrixXd a = matrix(rows, depth), b = matrix(depth, columns), c = a * b;
        EXPECT_LT((product(kernel, a, b) - c).norm(), 1e-14 * a.norm() * b.norm());
      }
}

TEST_F(BentKernels, GiveTheSameBitsOnEachLevel) {
  if (best_cpu_level() == CpuLevel::baseline)
    GTEST_SKIP() << "has one level";
  for (Index n = 1; n < static_cast<Index>(bent_kernel_rows); n += 3) {
    const MatrixXd a = matrix(n, n), b = matrix(n, 5), spread = matrix(n + 2, n);
    EXPECT_EQ(solved(bent_kernel_baseline, a, b), solved(bent_kernel_avx2, a, b)) << n;
    EXPECT_EQ(product(bent_kernel_baseline, spread, b), product(bent_kernel_avx2, spread, b)) << n;
  }
}

TEST_F(BentKernels, MoveNodesByAForceAndReadItsPoint) {
  for (const BentKernel* kernel : {&bent_kernel_baseline, &bent_kernel(best_cpu_level())})
    for (std::size_t corners = 0; corners < 4; ++corners)
      for (const Index rows : {3, 9, 12, 30}) {
        const MatrixXd w = matrix(rows, 9), weight = matrix(3, 1), n = matrix(3, 1);
        std::vector<const double*> first;
        VectorXd moved = VectorXd::Zero(rows), read = moved;
        for (Index c = 0; c < static_cast<Index>(corners); ++c) {
          const MatrixXd own = w.middleCols(3 * c, 3) * n;
          first.push_back(w.col(3 * c).data());
          moved += weight(c) * own;
        }
        VectorXd to(rows);
        kernel->push(first.data(), weight.data(), corners, static_cast<std::size_t>(rows), n.data(),
                     to.data());
        EXPECT_LT((to - moved).norm(), 1e-14) << corners;
        // What moves the nodes so is what a point of them is moved by.
        kernel->read(first.data(), weight.data(), corners, static_cast<std::size_t>(rows), n.data(),
                     read.data());
        EXPECT_LT((read - moved).norm(), 1e-14) << corners;
      }
}

/// x = (1 - W H)⁻¹ b, on few rows and on so many that the system is Eigen's.
TEST_F(BentKernels, AreThoseOfACompliance) {
  for (const Index count : {6, 30, 127, 128, 140}) {
    const Index rows = count + 9;
    const MatrixXd w = 0.1 * matrix(rows, rows), h = 0.1 * matrix(count, count),
                   b = matrix(rows, 4);
    Turning turning{{}, h};
    for (Index r = 0; r < count; ++r)
      turning.rows.push_back(r + 4);
    MatrixXd all = MatrixXd::Zero(rows, rows);
    all.block(4, 4, count, count) = h;
    const BentCompliance bent({w.data(), rows, rows}, turning);
    MatrixXd x = b;
    bent.apply(x);
    EXPECT_LT((x - w * all * x - b).norm(), 1e-11 * x.norm()) << count;
    const VectorXd v = b.col(0);
    EXPECT_LT((bent.turning(v) - all * v).norm(), 1e-13 * v.norm()) << count;
    EXPECT_LT((times({w.data(), rows, rows}, v) - w * v).norm(), 1e-13 * v.norm()) << count;
  }
}

} // namespace
} // namespace gewebe
