#include "formats/stream/removal.h"

#include "base/error.h"
#include "formats/stream/program_start.h"
#include "formats/stream/stream.h"

#include <array>
#include <atomic>
#include <climits>
#include <csignal>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <unistd.h>

namespace gewebe::formats {

namespace {

// Fixed slots, because a signal handler may not allocate.
struct Slot {
  std::atomic<bool> used{false};
  std::array<char, PATH_MAX> path{};
};
std::array<Slot, 8> slots;

std::atomic<bool> deferring{false};
std::atomic<int> deferred{0};
std::array<int, 2> wake{-1, -1}; // a pipe

extern "C" void gewebe_remove_temporaries(int signal_number) {
  int none = 0;
  if (deferring.load() && deferred.compare_exchange_strong(none, signal_number)) {
    const char byte = 0;
    (void)!::write(wake[1], &byte, 1);
    return;
  }
  remove_temporaries();
  (void)std::signal(signal_number, SIG_DFL);
  (void)std::raise(signal_number);
}

} // namespace

int remember_removal(const std::string& path) {
  for (std::size_t i = 0; i < slots.size(); ++i) {
    Slot& slot = slots.at(i);
    if (slot.used.load() || path.size() >= slot.path.size())
      continue;
    std::memcpy(slot.path.data(), path.c_str(), path.size() + 1);
    slot.used.store(true);
    return static_cast<int>(i);
  }
  return -1;
}

void forget_removal(int number) noexcept {
  if (number >= 0)
    slots[static_cast<std::size_t>(number)].used.store(false);
}

void defer_signals() {
  if (wake[0] < 0 && ::pipe2(wake.data(), O_CLOEXEC | O_NONBLOCK) != 0)
    return; // signals end the program, as before
  deferring.store(true);
}

int deferred_signal() noexcept {
  return deferred.load();
}

void check_deferred_signal() {
  if (deferred_signal() != 0)
    throw Cancelled();
}

int deferred_signal_descriptor() noexcept {
  return wake[0];
}

void end_by_deferred_signal() {
  const int number = deferred_signal();
  (void)std::signal(number, SIG_DFL);
  (void)std::raise(number);
  std::_Exit(128 + number);
}

SignalsWait::SignalsWait() {
  static_assert(sizeof(sigset_t) <= sizeof old_);
  sigset_t all{};
  sigset_t old{};
  (void)::sigfillset(&all);
  (void)::pthread_sigmask(SIG_SETMASK, &all, &old);
  std::memcpy(old_, &old, sizeof old);
}

SignalsWait::~SignalsWait() {
  sigset_t old{};
  std::memcpy(&old, old_, sizeof old);
  (void)::pthread_sigmask(SIG_SETMASK, &old, nullptr);
}

void install_signal_cleanup() {
  struct sigaction action {};
  action.sa_handler = gewebe_remove_temporaries;
  (void)::sigfillset(&action.sa_mask);
  action.sa_flags = 0;
  for (const int signal_number : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGPIPE, SIGXCPU}) {
    struct sigaction old {};
    // What the caller ignores on purpose (nohup) stays ignored; a broken pipe always ends a
    // program.
    if (signal_number != SIGPIPE && ::sigaction(signal_number, nullptr, &old) == 0 &&
        old.sa_handler == SIG_IGN)
      continue;
    (void)::sigaction(signal_number, &action, nullptr);
  }
  (void)std::signal(SIGXFSZ, SIG_IGN); // then write(2) says EFBIG
}

void remove_temporaries() noexcept {
  for (Slot& slot : slots)
    if (slot.used.load())
      (void)::unlink(slot.path.data());
}

} // namespace gewebe::formats
