#pragma once
// Instruments against what gives way to them, an elastostatic object or one in an implicit step:
// its shape and the forces that keep its nodes out of the instruments, unilateral and with Coulomb
// friction.
//
// In turn: each touched node is kept beyond the plane that supports the instrument where the node
// was last (contact_solver.h solves for the forces), then the planes are taken anew. What is beyond
// such a plane is outside, so no node is inside in any turn; and without friction the energy falls
// from turn to turn to a minimum, where each force is normal to the surface. Nodes found inside the
// whole shape join, and it begins again. Where the answer to forces is not linear it is solved as
// if it were, at the last forces, until what comes of the new ones is what they were found with.

#include "contact/instrument.h"
#include "contact/load.h"
#include "contact/node_reach.h"
#include "contact/surface_facets.h"
#include "contact/surface_parts.h"
#include "model/model.h"
#include "statics/elastostatic.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace gewebe {

/// A node that an instrument pushes.
struct NodeTouch {
  std::uint32_t node = 0, instrument = 0;
  Vec3 force; ///< on the node, 1e-6 N

  bool operator==(const NodeTouch&) const = default;
};

/// A point of the surface that an instrument pushes.
struct PointTouch {
  Facet nodes{};                   ///< of the piece that it is on
  std::array<double, 3> weights{}; ///< by which its place is theirs, and its force is on them
  std::uint32_t instrument = 0;
  CorePart part = CorePart::first_end; ///< of the instrument
  Vec3 normal;                         ///< from the instrument's core to the point
  Vec3 force;                          ///< 1e-6 N
  /// How the nodes moved and the force changed, from one update to the next.
  std::array<Vec3, 3> moved{};
  Vec3 grown{};
};

/// One for each node and instrument, by ascending ones, with the sum of its forces in their order.
std::vector<NodeTouch> sums_of_touches(std::vector<NodeTouch> touches);

/// An instrument's last short way, over which a node is pushed from where it was.
struct MovedInstrument {
  InstrumentShape shape;
  Pose before, now;
  /// Of one that gives way (contact/coupling.h): mm per force, and the force on it with which it
  /// would be where it is `now`.
  double compliance = 0;
  Vec3 pushed{};
};

/// The way in parts in which no instrument moves further than half its radius. \return how many, at
/// most `max`
std::size_t parts_of_way(std::span<const MovedInstrument> instruments, std::size_t max);

/// What contact took: problems with instruments that touch something, and their turns.
struct TouchCounts {
  std::uint64_t problems = 0, turns = 0, most_turns = 0;
  std::uint64_t unsolved = 0;
  double change =
      0; ///< the largest that was left where solved: of normals, of points over a radius

  void add(const TouchCounts& more);
};

struct ContactNodes;

/// What gives way to forces of contact.
class Yielding {
public:
  Yielding() = default;
  Yielding(const Yielding&) = delete;
  Yielding& operator=(const Yielding&) = delete;
  virtual ~Yielding() = default;
  /// Near the forces of the last `push`. \pre nodes ascending, none of them displaced
  virtual DelassusOperator delassus_operator(std::span<const std::uint32_t> nodes) = 0;
  /// These forces act now, beside all others. \param at where the last operator puts its nodes
  /// under them \return whether they stand there; else another one is asked for
  virtual bool push(std::span<const NodeTouch> touches, std::span<const Vec3> at) = 0;
  /// The shape under them: displacements of all nodes, or of the first ones, all of the surface
  /// among them.
  virtual std::span<const double> shape() = 0;
  /// Bounds of it, where some nodes take less than all; else none.
  virtual std::optional<NodeReach> reach() { return std::nullopt; }
  /// The shape as it is now is one that copy_shape tells of, until this is called again.
  virtual void keep_shape() {}
  enum class Moment { kept, now };
  /// That shape at some nodes, to their places in one of all. \pre reach() told bounds of it
  virtual void copy_shape(std::span<const std::uint32_t> /*nodes*/, std::span<double> /*shape*/,
                          Moment /*moment*/) {}
};

/// What is known of a shape of which not all is.
struct PartOfShape {
  std::vector<std::uint8_t> known{}; ///< by node; empty: all are
  NodeReach reach{};                 ///< of what is not
};

