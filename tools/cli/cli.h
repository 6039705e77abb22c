#pragma once
// What every program does alike: options, messages, --stats, exit statuses. See gewebe(7).
//
//   int main(int argc, char** argv) {
//     cli::Program program("voxelize", "Turns a mesh into a volume.");
//     double voxel = 0;
//     program.option("--voxel", voxel, "S", "edge of a voxel in mm").positive();
//     program.operand("MESH", path, "the mesh");
//     program.check([&] { if (...) throw UsageError("..."); });
//     return program.run(argc, argv, [&](cli::Run& run) { ... });
//   }

#include "base/context.h"
#include "base/error.h"
#include "formats/stream/kind.h"
#include "formats/stream/stream.h"
#include "geometry/vec3.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace gewebe::cli {

class ProgressBar;

/// One JSON object under construction; keys keep the order of their first use.
class Stats {
public:
  Stats();
  ~Stats();
  void set(std::string_view key, std::uint64_t value);
  void set(std::string_view key, std::int64_t value);
  void set(std::string_view key, int value) { set(key, static_cast<std::int64_t>(value)); }
  void set(std::string_view key, double value);
  void set(std::string_view key, bool value);
  void set(std::string_view key, const char* value) { set(key, std::string_view(value)); }
  void set(std::string_view key, std::string_view value);
  void set(std::string_view key, const std::vector<double>& values);
  void set(std::string_view key, const std::vector<std::uint64_t>& values);
  void set(std::string_view key, const Vec3& value) {
    set(key, std::vector<double>{value.x, value.y, value.z});
  }
  /// Adds to "seconds": {key: value}. All times go here.
  void seconds(std::string_view key, double value);
  /// A nested object.
  Stats& object(std::string_view key);
  std::string json() const;
  /// What is worth a line to people: numbers and words of this object, then of each nested one.
  std::vector<std::string> figures() const;

private:
  struct State;
  std::unique_ptr<State> state_;
};

/// What a program's work gets: the common options and the way to report.
class Run {
public:
  const Context& context() const { return context_; }
  const std::string& output() const { return output_; } ///< -o, "-" for standard output
  const std::string& to() const { return to_; }         ///< --to, "" if absent
  const std::string& format() const { return format_; } ///< --format, "" if absent
  formats::Output::Options output_options(bool binary) const;
  bool verbose() const { return verbose_; }
  bool quiet() const { return quiet_; }
  /// Whether --stats was given: figures that cost a pass over the result are worth it only then.
  bool stats_wanted() const { return stats_wanted_; }
  Stats& stats() { return stats_; }
  /// Null without a bar. Most programs leave it to the context's progress.
  ProgressBar* progress_bar() const { return progress_bar_; }
  /// Runs `work`, adds its wall time under stats "seconds": {name: …}.
  template <class Work>
  auto timed(std::string_view name, Work&& work) {
    const Timer timer(*this, name);
    return work();
  }
  /// `tool: warning: text` on standard error unless -q.
  void warn(const std::string& text);
  /// The program ends with this message and status 1 once all is reported, --stats too.
  void fail_at_end(const Error& error) { failure_ = error; }
  /// `tool: text` on standard error unless -q.
  void tell(const std::string& text);
  /// `tool: text` on standard error with -v.
  void say(const std::string& text);

private:
  friend class Program;
  struct Timer {
    Timer(Run& run, std::string_view name);
    ~Timer();
    Timer(const Timer&) = delete;
    Timer& operator=(const Timer&) = delete;
    Run& run_;
    std::string name_;
    double start_;
  };
  std::string tool_;
  Context context_;
  ProgressBar* progress_bar_ = nullptr;
  std::string output_ = "-", to_, format_;
  bool keep_unchanged_ = false, verbose_ = false, quiet_ = false, stats_wanted_ = false;
  Stats stats_;
  std::optional<Error> failure_;
};

/// Refines an option just declared.
class OptionRef {
public:
  OptionRef& positive(); ///< > 0
  OptionRef& range(double min, double max);
  OptionRef& one_of(std::vector<std::string> words);
  OptionRef& such_as(std::vector<std::string> words); ///< what a shell proposes; others will do
  OptionRef& count(std::size_t n);                    ///< a list must have exactly n numbers
  /// The option may be given several times: plainly once, and as N=VALUE with another whole number
  /// N each; `value_of(N)` is where that value goes.
  OptionRef& numbered(std::function<std::string&(std::int32_t)> value_of);
  OptionRef& numbered(std::function<std::optional<Vec3>&(std::int32_t)> value_of);
  OptionRef& numbered(std::function<std::optional<double>&(std::int32_t)> value_of);

private:
  friend class Program;
  explicit OptionRef(void* spec) : spec_(spec) {}
  void* spec_;
};

class Program {
public:
  /// `description` is one or two sentences for --help.
  Program(std::string name, std::string description);
  ~Program();

  // Options. `names` is "--long" or "-s,--long"; `metavar` names the value; the value before
  // parsing is the default that --help shows (optionals, lists and empty strings show none).
  // Numbers are strict: the whole word, finite. A list is one word with commas.
  /// T: double, std::int64_t, Vec3 (a place, a direction, a colour) or an optional of one of them,
  /// std::string, std::vector<double>.
  template <class T>
  OptionRef option(const std::string& names, T& value, const std::string& metavar,
                   const std::string& help);
  void flag(const std::string& names, bool& value, const std::string& help);

  // Operands, in order. An optional one keeps its default when absent. A shell proposes `words` for
  // it, or else files.
  void operand(const std::string& name, std::string& value, const std::string& help,
               bool required = false, std::vector<std::string> words = {});
  /// All remaining operands, at least `at_least`.
  void operands(const std::string& name, std::vector<std::string>& values, const std::string& help,
                std::size_t min_count);
  /// Declares --to (kinds that this tool writes) and/or --format (kinds that it reads).
  void output_kinds(const std::vector<formats::Kind>& kinds);
  void input_kinds(const std::vector<formats::Kind>& kinds);
  /// Whether the command line has the option of that long name, for checks. \pre it is declared
  bool given(std::string_view name) const;
  /// Cross-option checks, run after parsing; throw UsageError.
  void check(std::function<void()> check);

  /// Parses, checks, runs `work`, reports. Returns the exit status: 0, 1 (an Error or any
  /// exception), 2 (UsageError). A failure is one line on standard error.
  int run(int argc, char** argv, const std::function<void(Run&)>& work);

private:
  struct State;
  void declare_common();
  bool parse(const std::vector<std::string>& words);
  void prepare_run();
  void carry_out(const std::function<void(Run&)>& work);
  std::unique_ptr<State> state_;
};

/// \throw UsageError if "-" occurs more than once among `paths`.
void check_one_pipe(const std::vector<std::string>& paths);

} // namespace gewebe::cli
