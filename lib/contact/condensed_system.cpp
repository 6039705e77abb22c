#include "contact/condensed_system.h"

#include "base/error.h"
#include "cholesky/block_cholesky.h"

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <list>
#include <map>
#include <utility>

namespace gewebe::contact {

namespace {

using Eigen::Index, Eigen::MatrixXd, Eigen::VectorXd;

constexpr std::uint32_t none = UINT32_MAX;
/// An axis with less compliance than this part of the body's largest cannot move.
constexpr double immovable = 1e-13;

/// Translation of a deformable body's vertex, or of a whole rigid body.
struct Node {
  std::uint32_t body = 0, vertex = 0; ///< the vertex by its number in the body
  std::uint32_t place = 0;            ///< among the body's nodes
  std::uint32_t active = none;        ///< among active nodes
};

struct ActiveNode {
  std::uint32_t node = 0;
  std::array<std::int32_t, 3> unknown{-1, -1, -1};
  std::uint32_t partner = none; ///< first body that the Hessian couples it with
};

constexpr std::size_t most_inverses = 32;

/// What belongs to one body.
struct Part {
  std::vector<std::uint32_t> nodes;         ///< ascending vertices
  std::vector<std::uint32_t> rows;          ///< their vertices in the body
  std::vector<std::uint32_t> active;        ///< active nodes, by ascending node
  std::vector<std::vector<Block3>> columns; ///< by active node: W(row, it)
  std::vector<std::uint32_t> unknowns;      ///< of the system
  MatrixXd inverse;                         ///< W_aa^-1 over them, in the world's frame
  VectorXd start;                           ///< W_aa^-1 R0_a
};

/// Of a pair's Hessian, over its unknowns.
struct PairBlock {
  std::uint32_t order = 0;
  std::array<std::uint32_t, 12> unknown{};
  std::size_t first = 0; ///< of order^2 values, row-major
};

/// Solution of Newton's system for one right-hand side.
struct Direction {
  VectorXd p;
  std::vector<Vec3> change, response; ///< as in CondensedSystem::State
};

Vec3 times(const Block3& b, const Vec3& v) {
  return {b[0] * v.x + b[1] * v.y + b[2] * v.z, b[3] * v.x + b[4] * v.y + b[5] * v.z,
          b[6] * v.x + b[7] * v.y + b[8] * v.z};
}

Vec3 times_transposed(const Block3& b, const Vec3& v) {
  return {b[0] * v.x + b[3] * v.y + b[6] * v.z, b[1] * v.x + b[4] * v.y + b[7] * v.z,
          b[2] * v.x + b[5] * v.y + b[8] * v.z};
}

} // namespace

struct InverseCache::State {
  struct Inverse {
    std::uint64_t id = 0;
    std::vector<std::uint32_t> key; ///< axes of vertices
    MatrixXd inverse;               ///< in the vertices' frames
  };
  std::list<Inverse> inverses; ///< last used first
  // Memory of systems: that of a new one would be pages to be cleared.
  std::vector<PairBlock> blocks;
  std::vector<double> values;
  cholesky::BlockCholesky cholesky;
};

InverseCache::InverseCache() : state_(std::make_unique<State>()) {}
InverseCache::~InverseCache() = default;

/// Forces, displacements and their changes in one iteration.
struct Iterate {
  std::vector<Vec3> start;    ///< R0 by place
  std::vector<Vec3> force;    ///< F by active node
  std::vector<Vec3> pushed;   ///< W F by node
  std::vector<Vec3> change;   ///< q by active node
  std::vector<Vec3> response; ///< W q by node
  std::vector<Vec3> step;     ///< by place
};

/// How far the bodies are on the way to where they would be without contact.
struct CondensedWay {
  std::array<Direction, 2> direction; ///< at the same share c, by all of it
  double reach = 1;                   ///< part of c that the step is to take
  double c = 1, energy = 0;
};

/// Of energy(): quadratic in c, F and q.
struct EnergyTerms {
  double ff = 0, fq = 0, qq = 0, rf = 0, rq = 0;
};

struct CondensedSystem::State {
  const BodyTable& table;
  double ridge;
  InverseCache& cache;
  std::vector<std::uint32_t> vertices;
  std::vector<std::uint32_t> node_of; ///< by place of a vertex
  std::vector<std::uint32_t> place_of_vertex;
  std::vector<Node> nodes;
  std::vector<Block3> frames; ///< by node
  std::vector<Part> parts;
  std::vector<ActiveNode> active;
  Iterate now;
  CondensedWay way;
  CpuLevel cpu;
  std::vector<std::uint32_t> node_of_unknown;        ///< active node
  std::vector<std::array<std::uint32_t, 2>> coupled; ///< active nodes of two bodies
  VectorXd carried;                                  ///< H_af p_f of immovable vertices
  VectorXd p;
  EnergyTerms terms;

