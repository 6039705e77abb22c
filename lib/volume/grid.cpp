#include "volume/grid_internal.h"

#include "base/digest.h"
#include "base/error.h"
#include "base/parallel.h"

#include <openvdb/tools/Prune.h>
#include <openvdb/tree/ValueAccessor.h>

#include <utility>

namespace gewebe {
namespace {

using openvdb::Coord;
using Leaf = FloatTree::LeafNodeType;

static_assert(Leaf::DIM == leaf_dim && Leaf::SIZE == leaf_voxels);

Int3 to_int3(const Coord& c) {
  return {c.x(), c.y(), c.z()};
}
Coord to_coord(const Int3& i) {
  return {i[0], i[1], i[2]};
}

LeafView view_of(const Leaf& leaf) {
  // NodeMask keeps its eight words in one array; the non-const accessor is the only way to its
  // address.
  auto& mask = const_cast<Leaf&>(leaf).getValueMask();
  return {to_int3(leaf.origin()), leaf.buffer().data(),
          &const_cast<Leaf::NodeMaskType&>(mask).getWord<std::uint64_t>(0)};
}

} // namespace

Grid make_grid(GridInfo info, FloatTree::Ptr tree) {
  auto native = std::make_shared<Grid::Native>();
  native->tree = std::move(tree);
  return Grid(std::move(info), std::move(native));
}

Grid::Grid() : native_(std::make_shared<Native>()) {
  native_->tree = std::make_shared<FloatTree>(0.0F);
}

Grid::Grid(GridInfo info, std::shared_ptr<Native> native)
    : info_(std::move(info)), native_(std::move(native)) {}

std::vector<LeafView> Grid::leaves() const {
  std::vector<LeafView> views;
  views.reserve(native_->tree->leafCount());
  for (auto leaf = std::as_const(*native_->tree).cbeginLeaf(); leaf; ++leaf)
    views.push_back(view_of(*leaf));
  return views;
}

std::vector<TileView> Grid::tiles() const {
  std::vector<TileView> views;
  auto value = std::as_const(*native_->tree).cbeginValueAll();
  value.setMaxDepth(FloatTree::ValueAllCIter::LEAF_DEPTH - 1);
  for (; value; ++value) {
    const bool active = value.isValueOn();
    if (!active && *value == info_.background)
      continue;
    const openvdb::CoordBBox box = value.getBoundingBox();
    views.push_back({to_int3(box.min()), box.dim().x(), *value, active});
  }
  return views;
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

std::uint64_t Grid::digest() const {
  Digest digest;
  digest.add_bytes(info_.transform.m.data(), sizeof info_.transform.m);
  digest.add(info_.isovalue);
  digest.add(info_.band_isovalue.value_or(HUGE_VAL));
  digest.add(std::uint64_t{info_.level_set});
  digest.add(static_cast<double>(info_.background));
  digest.add_bytes(info_.name.data(), info_.name.size());
  for (const LeafView& leaf : leaves()) {
    digest.add_bytes(leaf.origin.data(), sizeof leaf.origin);
    digest.add_bytes(leaf.active, leaf_voxels / 8);
    digest.add_bytes(leaf.values, leaf_voxels * sizeof(float));
  }
  for (const TileView& tile : tiles()) {
    digest.add_bytes(tile.origin.data(), sizeof tile.origin);
    digest.add(static_cast<std::uint64_t>(tile.dim));
    digest.add(static_cast<double>(tile.value));
    digest.add(std::uint64_t{tile.active});
  }
  return digest.value();
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
      : info(std::move(i)), tree(std::make_shared<FloatTree>(info.background)), accessor(*tree) {}
  GridInfo info;
  FloatTree::Ptr tree;
  openvdb::tree::ValueAccessor<FloatTree> accessor;
};

GridBuilder::GridBuilder(GridInfo info) : state_(std::make_unique<State>(std::move(info))) {}
GridBuilder::~GridBuilder() = default;
GridBuilder::GridBuilder(GridBuilder&&) noexcept = default;

std::vector<LeafRef> GridBuilder::add_leaves(const Context& context,
                                             std::span<const Int3> origins) {
  std::vector<std::unique_ptr<Leaf>> leaves(origins.size());
  Context quiet = context;
  quiet.progress = nullptr;
  parallel_blocks(quiet, origins.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      leaves[i] = std::make_unique<Leaf>(to_coord(origins[i]), state_->info.background, false);
  });
  std::vector<LeafRef> refs(origins.size());
  for (std::size_t i = 0; i < origins.size(); ++i) {
    Leaf* const leaf = leaves[i].release();
    state_->accessor.addLeaf(leaf);
    refs[i] = {origins[i], leaf->buffer().data(),
               &const_cast<Leaf::NodeMaskType&>(leaf->getValueMask()).getWord<std::uint64_t>(0)};
  }
  return refs;
}

void GridBuilder::add_tile(const TileView& tile) {
  const openvdb::Index level = tile.dim == 8 ? 1 : tile.dim == 128 ? 2 : 3;
  state_->tree->addTile(level, to_coord(tile.origin), tile.value, tile.active);
}

void GridBuilder::share_leaf(const Grid& from, const LeafView& leaf) {
  const Leaf* const original = from.native()->tree->probeConstLeaf(to_coord(leaf.origin));
  if (original == nullptr)
    throw Error("no leaf to take over");
  state_->accessor.addLeaf(new Leaf(*original));
}

Grid GridBuilder::finish(bool prune) {
  if (prune)
    openvdb::tools::prune(*state_->tree, 0.0F, /*threaded=*/false);
  return make_grid(state_->info, state_->tree);
}

} // namespace gewebe
