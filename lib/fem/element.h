#pragma once
// Elastic tetrahedra with straight sides: small strains of an isotropic material.
//
// Linear elements (4 nodes) have one strain. They lock where a material hardly changes its volume
// (nu near 1/2), and in bending are too stiff always; they are here to compare with.
//
// Quadratic elements (10 nodes, in VTK's order: corners, then the middles of edges 01, 12, 02, 03,
// 13, 23, as EdgeMiddles) have a bubble besides, b = 256 λ0 λ1 λ2 λ3 of the barycentric
// coordinates, times a vector, and count the change of volume by its projection on linear
// functions: P2 + bubble / P1 discontinuous in the mixed form with the pressure
// p = lambda div u, which is eliminated in the element, then the bubble is. Without the bubble the
// projection is div u itself, for the divergence of a quadratic u is linear, so that plain
// elements have as many constraints of volume as displacements; the mean alone (mean dilatation,
// B-bar) doesn't lock, but its displacements are of order 2 and not 3. The bubble sets the three
// slopes of the pressure in each element free, and the order stays 3 at any nu < 1/2. At nu = 0.499
// tests/unit/test_solid_validation.cpp finds 2.98; in its place a plain element had 2.5 and the
// mean 1.6 on the same meshes. The mean is softer: nearer where a corner is singular. Only the part
// lambda (div u)² is projected, so that no motion but the rigid ones is free of energy.
//
// Sources: Hughes, Generalization of selective integration procedures, 1980, and Simo, Taylor,
// Pister, Variational and projection methods for the volume constraint, 1985 (projected change of
// volume is a mixed form); Crouzeix, Raviart, Conforming and nonconforming finite element methods
// for solving the stationary Stokes equations, 1973 (bubbles with discontinuous pressure); Arnold,
// Brezzi, Fortin, A stable finite element for the Stokes equations, 1984 (bubbles eliminated).
//
// All integrals are exact, from ∫ λ0^a λ1^b λ2^c λ3^d = 6 V a! b! c! d! / (a + b + c + d + 3)!:
// on straight sides every integrand is a polynomial of the barycentric coordinates.
//
// Units: mm, Pa = g/(mm s²), so stiffness in Pa mm = g/s², forces in g mm/s², as in
// linalg/stiffness.h.

#include "geometry/vec3.h"
#include "linalg/stiffness.h"
#include "model/hyperelastic_law.h"

#include <array>
#include <cstddef>
#include <span>

namespace gewebe::fem {

/// Lamé's constants, Pa: stress = lambda tr(strain) I + 2 mu strain.
struct Elasticity {
  double lambda = 0, mu = 0;
};

/// Of Young's modulus in Pa and Poisson's ratio.
/// \throw Error unless young is finite and > 0 and 0 <= poisson < 0.5
Elasticity elasticity(double young, double poisson);

/// A 3 × 3 matrix by rows.
using SolidBlock = std::array<double, 9>;

/// Six components of a symmetric tensor: xx, yy, zz, xy, yz, zx.
using SymmetricTensor = std::array<double, 6>;

/// What a viscoelastic element remembers of earlier strains, as it acts in one step
/// (viscous/solid_memory.h): with W_d = W - mu/3 (J - 1)² of fem/hyperelastic.h, its energy per
/// volume has share W_d + A : (C - I) / 2 in place of W_d.
struct ElementMemory {
  double share = 1;
  std::span<const SymmetricTensor> stress{}; ///< A at each point, Pa; none: an elastic element

  bool acts() const noexcept { return !stress.empty(); }
};

/// What the integrals of one tetrahedron are made of.
struct SolidElement {
  double volume = 0;              ///< mm³
  std::array<Vec3, 4> gradient{}; ///< of the barycentric coordinates, 1/mm
  Elasticity material;
  linalg::SymmetricBlock
      bubble_flexibility{};   ///< (∫b)² times the inverse of the bubble's own stiffness
  model::HyperelasticLaw law; ///< of large strains (fem/hyperelastic.h)
  ElementMemory memory{};     ///< ... of the step that is open
};

/// \throw Error unless the volume is finite and positive (as the corners are ordered)
SolidElement solid_element(const std::array<Vec3, 4>& corners, const Elasticity& material);

/// The stiffness between nodes a and b of a linear element: entry [3 i + j] is the force on a along
/// i per displacement of b along j. block(b, a) is its transpose. \pre a, b < 4
SolidBlock linear_block(const SolidElement& element, std::size_t a, std::size_t b);
/// The same of a quadratic element, its bubble eliminated. \pre a, b < 10
SolidBlock quadratic_block(const SolidElement& element, std::size_t a, std::size_t b);
/// The same without a bubble, which locks: to compare with.
SolidBlock plain_quadratic_block(const SolidElement& element, std::size_t a, std::size_t b);

/// What a force per volume (g/(mm² s²)) puts on each node, g mm/s²: of a quadratic element with
/// what its bubble hands on, for it is loaded too. \pre force.size() is 4 or 10
void body_load(const SolidElement& element, const Vec3& force_density, std::span<Vec3> force);

/// The gradient of the displacement at each corner, [3 i + j] = du_i/dx_j, under the displacements
/// of its 4 or 10 nodes (mm): with the bubble's projection on linear functions, so that the
/// stresses of these strains, linear in between, are in balance with K u and the force per volume.
/// In the middle of the element the bubble adds nothing. \pre u.size() is 4 or 10
std::array<SolidBlock, 4> displacement_gradients(const SolidElement& element,
                                                 std::span<const Vec3> u,
                                                 const Vec3& force_density = {});

} // namespace gewebe::fem
