// A cut of an elastostatic organ: what its solutions cost to follow, by the ways there are, over
// the number of springs: correcting them, computing the fronts again that the cut reaches, or all
// of them; CHOLMOD's update of a simplicial factor and its factorisation as peers. A patient's
// colon (a ball where there is no shared data), each cut at a random place, ways by turns.
//
// Writes CSV to standard output: stage, program, springs, nodes, threads, median, fastest and 99th
// percentile in ms, a figure and its unit.

#include "compliance/axis_solver.h"
#include "fem/model_stiffness.h"
#include "linalg/stiffness.h"
#include "model/build.h"
#include "tests/bench/timing.h"
#include "tests/unit/larger.h"
#include "tests/unit/mesh_fixtures.h"
#include "tests/unit/random_cuts.h"
#include "tests/unit/relative_difference.h"
#include "update/cut_stiffness.h"
#include "update/stiffness_change.h"
#include "update/woodbury.h"

#include <algorithm>
#include <array>
#include <cholmod.h>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <random>
#include <string>
#include <vector>

using namespace gewebe;
using namespace gewebe::timing;

namespace {

/// Times of a way at one size.
struct Row {
  std::vector<double> times;
  double error = 0;
};

void print(const char* stage, const std::string& program, std::size_t springs, std::size_t nodes,
           int threads, Row& row) {
  std::sort(row.times.begin(), row.times.end());
  const double median = row.times[row.times.size() / 2];
  std::printf("time over springs %s (log),%s,%zu,%zu,%d,%.3f,%.3f,%.3f,%.4g,median ms\n", stage,
              program.c_str(), springs, nodes, threads, median, row.times.front(),
              row.times[row.times.size() * 99 / 100], median);
  std::printf("error over springs %s (log),%s,%zu,%zu,%d,%.3f,%.3f,%.3f,%.2g,of the largest "
              "displacement\n",
              stage, program.c_str(), springs, nodes, threads, median, row.times.front(),
              row.times[row.times.size() * 99 / 100], row.error);
  std::fflush(stdout);
}

/// CHOLMOD's simplicial L D L' of a matrix, which rank-k updates change.
class Updated {
public:
  explicit Updated(const linalg::StiffnessMatrix& matrix) : matrix_(matrix) {
    (void)cholmod_l_start(&common_);
    common_.print = 0;
    common_.supernodal = CHOLMOD_SUPERNODAL;
    cholmod_sparse a{};
    a.nrow = a.ncol = matrix.order();
    a.nzmax = matrix.row.size();
    a.p = const_cast<std::int64_t*>(matrix.column_start.data());
    a.i = const_cast<std::int64_t*>(matrix.row.data());
    a.x = const_cast<double*>(matrix.value.data());
    a.stype = -1;
    a.itype = CHOLMOD_LONG;
    a.xtype = CHOLMOD_REAL;
    a.dtype = CHOLMOD_DOUBLE;
    a.sorted = a.packed = true;
    factor_ = cholmod_l_analyze(&a, &common_);
    (void)cholmod_l_factorize(&a, factor_, &common_);
    (void)cholmod_l_change_factor(CHOLMOD_REAL, 0, 0, 1, 1, factor_, &common_);
  }
  ~Updated() {
    (void)cholmod_l_free_factor(&factor_, &common_);
    (void)cholmod_l_finish(&common_);
  }
  Updated(const Updated&) = delete;
  Updated& operator=(const Updated&) = delete;

  /// Adds (or takes away) springs of rest length. \return ms
  double update(bool add, const model::Model& model, std::span<const std::size_t> springs) {
    cholmod_sparse* const c = columns(model, springs);
    const double time =
        milliseconds([&] { (void)cholmod_l_updown(add ? 1 : 0, c, factor_, &common_); });
    cholmod_sparse* owned = c;
    (void)cholmod_l_free_sparse(&owned, &common_);
    return time;
  }