  State(const BodyTable& of, double with_ridge, InverseCache& with_cache, CpuLevel with_cpu)
      : table(of), ridge(with_ridge), cache(with_cache), cpu(with_cpu) {}

  std::size_t size() const { return static_cast<std::size_t>(matrix_order); }

  /// The Hessian has an entry of two nodes.
  void couple(const Node& a, const Node& b) {
    if (a.body == b.body || a.active == none || b.active == none)
      return;
    for (const auto& [one, other] : {std::pair(&a, &b), std::pair(&b, &a)})
      active[one->active].partner = std::min(active[one->active].partner, other->body);
    coupled.push_back({a.active, b.active});
  }

  /// Begins the system's matrix.
  void begin_matrix() {
    // The nodes of a body fall into groups by the body that they touch: in a stack those of its top
    // are coupled with those of its bottom and of the next bottom alone.
    std::map<std::array<std::uint32_t, 2>, std::uint32_t> groups; // by body and partner
    for (const ActiveNode& node : active)
      groups.emplace(std::array{nodes[node.node].body, node.partner}, 0);
    const std::size_t count = groups.size();
    std::vector<std::uint8_t> near(count * count);
    std::uint32_t next = 0;
    for (auto& entry : groups)
      entry.second = next++;
    for (const auto& [a, i] : groups)
      for (const auto& [b, j] : groups)
        near[i * count + j] = a[0] == b[0] ? 1 : 0;
    std::vector<std::uint32_t> group_of_node, group;
    for (const ActiveNode& node : active)
      group_of_node.push_back(groups.at({nodes[node.node].body, node.partner}));
    for (const auto& [a, b] : coupled) {
      const std::size_t i = group_of_node[a], j = group_of_node[b];
      near[i * count + j] = near[j * count + i] = 1;
    }
    for (const std::uint32_t node : node_of_unknown)
      group.push_back(group_of_node[node]);
    cache.state_->cholesky.begin(group, near);
  }

  void add_pairs() {
    for (const PairBlock& b : cache.state_->blocks)
      for (std::size_t i = 0; i < b.order; ++i)
        for (std::size_t j = 0; j < b.order; ++j)
          if (b.unknown[i] >= b.unknown[j])
            cache.state_->cholesky.entry(b.unknown[i], b.unknown[j]) +=
                cache.state_->values[b.first + i * b.order + j];
  }

  /// p^T H p.
  double curvature(const VectorXd& of) const {
    double sum = 0;
    for (const PairBlock& b : cache.state_->blocks)
      for (std::size_t i = 0; i < b.order; ++i)
        for (std::size_t j = 0; j < b.order; ++j)
          sum +=
              of[b.unknown[i]] * cache.state_->values[b.first + i * b.order + j] * of[b.unknown[j]];
    return sum;
  }

  Index matrix_order = 0;

  std::uint32_t body_of(std::uint32_t vertex) const {
    const auto next = std::ranges::upper_bound(table.first, vertex);
    return static_cast<std::uint32_t>(next - table.first.begin()) - 1;
  }

