#include "formats/stream/file_names.h"

#include "base/error.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <climits>
#include <cstdlib>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <sys/stat.h>
#include <unistd.h>

namespace gewebe::formats {
namespace {

struct Identity {
  dev_t device = 0;
  ino_t inode = 0;
  bool operator==(const Identity&) const = default;
};

std::optional<Identity> identity(const struct stat& info) {
  if (!S_ISREG(info.st_mode))
    return std::nullopt;
  return Identity{info.st_dev, info.st_ino};
}

/// A file under one of its names: itself, where it is there, and its place in a folder.
struct Named {
  std::string name; ///< in messages
  std::string path; ///< empty where it is known by a descriptor alone
  std::optional<Identity> itself;
  std::optional<std::pair<Identity, std::string>> place;

  bool operator<(const Named& other) const {
    return path != other.path ? path < other.path : name < other.name;
  }

  /// What is known of it by now: a file may have been replaced since it was opened.
  void look() {
    if (path.empty())
      return;
    itself.reset();
    place.reset();
    struct stat info {};
    const bool there = ::stat(path.c_str(), &info) == 0;
    if (there)
      itself = identity(info);
    if (there ? !itself.has_value() : errno != ENOENT)
      return;
    const std::string target = follow_links(path);
    const std::size_t slash = target.find_last_of('/');
    if (::stat(slash == 0 ? "/" : target.substr(0, slash).c_str(), &info) == 0)
      place.emplace(Identity{info.st_dev, info.st_ino}, target.substr(slash + 1));
  }

  bool same(const Named& other) const {
    return (itself && itself == other.itself) || (place && place == other.place);
  }
};

/// \param descriptor as `note_read` has it
Named named(const std::string& name, int descriptor) {
  Named file;
  file.name = name;
  if (descriptor >= 0) {
    struct stat info {};
    if (::fstat(descriptor, &info) == 0)
      file.itself = identity(info);
    return file;
  }
  std::array<char, PATH_MAX> folder{};
  const bool relative = !name.starts_with('/');
  if (relative && ::getcwd(folder.data(), folder.size()) == nullptr)
    return file;
  file.path = relative ? std::string(folder.data()) + "/" + name : name;
  file.look();
  return file;
}

std::atomic<bool> guarded{false};
std::mutex mutex;
std::set<Named> read;
std::map<std::uint64_t, Named> written;
std::optional<Named> in_place;
std::uint64_t last_number = 0;

std::string shown(const Named& file, const Named& asked) {
  return file.name == asked.name ? "" : ", as '" + file.name + "'";
}

} // namespace

void guard_files() {
  guarded = true;
}

void note_read(const std::string& name, int descriptor) {
  if (!guarded)
    return;
  const std::lock_guard lock(mutex);
  Named file = named(name, descriptor);
  if (in_place && file.same(*in_place))
    return;
  // Even if it is refused: its writer must not replace it after all, see Output::commit.
  if (file.itself)
    read.insert(file);
  for (auto& [number, other] : written) {
    other.look();
    if (file.same(other))
      throw Error(name, "is written by this run, too" + shown(other, file) +
                            ", expected another file for the output");
  }
}

void allow_in_place(const std::string& name) {
  if (!guarded)
    return;
  const std::lock_guard lock(mutex);
  in_place = named(name, -1);
}

FileUse::FileUse(const std::string& name, int descriptor) {
  if (!guarded)
    return;
  const std::lock_guard lock(mutex);
  Named file = named(name, descriptor);
  for (auto& [number, other] : written) {
    other.look();
    if (file.same(other))
      throw Error(name, "is written by this run for something else, too" + shown(other, file) +
                            ", expected another file");
  }
  if (!in_place || !file.same(*in_place))
    for (Named other : read) {
      other.look();
      if (file.same(other))
        throw Error(name, "is read by this run, too" + shown(other, file) +
                              ", expected another file for the output");
    }
  if (!file.itself && !file.place)
    return;
  number_ = ++last_number;
  written[number_] = std::move(file);
}

void FileUse::end() noexcept {
  if (number_ == 0)
    return;
  const std::lock_guard lock(mutex);
  written.erase(number_);
  number_ = 0;
}

std::string partial_name(const std::string& path) {
  const std::size_t base = path.find_last_of('/') + 1; // 0 if there is none
  std::size_t dot = path.find_last_of('.');
  if (dot == std::string::npos || dot <= base)
    return path + ".partial";
  if (const std::size_t packed = path.find_last_of('.', dot - 1);
      path.substr(dot) == ".gz" && packed != std::string::npos && packed > base)
    dot = packed; // .nii.gz
  return path.substr(0, dot) + ".partial" + path.substr(dot);
}

bool leaves_folder(std::string_view path) {
  if (path.starts_with('/'))
    return true;
  for (std::size_t begin = 0; begin <= path.size();) {
    const std::size_t end = std::min(path.find('/', begin), path.size());
    if (path.substr(begin, end - begin) == "..")
      return true;
    begin = end + 1;
  }
  return false;
}

std::string follow_links(std::string path) {
  for (int depth = 0; depth < 40; ++depth) {
    std::array<char, PATH_MAX> target{};
    const ssize_t length = ::readlink(path.c_str(), target.data(), target.size() - 1);
    if (length < 0)
      return path;
    std::string link(target.data(), static_cast<std::size_t>(length));
    if (!link.starts_with('/')) {
      const std::size_t slash = path.find_last_of('/');
      if (slash != std::string::npos)
        link = path.substr(0, slash + 1) + link;
    }
    path = std::move(link);
  }
  return path;
}

} // namespace gewebe::formats
