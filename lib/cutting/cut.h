#pragma once
// Cuts of a model: removed springs, and opened edges of its surface.
//
// Opened edges divide the fan of triangles round a node into pieces. The piece with the largest
// area keeps the node; each other piece gets a copy of it. Quantities of a node are shared among
// its copies by area, those of an edge among the triangles beside it. Nothing is lost: while copies
// stand at the position of their node, masses and springs add up to the former values, except for
// removed springs. A manifold surface stays manifold, with one more boundary loop for each wound.

#include "model/model.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace gewebe::cutting {

/// Springs and edges of a model to be severed. Lists ascend, without repetitions.
struct Cut {
  /// Springs to be removed, of any kind. Triangles beside a spring of kind edge vanish with it.
  std::vector<std::size_t> springs;
  /// Edges i < j of the surface to be opened.
  std::vector<std::array<std::uint32_t, 2>> edges;
  /// A spring without a triangle (central, or free) on one side of the cut: the copy of its node
  /// that has this corner of a triangle gets no share of it.
  struct Side {
    std::uint32_t corner = 0; ///< 3 triangle + k
    std::uint32_t other = 0;  ///< the spring's other end

    auto operator<=>(const Side&) const = default;
  };
  std::vector<Side> sides;

  bool empty() const { return springs.empty() && edges.empty(); }
};

/// Union of two cuts of the same model.
Cut merged(const Cut& a, const Cut& b);

struct CutModel {
  /// In `place`: a node that is no longer in the model.
  static constexpr std::uint32_t gone = std::numeric_limits<std::uint32_t>::max();

  /// A node of a cut solid at a new position: it gets these shares of the quantities of former
  /// nodes.
  struct Between {
    std::uint32_t node = 0;
    std::vector<std::pair<std::uint32_t, double>> of; ///< nodes before, sum 1

    bool operator==(const Between&) const = default;
  };

  model::Model model;
  /// By node: the former node that it is, or is a copy of; for a node between others that with the
  /// largest share.
  std::vector<std::uint32_t> origin;
  std::vector<std::uint32_t> place; ///< by former node: its present number, or gone
  /// By node: its share of the former node's quantities, sums 1; 0 for a node between others.
  std::vector<double> share;
  std::vector<Between> between; ///< ascending: new nodes, and those that have been moved
  Cut left;                     ///< requested edges that are not open yet, of the new model
  std::size_t doubled = 0;      ///< number of copies
  std::size_t removed = 0;      ///< number of springs that are gone
  std::size_t split = 0;        ///< number of springs that have become several

  bool changed() const { return doubled > 0 || removed > 0; }
};

/// Cuts a model. Nodes of the surface keep their numbers; copies come after them by ascending node,
/// then central nodes. A single edge inside the surface can't open: it is `left`, for a later call
/// together with its neighbour.
///
/// Bending springs across an opened edge are removed. Other bending springs and edge springs follow
/// their triangles. A central spring is shared by area. Any other spring without a triangle goes to
/// the copy on the side of its other end.
///
/// Time is a few passes over the model, plus work in proportion to the size of the cut. The result
/// passes check_model. \pre check_model(model) passes
/// \throw Error if a spring or edge does not exist
CutModel cut_model(const model::Model& model, const Cut& cut);

/// \throw Error if a node of the surface that the model holds has lost its last spring
void require_held(const model::Model& before, const CutModel& cut);

/// Some nodes of a model as a model of their own.
struct ModelPart {
  model::Model model;
  std::vector<std::uint32_t> origin; ///< by node: its number in the whole
};

/// Parts that came off by a cut.
struct FreeParts {
  std::optional<ModelPart> rest; ///< none: all of the cut model stays
  std::vector<ModelPart> parts;  ///< by smallest node
};

/// Finds the parts of a cut model that have come off. A part is connected by springs, triangles and
/// tetrahedra. It has come off if it was connected with other nodes before, and no node of it is
/// held along any axis. If no part is held, the one with the most nodes stays (ties: the one with
/// the smallest node). Central nodes are left out if they can move and no spring holds them, or if
/// no node belongs to them. Parts have no embedded surface (cutting/skin_parts.h adds it).
FreeParts free_parts(const model::Model& before, const CutModel& cut);

/// The cut model without the parts that came off, as one step from the model before.
CutModel without_parts(CutModel cut, std::optional<ModelPart> rest);

} // namespace gewebe::cutting
