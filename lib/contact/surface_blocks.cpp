#include "contact/surface_blocks.h"

#include <algorithm>

namespace gewebe {

namespace {

constexpr std::size_t max_in_block = 64;

} // namespace

std::vector<Vec3> inward_directions(const Model& model) {
  std::vector<Vec3> inward(model.nodes.size());
  for (const Triangle& t : model.triangles) {
    const Vec3 a = model.nodes[t[0]].position, b = model.nodes[t[1]].position,
               c = model.nodes[t[2]].position;
    for (const std::uint32_t corner : t)
      inward[corner] -= cross(b - a, c - a);
  }
  return inward;
}

SurfaceBlocks::SurfaceBlocks(const Model& model) {
  std::vector<std::uint8_t> inside(model.nodes.size());
  for (const Tetrahedron& t : model.tetrahedra)
    for (const std::uint32_t corner : t)
      inside[corner] = 1;
  for (const EdgeMiddles& middles : model.middles)
    for (const std::uint32_t middle : middles)
      inside[middle] = 1;
  for (const Triangle& t : model.triangles)
    for (const std::uint32_t corner : t)
      inside[corner] = 0;
  for (std::uint32_t i = 0; i < surface_count(model); ++i)
    if (inside[i] == 0)
      nodes_.push_back(i);
  // Halved along the longest side until small; ties by number, so that the order is one.
  std::vector<std::pair<std::size_t, std::size_t>> open{{0, nodes_.size()}};
  while (!open.empty()) {
    const auto [begin, end] = open.back();
    open.pop_back();
    if (end - begin <= max_in_block) {
      first_.push_back(begin);
      continue;
    }
    Box3 box;
    for (std::size_t k = begin; k < end; ++k)
      box.add(model.nodes[nodes_[k]].position);
    const Vec3 size = box.size();
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const std::size_t middle = begin + (end - begin) / 2;
    const auto at = [&](std::size_t k) { return nodes_.begin() + static_cast<std::ptrdiff_t>(k); };
    std::nth_element(at(begin), at(middle), at(end), [&](std::uint32_t i, std::uint32_t j) {
      const double a = model.nodes[i].position[axis], b = model.nodes[j].position[axis];
      return a < b || (a == b && i < j);
    });
    open.emplace_back(begin, middle);
    open.emplace_back(middle, end);
  }
  std::sort(first_.begin(), first_.end());
  boxes_.resize(first_.size());
  first_.push_back(nodes_.size());
  for (std::size_t b = 0; b < boxes_.size(); ++b)
    std::sort(nodes_.begin() + static_cast<std::ptrdiff_t>(first_[b]),
              nodes_.begin() + static_cast<std::ptrdiff_t>(first_[b + 1]));
  set_shape(model, {});
}

void SurfaceBlocks::set_shape(const Model& model, std::span<const double> displacement) {
  box_ = {};
  for (std::size_t b = 0; b < boxes_.size(); ++b) {
    Box3 box;
    for (std::size_t k = first_[b]; k < first_[b + 1]; ++k) {
      const std::size_t i = nodes_[k];
      Vec3 p = model.nodes[i].position;
      if (!displacement.empty())
        p += {displacement[3 * i], displacement[3 * i + 1], displacement[3 * i + 2]};
      box.add(p);
    }
    boxes_[b] = box;
    box_.add(box.min);
    box_.add(box.max);
  }
}

} // namespace gewebe
