#pragma once
// Displaced nodes by the block C_cc on their free axes: f_c = C_cc⁻¹ (d - u_c of all other loads).
// Its factor follows the set as nodes join and leave.

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

namespace gewebe {

class ForcesAt {
public:
  /// Keeps references to all.
  ForcesAt(const Model& model, Compliance& compliance, LoadAnswer& answer)
      : model_(model), compliance_(compliance), answer_(answer) {}

  /// Whether displacements cost less this way. \param limit nodes up to which they do; SIZE_MAX: by
  /// what is at hand
  bool cheaper(const Load& now, std::size_t limit) const;
  /// Finds the forces. \return whether they meet the displacements
  bool meet(const Load& now);
  /// Of the last load that was met, by ascending node.
  std::vector<NodeVector> forces() const { return by_node(force_); }
  /// The first rows() of the shape under that load by what a rigid motion of these nodes did
  /// before, if this is one. \return whether it was
  bool shape(const Load& now, std::vector<double>& u);
  /// Loads with this set whose shapes were asked for otherwise, this one among them.
  int shapes() {
    shapes_ += counted_ ? 0 : 1;
    counted_ = true;
    return shapes_;
  }

  /// The rows of C_cc, x = C_cc⁻¹ x, and the forces by row.
  std::vector<std::size_t> axes() const;
  void solve(std::span<double> x) const { block_.solve(x); }
  std::span<const double> force() const { return force_; }

  double largest_miss() const noexcept { return miss_; } ///< so far, over the largest displacement

private:
  struct Contact {
    std::uint32_t node = 0;
    std::vector<std::size_t> axes;
  };
  bool join(std::uint32_t node);
  void leave_all();
  bool take_nodes(const std::map<std::uint32_t, Vec3>& nodes);
  std::vector<NodeVector> by_node(std::span<const double> force) const;

  const Model& model_;
  Compliance& compliance_;
  LoadAnswer& answer_;
  std::vector<Contact> contacts_; ///< in order of arrival
  ContactBlock block_;
  std::uint64_t changes_ = 0;    ///< of the block
  std::vector<double> question_; ///< what they have to be moved by, beyond other loads
  std::vector<double> force_;    ///< by axis of the block
  int shapes_ = 0;               ///< see shapes()
  bool counted_ = false;         ///< the last load among them
  ShapeModes modes_;             ///< of this set: question to shape
  double miss_ = 0;
};

} // namespace gewebe
