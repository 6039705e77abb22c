#include "formats/stream/stream.h"

#include "base/bytes.h"
#include "base/error.h"
#include "base/zero_pages.h"
#include "formats/stream/file_names.h"
#include "formats/stream/program_start.h"
#include "formats/stream/removal.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <istream>
#include <optional>
#include <ostream>
#include <poll.h>
#include <streambuf>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>
#include <utility>
#include <vector>

namespace gewebe::formats {
namespace {

constexpr std::size_t buffer_bytes = 1U << 20U;

bool is_pipe_name(const std::string& path) {
  return path.empty() || path == "-";
}

std::string error_text(int error) {
  return std::strerror(error);
}

bool same_bytes(const std::string& a, const std::string& b) {
  struct File {
    explicit File(const std::string& path) : handle(std::fopen(path.c_str(), "rb")) {}
    ~File() {
      if (handle != nullptr)
        (void)std::fclose(handle);
    }
    File(const File&) = delete;
    File& operator=(const File&) = delete;
    std::FILE* handle;
  };
  const File file_a(a);
  const File file_b(b);
  if (file_a.handle == nullptr || file_b.handle == nullptr)
    return false;
  std::vector<char> block_a(buffer_bytes);
  std::vector<char> block_b(buffer_bytes);
  for (;;) {
    const std::size_t count_a = std::fread(block_a.data(), 1, block_a.size(), file_a.handle);
    const std::size_t count_b = std::fread(block_b.data(), 1, block_b.size(), file_b.handle);
    if (count_a != count_b || std::memcmp(block_a.data(), block_b.data(), count_a) != 0)
      return false;
    if (count_a == 0)
      return true;
  }
}

} // namespace

// ---- Input

struct Input::State final : std::streambuf {
  ~State() override {
    if (fd > 0)
      (void)::close(fd);
  }

  /// Where signals are deferred, waits so that one of them ends the wait. \throw Cancelled
  void wait_for_signal_or_bytes() const {
    const int signals = deferred_signal_descriptor();
    if (signals < 0)
      return;
    std::array<pollfd, 2> either{pollfd{fd, POLLIN, 0}, pollfd{signals, POLLIN, 0}};
    (void)::poll(either.data(), either.size(), -1);
    check_deferred_signal();
  }

  /// So many bytes at most; 0 at the end.
  std::size_t read_some(char* to, std::size_t most) const {
    ssize_t count = 0;
    do {
      wait_for_signal_or_bytes();
      count = ::read(fd, to, most);
    } while (count < 0 && errno == EINTR);
    if (count < 0)
      throw Error(name, "cannot read: " + error_text(errno));
    return static_cast<std::size_t>(count);
  }

  /// Reads at least one byte more into the buffer; false at the end.
  bool fill() {
    if (gptr() == egptr()) {
      start = 0;
      end = 0;
    }
    if (end == buffer.size())
      return false;
    const std::size_t count = read_some(buffer.data() + end, buffer.size() - end);
    if (count == 0)
      return false;
    end += count;
    total += static_cast<std::uint64_t>(count);
    setg(buffer.data(), buffer.data() + start, buffer.data() + end);
    return true;
  }

  [[noreturn]] void refuse_larger(std::uint64_t max_bytes) const {
    throw Error(name, "is larger than the limit of " + bytes_text(static_cast<double>(max_bytes)) +
                          " (--max-memory)");
  }

  /// Consumes what is buffered.
  std::string_view take() {
    const std::string_view bytes(gptr(), static_cast<std::size_t>(egptr() - gptr()));
    setg(eback(), egptr(), egptr());
    return bytes;
  }

  int_type underflow() override {
    if (gptr() < egptr())
      return traits_type::to_int_type(*gptr());
    if (!fill())
      return traits_type::eof();
    return traits_type::to_int_type(*gptr());
  }

  std::streamsize xsgetn(char* target, std::streamsize wanted) override {
    std::streamsize got = 0;
    while (got < wanted) {
      const std::streamsize ready = egptr() - gptr();
      if (ready > 0) {
        const std::streamsize part = std::min(ready, wanted - got);
        std::memcpy(target + got, gptr(), static_cast<std::size_t>(part));
        setg(eback(), gptr() + part, egptr());
        got += part;
      } else if (!fill()) {
        break;
      }
    }
    return got;
  }

