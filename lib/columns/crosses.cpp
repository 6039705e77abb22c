#include "columns/crosses.h"

#include "base/error.h"
#include "columns/column_sum.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <type_traits>

namespace gewebe::columns {

namespace {

constexpr double narrow_most = 127, wide_most = 32767;

/// In four lanes, whose sums have a fixed order.
double product(const double* a, const double* b, std::size_t count) {
  std::array<double, 4> lane{};
  std::size_t k = 0;
  for (; k + 4 <= count; k += 4)
    for (std::size_t l = 0; l < 4; ++l)
      lane[l] += a[k + l] * b[k + l];
  for (; k < count; ++k)
    lane[0] += a[k] * b[k];
  return (lane[0] + lane[2]) + (lane[1] + lane[3]);
}

double product(std::span<const double> a, std::span<const double> b) {
  return product(a.data(), b.data(), a.size());
}

double largest(std::span<const double> values) {
  double max = 0;
  for (const double value : values)
    max = std::abs(value) > max ? std::abs(value) : max;
  return max;
}

void scale_to_one(std::span<double> values) {
  const double max = largest(values);
  if (max > 0)
    for (double& value : values)
      value /= max;
}

void round_all(std::span<double> values, double factor) {
  for (double& value : values)
    value = std::floor(value * factor + 0.5);
}

/// What is missing of a block, and the crosses found so far.
class Peeling {
public:
  Peeling(std::span<double> rest, std::size_t rows, double bound, CpuLevel cpu)
      : rest_(rest), rows_(rows), columns_(rest.size() / rows), bound_(bound),
        sum_(column_sum<double>(cpu)), u_(rows), v_(columns_), row_max_(rows) {
    for (std::size_t i = 0; i < rows_; ++i)
      row_.push_back(rest.data() + i * columns_);
    for (std::size_t i = 0; i < rows_; ++i)
      measure(i);
  }

  CrossCount run(Crosses& to) {
    while (find_pivot()) {
      peel();
      subtract();
      keep();
    }
    to.scale.insert(to.scale.end(), wide_scale_.begin(), wide_scale_.end());
    to.scale.insert(to.scale.end(), narrow_scale_.begin(), narrow_scale_.end());
    to.wide.insert(to.wide.end(), wide_.begin(), wide_.end());
    to.narrow.insert(to.narrow.end(), narrow_.begin(), narrow_.end());
    return {static_cast<std::uint32_t>(wide_scale_.size()),
            static_cast<std::uint32_t>(narrow_scale_.size())};
  }

private:
  void measure(std::size_t i) {
    double sum = 0, max = 0;
    for (std::size_t j = 0; j < columns_; ++j) {
      const double size = std::abs(row_[i][j]);
      sum += size;
      max = size > max ? size : max;
    }
    if (!std::isfinite(sum))
      throw Error("a displacement under unit force is not finite");
    row_max_[i] = max;
  }

  /// \return whether an entry is beyond the bound
  bool find_pivot() {
    i_ = static_cast<std::size_t>(std::max_element(row_max_.begin(), row_max_.end()) -
                                  row_max_.begin());
    return row_max_[i_] > bound_;
  }

  void multiply(std::span<const double> v, std::span<double> u) const {
    for (std::size_t i = 0; i < rows_; ++i)
      u[i] = product(row_[i], v.data(), columns_);
  }
  void multiply_transposed(std::span<const double> u, std::span<double> v) const {
    std::fill(v.begin(), v.end(), 0.0);
    sum_(row_.data(), u.data(), rows_, v.data(), 0, columns_);
  }

  /// The integers up to which a cross is rounded whose largest entry is `size`.
  double levels(double size) const {
    return size <= narrow_most * bound_ ? narrow_most : wide_most;
  }

  void peel() {
    std::copy_n(row_[i_], columns_, v_.begin());
    scale_to_one(v_);
    multiply(v_, u_);
    scale_to_one(u_);
    multiply_transposed(u_, v_);
    most_ = levels(largest(v_) / product(u_, u_));
    scale_to_one(v_);
    multiply(v_, u_);
    scale_to_one(u_);
    round_all(u_, most_);
    // The best v for that u.
    multiply_transposed(u_, v_);
    double size = largest(v_);
    if (!(size > 0)) { // nothing left along it after rounding
      std::fill(u_.begin(), u_.end(), 0.0);
      u_[i_] = most_;
      multiply_transposed(u_, v_);
      size = largest(v_);
    }
    scale_ = size / (product(u_, u_) * most_);
    round_all(v_, most_ / size);
  }

