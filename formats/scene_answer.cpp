#include "formats/scene_answer.h"

#include "formats/scene_instrument.h"

#include <array>
#include <charconv>
#include <span>

namespace gewebe {

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

std::string text_answer(const Simulation& simulation, std::uint64_t step) {
  std::string text = "step " + std::to_string(step) + " ";
  append(text, simulation.time());
  text += '\n';
  for (const MethodJump& jump : simulation.jumps()) {
    text += "jump " + simulation.name(jump.object) + " ";
    append(text, jump.size);
    text += '\n';
  }
  for (std::size_t i = 0; simulation.emits_forces() && i < simulation.object_count(); ++i) {
    const std::vector<NodeVector>& forces = simulation.contact_forces(i);
    text += "forces " + simulation.name(i) + " " + std::to_string(forces.size()) + "\n";
    for (const NodeVector& f : forces) {
      text += std::to_string(f.node) + " ";
      append(text, f.value, '\n');
    }
  }
  for (std::size_t i = 0; simulation.emits_shapes() && i < simulation.object_count(); ++i) {
    const std::vector<Node>& nodes = simulation.model(i).nodes;
    const std::span<const double> u = simulation.displacement(i);
    text += "shapes " + simulation.name(i) + " " + std::to_string(nodes.size()) + "\n";
    for (std::size_t k = 0; k < nodes.size(); ++k)
      append(text, nodes[k].position + Vec3{u[3 * k], u[3 * k + 1], u[3 * k + 2]}, '\n');
  }
  if (simulation.emits_instruments())
    text += instrument_reply(simulation);
  return text + "done\n";
}

std::string text_error(std::uint64_t line, std::string_view text) {
  std::string answer = "error " + std::to_string(line) + ": ";
  for (const char c : text)
    answer += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? ' ' : c;
  return answer + "\n";
}

} // namespace gewebe