  void make_nodes() {
    parts.resize(table.bodies.size());
    place_of_vertex.assign(table.vertex_count(), none);
    std::vector<std::uint32_t> of_rigid(table.bodies.size(), none);
    for (std::size_t place = 0; place < vertices.size(); ++place) {
      const std::uint32_t vertex = vertices[place], body = body_of(vertex);
      place_of_vertex[vertex] = static_cast<std::uint32_t>(place);
      const bool rigid = table.bodies[body]->is_rigid();
      if (rigid && of_rigid[body] != none) {
        node_of.push_back(of_rigid[body]);
        continue;
      }
      const auto node = static_cast<std::uint32_t>(nodes.size());
      of_rigid[body] = node;
      node_of.push_back(node);
      Part& part = parts[body];
      nodes.push_back(
          {body, vertex - table.first[body], static_cast<std::uint32_t>(part.nodes.size()), none});
      part.nodes.push_back(node);
      part.rows.push_back(vertex - table.first[body]);
    }
    for (const Node& node : nodes)
      frames.push_back(table.bodies[node.body]->frame(node.vertex));
    now.pushed.resize(nodes.size());
    now.response.resize(nodes.size());
    now.step.resize(vertices.size());
  }

  /// Of vectors on all vertices, over the unknowns.
  VectorXd condensed(std::span<const Vec3> by_vertex) const {
    VectorXd all = VectorXd::Zero(matrix_order);
    for (std::size_t place = 0; place < vertices.size(); ++place) {
      const Node& node = nodes[node_of[place]];
      if (node.active == none)
        continue;
      const ActiveNode& one = active[node.active];
      for (int a = 0; a < 3; ++a)
        if (const std::int32_t u = one.unknown[static_cast<std::size_t>(a)]; u >= 0)
          all[u] += by_vertex[vertices[place]][a];
    }
    return all;
  }

  /// Finds a direction's part of q = -(F + c W^-1 R0 + W^-1 p).
  void finish(Direction& d, bool forces, bool moves) {
    d.change.assign(active.size(), {});
    d.response.resize(nodes.size());
    for (const Part& part : parts) {
      const auto count = static_cast<Index>(part.unknowns.size());
      VectorXd own(count);
      for (Index i = 0; i < count; ++i)
        own[i] = d.p[part.unknowns[static_cast<std::size_t>(i)]];
      VectorXd q = -(part.inverse * own);
      if (moves)
        q -= way.c * part.start;
      Index i = 0;
      for (const std::uint32_t k : part.active)
        for (int a = 0; a < 3; ++a)
          if (active[k].unknown[static_cast<std::size_t>(a)] >= 0)
            d.change[k][a] = q[i++] - (forces ? now.force[k][a] : 0);
    }
    respond(d.change, d.response);
  }

  Vec3 start_of(std::uint32_t node) const { // R0 of a node's vertex
    const Node& n = nodes[node];
    return now.start[place_of_vertex[table.first[n.body] + n.vertex]];
  }

  /// Inverse of a body's W_aa, behind new columns.
  void renew(Part& part) {
    const auto count = static_cast<Index>(part.active.size());
    double largest = 0;
    for (Index k = 0; k < count; ++k) {
      const Block3& own = block(part, k, k);
      for (std::size_t a = 0; a < 3; ++a)
        largest = std::max(largest, own[4 * a]);
    }
    Axes axes;
    for (Index k = 0; k < count; ++k) {
      ActiveNode& node = active[part.active[static_cast<std::size_t>(k)]];
      for (int a = 0; a < 3; ++a) {
        if (!(block(part, k, k)[static_cast<std::size_t>(4 * a)] > immovable * largest))
          continue;
        axes.emplace_back(k, a);
        std::int32_t& unknown = node.unknown[static_cast<std::size_t>(a)];
        if (unknown < 0) {
          unknown = static_cast<std::int32_t>(matrix_order++);
          node_of_unknown.push_back(part.active[static_cast<std::size_t>(k)]);
        }
      }
    }
    const auto order = static_cast<Index>(axes.size());
    part.unknowns.clear();
    VectorXd r0(order);
    for (Index j = 0; j < order; ++j) {
      const auto [kj, aj] = axes[static_cast<std::size_t>(j)];
      const ActiveNode& node = active[part.active[static_cast<std::size_t>(kj)]];
      part.unknowns.push_back(
          static_cast<std::uint32_t>(node.unknown[static_cast<std::size_t>(aj)]));
      r0[j] = start_of(node.node)[aj];
    }
    part.inverse = turned(part, axes, inverse_of(part, axes, largest));
    part.start = part.inverse * r0;
  }

