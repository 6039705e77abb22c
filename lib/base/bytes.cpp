#include "base/bytes.h"

#include "base/error.h"

#include <array>
#include <charconv>
#include <cstdio>

namespace gewebe {

std::string bytes_text(double bytes) {
  static constexpr std::array<const char*, 7> units{"B", "KiB", "MiB", "GiB", "TiB", "PiB", "EiB"};
  std::size_t unit = 0;
  while (bytes >= 1024 && unit + 1 < units.size()) {
    bytes /= 1024;
    ++unit;
  }
  std::array<char, 64> text{};
  (void)std::snprintf(text.data(), text.size(), unit == 0 || bytes >= 1e6 ? "%.4g %s" : "%.1f %s",
                      bytes, units.at(unit));
  return text.data();
}

std::uint64_t bytes_from_text(std::string_view text) {
  double value = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, status] = std::from_chars(text.data(), end, value, std::chars_format::fixed);
  std::string_view suffix(rest, static_cast<std::size_t>(end - rest));
  double factor = 1;
  static constexpr std::string_view prefixes = "KMGT";
  if (!suffix.empty()) {
    const char upper =
        suffix[0] >= 'a' && suffix[0] <= 'z' ? static_cast<char>(suffix[0] - 32) : suffix[0];
    if (const auto power = prefixes.find(upper); power != std::string_view::npos) {
      for (std::size_t i = 0; i <= power; ++i)
        factor *= 1024;
      suffix.remove_prefix(1);
      if (suffix == "iB" || suffix == "B")
        suffix = {};
    } else if (suffix == "B") {
      suffix = {};
    }
  }
  const double bytes = value * factor;
  if (status != std::errc{} || !suffix.empty() || !(bytes >= 1) || !(bytes < 0x1p63))
    throw Error("'" + std::string(text) + "' is no size, expected a number with K, M, G or T");
  return static_cast<std::uint64_t>(bytes);
}

} // namespace gewebe
