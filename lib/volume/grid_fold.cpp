#include "volume/grid_fold.h"

#include "base/parallel.h"
#include "volume/grid_internal.h"

#include <openvdb/tree/ValueAccessor.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <optional>
#include <set>
#include <utility>

namespace gewebe::volume {
namespace {

using openvdb::Coord;
using Upper = FloatTree::RootNodeType::ChildNodeType;
using Lower = Upper::ChildNodeType;
using Leaf = FloatLeaf;
using Kind = BlockDecision::Kind;

/// A grid in one block: a node, or constant.
template <class Node>
struct Item {
  const Node* node = nullptr;
  float value = 0;
  bool active = false;
};

template <class Node>
Item<typename Node::ChildNodeType> child_item(const Item<Node>& parent, openvdb::Index n) {
  if (parent.node == nullptr)
    return {nullptr, parent.value, parent.active};
  if (parent.node->isChildMaskOn(n))
    return {parent.node->getTable()[n].getChild(), 0, false};
  return {nullptr, parent.node->getTable()[n].getValue(), parent.node->isValueMaskOn(n)};
}

std::uint64_t leaves_in(const Leaf&) {
  return 1;
}
std::uint64_t leaves_in(const Lower& node) {
  return node.getChildMask().countOn();
}
std::uint64_t leaves_in(const Upper& node) {
  std::uint64_t count = 0;
  for (auto child = node.cbeginChildOn(); child; ++child)
    count += leaves_in(*child);
  return count;
}

/// Calls visit(leaf) for the leaves and visit(level, origin, value) for the tiles that aren't 0.
template <class Visit>
void for_contents(const Leaf& leaf, Visit&& visit) {
  visit(leaf);
}
template <class Node, class Visit>
void for_contents(const Node& node, Visit&& visit) {
  for (auto child = node.cbeginChildOn(); child; ++child)
    for_contents(*child, visit);
  for (auto tile = node.cbeginValueAll(); tile; ++tile)
    if (*tile != 0)
      visit(Node::LEVEL, tile.getCoord(), *tile);
}

struct Constant {
  Coord origin;
  openvdb::Index level;
  float value;
};
struct Take {
  Coord origin;
  openvdb::Index level; ///< of the tile that would fill the block
  std::size_t operand;
};
struct LeafTask {
  Coord origin;
  BlockDecision outcome;
  float* values = nullptr; ///< where computed
  std::array<std::uint64_t, 8> active{};
};

/// What has to be done to the tree of grid `base`, or to an empty one.
class Plan {
public:
  Plan(std::span<const Grid> grids, std::optional<std::size_t> base, const BlockRule& rule,
       FoldReport& report, const Context& context)
      : base_(base), rule_(rule), report_(report), sources_(grids.size()) {
    std::set<Coord> origins;
    for (const Grid& grid : grids) {
      by_mask_.push_back(grid.summary(context).active_where_not_0);
      const auto& root = std::as_const(*grid.native()->tree).root();
      for (auto child = root.cbeginChildOn(); child; ++child)
        origins.insert(child.getCoord());
      for (auto tile = root.cbeginValueAll(); tile; ++tile)
        origins.insert(tile.getCoord());
    }
    std::vector<Item<Upper>> items(grids.size());
    for (const Coord& origin : origins) {
      for (std::size_t g = 0; g < grids.size(); ++g) {
        const auto& root = std::as_const(*grids[g].native()->tree).root();
        const Upper* const node = root.probeConstNode<Upper>(origin);
        items[g] = {node, node != nullptr ? 0 : root.getValue(origin),
                    node == nullptr && root.isValueOn(origin)};
      }
      block<Upper>(items, origin);
    }
  }

  std::vector<Constant> constants;
  std::vector<Take> takes;
  std::vector<LeafTask> leaves;
  std::vector<BlockSource> leaf_sources; ///< of each in turn, one for each grid
  std::uint64_t shared_leaves = 0;       ///< in `takes`

private:
  template <class Node>
  void block(std::span<const Item<Node>> items, const Coord& origin) {
    bool detail = false, not_0 = false, sloppy = false;
    for (std::size_t g = 0; g < items.size(); ++g) {
      detail = detail || items[g].node != nullptr;
      not_0 = not_0 || items[g].value != 0;
      sloppy = sloppy || items[g].active;
    }
    if (!detail && !not_0 && !sloppy)
      return;
    for (std::size_t g = 0; g < items.size(); ++g) {
      sources_[g].detail = items[g].node != nullptr;
      sources_[g].constant = items[g].value;
    }
    const BlockDecision decision = rule_(sources_);
    report_.tiles_combined += !detail && not_0 ? 1 : 0;
    switch (decision.kind) {
    case Kind::constant: {
      for (const Item<Node>& item : items)
        report_.leaves_skipped += item.node != nullptr ? leaves_in(*item.node) : 0;
      const Item<Node> old = base_ ? items[*base_] : Item<Node>{};
      if (old.node != nullptr || old.value != decision.value || old.active != (decision.value != 0))
        constants.push_back({origin, Node::LEVEL + 1, decision.value});
      break;
    }
    case Kind::take: {
      const std::uint64_t count = leaves_in(*items[decision.operand].node);
      report_.leaves_taken += count;
      if (decision.operand != base_) {
        shared_leaves += count;
        takes.push_back({origin, Node::LEVEL + 1, decision.operand});
      }
      break;
    }
    case Kind::look_inside:
      look_inside<Node>(items, origin);
      break;
    }
  }

