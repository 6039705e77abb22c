#pragma once
// What moves in integrator/solid_motion.h, and where it is.

#include "fem/element.h"
#include "integrator/motion_numbers_internal.h"
#include "tetrahedra/tet_mesh.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace gewebe::integrator {

struct MotionBody {
  tetrahedra::TetMesh mesh;
  std::vector<fem::SolidElement> elements;
  Numbers masses;                        ///< by node
  Numbers drag;                          ///< by node, per mass, 1/s
  Numbers rest;                          ///< places
  std::vector<std::uint8_t> in_elements; ///< by node, whether it is in a tetrahedron

  std::size_t axes() const noexcept { return rest.size(); }
  std::size_t nodes() const noexcept { return masses.size(); }
  /// Of a node in a step of h, per mass.
  double inertia(std::size_t node, double h) const { return 1 / (h * h) + drag[node] / h; }
};

/// Numbers on the 3 n axes.
struct MotionState {
  Numbers place, velocity, load;
  std::vector<std::uint8_t> held;

  bool any_held() const;
};

/// Of speeds v.
double motion_energy(const MotionBody& body, const Numbers& v);
/// From rest to the places.
double work_of_load(const MotionBody& body, const Numbers& load, const Numbers& places);

} // namespace gewebe::integrator
