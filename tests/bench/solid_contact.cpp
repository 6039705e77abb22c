// Contact with an elastostatic solid: 30 displaced nodes that all change at every update, against a
// net of as many surface nodes, where much and where little is inside. Columns of a patch of nodes
// are stored, with rows for the surface alone. And the same nodes moved together, slowly and far:
// forces and shape by the linear method and with large rotations (statics/warped_statics.h).
//
// Writes CSV to standard output: stage, program, surface nodes, nodes inside, median, fastest and
// slowest time in ms, and the median over that of the net, all measured in turn.

#include "fem/model_stiffness.h"
#include "fem/solid_model.h"
#include "model/build.h"
#include "statics/elastostatic.h"
#include "statics/warped_statics.h"
#include "tests/bench/memory_columns.h"
#include "tests/bench/timing.h"
#include "tests/unit/tet_fixtures.h"

#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

using namespace gewebe;
using namespace gewebe::timing;

namespace {

constexpr std::size_t contacts = 30, patch = 60;

struct Body {
  std::string name;
  model::Model model;
  linalg::FactorData factor{};
  std::unique_ptr<statics::Elastostatic> object{};
  contact::Load load{};
  std::vector<double> forces{}, surfaces{}, wholes{};
  std::unique_ptr<statics::WarpedStatics> turning{}; ///< of a solid
  std::vector<double> linear_far{}, turning_far{};
};

model::Model solid_box(std::uint32_t nx, std::uint32_t ny, std::uint32_t nz,
                       bool quadratic = false) {
  fem::SolidModelOptions options;
  options.material.materials = {{"gel", 1e-3, 5000, 1, 0.2, 0.4}};
  options.quadratic = quadratic;
  return fem::solid_model(test::box_tetrahedra(nx, ny, nz, quadratic ? 2 : 1), options, {});
}

void hold_below(model::Model& model) {
  for (model::Node& node : model.nodes)
    if (node.position.z == 0)
      node.fixed = model::fixed_all;
}

void prepare(Body& body) {
  hold_below(body.model);
  const linalg::StiffnessMatrix matrix = fem::stiffness_matrix(body.model);
  body.factor = linalg::Factor(matrix, Context{}).data();
  std::vector<std::uint32_t> nodes;
  for (std::uint32_t i = 0; nodes.size() < patch; ++i)
    if (body.model.nodes[i].fixed == model::fixed_none)
      nodes.push_back(i);
  const bool net = body.model.tetrahedra.empty();
  const auto source = [&] {
    return compliance::compliance_of_store(memory_stiffness(
        matrix, body.factor, nodes, false, net ? SIZE_MAX : model::surface_count(body.model)));
  };
  body.object = std::make_unique<statics::Elastostatic>(body.model, source(), with_threads(1));
  if (!net)
    body.turning = std::make_unique<statics::WarpedStatics>(body.model, source(), with_threads(1));
  for (std::size_t k = 0; k < contacts; ++k)
    body.load.displacement[nodes[2 * k]] = {};
}

void move_all(contact::Load& load, std::mt19937& random) {
  std::normal_distribution<double> normal(0, 0.01);
  for (auto& [node, d] : load.displacement)
    d = {normal(random), normal(random), normal(random)};
}

} // namespace

int main() {
  std::puts("stage,program,surface,inside,median_ms,fastest_ms,slowest_ms,over_net");
  std::vector<Body> bodies;
  const model::Model cube = solid_box(24, 24, 24);
  bodies.push_back({"net", model::build_model(model::surface_mesh(cube), {}, Context{}).model});
  bodies.push_back({"solid, much inside", cube});
  bodies.push_back({"solid, little inside", solid_box(40, 40, 2)});
  bodies.push_back({"solid, quadratic", solid_box(12, 12, 12, true)});
  for (Body& body : bodies)
    prepare(body);
  std::mt19937 random(1);
  for (int round = -40; round < 1000; ++round)
    for (Body& body : bodies) {
      const auto time = [&](std::vector<double>& to, const std::function<void()>& work) {
        const double taken = milliseconds(work);
        if (round >= 0)
          to.push_back(taken);
      };
      move_all(body.load, random);
      time(body.forces, [&] { body.object->update(body.load); });
      time(body.surfaces, [&] { (void)body.object->surface_displacement(); });
      if (round < 50)
        time(body.wholes, [&] { (void)body.object->displacement(); });
    }
  std::uint64_t rounds = 0, updates = 0;
  for (int step = -40; step < 400; ++step)
    for (Body& body : bodies) {
      contact::Load far = body.load;
      for (auto& [node, d] : far.displacement)
        d = {1 + 0.001 * step, 0, 1.5 + 0.002 * step};
      const auto time = [&](std::vector<double>& to, auto& object) {
        const double taken = milliseconds([&] {
          object.update(far);
          (void)object.surface_displacement();
        });
        if (step >= 0)
          to.push_back(taken);
      };
      time(body.linear_far, *body.object);
      if (!body.turning) {
        body.turning_far = body.linear_far;
        continue;
      }
      const std::uint64_t before = body.turning->counts().rounds;
      time(body.turning_far, *body.turning);
      if (step >= 0) {
        rounds += body.turning->counts().rounds - before;
        ++updates;
      }
    }
  std::fprintf(stderr, "%.2f rounds a shape that turns\n",
               static_cast<double>(rounds) / static_cast<double>(updates));
  const auto report = [&](const char* stage, std::vector<double> Body::*times) {
    const double net = times_of(bodies[0].*times).median;
    for (const Body& body : bodies) {
      const Times t = times_of(body.*times);
      const std::size_t surface = model::surface_count(body.model);
      std::printf("%s,\"%s\",%zu,%zu,%.4f,%.4f,%.4f,%.3f\n", stage, body.name.c_str(), surface,
                  body.model.nodes.size() - surface, t.median, t.fastest, t.slowest,
                  t.median / net);
    }
  };
  report("contact forces", &Body::forces);
  report("shape of the surface", &Body::surfaces);
  report("whole shape beyond it", &Body::wholes);
  report("forces and surface, moved together", &Body::linear_far);
  report("the same with large rotations", &Body::turning_far);
  for (const Body& body : bodies)
    std::fprintf(stderr, "%s: %llu solves\n", body.name.c_str(),
                 static_cast<unsigned long long>(body.object->counts().solves));
  return EXIT_SUCCESS;
}
