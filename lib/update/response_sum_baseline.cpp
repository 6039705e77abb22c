#include "update/response_sum_body_internal.h"

namespace gewebe::update {

void response_sum_baseline(const double* packed, std::size_t count, const double* factor,
                           double* sum, std::size_t stride, std::size_t first_tile,
                           std::size_t end) {
  add_tiles(packed, count, factor, sum, stride, first_tile, end);
}

} // namespace gewebe::update
