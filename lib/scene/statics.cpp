// The solvers of elastostatic objects: of one step, of two, made when they are needed.

#include "scene/rules_internal.h"
#include "solid/model_stiffness.h"
#include "solve/stiffness.h"
#include "statics/second_stage.h"

#include <algorithm>
#include <utility>

namespace gewebe::simulation {

void add_counts(ElastostaticCounts& sum, const ElastostaticCounts& more) {
  sum.updates += more.updates;
  sum.unchanged += more.unchanged;
  sum.shapes += more.shapes;
  sum.terms += more.terms;
  sum.skipped += more.skipped;
  sum.solves += more.solves;
  sum.columns_read += more.columns_read;
  sum.factors += more.factors;
  sum.backward_error = std::max(sum.backward_error, more.backward_error);
  if (more.worst_shape.worse_than(sum.worst_shape))
    sum.worst_shape = more.worst_shape;
  sum.contact_error = std::max(sum.contact_error, more.contact_error);
  sum.shape_error = std::max(sum.shape_error, more.shape_error);
}

void make_solver(const World& w, Object& object, std::shared_ptr<ComplianceSource> source) {
  object.statics->solver.emplace(object.model(), std::move(source), w.context,
                                 ElastostaticOptions{.measure_error = w.options.measure_error,
                                                     .tolerance = w.options.tolerance});
}

Elastostatic& solver_of(World& w, Object& object) {
  need_model(object);
  Statics& statics = *object.statics;
  if (statics.solver)
    return *statics.solver;
  statics.ahead = true;
  std::shared_ptr<ComplianceSource> source;
  if (statics.prepared)
    source = std::exchange(statics.prepared, nullptr);
  else if (!object.cut.first && object.matter->source.stiffness)
    source = object.matter->source.stiffness(object.model());
  make_solver(w, object, std::move(source));
  return *statics.solver;
}

void update_solver(World& w, Object& object, const Load& load) {
  object.statics->ahead = true;
  update_stages(w, object, load);
}

void renew(Object& object) {
  Statics& statics = *object.statics;
  if (statics.solver) {
    add_counts(statics.spent, statics.solver->counts());
    statics.solver.reset();
  }
  if (statics.two_step) {
    ElastostaticCounts second = statics.two_step->second_counts();
    second.updates = second.unchanged = 0; // those of the first stage count
    add_counts(statics.spent, second);
    statics.two_step.reset();
  }
  statics.stiffness.reset();
  statics.prepared.reset();
  if (object.body != nullptr && object.matter->integration == Integration::implicit)
    object.body->moving->renew();
  object.shown.valid = false;
}

/// \pre it has stages
TwoStep& two_step_of(World& w, Object& object) {
  std::optional<TwoStep>& two_step = object.statics->two_step;
  if (!two_step)
    two_step.emplace(object.model(), object.stages.second(), w.context, *object.stages.options,
                     w.options.tolerance);
  return *two_step;
}

void update_stages(World& w, Object& object, const Load& load) {
  Elastostatic& solver = solver_of(w, object);
  if (object.stages.options)
    two_step_of(w, object).update(solver, load);
  else
    solver.update(load);
}

std::span<const double> static_shape(Object& object) {
  Statics& statics = *object.statics;
  return statics.two_step ? statics.two_step->displacement(*statics.solver)
                          : statics.solver->displacement();
}

std::span<const double> static_surface(Object& object) {
  Statics& statics = *object.statics;
  return statics.two_step ? statics.two_step->surface_displacement(*statics.solver)
                          : statics.solver->surface_displacement();
}

const std::vector<NodeVector>& static_forces(const Object& object) {
  const Statics& statics = *object.statics;
  return statics.two_step ? statics.two_step->contact_forces() : statics.solver->contact_forces();
}

namespace {

/// Goes on with this model of the second stage.
void set_second(const World& w, Object& object, std::shared_ptr<const Model> model) {
  object.stages.model = model;
  object.stages.second = [context = w.context, model = std::move(model)] {
    return compliance_of_factor(
        [context, model] { return Factor(stiffness_matrix(*model), context); });
  };
}

} // namespace

/// The second stage of a cut object, if its model is known.
void follow_cut(const World& w, const Object& old, std::span<const std::uint32_t> origin,
                Object& next) {
  if (old.stages.model)
    set_second(w, next,
               std::make_shared<const Model>(
                   cut_second_stage(next.model(), origin, old.model(), *old.stages.model)));
}

/// That of an object that is as it came again.
void make_whole(const World& w, Object& object) {
  if (object.stages.first_model)
    set_second(w, object, object.stages.first_model);
}

void Rule<SetTwoStep>::check(World& w, const SetTwoStep& c) {
  Object& object = w.now.objects.at(c.object);
  if (!object.cut.first || !object.stages.model) // else that is cut too
    require_support(w, object, Feature::two_step);
  if (!c.model)
    return;
  need_model(object);
  if (!same_but_stiffness(object.cut.first ? *object.cut.first : object.model(), *c.model))
    throw Error("object " + object.name() +
                " and the model of its second stage differ in more than stiffness, expected the "
                "same nodes, springs and triangles");
}

void Rule<SetTwoStep>::apply(World& w, const SetTwoStep& c) {
  Object& object = w.now.objects.at(c.object);
  if (object.statics->two_step) {
    object.statics->ahead = true;
    object.statics->two_step->set(c.options);
  }
  object.stages.options = c.options;
  if (c.model && !object.cut.first && c.model != object.stages.first_model) {
    if (object.statics->two_step) {
      renew(object);
      object.statics->ahead = true;
    }
    object.stages.first_model = c.model;
    set_second(w, object, c.model);
  } else if (!object.stages.second) {
    object.stages.second = c.second;
  }
  object.stages.warned = false;
  touch(object);
}

void Rule<SetTwoStep>::log(const World&, const SetTwoStep& c, ChangeRow& row) {
  row.what = "two-step";
  row.value = c.options.threshold;
  row.text = c.options.series ? "series" : "";
}

} // namespace gewebe::simulation
