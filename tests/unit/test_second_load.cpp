// A second load on a used object gives the same result as that load on a fresh object, for every
// pair of load kinds and every material law and method.

#include "columns/compliance_columns.h"
#include "fem/model_stiffness.h"
#include "fem/solid_model.h"
#include "larger.h"
#include "linalg/condition.h"
#include "linalg/factor.h"
#include "scene/simulation.h"
#include "sim_models.h"
#include "simulation_scenes.h"
#include "tet_fixtures.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <numeric>
#include <ostream>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace gewebe::test {
namespace {

using Nodes = std::vector<std::uint32_t>;

/// A bar 16 × 8 × 8 mm along x, held at x = 0; of quadratic elements fewer.
model::Model bar(bool quadratic) {
  fem::SolidModelOptions options;
  options.material.materials = {{"gel", 1e-3, 2e4, 1, 0.2, 0.4}};
  options.quadratic = quadratic;
  options.drag_rate = 30;
  model::Model model = fem::solid_model(
      quadratic ? test::box_tetrahedra(2, 1, 1, 8) : test::box_tetrahedra(4, 2, 2, 4), options, {});
  for (model::Node& node : model.nodes)
    if (node.position.x == 0)
      node.fixed = model::fixed_all;
  return model;
}

/// Columns of the surface nodes, with rows for these alone.
class SurfaceColumns final : public columns::ColumnSource, public columns::ColumnSink {
public:
  explicit SurfaceColumns(const model::Model& model)
      : count_(model.nodes.size()), nodes_(model::surface_count(model)) {
    std::iota(nodes_.begin(), nodes_.end(), 0U);
    const linalg::StiffnessMatrix k = fem::stiffness_matrix(model);
    (void)columns::compliance_columns(k, linalg::Factor(k, {}), linalg::stiffness_norm(k), nodes_,
                                      {}, *this, nodes_.size());
  }
  std::size_t node_count() const override { return count_; }
  std::size_t row_nodes() const override { return nodes_.size(); }
  const Nodes& nodes() const override { return nodes_; }
  void read(std::size_t k, std::span<double> out) const override {
    std::ranges::copy(kept_[k], out.begin());
  }
  void write(std::size_t /*k*/, std::span<const double> columns, double /*residual*/) override {
    kept_.emplace_back(columns.begin(), columns.end());
  }

private:
  std::size_t count_;
  Nodes nodes_;
  std::vector<std::vector<double>> kept_;
};

/// A method and material law.
struct Law {
  std::string name;
  std::function<void(scene::Simulation&)> add;
  double tolerance = 1e-9; ///< of shapes and forces, over their largest number
  bool moves = false;      ///< elastodynamic: compared at rest
};

std::ostream& operator<<(std::ostream& out, const Law& law) {
  return out << law.name;
}

scene::ObjectSource with_columns(const model::Model& model) {
  return {[model] { return model; },
          [](const model::Model& own) {
            return compliance::compliance_of_store(
                {std::make_unique<SurfaceColumns>(own),
                 [&own] { return linalg::Factor(fem::stiffness_matrix(own), Context{}); }});
          }};
}

std::vector<Law> laws() {
  const auto object = [](const model::Model& model, scene::Method method,
                         scene::Integration integration = scene::Integration::semi_implicit,
                         const integrator::SolidChoice& solid = {}) {
    return [=](scene::Simulation& s) { s.add_object("o", model, method, {}, integration, solid); };
  };
  std::vector<Law> all{
      {"net", object(test::organ(1), scene::Method::ffe)},
      {"prepared_net",
       [](scene::Simulation& s) {
         s.add_object("o", test::organ(1), scene::Method::ffe);
         s.apply(scene::Prepare{0});
       }},
      {"linear_solid", object(bar(false), scene::Method::ffe)},
      {"quadratic_solid", object(bar(true), scene::Method::ffe)},
      {"stored_solid",
       [](scene::Simulation& s) {
         s.add_object("o", with_columns(bar(false)), scene::Method::ffe);
       }},
      {"two_steps", [](scene::Simulation& s) {
         model::Model stiff = test::organ(1);
         for (model::Spring& spring : stiff.springs)
           spring.stiffness *= 3;
         s.add_object("o", test::organ(1), scene::Method::ffe);
         s.apply(scene::SetTwoStep{
             0, {.threshold = 1e4}, {}, std::make_shared<const model::Model>(stiff)});
       }}};
  for (const bool quadratic : {false, true})
    all.push_back({quadratic ? "warped_quadratic_solid" : "warped_linear_solid",
                   [quadratic](scene::Simulation& s) {
                     s.add_object("o", bar(quadratic), scene::Method::ffe);
                     s.apply(scene::SetWarp{0});
                   },
                   5e-3}); // an answer starts from the one before, and rounds end at 1e-3
  for (const integrator::SolidLaw law :
       {integrator::SolidLaw::corotational, integrator::SolidLaw::hyperelastic}) {
    integrator::SolidChoice choice;
    choice.law = law;
    choice.tolerance = 1e-6;
    all.push_back(
        {law == integrator::SolidLaw::corotational ? "moving_corotational" : "moving_neo_hookean",
         object(bar(false), scene::Method::ela, scene::Integration::semi_implicit, choice), 1e-3,
         true});
  }
  all.push_back({"moving_net",
                 object(test::organ(1), scene::Method::ela, scene::Integration::implicit), 1e-3,
                 true});
  return all;
}

/// Applies and removes a load.
struct Kind {
  std::string name;
  std::function<void(scene::Simulation&)> set, clear;
};

Nodes far_end(const model::Model& model, std::size_t count) {
  Nodes nodes = test::free_nodes(model);
  std::ranges::stable_sort(nodes, {}, [&](std::uint32_t i) {
    return -model.nodes[i].position.x - 0.1 * model.nodes[i].position.z;
  });
  nodes.resize(std::min(nodes.size(), count));
  return nodes;
}

/// \param size of forces, 1e-6 N, and of accelerations
std::vector<Kind> kinds(const model::Model& model, double size, bool moves) {
  const Nodes end = far_end(model, 4), all = test::free_nodes(model), one{end[1]};
  const auto release = [](const Nodes& nodes) {
    return [nodes](scene::Simulation& s) { s.apply(scene::Release{0, nodes}); };
  };
  const auto force = [&](const char* name, const Nodes& nodes, const Vec3& f, double period = 0) {
    return Kind{name,
                [=](scene::Simulation& s) {
                  s.apply(scene::SetForce{0, nodes, f / static_cast<double>(nodes.size()), period});
                },
                release(nodes)};
  };
  const auto gravity = [](const char* name, const Vec3& g) {
    return Kind{name, [=](scene::Simulation& s) { s.apply(scene::SetGravity{g}); },
                [](scene::Simulation& s) { s.apply(scene::SetGravity{}); }};
  };
  const auto displace = [&](const char* name, const Nodes& nodes, const Vec3& d) {
    return Kind{name,
                [=](scene::Simulation& s) {
                  s.apply(scene::SetDisplacement{0, nodes, d});
                },
                release(nodes)};
  };
  const double weight = model::total_mass(model);
  std::vector<Kind> kinds{gravity("gravity", {0, 0, -size / weight}),
                          force("force", end, {0, 0, -size}),
                          displace("displacement", one, {0, 0, -0.8}),
                          {"pressure",
                           [=](scene::Simulation& s) {
                             s.apply(scene::SetPressure{0, end, {40, 0}});
                           },
                           release(end)}};
  if (moves)
    return kinds;
  kinds.push_back(gravity("gravity_aside", {0, 0.7 * size / weight, 0}));
  kinds.push_back(force("other_force", end, {0, size, 0.5 * size}));
  kinds.push_back(force("forces_on_many", all, {0, 2 * size, 0}));
  kinds.push_back(displace("displacement_of_several", end, {0, 0.5, 0.3}));
  kinds.push_back(force("pulse", end, {0, 0, 1.5 * size}, 0.35));
  Nodes inside;
  for (std::uint32_t i = static_cast<std::uint32_t>(model::surface_count(model));
       i < model.nodes.size(); ++i)
    if (model.nodes[i].fixed == model::fixed_none)
      inside.push_back(i);
  if (!inside.empty())
    kinds.push_back(force("force_inside", inside, {0, 0, size}));
  for (const double along : {0.5, -0.3}) {
    Kind both = kinds[2];
    both.name += " under gravity of " + std::to_string(along);
    both.set = [set = both.set, by = along * size / weight](scene::Simulation& s) {
      set(s);
      s.apply(scene::SetGravity{{0, by, 0}});
    };
    both.clear = [clear = both.clear](scene::Simulation& s) {
      clear(s);
      s.apply(scene::SetGravity{});
    };
    kinds.push_back(both);
  }
  return kinds;
}

/// Results of an object.
struct Asked {
  std::vector<double> shape, surface;
  std::vector<contact::NodeVector> forces;
};

Asked ask(const scene::Simulation& s) {
  Asked asked;
  const std::span<const double> surface = s.surface_displacement(0);
  asked.surface.assign(surface.begin(), surface.end());
  asked.shape = test::shape(s, 0);
  asked.forces = s.contact_forces(0);
  return asked;
}

double largest(std::span<const double> values) {
  double most = 0;
  for (const double x : values)
    most = test::larger(most, std::abs(x));
  return most;
}

void expect_near(std::span<const double> found, std::span<const double> expected, double tolerance,
                 const std::string& what) {
  ASSERT_EQ(found.size(), expected.size()) << what;
  double most = 0;
  for (std::size_t k = 0; k < found.size(); ++k)
    most = test::larger(most, std::abs(found[k] - expected[k]));
  EXPECT_LE(most, tolerance * largest(expected)) << what;
}

class SecondLoad : public testing::TestWithParam<Law> {};
INSTANTIATE_TEST_SUITE_P(Laws, SecondLoad, testing::ValuesIn(laws()),
                         [](const auto& of) { return of.param.name; });

/// One step, or enough long steps to bring an elastodynamic object to rest.
void go_on(scene::Simulation& s, bool moves) {
  if (!moves)
    return s.step(0.1);
  for (int k = 0; k < 12; ++k)
    s.step(2);
}

TEST_P(SecondLoad, EqualsTheSameLoadOnAFreshObject) {
  const Law& law = GetParam();
  const auto scene = [&] {
    auto s = std::make_unique<scene::Simulation>(test::one_thread(), scene::SimulationOptions{});
    law.add(*s);
    return s;
  };
  const model::Model model = scene()->model(0);
  const std::vector<Kind> all = kinds(model, model.tetrahedra.empty() ? 2e5 : 1e4, law.moves);
  for (const Kind& second : all) {
    const auto fresh = scene();
    if (law.moves)
      go_on(*fresh, true);
    else
      fresh->step(0.2);
    second.set(*fresh);
    go_on(*fresh, law.moves);
    const Asked expected = ask(*fresh);
    EXPECT_GT(largest(expected.shape), 0.02) << second.name;
    EXPECT_LT(largest(expected.shape), 6) << second.name;
    for (const Kind& first : all) {
      if (&first == &second)
        continue;
      const std::string what = second.name + " behind " + first.name;
      const auto used = scene();
      if (!law.moves)
        used->step(0.1);
      first.set(*used);
      go_on(*used, law.moves);
      EXPECT_GT(largest(ask(*used).shape), 0.01) << what;
      first.clear(*used);
      second.set(*used);
      go_on(*used, law.moves);
      const Asked found = ask(*used);
      expect_near(found.shape, expected.shape, law.tolerance, what);
      expect_near(found.surface, expected.surface, law.tolerance, what + ", surface");
      ASSERT_EQ(found.forces.size(), expected.forces.size()) << what;
      double most = 0, size = 0;
      for (std::size_t k = 0; k < found.forces.size(); ++k) {
        EXPECT_EQ(found.forces[k].node, expected.forces[k].node);
        most = test::larger(most, norm(found.forces[k].value - expected.forces[k].value));
        size = test::larger(size, norm(expected.forces[k].value));
      }
      EXPECT_LE(most, 2 * law.tolerance * size) << what << ", forces";
    }
  }
}

} // namespace
} // namespace gewebe::test