  void solve(std::vector<double>& over_axes) {
    cholmod_dense* b = cholmod_l_zeros(matrix_.order(), 1, CHOLMOD_REAL, &common_);
    for (std::size_t r = 0; r < matrix_.order(); ++r)
      static_cast<double*>(b->x)[r] = over_axes[static_cast<std::size_t>(matrix_.axis_of_row[r])];
    cholmod_dense* x = cholmod_l_solve(CHOLMOD_A, factor_, b, &common_);
    std::fill(over_axes.begin(), over_axes.end(), 0.0);
    for (std::size_t r = 0; r < matrix_.order(); ++r)
      over_axes[static_cast<std::size_t>(matrix_.axis_of_row[r])] = static_cast<double*>(x->x)[r];
    (void)cholmod_l_free_dense(&b, &common_);
    (void)cholmod_l_free_dense(&x, &common_);
  }

private:
  cholmod_sparse* columns(const model::Model& model, std::span<const std::size_t> springs) {
    cholmod_triplet* t = cholmod_l_allocate_triplet(matrix_.order(), springs.size(),
                                                    6 * springs.size(), 0, CHOLMOD_REAL, &common_);
    const auto* const permutation = static_cast<const std::int64_t*>(factor_->Perm);
    if (place_.empty()) {
      place_.resize(matrix_.order());
      for (std::size_t k = 0; k < place_.size(); ++k)
        place_[static_cast<std::size_t>(permutation[k])] = static_cast<std::int64_t>(k);
    }
    for (std::size_t c = 0; c < springs.size(); ++c) {
      const model::Spring& s = model.springs[springs[c]];
      const Vec3 d = model.nodes[s.j].position - model.nodes[s.i].position;
      const Vec3 n = std::sqrt(s.stiffness) * d / norm(d);
      for (const bool first : {true, false})
        for (int a = 0; a < 3; ++a) {
          const std::int64_t row =
              matrix_.row_of_axis[3 * std::size_t{first ? s.i : s.j} + static_cast<std::size_t>(a)];
          if (row < 0)
            continue;
          static_cast<std::int64_t*>(t->i)[t->nnz] = place_[static_cast<std::size_t>(row)];
          static_cast<std::int64_t*>(t->j)[t->nnz] = static_cast<std::int64_t>(c);
          static_cast<double*>(t->x)[t->nnz++] = first ? n[a] : -n[a];
        }
    }
    cholmod_sparse* const columns = cholmod_l_triplet_to_sparse(t, 0, &common_);
    (void)cholmod_l_free_triplet(&t, &common_);
    return columns;
  }

