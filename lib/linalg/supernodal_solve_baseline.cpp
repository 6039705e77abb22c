#include "linalg/supernodal_solve_kernel_internal.h"

namespace gewebe::linalg {

void solve_supernodal_baseline(const SupernodalArrays& l, double* x, std::size_t vectors,
                               double* work) {
  solve_any(l, x, vectors, work);
}

void forward_supernodal_baseline(const SupernodalArrays& l,
                                 std::span<const std::uint32_t> supernodes, double* x,
                                 std::size_t vectors, double* work) {
  forward_any(l, supernodes, x, vectors, work);
}

void solve_reached_baseline(const SupernodalArrays& l, std::span<const std::uint32_t> reached,
                            double* x, std::size_t vectors, double* work) {
  reached_any(l, reached, x, vectors, work);
}

} // namespace gewebe::linalg
