#include "formats/scene/scene_changes.h"

#include "formats/scene/scene_instrument.h"

#include <utility>
#include <variant>

namespace gewebe {

namespace {

Change cut_change(const CutCommand& cut, Simulation& simulation, const LoadNodeList& lists) {
  CutObject change{simulation.find(cut.object), {}};
  const auto nodes = [&](const std::optional<Selector>& selector) {
    return select_nodes(simulation.model(change.object), *selector, lists);
  };
  if (cut.plane) {
    PlaneToCut what{*cut.plane, {}};
    if (cut.nodes)
      what.nodes = nodes(cut.nodes);
    change.what = std::move(what);
  } else {
    SpringsToCut what{nodes(cut.nodes), {}};
    what.to = cut.others ? nodes(cut.others) : what.from;
    change.what = std::move(what);
  }
  return change;
}

} // namespace

std::optional<Change> scene_change(const Command& command, Simulation& simulation,
                                   const LoadNodeList& lists) {
  if (const auto* const force = std::get_if<ForceCommand>(&command.what)) {
    SetForce set{simulation.find(force->object), {}, force->force, force->period};
    set.nodes = select_nodes(simulation.model(set.object), force->nodes, lists);
    if (force->total)
      set.force = set.force / static_cast<double>(set.nodes.size());
    return set;
  }
  if (const auto* const displace = std::get_if<DisplaceCommand>(&command.what)) {
    SetDisplacement set{
        simulation.find(displace->object), {}, displace->displacement, displace->over};
    set.nodes = select_nodes(simulation.model(set.object), displace->nodes, lists);
    return set;
  }
  if (const auto* const pressure = std::get_if<PressureCommand>(&command.what)) {
    SetPressure set{simulation.find(pressure->object), {}, {pressure->pressure, pressure->period}};
    set.nodes = select_nodes(simulation.model(set.object), pressure->nodes, lists);
    return set;
  }
  if (const auto* const tie = std::get_if<AttachCommand>(&command.what)) {
    Attach set{simulation.find(tie->object), {}, simulation.find(tie->other), {}, tie->stiffness};
    set.nodes = select_nodes(simulation.model(set.object), tie->nodes, lists);
    set.others = select_nodes(simulation.model(set.other), tie->others, lists);
    return set;
  }
  if (const auto* const release = std::get_if<ReleaseCommand>(&command.what)) {
    Release set{simulation.find(release->object), {}};
    set.nodes = select_nodes(simulation.model(set.object), release->nodes, lists);
    return set;
  }
  if (const auto* const gravity = std::get_if<GravityCommand>(&command.what))
    return SetGravity{gravity->gravity};
  if (const auto* const timestep = std::get_if<TimestepCommand>(&command.what))
    return SetTimestep{timestep->dt};
  if (const auto* const emit = std::get_if<EmitCommand>(&command.what))
    return Emit{emit->forces, emit->instruments};
  if (const auto* const method = std::get_if<MethodCommand>(&command.what))
    return SetMethod{simulation.find(method->object), method->method};
  if (const auto* const renew = std::get_if<RenewCommand>(&command.what))
    return Renew{simulation.find(renew->object)};
  if (const auto* const cut = std::get_if<CutCommand>(&command.what))
    return cut_change(*cut, simulation, lists);
  if (const auto* const tear = std::get_if<TearCommand>(&command.what))
    return SetTear{simulation.find(tear->object), tear->strain};
  if (const auto* const restore = std::get_if<RestoreCommand>(&command.what))
    return Restore{simulation.find(restore->object)};
  return instrument_change(command, simulation, [&](std::size_t object, const Selector& selector) {
    return select_nodes(simulation.model(object), selector, lists);
  });
}

} // namespace gewebe
