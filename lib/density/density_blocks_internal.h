#pragma once
// Lists of the particles that reach each leaf. Particles are sorted into cubic blocks of the
// lattice (counting sort, in parallel). Each block has an octree of its own, so that the lists of a
// leaf exist only while its block is processed.

#include "base/context.h"
#include "density/density.h"
#include "density/density_kernel_internal.h"

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

namespace gewebe::density {

struct IndexBox {
  Int3 min, max; ///< inclusive
};

/// The kernels of a CPU level.
struct DensityKernels {
  DensityKernel add;
  ReachKernel reach;
  BoundKernel bound;
};
DensityKernels density_kernels(CpuLevel level);

/// The particles with a voxel centre of `clip` in the box around their support, in index space and
/// in their order. \throw Error if context.max_memory would not do
std::vector<IndexParticle> to_index_space(const Context& context, const Particles& particles,
                                          const volume::GridTransform& transform,
                                          const IndexBox& clip);

/// Cubes of `size` voxels (a power of two, at least 16) with the particles that may reach them,
/// enlarged on all sides by some margin.
struct Blocks {
  std::int32_t size = 0;
  std::vector<Int3> origins;
  std::vector<std::uint64_t> first; ///< particles of block n: list[first[n]] … list[first[n+1]]
  std::vector<std::uint32_t> particles; ///< ascending in each block
};
Blocks sort_into_blocks(const Context& context, std::span<const IndexParticle> particles,
                        const IndexBox& clip, double margin);

/// What is proven of a cube of voxels.
enum class Side : std::uint8_t { unknown, background, opposite };

/// A cube proven to lie wholly on the side where the background isn't.
struct ConstantCube {
  Int3 origin{};
  std::int32_t dim = 0; ///< 8 · 2^n
};

/// The leaves of a block that have to be evaluated, in octree order, and the particles that may
/// reach each: local indices of the block, ascending.
struct LeafLists {
  std::vector<Int3> leaves;
  std::vector<std::uint32_t> first; ///< empty, or leaves.size() + 1 entries
  std::vector<std::uint32_t> pairs;
  std::vector<ConstantCube> opposite;
  std::uint64_t skipped = 0; ///< leaves proven to lie on one side
  bool has_lists() const { return first.size() == leaves.size() + 1; }
};

/// Goes down the octree of one block. One for each thread: holds its scratch memory.
class BlockTree {
public:
  /// Where `isovalue` is set, cubes that are proven to lie on one side of it, together with all
  /// voxels that share a face with them, are left out of the lists. The blocks need a margin of 1.
  BlockTree(const Context& context, const IndexBox& clip, std::optional<double> isovalue);

  /// Takes up block n.
  void load(std::span<const IndexParticle> particles, const Blocks& blocks, std::size_t n);
  std::span<const IndexParticle> particles() const { return local_; }

  /// All leaves in reach, less those proven to lie on one side; their lists if requested
  /// and not too long. \throw Error if the leaves exceed context.max_memory
  void list_leaves(LeafLists& lists, bool with_particles);
  /// Calls `visit` with the number and the list of each leaf given, in octree order.
  using Visit = std::function<void(std::size_t number, std::span<const std::uint32_t> list)>;
  void visit_leaves(std::span<const Int3> wanted, const Visit& visit);

private:
  struct Tally { // does bounding pay?
    std::uint64_t tried = 0, spent = 0, saved = 0;
    bool pays() const;
  };
  void descend(const Int3& origin, std::int32_t size, std::span<const std::uint32_t> list,
               std::size_t level);
  Side prove(const Int3& origin, std::int32_t size, float lower, float upper) const;
  bool in_clip(const Int3& origin, std::int32_t size, std::int32_t margin) const;
  bool outside_clip(const Int3& origin, std::int32_t size) const;
  Side prove_leaf(const Int3& origin, std::span<const std::uint32_t> list);
  void emit(const Int3& origin, std::span<const std::uint32_t> list);
  bool is_wanted(const Int3& origin, std::int32_t size) const;

  const Context& context_;
  DensityKernels kernels_;
  IndexBox clip_;
  std::optional<double> isovalue_;
  Int3 origin_{};
  std::int32_t size_ = 0;
  std::vector<IndexParticle> local_;
  std::vector<std::vector<std::uint32_t>> scratch_; // lists by level
  std::vector<std::vector<std::uint8_t>> masks_;
  LeafLists* lists_ = nullptr; // where leaves are listed
  bool with_particles_ = false, bounding_ = false;
  const Visit* visit_ = nullptr; // where they are visited
  std::span<const Int3> wanted_;
  std::size_t visited_ = 0;
  Tally children_, parts_;
};

/// A voxel centre outside the clip box has density 0.
bool contains(const IndexBox& box, const Int3& origin);

/// Evaluates one leaf: values (zero at first) get the sum over its list, 0 outside the clip box.
void evaluate_leaf(const DensityKernels& kernels, const IndexBox& clip,
                   std::span<const IndexParticle> particles, std::span<const std::uint32_t> list,
                   const Int3& origin, std::vector<LeafParticle>& scratch, float* values);

struct EvaluatedLeaves {
  std::vector<volume::LeafRef> leaves; ///< of all plans, one after the other
  std::uint64_t pairs = 0;             ///< of leaves and particles
};

/// Adds all leaves of the plans to the grid and evaluates them there. Then, from the same thread,
/// `done` gets the leaf's number.
EvaluatedLeaves
evaluate_plans(const Context& context, volume::GridBuilder& builder,
               std::span<const IndexParticle> particles, const Blocks& blocks,
               const std::vector<LeafLists>& plans, const IndexBox& clip,
               const std::function<void(std::size_t, const volume::LeafRef&)>& done);

/// Bit n of word w: is value 64 w + n above `bound`, or with `unequal`, is it another one?
std::array<std::uint64_t, 8> compare_leaf(const float* values, float bound, bool unequal = false);

/// Trees for the threads of a loop, so that their scratch memory is made once.
class BlockTrees {
public:
  BlockTrees(const Context& context, const IndexBox& clip, std::optional<double> isovalue)
      : context_(context), clip_(clip), isovalue_(isovalue) {}
  struct Lent { // goes back when it ends
    BlockTrees& owner;
    std::unique_ptr<BlockTree> tree;
    ~Lent();
  };
  Lent lend();

private:
  const Context& context_;
  IndexBox clip_;
  std::optional<double> isovalue_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<BlockTree>> idle_;
};

/// Sets the active mask of a leaf: where the value isn't 0. False if that is nowhere.
bool activate(const volume::LeafRef& leaf);

/// Memory that a leaf takes in a grid.
inline constexpr double leaf_bytes = volume::leaf_voxels * sizeof(float) + 160;

/// The leaves of all blocks, with lists as long as these fit into a budget. What is done without
/// lists goes down the octree a second time.
std::vector<LeafLists> plan_blocks(const Context& context, std::span<const IndexParticle> particles,
                                   const Blocks& blocks, const IndexBox& clip,
                                   std::optional<double> isovalue);

/// Calls `visit` for each leaf of the plan, from its lists or down the octree. \pre tree.load(n)
void visit_plan(BlockTree& tree, const LeafLists& plan, const BlockTree::Visit& visit);

/// density_band.cpp: the leaves that an isosurface crosses. `plans` of plan_blocks with it.
volume::Grid band_grid(const Context& context, std::span<const IndexParticle> particles,
                       const Blocks& blocks, const std::vector<LeafLists>& plans,
                       const IndexBox& clip, const volume::GridInfo& info, DensityReport& report);

} // namespace gewebe::density
