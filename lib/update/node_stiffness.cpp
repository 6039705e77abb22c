#include "update/node_stiffness.h"

#include "cutting/cut.h"
#include "fem/assembly_blocks.h"
#include "fem/element.h"
#include "fem/solid_model.h"
#include "numeric/larger.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <set>
#include <utility>

namespace gewebe::update {
namespace {

constexpr std::uint32_t none = UINT32_MAX;

std::size_t nodes_of(const model::Model& model) {
  return model.middles.empty() ? 4 : 10;
}
std::uint32_t node_of(const model::Model& model, std::size_t t, std::size_t a) {
  return a < 4 ? model.tetrahedra[t][a] : model.middles[t][a - 4];
}

/// Rows of some nodes.
class Rows {
public:
  Rows(const model::Model& model, std::span<const std::uint32_t> rows)
      : model_(model), rows_(rows), row_of_(model.nodes.size(), none) {
    for (std::uint32_t r = 0; r < rows.size(); ++r)
      row_of_[rows[r]] = r;
    find_elements();
  }

  /// Appends those of the node, with their blocks.
  void write(std::uint32_t node, linalg::NodeMatrix& matrix) {
    const std::uint32_t r = row_of_[node];
    const std::size_t count = nodes_of(model_);
    near_.clear();
    for (std::size_t k = first_[r]; k < first_[r + 1]; ++k)
      for (std::size_t b = 0; b < count; ++b)
        if (const std::uint32_t other = node_of(model_, tetrahedron_[uses_[k] / 10], b);
            other != node)
          near_.push_back(other);
    std::ranges::sort(near_);
    const auto repeated = std::ranges::unique(near_);
    near_.erase(repeated.begin(), repeated.end());
    const std::size_t begin = matrix.block.size();
    matrix.block.resize(begin + near_.size());
    linalg::SymmetricBlock& diagonal = matrix.diagonal[node] = {};
    for (std::size_t k = first_[r]; k < first_[r + 1]; ++k) {
      const std::size_t e = uses_[k] / 10, a = uses_[k] % 10;
      for (std::size_t b = 0; b < count; ++b) {
        const fem::SolidBlock part = count == 4 ? fem::linear_block(element_[e], a, b)
                                                : fem::quadratic_block(element_[e], a, b);
        if (b == a) {
          constexpr std::array<std::size_t, 6> upper{0, 1, 2, 4, 5, 8};
          for (std::size_t n = 0; n < 6; ++n)
            diagonal[n] += part[upper[n]];
          continue;
        }
        const std::uint32_t other = node_of(model_, tetrahedron_[e], b);
        const auto at =
            static_cast<std::size_t>(std::ranges::lower_bound(near_, other) - near_.begin());
        for (std::size_t n = 0; n < 9; ++n)
          matrix.block[begin + at][n] += part[n];
      }
    }
    for (std::size_t k = 0; k < near_.size(); ++k) {
      matrix.node.push_back(near_[k]);
      matrix.at.push_back(static_cast<std::uint32_t>(begin + k));
    }
  }

private:
  /// Those that have one of the nodes, ascending.
  void find_elements() {
    const std::vector<fem::SolidMaterial> materials = fem::element_materials(model_);
    std::vector<fem::Elasticity> elasticities;
    for (const fem::SolidMaterial& m : materials)
      elasticities.push_back(fem::elasticity(m.young, m.poisson));
    const std::size_t count = nodes_of(model_);
    first_.assign(rows_.size() + 1, 0);
    for (std::uint32_t t = 0; t < model_.tetrahedra.size(); ++t) {
      bool near = false;
      for (std::size_t a = 0; a < count; ++a)
        if (const std::uint32_t r = row_of_[node_of(model_, t, a)]; r != none) {
          ++first_[r + std::size_t{1}];
          near = true;
        }
      if (!near)
        continue;
      tetrahedron_.push_back(t);
      std::array<Vec3, 4> corners;
      for (std::size_t k = 0; k < 4; ++k)
        corners[k] = model_.nodes[model_.tetrahedra[t][k]].position;
      element_.push_back(fem::solid_element(
          corners, elasticities[static_cast<std::size_t>(model_.tetrahedron_material[t])]));
    }
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    uses_.resize(first_.back());
    std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
    for (std::size_t e = 0; e < tetrahedron_.size(); ++e)
      for (std::size_t a = 0; a < count; ++a)
        if (const std::uint32_t r = row_of_[node_of(model_, tetrahedron_[e], a)]; r != none)
          uses_[next[r]++] = 10 * e + a;
  }

