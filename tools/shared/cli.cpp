#include "tools/shared/cli.h"

#include "base/bytes.h"
#include "base/nearest_word.h"
#include "base/number_text.h"
#include "formats/stream/file_names.h"
#include "formats/stream/program_start.h"

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <ios>
#include <mutex>
#include <new>
#include <sys/stat.h>
#include <system_error>
#include <typeinfo>
#include <unistd.h>
#include <utility>

namespace gewebe::cli {
namespace {

double now_seconds() {
  const auto since_start = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration<double>(since_start).count();
}

/// One message is one line, whatever it quotes.
std::string one_line(std::string text) {
  for (char& c : text)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f)
      c = ' ';
  while (!text.empty() && text.back() == ' ')
    text.pop_back();
  return text;
}

void print_message(const std::string& tool, const std::string& text) {
  const std::string line = tool + ": " + one_line(text) + "\n";
  (void)std::fwrite(line.data(), 1, line.size(), stderr);
}

/// What an exception means that isn't of ours: texts of libraries tell a user nothing.
std::string foreign_text(const std::exception& error) {
  if (dynamic_cast<const std::bad_alloc*>(&error) != nullptr ||
      dynamic_cast<const std::length_error*>(&error) != nullptr)
    return "out of memory";
  if (const auto* const system = dynamic_cast<const std::system_error*>(&error))
    if (system->code().category() == std::system_category() ||
        system->code() == std::errc::resource_unavailable_try_again)
      return system->code() == std::errc::resource_unavailable_try_again
                 ? "no thread can be started, expected room for more (ulimit -u, ulimit -v)"
                 : "the system refuses: " + system->code().message();
  if (dynamic_cast<const std::ios_base::failure*>(&error) != nullptr)
    return "cannot read or write";
  return std::string("a fault of this program, please report it: ") + error.what();
}

/// What nobody can catch: thrown where a library is loaded or a thread of one begins.
[[noreturn]] void end_suddenly() {
  remove_temporaries();
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

template <class Number>
Number parse_number(const std::string& name, std::string_view word) {
  Number value{};
  const char* const end = word.data() + word.size();
  const char* const begin = word.starts_with('+') ? word.data() + 1 : word.data();
  const auto [rest, status] = std::from_chars(begin, end, value);
  if (status != std::errc{} || rest != end)
    throw UsageError(name + ": '" + std::string(word) + "' is no " +
                     (std::is_integral_v<Number> ? "whole number" : "number"));
  if constexpr (std::is_floating_point_v<Number>)
    if (!std::isfinite(value))
      throw UsageError(name + ": '" + std::string(word) + "' is not finite");
  return value;
}

/// One option or flag: what CLI11 is told, and what happens to its word afterwards.
struct Spec {
  std::string names, metavar, help;
  std::string default_text;
  std::string word;               // as typed
  std::vector<std::string> words; // instead where values may have numbers
  bool* flag = nullptr;           // a flag has no word
  bool given = false;
  std::function<void(Spec&, std::string_view)> set; // parses the word, applies the checks
  std::function<void(Spec&, std::int32_t, std::string_view)> set_numbered;
  bool must_be_positive = false;
  double min = -HUGE_VAL, max = HUGE_VAL;
  std::vector<std::string> choices;
  std::size_t list_count = 0;

  std::string long_name() const { return names.substr(names.find("--")); }

  void check(double value) const {
    if (must_be_positive && !(value > 0))
      throw UsageError(long_name() + ": expected more than 0, not " + number_text(value));
    if (!(value >= min && value <= max))
      throw UsageError(long_name() + ": expected " + number_text(min) + " to " + number_text(max) +
                       ", not " + number_text(value));
  }
};

std::uint64_t read_number_file(const char* path) {
  std::ifstream file(path);
  std::uint64_t value = 0;
  return file >> value ? value : UINT64_MAX; // "max" means no limit
}

/// What the machine and the control group leave to a new allocation.
std::uint64_t available_memory() {
  std::uint64_t available = UINT64_MAX;
  std::ifstream info("/proc/meminfo");
  std::string key;
  std::uint64_t kilobytes = 0;
  for (std::string unit; info >> key >> kilobytes && std::getline(info, unit);)
    if (key == "MemAvailable:")
      available = kilobytes * 1024;
  const std::uint64_t limit = read_number_file("/sys/fs/cgroup/memory.max");
  const std::uint64_t used = read_number_file("/sys/fs/cgroup/memory.current");
  if (limit != UINT64_MAX && used < limit)
    available = std::min(available, limit - used);
  return available;
}

/// A bar with rate and remaining time on standard error.
class ProgressBar {
public:
  ProgressBar(std::string tool, bool at_once)
      : tool_(std::move(tool)), start_(now_seconds()), quiet_until_(at_once ? 0 : start_ + 1) {}
  ~ProgressBar() {
    if (drawn_)
      (void)std::fputs("\r\033[K", stderr);
  }
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  void update(double done) {
    const std::lock_guard lock(mutex_);
    const double now = now_seconds();
    if (done < last_)
      start_ = now; // a new phase
    last_ = done;
    if (now < quiet_until_ || now < next_)
      return;
    next_ = now + 0.1;
    drawn_ = true;
    const double elapsed = now - start_;
    const double rate = elapsed > 0 ? done / elapsed : 0;
    const double left = rate > 0 ? (1 - done) / rate : 0;
    std::string bar(30, '.');
    std::fill_n(bar.begin(), static_cast<std::ptrdiff_t>(30 * std::clamp(done, 0.0, 1.0)), '#');
    (void)std::fprintf(stderr, "\r%s [%s] %3.0f %%  %.1f %%/s  %.0f s left\033[K", tool_.c_str(),
                       bar.c_str(), 100 * done, 100 * rate, left);
  }

private:
  std::string tool_;
  std::mutex mutex_;
  double start_, quiet_until_, next_ = 0, last_ = 0;
  bool drawn_ = false;
};

bool progress_wanted(const std::string& mode) {
  if (mode != "auto")
    return mode == "always";
  struct stat info {};
  const bool piped = ::fstat(1, &info) == 0 && S_ISFIFO(info.st_mode);
  return ::isatty(2) != 0 && !piped;
}

void write_text(const std::string& path, const std::string& text) {
  Output output(path, {.binary = false});
  output.write(text);
  output.commit();
}

/// Before the first constructor of any library: closed streams, and ends that nobody catches.
void begin_program(int /*argc*/, char** /*argv*/, char** /*environment*/) {
  hold_standard_streams();
  std::set_terminate(end_suddenly);
}

#ifndef GEWEBE_SANITIZE // sanitizers set themselves up at that moment
__attribute__((section(".preinit_array"), used)) void (*const early)(int, char**,
                                                                     char**) = begin_program;
#endif

} // namespace

// ---- Stats

struct Stats::State {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  nlohmann::ordered_json seconds = nlohmann::ordered_json::object();
  std::vector<std::pair<std::string, std::unique_ptr<Stats>>> objects;

