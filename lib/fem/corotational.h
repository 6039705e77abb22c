#pragma once
// Tetrahedra under large rotations: energy and forces of corotational elements, that is, those of
// fem/element.h at small strains in a frame that turns with each tetrahedron.
//
// With F = dx/dX in the middle of the element and R the rotation nearest to it (R : F is largest,
// also where the element is flat or inverted, where R is a rotation all the same; Irving, Teran,
// Fedkiw, Invertible finite elements, 2004), the strain at a point is E = sym(Rᵀ dx/dX) - I and the
// energy is that of the linear element under E: for 4 nodes
//   V (mu |F - R|² + lambda/2 tr²(RᵀF - I)),
// for 10 nodes that of fem/element.h, quadratic functions with the change of volume projected
// and the bubble eliminated. Forces are the exact derivative of the energy, R's own included (Chao,
// Pinkall, Sanan, Schröder, A simple geometric model for elastic deformations, 2010). So they have
// neither a sum nor a moment, and a step can be judged by the energy. At rest the tangent is
// solid_stiffness().
//
// Damping has the potential 1/2 (E - E0) : C : (E - E0) of the same elements, of strains E0 that
// remember() keeps: it doesn't act on rotations, and its forces have no moment either.
//
// Where two (signed) stretches of an element sum up to nothing its R, and so its forces, jump; the
// energy is continuous.
//
// Units: mm, g, s, Pa. The same bytes on any number of threads and CPU level.

#include "base/context.h"
#include "fem/element.h"
#include "tetrahedra/tet_mesh.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace gewebe::fem {

/// The potential is the energy times `elastic` plus that of damping times `damping`.
struct CorotationalWeights {
  double elastic = 1, damping = 0;
};

/// What an element is turned and stretched by: for tangents.
struct ElementFrame {
  SolidBlock rotation{};
  linalg::SymmetricBlock stretch{}; ///< Rᵀ F in the middle
};

/// What is written down of every element in every evaluation, which takes a third of its time.
struct CorotationalNotes {
  bool strains = true; ///< for remember() and frame()
  bool frames = true;  ///< for frame()
};

class CorotationalSolid {
public:
  /// \pre elements are those of the mesh
  CorotationalSolid(const tetrahedra::TetMesh& mesh, std::span<const SolidElement> elements,
                    const CorotationalNotes& notes = {});
  ~CorotationalSolid();
  CorotationalSolid(CorotationalSolid&&) noexcept;
  CorotationalSolid& operator=(CorotationalSolid&&) noexcept;

  /// The energy (g mm²/s²) with the places of nodes x (3 n, mm), and -dE/dx into `forces` (3 n,
  /// g mm/s²). With `turns` node_rotations() are those of x from now on.
  /// \pre without damping, or strains are noted
  double evaluate(std::span<const double> x, const CorotationalWeights& weights,
                  std::span<double> forces, const Context& context, bool turns = true);
  /// Of the last evaluate(), its weight left aside.
  double elastic_energy() const noexcept;
  /// The strains of the last evaluate() are those that damping counts from. From the start they are
  /// those at rest.
  void remember();
  /// The strains that damping counts from, which are not written again, and those of earlier times.
  std::shared_ptr<const void> strains() const;
  void restore_strains(std::shared_ptr<const void> strains);
  /// Damping counts from start + factor (strains() - start) from then on. \param start  strains()
  /// of an earlier time
  void extend_strains(const std::shared_ptr<const void>& start, double factor);
  /// Of each node the rotation nearest to the mean of its elements', by rows, 9 n: as in the last
  /// evaluate() with turns. That of a node of no element is none.
  void node_rotations(std::span<double> rotations, const Context& context);
  /// All is noted from the next evaluate() on.
  void note_all();
  /// Of element t, as in the last evaluate(). \pre both are noted, or frames, if only they are read
  ElementFrame frame(std::size_t t) const;

private:
  struct State;
  std::unique_ptr<State> state_;
};

} // namespace gewebe::fem
