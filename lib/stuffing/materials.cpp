#include "stuffing/materials.h"

#include "base/error.h"
#include "base/parallel.h"
#include "volume/field.h"

#include <cmath>
#include <cstddef>
#include <memory>

namespace gewebe::stuffing {
namespace {

void check_transform(const volume::GridTransform& transform) {
  const double determinant = transform.determinant();
  if (!std::isfinite(determinant) || determinant == 0)
    throw Error("the transform of a volume of materials is singular, expected an invertible map");
}

Vec3 centroid(const tetrahedra::TetMesh& mesh, std::size_t t) {
  const auto& [a, b, c, d] = mesh.tetrahedra[t];
  return (mesh.points[a] + mesh.points[b] + mesh.points[c] + mesh.points[d]) / 4;
}

Vec3 centre_of(const labels::LabelRuns& labels, const Int3& v) {
  return labels.transform.to_world(
      {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])});
}

/// Do the centres of a voxel and its six neighbours lie in the solid? Never without one.
bool is_within(const labels::LabelRuns& labels, const MaterialAt& solid, const Int3& v) {
  if (!solid || solid(centre_of(labels, v)) == 0)
    return false;
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (const std::int32_t step : {-1, 1}) {
      Int3 next = v;
      next[axis] += step;
      if (solid(centre_of(labels, next)) == 0)
        return false;
    }
  return true;
}

/// As label_source says. \pre transform is invertible
std::int32_t label_at(const labels::LabelRuns& labels, const Vec3& place, std::int32_t reach,
                      const MaterialAt& solid) {
  const Vec3 index = labels.transform.to_index(place);
  Int3 voxel{};
  for (std::size_t a = 0; a < 3; ++a) {
    const double x = std::floor(index[static_cast<int>(a)] + 0.5);
    if (!(x >= -reach && x < static_cast<double>(labels.size[a]) + reach)) // NaN is outside
      return 0;
    voxel[a] = static_cast<std::int32_t>(x);
  }
  std::int32_t nearest = labels.at(voxel);
  if (nearest != 0 || reach == 0 || is_within(labels, solid, voxel))
    return nearest;
  double least = HUGE_VAL;
  for (std::int32_t k = voxel[2] - reach; k <= voxel[2] + reach; ++k)
    for (std::int32_t j = voxel[1] - reach; j <= voxel[1] + reach; ++j)
      for (std::int32_t i = voxel[0] - reach; i <= voxel[0] + reach; ++i) {
        const std::int32_t label = labels.at({i, j, k});
        if (label == 0 && !solid)
          continue;
        const Vec3 apart = centre_of(labels, {i, j, k}) - place;
        if (dot(apart, apart) < least && (label != 0 || is_within(labels, solid, {i, j, k}))) {
          least = dot(apart, apart);
          nearest = label;
        }
      }
  return nearest;
}

} // namespace

MaterialSource inside_source(const volume::Grid& volume, std::optional<double> isovalue) {
  check_transform(volume.info().transform);
  const bool level_set = volume.info().level_set;
  const double limit = isovalue.value_or(level_set ? 0 : volume.info().isovalue);
  return [&volume, level_set, limit]() -> MaterialAt {
    const auto field = std::make_shared<volume::Field>(volume);
    return [field, level_set, limit,
            transform = volume.info().transform](const Vec3& place) -> std::int32_t {
      const double value = field->value(transform.to_index(place));
      if (!std::isfinite(value))
        throw Error("a value is not finite, expected numbers where the tetrahedra are");
      return level_set ? value < limit : value > limit;
    };
  };
}

MaterialSource label_source(const labels::LabelRuns& labels, std::int32_t reach,
                            const MaterialSource& solid) {
  check_transform(labels.transform);
  return [&labels, reach, solid]() -> MaterialAt {
    return [&labels, reach, within = solid ? solid() : MaterialAt()](const Vec3& place) {
      return label_at(labels, place, reach, within);
    };
  };
}

void set_materials(const Context& context, const MaterialSource& source,
                   tetrahedra::TetMesh& mesh) {
  mesh.material.resize(mesh.tetrahedra.size());
  parallel_blocks(context, mesh.tetrahedra.size(), 4096, [&](std::size_t begin, std::size_t end) {
    const MaterialAt material_at_place = source();
    for (std::size_t t = begin; t < end; ++t)
      mesh.material[t] = material_at_place(centroid(mesh, t));
  });
}

} // namespace gewebe::stuffing