  using Axes = std::vector<std::pair<Index, int>>; ///< active node of the part, axis

  /// W_aa^-1 in the vertices' frames.
  const MatrixXd& inverse_of(const Part& part, const Axes& axes, double largest) {
    InverseCache::State& all = *cache.state_;
    const std::uint64_t id = table.bodies[nodes[part.nodes[0]].body]->matrix_id();
    std::vector<std::uint32_t> key;
    for (const auto& [k, a] : axes)
      key.push_back(3 * nodes[active[part.active[static_cast<std::size_t>(k)]].node].vertex +
                    static_cast<std::uint32_t>(a));
    if (id != 0)
      for (auto one = all.inverses.begin(); one != all.inverses.end(); ++one)
        if (one->id == id && one->key == key) {
          all.inverses.splice(all.inverses.begin(), all.inverses, one);
          return one->inverse;
        }
    const auto order = static_cast<Index>(axes.size());
    MatrixXd w(order, order);
    for (Index j = 0; j < order; ++j) {
      const auto [kj, aj] = axes[static_cast<std::size_t>(j)];
      for (Index i = 0; i < order; ++i) {
        const auto [ki, ai] = axes[static_cast<std::size_t>(i)];
        w(i, j) = block(part, ki, kj)[static_cast<std::size_t>(3 * ai + aj)];
      }
    }
    w = (0.5 * (w + w.transpose())).eval();
    double shift = 0;
    for (;;) {
      MatrixXd shifted = w;
      shifted.diagonal().array() += shift;
      if (cholesky::invert({shifted.data(), static_cast<std::size_t>(shifted.size())},
                           static_cast<std::size_t>(order), cpu) &&
          shifted.allFinite()) {
        w = std::move(shifted);
        break;
      }
      shift = shift > 0 ? 10 * shift : ridge * largest;
      if (!std::isfinite(shift) || !(shift <= largest))
        throw Error("contact: the compliance of a body is not positive");
    }
    all.inverses.push_front({id, std::move(key), std::move(w)});
    if (all.inverses.size() > most_inverses)
      all.inverses.pop_back();
    return all.inverses.front().inverse;
  }

  /// From the vertices' frames into the world's.
  MatrixXd turned(const Part& part, const Axes& axes, const MatrixXd& inverse) const {
    const ContactBody& body = *table.bodies[nodes[part.nodes[0]].body];
    const std::size_t count = part.active.size();
    std::vector<Index> first(count, -1); // unknown of a node with all three axes
    bool turns = false;
    std::vector<Eigen::Matrix3d> frame(count, Eigen::Matrix3d::Identity());
    for (std::size_t n = 0; n < axes.size(); ++n)
      if (axes[n].second == 0 && n + 2 < axes.size() && axes[n + 2].first == axes[n].first)
        first[static_cast<std::size_t>(axes[n].first)] = static_cast<Index>(n);
    for (std::size_t k = 0; k < count; ++k) {
      const Block3 of = body.frame(nodes[active[part.active[k]].node].vertex);
      frame[k] = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(of.data());
      turns = turns || (first[k] >= 0 && frame[k] != Eigen::Matrix3d::Identity());
    }
    MatrixXd result = inverse;
    if (!turns)
      return result;
    for (std::size_t k = 0; k < count; ++k)
      if (first[k] >= 0)
        result.middleRows<3>(first[k]) = (frame[k] * result.middleRows<3>(first[k])).eval();
    for (std::size_t k = 0; k < count; ++k)
      if (first[k] >= 0)
        result.middleCols<3>(first[k]) =
            (result.middleCols<3>(first[k]) * frame[k].transpose()).eval();
    return result;
  }

  /// W(active node i, active node j) of a part.
  const Block3& block(const Part& part, Index i, Index j) const {
    const Node& row = nodes[active[part.active[static_cast<std::size_t>(i)]].node];
    return part.columns[static_cast<std::size_t>(j)][row.place];
  }

