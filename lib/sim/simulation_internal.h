#pragma once
// What a Simulation holds, and how its units write numbers.

#include "base/error.h"
#include "sim/simulation.h"

#include <cstddef>
#include <cstdint>
#include <exception>
#include <optional>
#include <string>
#include <vector>

namespace gewebe {

namespace simulation {

/// The shortest text that reads back exactly.
std::string number_text(double value);

} // namespace simulation

struct Simulation::Object {
  std::string name;
  Model model; // never moves: the methods refer to it
  Method method = Method::ela;
  Load load;
  Integration integration = Integration::semi_implicit;
  std::optional<Elastostatic> still;
  std::optional<TwoStep> two_step; // over `still`
  Body* body = nullptr;            // of an elastodynamic object
  std::size_t offset = 0;          // of its nodes in the body

  std::vector<double> displacement;
  std::vector<NodeVector> forces;
  bool shown = true;  // forces are those of the present state, and of ela the displacement
  bool shaped = true; // of ffe the displacement too
  double shown_time = 0;
  bool warned_range = false;
  double shortest_edge = 0; // mm; 0: not yet known
  double looked_at = 0;     // largest displacement when the range was last looked at
  int not_looked = 0;
  bool warned_threshold = false;
};

/// What moves together: one elastodynamic object, or several that are attached to each other.
struct Simulation::Body {
  std::vector<std::size_t> parts; // objects
  std::optional<Model> joined;    // of several; else the object's own
  std::optional<Elastodynamic> moving;
  double safe = 0; // largest stable step
  bool changed = true;
  bool warned_step = false;
  std::uint64_t taken = 0; // by the last advance
  std::exception_ptr failure;
};

} // namespace gewebe
