// Compliance: the factor of a model and columns of the inverse, one and two threads, against
// CHOLMOD's own solve on blocks of identity columns and the rate of BLAS's matrix product in the
// same run; and against relaxation, whose error over time it gives for several thresholds and
// numbers of steps, from a sample of one node. A patient's colon and liver (a ball where there is
// no shared data) with central springs. Nothing is written to a disk.
//
// Writes CSV to standard output: stage, program, nodes, columns solved, threads, median, fastest
// and slowest time in ms, a figure and its unit. Words on the command line choose among columns
// (of the colon), colon and liver (their relaxation).

#include "columns/compliance_columns.h"
#include "dynamics/relaxation.h"
#include "fem/model_stiffness.h"
#include "linalg/condition.h"
#include "model/build.h"
#include "tests/bench/blas.h"
#include "tests/bench/timing.h"
#include "tests/unit/larger.h"
#include "tests/unit/mesh_fixtures.h"

#include <cholmod.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <vector>

using namespace gewebe;
using namespace gewebe::timing;

namespace {

void report(const char* stage, const char* program, std::size_t nodes, std::size_t columns,
            int threads, const Times& times, double figure, const char* unit) {
  std::printf("%s,%s,%zu,%zu,%d,%.3f,%.3f,%.3f,%.4g,%s\n", stage, program, nodes, columns, threads,
              times.median, times.fastest, times.slowest, figure, unit);
  std::fflush(stdout);
}

/// GFLOP/s of BLAS at 512 x 512 x 512, one thread: of its fastest run, since it stands for what the
/// machine can do.
double product_rate() {
  const int n = 512;
  const double one = 1, zero = 0;
  constexpr std::size_t entries = std::size_t{512} * 512;
  std::vector<double> a(entries, 0.5), b(entries, 0.25), c(entries);
  const Times times = measure(
      [&] { dgemm_("N", "N", &n, &n, &n, &one, a.data(), &n, b.data(), &n, &zero, c.data(), &n); });
  const double rate = 2.0 * n * n * n / times.fastest * 1e-6;
  report("matrix product", "BLAS", 0, n, 1, times, rate, "GFLOP/s");
  return rate;
}

/// Columns that stay in memory.
class Kept final : public columns::ColumnSink {
public:
  void write(std::size_t, std::span<const double> columns, double) override {
    all.insert(all.end(), columns.begin(), columns.end());
  }
  std::vector<double> all;
};

/// Columns that go nowhere, but for the last of which the first number is kept.
class Nowhere final : public columns::ColumnSink {
public:
  void write(std::size_t, std::span<const double> columns, double) override { sum += columns[0]; }
  double sum = 0;
};

/// CHOLMOD's factor and its solve for blocks of identity columns.
class Peer {
public:
  explicit Peer(const linalg::StiffnessMatrix& matrix) {
    (void)cholmod_l_start(&common_);
    common_.print = 0;
    common_.supernodal = CHOLMOD_SUPERNODAL;
    matrix_ = cholmod_l_allocate_sparse(matrix.order(), matrix.order(), matrix.row.size(), 1, 1, -1,
                                        CHOLMOD_REAL, &common_);
    std::memcpy(matrix_->p, matrix.column_start.data(), 8 * matrix.column_start.size());
    std::memcpy(matrix_->i, matrix.row.data(), 8 * matrix.row.size());
    std::memcpy(matrix_->x, matrix.value.data(), 8 * matrix.value.size());
    factor_ = cholmod_l_analyze(matrix_, &common_);
    (void)cholmod_l_factorize(matrix_, factor_, &common_);
  }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;
  ~Peer() {
    (void)cholmod_l_free_sparse(&matrix_, &common_);
    (void)cholmod_l_free_factor(&factor_, &common_);
    (void)cholmod_l_finish(&common_);
  }
  double entries() const { return static_cast<double>(factor_->xsize); }

