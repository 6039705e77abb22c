#include "dynamics/spring_kernel_body_internal.h"

namespace gewebe::dynamics {

bool block_step_baseline(const SpringBlock& block, const NodeRest* rest, const NodeTraits* traits,
                         const NodeRow* now, NodeRow* next, double h) {
  return step(block, rest, traits, now, next, h);
}

} // namespace gewebe::dynamics
