// The solvers of elastostatic objects: of one step, of two, of large rotations and of large
// strains, made when they are needed.

#include "fem/model_stiffness.h"
#include "linalg/stiffness.h"
#include "scene/rules_internal.h"
#include "statics/second_stage.h"

#include <algorithm>
#include <utility>

namespace gewebe::scene {

void add_counts(statics::ElastostaticCounts& sum, const statics::ElastostaticCounts& more) {
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
  sum.rounds += more.rounds;
  sum.change = std::max(sum.change, more.change);
}

void make_solver(const World& w, Object& object,
                 std::shared_ptr<compliance::ComplianceSource> source) {
  object.statics.solver = std::make_shared<statics::Elastostatic>(
      object.model(), std::move(source), w.context,
      statics::ElastostaticOptions{.measure_error = w.options.measure_error,
                                   .tolerance = w.options.tolerance,
                                   .may_be_free = true});
}

namespace {

std::shared_ptr<compliance::ComplianceSource> source_of(Object& object) {
  Statics& statics = object.statics;
  if (statics.prepared)
    return std::exchange(statics.prepared, nullptr);
  if (!object.cut.first && object.matter->source.stiffness)
    return object.matter->source.stiffness(object.model());
  return {};
}

/// What its solver did so far.
statics::ElastostaticCounts counts_of(const Statics& statics) {
  if (statics.strained) {
    const dynamics::SolidStaticCounts counts = statics.strained->counts();
    statics::ElastostaticCounts all;
    all.updates = counts.updates;
    all.unchanged = counts.unchanged;
    all.shapes = counts.shapes;
    all.factors = counts.factors;
    all.rounds = counts.rounds;
    return all;
  }
  if (!statics.warped)
    return statics.solver ? statics.solver->counts() : statics::ElastostaticCounts{};
  const statics::WarpedCounts counts = statics.warped->counts();
  statics::ElastostaticCounts all;
  all.updates = counts.updates;
  all.unchanged = counts.unchanged;
  all.shapes = counts.shapes;
  all.solves = counts.solves;
  all.columns_read = counts.columns_read;
  all.factors = counts.factors;
  all.rounds = counts.rounds;
  all.change = counts.change;
  return all;
}

} // namespace

statics::Elastostatic& solver_of(World& w, Object& object) {
  need_model(object);
  Statics& statics = object.statics;
  if (!statics.solver)
    make_solver(w, object, source_of(object));
  return *statics.solver;
}

statics::WarpedStatics& warped_of(World& w, Object& object) {
  need_model(object);
  Statics& statics = object.statics;
  if (!statics.warped) {
    statics.warped =
        std::make_shared<statics::WarpedStatics>(object.model(), source_of(object), w.context);
    statics.warped->restore(object.warped);
  }
  return *statics.warped;
}

namespace {

/// Where an object with a law stands, as the start of its first shape; null: at rest.
std::shared_ptr<const dynamics::SolidRest> shown_rest(const Object& object) {
  const std::vector<double>& u = *object.shown.displacement;
  if (!object.shown.shaped || u.size() != 3 * object.model().nodes.size() ||
      std::ranges::all_of(u, [](double x) { return x == 0; }))
    return nullptr;
  auto rest = std::make_shared<dynamics::SolidRest>();
  rest->load = acting_load(object.shown);
  rest->balanced = false;
  for (std::size_t i = 0; i < object.model().nodes.size(); ++i)
    for (int a = 0; a < 3; ++a)
      rest->places.push_back(object.model().nodes[i].position[a] +
                             u[3 * i + static_cast<std::size_t>(a)]);
  return rest;
}

} // namespace

dynamics::SolidStatic& strained_of(World& w, Object& object) {
  need_model(object);
  std::shared_ptr<dynamics::SolidStatic>& strained = object.statics.strained;
  if (strained)
    return *strained;
  if (!is_solid(object))
    throw Error("object " + object.name() +
                " has no tetrahedra, expected a solid for law=, damping= and tolerance=");
  if (!object.model().springs.empty() ||
      model::body_count(object.model()) != object.model().nodes.size())
    throw Error("object " + object.name() +
                " has springs beside its tetrahedra, expected tetrahedra alone for law= at rest");
  strained = std::make_shared<dynamics::SolidStatic>(object.model(), *law_of(object), w.context);
  if (!object.strained)
    object.strained = shown_rest(object);
  strained->restore(object.strained);
  return *strained;
}

statics::ElastostaticCounts static_counts(const Object& object) {
  const Statics& statics = object.statics;
  statics::ElastostaticCounts all = statics.spent;
  add_counts(all, counts_of(statics));
  return all;
}

void update_solver(World& w, Object& object, const contact::Load& load) {
  if (object.shown.rough)
    shape_in_step(w, object); // while the solver is at that load
  update_stages(w, object, load);
}

void drop_solvers(Object& object) {
  Statics& statics = object.statics;
  add_counts(statics.spent, counts_of(statics));
  statics.solver.reset();
  statics.warped.reset();
  statics.strained.reset();
  statics.reach.reset();
  if (statics.two_step) {
    statics::ElastostaticCounts second = statics.two_step->second_counts();
    second.updates = second.unchanged = 0; // those of the first stage count
    add_counts(statics.spent, second);
    statics.two_step.reset();
  }
  statics.stiffness.reset();
  statics.prepared.reset();
  object.shown.valid = false;
}

/// \pre it has stages
statics::TwoStep& two_step_of(World& w, Object& object) {
  std::shared_ptr<statics::TwoStep>& two_step = object.statics.two_step;
  if (!two_step)
    two_step = std::make_shared<statics::TwoStep>(object.model(), object.stages.second(), w.context,
                                                  *object.stages.options, w.options.tolerance);
  return *two_step;
}

void update_stages(World& w, Object& object, const contact::Load& load) {
  if (has_law(object)) {
    dynamics::SolidStatic& strained = strained_of(w, object);
    strained.restore(object.strained); // whatever was sought since
    strained.update(load, rest_time(w, object, w.now.clock.time));
    object.strained = strained.answer();
    return;
  }
  if (object.warp) {
    statics::WarpedStatics& warped = warped_of(w, object);
    warped.update(load);
    object.warped = warped.answer();
    return;
  }
  statics::Elastostatic& solver = solver_of(w, object);
  if (object.stages.options)
    two_step_of(w, object).update(solver, load);
  else
    solver.update(load);
}

std::span<const double> static_shape(Object& object) {
  Statics& statics = object.statics;
  if (statics.strained)
    return statics.strained->displacement();
  if (statics.warped)
    return statics.warped->displacement();
  return statics.two_step ? statics.two_step->displacement(*statics.solver)
                          : statics.solver->displacement();
}

std::span<const double> static_surface(Object& object) {
  Statics& statics = object.statics;
  if (statics.strained)
    return statics.strained->displacement();
  if (statics.warped)
    return statics.warped->surface_displacement();
  return statics.two_step ? statics.two_step->surface_displacement(*statics.solver)
                          : statics.solver->surface_displacement();
}

std::span<const double> static_rough_surface(Object& object) {
  Statics& statics = object.statics;
  if (statics.strained)
    return statics.strained->displacement();
  if (statics.warped)
    return statics.warped->surface_displacement();
  return statics.two_step ? statics.two_step->rough_surface(*statics.solver)
                          : statics.solver->rough_surface();
}

void verify_shape(Object& object) {
  Statics& statics = object.statics;
  if (statics.two_step)
    statics.two_step->verify(*statics.solver);
  else if (statics.solver)
    statics.solver->verify();
}

std::vector<contact::NodeVector> static_forces(const Object& object) {
  const Statics& statics = object.statics;
  if (statics.strained)
    return statics.strained->holding_forces();
  if (statics.warped)
    return statics.warped->holding_forces();
  return statics.two_step ? statics.two_step->contact_forces() : statics.solver->contact_forces();
}

namespace {

/// Goes on with this model of the second stage.
void set_second(const World& w, Object& object, std::shared_ptr<const model::Model> model) {
  object.stages.model = model;
  object.stages.second = [context = w.context, model = std::move(model)] {
    return compliance::compliance_of_factor(
        [context, model] { return linalg::Factor(fem::stiffness_matrix(*model), context); });
  };
}

} // namespace

/// The second stage of a cut object, if its model is known.
void follow_cut(const World& w, const Object& old, std::span<const std::uint32_t> origin,
                Object& next) {
  if (old.stages.model)
    set_second(w, next,
               std::make_shared<const model::Model>(statics::cut_second_stage(
                   next.model(), origin, old.model(), *old.stages.model)));
}

/// That of an object that is as it came again.
void make_whole(const World& w, Object& object) {
  if (object.stages.first_model)
    set_second(w, object, object.stages.first_model);
}

void Rule<SetWarp>::check(World& w, const SetWarp& c) {
  require_support(w, w.now.objects.at(c.object), Feature::warp);
}

void Rule<SetWarp>::apply(World& w, const SetWarp& c) {
  Object& object = w.now.objects.at(c.object);
  if (object.warp)
    return;
  if (object.statics.made())
    drop_solvers(object);
  object.warp = true;
  touch(object);
}

void Rule<SetWarp>::log(const World&, const SetWarp&, ChangeRow& row) {
  row.what = "rotation";
  row.text = "warp";
}

void Rule<SetTwoStep>::check(World& w, const SetTwoStep& c) {
  Object& object = w.now.objects.at(c.object);
  need_model(object);                            // which may have a law of large strains
  if (!object.cut.first || !object.stages.model) // else that is cut too
    require_support(w, object, Feature::two_step);
  if (!c.model)
    return;
  if (!statics::same_but_stiffness(object.cut.first ? *object.cut.first : object.model(), *c.model))
    throw Error("object " + object.name() +
                " and the model of its second stage differ in more than stiffness, expected the "
                "same nodes, springs and triangles");
}

void Rule<SetTwoStep>::apply(World& w, const SetTwoStep& c) {
  Object& object = w.now.objects.at(c.object);
  if (object.statics.two_step)
    object.statics.two_step->set(c.options);
  object.stages.options = c.options;
  if (c.model && !object.cut.first && c.model != object.stages.first_model) {
    if (object.statics.two_step)
      drop_solvers(object);
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

} // namespace gewebe::scene
