#pragma once
// What the turns of a contact (contact_turns_internal.h) look at: nodes that give way, pieces of
// surface between them, instruments.

#include "base/vec3.h"
#include "statics/bent_parts_internal.h"
#include "statics/contact_turns_internal.h"

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace gewebe {

/// \param w of three rows for each moving node \param free of all nodes \param placed, moved by
/// instrument
struct ContactScene {
  const ContactNodes& nodes;
  std::span<const Vec3> free;
  std::span<const std::optional<PlacedInstrument>> placed;
  std::span<const std::optional<MovedInstrument>> moved;
  BentCompliance::Compliance w;

  Eigen::Index rows() const { return w.rows(); }
  Eigen::VectorXd rows_of(std::span<const Vec3> places) const;
  std::vector<Vec3> places_of(const Eigen::VectorXd& x) const;
};

std::array<Vec3, 3> corners_of(const Facet& piece, std::span<const Vec3> at);
/// The pair's point, where the nodes are.
Vec3 point_of(const TouchPair& p, std::span<const Vec3> at);

using Matrix9 = Eigen::Matrix<double, 9, 9>;

/// Second derivatives, by the corners' places, of the distance d of a piece from a point c. With
/// weights w of the nearest point p = Σ w_i x_i, where p moves along edges e_m of the corner, edge
/// or triangle that it is on by dw_i/dm (its least distance lets it), and f = d²/2:
///
///   f_ij = w_i w_j I,  f_im = w_i e_m + (dw_i/dm) (p - c),  f_ml = e_m·e_l,
///   H = (f_ij - f_im f_ml⁻¹ f_mj - w_i w_j n nᵀ) / d
///
/// \return none where the triangle is too thin for its own plane
/// \pre found is of these corners and a point of the core, and has a normal
std::optional<Matrix9> bending_from_point(const SurfacePoint& found,
                                          const std::array<Vec3, 3>& corners, int count);

/// How a turn takes the forces' turning: how much of what makes softer counts, and by how much
/// (over a contact's own stiffness) what pushes is held to its place, which changes nothing where
/// that is met and makes stable what is so only under its contacts.
struct Bend {
  double loose = 1, hold = 0;
};

/// ∂(Bᵀ f)/∂x of the last pushes f of these pairs, by differences, at the places `at`. \param parts
/// by which it is taken, or null \param held becomes the forces that hold what pushes to its place
BentParts bending(const ContactScene& scene, std::span<const TouchPair> pairs,
                  std::span<const std::uint32_t> active, std::span<const Vec3> at, const Bend& how,
                  const ContactParts* parts, Eigen::VectorXd& held);

/// The pairs that a turn's linear problem looks at, each with a column of W Bᵀ for its push, or
/// three for its force where anything rubs.
struct LookedContacts {
  std::vector<std::uint32_t> pairs;
  Eigen::MatrixXd straight; ///< own compliance by rows of the points, before forces turn: diagonal
  Eigen::MatrixXd columns;  ///< with it
  Eigen::VectorXd forces;   ///< by column
  Eigen::VectorXd x;        ///< where the nodes are under them
  bool exact = true;
};

/// The linear problem of a turn, by more and more of the pairs, whose forces it sets. \param stuck
/// becomes one that can't be moved \return none where it isn't stable
std::optional<LookedContacts> solve_bent(const ContactScene& scene, std::span<TouchPair> pairs,
                                         std::span<const std::uint32_t> active,
                                         std::span<const Vec3> at, const BentParts& bent,
                                         const Eigen::VectorXd& held, bool careful,
                                         std::optional<TouchPair>& stuck);

} // namespace gewebe
