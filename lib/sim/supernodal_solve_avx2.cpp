#include "sim/supernodal_solve_kernel_internal.h"

namespace gewebe {

void solve_single_avx2(const SupernodalArrays& l, double* x, double* work) {
  solve<Single>(l, x, work);
}

void solve_panel_avx2(const SupernodalArrays& l, double* x, double* work) {
  solve<Wide>(l, x, work);
}

} // namespace gewebe