  const linalg::StiffnessMatrix& matrix_;
  cholmod_common common_{};
  cholmod_factor* factor_ = nullptr;
  std::vector<std::int64_t> place_;
};

update::AxesSolve solver_of(const linalg::FrontalFactor& factor) {
  return [&factor](std::span<double> f, std::size_t columns) { factor.solve(f, columns); };
}

std::vector<double> load(std::size_t axes) {
  std::mt19937 random(3);
  std::vector<double> f(axes);
  for (double& value : f)
    value = static_cast<double>(random()) / 2147483648.0 - 1;
  return f;
}

/// Springs alone: nodes stay, so that CHOLMOD's update can follow.
void bench_springs(const model::Model& model, int threads) {
  const Context context = with_threads(threads);
  const linalg::StiffnessMatrix matrix = fem::stiffness_matrix(model);
  linalg::FrontalFactor factor(model, context);
  linalg::Factor cholmod(matrix, context);
  Updated updated(matrix);
  const std::vector<double> f = load(3 * model.nodes.size());
  std::mt19937 random(1);
  for (const std::size_t count : std::array<std::size_t, 9>{1, 2, 5, 10, 20, 24, 50, 100, 200}) {
    std::map<std::string, Row> rows;
    for (int round = 0; round < (count > 24 ? 20 : 60); ++round) {
      const cutting::Cut cut = test::springs_around(
          model, static_cast<std::uint32_t>(random() % model::surface_count(model)), count);
      model::Model now = model;
      for (const std::size_t e : cut.springs)
        now.springs[e].stiffness *= 1e-6; // so that nothing hangs loose, whatever is cut
      const auto same = [&] {
        std::vector<std::uint32_t> numbers(model.nodes.size());
        for (std::uint32_t i = 0; i < numbers.size(); ++i)
          numbers[i] = i;
        return numbers;
      }();
      std::vector<double> expected, u;
      const auto judge = [&](Row& row) {
        if (round % 10 == 0)
          row.error = test::larger(row.error, test::relative_difference(u, expected));
      };
      if (count <= 100) {
        std::optional<update::WoodburySolver> corrected;
        rows["Woodbury"].times.push_back(milliseconds([&] {
          corrected.emplace(update::stiffness_change(model, now, same, same), solver_of(factor),
                            context);
        }));
        if (round % 10 == 0) {
          expected = f;
          compliance::AxisSolver{linalg::Factor(fem::stiffness_matrix(now), context),
                                 matrix.row_of_axis}
              .solve(expected);
        }
        u = f;
        corrected->solve(u);
        judge(rows["Woodbury"]);
      }
      if (count <= 100) {
        if (expected.empty() && round % 10 == 0) {
          expected = f;
          compliance::AxisSolver{linalg::Factor(fem::stiffness_matrix(now), context),
                                 matrix.row_of_axis}
              .solve(expected);
        }
        // Removing all but a millionth, as the model does.
        model::Model gone = model;
        for (const std::size_t e : cut.springs)
          gone.springs[e].stiffness *= 1 - 1e-6;
        Row& row = rows["CHOLMOD update"];
        row.times.push_back(updated.update(false, gone, cut.springs));
        u = f;
        updated.solve(u);
        judge(row);
        (void)updated.update(true, gone, cut.springs);
      }
      rows["refactorisation"].times.push_back(
          milliseconds([&] { (void)factor.refactor(now, {}, {}, context); }));
      if (round % 10 == 0) {
        expected = f;
        compliance::AxisSolver{linalg::Factor(fem::stiffness_matrix(now), context),
                               matrix.row_of_axis}
            .solve(expected);
        u = f;
        factor.solve(u);
        judge(rows["refactorisation"]);
      }
      (void)factor.refactor(model, {}, {}, context);
      if (round % 5 == 0) {
        model::Model all = model;
        for (model::Spring& s : all.springs)
          s.stiffness *= 1.5;
        rows["all fronts"].times.push_back(
            milliseconds([&] { (void)factor.refactor(all, {}, {}, context); }));
        (void)factor.refactor(model, {}, {}, context);
        rows["CHOLMOD factor"].times.push_back(
            milliseconds([&] { cholmod.refactor(fem::stiffness_matrix(now), context); }));
      }
    }
    for (auto& [program, row] : rows)
      print("removed", program, count, model.nodes.size(), threads, row);
  }
}

/// The surface opened: nodes are doubled. The whole cut, from the area of the blade on.
void bench_opening(const model::Model& first, int threads) {
  const Context context = with_threads(threads);
  std::mt19937 random(2);
  const double edge = test::mean_edge(first);
  for (const double length : {2.0, 4.0, 8.0, 16.0}) {
    auto model = std::make_shared<const model::Model>(first);
    update::CutStiffness stiffness(model, nullptr, context);
    stiffness.prepare();
    std::map<std::string, Row> rows;
    double touched = 0;
    int cuts = 0;
    for (int round = 0; round < 60; ++round) {
      const cutting::SweptQuad area =
          test::blade_at(*model, random() % model->triangles.size(),
                         static_cast<double>(random() % 628) / 100, length * edge, edge);
      std::optional<cutting::CutModel> next;
      const double find = milliseconds([&] {
        const cutting::Cut cut = cutting::swept_cut(*model, {}, std::span(&area, 1));
        if (!cut.empty())
          next.emplace(cutting::cut_model(*model, cut));
      });
      if (!next || !next->changed() || !cutting::free_parts(*model, *next).parts.empty())
        continue;
      auto now = std::make_shared<const model::Model>(std::move(next->model));
      update::CutWork work;
      double follow = 0;
      try {
        follow = milliseconds([&] { work = stiffness.cut(now, next->origin, next->place); });
      } catch (const Error&) { // hangs at too little
        stiffness = update::CutStiffness(model, nullptr, context);
        stiffness.prepare();
        continue;
      }
      ++cuts;
      touched += static_cast<double>(next->removed + next->split + 3 * next->doubled);
      rows["the model"].times.push_back(find);
      rows["its stiffness"].times.push_back(follow);
      rows["both"].times.push_back(find + follow);
      if (round % 6 == 0) {
        std::optional<compliance::AxisSolver> fresh;
        rows["CHOLMOD afresh"].times.push_back(milliseconds([&] {
          linalg::StiffnessMatrix matrix = fem::stiffness_matrix(*now);
          linalg::Factor factor(matrix, context);
          fresh.emplace(compliance::AxisSolver{std::move(factor), std::move(matrix.row_of_axis)});
        }));
        std::vector<double> u = load(3 * now->nodes.size()), expected = u;
        stiffness.compliance()->solve(u, 1);
        fresh->solve(expected);
        rows["its stiffness"].error =
            std::max(rows["its stiffness"].error, test::relative_difference(u, expected));
      }
      model = std::move(now);
    }
    for (auto& [program, row] : rows)
      print("opened", program, static_cast<std::size_t>(touched / std::max(cuts, 1)),
            model->nodes.size(), threads, row);
  }
}

} // namespace

int main() {
  std::puts("stage,program,springs,nodes,threads,median_ms,fastest_ms,p99_ms,figure,unit");
  TriangleMesh mesh = test::load_test_mesh("gca90_large_intestine_20k.stl");
  if (mesh.triangles.empty()) {
    (void)std::fputs("cut: no shared data, a ball instead\n", stderr);
    mesh = test::sphere_mesh(5, 100, {});
  }
  const model::Model model = model::build_model(mesh, {}, Context{}).model;
  for (const int threads : {1, 2}) {
    bench_springs(model, threads);
    bench_opening(model, threads);
  }
  return EXIT_SUCCESS;
}