  int fd = -1;
  std::string name;
  std::vector<char> buffer = std::vector<char>(buffer_bytes);
  std::size_t start = 0, end = 0;
  std::uint64_t total = 0;
  std::uint64_t size_hint = 0;
  std::unique_ptr<std::istream> stream;
};

Input::Input(const std::string& path, bool binary) : state_(std::make_unique<State>()) {
  State& state = *state_;
  state.name = is_pipe_name(path) ? "-" : path;
  if (is_pipe_name(path)) {
    if (binary && ::isatty(0) != 0)
      throw UsageError("standard input is a terminal, expected a file or a pipe");
    state.fd = 0;
  } else {
    state.fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (state.fd < 0)
      throw Error(path, "cannot open: " + error_text(errno));
  }
  struct stat info {};
  if (::fstat(state.fd, &info) != 0)
    throw Error(state.name, "cannot open: " + error_text(errno));
  if (S_ISDIR(info.st_mode))
    throw Error(state.name, "is a directory, expected a file");
  if (binary && !is_pipe_name(path) && ::isatty(state.fd) != 0)
    throw UsageError(path + " is a terminal, expected a file or a pipe");
  if (S_ISREG(info.st_mode))
    state.size_hint = static_cast<std::uint64_t>(info.st_size);
  note_read(state.name, state.fd == 0 ? 0 : -1);
}

Input::~Input() = default;
Input::Input(Input&&) noexcept = default;

const std::string& Input::name() const {
  return state_->name;
}

std::string_view Input::peek(std::size_t count) {
  State& state = *state_;
  while (state.end - state.start < count && state.fill()) {
  }
  if (state.total == 0)
    throw Error(state.name, "is empty");
  return std::string_view(state.buffer.data() + state.start,
                          std::min(count, state.end - state.start));
}

std::string Input::read_all(std::uint64_t max_bytes) {
  State& state = *state_;
  (void)peek(1);
  std::string bytes(state.take());
  if (state.size_hint <= max_bytes)
    bytes.reserve(state.size_hint + 1);
  while (bytes.size() <= max_bytes && state.fill()) {
    bytes.append(state.take());
  }
  if (bytes.size() > max_bytes)
    state.refuse_larger(max_bytes);
  return bytes;
}

InputBytes Input::read_all_pages(std::uint64_t max_bytes) {
  constexpr std::size_t least = std::size_t{4} << 20;
  State& state = *state_;
  (void)peek(1);
  const std::string_view first = state.take();
  const auto kept = std::make_shared<ZeroPages>();
  ZeroPages& pages = *kept;
  pages.grow(std::max<std::size_t>(
      {first.size() + 1, least,
       state.size_hint <= max_bytes ? static_cast<std::size_t>(state.size_hint) + 1 : 0}));
  std::memcpy(pages.data(), first.data(), first.size());
  std::size_t size = first.size();
  while (size <= max_bytes) {
    if (size == pages.size())
      pages.grow(2 * pages.size());
    char* const begin = reinterpret_cast<char*>(pages.data());
    const std::size_t count = state.read_some(begin + size, pages.size() - size);
    if (count == 0) {
      InputBytes bytes;
      bytes.pages_ = kept;
      bytes.bytes_ = {begin, size};
      return bytes;
    }
    size += count;
  }
  state.refuse_larger(max_bytes);
}

std::istream& Input::stream() {
  if (!state_->stream)
    state_->stream = std::make_unique<std::istream>(state_.get());
  return *state_->stream;
}

void Input::wait_awake() const {
  pollfd own{state_->fd, POLLIN, 0};
  while (::poll(&own, 1, 0) == 0)
    check_deferred_signal();
}

// ---- Output

struct Output::State final : std::streambuf {
  State() { drop_buffer(); }
  ~State() override {
    if (fd > 1)
      (void)::close(fd);
    if (!temporary.empty() && !kept) {
      (void)::unlink(temporary.c_str());
      forget_removal(slot);
    }
  }

  [[noreturn]] void fail(const std::string& what) const {
    throw Error(name, what + ": " + error_text(errno));
  }

