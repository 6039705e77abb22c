#pragma once
// A file name of a test's own, removed with it.

#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <unistd.h>

namespace gewebe::test {

class ScratchFile {
public:
  explicit ScratchFile(const std::string& suffix = "") {
    const char* const folder = std::getenv("TMPDIR");
    path_ = std::string(folder != nullptr ? folder : "/tmp") + "/gewebe-test-XXXXXX" + suffix;
    const int fd = ::mkstemps(path_.data(), static_cast<int>(suffix.size()));
    if (fd < 0)
      throw std::runtime_error("no scratch file " + path_);
    (void)::close(fd);
  }
  ~ScratchFile() { (void)std::remove(path_.c_str()); }
  ScratchFile(const ScratchFile&) = delete;
  ScratchFile& operator=(const ScratchFile&) = delete;

  const std::string& path() const { return path_; }

private:
  std::string path_;
};

} // namespace gewebe::test
