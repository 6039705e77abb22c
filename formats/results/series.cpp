#include "formats/results/series_internal.h"

#include "base/error.h"

namespace gewebe::formats {

std::string SeriesName::name(std::uint64_t frame) const {
  const std::string number = std::to_string(frame);
  return before + std::string(width > number.size() ? width - number.size() : 0, '0') + number +
         after;
}

std::optional<SeriesName> series_in(const std::string& path) {
  const std::size_t name = path.find_last_of('/') + 1; // 0 if there is none
  const std::size_t sign = path.find('%', name);
  if (sign == std::string::npos)
    return std::nullopt;
  std::size_t end = sign + 1;
  SeriesName pattern;
  if (end < path.size() && path[end] == '0') // then the width, one digit
    for (++end; end < path.size() && path[end] >= '1' && path[end] <= '9' && pattern.width == 0;
         ++end)
      pattern.width = static_cast<std::size_t>(path[end] - '0');
  const bool good = end < path.size() && path[end] == 'd' &&
                    (pattern.width > 0 || end == sign + 1) &&
                    path.find('%', end) == std::string::npos;
  if (!good)
    throw UsageError(path + ": no pattern of a series, expected one %d or %0Nd with N from 1 to 9");
  pattern.before = path.substr(0, sign);
  pattern.after = path.substr(end + 1);
  return pattern;
}

std::optional<KeptResult> series_kept(const std::string& path, std::uint64_t frames, double time) {
  if (frames < 2)
    return std::nullopt;
  return KeptResult{frames_text(frames), time, true, "", path};
}

} // namespace gewebe::formats
