#include "solve/supernodal_solve_kernel_internal.h"

namespace gewebe {

void solve_supernodal_baseline(const SupernodalArrays& l, double* x, std::size_t vectors,
                               double* work) {
  if (vectors == 1)
    solve<Single>(l, x, 1, work);
  else if (vectors == 4)
    solve<Narrow>(l, x, 4, work);
  else
    solve<Wide>(l, x, vectors, work);
}

void forward_supernodal_baseline(const SupernodalArrays& l,
                                 std::span<const std::uint32_t> supernodes, double* x,
                                 std::size_t vectors, double* work) {
  if (vectors == 1)
    forward_some<Single>(l, supernodes, x, 1, work);
  else if (vectors == 4)
    forward_some<Narrow>(l, supernodes, x, 4, work);
  else
    forward_some<Wide>(l, supernodes, x, vectors, work);
}

} // namespace gewebe
