// The sparse factor against CHOLMOD's and against the rate of BLAS's matrix product in the same
// run: a net and blocks of material of several sizes, one and two threads, 1, 3 and 24 right-hand
// sides; one large front; and the memory of 300,000 rows.
//
// Writes CSV to standard output: stage, program, rows, right-hand sides, threads, fastest and
// median time in ms (of the processor where there is one thread), a figure and its unit. Words on
// the command line choose among product, front, net, blocks, memory.

#include "linalg/factor.h"
#include "cholesky/multifrontal.h"
#include "fem/model_stiffness.h"
#include "linalg/stiffness.h"
#include "tests/bench/blas.h"
#include "tests/bench/cholmod_peer.h"
#include "tests/bench/timing.h"
#include "tests/unit/mesh_fixtures.h"
#include "tests/unit/stiffness_models.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <initializer_list>
#include <optional>
#include <string>
#include <sys/resource.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>
#include <vector>

using namespace gewebe;
using namespace gewebe::timing;

namespace {

void report(const char* stage, const char* program, std::size_t rows, std::size_t columns,
            int threads, const Times& times, double figure, const char* unit) {
  std::printf("%s,%s,%zu,%zu,%d,%.3f,%.3f,%.4g,%s\n", stage, program, rows, columns, threads,
              times.fastest, times.median, figure, unit);
  std::fflush(stdout);
}

/// Of the processor on one thread, which others on the machine disturb less.
Times timed(const std::function<void()>& work, int threads, int runs) {
  std::vector<double> times;
  for (int run = 0; run < runs; ++run)
    times.push_back(threads == 1 ? processor_milliseconds(work) : milliseconds(work));
  return times_of(std::move(times));
}

/// GFLOP/s of BLAS at 1024 x 1024 x 1024, and what two threads with one product each gain.
double product_rate() {
  const int n = 1024;
  constexpr std::size_t entries = std::size_t{1024} * 1024;
  const auto product = [&](std::vector<double>& c) {
    static const std::vector<double> a(entries, 0.5), b(entries, 0.25);
    const double one = 1, zero = 0;
    dgemm_("N", "N", &n, &n, &n, &one, a.data(), &n, b.data(), &n, &zero, c.data(), &n);
  };
  std::vector<double> first(entries), second(entries);
  product(first);
  double rate = 0;
  for (const int threads : {1, 2}) {
    const Times times = timed(
        [&] {
          std::optional<std::jthread> other;
          if (threads == 2)
            other.emplace([&] { product(second); });
          product(first);
        },
        threads, 7);
    const double now = 2.0 * threads * n * n * n / times.fastest * 1e-6;
    report("matrix product", "BLAS", n, n, threads, times, now, "GFLOP/s");
    rate = threads == 1 ? now : rate;
  }
  return rate;
}

/// Two fronts, the second as wide as the first is below its columns.
void bench_front(std::size_t eliminated, std::size_t below, double rate) {
  cholesky::FrontTree tree;
  const std::size_t nodes = eliminated + below;
  for (std::uint32_t i = 0; i < nodes; ++i) {
    tree.sequence.push_back(i);
    tree.position.push_back(i);
    if (i >= eliminated)
      tree.boundary.push_back(i);
  }
  tree.first = {0, static_cast<std::uint32_t>(eliminated), static_cast<std::uint32_t>(nodes)};
  tree.parent = {1, cholesky::FrontTree::none};
  tree.start = {0, below, below};
  const std::vector<std::uint8_t> axes(nodes, 3);
  std::vector<cholesky::Front> fronts(2);
  std::vector<double> l(cholesky::measure_fronts(tree, axes, fronts));
  fronts[0].l = l.data();
  fronts[1].l = l.data() + fronts[0].entries();
  const auto assemble = [&](const cholesky::FrontAssembly& to) {
    for (std::size_t c = 0; c < fronts[to.front].columns; ++c) {
      std::fill_n(&to.at(c, c), to.rows - c, -0.5);
      to.at(c, c) = 2.0 * static_cast<double>(l.size());
    }
  };
  double one = 0;
  for (const int threads : {1, 2}) {
    const Times times = timed(
        [&] {
          (void)cholesky::factorise(
              {.tree = tree, .axes = axes, .fronts = fronts, .assemble = assemble}, {},
              with_threads(threads));
        },
        threads, 5);
    double all = 0;
    for (const cholesky::Front& f : fronts)
      all += operations(static_cast<double>(f.columns), static_cast<double>(f.below()));
    const double now = all / times.fastest * 1e-6;
    report("two fronts", "gewebe", 3 * nodes, 3 * eliminated, threads, times, now, "GFLOP/s");
    if (threads == 1) {
      one = times.fastest;
      report("two fronts", "gewebe", 3 * nodes, 3 * eliminated, 1, times, now / rate,
             "of the rate of the product");
    } else {
      report("two fronts", "gewebe", 3 * nodes, 3 * eliminated, 2, times, one / times.fastest,
             "times as quick as one thread");
    }
  }
}

void bench_matrix(const char* stage, const linalg::StiffnessMatrix& matrix, bool peers) {
  const std::size_t rows = matrix.order();
  const int runs = rows > 30000 ? 3 : 7;
  std::optional<linalg::Factor> factor;
  const auto say = [&](const char* what, const char* program, std::size_t columns, int threads,
                       const Times& times, double figure, const char* unit) {
    report((std::string(stage) + ", " + what).c_str(), program, rows, columns, threads, times,
           figure, unit);
  };
  const Times anew = timed([&] { factor.emplace(matrix, with_threads(1)); }, 1, runs);
  say("order and factor", "gewebe", 0, 1, anew, static_cast<double>(factor->entries()) * 8e-6,
      "MB");
  const double all = all_operations(*factor);
  for (const int threads : {1, 2}) {
    const Times times =
        timed([&] { factor->refactor(matrix, with_threads(threads)); }, threads, runs);
    say("factor", "gewebe", 0, threads, times, all / times.fastest * 1e-6, "GFLOP/s");
  }
  std::optional<CholmodPeer> peer;
  if (peers) {
    peer.emplace(matrix);
    const Times order = timed([&] { peer->order(); }, 1, runs);
    const Times times = timed([&] { peer->factorise(); }, 1, runs);
    say("order", "CHOLMOD", 0, 1, order, 0, "");
    say("factor", "CHOLMOD", 0, 1, times, peer->entries() * 8e-6, "MB");
  }
  std::vector<double> f(rows * 24), u(f.size());
  for (std::size_t k = 0; k < f.size(); ++k)
    f[k] = static_cast<double>(k * 7 % 23) - 11;
  for (const std::size_t columns : std::initializer_list<std::size_t>{1, 3, 24}) {
    std::vector<double> ours, theirs;
    for (int turn = 0; turn < 4 * runs; ++turn) { // by turns, so that both see the same machine
      const std::span<double> some(u.data(), rows * columns);
      ours.push_back(processor_milliseconds([&] {
        factor->solve({f.data(), some.size()}, some, columns);
      }));
      if (peer)
        theirs.push_back(processor_milliseconds([&] { peer->solve(f, columns); }));
    }
    const Times own = times_of(ours);
    say("solve", "gewebe", columns, 1, own,
        static_cast<double>(factor->entries()) * 16e-6 / own.fastest, "GB/s of L");
    if (peer) {
      const Times other = times_of(theirs);
      say("solve", "CHOLMOD", columns, 1, other, own.fastest / other.fastest, "ours over its time");
    }
  }
}

/// The most memory that a child process held, in MB, above what it began with.
double peak_memory(const std::function<void()>& work) {
  const pid_t child = fork();
  if (child == 0) {
    work();
    _exit(0);
  }
  rusage used{};
  int status = 0;
  if (wait4(child, &status, 0, &used) != child || status != 0)
    return -1;
  return static_cast<double>(used.ru_maxrss) * 1024e-6;
}

void bench_memory(std::size_t side) {
  const linalg::StiffnessMatrix matrix = fem::stiffness_matrix(test::block_of_material(side));
  const double nothing = peak_memory([] {});
  double ours = 0;
  for (const int threads : {1, 2}) {
    double max = 0;
    const Times times = timed(
        [&] { max = peak_memory([&] { const linalg::Factor f(matrix, with_threads(threads)); }); },
        2, 1);
    ours = threads == 1 ? max - nothing : ours;
    report("memory", "gewebe", matrix.order(), 0, threads, times, max - nothing, "MB");
  }
  double max = 0;
  const Times times = timed(
      [&] {
        max = peak_memory([&] {
          CholmodPeer peer(matrix);
          peer.order();
          peer.factorise();
        });
      },
      2, 1);
  report("memory", "CHOLMOD", matrix.order(), 0, 1, times, max - nothing, "MB");
  report("memory", "gewebe", matrix.order(), 0, 1, times, ours / (max - nothing),
         "times CHOLMOD's");
}

} // namespace

int main(int count, char** words) {
  const auto wanted = [&](const char* stage) {
    return count < 2 || std::any_of(words + 1, words + count,
                                    [&](const char* w) { return std::strcmp(w, stage) == 0; });
  };
  std::puts("stage,program,rows,columns,threads,fastest_ms,median_ms,figure,unit");
  const double rate = wanted("product") || wanted("front") ? product_rate() : 0;
  if (wanted("front"))
    for (const std::size_t below : std::initializer_list<std::size_t>{0, 400, 1000})
      bench_front(400, below, rate);
  if (wanted("net"))
    bench_matrix("net", fem::stiffness_matrix(test::model_of(test::sphere_mesh(5, 100, {}))), true);
  if (wanted("blocks"))
    for (const std::size_t side : std::initializer_list<std::size_t>{12, 20, 28})
      bench_matrix("block", fem::stiffness_matrix(test::block_of_material(side)), true);
  if (wanted("memory"))
    bench_memory(47);
  return EXIT_SUCCESS;
}
