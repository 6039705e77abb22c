#pragma once
// Names of series: one file for each frame.

#include "formats/results/results_writer.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

namespace gewebe::formats {

/// The place of a number in the names of a series.
struct SeriesName {
  std::string before, after;
  std::size_t width = 0; ///< filled up with zeros

  std::string name(std::uint64_t frame) const;
};

/// Nothing where the path holds no '%'.
/// \throw UsageError for anything but one %d, %0Nd in the file's name
std::optional<SeriesName> series_in(const std::string& path);

/// The files of a failed run, which are there already. \param path with its pattern
std::optional<KeptResult> series_kept(const std::string& path, std::uint64_t frames, double time);

} // namespace gewebe::formats
