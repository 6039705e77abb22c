#include "statics/warped_contact.h"

#include "base/vector_at.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace gewebe {

namespace {

constexpr double met = 1e-3; ///< of the largest displacement, as answers are exact to
constexpr int max_pushes = 30;

} // namespace

WarpedYielding::WarpedYielding(const Model& model, std::function<WarpedStatics&()> solver,
                               const Load& load, std::span<const NodeTouch> last)
    : model_(model), solver_(std::move(solver)), load_(load), pushed_(load) {
  for (const NodeTouch& t : last)
    if (!load.displacement.contains(t.node))
      pushed_.force[t.node] += t.force;
}

DelassusOperator WarpedYielding::delassus_operator(std::span<const std::uint32_t> nodes) {
  if (!std::ranges::equal(nodes, nodes_)) {
    nodes_.assign(nodes.begin(), nodes.end());
    rounds_ = 0;
  }
  // Forces at nodes that have left are no more.
  Load here = load_;
  for (const std::uint32_t node : nodes)
    if (const auto force = pushed_.force.find(node); force != pushed_.force.end())
      here.force[node] = force->second;
  pushed_ = std::move(here);
  WarpedStatics& solver = solver_();
  solver.update(pushed_, nodes);
  DelassusOperator delassus;
  delassus.nodes = nodes_;
  delassus.compliance = solver.compliance_at(nodes);
  const std::span<const double> u = solver.surface_displacement();
  const std::size_t size = 3 * nodes.size();
  std::vector<double> force(size);
  for (std::size_t k = 0; k < size; ++k) {
    const auto axis = static_cast<int>(k % 3);
    const auto now = pushed_.force.find(nodes[k / 3]);
    const auto given = load_.force.find(nodes[k / 3]);
    force[k] = (now == pushed_.force.end() ? 0 : now->second[axis]) -
               (given == load_.force.end() ? 0 : given->second[axis]);
  }
  for (std::size_t r = 0; r < size; ++r) {
    double free = u[axis_of(nodes[r / 3], static_cast<int>(r % 3))];
    for (std::size_t c = 0; c < size; ++c)
      free -= delassus.compliance[c * size + r] * force[c];
    delassus.free.push_back(free);
  }
  return delassus;
}

bool WarpedYielding::push(std::span<const NodeTouch> touches, std::span<const Vec3> at) {
  pushed_ = load_;
  for (const NodeTouch& t : touches)
    pushed_.force[t.node] += t.force;
  if (at.empty())
    nodes_.clear();
  WarpedStatics& solver = solver_();
  solver.update(pushed_, nodes_);
  if (at.empty())
    return true;
  const std::span<const double> u = solver.surface_displacement();
  double largest = 0, miss = 0;
  for (const double x : u)
    largest = std::max(largest, std::abs(x));
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    const Vec3 off = at[k] - model_.nodes[nodes_[k]].position - vector_at(u, nodes_[k]);
    for (int a = 0; a < 3; ++a)
      miss = !(std::abs(off[a]) <= miss) ? std::abs(off[a]) : miss;
  }
  if (miss <= met * largest)
    return true;
  if (++rounds_ < max_pushes)
    return false;
  solved_ = false;
  return true;
}

std::span<const double> WarpedYielding::shape() {
  return solver_().surface_displacement();
}

} // namespace gewebe
