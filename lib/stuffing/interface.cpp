#include "stuffing/interface_internal.h"

#include "base/error.h"
#include "base/parallel.h"

#include <algorithm>

namespace gewebe::stuffing {
namespace {

constexpr std::size_t grain = 1024;

/// Directions that make a triangle of the link with a direction: what lies round the edge.
constexpr std::array<std::uint32_t, bcc::directions> make_rings() {
  std::array<std::uint32_t, bcc::directions> rings{};
  for (const auto& face : bcc::link.faces)
    for (const std::uint8_t d : face)
      for (const std::uint8_t e : face)
        if (d != e)
          rings[d] |= 1U << e;
  return rings;
}
constexpr std::array<std::uint32_t, bcc::directions> rings = make_rings();

bool is_inside(const StuffingBlocks& blocks, const PlaceInBlock& place) {
  return place.block != StuffingBlock::none && blocks[place.block].in(place.word, place.bit);
}

void gather(const Context& context, const StuffingBlocks& blocks, const SurfacePoints& surface,
            const BlockMaterials& materials, std::vector<InterfacePoint>& points) {
  parallel_blocks(context, blocks.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
      const StuffingBlock& block = blocks[b];
      std::uint32_t next = block.first_interface;
      for_each_point(block.interface.set(), [&](unsigned word, unsigned bit) {
        InterfacePoint& point = points[next++];
        point.block = static_cast<std::uint32_t>(b);
        point.word = static_cast<std::uint16_t>(word);
        point.bit = static_cast<std::uint16_t>(bit);
        point.material = material_at(materials, {point.block, word, bit});
        point.free = !block.surface.contains(word, bit);
        point.on = !point.free && surface.points[block.surface_point(word, bit)].warped();
        for (unsigned d = 0; d < bcc::directions; ++d) {
          const PlaceInBlock there = neighbour(block, word, bit, d);
          point.neighbours[d] =
              there.block != StuffingBlock::none &&
                      blocks[there.block].interface.contains(there.word, there.bit)
                  ? blocks[there.block].interface_point(there.word, there.bit)
                  : InterfacePoint::none;
        }
      });
    }
  });
}

Vec3 place_of(const StuffingBlocks& blocks, const InterfacePoint& point) {
  return bcc::position(point_at(blocks[point.block], point.word, point.bit));
}

/// The share of the way from one place to the other at which `material` ends, by halves.
double find_cut(const MaterialAt& material_at_place, const StuffingLattice& lattice,
                const Vec3& from, const Vec3& to, std::int32_t material) {
  double low = 0, high = 1;
  for (int round = 0; round < 30; ++round) {
    const double middle = (low + high) / 2;
    (material_at_place(lattice.to_world.to_world(from + (to - from) * middle)) == material ? low
                                                                                           : high) =
        middle;
  }
  return (low + high) / 2;
}

/// The end of the smaller material looks, so that both see one cut.
void find_cuts(const Context& context, const StuffingLattice& lattice, const StuffingBlocks& blocks,
               const MaterialSource& source, MaterialInterface& interface) {
  std::vector<InterfacePoint>& points = interface.points;
  parallel_blocks(context, points.size(), grain, [&](std::size_t begin, std::size_t end) {
    const MaterialAt material_at_place = source();
    for (std::size_t n = begin; n < end; ++n) {
      InterfacePoint& point = points[n];
      const Vec3 place = place_of(blocks, point);
      for (unsigned d = 0; d < bcc::directions; ++d)
        if (interface.differs(point, d) && point.material < points[point.neighbours[d]].material)
          point.cuts[d] =
              find_cut(material_at_place, lattice, place, place + bcc::step(d), point.material);
    }
  });
  parallel_blocks(context, points.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      InterfacePoint& point = points[n];
      for (unsigned d = 0; d < bcc::directions; ++d)
        if (interface.differs(point, d) && point.material > points[point.neighbours[d]].material)
          point.cuts[d] = 1 - points[point.neighbours[d]].cuts[bcc::opposite(d)];
    }
  });
}

/// May the edge be cut? \pre the materials of its ends differ
bool can_be_cut(const MaterialInterface& interface, const InterfacePoint& point,
                unsigned direction) {
  const InterfacePoint& other = interface.points[point.neighbours[direction]];
  if (!point.free || !other.free)
    return false;
  for (unsigned d = 0; d < bcc::directions; ++d) {
    if ((rings[direction] >> d & 1) == 0 || point.neighbours[d] == InterfacePoint::none)
      continue; // not at the interface: of the material of both its neighbours
    const std::int32_t material = interface.points[point.neighbours[d]].material;
    if (material != point.material && material != other.material)
      return false;
  }
  return true;
}

/// The interface comes to an end of each edge that can't be cut.
void keep_in_place(const Context& context, MaterialInterface& interface) {
  std::vector<InterfacePoint>& points = interface.points;
  std::vector<std::uint8_t> comes(points.size());
  parallel_blocks(context, points.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      const InterfacePoint& point = points[n];
      for (unsigned d = 0; d < bcc::directions; ++d) {
        if (point.on || !interface.differs(point, d))
          continue;
        const InterfacePoint& other = points[point.neighbours[d]];
        const bool nearer =
            point.cuts[d] < 0.5 || (!(point.cuts[d] > 0.5) && point.material < other.material);
        if (!other.on && nearer && !can_be_cut(interface, point, d))
          comes[n] = 1;
      }
    }
  });
  for (std::size_t n = 0; n < points.size(); ++n)
    points[n].on = points[n].on || comes[n] != 0;
}

