// Shapes that instruments look at in part, as nobody else asks for them.

#include "base/error.h"
#include "columns/column_compression.h"
#include "columns/compliance_columns.h"
#include "compliance/compliance_source.h"
#include "fem/model_stiffness.h"
#include "geometry/vector_at.h"
#include "linalg/condition.h"
#include "linalg/factor.h"
#include "scene/simulation.h"
#include "sim_models.h"
#include "statics/elastostatic.h"
#include "stiffness_models.h"

#include <array>
#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace gewebe::test {
namespace {

using test::organ;

/// Of the organ, a ball of radius 20.
const Vec3 middle{100, -50, 30};

/// An organ of which all nodes of the surface have compressed columns.
struct StoredOrgan {
  model::Model model = organ(4);
  linalg::StiffnessMatrix k = fem::stiffness_matrix(model);
  columns::CompressedMade made;
  bool broken = false; ///< the file

  StoredOrgan() {
    const linalg::Factor factor(k, {});
    std::vector<Vec3> positions;
    std::vector<std::uint32_t> nodes;
    for (std::uint32_t i = 0; i < model.nodes.size(); ++i) {
      positions.push_back(model.nodes[i].position);
      if (i < model::surface_count(model))
        nodes.push_back(i);
    }
    made = columns::compress_columns(
        positions, nodes, 1e-5,
        [&](std::span<const std::uint32_t> of, columns::ColumnSink& sink) {
          return columns::compliance_columns(k, factor, linalg::stiffness_norm(k), of, {}, sink,
                                             positions.size());
        },
        {});
  }
  void join(scene::Simulation& s) const {
    scene::ObjectSource source;
    source.model = [this] { return model; };
    source.stiffness = [this](const model::Model&) { return stiffness(); };
    s.add_object("organ", std::move(source), scene::Method::ffe);
  }
  std::shared_ptr<compliance::ComplianceSource> stiffness() const {
    const auto read = [this](std::size_t chunk) {
      if (broken)
        throw Error("a chunk can't be read");
      return made.chunks[chunk];
    };
    return compliance::compliance_of_store(
        {std::make_unique<columns::CompressedColumns>(made.layout, model.nodes.size(), read),
         [this] { return linalg::Factor(k, Context{}); }});
  }
};

Context of_threads(int threads) {
  Context context;
  context.threads = threads;
  return context;
}

/// Two spheres over the organ, with forces that change in between. \param ask of what is asked in
/// each step
std::vector<double> told_on_the_way(const StoredOrgan& organ, int threads, int ask) {
  scene::Simulation s(of_threads(threads), {.guard = true});
  organ.join(s);
  s.apply(scene::SetInstrument{0, {1.5, {}, 0}, {middle + Vec3{0, 0, 26}, {}}, "probe"});
  s.apply(scene::SetInstrument{1, {1, {}, 0}, {middle + Vec3{0, 25, 0}, {}}, "other"});
  std::vector<double> all;
  for (int step = 0; step < 60; ++step) {
    // To where nothing was looked at, but not to fixed nodes, at the lower end.
    const double a = step < 25 ? 0.02 * step : 1.9 * std::sin(0.23 * step);
    const double deep = step == 0 ? 3 : step % 20 == 19 ? -1 : 0.6 + 0.3 * std::sin(a);
    s.apply(scene::MoveInstrument{
        0, middle + (21.5 - deep) * Vec3{std::sin(a), 0.1, std::cos(a)}, {}, 0.001});
    s.apply(scene::MoveInstrument{1, middle + Vec3{0.3 * a, 20.5, 0.2}, {}, 0.001});
    if (step == 33)
      s.apply(scene::SetForce{0, {10}, {3, 0, 0}, 0});
    if (step == 44)
      s.apply(scene::SetGravity{{0, 0, -1000}});
    s.step(0.001);
    for (const contact::NodeVector& f : s.contact_forces(0))
      all.insert(all.end(), {static_cast<double>(f.node), f.value.x, f.value.y, f.value.z});
    const bool asks = ask == 1 || (ask == 2 && step % 7 == 3);
    if (asks)
      (void)s.surface_displacement(0);
    // Found where its range is checked, its load changes, or it has weight.
    EXPECT_EQ(s.object(0).shaped, asks || step == 0 || step == 33 || step >= 44) << step;
  }
  const std::span<const double> u = s.displacement(0);
  all.insert(all.end(), u.begin(), u.end());
  return all;
}

TEST(PartOfShape, WhoeverAsksForAShapeForcesAndShapesAreTheSame) {
  const StoredOrgan organ;
  const std::vector<double> always = told_on_the_way(organ, 1, 1);
  ASSERT_GT(always.size(), 3 * organ.model.nodes.size() + 60);
  for (const int threads : {1, 2})
    for (const int ask : {0, 2}) {
      const std::vector<double> told = told_on_the_way(organ, threads, ask);
      ASSERT_EQ(told.size(), always.size());
      EXPECT_EQ(std::memcmp(told.data(), always.data(), told.size() * sizeof(double)), 0);
    }
}

// What fails behind steps whose shape nobody asked for leaves them as they were.
TEST(PartOfShape, AStepThatFailsLeavesItAsItWas) {
  StoredOrgan organ;
  std::vector<std::vector<double>> told;
  for (const bool fails : {false, true}) {
    scene::Simulation s(of_threads(1), {.guard = true});
    organ.join(s);
    s.apply(scene::SetInstrument{0, {1.5, {}, 0}, {middle + Vec3{-26, 0, 0}, {}}, "probe"});
    std::vector<double>& all = told.emplace_back();
    for (int step = 0; step < 20; ++step) {
      const double deep = step == 0 ? 3 : 0.8;
      s.apply(scene::MoveInstrument{
          0,
          middle + (21.5 - deep) * Vec3{-std::cos(0.15 * step), std::sin(0.15 * step), 0},
          {},
          0.001});
      s.step(0.001);
      for (const contact::NodeVector& f : s.contact_forces(0))
        all.insert(all.end(), {f.value.x, f.value.y, f.value.z});
      if (fails && step % 3 == 2 && step < 12) { // where its columns are not known yet
        organ.broken = true;
        s.apply(scene::MoveInstrument{0, middle + Vec3{20, 0, 0}, {}, 0.001});
        EXPECT_THROW(s.step(0.001), Error);
        organ.broken = false;
      }
    }
    const std::span<const double> u = s.displacement(0);
    all.insert(all.end(), u.begin(), u.end());
  }
  EXPECT_EQ(told[0], told[1]);
}

} // namespace
} // namespace gewebe::test
