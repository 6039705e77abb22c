#pragma once
// Contact of a sphere with nodes alone, as a reference to compare contact with the surface with:
// each node is kept beyond the plane that supports the sphere where the node was last, then the
// planes are taken anew.

#include "base/vec3.h"
#include "model/model.h"
#include "statics/elastostatic.h"

#include <span>
#include <vector>

namespace gewebe::validate {

class NodeContact {
public:
  /// Of an elastostatic object, at rest; keeps a reference to its model. \param compliance of the
  /// nodes that may be touched
  NodeContact(const Model& model, DelassusOperator compliance);

  /// The force of a sphere on its nodes, without friction. Nodes keep the sides on which they were.
  Vec3 press(const Vec3& centre, double radius);

private:
  DelassusOperator compliance_;
  std::vector<Vec3> free_, at_, force_;
};

} // namespace gewebe::validate
