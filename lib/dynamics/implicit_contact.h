#pragma once
// Instruments in a backward Euler step:
//
//   M (Δ/h - v)/h = F(u + Δ, Δ/h) + f + Hᵀ λ,
//
// where λ and the new places of the touched nodes meet the conditions of contact_solver.h. In turn:
// the step under the last λ; from its matrix A the Delassus operator W = H A⁻¹ Hᵀ of the touched
// nodes; λ for where W puts them (static_contact.h); the step under these, until its nodes stand
// where W put them. Nothing of a step's velocity into an instrument is left at its end, and
// friction acts against the slip over the step. What an instrument jumps over is moved out of it
// before, without velocity, as in explicit steps.

#include "base/context.h"
#include "compliance/column_cache.h"
#include "dynamics/dynamic_contact.h"
#include "dynamics/implicit_euler.h"
#include "model/model.h"
#include "statics/static_contact.h"

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

namespace gewebe {

class ImplicitContact {
public:
  /// Keeps references to both.
  ImplicitContact(const Model& model, ImplicitEuler& euler);

  struct Step {
    std::span<const Vec3> outer;
    std::span<const std::uint8_t> held;
    const std::map<std::uint32_t, Vec3>& displaced; ///< nodes whose axes are all held
    std::span<const std::optional<MovingInstrument>> instruments;
    double start = 0, h = 0; ///< s
  };
  struct Result {
    bool solved = false; ///< the step
    bool exact = true;   ///< its forces
    std::uint32_t worst = 0;
    std::vector<NodeTouch> impulses;
  };
  /// As ImplicitEuler::step. \param touches forces of the last step, then of this one
  /// \throw as it, and Error if columns of A⁻¹ do not fit in memory
  Result step(const Step& step, std::span<NodeMotion> motion, std::vector<NodeTouch>& touches,
              const Context& context);

private:
  class Object;
  bool part(const Step& step, std::span<NodeMotion> motion, std::vector<NodeTouch>& touches,
            const Context& context, Result& result);

  const Model& model_;
  ImplicitEuler& euler_;
  StaticContact contact_;
  double size_ = 0;
  std::optional<ColumnCache> columns_; ///< of A⁻¹
  std::uint64_t columns_of_ = 0;       ///< factorisation
};

} // namespace gewebe
