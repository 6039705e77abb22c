#include "contact/island.h"

#include "collision/bvh.h"
#include "collision/candidates.h"
#include "contact/barrier.h"
#include "contact/contact_pairs.h"
#include "contact/convex_core.h"
#include "contact/fit_radii.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace gewebe::contact {

namespace {

constexpr int max_halvings = 8;
/// Steps that needed no more parts than the last one, behind which half as many are tried.
constexpr int steps_in_parts = 4;

/// Part of d_hat by which d_min of a radius is less than it, so that a typical force acts where the
/// surfaces just touch.
constexpr double radius_offset = 0.6;

constexpr double typical_strain = 1e-2;

/// Part of the energies by which rounding may let them grow.
constexpr double rounding = 1e-12;

std::vector<Vec3> positions_of(const BodyTable& table) {
  std::vector<Vec3> x(table.vertex_count());
  for (std::size_t b = 0; b < table.bodies.size(); ++b)
    table.bodies[b]->positions(
        std::span(x).subspan(table.first[b], table.first[b + 1] - table.first[b]));
  return x;
}

double median_edge(const collision::CollisionSurface& surface) {
  std::vector<double> lengths;
  for (const auto& [a, b] : surface.edges)
    if (surface.radius[a] == 0)
      lengths.push_back(norm(surface.rest[a] - surface.rest[b]));
  if (lengths.empty())
    return 0;
  const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
  std::ranges::nth_element(lengths, middle);
  return *middle;
}

/// Whether the segment pq passes the inside of a triangle; touching is no passing.
bool passes(const Vec3& p, const Vec3& q, const Vec3& a, const Vec3& b, const Vec3& c) {
  const auto volume = [](const Vec3& u, const Vec3& v, const Vec3& s, const Vec3& t) {
    return dot(cross(v - u, s - u), t - u);
  };
  const double up = volume(a, b, c, p), uq = volume(a, b, c, q);
  if (!(up * uq < 0))
    return false;
  const double ab = volume(p, q, a, b), bc = volume(p, q, b, c), ca = volume(p, q, c, a);
  return (ab > 0 && bc > 0 && ca > 0) || (ab < 0 && bc < 0 && ca < 0);
}

} // namespace

ModelSurface model_surface(const model::Model& model) {
  ModelSurface all;
  std::vector<std::uint32_t> vertex(model.nodes.size(), UINT32_MAX);
  for (const Triangle& t : model.triangles)
    for (const std::uint32_t corner : t)
      vertex[corner] = 0;
  for (std::uint32_t node = 0; node < vertex.size(); ++node) {
    if (vertex[node] == UINT32_MAX)
      continue;
    vertex[node] = static_cast<std::uint32_t>(all.node.size());
    all.node.push_back(node);
    all.surface.rest.push_back(model.nodes[node].position);
    all.surface.fixed.push_back(model.nodes[node].fixed == model::fixed_all ? 1 : 0);
  }
  for (const Triangle& t : model.triangles)
    all.surface.triangles.push_back({vertex[t[0]], vertex[t[1]], vertex[t[2]]});
  all.typical = typical_contact(model);
  return all;
}

TypicalContact typical_contact(const model::Model& model) {
  double edges = 0;
  std::size_t count = 0;
  for (const Triangle& t : model.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      edges += norm(model.nodes[t[k]].position - model.nodes[t[(k + 1) % 3]].position);
      ++count;
    }
  if (count == 0)
    return {};
  const double edge = edges / static_cast<double>(count);
  double stiffness = HUGE_VAL; // of a piece of the size of an edge
  if (!model.tetrahedra.empty())
    for (const model::Material& m : model.materials)
      stiffness = m.young > 0 ? std::min(stiffness, m.young * edge) : stiffness;
  for (const model::Spring& spring : model.springs)
    stiffness = spring.stiffness > 0 ? std::min(stiffness, spring.stiffness) : stiffness;
  if (!std::isfinite(stiffness))
    return {};
  return {stiffness, typical_strain * stiffness * edge};
}

