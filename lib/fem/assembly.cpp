#include "fem/assembly.h"

#include "base/error.h"
#include "base/parallel.h"
#include "fem/assembly_blocks.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace gewebe::fem {

namespace {

/// Of edges' lengths, that middles may stand away from the middle.
constexpr double straight = 1e-3;

std::size_t material_of(const tetrahedra::TetMesh& mesh, std::size_t t) {
  return mesh.material.empty() ? 0 : static_cast<std::size_t>(mesh.material[t]);
}

SolidBlock block(const tetrahedra::TetMesh& mesh, const SolidElement& e, std::size_t a,
                 std::size_t b) {
  return mesh.middles.empty() ? linear_block(e, a, b) : quadratic_block(e, a, b);
}

/// Where each node is used: 10 t + a, ascending.
struct Uses {
  std::vector<std::size_t> start;
  std::vector<std::size_t> at;
};

Uses uses_of(const tetrahedra::TetMesh& mesh) {
  const std::size_t count = solid_nodes(mesh);
  Uses uses;
  uses.start.resize(mesh.points.size() + 1);
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t)
    for (std::size_t a = 0; a < count; ++a)
      ++uses.start[std::size_t{solid_node(mesh, t, a)} + 1];
  for (std::size_t i = 0; i < mesh.points.size(); ++i)
    uses.start[i + 1] += uses.start[i];
  uses.at.resize(uses.start.back());
  std::vector<std::size_t> fill(uses.start.begin(), uses.start.end() - 1);
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t)
    for (std::size_t a = 0; a < count; ++a)
      uses.at[fill[solid_node(mesh, t, a)]++] = 10 * t + a;
  return uses;
}

/// The nodes from i on that share a tetrahedron with node i, ascending, i among them.
void neighbours(const tetrahedra::TetMesh& mesh, const Uses& uses, std::size_t i,
                std::vector<std::uint32_t>& found) {
  const std::size_t count = solid_nodes(mesh);
  found.assign(1, static_cast<std::uint32_t>(i));
  for (std::size_t k = uses.start[i]; k < uses.start[i + 1]; ++k)
    for (std::size_t b = 0; b < count; ++b)
      if (const std::uint32_t j = solid_node(mesh, uses.at[k] / 10, b); j > i)
        found.push_back(j);
  std::ranges::sort(found);
  const auto repeated = std::ranges::unique(found);
  found.erase(repeated.begin(), repeated.end());
}

std::size_t free_axes(const linalg::StiffnessMatrix& matrix, std::size_t node,
                      std::size_t first = 0) {
  std::size_t count = 0;
  for (std::size_t axis = first; axis < 3; ++axis)
    count += matrix.row_of_axis[3 * node + axis] >= 0 ? 1 : 0;
  return count;
}

void number_axes(std::size_t nodes, std::span<const std::uint8_t> fixed,
                 linalg::StiffnessMatrix& matrix) {
  matrix.row_of_axis.assign(3 * nodes, -1);
  for (std::size_t axis = 0; axis < 3 * nodes; ++axis)
    if (fixed.empty() || fixed[axis] == 0) {
      matrix.row_of_axis[axis] = static_cast<std::int64_t>(matrix.axis_of_row.size());
      matrix.axis_of_row.push_back(static_cast<std::int64_t>(axis));
    }
  if (matrix.order() == 0)
    throw Error("every node is fixed along every axis, expected a node that can move");
}

void check_middles(const tetrahedra::TetMesh& mesh, std::size_t t) {
  for (std::size_t k = 0; k < 6; ++k) {
    const auto [a, b] = tetrahedra::tetrahedron_edges[k];
    const Vec3 &p = mesh.points[mesh.tetrahedra[t][a]], &q = mesh.points[mesh.tetrahedra[t][b]];
    if (!(norm(mesh.points[mesh.middles[t][k]] - (p + q) / 2) <= straight * norm(q - p)))
      throw Error("tetrahedron " + std::to_string(t) +
                  " has a node away from the middle of its edge, expected straight sides");
  }
}

} // namespace

std::vector<SolidElement> solid_elements(const tetrahedra::TetMesh& mesh,
                                         std::span<const SolidMaterial> materials,
                                         const Context& context) {
  std::vector<Elasticity> elasticities;
  for (const SolidMaterial& m : materials) {
    elasticities.push_back(elasticity(m.young, m.poisson));
    if (!(m.density > 0 && std::isfinite(m.density)))
      throw Error("the density of a material is not a positive number");
  }
  std::vector<SolidElement> elements(mesh.tetrahedra.size());
  parallel_blocks(context, elements.size(), 1024, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const std::size_t m = material_of(mesh, t);
      if (m >= materials.size())
        throw Error("tetrahedron " + std::to_string(t) + " is of material " +
                    std::to_string(mesh.material.empty() ? 0 : mesh.material[t]) +
                    ", which is not there");
      if (!mesh.middles.empty())
        check_middles(mesh, t);
      const Tetrahedron& c = mesh.tetrahedra[t];
      const std::array<Vec3, 4> corners{mesh.points[c[0]], mesh.points[c[1]], mesh.points[c[2]],
                                        mesh.points[c[3]]};
      if (!(tetrahedra::tetrahedron_volume(corners[0], corners[1], corners[2], corners[3]) > 0))
        throw Error("tetrahedron " + std::to_string(t) + " has no positive volume");
      elements[t] = solid_element(corners, elasticities[m]);
      elements[t].law = materials[m].law;
    }
  });
  return elements;
}

