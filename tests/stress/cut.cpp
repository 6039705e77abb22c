// Two hundred cuts in a row, of springs and of the surface: behind each of them solutions and
// columns equal those of the model precomputed afresh, and leave no larger residual. A patient's
// colon and a liver, or balls where there is no shared data. The negative control solves with what
// held before the cut. Argument: how many cuts (default 200).

#include "compliance/axis_solver.h"
#include "fem/model_stiffness.h"
#include "linalg/condition.h"
#include "linalg/stiffness.h"
#include "model/build.h"
#include "statics/elastostatic.h"
#include "tests/bench/memory_columns.h"
#include "tests/unit/larger.h"
#include "tests/unit/mesh_fixtures.h"
#include "tests/unit/random_cuts.h"
#include "tests/unit/relative_difference.h"
#include "update/cut_stiffness.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>

using namespace gewebe;

namespace {

// Two stable solutions differ by roundings times the condition, so it must leave room below 1e-8.
constexpr double max_error = 1e-8, max_residual = 1e-13, condition_limit = 5e8;
int passed = 0, failed = 0;

void check(bool good, const std::string& what) {
  ++(good ? passed : failed);
  if (!good)
    std::printf("failed: %s\n", what.c_str());
}

double residual(const model::Model& model, std::span<const double> u, std::span<const double> f) {
  const linalg::StiffnessMatrix matrix = fem::stiffness_matrix(model);
  std::vector<double> x, right;
  for (const std::int64_t axis : matrix.axis_of_row) {
    x.push_back(u[static_cast<std::size_t>(axis)]);
    right.push_back(f[static_cast<std::size_t>(axis)]);
  }
  return linalg::backward_error(matrix, linalg::stiffness_norm(matrix), x, right);
}

std::vector<double> random_load(std::size_t axes, std::mt19937& random) {
  std::vector<double> f(axes);
  for (double& value : f)
    value = static_cast<double>(random()) / 2147483648.0 - 1;
  return f;
}

void cut_often(const char* name, const TriangleMesh& mesh, int cuts) {
  auto model = std::make_shared<const model::Model>(model::build_model(mesh, {}, Context{}).model);
  const Context context;
  std::vector<std::uint32_t> touched;
  for (std::uint32_t i = 0; i < model::surface_count(*model); i += 101)
    touched.push_back(i);
  const linalg::StiffnessMatrix matrix = fem::stiffness_matrix(*model);
  const linalg::FactorData factor = linalg::Factor(matrix, context).data();
  update::CutStiffness stiffness(
      model,
      compliance::compliance_of_store(timing::memory_stiffness(matrix, factor, touched, false)),
      context);
  stiffness.prepare();
  std::mt19937 random(7);
  std::array<int, 3> ways{};
  double worst = 0, worst_residual = 0, worst_column = 0, control = HUGE_VAL;
  double worst_condition = 0;
  std::size_t refused = 0, springs = 0, told = 0;
  for (int done = 0; done < cuts;) {
    std::optional<cutting::CutModel> next = test::random_cut(*model, random, 50);
    if (!next)
      continue;
    const std::size_t removed = next->removed + next->doubled;
    auto now = std::make_shared<const model::Model>(std::move(next->model));
    std::vector<double> f = random_load(3 * now->nodes.size(), random);
    linalg::StiffnessMatrix matrix_now = fem::stiffness_matrix(*now);
    std::optional<compliance::AxisSolver> fresh;
    double condition = HUGE_VAL;
    try {
      linalg::Factor factor_now(matrix_now, context);
      condition = linalg::stiffness_norm(matrix_now) * linalg::inverse_norm(factor_now);
      fresh.emplace(
          compliance::AxisSolver{std::move(factor_now), std::move(matrix_now.row_of_axis)});
    } catch (const linalg::NotPositiveDefinite&) {
      // A part hangs loose.
    }
    if (!(condition < condition_limit)) { // solutions would differ by their condition alone
      ++refused;
      if (condition < 10 * linalg::max_condition || told == 3)
        continue;
      ++told;
      bool refuses = false;
      try {
        update::CutStiffness other(model, nullptr, context);
        (void)other.cut(now, next->origin, next->place);
      } catch (const Error&) {
        refuses = true;
      }
      check(refuses, std::string(name) + ": a singular stiffness was not told");
      continue;
    }
    worst_condition = test::larger(worst_condition, condition);
    // Each fourth cut by Woodbury, which on so few nodes is never the cheapest.
    const update::CutWork work =
        stiffness.cut(now, next->origin, next->place,
                      done % 4 == 3 ? std::optional(update::CutWay::woodbury) : std::nullopt);
    const std::shared_ptr<compliance::ComplianceSource> compliance = stiffness.compliance();
    const columns::ColumnSource& stored = *compliance->columns();
    ++ways[static_cast<std::size_t>(work.way)];
    springs += removed;
    std::vector<double> u = f, expected = f;
    compliance->solve(u, 1);
    fresh->solve(expected);
    const double error = test::relative_difference(u, expected), back = residual(*now, u, f);
    worst = test::larger(worst, error);
    worst_residual = test::larger(worst_residual, back);
    const std::string which = std::string(name) + ", cut " + std::to_string(done);
    check(error < max_error, which + ": error " + std::to_string(error));
    check(back < max_residual, which + ": residual " + std::to_string(back));
    if (done % 20 == 0) { // columns of the store, corrected
      std::vector<double> columns(9 * now->nodes.size()), right(columns.size(), 0);
      const std::size_t k = random() % stored.nodes().size();
      const std::uint32_t node = stored.nodes()[k];
      stored.read(k, columns);
      for (std::size_t a = 0; a < 3; ++a)
        right[a * 3 * now->nodes.size() + 3 * std::size_t{node} + a] = 1;
      fresh->solve(right, 3);
      const double wrong = test::relative_difference(columns, right);
      worst_column = test::larger(worst_column, wrong);
      check(wrong < max_error, which + ": a column's error " + std::to_string(wrong));
    }
    if (now->nodes.size() == model->nodes.size()) {
      // A solver of before must not pass.
      std::vector<double> old = f;
      compliance::factorise_axes(*model, context).solve(old);
      control = test::smaller(control, test::relative_difference(old, expected));
    }
    model = std::move(now);
    ++done;
  }
  check(std::isfinite(control) && control > max_error,
        std::string(name) + ": the model of before passes as the cut one");
  std::printf(
      "%s: %zu nodes at the end, %d cuts of %zu springs and copies, %d by Woodbury, %d refactored, "
      "%d afresh, %zu more would leave something loose: error %.2g, column %.2g, residual "
      "%.2g, condition %.2g, control %.2g\n",
      name, model->nodes.size(), cuts, springs, ways[0], ways[1], ways[2], refused, worst,
      worst_column, worst_residual, worst_condition, control);
  std::fflush(stdout);
}

} // namespace

int main(int argc, char** argv) {
  const int cuts = argc > 1 ? static_cast<int>(std::strtol(argv[1], nullptr, 10)) : 200;
  for (const auto& [name, file] : {std::pair{"liver", "sofa_liver_smooth.obj"},
                                   std::pair{"colon", "gca90_large_intestine_20k.stl"}}) {
    TriangleMesh mesh = test::load_test_mesh(file);
    if (mesh.triangles.empty()) {
      (void)std::fprintf(stderr, "cut: no shared data, a ball instead of the %s\n", name);
      mesh = test::sphere_mesh(4, 50, {});
    }
    cut_often(name, mesh, cuts);
  }
  std::printf("%d passed, %d failed\n", passed, failed);
  return failed == 0 && passed > 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
