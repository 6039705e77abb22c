#pragma once
// A hierarchy of boxes over things that move but stay neighbours: built once by where they are,
// fitted to their boxes whenever these change.

#include "base/vec3.h"
#include "contact/instrument.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe {

class BoxTree {
public:
  /// Halved along the longest side, ties by number, so that the order is one.
  explicit BoxTree(std::span<const Vec3> middles);

  /// \param boxes by thing
  void fit(std::span<const Box3> boxes);
  const Box3& box() const { return boxes_[0]; }

  /// Calls visit(number) for all things in leaves whose box reaches into this one; the same order
  /// always.
  template <class Visit>
  void visit_near(const Box3& box, Visit&& visit) const {
    if (order_.empty())
      return;
    std::array<std::uint32_t, 128> open{}; // two of each level
    std::size_t waiting = 1;
    while (waiting > 0) {
      const std::uint32_t at = open[--waiting];
      if (!near(box, boxes_[at]))
        continue;
      const Part& part = parts_[at];
      if (part.second == 0) {
        for (std::size_t k = part.begin; k < part.end; ++k)
          visit(order_[k]);
      } else {
        open[waiting++] = part.second;
        open[waiting++] = at + 1;
      }
    }
  }

private:
  struct Part {
    std::size_t begin = 0, end = 0;
    std::uint32_t second = 0; ///< the first half follows its whole; 0: a leaf
  };
  std::vector<std::uint32_t> order_;
  std::vector<Part> parts_; ///< wholes before their halves
  std::vector<Box3> boxes_;
};

} // namespace gewebe
