#pragma once
// Names of files that must not outlive the program, whatever ends it.

#include <string>

namespace gewebe::formats {

/// From now on signals (those of install_signal_cleanup) and remove_temporaries() remove this file.
/// \return a number for forget_removal; -1 if too many names, or too long a one, are remembered
int remember_removal(const std::string& path);
/// -1 is nothing.
void forget_removal(int number) noexcept;

/// From now on the first of these signals is only noted, so that the program can
/// keep its results. A second one ends it at once.
void defer_signals();
/// The noted signal; 0: none.
int deferred_signal() noexcept;
/// \throw Cancelled if a signal was noted
void check_deferred_signal();
/// A descriptor for poll(2), readable once a signal is noted; -1 before `defer_signals`.
int deferred_signal_descriptor() noexcept;
/// Ends the program by the noted signal. \pre there is one
[[noreturn]] void end_by_deferred_signal();

/// While it lives all signals of this thread wait: what is made and remembered under it is not left
/// behind.
class SignalsWait {
public:
  SignalsWait();
  ~SignalsWait();
  SignalsWait(const SignalsWait&) = delete;
  SignalsWait& operator=(const SignalsWait&) = delete;

private:
  alignas(16) unsigned char old_[128]; // a sigset_t
};

} // namespace gewebe::formats
