#include "formats/scene/scene_instrument.h"

#include <array>
#include <charconv>
#include <variant>

namespace gewebe {

std::optional<Change> instrument_change(
    const Command& command, Simulation& simulation,
    const std::function<std::vector<std::uint32_t>(std::size_t, const Selector&)>& nodes) {
  if (const auto* const set = std::get_if<InstrumentCommand>(&command.what))
    return SetInstrument{simulation.instrument_place(set->name), set->shape, set->pose, set->name};
  if (const auto* const move = std::get_if<MoveCommand>(&command.what))
    return MoveInstrument{simulation.find_instrument(move->instrument), move->place, move->turn,
                          move->over};
  if (const auto* const grasp = std::get_if<GraspCommand>(&command.what)) {
    Grasp change{simulation.find(grasp->object), {}, simulation.find_instrument(grasp->instrument)};
    change.nodes = nodes(change.object, grasp->nodes);
    return change;
  }
  if (const auto* const withdraw = std::get_if<WithdrawCommand>(&command.what))
    return Withdraw{simulation.find_instrument(withdraw->instrument)};
  return std::nullopt;
}

std::string instrument_reply(const Simulation& simulation) {
  std::size_t count = 0;
  std::string lines;
  for (std::size_t k = 0; k < simulation.instrument_count(); ++k) {
    const InstrumentReport report = simulation.instrument(k);
    if (!report.present)
      continue;
    ++count;
    lines += simulation.instrument_name(k);
    for (const Vec3& v : {report.pose.place, report.force, report.torque})
      for (int a = 0; a < 3; ++a) {
        std::array<char, 32> number{};
        lines += ' ';
        lines.append(number.data(),
                     std::to_chars(number.data(), number.data() + number.size(), v[a] + 0.0).ptr);
      }
    lines += '\n';
  }
  return "instruments " + std::to_string(count) + "\n" + lines;
}

} // namespace gewebe
