// The table of methods and features, walked: what it does not list works, what it lists is refused
// by its words before anything is done, or passed by, which is told.

#include "base/error.h"
#include "compliance/compliance_source.h"
#include "fem/assembly.h"
#include "fem/model_stiffness.h"
#include "fem/solid_model.h"
#include "larger.h"
#include "linalg/stiffness.h"
#include "scene/support.h"
#include "simulation_scenes.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <memory>
#include <set>
#include <string>
#include <vector>

namespace gewebe::test {
namespace {

bool is_solid(scene::Way way) {
  return way == scene::Way::solid || way == scene::Way::warped || way == scene::Way::strained ||
         way == scene::Way::solid_motion || way == scene::Way::sprung ||
         way == scene::Way::viscoelastic;
}

/// All that an object is which goes on this way, in these tests, but for what it consists of.
std::vector<scene::Way> ways_of(scene::Way way) {
  switch (way) {
  case scene::Way::attached:
    return {scene::Way::explicit_motion, scene::Way::whole, scene::Way::attached};
  case scene::Way::two_step:
    return {scene::Way::elastostatic, scene::Way::whole, scene::Way::two_step};
  case scene::Way::two_step_stored:
    return {scene::Way::elastostatic, scene::Way::whole, scene::Way::two_step,
            scene::Way::two_step_stored};
  case scene::Way::cut:
    return {scene::Way::elastostatic, scene::Way::cut};
  case scene::Way::whole:
    return {scene::Way::elastostatic, scene::Way::whole};
  case scene::Way::solid:
    return {scene::Way::elastostatic, scene::Way::whole};
  case scene::Way::sprung:
    return {scene::Way::elastostatic, scene::Way::whole, scene::Way::sprung};
  case scene::Way::warped:
    return {scene::Way::elastostatic, scene::Way::whole, scene::Way::warped};
  case scene::Way::strained:
    return {scene::Way::elastostatic, scene::Way::whole, scene::Way::strained};
  case scene::Way::viscoelastic:
    return {scene::Way::elastostatic, scene::Way::whole, scene::Way::strained,
            scene::Way::viscoelastic};
  case scene::Way::net:
    return {scene::Way::elastostatic, scene::Way::whole};
  case scene::Way::filled:
    return {scene::Way::implicit_motion, scene::Way::whole, scene::Way::filled};
  case scene::Way::solid_motion:
    return {scene::Way::explicit_motion, scene::Way::whole, scene::Way::solid_motion};
  default:
    return {way, scene::Way::whole};
  }
}

const scene::Gap* expected(scene::Way way, scene::Feature feature) {
  std::vector<scene::Way> ways = ways_of(way);
  ways.push_back(is_solid(way) ? scene::Way::solid : scene::Way::net);
  for (const scene::Gap& one : scene::gaps)
    for (const scene::Way is : ways)
      if (one.way == is && one.feature == feature)
        return &one;
  return nullptr;
}

model::Model stiffer(model::Model model) {
  for (model::Spring& s : model.springs)
    s.stiffness *= 3;
  return model;
}

/// Its surface filled with tetrahedra that meet in the middle.
model::Model solid(model::Model model) {
  model.springs.clear();
  model.materials[0].poisson = 0.4;
  const auto surface = static_cast<std::uint32_t>(model::surface_count(model));
  Vec3 middle;
  for (std::uint32_t i = 0; i < surface; ++i) {
    middle += model.nodes[i].position / surface;
    model.nodes[i].central = -1;
  }
  model.nodes.resize(surface);
  model.nodes.push_back({.position = middle, .mass = 1});
  model.normals.clear();
  for (const Triangle& t : model.triangles)
    model.tetrahedra.push_back({t[1], t[0], t[2], surface});
  model.tetrahedron_material.assign(model.tetrahedra.size(), 0);
  const std::vector<double> masses =
      fem::solid_masses(fem::element_mesh(model), fem::element_materials(model));
  for (std::size_t i = 0; i < masses.size(); ++i) {
    model.nodes[i].mass = masses[i];
    model.nodes[i].drag = masses[i];
  }
  return model;
}

model::Model model_of(scene::Way way) {
  model::Model model = is_solid(way) ? solid(test::organ(3)) : test::organ(3);
  if (way == scene::Way::sprung) {
    const auto [i, j] = std::minmax(model.triangles[0][0], model.triangles[0][1]);
    model.springs = {{i, j, model::SpringKind::edge, 1, 0, 1}};
  }
  if (way == scene::Way::viscoelastic)
    model.materials[0].prony = {{0.3, 0.01}};
  return model;
}

class Pair {
public:
  Pair(scene::Way way, std::vector<std::string>& warnings)
      : model_(model_of(way)), way_(way),
        scene_(test::one_thread(), {.warn = [&](const std::string& t) { warnings.push_back(t); }}) {
    const bool moves = way == scene::Way::explicit_motion || way == scene::Way::implicit_motion ||
                       way == scene::Way::attached || way == scene::Way::solid_motion ||
                       way == scene::Way::filled;
    const scene::Integration integration =
        way == scene::Way::implicit_motion || way == scene::Way::filled
            ? scene::Integration::implicit
            : scene::Integration::semi_implicit;
    integrator::SolidChoice choice;
    if (way == scene::Way::filled)
      choice.bulk = 1000;
    if (way == scene::Way::strained || way == scene::Way::viscoelastic)
      choice.law = integrator::SolidLaw::hyperelastic;
    scene_.add_object("o", model_, moves ? scene::Method::ela : scene::Method::ffe, {}, integration,
                      choice);
    model::Model beside = test::organ(3);
    for (model::Node& n : beside.nodes)
      n.position.x += 100;
    scene_.add_object("p", std::move(beside), moves ? scene::Method::ela : scene::Method::ffe, {},
                      way == scene::Way::solid_motion ? scene::Integration::implicit : integration);
    if (way == scene::Way::attached)
      scene_.apply(tie());
    if (way == scene::Way::warped)
      scene_.apply(scene::SetWarp{0});
    if (way == scene::Way::two_step || way == scene::Way::two_step_stored)
      scene_.apply(two_step());
    if (way == scene::Way::cut) {
      scene_.apply(scene::SetForce{0, {top()}, {0, 0, 1}});
      scene_.step(0.001);
      scene_.apply(scene::CutObject{0, test::incision(model_)});
      scene_.apply(scene::Release{0, {top()}});
      scene_.step(0.001);
      scene_.take_news();
    }
  }

