#pragma once
// Unique numbers for keys of caches.

#include <cstdint>

namespace gewebe {

/// A number above 0 that this process has not used before. Results never depend on it.
std::uint64_t unique_number() noexcept;

} // namespace gewebe
