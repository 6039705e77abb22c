#include "statics/shape_check.h"

#include "statics/linear_range.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace gewebe::statics {

namespace {

struct Faces {
  std::vector<bool> turned;
  double volume = 0;
};

Faces faces_of(const model::Model& model, std::span<const double> displacement) {
  const auto at = [&](std::size_t i) {
    const Vec3& p = model.nodes[i].position;
    return displacement.empty()
               ? p
               : p + Vec3{displacement[3 * i], displacement[3 * i + 1], displacement[3 * i + 2]};
  };
  const Vec3 origin = model.nodes.empty() ? Vec3{} : at(0); // a far body loses no digits
  std::vector<Vec3> around(model.nodes.size()), normals(model.triangles.size());
  Faces faces;
  for (std::size_t t = 0; t < normals.size(); ++t) {
    const Triangle& c = model.triangles[t];
    const Vec3 a = at(c[0]) - origin, b = at(c[1]) - origin, d = at(c[2]) - origin;
    normals[t] = cross(b - a, d - a);
    faces.volume += dot(a, cross(b, d)) / 6;
    for (const std::uint32_t corner : c)
      around[corner] += normals[t];
  }
  faces.turned.resize(normals.size());
  for (std::size_t t = 0; t < normals.size(); ++t) {
    const Triangle& c = model.triangles[t];
    faces.turned[t] = dot(normals[t], around[c[0]] + around[c[1]] + around[c[2]]) < 0;
  }
  return faces;
}

/// Whether each edge is run along once in either direction.
bool is_closed(const model::Model& model) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> out, back;
  for (const Triangle& t : model.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      out.emplace_back(t[k], t[(k + 1) % 3]);
      back.emplace_back(t[(k + 1) % 3], t[k]);
    }
  std::ranges::sort(out);
  std::ranges::sort(back);
  return out == back;
}

} // namespace

ShapeCheck::ShapeCheck(const model::Model& model) {
  Faces faces = faces_of(model, {});
  turned_ = std::move(faces.turned);
  volume_ = faces.volume;
  closed_ = is_closed(model);
  const double shortest = gewebe::statics::shortest_edge(model);
  shortest_edge_ = std::isfinite(shortest) ? shortest : 0;
}

ShapeFaults ShapeCheck::look(const model::Model& model,
                             std::span<const double> displacement) const {
  const Faces faces = faces_of(model, displacement);
  ShapeFaults faults;
  for (std::size_t t = faces.turned.size(); t-- > 0;)
    if (faces.turned[t] && !turned_[t]) {
      ++faults.turned;
      faults.triangle = static_cast<std::uint32_t>(t);
    }
  if (closed_ && volume_ != 0)
    faults.volume = faces.volume / volume_ - 1;
  const LinearRange range = linear_range(model, displacement);
  faults.strain = range.strain;
  faults.i = range.strain_edge[0];
  faults.j = range.strain_edge[1];
  return faults;
}

} // namespace gewebe::statics