BodySurface instrument_surface(const InstrumentShape& shape) {
  BodySurface surface;
  surface.radius = shape.radius;
  if (shape.core) {
    surface.rest.assign(shape.core->corners().begin(), shape.core->corners().end());
    for (const ConvexCore::Face& face : shape.core->faces())
      for (std::size_t k = 2; k < face.corners.size(); ++k)
        surface.triangles.push_back({face.corners[0], face.corners[k - 1], face.corners[k]});
  } else if (shape.axis == Vec3{}) {
    surface.rest = {Vec3{}};
    surface.points = {0};
  } else {
    surface.rest = {Vec3{}, shape.axis};
    surface.edges = {{0, 1}};
  }
  return surface;
}

IslandMotion::IslandMotion(std::span<const BodySurface* const> surfaces,
                           const collision::OwnerTable<double>& friction,
                           const Parameters& parameters, double edge)
    : parameters_(parameters), island_(std::make_unique<Island>()) {
  Island& island = *island_;
  collision::CollisionSurface& all = island.surface;
  double smallest_radius = std::numeric_limits<double>::infinity();
  std::uint32_t pieces = 0;
  for (const BodySurface* const one : surfaces) {
    const BodySurface& own = *one;
    const auto first = static_cast<std::uint32_t>(all.rest.size());
    island.table.first.push_back(first);
    all.rest.insert(all.rest.end(), own.rest.begin(), own.rest.end());
    for (std::array<std::uint32_t, 3> t : own.triangles) {
      for (std::uint32_t& v : t)
        v += first;
      all.triangles.push_back(t);
    }
    for (const auto& [a, b] : own.edges)
      all.edges.push_back({a + first, b + first});
    for (const std::uint32_t p : own.points)
      all.points.push_back(p + first);
    for (std::size_t v = 0; v < own.rest.size(); ++v)
      all.owner.push_back(pieces + (own.piece.empty() ? 0 : own.piece[v]));
    pieces += own.pieces;
    all.radius.resize(all.rest.size(), own.radius);
    all.fixed.insert(all.fixed.end(), own.fixed.begin(), own.fixed.end());
    all.fixed.resize(all.rest.size(), 0);
    all.holder.insert(all.holder.end(), own.holder.begin(), own.holder.end());
    all.holder.resize(all.rest.size(), collision::no_owner);
    if (own.radius > 0)
      smallest_radius = std::min(smallest_radius, own.radius);
  }
  island.table.first.push_back(static_cast<std::uint32_t>(all.rest.size()));
  island.allowed = collision::AllowedPairs(pieces, 0);
  island.friction = collision::OwnerTable<double>(pieces, 0);
  for (std::size_t m = 0; m < pieces; ++m)
    for (std::size_t n = 0; n <= m; ++n)
      if (friction.at(m, n) >= 0) {
        island.allowed.set(m, n, 1);
        island.friction.set(m, n, friction.at(m, n));
      }
  collision::complete_surface(all);
  island.edge = edge > 0 ? edge : median_edge(all);
  if (!(island.edge > 0))
    island.edge = std::isfinite(smallest_radius) ? smallest_radius : 1;
  island.activation_distance =
      std::min(parameters_.lengths.activation_distance * island.edge,
               parameters_.lengths.activation_over_radius * smallest_radius);
  for (double& radius : all.radius)
    if (radius > 0)
      radius -= radius_offset * island.activation_distance;
  solver_ = std::make_unique<StepSolver>(island);
  radii_ = std::make_unique<RadiusFit>(island);
}

IslandMotion::~IslandMotion() = default;

double IslandMotion::activation_distance() const noexcept {
  return island_->activation_distance;
}

StepReport IslandMotion::take_report() {
  return std::exchange(report_, {});
}

/// Begins a step of all members. \return positions of all vertices
std::vector<Vec3> IslandMotion::begin(Members members, const Interval& step,
                                      const Context& context) {
  BodyTable& table = island_->table;
  table.bodies.clear();
  for (IslandMember* const member : members)
    table.bodies.push_back(&member->begin(step, context));
  return positions_of(table);
}

