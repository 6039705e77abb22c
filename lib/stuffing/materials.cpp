#include "stuffing/materials.h"

#include "base/error.h"
#include "base/parallel.h"
#include "volume/field.h"

#include <cmath>

namespace gewebe {

void set_materials(const Context& context, std::span<const Grid> volumes, TetMesh& mesh) {
  for (const Grid& volume : volumes) {
    const double determinant = volume.info().transform.determinant();
    if (!std::isfinite(determinant) || determinant == 0)
      throw Error("the transform of a volume of materials is singular, expected an invertible map");
  }
  mesh.material.assign(mesh.tetrahedra.size(), 0);
  for (std::size_t n = 0; n < volumes.size(); ++n) {
    const GridInfo& info = volumes[n].info();
    const double isovalue = info.level_set ? 0 : info.isovalue;
    parallel_blocks(context, mesh.tetrahedra.size(), 4096, [&](std::size_t begin, std::size_t end) {
      Field field(volumes[n]);
      for (std::size_t t = begin; t < end; ++t) {
        const auto& [a, b, c, d] = mesh.tetrahedra[t];
        const Vec3 centroid =
            (mesh.points[a] + mesh.points[b] + mesh.points[c] + mesh.points[d]) / 4;
        const double value = field.value(info.transform.to_index(centroid));
        if (!std::isfinite(value))
          throw Error("a volume of materials has a value that is not finite");
        if (info.level_set ? value < isovalue : value > isovalue)
          mesh.material[t] = static_cast<std::int32_t>(n + 1);
      }
    });
  }
}

} // namespace gewebe
