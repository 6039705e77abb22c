#pragma once
// Errors with their place. The library throws Error; a tool prints it as exactly one line,
// `tool: PLACE: what is wrong, what was expected`, and ends with status 1.

#include <stdexcept>
#include <string>
#include <utility>

namespace gewebe {

/// Error with a message for the user. `what()` is the message without its place ("3 odd rays,
/// expected a closed mesh"). `place()` is the position in a file ("liver.obj:12", "-: byte 37") or
/// empty. The library does not use files, so formats and tools add the place (see `at`).
class Error : public std::runtime_error {
public:
  explicit Error(const std::string& what) : std::runtime_error(what) {}
  Error(std::string place, const std::string& what)
      : std::runtime_error(what), place_(std::move(place)) {}

  const std::string& place() const noexcept { return place_; }

private:
  std::string place_;
};

/// Wrong use of a program: status 2 instead of 1.
class UsageError : public Error {
public:
  using Error::Error;
};

/// Thrown by library calls when their cancel callback returned true.
class Cancelled : public Error {
public:
  Cancelled() : Error("cancelled") {}
};

/// Runs `work`; an Error without a place leaves it with `place`, any other error unchanged.
template <class Work>
auto at(const std::string& place, Work&& work) -> decltype(work()) {
  try {
    return work();
  } catch (const UsageError&) {
    throw;
  } catch (const Cancelled&) {
    throw;
  } catch (const Error& error) {
    if (!error.place().empty())
      throw;
    throw Error(place, error.what());
  }
}

} // namespace gewebe
