// Contact with an elastostatic organ: how long forces and shapes take when every displacement
// changes at every update, for 30 and 200 nodes, with columns of float64 and float32, with a
// tolerance, and for a rigid grasp; beside the rate at which this machine reads memory. A patient's
// colon (a ball where there is no shared data), the contacts a patch of its surface.
//
// Writes CSV to standard output: stage, program, nodes, contacts, threads, median, fastest and
// slowest time in ms, a figure and its unit.

#include "base/huge_pages.h"
#include "base/parallel.h"
#include "columns/column_sum.h"
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
#include <random>
#include <span>
#include <string>
#include <vector>

using namespace gewebe;
using namespace gewebe::timing;

namespace {

void report(const char* stage, const std::string& program, std::size_t nodes, std::size_t contacts,
            int threads, const Times& times, double figure, const char* unit) {
  std::printf("%s,%s,%zu,%zu,%d,%.4f,%.4f,%.4f,%.4g,%s\n", stage, program.c_str(), nodes, contacts,
              threads, times.median, times.fastest, times.slowest, figure, unit);
  std::fflush(stdout);
}

struct Organ {
  model::Model model;
  linalg::StiffnessMatrix matrix;
  linalg::FactorData factor;
  std::vector<std::uint32_t> patch; ///< ascending
};

/// The surface nodes nearest to one.
std::vector<std::uint32_t> patch_of(const model::Model& model, std::uint32_t centre,
                                    std::size_t count) {
  std::vector<std::pair<double, std::uint32_t>> order;
  for (std::uint32_t i = 0; i < model::surface_count(model); ++i) {
    const Vec3 d = model.nodes[i].position - model.nodes[centre].position;
    order.emplace_back(dot(d, d), i);
  }
  std::sort(order.begin(), order.end());
  std::vector<std::uint32_t> nodes;
  for (std::size_t k = 0; k < std::min(count, order.size()); ++k)
    nodes.push_back(order[k].second);
  std::sort(nodes.begin(), nodes.end());
  return nodes;
}

struct Way {
  std::string name;
  bool single = false;
  double tolerance = 0;
  int threads = 2;
};

std::shared_ptr<compliance::ComplianceSource> compliance_of(const Organ& organ, bool single) {
  return compliance::compliance_of_store(
      memory_stiffness(organ.matrix, organ.factor, organ.patch, single));
}

/// Every displacement changes with every update, as of a surface that is pressed in.
void move_all(contact::Load& load, std::mt19937& random) {
  std::normal_distribution<double> normal;
  const Vec3 push{normal(random), normal(random), normal(random)};
  for (auto& [node, d] : load.displacement)
    d = 0.02 * push + 0.01 * Vec3{normal(random), normal(random), normal(random)};
}

double quantile(std::vector<double> times, double q) {
  std::sort(times.begin(), times.end());
  return times[static_cast<std::size_t>(q * static_cast<double>(times.size() - 1))];
}

void bench_contact(const Organ& organ, std::size_t contacts, const Way& way) {
  const std::size_t n = organ.model.nodes.size();
  statics::Elastostatic object(organ.model, compliance_of(organ, way.single),
                               with_threads(way.threads), {.tolerance = way.tolerance});
  statics::Elastostatic exact(organ.model, compliance_of(organ, false), with_threads(2));
  contact::Load load;
  for (std::size_t k = 0; k < contacts; ++k)
    load.displacement[organ.patch[k * organ.patch.size() / contacts]] = {};
  std::mt19937 random(1);
  for (int k = 0; k < 40; ++k) { // the set is known, and so is that it is not rigid
    move_all(load, random);
    object.update(load);
    (void)object.displacement();
  }
  std::vector<double> forces, shapes;
  const std::uint64_t terms = object.counts().terms, skipped = object.counts().skipped;
  double worst = 0;
  for (int k = 0; k < 1000; ++k) {
    move_all(load, random);
    forces.push_back(milliseconds([&] { object.update(load); }));
  }
  for (int k = 0; k < 200; ++k) {
    move_all(load, random);
    shapes.push_back(milliseconds([&] {
      object.update(load);
      (void)object.displacement();
    }));
    if (k % 40 != 0)
      continue;
    exact.update(load);
    const std::span<const double> a = object.displacement(), b = exact.displacement();
    double difference = 0, size = 0;
    for (std::size_t r = 0; r < a.size(); ++r) {
      difference = test::larger(difference, std::abs(a[r] - b[r]));
      size = test::larger(size, std::abs(b[r]));
    }
    worst = test::larger(worst, difference / size);
  }
  report("contact forces", way.name, n, contacts, way.threads, times_of(forces),
         quantile(forces, 0.99), "ms p99");
  report("contact forces", way.name, n, contacts, way.threads, times_of(forces),
         quantile(forces, 0.999), "ms p99.9");
  report("forces and shape", way.name, n, contacts, way.threads, times_of(shapes),
         quantile(shapes, 0.99), "ms p99");
  report("error of shape", way.name, n, contacts, way.threads, times_of(shapes), worst,
         "of the largest displacement");
  const statics::ElastostaticCounts counts = object.counts();
  report("left out", way.name, n, contacts, way.threads, times_of(shapes),
         static_cast<double>(counts.skipped - skipped) /
             std::max(1.0, static_cast<double>(counts.terms - terms + counts.skipped - skipped)),
         "of the products");
}

/// The whole patch, turned and shifted as one.
void bench_grasp(const Organ& organ) {
  statics::Elastostatic object(organ.model, compliance_of(organ, false), with_threads(2));
  contact::Load load;
  int frame = 0;
  const auto pose = [&] {
    const double turn = 0.01 * std::sin(0.3 * ++frame), c = std::cos(turn), s = std::sin(turn);
    const Vec3 centre = organ.model.nodes[organ.patch[0]].position;
    for (const std::uint32_t node : organ.patch) {
      const Vec3 p = organ.model.nodes[node].position - centre;
      load.displacement[node] =
          Vec3{c * p.x - s * p.y, s * p.x + c * p.y, p.z} - p + Vec3{0, 0, 0.01 * frame};
    }
    object.update(load);
    (void)object.displacement();
  };
  for (int k = 0; k < 20; ++k)
    pose();
  report("forces and shape", "rigid grasp", organ.model.nodes.size(), organ.patch.size(), 2,
         measure(pose, 200), static_cast<double>(object.counts().solves), "solves since the start");
}

/// One node joins, one leaves, as where an instrument slides.
void bench_sliding(const Organ& organ, std::size_t contacts) {
  statics::Elastostatic object(organ.model, compliance_of(organ, false), with_threads(2));
  contact::Load load;
  for (std::size_t k = 0; k < contacts; ++k)
    load.displacement[organ.patch[k]] = {};
  std::mt19937 random(1);
  std::size_t next = contacts;
  const auto slide = [&] {
    load.displacement.erase(organ.patch[(next - contacts) % organ.patch.size()]);
    load.displacement[organ.patch[next++ % organ.patch.size()]] = {};
    move_all(load, random);
    object.update(load);
  };
  for (std::size_t k = 0; k < organ.patch.size(); ++k)
    slide();
  std::vector<double> times;
  for (int k = 0; k < 500; ++k)
    times.push_back(milliseconds(slide));
  report("contact forces, sliding", "float64", organ.model.nodes.size(), contacts, 2,
         times_of(times), quantile(times, 0.99), "ms p99");
}

/// Every byte, and nothing else to do.
long long read_through(const char* from, std::size_t bytes) {
  using Lane = long long __attribute__((vector_size(16), aligned(4), may_alias));
  Lane lanes[8] = {};
  for (std::size_t k = 0; k + 128 <= bytes; k += 128)
    for (std::size_t l = 0; l < 8; ++l)
      lanes[l] |= *reinterpret_cast<const Lane*>(from + k + 16 * l);
  long long all = 0;
  for (const Lane& lane : lanes)
    all |= lane[0] | lane[1];
  return all;
}

/// What a sum of the whole patch's columns takes, against reading as many bytes.
template <class Entry>
void bench_streaming(const Organ& organ, const char* name) {
  const std::size_t axes = 3 * organ.model.nodes.size(), count = 3 * organ.patch.size();
  std::vector<Entry> values;
  resizing(values, axes * count)();
  std::fill(values.begin(), values.end(), Entry{1});
  std::vector<const Entry*> columns;
  for (std::size_t k = 0; k < count; ++k)
    columns.push_back(values.data() + k * axes);
  const std::vector<double> factor(count, 0.5);
  std::vector<double> sum(axes);
  const double bytes = static_cast<double>(sizeof(Entry) * axes * count);
  for (const int threads : {1, 2}) {
    std::vector<double> reads, sums;
    long long kept = 0;
    for (int run = 0; run < 15; ++run) { // in turn, for another program may take the memory
      std::vector<long long> parts(64, 0);
      reads.push_back(milliseconds([&] {
        const std::size_t grain = values.size() * sizeof(Entry) / 64;
        parallel_blocks(with_threads(threads), 64, 1, [&](std::size_t part, std::size_t) {
          parts[part] =
              read_through(reinterpret_cast<const char*>(values.data()) + part * grain, grain);
        });
      }));
      for (const long long part : parts)
        kept |= part;
      sums.push_back(milliseconds([&] {
        parallel_blocks(with_threads(threads), axes, 3072, [&](std::size_t begin, std::size_t end) {
          columns::column_sum<Entry>(best_cpu_level())(columns.data(), factor.data(), count,
                                                       sum.data(), begin, end);
        });
      }));
    }
    if (kept == 0)
      std::puts("nothing was read");
    const Times read = times_of(reads), added = times_of(sums);
    report("reading", name, axes / 3, organ.patch.size(), threads, read, bytes / read.median * 1e-6,
           "GB/s");
    report("adding columns", name, axes / 3, organ.patch.size(), threads, added,
           bytes / added.median * 1e-6, "GB/s");
    report("adding columns", name, axes / 3, organ.patch.size(), threads, added,
           read.median / added.median, "of the rate of reading");
  }
}

void bench_solve(const Organ& organ) {
  const linalg::Factor factor(organ.factor);
  std::vector<double> f(factor.order(), 1), u(factor.order());
  const Times times = measure([&] { factor.solve(f, u); }, 51);
  report("solve", "factor", organ.model.nodes.size(), 1, 1, times,
         16e-6 * static_cast<double>(factor.entries()) / times.median, "GB/s of L, read twice");
}

} // namespace

int main() {
  std::puts("stage,program,nodes,contacts,threads,median_ms,fastest_ms,slowest_ms,figure,unit");
  TriangleMesh mesh = test::load_test_mesh("gca90_large_intestine_20k.stl");
  if (mesh.triangles.empty()) {
    (void)std::fputs("contact: no shared data, a ball instead\n", stderr);
    mesh = test::sphere_mesh(5, 100, {});
  }
  Organ organ{model::build_model(mesh, {}, Context{}).model, {}, {}, {}};
  organ.matrix = fem::stiffness_matrix(organ.model);
  organ.factor = linalg::Factor(organ.matrix, Context{}).data();
  organ.patch = patch_of(organ.model, 1000, 200);
  bench_streaming<double>(organ, "float64");
  bench_streaming<float>(organ, "float32");
  bench_solve(organ);
  for (const std::size_t contacts : {std::size_t{30}, std::size_t{200}})
    for (const Way& way : {Way{"float64"}, Way{"float32", true}, Way{"float64 1e-3", false, 1e-3},
                           Way{"float32 1e-3", true, 1e-3}})
      bench_contact(organ, contacts, way);
  bench_sliding(organ, 30);
  bench_grasp(organ);
  return EXIT_SUCCESS;
}
