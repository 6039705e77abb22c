#include "contact_checks.h"
#include "dynamics/dynamic_contact.h"
#include "dynamics/elastodynamic.h"
#include "sim_models.h"
#include "statics/elastostatic.h"
#include "statics/static_contact.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>

namespace gewebe {
namespace {

const Vec3 middle{100, -50, 30}; // of the organ, a ball of radius 20

Vec3 place(const Model& model, std::span<const double> u, std::size_t i) {
  return model.nodes[i].position + Vec3{u[3 * i], u[3 * i + 1], u[3 * i + 2]};
}

TEST(StaticContact, PushesAlongTheNormalAndNoFurther) {
  const Model model = test::organ(4);
  Elastostatic solver(model, {}, Context{});
  std::vector<double> u(3 * model.nodes.size());
  StaticContact contact(model, u);
  Pose before{middle + Vec3{0.3, 0.2, 28.5}, {}};
  for (const double friction : {0.0, 0.3})
    for (const double z : {27.0, 25.0, 26.0}) {
      const InstrumentShape shape{8, {}, friction};
      const Pose now{middle + Vec3{0.3 + friction, 0.2, z}, {}};
      const std::vector<std::optional<MovedInstrument>> moved{MovedInstrument{shape, before, now}};
      contact.update([&]() -> Elastostatic& { return solver; }, {}, moved, u);
      before = now;
      const PlacedInstrument placed(shape, now);
      EXPECT_TRUE(contact.solved());
      EXPECT_LT(test::surface_depth(model, u, placed), 1e-6);
      EXPECT_GT(test::surface_depth(model, u, PlacedInstrument({8.1, {}, 0}, now)),
                1e-3); // it would show
      ASSERT_GT(contact.points().size(), 2U);
      std::vector<NodeTouch> sums;
      for (const PointTouch& t : contact.points()) {
        Vec3 p;
        for (std::size_t c = 0; c < 3; ++c) {
          p += t.weights[c] * place(model, u, t.nodes[c]);
          if (t.weights[c] > 0)
            sums.push_back({t.nodes[c], t.instrument, t.weights[c] * t.force});
        }
        EXPECT_NEAR(placed.distance(p), 0, 1e-6 * placed.radius); // f g = 0
        const Vec3 n = placed.normal(p);
        const double push = dot(t.force, n), drag = norm(t.force - push * n);
        EXPECT_GT(push, 0);
        EXPECT_LE(drag, friction * push + 1e-6 * norm(t.force));
      }
      EXPECT_EQ(sums_of_touches(sums), contact.touches());
    }
  contact.update([&]() -> Elastostatic& { return solver; }, {}, {}, u); // gone
  EXPECT_TRUE(contact.touches().empty());
  for (const double x : u)
    EXPECT_LT(std::abs(x), 1e-9);
}

/// What pushed before shortens the search for what pushes now; it does not change what that is.
TEST(StaticContact, GoesOnWithTheLastForcesOnShortWays) {
  const Model model = test::organ(4);
  Elastostatic solver(model, {}, Context{});
  const auto object = [&]() -> Elastostatic& { return solver; };
  for (const double friction : {0.0, 0.3}) {
    const InstrumentShape shape{8, {}, friction};
    std::vector<double> u(3 * model.nodes.size());
    StaticContact following(model, u);
    TouchCounts going, anew;
    for (int step = 0; step < 30; ++step) {
      const auto pose = [&](int n) { // and back from the last but nine
        const double way = n < 21 ? n : 40 - n;
        return Pose{middle + Vec3{0.3 + 0.04 * way, 0.2, 27 - 0.02 * way}, {}};
      };
      const std::vector<std::optional<MovedInstrument>> moved{
          MovedInstrument{shape, pose(std::max(0, step - 1)), pose(step)}};
      std::vector<double> v = u, w = u;
      StaticContact other(model, u, following.touches()),
          restored(model, u, following.touches(), following.points());
      following.update(object, {}, moved, u);
      other.update(object, {}, moved, v);
      restored.update(object, {}, moved, w);
      EXPECT_EQ(following.touches(), restored.touches());
      EXPECT_EQ(u, w);
      ASSERT_TRUE(following.solved() && other.solved()) << friction << " " << step;
      going.add(following.take_counts());
      anew.add(other.take_counts());
      EXPECT_LT(test::surface_depth(model, u, PlacedInstrument(shape, pose(step))), 8e-9);
      Vec3 sum, difference;
      for (const NodeTouch& t : following.touches()) {
        sum += t.force;
        difference += t.force;
      }
      for (const NodeTouch& t : other.touches())
        difference = difference - t.force;
      EXPECT_LE(norm(difference), 1e-7 * norm(sum)) << friction << " " << step;
      for (std::size_t r = 0; r < u.size(); ++r)
        ASSERT_NEAR(u[r], v[r], 1e-8) << friction << " " << step;
    }
    // Less than 0.64 and 0.73; without the places and forces that go on, 0.81 and 0.92.
    EXPECT_LT(static_cast<double>(going.turns), 0.76 * static_cast<double>(anew.turns)) << friction;
    EXPECT_LT(going.change, 1e-9);
  }
}

TEST(DynamicContact, KeepsMovingNodesOutAndBalancesThemAtRest) {
  const Model model = test::organ(3);
  Elastodynamic moving(model);
  const InstrumentShape shape{8, {}, 0};
  const Pose start{middle + Vec3{0.3, 0.2, 28.5}, {}}, end{middle + Vec3{0.3, 0.2, 26.5}, {}};
  const auto displacement = [&] {
    std::vector<double> u;
    for (const NodeMotion& m : moving.motion())
      u.insert(u.end(), {m.displacement.x, m.displacement.y, m.displacement.z});
    return u;
  };
  const double h = 0.9 * safe_step(model);
  Pose before = start;
  const PoseWay way{start, end, 0, 0.2};
  for (int k = 0; k < 40; ++k) {
    const double time = 0.01 * k;
    moving.set_instruments({MovingInstrument{shape, before, way}});
    moving.wake();
    moving.advance(0.01, h, Context{}, time);
    before = way.at(time + 0.01);
    EXPECT_LT(test::surface_depth(model, displacement(), PlacedInstrument(shape, before)), 1e-6)
        << k;
    for (const NodeTouch& t : moving.take_impulses()) {
      const Vec3 at = model.nodes[t.node].position + moving.motion()[t.node].displacement;
      EXPECT_GT(dot(t.force, at - before.place), 0); // never pulls
    }
  }
  // At rest the instrument's force is what the springs hold against.
  moving.set_instruments({MovingInstrument{shape, before, way}});
  moving.advance(20, h, Context{}, 0.4);
  (void)moving.take_impulses();
  moving.advance(0.5, h, Context{}, 20.4);
  const SpringNetwork network = spring_network(model);
  const std::vector<NodeTouch> touches = moving.take_impulses();
  EXPECT_FALSE(touches.empty());
  for (const NodeTouch& t : touches) {
    const Vec3 pull = spring_force(network, moving.motion(), t.node);
    EXPECT_LT(norm(t.force / 0.5 + pull), 1e-3 * norm(pull));
  }
}

} // namespace
} // namespace gewebe
