#pragma once
// A surface that follows the elements of a solid: what it was made of goes along with it, with its
// texture coordinates and materials, however coarse the elements are.
//
// A point of the skin belongs to one element. With q the point of that element, at rest, which is
// nearest to the skin's point x (x itself where the element holds it), it is displaced by
//
//   u(q) + grad u(q) (x - q),
//
// u being the element's displacements: linear or quadratic functions of the barycentric coordinates
// without the bubble, which has no node. So outside the element the skin goes on with the strain
// and the rotation at q, not with the quadratic functions, which leave all bounds there.
// This is a sum of weights times the displacements of the nodes. It is continuous where the skin
// lies inside, since u is.

#include "base/context.h"
#include "geometry/mesh.h"
#include "geometry/vec3.h"
#include "model/model.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::embedding {

/// How the points of a skin follow nodes.
struct SkinWeights {
  std::size_t nodes = 4;           ///< of each point: 4 or 10
  std::vector<std::uint32_t> node; ///< in the order of the element, corners first
  std::vector<double> weight;      ///< as many; those of a point sum to 1
};
/// Of a model's skin, none where it has none. \pre check_model(model) passes
SkinWeights skin_weights(const model::Model& model);

/// Where points of a skin are. \param rest of the skin \param displacement of the model's nodes,
/// x, y, z of each \pre all nodes of `weights` are among them
std::vector<Vec3> displaced_skin(const SkinWeights& weights, std::span<const Vec3> rest,
                                 std::span<const double> displacement);

struct SkinReport {
  std::uint64_t dropped_triangles = 0; ///< with two equal corners
  std::uint64_t points_outside = 0;    ///< of the skin, outside all elements
  double farthest = 0;                 ///< of them, mm
};

/// Makes a surface the model's skin: each point that a triangle uses, in their order, follows the
/// nearest element, the first of several. \param material of each triangle; empty: 0
/// \pre check_mesh(surface) passes, the model has tetrahedra and the materials
/// \throw Error if no triangle is left; Cancelled
SkinReport add_skin(model::Model& model, const TriangleMesh& surface,
                    std::span<const std::int32_t> material, const Context& context);

} // namespace gewebe::embedding
