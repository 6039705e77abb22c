#pragma once
// What takes answers, results and logs of a scene may fail.

#include "base/error.h"

#include <exception>

namespace gewebe::cli {

/// A failure of what takes answers, results and logs is no fault of the line.
struct Undelivered {
  std::exception_ptr error;
};

template <class Work>
void deliver(Work&& work) {
  try {
    work();
  } catch (const Error&) {
    throw Undelivered{std::current_exception()};
  }
}

} // namespace gewebe::cli