void warp(const Context& context, const StuffingBlocks& blocks, MaterialInterface& interface) {
  std::vector<InterfacePoint>& points = interface.points;
  for (unsigned turn = 0; turn < bcc::colours; ++turn)
    parallel_blocks(context, points.size(), grain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n < end; ++n) {
        InterfacePoint& point = points[n];
        if (bcc::colour(point_at(blocks[point.block], point.word, point.bit)) != turn)
          continue;
        point.warp = violated(interface, point);
        point.on = point.on || point.warped();
      }
    });
}

/// One after the other, by number: the result doesn't depend on threads.
void keep_one_corner(const StuffingBlocks& blocks, const SurfacePoints& surface,
                     MaterialInterface& interface) {
  const auto moved = [&](const PlaceInBlock& place) {
    const StuffingBlock& there = blocks[place.block];
    if (there.interface.contains(place.word, place.bit) &&
        interface.points[there.interface_point(place.word, place.bit)].warped())
      return true;
    return there.surface.contains(place.word, place.bit) &&
           surface.points[there.surface_point(place.word, place.bit)].warped();
  };
  for (InterfacePoint& point : interface.points) {
    if (!point.warped())
      continue;
    const StuffingBlock& block = blocks[point.block];
    std::uint32_t set = 0;
    for (unsigned d = 0; d < bcc::directions; ++d)
      if (moved(neighbour(block, point.word, point.bit, d)))
        set |= 1U << d;
    for (const auto& [a, b, c] : bcc::link.faces)
      if ((set >> a & set >> b & set >> c & 1) != 0) {
        point.warp = InterfacePoint::stays;
        point.on = false;
        point.refused = true;
        break;
      }
  }
}

} // namespace

BlockMaterials materials_of(const Context& context, const StuffingLattice& lattice,
                            const StuffingBlocks& blocks, const MaterialSource& source) {
  BlockMaterials materials(blocks.size());
  constexpr std::size_t points_of_block = std::size_t{16} * 64;
  const auto with_inside =
      std::count_if(blocks.begin(), blocks.end(),
                    [](const StuffingBlock& block) { return size(block.inside) != 0; });
  require_memory(context, static_cast<double>(with_inside) * points_of_block * sizeof(std::int32_t),
                 "the materials of lattice points");
  parallel_blocks(context, blocks.size(), 8, [&](std::size_t begin, std::size_t end) {
    const MaterialAt material_at_place = source();
    for (std::size_t b = begin; b < end; ++b) {
      if (size(blocks[b].inside) == 0)
        continue;
      materials[b].resize(points_of_block);
      for_each_point(blocks[b].inside, [&](unsigned word, unsigned bit) {
        materials[b][64 * std::size_t{word} + bit] = material_at_place(
            lattice.to_world.to_world(bcc::position(point_at(blocks[b], word, bit))));
      });
    }
  });
  return materials;
}

std::uint32_t find_interface(const Context& context, const BlockMaterials& materials,
                             StuffingBlocks& blocks) {
  parallel_blocks(context, blocks.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
      StuffingBlock& block = blocks[b];
      PointSet interface {};
      for_each_point(block.inside, [&](unsigned word, unsigned bit) {
        const std::int32_t here =
            material_at(materials, {static_cast<std::uint32_t>(b), word, bit});
        for (unsigned d = 0; d < bcc::directions; ++d) {
          const PlaceInBlock there = neighbour(block, word, bit, d);
          if (is_inside(blocks, there) && material_at(materials, there) != here) {
            interface[word] |= std::uint64_t{1} << bit;
            break;
          }
        }
      });
      block.interface = PointRanks(interface);
    }
  });
  std::uint64_t count = 0;
  for (StuffingBlock& block : blocks) {
    block.first_interface = static_cast<std::uint32_t>(count);
    count += size(block.interface.set());
    if (count >= UINT32_MAX)
      throw Error("materials meet at 2^32 - 1 lattice points or more, expected fewer");
  }
  return static_cast<std::uint32_t>(count);
}

MaterialInterface follow_interface(const Context& context, const StuffingLattice& lattice,
                                   const StuffingBlocks& blocks, const SurfacePoints& surface,
                                   const BlockMaterials& materials, const MaterialSource& source) {
  MaterialInterface interface;
  if (blocks.empty())
    return interface;
  const std::size_t count = blocks.back().first_interface + size(blocks.back().interface.set());
  require_memory(context, static_cast<double>(count) * sizeof(InterfacePoint),
                 "the lattice points where materials meet");
  interface.points.resize(count);
  gather(context, blocks, surface, materials, interface.points);
  find_cuts(context, lattice, blocks, source, interface);
  keep_in_place(context, interface);
  warp(context, blocks, interface);
  keep_one_corner(blocks, surface, interface);
  return interface;
}

} // namespace gewebe::stuffing
