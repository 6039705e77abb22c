#include "formats/scene/scene_answer.h"

#include "geometry/vector_at.h"
#include "text/utf8.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <span>

namespace gewebe::formats {

namespace {

void append(std::string& text, double value) {
  std::array<char, 32> number{};
  text.append(number.data(),
              std::to_chars(number.data(), number.data() + number.size(), value).ptr);
}

void append(std::string& text, const Vec3& v, char end) {
  append(text, v.x);
  text += ' ';
  append(text, v.y);
  text += ' ';
  append(text, v.z);
  text += end;
}

} // namespace

void append_numbers(std::string& line, std::initializer_list<double> values) {
  for (const double value : values) {
    line += ' ';
    append(line, value + 0.0); // -0 as 0
  }
}

void append_numbers(std::string& line, const Vec3& v) {
  append_numbers(line, {v.x, v.y, v.z});
}

std::string
instrument_lines(const scene::Simulation& simulation,
                 const std::function<void(std::string&, const scene::InstrumentReport&)>& tell) {
  std::size_t count = 0;
  std::string lines;
  for (std::size_t k = 0; k < simulation.instrument_count(); ++k) {
    const scene::InstrumentReport report = simulation.instrument(k);
    if (!report.present)
      continue;
    ++count;
    lines += report.name;
    tell(lines, report);
    lines += '\n';
  }
  return "instruments " + std::to_string(count) + "\n" + lines;
}

std::string cutting_line(const scene::Simulation& simulation, const scene::Cutting& c) {
  const std::string& name = simulation.object(c.object).name;
  const std::string nodes = " nodes " + std::to_string(c.nodes);
  switch (c.kind) {
  case scene::Cutting::Kind::cut:
    return "cut " + name + " springs " + std::to_string(c.springs) + " doubled " +
           std::to_string(c.doubled) + nodes;
  case scene::Cutting::Kind::part:
    return "part " + name + " " + simulation.object(c.part).name + nodes;
  case scene::Cutting::Kind::loose:
    return "loose " + name + nodes;
  default:
    return "restored " + name + nodes;
  }
}

bool topology_changed(const scene::Simulation& simulation, std::size_t object) {
  const std::vector<scene::Cutting>& all = simulation.news().cuttings;
  return std::any_of(all.begin(), all.end(), [&](const scene::Cutting& c) {
    return c.kind != scene::Cutting::Kind::loose &&
           (c.kind == scene::Cutting::Kind::part ? c.part : c.object) == object;
  });
}

std::string text_answer(const scene::Simulation& simulation, std::uint64_t step,
                        const AnswerFields& fields) {
  std::string text = "step " + std::to_string(step) + " ";
  append(text, simulation.time());
  text += '\n';
  for (const scene::MethodJump& jump : simulation.news().jumps) {
    text += "jump " + simulation.object(jump.object).name + " ";
    append(text, jump.size);
    text += '\n';
  }
  for (const scene::Cutting& c : simulation.news().cuttings)
    text += cutting_line(simulation, c) + "\n";
  for (std::size_t i = 0; simulation.settings().emits.any_shapes() && i < simulation.object_count();
       ++i) {
    if (!topology_changed(simulation, i))
      continue;
    const std::vector<Triangle>& triangles = simulation.model(i).triangles;
    text +=
        "triangles " + simulation.object(i).name + " " + std::to_string(triangles.size()) + "\n";
    for (const Triangle& t : triangles)
      text += std::to_string(t[0]) + " " + std::to_string(t[1]) + " " + std::to_string(t[2]) + "\n";
  }
  for (std::size_t i = 0; simulation.settings().emits.forces && i < simulation.object_count();
       ++i) {
    const std::vector<contact::NodeVector>& forces = simulation.contact_forces(i);
    text += "forces " + simulation.object(i).name + " " + std::to_string(forces.size()) + "\n";
    for (const contact::NodeVector& f : forces) {
      text += std::to_string(f.node) + " ";
      append(text, f.value, '\n');
    }
  }
  for (std::size_t i = 0; simulation.settings().emits.any_shapes() && i < simulation.object_count();
       ++i) {
    const std::vector<model::Node>& nodes = simulation.model(i).nodes;
    const bool all = simulation.settings().emits.shapes;
    const std::size_t count = all ? nodes.size() : simulation.surface_nodes(i);
    const std::span<const double> u =
        all ? simulation.displacement(i) : simulation.surface_displacement(i);
    text += "shapes " + simulation.object(i).name + " " + std::to_string(count) + "\n";
    for (std::size_t k = 0; k < count; ++k)
      append(text, nodes[k].position + vector_at(u, k), '\n');
  }
  for (const StressAnswer& of : fields.stresses) {
    text += "stress " + simulation.object(of.object).name + " " + std::to_string(of.nodes.size()) +
            "\n";
    for (const std::uint32_t node : of.nodes) {
      text += std::to_string(node);
      for (const double value : of.stress[node]) {
        text += ' ';
        append(text, value + 0.0); // -0 as 0
      }
      text += ' ';
      append(text, fem::von_mises(of.stress[node]));
      text += '\n';
    }
  }
  for (const EstimateAnswer& of : fields.estimates) {
    text += "estimate " + simulation.object(of.object).name;
    if (const std::optional<fem::DiscretisationError>& e = of.error)
      append_numbers(text, {e->relative, e->force, e->displacement, e->stress});
    else
      text += " none";
    text += '\n';
  }
  if (simulation.settings().emits.instruments)
    text +=
        instrument_lines(simulation, [](std::string& line, const scene::InstrumentReport& report) {
          for (const Vec3& v : {report.pose.place, report.force, report.torque})
            append_numbers(line, v);
          if (report.hand)
            append_numbers(line, *report.hand);
        });
  return text + "done\n";
}

std::string text_ok(std::uint64_t line) {
  return "ok " + std::to_string(line) + "\n";
}

std::string text_sync(const scene::Simulation& simulation) {
  std::string text = "sync ";
  append(text, simulation.time());
  return text + "\n";
}

std::string text_ready(const scene::Simulation& simulation) {
  std::string text = "ready ";
  append(text, simulation.time());
  return text + "\n";
}

/// Valid UTF-8 in one line, whatever the text holds.
std::string text_error(std::uint64_t line, std::string_view text) {
  std::string answer = "error " + std::to_string(line) + ": ";
  while (!text.empty()) {
    const auto first = static_cast<unsigned char>(text[0]);
    const std::size_t size = gewebe::text::utf8_size(text);
    if (size == 0)
      answer += '?';
    else if (first < 0x20 || first == 0x7f)
      answer += ' ';
    else
      answer += text.substr(0, size);
    text.remove_prefix(std::max<std::size_t>(size, 1));
  }
  return answer + "\n";
}

} // namespace gewebe::formats
