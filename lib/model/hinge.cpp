#include "model/hinge.h"

#include <array>
#include <cmath>
#include <utility>

namespace gewebe::model {

namespace {

constexpr double parallel = 1e-12; // of the largest: a pivot below is 0; squares of lengths

using Matrix = std::array<std::array<double, 6>, 6>;

/// Rank of a positive semidefinite matrix, by Cholesky's method with the largest pivot first.
int rank(Matrix m) {
  double largest = 0;
  for (std::size_t i = 0; i < 6; ++i)
    largest = std::fmax(largest, m[i][i]);
  for (std::size_t step = 0; step < 6; ++step) {
    std::size_t at = step;
    for (std::size_t i = step; i < 6; ++i)
      if (m[i][i] > m[at][at])
        at = i;
    if (!(m[at][at] > parallel * largest))
      return static_cast<int>(step);
    std::swap(m[step], m[at]);
    for (auto& row : m)
      std::swap(row[step], row[at]);
    for (std::size_t i = step + 1; i < 6; ++i)
      for (std::size_t j = step + 1; j < 6; ++j)
        m[i][j] -= m[i][step] * m[step][j] / m[step][step];
  }
  return 6;
}

struct Held {
  std::size_t nodes = 0, held = 0;
  bool central = false;
  Vec3 mean;
  double size = 0;
  Matrix motions{}; // sum over held axes of the products of what each rigid motion does to them
};

} // namespace

std::vector<Hinged> hinged_components(const Model& model) {
  const Components parts = components(model);
  const std::size_t surface = body_count(model);
  std::vector<Held> held(parts.count);
  std::vector<std::size_t> held_nodes;
  for (std::size_t i = 0; i < model.nodes.size(); ++i) {
    Held& h = held[parts.of_node[i]];
    h.nodes += i < surface ? 1 : 0;
    if (model.nodes[i].fixed == fixed_none)
      continue;
    held_nodes.push_back(i);
    h.central = h.central || i >= surface;
    h.mean += model.nodes[i].position;
    ++h.held;
  }
  for (Held& h : held)
    if (h.held > 0)
      h.mean = h.mean / static_cast<double>(h.held);
  for (std::size_t i = 0; i < model.nodes.size(); ++i) {
    Held& h = held[parts.of_node[i]];
    h.size = std::fmax(h.size, norm(model.nodes[i].position - h.mean));
  }
  for (const std::size_t i : held_nodes) {
    Held& h = held[parts.of_node[i]];
    if (!h.central || !(h.size > 0))
      continue;
    const Vec3 p = (model.nodes[i].position - h.mean) / h.size;
    for (int axis = 0; axis < 3; ++axis) {
      if ((model.nodes[i].fixed >> axis & 1) == 0)
        continue;
      // Moved along `axis` by a unit of each translation and of each turn about the mean.
      std::array<double, 6> by{};
      by[static_cast<std::size_t>(axis)] = 1;
      const int next = (axis + 1) % 3, last = (axis + 2) % 3;
      by[static_cast<std::size_t>(3 + next)] = p[last];
      by[static_cast<std::size_t>(3 + last)] = -p[next];
      for (std::size_t r = 0; r < 6; ++r)
        for (std::size_t c = 0; c < 6; ++c)
          h.motions[r][c] += by[r] * by[c];
    }
  }
  std::vector<Hinged> hinged;
  for (std::uint32_t c = 0; c < parts.count; ++c)
    if (held[c].central && rank(held[c].motions) < 6)
      hinged.push_back({c, held[c].nodes, held[c].held});
  return hinged;
}

} // namespace gewebe::model
