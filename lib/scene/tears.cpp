// Tearing: springs that are stretched too far, elements of solids that bear too much.

#include "cutting/cut_skin.h" // MeetingOfNoSheets
#include "cutting/tear_solid.h"
#include "geometry/vector_at.h"
#include "scene/rules_internal.h"
#include "text/number_text.h"

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace gewebe::scene {

namespace {

constexpr int most_attempts = 4; // until something comes apart

/// What strains of a solid are found by.
struct Strained {
  std::vector<double> u; // 3 n, or none at rest
  fem::StrainFrames frames = fem::StrainFrames::resting;
};

Strained strained(World& w, Object& object) {
  Strained found;
  if (object.body != nullptr) {
    found.frames = fem::StrainFrames::elements;
    for (const dynamics::NodeMotion& m : motion_of(object))
      found.u.insert(found.u.end(), {m.displacement.x, m.displacement.y, m.displacement.z});
  } else if (object.method == Method::ffe) {
    std::span<const double> u = whole_shape_in_step(w, object);
    if (has_law(object))
      found.frames = fem::StrainFrames::elements;
    else if (object.warped)
      u = warped_of(w, object).local_displacement();
    found.u.assign(u.begin(), u.end());
  }
  return found;
}

std::string limit_text(const cutting::TearLimit& limit) {
  std::string text = limit.stress ? "stress" : "strain";
  for (const double one : limit.most)
    text += " " + text::number_text(one);
  if (limit.over > 0)
    text += " over " + text::number_text(limit.over);
  return text;
}

void require_limit(const Object& object, const cutting::TearLimit& limit) {
  if (limit.most.size() > 1 && limit.most.size() != object.model().materials.size())
    throw Error("object " + object.name() + ": " + std::to_string(limit.most.size()) +
                " limits to tear at, expected one or those of its " +
                std::to_string(object.model().materials.size()) + " materials");
  if (limit.stress && object.stages.options)
    throw Error("object " + object.name() +
                " has a second stage, so that its stress is that of no one material, expected no "
                "two-step to tear by stress");
}

/// The skin goes along where it can: else it spans the tear until what holds it comes off.
std::optional<cutting::CutModel> part_at(World& w, std::size_t index,
                                         const cutting::SolidTear& tear) {
  const PlaneToCut plane{tear.plane, tear.nodes, true};
  try {
    return cut_by_plane(w, index, plane);
  } catch (const mesh::MeetingOfNoSheets& error) {
    if (w.options.warn)
      w.options.warn("object " + w.now.objects[index].name() + " at " +
                     text::number_text(w.now.clock.time) +
                     " s: its skin is not torn by this step: " + error.what());
    return cut_by_plane(w, index, plane, false);
  }
}

void tear_solid(World& w, std::size_t index) {
  Object& object = w.now.objects[index];
  const cutting::TearLimit limit = object.cut.limit;
  if (!limit.any() || !may_cut(w, object, Feature::tear))
    return;
  require_limit(object, limit);
  const Strained is = strained(w, object);
  if (is.u.empty())
    return;
  for (int attempt = 0; attempt < most_attempts; ++attempt) {
    const std::optional<cutting::SolidTear> tear =
        cutting::find_tear(object.model(), is.u, is.frames, limit, attempt);
    if (!tear)
      return;
    if (std::optional<cutting::CutModel> cut = part_at(w, index, *tear)) {
      carry_out(w, index, std::move(*cut));
      return;
    }
    bool& told = object.matter->told.untorn;
    if (attempt + 1 == most_attempts && w.options.warn && !told) {
      told = true;
      w.options.warn("object " + object.name() + " at " + text::number_text(w.now.clock.time) +
                     " s: element " + std::to_string(tear->tetrahedron) + " bears " +
                     text::number_text(tear->share) +
                     " times its limit, but no faces near it come apart");
    }
  }
}

} // namespace

void tear(World& w) {
  const std::size_t count = w.now.objects.size();
  for (std::size_t index = 0; index < count; ++index) {
    Object& object = w.now.objects[index];
    if (object.matter->known && is_solid(object)) {
      of_object(object.name() + " at " + text::number_text(w.now.clock.time) + " s",
                [&] { tear_solid(w, index); });
      continue;
    }
    if (!(object.cut.tear > 0) || !may_cut(w, object, Feature::tear))
      continue;
    shape_in_step(w, object);
    const cutting::Cut torn =
        cutting::torn_cut(object.model(), *object.shown.displacement, object.cut.tear);
    if (torn.empty())
      continue;
    of_object(object.name() + " at " + text::number_text(w.now.clock.time) + " s", [&] {
      cutting::CutModel cut =
          cutting::cut_model(object.model(), cutting::merged(torn, object.cut.scored));
      if (cut.changed())
        carry_out(w, index, std::move(cut));
    });
  }
}

void Rule<SetTear>::apply(World& w, const SetTear& c) {
  Object& object = w.now.objects.at(c.object);
  cutting::TearLimit limit = c.limit;
  if (limit.most.empty() && c.strain > 0)
    limit.most = {c.strain};
  if (!c.limit.most.empty()) {
    need_model(object);
    if (object.matter->known && !is_solid(object))
      throw Error("object " + object.name() +
                  " has no tetrahedra, expected tear NAME STRAIN of its springs");
    require_limit(object, limit);
  }
  object.cut.tear = c.strain;
  object.cut.limit = std::move(limit);
}

void Rule<SetTear>::log(const World&, const SetTear& c, ChangeRow& row) {
  row.what = "tear";
  if (c.limit.most.empty())
    row.value = c.strain;
  else
    row.text = limit_text(c.limit);
}

} // namespace gewebe::scene
