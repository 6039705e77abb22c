#include "shading/facet_tree.h"

#include <algorithm>

namespace gewebe::shading {
namespace {

constexpr std::size_t leaf_size = 4;

struct Item {
  Box3 box;
  Vec3 middle;
  std::uint32_t number = 0;
};
using Items = std::span<Item>;

/// Reorders: each of the first half lies before each of the second.
std::array<Items, 2> halves(Items items) {
  Box3 middles;
  for (const Item& item : items)
    middles.add(item.middle);
  const Vec3 size = middles.max - middles.min;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const std::size_t half = items.size() / 2;
  std::nth_element(items.begin(), items.begin() + static_cast<std::ptrdiff_t>(half), items.end(),
                   [axis](const Item& a, const Item& b) {
                     return a.middle[axis] != b.middle[axis] ? a.middle[axis] < b.middle[axis]
                                                             : a.number < b.number;
                   });
  return {items.first(half), items.subspan(half)};
}

class Builder {
public:
  explicit Builder(std::span<const FacetCorners> facets) : facets_(facets) {}

  /// \return the number of the node
  std::uint32_t node(Items items) {
    const auto at = static_cast<std::uint32_t>(tree.nodes.size());
    tree.nodes.emplace_back();
    std::array<Items, 4> parts{items};
    std::size_t count = 1;
    for (int level = 0; level < 2; ++level) {
      const std::array<Items, 4> whole = parts;
      const std::size_t wholes = count;
      count = 0;
      for (std::size_t n = 0; n < wholes; ++n)
        if (whole[n].size() <= leaf_size) {
          parts[count++] = whole[n];
        } else {
          const auto [first, second] = halves(whole[n]);
          parts[count++] = first;
          parts[count++] = second;
        }
    }
    FacetTree::Node made{};
    made.children = static_cast<std::uint32_t>(count);
    for (std::size_t n = 0; n < count; ++n) {
      Box3 box;
      for (const Item& item : parts[n]) {
        box.add(item.box.min);
        box.add(item.box.max);
      }
      for (int a = 0; a < 3; ++a) {
        made.low[a][n] = box.min[a];
        made.high[a][n] = box.max[a];
      }
      made.child[n] = parts[n].size() <= leaf_size ? leaf(parts[n]) : node(parts[n]);
    }
    tree.nodes[at] = made;
    return at;
  }

  FacetTree tree;

private:
  std::uint32_t leaf(Items items) {
    FacetTree::Leaf made{};
    for (std::size_t n = 0; n < items.size(); ++n) {
      const auto& [a, b, c] = facets_[items[n].number];
      const Vec3 edge1 = b - a, edge2 = c - a;
      for (int k = 0; k < 3; ++k) {
        made.corner[k][n] = a[k];
        made.edge1[k][n] = edge1[k];
        made.edge2[k][n] = edge2[k];
      }
    }
    tree.leaves.push_back(made);
    return FacetTree::leaf_bit | static_cast<std::uint32_t>(tree.leaves.size() - 1);
  }

  std::span<const FacetCorners> facets_;
};

} // namespace

FacetTree facet_tree(std::span<const FacetCorners> facets) {
  if (facets.empty())
    return {};
  std::vector<Item> items(facets.size());
  for (std::size_t n = 0; n < items.size(); ++n) {
    for (const Vec3& corner : facets[n])
      items[n].box.add(corner);
    items[n].middle = (items[n].box.min + items[n].box.max) * 0.5;
    items[n].number = static_cast<std::uint32_t>(n);
  }
  Builder builder(facets);
  // Halves of more than four have at least two.
  builder.tree.leaves.reserve(facets.size() / 2 + 1);
  builder.tree.nodes.reserve(facets.size() / 6 + 1);
  (void)builder.node(items);
  return std::move(builder.tree);
}

double facet_tree_bytes(double facets) {
  return facets * (sizeof(Item) + sizeof(FacetTree::Leaf) / 2.0 + sizeof(FacetTree::Node) / 6.0);
}

} // namespace gewebe::shading