  /// Does it to the object. \return whether it had its effect
  bool works(scene::Feature feature) {
    switch (feature) {
    case scene::Feature::force:
      scene_.apply(scene::SetForce{0, {top()}, {0, 0, 2000}});
      return bends();
    case scene::Feature::pressure:
      scene_.apply(scene::SetPressure{0, {top()}, {100, 0}});
      return bends();
    case scene::Feature::displace:
      scene_.apply(scene::SetDisplacement{0, {top()}, {0, 0, 1}});
      return bends();
    case scene::Feature::grasp:
      scene_.apply(scene::SetInstrument{0, {3, {}, 0}, {{100, -50, 90}, {}}, "tongs"});
      scene_.apply(scene::Grasp{0, {top()}, 0});
      scene_.apply(scene::MoveInstrument{0, {100, -50, 91}, {}, 0});
      return bends();
    case scene::Feature::touch:
      scene_.apply(scene::SetInstrument{0, {5, {}, 0}, {{100, -50, 56}, {}}, "probe"});
      scene_.step(0.001);
      scene_.apply(scene::MoveInstrument{0, {100, -50, 53}, {}, 0.02});
      for (int k = 0; k < 20; ++k)
        scene_.step(0.001);
      return scene_.instrument(0).nodes > 0 && norm(scene_.instrument(0).force) > 0;
    case scene::Feature::cut:
      scene_.apply(scene::CutObject{0, is_solid(way_)            ? through()
                                       : way_ == scene::Way::cut ? lower_incision()
                                                                 : test::incision(model_)});
      return test::count(scene_, scene::Cutting::Kind::cut) == 1;
    case scene::Feature::blade:
      return sweep();
    case scene::Feature::tear:
      scene_.apply(scene::SetTear{0, 0.05});
      scene_.apply(is_solid(way_) ? scene::SetDisplacement{0, right_half(), {6, 0, 0}}
                                  : scene::SetDisplacement{0, {top()}, {0, 0, 6}});
      for (int k = 0; k < 4; ++k)
        scene_.step(0.001);
      return test::count(scene_, scene::Cutting::Kind::cut) > 0;
    case scene::Feature::restore:
      scene_.apply(scene::Restore{0});
      return test::count(scene_, scene::Cutting::Kind::restored) == 1;
    case scene::Feature::attach:
      scene_.apply(tie());
      scene_.apply(scene::SetForce{1, {top()}, {0, 0, 2000}});
      return bends();
    case scene::Feature::method: {
      const scene::Method other =
          scene_.object(0).method == scene::Method::ela ? scene::Method::ffe : scene::Method::ela;
      scene_.apply(scene::SetMethod{0, other});
      return scene_.object(0).method == other;
    }
    case scene::Feature::two_step:
      scene_.apply(two_step());
      scene_.apply(scene::SetForce{0, {top()}, {0, 0, 2000}});
      return bends();
    case scene::Feature::warp:
      scene_.apply(scene::SetWarp{0});
      scene_.apply(scene::SetForce{0, {top()}, {0, 0, 2000}});
      return bends();
    case scene::Feature::contact: // a node of the other one is brought into it from above
      scene_.apply(scene::SetContact{0, 1, 0});
      for (const Vec3& at : {Vec3{0, 0, 10}, Vec3{-100, 0, 10}, Vec3{-100, 0, -1}}) {
        scene_.apply(scene::SetDisplacement{1, {top()}, at, 0.02});
        for (int k = 0; k < 4; ++k)
          scene_.step(0.005);
      }
      return bends() && !scene_.contact_forces(0).empty();
    case scene::Feature::self_contact:
      scene_.apply(scene::SetContact{0, 0, 0});
      scene_.apply(scene::SetForce{0, {top()}, {0, 0, 2000}});
      return bends();
    case scene::Feature::prepare:
      scene_.apply(scene::Prepare{.object = 0, .contact = true, .cut = false, .nodes_ahead = {}});
      scene_.apply(scene::SetForce{0, {top()}, {0, 0, 2000}});
      return bends();
    }
    return false;
  }

private:
  std::uint32_t top() const { return test::highest(model_); }
  std::vector<std::uint32_t> right_half() const {
    std::vector<std::uint32_t> nodes;
    for (std::uint32_t i = 0; i < model_.nodes.size(); ++i)
      if (model_.nodes[i].position.x > 101 && model_.nodes[i].fixed == model::fixed_none)
        nodes.push_back(i);
    return nodes;
  }
  // Weak, so that it does not throw about what the node of the other one goes past.
  scene::Attach tie() const { return {0, {top()}, 1, {top()}, 100}; }
  scene::SetTwoStep two_step() const {
    if (way_ == scene::Way::two_step)
      return {0, {.threshold = 1}, {}, std::make_shared<const model::Model>(stiffer(model_))};
    return {0, {.threshold = 1}, [model = stiffer(model_)] {
              return compliance::compliance_of_factor(
                  [model] { return linalg::Factor(fem::stiffness_matrix(model), Context{}); });
            }};
  }
  static scene::PlaneToCut through() { return {{{100.2, -50, 30}, {1, 0.1, 0}}, {}}; }
  scene::PlaneToCut lower_incision() const {
    scene::PlaneToCut cut{{{100.2, -50, 30}, {0.1, 1, 0}}, std::vector<std::uint32_t>{}};
    const model::Model& now = scene_.model(0);
    for (std::uint32_t i = 0; i < model::surface_count(now); ++i)
      if (now.nodes[i].position.z > 40)
        cut.nodes->push_back(i);
    return cut;
  }
  bool bends() {
    for (int k = 0; k < 3; ++k)
      scene_.step(0.005);
    double max = 0;
    for (const double u : scene_.displacement(0))
      max = test::larger(max, std::abs(u));
    return max > 0;
  }
  bool sweep() {
    contact::InstrumentShape edge;
    edge.radius = 0;
    edge.blade = true;
    edge.axis = {0, 0, is_solid(way_) ? -80.0 : -8.0}; // solids are cut through
    const double away = is_solid(way_) ? 40 : 12;
    scene_.apply(scene::SetInstrument{0, edge, {{100 - away, -50.3, 53}, {}}, "blade"});
    scene_.step(0);
    scene_.apply(scene::MoveInstrument{0, {100 + away, -50.3, 53}, {}, 0.01});
    for (int k = 0; k < 10; ++k)
      scene_.step(0.001);
    std::set<std::size_t> cut;
    for (const scene::Cutting& c : scene_.news().cuttings)
      cut.insert(c.object);
    return cut.contains(0);
  }

