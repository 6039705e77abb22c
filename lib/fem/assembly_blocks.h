#pragma once
// Matrices of any blocks that tetrahedra add between their nodes.

#include "base/context.h"
#include "fem/element.h"
#include "linalg/stiffness.h"
#include "tetrahedra/tet_mesh.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>

namespace gewebe::fem {

inline std::size_t solid_nodes(const tetrahedra::TetMesh& mesh) {
  return mesh.middles.empty() ? 4 : 10;
}

inline std::uint32_t solid_node(const tetrahedra::TetMesh& mesh, std::size_t t, std::size_t a) {
  return a < 4 ? mesh.tetrahedra[t][a] : mesh.middles[t][a - 4];
}

/// Between nodes a and b of tetrahedron t, [3 i + j] as in SolidBlock; called for each pair in one
/// order at least, from many threads.
using BlockOf = std::function<SolidBlock(std::size_t t, std::size_t a, std::size_t b)>;

/// As solid_stiffness, of the blocks given.
linalg::StiffnessMatrix assembled_matrix(const tetrahedra::TetMesh& mesh, const BlockOf& block_of,
                                         std::span<const std::uint8_t> fixed,
                                         const Context& context);

} // namespace gewebe::fem
