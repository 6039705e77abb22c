// Objects of a scene: what they consist of, read when it is needed, and their solvers.

#include "scene/world_internal.h"

#include <algorithm>
#include <memory>
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
  sum.contact_error = std::max(sum.contact_error, more.contact_error);
  sum.shape_error = std::max(sum.shape_error, more.shape_error);
}

void insert(World& w, Object object) {
  for (const Object& other : w.now.objects)
    if (other.name() == object.name())
      throw Error("there is an object '" + object.name() + "' already, expected another name");
  object.load.write().gravity = w.now.gravity;
  object.shown.valid = object.load->empty();
  w.now.objects.push_back(std::move(object));
}

void need_model(Object& object) {
  if (object.matter->known)
    return;
  object.matter->model = std::make_shared<const Model>(object.matter->source.model());
  object.shown.displacement.replace().assign(3 * object.model().nodes.size(), 0);
  object.matter->known = true;
}

void make_still(const World& w, Object& object, std::shared_ptr<ComplianceSource> source) {
  object.statics->still.emplace(object.model(), std::move(source), w.context,
                                ElastostaticOptions{.measure_error = w.options.measure_error,
                                                    .tolerance = w.options.tolerance});
}

Elastostatic& still_of(World& w, Object& object) {
  need_model(object);
  Statics& statics = *object.statics;
  if (statics.still)
    return *statics.still;
  statics.ahead = true;
  std::shared_ptr<ComplianceSource> source;
  if (statics.prepared)
    source = std::exchange(statics.prepared, nullptr);
  else if (!object.cut.first && object.matter->source.stiffness)
    source = object.matter->source.stiffness(object.model());
  make_still(w, object, std::move(source));
  return *statics.still;
}

void update_still(World& w, Object& object, const Load& load) {
  object.statics->ahead = true;
  update_stages(w, object, load);
}

void renew(Object& object) {
  Statics& statics = *object.statics;
  if (statics.still) {
    add_counts(statics.spent, statics.still->counts());
    statics.still.reset();
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

} // namespace gewebe::simulation