/// Ends the step that has been solved.
void IslandMotion::end(Members members, const Interval& step, const Context& context) {
  const BodyTable& table = island_->table;
  std::vector<std::vector<IslandMember::Force>> forces(members.size());
  std::size_t body = 0;
  for (const ContactForce& f : solver_->forces()) { // by ascending vertex
    while (f.vertex >= table.first[body + 1])
      ++body;
    forces[body].push_back({f.vertex - table.first[body], f.from, f.normal + f.friction});
  }
  for (std::size_t m = 0; m < members.size(); ++m)
    members[m]->end(forces[m], step, context);
}

IslandMotion::Solved IslandMotion::step(Members members, const Interval& step,
                                        const Context& context) {
  Solved solved;
  solved.from = begin(members, step, context);
  radii_->fit(solved.from);
  report_.add(solver_->solve({step.to - step.from, parameters_, {}}, context));
  if (step.stage == numeric::Stage::first) {
    solved.to = positions_of(island_->table);
    solved.forces = solver_->forces();
  }
  end(members, step, context);
  return solved;
}

Stages stages_of(const Interval& step) {
  const double middle = step.from + numeric::stage_length * (step.to - step.from);
  return {{step.from, middle, numeric::Stage::first}, {middle, step.to, numeric::Stage::second}};
}

/// Looks whether the energy of an island has grown beyond what loads and obstacles have done, in a
/// second stage that is solved. Where it has, inner speeds will be lowered, so that momenta stay.
/// \param start  positions that the second stage counts from
/// \return false: lower speeds don't suffice
bool IslandMotion::watch_energy(const Solved& first, std::span<const Vec3> start) {
  const BodyTable& table = island_->table;
  EnergyGain all;
  std::vector<std::uint8_t> gains;
  for (ContactBody* const body : table.bodies) {
    const std::optional<EnergyGain> gain = body->energy_gain();
    gains.push_back(gain ? 1 : 0);
    if (!gain)
      continue;
    all.gain += gain->gain;
    all.inner += gain->inner;
    all.scale += gain->scale;
  }
  const std::vector<Vec3> to = positions_of(table);
  double stored = 0; // by barriers, at most
  const auto take = [&](std::span<const ContactForce> forces, const auto& way) {
    std::size_t body = 0;
    for (const ContactForce& f : forces) {
      while (f.vertex >= table.first[body + 1])
        ++body;
      const Vec3 force = f.normal + f.friction;
      stored += norm(f.normal) * island_->activation_distance;
      if (gains[body] == 0) // what it does to others
        all.gain += dot(force, way(f.vertex));
    }
  };
  take(first.forces,
       [&](std::uint32_t v) { return numeric::stage_extension * (first.to[v] - first.from[v]); });
  take(solver_->forces(), [&](std::uint32_t v) { return to[v] - start[v]; });
  if (all.gain <= rounding * all.scale)
    return true;
  if (!(all.gain - all.inner <= stored))
    return false;
  const double factor = all.inner > all.gain ? std::sqrt(1 - all.gain / all.inner) : 0;
  for (ContactBody* const body : table.bodies)
    body->slow_down(factor);
  return true;
}

/// \return false: energy would grow, nothing is ended
bool IslandMotion::second_stage(Members members, const Solved& first, const Interval& step,
                                const Context& context) {
  (void)begin(members, step, context);
  std::vector<Vec3> start = first.from;
  for (std::size_t v = 0; v < start.size(); ++v)
    start[v] += numeric::stage_extension * (first.to[v] - start[v]);
  const double h = (step.to - step.from) / numeric::stage_extension;
  report_.add(solver_->solve({h, parameters_, start}, context));
  if (!watch_energy(first, start))
    return false;
  end(members, step, context);
  return true;
}

