// The stiffness store: how its size follows from the number of objects, how time, memory and size
// grow with the number of nodes, and how fast columns reach the disk beside a plain write of as
// many bytes in the same folder. Balls with four central nodes each. Files stand in the folder
// TMPDIR, /tmp if there is none, and go with the program.
//
// Writes CSV to standard output: stage, program, nodes (of the whole scene), columns, threads,
// median, fastest and slowest time in ms, a figure and its unit.

#include "columns/compliance_columns.h"
#include "fem/model_stiffness.h"
#include "formats/store/stiffness_store_writer.h"
#include "linalg/condition.h"
#include "model/build.h"
#include "model/primitive.h"
#include "tests/bench/timing.h"
#include "tests/unit/scratch.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fcntl.h>
#include <filesystem>
#include <initializer_list>
#include <string>
#include <sys/resource.h>
#include <unistd.h>
#include <utility>
#include <vector>

using namespace gewebe;
using namespace gewebe::test;
using namespace gewebe::timing;

namespace {

void report(const char* stage, const std::string& program, std::size_t nodes, std::size_t columns,
            int threads, const Times& times, double figure, const char* unit) {
  std::printf("%s,%s,%zu,%zu,%d,%.3f,%.3f,%.3f,%.6g,%s\n", stage, program.c_str(), nodes, columns,
              threads, times.median, times.fastest, times.slowest, figure, unit);
  std::fflush(stdout);
}

/// A ball cut into rings, of some `nodes` nodes.
model::Model ball(std::size_t nodes) {
  const auto rings = static_cast<std::size_t>(std::sqrt(static_cast<double>(nodes) / 2));
  model::BuildOptions options;
  options.centrals = 4;
  return model::build_model(
             model::primitive_mesh(model::parse_primitive(
                 "sphere:" + std::to_string(2 * rings) + "x" + std::to_string(rings), "")),
             options, Context{})
      .model;
}

std::vector<std::uint32_t> all_nodes(const model::Model& model, bool wanted) {
  std::vector<std::uint32_t> nodes(wanted ? model.nodes.size() : 0);
  for (std::size_t i = 0; i < nodes.size(); ++i)
    nodes[i] = static_cast<std::uint32_t>(i);
  return nodes;
}

struct Made {
  std::uint64_t bytes = 0;
  double columns = 0; ///< ms
};

/// A store of equal objects in a file of its own.
Made make_store(const model::Model& model, std::size_t objects, bool columns, bool single,
                int threads) {
  const ScratchFile file(".h5");
  Made made;
  {
    formats::Output output(file.path(), {});
    formats::StiffnessStoreWriter writer(output);
    for (std::size_t k = 0; k < objects; ++k) {
      const linalg::StiffnessMatrix matrix = fem::stiffness_matrix(model);
      linalg::StiffnessCheck check;
      const linalg::Factor factor =
          linalg::checked_factor(model, matrix, with_threads(threads), check);
      formats::StiffnessFacts facts;
      facts.object = "ball" + std::to_string(k);
      facts.hash = formats::stiffness_hash(model);
      facts.rest = formats::rest_hash(model);
      facts.nodes = model.nodes.size();
      facts.order = matrix.order();
      facts.norm = check.norm;
      facts.condition = check.condition;
      facts.single = single;
      const auto nodes = writer.begin(facts, matrix, factor, all_nodes(model, columns));
      made.columns += milliseconds([&] {
        (void)columns::compliance_columns(matrix, factor, check.norm, nodes, with_threads(threads),
                                          writer);
      });
      (void)writer.end(check.residual);
    }
    writer.close();
    output.commit();
  }
  made.bytes = std::filesystem::file_size(file.path());
  return made;
}

/// What k equal objects take: columns 72 n²/k bytes, and the rest.
void bench_size() {
  const std::size_t nodes = 2000;
  for (const std::size_t k : std::initializer_list<std::size_t>{1, 2, 5, 10}) {
    const model::Model model = ball(nodes / k);
    const std::size_t n = k * model.nodes.size();
    const double expected = 72.0 * static_cast<double>(n * n) / static_cast<double>(k);
    const std::string program = std::to_string(k) + " objects";
    Made factor, all, half;
    const Times alone = measure([&] { factor = make_store(model, k, false, false, 1); }, 3);
    report("size of factor", program, n, 0, 1, alone, static_cast<double>(factor.bytes) * 1e-6,
           "MB");
    const Times times = measure([&] { all = make_store(model, k, true, false, 2); }, 3);
    const auto share = [&](const Made& made, double of) {
      return static_cast<double>(made.bytes - factor.bytes) / of;
    };
    report("size of columns", program, n, 3 * n, 2, times, share(all, expected), "of 72 n^2/k");
    const Times single = measure([&] { half = make_store(model, k, true, true, 2); }, 3);
    report("size of columns", program + " float32", n, 3 * n, 2, single, share(half, expected),
           "of 72 n^2/k");
  }
  const model::Model organ = ball(10000);
  Made made;
  const Times times = measure([&] { made = make_store(organ, 1, false, false, 1); }, 3);
  report("size of factor", "10000 nodes", organ.nodes.size(), 0, 1, times,
         static_cast<double>(made.bytes) * 1e-6, "MB");
}

double peak_memory() {
  rusage usage{};
  (void)getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) * 1024e-6; // MB
}

