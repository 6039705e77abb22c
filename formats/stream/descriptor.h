#pragma once
// A file descriptor that is closed at the end, and the lock of a folder in which names are taken.

#include <string>
#include <utility>

namespace gewebe::formats {

/// A file descriptor that is closed at the end.
class Descriptor {
public:
  explicit Descriptor(int fd = -1) noexcept : fd_(fd) {}
  ~Descriptor();
  Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept;
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  int get() const noexcept { return fd_; }
  explicit operator bool() const noexcept { return fd_ >= 0; }

private:
  int fd_;
};

/// Lock of the folder of `path`: while it exists, no other run with such a lock creates or replaces
/// a name there. Empty for a folder that can't be read.
Descriptor lock_folder_of(const std::string& path);

} // namespace gewebe::formats
