#pragma once
// Event log as CSV: gewebe_results(5). One row for each change of a scene as it took
// effect, and for what was refused or warned of.

#include "formats/stream/stream.h"
#include "scene/simulation.h"

#include <string>
#include <string_view>
#include <vector>

namespace gewebe::cli {

class EventLog {
public:
  /// \throw Error, UsageError as Output
  EventLog(const std::string& path, const formats::Output::Options& options);

  /// A new object, of this model file.
  void object(double time, const std::string& name, const std::string& model, scene::Method method);
  /// An object's model was written to this file.
  void model(double time, const std::string& name, const std::string& file);
  /// Its stress at some nodes is emitted from now on.
  void stress(double time, const std::string& name, const std::vector<std::uint32_t>& nodes);
  void change(double time, const scene::ChangeRow& row);
  /// What cutting did to an object.
  void cutting(const scene::Simulation& simulation, const scene::Cutting& cutting);
  /// Where each instrument that is there stands at the end of a step, and what it feels.
  void instruments(const scene::Simulation& simulation);
  /// `what` is "error" or "warning".
  void message(double time, const char* what, std::string_view text);

  /// Confirms or discards the events since the last keep or drop.
  void keep();
  void drop() { rows_.clear(); }
  /// From now on a signal or a crash leaves what was kept, see Output.
  void outlive_signals() { output_.outlive_signals(); }
  /// The file appears. \throw Error
  void commit();

private:
  formats::Output output_;
  std::vector<std::string> rows_;
};

/// Ascending node numbers as ranges: "4 6-9".
std::string node_ranges(const std::vector<std::uint32_t>& nodes, char separator);

} // namespace gewebe::cli
