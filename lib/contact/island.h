#pragma once
// Bodies that may touch each other, stepped together.

#include "base/context.h"
#include "collision/surface.h"
#include "contact/contact_body.h"
#include "contact/instrument.h"
#include "contact/parameters.h"
#include "contact/step.h"
#include "geometry/vec3.h"
#include "model/model.h"
#include "numeric/two_stages.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace gewebe::contact {

/// Collision surface of one body, by its own vertices.
struct BodySurface {
  std::vector<Vec3> rest; ///< by vertex, mm
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::array<std::uint32_t, 2>> edges; ///< beside those of triangles
  std::vector<std::uint32_t> points;               ///< beside those of edges
  std::vector<std::uint8_t> fixed;                 ///< by vertex: 1 if it never moves
  /// By vertex: the piece that holds it, counted over all surfaces of the island, or
  /// collision::no_owner; empty: none is held.
  std::vector<std::uint32_t> holder;
  /// By vertex: the surface's piece that it belongs to, which decides what it may be in contact
  /// with; empty: all are of the first.
  std::vector<std::uint32_t> piece;
  std::uint32_t pieces = 1;
  double radius = 0; ///< the surface lies so far outside, mm
};

/// What is typical for contacts of a solid or a net; 0 without material, springs or triangles.
struct TypicalContact {
  double stiffness = 0; ///< of a piece of the size of an edge, 1e-6 N/mm
  double force = 0;     ///< strains such a piece by a hundredth, 1e-6 N
};
TypicalContact typical_contact(const model::Model& model);
/// Surface of a model: its triangles, with nodes of the model as vertices.
struct ModelSurface {
  BodySurface surface;
  std::vector<std::uint32_t> node; ///< by vertex, ascending
  TypicalContact typical;
};
ModelSurface model_surface(const model::Model& model);
/// A point, an edge or the triangles of a convex core, at its own pose. \pre no blade
BodySurface instrument_surface(const InstrumentShape& shape);

/// A step, or a stage of a step of second order: the first one ends as a step of its own would, by
/// backward Euler; the second one makes of both a step of second order (numeric/two_stages.h).
struct Interval {
  double from = 0, to = 0; ///< s; both the same: at rest
  numeric::Stage stage = numeric::Stage::whole;
};
struct Stages {
  Interval first, second;
};
Stages stages_of(const Interval& step);

/// Makes a ContactBody for each step of something that goes on in time.
class IslandMember {
public:
  IslandMember() = default;
  IslandMember(const IslandMember&) = delete;
  IslandMember& operator=(const IslandMember&) = delete;
  virtual ~IslandMember() = default;

  /// Begins a step. A step that was begun and not ended leaves no trace when another one begins.
  /// \pre a second stage: has_first_stage(), of the same step
  /// \return valid until the end of the step
  virtual ContactBody& begin(const Interval& step, const Context& context) = 0;
  /// Whether the first stage that has ended may be followed by a second one.
  virtual bool has_first_stage() const { return true; }
  struct Force {
    std::uint32_t vertex = 0; ///< of the member
    std::uint32_t from = 0;   ///< piece of the island
    Vec3 force;
  };
  /// Ends the step with these forces on the member's vertices, by ascending vertex.
  virtual void end(std::span<const Force> forces, const Interval& step, const Context& context) = 0;
};

/// Into how many parts the last steps of bodies had to be halved, so that the next one need not
/// fail first.
struct StepParts {
  int halvings = 0;
  int steps = 0; ///< since then that needed no more
};

class RadiusFit;

class IslandMotion {
public:
  /// \param surfaces  of the members; their pieces are numbered one behind the other
  /// \param friction  Coulomb's coefficient of two pieces; < 0: they do not touch
  /// \param edge  median of the edges that may touch, mm, where these are parts of surfaces; 0: is
  /// found
  IslandMotion(std::span<const BodySurface* const> surfaces,
               const collision::OwnerTable<double>& friction, const Parameters& parameters = {},
               double edge = 0);
  ~IslandMotion();

  /// Steps from one time to the other, in halves where contact is not solved. \param members  one
  /// for each surface \param parts  of the last step; becomes those for the next one
  /// \param order  of the method, 1 or 2
  /// \throw NotSolved where the shortest step is not solved either: nothing has been ended since
  /// the last step that was; the caller rolls back
  void advance(std::span<IslandMember* const> members, double from, double to, StepParts& parts,
               const Context& context, int order = 1);
  void advance(std::span<IslandMember* const> members, double from, double to,
               const Context& context) {
    StepParts none;
    advance(members, from, to, none, context);
  }

  /// Where an edge passes through a triangle. \param x  positions of all vertices
  std::optional<Vec3> find_intersection(std::span<const Vec3> x) const;
  /// Where surfaces touch, so that no step can begin.
  std::optional<Vec3> find_touching(std::span<const Vec3> x) const;
  const Island& island() const noexcept { return *island_; }

  /// What has been done since the last call.
  StepReport take_report();
  double activation_distance() const noexcept;

private:
  using Members = std::span<IslandMember* const>;
  /// A solved stage.
  struct Solved {
    std::vector<Vec3> from, to; ///< positions of all vertices
    std::vector<ContactForce> forces;
  };
  std::vector<Vec3> begin(Members members, const Interval& step, const Context& context);
  void end(Members members, const Interval& step, const Context& context);
  Solved step(Members members, const Interval& step, const Context& context);
  bool watch_energy(const Solved& first, std::span<const Vec3> start);
  bool second_stage(Members members, const Solved& first, const Interval& step,
                    const Context& context);
  double take(Members members, double from, double to, bool parts, const Context& context);
  int advance_parts(Members members, double from, double to, int untried, int halvings,
                    const Context& context);

  Parameters parameters_;
  std::unique_ptr<Island> island_;
  std::unique_ptr<StepSolver> solver_;
  std::unique_ptr<RadiusFit> radii_;
  StepReport report_;
  int order_ = 1; ///< of the present advance
};

} // namespace gewebe::contact
