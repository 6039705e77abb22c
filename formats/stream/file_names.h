#pragma once
// Which files a program reads and writes, so that two names for one file are found before its
// work: by device and inode, through links, and by folder and name for what is not there yet.
// Input, Output and the HDF5 reader say what they open; after `guard_files` a program
// is refused a second use that would destroy the first. Regular files alone: a device or a FIFO may
// be used as often as one likes.

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

namespace gewebe::formats {

/// From now on FileUse and `note_read` look for clashes. For programs only, before they open
/// anything.
void guard_files();

/// A file that is read, for the rest of the program. `descriptor` >= 0: it is open there (standard
/// input), under no name that we know.
/// \throw Error, place = name, if it is being written
void note_read(const std::string& name, int descriptor = -1);

/// This one may be read and written: the program replaces it in the end.
void allow_in_place(const std::string& name);

/// A file that is being written, until this object ends.
class FileUse {
public:
  FileUse() = default;
  /// `descriptor` as above (standard output).
  /// \throw Error, place = name, if another FileUse has it, or it is read
  explicit FileUse(const std::string& name, int descriptor = -1);
  ~FileUse() { end(); }
  FileUse(FileUse&& other) noexcept : number_(std::exchange(other.number_, 0)) {}
  FileUse& operator=(FileUse&& other) noexcept {
    end();
    number_ = std::exchange(other.number_, 0);
    return *this;
  }

private:
  void end() noexcept;
  std::uint64_t number_ = 0; ///< 0: none
};

/// Where `path` leads through symbolic links, whether or not the last one's target is there.
std::string follow_links(std::string path);

/// The name beside `path` for a result that a failed run could not finish: run.partial.h5 for
/// run.h5.
std::string partial_name(const std::string& path);

/// Whether `path`, found in a file and meant from that file's folder, may lead out of it: absolute,
/// or with `..` in it.
bool leaves_folder(std::string_view path);

} // namespace gewebe::formats
