#include "statics/static_contact.h"

#include "base/vector_at.h"
#include "contact/contact_solver.h"

#include <Eigen/Core>
#include <Eigen/QR>

#include <algorithm>
#include <cmath>
#include <map>

// Based on: B. Marks, G. Wright, A general inner approximation algorithm for nonconvex mathematical
// programs, 1978; D. Anderson, Iterative procedures for nonlinear integral equations, 1965.

namespace gewebe {

namespace {

constexpr double same_direction = 1e-9;
constexpr double nearly = 0.03; ///< from where on convergence is sped up
constexpr int max_turns = 300;
constexpr double fair_direction = 1e-6; ///< that is not worth a warning
constexpr std::size_t max_new = 256;    ///< nodes that join at once, the deepest
constexpr double outside = 1e-9;        ///< of the radius: so deep is not inside
constexpr double immovable = 1e-12;     ///< of the largest compliance
constexpr double deep = 1e-6;
constexpr int max_rounds = 300; ///< until an object agrees

/// Speeds up the convergence of directions: the next ones are taken where a linear map with the
/// last changes would not change them. Any directions are fit for a turn.
class Anderson {
public:
  /// \param used what led to `found`, which become what to use next
  void next(const std::vector<Vec3>& used, std::vector<Vec3>& found) {
    const auto size = static_cast<Eigen::Index>(3 * used.size());
    Eigen::VectorXd change(size), to(size);
    for (std::size_t i = 0; i < used.size(); ++i)
      for (int a = 0; a < 3; ++a) {
        const Eigen::Index row = static_cast<Eigen::Index>(3 * i) + a;
        to[row] = found[i][a];
        change[row] = found[i][a] - used[i][a];
      }
    if (last_.size() > 0 && change.norm() > last_.norm())
      *this = {}; // it led away
    if (last_.size() > 0) {
      if (changes_.size() == memory) {
        changes_.erase(changes_.begin());
        tos_.erase(tos_.begin());
      }
      changes_.emplace_back(change - last_);
      tos_.emplace_back(to - last_to_);
      Eigen::MatrixXd all(size, static_cast<Eigen::Index>(changes_.size()));
      for (std::size_t k = 0; k < changes_.size(); ++k)
        all.col(static_cast<Eigen::Index>(k)) = changes_[k];
      const Eigen::VectorXd part = all.colPivHouseholderQr().solve(change);
      if (part.allFinite())
        for (std::size_t k = 0; k < changes_.size(); ++k)
          for (std::size_t i = 0; i < found.size(); ++i)
            for (int a = 0; a < 3; ++a)
              found[i][a] -= part[static_cast<Eigen::Index>(k)] *
                             tos_[k][static_cast<Eigen::Index>(3 * i) + a];
    }
    last_ = change;
    last_to_ = to;
    for (Vec3& n : found)
      n = n / norm(n);
  }

private:
  static constexpr std::size_t memory = 8;
  std::vector<Eigen::VectorXd> changes_, tos_;
  Eigen::VectorXd last_, last_to_;
};

/// n·(W n) of one node.
double normal_compliance(const DelassusOperator& delassus, std::size_t k, const Vec3& n) {
  const std::size_t rows = 3 * delassus.nodes.size();
  double sum = 0;
  for (std::size_t a = 0; a < 3; ++a)
    for (std::size_t b = 0; b < 3; ++b)
      sum += n[static_cast<int>(a)] * delassus.compliance[(3 * k + b) * rows + 3 * k + a] *
             n[static_cast<int>(b)];
  return sum;
}

} // namespace

std::vector<NodeTouch> sums_of_touches(std::vector<NodeTouch> touches) {
  std::stable_sort(touches.begin(), touches.end(), [](const NodeTouch& a, const NodeTouch& b) {
    return a.node != b.node ? a.node < b.node : a.instrument < b.instrument;
  });
  std::size_t count = 0;
  for (const NodeTouch& t : touches)
    if (count > 0 && touches[count - 1].node == t.node &&
        touches[count - 1].instrument == t.instrument)
      touches[count - 1].force += t.force;
    else
      touches[count++] = t;
  touches.resize(count);
  return touches;
}

std::size_t parts_of_way(std::span<const MovedInstrument> instruments, std::size_t max) {
  double parts = 1;
  for (const MovedInstrument& i : instruments)
    parts = std::max(parts, std::ceil(2 * path_length(i.shape, i.before, i.now) / i.shape.radius));
  return parts < static_cast<double>(max) ? static_cast<std::size_t>(parts) : max;
}

StaticContact::StaticContact(const Model& model, std::span<const double> shape,
                             std::vector<NodeTouch> touches)
    : model_(model), blocks_(model), inward_(inward_directions(model)),
      touches_(std::move(touches)) {
  blocks_.set_shape(model, shape);
}

/// Nodes deeper in an instrument than `depth` of its radius join `inside`, which stays ascending;
/// of new ones the deepest if they are many.
void StaticContact::find(const Placed& placed, const std::map<std::uint32_t, Vec3>& displaced,
                         std::span<const double> shape, double depth,
                         std::vector<std::uint32_t>& inside) {
  std::vector<std::pair<double, std::uint32_t>> found;
  for (std::uint32_t k = 0; k < placed.size(); ++k) {
    if (!placed[k])
      continue;
    const PlacedInstrument& instrument = *placed[k];
    blocks_.visit_near(instrument.box(), [&](std::uint32_t node) {
      const double d = instrument.distance(rest(node) + vector_at(shape, node));
      if (!(d < -depth * instrument.radius))
        return;
      if (model_.nodes[node].fixed == fixed_all || displaced.contains(node)) {
        if (!stuck_ && d < -deep * instrument.radius && !displaced.contains(node))
          stuck_ = NodeTouch{node, k, {}};
        return;
      }
      if (!std::binary_search(inside.begin(), inside.end(), node))
        found.emplace_back(d / instrument.radius, node);
    });
  }
  std::sort(found.begin(), found.end());
  for (std::size_t k = 0, count = 0; k < found.size() && count < max_new; ++k) {
    const auto where = std::lower_bound(inside.begin(), inside.end(), found[k].second);
    if (where == inside.end() || *where != found[k].second) {
      inside.insert(where, found[k].second);
      ++count;
    }
  }
}

/// A node between two instruments that overlap leaves them across the line between them: no point
/// is beyond both planes.
void StaticContact::part_pinched(const Placed& placed, std::vector<Pair>& pairs,
                                 std::span<const std::uint32_t> nodes) const {
  for (std::size_t i = 0; i < pairs.size(); ++i)
    for (std::size_t j = i + 1; j < pairs.size() && pairs[j].place == pairs[i].place; ++j) {
      Vec3 &a = pairs[i].normal, &b = pairs[j].normal;
      if (dot(a, b) > -0.9 ||
          placed[pairs[i].instrument]->support(a) <= -placed[pairs[j].instrument]->support(b))
        continue;
      const Vec3 along = (a - b) / norm(a - b), wish = inward_[nodes[pairs[i].place]];
      Vec3 out = wish - dot(wish, along) * along;
      if (!(norm(out) > 1e-6 * norm(wish)))
        out = std::abs(along.x) < 0.6 ? cross(along, {1, 0, 0}) : cross(along, {0, 1, 0});
      a = b = out / norm(out);
    }
}

/// The turns: forces of the pairs and where the nodes then stand.
void StaticContact::solve(const DelassusOperator& delassus, const Placed& placed,
                          std::span<const std::optional<MovedInstrument>> moved,
                          std::vector<Pair>& pairs, std::span<const double> before,
                          std::vector<Vec3>& at) {
  const std::size_t m = delassus.nodes.size();
  std::vector<Vec3> free(m), was(m);
  double largest = 0;
  for (std::size_t k = 0; k < m; ++k) {
    free[k] = rest(delassus.nodes[k]) + vector_at(delassus.free, k);
    was[k] = rest(delassus.nodes[k]) + vector_at(before, delassus.nodes[k]);
    for (std::size_t a = 0; a < 3; ++a)
      largest = std::max(largest, delassus.compliance[(3 * k + a) * 3 * m + 3 * k + a]);
  }
  const auto ascending = [](const Pair& a, const Pair& b) {
    return a.place != b.place ? a.place < b.place : a.instrument < b.instrument;
  };
  // Pairs of every node with whatever it is inside of.
  const auto join = [&](std::span<const Vec3> where, double depth) {
    bool joined = false;
    for (std::uint32_t place = 0; place < m; ++place)
      for (std::uint32_t k = 0; k < placed.size(); ++k) {
        if (!placed[k] || placed[k]->distance(where[place]) > -depth * placed[k]->radius)
          continue;
        Pair pair{place, k, {}, {}};
        const auto there = std::lower_bound(pairs.begin(), pairs.end(), pair, ascending);
        if (there != pairs.end() && !ascending(pair, *there))
          continue;
        pair.normal = placed[k]->normal(was[place], inward_[delassus.nodes[place]]);
        if (!(normal_compliance(delassus, place, pair.normal) > immovable * largest)) {
          stuck_ = NodeTouch{delassus.nodes[place], k, {}};
          continue;
        }
        pairs.insert(there, pair);
        joined = true;
      }
    return joined;
  };
  for (Pair& pair : pairs)
    pair.normal =
        placed[pair.instrument]->normal(was[pair.place], inward_[delassus.nodes[pair.place]]);
  std::sort(pairs.begin(), pairs.end(), ascending);
  join(was, 0);
  join(free, outside);
  part_pinched(placed, pairs, delassus.nodes);
  at = free;
  solved_ = pairs.empty();
  Anderson faster;
  for (int turn = 0; turn < max_turns && !pairs.empty(); ++turn) {
    std::vector<Contact> contacts;
    std::vector<Vec3> guess;
    for (const Pair& pair : pairs) {
      const PlacedInstrument& instrument = *placed[pair.instrument];
      const MovedInstrument& way = *moved[pair.instrument];
      contacts.push_back({pair.place, pair.normal,
                          dot(pair.normal, free[pair.place]) - instrument.support(pair.normal),
                          free[pair.place] - carried(way.before, way.now, was[pair.place]),
                          instrument.friction});
      guess.push_back(pair.force);
    }
    const ContactForces forces = solve_contacts(delassus.compliance, m, contacts, guess);
    at = free;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      pairs[i].force = forces.force[i];
      if (pairs[i].force == Vec3{})
        continue;
      for (std::size_t k = 0; k < m; ++k)
        for (std::size_t b = 0; b < 3; ++b) {
          const double* const column =
              &delassus.compliance[(3 * std::size_t{pairs[i].place} + b) * 3 * m + 3 * k];
          at[k] += pairs[i].force[static_cast<int>(b)] * Vec3{column[0], column[1], column[2]};
        }
    }
    double normal_change = 0;
    std::vector<Vec3> used, normals;
    for (Pair& pair : pairs) {
      used.push_back(pair.normal);
      normals.push_back(
          placed[pair.instrument]->normal(at[pair.place], inward_[delassus.nodes[pair.place]]));
      if (pair.force == Vec3{})
        used.back() = normals.back(); // no matter
      normal_change = std::max(normal_change, norm(normals.back() - used.back()));
    }
    if (normal_change < nearly)
      faster.next(used, normals);
    for (std::size_t i = 0; i < pairs.size(); ++i)
      pairs[i].normal = normals[i];
    const bool joined = join(at, outside);
    if (joined)
      faster = {};
    solved_ = forces.solved && normal_change <= fair_direction;
    if (!joined && normal_change <= same_direction)
      break;
  }
  // Rounding alone may have left a node inside.
  for (const Pair& pair : pairs)
    if (const double d = placed[pair.instrument]->distance(at[pair.place]); d < 0)
      at[pair.place] -= d * placed[pair.instrument]->normal(at[pair.place]);
}

