#pragma once
// Newton's method of a hyperelastic solid whose bubbles and pressures are unknowns beside its
// nodes: the linear system of a round, both eliminated in their elements.
//
// The energy of fem/hyperelastic.h is the minimum over bubbles, and the maximum over pressures, of
//
//   ∫ W(F) + p (J - 1) - p²/(2 lambda),   p linear in each element (constant in linear ones).
//
// Newton's method on all three has the same matrix as on the nodes alone, with one difference: the
// pressure of its geometric part is the unknown, not lambda (J - 1) of the last shape. As nu goes
// to 1/2 a round that is off by a part e of the strains makes lambda e² of the latter, which is
// neither a stress of the body nor of what the next round has to undo; the unknown stays a
// pressure of the body's (mixed and displacement formulations in Newton's method: Magisano,
// Leonetti, Garcea, Advantages of the mixed format in geometrically nonlinear analysis of beams and
// shells using solid finite elements, Int. J. Numer. Meth. Engng 109, 2017). The solutions are the
// same.

#include "base/context.h"
#include "fem/assembly.h"
#include "fem/element.h"
#include "fem/hyperelastic.h"
#include "geometry/vec3.h"
#include "linalg/stiffness.h"
#include "tetrahedra/tet_mesh.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::fem {

/// What each element has beside its nodes.
struct MixedUnknowns {
  std::vector<Vec3> bubble;                    ///< mm; 0 in linear elements
  std::vector<std::array<double, 4>> pressure; ///< at the corners, Pa, tension positive
};

/// The linear system of a round, and what its solution is for. Displacements are those of all nodes
/// from rest, 3 n. The same bytes on any number of threads.
class MixedSolid {
public:
  /// Keeps references to both. \pre elements are those of the mesh, of laws without limits to F
  MixedSolid(const tetrahedra::TetMesh& mesh, std::span<const SolidElement> elements);

  /// Bubbles of least energy, sought from `start`, and the pressures that J makes.
  MixedUnknowns balanced(std::span<const double> u, std::span<const Vec3> start,
                         const Context& context) const;
  /// Builds the system at a shape, and its right-hand side.
  /// \param positive  share, 0 to 1, of the matrix of positive parts in that of an element which
  /// isn't positive semidefinite: with the least share that makes the sum definite, steps along
  /// what buckles are long
  /// \return the energy of the displacements and bubbles
  double linearise(std::span<const double> u, const MixedUnknowns& own, double positive,
                   const Context& context);
  /// The matrix of the nodes' free axes. \pre linearised
  linalg::StiffnessMatrix matrix(std::span<const std::uint8_t> held, const Context& context) const;
  /// The right-hand side of the last system at another shape. \return the energy there
  /// \pre linearised
  double evaluate(std::span<const double> u, const MixedUnknowns& own, const Context& context);
  /// Forces of the elements on nodes, for the last right-hand side, are added to `forces`.
  void add_forces(std::span<double> forces) const;
  /// The matrix times d is taken from `forces`, d being 0 on axes that aren't held.
  void take_product(std::span<const double> d, std::span<double> forces) const;
  /// What bubbles and pressures change by where nodes are displaced by d, under the last
  /// right-hand side.
  MixedUnknowns follow(std::span<const double> d, const Context& context) const;

private:
  using Slopes = std::array<std::array<Vec3, HyperelasticResponse::nodes>, 4>;
  /// Of one element in the system.
  struct Part {
    std::vector<double> matrix;            ///< of its nodes, by rows
    Slopes volume{};                       ///< HyperelasticResponse::volume_slope
    std::array<double, 90> between{};      ///< bubble by nodes, 3 rows
    std::array<double, 9> flexibility{};   ///< of the bubble
    std::array<Vec3, 11> force{};          ///< that the nodes and the bubble have to balance
    std::array<double, 4> pressure_jump{}; ///< that of J less that of its own
  };
  double linearise_element(std::size_t t, std::span<const double> u, const MixedUnknowns& own,
                           double positive);
  void set_forces(std::size_t t, const std::array<double, 4>& own,
                  const std::array<Vec3, HyperelasticResponse::nodes>& force,
                  const std::array<double, 4>& pressure);
  std::array<Vec3, 10> of_nodes(std::span<const double> v, std::size_t t) const;

  const tetrahedra::TetMesh& mesh_;
  std::span<const SolidElement> elements_;
  std::size_t nodes_;
  std::vector<Part> parts_;
};

} // namespace gewebe::fem
