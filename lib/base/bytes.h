#pragma once
// Sizes in bytes as people write and read them.

#include <cstdint>
#include <string>
#include <string_view>

namespace gewebe {

/// "512 B", "3.4 KiB", "12.0 GiB".
std::string bytes_text(double bytes);

/// "4G", "512M", "1.5GiB", "1000000": binary multiples K, M, G, T with an optional "iB" or "B".
/// \throw Error if it is no positive size
std::uint64_t bytes_from_text(std::string_view text);

} // namespace gewebe
