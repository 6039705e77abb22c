#include "tools/cli/cli.h"

#include "base/bytes.h"
#include "formats/stream/file_names.h"
#include "formats/stream/program_start.h"
#include "text/number_text.h"
#include "tools/cli/memory_limit.h"
#include "tools/cli/messages.h"
#include "tools/cli/options_internal.h"
#include "tools/cli/progress_bar.h"
#include "tools/cli/version.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <sys/stat.h>
#include <type_traits>
#include <unistd.h>
#include <utility>

namespace gewebe::cli {
namespace {

/// Exceptions that cannot be caught: thrown where a library is loaded or one of its threads begins.
[[noreturn]] void end_suddenly() {
  formats::remove_temporaries();
  std::string text = "a fault of this program, please report it";
  try {
    if (const std::exception_ptr thrown = std::current_exception())
      std::rethrow_exception(thrown);
  } catch (const std::exception& error) {
    text = foreign_text(error);
  } catch (...) { // as said above
  }
  print_message(program_invocation_short_name, text);
  ::_exit(1);
}

void write_text(const std::string& path, const std::string& text) {
  formats::Output output(path, {.binary = false});
  output.write(text);
  output.commit();
}

/// Before the first constructor of any library: closed streams, and uncaught exceptions.
void begin_program(int /*argc*/, char** /*argv*/, char** /*environment*/) {
  formats::hold_standard_streams();
  std::set_terminate(end_suddenly);
}

#ifndef GEWEBE_SANITIZE // sanitizers set themselves up at that moment
__attribute__((section(".preinit_array"), used)) void (*const early)(int, char**,
                                                                     char**) = begin_program;
#endif

} // namespace

// ---- Run

formats::Output::Options Run::output_options(bool binary) const {
  return {.keep_unchanged = keep_unchanged_, .binary = binary};
}

void Run::warn(const std::string& text) {
  if (!quiet_)
    print_message(tool_, "warning: " + text);
}

void Run::tell(const std::string& text) {
  if (!quiet_)
    print_message(tool_, text);
}

void Run::say(const std::string& text) {
  if (verbose_)
    print_message(tool_, text);
}

Run::Timer::Timer(Run& run, std::string_view name)
    : run_(run), name_(name), start_(now_seconds()) {}
Run::Timer::~Timer() {
  run_.stats_.seconds(name_, now_seconds() - start_);
}

// ---- Program

struct Program::State {
  std::string description;
  CommandLine line;
  std::vector<std::function<void()>> checks;
  Run run;

  // the common options
  std::string to, format, output = "-", progress = "auto", stats_file, max_memory;
  std::int64_t threads = 0;
  bool help = false, help_json = false, version = false;
  bool quiet = false, verbose = false, keep_unchanged = false;
  bool stats = false;

