#pragma once
// Forces of pairs of surfaces (statics/meeting_yielding.h) whose points and normals stay, so that
// their nodes' places depend linearly on them.

#include "contact/contact_solver.h"
#include "statics/meeting_yielding.h"

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe {

inline Eigen::Vector3d eigen(const Vec3& v) {
  return {v.x, v.y, v.z};
}
inline Vec3 vec(const Eigen::Vector3d& v) {
  return {v[0], v[1], v[2]};
}

/// From the point of the second part to that of the first.
Vec3 between(const SurfacePair& pair, std::span<const Vec3> at);

struct MeetingColumns {
  Eigen::MatrixXd moved;      ///< by pairs' forces, three columns each: nodes of the operator
  Eigen::MatrixXd compliance; ///< of the pairs
};
/// \param nodes of the operator, ascending \param compliance its own
MeetingColumns columns_of_pairs(std::span<const SurfacePush> pairs,
                                std::span<const std::uint32_t> nodes,
                                std::span<const double> compliance);

/// Those that meet, and one of those that say the same: a node on a corner, and that corner on the
/// node.
std::vector<std::size_t> counting_pairs(std::span<const SurfacePush> pairs);

/// Takes the pairs' forces on from what they are to those of the contacts. \param contacts of the
/// pairs, in their order \return whether they are solved
bool push_pairs(const MeetingColumns& columns, std::span<const Contact> contacts,
                std::span<SurfacePush> pairs);

} // namespace gewebe
