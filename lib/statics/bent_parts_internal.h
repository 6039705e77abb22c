#pragma once
// Newton's matrix of a contact in parts: nodes in contact far from each other hardly feel how their
// forces turn. With W̃ the blocks of W of each part alone, x with
//
//   x - W̃ H (x - x_last) + W̃ H (W - W̃) (f - f_last) = x_free + W f
//
// for forces f is where x_free + W f has it as soon as neither the forces nor the places change, as
// without parts; until then each turn leaves the little that far forces' change would turn. A part
// is solved for itself: at the cost of its own size cubed, not that of all.

#include "statics/bent_compliance_internal.h"

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe {

struct ContactNodes;

/// Nodes that give way, by parts.
struct ContactParts {
  std::vector<std::uint32_t> of_node;          ///< of each moving node
  std::vector<std::vector<Eigen::Index>> rows; ///< of each part, ascending
  std::vector<Eigen::MatrixXd> compliance;     ///< W of these alone

  std::size_t size() const { return rows.size(); }
};

/// Parts that share no piece of surface and move each other by little. \param w of three rows for
/// each moving node
ContactParts parts_of(const ContactNodes& nodes, const BentCompliance::Compliance& w);

/// Where the nodes would be but for what the last pushes are.
struct BentStart {
  Eigen::VectorXd free;  ///< under forces that act whatever the pushes are
  Eigen::VectorXd turns; ///< of it in parts: how far the forces' turning has moved them by now
};

class BentParts {
public:
  /// \param w, turning as BentCompliance has them: of each part, whose rows are those of the part;
  /// of all in one without parts. \param parts must live
  BentParts(const BentCompliance::Compliance& w, std::vector<Turning> turning,
            const ContactParts* parts = nullptr);

  bool in_parts() const { return parts_ != nullptr; }
  /// \param held forces that act whatever the pushes are \param at the last places
  BentStart start(const Eigen::VectorXd& free, const Eigen::VectorXd& held,
                  const Eigen::VectorXd& at) const;
  /// Where the nodes are without pushes. \param pushed the last pushes on the nodes
  Eigen::VectorXd without(const BentStart& start, const Eigen::VectorXd& pushed) const;
  /// How pushes move the nodes, from columns of W: in place. \param node of each `width` columns
  /// one of those that are pushed
  void apply(Eigen::MatrixXd& columns, std::span<const std::uint32_t> node,
             Eigen::Index width) const;
  /// H of a vector of all rows.
  Eigen::VectorXd turning(const Eigen::VectorXd& x) const;

private:
  BentCompliance::Compliance w_;
  const ContactParts* parts_ = nullptr; ///< null: one
  std::vector<BentCompliance> bent_;    ///< by part
};

} // namespace gewebe
