#pragma once
// Cubes of a lattice as the leaves of an octree whose neighbours differ by one level at most. For
// the room and its tests.

#include "geometry/index_map.h"
#include "geometry/vec3.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace gewebe::stuffing {

/// A cube of an octree: its edge is 1 << level of the finest cells, its first cell `cube` << level.
struct OctreeCube {
  unsigned level = 0;
  Int3 cube{};

  Int3 first_cell() const {
    return {cube[0] * (1 << level), cube[1] * (1 << level), cube[2] * (1 << level)};
  }
  OctreeCube parent() const { return {level + 1, {cube[0] >> 1, cube[1] >> 1, cube[2] >> 1}}; }
  OctreeCube neighbour(int x, int y, int z) const {
    return {level, {cube[0] + x, cube[1] + y, cube[2] + z}};
  }
  /// \pre level > 0; n < 8, with bit a for the far half along axis a
  OctreeCube child(unsigned n) const {
    const auto half = [&](std::size_t a) { return 2 * cube[a] + static_cast<int>(n >> a & 1); };
    return {level - 1, {half(0), half(1), half(2)}};
  }
};

/// Numbers for keys, with removal of none.
class GrowingIndexMap {
public:
  std::uint32_t find(const Int3& key) const { return map_.find(key); }
  /// \pre it isn't there
  void insert(const Int3& key, std::uint32_t value);
  std::size_t size() const { return keys_.size(); }

private:
  IndexMap map_{64};
  std::size_t room_ = 64;
  std::vector<Int3> keys_;
  std::vector<std::uint32_t> values_;
};

/// Leaves of an octree. Space without one is left out of it.
class StuffingOctree {
public:
  enum class State : std::uint8_t { absent, leaf, split }; ///< split: there are smaller leaves

  /// \pre levels > 0
  explicit StuffingOctree(unsigned levels) : levels_(levels) {}

  unsigned levels() const { return static_cast<unsigned>(levels_.size()); }
  /// Makes a leaf. \pre no leaf overlaps it
  void add(const OctreeCube& cube);
  /// Replaces a leaf by its eight halves. \pre it is a leaf above level 0
  void split(const OctreeCube& leaf);
  State state(const OctreeCube& cube) const;
  /// The leaf that holds a cube; with State::absent as no leaf does, or only smaller ones.
  struct Holder {
    State state = State::absent;
    OctreeCube cube;
  };
  Holder holder(OctreeCube cube) const;
  /// Is the cube inside a leaf, or made of smaller ones? \pre it is not larger than the cubes that
  /// were added
  bool covered(const OctreeCube& cube) const;
  /// Splits leaves until those that share a corner differ by one level at most. The result is the
  /// coarsest such octree, whatever the order.
  void balance();
  /// By blocks of `block` levels above the finest, in them by first cell.
  std::vector<OctreeCube> leaves(unsigned block) const;

private:
  void insert(const OctreeCube& cube, bool is_split);
  struct Level {
    GrowingIndexMap numbers;
    std::vector<Int3> cubes;
    std::vector<bool> is_split;
  };
  std::vector<Level> levels_;
};

} // namespace gewebe::stuffing
