#include "base/cpu.h"
#include "columns/column_sum.h"

#include <cmath>
#include <cstdint>
#include <gtest/gtest.h>
#include <random>
#include <vector>

namespace gewebe::test {
namespace {

template <class Entry>
std::vector<double> sum_at(CpuLevel level, std::size_t count, std::size_t begin, std::size_t end) {
  const std::size_t rows = 103;
  std::mt19937 random(2);
  std::normal_distribution<double> normal;
  std::vector<std::vector<Entry>> columns(count);
  std::vector<const Entry*> pointers;
  std::vector<double> factor, sum(rows, 0.5);
  for (auto& column : columns) {
    for (std::size_t r = 0; r < rows; ++r)
      column.push_back(static_cast<Entry>(90 + 5 * normal(random)));
    pointers.push_back(column.data());
    factor.push_back(normal(random));
  }
  columns::column_sum<Entry>(level)(pointers.data(), factor.data(), count, sum.data(), begin, end);
  return sum;
}

template <class Entry>
void same_at_every_level() {
  for (const std::size_t count : {0U, 1U, 3U, 4U, 7U, 8U, 21U})
    for (const std::size_t end : {0U, 5U, 8U, 103U}) {
      const std::vector<double> sum = sum_at<Entry>(CpuLevel::baseline, count, 0, end);
      EXPECT_EQ(sum, sum_at<Entry>(best_cpu_level(), count, 0, end));
      for (std::size_t r = end; r < sum.size(); ++r)
        EXPECT_EQ(sum[r], 0.5);
      if (count > 0 && end > 0) {
        EXPECT_NE(sum[0], 0.5);
      }
    }
}

TEST(ColumnSum, IsTheSameAtEveryLevelOfCpu) {
  same_at_every_level<double>();
  same_at_every_level<float>();
  same_at_every_level<std::int16_t>();
  same_at_every_level<std::int8_t>();
}

TEST(ColumnSum, IsThePlainSum) {
  const std::vector<double> a{1, 2, 3, 4, 5, 6, 7, 8, 9}, b{-1, 0, 1, 0, 2, 0, 3, 0, 4};
  const std::vector<const double*> columns{a.data(), b.data()};
  const std::vector<double> factor{2, 10};
  std::vector<double> sum(9, 1);
  columns::column_sum<double>(best_cpu_level())(columns.data(), factor.data(), 2, sum.data(), 0, 9);
  for (std::size_t r = 0; r < 9; ++r)
    EXPECT_EQ(sum[r], 1 + 2 * a[r] + 10 * b[r]);
}

} // namespace
} // namespace gewebe::test
