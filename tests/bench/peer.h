#pragma once
// Peers of the benchmarks that are Python scripts.

#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

namespace gewebe::timing {

/// The numbers that a script prints, up to the first word that is none; nothing where it can't run.
/// `call` is its name with its arguments. $PYTHON says which Python, else python3.
inline std::vector<double> numbers_of_script(const std::string& call) {
  const char* const python = std::getenv("PYTHON");
  const std::string command =
      std::string(python != nullptr ? python : "python3") + " " + call + " 2>/dev/null";
  std::vector<double> numbers;
  FILE* const peer = popen(command.c_str(), "r");
  if (peer == nullptr)
    return numbers;
  std::string text;
  char part[4096];
  while (std::fgets(part, sizeof part, peer) != nullptr)
    text += part;
  pclose(peer);
  const char* at = text.c_str();
  for (char* end = nullptr;; at = end) {
    const double number = std::strtod(at, &end);
    if (end == at)
      break;
    numbers.push_back(number);
  }
  return numbers;
}

} // namespace gewebe::timing
