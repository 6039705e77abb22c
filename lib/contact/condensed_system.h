#pragma once
// Newton's system of a contact problem, condensed to the vertices in contact.
//
// All bodies together minimise 1/2 r^T A r + g(S x), r = x - x_free, block-diagonal A, by Newton's
// method. With the Hessian H of the contact energy g, which is 0 except at active vertices a,
//
//   (W_aa^-1 + H) p_a = -(W_aa^-1 r_a + g_a),   p = -r - W_:a q,   q = -W_aa^-1 (r_a + p_a)
//
// (Woodbury's identity): the exact full-space step from columns of W of active vertices alone.
// Along a step r stays c R0 + W F, with the share c of the way that is left (1 at the start, 0
// after a full step) and forces F, which become the contact forces: -g_a. They start as those of
// the last step, F_0; R0 is x - x_free - W F_0 at the start. Vertices that cannot move (W = 0) are
// carried to their targets by c alone.

#include "base/cpu.h"
#include "contact/contact_body.h"
#include "geometry/vec3.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace gewebe::contact {

/// Bodies of a problem; vertices of body b are first[b] ... first[b + 1] - 1.
struct BodyTable {
  std::vector<ContactBody*> bodies;
  std::vector<std::uint32_t> first;

  std::uint32_t vertex_count() const { return first.empty() ? 0 : first.back(); }
};

/// Inverses of W_aa, by matrix and vertices: they serve from step to step where contact stays. And
/// the memory of one system at a time.
class InverseCache {
public:
  InverseCache();
  ~InverseCache();

private:
  friend class CondensedSystem;
  struct State;
  std::unique_ptr<State> state_;
};

class CondensedSystem {
public:
  /// \param vertices  that may take part, ascending \param start  R0 of all vertices
  /// \param forces  F_0 by body, on some of these vertices
  /// \param energy  R0^T A R0, roughly \param share  c \param ridge  see Parameters \pre the bodies
  /// are linearised; they outlive this
  CondensedSystem(const BodyTable& table, std::vector<std::uint32_t> vertices,
                  std::span<const Vec3> start, std::span<const std::vector<VertexForce>> forces,
                  double energy, double share, double ridge, InverseCache& cache, CpuLevel cpu);
  ~CondensedSystem();
  CondensedSystem(const CondensedSystem&) = delete;
  CondensedSystem& operator=(const CondensedSystem&) = delete;

  std::span<const std::uint32_t> vertices() const;
  /// Active vertices, in addition to those that are. \pre among vertices()
  void activate(std::span<const std::uint32_t> vertices);
  std::size_t unknowns() const; ///< axes of active vertices that can move

  /// Begins a Hessian: 0.
  void clear_hessian();
  /// Adds a block of a pair. \param of  its vertices, active or immovable
  /// \param block  of order 3 of.size(), row-major
  void add_hessian(std::span<const std::uint32_t> of, std::span<const double> block);

  /// Newton's step for the gradient of the contact energy at all vertices, by all of the way.
  /// \param damping  stiffness against any step of an active vertex, 1e-6 N/mm
  /// \return whether the system was positive definite
  bool solve(std::span<const Vec3> gradient, double damping);
  /// Newton's step that balances the forces behind a part of the way that is left: c becomes
  /// (1 - reach) c. \pre solved; 0 <= reach <= 1
  void choose_reach(double reach);
  /// Step of a vertex of vertices(), by its place there. \pre solved
  const Vec3& step(std::size_t place) const;

  /// Energy behind a part of the step, without a constant, and its slope at 0: 1/2 r^T A r, of a
  /// step by all of the way, or, of one by none of it, 1/2 s^T A s, s = r - c R0.
  double energy(double part) const;
  double slope() const;
  /// Raises the weight of 1/2 c^2 in the energy of a step by all of the way, at first R0^T A R0,
  /// until `slope() + contact_slope` is a descent.
  void require_descent(double contact_slope);
  /// Takes a part of the step.
  void advance(double part);

  double share() const; ///< c
  /// Largest difference of F and the forces that follow from a gradient of the contact energy, and
  /// the largest of F, over nodes: {0, 0} without forces.
  struct Residual {
    double difference = 0, largest = 0;
  };
  Residual residual(std::span<const Vec3> gradient) const;
  /// Forces F on the vertices of a body.
  std::vector<VertexForce> forces(std::size_t body) const;

private:
  struct State;
  std::unique_ptr<State> state_;
};

} // namespace gewebe::contact
