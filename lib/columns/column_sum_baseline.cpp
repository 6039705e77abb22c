#include "columns/column_sum_body_internal.h"

namespace gewebe::columns {

void column_sum_baseline(const double* const* column, const double* factor, std::size_t count,
                         double* sum, std::size_t begin, std::size_t end) {
  add_all(column, factor, count, sum, begin, end);
}

void column_sum_baseline(const float* const* column, const double* factor, std::size_t count,
                         double* sum, std::size_t begin, std::size_t end) {
  add_all(column, factor, count, sum, begin, end);
}

void column_sum_baseline(const std::int16_t* const* column, const double* factor, std::size_t count,
                         double* sum, std::size_t begin, std::size_t end) {
  add_all(column, factor, count, sum, begin, end);
}

void column_sum_baseline(const std::int8_t* const* column, const double* factor, std::size_t count,
                         double* sum, std::size_t begin, std::size_t end) {
  add_all(column, factor, count, sum, begin, end);
}

} // namespace gewebe::columns
