#pragma once
// Solver for prescribed displacements by the block C_cc on their free axes: f_c = C_cc⁻¹ (d - u_c
// of all other loads). Its factor is updated when nodes join and leave.

#include "base/copy_on_write.h"
#include "compliance/compliance.h"
#include "compliance/contact_block.h"
#include "compliance/load_answer.h"
#include "compliance/shape_modes.h"
#include "contact/load.h"
#include "model/model.h"

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

namespace gewebe::compliance {

/// Reactions of a set of displaced nodes.
class ForcesAt {
public:
  struct Contact {
    std::uint32_t node = 0;
    std::vector<std::size_t> axes;
  };
  /// Factor of C_cc and shapes of rigid motions, whose bits depend on which nodes came when. Copies
  /// share them.
  struct Past {
    CopyOnWrite<std::vector<Contact>> contacts{}; ///< in order of arrival
    CopyOnWrite<ContactBlock> block{};
    std::uint64_t changes = 0;                   ///< of the block
    CopyOnWrite<std::vector<double>> question{}; ///< d - u_c
    CopyOnWrite<std::vector<double>> force{};    ///< by axis of the block
    int shapes = 0;                              ///< see ForcesAt::shapes()
    bool counted = false;                        ///< `shapes` includes the last load
    CopyOnWrite<ShapeModes> modes{};             ///< of these nodes: from d - u_c to the shape
  };
  const Past& past() const noexcept { return now_; }
  void restore(const Past& past) { now_ = past; }

  /// Keeps references to all.
  ForcesAt(const model::Model& model, Compliance& compliance, LoadAnswer& answer)
      : model_(model), compliance_(compliance), answer_(answer) {}

  /// Whether this solver is cheaper for a load.
  /// \param limit  number of displaced nodes up to which it is; SIZE_MAX: from the cost model and
  /// the available columns
  bool cheaper(const contact::Load& now, std::size_t limit) const;
  /// Finds the forces. \return whether they produce the displacements
  bool meet(const contact::Load& now);
  /// Reactions under the last load of meet(), by ascending node.
  std::vector<contact::NodeVector> forces() const { return by_node(*now_.force); }
  /// The first rows() of the shape under that load, if the displacements are a rigid motion of
  /// these nodes whose shape follows from earlier ones. \return whether it was found
  bool shape(const contact::Load& now, std::vector<double>& u);
  /// Number of loads with these nodes whose shapes were computed by other means, this one included.
  int shapes() {
    now_.shapes += now_.counted ? 0 : 1;
    now_.counted = true;
    return now_.shapes;
  }

  /// Rows of C_cc.
  std::vector<std::size_t> axes() const;
  /// x = C_cc⁻¹ x.
  void solve(std::span<double> x) const { now_.block->solve(x); }
  /// Forces by row of C_cc.
  std::span<const double> force() const { return *now_.force; }

  /// Largest error of a prescribed displacement so far, over the largest displacement.
  double largest_miss() const noexcept { return miss_; }

private:
  bool join(std::uint32_t node);
  void leave_all();
  bool take_nodes(const std::map<std::uint32_t, Vec3>& nodes);
  std::vector<contact::NodeVector> by_node(std::span<const double> force) const;

  const model::Model& model_;
  Compliance& compliance_;
  LoadAnswer& answer_;
  Past now_;
  double miss_ = 0;
};

} // namespace gewebe::compliance
