#include "tools/run/instrument_check.h"

#include "contact/instrument.h"
#include "tetrahedra/tet_mesh.h"
#include "text/number_text.h"
#include "text/rounded_text.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace gewebe::cli {
namespace {

constexpr double edges_in_radius = 2;

/// The surface of a solid near an instrument.
struct Below {
  std::size_t object = 0;
  double distance = HUGE_VAL; ///< of the nearest node
  Vec3 at_rest;               ///< that node
  std::vector<double> edges;  ///< between corners of elements
};

Below look_below(const scene::Simulation& simulation, std::size_t number,
                 const contact::PlacedInstrument& placed) {
  Below below{number, HUGE_VAL, {}, {}};
  const model::Model& model = simulation.model(number);
  const std::size_t nodes = simulation.node_counts(number).surface;
  const std::span<const double> u = simulation.known_surface(number); // else about where it rests
  std::vector<double> distance(nodes);
  for (std::size_t n = 0; n < nodes; ++n) {
    Vec3 place = model.nodes[n].position;
    if (3 * n + 2 < u.size())
      place += {u[3 * n], u[3 * n + 1], u[3 * n + 2]};
    distance[n] = placed.distance(place);
    if (distance[n] < below.distance) {
      below.distance = distance[n];
      below.at_rest = model.nodes[n].position;
    }
  }
  const double reach = below.distance + 2 * placed.radius;
  for (const Tetrahedron& t : model.tetrahedra)
    for (const auto& [i, j] : tetrahedra::tetrahedron_edges)
      if (t[i] < nodes && t[j] < nodes && (distance[t[i]] <= reach || distance[t[j]] <= reach))
        below.edges.push_back(norm(model.nodes[t[i]].position - model.nodes[t[j]].position));
  return below;
}

std::optional<Below> nearest(const scene::Simulation& simulation,
                             const contact::PlacedInstrument& placed) {
  std::optional<Below> result;
  for (std::size_t n = 0; n < simulation.object_count(); ++n) {
    if (!simulation.object(n).known || simulation.model(n).tetrahedra.empty())
      continue;
    Below below = look_below(simulation, n, placed);
    if (!result || below.distance < result->distance)
      result = std::move(below);
  }
  return result;
}

/// A tenth of the radius is near enough.
std::string place_text(const Vec3& place, double radius) {
  const double unit = std::ldexp(1, std::ilogb(radius / 10));
  const auto text = [&](double x) {
    const double rounded = std::round(x / unit) * unit;
    return text::number_text(rounded == 0 ? 0 : rounded);
  };
  return text(place.x) + "," + text(place.y) + "," + text(place.z);
}

} // namespace

void InstrumentCheck::look(const scene::Simulation& simulation,
                           const std::function<void(const std::string&)>& warn) {
  done_.resize(simulation.instrument_count());
  for (std::size_t n = 0; n < done_.size(); ++n) {
    if (done_[n] || !warn)
      continue;
    const scene::InstrumentReport report = simulation.instrument(n);
    if (!report.present || report.nodes == 0)
      continue;
    const contact::InstrumentKind kind = contact::kind_of(report.shape);
    done_[n] = true;
    if (kind != contact::InstrumentKind::sphere && kind != contact::InstrumentKind::capsule)
      continue; // a blade cuts, and the radius of a mesh rounds it alone
    const contact::PlacedInstrument placed(report.shape, report.pose);
    std::optional<Below> below = nearest(simulation, placed);
    if (!below || below->edges.empty())
      continue;
    const auto middle = below->edges.begin() + static_cast<std::ptrdiff_t>(below->edges.size() / 2);
    std::ranges::nth_element(below->edges, middle);
    const double radius = report.shape.radius;
    // What it touches may be a net, and the solid far away.
    if (!(below->distance <= *middle) || !(radius < edges_in_radius * *middle))
      continue;
    warn(
        "instrument " + report.name + " at " + text::number_text(simulation.time()) +
        " s: its radius of " + text::rounded_text(radius) + " mm is below twice the edges of " +
        text::rounded_text(*middle) + " mm of object " + simulation.object(below->object).name +
        " under it, so that its force may be off by tens of percent, expected smaller cells there: "
        "exp2ela --solid --refine sphere:" +
        place_text(below->at_rest, radius) + "," + text::rounded_text(2 * radius) + ":" +
        text::rounded_text(radius / edges_in_radius));
  }
}

} // namespace gewebe::cli
