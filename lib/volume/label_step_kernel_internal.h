#pragma once
// One projected gradient step of label_density.h for one block of 8³ values (i fastest), once per
// CPU level; every level gives the same bits. No products are contracted.

#include <array>
#include <cstddef>

namespace gewebe {

struct LabelStep {
  std::array<float, 3> weight; ///< w_a
  float pull;                  ///< m
  float size;                  ///< of the step
  float half_diagonal;         ///< g, mm
};

/// y: the point of the step, with its neighbours along -i, +i, -j, +j, -k, +k (NaN where there are
/// none); writes the new F to `value`, which holds the old one, and returns the largest change.
using LabelStepKernel = float (*)(const LabelStep& step, const float* y,
                                  const std::array<const float*, 6>& neighbours,
                                  const float* target, const float* distance, float* value);

float label_step_baseline(const LabelStep& step, const float* y,
                          const std::array<const float*, 6>& neighbours, const float* target,
                          const float* distance, float* value);
float label_step_avx2(const LabelStep& step, const float* y,
                      const std::array<const float*, 6>& neighbours, const float* target,
                      const float* distance, float* value);

/// The body of both; `inline` in an unnamed namespace, so that each unit has its own code.
namespace {

/// 12 slices of 64 values across an axis -> w times the fourth difference at the inner 8. Second
/// differences that meet a NaN count as 0.
inline void add_fourth_difference(const float (&line)[12][64], float weight, float (&sum)[8][64]) {
  float second[10][64];
  for (int n = 0; n < 10; ++n)
    for (int m = 0; m < 64; ++m) {
      const float d = (line[n][m] - 2 * line[n + 1][m]) + line[n + 2][m];
      second[n][m] = d == d ? d : 0.0F;
    }
  for (int n = 0; n < 8; ++n)
    for (int m = 0; m < 64; ++m)
      sum[n][m] = weight * ((second[n][m] - 2 * second[n + 1][m]) + second[n + 2][m]);
}

inline float label_step(const LabelStep& step, const float* y,
                        const std::array<const float*, 6>& neighbours, const float* target,
                        const float* distance, float* value) {
  float gradient[8][8][8]; // k, j, i
  float line[12][64];
  float sum[8][64];
  // The block that holds slice n of 12 along axis a, and its place there.
  const auto slice = [&](std::size_t a, int n) {
    return n < 2 ? neighbours[2 * a] : n < 10 ? y : neighbours[2 * a + 1];
  };
  for (int n = 0; n < 12; ++n) {
    const float* const from = slice(2, n) + 64 * ((n + 6) & 7);
    for (int m = 0; m < 64; ++m)
      line[n][m] = from[m];
  }
  add_fourth_difference(line, step.weight[2], sum);
  for (int k = 0; k < 8; ++k)
    for (int m = 0; m < 64; ++m)
      (&gradient[k][0][0])[m] = sum[k][m];

  for (int n = 0; n < 12; ++n) {
    const float* const from = slice(1, n) + 8 * ((n + 6) & 7);
    for (int k = 0; k < 8; ++k)
      for (int i = 0; i < 8; ++i)
        line[n][8 * k + i] = from[64 * k + i];
  }
  add_fourth_difference(line, step.weight[1], sum);
  for (int k = 0; k < 8; ++k)
    for (int j = 0; j < 8; ++j)
      for (int i = 0; i < 8; ++i)
        gradient[k][j][i] += sum[j][8 * k + i];

  for (int n = 0; n < 12; ++n) {
    const float* const from = slice(0, n) + ((n + 6) & 7);
    for (int m = 0; m < 64; ++m)
      line[n][m] = from[8 * m];
  }
  add_fourth_difference(line, step.weight[0], sum);
  for (int k = 0; k < 8; ++k)
    for (int j = 0; j < 8; ++j)
      for (int i = 0; i < 8; ++i)
        gradient[k][j][i] += sum[i][8 * k + j];

  float change[64] = {};
  const float* const g = &gradient[0][0][0];
  for (int n = 0; n < 512; n += 64)
    for (int m = 0; m < 64; ++m) {
      const float d = distance[n + m];
      const float size = d < 0 ? -d : d;
      const float least =
          size - step.half_diagonal > 0.1F * size ? size - step.half_diagonal : 0.1F * size;
      const float low = d < 0 ? -2 * size : least, high = d < 0 ? -least : 2 * size;
      float v = y[n + m] - step.size * (g[n + m] + step.pull * (y[n + m] - target[n + m]));
      v = v < low ? low : v;
      v = v > high ? high : v;
      const float c = v > value[n + m] ? v - value[n + m] : value[n + m] - v;
      change[m] = c > change[m] ? c : change[m];
      value[n + m] = v;
    }
  float largest = 0;
  for (const float c : change)
    largest = c > largest ? c : largest;
  return largest;
}

} // namespace
} // namespace gewebe
