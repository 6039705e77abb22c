#pragma once
// Solving with a supernodal factor, once per CPU level; every level gives the same bits, and so
// does every number of right-hand sides. Nothing is shared between calls, so any number of threads
// may solve at once, which not every BLAS allows.

#include "base/cpu.h"

#include <cstddef>
#include <cstdint>
#include <span>

namespace gewebe::linalg {

/// L as in cholmod_factor: supernode k has columns super[k] … super[k+1]-1, rows s[pi[k] …
/// pi[k+1]-1], its own columns first, and values x[px[k] …], column by column; or, where those are
/// apart, at blocks[k].
struct SupernodalArrays {
  std::size_t supernodes = 0;
  const std::int64_t* super = nullptr;
  const std::int64_t* pi = nullptr;
  const std::int64_t* px = nullptr;
  const std::int64_t* s = nullptr;
  const double* x = nullptr;
  const double* const* blocks = nullptr;
};

inline constexpr std::size_t panel_width = 8;

/// How many right-hand sides to set side by side for so many: one, four (those of a node's axes),
/// or a multiple of panel_width.
inline std::size_t solve_width(std::size_t vectors) {
  return vectors == 1   ? 1
         : vectors <= 4 ? 4
                        : (vectors + panel_width - 1) / panel_width * panel_width;
}

/// x = L⁻ᵀ L⁻¹ x in place, for `vectors` of them side by side, x[row][vector]: solve_width() many,
/// at most 64 panels. `work` holds `vectors` numbers for each row that the longest supernode has
/// below its own columns.
using SupernodalSolve = void (*)(const SupernodalArrays& l, double* x, std::size_t vectors,
                                 double* work);

/// The first half alone, x = L⁻¹ x, of right-hand sides that reach these supernodes only,
/// ascending.
using SupernodalForward = void (*)(const SupernodalArrays& l,
                                   std::span<const std::uint32_t> supernodes, double* x,
                                   std::size_t vectors, double* work);

/// Both halves, of right-hand sides that reach no other supernodes than these in the first one,
/// ascending. Rows of others need not be set.
using SolveReached = void (*)(const SupernodalArrays& l, std::span<const std::uint32_t> reached,
                              double* x, std::size_t vectors, double* work);

void solve_supernodal_baseline(const SupernodalArrays& l, double* x, std::size_t vectors,
                               double* work);
void solve_supernodal_avx2(const SupernodalArrays& l, double* x, std::size_t vectors, double* work);
void solve_supernodal_avx512(const SupernodalArrays& l, double* x, std::size_t vectors,
                             double* work);

void forward_supernodal_baseline(const SupernodalArrays& l,
                                 std::span<const std::uint32_t> supernodes, double* x,
                                 std::size_t vectors, double* work);
void forward_supernodal_avx2(const SupernodalArrays& l, std::span<const std::uint32_t> supernodes,
                             double* x, std::size_t vectors, double* work);
void forward_supernodal_avx512(const SupernodalArrays& l, std::span<const std::uint32_t> supernodes,
                               double* x, std::size_t vectors, double* work);

void solve_reached_baseline(const SupernodalArrays& l, std::span<const std::uint32_t> reached,
                            double* x, std::size_t vectors, double* work);
void solve_reached_avx2(const SupernodalArrays& l, std::span<const std::uint32_t> reached,
                        double* x, std::size_t vectors, double* work);
void solve_reached_avx512(const SupernodalArrays& l, std::span<const std::uint32_t> reached,
                          double* x, std::size_t vectors, double* work);

inline SupernodalSolve solve_supernodal(CpuLevel cpu) {
  return cpu == CpuLevel::baseline ? solve_supernodal_baseline
         : cpu == CpuLevel::avx2   ? solve_supernodal_avx2
                                   : solve_supernodal_avx512;
}
inline SupernodalForward forward_supernodal(CpuLevel cpu) {
  return cpu == CpuLevel::baseline ? forward_supernodal_baseline
         : cpu == CpuLevel::avx2   ? forward_supernodal_avx2
                                   : forward_supernodal_avx512;
}

inline SolveReached solve_reached(CpuLevel cpu) {
  return cpu == CpuLevel::baseline ? solve_reached_baseline
         : cpu == CpuLevel::avx2   ? solve_reached_avx2
                                   : solve_reached_avx512;
}

} // namespace gewebe::linalg
