#include "formats/scene/scene_query.h"

#include "base/error.h"
#include "formats/scene/scene_answer.h"
#include "geometry/vector_at.h"
#include "text/number_text.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::formats {

namespace {

std::string told_nodes(const scene::Simulation& simulation, const QueryCommand& query) {
  const std::size_t object = scene::find_object(simulation, query.object);
  const std::vector<model::Node>& nodes = simulation.model(object).nodes;
  std::string text = "nodes " + query.object + " " + std::to_string(nodes.size()) + "\n";
  if (query.positions == QueryCommand::Positions::none)
    return text;
  const bool now = query.positions == QueryCommand::Positions::now;
  // To compute it here would leave traces in the last digits of later shapes.
  if (now && !simulation.object(object).shaped)
    throw Error("the last answer had no use for the shape of object " + query.object +
                ", expected emit shapes before that step, or nodes " + query.object + " rest");
  const std::span<const double> u = now ? simulation.displacement(object) : std::span<double>();
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    const Vec3 p = now ? nodes[k].position + vector_at(u, k) : nodes[k].position;
    text += gewebe::text::number_text(p.x) + ' ' + gewebe::text::number_text(p.y) + ' ' +
            gewebe::text::number_text(p.z) + '\n';
  }
  return text;
}

std::string told_selection(const scene::Simulation& simulation, const QueryCommand& query,
                           const model::LoadNodeList& lists) {
  const std::size_t object = scene::find_object(simulation, query.object);
  const std::vector<std::uint32_t> nodes = model::select_nodes(
      simulation.model(object), simulation.node_counts(object), query.nodes.value(), lists);
  std::string text = "select " + query.object + " " + std::to_string(nodes.size()) + "\n";
  for (const std::uint32_t node : nodes)
    text += std::to_string(node) + '\n';
  return text;
}

std::string told_objects(const scene::Simulation& simulation) {
  std::string text = "objects " + std::to_string(simulation.object_count()) + "\n";
  for (std::size_t i = 0; i < simulation.object_count(); ++i) {
    const scene::ObjectFacts object = simulation.object(i);
    text += object.name + ' ' + scene::method_name(object.method);
    if (object.known) { // its file is not read for this
      const model::Model& model = simulation.model(i);
      for (const std::size_t count :
           {model.nodes.size(), model.triangles.size(), model.tetrahedra.size()})
        text += ' ' + std::to_string(count);
    } else {
      text += " - - -";
    }
    text += object.method == scene::Method::ffe ? " -\n" : object.awake ? " awake\n" : " asleep\n";
  }
  return text;
}

std::string told_instruments(const scene::Simulation& simulation) {
  return instrument_lines(simulation, [](std::string& line, const scene::InstrumentReport& report) {
    const contact::InstrumentShape& shape = report.shape;
    (line += ' ') += contact::instrument_kind_name(contact::kind_of(shape));
    const contact::Quaternion& turn = report.pose.turn;
    append_numbers(line, {shape.radius, shape.friction});
    append_numbers(line, report.pose.place);
    append_numbers(line, report.pose(shape.axis));
    append_numbers(line, {turn.w, turn.x, turn.y, turn.z});
    append_numbers(line, report.force);
    append_numbers(line, report.torque);
    line += ' ' + std::to_string(report.nodes);
    if (report.hand) {
      append_numbers(line, *report.hand);
      append_numbers(line, {report.coupling.stiffness, report.coupling.damping});
    }
  });
}

} // namespace

std::string text_query(const scene::Simulation& simulation, const QueryCommand& query,
                       const model::LoadNodeList& lists) {
  switch (query.kind) {
  case QueryCommand::Kind::nodes:
    return told_nodes(simulation, query);
  case QueryCommand::Kind::select:
    return told_selection(simulation, query, lists);
  case QueryCommand::Kind::objects:
    return told_objects(simulation);
  case QueryCommand::Kind::instruments:
    break;
  }
  return told_instruments(simulation);
}

} // namespace gewebe::formats
