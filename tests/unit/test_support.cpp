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

namespace gewebe {
namespace {

bool is_solid(Way way) {
  return way == Way::solid || way == Way::warped || way == Way::strained ||
         way == Way::solid_motion || way == Way::sprung || way == Way::viscoelastic;
}

/// All that an object is which goes on this way, in these tests, but for what it consists of.
std::vector<Way> ways_of(Way way) {
  switch (way) {
  case Way::attached:
    return {Way::explicit_motion, Way::whole, Way::attached};
  case Way::two_step:
    return {Way::elastostatic, Way::whole, Way::two_step};
  case Way::two_step_stored:
    return {Way::elastostatic, Way::whole, Way::two_step, Way::two_step_stored};
  case Way::cut:
    return {Way::elastostatic, Way::cut};
  case Way::whole:
    return {Way::elastostatic, Way::whole};
  case Way::solid:
    return {Way::elastostatic, Way::whole};
  case Way::sprung:
    return {Way::elastostatic, Way::whole, Way::sprung};
  case Way::warped:
    return {Way::elastostatic, Way::whole, Way::warped};
  case Way::strained:
    return {Way::elastostatic, Way::whole, Way::strained};
  case Way::viscoelastic:
    return {Way::elastostatic, Way::whole, Way::strained, Way::viscoelastic};
  case Way::net:
    return {Way::elastostatic, Way::whole};
  case Way::filled:
    return {Way::implicit_motion, Way::whole, Way::filled};
  case Way::solid_motion:
    return {Way::explicit_motion, Way::whole, Way::solid_motion};
  default:
    return {way, Way::whole};
  }
}

const Gap* expected(Way way, Feature feature) {
  std::vector<Way> ways = ways_of(way);
  ways.push_back(is_solid(way) ? Way::solid : Way::net);
  for (const Gap& one : gaps)
    for (const Way is : ways)
      if (one.way == is && one.feature == feature)
        return &one;
  return nullptr;
}

Model stiffer(Model model) {
  for (Spring& s : model.springs)
    s.stiffness *= 3;
  return model;
}

/// Its surface filled with tetrahedra that meet in the middle.
Model solid(Model model) {
  model.springs.clear();
  model.materials[0].poisson = 0.4;
  const auto surface = static_cast<std::uint32_t>(surface_count(model));
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
  const std::vector<double> masses = solid_masses(element_mesh(model), element_materials(model));
  for (std::size_t i = 0; i < masses.size(); ++i) {
    model.nodes[i].mass = masses[i];
    model.nodes[i].drag = masses[i];
  }
  return model;
}

Model model_of(Way way) {
  Model model = is_solid(way) ? solid(test::organ(3)) : test::organ(3);
  if (way == Way::sprung) {
    const auto [i, j] = std::minmax(model.triangles[0][0], model.triangles[0][1]);
    model.springs = {{i, j, SpringKind::edge, 1, 0, 1}};
  }
  if (way == Way::viscoelastic)
    model.materials[0].prony = {{0.3, 0.01}};
  return model;
}

class Pair {
public:
  Pair(Way way, std::vector<std::string>& warnings)
      : model_(model_of(way)), way_(way),
        scene_(test::one_thread(), {.warn = [&](const std::string& t) { warnings.push_back(t); }}) {
    const bool moves = way == Way::explicit_motion || way == Way::implicit_motion ||
                       way == Way::attached || way == Way::solid_motion || way == Way::filled;
    const Integration integration = way == Way::implicit_motion || way == Way::filled
                                        ? Integration::implicit
                                        : Integration::semi_implicit;
    SolidChoice choice;
    if (way == Way::filled)
      choice.bulk = 1000;
    if (way == Way::strained || way == Way::viscoelastic)
      choice.law = SolidLaw::hyperelastic;
    scene_.add_object("o", model_, moves ? Method::ela : Method::ffe, {}, integration, choice);
    Model beside = test::organ(3);
    for (Node& n : beside.nodes)
      n.position.x += 100;
    scene_.add_object("p", std::move(beside), moves ? Method::ela : Method::ffe, {},
                      way == Way::solid_motion ? Integration::implicit : integration);
    if (way == Way::attached)
      scene_.apply(tie());
    if (way == Way::warped)
      scene_.apply(SetWarp{0});
    if (way == Way::two_step || way == Way::two_step_stored)
      scene_.apply(two_step());
    if (way == Way::cut) {
      scene_.apply(SetForce{0, {top()}, {0, 0, 1}});
      scene_.step(0.001);
      scene_.apply(CutObject{0, test::incision(model_)});
      scene_.apply(Release{0, {top()}});
      scene_.step(0.001);
      scene_.take_news();
    }
  }