  template <class Node>
  void look_inside(std::span<const Item<Node>> items, const Coord& origin) {
    if constexpr (std::is_same_v<Node, Leaf>) {
      leaves.push_back({origin, {}, nullptr, {}});
      for (const Item<Leaf>& item : items)
        leaf_sources.push_back({item.node != nullptr, item.value,
                                item.node != nullptr ? view_of(*item.node) : LeafView{}});
    } else {
      using Child = typename Node::ChildNodeType;
      const Node* const some =
          std::ranges::find_if(items, [](const Item<Node>& i) { return i.node != nullptr; })->node;
      std::vector<Item<Child>> children(items.size());
      for (openvdb::Index word = 0; word < Node::NUM_VALUES / 64; ++word)
        for (std::uint64_t bits = slots_in_use(items, word); bits != 0; bits &= bits - 1) {
          const auto n = word * 64 + static_cast<openvdb::Index>(std::countr_zero(bits));
          for (std::size_t g = 0; g < items.size(); ++g)
            children[g] = child_item(items[g], n);
          block<Child>(children, some->offsetToGlobalCoord(n));
        }
    }
  }

  /// Which of 64 children may be anything but inactive 0.
  template <class Node>
  std::uint64_t slots_in_use(std::span<const Item<Node>> items, openvdb::Index word) const {
    std::uint64_t bits = 0;
    for (std::size_t g = 0; g < items.size(); ++g) {
      const Item<Node>& item = items[g];
      if (item.node == nullptr ? item.value != 0 || item.active : !by_mask_[g])
        return ~std::uint64_t{0};
      if (item.node != nullptr)
        bits |= item.node->getChildMask().template getWord<std::uint64_t>(word) |
                item.node->getValueMask().template getWord<std::uint64_t>(word);
    }
    return bits;
  }

  std::optional<std::size_t> base_;
  const BlockRule& rule_;
  FoldReport& report_;
  std::vector<BlockSource> sources_;
  std::vector<bool> by_mask_; ///< masks tell where a grid isn't 0
};

/// The tree under change.
class Target {
public:
  Target(FloatTree::Ptr tree, std::shared_ptr<LeafStorage> storage)
      : tree_(std::move(tree)), storage_(std::move(storage)), accessor_(*tree_) {}

  void constant(const Constant& block) {
    clear(block.origin, block.level);
    accessor_.addTile(block.level, block.origin, block.value, block.value != 0);
  }
  /// \pre `values` outlive the tree
  void leaf(const Coord& origin, const float* values, const Leaf::NodeMaskType& mask) {
    // The pointer is not written through while it may be shared: grids are immutable.
    auto* const borrowed = const_cast<float*>(values);
    if (Leaf* const old = accessor_.probeLeaf(origin)) {
      borrow_values(*old, borrowed);
      old->setValueMask(mask);
      return;
    }
    BorrowingLeaf fresh = borrowing_leaf(origin, borrowed);
    fresh->setValueMask(mask);
    accessor_.addLeaf(fresh.release());
  }
  void take(const Take& block, const FloatTree& from) {
    clear(block.origin, block.level);
    if (block.level > 1)
      accessor_.addTile(block.level, block.origin, 0, false);
    if (block.level == 1)
      contents(*from.probeConstLeaf(block.origin));
    else if (block.level == 2)
      contents(*from.root().probeConstNode<Lower>(block.origin));
    else
      contents(*from.root().probeConstNode<Upper>(block.origin));
  }

  const FloatTree::Ptr& tree() const { return tree_; }
  const std::shared_ptr<LeafStorage>& storage() const { return storage_; }

private:
  struct Sharer {
    Target& target;
    void operator()(const Leaf& leaf) const {
      target.leaf(leaf.origin(), leaf.buffer().data(), leaf.getValueMask());
    }
    void operator()(openvdb::Index level, const Coord& origin, float value) const {
      target.accessor_.addTile(level, origin, value, value != 0);
    }
  };
  template <class Node>
  void contents(const Node& node) {
    for_contents(node, Sharer{*this});
  }
  /// Leaves in the block forget their values, since they are about to be deleted.
  void clear(const Coord& origin, openvdb::Index level) {
    if (level == 1) {
      if (Leaf* const leaf = accessor_.probeLeaf(origin))
        give_back(*leaf);
    } else if (level == 2) {
      if (Lower* const node = tree_->root().probeNode<Lower>(origin))
        give_back_all(*node);
    } else if (Upper* const node = tree_->root().probeNode<Upper>(origin)) {
      for (auto child = node->beginChildOn(); child; ++child)
        give_back_all(*child);
    }
    if (level > 1)
      accessor_.clear(); // it may know nodes that go
  }
  static void give_back_all(Lower& node) {
    for (auto leaf = node.beginChildOn(); leaf; ++leaf)
      give_back(*leaf);
  }

