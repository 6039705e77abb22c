#pragma once
// Groups of a result as HDF5 that its readers share.

#include "formats/store/hdf5_internal.h"

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace gewebe::formats {

/// Names of objects, or of instruments, in the order of the scene.
inline std::vector<std::string> ordered_names(const hdf5::Group& of) {
  std::vector<std::pair<std::uint32_t, std::string>> ordered;
  for (const std::string& name : of.groups())
    ordered.emplace_back(of.group(name).number<std::uint32_t>("order"), name);
  std::sort(ordered.begin(), ordered.end());
  std::vector<std::string> names;
  for (auto& [order, name] : ordered)
    names.push_back(std::move(name));
  return names;
}

} // namespace gewebe::formats