linalg::StiffnessMatrix solid_stiffness(const tetrahedra::TetMesh& mesh,
                                        std::span<const SolidElement> elements,
                                        std::span<const std::uint8_t> fixed,
                                        const Context& context) {
  return assembled_matrix(
      mesh,
      [&](std::size_t t, std::size_t a, std::size_t b) { return block(mesh, elements[t], a, b); },
      fixed, context);
}

linalg::StiffnessMatrix assembled_matrix(const tetrahedra::TetMesh& mesh, const BlockOf& block_of,
                                         std::span<const std::uint8_t> fixed,
                                         const Context& context) {
  linalg::StiffnessMatrix matrix;
  const std::size_t nodes = mesh.points.size(), count = solid_nodes(mesh);
  number_axes(nodes, fixed, matrix);
  const Uses uses = uses_of(mesh);

  // Each node writes its own columns: their lengths first, then entries by ascending tetrahedra.
  std::vector<std::size_t> rows(nodes); // free axes of the nodes behind, joined to it
  parallel_blocks(context, nodes, 256, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint32_t> near;
    for (std::size_t i = begin; i < end; ++i) {
      neighbours(mesh, uses, i, near);
      for (std::size_t k = 1; k < near.size(); ++k)
        rows[i] += free_axes(matrix, near[k]);
    }
  });
  matrix.column_start.push_back(0);
  for (const std::int64_t axis : matrix.axis_of_row) {
    const std::size_t i = static_cast<std::size_t>(axis) / 3;
    matrix.column_start.push_back(
        matrix.column_start.back() +
        static_cast<std::int64_t>(rows[i] +
                                  free_axes(matrix, i, static_cast<std::size_t>(axis) % 3)));
  }
  matrix.row.resize(static_cast<std::size_t>(matrix.column_start.back()));
  matrix.value.resize(matrix.row.size());

  parallel_blocks(context, nodes, 256, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint32_t> near;
    std::vector<SolidBlock> blocks; // rows of the neighbour, columns of node i
    for (std::size_t i = begin; i < end; ++i) {
      if (free_axes(matrix, i) == 0)
        continue;
      neighbours(mesh, uses, i, near);
      blocks.assign(near.size(), {});
      for (std::size_t k = uses.start[i]; k < uses.start[i + 1]; ++k) {
        const std::size_t t = uses.at[k] / 10, a = uses.at[k] % 10;
        for (std::size_t b = 0; b < count; ++b)
          if (const std::uint32_t j = solid_node(mesh, t, b); j >= i) {
            const auto at =
                static_cast<std::size_t>(std::ranges::lower_bound(near, j) - near.begin());
            const SolidBlock added = block_of(t, b, a);
            for (std::size_t n = 0; n < 9; ++n)
              blocks[at][n] += added[n];
          }
      }
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::int64_t column = matrix.row_of_axis[3 * i + axis];
        if (column < 0)
          continue;
        auto at = static_cast<std::size_t>(matrix.column_start[static_cast<std::size_t>(column)]);
        for (std::size_t k = 0; k < near.size(); ++k)
          for (std::size_t b = k == 0 ? axis : 0; b < 3; ++b)
            if (const std::int64_t row = matrix.row_of_axis[3 * std::size_t{near[k]} + b];
                row >= 0) {
              matrix.row[at] = row;
              matrix.value[at++] = blocks[k][3 * b + axis];
            }
      }
    }
  });
  if (!std::ranges::all_of(matrix.value, [](double v) { return std::isfinite(v); }))
    throw Error("the stiffness of a node is too large to be a number");
  return matrix;
}

linalg::StiffnessMatrix sum(const linalg::StiffnessMatrix& a, const linalg::StiffnessMatrix& b) {
  if (a.row_of_axis != b.row_of_axis)
    throw Error("two stiffness matrices have different free axes");
  linalg::StiffnessMatrix result;
  result.row_of_axis = a.row_of_axis;
  result.axis_of_row = a.axis_of_row;
  result.column_start.push_back(0);
  for (std::size_t c = 0; c < a.order(); ++c) {
    auto i = static_cast<std::size_t>(a.column_start[c]),
         j = static_cast<std::size_t>(b.column_start[c]);
    const auto i_end = static_cast<std::size_t>(a.column_start[c + 1]),
               j_end = static_cast<std::size_t>(b.column_start[c + 1]);
    while (i < i_end || j < j_end) {
      const bool of_a = i < i_end && (j == j_end || a.row[i] <= b.row[j]),
                 of_b = j < j_end && (i == i_end || b.row[j] <= a.row[i]);
      result.row.push_back(of_a ? a.row[i] : b.row[j]);
      result.value.push_back((of_a ? a.value[i] : 0) + (of_b ? b.value[j] : 0));
      i += of_a ? 1 : 0;
      j += of_b ? 1 : 0;
    }
    result.column_start.push_back(static_cast<std::int64_t>(result.row.size()));
  }
  return result;
}

