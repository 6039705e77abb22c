#include "tools/run/event_log.h"

#include "text/number_text.h"

#include <initializer_list>

namespace gewebe::cli {

namespace {

std::string quoted(std::string_view text) {
  std::string result = "\"";
  for (const char c : text)
    result += c == '"' ? std::string("\"\"") : std::string(1, c < 0x20 && c >= 0 ? ' ' : c);
  return result + '"';
}

std::string csv(double time, const scene::ChangeRow& row) {
  std::string line = text::number_text(time) + "," + row.what + "," + row.object + "," +
                     node_ranges(row.nodes, ' ') + ",";
  for (int a = 0; a < 3; ++a)
    line += (row.vector ? text::number_text((*row.vector)[a]) : "") + ",";
  line += (row.value ? text::number_text(*row.value) : "") + ",";
  line += (row.duration > 0 ? text::number_text(row.duration) : "") + "," + row.other + "," +
          node_ranges(row.others, ' ') + ",";
  line += row.text.empty() ? "" : quoted(row.text);
  const scene::InstrumentRow& of = row.instrument;
  const auto add = [&](bool there, std::initializer_list<double> values) {
    for (const double value : values)
      line += "," + (there ? text::number_text(value + 0.0) : ""); // -0 as 0
  };
  const auto add_vector = [&](const std::optional<Vec3>& v) {
    const Vec3 value = v.value_or(Vec3{});
    add(v.has_value(), {value.x, value.y, value.z});
  };
  add_vector(of.end);
  const contact::Quaternion turn = of.turn.value_or(contact::Quaternion{});
  add(of.turn.has_value(), {turn.w, turn.x, turn.y, turn.z});
  add_vector(of.force);
  add_vector(of.torque);
  line += "," + (of.nodes ? std::to_string(*of.nodes) : "");
  add_vector(of.hand);
  return line + "\n";
}

constexpr std::string_view columns =
    "time,what,object,nodes,x,y,z,value,duration,other,other_nodes,text,end_x,end_y,end_z,turn_w,"
    "turn_x,turn_y,turn_z,force_x,force_y,force_z,torque_x,torque_y,torque_z,touched,hand_x,hand_y,"
    "hand_z\n";

formats::Output::Options as_log(formats::Output::Options options) {
  options.log = columns;
  options.beside = true;
  return options;
}

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

EventLog::EventLog(const std::string& path, const formats::Output::Options& options)
    : output_(path, as_log(options)) {
  output_.write(columns);
}

void EventLog::object(double time, const std::string& name, const std::string& model,
                      scene::Method method) {
  rows_.push_back(csv(
      time, {.what = "object", .object = name, .text = model + " " + scene::method_name(method)}));
}

void EventLog::model(double time, const std::string& name, const std::string& file) {
  rows_.push_back(csv(time, {.what = "emit", .object = name, .text = "model " + file}));
}

void EventLog::stress(double time, const std::string& name,
                      const std::vector<std::uint32_t>& nodes) {
  rows_.push_back(csv(time, {.what = "emit", .object = name, .nodes = nodes, .text = "stress"}));
}

void EventLog::change(double time, const scene::ChangeRow& row) {
  rows_.push_back(csv(time, row));
}

void EventLog::cutting(const scene::Simulation& simulation, const scene::Cutting& c) {
  const bool part = c.kind == scene::Cutting::Kind::part;
  rows_.push_back(csv(c.time, {.what = c.kind == scene::Cutting::Kind::cut     ? "severed"
                                       : part                                  ? "part"
                                       : c.kind == scene::Cutting::Kind::loose ? "loose"
                                                                               : "restored",
                               .object = simulation.object(c.object).name,
                               .value = static_cast<double>(c.nodes),
                               .other = part ? simulation.object(c.part).name : "",
                               .text = c.kind == scene::Cutting::Kind::cut
                                           ? std::to_string(c.springs) + " springs, " +
                                                 std::to_string(c.doubled) + " nodes doubled"
                                           : c.text}));
}

void EventLog::instruments(const scene::Simulation& simulation) {
  for (std::size_t k = 0; k < simulation.instrument_count(); ++k) {
    const scene::InstrumentReport report = simulation.instrument(k);
    if (!report.present)
      continue;
    rows_.push_back(csv(simulation.time(),
                        {.what = "felt",
                         .object = report.name,
                         .vector = report.pose.place + Vec3{}, // -0 as 0
                         .value = report.shape.radius,
                         .text = contact::instrument_kind_name(contact::kind_of(report.shape)),
                         .instrument = {report.pose(report.shape.axis), report.pose.turn,
                                        report.force, report.torque, report.nodes, report.hand}}));
  }
}

void EventLog::message(double time, const char* what, std::string_view text) {
  rows_.push_back(csv(time, {.what = what, .object = {}, .text = std::string(text)}));
}

void EventLog::keep() {
  std::string text;
  for (const std::string& row : rows_)
    text += row;
  rows_.clear();
  output_.append_whole(text);
}

void EventLog::commit() {
  output_.commit();
}

} // namespace gewebe::cli
