#pragma once
// One projected gradient step of label_density.h for one block of 8³ values (i fastest), once per
// CPU level; every level gives the same bits. No products are contracted.

#include <array>
#include <cstddef>

namespace gewebe::labels {

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
    const float* const from = slice(2, n) + (((n + 6) & 7) << 6);
    for (int m = 0; m < 64; ++m)
      line[n][m] = from[m];
  }
  add_fourth_difference(line, step.weight[2], sum);
  for (int k = 0; k < 8; ++k)
    for (int m = 0; m < 64; ++m)
      (&gradient[k][0][0])[m] = sum[k][m];

  for (int n = 0; n < 12; ++n) {
    const float* const from = slice(1, n) + (((n + 6) & 7) << 3);
    for (int k = 0; k < 8; ++k)
      for (int i = 0; i < 8; ++i)
        line[n][8 * k + i] = from[64 * k + i];
  }
  add_fourth_difference(line, step.weight[1], sum);
  for (int k = 0; k < 8; ++k)
    for (int j = 0; j < 8; ++j)
      for (int i = 0; i < 8; ++i)
        gradient[k][j][i] += sum[j][8 * k + i];

  // Along i the values are neighbours in memory, so that rows serve as they are.
  const float* const before = neighbours[0];
  const float* const after = neighbours[1];
  for (int m = 0; m < 64; ++m) {
    float row[12];
    float second[16] = {};
    float fourth[8];
    const float* const from = y + (m << 3);
    const float* const left = before + (m << 3);
    const float* const right = after + (m << 3);
    row[0] = left[6];
    row[1] = left[7];
    for (int i = 0; i < 8; ++i)
      row[i + 2] = from[i];
    row[10] = right[0];
    row[11] = right[1];
    for (int n = 0; n < 10; ++n) {
      const float d = (row[n] - 2 * row[n + 1]) + row[n + 2];
      second[n] = d == d ? d : 0.0F;
    }
    for (int n = 0; n < 8; ++n)
      fourth[n] = step.weight[0] * ((second[n] - 2 * second[n + 1]) + second[n + 2]);
    float* const to = &gradient[0][0][0] + (m << 3);
    for (int i = 0; i < 8; ++i)
      to[i] += fourth[i];
  }

  float change[64] = {};
  const float* const g = &gradient[0][0][0];
  for (int n = 0; n < 512; n += 64) {
    // Copies, so that the compiler need not fear that the arrays overlap.
    float d[64], at[64], to[64], old[64];
    for (int m = 0; m < 64; ++m) {
      d[m] = distance[n + m];
      at[m] = y[n + m];
      to[m] = target[n + m];
      old[m] = value[n + m];
    }
    for (int m = 0; m < 64; ++m) {
      const float v = at[m] - step.size * (g[n + m] + step.pull * (at[m] - to[m]));
      const float opposite = -v, size_of_negative = -d[m];
      const float size = d[m] < 0 ? size_of_negative : d[m];
      const float inward = d[m] < 0 ? opposite : v; // so that both kinds have the same bounds
      const float rest = size - step.half_diagonal, tenth = 0.1F * size, high = 2 * size;
      const float low = rest > tenth ? rest : tenth;
      const float above = inward < low ? low : inward;
      const float within = above > high ? high : above;
      const float back = -within;
      const float next = d[m] < 0 ? back : within;
      const float up = next - old[m], down = old[m] - next;
      const float c = up > down ? up : down;
      change[m] = c > change[m] ? c : change[m];
      old[m] = next;
    }
    for (int m = 0; m < 64; ++m)
      value[n + m] = old[m];
  }
  float largest = 0;
  for (const float c : change)
    largest = c > largest ? c : largest;
  return largest;
}

} // namespace
} // namespace gewebe::labels
