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
  for (double number = 0; std::fscanf(peer, "%lf", &number) == 1;)
    numbers.push_back(number);
  pclose(peer);
  return numbers;
}

} // namespace gewebe::timing