  nlohmann::ordered_json whole() const {
    nlohmann::ordered_json all = json;
    for (const auto& [key, object] : objects)
      all[key] = object->state_->whole();
    if (!seconds.empty())
      all["seconds"] = seconds;
    return all;
  }
};

Stats::Stats() : state_(std::make_unique<State>()) {}
Stats::~Stats() = default;

void Stats::set(std::string_view key, std::uint64_t value) {
  state_->json[std::string(key)] = value;
}
void Stats::set(std::string_view key, std::int64_t value) {
  state_->json[std::string(key)] = value;
}
void Stats::set(std::string_view key, double value) {
  state_->json[std::string(key)] = value;
}
void Stats::set(std::string_view key, bool value) {
  state_->json[std::string(key)] = value;
}
void Stats::set(std::string_view key, std::string_view value) {
  state_->json[std::string(key)] = std::string(value);
}
void Stats::set(std::string_view key, const std::vector<double>& values) {
  state_->json[std::string(key)] = values;
}
void Stats::set(std::string_view key, const std::vector<std::uint64_t>& values) {
  state_->json[std::string(key)] = values;
}
void Stats::seconds(std::string_view key, double value) {
  auto& sum = state_->seconds[std::string(key)];
  sum = (sum.is_number() ? sum.get<double>() : 0.0) + value;
}

Stats& Stats::object(std::string_view key) {
  for (auto& [name, object] : state_->objects)
    if (name == key)
      return *object;
  return *state_->objects.emplace_back(key, std::make_unique<Stats>()).second;
}

std::string Stats::json() const {
  return state_->whole().dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

// ---- Run

Output::Options Run::output_options(bool binary) const {
  return {.keep_unchanged = keep_unchanged_, .binary = binary};
}

void Run::warn(const std::string& text) {
  if (!quiet_)
    print_message(tool_, "warning: " + text);
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

// ---- OptionRef

namespace {
Spec& spec_of(void* spec) {
  return *static_cast<Spec*>(spec);
}
} // namespace

OptionRef& OptionRef::positive() {
  spec_of(spec_).must_be_positive = true;
  return *this;
}
OptionRef& OptionRef::range(double min, double max) {
  spec_of(spec_).min = min;
  spec_of(spec_).max = max;
  return *this;
}
OptionRef& OptionRef::one_of(std::vector<std::string> words) {
  spec_of(spec_).choices = std::move(words);
  return *this;
}
OptionRef& OptionRef::count(std::size_t n) {
  spec_of(spec_).list_count = n;
  return *this;
}

// ---- Program

struct Program::State {
  std::string name, description;
  std::vector<std::unique_ptr<Spec>> specs;
  struct Operand {
    std::string name, help;
    std::string* value = nullptr;
    std::vector<std::string>* values = nullptr;
    std::size_t at_least = 0;
  };
  std::vector<Operand> operands;
  std::vector<std::function<void()>> checks;
  Run run;

  // the common options
  std::string to, format, output = "-", progress = "auto", stats_file, max_memory;
  std::int64_t threads = 0;
  bool quiet = false, verbose = false, keep_unchanged = false;
  bool stats = false;

  Spec& add(const std::string& names, const std::string& metavar, const std::string& help) {
    specs.push_back(std::make_unique<Spec>());
    Spec& spec = *specs.back();
    spec.names = names;
    spec.metavar = metavar;
    spec.help = help;
    return spec;
  }
};

Program::Program(std::string name, std::string description) : state_(std::make_unique<State>()) {
#ifdef GEWEBE_SANITIZE
  begin_program(0, nullptr, nullptr);
#endif
  state_->name = std::move(name);
  state_->description = std::move(description);
}
Program::~Program() = default;

OptionRef Program::option(const std::string& names, double& value, const std::string& metavar,
                          const std::string& help) {
  Spec& spec = state_->add(names, metavar, help);
  spec.default_text = number_text(value);
  spec.set = [&value](Spec& self, std::string_view word) {
    value = parse_number<double>(self.long_name(), word);
    self.check(value);
  };
  return OptionRef(&spec);
}

OptionRef Program::option(const std::string& names, std::optional<double>& value,
                          const std::string& metavar, const std::string& help) {
  Spec& spec = state_->add(names, metavar, help);
  spec.set = [&value](Spec& self, std::string_view word) {
    value = parse_number<double>(self.long_name(), word);
    self.check(*value);
  };
  return OptionRef(&spec);
}

OptionRef Program::option(const std::string& names, std::int64_t& value, const std::string& metavar,
                          const std::string& help) {
  Spec& spec = state_->add(names, metavar, help);
  spec.default_text = std::to_string(value);
  spec.set = [&value](Spec& self, std::string_view word) {
    value = parse_number<std::int64_t>(self.long_name(), word);
    self.check(static_cast<double>(value));
  };
  return OptionRef(&spec);
}

OptionRef Program::option(const std::string& names, std::optional<std::int64_t>& value,
                          const std::string& metavar, const std::string& help) {
  Spec& spec = state_->add(names, metavar, help);
  spec.set = [&value](Spec& self, std::string_view word) {
    value = parse_number<std::int64_t>(self.long_name(), word);
    self.check(static_cast<double>(*value));
  };
  return OptionRef(&spec);
}

OptionRef Program::option(const std::string& names, std::string& value, const std::string& metavar,
                          const std::string& help) {
  Spec& spec = state_->add(names, metavar, help);
  spec.default_text = value;
  spec.set = [&value](Spec& self, std::string_view word) {
    if (!self.choices.empty() && std::ranges::find(self.choices, word) == self.choices.end()) {
      std::string list;
      for (const std::string& choice : self.choices)
        list += (list.empty() ? "" : ", ") + choice;
      throw UsageError(self.long_name() + ": '" + std::string(word) + "', expected one of " + list);
    }
    value = word;
  };
  return OptionRef(&spec);
}

namespace {
std::vector<double> parse_list(const Spec& spec, std::string_view word) {
  std::vector<double> values;
  for (std::size_t begin = 0; begin <= word.size();) {
    const std::size_t comma = std::min(word.find(',', begin), word.size());
    values.push_back(parse_number<double>(spec.long_name(), word.substr(begin, comma - begin)));
    spec.check(values.back());
    begin = comma + 1;
  }
  if (spec.list_count != 0 && values.size() != spec.list_count)
    throw UsageError(spec.long_name() + ": expected " + std::to_string(spec.list_count) +
                     " numbers, not " + std::to_string(values.size()));
  return values;
}

/// N of "N=VALUE".
std::optional<std::int32_t> number_before_value(std::string_view word) {
  std::int32_t number = 0;
  const auto [rest, status] = std::from_chars(word.data(), word.data() + word.size(), number);
  if (status != std::errc{} || rest == word.data() + word.size() || *rest != '=' || word[0] == '-')
    return std::nullopt;
  return number;
}

void set_all(Spec& spec) {
  std::vector<std::optional<std::int32_t>> numbers;
  if (!spec.set_numbered)
    return spec.set(spec, spec.word);
  for (const std::string_view word : spec.words) {
    const auto number = number_before_value(word);
    if (std::ranges::find(numbers, number) != numbers.end())
      throw UsageError(spec.long_name() + (number ? " " + std::to_string(*number) + "=" : "") +
                       ": given more than once");
    numbers.push_back(number);
    if (number && word.back() == '=')
      throw UsageError(spec.long_name() + " " + std::string(word) + ": expected " + spec.metavar);
    if (number)
      spec.set_numbered(spec, *number, word.substr(word.find('=') + 1));
    else
      spec.set(spec, word);
  }
}

Vec3 parse_vec3(const Spec& spec, std::string_view word) {
  const std::vector<double> values = parse_list(spec, word);
  return {values[0], values[1], values[2]};
}
} // namespace

OptionRef& OptionRef::numbered(std::function<std::string&(std::int32_t)> value_of) {
  static_cast<Spec*>(spec_)->set_numbered =
      [value_of = std::move(value_of)](Spec&, std::int32_t n, std::string_view word) {
        value_of(n) = word;
      };
  return *this;
}

OptionRef& OptionRef::numbered(std::function<std::optional<Vec3>&(std::int32_t)> value_of) {
  static_cast<Spec*>(spec_)->set_numbered =
      [value_of = std::move(value_of)](Spec& self, std::int32_t n, std::string_view word) {
        value_of(n) = parse_vec3(self, word);
      };
  return *this;
}

OptionRef Program::option(const std::string& names, std::vector<double>& value,
                          const std::string& metavar, const std::string& help) {
  Spec& spec = state_->add(names, metavar, help);
  spec.set = [&value](Spec& self, std::string_view word) { value = parse_list(self, word); };
  return OptionRef(&spec);
}

OptionRef Program::option(const std::string& names, Vec3& value, const std::string& metavar,
                          const std::string& help) {
  Spec& spec = state_->add(names, metavar, help);
  spec.default_text =
      number_text(value.x) + "," + number_text(value.y) + "," + number_text(value.z);
  spec.list_count = 3;
  spec.set = [&value](Spec& self, std::string_view word) { value = parse_vec3(self, word); };
  return OptionRef(&spec);
}

OptionRef Program::option(const std::string& names, std::optional<Vec3>& value,
                          const std::string& metavar, const std::string& help) {
  Spec& spec = state_->add(names, metavar, help);
  spec.list_count = 3;
  spec.set = [&value](Spec& self, std::string_view word) { value = parse_vec3(self, word); };
  return OptionRef(&spec);
}

void Program::flag(const std::string& names, bool& value, const std::string& help) {
  state_->add(names, "", help).flag = &value;
}

void Program::operand(const std::string& name, std::string& value, const std::string& help,
                      bool required) {
  state_->operands.push_back({name, help, &value, nullptr, required ? 1U : 0U});
}

void Program::operands(const std::string& name, std::vector<std::string>& values,
                       const std::string& help, std::size_t at_least) {
  state_->operands.push_back({name, help, nullptr, &values, at_least});
}

namespace {
std::string kind_list(const std::vector<Kind>& kinds) {
  std::string text;
  for (const Kind kind : kinds)
    text += (text.empty() ? "" : ", ") + std::string(kind_name(kind));
  return text;
}

std::vector<std::string> kind_words(const std::vector<Kind>& kinds) {
  std::vector<std::string> words;
  for (const Kind kind : kinds)
    words.emplace_back(kind_name(kind));
  if (std::ranges::find(kinds, Kind::ply) != kinds.end())
    words.emplace_back("mesh");
  return words;
}
} // namespace

void Program::output_kinds(const std::vector<Kind>& kinds) {
  option("--to", state_->to, "KIND", "kind of the output, against its suffix: " + kind_list(kinds))
      .one_of(kind_words(kinds));
}

void Program::input_kinds(const std::vector<Kind>& kinds) {
  option("--format", state_->format, "KIND",
         "kind of an input without magic bytes or suffix: " + kind_list(kinds))
      .one_of(kind_words(kinds));
}

void Program::check(std::function<void()> check) {
  state_->checks.push_back(std::move(check));
}

namespace {

/// `--stats` alone never takes the next word: it is rewritten to its long form before CLI11 sees
/// it.
std::vector<std::string> preprocess(int argc, char** argv, bool& stats) {
  std::vector<std::string> words(argv + 1, argv + argc);
  std::vector<std::string> kept;
  bool only_operands = false;
  for (std::string& word : words) {
    only_operands = only_operands || word == "--";
    if (!only_operands && word == "--stats")
      stats = true;
    else
      kept.push_back(std::move(word));
  }
  std::ranges::reverse(kept); // CLI11 takes them from the back
  return kept;
}

/// The long options, for those who mistype one.
std::vector<std::string> long_options(const std::vector<std::unique_ptr<Spec>>& specs) {
  std::vector<std::string> known{"--help", "--version"};
  for (const auto& spec : specs)
    known.push_back(spec->long_name());
  return known;
}

/// A long option behind one dash would be taken for short ones: -voxel for -v -o xel.
void refuse_one_dash(const std::vector<std::string>& words, const std::vector<std::string>& known,
                     const std::string& tool) {
  for (const std::string& word : words) {
    if (word == "--")
      return;
    if (word.size() > 2 && word[0] == '-' && std::ranges::find(known, "-" + word) != known.end())
      throw UsageError("unexpected argument '" + word + "' (did you mean -" + word + "?), see " +
                       tool + " --help");
  }
}

std::string three_digits(double value) {
  std::array<char, 32> text{};
  (void)std::snprintf(text.data(), text.size(), "%.3g", value);
  return text.data();
}

/// What is worth a line to people: numbers and words; not lists, objects and digests.
std::string figures(const nlohmann::ordered_json& all) {
  std::string text;
  for (const auto& [key, value] : all.items())
    if ((value.is_number() || value.is_boolean() || value.is_string()) && key != "tool" &&
        key.find("digest") == std::string::npos)
      text += (text.empty() ? "" : ", ") + key + " " +
              (value.is_string()         ? value.get<std::string>()
               : value.is_number_float() ? three_digits(value.get<double>())
                                         : value.dump());
  return text;
}

/// What -v tells at the end: sizes, and what was written.
void tell_result(Run& run, const nlohmann::ordered_json& all, double seconds) {
  if (const std::string text = figures(all); !text.empty())
    run.say(text);
  for (const auto& [key, value] : all.items())
    if (value.is_object() && key != "seconds")
      run.say(key + ": " + figures(value));
  struct stat info {};
  const std::string& path = run.output();
  std::string what = "done";
  if (path == "-")
    what = "wrote to standard output";
  else if (::stat(path.c_str(), &info) == 0 && S_ISREG(info.st_mode))
    what = "wrote " + path + ", " + bytes_text(static_cast<double>(info.st_size));
  run.say(what + ", " + three_digits(seconds) + " s");
}

} // namespace

int Program::run(int argc, char** argv, const std::function<void(Run&)>& work) {
  State& s = *state_;
  install_signal_cleanup();
  guard_files();
  const double start = now_seconds();
  try {
    option("-o,--output", s.output, "FILE", "where the result goes, - is standard output");
    option("-j,--threads", s.threads, "N", "threads, 0 = all").range(0, 4096);
    flag("-q,--quiet", s.quiet, "no warnings");
    flag("-v,--verbose", s.verbose, "say what is done");
    option("--progress", s.progress, "WHEN", "progress bar: auto, always, never")
        .one_of({"auto", "always", "never"});
    option("--stats", s.stats_file, "[=FILE]",
           "one line of JSON about the work, on standard error or in FILE");
    option("--max-memory", s.max_memory, "SIZE",
           "refuse work that needs more, such as 4G (default: what is available)");
    flag("--keep-unchanged", s.keep_unchanged, "leave FILE alone if its bytes would be equal");

    CLI::App app(s.description, s.name);
    app.set_help_flag("-h,--help", "this text");
    app.set_version_flag("--version", s.name + " (Gewebe) " GEWEBE_VERSION, "the version");
    app.get_formatter()->column_width(34);
    for (const auto& owned : s.specs) {
      Spec& spec = *owned;
      if (spec.flag != nullptr) {
        app.add_flag(spec.names, *spec.flag, spec.help);
        continue;
      }
      const std::string more =
          spec.default_text.empty() ? "" : " (default " + spec.default_text + ")";
      CLI::Option* const option =
          spec.set_numbered
              ? app.add_option(spec.names, spec.words, spec.help + more)->allow_extra_args(false)
              : app.add_option(spec.names, spec.word, spec.help + more);
      option->type_name(spec.metavar)->each([&spec](const std::string&) { spec.given = true; });
    }
    for (const State::Operand& operand : s.operands) {
      CLI::Option* option = operand.values != nullptr
                                ? app.add_option(operand.name, *operand.values, operand.help)
                                : app.add_option(operand.name, *operand.value, operand.help);
      option->type_name("")->required(operand.at_least > 0);
    }
    refuse_one_dash({argv + 1, argv + argc}, long_options(s.specs), s.name);
    std::vector<std::string> words = preprocess(argc, argv, s.stats);
    try {
      app.parse(words);
    } catch (const CLI::CallForHelp&) {
      write_text("-", app.help());
      return 0;
    } catch (const CLI::CallForVersion& version) {
      write_text("-", std::string(version.what()) + "\n");
      return 0;
    } catch (const CLI::ExtrasError&) {
      const std::string wrong = app.remaining().front();
      throw UsageError("unexpected argument '" + wrong + "'" +
                       suggestion(wrong.substr(0, wrong.find('=')), long_options(s.specs)) +
                       ", see " + s.name + " --help");
    } catch (const CLI::ParseError& error) {
      throw UsageError(std::string(error.what()) + ", see " + s.name + " --help");
    }
    for (const auto& spec : s.specs)
      if (spec->given)
        set_all(*spec);
    for (const State::Operand& operand : s.operands) {
      const std::size_t count =
          operand.values != nullptr ? operand.values->size() : app.count(operand.name);
      if (count < operand.at_least)
        throw UsageError("expected at least " + std::to_string(operand.at_least) + " " +
                         operand.name + ", see " + s.name + " --help");
    }
    for (const auto& check : s.checks)
      check();

    Run& run = s.run;
    run.tool_ = s.name;
    run.output_ = s.output.empty() ? "-" : s.output;
    run.to_ = s.to;
    run.format_ = s.format;
    run.keep_unchanged_ = s.keep_unchanged;
    run.verbose_ = s.verbose;
    run.quiet_ = s.quiet;
    run.stats_wanted_ = s.stats || s.verbose || !s.stats_file.empty();
    run.context_.threads = static_cast<int>(s.threads);
    if (const char* level = std::getenv("GEWEBE_CPU"); level != nullptr && *level != '\0')
      run.context_.cpu = at("GEWEBE_CPU", [&] { return cpu_level_from_name(level); });
    if (s.max_memory.empty()) {
      run.context_.max_memory = available_memory();
    } else {
      try {
        run.context_.max_memory = bytes_from_text(s.max_memory);
      } catch (const Error& error) {
        throw UsageError(std::string("--max-memory: ") + error.what());
      }
    }
    if (s.stats_file == "-")
      throw UsageError("--stats: standard output is data, expected a file");
    std::optional<ProgressBar> bar;
    if (progress_wanted(s.progress)) {
      bar.emplace(s.name, s.progress == "always");
      run.context_.progress = [&bar](double done) { bar->update(done); };
    }
    run.stats_.set("tool", s.name);
    std::optional<Output> stats_output; // before the work, so that a clash of names ends it
    if (!s.stats_file.empty())
      stats_output.emplace(s.stats_file, Output::Options{.binary = false});
    work(run);
    bar.reset();
    run.stats_.seconds("total", now_seconds() - start);
    if (s.verbose && !run.failure_)
      tell_result(run, nlohmann::ordered_json::parse(run.stats_.json()), now_seconds() - start);
    if (stats_output) {
      stats_output->write(run.stats_.json() + "\n");
      stats_output->commit();
    } else if (s.stats) {
      const std::string line = run.stats_.json() + "\n";
      if (::write(2, line.data(), line.size()) != static_cast<ssize_t>(line.size()))
        throw Error("cannot write the statistics to standard error");
    }
    if (run.failure_)
      throw Error(*run.failure_);
    return 0;
  } catch (const UsageError& error) {
    print_message(s.name, error.what());
    return 2;
  } catch (const Error& error) {
    print_message(s.name, (error.place().empty() ? "" : error.place() + ": ") + error.what());
  } catch (const std::exception& error) {
    print_message(s.name, foreign_text(error));
  }
  return 1;
}

void check_one_pipe(const std::vector<std::string>& paths) {
  if (std::ranges::count(paths, "-") > 1)
    throw UsageError("standard input ('-') given more than once");
}

} // namespace gewebe::cli
