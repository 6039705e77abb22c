#include "statics/warped_statics.h"

#include "base/error.h"
#include "compliance/compliance.h"
#include "compliance/load_answer.h"
#include "fem/solid_model.h"
#include "geometry/vector_at.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

namespace gewebe::statics {

namespace {

constexpr std::size_t few_nodes = 64, max_nodes = 1000;
constexpr WarpOptions usual{.max_rounds = 30, .tolerance = warp_tolerance};
constexpr double too_far = 1e-2;

std::vector<std::uint8_t> fixed_axes(const model::Model& model) {
  std::vector<std::uint8_t> fixed(3 * model.nodes.size());
  for (std::uint32_t i = 0; i < model.nodes.size(); ++i)
    for (int a = 0; a < 3; ++a)
      fixed[axis_of(i, a)] = contact::is_fixed(model, i, a) ? 1 : 0;
  return fixed;
}

RotationWarp made_warp(const model::Model& model, WarpSolve solve, const Context& context) {
  if (model.tetrahedra.empty())
    throw Error("the model has no tetrahedra, expected a solid for rotation=warp");
  const tetrahedra::TetMesh mesh = fem::element_mesh(model);
  const std::vector<fem::SolidElement> elements =
      fem::solid_elements(mesh, fem::element_materials(model), context);
  std::vector<std::uint8_t> used(model.nodes.size());
  for (const auto& corners : mesh.tetrahedra)
    for (const std::uint32_t node : corners)
      used[node] = 1;
  for (const auto& middles : mesh.middles)
    for (const std::uint32_t node : middles)
      used[node] = 1;
  if (const auto free = std::ranges::find(used, 0); free != used.end())
    throw Error("node " + std::to_string(free - used.begin()) +
                " is of no tetrahedron, expected all in some for rotation=warp");
  return {mesh, elements, fixed_axes(model), std::move(solve), context};
}

} // namespace

struct WarpedStatics::State {
  const model::Model& model;
  compliance::Compliance compliance;
  RotationWarp warp;
  std::vector<std::uint8_t> fixed;
  std::size_t surface_nodes;
  WarpColumns columns;
  std::optional<WarpWholeLoad> whole;
  contact::Load whole_of; // what that is of
  std::shared_ptr<const WarpedAnswer> answer;
  WarpedCounts counts;
  // Displacements of the answer, once they were read.
  std::vector<double> surface, all, local;

  State(const model::Model& m, std::shared_ptr<compliance::ComplianceSource> source,
        const Context& context)
      : model(m), compliance(m, std::move(source), context, false),
        warp(made_warp(
            m, [this](std::span<double> f) { compliance.solve(f); }, context)),
        fixed(fixed_axes(m)), surface_nodes(model::surface_count(m)),
        columns(warp.surface().nodes().size()) {}

  std::uint32_t place_of(std::uint32_t node) const {
    const std::uint32_t place = warp.surface().place()[node];
    if (place == RotationStrain::none)
      throw Error("node " + std::to_string(node) +
                  " is inside, expected nodes of the surface alone to be displaced or touched with "
                  "rotation=warp");
    return place;
  }

  // ---- what acts

  /// What is solved for: weight, and forces where they are many or inside.
  contact::Load whole_part(const contact::Load& load,
                           std::span<const std::uint32_t> touched) const {
    contact::Load part;
    part.gravity = load.gravity;
    part.force = load.force;
    for (const std::uint32_t node : touched)
      part.force.erase(node);
    if (part.force.size() <= few_nodes)
      std::erase_if(part.force, [&](const auto& entry) {
        return warp.surface().place()[entry.first] != RotationStrain::none;
      });
    return part;
  }

  static bool same(const contact::Load& a, const contact::Load& b) {
    return a.gravity == b.gravity && a.force == b.force;
  }

  void column_of(std::uint32_t place, std::span<double> of_node) {
    const std::vector<std::uint32_t>& nodes = warp.surface().nodes();
    const std::size_t rows = 3 * nodes.size();
    std::vector<double> u;
    for (int a = 0; a < 3; ++a) {
      contact::NodeVector unit{nodes[place], {}};
      unit.value[a] = 1;
      u.assign(compliance.rows(), 0);
      if (!contact::is_fixed(model, nodes[place], a))
        compliance.add({&unit, 1}, 0, u);
      for (std::size_t k = 0; k < rows; ++k)
        of_node[static_cast<std::size_t>(a) * rows + k] = u[3 * std::size_t{nodes[k / 3]} + k % 3];
    }
  }