/// The exponent of a power law through points (nodes, figure), by least squares of logarithms.
double slope(const std::vector<std::pair<double, double>>& points) {
  double x = 0, y = 0, xx = 0, xy = 0;
  const auto count = static_cast<double>(points.size());
  for (const auto& [nodes, figure] : points) {
    x += std::log(nodes) / count;
    y += std::log(figure) / count;
  }
  for (const auto& [nodes, figure] : points) {
    xx += (std::log(nodes) - x) * (std::log(nodes) - x);
    xy += (std::log(nodes) - x) * (std::log(figure) - y);
  }
  return xy / xx;
}

/// Of factor-only stores; the stage "scaling" is drawn over the number of nodes.
void bench_scaling() {
  struct Line {
    const char *name, *unit;
    std::vector<std::pair<double, double>> points;
  };
  std::array<Line, 3> lines{Line{"time", "ms", {}}, {"store", "MB", {}}, {"peak memory", "MB", {}}};
  std::vector<Times> all;
  for (const std::size_t nodes :
       std::initializer_list<std::size_t>{1000, 3000, 10000, 30000, 100000}) {
    const model::Model model = ball(nodes);
    const auto n = static_cast<double>(model.nodes.size());
    Made made;
    all.push_back(
        measure([&] { made = make_store(model, 1, false, false, 1); }, nodes > 10000 ? 1 : 3));
    lines[0].points.emplace_back(n, all.back().median);
    lines[1].points.emplace_back(n, static_cast<double>(made.bytes) * 1e-6);
    lines[2].points.emplace_back(n, peak_memory());
  }
  for (const Line& line : lines) {
    char program[64];
    (void)std::snprintf(program, sizeof program, "%s in %s; n^%.2f", line.name, line.unit,
                        slope(line.points));
    for (std::size_t k = 0; k < all.size(); ++k)
      report("scaling", program, static_cast<std::size_t>(line.points[k].first), 0, 1, all[k],
             line.points[k].second, "ms or MB");
  }
}

/// Columns into a file, and as many bytes from one block of memory.
void bench_disk() {
  const model::Model model = ball(4000);
  Made made;
  const Times times = measure([&] { made = make_store(model, 1, true, false, 2); }, 3);
  const double bytes = static_cast<double>(made.bytes);
  report("columns to disk", "ffe-precompute", model.nodes.size(), 3 * model.nodes.size(), 2, times,
         bytes / made.columns * 1e-6, "GB/s of solving and writing");
  const std::vector<char> block(std::size_t{1} << 20, 'x');
  const Times plain = measure(
      [&] {
        const ScratchFile file;
        const int fd = ::open(file.path().c_str(), O_WRONLY | O_TRUNC | O_CLOEXEC);
        for (std::uint64_t at = 0; at < made.bytes; at += block.size())
          if (::write(fd, block.data(), block.size()) < 0)
            std::exit(EXIT_FAILURE);
        (void)::close(fd);
      },
      3);
  report("columns to disk", "write(2)", model.nodes.size(), 3 * model.nodes.size(), 1, plain,
         bytes / plain.median * 1e-6, "GB/s");
}

} // namespace

int main() {
  std::puts("stage,program,nodes,columns,threads,median_ms,fastest_ms,slowest_ms,figure,unit");
  bench_scaling(); // first, since the peak of memory never falls
  bench_size();
  bench_disk();
  return EXIT_SUCCESS;
}