void multiply_solid(const tetrahedra::TetMesh& mesh, std::span<const SolidElement> elements,
                    std::span<const double> u, std::span<double> f) {
  std::ranges::fill(f, 0.0);
  const std::size_t count = solid_nodes(mesh);
  for (std::size_t t = 0; t < elements.size(); ++t)
    for (std::size_t a = 0; a < count; ++a)
      for (std::size_t b = 0; b < count; ++b) {
        const SolidBlock k = block(mesh, elements[t], a, b);
        const std::size_t row = 3 * std::size_t{solid_node(mesh, t, a)},
                          column = 3 * std::size_t{solid_node(mesh, t, b)};
        for (std::size_t i = 0; i < 3; ++i)
          f[row + i] +=
              k[3 * i] * u[column] + k[3 * i + 1] * u[column + 1] + k[3 * i + 2] * u[column + 2];
      }
}

std::vector<double> solid_masses(const tetrahedra::TetMesh& mesh,
                                 std::span<const SolidMaterial> materials) {
  std::vector<double> masses(mesh.points.size());
  const bool quadratic = !mesh.middles.empty();
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
    const Tetrahedron& c = mesh.tetrahedra[t];
    const double mass = materials[material_of(mesh, t)].density *
                        tetrahedra::tetrahedron_volume(mesh.points[c[0]], mesh.points[c[1]],
                                                       mesh.points[c[2]], mesh.points[c[3]]);
    for (std::size_t a = 0; a < solid_nodes(mesh); ++a)
      masses[solid_node(mesh, t, a)] += mass * (!quadratic ? 1.0 / 4 : a < 4 ? 1.0 / 36 : 4.0 / 27);
  }
  return masses;
}

std::vector<double> gravity_load(const tetrahedra::TetMesh& mesh,
                                 std::span<const SolidMaterial> materials,
                                 std::span<const SolidElement> elements, const Vec3& acceleration) {
  std::vector<double> load(3 * mesh.points.size());
  std::array<Vec3, 10> force;
  const std::size_t count = solid_nodes(mesh);
  for (std::size_t t = 0; t < elements.size(); ++t) {
    body_load(elements[t], materials[material_of(mesh, t)].density * acceleration,
              std::span(force).first(count));
    for (std::size_t a = 0; a < count; ++a)
      for (int axis = 0; axis < 3; ++axis)
        load[3 * std::size_t{solid_node(mesh, t, a)} + static_cast<std::size_t>(axis)] +=
            force[a][axis];
  }
  return load;
}

namespace {

/// Thirds of a force on three nodes.
void add_thirds(const tetrahedra::TetMesh& mesh, const tetrahedra::TetBoundary& of_mesh,
                std::uint32_t triangle, const Vec3& force, std::vector<double>& load) {
  for (std::size_t k = 0; k < 3; ++k) {
    const std::uint32_t node = mesh.middles.empty()
                                   ? of_mesh.node[of_mesh.mesh.triangles[triangle][k]]
                                   : of_mesh.middles[triangle][k];
    for (int axis = 0; axis < 3; ++axis)
      load[3 * std::size_t{node} + static_cast<std::size_t>(axis)] += force[axis] / 3;
  }
}

/// The triangle's normal, as long as its area.
Vec3 area(const tetrahedra::TetBoundary& of_mesh, std::uint32_t triangle) {
  const auto [a, b, c] = of_mesh.mesh.triangles[triangle];
  const std::vector<Vec3>& p = of_mesh.mesh.points;
  return cross(p[b] - p[a], p[c] - p[a]) / 2;
}

} // namespace

std::vector<double> traction_load(const tetrahedra::TetMesh& mesh,
                                  const tetrahedra::TetBoundary& of_mesh,
                                  std::span<const std::uint32_t> triangles, const Vec3& traction) {
  std::vector<double> load(3 * mesh.points.size());
  for (const std::uint32_t triangle : triangles)
    add_thirds(mesh, of_mesh, triangle, traction * norm(area(of_mesh, triangle)), load);
  return load;
}

std::vector<double> pressure_load(const tetrahedra::TetMesh& mesh,
                                  const tetrahedra::TetBoundary& of_mesh,
                                  std::span<const std::uint32_t> triangles, double pressure) {
  std::vector<double> load(3 * mesh.points.size());
  for (const std::uint32_t triangle : triangles)
    add_thirds(mesh, of_mesh, triangle, area(of_mesh, triangle) * -pressure, load);
  return load;
}

} // namespace gewebe::fem
