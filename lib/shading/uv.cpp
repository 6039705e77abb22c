#include "shading/uv.h"

#include "base/error.h"
#include "base/parallel.h"
#include "shading/angles.h"
#include "shading/tangents.h"
#include "texture/rest.h"

#include <algorithm>
#include <cmath>

namespace gewebe::shading {
namespace {

using Corners = std::array<std::array<double, 2>, 3>; // s and t of each

/// The axis, and the side of it, that a triangle looks to.
struct Side {
  int axis = 2;
  bool positive = true;
};

Side side_of(const Vec3& normal) {
  // By a margin, so that symmetric shapes don't depend on the last digit.
  constexpr double clearly = 1 + 1e-6;
  Side side{0, true};
  for (int axis = 1; axis < 3; ++axis)
    if (std::fabs(normal[axis]) > clearly * std::fabs(normal[side.axis]))
      side.axis = axis;
  side.positive = !(normal[side.axis] < 0);
  return side;
}

/// Along x and y the texture stands upright (z is up), along z its top is the front (+y).
std::array<double, 2> project(const Vec3& p, const Side& side) {
  const double sign = side.positive ? 1 : -1;
  switch (side.axis) {
  case 0:
    return {sign * p.y, p.z};
  case 1:
    return {-sign * p.x, p.z};
  default:
    return {sign * p.x, p.y};
  }
}

/// Coordinates go on across the seam; on the axis, where there is no longitude, the others' mean.
void join_longitudes(Corners& st, const std::array<bool, 3>& on_axis) {
  double low = 2, high = -1;
  for (std::size_t c = 0; c < 3; ++c)
    if (!on_axis[c]) {
      low = std::min(low, st[c][0]);
      high = std::max(high, st[c][0]);
    }
  double sum = 0;
  int count = 0;
  for (std::size_t c = 0; c < 3; ++c)
    if (!on_axis[c]) {
      if (high - low > 0.5 && st[c][0] < 0.5)
        st[c][0] += 1;
      sum += st[c][0];
      ++count;
    }
  for (std::size_t c = 0; c < 3; ++c)
    if (on_axis[c])
      st[c][0] = count > 0 ? sum / count : 0;
}

/// Projections for the whole mesh: where s and t start, so that far objects keep their digits.
class Mapper {
public:
  Mapper(const UvFrame& frame, const std::vector<Vec3>& normals)
      : frame_(frame), normals_(normals) {
    center_ = frame.box.min * 0.5 + frame.box.max * 0.5;
    // Whole edges from the world's origin: the pattern stays where it is when the box changes.
    for (int a = 0; a < 3; ++a)
      start_[a] = std::floor(frame.box.min[a] / frame.edge) * frame.edge;
    near_axis_ = 1e-9 * frame.box.longest_side();
  }

  Corners operator()(std::span<const Vec3> rest, const Triangle& t) const {
    Corners st{};
    if (frame_.mapping == UvMapping::box) {
      const Side side = side_of(normals_[t[0]] + normals_[t[1]] + normals_[t[2]]);
      for (std::size_t c = 0; c < 3; ++c)
        st[c] = project((rest[t[c]] - start_) / frame_.edge, side);
      return st;
    }
    std::array<bool, 3> on_axis{};
    for (std::size_t c = 0; c < 3; ++c) {
      const Vec3 p = rest[t[c]] - center_;
      const double radius = std::sqrt(p.x * p.x + p.y * p.y);
      on_axis[c] = !(radius > near_axis_);
      st[c] = {turn(p.x, p.y), height(p, radius)};
    }
    join_longitudes(st, on_axis);
    return st;
  }

private:
  double height(const Vec3& p, double radius) const {
    if (frame_.mapping == UvMapping::cylinder) {
      const double size = frame_.box.size().z;
      return size > 0 ? p.z / size + 0.5 : 0.5;
    }
    const double latitude = turn(radius, p.z); // 0 … 1/4, or 3/4 … 1 in the south
    return 2 * (latitude > 0.5 ? latitude - 1 : latitude) + 0.5;
  }

  const UvFrame& frame_;
  const std::vector<Vec3>& normals_;
  Vec3 center_, start_;
  double near_axis_ = 0;
};

} // namespace

const std::vector<std::string>& uv_mapping_names() {
  static const std::vector<std::string> names{"box", "sphere", "cylinder"};
  return names;
}

UvMapping uv_mapping_from_name(std::string_view name) {
  for (std::size_t n = 0; n < uv_mapping_names().size(); ++n)
    if (uv_mapping_names()[n] == name)
      return static_cast<UvMapping>(n);
  throw Error("mapping '" + std::string(name) + "' is unknown");
}

std::vector<std::array<float, 6>> make_texcoords(std::span<const Vec3> rest,
                                                 std::span<const Triangle> triangles,
                                                 const UvFrame& frame, const Context& context) {
  std::vector<Vec3> normals;
  if (frame.mapping == UvMapping::box)
    normals = area_normals(rest, triangles);
  const Mapper map(frame, normals);
  std::vector<std::array<float, 6>> texcoords(triangles.size());
  parallel_blocks(context, triangles.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const Corners st = map(rest, triangles[t]);
      for (std::size_t c = 0; c < 3; ++c) {
        texcoords[t][2 * c] = static_cast<float>(st[c][0]);
        texcoords[t][2 * c + 1] = static_cast<float>(st[c][1]);
      }
    }
  });
  return texcoords;
}

std::uint64_t add_texcoords(std::vector<Surface>& surfaces, const UvOptions& options,
                            const Context& context) {
  UvFrame frame;
  frame.mapping = options.mapping.value_or(UvMapping::box);
  frame.box = rest_box(surfaces);
  frame.edge = texture::rest_mapping(frame.box, options.edge).edge;
  std::uint64_t mapped = 0;
  for (Surface& surface : surfaces) {
    if (surface.instrument) { // which has no use for them, but a place
      surface.mesh.texcoords.assign(surface.mesh.triangles.size(), {});
      continue;
    }
    if (surface.mesh.texcoords.size() == surface.mesh.triangles.size() && !options.mapping)
      continue;
    const std::vector<Vec3>& rest = surface.rest.empty() ? surface.mesh.points : surface.rest;
    surface.mesh.texcoords = make_texcoords(rest, surface.mesh.triangles, frame, context);
    ++mapped;
  }
  return mapped;
}

} // namespace gewebe::shading
