#pragma once
// Cuts: springs of a model that are gone, edges of its surface that have come apart.
//
// Along opened edges the fan of triangles round a node falls into pieces. The piece with the
// largest area keeps the node, each other one gets a copy of it. What a node has is shared among
// its copies by area, what an edge has among the triangles beside it, so that nothing is lost: as
// long as copies stand where their node was, masses and springs add up to what they were, but for
// springs that are gone. The surface stays manifold where it was, with one boundary loop more for
// each wound.

#include "model/model.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace gewebe {

/// What is to be severed, of one model. Lists ascend, without repetitions.
struct Cut {
  /// Removed outright, whatever their kind. Triangles beside a spring of kind edge vanish with it.
  std::vector<std::size_t> springs;
  /// Edges i < j of the surface along which it comes apart.
  std::vector<std::array<std::uint32_t, 2>> edges;
  /// A spring without a triangle (central, or free) that the cut passes on one side of its node:
  /// the copy that has this corner of a triangle gets no share of it.
  struct Side {
    std::uint32_t corner = 0; ///< 3 triangle + k
    std::uint32_t other = 0;  ///< the spring's other end

    auto operator<=>(const Side&) const = default;
  };
  std::vector<Side> sides;

  bool empty() const { return springs.empty() && edges.empty(); }
};

/// Both at once, of the same model.
Cut merged(const Cut& a, const Cut& b);

struct CutModel {
  /// In `place`: a node that is no longer in the model.
  static constexpr std::uint32_t gone = std::numeric_limits<std::uint32_t>::max();

  /// A node of a cut solid that stands where none did: what nodes before had is its to these
  /// shares.
  struct Between {
    std::uint32_t node = 0;
    std::vector<std::pair<std::uint32_t, double>> of; ///< nodes before, sum 1

    bool operator==(const Between&) const = default;
  };

  Model model;
  /// By node: the node before that it is, or is a copy of; of a node between others the one with
  /// the largest share.
  std::vector<std::uint32_t> origin;
  std::vector<std::uint32_t> place; ///< by node before: its number now, or gone
  /// By node: its part of what the node before had, sums 1; 0 of one that was put between others.
  std::vector<double> share;
  std::vector<Between> between; ///< ascending: new ones, and those that have been moved
  Cut left;                     ///< edges asked for that did not come apart yet, of the new model
  std::size_t doubled = 0;      ///< copies
  std::size_t removed = 0;      ///< springs of which nothing is left
  std::size_t split = 0;        ///< springs that have become several

  bool changed() const { return doubled > 0 || removed > 0; }
};

/// The model with the cut carried out. Nodes of the surface keep their numbers, copies stand behind
/// them by ascending node, central nodes behind these. A single edge with surface all round does
/// not come apart: it is `left`, to be asked for again with its neighbour.
///
/// Bending springs across an edge that came apart are gone, others follow their triangles; so do
/// edge springs. A central spring is shared by area. Any other spring without a triangle goes with
/// the copy on whose side its other end lies.
///
/// Takes a few passes over the model, whose work beside them is that of the place where it is cut.
/// The result passes check_model. \pre check_model(model) passes \throw Error if a spring or edge
/// does not exist
CutModel cut_model(const Model& model, const Cut& cut);

/// \throw Error if a node of the surface that the model holds has lost its last spring
void require_held(const Model& before, const CutModel& cut);

/// Some nodes of a model as a model of their own.
struct ModelPart {
  Model model;
  std::vector<std::uint32_t> origin; ///< by node: its number in the whole
};

/// What came off by a cut.
struct FreeParts {
  std::optional<ModelPart> rest; ///< none: all of the cut model stays
  std::vector<ModelPart> parts;  ///< by smallest node
};

/// Parts of a cut model, connected by springs, triangles and tetrahedra, that hung together with
/// more before and now have no node that the model holds along any axis. Where there is none that
/// is held, the part with the most nodes stays (ties: the one with the smallest node). Central
/// nodes that no spring holds any more and that can move, or to which no node belongs, are left
/// out. Parts have no skin (solid/skin_parts.h gives them theirs).
FreeParts free_parts(const Model& before, const CutModel& cut);

/// The cut model without the parts that came off, as one step from the model before.
CutModel without_parts(CutModel cut, std::optional<ModelPart> rest);

} // namespace gewebe
