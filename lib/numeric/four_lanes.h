#pragma once
// SIMD vectors of four numbers, for kernels that are compiled once for each instruction set. The
// calling convention for returned vectors differs between the sets, so no function returns one.

namespace gewebe::numeric {
namespace {

using Four = double __attribute__((vector_size(32), aligned(8), may_alias));
using FourSingle = float __attribute__((vector_size(16), aligned(4), may_alias));

inline const Four& four(const double* at) {
  return *reinterpret_cast<const Four*>(at);
}
inline Four& four(double* at) { // NOLINT(readability-non-const-parameter)
  return *reinterpret_cast<Four*>(at);
}
inline void load(const double* at, Four& to) {
  to = four(at);
}
inline void load(const float* at, Four& to) {
  to = __builtin_convertvector(*reinterpret_cast<const FourSingle*>(at), Four);
}

} // namespace
} // namespace gewebe::numeric
