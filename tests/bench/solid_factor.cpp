// The factor of elastic solids, quadratic tetrahedra that fill a spleen, beside CHOLMOD's with
// OpenBLAS and PARDISO's of MKL (pypardiso, $PYTHON says which Python): order, factor, memory, on
// one thread and on two. The programs take turns, each in a process of its own. A BLAS that has one
// thread has no second line; $OPENBLAS_NUM_THREADS is set for one that has more.
//
// The spleen is that of $GEWEBE_SHARED/data; without it a box of as many tetrahedra. Words on the
// command line choose among small (7,000 tetrahedra), large (70,000) and huge (100,000, not made
// unless it is asked for); without one, small and large.
//
// Writes CSV to standard output: stage, program, rows, tetrahedra, threads, fastest and median time
// of the factor in ms (of the processor where there is one thread), median time of the order, the
// fastest rate (by the operations of the program's own order) and its unit, MB of L, MB of memory
// at most beside the matrix, backward error of a solution.

#include "base/error.h"
#include "fem/model_stiffness.h"
#include "fem/solid_model.h"
#include "formats/model/ela.h"
#include "linalg/condition.h"
#include "tests/bench/cholmod_peer.h"
#include "tests/bench/peer.h"
#include "tests/bench/timing.h"
#include "tests/unit/larger.h"
#include "tests/unit/tet_fixtures.h"

#include <dlfcn.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <string>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

using namespace gewebe;
using namespace gewebe::timing;

namespace {

struct Measured {
  double order = 0, factor = 0; ///< ms
  double operations = 0, l = 0; ///< of L MB
  double peak = 0;              ///< MB
  double error = 0;
};

double one_time(const std::function<void()>& work, int threads) {
  return threads == 1 ? processor_milliseconds(work) : milliseconds(work);
}

std::vector<double> some_load(std::size_t rows) {
  std::vector<double> f(rows);
  for (std::size_t k = 0; k < rows; ++k)
    f[k] = static_cast<double>(k * 7 % 23) - 11;
  return f;
}

double error_of(const linalg::StiffnessMatrix& matrix, const std::vector<double>& x) {
  return linalg::backward_error(matrix, linalg::stiffness_norm(matrix), x,
                                some_load(matrix.order()));
}

/// In a process of its own, whose memory above that of one that does nothing is told. The threads
/// of this one would not go along, and those of the other would be missing: so this one has none.
std::optional<Measured> apart(const std::function<Measured()>& work) {
  const auto child = [](const std::function<Measured()>& measure, rusage& used) {
    std::array<int, 2> ends{};
    std::optional<Measured> result;
    if (pipe(ends.data()) != 0)
      return result;
    const pid_t process = fork();
    if (process == 0) {
      const Measured m = measure();
      _exit(write(ends[1], &m, sizeof m) == sizeof m ? 0 : 1);
    }
    close(ends[1]);
    Measured m;
    const bool whole = read(ends[0], &m, sizeof m) == sizeof m;
    close(ends[0]);
    int status = 0;
    if (process > 0 && wait4(process, &status, 0, &used) == process && status == 0 && whole)
      result = m;
    return result;
  };
  rusage nothing{}, used{};
  (void)child([] { return Measured{}; }, nothing);
  std::optional<Measured> m = child(work, used);
  if (m)
    m->peak = static_cast<double>(used.ru_maxrss - nothing.ru_maxrss) * 1024e-6;
  return m;
}

Measured ours(const linalg::StiffnessMatrix& matrix, int threads) {
  Measured m;
  std::optional<linalg::Factor> factor;
  const double all = one_time([&] { factor.emplace(matrix, with_threads(threads)); }, threads);
  m.factor = one_time([&] { factor->refactor(matrix, with_threads(threads)); }, threads);
  m.order = std::max(all - m.factor, 0.0);
  m.operations = all_operations(*factor);
  m.l = static_cast<double>(factor->entries()) * 8e-6;
  std::vector<double> x(matrix.order());
  factor->solve(some_load(matrix.order()), x);
  m.error = error_of(matrix, x);
  return m;
}

Measured cholmod(const linalg::StiffnessMatrix& matrix, int threads) {
  Measured m;
  CholmodPeer peer(matrix, true);
  m.order = one_time([&] { peer.order(); }, threads);
  m.operations = peer.operations();
  m.factor = one_time([&] { peer.factorise(); }, threads);
  m.l = peer.entries() * 8e-6;
  std::vector<double> x(matrix.order());
  peer.solve(some_load(matrix.order()), 1, x.data());
  m.error = error_of(matrix, x);
  return m;
}

/// Whether the BLAS of CHOLMOD can have several threads.
bool blas_has_threads() {
  const auto parallel = reinterpret_cast<int (*)()>(dlsym(RTLD_DEFAULT, "openblas_get_parallel"));
  return parallel != nullptr && parallel() != 0;
}
void set_blas_threads(int threads) {
  if (const auto set =
          reinterpret_cast<void (*)(int)>(dlsym(RTLD_DEFAULT, "openblas_set_num_threads")))
    set(threads);
}

void write_matrix(const std::string& path, const linalg::StiffnessMatrix& matrix) {
  std::ofstream file(path, std::ios::binary);
  const auto put = [&](const auto& list) {
    file.write(reinterpret_cast<const char*>(list.data()),
               static_cast<std::streamsize>(list.size() * sizeof list[0]));
  };
  put(std::array<std::uint64_t, 2>{matrix.order(), matrix.row.size()});
  put(matrix.column_start);
  put(matrix.row);
  put(matrix.value);
  if (!file.flush())
    throw Error(path, "cannot be written");
}

std::optional<Measured> pardiso(const std::string& path, int threads) {
  const std::vector<double> n = numbers_of_script("tests/bench/solid_factor_pardiso.py '" + path +
                                                  "' " + std::to_string(threads));
  if (n.size() != 6)
    return std::nullopt;
  return Measured{n[0], n[1], n[2], n[3], n[4], n[5]};
}

/// Some of the spleen's nodes are held at its end.
model::Model spleen(const std::string& surface, const std::string& programs, double cell,
                    const std::string& folder) {
  const std::string path = folder + "/spleen.ela";
  const std::string call =
      "'" + programs + "/exp2ela' -q --material liver --unit m --solid --cell " +
      std::to_string(cell) + " --fix 'x<56.5' '" + surface + "' -o '" + path + "'";
  if (std::system(call.c_str()) != 0)
    throw Error(surface, "is not filled by exp2ela");
  formats::Input input(path);
  return formats::read_ela(input, with_threads(1));
}

model::Model box(std::size_t tetrahedra) {
  const auto side =
      static_cast<std::uint32_t>(std::cbrt(static_cast<double>(tetrahedra) / 6)); // per cube
  fem::SolidModelOptions options;
  options.material.materials = {{"gel", 1e-3, 5000, 1, 0.2, 0.45}};
  model::Model model =
      fem::solid_model(test::box_tetrahedra(side, side, side), options, with_threads(1));
  for (model::Node& node : model.nodes)
    if (node.position.z == 0)
      node.fixed = model::fixed_all;
  return model;
}

struct Size {
  const char* name;
  std::size_t tetrahedra;
  double cell; ///< of the spleen's filling
  int runs;
};

void bench(const Size& size, const model::Model& model, const std::string& folder) {
  const linalg::StiffnessMatrix matrix = fem::stiffness_matrix(model, {}, with_threads(1));
  const std::string path = folder + "/matrix";
  write_matrix(path, matrix);
  struct Line {
    const char* program;
    int threads;
    std::function<std::optional<Measured>()> measure;
    std::vector<Measured> runs{};
  };
  std::vector<Line> lines;
  for (const int threads : {1, 2}) {
    lines.push_back({"gewebe", threads,
                     [&matrix, threads] { return apart([&] { return ours(matrix, threads); }); }});
    if (threads == 1 || blas_has_threads())
      lines.push_back({"CHOLMOD with OpenBLAS", threads, [&matrix, threads] {
                         set_blas_threads(threads);
                         return apart([&] { return cholmod(matrix, threads); });
                       }});
    else
      (void)std::fputs("CHOLMOD: the BLAS installed has one thread\n", stderr);
    lines.push_back({"PARDISO", threads, [&path, threads] { return pardiso(path, threads); }});
  }
  for (int run = 0; run < size.runs; ++run)
    for (Line& line : lines)
      if (const std::optional<Measured> m = line.measure())
        line.runs.push_back(*m);
  for (const Line& line : lines) {
    if (line.runs.empty()) {
      std::fprintf(stderr, "%s: not installed, or failed: skipped\n", line.program);
      continue;
    }
    std::vector<double> factor, order;
    double peak = 0;
    for (const Measured& m : line.runs) {
      factor.push_back(m.factor);
      order.push_back(m.order);
      peak = test::larger(peak, m.peak);
    }
    const Measured& m = line.runs.front();
    const Times times = times_of(factor);
    std::printf("factor of a solid: %s,%s,%zu,%zu,%d,%.1f,%.1f,%.1f,%.4g,GFLOP/s,%.1f,%.1f,%.2g\n",
                size.name, line.program, matrix.order(), model.tetrahedra.size(), line.threads,
                times.fastest, times.median, times_of(order).median,
                m.operations / times.fastest * 1e-6, m.l, peak, m.error);
    std::fflush(stdout);
  }
  std::filesystem::remove(path);
}

} // namespace

