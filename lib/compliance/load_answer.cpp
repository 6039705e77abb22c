#include "compliance/load_answer.h"

#include "fem/model_stiffness.h"
#include "geometry/vector_at.h"

#include <algorithm>
#include <utility>

namespace gewebe::compliance {

namespace {

// Roundings of sums that follow their changes stay below 1000 times one.
constexpr std::uint64_t max_increments = 1000;

} // namespace

std::vector<double> forces_over_axes(const model::Model& model, const contact::Load& load) {
  std::vector<double> f(3 * model.nodes.size(), 0);
  if (load.gravity != Vec3{})
    f = fem::weight_of(model, load.gravity);
  for (const auto& [node, force] : load.force)
    for (int a = 0; a < 3; ++a)
      f[axis_of(node, a)] += force[a];
  return f;
}

std::vector<std::uint32_t> nodes_of(const std::map<std::uint32_t, Vec3>& values) {
  std::vector<std::uint32_t> nodes;
  nodes.reserve(values.size());
  for (const auto& entry : values)
    nodes.push_back(entry.first);
  return nodes;
}

std::vector<contact::NodeVector> as_vectors(const std::map<std::uint32_t, Vec3>& values) {
  std::vector<contact::NodeVector> list;
  list.reserve(values.size());
  for (const auto& [node, value] : values)
    list.push_back({node, value});
  return list;
}

LoadAnswer::LoadAnswer(const model::Model& model, Compliance& compliance)
    : model_(model), compliance_(compliance) {
  now_.answer.write().resize(compliance.rows());
}

const std::vector<double>& LoadAnswer::weight(const Vec3& gravity) {
  if (gravity == weight_gravity_)
    return weight_;
  std::vector<double> fresh;
  if (gravity != Vec3{}) {
    contact::Load alone;
    alone.gravity = gravity;
    fresh = forces_over_axes(model_, alone);
    compliance_.solve(fresh);
    fresh.resize(compliance_.rows());
  }
  weight_ = std::move(fresh);
  weight_gravity_ = gravity;
  return weight_;
}

/// Forces that differ from those of the answer, by their difference.
std::vector<contact::NodeVector>
LoadAnswer::changed_forces(const std::map<std::uint32_t, Vec3>& now) const {
  std::vector<contact::NodeVector> changed;
  const std::map<std::uint32_t, Vec3>& force = *now_.force;
  auto a = force.begin();
  auto b = now.begin();
  while (a != force.end() || b != now.end()) {
    if (b == now.end() || (a != force.end() && a->first < b->first)) {
      changed.push_back({a->first, -a->second});
      ++a;
    } else if (a == force.end() || b->first < a->first) {
      changed.push_back({b->first, b->second});
      ++b;
    } else {
      if (!(a->second == b->second))
        changed.push_back({b->first, b->second - a->second});
      ++a;
      ++b;
    }
  }
  return changed;
}

/// Whether the answer is found from the last one.
bool LoadAnswer::follows(const contact::Load& load, std::size_t changed) const {
  return load.gravity == now_.gravity && changed < load.force.size() &&
         now_.increments < max_increments;
}

void LoadAnswer::note(const contact::Load& load) {
  if (known(load))
    return;
  std::vector<contact::NodeVector> changed = load.gravity == now_.gravity
                                                 ? changed_forces(load.force)
                                                 : std::vector<contact::NodeVector>{};
  if (follows(load, changed.size())) {
    now_.pending.write().push_back(std::move(changed));
    ++now_.increments;
  } else {
    now_.pending = {};
    now_.fresh = std::optional(as_vectors(load.force));
    now_.increments = 0;
  }
  now_.gravity = load.gravity;
  now_.force.replace() = load.force;
}

/// Makes the answer that of the load noted last.
void LoadAnswer::settle() {
  if (!*now_.fresh && now_.pending->empty())
    return;
  const Vec3 gravity = now_.gravity;
  forget(); // should a sum fail
  if (*now_.fresh) {
    std::vector<double>& answer = now_.answer.replace();
    answer = weight(gravity);
    answer.resize(compliance_.rows(), 0);
    compliance_.add(**now_.fresh, 0, answer);
    now_.fresh = {};
  }
  const auto pending = std::exchange(now_.pending, {});
  for (const std::vector<contact::NodeVector>& changed : *pending)
    compliance_.add(changed, 0, now_.answer.write());
  now_.gravity = gravity;
}

const std::vector<double>& LoadAnswer::whole(const contact::Load& load) {
  note(load);
  settle();
  return *now_.answer;
}

/// The answer over all axes, by a solve.
const std::vector<double>& LoadAnswer::everywhere(const contact::Load& load) {
  if (!everywhere_.empty() && load.gravity == solved_.gravity && load.force == solved_.force)
    return everywhere_;
  everywhere_.clear(); // should the solve fail
  std::vector<double> fresh = forces_over_axes(model_, load);
  if (load.gravity != Vec3{} || !load.force.empty())
    compliance_.solve(fresh);
  everywhere_ = std::move(fresh);
  solved_.gravity = load.gravity;
  solved_.force = load.force;
  return everywhere_;
}

std::vector<double> LoadAnswer::at(const contact::Load& load, std::span<const std::size_t> rows) {
  std::vector<double> values;
  values.reserve(rows.size());
  if (std::any_of(rows.begin(), rows.end(),
                  [&](std::size_t row) { return row >= compliance_.rows(); })) {
    const std::vector<double>& all = everywhere(load);
    for (const std::size_t row : rows)
      values.push_back(all[row]);
    return values;
  }
  if (compliance_.columns_pay(nodes_of(load.force))) {
    (void)weight(load.gravity);
    for (const std::size_t row : rows)
      values.push_back(weight_.empty() ? 0 : weight_[row]);
    compliance_.add_rows(as_vectors(load.force), rows, values);
    return values;
  }
  if (now_.increments > 0)
    forget();
  const std::vector<double>& all = whole(load);
  for (const std::size_t row : rows)
    values.push_back(all[row]);
  return values;
}

std::vector<double> LoadAnswer::at_blocks(const contact::Load& load,
                                          std::span<const std::size_t> rows) {
  const bool columns = compliance_.columns_pay(nodes_of(load.force));
  if (!compliance_.carries() || (columns && load.gravity == Vec3{}))
    return at(load, rows);
  contact::Load carried;
  carried.gravity = load.gravity;
  if (!columns)
    carried.force = load.force;
  if (!(carried == carried_))
    carried_at_.clear();
  carried_ = std::move(carried);
  std::vector<std::uint32_t> missing;
  for (const std::size_t row : rows)
    if (const auto node = static_cast<std::uint32_t>(row / 3);
        !carried_at_.contains(node) && (missing.empty() || missing.back() != node))
      missing.push_back(node);
  if (!missing.empty()) {
    const std::vector<Vec3> u = compliance_.carried(forces_over_axes(model_, carried_), missing);
    for (std::size_t k = 0; k < missing.size(); ++k)
      carried_at_[missing[k]] = u[k];
  }
  std::vector<double> values;
  values.reserve(rows.size());
  for (const std::size_t row : rows)
    values.push_back(
        carried_at_.at(static_cast<std::uint32_t>(row / 3))[static_cast<int>(row % 3)]);
  if (columns)
    compliance_.add_rows(as_vectors(load.force), rows, values);
  return values;
}

} // namespace gewebe::compliance