/// A step from one time to the other, of the present order. Of second order, a first stage whose
/// second one is not solved stays as a step of first order; where the energy would grow, the rest
/// is one, too. \param parts  a rest that is not solved is left
/// \return time that has been reached \throw NotSolved where nothing is taken
double IslandMotion::take(Members members, double from, double to, bool parts,
                          const Context& context) {
  if (order_ == 1 || !(to > from)) {
    (void)step(members, {from, to}, context);
    return to;
  }
  const auto [first, second] = stages_of({from, to});
  const Solved solved = step(members, first, context);
  try {
    if (std::ranges::all_of(members, [](const auto* m) { return m->has_first_stage(); }) &&
        second_stage(members, solved, second, context))
      return to;
    ++report_.first_order;
    (void)step(members, {second.from, to}, context);
    return to;
  } catch (const IntersectsAtStart&) {
    throw;
  } catch (const NotSolved&) {
    if (!parts)
      throw;
  }
  return second.from;
}

/// \param untried  halvings made without a try \param halvings  that are left
/// \return how often it had to be halved
int IslandMotion::advance_parts(Members members, double from, double to, int untried, int halvings,
                                const Context& context) {
  const double middle = from + (to - from) / 2;
  const int rest = std::max(untried - 1, 0);
  if (untried == 0 || !(to > from)) {
    const bool parts = halvings > 0 && to > from;
    double taken = from;
    try {
      taken = take(members, from, to, parts, context);
      if (taken == to)
        return 0;
    } catch (const IntersectsAtStart&) {
      throw;
    } catch (const NotSolved&) {
      if (!parts)
        throw;
    }
    ++report_.halvings;
    if (taken > from)
      return 1 + advance_parts(members, taken, to, rest, halvings - 1, context);
  }
  const int first = advance_parts(members, from, middle, rest, halvings - 1, context);
  const int second = advance_parts(members, middle, to, rest, halvings - 1, context);
  return 1 + std::max(first, second);
}

void IslandMotion::advance(Members members, double from, double to, StepParts& parts,
                           const Context& context, int order) {
  order_ = order;
  const std::uint64_t before = report_.iterations;
  const int needed = advance_parts(members, from, to, parts.halvings, max_halvings, context);
  if (report_.iterations == before) // nothing touched
    parts = {};
  else if (needed > parts.halvings)
    parts = {needed, 0};
  else if (parts.halvings > 0 && ++parts.steps == steps_in_parts)
    parts = {parts.halvings - 1, 0};
}

std::optional<Vec3> IslandMotion::find_intersection(std::span<const Vec3> x) const {
  const collision::CollisionSurface& surface = island_->surface;
  std::vector<Box3> boxes;
  for (const auto& t : surface.triangles) {
    Box3& box = boxes.emplace_back();
    for (const std::uint32_t v : t)
      box.add(x[v]);
  }
  const collision::Bvh tree(boxes);
  for (const auto& [a, b] : surface.edges) {
    bool found = false;
    Box3 box;
    box.add(x[a]);
    box.add(x[b]);
    tree.for_each_overlapping(box, [&](std::uint32_t number) {
      const auto& t = surface.triangles[number];
      if (found || island_->allowed.at(surface.owner[a], surface.owner[t[0]]) == 0 ||
          std::ranges::any_of(t, [&](std::uint32_t v) { return v == a || v == b; }))
        return;
      found = passes(x[a], x[b], x[t[0]], x[t[1]], x[t[2]]);
    });
    if (found)
      return (x[a] + x[b]) / 2;
  }
  return std::nullopt;
}

std::optional<Vec3> IslandMotion::find_touching(std::span<const Vec3> x) const {
  collision::Candidates candidates;
  const double reach = island_->activation_distance;
  collision::BroadPhase(island_->surface)
      .find(island_->surface, x, x, reach, island_->allowed, candidates);
  ContactPairs pairs;
  find_active_pairs(island_->surface, candidates, x, reach, pairs);
  if (const SmallestGap least = find_smallest_gap(pairs, x); !(least.gap > 0))
    return least.position;
  return std::nullopt;
}

} // namespace gewebe::contact
