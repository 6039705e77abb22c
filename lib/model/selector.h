#pragma once
// Selectors of nodes of a model, the language of gewebe_selector(7).

#include "geometry/vec3.h"
#include "model/model.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace gewebe::model {

/// Ranges of node numbers, both ends included.
using NodeRanges = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

/// A parsed selector: a Boolean expression in postfix order.
struct Selector {
  enum class Op : std::uint8_t {
    logical_and,
    logical_or,
    logical_not, // of the results before
    all,
    surface,
    inside,
    central,
    boundary,
    box,
    sphere,
    plane,
    near, // numbers[0 …]
    less,
    less_equal,
    greater,
    greater_equal, // coordinate `index` against numbers[0]
    component,     // `index`
    nodes,
    file, // `ranges`; `file_name`
  };
  struct Step {
    Op op = Op::all;
    std::uint32_t index = 0;
    std::vector<double> numbers;
    NodeRanges ranges;
    std::string file_name;
  };
  std::string text; ///< as given, for messages
  std::vector<Step> steps;
};

/// \throw Error "selector TEXT: column N: what is wrong, what was expected", columns from 1. The
/// fault is one of use where the text comes from a command line.
Selector parse_selector(std::string_view text);

/// The names of the node lists that it reads.
std::vector<std::string> node_list_names(const Selector& selector);

/// Whether it selects nodes by number, which are others in each mesh of a body.
bool has_node_numbers(const Selector& selector);

/// Returns the text of the node list that a selector names as @NAME. It may throw Error.
using LoadNodeList = std::function<std::string(const std::string& name)>;

/// Nodes over which a selector ranges by default.
enum class SelectorScope : std::uint8_t {
  surface, ///< nodes of the surface
  body,    ///< also nodes inside a solid
};

/// The selected nodes, ascending; never empty. Positions are those at rest. A selector that names
/// central nodes (by `central`, `all` or their numbers) ranges over all nodes. One that names nodes
/// inside a solid (by `inside` or their numbers) ranges over all except central nodes. Any other
/// one ranges over the scope. \pre the invariants of model.h hold
/// \throw Error if it selects nothing, or names a node or a component that the model does not have;
/// for a node list file with place "NAME:LINE"
std::vector<std::uint32_t> select_nodes(const Model& model, const Selector& selector,
                                        const LoadNodeList& load = nullptr,
                                        SelectorScope scope = SelectorScope::surface);

/// The same where the counts of this model are known.
std::vector<std::uint32_t> select_nodes(const Model& model, const NodeCounts& counts,
                                        const Selector& selector,
                                        const LoadNodeList& load = nullptr,
                                        SelectorScope scope = SelectorScope::surface);

/// Numbers and ranges (7-9), separated by blanks, commas or line ends; `#` starts a comment.
/// \throw Error, place "NAME:LINE"
NodeRanges parse_node_list(std::string_view text, const std::string& name);

} // namespace gewebe::model
