#pragma once
// Numbers by which caches tell one thing from another.

#include <cstdint>

namespace gewebe {

/// A number above 0 that this process has not had before. Results never depend on it.
std::uint64_t unique_number() noexcept;

} // namespace gewebe
