#include "geometry/particles.h"

namespace gewebe {

Box3 support_box(const Particles& particles) {
  Box3 box;
  for (const Particle& particle : particles) {
    const Vec3 radius{particle.support_radius, particle.support_radius, particle.support_radius};
    box.add(particle.center - radius);
    box.add(particle.center + radius);
  }
  return box;
}

} // namespace gewebe
