#pragma once
// What viscoelastic elements remember: linear viscoelasticity of finite strains by Prony series
// (model/prony.h).
//
// The part of a law (fem/hyperelastic.h) that relaxes is W_d = W - mu/3 (J - 1)². Its second
// Piola-Kirchhoff stress at a sudden strain is S_d = 2 dW_d/dC. The stress is
//
//   S(t) = S_v(t) + (1 - Σ g_k) S_d(t) + Σ H_k(t),   H_k(t) = g_k ∫ exp(-(t - s)/tau_k) dS_d(s),
//
// S_v that of what changes with volume alone (Simo, On a fully three-dimensional finite-strain
// viscoelastic damage model, Comput. Methods Appl. Mech. Engrg. 60, 1987; in this form Holzapfel,
// On large strain viscoelasticity, Int. J. Numer. Meth. Engng 39, 1996). Of laws in modified
// invariants S_d is deviatoric at any strain, of the Neo-Hookean one at small strains.
//
// In a step of h in which S_d is linear in time the integral is exact (Taylor, Pister, Goudreau,
// Thermomechanical analysis of viscoelastic solids, Int. J. Numer. Meth. Engng 2, 1970):
//
//   H_k' = e H_k + g_k a (S_d' - S_d),   e = exp(-h/tau_k),   a = (1 - e) tau_k / h,
//
// and S' is the derivative of an energy: share W_d + A : (C - I) / 2 with share = 1 - Σ g_k (1 - a)
// and A = Σ (e H_k - g_k a S_d), which the step minimises as any other. A step of 0 s is sudden:
// e = a = 1. Several sudden steps are one.
//
// The energy reported is (1 - Σ g_k) W_d + Σ |H_k|² / (4 g_k mu): what is stored, to second
// order in the strains.
//
// Points compressed below a tenth of their volume keep S_d: what they remember fades.

#include "base/context.h"
#include "fem/assembly.h"
#include "fem/element.h"
#include "geometry/vec3.h"
#include "tetrahedra/tet_mesh.h"

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

namespace gewebe::viscous {

/// State of all elements.
struct MemoryState {
  /// By element and point: S_d, then H of each term, Pa.
  std::shared_ptr<const std::vector<fem::SymmetricTensor>> tensors;
  double beyond = 0; ///< see SolidMemory::beyond, of a sudden step
  bool still = true; ///< the last step changed H by less than 1e-9 of the largest S_d
};

class SolidMemory {
public:
  /// At rest; lets elements refer to what is here. \pre elements are those of the mesh and the
  /// materials, stay where they are and outlive this; the mesh, too
  SolidMemory(const tetrahedra::TetMesh& mesh, std::span<const fem::SolidMaterial> materials,
              std::span<fem::SolidElement> elements);

  /// Whether no element remembers anything; nothing below is needed then.
  bool empty() const noexcept { return parts_.empty(); }
  /// From now on elements have the energy of a step of h seconds, 0 or more.
  void begin(double h);
  /// Ends that step at these displacements of nodes, 3 n, and bubbles, or none. Elements have the
  /// energy of a sudden step then.
  void end(std::span<const double> u, std::span<const Vec3> bubbles, const Context& context);
  /// What the reported energy is more than that of the elements: at the end of the last step,
  /// of its own length, or of a sudden one.
  double beyond() const noexcept { return beyond_; }
  double beyond_sudden() const noexcept { return state_.beyond; }
  bool still() const noexcept { return state_.still; }

  MemoryState state() const { return state_; }
  void restore(const MemoryState& state);

private:
  struct Term {
    double share = 0, time = 0;
    double kept = 1, mean = 1; ///< e and a
  };
  struct Law {
    std::vector<Term> terms;
    double share = 1, rest = 1; ///< of W_d in the step, and after long
  };
  /// One viscoelastic element.
  struct Part {
    std::size_t element = 0, law = 0;
    std::size_t first = 0, acting = 0; ///< of its tensors in the state, and in acting_
  };
  void recall();

  const tetrahedra::TetMesh& mesh_;
  std::span<fem::SolidElement> elements_;
  std::size_t points_; ///< of an element
  std::vector<Law> laws_;
  std::vector<Part> parts_;
  std::size_t count_ = 0;                    ///< of tensors
  std::vector<fem::SymmetricTensor> acting_; ///< A
  MemoryState state_;
  double beyond_ = 0;
};

} // namespace gewebe::viscous
