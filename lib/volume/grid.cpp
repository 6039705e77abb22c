#include "volume/grid_internal.h"

#include "base/digest.h"
#include "base/error.h"
#include "base/parallel.h"
#include "volume/value_summary_internal.h"

#include <openvdb/tools/Prune.h>
#include <openvdb/tree/ValueAccessor.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

namespace gewebe::volume {
namespace {

using openvdb::Coord;
using Leaf = FloatLeaf;
using LeafBuffer = Leaf::Buffer;

static_assert(Leaf::DIM == leaf_dim && Leaf::SIZE == leaf_voxels);

// OpenVDB has no call that lets a leaf's values lie in memory of ours. An explicit instantiation
// may name private members, which gives the address of the pointer without any trick on the layout.
// What else OpenVDB does with that pointer was read in version 10: new[], delete[], and nothing
// for a null pointer.
static_assert(OPENVDB_LIBRARY_MAJOR_VERSION_NUMBER == 10,
              "look at tree/LeafBuffer.h of this OpenVDB: is mData allocated, deleted and left "
              "alone where it is null as in version 10?");
float*& values_of(LeafBuffer& buffer);
template <auto Member>
struct Reveal {
  friend float*& values_of(LeafBuffer& buffer) { return buffer.*Member; }
};
template struct Reveal<&LeafBuffer::mData>;

constexpr openvdb::Index32 borrowed = 1; // Leaf::transientData

struct TreeDeleter {
  std::shared_ptr<LeafStorage> storage;
  void operator()(FloatTree* tree) {
    for (auto upper = tree->root().beginChildOn(); upper; ++upper)
      for (auto lower = upper->beginChildOn(); lower; ++lower)
        for (auto leaf = lower->beginChildOn(); leaf; ++leaf)
          give_back(*leaf);
    delete tree;
  }
};

} // namespace

void DeleteBorrowing::operator()(Leaf* leaf) const {
  give_back(*leaf);
  delete leaf;
}

BorrowingLeaf borrowing_leaf(const Coord& origin, float* values) {
  BorrowingLeaf leaf(new Leaf(openvdb::PartialCreate(), origin));
  values_of(leaf->buffer()) = values;
  leaf->setTransientData(borrowed);
  return leaf;
}

void give_back(Leaf& leaf) {
  if (leaf.transientData() == borrowed)
    values_of(leaf.buffer()) = nullptr;
}

void borrow_values(Leaf& leaf, float* values) {
  if (leaf.transientData() != borrowed)
    delete[] values_of(leaf.buffer()); // as ~LeafBuffer does
  values_of(leaf.buffer()) = values;
  leaf.setTransientData(borrowed);
}

std::uint64_t* mask_words(Leaf& leaf) {
  // NodeMask keeps its eight words in one array; the non-const accessor is the only way to its
  // address.
  return &const_cast<Leaf::NodeMaskType&>(leaf.getValueMask()).getWord<std::uint64_t>(0);
}

LeafView view_of(const Leaf& leaf) {
  return {to_int3(leaf.origin()), leaf.buffer().data(), mask_words(const_cast<Leaf&>(leaf))};
}

FloatTree::Ptr make_tree(float background, const std::shared_ptr<LeafStorage>& storage) {
  return {new FloatTree(background), TreeDeleter{storage}};
}

Grid make_grid(GridInfo info, FloatTree::Ptr tree, std::shared_ptr<LeafStorage> storage) {
  auto native = std::make_shared<Grid::Native>();
  native->tree = std::move(tree);
  native->storage = std::move(storage);
  return Grid(std::move(info), std::move(native));
}

Grid::Grid() : native_(std::make_shared<Native>()) {
  native_->storage = std::make_shared<LeafStorage>();
  native_->tree = make_tree(0, native_->storage);
}

Grid::Grid(GridInfo info, std::shared_ptr<Native> native)
    : info_(std::move(info)), native_(std::move(native)) {}

std::vector<LeafView> Grid::leaves() const {
  std::vector<LeafView> views;
  views.reserve(native_->tree->leafCount());
  for (auto upper = std::as_const(*native_->tree).root().cbeginChildOn(); upper; ++upper)
    for (auto lower = upper->cbeginChildOn(); lower; ++lower)
      for (auto leaf = lower->cbeginChildOn(); leaf; ++leaf)
        views.push_back(view_of(*leaf));
  return views;
}

namespace {

/// Appends the tiles of a node and its children, by place. OpenVDB's own iterator over all tiles
/// takes 20 times as long.
template <class Node>
void append_tiles(const Node& node, float background, std::vector<TileView>& views) {
  const auto* const table = node.getTable();
  for (openvdb::Index n = 0; n < Node::NUM_VALUES; ++n) {
    if (node.isChildMaskOn(n)) {
      if constexpr (Node::LEVEL > 1)
        append_tiles(*table[n].getChild(), background, views);
      continue;
    }
    const float value = table[n].getValue();
    const bool active = node.isValueMaskOn(n);
    if (active || value != background)
      views.push_back(
          {to_int3(node.offsetToGlobalCoord(n)), Node::ChildNodeType::DIM, value, active});
  }
}

} // namespace

std::vector<TileView> Grid::tiles() const {
  const auto& root = std::as_const(*native_->tree).root();
  std::vector<TileView> views;
  for (auto child = root.cbeginChildAll(); child; ++child) {
    float value = 0;
    if (const auto* const node = child.probeChild(value)) {
      append_tiles(*node, info_.background, views);
      continue;
    }
    const bool active = root.isValueOn(child.getCoord());
    if (active || value != info_.background)
      views.push_back({to_int3(child.getCoord()), 4096, value, active});
  }
  return views;
}

const ValueSummary& Grid::summary(const Context& context) const {
  std::call_once(native_->summary_once,
                 [&] { native_->summary = summarize_values(context, leaves(), tiles(), info_); });
  return native_->summary;
}

std::uint64_t Grid::active_voxels() const {
  return native_->tree->activeVoxelCount();
}

std::uint64_t Grid::memory_bytes() const {
  return native_->tree->memUsage();
}

bool Grid::active_box(Int3& min, Int3& max) const {
  openvdb::CoordBBox box;
  if (!native_->tree->evalActiveVoxelBoundingBox(box))
    return false;
  min = to_int3(box.min());
  max = to_int3(box.max());
  return true;
}

namespace {

/// Tiles go to the digest by the thousand: a call for each number would take longer than the hash.
class TileBytes {
public:
  explicit TileBytes(Digest& digest) : digest_(digest) {}
  void add(const TileView& tile) {
    const auto dim = static_cast<std::uint64_t>(tile.dim);
    const auto value = static_cast<double>(tile.value);
    const std::uint64_t active = tile.active ? 1 : 0;
    append(tile.origin.data(), sizeof tile.origin);
    append(&dim, sizeof dim);
    append(&value, sizeof value);
    append(&active, sizeof active);
    if (used_ + 64 > bytes_.size())
      flush();
  }
  void flush() {
    digest_.add_bytes(bytes_.data(), used_);
    used_ = 0;
  }

private:
  void append(const void* data, std::size_t size) {
    std::memcpy(bytes_.data() + used_, data, size);
    used_ += size;
  }
  Digest& digest_;
  std::array<std::byte, 16384> bytes_{};
  std::size_t used_ = 0;
};

std::uint64_t digest_of(const Grid& grid) {
  const GridInfo& info = grid.info();
  Digest digest;
  digest.add_bytes(info.transform.m.data(), sizeof info.transform.m);
  digest.add(info.isovalue);
  digest.add(info.band_isovalue.value_or(HUGE_VAL));
  digest.add(std::uint64_t{info.level_set});
  digest.add(static_cast<double>(info.background));
  digest.add_bytes(info.name.data(), info.name.size());
  for (const LeafView& leaf : grid.leaves()) {
    digest.add_bytes(leaf.origin.data(), sizeof leaf.origin);
    digest.add_bytes(leaf.active, leaf_voxels / 8);
    digest.add_bytes(leaf.values, leaf_voxels * sizeof(float));
  }
  TileBytes tiles(digest);
  for (const TileView& tile : grid.tiles())
    tiles.add(tile);
  tiles.flush();
  return digest.value();
}

} // namespace

std::uint64_t Grid::digest() const {
  const std::lock_guard lock(native_->digest_mutex);
  auto& known = native_->digest;
  if (!known || known->first != info_)
    known.emplace(info_, digest_of(*this));
  return known->second;
}

// ---- GridAccessor

struct GridAccessor::Cache {
  explicit Cache(const Grid& grid) : native(grid.native()), accessor(*native->tree) {}
  std::shared_ptr<Grid::Native> native; // keeps the tree alive
  openvdb::tree::ValueAccessor<const FloatTree> accessor;
};

GridAccessor::GridAccessor(const Grid& grid) : cache_(std::make_unique<Cache>(grid)) {}
GridAccessor::~GridAccessor() = default;
GridAccessor::GridAccessor(GridAccessor&&) noexcept = default;

float GridAccessor::lookup(const Int3& ijk) {
  float tile = 0;
  const LeafView leaf = leaf_at(ijk, tile);
  return leaf.values != nullptr ? leaf.values[leaf_offset(ijk)] : tile;
}

LeafView GridAccessor::leaf_at(const Int3& ijk, float& tile) {
  const Coord coord = to_coord(ijk);
  if (const Leaf* leaf = cache_->accessor.probeConstLeaf(coord)) {
    const LeafView view = view_of(*leaf);
    origin_ = view.origin;
    values_ = view.values;
    return view;
  }
  tile = cache_->accessor.getValue(coord);
  return {};
}

// ---- GridBuilder

struct GridBuilder::State {
  explicit State(GridInfo i)
      : info(std::move(i)), storage(std::make_shared<LeafStorage>()),
        tree(make_tree(info.background, storage)), accessor(*tree) {}
  GridInfo info;
  std::shared_ptr<LeafStorage> storage;
  FloatTree::Ptr tree;
  openvdb::tree::ValueAccessor<FloatTree> accessor;
  int threads = 1; // the last caller's
};

GridBuilder::GridBuilder(GridInfo info) : state_(std::make_unique<State>(std::move(info))) {}
GridBuilder::~GridBuilder() = default;
GridBuilder::GridBuilder(GridBuilder&&) noexcept = default;

namespace {

/// Refuses leaves that need more memory, with the nodes above them, than the context allows.
void require_leaves(const Context& context, std::span<const Int3> origins) {
  constexpr double leaf = leaf_voxels * sizeof(float) + sizeof(Leaf) + sizeof(LeafRef) + 8;
  constexpr double node = sizeof(FloatTree::RootNodeType::ChildNodeType::ChildNodeType);
  const auto node_of = [](const Int3& o) { return Int3{o[0] >> 7, o[1] >> 7, o[2] >> 7}; };
  const double leaves = static_cast<double>(origins.size());
  if (leaves * (leaf + node) <= static_cast<double>(context.max_memory))
    return;
  std::vector<Int3> nodes;
  for (const Int3& origin : origins)
    if (nodes.empty() || node_of(origin) != nodes.back())
      nodes.push_back(node_of(origin));
  std::ranges::sort(nodes);
  nodes.erase(std::ranges::unique(nodes).begin(), nodes.end());
  require_memory(context, leaves * leaf + static_cast<double>(nodes.size()) * node, "the volume");
}

} // namespace

std::vector<LeafRef> GridBuilder::add_leaves(const Context& context,
                                             std::span<const Int3> origins) {
  require_leaves(context, origins);
  state_->threads = context.threads;
  auto* const values = reinterpret_cast<float*>(
      state_->storage->pages.emplace_back(origins.size() * leaf_voxels * sizeof(float)).data());
  std::vector<BorrowingLeaf> leaves(origins.size());
  std::vector<LeafRef> refs(origins.size());
  const float background = state_->info.background;
  Context quiet = context;
  quiet.progress = nullptr;
  parallel_blocks(quiet, origins.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      float* const own = values + i * leaf_voxels;
      if (background != 0) // fresh pages are 0
        std::fill_n(own, leaf_voxels, background);
      leaves[i] = borrowing_leaf(to_coord(origins[i]), own);
      refs[i] = {
          origins[i], own,
          &const_cast<Leaf::NodeMaskType&>(leaves[i]->getValueMask()).getWord<std::uint64_t>(0)};
    }
  });
  for (BorrowingLeaf& leaf : leaves)
    state_->accessor.addLeaf(leaf.release());
  return refs;
}

