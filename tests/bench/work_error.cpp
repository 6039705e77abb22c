// Work against error: how long the shape of a pulled liver takes and how far it is then from the
// linear equilibrium. Elastostatic with columns of float64 and float32 and several tolerances
// against elastodynamics run to rest, by semi-implicit and by implicit steps. A patient's liver (a
// ball where there is no shared data), pulled at five nodes by 1e-6 of an edge, so that the
// non-linear equilibrium is near to the linear one: where the curves of elastodynamics end.
//
// One thread, and the time that its processor worked. Writes CSV to standard output: stage,
// program, nodes, pulled nodes, threads, median, fastest and slowest time in ms, a figure and its
// unit.

#include "dynamics/elastodynamic.h"
#include "dynamics/solid_dynamic.h"
#include "fem/model_stiffness.h"
#include "model/build.h"
#include "statics/elastostatic.h"
#include "tests/bench/memory_columns.h"
#include "tests/bench/timing.h"
#include "tests/unit/larger.h"
#include "tests/unit/mesh_fixtures.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

using namespace gewebe;
using namespace gewebe::timing;

namespace {

constexpr std::size_t pulled = 5;

void report(const std::string& program, std::size_t nodes, const Times& times, double error) {
  std::printf(
      "error of a pulled liver,%s,%zu,%zu,1,%.5f,%.5f,%.5f,%.3e,of the largest displacement\n",
      program.c_str(), nodes, pulled, times.median, times.fastest, times.slowest, error);
  std::fflush(stdout);
}

double difference(std::span<const double> a, std::span<const double> b) {
  double error = 0, size = 0;
  for (std::size_t r = 0; r < a.size(); ++r) {
    error = test::larger(error, std::abs(a[r] - b[r]));
    size = test::larger(size, std::abs(b[r]));
  }
  return std::max(error / size, 1e-17); // for the logarithm
}

struct Organ {
  model::Model model;
  linalg::StiffnessMatrix matrix;
  linalg::FactorData factor;
  std::vector<std::uint32_t> nodes; ///< that may be pulled, ascending
};

contact::Load pull(const Organ& organ, double size, double turn) {
  contact::Load load;
  for (std::size_t k = 0; k < pulled; ++k)
    load.displacement[organ.nodes[k]] =
        size * Vec3{0.5 * std::sin(turn + static_cast<double>(k)), 0.3 * std::cos(turn), 1};
  return load;
}

void elastostatic(const Organ& organ, double size, const std::vector<double>& exact, bool single,
                  double tolerance) {
  statics::Elastostatic object(organ.model,
                               compliance::compliance_of_store(memory_stiffness(
                                   organ.matrix, organ.factor, organ.nodes, single)),
                               with_threads(1), {.tolerance = tolerance});
  std::vector<double> times;
  for (int run = 0; run < 41; ++run) {
    object.update(pull(organ, size, 1 + run % 7)); // another pull of the same nodes
    (void)object.displacement();
    times.push_back(processor_milliseconds([&] {
      object.update(pull(organ, size, 0));
      (void)object.displacement();
    }));
  }
  report(single ? "elastostatic float32; tolerances 0 to 0.1"
                : "elastostatic float64; tolerances 0 to 0.1",
         organ.model.nodes.size(), times_of(times), difference(object.displacement(), exact));
}

void elastodynamic(const Organ& organ, double size, const std::vector<double>& exact,
                   bool implicit) {
  std::unique_ptr<dynamics::BodyMotion> mover;
  if (implicit)
    mover = std::make_unique<dynamics::SolidDynamic>(organ.model, integrator::SolidChoice{},
                                                     with_threads(1));
  else
    mover = std::make_unique<dynamics::Elastodynamic>(organ.model);
  dynamics::BodyMotion& object = *mover;
  const double step =
      implicit ? 1.0 / 60 : dynamics::safe_step_fraction * model::safe_step(organ.model);
  object.set_load(pull(organ, size, 0), 0);
  double spent = 0, time = 0, chunk = implicit ? 0.1 : 0.01;
  while (time < 60 && spent < 8000 && !object.resting()) {
    spent +=
        processor_milliseconds([&] { (void)object.advance(chunk, step, with_threads(1), time); });
    time += chunk;
    chunk = 0.3 * time;
    std::vector<double> u;
    for (const dynamics::NodeMotion& m : object.motion())
      for (int a = 0; a < 3; ++a)
        u.push_back(m.displacement[a]);
    report(implicit ? "elastodynamic implicit" : "elastodynamic", organ.model.nodes.size(),
           {spent, spent, spent}, difference(u, exact));
  }
}

} // namespace

int main() {
  std::puts("stage,program,nodes,pulled,threads,median_ms,fastest_ms,slowest_ms,figure,unit");
  TriangleMesh mesh = test::load_test_mesh("sofa_liver_smooth.obj");
  if (mesh.triangles.empty()) {
    (void)std::fputs("work_error: no shared data, a ball instead\n", stderr);
    mesh = test::sphere_mesh(4, 100, {});
  }
  Organ organ{model::build_model(mesh, {}, Context{}).model, {}, {}, {}};
  organ.matrix = fem::stiffness_matrix(organ.model);
  organ.factor = linalg::Factor(organ.matrix, Context{}).data();
  for (std::uint32_t k = 0; k < pulled; ++k)
    organ.nodes.push_back(static_cast<std::uint32_t>(model::surface_count(organ.model)) / 7 *
                          (k + 1));
  double edges = 0;
  std::size_t count = 0;
  for (const model::Spring& s : organ.model.springs)
    if (s.kind == model::SpringKind::edge) {
      edges += s.rest;
      ++count;
    }
  const double size = 1e-6 * edges / static_cast<double>(count);
  // The reference holds the nodes in the matrix and reads no column.
  statics::Elastostatic reference(organ.model, {}, with_threads(1), {.block_limit = 0});
  reference.update(pull(organ, size, 0));
  const std::vector<double> exact(reference.displacement().begin(), reference.displacement().end());
  for (const bool single : {false, true})
    for (const double tolerance : {0.0, 1e-4, 1e-3, 1e-2, 1e-1})
      elastostatic(organ, size, exact, single, tolerance);
  elastodynamic(organ, size, exact, false);
  elastodynamic(organ, size, exact, true);
  return EXIT_SUCCESS;
}
