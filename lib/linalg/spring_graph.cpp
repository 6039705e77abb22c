#include "linalg/spring_graph.h"

namespace gewebe::linalg {

SpringGraph spring_graph(const model::Model& model) {
  const std::size_t n = model.nodes.size();
  SpringGraph graph;
  graph.start.assign(n + 1, 0);
  for (const model::Spring& s : model.springs)
    if (s.stiffness != 0) {
      ++graph.start[s.i + std::size_t{1}];
      ++graph.start[s.j + std::size_t{1}];
    }
  for (std::size_t i = 0; i < n; ++i)
    graph.start[i + 1] += graph.start[i];
  graph.node.resize(graph.start[n]);
  graph.spring.resize(graph.start[n]);
  std::vector<std::size_t> fill(graph.start.begin(), graph.start.end() - 1);
  for (std::uint32_t e = 0; e < model.springs.size(); ++e) {
    const model::Spring& s = model.springs[e];
    if (s.stiffness == 0)
      continue;
    graph.node[fill[s.i]] = s.j;
    graph.spring[fill[s.i]++] = e;
    graph.node[fill[s.j]] = s.i;
    graph.spring[fill[s.j]++] = e;
  }
  graph.axes.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const unsigned fixed = model.nodes[i].fixed;
    graph.axes[i] =
        static_cast<std::uint8_t>(3 - ((fixed & 1) + (fixed >> 1 & 1) + (fixed >> 2 & 1)));
  }
  return graph;
}

} // namespace gewebe::linalg
