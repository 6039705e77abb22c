#include "base/error.h"
#include "fem/model_stiffness.h"
#include "larger.h"
#include "scene/simulation.h"
#include "sim_models.h"
#include "simulation_scenes.h"
#include "statics/two_step.h"

#include "compliance/compliance_source.h"
#include "tests/unit/relative_difference.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <random>
#include <span>
#include <string>
#include <vector>

namespace gewebe::test {
namespace {

using test::free_nodes, test::organ;

/// Every spring stiffer by a factor of its own between `from` and `to`.
model::Model stiffened(model::Model model, double from, double to) {
  std::mt19937 engine(7);
  for (model::Spring& s : model.springs)
    s.stiffness *= from + (to - from) * static_cast<double>(engine()) / 4294967296.0;
  return model;
}

std::shared_ptr<compliance::ComplianceSource> compliance_of(const model::Model& model) {
  return compliance::compliance_of_factor(
      [&model] { return linalg::Factor(fem::stiffness_matrix(model), Context{}); });
}

struct Stages {
  model::Model model, stiff;
  statics::Elastostatic first;
  statics::TwoStep two;

  Stages(model::Model one, model::Model other, const statics::TwoStepOptions& options)
      : model(std::move(one)), stiff(std::move(other)), first(model, {}, Context{}),
        two(model, compliance_of(stiff), Context{}, options) {}
  Stages(const Stages&) = delete;
  Stages& operator=(const Stages&) = delete;

