#pragma once
// Frictional contact of nodes whose displacements depend linearly on the forces at them.
//
// Node c moves by Σ W_cd f_d, W symmetric, positive definite on what can move. Contact i is of a
// node with a half-space: with unit normal n and f in coordinates of the contact
//
//   g = gap + n·(W f),   0 <= f_n,  0 <= g,  f_n g = 0                (Signorini)
//   s = T (slip + W f),  |f_t| <= μ f_n,  |f_t| = μ f_n and s = -α f_t, α >= 0, where s != 0
//                                                                     (Coulomb)
//
// T leaves out the part along n. Without friction this is a convex quadratic programme
// (contact_pushes.h). With friction it is solved by Newton steps on Alart and Curnier's equations
// and sweeps over single contacts, each solved exactly; where these fail, by an interior-point
// method (contact_interior_internal.h).

#include "base/vec3.h"
#include "contact/contact_pushes.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe {

struct Contact {
  std::uint32_t node = 0; ///< of those that the compliance is of
  Vec3 normal;            ///< out of the half-space's solid
  double gap = 0;         ///< of the node along the normal where no contact pushes; < 0: inside
  Vec3 slip;              ///< there, against where it would stick
  double friction = 0;    ///< μ >= 0
};

struct ContactForces {
  std::vector<Vec3> force; ///< on the node, by contact
  double residual = 0;     ///< of all conditions as forces, over the largest force
  bool solved = false;     ///< residual is at most the tolerance
};

/// \param compliance W, (3 m)² numbers, columns one behind the other \param start a guess, by
/// contact, or empty \param tolerance of the residual, with friction   \pre contacts' nodes < m
ContactForces solve_contacts(std::span<const double> compliance, std::size_t m,
                             std::span<const Contact> contacts, std::span<const Vec3> start = {},
                             double tolerance = contact_solver_tolerance);

/// The residual of any forces, as above.
double contact_residual(std::span<const double> compliance, std::size_t m,
                        std::span<const Contact> contacts, std::span<const Vec3> force);

} // namespace gewebe
