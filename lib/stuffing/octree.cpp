#include "stuffing/octree_internal.h"

#include <algorithm>
#include <utility>

namespace gewebe::stuffing {

void GrowingIndexMap::insert(const Int3& key, std::uint32_t value) {
  if (keys_.size() == room_) {
    room_ *= 2;
    map_ = IndexMap(room_);
    for (std::size_t n = 0; n < keys_.size(); ++n)
      map_.insert(keys_[n], values_[n]);
  }
  map_.insert(key, value);
  keys_.push_back(key);
  values_.push_back(value);
}

void StuffingOctree::add(const OctreeCube& cube) {
  insert(cube, false);
  for (OctreeCube above = cube.parent();
       above.level < levels_.size() && state(above) == State::absent; above = above.parent())
    insert(above, true);
}

void StuffingOctree::insert(const OctreeCube& cube, bool is_split) {
  Level& level = levels_[cube.level];
  level.numbers.insert(cube.cube, static_cast<std::uint32_t>(level.cubes.size()));
  level.cubes.push_back(cube.cube);
  level.is_split.push_back(is_split);
}

void StuffingOctree::split(const OctreeCube& leaf) {
  Level& level = levels_[leaf.level];
  level.is_split[level.numbers.find(leaf.cube)] = true;
  for (unsigned n = 0; n < 8; ++n)
    insert(leaf.child(n), false);
}

StuffingOctree::State StuffingOctree::state(const OctreeCube& cube) const {
  if (cube.level >= levels_.size())
    return State::absent;
  const Level& level = levels_[cube.level];
  const std::uint32_t number = level.numbers.find(cube.cube);
  return number == IndexMap::none ? State::absent
         : level.is_split[number] ? State::split
                                  : State::leaf;
}

StuffingOctree::Holder StuffingOctree::holder(OctreeCube cube) const {
  for (; cube.level < levels_.size(); cube = cube.parent())
    if (const State found = state(cube); found != State::absent)
      return {found == State::leaf ? State::leaf : State::absent, cube};
  return {};
}

bool StuffingOctree::covered(const OctreeCube& cube) const {
  return state(cube) == State::split || holder(cube).state == State::leaf;
}

void StuffingOctree::balance() {
  for (unsigned fine = 0; fine + 2 < levels_.size(); ++fine) {
    // Splits below add leaves to higher levels alone, which are looked at later.
    const std::size_t count = levels_[fine].cubes.size();
    for (std::size_t n = 0; n < count; ++n) {
      if (levels_[fine].is_split[n])
        continue;
      const OctreeCube parent = OctreeCube{fine, levels_[fine].cubes[n]}.parent();
      for (int x = -1; x <= 1; ++x)
        for (int y = -1; y <= 1; ++y)
          for (int z = -1; z <= 1; ++z) {
            const OctreeCube beside = parent.neighbour(x, y, z);
            for (Holder found = holder(beside);
                 found.state == State::leaf && found.cube.level > beside.level;
                 found = holder(beside))
              split(found.cube);
          }
    }
  }
}

std::vector<OctreeCube> StuffingOctree::leaves(unsigned block) const {
  std::vector<OctreeCube> result;
  for (unsigned level = 0; level < levels_.size(); ++level)
    for (std::size_t n = 0; n < levels_[level].cubes.size(); ++n)
      if (!levels_[level].is_split[n])
        result.push_back({level, levels_[level].cubes[n]});
  const auto key = [block](const OctreeCube& leaf) {
    const Int3 first = leaf.first_cell();
    return std::pair(Int3{first[0] >> block, first[1] >> block, first[2] >> block}, first);
  };
  std::ranges::sort(result, {}, key);
  return result;
}

} // namespace gewebe::stuffing
