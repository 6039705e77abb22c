#include "formats/stream/child.h"

#include "base/error.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <new>
#include <stdexcept>

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace gewebe::formats {
namespace {

// What the child sends: this head, then `size` bytes.
struct Head {
  std::uint64_t size;
  std::uint64_t good; // 1: the result, 0: a complaint
};

class Descriptor {
public:
  explicit Descriptor(int value) : value_(value) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() { close(); }
  void close() {
    if (value_ >= 0)
      ::close(value_);
    value_ = -1;
  }
  int get() const { return value_; }

private:
  int value_;
};

// Ends and reaps the child whatever happens.
class Child {
public:
  explicit Child(pid_t pid) : pid_(pid) {}
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  ~Child() {
    if (pid_ <= 0)
      return;
    ::kill(pid_, SIGKILL);
    wait();
  }
  /// The status as waitpid gives it, or -1 if it is unknown (the parent ignores
  /// SIGCHLD).
  int wait() {
    int status = -1;
    while (::waitpid(pid_, &status, 0) < 0) {
      if (errno == EINTR)
        continue;
      status = -1;
      break;
    }
    pid_ = 0;
    return status;
  }

private:
  pid_t pid_;
};

bool send(int pipe, const void* data, std::size_t size) {
  const char* at = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t sent = ::write(pipe, at, size);
    if (sent < 0 && errno == EINTR)
      continue;
    if (sent <= 0)
      return false;
    at += sent;
    size -= static_cast<std::size_t>(sent);
  }
  return true;
}

void set_limit(decltype(RLIMIT_AS) what, rlim_t soft, rlim_t hard) {
  rlimit limit{};
  ::getrlimit(what, &limit);
  limit.rlim_cur = std::min(soft, limit.rlim_max);
  limit.rlim_max = std::min(hard, limit.rlim_max);
  ::setrlimit(what, &limit);
}

std::uint64_t address_space_in_use() {
  std::uint64_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

void apply_limits([[maybe_unused]] const ChildLimits& limits) {
  set_limit(RLIMIT_CORE, 0, 0);
  set_limit(RLIMIT_CPU, limits.cpu_seconds, limits.cpu_seconds + 1);
#ifndef GEWEBE_SANITIZE // a sanitizer's shadow takes terabytes of address space
  if (limits.memory != 0) {
    const rlim_t bytes = address_space_in_use() + limits.memory;
    set_limit(RLIMIT_AS, bytes, bytes);
  }
#endif
}

void reset_signals() {
  for (int signal = 1; signal < NSIG; ++signal)
    ::signal(signal, SIG_DFL);
  sigset_t none;
  sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
}

// Standard streams to /dev/null, the pipe as descriptor 3, everything else closed. Returns the
// pipe.
int take_over_descriptors(int pipe) {
  const int null = ::open("/dev/null", O_RDWR);
  for (int fd = 0; fd < 3; ++fd)
    ::dup2(null, fd);
  ::dup2(pipe, 3);
  ::close_range(4, ~0u, 0);
  return 3;
}

[[noreturn]] void child_main(const std::function<std::string()>& work, const ChildLimits& limits,
                             int pipe, pid_t parent) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent)
    ::_exit(1);
  reset_signals();
  pipe = take_over_descriptors(pipe);
  std::string reply;
  Head head{0, 0};
  try {
    apply_limits(limits);
    reply = work();
    head.good = 1;
  } catch (const std::bad_alloc&) {
    reply = "out of memory";
  } catch (const std::length_error&) { // a size that no memory has
    reply = "out of memory";
  } catch (const std::exception& error) {
    reply = error.what();
  } catch (...) {
    reply = "an unknown failure";
  }
  head.size = reply.size();
  const bool sent = send(pipe, &head, sizeof head) && send(pipe, reply.data(), reply.size());
  ::_exit(sent ? 0 : 1);
}

class Received {
public:
  bool complete() const { return has_head_ && body_.size() == head_.size; }
  bool good() const { return head_.good == 1; }
  std::string& body() { return body_; }

  // The buffer grows with what came, not with what the head promises.
  void add(const char* data, std::size_t size) {
    if (!has_head_) {
      const std::size_t part = std::min(size, sizeof head_ - head_bytes_);
      std::memcpy(reinterpret_cast<char*>(&head_) + head_bytes_, data, part);
      head_bytes_ += part;
      has_head_ = head_bytes_ == sizeof head_;
      data += part;
      size -= part;
    }
    if (size > 0 && size > head_.size - body_.size())
      throw Error("sent more than it announced");
    body_.append(data, size);
  }

private:
  Head head_{};
  std::size_t head_bytes_ = 0;
  bool has_head_ = false;
  std::string body_;
};

std::string how_it_ended(int status, const ChildLimits& limits) {
  if (status != -1 && WIFSIGNALED(status)) {
    const int signal = WTERMSIG(status);
    if (signal == SIGXCPU || signal == SIGKILL)
      return "took over " + std::to_string(limits.cpu_seconds) + " s";
    return "crashed (signal " + std::to_string(signal) + ")";
  }
  return "ended without an answer";
}

} // namespace

bool has_room_for_child(const ChildLimits& limits) {
  rlimit limit{};
  ::getrlimit(RLIMIT_AS, &limit);
  return limit.rlim_cur == RLIM_INFINITY ||
         limit.rlim_cur >= address_space_in_use() + limits.memory;
}

std::string run_in_child(const std::function<std::string()>& work, const ChildLimits& limits) {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0)
    throw Error("no pipe to a child process: " + std::string(std::strerror(errno)));
  Descriptor from_child(ends[0]), to_parent(ends[1]);
  ::fcntl(ends[1], F_SETPIPE_SZ, 1 << 20); // fewer switches; no harm if refused

  const pid_t parent = ::getpid();
  const pid_t pid = ::fork();
  if (pid < 0)
    throw Error("no child process: " + std::string(std::strerror(errno)));
  if (pid == 0)
    child_main(work, limits, to_parent.get(), parent);
  Child child(pid);
  to_parent.close();

  using Clock = std::chrono::steady_clock;
  const auto deadline = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                           std::chrono::duration<double>(limits.seconds));
  Received received;
  std::string buffer(1 << 20, '\0');
  for (;;) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now()).count();
    if (left <= 0)
      throw Error("took over " + std::to_string(std::lround(limits.seconds)) + " s");
    pollfd ready{from_child.get(), POLLIN, 0};
    const int events = ::poll(&ready, 1, static_cast<int>(std::min<std::int64_t>(left, 1000)));
    if (events <= 0)
      continue;
    const ssize_t size = ::read(from_child.get(), buffer.data(), buffer.size());
    if (size < 0 && errno == EINTR)
      continue;
    if (size <= 0)
      break;
    received.add(buffer.data(), static_cast<std::size_t>(size));
  }
  const int status = child.wait();
  if (!received.complete())
    throw Error(how_it_ended(status, limits));
  if (!received.good())
    throw Error(received.body());
  return std::move(received.body());
}

} // namespace gewebe::formats