  std::vector<double> shape(const contact::Load& load) {
    two.update(first, load);
    const std::span<const double> u = two.displacement(first);
    return {u.begin(), u.end()};
  }
};

std::vector<double> compliance_times(const model::Model& model, const contact::Load& load) {
  statics::Elastostatic object(model, {}, Context{});
  object.update(load);
  const std::span<const double> u = object.displacement();
  return {u.begin(), u.end()};
}

contact::Load times(double factor, const contact::Load& load) {
  contact::Load more = load;
  for (auto& [node, force] : more.force)
    force *= factor;
  more.gravity *= factor;
  return more;
}

std::vector<double> combined(double a, const std::vector<double>& x, double b,
                             const std::vector<double>& y) {
  std::vector<double> sum;
  for (std::size_t i = 0; i < x.size(); ++i)
    sum.push_back(a * x[i] + b * y[i]);
  return sum;
}

/// Forces on some nodes and weight, together of norm 1.
contact::Load unit_load(const model::Model& model) {
  contact::Load load{.gravity = {0, 100, -981}};
  const std::vector<std::uint32_t> nodes = free_nodes(model);
  for (std::size_t k = 0; k < 5; ++k)
    load.force[nodes[7 * k]] = {std::sin(1.0 + static_cast<double>(k)), 0.3, -0.2};
  load.force[nodes[3]] = {0, 2, 0};
  return times(1 / statics::load_norm(model, load), load);
}

Vec3 at(const std::vector<double>& u, std::size_t node) {
  return {u[3 * node], u[3 * node + 1], u[3 * node + 2]};
}

TEST(TwoStep, LoadNormCountsForcesAndWeightOfFreeAxes) {
  model::Model model = test::two_masses(2);
  model.nodes[0].fixed = model::fixed_all;
  model.nodes[1].fixed = model::fixed_y;
  contact::Load load;
  load.force[0] = {100, 100, 100};
  load.force[1] = {1, 50, -2};
  EXPECT_DOUBLE_EQ(statics::load_norm(model, load), std::sqrt(5.0));
  load.gravity = {1, 7, 3};
  EXPECT_DOUBLE_EQ(statics::load_norm(model, load), 5); // (1 + 2, -, -2 + 6)
}

// One spring: u = f/k up to f0, then the line of slope 1/k1 - 1/k2, or 1/k2 in series.
TEST(TwoStep, OneSpringFollowsFigure3_10) {
  for (const bool series : {false, true}) {
    model::Model soft = test::two_masses();
    soft.nodes[0].fixed = model::fixed_all;
    soft.nodes[1].fixed = model::fixed_y | model::fixed_z;
    model::Model stiff = soft;
    stiff.springs[0].stiffness = 4;
    Stages s(soft, stiff, {.threshold = 2, .series = series});
    const double slope = series ? 0.25 : 0.75;
    for (const double f : {0.0, 0.5, 1.0, 2.0, 2.5, 4.0, 100.0, -1.0, -3.0}) {
      const double size = std::abs(f);
      const double u = std::copysign(std::min(size, 2.0) + slope * std::max(0.0, size - 2), f);
      contact::Load pull;
      pull.force[1] = {f, 0, 0};
      EXPECT_NEAR(s.shape(pull)[3], u, 1e-14 * size) << f;
      contact::Load hold;
      hold.displacement[1] = {u, 0, 0};
      EXPECT_EQ(s.shape(hold)[3], u);
      ASSERT_EQ(s.two.contact_forces().size(), 1U);
      EXPECT_NEAR(s.two.contact_forces()[0].value.x, f, 1e-13 * size) << f;
      EXPECT_NEAR(s.two.load(), size, 1e-13 * size);
    }
    EXPECT_NEAR(s.two.largest(), 100, 1e-11);
  }
}

TEST(TwoStep, IsContinuousAndHasTheSlopesOfItsStages) {
  const model::Model model = organ(), stiff = stiffened(model, 3, 6);
  const contact::Load unit = unit_load(model);
  const double f0 = 50;
  const std::vector<double> c1 = compliance_times(model, unit), c2 = compliance_times(stiff, unit);
  for (const bool series : {false, true}) {
    Stages s(model, stiff, {.threshold = f0, .series = series});
    EXPECT_LT(
        test::relative_difference(s.shape(times(0.5 * f0, unit)), combined(0.5 * f0, c1, 0, c2)),
        1e-12);
    EXPECT_EQ(s.two.second_counts().factors, 0U) << "the second stage is not needed yet";
    const std::vector<double> below = s.shape(times(f0 * (1 - 1e-9), unit));
    const std::vector<double> above = s.shape(times(f0 * (1 + 1e-9), unit));
    EXPECT_LT(test::relative_difference(above, below), 1e-8);
    const std::vector<double> rise =
        combined(1, s.shape(times(3 * f0, unit)), -1, s.shape(times(2 * f0, unit)));
    EXPECT_LT(test::relative_difference(rise, series ? combined(0, c1, f0, c2)
                                                     : combined(f0, c1, -f0, c2)),
              1e-11);
    // The check sees another slope, and another threshold.
    EXPECT_GT(test::relative_difference(rise, combined(f0, c1, 0, c2)), 1e-3);
    Stages other(model, stiff, {.threshold = f0 * (1 + 1e-6), .series = series});
    EXPECT_GT(
        test::relative_difference(other.shape(times(2 * f0, unit)), s.shape(times(2 * f0, unit))),
        1e-8);
  }
}

TEST(TwoStep, DisplacementGivesBackThePointOfTheCurve) {
  const model::Model model = organ(), stiff = stiffened(model, 2, 5);
  const contact::Load unit = unit_load(model);
  const double f0 = 50;
  for (const bool series : {false, true})
    for (const double size : {0.3, 0.999, 1.0, 1.001, 1.5, 4.0, 30.0, 1e4}) {
      Stages s(model, stiff, {.threshold = f0, .series = series});
      const contact::Load given = times(size * f0, unit);
      const std::vector<double> u = s.shape(given);
      // The same with some of the nodes held where they are, the rest of the load as it was.
      contact::Load held = given;
      std::map<std::uint32_t, Vec3> force;
      int k = 0;
      for (const auto& [node, f] : given.force)
        if (++k % 3 != 0) {
          held.displacement[node] = at(u, node);
          force[node] = f;
          if (k == 1)
            force[node] = {}; // here the load stays as well, so that nothing more is needed
          else
            held.force.erase(node);
        }
      const std::vector<double> again = s.shape(held);
      EXPECT_LT(test::relative_difference(again, u), 1e-10) << series << " " << size;
      EXPECT_NEAR(s.two.load(), size * f0, 1e-10 * size * f0);
      double error = 0;
      ASSERT_EQ(s.two.contact_forces().size(), force.size());
      for (const contact::NodeVector& f : s.two.contact_forces()) {
        error = test::larger(error, norm(f.value - force.at(f.node)));
        EXPECT_EQ(at(again, f.node), held.displacement.at(f.node));
      }
      EXPECT_LT(error, 1e-10 * size * f0) << series << " " << size;
      // From a cached contact too, and back below the threshold.
      contact::Load nearer = held;
      for (auto& [node, d] : nearer.displacement)
        d *= 1.001;
      EXPECT_GT(test::relative_difference(s.shape(nearer), u), 1e-5);
      EXPECT_LT(test::relative_difference(s.shape(held), u), 1e-10);
      (void)s.shape({});
      EXPECT_EQ(s.two.load(), 0);
    }
}

TEST(TwoStep, HalfHeldNodesAreGraspedAlongTheirFreeAxes) {
  const model::Model model = organ(), stiff = stiffened(model, 2, 5);
  std::uint32_t half = 0, whole = 0;
  for (std::uint32_t i = 0; i < model::surface_count(model); ++i)
    (model.nodes[i].fixed == model::fixed_z     ? half
     : model.nodes[i].fixed == model::fixed_all ? whole
                                                : half) =
        model.nodes[i].fixed == model::fixed_none ? half : i;
  ASSERT_EQ(model.nodes[half].fixed, model::fixed_z);
  ASSERT_EQ(model.nodes[whole].fixed, model::fixed_all);
  Stages s(model, stiff, {.threshold = 1});
  contact::Load load;
  load.force[half] = {30, -40, 99};
  const std::vector<double> u = s.shape(load);
  EXPECT_DOUBLE_EQ(s.two.load(), 50);
  contact::Load held;
  held.displacement[half] = {at(u, half).x, at(u, half).y, 0};
  held.displacement[whole] = {};
  EXPECT_LT(test::relative_difference(s.shape(held), u), 1e-11);
  for (const contact::NodeVector& f : s.two.contact_forces())
    EXPECT_LT(norm(f.value - (f.node == half ? Vec3{30, -40, 0} : Vec3{})), 1e-9);
  // Nothing but what can't move: no force, no threshold.
  contact::Load nothing;
  nothing.displacement[whole] = {};
  EXPECT_EQ(s.shape(nothing), std::vector<double>(u.size(), 0.0));
}

TEST(TwoStep, RefusesAStageThatIsNotStiffer) {
  const model::Model model = organ();
  const model::Model mixed = stiffened(model, 0.2, 3);
  const std::uint32_t node = free_nodes(model)[4];
  contact::Load hold;
  hold.displacement[node] = {0, 0, 1};
  Stages s(model, mixed, {.threshold = 1e-3});
  std::string message;
  try {
    (void)s.shape(hold);
  } catch (const Error& error) {
    message = error.what();
  }
  EXPECT_NE(message.find("C1 - C2 is not positive definite"), std::string::npos) << message;
  EXPECT_NE(message.find("series"), std::string::npos) << message;
  // Under the threshold nothing of it is asked; in series any stage will do.
  s.two.set({.threshold = 1e12});
  EXPECT_EQ(at(s.shape(hold), node).z, 1);
  s.two.set({.threshold = 1e-3, .series = true});
  const std::vector<double> u = s.shape(hold);
  EXPECT_EQ(at(u, node).z, 1);
  contact::Load pull;
  pull.force[node] = s.two.contact_forces()[0].value;
  EXPECT_LT(test::relative_difference(s.shape(pull), u), 1e-10);
  for (const double bad : {0.0, -1.0, std::nan(""), HUGE_VAL})
    EXPECT_THROW(s.two.set({.threshold = bad}), Error);
}

TEST(TwoStep, RootIsFoundFarBeyondTheThreshold) {
  // Two blocks that share no eigenvectors, pulled along a poor direction.
  const std::vector<double> a1{4, 1, 1, 3}, a2{1.5, 0.9, 0.9, 1};
  for (const bool series : {false, true}) {
    const statics::TwoStepContact contact(a1, a2, 2, series);
    for (const double far : {1.0, 1e2, 1e6, 1e12}) {
      const std::vector<double> d{far, -far}, none{0, 0};
      const statics::TwoStepContact::Answer answer = contact.solve({d, none, none, none, 0, 1});
      const double f = std::hypot(answer.force[0], answer.force[1]);
      const double s = std::min(1.0, 1 / f);
      EXPECT_NEAR(answer.s, s, 1e-15);
      for (std::size_t i = 0; i < 2; ++i) {
        const double one = a1[i] * answer.force[0] + a1[2 + i] * answer.force[1],
                     two = a2[i] * answer.force[0] + a2[2 + i] * answer.force[1];
        EXPECT_NEAR(series ? s * one + (1 - s) * two : one - (1 - s) * two, d[i], 1e-13 * far);
      }
    }
  }
}

/// An organ pressed from above by a sphere, one of its nodes displaced.
struct Pressed {
  std::vector<double> u;
  std::vector<contact::NodeVector> forces;
  Vec3 tool;
};
Pressed pressed(const model::Model& model, const model::Model& stiff,
                std::optional<statics::TwoStepOptions> options, double friction, bool displaced) {
  scene::Simulation s(test::one_thread(),
                      {.warn = [](const std::string& text) { ADD_FAILURE() << text; }});
  s.add_object("o", model, scene::Method::ffe);
  if (options)
    s.apply(scene::SetTwoStep{0, *options, [&] { return compliance_of(stiff); }});
  if (displaced)
    s.apply(scene::SetDisplacement{0, {free_nodes(model)[2]}, {0.01, 0.02, 0}});
  const Vec3 start{100.3, -49.8, 58};
  s.apply(scene::SetInstrument{0, {8, {}, friction}, {start, {}}});
  s.apply(scene::MoveInstrument{0, start + Vec3{0.1, 0, -0.4}, {}, 0.2});
  for (int k = 0; k < 4; ++k)
    s.step(0.05);
  return {{s.displacement(0).begin(), s.displacement(0).end()},
          s.contact_forces(0),
          s.instrument(0).force};
}

/// Part of the largest to which forces of contact and those of the shape agree.
constexpr double forces_met = 4e-4;

TEST(TwoStep, BelowItsThresholdInstrumentsMeetOneStage) {
  const model::Model model = organ(), stiff = stiffened(model, 2, 5);
  for (const double friction : {0.0, 0.3})
    for (const bool displaced : {false, true}) {
      const Pressed one = pressed(model, stiff, {}, friction, displaced),
                    two = pressed(model, stiff, statics::TwoStepOptions{1e9, true}, friction,
                                  displaced);
      EXPECT_GT(norm(one.tool), 0);
      EXPECT_LT(test::relative_difference(one.u, two.u), forces_met);
      ASSERT_EQ(one.forces.size(), two.forces.size());
      for (std::size_t k = 0; k < one.forces.size(); ++k) {
        EXPECT_EQ(one.forces[k].node, two.forces[k].node);
        EXPECT_LT(norm(one.forces[k].value - two.forces[k].value), forces_met * norm(one.tool));
      }
    }
}

TEST(TwoStep, BeyondItInstrumentsMeetThePointOfTheCurve) {
  const model::Model model = organ(), stiff = stiffened(model, 2, 5);
  for (const bool series : {false, true})
    for (const double friction : {0.0, 0.3})
      for (const bool displaced : {false, true}) {
        const double reached = norm(pressed(model, stiff, {}, friction, displaced).tool);
        const statics::TwoStepOptions options{reached / 3, series};
        const Pressed one = pressed(model, stiff, {}, friction, displaced),
                      two = pressed(model, stiff, options, friction, displaced);
        EXPECT_GT(norm(two.tool - one.tool), 0.2 * norm(one.tool)); // it would show
        // The touched nodes displaced to where they are take the same forces.
        contact::Load load;
        double largest = 0;
        for (const contact::NodeVector& f : two.forces) {
          load.displacement[f.node] = at(two.u, f.node);
          largest = test::larger(largest, norm(f.value));
        }
        Stages stages(model, stiff, options);
        EXPECT_LT(test::relative_difference(stages.shape(load), two.u), forces_met);
        ASSERT_EQ(stages.two.contact_forces().size(), two.forces.size());
        for (std::size_t k = 0; k < two.forces.size(); ++k)
          EXPECT_LT(norm(stages.two.contact_forces()[k].value - two.forces[k].value),
                    forces_met * largest);
        if (friction > 0)
          continue;
        const Vec3 centre{100.4, -49.8, 57.6};
        for (const contact::NodeVector& f : two.forces) {
          const Vec3 n = model.nodes[f.node].position + at(two.u, f.node) - centre;
          if (f.node != free_nodes(model)[2]) {
            EXPECT_LT(norm(cross(f.value, n)), 1e-6 * norm(f.value) * norm(n));
          }
        }
      }
}

/// Its support carries what presses on it, beyond the threshold as below.
TEST(TwoStep, AnInstrumentPressesOnADisplacedNodeToo) {
  const model::Model model = organ(), stiff = stiffened(model, 2, 5);
  const auto middle = [&](const Triangle& t) {
    return (model.nodes[t[0]].position + model.nodes[t[1]].position + model.nodes[t[2]].position) /
           3;
  };
  const Triangle top = *std::max_element(
      model.triangles.begin(), model.triangles.end(),
      [&](const Triangle& a, const Triangle& b) { return middle(a).z < middle(b).z; });
  const Vec3 start = middle(top) + Vec3{0, 0, 2.1};
  const auto press = [&](std::optional<statics::TwoStepOptions> options, double friction) {
    scene::Simulation s(test::one_thread(),
                        {.warn = [](const std::string& text) { ADD_FAILURE() << text; }});
    s.add_object("o", model, scene::Method::ffe);
    if (options)
      s.apply(scene::SetTwoStep{0, *options, [&] { return compliance_of(stiff); }});
    s.apply(scene::SetDisplacement{0, {top[1]}, {0.02, 0, -0.03}});
    s.apply(scene::SetInstrument{0, {2, {}, friction}, {start, {}}});
    s.apply(scene::MoveInstrument{0, start - Vec3{0, 0, 0.4}, {}, 0.2});
    for (int k = 0; k < 4; ++k)
      s.step(0.05);
    EXPECT_EQ(s.instrument(0).nodes, 3U); // the displaced one among them
    return Pressed{{s.displacement(0).begin(), s.displacement(0).end()},
                   s.contact_forces(0),
                   s.instrument(0).force};
  };
  for (const bool series : {false, true})
    for (const double friction : {0.0, 0.3}) {
      const Pressed one = press({}, friction);
      const statics::TwoStepOptions options{norm(one.tool) / 3, series};
      const Pressed two = press(options, friction);
      EXPECT_GT(norm(two.tool - one.tool), 0.1 * norm(one.tool)); // it would show
      contact::Load load;
      double largest = 0;
      for (const contact::NodeVector& f : two.forces) {
        load.displacement[f.node] = at(two.u, f.node);
        largest = test::larger(largest, norm(f.value));
      }
      Stages stages(model, stiff, options);
      EXPECT_LT(test::relative_difference(stages.shape(load), two.u), forces_met);
      ASSERT_EQ(stages.two.contact_forces().size(), two.forces.size());
      for (std::size_t k = 0; k < two.forces.size(); ++k)
        EXPECT_LT(norm(stages.two.contact_forces()[k].value - two.forces[k].value),
                  forces_met * largest);
    }
}

/// All that a scene shows of its objects and the instrument.
struct Seen {
  double time = 0, strain = 0;
  std::size_t pending = 0, nodes = 0;
  std::vector<double> u;
  std::vector<contact::NodeVector> forces;
  Vec3 force, torque;