class StaticContact {
public:
  /// Keeps a reference to the model. \param shape the present one
  /// \param touches what is touched in it, by ascending node and instrument \param points of these
  StaticContact(const Model& model, std::span<const double> shape,
                std::vector<NodeTouch> touches = {}, std::vector<PointTouch> points = {},
                const PartOfShape& part = {});

  /// Takes the object's shape on to that with the instruments where they are now; `shape` (as
  /// Yielding has it) is the last one before and the new one after. An absent instrument is no
  /// element. Where more of the way is to come (not `last`) and nothing is touched, nothing is
  /// done. \param displaced nodes that stand where they must \param part null: all of the shape is
  /// wanted; else what is known of it, of the new one those nodes that are looked at if that is
  /// enough, with the same forces and places to the bit   \throw as the object
  void update(Yielding& object, const std::map<std::uint32_t, Vec3>& displaced,
              std::span<const std::optional<MovedInstrument>> instruments,
              std::vector<double>& shape, bool last = true, PartOfShape* part = nullptr);
  /// Of an elastostatic object, asked for when needed, under `load`. \pre as Elastostatic::update
  void update(const std::function<Elastostatic&()>& solver, const Load& load,
              std::span<const std::optional<MovedInstrument>> instruments,
              std::vector<double>& shape, bool last = true);
  /// From another state: its shape and what is touched in it, in points if they are known.
  void restart(std::span<const double> shape, std::vector<NodeTouch> touches,
               std::vector<PointTouch> points = {});
  /// Of the last shape; where something is touched, a larger one.
  const Box3& box() const noexcept { return facets_.box(); }
  /// range_of the last shape, if it is known.
  const std::optional<Box3>& range() const noexcept { return facets_.range(); }

  /// By ascending node and instrument; forces that don't vanish.
  const std::vector<NodeTouch>& touches() const noexcept { return touches_; }
  /// The points that these are of, where they are known.
  const std::vector<PointTouch>& points() const noexcept { return points_; }
  /// How far an instrument has given way in the last update, from where it is now.
  Vec3 gave(std::size_t instrument) const {
    return instrument < gave_.size() ? gave_[instrument] : Vec3{};
  }
  /// A node inside an instrument, by more than 1e-6 of its radius, that can't be moved out: it is
  /// held.
  std::optional<NodeTouch> stuck() const { return stuck_; }
  /// Whether the last forces meet the conditions, and their directions the surfaces.
  bool solved() const noexcept { return solved_; }
  /// Since the last call.
  TouchCounts take_counts() { return std::exchange(counts_, {}); }

private:
  using Placed = std::vector<std::optional<PlacedInstrument>>;
  void set_part(std::span<const double> shape, const PartOfShape& part);
  std::vector<std::uint32_t> nodes_of(std::span<const std::size_t> blocks) const;
  void place(std::span<const std::uint32_t> nodes, std::span<const Vec3> at);
  bool take_part(Yielding& object, std::span<const std::uint32_t> nodes, std::span<const Vec3> at,
                 std::span<const Box3> places);
  void take_whole(Yielding& object, std::span<const std::uint32_t> nodes, std::span<const Vec3> at,
                  std::span<const Box3> places);
  void find(const Placed& placed, const std::map<std::uint32_t, Vec3>& displaced,
            std::span<const double> shape, double depth, std::vector<std::uint32_t>& inside);
  ContactNodes around(std::span<const std::uint32_t> nodes,
                      const std::map<std::uint32_t, Vec3>& displaced,
                      std::span<const double> before) const;
  bool solve_all(Yielding& object, std::span<const std::uint32_t> nodes,
                 const std::map<std::uint32_t, Vec3>& displaced, const Placed& placed,
                 std::span<const std::optional<MovedInstrument>> moved,
                 std::span<const double> before, std::span<const PointTouch> last,
                 std::size_t& vain_pairs, std::vector<Vec3>& at);
  Vec3 rest(std::uint32_t node) const { return model_.nodes[node].position; }

  const Model& model_;
  SurfaceFacets facets_;
  std::vector<Vec3> inward_; ///< at rest, by node
  std::vector<NodeTouch> touches_;
  std::vector<PointTouch> points_;
  std::vector<Vec3> gave_; ///< by instrument; empty: none gives way
  std::optional<NodeTouch> stuck_;
  bool solved_ = true;
  std::vector<double> next_; ///< the shape that is found, in the memory of the last but one
  PartOfShape next_part_;    ///< what is known of it
  TouchCounts counts_;
};

} // namespace gewebe
