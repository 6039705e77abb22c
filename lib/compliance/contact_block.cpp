#include "compliance/contact_block.h"

#include <cmath>

namespace gewebe::compliance {

namespace {

/// Four sums side by side: a fixed order that is quick.
double dot(const double* a, const double* b, std::size_t count) {
  double s0 = 0, s1 = 0, s2 = 0, s3 = 0;
  std::size_t k = 0;
  for (; k + 4 <= count; k += 4) {
    s0 += a[k] * b[k];
    s1 += a[k + 1] * b[k + 1];
    s2 += a[k + 2] * b[k + 2];
    s3 += a[k + 3] * b[k + 3];
  }
  for (; k < count; ++k)
    s0 += a[k] * b[k];
  return (s0 + s1) + (s2 + s3);
}

} // namespace

bool ContactBlock::append(std::span<const double> added) {
  const std::size_t n = size_;
  values_.resize((n + 1) * (n + 2) / 2);
  double* const y = row(n);
  for (std::size_t i = 0; i < n; ++i)
    y[i] = (added[i] - dot(row(i), y, i)) / row(i)[i];
  const double pivot = added[n] - dot(y, y, n);
  // What is left of a diagonal by cancellation alone is no pivot.
  if (!(pivot > 1e-14 * added[n])) {
    values_.resize(n * (n + 1) / 2);
    return false;
  }
  y[n] = std::sqrt(pivot);
  matrix_.insert(matrix_.end(), added.begin(), added.end());
  ++size_;
  return true;
}

void ContactBlock::remove(std::size_t first, std::size_t count) {
  const std::size_t behind = size_ - first - count;
  // Update of the later rows: L22' L22'ᵀ = L22 L22ᵀ + L21 L21ᵀ, one column of L21 at a time.
  std::vector<double> left(behind * count);
  for (std::size_t k = 0; k < behind; ++k) {
    const double* const from = row(first + count + k);
    for (std::size_t c = 0; c < count; ++c)
      left[c * behind + k] = from[first + c];
  }
  for (std::size_t k = 0; k < behind; ++k) {
    const double* const from = row(first + count + k);
    double* const to = row(first + k);
    for (std::size_t j = 0; j < first; ++j)
      to[j] = from[j];
    for (std::size_t j = 0; j <= k; ++j)
      to[first + j] = from[first + count + j];
  }
  std::size_t to = first * (first + 1) / 2;
  for (std::size_t i = first + count; i < size_; ++i)
    for (std::size_t j = 0; j <= i; ++j)
      if (j < first || j >= first + count)
        matrix_[to++] = matrix_[i * (i + 1) / 2 + j];
  matrix_.resize(to);
  size_ -= count;
  values_.resize(size_ * (size_ + 1) / 2);
  for (std::size_t c = 0; c < count; ++c) {
    double* const x = left.data() + c * behind;
    for (std::size_t j = 0; j < behind; ++j) {
      double& diagonal = row(first + j)[first + j];
      const double r = std::hypot(diagonal, x[j]), cosine = diagonal / r, sine = x[j] / r;
      diagonal = r;
      for (std::size_t k = j + 1; k < behind; ++k) {
        double& entry = row(first + k)[first + j];
        const double old = entry;
        entry = cosine * old + sine * x[k];
        x[k] = cosine * x[k] - sine * old;
      }
    }
  }
}

void ContactBlock::clear() {
  size_ = 0;
  values_.clear();
  matrix_.clear();
}

void ContactBlock::solve(std::span<double> x) const {
  for (std::size_t i = 0; i < size_; ++i)
    x[i] = (x[i] - dot(row(i), x.data(), i)) / row(i)[i];
  for (std::size_t i = size_; i-- > 0;) {
    const double* const l = row(i);
    x[i] /= l[i];
    for (std::size_t j = 0; j < i; ++j)
      x[j] -= l[j] * x[i];
  }
}

void ContactBlock::multiply(std::span<const double> x, std::span<double> y) const {
  const double* a = matrix_.data();
  for (std::size_t i = 0; i < size_; ++i, a += i) {
    y[i] = dot(a, x.data(), i + 1);
    for (std::size_t j = 0; j < i; ++j)
      y[j] += a[j] * x[i];
  }
}

} // namespace gewebe::compliance
