#pragma once
// Instruction sets that kernels may use. Results are the same bytes at every level.

#include <string_view>

namespace gewebe {

enum class CpuLevel { baseline, avx2, avx512 };

/// The highest level that this machine supports (avx2 means AVX2 with FMA, avx512 F, DQ, BW, VL).
CpuLevel best_cpu_level() noexcept;

/// "baseline", "avx2", "avx512".
std::string_view cpu_level_name(CpuLevel level) noexcept;

/// The level of that name, lowered to what this machine supports.
/// \throw Error if there is no such level.
CpuLevel cpu_level_from_name(std::string_view name);

} // namespace gewebe
