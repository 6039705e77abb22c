#include "formats/volume/nifti_header_internal.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

namespace gewebe::formats {
namespace {

static_assert(std::endian::native == std::endian::little, "the header is little-endian memory");

Vec3 column(const volume::GridTransform& t, std::size_t axis) {
  return {t.m[axis], t.m[4 + axis], t.m[8 + axis]};
}

/// A rotation, by its columns, as a quaternion of positive real part: b, c, d.
Vec3 quaternion(const Vec3& x, const Vec3& y, const Vec3& z) {
  // The largest of the four squares, for its root.
  const double a2 = 1 + x.x + y.y + z.z, b2 = 1 + x.x - y.y - z.z, c2 = 1 - x.x + y.y - z.z,
               d2 = 1 - x.x - y.y + z.z;
  double a = 0;
  Vec3 q;
  if (a2 >= b2 && a2 >= c2 && a2 >= d2) {
    a = 0.5 * std::sqrt(a2);
    q = Vec3{y.z - z.y, z.x - x.z, x.y - y.x} * (0.25 / a);
  } else if (b2 >= c2 && b2 >= d2) {
    const double b = 0.5 * std::sqrt(b2);
    q = {b, 0.25 / b * (y.x + x.y), 0.25 / b * (z.x + x.z)};
    a = 0.25 / b * (y.z - z.y);
  } else if (c2 >= d2) {
    const double c = 0.5 * std::sqrt(c2);
    q = {0.25 / c * (y.x + x.y), c, 0.25 / c * (z.y + y.z)};
    a = 0.25 / c * (z.x - x.z);
  } else {
    const double d = 0.5 * std::sqrt(d2);
    q = {0.25 / d * (z.x + x.z), 0.25 / d * (z.y + y.z), d};
    a = 0.25 / d * (x.y - y.x);
  }
  return a < 0 ? q * -1.0 : q;
}

void put_place(NiftiHeader& h, const volume::GridTransform& t) {
  const Vec3 size = t.voxel_size();
  h.put_real(80, size.x);
  h.put_real(84, size.y);
  h.put_real(88, size.z);
  for (std::size_t n = 0; n < 12; ++n) // srow_x, srow_y, srow_z
    h.put_real(280 + 4 * n, t.m[n]);
  h.put<std::int16_t>(254, 1); // sform_code: scanner
  const Vec3 x = column(t, 0) * (1 / size.x), y = column(t, 1) * (1 / size.y),
             z = column(t, 2) * (1 / size.z);
  const double mirrored = dot(cross(x, y), z) < 0 ? -1 : 1;
  h.put_real(76, mirrored); // qfac
  if (!(std::fabs(dot(x, y)) < 1e-6 && std::fabs(dot(y, z)) < 1e-6 && std::fabs(dot(z, x)) < 1e-6))
    return;
  h.put<std::int16_t>(252, 1); // qform_code
  const Vec3 q = quaternion(x, y, z * mirrored);
  for (const auto& [at, value] :
       {std::pair(256, q.x), {260, q.y}, {264, q.z}, {268, t.m[3]}, {272, t.m[7]}, {276, t.m[11]}})
    h.put_real(static_cast<std::size_t>(at), value);
}

} // namespace

void NiftiHeader::put_text(std::size_t at, std::string_view text) {
  std::ranges::copy(text, bytes_.begin() + static_cast<std::ptrdiff_t>(at));
}

NiftiHeader nifti_header(const std::array<int, 8>& dim, std::int16_t intent,
                         const volume::GridTransform& transform, std::string_view what) {
  NiftiHeader h;
  h.put<std::int32_t>(0, 348);
  h.put<char>(38, 'r'); // regular
  for (std::size_t n = 0; n < dim.size(); ++n)
    h.put(40 + 2 * n, static_cast<std::int16_t>(dim[n]));
  h.put<std::int16_t>(68, intent);
  h.put<std::int16_t>(70, 16); // datatype: float32
  h.put<std::int16_t>(72, 32); // bitpix
  for (const std::size_t at : {92U, 96U, 100U, 104U})
    h.put_real(at, 1);
  put_place(h, transform);
  h.put_real(108, nifti_header_bytes); // vox_offset
  h.put_real(112, 1);                  // scl_slope
  h.put<std::uint8_t>(123, 2);         // xyzt_units: mm
  h.put_text(148, what.substr(0, 79));
  h.put_text(344, std::string_view("n+1\0", 4));
  return h;
}

} // namespace gewebe::formats