  void subtract() {
    const double* const column = v_.data();
    for (std::size_t i = 0; i < rows_; ++i) {
      const double factor = -(scale_ * u_[i]);
      if (factor == 0)
        continue;
      sum_(&column, &factor, 1, row_[i], 0, columns_);
      measure(i);
    }
  }

  void keep() {
    const auto append = [&](auto& to) {
      using T = typename std::remove_reference_t<decltype(to)>::value_type;
      for (const double value : u_)
        to.push_back(static_cast<T>(value));
      for (const double value : v_)
        to.push_back(static_cast<T>(value));
    };
    if (most_ == wide_most) {
      wide_scale_.push_back(scale_);
      append(wide_);
    } else {
      narrow_scale_.push_back(scale_);
      append(narrow_);
    }
  }

  std::span<double> rest_;
  std::size_t rows_, columns_;
  double bound_;
  ColumnSum<double> sum_;
  std::vector<double*> row_;
  std::vector<double> u_, v_, row_max_;
  std::vector<double> wide_scale_, narrow_scale_;
  std::vector<std::int16_t> wide_;
  std::vector<std::int8_t> narrow_;
  std::size_t i_ = 0; ///< the row with the largest entry
  double most_ = 0;
  double scale_ = 0;
};

/// The lower triangle of a symmetric block as integers of one or two scales.
CrossCount append_triangle(std::span<const double> block, std::size_t rows, double bound,
                           Crosses& to) {
  const double size = largest(block), fine = 2 * bound;
  const bool narrow_alone = size <= narrow_most * fine, wide_alone = size <= wide_most * fine;
  const double coarse = wide_alone ? fine : size / wide_most;
  if (!(coarse <= narrow_most * 2 * fine))
    throw Error("columns can't be compressed with so small a bound");
  CrossCount count;
  if (size <= bound)
    return count;
  count.wide = narrow_alone ? 0 : 1;
  count.narrow = narrow_alone || !wide_alone ? 1 : 0;
  if (count.wide > 0)
    to.scale.push_back(coarse);
  if (count.narrow > 0)
    to.scale.push_back(fine);
  for (std::size_t i = 0; i < rows; ++i)
    for (std::size_t j = 0; j <= i; ++j) {
      double value = block[i * rows + j];
      if (count.wide > 0) {
        const double whole = std::floor(value / coarse + 0.5);
        to.wide.push_back(static_cast<std::int16_t>(whole));
        value -= coarse * whole;
      }
      if (count.narrow > 0)
        to.narrow.push_back(static_cast<std::int8_t>(std::floor(value / fine + 0.5)));
    }
  return count;
}

std::size_t in_triangle(std::size_t i, std::size_t j) {
  return i < j ? j * (j + 1) / 2 + i : i * (i + 1) / 2 + j;
}

template <class T>
void add_entries_of(const CrossView& b, const T* from, const double* scale, std::size_t count,
                    std::size_t row, std::size_t column, std::size_t size, double* to) {
  const std::size_t stride = b.stride();
  for (std::size_t k = 0; k < count; ++k, from += stride)
    for (std::size_t r = 0; r < size; ++r) {
      const double by = b.symmetric ? scale[k] : scale[k] * static_cast<double>(from[row + r]);
      for (std::size_t c = 0; c < size; ++c) {
        const std::size_t at = b.symmetric ? in_triangle(row + r, column + c) : b.rows + column + c;
        to[size * r + c] += by * static_cast<double>(from[at]);
      }
    }
}

template <class T>
void add_triangle_of(const CrossView& b, const T* from, const double* scale, std::size_t count,
                     std::span<const CrossLoad> x, std::span<double> y) {
  for (std::size_t k = 0; k < count; ++k, from += b.stride())
    for (const CrossLoad& load : x) {
      const double by = scale[k] * load.value;
      const T* at = from + in_triangle(load.at, 0);
      for (std::size_t i = 0; i <= load.at; ++i)
        y[i] += by * static_cast<double>(at[i]);
      at += load.at;
      for (std::size_t i = load.at + 1; i < b.rows; ++i)
        y[i] += by * static_cast<double>(*(at += i));
    }
}

/// In four lanes, as product().
template <class T>
double product_of(const T* from, std::span<const CrossLoad> x) {
  std::array<double, 4> lane{};
  std::size_t k = 0;
  for (; k + 4 <= x.size(); k += 4)
    for (std::size_t l = 0; l < 4; ++l)
      lane[l] += static_cast<double>(from[x[k + l].at]) * x[k + l].value;
  for (; k < x.size(); ++k)
    lane[0] += static_cast<double>(from[x[k].at]) * x[k].value;
  return (lane[0] + lane[2]) + (lane[1] + lane[3]);
}

template <class T>
void add_product_of(const CrossView& b, const T* from, const double* scale, std::size_t count,
                    bool transposed, std::span<const CrossLoad> x, CpuLevel cpu,
                    std::span<double> y) {
  constexpr std::size_t at_once = 64;
  std::array<const T*, at_once> column{};
  std::array<double, at_once> factor{};
  if (b.symmetric)
    return add_triangle_of(b, from, scale, count, x, y);
  const std::size_t stride = b.stride();
  const std::size_t input = transposed ? 0 : b.rows, output = transposed ? b.rows : 0;
  for (std::size_t done = 0; done < count; done += at_once) {
    const std::size_t some = std::min(at_once, count - done);
    for (std::size_t k = 0; k < some; ++k) {
      const T* const cross = from + (done + k) * stride;
      column[k] = cross + output;
      factor[k] = scale[done + k] * product_of(cross + input, x);
    }
    column_sum<T>(cpu)(column.data(), factor.data(), some, y.data(), 0, y.size());
  }
}

template <class T>
void append_largest(const CrossView& b, const T* from, std::size_t count,
                    std::vector<std::array<double, 2>>& to) {
  const auto most = [](const T* begin, std::size_t size) {
    int largest = 0;
    for (std::size_t k = 0; k < size; ++k)
      largest = std::max(largest, std::abs(int{begin[k]}));
    return static_cast<double>(largest);
  };
  for (std::size_t k = 0; k < count; ++k, from += b.stride())
    to.push_back({most(from, b.rows), most(from + b.rows, b.columns)});
}

template <class T>
double product_bound_of(const CrossView& b, const T* from, const double* scale, std::size_t count,
                        bool transposed, std::span<const CrossLoad> x,
                        const std::array<double, 2>* largest) {
  const std::size_t input = transposed ? 0 : b.rows;
  double sum = 0;
  for (std::size_t k = 0; k < count; ++k)
    sum += std::abs(scale[k] * product_of(from + k * b.stride() + input, x)) *
           largest[k][transposed ? 1 : 0];
  return sum;
}

} // namespace

CrossCount append_crosses(std::span<double> rest, std::size_t rows, bool symmetric, double bound,
                          CpuLevel cpu, Crosses& to) {
  bound *= 1 - 1e-9; // sums of crosses have other roundings than what was peeled off
  Peeling peeling(rest, rows, bound, cpu);
  return symmetric ? append_triangle(rest, rows, bound, to) : peeling.run(to);
}

void add_entries(const CrossView& block, std::size_t row, std::size_t column, std::size_t size,
                 double* to) {
  add_entries_of(block, block.wide, block.scale, block.count.wide, row, column, size, to);
  add_entries_of(block, block.narrow, block.scale + block.count.wide, block.count.narrow, row,
                 column, size, to);
}

std::vector<std::array<double, 2>> largest_entries(const CrossView& block) {
  std::vector<std::array<double, 2>> all;
  append_largest(block, block.wide, block.count.wide, all);
  append_largest(block, block.narrow, block.count.narrow, all);
  return all;
}

double product_bound(const CrossView& block, bool transposed, std::span<const CrossLoad> x,
                     std::span<const std::array<double, 2>> largest) {
  return product_bound_of(block, block.wide, block.scale, block.count.wide, transposed, x,
                          largest.data()) +
         product_bound_of(block, block.narrow, block.scale + block.count.wide, block.count.narrow,
                          transposed, x, largest.data() + block.count.wide);
}

void add_product(const CrossView& block, bool transposed, std::span<const CrossLoad> x,
                 CpuLevel cpu, std::span<double> y) {
  add_product_of(block, block.wide, block.scale, block.count.wide, transposed, x, cpu, y);
  add_product_of(block, block.narrow, block.scale + block.count.wide, block.count.narrow,
                 transposed, x, cpu, y);
}

} // namespace gewebe::columns
