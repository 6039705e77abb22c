#include "tools/run/scene_progress.h"

#include "base/error.h"
#include "formats/scene/scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <fcntl.h>
#include <string_view>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>
#include <variant>
#include <vector>

namespace gewebe::cli {

namespace {

/// Adds up the steps of a scene.
class StepSum {
public:
  double time() const { return time_; }

  /// \return false behind the last line that counts
  bool add(std::string_view line) {
    if (!is_about_time(line))
      return true;
    std::optional<formats::Command> command;
    try {
      command = formats::parse_scene_line(line);
    } catch (const Error&) {
      return true;
    }
    if (!command)
      return true;
    if (const auto* const step = std::get_if<formats::StepCommand>(&command->what)) {
      take_timesteps();
      time_ += step->dt.value_or(timestep_);
    } else if (const auto* const run = std::get_if<formats::RunCommand>(&command->what)) {
      time_ = std::max(time_, run->until);
    } else if (const auto* const change = std::get_if<formats::ChangeCommand>(&command->what)) {
      if (const auto* const set = std::get_if<scene::SetTimestep>(&change->change))
        timesteps_.emplace_back(command->at.value_or(time_), set->dt);
    }
    return !std::holds_alternative<formats::EndCommand>(command->what);
  }

private:
  /// Other lines, which may be long, need no parsing.
  static bool is_about_time(std::string_view line) {
    line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size()));
    const std::string_view word = line.substr(0, line.find_first_of(" \t\r"));
    return word == "step" || word == "run" || word == "timestep" || word == "at" || word == "end";
  }
  void take_timesteps() {
    std::erase_if(timesteps_, [this](const auto& change) {
      if (change.first > time_)
        return false;
      timestep_ = change.second;
      return true;
    });
  }

  double time_ = 0, timestep_ = formats::default_step;
  std::vector<std::pair<double, double>> timesteps_; ///< when it changes, and to what
};

/// A regular file, opened; standard input remains open.
class SceneFile {
public:
  explicit SceneFile(const std::string& path) : own_(path != "-" && !path.empty()), descriptor_(0) {
    struct stat info {};
    if ((own_ ? ::stat(path.c_str(), &info) : ::fstat(0, &info)) != 0 || !S_ISREG(info.st_mode))
      descriptor_ = -1;
    else if (own_) // without waiting, should a pipe take its name just now
      descriptor_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    else
      offset_ = std::max<off_t>(::lseek(0, 0, SEEK_CUR), 0);
  }
  ~SceneFile() {
    if (own_ && descriptor_ >= 0)
      (void)::close(descriptor_);
  }
  SceneFile(const SceneFile&) = delete;
  SceneFile& operator=(const SceneFile&) = delete;

  bool is_open() const { return descriptor_ >= 0; }
  /// 0: the end; less: a failure
  ssize_t read(std::vector<char>& buffer) {
    const ssize_t count = ::pread(descriptor_, buffer.data(), buffer.size(), offset_);
    offset_ += std::max<ssize_t>(count, 0);
    return count;
  }

private:
  bool own_;
  int descriptor_;
  off_t offset_ = 0;
};

std::string format_number(double value, int digits) {
  std::array<char, 32> text{};
  (void)std::snprintf(text.data(), text.size(), "%.*g", digits, value);
  return text.data();
}

} // namespace

std::optional<double> find_scene_end(const std::string& path) {
  constexpr std::size_t longest = 4096; // of a line about time; the rest of longer ones is skipped
  SceneFile file(path);
  if (!file.is_open())
    return std::nullopt;
  StepSum sum;
  std::string line;
  std::vector<char> buffer(1U << 18U);
  for (;;) {
    const ssize_t count = file.read(buffer);
    if (count < 0)
      return std::nullopt;
    if (count == 0)
      break;
    std::string_view bytes(buffer.data(), static_cast<std::size_t>(count));
    while (!bytes.empty()) {
      const std::size_t length = std::min(bytes.find('\n'), bytes.size());
      line += bytes.substr(0, std::min(length, longest - line.size()));
      if (length == bytes.size())
        break;
      if (!sum.add(line))
        return sum.time();
      line.clear();
      bytes.remove_prefix(length + 1);
    }
  }
  (void)sum.add(line);
  return sum.time();
}

SceneProgress::SceneProgress(cli::ProgressBar& bar, std::optional<double> end)
    : bar_(bar), end_(end), samples_{{cli::now_seconds(), 0}} {}

void SceneProgress::advance(double time, std::uint64_t frames) {
  time_ = time;
  frames_ = frames;
  const bool due = bar_.is_due();
  if (stepped_ && !due)
    return;
  const double clock = cli::now_seconds();
  if (due)
    draw(clock);
  if (!std::exchange(stepped_, true))
    samples_.clear(); // the first step reads models and factorises, which says nothing of others
  samples_.push_back({clock, time});
  if (samples_.size() > 30)
    samples_.pop_front();
}

void SceneProgress::finish() {
  if (bar_.was_drawn() && stepped_)
    draw(cli::now_seconds());
}

void SceneProgress::draw(double clock) {
  const Sample& since = samples_.front();
  if (clock > since.clock && time_ > since.time)
    speed_ = (time_ - since.time) / (clock - since.clock);
  const std::string frames = std::to_string(frames_) + (frames_ == 1 ? " frame" : " frames");
  const std::string speed = " s  " + format_number(speed_, 3) + " x real time  ";
  if (!end_)
    return bar_.draw(std::nullopt, format_number(time_, 4) + speed + frames);
  const double end = std::max(*end_, time_), left = end - time_;
  std::string figures = format_number(time_, 4);
  figures += " of " + format_number(end, 4) + speed + frames;
  if (speed_ > 0 || left == 0)
    figures += "  " + format_number(left == 0 ? 0 : std::ceil(left / speed_), 9) + " s left";
  bar_.draw(left > 0 ? time_ / end : 1, figures);
}

void start_progress(std::optional<SceneProgress>& progress, cli::ProgressBar* bar,
                    const std::string& scene, bool listens) {
  const bool typed = !listens && scene == "-" && ::isatty(0) != 0;
  if (bar == nullptr || (typed && !bar->always()))
    return;
  progress.emplace(*bar, listens ? std::nullopt : find_scene_end(scene));
}

} // namespace gewebe::cli
