#include "linalg/stiffness.h"

#include "base/error.h"

#include <algorithm>
#include <array>
#include <cmath>

// Based on: Bro-Nielsen, Finite Element Modeling in Surgery Simulation, 1998 (K u = f of the object
// linearised at rest).

namespace gewebe::linalg {

SymmetricBlock stiffness_block(const model::Model& model, const model::Spring& s) {
  const Vec3 d = model.nodes[s.j].position - model.nodes[s.i].position;
  const double l = norm(d);
  const Vec3 n = d / l;
  const double across = 1 - s.rest / l;
  const auto value = [&](int a, int b) {
    const double nn = n[a] * n[b];
    return s.stiffness * (nn + across * ((a == b ? 1 : 0) - nn));
  };
  return {value(0, 0), value(0, 1), value(0, 2), value(1, 1), value(1, 2), value(2, 2)};
}

namespace {

using Block = SymmetricBlock;

constexpr std::array<std::array<std::size_t, 3>, 3> entry{{{0, 1, 2}, {1, 3, 4}, {2, 4, 5}}};

/// The springs that start at each node, by their other end.
struct Rows {
  std::vector<std::size_t> start; ///< n + 1
  std::vector<std::size_t> spring;
};

Rows rows_of(const model::Model& model) {
  Rows rows;
  rows.start.resize(model.nodes.size() + 1);
  for (const model::Spring& s : model.springs)
    ++rows.start[s.i + std::size_t{1}];
  for (std::size_t i = 0; i < model.nodes.size(); ++i)
    rows.start[i + 1] += rows.start[i];
  rows.spring.resize(model.springs.size());
  std::vector<std::size_t> fill(rows.start.begin(), rows.start.end() - 1);
  for (std::size_t e = 0; e < model.springs.size(); ++e)
    rows.spring[fill[model.springs[e].i]++] = e;
  const auto nearer = [&](std::size_t a, std::size_t b) {
    return model.springs[a].j < model.springs[b].j;
  };
  for (std::size_t i = 0; i < model.nodes.size(); ++i)
    std::sort(rows.spring.begin() + static_cast<std::ptrdiff_t>(rows.start[i]),
              rows.spring.begin() + static_cast<std::ptrdiff_t>(rows.start[i + 1]), nearer);
  return rows;
}

void number_axes(const model::Model& model, std::span<const std::uint8_t> fixed,
                 StiffnessMatrix& matrix) {
  matrix.row_of_axis.assign(3 * model.nodes.size(), -1);
  for (std::size_t i = 0; i < model.nodes.size(); ++i)
    for (std::size_t a = 0; a < 3; ++a) {
      const std::size_t axis = 3 * i + a;
      if ((model.nodes[i].fixed >> a & 1) != 0 || (!fixed.empty() && fixed[axis] != 0))
        continue;
      matrix.row_of_axis[axis] = static_cast<std::int64_t>(matrix.axis_of_row.size());
      matrix.axis_of_row.push_back(static_cast<std::int64_t>(axis));
    }
}

} // namespace

namespace {

/// \param left_out whether a spring makes no entry
template <class LeftOut>
StiffnessMatrix assemble(const model::Model& model, std::span<const Block> blocks,
                         std::span<const double> added, std::span<const std::uint8_t> fixed,
                         LeftOut&& left_out) {
  StiffnessMatrix matrix;
  number_axes(model, fixed, matrix);
  if (matrix.order() == 0)
    throw Error("every node is fixed along every axis, expected a node that can move");

  std::vector<Block> diagonal(model.nodes.size());
  for (std::size_t e = 0; e < model.springs.size(); ++e) {
    const model::Spring& s = model.springs[e];
    for (std::size_t k = 0; k < 6; ++k) {
      diagonal[s.i][k] += blocks[e][k];
      diagonal[s.j][k] += blocks[e][k];
    }
  }
  for (std::size_t i = 0; i < added.size(); ++i)
    for (std::size_t a = 0; a < 3; ++a)
      diagonal[i][entry[a][a]] += added[i];

  const Rows rows = rows_of(model);
  matrix.column_start.reserve(matrix.order() + 1);
  matrix.row.reserve(matrix.order() * 2 + model.springs.size() * 9);
  matrix.value.reserve(matrix.row.capacity());
  bool finite = true;
  const auto add = [&](std::int64_t row, double value) {
    finite = finite && std::isfinite(value);
    matrix.row.push_back(row);
    matrix.value.push_back(value);
  };
  for (std::size_t i = 0; i < model.nodes.size(); ++i)
    for (std::size_t a = 0; a < 3; ++a) {
      if (matrix.row_of_axis[3 * i + a] < 0)
        continue;
      matrix.column_start.push_back(static_cast<std::int64_t>(matrix.row.size()));
      for (std::size_t b = a; b < 3; ++b)
        if (const std::int64_t row = matrix.row_of_axis[3 * i + b]; row >= 0)
          add(row, diagonal[i][entry[a][b]]);
      for (std::size_t r = rows.start[i]; r < rows.start[i + 1]; ++r) {
        const std::size_t e = rows.spring[r];
        if (left_out(model.springs[e]))
          continue;
        for (std::size_t b = 0; b < 3; ++b)
          if (const std::int64_t row = matrix.row_of_axis[3 * std::size_t{model.springs[e].j} + b];
              row >= 0)
            add(row, -blocks[e][entry[a][b]]);
      }
    }
  matrix.column_start.push_back(static_cast<std::int64_t>(matrix.row.size()));
  if (!finite)
    throw Error("the stiffness of a node is too large to be a number");
  return matrix;
}

} // namespace

StiffnessMatrix spring_stiffness(const model::Model& model, std::span<const std::uint8_t> fixed) {
  std::vector<Block> blocks(model.springs.size());
  for (std::size_t e = 0; e < blocks.size(); ++e)
    blocks[e] = stiffness_block(model, model.springs[e]);
  return assemble(model, blocks, {}, fixed,
                  [](const model::Spring& s) { return s.stiffness == 0; });
}

StiffnessMatrix spring_matrix(const model::Model& model, std::span<const SymmetricBlock> blocks,
                              std::span<const double> diagonal,
                              std::span<const std::uint8_t> fixed) {
  return assemble(model, blocks, diagonal, fixed,
                  [](const model::Spring& s) { return s.stiffness == 0 && s.damping == 0; });
}

namespace {

void multiply_spring(const model::Spring& s, const SymmetricBlock& block, std::span<const double> u,
                     std::span<double> f) {
  const std::size_t i = 3 * std::size_t{s.i}, j = 3 * std::size_t{s.j};
  const std::array<double, 3> stretch{u[i] - u[j], u[i + 1] - u[j + 1], u[i + 2] - u[j + 2]};
  for (std::size_t a = 0; a < 3; ++a) {
    const double force = block[entry[a][0]] * stretch[0] + block[entry[a][1]] * stretch[1] +
                         block[entry[a][2]] * stretch[2];
    f[i + a] += force;
    f[j + a] -= force;
  }
}

} // namespace

std::vector<SymmetricBlock> stiffness_blocks(const model::Model& model) {
  std::vector<SymmetricBlock> blocks;
  blocks.reserve(model.springs.size());
  for (const model::Spring& s : model.springs)
    blocks.push_back(stiffness_block(model, s));
  return blocks;
}

void multiply_springs(const model::Model& model, std::span<const SymmetricBlock> blocks,
                      std::span<const double> u, std::span<double> f) {
  std::fill(f.begin(), f.end(), 0.0);
  for (std::size_t k = 0; k < blocks.size(); ++k)
    multiply_spring(model.springs[k], blocks[k], u, f);
}

double stiffness_norm(const StiffnessMatrix& matrix) {
  std::vector<double> sum(matrix.order());
  for (std::size_t c = 0; c < matrix.order(); ++c)
    for (auto at = static_cast<std::size_t>(matrix.column_start[c]);
         at < static_cast<std::size_t>(matrix.column_start[c + 1]); ++at) {
      const auto r = static_cast<std::size_t>(matrix.row[at]);
      sum[c] += std::abs(matrix.value[at]);
      if (r != c)
        sum[r] += std::abs(matrix.value[at]);
    }
  return *std::max_element(sum.begin(), sum.end());
}

void multiply(const StiffnessMatrix& matrix, std::span<const double> x, std::span<double> y) {
  std::fill(y.begin(), y.end(), 0.0);
  for (std::size_t c = 0; c < matrix.order(); ++c) {
    double sum = 0;
    for (auto at = static_cast<std::size_t>(matrix.column_start[c]);
         at < static_cast<std::size_t>(matrix.column_start[c + 1]); ++at) {
      const auto r = static_cast<std::size_t>(matrix.row[at]);
      sum += matrix.value[at] * x[r];
      if (r != c)
        y[r] += matrix.value[at] * x[c];
    }
    y[c] += sum;
  }
}

} // namespace gewebe::linalg
