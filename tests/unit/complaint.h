#pragma once
// What an error says.

#include "base/error.h"

#include <string>
#include <utility>

namespace gewebe::test {

/// The Error that a call throws: "PLACE: text", or the text where it has no place; "" where it
/// throws none.
template <class Call>
std::string complaint(Call&& call) {
  try {
    (void)std::forward<Call>(call)();
  } catch (const Error& error) {
    return error.place().empty() ? error.what() : error.place() + ": " + error.what();
  }
  return "";
}

} // namespace gewebe::test
