// Instruments that are convex meshes, by both methods.

#include "contact/convex_core.h"
#include "contact/instrument_surface.h"
#include "contact_checks.h"
#include "convex_meshes.h"
#include "larger.h"
#include "mesh_fixtures.h"
#include "scene/simulation.h"
#include "sim_models.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace gewebe::test {
namespace {

using test::organ;

/// The organ of the tests is a ball of radius 20 about this.
const Vec3 middle{100, -50, 30};
const contact::Quaternion askew = contact::unit({0.8, 0.3, -0.5, 0.1});

contact::InstrumentShape shape_of(const TriangleMesh& mesh, double radius, double friction = 0) {
  contact::InstrumentShape shape{radius, {}, friction};
  shape.core = std::make_shared<const contact::ConvexCore>(mesh);
  return shape;
}

/// A jaw: a box with its middle in the origin.
contact::InstrumentShape jaw(double radius, double friction) {
  TriangleMesh box = test::divided_box({9, 4, 2}, 3);
  for (Vec3& p : box.points)
    p -= {4.5, 2, 1};
  return shape_of(box, radius, friction);
}

struct Felt {
  Vec3 force, torque;
};

Felt pressed(const contact::InstrumentShape& shape, const contact::Pose& pose, scene::Method method,
             scene::Integration integration = scene::Integration::semi_implicit) {
  scene::Simulation s(test::one_thread(), {});
  s.add_object("o", organ(3), method, {}, integration);
  s.apply(scene::SetInstrument{0, shape, {pose.place + Vec3{0, 0, 5}, pose.turn}});
  for (int k = 4; k >= 0; --k) {
    s.apply(scene::MoveInstrument{0, pose.place + Vec3{0, 0, 1.0 * k}, {}, 0.05});
    s.step(0.05);
  }
  s.step(0.1);
  const scene::InstrumentReport tool = s.instrument(0);
  return {tool.force, tool.torque};
}

TEST(MeshInstrument, ARefinedMeshHasTheForcesOfTheSphereAndTheCapsule) {
  const double whole = 8, radius = 1.5;
  const int turns = 4; // of the mesh: where its corners are is chance
  for (const bool capsule : {false, true}) {
    const Vec3 axis = capsule ? Vec3{9, 3, 1} : Vec3{};
    const contact::Pose pose{middle + Vec3{0.3, 0.2, 26} - 0.5 * axis, {}};
    const Felt exact = pressed({whole, axis, 0.2}, pose, scene::Method::ffe);
    std::vector<double> push, all; // what is missing of the push, and of the force
    for (const unsigned k : {1U, 2U, 3U}) {
      push.push_back(0);
      all.push_back(0);
      for (int n = 0; n < turns; ++n) {
        TriangleMesh mesh;
        if (capsule) {
          contact::InstrumentSurface round =
              contact::round_surface(whole - radius, axis, std::size_t{4} << k);
          mesh.points = std::move(round.points);
          mesh.triangles = std::move(round.triangles);
        } else {
          mesh = test::sphere_mesh(static_cast<int>(k), whole - radius, {});
        }
        const contact::Quaternion turn =
            capsule ? contact::turn_about(axis, 13.7 * n)
                    : contact::unit({0.8, 0.3 + 0.31 * n, 0.7 * n - 0.5, 0.1});
        for (Vec3& p : mesh.points)
          p = contact::rotated(turn, p);
        const Felt found = pressed(shape_of(mesh, radius, 0.2), pose, scene::Method::ffe);
        push.back() += (exact.force.z - found.force.z) / exact.force.z / turns;
        all.back() += norm(exact.force - found.force) / norm(exact.force) / turns;
      }
    }
    // The push is of second order in the length of an edge, as the gap to the round surface; where
    // it acts, and with that its direction, of first.
    EXPECT_LT(push[0], 0.3) << capsule;
    EXPECT_LT(std::abs(push[1]), 0.5 * push[0]) << capsule;
    EXPECT_LT(std::abs(push[2]), 0.15 * push[0]) << capsule;
    EXPECT_LT(std::abs(push[2]), 0.02) << capsule;
    EXPECT_LT(all[2], 0.25 * all[0]) << capsule;
    RecordProperty(capsule ? "capsule" : "sphere", std::to_string(push[0]) + " " +
                                                       std::to_string(push[1]) + " " +
                                                       std::to_string(push[2]));
  }
}

TEST(MeshInstrument, ItIsKeptOutAndWhatItFeelsIsWhatItDoes) {
  for (const auto& [method, integration] :
       {std::pair(scene::Method::ffe, scene::Integration::semi_implicit),
        std::pair(scene::Method::ela, scene::Integration::semi_implicit),
        std::pair(scene::Method::ela, scene::Integration::implicit)})
    for (const double friction : {0.0, 0.4}) {
      scene::Simulation s(test::one_thread(), {});
      s.add_object("o", organ(3), method, {}, integration);
      const contact::InstrumentShape shape = jaw(0.5, friction);
      const Vec3 start = middle + Vec3{0.3, 0.2, 26};
      s.apply(scene::SetInstrument{0, shape, {start, askew}});
      bool touched = false;
      const auto step = [&](const Vec3& to, const contact::Quaternion& turn) {
        s.apply(scene::MoveInstrument{0, to, turn, 0.02});
        s.step(0.02);
        const scene::InstrumentReport tool = s.instrument(0);
        EXPECT_LT(test::surface_depth(s.model(0), s.displacement(0), shape, tool.pose),
                  test::depth_allowed);
        Vec3 sum;
        double size = 0;
        for (const contact::NodeVector& f : s.contact_forces(0)) {
          sum += f.value;
          size += norm(f.value);
        }
        EXPECT_LE(norm(tool.force + sum), 1e-12 * size);
        EXPECT_GE(tool.force.z, 0); // pushed out
        touched = touched || norm(tool.force) > 0;
      };
      for (int k = 1; k <= 6; ++k)
        step(start - Vec3{0, 0, 0.7 * k}, askew);
      for (int k = 1; k <= 4; ++k)
        step(start + Vec3{0.4 * k, 0, -4.2}, contact::unit({0.8, 0.3 + 0.05 * k, -0.5, 0.1}));
      EXPECT_TRUE(touched);
      s.apply(scene::MoveInstrument{0, start + Vec3{0, 0, 30}, {}, 0.02});
      s.step(0.02);
      s.step(0.02);
      EXPECT_EQ(s.instrument(0).force, Vec3{});
    }
}

TEST(MeshInstrument, SlidAlongItsForceIsContinuous) {
  const model::Model model = organ(3);
  double edges = 0;
  for (const Triangle& t : model.triangles)
    for (std::size_t k = 0; k < 3; ++k)
      edges += norm(model.nodes[t[k]].position - model.nodes[t[(k + 1) % 3]].position);
  const double edge = edges / (3 * static_cast<double>(model.triangles.size()));
  // Rounded by half an edge; and all but sharp, so that a turn may lead into it.
  for (const auto& way : {std::array{0.5 * edge, 0.04, 0.0}, std::array{0.5 * edge, 0.04, 0.3},
                          std::array{0.1, 0.02, 0.0}}) {
    const double radius = way[0], along = way[1], friction = way[2];
    const contact::InstrumentShape shape = jaw(radius, friction);
    scene::Simulation s(test::one_thread(), {});
    s.add_object("o", model, scene::Method::ffe);
    s.apply(scene::SetInstrument{0, shape, {middle + Vec3{-1.5, 0.3, 30}, askew}});
    s.step(0.01);
    double before = HUGE_VAL, jump = 0, depth = 0;
    const auto go = [&](const Vec3& to, bool judged) {
      s.apply(scene::MoveInstrument{0, to, {}, 0});
      s.step(0.01);
      depth = test::larger(
          depth, test::surface_depth(model, s.displacement(0), shape, s.instrument(0).pose));
      const Vec3 sum = s.instrument(0).force;
      EXPECT_GE(sum.z, 0);
      if (judged && before < HUGE_VAL)
        jump = test::larger(jump, std::abs(sum.z - before) / std::min(sum.z, before));
      before = sum.z;
    };
    for (double z = 30; z > 23.2; z -= 2.5 * along)
      go(middle + Vec3{-1.5, 0.3, z}, false);
    EXPECT_GT(before, 0);
    go(middle + Vec3{-1.5, 0.15, 23.2}, false);
    for (double x = -1.5; x < 1.5; x += along)
      go(middle + Vec3{x, 0.3 + 0.1 * x, 23.2}, true);
    EXPECT_LT(depth, test::depth_allowed);
    if (radius > 0.2 * edge) {
      EXPECT_LT(jump, 0.02) << friction;
    }
    RecordProperty("jump", std::to_string(jump));
  }
}

TEST(MeshInstrument, NoWorkIsLeftOverAClosedWay) {
  const contact::InstrumentShape shape = jaw(0.8, 0);
  std::vector<double> left;
  for (const int steps : {20, 40, 80}) {
    scene::Simulation s(test::one_thread(), {});
    s.add_object("o", organ(2), scene::Method::ffe);
    const auto pose = [&](int k) {
      const double angle = 2 * 3.14159265358979323846 * k / steps;
      return contact::Pose{
          middle +
              Vec3{1.5 * std::sin(angle), 0.5 * std::sin(2 * angle), 22.5 + 1.2 * std::cos(angle)},
          contact::unit({0.8, 0.3 + 0.1 * std::sin(angle), -0.5 - 0.1 * std::cos(angle), 0.1})};
    };
    s.apply(scene::SetInstrument{0, shape, {pose(0).place + Vec3{0, 0, 9}, pose(0).turn}});
    s.step(0.01);
    Felt last;
    contact::Pose before;
    double work = 0, all = 0;
    for (int k = 0; k <= 2 * steps; ++k) {
      s.apply(scene::MoveInstrument{0, pose(k).place, pose(k).turn, 0});
      s.step(0.01);
      const scene::InstrumentReport tool = s.instrument(0);
      if (k > steps) { // the second time round
        // Of the mean force over the way, and of the mean torque over the turn.
        const contact::Quaternion &p = before.turn, &q = tool.pose.turn;
        const Vec3 from{p.x, p.y, p.z}, to{q.x, q.y, q.z};
        const Vec3 turn = 2 * (p.w * to - q.w * from + cross(from, to));
        const double one = 0.5 * (dot(last.force + tool.force, tool.pose.place - before.place) +
                                  dot(last.torque + tool.torque, turn));
        work += one;
        all += std::abs(one);
      }
      last = {tool.force, tool.torque};
      before = tool.pose;
    }
    ASSERT_GT(all, 0);
    left.push_back(std::abs(work) / all);
  }
  EXPECT_LT(left[0], 0.05);
  EXPECT_LT(left[2], 0.002);
  EXPECT_LT(left[2], 0.3 * left[0]);
}

TEST(MeshInstrument, AFastOneDoesNotPassThrough) {
  for (const scene::Method method : {scene::Method::ffe, scene::Method::ela}) {
    scene::Simulation s(test::one_thread(), {});
    s.add_object("o", organ(3), method);
    const contact::InstrumentShape shape = jaw(0.5, 0);
    s.apply(scene::SetInstrument{0, shape, {middle + Vec3{0.3, 0.2, 26}, askew}});
    s.step(0.01);
    s.apply(scene::MoveInstrument{0, middle + Vec3{0.3, 0.2, 20}, {}, 0});
    s.step(0.01);
    const scene::InstrumentReport tool = s.instrument(0);
    EXPECT_LT(test::surface_depth(s.model(0), s.displacement(0), shape, tool.pose),
              test::depth_allowed);
    EXPECT_GT(tool.force.z, 0);
  }
}

TEST(MeshInstrument, TheSameBytesForAnyNumberOfThreads) {
  std::vector<std::vector<double>> found;
  for (const int threads : {1, 3}) {
    Context context;
    context.threads = threads;
    scene::Simulation s(context, {});
    s.add_object("o", organ(3), scene::Method::ela);
    s.apply(scene::SetInstrument{0, jaw(0.5, 0.3), {middle + Vec3{0.3, 0.2, 26}, askew}});
    s.apply(scene::MoveInstrument{0, middle + Vec3{0.3, 0.2, 22}, {}, 0.02});
    s.step(0.02);
    const scene::InstrumentReport tool = s.instrument(0);
    found.emplace_back(s.displacement(0).begin(), s.displacement(0).end());
    for (const Vec3& v : {tool.force, tool.torque})
      found.back().insert(found.back().end(), {v.x, v.y, v.z});
  }
  EXPECT_EQ(found[0], found[1]);
}

} // namespace
} // namespace gewebe::test