void GridBuilder::add_tile(const TileView& tile) {
  const openvdb::Index level = tile.dim == 8 ? 1 : tile.dim == 128 ? 2 : 3;
  state_->tree->addTile(level, to_coord(tile.origin), tile.value, tile.active);
}

void GridBuilder::replace_leaf(const TileView& tile) {
  const Coord origin = to_coord(tile.origin);
  Leaf* const leaf = state_->accessor.probeLeaf(origin);
  if (leaf == nullptr)
    throw Error("no leaf to replace");
  give_back(*leaf);
  state_->accessor.addTile(1, origin, tile.value, tile.active);
}

void GridBuilder::share_leaf(const Grid& from, const LeafView& leaf) {
  const Leaf* const original = from.native()->tree->probeConstLeaf(to_coord(leaf.origin));
  if (original == nullptr)
    throw Error("no leaf to take over");
  std::vector<std::shared_ptr<const void>>& lenders = state_->storage->lenders;
  if (lenders.empty() || lenders.back() != from.native())
    lenders.push_back(from.native());
  // The pointer is not written through: both grids are immutable.
  BorrowingLeaf shared =
      borrowing_leaf(original->origin(), const_cast<float*>(original->buffer().data()));
  shared->setValueMask(original->getValueMask());
  state_->accessor.addLeaf(shared.release());
}

