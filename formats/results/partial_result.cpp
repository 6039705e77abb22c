#include "formats/results/partial_result.h"

#include "base/error.h"
#include "formats/results/xdmf_internal.h"
#include "formats/store/hdf5_internal.h"
#include "formats/stream/descriptor.h"
#include "formats/stream/file_names.h"
#include "text/number_text.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <cstddef>
#include <cstring>
#include <ctime>
#include <fcntl.h>
#include <filesystem>
#include <optional>
#include <span>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>
#include <vector>

namespace gewebe::formats {

namespace {

namespace fs = std::filesystem;

/// A temporary file of an Output, locked by this program.
struct Leftover {
  std::string path;
  Descriptor lock;
  timespec changed{};
};

bool newer(const timespec& a, const timespec& b) {
  return a.tv_sec != b.tv_sec ? a.tv_sec > b.tv_sec : a.tv_nsec > b.tv_nsec;
}

/// Those of the file `target` that no program writes any more, the newest first.
std::vector<Leftover> leftovers_of(const std::string& target) {
  const std::size_t slash = target.find_last_of('/') + 1; // 0 if there is none
  const std::string folder = slash == 0 ? "." : target.substr(0, slash);
  const std::string start = "." + target.substr(slash).substr(0, 200) + ".";
  std::vector<Leftover> found;
  std::error_code failure;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, failure)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(start) || name.size() != start.size() + 6 ||
        !std::all_of(name.end() - 6, name.end(),
                     [](unsigned char c) { return std::isalnum(c) != 0; }))
      continue;
    Leftover left;
    left.path = target.substr(0, slash) + name;
    left.lock = Descriptor(::open(left.path.c_str(), O_RDWR | O_NOFOLLOW | O_CLOEXEC | O_NONBLOCK));
    struct stat info {};
    if (!left.lock || ::fstat(left.lock.get(), &info) != 0 || !S_ISREG(info.st_mode) ||
        info.st_uid != ::geteuid() || ::flock(left.lock.get(), LOCK_EX | LOCK_NB) != 0)
      continue;
    left.changed = info.st_mtim;
    found.push_back(std::move(left));
  }
  if (failure)
    throw Error(folder, "cannot be listed: " + failure.message());
  std::ranges::sort(
      found, [](const Leftover& a, const Leftover& b) { return newer(a.changed, b.changed); });
  return found;
}

/// Frames of a table, whose rows are frames or nodes.
struct PartialTable {
  PartialFrames there;
  bool of_nodes = false;
};

/// Cuts a table off behind its last whole frame, see Output::append_whole.
PartialTable cut_table(const Leftover& left) {
  std::string text;
  std::vector<char> block(1U << 20U);
  for (ssize_t count = 0; (count = ::read(left.lock.get(), block.data(), block.size())) > 0;)
    text.append(block.data(), static_cast<std::size_t>(count));
  text.resize(std::min(text.find('\0'), text.size()));
  if (::ftruncate(left.lock.get(), static_cast<off_t>(text.size())) != 0)
    throw Error(left.path, std::string("cannot write: ") + std::strerror(errno));
  PartialTable table{{}, text.starts_with("time,object,")};
  PartialFrames& there = table.there;
  for (std::size_t line = text.find('\n') + 1, end = 0; line < text.size(); line = end + 1) {
    end = std::min(text.find('\n', line), text.size());
    double time = 0;
    if (std::from_chars(text.data() + line, text.data() + end, time).ec == std::errc() &&
        (!table.of_nodes || there.frames == 0 || time != there.time))
      there = {there.frames + 1, time};
  }
  return table;
}

bool is_hdf5(const Leftover& left) {
  std::array<char, 8> head{};
  return ::pread(left.lock.get(), head.data(), head.size(), 0) ==
             static_cast<ssize_t>(head.size()) &&
         std::memcmp(head.data(), "\x89HDF\r\n\x1a\n", head.size()) == 0;
}

/// The XDMF file beside it, if it is no file of VTK alone.
void write_companion(const std::string& result) {
  const hdf5::File file = hdf5::File::open_own(result);
  if (file.root().has("VTKHDF"))
    return;
  Output output(xdmf_path(result), {.sync = true, .binary = false, .beside = true});
  write_xdmf(file, result.substr(result.find_last_of('/') + 1),
             [&](std::string_view text) { output.write(text); });
  output.commit();
}

} // namespace

PartialFrames mark_partial(const std::string& path, const std::string& why) {
  hdf5::File file = hdf5::File::reopen_checkpoint(path);
  PartialFrames there;
  {
    const bool vtk = file.root().has("VTKHDF");
    const hdf5::Dataset times =
        vtk ? file.root().group("VTKHDF").group("Steps").dataset("Values", hdf5::Number::float64)
            : file.root().dataset("time", hdf5::Number::float64);
    there.frames = times.rows();
    if (there.frames > 0)
      times.read_rows(there.frames - 1, std::span<double>(&there.time, 1));
  }
  try {
    if (file.root().has("VTKHDF"))
      file.root().group("VTKHDF").set("partial", why);
    else
      file.root().set("partial", why);
    file.close();
  } catch (const Error&) {
    file.abandon(); // the name says it, too
  }
  return there;
}

KeptResult recover_result(const std::string& path) {
  const std::string target = follow_links(path);
  std::vector<Leftover> results = leftovers_of(target);
  const std::vector<Leftover> companions = leftovers_of(follow_links(xdmf_path(path)));
  for (Leftover& left : results) {
    if (!is_hdf5(left) && !target.ends_with(".csv"))
      continue;
    const bool table = !is_hdf5(left);
    PartialTable found;
    try {
      found = table ? cut_table(left) : PartialTable{mark_partial(left.path, "killed")};
    } catch (const Error&) {
      continue; // killed before its first frame
    }
    const PartialFrames& there = found.there;
    if (there.frames == 0)
      continue;
    KeptResult kept{(found.of_nodes ? "forces of " : "") + frames_text(there.frames), there.time,
                    true, "", partial_name(target)};
    if (::rename(left.path.c_str(), kept.file.c_str()) != 0)
      throw Error(kept.file, std::string("cannot rename: ") + std::strerror(errno));
    if (!table)
      write_companion(kept.file);
    if (!table)
      for (const Leftover& companion : companions)
        (void)::unlink(companion.path.c_str());
    return kept;
  }
  throw Error(path, "no killed run has left frames of it, expected a file such as ." +
                        target.substr(target.find_last_of('/') + 1) + ".XXXXXX beside it");
}

std::string frames_text(std::uint64_t frames) {
  return std::to_string(frames) + (frames == 1 ? " frame" : " frames");
}

} // namespace gewebe::formats
