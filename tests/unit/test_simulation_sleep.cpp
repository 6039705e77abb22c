// What rests costs nothing, however much else moves in its scene: counted, not timed.

#include "fem/solid_model.h"
#include "geometry/vector_at.h"
#include "scene/simulation.h"
#include "sim_models.h"
#include "simulation_scenes.h"
#include "tet_fixtures.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace gewebe::test {
namespace {

using test::one_thread, test::organ, test::settle, test::shape;

constexpr double apart = 100; // mm
constexpr std::uint64_t steps = 5;

model::Model beside(model::Model model, std::size_t number) {
  for (model::Node& node : model.nodes)
    node.position.y += apart * static_cast<double>(number);
  return model;
}

/// 16 × 8 × 8 mm along x, held at x = 0.
model::Model block(bool quadratic) {
  fem::SolidModelOptions options;
  options.material.materials = {{"gel", 1e-3, 2e4, 1, 0.2, 0.4}};
  options.quadratic = quadratic;
  model::Model model = fem::solid_model(test::box_tetrahedra(2, 1, 1, 8), options, {});
  for (model::Node& node : model.nodes)
    if (node.position.x == 0)
      node.fixed = model::fixed_all;
  return model;
}

/// Solids of both laws, nets by implicit and by explicit steps, side by side; all rest under their
/// weight.
struct Side {
  scene::Simulation scene{one_thread(), {}};
  std::vector<std::uint32_t> node; ///< of each, one that can move

  Side() {
    const auto add = [&](model::Model model, scene::Integration integration,
                         const integrator::SolidChoice& choice) {
      const std::size_t number = node.size();
      std::uint32_t top = 0;
      for (std::uint32_t i = 0; i < model::surface_count(model); ++i)
        if (model.nodes[i].fixed == model::fixed_none &&
            (model.nodes[top].fixed != model::fixed_none ||
             model.nodes[i].position.x > model.nodes[top].position.x))
          top = i;
      node.push_back(top);
      scene.add_object(std::to_string(number), beside(std::move(model), number), scene::Method::ela,
                       {}, integration, choice);
    };
    integrator::SolidChoice choice;
    choice.damping = integrator::damping_per_stiffness(0.5, 20);
    add(block(true), scene::Integration::semi_implicit, choice);
    add(organ(1), scene::Integration::implicit, {});
    choice.law = integrator::SolidLaw::hyperelastic;
    add(block(false), scene::Integration::semi_implicit, choice);
    add(organ(1), scene::Integration::semi_implicit, {});
    add(organ(1), scene::Integration::implicit, {});
    choice.law = integrator::SolidLaw::corotational;
    add(block(false), scene::Integration::semi_implicit, choice);
    scene.apply(scene::SetTimestep{0.02});
    scene.apply(scene::SetGravity{{0, 0, -981}});
    settle(scene);
  }
  std::size_t size() const { return node.size(); }
  void push(std::size_t object) {
    scene.apply(scene::SetForce{object, {node[object]}, {0, 0, 60}});
  }
  /// What `steps` steps cost.
  scene::SimulationCounts cost() {
    const scene::SimulationCounts before = scene.counts();
    for (std::uint64_t k = 0; k < steps; ++k)
      scene.step(0.02);
    scene::SimulationCounts counts = scene.counts();
    counts.integration -= before.integration;
    counts.resting -= before.resting;
    counts.moving -= before.moving;
    counts.solids.steps -= before.solids.steps;
    counts.solids.rounds -= before.solids.rounds;
    counts.solids.factors -= before.solids.factors;
    return counts;
  }
};

TEST(SimulationSleep, OnlyWhatIsDisturbedIsPaidFor) {
  Side all;
  std::uint64_t rounds = 0, explicit_steps = 0;
  for (std::size_t object = 0; object < all.size(); ++object) {
    std::vector<std::vector<double>> shapes;
    for (std::size_t k = 0; k < all.size(); ++k)
      shapes.push_back(shape(all.scene, k));
    all.push(object);
    const scene::SimulationCounts paid = all.cost();
    const bool by_solids = object != 3;
    EXPECT_EQ(paid.moving, steps) << object;
    EXPECT_EQ(paid.resting, steps * (all.size() - 1)) << object;
    EXPECT_EQ(paid.solids.steps, by_solids ? steps : 0) << object;
    EXPECT_EQ(paid.solids.factors, 0U) << object;
    EXPECT_EQ(paid.solids.rounds > 0, by_solids) << object;
    EXPECT_EQ(paid.integration == paid.solids.steps, by_solids) << object;
    for (std::size_t k = 0; k < all.size(); ++k)
      EXPECT_EQ(shape(all.scene, k) == shapes[k], k != object) << object << " moves " << k;
    rounds += paid.solids.rounds;
    explicit_steps += by_solids ? 0 : paid.integration;
    all.scene.apply(scene::Release{object, {all.node[object]}});
    settle(all.scene);
  }
  // All at once cost what each did by itself.
  for (std::size_t object = 0; object < all.size(); ++object)
    all.push(object);
  const scene::SimulationCounts paid = all.cost();
  EXPECT_EQ(paid.moving, steps * all.size());
  EXPECT_EQ(paid.resting, 0U);
  EXPECT_EQ(paid.solids.steps, steps * (all.size() - 1));
  EXPECT_EQ(paid.integration, steps * (all.size() - 1) + explicit_steps);
  EXPECT_GT(2 * paid.solids.rounds, rounds);
}

TEST(SimulationSleep, AnInstrumentWakesWhatItTouchesAlone) {
  Side all;
  const auto over = [&](std::size_t object, double above) {
    Vec3 place = all.scene.model(object).nodes[all.node[object]].position +
                 vector_at(shape(all.scene, object), all.node[object]);
    place.x += 3 + above;
    return place;
  };
  const auto paid_for = [&] {
    const scene::SimulationCounts paid = all.cost();
    EXPECT_EQ(paid.moving + paid.resting, steps * all.size());
    return paid.moving;
  };
  all.scene.apply(scene::SetInstrument{0, {3, {}, 0}, {over(0, 50), {}}, "p"});
  all.scene.apply(scene::SetInstrument{1, {3, {}, 0}, {over(4, 50), {}}, "q"});
  EXPECT_EQ(paid_for(), 0U);
  all.scene.apply(scene::MoveInstrument{0, over(0, -1), {}, 0.05});
  EXPECT_LE(paid_for(), steps);
  settle(all.scene);
  EXPECT_GT(norm(all.scene.instrument(0).force), 1);
  // What the first one touches sleeps on, whatever another does.
  all.scene.apply(scene::MoveInstrument{1, over(4, 40), {}, 0.05});
  EXPECT_EQ(paid_for(), 0U);
  EXPECT_GT(norm(all.scene.instrument(0).force), 1);
  all.scene.apply(scene::MoveInstrument{0, over(0, 50), {}, 0.05});
  EXPECT_EQ(paid_for(), steps);
}

} // namespace
} // namespace gewebe::test