namespace {

bool is_constant(const Leaf& leaf) {
  if (!leaf.getValueMask().isOn() && !leaf.getValueMask().isOff())
    return false;
  const float* const values = leaf.buffer().data();
  return std::all_of(values + 1, values + leaf_voxels, [&](float v) { return v == values[0]; });
}

} // namespace

Grid GridBuilder::finish(bool prune) {
  if (prune) {
    std::vector<Leaf*> leaves;
    leaves.reserve(state_->tree->leafCount());
    state_->tree->getNodes(leaves);
    std::vector<std::uint8_t> constant(leaves.size());
    Context context;
    context.threads = state_->threads;
    parallel_blocks(context, leaves.size(), 1024, [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n < end; ++n)
        constant[n] = is_constant(*leaves[n]) ? 1 : 0;
    });
    for (std::size_t n = 0; n < leaves.size(); ++n)
      if (constant[n] != 0) {
        const Coord origin = leaves[n]->origin();
        const float value = leaves[n]->getFirstValue();
        const bool active = leaves[n]->getValueMask().isOn();
        give_back(*leaves[n]);
        state_->accessor.addTile(1, origin, value, active);
      }
    openvdb::tools::pruneTiles(*state_->tree, 0.0F, /*threaded=*/false);
  }
  return make_grid(state_->info, state_->tree, state_->storage);
}

} // namespace gewebe::volume