int main(int count, char** words) {
  const std::array<Size, 3> sizes{
      {{"small", 7000, 7.1, 3}, {"large", 70000, 2.92, 1}, {"huge", 100000, 2.52, 1}}};
  const auto wanted = [&](const Size& size) {
    return count < 2 ? std::strcmp(size.name, "huge") != 0
                     : std::any_of(words + 1, words + count,
                                   [&](const char* w) { return std::strcmp(w, size.name) == 0; });
  };
  const char* const shared = std::getenv("GEWEBE_SHARED");
  const std::string surface =
      std::string(shared != nullptr ? shared : "../shared") + "/data/hubmap_F_spleen_uv.obj";
  const std::string programs = std::filesystem::canonical("/proc/self/exe").parent_path().string();
  std::string folder = (std::filesystem::temp_directory_path() / "gewebe-bench-XXXXXX").string();
  if (mkdtemp(folder.data()) == nullptr)
    return EXIT_FAILURE;
  std::puts("stage,program,rows,tetrahedra,threads,fastest_ms,median_ms,order_ms,figure,unit,l_mb,"
            "peak_mb,error");
  int status = EXIT_SUCCESS;
  try {
    for (const Size& size : sizes)
      if (wanted(size))
        bench(size,
              std::filesystem::exists(surface) ? spleen(surface, programs, size.cell, folder)
                                               : box(size.tetrahedra),
              folder);
  } catch (const Error& error) {
    std::fprintf(stderr, "solid_factor: %s\n", error.what());
    status = EXIT_FAILURE;
  }
  std::filesystem::remove_all(folder);
  return status;
}
