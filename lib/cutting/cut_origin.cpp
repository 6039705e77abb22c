#include "cutting/cut_origin.h"

#include "base/error.h"

#include <algorithm>
#include <numeric>
#include <string>
#include <tuple>

namespace gewebe::cutting {

namespace {

bool before_in_space(const Vec3& a, const Vec3& b) {
  return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
}

/// Places that nodes of either model are at, numbered.
class Places {
public:
  explicit Places(const model::Model& model) : order_(model.nodes.size()), nodes_(model.nodes) {
    std::iota(order_.begin(), order_.end(), 0U);
    std::stable_sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) {
      return before_in_space(nodes_[a].position, nodes_[b].position);
    });
  }
  /// The nodes there, ascending.
  std::pair<const std::uint32_t*, const std::uint32_t*> at(const Vec3& position) const {
    const auto first = std::lower_bound(
        order_.begin(), order_.end(), position,
        [&](std::uint32_t a, const Vec3& p) { return before_in_space(nodes_[a].position, p); });
    auto last = first;
    while (last != order_.end() && nodes_[*last].position == position)
      ++last;
    return {order_.data() + (first - order_.begin()), order_.data() + (last - order_.begin())};
  }

private:
  std::vector<std::uint32_t> order_;
  const std::vector<model::Node>& nodes_;
};

/// Where the other ends of a node's springs are, in order.
std::vector<Vec3> ends(const model::Model& model, std::uint32_t node) {
  std::vector<Vec3> ends;
  for (const model::Spring& s : model.springs)
    if (s.i == node || s.j == node)
      ends.push_back(model.nodes[s.i == node ? s.j : s.i].position);
  std::sort(ends.begin(), ends.end(), before_in_space);
  return ends;
}

std::uint32_t max_alike(const model::Model& before, const model::Model& after,
                        const std::uint32_t* first, const std::uint32_t* last, std::uint32_t node) {
  const std::vector<Vec3> own = ends(after, node);
  std::uint32_t best = *first;
  std::size_t max = 0;
  for (; first != last; ++first) {
    std::vector<Vec3> shared;
    const std::vector<Vec3> theirs = ends(before, *first);
    std::set_intersection(own.begin(), own.end(), theirs.begin(), theirs.end(),
                          std::back_inserter(shared), before_in_space);
    if (shared.size() > max) {
      max = shared.size();
      best = *first;
    }
  }
  return best;
}

} // namespace

CutOrigin find_cut_origin(const model::Model& before, const model::Model& after) {
  const Places places(before);
  CutOrigin cut;
  cut.place.assign(before.nodes.size(), gone_node);
  const std::size_t surface = std::min(model::surface_count(before), model::surface_count(after));
  for (std::uint32_t node = 0; node < after.nodes.size(); ++node) {
    const Vec3& position = after.nodes[node].position;
    const auto [first, last] = places.at(position);
    if (first == last)
      throw Error("node " + std::to_string(node) +
                  " is where the model before has none, expected a model that was cut from it");
    const bool own = node < surface && before.nodes[node].position == position;
    cut.origin.push_back(own                 ? node
                         : last - first == 1 ? *first
                                             : max_alike(before, after, first, last, node));
  }
  for (std::uint32_t node = 0; node < cut.origin.size(); ++node) {
    std::uint32_t& place = cut.place[cut.origin[node]];
    if (place == gone_node || cut.origin[node] == node)
      place = node;
  }
  return cut;
}

} // namespace gewebe::cutting
