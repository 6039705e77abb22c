#include "compliance/contact_block.h"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <random>
#include <vector>

namespace gewebe::test {
namespace {

Eigen::MatrixXd definite(int size, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd a(size, size);
  for (int i = 0; i < size; ++i)
    for (int j = 0; j < size; ++j)
      a(i, j) = normal(random);
  return a * a.transpose() + Eigen::MatrixXd::Identity(size, size);
}

void append(compliance::ContactBlock& block, const Eigen::MatrixXd& a, const std::vector<int>& rows,
            int row) {
  std::vector<double> entries;
  for (const int other : rows)
    entries.push_back(a(row, other));
  entries.push_back(a(row, row));
  ASSERT_TRUE(block.append(entries));
}

double error(const compliance::ContactBlock& block, const Eigen::MatrixXd& a,
             const std::vector<int>& rows) {
  const Eigen::MatrixXd part = a(rows, rows);
  Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(static_cast<Eigen::Index>(rows.size()), -1, 2);
  const Eigen::VectorXd expected = part.llt().solve(x), product = part * x;
  Eigen::VectorXd y(x.size());
  block.multiply({x.data(), rows.size()}, {y.data(), rows.size()});
  block.solve({x.data(), rows.size()});
  return (x - expected).norm() / expected.norm() + (y - product).norm() / product.norm();
}

TEST(ContactBlock, FollowsRowsThatJoinAndLeave) {
  const Eigen::MatrixXd a = definite(60, 3);
  compliance::ContactBlock block;
  std::vector<int> rows;
  std::mt19937 random(1);
  for (int k = 0; k < 200; ++k) {
    if (rows.size() < 6 || random() % 2 == 0) {
      const int row = static_cast<int>(random() % 60);
      if (std::find(rows.begin(), rows.end(), row) != rows.end())
        continue;
      append(block, a, rows, row);
      rows.push_back(row);
    } else {
      const std::size_t count = 1 + random() % 3, first = random() % (rows.size() - count);
      block.remove(first, count);
      rows.erase(rows.begin() + static_cast<std::ptrdiff_t>(first),
                 rows.begin() + static_cast<std::ptrdiff_t>(first + count));
    }
    ASSERT_EQ(block.size(), rows.size());
    ASSERT_LT(error(block, a, rows), 1e-11) << k;
  }
  std::swap(rows.front(), rows.back());
  EXPECT_GT(error(block, a, rows), 1e-3); // the comparison tells rows apart
}

TEST(ContactBlock, RefusesARowThatDependsOnOthers) {
  compliance::ContactBlock block;
  EXPECT_TRUE(block.append(std::vector<double>{4}));
  EXPECT_FALSE(block.append(std::vector<double>{2, 1}));
  EXPECT_FALSE(block.append(std::vector<double>{2, NAN}));
  EXPECT_EQ(block.size(), 1U);
  EXPECT_TRUE(block.append(std::vector<double>{2, 1.5}));
  std::vector<double> x{4, 2.5};
  block.solve(x);
  EXPECT_NEAR(x[0], 0.5, 1e-15);
  EXPECT_NEAR(x[1], 1, 1e-15);
}

} // namespace
} // namespace gewebe::test
