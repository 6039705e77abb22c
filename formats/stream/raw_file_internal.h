#pragma once
// A file that is read and written at places, beside the library that laid it out.

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>

namespace gewebe::formats {

class RawFile {
public:
  /// `name` is what messages call it. \throw Error if it can't be opened for reading and writing
  RawFile(const std::string& path, std::string name);
  /// A new file without a name, on the disk of `beside` (a path in some folder), or in memory where
  /// that disk knows no such files. It is gone when its last descriptor is closed.
  /// \throw Error
  static RawFile nameless(const std::string& beside, std::string name);
  ~RawFile();
  RawFile(RawFile&& other) noexcept;
  RawFile(const RawFile&) = delete;
  RawFile& operator=(const RawFile&) = delete;
  RawFile& operator=(RawFile&&) = delete;

  /// \throw Error "cannot write: No space left on device" and the like
  void write(std::uint64_t at, const void* data, std::size_t size);
  /// False where the file ends before or can't be read.
  bool read(std::uint64_t at, void* data, std::size_t size) const;
  std::uint64_t size() const;
  /// Bytes that it takes on the disk, less than its size where it has holes.
  std::uint64_t stored() const;
  void resize(std::uint64_t size);
  /// A path by which libraries open the same file again, in this process alone.
  std::string path() const;

private:
  RawFile(int fd, std::string name) : fd_(fd), name_(std::move(name)) {}
  [[noreturn]] void fail(const char* what) const;
  int fd_;
  std::string name_;
};

} // namespace gewebe::formats
