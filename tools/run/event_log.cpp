#include "tools/run/event_log.h"

#include "base/number_text.h"

#include <variant>

namespace gewebe {

namespace {

/// A row of the log; what does not apply stays empty.
struct Row {
  double time = 0;
  std::string what;
  std::string object;
  std::vector<std::uint32_t> nodes{};
  std::optional<Vec3> vector{};
  std::optional<double> value{};
  double duration = 0; ///< s; 0: none
  std::string other{};
  std::vector<std::uint32_t> others{};
  std::string text{};
};

std::string quoted(std::string_view text) {
  std::string result = "\"";
  for (const char c : text)
    result += c == '"' ? std::string("\"\"") : std::string(1, c < 0x20 && c >= 0 ? ' ' : c);
  return result + '"';
}

std::string csv(const Row& row) {
  std::string line = number_text(row.time) + "," + row.what + "," + row.object + "," +
                     node_ranges(row.nodes, ' ') + ",";
  for (int a = 0; a < 3; ++a)
    line += (row.vector ? number_text((*row.vector)[a]) : "") + ",";
  line += (row.value ? number_text(*row.value) : "") + ",";
  line += (row.duration > 0 ? number_text(row.duration) : "") + "," + row.other + "," +
          node_ranges(row.others, ' ') + ",";
  return line + (row.text.empty() ? "" : quoted(row.text)) + "\n";
}

/// What each change says.
struct Describe {
  const Simulation& simulation;
  Row row{.time = simulation.time(), .what = {}, .object = {}};

  void of(std::size_t object, const char* what) {
    row.object = simulation.name(object);
    row.what = what;
  }
  void about(std::size_t instrument, const char* what) {
    row.other = simulation.instrument_name(instrument);
    row.what = what;
  }
  void operator()(const SetForce& c) {
    of(c.object, "force");
    row.nodes = c.nodes;
    row.vector = c.force;
    row.duration = c.period;
  }
  void operator()(const SetPressure& c) {
    of(c.object, "pressure");
    row.nodes = c.nodes;
    row.value = c.pressure.pressure;
    row.duration = c.pressure.period;
  }
  void operator()(const SetDisplacement& c) {
    of(c.object, "displace");
    row.nodes = c.nodes;
    row.vector = c.displacement;
    row.duration = c.over;
  }
  void operator()(const Attach& c) {
    of(c.object, "attach");
    row.nodes = c.nodes;
    row.value = c.stiffness;
    row.other = simulation.name(c.other);
    row.others = c.others;
  }
  void operator()(const Release& c) {
    of(c.object, "release");
    row.nodes = c.nodes;
  }
  void operator()(const SetInstrument& c) {
    about(c.instrument, "instrument");
    row.vector = c.pose.place;
    row.value = c.shape.radius;
  }
  void operator()(const MoveInstrument& c) {
    about(c.instrument, "move");
    row.vector = c.place;
    row.duration = c.over;
  }
  void operator()(const Grasp& c) {
    of(c.object, "grasp");
    row.nodes = c.nodes;
    row.other = simulation.instrument_name(c.instrument);
  }
  void operator()(const Withdraw& c) { about(c.instrument, "withdraw"); }
  void operator()(const SetGravity& c) {
    row.what = "gravity";
    row.vector = c.gravity;
  }
  void operator()(const SetTimestep& c) {
    row.what = "timestep";
    row.value = c.dt;
  }
  void operator()(const SetTwoStep& c) {
    of(c.object, "two-step");
    row.value = c.options.threshold;
    row.text = c.options.series ? "series" : "";
  }
  void operator()(const Emit& c) {
    row.what = "emit";
    row.text = c.instruments ? "instruments" : c.forces ? "forces" : "shapes";
  }
  void operator()(const SetMethod& c) {
    of(c.object, "method");
    row.text = method_name(c.method);
    if (c.method == Method::ffe && !simulation.jumps().empty() &&
        simulation.jumps().back().object == c.object)
      row.value = simulation.jumps().back().size;
  }
  void operator()(const Renew& c) { of(c.object, "renew"); }
  void operator()(const CutObject& c) {
    of(c.object, "cut");
    if (const auto* const springs = std::get_if<SpringsToCut>(&c.what)) {
      row.nodes = springs->from;
      row.others = springs->to;
      row.text = "springs";
      return;
    }
    const auto& plane = std::get<PlaneToCut>(c.what);
    row.nodes = plane.nodes.value_or(std::vector<std::uint32_t>{});
    row.vector = plane.plane.point;
    const Vec3& n = plane.plane.normal;
    row.text = "plane " + number_text(n.x) + " " + number_text(n.y) + " " + number_text(n.z);
  }
  void operator()(const SetTear& c) {
    of(c.object, "tear");
    row.value = c.strain;
  }
  void operator()(const Restore& c) { of(c.object, "restore"); }
};

} // namespace

std::string node_ranges(const std::vector<std::uint32_t>& nodes, char separator) {
  std::string text;
  for (std::size_t i = 0; i < nodes.size();) {
    std::size_t last = i;
    while (last + 1 < nodes.size() && nodes[last + 1] == nodes[last] + 1)
      ++last;
    if (!text.empty())
      text += separator;
    text += std::to_string(nodes[i]);
    if (last > i)
      text += "-" + std::to_string(nodes[last]);
    i = last + 1;
  }
  return text;
}

EventLog::EventLog(const std::string& path, const Output::Options& options)
    : output_(path, options) {
  output_.write("time,what,object,nodes,x,y,z,value,duration,other,other_nodes,text\n");
}

void EventLog::object(double time, const std::string& name, const std::string& model,
                      Method method) {
  rows_.push_back(csv(
      {.time = time, .what = "object", .object = name, .text = model + " " + method_name(method)}));
}

void EventLog::model(double time, const std::string& name, const std::string& file) {
  rows_.push_back(csv({.time = time, .what = "emit", .object = name, .text = "model " + file}));
}

void EventLog::change(const Simulation& simulation, const Change& change) {
  Describe describe{simulation};
  std::visit(describe, change);
  rows_.push_back(csv(describe.row));
}

void EventLog::cutting(const Simulation& simulation, const Cutting& c) {
  const bool part = c.kind == Cutting::Kind::part;
  rows_.push_back(
      csv({.time = c.time,
           .what = c.kind == Cutting::Kind::cut     ? "severed"
                   : part                           ? "part"
                   : c.kind == Cutting::Kind::loose ? "loose"
                                                    : "restored",
           .object = simulation.name(c.object),
           .value = static_cast<double>(c.nodes),
           .other = part ? simulation.name(c.part) : "",
           .text = c.kind == Cutting::Kind::cut ? std::to_string(c.springs) + " springs, " +
                                                      std::to_string(c.doubled) + " nodes doubled"
                                                : c.text}));
}

void EventLog::message(double time, const char* what, std::string_view text) {
  rows_.push_back(csv({.time = time, .what = what, .object = {}, .text = std::string(text)}));
}

void EventLog::keep() {
  for (const std::string& row : rows_)
    output_.write(row);
  rows_.clear();
}

void EventLog::commit() {
  output_.commit();
}

} // namespace gewebe
