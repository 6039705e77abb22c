#include "incision/cut_link_internal.h"

#include "base/disjoint_sets.h"

#include <algorithm>

namespace gewebe::incision {
namespace {

std::vector<NodeLink::Vertex> vertices_of(const std::vector<NodeLink::Face>& faces) {
  std::vector<NodeLink::Vertex> vertices;
  for (const NodeLink::Face& face : faces)
    vertices.insert(vertices.end(), face.ends.begin(), face.ends.end());
  std::ranges::sort(vertices);
  const auto repeated = std::ranges::unique(vertices);
  vertices.erase(repeated.begin(), repeated.end());
  return vertices;
}

/// Looks for ways between the two loops of a ring.
class Crossing {
public:
  explicit Crossing(const std::vector<NodeLink::Face>& faces)
      : faces_(faces), vertices_(vertices_of(faces)), degree_(vertices_.size()),
        loops_(vertices_.size()) {
    for (const NodeLink::Face& face : faces) {
      ends_.push_back({number(face.ends[0]), number(face.ends[1])});
      for (const std::uint32_t end : ends_.back())
        degree_[end] += face.open ? 1 : 0;
    }
    for (std::size_t f = 0; f < faces.size(); ++f)
      if (const auto& [a, b] = ends_[f]; faces[f].open && is_passed_once(a) && is_passed_once(b))
        loops_.join(a, b);
  }

  std::vector<std::uint32_t> ways(std::size_t most) {
    const auto meetings = std::ranges::count_if(degree_, [](std::uint32_t d) { return d > 2; });
    const std::uint32_t old = old_loop();
    if (loop_count() != 2 || meetings > 1 || old == none)
      return {};
    blocked_.assign(vertices_.size(), false);
    for (std::size_t v = 0; v < blocked_.size(); ++v)
      blocked_[v] = degree_[v] > 2;
    std::vector<std::uint32_t> ways = shortest(old, most);
    if (ways.empty() || meetings == 1)
      return ways;
    const std::vector<std::uint32_t> second = shortest(old, most);
    if (second.empty())
      return {};
    ways.insert(ways.end(), second.begin(), second.end());
    return ways;
  }

private:
  static constexpr std::uint32_t none = UINT32_MAX;

  std::uint32_t number(const NodeLink::Vertex& vertex) const {
    return static_cast<std::uint32_t>(std::ranges::lower_bound(vertices_, vertex) -
                                      vertices_.begin());
  }
  bool is_passed_once(std::uint32_t vertex) const { return degree_[vertex] == 2; }

  /// Number of loops, without the vertices where they meet.
  std::size_t loop_count() {
    std::size_t count = 0;
    for (std::uint32_t v = 0; v < vertices_.size(); ++v)
      count += is_passed_once(v) && loops_.find(v) == v ? 1 : 0;
    return count;
  }

  /// The first with an edge that was open before.
  std::uint32_t old_loop() {
    std::uint32_t first = none;
    for (std::size_t f = 0; f < faces_.size(); ++f)
      for (const std::uint32_t end : ends_[f])
        if (faces_[f].open && faces_[f].old && is_passed_once(end))
          first = std::min(first, loops_.find(end));
    return first;
  }

  /// From one loop to the other, breadth first, beside what is blocked; blocks its own vertices.
  std::vector<std::uint32_t> shortest(std::uint32_t loop, std::size_t most) {
    struct Step {
      std::uint32_t vertex = 0, from = 0, face = 0;
      std::size_t length = 0;
    };
    std::vector<Step> steps;
    std::vector<bool> seen = blocked_;
    for (std::uint32_t v = 0; v < vertices_.size(); ++v)
      if (is_passed_once(v) && loops_.find(v) == loop) {
        if (!seen[v])
          steps.push_back({v, 0, 0, 0});
        seen[v] = true;
      }
    for (std::size_t n = 0; n < steps.size(); ++n) {
      const Step step = steps[n];
      if (step.length > 0 && is_passed_once(step.vertex)) {
        std::vector<std::uint32_t> way;
        std::size_t k = n;
        for (; steps[k].length > 0; k = steps[k].from) {
          way.push_back(steps[k].face);
          blocked_[steps[k].vertex] = true;
        }
        blocked_[steps[k].vertex] = true;
        return way;
      }
      if (step.length == most)
        continue;
      for (std::size_t f = 0; f < faces_.size(); ++f) {
        const auto& [a, b] = ends_[f];
        if (faces_[f].open || (a != step.vertex && b != step.vertex))
          continue;
        const std::uint32_t next = a == step.vertex ? b : a;
        if (seen[next])
          continue;
        seen[next] = true;
        steps.push_back({next, static_cast<std::uint32_t>(n), faces_[f].number, step.length + 1});
      }
    }
    return {};
  }

  const std::vector<NodeLink::Face>& faces_;
  std::vector<NodeLink::Vertex> vertices_;
  std::vector<std::array<std::uint32_t, 2>> ends_; // of each face
  std::vector<std::uint32_t> degree_;              // open faces at each vertex
  DisjointSets loops_;
  std::vector<bool> blocked_;
};

} // namespace

void NodeLink::add(const std::array<Face, 3>& faces) {
  faces_.insert(faces_.end(), faces.begin(), faces.end());
  ++tetrahedra_;
}

int NodeLink::euler_number() const {
  const auto open = std::ranges::count_if(faces_, &Face::open);
  const auto edges = (static_cast<std::ptrdiff_t>(faces_.size()) + open) / 2;
  return static_cast<int>(static_cast<std::ptrdiff_t>(vertices_of(faces_).size()) - edges +
                          static_cast<std::ptrdiff_t>(tetrahedra_));
}

std::vector<std::uint32_t> NodeLink::ways_across(std::size_t most) const {
  return Crossing(faces_).ways(most);
}

} // namespace gewebe::incision
