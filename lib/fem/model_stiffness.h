#pragma once
// The stiffness of a model: what its springs add (linalg/stiffness.h) and what its tetrahedra add
// (fem/assembly.h), linearised at rest.

#include "base/context.h"
#include "fem/element.h"
#include "geometry/vec3.h"
#include "linalg/stiffness.h"
#include "model/model.h"
#include "tetrahedra/tet_mesh.h"

#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::fem {

/// K of the model on the axes that `fixed` (empty, or 3 n flags) and the model's own constraints
/// leave free. The same bytes on any number of threads. \pre check_model(model) passes
/// \throw Error if no axis is free, or a sum isn't finite; Cancelled
linalg::StiffnessMatrix stiffness_matrix(const model::Model& model,
                                         std::span<const std::uint8_t> fixed = {},
                                         const Context& context = {});

/// K as an operator, to multiply more than once. Keeps a reference to the model.
class StiffnessOperator {
public:
  /// \pre check_model(model) passes   \throw Error as solid_elements; Cancelled
  explicit StiffnessOperator(const model::Model& model, const Context& context = {});

  /// f = K u over all 3 n axes, the fixed ones too, whose f are what the supports must hold
  /// against: reactions. \pre u.size() == f.size() == 3 n
  void multiply(std::span<const double> u, std::span<double> f) const;

private:
  const model::Model& model_;
  std::vector<linalg::SymmetricBlock> springs_;
  tetrahedra::TetMesh mesh_;
  std::vector<SolidElement> elements_;
};

/// f = K u once.
void multiply_stiffness(const model::Model& model, std::span<const double> u, std::span<double> f);

/// The forces of gravity on each axis under an acceleration in mm/s²: of a node its mass times
/// that; what its tetrahedra give it of its mass acts by consistent loads instead (gravity_load),
/// for those of quadratic elements differ from lumped masses.
std::vector<double> weight_of(const model::Model& model, const Vec3& acceleration);

} // namespace gewebe::fem
