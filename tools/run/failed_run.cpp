#include "tools/run/failed_run.h"

#include "formats/stream/removal.h"
#include "text/number_text.h"
#include "tools/cli/progress_bar.h"

#include <csignal>
#include <string>

namespace gewebe::cli {

bool RunLogs::any() const {
  return events_ != nullptr || record_ != nullptr || latency_.logs();
}

void RunLogs::outlive_signals() {
  if (events_ != nullptr)
    events_->outlive_signals();
  latency_.outlive_signals(); // a record always does
}

std::optional<Error> RunLogs::commit() {
  std::optional<Error> first;
  const auto each = [&](const auto& work) {
    try {
      work();
    } catch (const gewebe::Error& error) {
      if (!first)
        first = error;
    }
  };
  if (events_ != nullptr)
    each([&] { events_->commit(); });
  if (record_ != nullptr)
    each([&] { record_->commit(); });
  each([&] { latency_.commit(); });
  return first;
}

namespace {

/// Keeps the frames. \return what is to be said of it
Error ending_of(const Error& error, formats::ResultWriter* result, double time) {
  const bool interrupted = formats::deferred_signal() != 0;
  std::string kept, left_out;
  if (result != nullptr)
    try {
      if (const auto some = result->keep_partial(interrupted ? "interrupted" : error.what())) {
        time = some->time;
        kept = some->what;
        if (!interrupted)
          kept += (some->all_frames ? " up to " : " at ") + text::number_text(time) + " s";
        kept += " kept in " + some->file;
        if (!some->left_out.empty())
          kept += " (without " + some->left_out + ")";
      }
    } catch (const Error& failure) {
      kept = "the frames could not be kept: " +
             (failure.place().empty() ? "" : failure.place() + ": ") + failure.what();
    }
  if (!interrupted)
    return {error.place(), error.what() + (kept.empty() ? "" : "; " + kept)};
  return Error("interrupted at " + text::number_text(time) + " s" +
               (kept.empty() ? "" : ": " + kept));
}

} // namespace

void outlive_failures(formats::ResultWriter* result, RunLogs& logs) {
  if (result != nullptr || logs.any())
    formats::defer_signals();
  if (result != nullptr)
    result->outlive_signals();
  logs.outlive_signals();
}

void end_failed_run(const Error& error, formats::ResultWriter* result, RunLogs& logs, double time) {
  const bool unheard = formats::deferred_signal() == SIGPIPE;
  if (!unheard)
    (void)logs.commit(); // they tell how it came to this
  const Error ending = ending_of(error, result, time);
  if (unheard) {
    cli::erase_progress();
    formats::end_by_deferred_signal();
  }
  throw Error(ending);
}

void report_recovered(cli::Run& run, const formats::KeptResult& kept) {
  run.say(kept.what + " up to " + text::number_text(kept.time) + " s kept in " + kept.file);
  run.stats().set("recovered", kept.file);
  run.stats().set("time", kept.time);
}

} // namespace gewebe::cli
