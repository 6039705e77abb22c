#pragma once
// Latencies: how long a client waits for the answer to a step.

#include "formats/stream/stream.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace gewebe::cli {

/// A latency is the time from the arrival of the line with a step, or from the answer
/// before if that is later, until the answer has left.
class StepLatency {
public:
  /// \param rate answers per second that are required; 0: any
  explicit StepLatency(double rate) : rate_(rate), counts_(exponents * parts) {}

  /// Also writes each as CSV. \throw Error, UsageError as Output
  void log_to(const std::string& path, const formats::Output::Options& options);
  void line_arrived() { arrived_ = now(); }
  /// The answer to this step, at this time of the scene, has left.
  void answered(std::uint64_t step, double time);
  bool logs() const noexcept { return log_.has_value(); }
  /// From now on a signal or a crash leaves the log, see Output.
  void outlive_signals();
  /// The log appears, if there is one. \throw Error
  void commit();

  std::uint64_t steps() const noexcept { return steps_; }
  std::uint64_t missed() const noexcept { return missed_; } ///< that took longer than 1/rate
  double largest() const noexcept { return largest_; }      ///< s
  double sum() const noexcept { return sum_; }              ///< s
  /// The latency that this part of the steps did not exceed, to 0.1 %; 0 before the first step.
  /// \pre 0 <= part <= 1
  double quantile(double part) const;

private:
  static constexpr std::size_t parts = 1024; // of a power of two
  static constexpr std::size_t exponents = 64;
  static double now();
  static std::size_t bin(double seconds);

  double rate_, arrived_ = 0, answered_ = 0, largest_ = 0, sum_ = 0;
  std::uint64_t steps_ = 0, missed_ = 0;
  std::vector<std::uint64_t> counts_; ///< by power of two and part of it
  std::optional<formats::Output> log_;
};

} // namespace gewebe::cli