  void solve(std::size_t first, std::size_t count) {
    cholmod_dense* f = cholmod_l_zeros(factor_->n, count, CHOLMOD_REAL, &common_);
    for (std::size_t c = 0; c < count; ++c)
      static_cast<double*>(f->x)[c * factor_->n + (first + c) % factor_->n] = 1;
    cholmod_dense* u = cholmod_l_solve(CHOLMOD_A, factor_, f, &common_);
    (void)cholmod_l_free_dense(&u, &common_);
    (void)cholmod_l_free_dense(&f, &common_);
  }

private:
  cholmod_common common_{};
  cholmod_sparse* matrix_ = nullptr;
  cholmod_factor* factor_ = nullptr;
};

void bench_columns(const model::Model& model, double rate) {
  const linalg::StiffnessMatrix matrix = fem::stiffness_matrix(model);
  const std::size_t n = model.nodes.size();
  std::optional<linalg::Factor> factor;
  const Times factorising = measure([&] { factor.emplace(matrix, with_threads(1)); }, 3);
  report("factor", "ffe-precompute", n, 0, 1, factorising,
         static_cast<double>(factor->entries()) * 8e-6, "MB");
  const double norm = linalg::stiffness_norm(matrix);
  std::vector<std::uint32_t> nodes; // every eighth: neighbours in the file are so in the model
  for (std::uint32_t node = 0; node < n; ++node)
    if (node / 8 % 8 == 0)
      nodes.push_back(node);
  const double flops =
      4 * static_cast<double>(factor->entries()) * 3 * static_cast<double>(nodes.size());
  double one_thread = 0, two_threads = 0;
  for (const int threads : {1, 2}) {
    Nowhere nowhere;
    const Times times = measure(
        [&] {
          (void)columns::compliance_columns(matrix, *factor, norm, nodes, with_threads(threads),
                                            nowhere);
        },
        3);
    report("columns", "ffe-precompute", n, 3 * nodes.size(), threads, times,
           flops / times.median * 1e-6, "GFLOP/s of a plain solve");
    report("columns of matrix product", "ffe-precompute", n, 3 * nodes.size(), threads, times,
           flops / times.median * 1e-6 / (rate * threads), "fraction of its rate");
    (threads == 1 ? one_thread : two_threads) =
        times.median / static_cast<double>(3 * nodes.size());
  }
  Peer peer(matrix);
  for (const std::size_t block : std::initializer_list<std::size_t>{32, 128, 512}) {
    const std::size_t count = 1024 / block;
    const Times times = measure(
        [&] {
          for (std::size_t b = 0; b < count; ++b)
            peer.solve(b * block * 17, block);
        },
        3);
    const double each = times.median / 1024;
    char name[64];
    (void)std::snprintf(name, sizeof name, "CHOLMOD solve by %zu", block);
    report("columns", name, n, 1024, 1, times, 4 * peer.entries() / each * 1e-6, "GFLOP/s");
    report("columns of peer", name, n, 1024, 2, times, each / two_threads,
           "times of ours on two threads");
    report("columns of peer", name, n, 1024, 1, times, each / one_thread, "times of ours on one");
  }
}

/// Relaxed columns of one node, one thread: their largest error over the largest number of the
/// direct ones, against the time of one column; and how much longer that is than a direct one.
void bench_relaxation(const char* name, const model::Model& model, bool many) {
  const linalg::StiffnessMatrix matrix = fem::stiffness_matrix(model);
  const linalg::Factor factor(matrix, with_threads(1));
  const double norm = linalg::stiffness_norm(matrix);
  const std::size_t n = model.nodes.size();
  const std::uint32_t node[] = {static_cast<std::uint32_t>(n / 3)};
  Kept exact;
  (void)columns::compliance_columns(matrix, factor, norm, node, with_threads(1), exact);
  std::vector<std::uint32_t> nodes;
  for (std::uint32_t i = 0; i < std::min<std::size_t>(n, 512); ++i)
    nodes.push_back(i);
  Nowhere nowhere;
  const Times direct = measure(
      [&] {
        (void)columns::compliance_columns(matrix, factor, norm, nodes, with_threads(1), nowhere);
      },
      3);
  const double column = direct.median / static_cast<double>(3 * nodes.size());
  const auto relax = [&](const char* program, const dynamics::RelaxOptions& options) {
    Kept found;
    const Times times = measure(
        [&] {
          found.all.clear();
          (void)dynamics::relaxed_columns(model, matrix, factor, norm, node, options,
                                          with_threads(1), found);
        },
        1);
    double error = 0, largest = 0;
    for (std::size_t i = 0; i < exact.all.size(); ++i) {
      const double e = std::abs(found.all[i] - exact.all[i]);
      error = test::larger(error, e);
      largest = test::larger(largest, std::abs(exact.all[i]));
    }
    report((std::string("relaxation of ") + name).c_str(), program, n, 3, 1, times, error / largest,
           "largest error over largest displacement");
    report((std::string("a column relaxed, ") + name).c_str(), program, n, 3, 1, times,
           times.median / 3 / column, "times of a direct one (sample of one node)");
  };
  relax("threshold 5e-06 (the default)", {});
  if (!many)
    return;
  for (const double threshold : {5e-3, 5e-4, 5e-5}) {
    char program[32];
    (void)std::snprintf(program, sizeof program, "threshold %g", threshold);
    relax(program, {.threshold = threshold});
  }
  for (const std::uint64_t steps : std::initializer_list<std::uint64_t>{250, 1000, 4000, 16000})
    relax((std::to_string(steps) + " steps").c_str(), {.steps = steps});
}

model::Model model_of(const TriangleMesh& mesh) {
  return model::build_model(mesh, {}, Context{}).model;
}

} // namespace

int main(int count, char** words) {
  constexpr std::array stages{"columns", "colon", "liver"};
  for (int k = 1; k < count; ++k)
    if (std::ranges::none_of(stages,
                             [&](const char* s) { return std::strcmp(words[k], s) == 0; })) {
      (void)std::fprintf(stderr, "bench_stiffness: %s: expected columns, colon or liver\n",
                         words[k]);
      return 2;
    }
  const auto wanted = [&](const char* stage) {
    return count < 2 || std::any_of(words + 1, words + count,
                                    [&](const char* w) { return std::strcmp(w, stage) == 0; });
  };
  std::puts("stage,program,nodes,columns,threads,median_ms,fastest_ms,slowest_ms,figure,unit");
  TriangleMesh organ = test::load_test_mesh("gca90_large_intestine_20k.stl");
  if (organ.triangles.empty()) {
    (void)std::fputs("stiffness: no shared data, a ball instead\n", stderr);
    organ = test::sphere_mesh(5, 100, {});
  }
  if (wanted("columns"))
    bench_columns(model_of(organ), product_rate());
  if (wanted("colon"))
    bench_relaxation("colon", model_of(organ), false);
  TriangleMesh liver = test::load_test_mesh("sofa_liver_smooth.obj");
  if (liver.triangles.empty())
    liver = test::sphere_mesh(4, 100, {});
  if (wanted("liver"))
    bench_relaxation("liver", model_of(liver), true);
  return EXIT_SUCCESS;
}