  Spec& add(const std::string& names, const std::string& metavar, const std::string& help_text) {
    Spec& spec = *line.specs.emplace_back(std::make_unique<Spec>());
    spec.names = names;
    spec.metavar = metavar;
    spec.help = help_text;
    return spec;
  }
};

Program::Program(std::string name, std::string description) : state_(std::make_unique<State>()) {
#ifdef GEWEBE_SANITIZE
  begin_program(0, nullptr, nullptr);
#endif
  state_->line.tool = std::move(name);
  state_->description = std::move(description);
  flag("-h,--help", state_->help, "print this text");
  flag("--help-json", state_->help_json, "print options, examples and exit statuses as JSON");
  flag("--version", state_->version, "print version, commit, libraries, kernels");
}
Program::~Program() = default;

namespace {
std::string default_text(double value) {
  return text::number_text(value);
}
std::string default_text(std::int64_t value) {
  return std::to_string(value);
}
std::string default_text(const std::string& value) {
  return value;
}
std::string default_text(const Vec3& value) {
  return text::number_text(value.x) + "," + text::number_text(value.y) + "," +
         text::number_text(value.z);
}
template <class T> // a list, or what has no default
std::string default_text(const T& /*value*/) {
  return "";
}

template <class T>
std::string value_type() {
  if constexpr (std::is_same_v<T, double> || std::is_same_v<T, std::optional<double>>)
    return "number";
  if constexpr (std::is_same_v<T, std::int64_t> || std::is_same_v<T, std::optional<std::int64_t>>)
    return "whole number";
  return std::is_same_v<T, std::string> ? "text" : "numbers";
}
} // namespace

template <class T>
OptionRef Program::option(const std::string& names, T& value, const std::string& metavar,
                          const std::string& help) {
  Spec& spec = state_->add(names, metavar, help);
  spec.default_text = default_text(value);
  spec.value_type = value_type<T>();
  if constexpr (std::is_same_v<T, gewebe::Vec3> || std::is_same_v<T, std::optional<gewebe::Vec3>>)
    spec.list_count = 3;
  spec.set = [&spec, &value](std::string_view word) { spec.read(word, value); };
  return OptionRef(&spec);
}

using Text = const std::string&;
template OptionRef Program::option(Text, double&, Text, Text);
template OptionRef Program::option(Text, std::optional<double>&, Text, Text);
template OptionRef Program::option(Text, std::int64_t&, Text, Text);
template OptionRef Program::option(Text, std::optional<std::int64_t>&, Text, Text);
template OptionRef Program::option(Text, std::string&, Text, Text);
template OptionRef Program::option(Text, std::vector<double>&, Text, Text);
template OptionRef Program::option(Text, Vec3&, Text, Text);
template OptionRef Program::option(Text, std::optional<Vec3>&, Text, Text);

void Program::flag(const std::string& names, bool& value, const std::string& help) {
  state_->add(names, "", help).flag = &value;
}

void Program::operand(const std::string& name, std::string& value, const std::string& help,
                      bool required, std::vector<std::string> words) {
  state_->line.operands.push_back({.name = name,
                                   .help = help,
                                   .words = std::move(words),
                                   .value = &value,
                                   .values = nullptr,
                                   .min_count = required ? 1U : 0U});
}

void Program::operands(const std::string& name, std::vector<std::string>& values,
                       const std::string& help, std::size_t min_count) {
  state_->line.operands.push_back(
      {.name = name, .help = help, .words = {}, .values = &values, .min_count = min_count});
}

namespace {
std::vector<std::string> kind_words(const std::vector<formats::Kind>& kinds) {
  std::vector<std::string> words;
  for (const formats::Kind kind : kinds)
    words.emplace_back(formats::kind_name(kind));
  if (std::ranges::find(kinds, formats::Kind::ply) != kinds.end())
    words.emplace_back("mesh");
  return words;
}
} // namespace

void Program::output_kinds(const std::vector<formats::Kind>& kinds) {
  option("--to", state_->to, "KIND",
         "kind of the output, overrides its suffix: " + formats::kind_list(kinds))
      .one_of(kind_words(kinds));
}

void Program::input_kinds(const std::vector<formats::Kind>& kinds) {
  option("--format", state_->format, "KIND",
         "kind of an input that has neither magic bytes nor suffix: " + formats::kind_list(kinds))
      .one_of(kind_words(kinds));
}

bool Program::given(std::string_view name) const {
  const Spec& spec = *state_->line.find(name);
  return spec.flag != nullptr ? *spec.flag : !spec.words.empty();
}

void Program::check(std::function<void()> check) {
  state_->checks.push_back(std::move(check));
}

void Program::declare_common() {
  State& s = *state_;
  option("-o,--output", s.output, "FILE", "output file, - is standard output");
  option("-j,--threads", s.threads, "N", "number of threads, 0 = all").range(0, 4096);
  flag("-q,--quiet", s.quiet, "suppress warnings, except of results that cannot be trusted");
  flag("-v,--verbose", s.verbose, "print each step of the work");
  option("--progress", s.progress, "WHEN", "progress bar: auto, always, never")
      .one_of({"auto", "always", "never"});
  option("--stats", s.stats_file, "[=FILE]",
         "write one line of JSON with figures, to standard error or FILE");
  s.line.specs.back()->flag = &s.stats; // alone it never takes the next word
  option("--max-memory", s.max_memory, "SIZE",
         "refuse work that needs more memory, such as 4G (default: what is available)");
  flag("--keep-unchanged", s.keep_unchanged, "leave FILE alone if its bytes would be equal");
}

/// Whether there is work to do: --help, --version and --describe, which is for scripts/completions
/// and therefore in no help, are done here.
bool Program::parse(const std::vector<std::string>& words) {
  State& s = *state_;
  declare_common();
  if (words.size() == 1 && words[0] == "--describe") {
    write_text("-", s.line.describe(s.description));
    return false;
  }
  s.line.take(words);
  if (s.help || s.help_json || s.version) {
    write_text("-", s.version     ? version_text(s.line.tool)
                    : s.help_json ? s.line.help_json(s.description)
                                  : s.line.help(s.description));
    return false;
  }
  s.line.check_complete();
  for (const auto& spec : s.line.specs)
    spec->set_all();
  for (const auto& check : s.checks)
    check();
  if (s.stats_file == "-")
    throw UsageError("--stats: standard output is data, expected a file");
  return true;
}

/// Fills in what the work is given.
void Program::prepare_run() {
  State& s = *state_;
  Run& run = s.run;
  run.tool_ = s.line.tool;
  run.output_ = s.output;
  run.to_ = s.to;
  run.format_ = s.format;
  run.keep_unchanged_ = s.keep_unchanged;
  run.verbose_ = s.verbose;
  run.quiet_ = s.quiet;
  run.stats_wanted_ = s.stats || s.verbose || !s.stats_file.empty();
  run.stats_.set("tool", run.tool_);
  run.context_.threads = static_cast<int>(s.threads);
  if (const char* level = std::getenv("GEWEBE_CPU"); level != nullptr && *level != '\0')
    run.context_.cpu = at("GEWEBE_CPU", [&] { return cpu_level_from_name(level); });
  try {
    run.context_.max_memory =
        s.max_memory.empty() ? available_memory() : bytes_from_text(s.max_memory);
  } catch (const Error& error) {
    throw UsageError(std::string("--max-memory: ") + error.what());
  }
}

namespace {

/// Final lines of -v: sizes, and what was written.
void tell_result(Run& run, double seconds) {
  for (const std::string& line : run.stats().figures())
    run.say(line);
  struct stat info {};
  const std::string& path = run.output();
  std::string what = "done";
  if (path == "-")
    what = "wrote to standard output";
  else if (::stat(path.c_str(), &info) == 0 && S_ISREG(info.st_mode))
    what = "wrote " + path + ", " + bytes_text(static_cast<double>(info.st_size));
  std::array<char, 32> time{};
  (void)std::snprintf(time.data(), time.size(), ", %.3g s", seconds);
  run.say(what + time.data());
}

} // namespace

void Program::carry_out(const std::function<void(Run&)>& work) {
  const double start = now_seconds();
  State& s = *state_;
  Run& run = s.run;
  std::optional<ProgressBar> bar;
  if (progress_wanted(s.progress)) {
    bar.emplace(run.tool_, s.progress == "always");
    run.progress_bar_ = &*bar;
    run.context_.progress = [&bar](double done) { bar->update(done); };
  }
  std::optional<formats::Output> stats_output; // before the work, so that a clash of names ends it
  if (!s.stats_file.empty())
    stats_output.emplace(s.stats_file, formats::Output::Options{.binary = false, .beside = true});
  work(run);
  run.progress_bar_ = nullptr;
  bar.reset();
  run.stats_.seconds("total", now_seconds() - start);
  if (s.verbose && !run.failure_)
    tell_result(run, now_seconds() - start);
  const std::string line = run.stats_.json() + "\n";
  if (stats_output) {
    stats_output->write(line);
    stats_output->commit();
  } else if (s.stats && ::write(2, line.data(), line.size()) != static_cast<ssize_t>(line.size())) {
    throw Error("cannot write the statistics to standard error");
  }
  if (run.failure_)
    throw Error(*run.failure_);
}

int Program::run(int argc, char** argv, const std::function<void(Run&)>& work) {
  const std::string& tool = state_->line.tool;
  formats::install_signal_cleanup();
  formats::guard_files();
  try {
    if (parse({argv + 1, argv + argc})) {
      prepare_run();
      carry_out(work);
    }
    return 0;
  } catch (const UsageError& error) {
    print_message(tool, error.what());
    return 2;
  } catch (const Error& error) {
    print_message(tool, (error.place().empty() ? "" : error.place() + ": ") + error.what());
  } catch (const std::exception& error) {
    print_message(tool, foreign_text(error));
  }
  return 1;
}

void check_one_pipe(const std::vector<std::string>& paths) {
  if (std::ranges::count(paths, "-") > 1)
    throw UsageError("standard input ('-') given more than once");
}

} // namespace gewebe::cli
