#include "base/error.h"
#include "formats/stream/raw_file_internal.h"

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

namespace gewebe::formats {

RawFile::RawFile(const std::string& path, std::string name)
    : fd_(::open(path.c_str(), O_RDWR | O_NOFOLLOW | O_CLOEXEC)), name_(std::move(name)) {
  if (fd_ < 0)
    fail("cannot open");
}

RawFile RawFile::nameless(const std::string& beside, std::string name) {
  const std::size_t slash = beside.find_last_of('/');
  const std::string folder = slash == std::string::npos ? "." : beside.substr(0, slash + 1);
  int fd = ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
  if (fd < 0 && (errno == EOPNOTSUPP || errno == EISDIR || errno == EINVAL))
    fd = ::memfd_create("gewebe", MFD_CLOEXEC);
  if (fd < 0)
    throw Error(name, std::string("cannot create a file in its folder: ") + std::strerror(errno));
  return {fd, std::move(name)};
}

RawFile::~RawFile() {
  if (fd_ >= 0)
    (void)::close(fd_);
}

RawFile::RawFile(RawFile&& other) noexcept
    : fd_(std::exchange(other.fd_, -1)), name_(std::move(other.name_)) {}

void RawFile::fail(const char* what) const {
  throw Error(name_, std::string(what) + ": " + std::strerror(errno));
}

void RawFile::write(std::uint64_t at, const void* data, std::size_t size) {
  const auto* from = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t count = ::pwrite(fd_, from, size, static_cast<off_t>(at));
    if (count < 0 && errno == EINTR)
      continue;
    if (count < 0)
      fail("cannot write");
    from += count;
    at += static_cast<std::uint64_t>(count);
    size -= static_cast<std::size_t>(count);
  }
}

bool RawFile::read(std::uint64_t at, void* data, std::size_t size) const {
  auto* to = static_cast<char*>(data);
  while (size > 0) {
    const ssize_t count = ::pread(fd_, to, size, static_cast<off_t>(at));
    if (count < 0 && errno == EINTR)
      continue;
    if (count <= 0)
      return false;
    to += count;
    at += static_cast<std::uint64_t>(count);
    size -= static_cast<std::size_t>(count);
  }
  return true;
}

std::uint64_t RawFile::size() const {
  struct stat info {};
  return ::fstat(fd_, &info) == 0 ? static_cast<std::uint64_t>(info.st_size) : 0;
}

std::uint64_t RawFile::stored() const {
  struct stat info {};
  return ::fstat(fd_, &info) == 0 ? static_cast<std::uint64_t>(info.st_blocks) * 512 : 0;
}

std::string RawFile::path() const {
  return "/proc/self/fd/" + std::to_string(fd_);
}

void RawFile::resize(std::uint64_t size) {
  if (::ftruncate(fd_, static_cast<off_t>(size)) != 0)
    fail("cannot write");
}

} // namespace gewebe::formats
