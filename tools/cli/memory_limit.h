#pragma once
// The default of --max-memory.

#include <cstdint>
#include <string>

namespace gewebe::cli {

/// Bytes that this process can still allocate: the least of what the machine has available
/// (/proc/meminfo), what its control groups leave (versions 1 and 2, its own group and all groups
/// above), and what RLIMIT_AS and RLIMIT_DATA leave.
///
/// Pages of the file cache that a control group can drop count as free. An eighth of what an
/// RLIMIT leaves is kept back, since threads and allocators reserve address space that no estimate
/// contains. UINT64_MAX if nothing is limited.
/// \param root  put before the names of the files in /proc and /sys
std::uint64_t available_memory(const std::string& root = "");

} // namespace gewebe::cli
