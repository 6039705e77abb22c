#include "integrator/motion_volumes_internal.h"

#include "base/disjoint_sets.h"
#include "base/error.h"
#include "geometry/vector_at.h"
#include "mesh/border.h"

#include <Eigen/Cholesky>

#include <cmath>
#include <cstdint>
#include <map>

namespace gewebe::integrator {

namespace {

constexpr double no_volume = 1e-9; ///< of the cube of the extent

} // namespace

MotionVolumes::MotionVolumes(std::span<const Triangle> triangles, const Numbers& rest,
                             double bulk) {
  DisjointSets faces(triangles.size());
  if (triangles.empty() || !mesh::join_opposite_sides(rest.size() / 3, triangles, faces))
    throw Error("its surface is not closed, expected a closed one to keep its volume");
  std::map<std::uint32_t, std::size_t> part_of;
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    const auto [at, is_new] = part_of.try_emplace(faces.find(t), parts_.size());
    if (is_new)
      parts_.emplace_back();
    parts_[at->second].triangles.push_back(triangles[t]);
  }
  for (Part& part : parts_) {
    Box3 box;
    for (const Triangle& t : part.triangles)
      for (const std::uint32_t corner : t)
        box.add(vector_at(rest, corner));
    part.gradient.resize(rest.size());
    part.rest = volume(part, rest, false);
    if (!(std::abs(part.rest) > no_volume * std::pow(box.longest_side(), 3)))
      throw Error("a part of its surface encloses no volume, expected one to keep");
    part.stiffness = bulk / std::abs(part.rest);
  }
}

/// From one of its points on, so that where it is adds no rounding.
double MotionVolumes::volume(Part& part, const Numbers& at, bool gradient) const {
  const Vec3 origin = vector_at(at, part.triangles[0][0]);
  double six = 0;
  if (gradient)
    for (const Triangle& t : part.triangles)
      for (const std::uint32_t corner : t)
        for (std::size_t a = 0; a < 3; ++a)
          part.gradient[3 * std::size_t{corner} + a] = 0;
  for (const Triangle& t : part.triangles) {
    const Vec3 p[3] = {vector_at(at, t[0]) - origin, vector_at(at, t[1]) - origin,
                       vector_at(at, t[2]) - origin};
    six += dot(p[0], cross(p[1], p[2]));
    if (!gradient)
      continue;
    const Vec3 third = cross(p[1] - p[0], p[2] - p[0]) / 6; // of the area vector
    for (const std::uint32_t corner : t)
      for (int a = 0; a < 3; ++a)
        part.gradient[3 * std::size_t{corner} + static_cast<std::size_t>(a)] += third[a];
  }
  return six / 6;
}

double MotionVolumes::evaluate(const Numbers& at, std::span<double> forces) {
  elastic_ = 0;
  for (Part& part : parts_) {
    const double more = volume(part, at, true) - part.rest, pull = part.stiffness * more;
    elastic_ += pull * more / 2;
    for (std::size_t axis = 0; axis < part.gradient.size(); ++axis)
      forces[axis] -= pull * part.gradient[axis];
  }
  return elastic_;
}

void MotionVolumes::linearise(const std::function<void(Numbers&)>& solve) {
  const auto count = static_cast<Eigen::Index>(parts_.size());
  Eigen::MatrixXd inner(count, count);
  gradients_.resize(parts_.size());
  for (std::size_t k = 0; k < parts_.size(); ++k) {
    gradients_[k] = parts_[k].response = parts_[k].gradient;
    solve(parts_[k].response);
  }
  for (Eigen::Index r = 0; r < count; ++r)
    for (Eigen::Index c = 0; c < count; ++c)
      inner(r, c) = (r == c ? 1 / parts_[static_cast<std::size_t>(r)].stiffness : 0) +
                    product(gradients_[static_cast<std::size_t>(r)],
                            parts_[static_cast<std::size_t>(c)].response);
  const Eigen::MatrixXd symmetric = (inner + inner.transpose()) / 2; // of single precision
  inner_ = symmetric.ldlt().solve(Eigen::MatrixXd::Identity(count, count));
}

void MotionVolumes::correct(Numbers& v) const {
  const auto count = static_cast<Eigen::Index>(parts_.size());
  Eigen::VectorXd along(count);
  for (Eigen::Index k = 0; k < count; ++k)
    along[k] = product(gradients_[static_cast<std::size_t>(k)], v);
  const Eigen::VectorXd by = inner_ * along;
  for (Eigen::Index k = 0; k < count; ++k)
    add(v, -by[k], parts_[static_cast<std::size_t>(k)].response);
}

} // namespace gewebe::integrator