  /// -1 and errno as open(2). A FIFO waits for its reader, until a deferred signal ends the
  /// program.
  int open_device() const {
    const int wake = deferred_signal_descriptor();
    for (;;) {
      const int opened = ::open(name.c_str(), O_WRONLY | O_CLOEXEC | (wake < 0 ? 0 : O_NONBLOCK));
      if (opened >= 0) {
        (void)::fcntl(opened, F_SETFL, ::fcntl(opened, F_GETFL) & ~O_NONBLOCK);
        return opened;
      }
      if (wake < 0 || (errno != ENXIO && errno != EINTR))
        return -1;
      pollfd signal{wake, POLLIN, 0};
      (void)::poll(&signal, 1, 20);
      check_deferred_signal();
    }
  }

  void open_direct() {
    fd = open_device();
    if (fd < 0)
      fail("cannot open for writing");
    if (options.binary && ::isatty(fd) != 0)
      throw UsageError(name + " is a terminal, expected a file or a pipe");
  }

  /// False where another program has it, or had it and gave it its name just now.
  bool lock_part(const std::string& path) const {
    struct stat opened {
    }, named{};
    return ::flock(fd, LOCK_EX | LOCK_NB) == 0 && ::fstat(fd, &opened) == 0 &&
           ::stat(path.c_str(), &named) == 0 && opened.st_ino == named.st_ino &&
           opened.st_dev == named.st_dev;
  }

  void create_temporary() {
    const std::size_t slash = target.find_last_of('/');
    const std::string folder = slash == std::string::npos ? "" : target.substr(0, slash + 1);
    const std::string base = slash == std::string::npos ? target : target.substr(slash + 1);
    const bool part = options.part || !options.log.empty();
    std::string path = part ? target + ".part" : folder + "." + base.substr(0, 200) + ".XXXXXX";
    // Until the name is remembered, so that no signal can leave the file behind.
    std::optional<SignalsWait> wait(std::in_place);
    fd = part ? open_part(path) : ::mkostemp(path.data(), O_CLOEXEC);
    int error = errno;
    if (fd >= 0 && part && !lock_part(path)) {
      error = EBUSY; // of another program, so it must not be removed
      (void)::close(fd);
      fd = -1;
    }
    if (fd >= 0) {
      temporary = path;
      if (found && !options.log.empty())
        found = ::ftruncate(fd, 0) != 0;
      kept = found;
      slot = found ? -1 : remember_removal(path);
    }
    wait.reset();
    errno = error;
    if (fd < 0 && errno == EBUSY)
      throw Error(name, "is being made by another program: " + path + " is locked");
    if (fd < 0 && (errno == ELOOP || errno == EEXIST || errno == EISDIR))
      throw Error(name, path + " is there and no file of ours, expected none or what an unfinished "
                               "run left");
    if (fd < 0)
      fail("cannot create a file in its folder");
    if (!found && ::fchmod(fd, mode) != 0)
      fail("cannot set the mode");
  }