  struct Acting {
    std::vector<double> forces, targets;
    std::vector<std::uint8_t> held;
  };

  /// Columns of the nodes that forces come by.
  void take_columns(const contact::Load& load, const contact::Load& part,
                    std::span<const std::uint32_t> touched) {
    std::vector<std::uint32_t> nodes, places;
    for (const auto& entry : load.force)
      if (!part.force.contains(entry.first))
        nodes.push_back(entry.first);
    for (const auto& entry : load.displacement)
      nodes.push_back(entry.first);
    nodes.insert(nodes.end(), touched.begin(), touched.end());
    std::ranges::sort(nodes);
    nodes.erase(std::ranges::unique(nodes).begin(), nodes.end());
    if (nodes.size() > max_nodes)
      throw Error(std::to_string(nodes.size()) +
                  " nodes are displaced or touched, expected at most " + std::to_string(max_nodes) +
                  " with rotation=warp");
    for (const std::uint32_t node : nodes)
      places.push_back(place_of(node));
    if (compliance.fit(nodes)) {
      std::vector<std::uint32_t> fresh;
      for (std::size_t k = 0; k < nodes.size(); ++k)
        if (!std::ranges::binary_search(columns.nodes(), places[k]))
          fresh.push_back(nodes[k]);
      compliance.need(fresh);
    }
    columns.set(places,
                [&](std::uint32_t place, std::span<double> of_node) { column_of(place, of_node); });
  }

  Acting acting_on_columns(const contact::Load& load, const contact::Load& part) const {
    Acting acting{std::vector<double>(columns.count()), std::vector<double>(columns.count()),
                  std::vector<std::uint8_t>(columns.nodes().size())};
    for (std::size_t n = 0; n < columns.nodes().size(); ++n) {
      const std::uint32_t node = warp.surface().nodes()[columns.nodes()[n]];
      const auto force = load.force.find(node);
      const auto place = load.displacement.find(node);
      acting.held[n] = place != load.displacement.end() ? 1 : 0;
      for (int a = 0; a < 3; ++a) {
        const std::size_t c = 3 * n + static_cast<std::size_t>(a);
        if (acting.held[n] != 0)
          acting.targets[c] = place->second[a];
        else if (force != load.force.end() && !part.force.contains(node))
          acting.forces[c] = force->second[a];
      }
    }
    return acting;
  }

  WarpLoad as_load(const Acting& acting) const {
    return {.columns = columns,
            .forces = acting.forces,
            .held = acting.held,
            .targets = acting.targets,
            .whole = whole ? &*whole : nullptr};
  }

  // ---- answers

  void take_whole(const contact::Load& part) {
    if (part.gravity == Vec3{} && part.force.empty()) {
      whole.reset();
    } else if (!whole || !same(part, whole_of)) {
      whole = warp.whole_load(compliance::forces_over_axes(model, part));
      whole_of = part;
    }
  }

  void update(const contact::Load& load, std::span<const std::uint32_t> touched) {
    const bool known = answer && answer->load == load;
    ++counts.updates;
    counts.unchanged += known ? 1 : 0;
    if (known && touched.empty())
      return;
    const contact::Load part = whole_part(load, touched);
    take_columns(load, part, touched);
    if (known)
      return;
    take_whole(part);
    auto next = std::make_shared<WarpedAnswer>();
    if (answer)
      next->state = answer->state;
    if (!answer || !same(answer->whole, part))
      next->state.whole_forces.clear(); // of another load
    warp.answer(as_load(acting_on_columns(load, part)), next->state, usual);
    double sum = 0;
    for (const double x : next->state.u)
      sum += std::abs(x);
    if (!std::isfinite(sum) || !(next->state.change <= too_far))
      throw Error(
          "rotation=warp finds no shape, for strains are too large, expected a smaller load");
    counts.rounds += static_cast<std::uint64_t>(next->state.rounds);
    counts.change = std::max(counts.change, next->state.change);
    next->load = load;
    next->whole = part;
    set(std::move(next));
  }

  void set(std::shared_ptr<const WarpedAnswer> next) {
    answer = std::move(next);
    surface.clear();
    all.clear();
    local.clear();
  }

