#include "tools/cli/memory_limit.h"

#include <algorithm>
#include <fstream>
#include <sys/resource.h>
#include <unistd.h>

namespace gewebe::cli {
namespace {

constexpr std::uint64_t unlimited = UINT64_MAX;

/// The number in a file. UINT64_MAX if the file is absent or holds a word ("max").
std::uint64_t read_number(const std::string& path) {
  std::ifstream file(path);
  std::uint64_t value = 0;
  return file >> value ? value : unlimited;
}

/// The number that follows `name` in a file of keys and numbers.
std::uint64_t read_key(const std::string& path, const std::string& name, std::uint64_t absent) {
  std::ifstream file(path);
  std::string key;
  std::uint64_t value = 0;
  for (std::string rest; file >> key >> value; std::getline(file, rest))
    if (key == name)
      return value;
  return absent;
}

/// Names of the files of one version of control groups.
struct GroupFiles {
  const char* limit;
  const char* used;
  const char* cache; ///< key in memory.stat
};
constexpr GroupFiles version_1{"/memory.limit_in_bytes", "/memory.usage_in_bytes",
                               "total_inactive_file"};
constexpr GroupFiles version_2{"/memory.max", "/memory.current", "inactive_file"};

std::uint64_t left_in_group(const std::string& folder, const GroupFiles& files) {
  const std::uint64_t limit = read_number(folder + files.limit);
  const std::uint64_t used = read_number(folder + files.used);
  if (limit == unlimited || used == unlimited)
    return unlimited;
  const std::uint64_t cache = std::min(used, read_key(folder + "/memory.stat", files.cache, 0));
  return limit - std::min(limit, used - cache);
}

/// The least that the group `path` below `mount` and the groups above it leave. In a container the
/// mount can be the group itself, without the path.
std::uint64_t left_in_groups(const std::string& mount, std::string path, const GroupFiles& files) {
  std::uint64_t left = left_in_group(mount, files);
  while (path.size() > 1) {
    left = std::min(left, left_in_group(mount + path, files));
    path.resize(path.find_last_of('/'));
  }
  return left;
}

std::uint64_t left_in_control_groups(const std::string& root) {
  const std::string mount = root + "/sys/fs/cgroup";
  std::uint64_t left =
      std::min(left_in_group(mount, version_2), left_in_group(mount + "/memory", version_1));
  std::ifstream groups(root + "/proc/self/cgroup"); // lines NUMBER:CONTROLLERS:PATH
  for (std::string line; std::getline(groups, line);) {
    const std::size_t first = line.find(':');
    const std::size_t second = line.find(':', first + 1);
    if (first == std::string::npos || second == std::string::npos || line[second + 1] != '/')
      continue;
    const std::string controllers = "," + line.substr(first + 1, second - first - 1) + ",";
    const std::string path = line.substr(second + 1);
    if (controllers == ",,")
      left = std::min(left, left_in_groups(mount, path, version_2));
    else if (controllers.find(",memory,") != std::string::npos)
      left = std::min(left, left_in_groups(mount + "/memory", path, version_1));
  }
  return left;
}

/// What an RLIMIT leaves where `used` bytes count already.
std::uint64_t left_in_limit(decltype(RLIMIT_AS) what, std::uint64_t used) {
  rlimit limit{};
  if (::getrlimit(what, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY)
    return unlimited;
  const std::uint64_t bytes = limit.rlim_cur;
  return (bytes - std::min(bytes, used)) / 8 * 7;
}

} // namespace

std::uint64_t available_memory(const std::string& root) {
  std::uint64_t available = unlimited;
  if (const std::uint64_t kilobytes = read_key(root + "/proc/meminfo", "MemAvailable:", unlimited);
      kilobytes != unlimited)
    available = kilobytes * 1024;
  available = std::min(available, left_in_control_groups(root));
  // Pages: all, in memory, shared, text, library (0), data.
  std::ifstream statm("/proc/self/statm");
  std::uint64_t pages = 0, data_pages = 0, other = 0;
  statm >> pages >> other >> other >> other >> other >> data_pages;
  const auto page = static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
  available = std::min(available, left_in_limit(RLIMIT_AS, pages * page));
  return std::min(available, left_in_limit(RLIMIT_DATA, data_pages * page));
}

} // namespace gewebe::cli
