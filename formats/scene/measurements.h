#pragma once
// What a body was measured to do under known loads, as text: gewebe_measurements(5).

#include "fit/young_fit.h"
#include "geometry/vec3.h"
#include "model/selector.h"

#include <string>
#include <string_view>
#include <vector>

namespace gewebe::formats {

struct MeasuredForce {
  model::Selector nodes;
  Vec3 force;         ///< g mm/s²
  bool total = false; ///< divided among the nodes
};

struct LoadCase {
  Vec3 gravity; ///< mm/s²
  std::vector<MeasuredForce> forces;
  std::vector<fit::Measurement> measurements;
};

struct Measurements {
  std::vector<LoadCase> cases;       ///< those with a measurement
  std::vector<std::string> known;    ///< materials that keep their modulus
  std::vector<double> times, values; ///< of a swing, s and any unit
};

/// \throw Error with the place "NAME:LINE"; if there is neither a measurement nor a swing
Measurements parse_measurements(std::string_view text, const std::string& name);

} // namespace gewebe::formats