  const model::Model& model_;
  std::span<const std::uint32_t> rows_;
  std::vector<std::uint32_t> row_of_; // by node: which of the rows, or none
  std::vector<std::uint32_t> tetrahedron_;
  std::vector<fem::SolidElement> element_;
  std::vector<std::size_t> first_, uses_; // of each row: 10 e + a
  std::vector<std::uint32_t> near_;
};

void write_axes(const model::Model& model, linalg::NodeMatrix& matrix) {
  matrix.fixed.resize(model.nodes.size());
  matrix.axes.resize(model.nodes.size());
  for (std::size_t i = 0; i < model.nodes.size(); ++i) {
    const unsigned fixed = model.nodes[i].fixed;
    matrix.fixed[i] = static_cast<std::uint8_t>(fixed);
    matrix.axes[i] =
        static_cast<std::uint8_t>(3 - ((fixed & 1) + (fixed >> 1 & 1) + (fixed >> 2 & 1)));
  }
}

} // namespace

linalg::NodeMatrix node_stiffness(const model::Model& model) {
  linalg::NodeMatrix matrix;
  std::vector<std::uint32_t> all(model.nodes.size());
  std::iota(all.begin(), all.end(), 0U);
  update_node_stiffness(matrix, model, all);
  return matrix;
}

void update_node_stiffness(linalg::NodeMatrix& matrix, const model::Model& model,
                           std::span<const std::uint32_t> rows) {
  Rows written(model, rows);
  linalg::NodeMatrix next;
  next.start.reserve(model.nodes.size() + 1);
  next.node.reserve(matrix.node.size() + 64 * rows.size());
  next.at.reserve(next.node.capacity());
  next.block = std::move(matrix.block);
  next.diagonal = std::move(matrix.diagonal);
  next.diagonal.resize(model.nodes.size());
  // Old blocks of rows that were replaced stay in memory until there are too many.
  if (next.block.size() > 2 * matrix.node.size()) {
    std::vector<std::array<double, 9>> kept;
    kept.reserve(next.block.size() / 2);
    for (std::uint32_t& at : matrix.at) {
      kept.push_back(next.block[at]);
      at = static_cast<std::uint32_t>(kept.size() - 1);
    }
    next.block = std::move(kept);
  }
  const auto keep = [&](std::size_t first, std::size_t last) { // rows that are as they were
    if (first == last)
      return;
    const std::size_t begin = matrix.start[first], end = matrix.start[last], now = next.node.size();
    const auto append = [&](std::vector<std::uint32_t>& to,
                            const std::vector<std::uint32_t>& from) {
      to.insert(to.end(), from.begin() + static_cast<std::ptrdiff_t>(begin),
                from.begin() + static_cast<std::ptrdiff_t>(end));
    };
    append(next.node, matrix.node);
    append(next.at, matrix.at);
    for (std::size_t i = first; i < last; ++i)
      next.start.push_back(matrix.start[i + 1] - begin + now);
  };
  std::size_t done = 0;
  for (const std::uint32_t row : rows) {
    keep(done, row);
    written.write(row, next);
    next.start.push_back(next.node.size());
    done = row + std::size_t{1};
  }
  keep(done, model.nodes.size());
  write_axes(model, next);
  matrix = std::move(next);
}

std::vector<std::uint32_t> changed_rows(const model::Model& before, const model::Model& now,
                                        std::span<const std::uint32_t> place) {
  using Element = std::array<std::uint32_t, 10>;
  const std::size_t count = nodes_of(now);
  std::vector<std::uint8_t> changed(now.nodes.size()), reached(now.nodes.size());
  bool stay = before.tetrahedra.size() <= now.tetrahedra.size();
  for (std::uint32_t i = 0; i < place.size(); ++i) {
    stay = stay && place[i] == i;
    if (place[i] == cutting::CutModel::gone)
      continue;
    reached[place[i]] = 1;
    if (!(before.nodes[i].position == now.nodes[place[i]].position))
      changed[place[i]] = 2; // and with it all of its elements
  }
  for (std::size_t i = 0; i < now.nodes.size(); ++i)
    if (reached[i] == 0)
      changed[i] = 1;
  const auto mark = [&](const Element& e) {
    for (std::size_t a = 0; a < count; ++a)
      if (e[a] != none)
        changed[e[a]] = std::max<std::uint8_t>(changed[e[a]], 1);
  };
  const auto element_now = [&](std::size_t t) {
    Element e{};
    for (std::size_t a = 0; a < count; ++a)
      e[a] = node_of(now, t, a);
    return e;
  };
  const auto element_before = [&](std::size_t t) {
    Element e{};
    for (std::size_t a = 0; a < count; ++a) {
      const std::uint32_t to = place[node_of(before, t, a)];
      e[a] = to == cutting::CutModel::gone ? none : to;
    }
    return e;
  };
  if (stay) {
    for (std::size_t t = 0; t < now.tetrahedra.size(); ++t) {
      const Element is = element_now(t);
      bool same = t < before.tetrahedra.size();
      for (std::size_t a = 0; a < count; ++a)
        same = same && is[a] == node_of(before, t, a) && changed[is[a]] != 2;
      if (same)
        continue;
      mark(is);
      if (t < before.tetrahedra.size())
        mark(element_before(t));
    }
  } else {
    std::set<Element> had;
    for (std::size_t t = 0; t < before.tetrahedra.size(); ++t)
      had.insert(element_before(t));
    for (std::size_t t = 0; t < now.tetrahedra.size(); ++t) {
      const Element is = element_now(t);
      const bool same = had.erase(is) > 0;
      bool moved = false;
      for (std::size_t a = 0; a < count; ++a)
        moved = moved || changed[is[a]] == 2;
      if (!same || moved)
        mark(is);
    }
    for (const Element& gone : had)
      mark(gone);
  }
  std::vector<std::uint32_t> rows;
  for (std::uint32_t i = 0; i < changed.size(); ++i)
    if (changed[i] != 0)
      rows.push_back(i);
  return rows;
}

double row_norm(const linalg::NodeMatrix& matrix, std::size_t node) {
  constexpr std::array<std::array<std::size_t, 3>, 3> entry{{{0, 1, 2}, {1, 3, 4}, {2, 4, 5}}};
  double norm = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    if ((matrix.fixed[node] >> a & 1) != 0)
      continue;
    double sum = 0;
    for (std::size_t b = 0; b < 3; ++b)
      sum += (matrix.fixed[node] >> b & 1) != 0 ? 0 : std::abs(matrix.diagonal[node][entry[a][b]]);
    for (std::size_t k = matrix.start[node]; k < matrix.start[node + 1]; ++k)
      for (std::size_t b = 0; b < 3; ++b)
        sum += (matrix.fixed[matrix.node[k]] >> b & 1) != 0
                   ? 0
                   : std::abs(matrix.block[matrix.at[k]][3 * a + b]);
    norm = numeric::larger(norm, sum);
  }
  return norm;
}

} // namespace gewebe::update