  /// Displaced nodes stand where they must, and fixed ones.
  void place_exactly(std::vector<double>& u) const {
    for (const auto& [node, d] : answer->load.displacement)
      for (int a = 0; a < 3; ++a)
        u[axis_of(node, a)] = d[a];
    for (std::size_t k = 0; k < u.size(); ++k)
      if (fixed[k] != 0)
        u[k] = 0;
  }

  const std::vector<double>& on_surface() {
    if (!surface.empty())
      return surface;
    ++counts.shapes;
    surface.assign(3 * surface_nodes, 0);
    if (!answer)
      return surface;
    const std::vector<std::uint32_t>& nodes = warp.surface().nodes();
    for (std::size_t k = 0; k < answer->state.u.size(); ++k)
      surface[3 * std::size_t{nodes[k / 3]} + k % 3] = answer->state.u[k];
    place_exactly(surface);
    return surface;
  }

  const std::vector<double>& everywhere_local() {
    if (!local.empty())
      return local;
    if (!answer) {
      local.assign(3 * model.nodes.size(), 0);
      return local;
    }
    take_whole(answer->whole);
    local =
        warp.whole_local({.columns = columns, .whole = whole ? &*whole : nullptr}, answer->state);
    return local;
  }

  const std::vector<double>& everywhere() {
    if (!all.empty())
      return all;
    const std::vector<double>& strained = everywhere_local();
    if (!answer) {
      all = strained;
      return all;
    }
    std::vector<double> shape = warp.whole_shape(answer->state, strained);
    place_exactly(shape);
    all = std::move(shape);
    return all;
  }
};

WarpedStatics::WarpedStatics(const model::Model& model,
                             std::shared_ptr<compliance::ComplianceSource> source,
                             const Context& context)
    : state_(std::make_unique<State>(model, std::move(source), context)) {}
WarpedStatics::~WarpedStatics() = default;
WarpedStatics::WarpedStatics(WarpedStatics&&) noexcept = default;

void WarpedStatics::update(const contact::Load& load, std::span<const std::uint32_t> touched) {
  state_->update(load, touched);
}

std::shared_ptr<const WarpedAnswer> WarpedStatics::answer() const noexcept {
  return state_->answer;
}

void WarpedStatics::restore(std::shared_ptr<const WarpedAnswer> answer) {
  if (answer != state_->answer)
    state_->set(std::move(answer));
}

std::span<const double> WarpedStatics::surface_displacement() {
  return state_->on_surface();
}

std::span<const double> WarpedStatics::displacement() {
  return state_->everywhere();
}

std::span<const double> WarpedStatics::local_displacement() {
  return state_->everywhere_local();
}

std::vector<contact::NodeVector> WarpedStatics::holding_forces() const {
  std::vector<contact::NodeVector> forces;
  if (!state_->answer)
    return forces;
  const WarpState& state = state_->answer->state;
  const std::vector<std::uint32_t>& nodes = state_->warp.surface().nodes();
  for (const auto& entry : state_->answer->load.displacement) {
    const std::uint32_t node = entry.first;
    const auto at = std::ranges::find(state.nodes, state_->warp.surface().place()[node]);
    const auto n = static_cast<std::size_t>(at - state.nodes.begin());
    contact::NodeVector force{nodes[*at], {}};
    for (int a = 0; a < 3; ++a)
      if (!contact::is_fixed(state_->model, node, a))
        force.value[a] = state.holding[3 * n + static_cast<std::size_t>(a)];
    forces.push_back(force);
  }
  return forces;
}

std::vector<double> WarpedStatics::compliance_at(std::span<const std::uint32_t> nodes) {
  State& s = *state_;
  std::vector<std::size_t> places;
  for (const std::uint32_t node : nodes)
    places.push_back(static_cast<std::size_t>(
        std::ranges::lower_bound(s.columns.nodes(), s.place_of(node)) - s.columns.nodes().begin()));
  const State::Acting acting = s.acting_on_columns(s.answer->load, s.answer->whole);
  return s.warp.compliance_at(s.as_load(acting), s.answer->state, places);
}

WarpedCounts WarpedStatics::counts() const noexcept {
  WarpedCounts counts = state_->counts;
  counts.solves = state_->compliance.solves();
  counts.factors = state_->compliance.factors();
  counts.columns_read = state_->compliance.cache().columns_read();
  return counts;
}

} // namespace gewebe::statics
