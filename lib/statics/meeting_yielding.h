#pragma once
// Surfaces that touch each other, or themselves, as what gives way to instruments: an object whose
// nodes push each other by pairs of a node and a triangle (contact/surface_pairs.h), unilateral and
// with Coulomb friction. What presses the node along the normal presses the triangle's corners the
// other way, by the weights of the point, so that action is reaction to rounding.
//
// In turn: the pairs' points and normals where the nodes were last; their forces (contact_solver.h)
// with the Delassus operator B W Bᵀ, B the weights of nodes and corners; where these put the nodes,
// until the points stay. Who asks what instruments can do meets the object with the pairs that push
// held together, W - W Cᵀ (C W Cᵀ)⁻¹ C W. Nodes that are behind a triangle in the whole shape join,
// and it begins again. What overlaps when a step begins comes apart by a twentieth of an edge a
// step.

#include "contact/surface_pairs.h"
#include "statics/static_contact.h"

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <tuple>
#include <vector>

namespace gewebe {

/// The instrument of a NodeTouch that another surface is.
inline constexpr std::uint32_t other_surface = UINT32_MAX;

/// Of an edge: so deep is not inside.
inline constexpr double surface_depth = 1e-4;

/// A pair and the force on its node; its triangle has the opposite one.
struct SurfacePush {
  SurfacePair pair;
  Vec3 force;
};

class MeetingYielding final : public Yielding {
public:
  /// Keeps references. \param held whether a node gives way along no axis \param was displacements
  /// when the step began \param touched nodes that surfaces pushed in the last step, ascending
  MeetingYielding(Yielding& object, SurfacePairs& pairs, std::function<bool(std::uint32_t)> held,
                  std::span<const double> was, std::vector<std::uint32_t> touched);

  DelassusOperator delassus_operator(std::span<const std::uint32_t> nodes) override;
  bool push(std::span<const NodeTouch> touches, std::span<const Vec3> at) override;
  std::span<const double> shape() override { return object_.shape(); }

  /// Sums of the pairs' forces on nodes, by ascending ones.
  std::vector<NodeTouch> touches() const;
  /// Whether the last forces meet the conditions.
  bool solved() const noexcept { return solved_; }
  TouchCounts counts() const;

private:
  using Key = std::tuple<std::uint32_t, bool, std::uint32_t>;
  struct Columns {
    Eigen::MatrixXd moved;      ///< by pairs' forces, three columns each: nodes of the operator
    Eigen::MatrixXd compliance; ///< of the pairs
  };

  void begin();
  bool join(std::vector<SurfacePair> found, bool first);
  void ask();
  void take_shape();
  void solve();
  bool gather_nodes();
  Eigen::VectorXd without_pairs() const;
  Columns columns_of(std::span<const SurfacePush> pairs) const;
  Vec3 between(const SurfacePair& pair, std::span<const Vec3> at) const;
  double target_of(const SurfacePair& pair) const;
  double miss_of(std::span<const SurfacePush> pairs) const;
  void solve_linear(std::vector<SurfacePush>& pairs, const Eigen::VectorXd& base,
                    Eigen::VectorXd& x);
  std::vector<std::size_t> counting(std::span<const SurfacePush> pairs) const;

  Yielding& object_;
  SurfacePairs& pairs_;
  std::function<bool(std::uint32_t)> held_;
  std::vector<double> was_;
  std::vector<Vec3> was_at_;
  std::vector<std::uint32_t> touched_;
  std::map<Key, double> overlaps_; ///< gaps when the step began

  std::vector<std::uint32_t> own_; ///< nodes that instruments may touch
  std::vector<SurfacePush> all_;   ///< by Key
  std::vector<std::uint32_t> nodes_, more_;
  DelassusOperator delassus_;     ///< of nodes_: own_, those of pairs, and more_
  std::vector<NodeTouch> pushed_; ///< by instruments, last
  std::vector<Vec3> at_;          ///< places of all nodes
  Eigen::VectorXd x_;             ///< of nodes_ under all forces
  bool begun_ = false, fresh_ = false, solved_ = true;
  int waits_ = 0, turns_ = 0;
  double left_ = 0; ///< of gaps, over an edge
};

} // namespace gewebe
