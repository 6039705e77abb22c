// What a first contact or cut of an elastostatic object needs, made before it is needed: nothing
// that is answered depends on when.

#include "scene/rules_internal.h"

namespace gewebe::scene {

void Rule<Prepare>::check(World& w, const Prepare& c) {
  Object& object = w.now.objects.at(c.object);
  need_model(object);
  require_support(w, object, Feature::prepare);
  if (c.cut)
    require_support(w, object, Feature::cut);
  if (c.contact)
    require_support(w, object, Feature::touch);
  if (!c.nodes_ahead.empty() && has_law(object))
    throw Error("object " + object.name() +
                " has large strains (law=), expected no nodes to prepare");
  if (!c.nodes_ahead.empty() && object.warp)
    throw Error("object " + object.name() +
                " has large rotations (rotation=warp), expected no nodes to prepare");
}

void Rule<Prepare>::apply(World& w, const Prepare& c) {
  Object& object = w.now.objects.at(c.object);
  need_model(object);
  if (is_held_altogether(object))
    return;
  if (has_law(object)) {
    strained_of(w, object).prepare(acting_at(object, w.now.clock.time));
  } else if (object.warp) {
    (void)warped_of(w, object);
  } else {
    statics::Elastostatic& solver = solver_of(w, object);
    if (object.stages.options)
      (void)two_step_of(w, object);
    if (c.contact)
      solver.read_compressed();
    solver.prepare(c.nodes_ahead);
  }
  if (c.cut)
    announce_cut(w, c.object);
}

void Rule<Prepare>::log(const World&, const Prepare& c, ChangeRow& row) {
  row.what = "prepare";
  row.nodes = c.nodes_ahead;
  row.text = c.contact && c.cut ? "contact cut" : c.cut ? "cut" : "contact";
}

} // namespace gewebe::scene
