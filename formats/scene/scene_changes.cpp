#include "formats/scene/scene_changes.h"

#include <cstdint>
#include <utility>
#include <variant>
#include <vector>

namespace gewebe::formats {

namespace {

/// Finds what a change names, by the fields that it has.
struct Names {
  const ChangeCommand& said;
  const scene::Simulation& simulation;
  const model::LoadNodeList& lists;

  std::vector<std::uint32_t> nodes(std::size_t object, const model::Selector& selector) const {
    return model::select_nodes(simulation.model(object), simulation.node_counts(object), selector,
                               lists);
  }

  template <class Kind>
  void find(Kind& c) const {
    if constexpr (requires { c.object; })
      c.object = scene::find_object(simulation, said.object);
    if constexpr (requires { c.other; })
      c.other = scene::find_object(simulation, said.other);
    if constexpr (requires { c.instrument; })
      c.instrument = scene::find_instrument(simulation, said.instrument);
    if constexpr (requires { c.nodes; })
      c.nodes = nodes(c.object, *said.nodes);
    if constexpr (requires { c.others; })
      c.others = nodes(c.other, *said.others);
    if constexpr (requires {
                    c.force;
                    c.nodes;
                  })
      if (said.total)
        c.force = c.force / static_cast<double>(c.nodes.size());
  }
  void find(scene::SetMass& c) const {
    c.object = scene::find_object(simulation, said.object);
    c.nodes = nodes(c.object, *said.nodes);
    if (said.total)
      c.mass /= static_cast<double>(c.nodes.size());
  }
  void find(scene::SetContact& c) const {
    c.object = scene::find_object(simulation, said.object);
    c.other = said.other == "self" ? c.object : scene::find_object(simulation, said.other);
    if (c.other == c.object && said.other != "self")
      throw Error("object " + said.object + " with itself, expected contact " + said.object +
                  " self");
  }
  void find(scene::Prepare& c) const {
    c.object = scene::find_object(simulation, said.object);
    if (said.nodes)
      c.nodes_ahead = nodes(c.object, *said.nodes);
  }
  void find(scene::SetInstrument& c) const {
    c.instrument = scene::instrument_place(simulation, c.name);
  }
  void find(scene::CutObject& c) const {
    c.object = scene::find_object(simulation, said.object);
    if (auto* const plane = std::get_if<scene::PlaneToCut>(&c.what)) {
      if (said.nodes)
        plane->nodes = // those inside a solid too
            model::select_nodes(simulation.model(c.object), simulation.node_counts(c.object),
                                *said.nodes, lists, model::SelectorScope::body);
      return;
    }
    auto& springs = std::get<scene::SpringsToCut>(c.what);
    springs.from = nodes(c.object, *said.nodes);
    springs.to = said.others ? nodes(c.object, *said.others) : springs.from;
  }
};

} // namespace

scene::Change scene_change(const ChangeCommand& command, const scene::Simulation& simulation,
                           const model::LoadNodeList& lists) {
  scene::Change change = command.change;
  const Names names{command, simulation, lists};
  std::visit([&](auto& c) { names.find(c); }, change);
  return change;
}

} // namespace gewebe::formats