  /// W v at all nodes, v by active node.
  void respond(const std::vector<Vec3>& v, std::vector<Vec3>& to) const {
    std::ranges::fill(to, Vec3{});
    for (const Part& part : parts) {
      if (part.active.empty())
        continue;
      for (std::size_t k = 0; k < part.active.size(); ++k) {
        const ActiveNode& node = active[part.active[k]];
        if (v[part.active[k]] == Vec3{})
          continue;
        const Vec3 f = times_transposed(frames[node.node], v[part.active[k]]);
        const std::vector<Block3>& column = part.columns[k];
        for (std::size_t row = 0; row < part.nodes.size(); ++row)
          to[part.nodes[row]] += times(column[row], f);
      }
      for (const std::uint32_t node : part.nodes)
        to[node] = times(frames[node], to[node]);
    }
  }
};

CondensedSystem::CondensedSystem(const BodyTable& table, std::vector<std::uint32_t> vertices,
                                 std::span<const Vec3> start,
                                 std::span<const std::vector<VertexForce>> forces, double energy,
                                 double share, double ridge, InverseCache& cache, CpuLevel cpu)
    : state_(std::make_unique<State>(table, ridge, cache, cpu)) {
  State& s = *state_;
  s.way.energy = energy;
  s.way.c = share;
  s.vertices = std::move(vertices);
  s.make_nodes();
  for (const std::uint32_t vertex : s.vertices)
    s.now.start.push_back(start[vertex]);
  std::vector<std::uint32_t> pushed;
  for (std::size_t body = 0; body < forces.size(); ++body)
    for (const VertexForce& f : forces[body])
      pushed.push_back(table.first[body] + f.vertex);
  activate(pushed);
  for (std::size_t body = 0; body < forces.size(); ++body)
    for (const VertexForce& f : forces[body]) {
      const std::uint32_t place = s.place_of_vertex[table.first[body] + f.vertex];
      s.now.force[s.nodes[s.node_of[place]].active] += f.force;
    }
  s.respond(s.now.force, s.now.pushed);
}

CondensedSystem::~CondensedSystem() = default;

std::span<const std::uint32_t> CondensedSystem::vertices() const {
  return state_->vertices;
}

std::size_t CondensedSystem::unknowns() const {
  return state_->size();
}

void CondensedSystem::activate(std::span<const std::uint32_t> vertices) {
  State& s = *state_;
  std::vector<std::vector<std::uint32_t>> added(s.parts.size());
  for (const std::uint32_t vertex : vertices)
    if (const Node& n = s.nodes[s.node_of[s.place_of_vertex[vertex]]]; n.active == none)
      added[n.body].push_back(n.vertex);
  for (std::size_t b = 0; b < added.size(); ++b)
    if (!added[b].empty())
      s.table.bodies[b]->prepare(added[b]);
  std::vector<std::uint8_t> changed(s.parts.size());
  for (const std::uint32_t vertex : vertices) {
    const std::uint32_t node = s.node_of[s.place_of_vertex[vertex]];
    Node& n = s.nodes[node];
    if (n.active != none)
      continue;
    n.active = static_cast<std::uint32_t>(s.active.size());
    s.active.push_back({node, {-1, -1, -1}});
    Part& part = s.parts[n.body];
    const auto place = std::ranges::lower_bound(part.active, node, {},
                                                [&](std::uint32_t k) { return s.active[k].node; });
    const auto column = part.columns.begin() + (place - part.active.begin());
    std::vector<Block3> blocks(part.rows.size());
    s.table.bodies[n.body]->compliance(n.vertex, part.rows, blocks);
    part.columns.insert(column, std::move(blocks));
    part.active.insert(place, n.active);
    changed[n.body] = 1;
  }
  for (std::size_t b = 0; b < s.parts.size(); ++b)
    if (changed[b] != 0)
      s.renew(s.parts[b]);
  s.now.force.resize(s.active.size());
  s.now.change.resize(s.active.size());
}

void CondensedSystem::clear_hessian() {
  State& s = *state_;
  s.cache.state_->blocks.clear();
  s.cache.state_->values.clear();
  s.carried.setZero(s.matrix_order);
  s.coupled.clear();
  for (ActiveNode& node : s.active)
    node.partner = none;
}

void CondensedSystem::add_hessian(std::span<const std::uint32_t> of,
                                  std::span<const double> block) {
  State& s = *state_;
  std::array<std::int32_t, 12> unknown{};
  std::array<double, 12> way{}; // of axes that are carried to their targets
  const std::size_t order = 3 * of.size();
  for (std::size_t k = 0; k < of.size(); ++k) {
    const std::uint32_t place = s.place_of_vertex[of[k]];
    const Node& node = s.nodes[s.node_of[place]];
    for (std::size_t j = 0; j < k; ++j)
      s.couple(node, s.nodes[s.node_of[s.place_of_vertex[of[j]]]]);
    const Vec3 carried = -s.way.c * s.now.start[place];
    for (std::size_t a = 0; a < 3; ++a) {
      unknown[3 * k + a] = node.active == none ? -1 : s.active[node.active].unknown[a];
      way[3 * k + a] = unknown[3 * k + a] < 0 ? carried[static_cast<int>(a)] : 0;
    }
  }
  PairBlock pair;
  pair.first = s.cache.state_->values.size();
  for (std::size_t i = 0; i < order; ++i) {
    if (unknown[i] < 0)
      continue;
    pair.unknown[pair.order++] = static_cast<std::uint32_t>(unknown[i]);
    double carried = 0;
    for (std::size_t j = 0; j < order; ++j) {
      const double h = block[order * i + j];
      if (unknown[j] < 0)
        carried += h * way[j];
      else
        s.cache.state_->values.push_back(h);
    }
    s.carried[unknown[i]] += carried;
  }
  s.cache.state_->blocks.push_back(pair);
}

bool CondensedSystem::solve(std::span<const Vec3> gradient, double damping) {
  State& s = *state_;
  const Index order = s.matrix_order;
  cholesky::BlockCholesky& matrix = s.cache.state_->cholesky;
  s.begin_matrix();
  s.add_pairs();
  for (std::uint32_t u = 0; u < s.size(); ++u)
    matrix.entry(u, u) += damping;
  auto& [still, whole] = s.way.direction;
  whole.p = -s.carried;
  for (const Part& part : s.parts) {
    const auto count = static_cast<Index>(part.unknowns.size());
    for (Index j = 0; j < count; ++j) {
      const std::uint32_t column = part.unknowns[static_cast<std::size_t>(j)];
      whole.p[column] -= s.way.c * part.start[j];
    }
    matrix.add_block(part.unknowns,
                     {part.inverse.data(), static_cast<std::size_t>(part.inverse.size())});
  }
  still.p = -s.condensed(gradient);
  for (const ActiveNode& active : s.active)
    for (int a = 0; a < 3; ++a)
      if (const std::int32_t u = active.unknown[static_cast<std::size_t>(a)]; u >= 0)
        still.p[u] -= s.now.force[s.nodes[active.node].active][a];
  if (order > 0 && !matrix.factor(s.cpu))
    return false;
  VectorXd both(2 * order);
  both << still.p, whole.p;
  matrix.solve({both.data(), 2 * s.size()});
  still.p = both.head(order);
  whole.p = both.tail(order);
  s.finish(still, true, false);
  s.finish(whole, false, true);
  choose_reach(1);
  return still.p.allFinite() && whole.p.allFinite();
}

void CondensedSystem::choose_reach(double reach) {
  State& s = *state_;
  s.way.reach = s.way.c > 0 ? reach : 1;
  const auto& [still, whole] = s.way.direction;
  s.p = still.p + s.way.reach * whole.p;
  const auto combine = [&](auto of, std::vector<gewebe::Vec3>& to) {
    for (std::size_t k = 0; k < to.size(); ++k)
      to[k] = (still.*of)[k] + s.way.reach * (whole.*of)[k];
  };
  combine(&Direction::change, s.now.change);
  combine(&Direction::response, s.now.response);
  for (std::size_t place = 0; place < s.vertices.size(); ++place) {
    const std::uint32_t node = s.node_of[place];
    s.now.step[place] =
        -s.way.reach * s.way.c * s.now.start[place] - s.now.pushed[node] - s.now.response[node];
  }
  s.terms.ff = s.terms.fq = s.terms.qq = s.terms.rf = s.terms.rq = 0;
  for (std::size_t k = 0; k < s.active.size(); ++k) {
    const std::uint32_t node = s.active[k].node;
    const Vec3 r0 = s.start_of(node);
    s.terms.rf += dot(r0, s.now.force[k]);
    s.terms.rq += dot(r0, s.now.change[k]);
    s.terms.ff += dot(s.now.force[k], s.now.pushed[node]);
    s.terms.fq += dot(s.now.force[k], s.now.response[node]);
    s.terms.qq += dot(s.now.change[k], s.now.response[node]);
  }
}

const Vec3& CondensedSystem::step(std::size_t place) const {
  return state_->now.step[place];
}

double CondensedSystem::energy(double part) const {
  const State& s = *state_;
  const double stay = 1 - part;
  double energy =
      0.5 * (stay * stay * s.terms.ff - 2 * stay * part * s.terms.fq + part * part * s.terms.qq);
  if (s.way.reach > 0) {
    const double c = stay * s.way.c;
    energy += c * (stay * s.terms.rf - part * s.terms.rq) + 0.5 * s.way.energy * c * c;
  }
  return energy;
}

double CondensedSystem::slope() const {
  const State& s = *state_;
  double slope = -s.terms.ff - s.terms.fq;
  if (s.way.reach > 0)
    slope -= s.way.c * (2 * s.terms.rf + s.terms.rq) + s.way.energy * s.way.c * s.way.c;
  return slope;
}

void CondensedSystem::require_descent(double contact_slope) {
  State& s = *state_;
  // Newton's decrement that the step would have without the way.
  const double descent = s.curvature(s.p) + s.terms.qq, total = slope() + contact_slope;
  if (s.way.c > 0 && s.way.reach > 0 && !(total <= -0.5 * descent))
    s.way.energy += (total + descent) / (s.way.c * s.way.c);
}

void CondensedSystem::advance(double part) {
  State& s = *state_;
  s.way.c = part * s.way.reach < 1 ? (1 - part * s.way.reach) * s.way.c : 0;
  for (std::size_t k = 0; k < s.active.size(); ++k)
    s.now.force[k] = (1 - part) * s.now.force[k] - part * s.now.change[k];
  for (std::size_t node = 0; node < s.nodes.size(); ++node)
    s.now.pushed[node] = (1 - part) * s.now.pushed[node] - part * s.now.response[node];
}

CondensedSystem::Residual CondensedSystem::residual(std::span<const Vec3> gradient) const {
  const State& s = *state_;
  std::vector<Vec3> sum(s.nodes.size());
  for (std::size_t place = 0; place < s.vertices.size(); ++place)
    sum[s.node_of[place]] -= gradient[s.vertices[place]];
  Residual result;
  for (std::size_t node = 0; node < s.nodes.size(); ++node) {
    const std::uint32_t active = s.nodes[node].active;
    if (active == none && sum[node] == Vec3{})
      continue;
    Vec3 force;
    std::array<bool, 3> moves{};
    if (active != none) {
      force = s.now.force[active];
      for (std::size_t a = 0; a < 3; ++a)
        moves[a] = s.active[active].unknown[a] >= 0;
    }
    Vec3 difference = force - sum[node];
    for (int a = 0; a < 3; ++a)
      if (active != none && !moves[static_cast<std::size_t>(a)])
        difference[a] = 0; // carried to its target
    if (const double size = norm(difference); !(size <= result.difference))
      result.difference = size;
    result.largest = std::max(result.largest, norm(force));
  }
  return result;
}

double CondensedSystem::share() const {
  return state_->way.c;
}

std::vector<VertexForce> CondensedSystem::forces(std::size_t body) const {
  const State& s = *state_;
  std::vector<VertexForce> all;
  for (const std::uint32_t k : s.parts[body].active)
    all.push_back({s.nodes[s.active[k].node].vertex, s.now.force[k]});
  std::ranges::sort(all, {}, &VertexForce::vertex);
  return all;
}

} // namespace gewebe::contact
