#include "dynamics/elastodynamic.h"

#include "base/error.h"
#include "base/lockstep.h"
#include "base/parallel.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <utility>

// Based on: E. Hairer, C. Lubich, G. Wanner, Geometric numerical integration illustrated by the
// Störmer-Verlet method, 2003 (symplectic Euler).

namespace gewebe::dynamics {

namespace {

constexpr double rest_tolerance = 1e-15;
constexpr double max_steps = 1e9;
// Springs times steps, and springs, below which a thread costs more than it gains.
constexpr double pulls_of_a_thread = 2e6;
constexpr std::uint64_t pulls_of_a_step = 4000;

/// Whether every component is at most `bound` in size; false for NaN.
bool within(const Vec3& v, double bound) {
  return std::abs(v.x) <= bound && std::abs(v.y) <= bound && std::abs(v.z) <= bound;
}

Vec3 vector_of(const double* row) {
  return {row[0], row[1], row[2]};
}

void put(const Vec3& v, double* row) {
  row[0] = v.x;
  row[1] = v.y;
  row[2] = v.z;
}

/// Blocks of thread t: of about as many springs for each.
std::pair<std::size_t, std::size_t> share(const SpringLayout& layout, int thread, int threads) {
  std::size_t all = 0;
  for (const SpringBlock& b : layout.blocks)
    all += b.within_count + b.across_count + b.count / 8;
  const auto bound = [&](int t) {
    const auto wanted = all * static_cast<std::size_t>(t) / static_cast<std::size_t>(threads);
    std::size_t block = 0, sum = 0;
    for (; block < layout.blocks.size() && sum < wanted; ++block) {
      const SpringBlock& b = layout.blocks[block];
      sum += b.within_count + b.across_count + b.count / 8;
    }
    return t == threads ? layout.blocks.size() : block;
  };
  return {bound(thread), bound(thread + 1)};
}

} // namespace

Elastodynamic::Elastodynamic(const model::Model& model)
    : model_(model), network_(spring_network(model)), layout_(spring_layout(model)),
      rows_(std::vector<NodeRow>(model.nodes.size())),
      next_(std::vector<NodeRow>(model.nodes.size())), motion_(model.nodes.size()) {
  Box3 box;
  require_masses(model);
  for (const model::Node& node : model.nodes)
    box.add(node.position);
  size_ = box.longest_side();
  apply_load();
}

void Elastodynamic::set_load(const contact::Load& load, double time) {
  if (load == *load_)
    return;
  load_ = std::make_shared<const contact::Load>(load);
  time_ = time;
  apply_load();
}

void Elastodynamic::apply_load() {
  loaded_ = time_;
  traits_.assign(layout_.movable, {});
  drives_.clear();
  for (std::size_t row = 0; row < layout_.movable; ++row) {
    const std::uint32_t i = layout_.node_of_row[row];
    const model::Node& node = model_.nodes[i];
    for (int a = 0; a < 3; ++a)
      traits_[row].inverse_mass[a] = contact::is_fixed(model_, i, a) ? 0 : 1 / node.mass;
    traits_[row].drag = node.drag;
    put(node.mass * load_->gravity, traits_[row].constant);
  }
  const auto drive_of = [&](std::size_t row) -> Drive& {
    drives_.resize(layout_.blocks.size());
    const auto behind =
        std::upper_bound(layout_.blocks.begin(), layout_.blocks.end(), row,
                         [](std::size_t r, const SpringBlock& b) { return r < b.first; });
    return drives_[static_cast<std::size_t>(behind - layout_.blocks.begin()) - 1];
  };
  std::map<std::uint32_t, Driven> driven;
  for (const auto& [node, force] : load_->force) {
    const std::size_t row = layout_.row_of_node[node];
    if (row >= layout_.movable)
      continue;
    if (const auto period = load_->force_period.find(node); period != load_->force_period.end()) {
      driven[node].pulsing = force;
      driven[node].period = period->second;
    } else {
      put(vector_of(traits_[row].constant) + force, traits_[row].constant);
    }
  }
  for (const auto& [node, pressure] : load_->pressure)
    if (layout_.row_of_node[node] < layout_.movable)
      driven[node].pressure = pressure;
  if (!load_->pressure.empty())
    for (const Triangle& t : model_.triangles)
      for (const std::uint32_t corner : t)
        if (const auto d = driven.find(corner);
            d != driven.end() && d->second.pressure.pressure != 0)
          d->second.around.push_back(t);
  for (auto& [node, d] : driven) {
    const std::size_t row = layout_.row_of_node[node];
    d.node = node;
    d.steady = vector_of(traits_[row].constant);
    drive_of(row).driven.push_back(std::move(d));
  }
  for (const auto& [node, displacement] : load_->displacement) {
    const std::size_t row = layout_.row_of_node[node];
    const auto way = load_->ramp.find(node);
    const bool ramps = way != load_->ramp.end() && time_ < way->second.end;
    if (row < layout_.movable) {
      std::fill(std::begin(traits_[row].inverse_mass), std::end(traits_[row].inverse_mass), 0.0);
      if (ramps)
        drive_of(row).ramped.push_back({node, way->second});
    }
    NodeRow& here = rows_.write()[row];
    here = {};
    put(ramps ? way->second.at(time_) : displacement, here.u);
  }
  copy_held_rows();
  motion_shown_ = false;
  resting_ = false;
}

/// No step writes rows that can't move, so both sides have them.
void Elastodynamic::copy_held_rows() {
  const auto held = static_cast<std::ptrdiff_t>(layout_.movable);
  std::copy(rows_->begin() + held, rows_->end(), next_.write().begin() + held);
}

std::span<const NodeMotion> Elastodynamic::motion() const {
  const std::vector<NodeRow>& rows = *rows_;
  if (!motion_shown_)
    for (std::size_t row = 0; row < rows.size(); ++row)
      motion_[layout_.node_of_row[row]] = {vector_of(rows[row].u), vector_of(rows[row].v)};
  motion_shown_ = true;
  return motion_;
}

void Elastodynamic::set_motion(std::span<const NodeMotion> motion) {
  std::vector<NodeRow>& rows = rows_.write();
  for (std::size_t row = 0; row < rows.size(); ++row) {
    put(motion[layout_.node_of_row[row]].displacement, rows[row].u);
    put(motion[layout_.node_of_row[row]].velocity, rows[row].v);
  }
  apply_load();
}

Elastodynamic::State Elastodynamic::state() const {
  return {load_, time_, loaded_, rows_, resting_};
}

void Elastodynamic::restore(const State& state) {
  if (load_ != state.load || loaded_ != state.loaded) {
    load_ = state.load;
    time_ = state.loaded; // ways that had ended then were no ways
    apply_load();
  }
  time_ = state.time;
  resting_ = state.resting;
  rows_ = state.rows;
  copy_held_rows();
  motion_shown_ = false;
}

template <class At>
Vec3 Elastodynamic::outer_force(const Driven& driven, double time, const At& position) const {
  Vec3 force = driven.steady + contact::pulse(time, driven.period) * driven.pulsing;
  if (driven.around.empty())
    return force;
  const double sixth = driven.pressure.pressure * contact::pulse(time, driven.pressure.period) /
                       6; // of twice the area
  for (const Triangle& t : driven.around) {
    const Vec3 a = position(t[0]), b = position(t[1]), c = position(t[2]);
    force += sixth * cross(b - a, c - a);
  }
  return force;
}

Vec3 Elastodynamic::outer_force(std::uint32_t node, double time) const {
  const std::size_t row = layout_.row_of_node[node];
  if (row >= layout_.movable) { // pressure and pulses on it are not of interest: it can't move
    const auto force = load_->force.find(node);
    return model_.nodes[node].mass * load_->gravity +
           (force != load_->force.end() ? force->second : Vec3{});
  }
  const auto position = [&](std::uint32_t i) {
    return model_.nodes[i].position + vector_of((*rows_)[layout_.row_of_node[i]].u);
  };
  for (const Drive& drive : drives_)
    for (const Driven& driven : drive.driven)
      if (driven.node == node)
        return outer_force(driven, time, position);
  return vector_of(traits_[row].constant);
}

bool Elastodynamic::found_at_rest(double h, double time) const {
  if (load_->changes_until() > time)
    return false;
  const double speed = rest_tolerance * size_ / h, acceleration = speed / h;
  for (const NodeRow& row : *rows_)
    if (!within(vector_of(row.v), speed))
      return false;
  const std::span<const NodeMotion> now = motion();
  for (std::uint32_t row = 0; row < layout_.movable; ++row) {
    const Vec3 inverse = vector_of(traits_[row].inverse_mass);
    if (inverse == Vec3{})
      continue;
    const std::uint32_t node = layout_.node_of_row[row];
    const Vec3 outer = drives_.empty() ? vector_of(traits_[row].constant) : outer_force(node, time);
    const Vec3 force = spring_force(network_, now, node) + outer;
    if (!within({force.x * inverse.x, force.y * inverse.y, force.z * inverse.z}, acceleration))
      return false;
  }
  return true;
}

std::uint64_t Elastodynamic::advance(double duration, const TimeSteps& of, const Context& context,
                                     double start) {
  if (resting_ || duration == 0)
    return 0;
  // A hair more than a whole number of steps is rounding.
  const double exact = duration / of.largest * (1 - 1e-12);
  if (!(exact <= max_steps))
    throw Error("a step of this length takes over 1e9 integration steps, expected fewer");
  const double count = std::max(1.0, std::ceil(exact));
  const double h = duration / count;
  if (found_at_rest(h, start)) {
    for (NodeRow& row : rows_.write())
      std::fill(std::begin(row.v), std::end(row.v), 0.0);
    motion_shown_ = false;
    resting_ = true;
    return 0;
  }
  const auto steps = static_cast<std::uint64_t>(count);
  motion_shown_ = false;
  run_steps(steps, h, start, context);
  time_ = start + duration;
  return steps;
}

void Elastodynamic::run_steps(std::uint64_t steps, double h, double start, const Context& context) {
  const std::uint64_t pulls = layout_.pulls(), worth = pulls / pulls_of_a_step;
  int threads = static_cast<int>(std::min<std::size_t>(
      static_cast<std::size_t>(std::min(thread_count(context), thread_count(Context{}))),
      layout_.blocks.size()));
  threads =
      std::max(1, static_cast<int>(std::min(
                      {static_cast<double>(threads),
                       static_cast<double>(pulls) * static_cast<double>(steps) / pulls_of_a_thread,
                       static_cast<double>(worth)})));
  NodeRow *const rows = rows_.write().data(), *const others = next_.write().data();
  // Written during one step and read behind its end, while the next may be on: hence two.
  std::array<std::atomic<bool>, 2> odd{}, cancelled{};
  std::uint64_t done = 0;
  in_lockstep(threads, [&](int thread, int all, MeetingPoint& point) {
    const auto [first, last] = share(layout_, thread, all);
    NodeRow *now = rows, *next = others;
    std::uint32_t round = 0;
    std::uint64_t s = 0;
    for (bool stop = false; s < steps && !stop; ++s) {
      const double time = start + static_cast<double>(s) * h;
      for (std::size_t b = first; b < last; ++b) {
        if (!step_block(b, now, next, h, time, context.cpu))
          odd[s % 2].store(true, std::memory_order_relaxed);
      }
      if (thread == 0 && context.cancelled && context.cancelled())
        cancelled[s % 2].store(true, std::memory_order_relaxed);
      point.meet(round);
      stop = odd[s % 2].load(std::memory_order_relaxed) ||
             cancelled[s % 2].load(std::memory_order_relaxed);
      std::swap(now, next);
    }
    if (thread == 0)
      done = s;
  });
  if (done % 2 == 1)
    std::swap(rows_, next_);
  if (cancelled[0].load() || cancelled[1].load())
    throw Cancelled();
  if (odd[0].load() || odd[1].load())
    fail(start + static_cast<double>(done) * h, "is no longer finite, expected a "
                                                "smaller load or timestep");
}

bool Elastodynamic::step_block(std::size_t block, const NodeRow* now, NodeRow* next, double h,
                               double time, CpuLevel cpu) {
  const Drive* const drive = drives_.empty() ? nullptr : &drives_[block];
  if (drive != nullptr)
    for (const Driven& driven : drive->driven)
      put(outer_force(driven, time,
                      [&](std::uint32_t i) {
                        return model_.nodes[i].position + vector_of(now[layout_.row_of_node[i]].u);
                      }),
          traits_[layout_.row_of_node[driven.node]].constant);
  const BlockStep kernel = cpu == CpuLevel::baseline ? block_step_baseline : block_step_avx2;
  const bool finite =
      kernel(layout_.blocks[block], layout_.rest.data(), traits_.data(), now, next, h);
  if (drive != nullptr)
    for (const RampedNode& t : drive->ramped) {
      const std::size_t row = layout_.row_of_node[t.node];
      const Vec3 u = t.way.at(time + h);
      put(time + h < t.way.end ? (u - vector_of(now[row].u)) / h : Vec3{}, next[row].v);
      put(u, next[row].u);
    }
  return finite;
}

void Elastodynamic::fail(double time, const char* what) const {
  const std::span<const NodeMotion> now = motion();
  std::uint32_t node = 0;
  while (node + 1 < now.size() && is_finite(now[node].displacement) &&
         is_finite(now[node].velocity))
    ++node;
  throw MotionError(node, time, what);
}

std::vector<contact::NodeVector> Elastodynamic::contact_forces() const {
  std::vector<contact::NodeVector> forces;
  forces.reserve(load_->displacement.size());
  const std::span<const NodeMotion> now = motion();
  for (const auto& [node, displacement] : load_->displacement) {
    Vec3 force = -(spring_force(network_, now, node) + outer_force(node, time_));
    for (int a = 0; a < 3; ++a)
      if (contact::is_fixed(model_, node, a) || force[a] == 0)
        force[a] = 0; // no -0
    forces.push_back({node, force});
  }
  return forces;
}

} // namespace gewebe::dynamics