  /// Makes the file, or opens what an earlier run left: never through a link, never what is
  /// another user's. -1 and errno as open(2); EEXIST if it isn't ours.
  int open_part(const std::string& path) {
    const int made = ::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
    if (made >= 0 || errno != EEXIST)
      return made;
    const int there = ::open(path.c_str(), O_RDWR | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    struct stat info {};
    if (there < 0)
      return -1;
    if (::fstat(there, &info) != 0 || !S_ISREG(info.st_mode) || info.st_nlink > 1 ||
        info.st_uid != ::geteuid() || (info.st_size > 0 && !begins_as_log(there))) {
      (void)::close(there);
      errno = EEXIST;
      return -1;
    }
    found = info.st_size > 0;
    return there;
  }

  /// True where it need not.
  bool begins_as_log(int there) const {
    std::string start(options.log.size(), '\0');
    return ::pread(there, start.data(), start.size(), 0) == static_cast<ssize_t>(start.size()) &&
           start == options.log;
  }

  void write_all(const char* data, std::size_t size) {
    if (fd < 0)
      open_direct();
    while (size > 0) {
      const ssize_t count = ::write(fd, data, size);
      if (count < 0) {
        if (errno == EINTR) {
          check_deferred_signal(); // the reader may never come back
          continue;
        }
        fail("cannot write");
      }
      data += count;
      size -= static_cast<std::size_t>(count);
      written += static_cast<std::uint64_t>(count);
    }
  }

  /// At a place of the temporary file.
  void write_at(std::uint64_t at, const char* data, std::size_t size) const {
    while (size > 0) {
      const ssize_t count = ::pwrite(fd, data, size, static_cast<off_t>(at));
      if (count < 0) {
        if (errno == EINTR)
          continue;
        const int error = errno;
        (void)::ftruncate(fd, static_cast<off_t>(written));
        errno = error;
        fail("cannot write");
      }
      data += count;
      at += static_cast<std::uint64_t>(count);
      size -= static_cast<std::size_t>(count);
    }
  }

  void drop_buffer() { setp(buffer.data(), buffer.data() + buffer.size()); }

  void flush_buffer() {
    const std::size_t size = static_cast<std::size_t>(pptr() - pbase());
    drop_buffer();
    if (size > 0)
      write_all(buffer.data(), size);
  }

  int_type overflow(int_type c) override {
    flush_buffer();
    if (!traits_type::eq_int_type(c, traits_type::eof())) {
      *pptr() = traits_type::to_char_type(c);
      pbump(1);
    }
    return traits_type::not_eof(c);
  }

  std::streamsize xsputn(const char* data, std::streamsize size) override {
    if (size > epptr() - pptr())
      flush_buffer();
    if (size >= static_cast<std::streamsize>(buffer.size())) {
      write_all(data, static_cast<std::size_t>(size));
    } else {
      std::memcpy(pptr(), data, static_cast<std::size_t>(size));
      pbump(static_cast<int>(size));
    }
    return size;
  }

  int sync() override {
    flush_buffer();
    return 0;
  }

  std::string name, target, temporary;
  Options options;
  int fd = -1, slot = -1;
  std::uint64_t written = 0; ///< bytes, those in the buffer not counted
  mode_t mode = 0;
  bool existed = false, kept = false, prepared = false;
  bool found = false;    ///< the part held something
  bool reserved = false; ///< blocks behind its end
  FileUse use;
  std::vector<char> buffer = std::vector<char>(buffer_bytes);
  std::unique_ptr<std::ostream> stream;
};

Output::Output(const std::string& path, const Options& options)
    : state_(std::make_unique<State>()) {
  State& state = *state_;
  state.options = options;
  state.name = is_pipe_name(path) ? "-" : path;
  if (is_pipe_name(path)) {
    if (options.binary && ::isatty(1) != 0)
      throw UsageError("standard output is a terminal, expected -o FILE or a pipe");
    state.fd = 1;
    // Where it is a pipe, so that neither end waits for the other at each 64 KiB; no harm if not.
    (void)::fcntl(1, F_SETPIPE_SZ, static_cast<int>(buffer_bytes));
    state.use = FileUse("-", 1);
    return;
  }
  struct stat info {};
  state.existed = ::stat(path.c_str(), &info) == 0;
  if (state.existed && S_ISDIR(info.st_mode))
    throw Error(path, "is a directory, expected a file");
  if (!state.existed && errno != ENOENT)
    state.fail("cannot open for writing");
  const bool null = S_ISCHR(info.st_mode) && info.st_rdev == makedev(1, 3); // /dev/null
  if (state.existed && !S_ISREG(info.st_mode) && options.beside && !null)
    throw Error(path, "is no regular file, expected one, or a new name, beside the result");
  if (state.existed && !S_ISREG(info.st_mode)) {
    if (options.binary && S_ISCHR(info.st_mode) && path.starts_with("/dev/tty"))
      throw UsageError(path + " is a terminal, expected a file or a pipe");
    return; // opened at the first write: a FIFO's reader may come late
  }
  if (state.existed) {
    if (::access(path.c_str(), W_OK) != 0)
      state.fail("cannot open for writing");
    state.mode = info.st_mode & 07777U;
  } else {
    const mode_t mask = ::umask(0);
    (void)::umask(mask);
    state.mode = 0666U & ~mask;
  }
  state.target = follow_links(path);
  state.use = FileUse(path);
  state.create_temporary();
}

Output::~Output() = default;
Output::Output(Output&&) noexcept = default;

const std::string& Output::name() const {
  return state_->name;
}

void Output::write(const void* data, std::size_t size) {
  (void)state_->sputn(static_cast<const char*>(data), static_cast<std::streamsize>(size));
}

std::ostream& Output::stream() {
  if (!state_->stream) {
    state_->stream = std::make_unique<std::ostream>(state_.get());
    state_->stream->exceptions(std::ios::badbit | std::ios::failbit);
  }
  return *state_->stream;
}

const std::string& Output::temporary() const {
  if (state_->temporary.empty())
    throw Error(state_->name,
                "is no regular file, but this kind can't be written to a pipe or a device");
  return state_->temporary;
}

void Output::keep_part(bool keep) {
  state_->kept = keep;
  forget_removal(state_->slot);
  state_->slot = -1;
}

bool Output::part() const {
  return state_->options.part && !state_->temporary.empty();
}

void Output::outlive_signals() {
  State& state = *state_;
  if (state.temporary.empty() || state.fd < 0)
    return;
  (void)::flock(state.fd, LOCK_EX | LOCK_NB); // shows --recover that it is in use
  forget_removal(state.slot);
  state.slot = -1;
}

void Output::append_whole(std::string_view bytes) {
  State& state = *state_;
  if (state.temporary.empty()) {
    write(bytes);
    return;
  }
  state.flush_buffer();
  if (bytes.empty())
    return;
  state.write_at(state.written + 1, bytes.data() + 1, bytes.size() - 1);
  state.write_at(state.written, bytes.data(), 1);
  state.written += bytes.size();
  if (::lseek(state.fd, static_cast<off_t>(state.written), SEEK_SET) < 0)
    state.fail("cannot write");
}

void Output::reserve(std::uint64_t bytes) {
  State& state = *state_;
  if (state.temporary.empty() || bytes == 0)
    return;
  state.reserved = true;
  while (::fallocate(state.fd, FALLOC_FL_KEEP_SIZE, 0, static_cast<off_t>(bytes)) != 0)
    if (errno == ENOSPC || errno == EDQUOT || errno == EFBIG)
      state.fail("cannot write");
    else if (errno != EINTR)
      return; // this file system can't say
}

void Output::start_over() {
  State& state = *state_;
  state.drop_buffer();
  if (state.fd < 0) // closed by `prepare`
    state.fd = ::open(state.temporary.c_str(), O_WRONLY | O_NOFOLLOW | O_CLOEXEC);
  if (state.fd < 0 || ::lseek(state.fd, 0, SEEK_SET) != 0 || ::ftruncate(state.fd, 0) != 0)
    state.fail("cannot write");
  state.prepared = false;
  state.written = 0;
}

bool Output::has_temporary() const {
  return !state_->temporary.empty();
}

std::string Output::commit_partial() {
  State& state = *state_;
  state.use = FileUse();
  state.target = partial_name(state.target);
  state.name = state.target;
  state.options.keep_unchanged = false;
  commit();
  return state.name;
}

void Output::prepare() {
  State& state = *state_;
  if (state.prepared)
    return;
  state.flush_buffer();
  if (state.fd < 0)
    state.open_direct(); // nothing was written, but the reader of a FIFO waits
  if (!state.temporary.empty()) {
    if (state.found && ::fchmod(state.fd, state.mode) != 0)
      state.fail("cannot set the mode");
    if (state.reserved && ::ftruncate(state.fd, static_cast<off_t>(state.written)) != 0)
      state.fail("cannot write");
    if (state.options.sync && ::fsync(state.fd) != 0)
      state.fail("cannot write");
  }
  const int fd = state.fd;
  state.fd = -1;
  if (::close(fd) != 0)
    state.fail("cannot write");
  state.prepared = true;
}

void Output::commit() {
  State& state = *state_;
  prepare();
  if (state.temporary.empty())
    return;
  if (state.options.keep_unchanged && state.existed && same_bytes(state.temporary, state.target)) {
    state.kept = false;
    return; // the destructor removes the temporary file
  }
  // Something may have been read since that another file has to serve for; a record of a failed
  // run would destroy it.
  state.use = FileUse();
  state.use = FileUse(state.name);
  if (::rename(state.temporary.c_str(), state.target.c_str()) != 0)
    state.fail("cannot rename");
  forget_removal(state.slot);
  state.temporary.clear();
}

void hold_standard_streams() {
  // Open in the wrong direction, so that readers and writers get an error.
  for (const int fd : {0, 1, 2})
    if (::fcntl(fd, F_GETFD) < 0 && errno == EBADF)
      (void)::open("/dev/null", fd == 0 ? O_WRONLY : O_RDONLY);
}

} // namespace gewebe::formats
