#include "formats/volume/nifti_field.h"

#include "formats/volume/gzip_internal.h"
#include "formats/volume/nifti_header_internal.h"

#include <algorithm>

namespace gewebe::formats {
namespace {

void write_components(const tetrahedra::LatticeField& field, float outside,
                      const std::function<void(std::string_view)>& sink) {
  std::string piece;
  constexpr std::size_t together = 16384;
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::size_t begin = 0; begin < field.values.size(); begin += together) {
      piece.clear();
      for (std::size_t p = begin; p < std::min(begin + together, field.values.size()); ++p) {
        const float ras = field.values[p].at(axis);
        // RAS to LPS; 0 stays +0.
        const float value = field.held[p] == 0 ? outside : axis < 2 ? 0 - ras : ras;
        piece.append(reinterpret_cast<const char*>(&value), sizeof value);
      }
      sink(piece);
    }
}

} // namespace

tetrahedra::PlaceLattice voxel_centres(const Int3& size, const volume::GridTransform& transform) {
  const auto column = [&m = transform.m](std::size_t axis) {
    return Vec3{m[axis], m[4 + axis], m[8 + axis]};
  };
  return {column(3),
          {column(0), column(1), column(2)},
          {static_cast<std::size_t>(size[0]), static_cast<std::size_t>(size[1]),
           static_cast<std::size_t>(size[2])}};
}

void write_nifti_field(const tetrahedra::LatticeField& field, const Int3& size,
                       const volume::GridTransform& transform, float outside,
                       const std::string& what, bool gzip,
                       const std::function<void(std::string_view)>& sink) {
  constexpr std::int16_t vector = 1007;
  const NiftiHeader header =
      nifti_header({5, size[0], size[1], size[2], 1, 3, 1, 1}, vector, transform, what);
  if (!gzip) {
    sink(header.bytes());
    write_components(field, outside, sink);
    return;
  }
  GzipWriter packed(sink);
  packed.write(header.bytes());
  write_components(field, outside, [&](std::string_view bytes) { packed.write(bytes); });
  packed.finish();
}

} // namespace gewebe::formats
