#include "mesh/face_ranges.h"

#include "base/parallel.h"

namespace gewebe::mesh {

FaceRanges::FaceRanges(std::span<const Triangle> triangles, std::size_t points,
                       const Context& context)
    : triangles_(triangles), reach_((triangles.size() + faces_of_block - 1) / faces_of_block) {
  parallel_blocks(context, triangles.size(), faces_of_block,
                  [&](std::size_t begin, std::size_t end) {
                    Reach r;
                    for (const Triangle& t : triangles.subspan(begin, end - begin))
                      for (const std::uint32_t corner : t) {
                        r.low = std::min(r.low, corner);
                        r.high = std::max(r.high, corner);
                      }
                    reach_[begin / faces_of_block] = r;
                  });
  for (; grain_ * 16 < points; grain_ *= 2) {
    std::size_t visits = 0;
    for (const Reach& r : reach_)
      visits += r.high / grain_ - r.low / grain_ + 1;
    if (visits <= 3 * reach_.size())
      break;
  }
}

} // namespace gewebe::mesh
