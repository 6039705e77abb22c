#pragma once
// ffe-run at the other ends of two pipes, for the benchmarks.

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <spawn.h>
#include <sstream>
#include <string>
#include <sys/wait.h>
#include <system_error>
#include <unistd.h>
#include <vector>

namespace gewebe::timing {

inline long number_behind(const std::string& text, const std::string& word) {
  const std::size_t at = text.find(word);
  return at == std::string::npos ? 0 : std::strtol(text.c_str() + at + word.size(), nullptr, 10);
}

/// ffe-run --serve at the other ends of two pipes.
class Served {
public:
  [[noreturn]] static void fail(const std::string& why) {
    (void)std::fprintf(stderr, "%s\n", why.c_str());
    std::exit(EXIT_FAILURE);
  }

  Served(const std::string& tools, const std::string& folder, int threads = 1, bool awake = false) {
    std::array<int, 2> to{}, from{};
    if (pipe(to.data()) != 0 || pipe(from.data()) != 0)
      fail("no pipe");
    posix_spawn_file_actions_t actions{};
    (void)posix_spawn_file_actions_init(&actions);
    (void)posix_spawn_file_actions_adddup2(&actions, to[0], STDIN_FILENO);
    (void)posix_spawn_file_actions_adddup2(&actions, from[1], STDOUT_FILENO);
    for (const int end : {to[0], to[1], from[0], from[1]})
      (void)posix_spawn_file_actions_addclose(&actions, end);
    const std::string program = tools + "/ffe-run";
    std::vector<std::string> words{program,  "--serve", "-q", "-j" + std::to_string(threads),
                                   "--rate", "60"};
    if (awake)
      words.emplace_back("--busy-wait");
    std::vector<char*> arguments;
    for (std::string& word : words)
      arguments.push_back(word.data());
    arguments.push_back(nullptr);
    std::filesystem::current_path(folder);
    if (posix_spawn(&child_, program.c_str(), &actions, nullptr, arguments.data(), environ) != 0)
      fail(program + " can't be started");
    (void)posix_spawn_file_actions_destroy(&actions);
    (void)close(to[0]);
    (void)close(from[1]);
    to_ = to[1];
    from_ = fdopen(from[0], "r");
  }
  ~Served() {
    (void)close(to_);
    (void)std::fclose(from_);
    (void)waitpid(child_, nullptr, 0);
  }
  Served(const Served&) = delete;
  Served& operator=(const Served&) = delete;

  void say(const std::string& text) const {
    if (write(to_, text.data(), text.size()) != static_cast<ssize_t>(text.size()))
      fail("ffe-run does not listen");
  }

  struct Answer {
    long gone = 0, doubled = 0;
    long forces = 0; ///< nodes with one
    bool refused = false, free = false;
  };
  /// Up to the end of the step.
  Answer hear() const {
    Answer answer;
    std::array<char, 4096> line{};
    while (std::fgets(line.data(), line.size(), from_) != nullptr) {
      const std::string text = line.data();
      if (text.starts_with("cut")) {
        answer.gone = number_behind(text, " springs ");
        answer.doubled = number_behind(text, " doubled ");
      }
      if (text.starts_with("forces "))
        answer.forces += std::strtol(text.c_str() + text.rfind(' '), nullptr, 10);
      answer.refused = answer.refused || text.starts_with("error");
      answer.free = answer.free || text.starts_with("loose") || text.starts_with("part");
      if (text == "done\n")
        return answer;
    }
    fail("ffe-run has ended");
  }

  /// What it has worked so far, on all its threads, ms; 0 where the system does not tell.
  double worked() const {
    double sum = 0;
    std::error_code none;
    for (const auto& task :
         std::filesystem::directory_iterator("/proc/" + std::to_string(child_) + "/task", none)) {
      std::ifstream file(task.path() / "schedstat");
      double nanoseconds = 0;
      file >> nanoseconds;
      sum += 1e-6 * nanoseconds;
    }
    return sum;
  }

  struct Disturbed {
    double faults = 0;   ///< of pages, with and without the disk
    double switches = 0; ///< that took the processor from it
  };
  /// Since it began; 0 where the system does not tell.
  Disturbed disturbed() const {
    const std::string own = "/proc/" + std::to_string(child_);
    Disturbed all;
    std::ifstream stat(own + "/stat"), status(own + "/status");
    std::string line;
    std::getline(stat, line);
    std::istringstream words(line.substr(std::min(line.size(), line.rfind(')') + 1)));
    std::vector<std::string> word{std::istream_iterator<std::string>(words), {}};
    if (word.size() > 9) // behind the name: the 10th and the 12th of the line
      all.faults = std::strtod(word[7].c_str(), nullptr) + std::strtod(word[9].c_str(), nullptr);
    while (std::getline(status, line))
      if (line.starts_with("nonvoluntary_ctxt_switches:"))
        all.switches = static_cast<double>(number_behind(line, ":"));
    return all;
  }

  /// MB that it has in memory.
  double resident() const {
    std::ifstream file("/proc/" + std::to_string(child_) + "/statm");
    double pages = 0, resident = 0;
    file >> pages >> resident;
    return 1e-6 * static_cast<double>(sysconf(_SC_PAGESIZE)) * resident;
  }

private:
  pid_t child_ = 0;
  int to_ = -1;
  FILE* from_ = nullptr;
};

} // namespace gewebe::timing