void StaticContact::restart(std::span<const double> shape, std::vector<NodeTouch> touches) {
  touches_ = std::move(touches);
  blocks_.set_shape(model_, shape);
}

/// Forces at these nodes, and where they then stand. \return whether the object agrees
bool StaticContact::solve_all(Yielding& object, std::span<const std::uint32_t> nodes,
                              const Placed& placed,
                              std::span<const std::optional<MovedInstrument>> moved,
                              std::span<const double> before, std::vector<Vec3>& at) {
  for (int round = 0; round < max_rounds; ++round) {
    std::vector<Pair> pairs;
    if (!nodes.empty()) {
      const DelassusOperator delassus = object.delassus_operator(nodes);
      for (const NodeTouch& t : touches_) {
        const auto place = std::lower_bound(nodes.begin(), nodes.end(), t.node) - nodes.begin();
        pairs.push_back({static_cast<std::uint32_t>(place), t.instrument, {}, t.force});
      }
      solve(delassus, placed, moved, pairs, before, at);
    }
    touches_.clear();
    for (const Pair& pair : pairs)
      if (pair.force != Vec3{})
        touches_.push_back({nodes[pair.place], pair.instrument, pair.force});
    if (object.push(touches_, at))
      return true;
  }
  return false;
}

void StaticContact::update(Yielding& object, const std::map<std::uint32_t, Vec3>& displaced,
                           std::span<const std::optional<MovedInstrument>> instruments,
                           std::vector<double>& shape, bool last) {
  Placed placed;
  for (const auto& i : instruments)
    placed.push_back(i ? std::optional(PlacedInstrument(i->shape, i->now)) : std::nullopt);
  std::erase_if(touches_, [&](const NodeTouch& t) {
    return t.instrument >= placed.size() || !placed[t.instrument] || displaced.contains(t.node);
  });
  std::vector<std::uint32_t> nodes;
  for (const NodeTouch& t : touches_)
    if (nodes.empty() || nodes.back() != t.node)
      nodes.push_back(t.node);
  stuck_.reset();
  find(placed, displaced, shape, 0, nodes);
  if (nodes.empty() && !last)
    return;
  const std::vector<double> before = shape;
  solved_ = true;
  for (;;) {
    std::vector<Vec3> at;
    const bool agreed = solve_all(object, nodes, placed, instruments, before, at);
    solved_ = solved_ && agreed;
    const std::span<const double> u = object.shape();
    shape.assign(u.begin(), u.end());
    // As the contacts have it, whatever is left out of the rest of the shape.
    for (std::size_t k = 0; k < nodes.size(); ++k)
      for (int a = 0; a < 3; ++a)
        shape[axis_of(nodes[k], a)] = (at[k] - rest(nodes[k]))[a];
    blocks_.set_shape(model_, shape);
    const std::size_t known = nodes.size();
    find(placed, displaced, shape, outside, nodes);
    if (nodes.size() == known)
      return;
  }
}

namespace {

/// One solution for any forces.
class ElastostaticYielding final : public Yielding {
public:
  ElastostaticYielding(const std::function<Elastostatic&()>& solver, const Load& load)
      : solver_(solver), load_(load) {}
  DelassusOperator delassus_operator(std::span<const std::uint32_t> nodes) override {
    return solver_().delassus_operator(load_, nodes);
  }
  bool push(std::span<const NodeTouch> touches, std::span<const Vec3>) override {
    pushed_ = load_;
    for (const NodeTouch& t : touches)
      pushed_.force[t.node] += t.force;
    return true;
  }
  std::span<const double> shape() override {
    solver_().update(pushed_);
    return solver_().surface_displacement();
  }

private:
  const std::function<Elastostatic&()>& solver_;
  const Load& load_;
  Load pushed_;
};

} // namespace

void StaticContact::update(const std::function<Elastostatic&()>& solver, const Load& load,
                           std::span<const std::optional<MovedInstrument>> instruments,
                           std::vector<double>& shape, bool last) {
  ElastostaticYielding object(solver, load);
  update(object, load.displacement, instruments, shape, last);
}

} // namespace gewebe
