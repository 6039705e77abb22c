#pragma once
// A body as the contact solver sees it: a quadratic model of its energy around its present state.
//
// With x the positions of all its nodes and A its Hessian, a body minimises
//
//   1/2 (x - x_free)^T A (x - x_free) - f^T S x
//
// where S selects the vertices of its collision surface and f are the contact forces on them. So
// x = x_free + A^-1 S^T f, and the solver needs the rows of the compliance W = S A^-1 S^T alone.
// In dynamics A = M/h^2 + K, at rest A = K. A linear body is one whose model is exact.

#include "geometry/vec3.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace gewebe::contact {

/// Row-major.
using Block3 = std::array<double, 9>;

/// Contact force on a vertex of a body, 1e-6 N.
struct VertexForce {
  std::uint32_t vertex = 0; ///< of the body
  Vec3 force;
};

/// What a body's energy has come to in a step of two stages, 1e-9 J.
struct EnergyGain {
  double gain = 0;  ///< beyond the work of its own loads
  double inner = 0; ///< of speeds that neither move nor turn it as a whole, and can be lowered
  double scale = 0; ///< of its energies, for rounding
};

/// Owned by the maker of a step; lives for that step.
class ContactBody {
public:
  ContactBody() = default;
  ContactBody(const ContactBody&) = delete;
  ContactBody& operator=(const ContactBody&) = delete;
  virtual ~ContactBody() = default;

  /// Vertices of the collision surface; the numbering does not change during a step.
  virtual std::size_t vertex_count() const = 0;
  /// Writes the present positions of all vertices, mm.
  virtual void positions(std::span<Vec3> x) = 0;
  /// Builds the quadratic model around the present state.
  /// \param forces  contact forces f_0 that act in it, by ascending vertex; the first time those
  /// of the last step
  /// \param step  becomes x_free + A^-1 S^T f_0 - x at all vertices
  /// \return R^T A R of this step R of all nodes, roughly
  /// \throw Error if the state cannot be linearised
  virtual double linearise(std::span<const VertexForce> forces, std::span<Vec3> step) = 0;
  /// Contact forces at the end of the last step, by ascending vertex.
  virtual std::vector<VertexForce> last_forces() const { return {}; }
  /// Computes the columns that compliance() needs for these vertices: together they cost less.
  /// \pre linearised
  virtual void prepare(std::span<const std::uint32_t> /*vertices*/) {}
  /// Compliance between `vertex` and each vertex of `rows` in their frames:
  /// W(row, vertex) = frame(row) block frame(vertex)^T, mm per 1e-6 N. Zero along axes that cannot
  /// move. \pre linearised
  virtual void compliance(std::uint32_t vertex, std::span<const std::uint32_t> rows,
                          std::span<Block3> blocks) = 0;
  /// Rotation of a vertex's frame, the identity by default. A vertex with an axis that cannot move
  /// has no other.
  virtual Block3 frame(std::uint32_t /*vertex*/) const { return {1, 0, 0, 0, 1, 0, 0, 0, 1}; }
  /// Bodies with the same number (but 0), see base/unique_number.h, have the same compliance() of
  /// the same vertices.
  virtual std::uint64_t matrix_id() const { return 0; }
  /// Moves to x_free + A^-1 S^T f, less `share` of `step`. \param forces  f by ascending vertex
  virtual void move(double share, std::span<const VertexForce> forces) = 0;

  /// Whether the body's energy is, where it has moved to, what its model promised; else the next
  /// model is a stiffer one. \pre moved by all of the step
  virtual bool model_holds() { return true; }
  /// The next models of this step may cost more and are better: rounds converge slowly.
  virtual void sharpen() {}
  /// Translates a free body that has moved so that it has the momentum which its forces give it,
  /// where that takes at most `room`; one at rest takes the shape that belongs to its forces. Exact
  /// models leave nothing to do.
  /// \return whether the momentum, or the shape, is right
  virtual bool keep_momentum(double /*room*/) { return true; }

  /// Moves to where the step ends without contact, if the body can: better than by its models.
  /// \return whether it can
  virtual bool solve_alone() { return false; }
  /// Moves back to where the step began. \pre it can solve_alone()
  virtual void begin_again() {}

  /// Energy of a body with inertia where the second stage has moved it to; nothing of a body that
  /// goes where it must, or is at rest. \pre a second stage
  virtual std::optional<EnergyGain> energy_gain() { return std::nullopt; }
  /// Multiplies the speeds of `inner` at the end of the stage.
  virtual void slow_down(double /*factor*/) {}

  /// Whether one model serves for the whole step.
  virtual bool is_linear() const = 0;
  /// Whether some vertices go ways in this step that no force can stop.
  virtual bool is_led() const { return false; }
  /// All vertices translate together: W has the same block for all of them.
  virtual bool is_rigid() const { return false; }
  /// A force that is typical for the contacts of this body, 1e-6 N, or 0: unknown. It scales the
  /// barrier; an error of a factor 1000 changes no result noticeably.
  virtual double typical_force() const = 0;
  /// Force with which it resists a displacement of a vertex, roughly, 1e-6 N/mm, or 0: unknown. It
  /// scales the barrier, too.
  virtual double vertex_stiffness() const { return 0; }
};

} // namespace gewebe::contact
