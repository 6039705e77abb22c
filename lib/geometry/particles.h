#pragma once
// Particles of a soft object (Wyvill et al. 1986).

#include "geometry/vec3.h"

#include <vector>

namespace gewebe {

struct Particle {
  Vec3 center;           ///< mm
  double support_radius; ///< R > 0, mm: the density vanishes at this distance
  double weight = 1;     ///< factor of the density; negative removes matter
};

using Particles = std::vector<Particle>;

/// Union of the boxes of the supports.
Box3 support_box(const Particles& particles);

} // namespace gewebe
