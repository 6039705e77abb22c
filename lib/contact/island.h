#pragma once
// Bodies that may touch each other, stepped together.

#include "base/context.h"
#include "base/vec3.h"
#include "collision/surface.h"
#include "contact/contact_body.h"
#include "contact/instrument.h"
#include "contact/parameters.h"
#include "contact/step.h"
#include "model/model.h"

#include <cstddef>
#include <cstdint>
#include <memory>
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
  double radius = 0;                               ///< the surface lies so far outside, mm
};

/// Surface of a model: its triangles, with nodes of the model as vertices.
struct ModelSurface {
  BodySurface surface;
  std::vector<std::uint32_t> node; ///< by vertex, ascending
};
ModelSurface model_surface(const Model& model);
/// A point, an edge or the triangles of a convex core, at its own pose. \pre no blade
BodySurface instrument_surface(const InstrumentShape& shape);

/// Makes a ContactBody for each step of something that goes on in time.
class IslandMember {
public:
  IslandMember() = default;
  IslandMember(const IslandMember&) = delete;
  IslandMember& operator=(const IslandMember&) = delete;
  virtual ~IslandMember() = default;

  /// Begins a step. A step that was begun and not ended leaves no trace when another one begins.
  /// \param from, to  times, s; both the same: at rest
  /// \return valid until the end of the step
  virtual ContactBody& begin(double from, double to, const Context& context) = 0;
  /// Ends the step with these forces on the member's vertices. \param from  by members
  struct Force {
    std::uint32_t vertex = 0;
    std::uint32_t from = 0;
    Vec3 force;
  };
  virtual void end(std::span<const Force> forces, const Context& context) = 0;
};

/// What a member is in an island.
struct MemberSurface {
  IslandMember* member = nullptr;
  const BodySurface* surface = nullptr;
};

class IslandMotion {
public:
  /// \param members  outlive this, with their surfaces
  /// \param friction  Coulomb's coefficient of two members; < 0: they do not touch
  IslandMotion(std::span<const MemberSurface> members, const collision::OwnerTable<double>& friction,
               const Parameters& parameters = {});
  ~IslandMotion();

  /// Steps from one time to the other, in halves where contact is not solved.
  /// \throw NotSolved where the shortest step is not solved either: nothing has been ended since
  /// the last step that was; the caller rolls back
  void advance(double from, double to, const Context& context);

  /// What has been done since the last call.
  StepReport take_report();
  std::uint64_t halvings() const noexcept { return halvings_; }
  double activation_distance() const noexcept;

private:
  void step(double from, double to, const Context& context);
  void advance_parts(double from, double to, int halvings, const Context& context);

  std::vector<MemberSurface> members_;
  Parameters parameters_;
  std::unique_ptr<Island> island_;
  std::unique_ptr<StepSolver> solver_;
  StepReport report_;
  std::uint64_t halvings_ = 0;
};

} // namespace gewebe::contact
