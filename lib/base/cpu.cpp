#include "base/cpu.h"

#include "base/error.h"

#include <algorithm>
#include <string>

namespace gewebe {

CpuLevel best_cpu_level() noexcept {
  __builtin_cpu_init();
  const bool avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  if (!avx2)
    return CpuLevel::baseline;
  const bool avx512 = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
                      __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl");
  return avx512 ? CpuLevel::avx512 : CpuLevel::avx2;
}

std::string_view cpu_level_name(CpuLevel level) noexcept {
  switch (level) {
  case CpuLevel::avx512:
    return "avx512";
  case CpuLevel::avx2:
    return "avx2";
  case CpuLevel::baseline:
    break;
  }
  return "baseline";
}

CpuLevel cpu_level_from_name(std::string_view name) {
  for (const CpuLevel level : {CpuLevel::baseline, CpuLevel::avx2, CpuLevel::avx512})
    if (name == cpu_level_name(level))
      return std::min(level, best_cpu_level());
  throw Error("no CPU level '" + std::string(name) + "', expected baseline, avx2 or avx512");
}

} // namespace gewebe