  bool operator==(const Seen&) const = default;
};
Seen seen(const scene::Simulation& s) {
  const scene::InstrumentReport tool = s.instrument(0);
  return {s.time(),          s.state().strain,    s.pending(), tool.nodes,
          test::shape(s, 0), s.contact_forces(0), tool.force,  tool.torque};
}

/// The step goes wrong when the object in contact has been through it: a second one that it shows
/// then has no stiffness.
TEST(TwoStep, AStepInContactThatFailsLeavesNoTrace) {
  const model::Model model = organ(), stiff = stiffened(model, 2, 5);
  model::Model away = model; // where no instrument is
  for (model::Node& node : away.nodes)
    node.position.x += 500;
  for (const bool series : {false, true})
    for (const double threshold : {5.0, 1e9})
      for (const double friction : {0.0, 0.3}) {
        std::vector<Seen> results[2];
        for (const bool fails : {false, true}) {
          scene::Simulation s(test::one_thread(), {.guard = true});
          s.add_object("o", model, scene::Method::ffe);
          s.add_object(
              "other",
              {.model = [&] { return away; },
               .stiffness = [](const model::Model&)
                   -> std::shared_ptr<compliance::ComplianceSource> { throw Error("broken"); }},
              scene::Method::ffe);
          s.apply(scene::SetTwoStep{0, {threshold, series}, [&] { return compliance_of(stiff); }});
          // Most forces stay, so that their answer is followed by increments.
          s.apply(scene::SetForce{0, free_nodes(model), {0, 0.03, 0.01}});
          s.apply(scene::SetForce{0, {free_nodes(model)[2]}, {0.3, 0.7, 0}, 0.37}); // pulses
          const Vec3 start{100.3, -49.8, 58};
          s.apply(scene::SetInstrument{0, {8, {}, friction}, {start, {}}});
          s.apply(scene::MoveInstrument{0, start + Vec3{0.1, 0, -0.4}, {}, 0.2});
          s.step(0.1);
          EXPECT_GT(s.instrument(0).nodes, 0U);
          EXPECT_EQ(norm(s.instrument(0).force) > threshold, threshold < 1e9);
          if (fails) {
            const Seen before = seen(s);
            s.apply(scene::SetForce{1, {free_nodes(model)[4]}, {0, 0, 1}});
            EXPECT_THROW(s.step(0.1), Error);
            EXPECT_EQ(seen(s), before);
            s.apply(scene::Release{1, {free_nodes(model)[4]}});
          }
          for (int k = 0; k < 3; ++k) {
            s.step(0.025);
            results[fails ? 1 : 0].push_back(seen(s));
          }
        }
        for (std::size_t k = 0; k < 3; ++k)
          EXPECT_EQ(results[0][k], results[1][k]) << series << threshold << friction << k;
      }
}

/// By two cuts, each of both stages for itself.
TEST(TwoStep, ACutObjectFollowsTheStagesOfTheCutModels) {
  const model::Model model = organ(3), stiff = stiffened(model, 2, 5);
  const std::uint32_t node = free_nodes(model)[2];
  for (const double threshold : {1.0, 1e9})
    for (const bool series : {false, true}) {
      const statics::TwoStepOptions options{threshold, series};
      scene::Simulation s(test::one_thread(), {});
      s.add_object("o", model, scene::Method::ffe);
      s.apply(scene::SetTwoStep{0, options, {}, std::make_shared<const model::Model>(stiff)});
      s.apply(scene::SetForce{0, {node}, {0, 3, 1}});
      s.step(0.1);
      const std::vector<double> whole = test::shape(s, 0);
      model::Model one = model, two = stiff;
      std::vector<double> before = whole;
      for (const Vec3& normal : {Vec3{1, 0.1, 0}, Vec3{0.1, 1, 0}}) {
        scene::PlaneToCut what{{{100.2, -50, 30}, normal}, std::vector<std::uint32_t>{}};
        for (std::uint32_t i = 0; i < model::surface_count(one); ++i)
          if (one.nodes[i].position.z > 40)
            what.nodes->push_back(i);
        const cutting::Cut cut = cutting::plane_cut(one, what.plane, *what.nodes);
        one = cutting::cut_model(one, cut).model;
        two = cutting::cut_model(two, cut).model;
        s.apply(scene::CutObject{0, what});
        s.step(0.1);
        Stages stages(one, two, options);
        contact::Load load;
        load.force[node] = {0, 3, 1};
        EXPECT_LT(test::relative_difference(test::shape(s, 0), stages.shape(load)), 1e-9);
        Stages uncut(one, one, {.threshold = 1e9}); // it would show
        if (threshold == 1) {
          EXPECT_GT(test::relative_difference(test::shape(s, 0), uncut.shape(load)), 1e-3);
        }
        EXPECT_NE(test::shape(s, 0), before);
        before = test::shape(s, 0);
      }
      s.apply(scene::SetTwoStep{0, {threshold * 0.9, series}, {}}); // of what is cut
      s.step(0.1);
      EXPECT_EQ(test::shape(s, 0) == before, threshold == 1e9);
      s.apply(scene::SetTwoStep{0, options, {}});
      s.apply(scene::Restore{0});
      s.step(0.1);
      EXPECT_LT(test::relative_difference(test::shape(s, 0), whole), 1e-12);
    }
}

TEST(TwoStep, WhatComesOffIsAsFastAsBelowTheThreshold) {
  const model::Model model = test::soft_organ();
  const std::uint32_t top = test::highest(model);
  std::vector<std::vector<double>> parts;
  for (const bool staged : {false, true}) {
    scene::Simulation s(test::one_thread(), {});
    s.add_object("o", model, scene::Method::ffe);
    if (staged)
      s.apply(scene::SetTwoStep{
          0, {1e9}, {}, std::make_shared<const model::Model>(stiffened(model, 2, 5))});
    for (const double z : {0.1, 0.2}) {
      s.apply(scene::SetDisplacement{0, {top}, {0, 0, z}});
      s.step(0.01);
    }
    s.apply(scene::Release{0, {top}});
    s.apply(test::lobe_off());
    s.step(0.001);
    ASSERT_EQ(s.object_count(), 2U);
    parts.push_back(test::shape(s, 1));
  }
  EXPECT_EQ(parts[0], parts[1]);
}

TEST(TwoStep, RefusesAnotherModelAsSecondStage) {
  const model::Model model = organ(2);
  model::Model other = model;
  other.nodes[3].position.x += 1;
  scene::Simulation s({}, {});
  s.add_object("o", model, scene::Method::ffe);
  for (const model::Model& wrong : {other, organ(3)})
    EXPECT_THROW(
        s.apply(scene::SetTwoStep{0, {1}, {}, std::make_shared<const model::Model>(wrong)}), Error);
}

TEST(TwoStep, InASimulationByEventsWithAWarning) {
  std::vector<std::string> warnings;
  const model::Model model = organ(), stiff = stiffened(model, 2, 5);
  scene::Simulation s({}, {.warn = [&](const std::string& text) { warnings.push_back(text); }});
  s.add_object("still", model, scene::Method::ffe);
  s.add_object("moving", model, scene::Method::ela);
  const std::uint32_t node = free_nodes(model)[2];
  const auto second = [&] { return compliance_of(stiff); };
  EXPECT_THROW(s.apply(scene::SetTwoStep{1, {.threshold = 1}, second}), Error);
  s.apply(scene::SetForce{0, {node}, {0, 3, 0}});
  s.schedule(0.5, scene::SetTwoStep{0, {.threshold = 1}, second});
  s.step(0.25);
  const std::vector<double> one(s.displacement(0).begin(), s.displacement(0).end());
  s.step(0.25);
  const std::vector<double> two(s.displacement(0).begin(), s.displacement(0).end());
  Stages stages(model, stiff, {.threshold = 1});
  contact::Load load;
  load.force[node] = {0, 3, 0};
  EXPECT_EQ(two, stages.shape(load));
  EXPECT_GT(test::relative_difference(two, one), 0.05);
  s.warn_of_thresholds();
  EXPECT_TRUE(warnings.empty());
  s.apply(scene::SetTwoStep{0, {.threshold = 10}, second});
  s.step(0.1);
  EXPECT_EQ(std::vector<double>(s.displacement(0).begin(), s.displacement(0).end()), one);
  for (int k = 0; k < 2; ++k)
    s.warn_of_thresholds();
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_NE(warnings[0].find("object still"), std::string::npos);
  EXPECT_NE(warnings[0].find("3 at most"), std::string::npos) << warnings[0];
}

} // namespace
} // namespace gewebe::test
