#include "tools/run/step_latency.h"

#include "text/number_text.h"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace gewebe::cli {

namespace {

constexpr int min_exponent = -40; // 1 ps

} // namespace

double StepLatency::now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::size_t StepLatency::bin(double seconds) {
  int exponent = 0;
  const double half = std::frexp(seconds, &exponent); // 0.5 to 1
  if (!(seconds > 0) || exponent <= min_exponent)
    return 0;
  const auto power = static_cast<std::size_t>(exponent - min_exponent);
  if (power >= exponents)
    return exponents * parts - 1;
  return power * parts + static_cast<std::size_t>((2 * half - 1) * parts);
}

void StepLatency::log_to(const std::string& path, const formats::Output::Options& options) {
  formats::Output::Options log = options;
  log.log = "step,time,latency\n";
  log.beside = true;
  log_.emplace(path, log);
  log_->write(log.log);
}

void StepLatency::answered(std::uint64_t step, double time) {
  const double end = now();
  const double latency = end - std::max(arrived_, answered_);
  answered_ = end;
  ++steps_;
  ++counts_[bin(latency)];
  largest_ = std::max(largest_, latency);
  sum_ += latency;
  missed_ += latency * rate_ > 1 ? 1 : 0;
  if (log_)
    log_->append_whole(std::to_string(step) + "," + text::number_text(time) + "," +
                       text::number_text(latency) + "\n");
}

void StepLatency::outlive_signals() {
  if (log_)
    log_->outlive_signals();
}

void StepLatency::commit() {
  if (log_)
    log_->commit();
}

double StepLatency::quantile(double part) const {
  const auto wanted = std::max<std::uint64_t>(
      1, static_cast<std::uint64_t>(std::ceil(part * static_cast<double>(steps_))));
  std::uint64_t sum = 0;
  for (std::size_t b = 0; b < counts_.size(); ++b) {
    sum += counts_[b];
    if (sum >= wanted) // the bin's upper end
      return std::min(largest_, std::ldexp(1 + static_cast<double>(b % parts + 1) / parts,
                                           static_cast<int>(b / parts) + min_exponent - 1));
  }
  return largest_;
}

} // namespace gewebe::cli