  /// Does it to the object. \return whether it had its effect
  bool works(Feature feature) {
    switch (feature) {
    case Feature::force:
      scene_.apply(SetForce{0, {top()}, {0, 0, 2000}});
      return bends();
    case Feature::pressure:
      scene_.apply(SetPressure{0, {top()}, {100, 0}});
      return bends();
    case Feature::displace:
      scene_.apply(SetDisplacement{0, {top()}, {0, 0, 1}});
      return bends();
    case Feature::grasp:
      scene_.apply(SetInstrument{0, {3, {}, 0}, {{100, -50, 90}, {}}, "tongs"});
      scene_.apply(Grasp{0, {top()}, 0});
      scene_.apply(MoveInstrument{0, {100, -50, 91}, {}, 0});
      return bends();
    case Feature::touch:
      scene_.apply(SetInstrument{0, {5, {}, 0}, {{100, -50, 56}, {}}, "probe"});
      scene_.step(0.001);
      scene_.apply(MoveInstrument{0, {100, -50, 53}, {}, 0.02});
      for (int k = 0; k < 20; ++k)
        scene_.step(0.001);
      return scene_.instrument(0).nodes > 0 && norm(scene_.instrument(0).force) > 0;
    case Feature::cut:
      scene_.apply(CutObject{0, is_solid(way_)     ? through()
                                : way_ == Way::cut ? lower_incision()
                                                   : test::incision(model_)});
      return test::count(scene_, Cutting::Kind::cut) == 1;
    case Feature::blade:
      return sweep();
    case Feature::tear:
      scene_.apply(SetTear{0, 0.05});
      scene_.apply(is_solid(way_) ? SetDisplacement{0, right_half(), {6, 0, 0}}
                                  : SetDisplacement{0, {top()}, {0, 0, 6}});
      for (int k = 0; k < 4; ++k)
        scene_.step(0.001);
      return test::count(scene_, Cutting::Kind::cut) > 0;
    case Feature::restore:
      scene_.apply(Restore{0});
      return test::count(scene_, Cutting::Kind::restored) == 1;
    case Feature::attach:
      scene_.apply(tie());
      scene_.apply(SetForce{1, {top()}, {0, 0, 2000}});
      return bends();
    case Feature::method: {
      const Method other = scene_.object(0).method == Method::ela ? Method::ffe : Method::ela;
      scene_.apply(SetMethod{0, other});
      return scene_.object(0).method == other;
    }
    case Feature::two_step:
      scene_.apply(two_step());
      scene_.apply(SetForce{0, {top()}, {0, 0, 2000}});
      return bends();
    case Feature::warp:
      scene_.apply(SetWarp{0});
      scene_.apply(SetForce{0, {top()}, {0, 0, 2000}});
      return bends();
    case Feature::contact: // a node of the other one is brought into it from above
      scene_.apply(SetContact{0, 1, 0});
      for (const Vec3& at : {Vec3{0, 0, 10}, Vec3{-100, 0, 10}, Vec3{-100, 0, -1}}) {
        scene_.apply(SetDisplacement{1, {top()}, at, 0.02});
        for (int k = 0; k < 4; ++k)
          scene_.step(0.005);
      }
      return bends() && !scene_.contact_forces(0).empty();
    case Feature::self_contact:
      scene_.apply(SetContact{0, 0, 0});
      scene_.apply(SetForce{0, {top()}, {0, 0, 2000}});
      return bends();
    case Feature::prepare:
      scene_.apply(Prepare{.object = 0, .contact = true, .cut = false, .nodes_ahead = {}});
      scene_.apply(SetForce{0, {top()}, {0, 0, 2000}});
      return bends();
    }
    return false;
  }

private:
  std::uint32_t top() const { return test::highest(model_); }
  std::vector<std::uint32_t> right_half() const {
    std::vector<std::uint32_t> nodes;
    for (std::uint32_t i = 0; i < model_.nodes.size(); ++i)
      if (model_.nodes[i].position.x > 101 && model_.nodes[i].fixed == fixed_none)
        nodes.push_back(i);
    return nodes;
  }
  // Weak, so that it does not throw about what the node of the other one goes past.
  Attach tie() const { return {0, {top()}, 1, {top()}, 100}; }
  SetTwoStep two_step() const {
    if (way_ == Way::two_step)
      return {0, {.threshold = 1}, {}, std::make_shared<const Model>(stiffer(model_))};
    return {0, {.threshold = 1}, [model = stiffer(model_)] {
              return compliance_of_factor(
                  [model] { return Factor(stiffness_matrix(model), Context{}); });
            }};
  }
  static PlaneToCut through() { return {{{100.2, -50, 30}, {1, 0.1, 0}}, {}}; }
  PlaneToCut lower_incision() const {
    PlaneToCut cut{{{100.2, -50, 30}, {0.1, 1, 0}}, std::vector<std::uint32_t>{}};
    const Model& now = scene_.model(0);
    for (std::uint32_t i = 0; i < surface_count(now); ++i)
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
    InstrumentShape edge;
    edge.radius = 0;
    edge.blade = true;
    edge.axis = {0, 0, is_solid(way_) ? -80.0 : -8.0}; // solids are cut through
    const double away = is_solid(way_) ? 40 : 12;
    scene_.apply(SetInstrument{0, edge, {{100 - away, -50.3, 53}, {}}, "blade"});
    scene_.step(0);
    scene_.apply(MoveInstrument{0, {100 + away, -50.3, 53}, {}, 0.01});
    for (int k = 0; k < 10; ++k)
      scene_.step(0.001);
    std::set<std::size_t> cut;
    for (const Cutting& c : scene_.news().cuttings)
      cut.insert(c.object);
    return cut.contains(0);
  }

  Model model_;
  Way way_;
  Simulation scene_;
};

TEST(Support, EveryPairWorksOrIsRefusedByItsWords) {
  for (const Way way : all_ways)
    for (const Feature feature : all_features) {
      SCOPED_TRACE("way " + std::to_string(static_cast<int>(way)) + ", feature " +
                   std::to_string(static_cast<int>(feature)));
      std::vector<std::string> warnings;
      Pair pair(way, warnings);
      warnings.clear();
      const Gap* const gap = expected(way, feature);
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
  std::set<std::pair<Way, Feature>> named;
  for (const Gap& one : gaps) {
    EXPECT_TRUE(named.emplace(one.way, one.feature).second);
    EXPECT_FALSE(one.text.empty());
    bool reached = false;
    for (const Way way : all_ways)
      reached = reached || expected(way, one.feature) == &one;
    EXPECT_TRUE(reached) << one.text;
  }
}

} // namespace
} // namespace gewebe
