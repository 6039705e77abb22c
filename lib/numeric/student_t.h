#pragma once

#include <cstdint>

namespace gewebe::numeric {

/// Quantile of Student's t distribution: the t that a variable exceeds with probability `tail`.
///
/// Bisects the finite series of the distribution for whole degrees of freedom (Abramowitz & Stegun
/// 1964, eq. 26.7.3 and 26.7.4), in time proportional to `freedom`.
/// \param tail     above 0, at most 1/2
/// \param freedom  degrees of freedom, at least 1
double student_t_quantile(double tail, std::uint64_t freedom);

} // namespace gewebe::numeric