  FloatTree::Ptr tree_;
  std::shared_ptr<LeafStorage> storage_;
  openvdb::tree::ValueAccessor<FloatTree> accessor_;
};

/// The largest of the grids without other owners.
std::optional<std::size_t> choose_base(std::span<const Grid> grids) {
  std::optional<std::size_t> base;
  openvdb::Index64 max = 0;
  for (std::size_t g = 0; g < grids.size(); ++g) {
    if (grids[g].native().use_count() != 1 || grids[g].native()->tree.use_count() != 1)
      continue;
    const openvdb::Index64 count = grids[g].native()->tree->leafCount();
    if (!base || count > max) {
      base = g;
      max = count;
    }
  }
  return base;
}

std::array<std::uint64_t, 8> not_0(const LeafValues& values) {
  std::array<std::uint64_t, 8> active{};
  for (std::size_t n = 0; n < values.size(); ++n)
    active[n / 64] |= static_cast<std::uint64_t>(values[n] != 0) << (n % 64);
  return active;
}

void compute(const Context& context, Plan& plan, std::size_t operands, const LeafRule& rule,
             LeafStorage& storage) {
  // One slot for each leaf that might need values of its own; those never written cost nothing.
  auto* const slots = reinterpret_cast<float*>(
      storage.pages.emplace_back(plan.leaves.size() * sizeof(LeafValues)).data());
  std::atomic<std::size_t> used{0};
  parallel_blocks(context, plan.leaves.size(), 128, [&](std::size_t begin, std::size_t end) {
    LeafValues values{};
    for (std::size_t n = begin; n < end; ++n) {
      LeafTask& task = plan.leaves[n];
      task.outcome = rule(std::span(plan.leaf_sources).subspan(n * operands, operands), values);
      if (task.outcome.kind != Kind::look_inside)
        continue;
      task.values = slots + used.fetch_add(1, std::memory_order_relaxed) * leaf_voxels;
      std::copy(values.begin(), values.end(), task.values);
      task.active = not_0(values);
    }
  });
}

} // namespace

Grid fold_grids(const Context& context, const GridInfo& info, std::vector<Grid> grids,
                const BlockRule& block_rule, const LeafRule& leaf_rule, FoldReport& report) {
  const std::optional<std::size_t> base = choose_base(grids);
  report = {};
  Plan plan(grids, base, block_rule, report, context);
  require_memory(context,
                 static_cast<double>(plan.leaves.size()) * (sizeof(LeafValues) + 128) +
                     static_cast<double>(plan.shared_leaves) * 128,
                 "the combined volume");
  auto storage = base ? grids[*base].native()->storage : std::make_shared<LeafStorage>();
  compute(context, plan, grids.size(), leaf_rule, *storage);

  // All is read; now the tree may change.
  Target target(base ? grids[*base].native()->tree : make_tree(0, storage), storage);
  std::vector<bool> lends(grids.size());
  for (const Constant& block : plan.constants)
    target.constant(block);
  for (const Take& block : plan.takes) {
    target.take(block, *grids[block.operand].native()->tree);
    lends[block.operand] = true;
  }
  for (std::size_t n = 0; n < plan.leaves.size(); ++n) {
    const LeafTask& task = plan.leaves[n];
    const BlockSource* const sources = plan.leaf_sources.data() + n * grids.size();
    Leaf::NodeMaskType mask;
    auto* const words = &mask.getWord<std::uint64_t>(0);
    switch (task.outcome.kind) {
    case Kind::constant: {
      const float value = task.outcome.value;
      ++report.leaves_constant;
      const bool same =
          base ? !sources[*base].detail && sources[*base].constant == value : value == 0;
      if (!same)
        target.constant({task.origin, 1, value});
      break;
    }
    case Kind::take: {
      const std::size_t g = task.outcome.operand;
      ++report.leaves_taken;
      if (g != base) {
        std::copy_n(sources[g].leaf.active, 8, words);
        target.leaf(task.origin, sources[g].leaf.values, mask);
        lends[g] = true;
      }
      break;
    }
    case Kind::look_inside:
      ++report.leaves_computed;
      std::copy(task.active.begin(), task.active.end(), words);
      target.leaf(task.origin, task.values, mask);
      break;
    }
  }
  for (std::size_t g = 0; g < grids.size(); ++g)
    if (lends[g])
      storage->lenders.push_back(grids[g].native());
  return make_grid(info, target.tree(), storage);
}

} // namespace gewebe::volume