  model::Model model_;
  scene::Way way_;
  scene::Simulation scene_;
};

TEST(Support, EveryPairWorksOrIsRefusedByItsWords) {
  for (const scene::Way way : scene::all_ways)
    for (const scene::Feature feature : scene::all_features) {
      SCOPED_TRACE("way " + std::to_string(static_cast<int>(way)) + ", feature " +
                   std::to_string(static_cast<int>(feature)));
      std::vector<std::string> warnings;
      Pair pair(way, warnings);
      warnings.clear();
      const scene::Gap* const gap = expected(way, feature);
      std::string text = gap != nullptr ? "object o " + std::string(gap->text) : "";
      if (const std::size_t at = text.find('*'); at != std::string::npos)
        text.replace(at, 1, "p");
      if (gap == nullptr) {
        EXPECT_TRUE(pair.works(feature));
      } else if (gap->refused) {
        try {
          (void)pair.works(feature);
          ADD_FAILURE() << "it is not refused: " << text;
        } catch (const Error& error) {
          EXPECT_EQ(error.what(), text);
        }
      } else {
        EXPECT_FALSE(pair.works(feature));
        EXPECT_EQ(std::count(warnings.begin(), warnings.end(), text), 1) << text;
      }
    }
}

TEST(Support, TheTableNamesEachPairOnceAndEachGapIsReached) {
  std::set<std::pair<scene::Way, scene::Feature>> named;
  for (const scene::Gap& one : scene::gaps) {
    EXPECT_TRUE(named.emplace(one.way, one.feature).second);
    EXPECT_FALSE(one.text.empty());
    bool reached = false;
    for (const scene::Way way : scene::all_ways)
      reached = reached || expected(way, one.feature) == &one;
    EXPECT_TRUE(reached) << one.text;
  }
}

} // namespace
} // namespace gewebe::test
