// Cuts of a solid, one behind the other: what each part of a cut takes, in the library and for who
// drives a scene, beside CHOLMOD's full factorisation; errors against a factor of the cut model.
//
// A liver of 25,000 linear tetrahedra (a box of as many where there is no shared data), held at one
// side, cut at random places by small planes that pass through some 24 of them. Times are of the
// processor, in the library on one thread, through the pipe on all of one or two. Arguments: how
// many cuts (200), and `errors`: each cut's shape beside that of a factor of its own.
//
// Writes CSV to standard output: stage, median, 90th and 99th percentile, largest, unit.

#include "cutting/cut_solid.h"
#include "compliance/forward_blocks.h"
#include "cutting/cut.h"
#include "fem/model_stiffness.h"
#include "fem/solid_model.h"
#include "formats/model/ela.h"
#include "linalg/factor.h"
#include "tests/bench/cholmod_peer.h"
#include "tests/bench/served.h"
#include "tests/bench/timing.h"
#include "tests/unit/larger.h"
#include "tests/unit/tet_cut_checks.h"
#include "tests/unit/tet_fixtures.h"
#include "tests/unit/tet_organs.h"
#include "update/cut_stiffness.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <random>
#include <string>
#include <string_view>
#include <vector>

using namespace gewebe;
using namespace gewebe::timing;

namespace {

model::Model solid() {
  tetrahedra::TetMesh mesh = test::organ_tetrahedra("sofa_liver_smooth.obj", 23.3);
  if (mesh.tetrahedra.empty()) {
    (void)std::fputs("cut_solid: no shared data, a box instead\n", stderr);
    mesh = test::box_tetrahedra(16, 16, 16, 5);
  }
  fem::SolidModelOptions options;
  options.material.materials = {{"liver", 1.06e-3, 5000, 1, 0.2, 0.45}};
  options.quadratic = false;
  model::Model model = fem::solid_model(std::move(mesh), options, {});
  Box3 box;
  for (const model::Node& node : model.nodes)
    box.add(node.position);
  for (model::Node& node : model.nodes)
    if (node.position.x < box.min.x + 0.15 * box.size().x)
      node.fixed = model::fixed_all;
  model.name = "liver";
  return model;
}

double mean_edge(const model::Model& model) {
  double sum = 0;
  for (const Tetrahedron& t : model.tetrahedra)
    for (const auto& [a, b] : tetrahedra::tetrahedron_edges)
      sum += norm(model.nodes[t[a]].position - model.nodes[t[b]].position);
  return sum / (6 * static_cast<double>(model.tetrahedra.size()));
}

/// Places and directions, the same in the library and through the pipe.
class Places {
public:
  explicit Places(const model::Model& first) {
    const std::size_t surface = model::surface_count(first);
    for (std::size_t i = 0; i < surface; ++i)
      if (first.nodes[i].fixed == model::fixed_none)
        free_.push_back(first.nodes[i].position);
  }
  Vec3 place() { return free_[random_() % free_.size()]; }
  Vec3 normal() {
    for (;;) {
      const auto part = [&] { return static_cast<double>(random_() % 2001) / 1000 - 1; };
      const Vec3 n{part(), part(), part()};
      if (norm(n) > 0.3 && norm(n) < 1)
        return n / norm(n);
    }
  }

private:
  std::mt19937 random_{11};
  std::vector<Vec3> free_;
};

void tell(const std::string& stage, std::vector<double> values, const char* unit) {
  if (values.empty())
    return;
  std::ranges::sort(values);
  const auto at = [&](double share) {
    return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
  };
  std::printf("%s,%.6g,%.6g,%.6g,%.6g,%s\n", stage.c_str(), at(0.5), at(0.9), at(0.99),
              values.back(), unit);
  std::fflush(stdout);
}

std::vector<std::uint8_t> near(const model::Model& model, const Vec3& place, double radius) {
  std::vector<std::uint8_t> among(model.nodes.size());
  for (std::size_t i = 0; i < among.size(); ++i)
    among[i] = norm(model.nodes[i].position - place) <= radius;
  return among;
}

std::vector<double> some_load(const model::Model& model) {
  std::vector<double> f(3 * model.nodes.size());
  for (std::size_t k = 0; k < f.size(); ++k)
    f[k] = static_cast<double>(k * 7 % 23) - 11;
  return f;
}

double least_margin(const model::Model& model) {
  const tetrahedra::TetMesh mesh = fem::element_mesh(model);
  double least = 180;
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t)
    least = test::smaller(least, test::least_margin(mesh, t));
  return least;
}

/// Shapes under one load, by the factor that follows and by one of its own.
double error_of(const model::Model& model, compliance::ComplianceSource& source) {
  std::vector<double> is = some_load(model), want = is;
  source.solve(is, 1);
  const linalg::StiffnessMatrix matrix = fem::stiffness_matrix(model);
  const linalg::Factor factor(matrix, with_threads(1));
  std::vector<double> rows(matrix.order());
  for (std::size_t k = 0; k < rows.size(); ++k)
    rows[k] = want[static_cast<std::size_t>(matrix.axis_of_row[k])];
  const std::vector<double> forces = rows;
  factor.solve(forces, rows, 1);
  double worst = 0, largest = 0;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const double u = is[static_cast<std::size_t>(matrix.axis_of_row[k])];
    worst = test::larger(worst, std::abs(u - rows[k]));
    largest = test::larger(largest, std::abs(rows[k]));
  }
  return worst / largest;
}

/// Some ten nodes of the surface lie beyond it.
double far_plane(const model::Model& model) {
  std::vector<double> x;
  const std::size_t surface = model::surface_count(model);
  for (std::size_t i = 0; i < surface; ++i)
    x.push_back(model.nodes[i].position.x);
  std::ranges::sort(x);
  return x[x.size() - 11];
}

std::vector<std::uint32_t> far_end(const model::Model& model) {
  const double plane = far_plane(model);
  std::vector<std::uint32_t> nodes;
  for (std::uint32_t i = 0; i < model.nodes.size(); ++i)
    if (model.nodes[i].position.x > plane)
      nodes.push_back(i);
  return nodes;
}

void in_library(const model::Model& first, std::size_t cuts, bool errors) {
  const double radius = 1.72 * mean_edge(first);
  auto model = std::make_shared<const model::Model>(first);
  update::CutStiffness stiffness(model, nullptr, with_threads(1));
  std::printf("first factor,%.6g,,,,ms\n", processor_milliseconds([&] { stiffness.prepare(); }));
  Places places(first);
  std::vector<double> elements, follow, change, some, solve, all, computed, operations, separated,
      error;
  double mass = 0, volume = 0, fresh = 0;
  for (std::size_t attempt = 0; all.size() < cuts && attempt < 5 * cuts; ++attempt) {
    const Vec3 place = places.place(), normal = places.normal();
    const std::vector<std::uint8_t> among = near(*model, place, radius);
    incision::BladeCutOptions options;
    options.among = among;
    cutting::SolidCut cut;
    cutting::CutModel step;
    const double t0 = processor_milliseconds([&] {
      cut = cutting::cut_solid(*model, cutting::plane_blade(*model, {place, normal}), options);
    });
    if (cut.report.doubled == 0)
      continue;
    const auto number = static_cast<double>(cut.report.separated);
    const double t1 =
        processor_milliseconds([&] { step = cutting::as_cut_model(*model, std::move(cut)); });
    cutting::FreeParts parts;
    const double t2 = processor_milliseconds([&] { parts = cutting::free_parts(*model, step); });
    if (!parts.parts.empty())
      continue;
    auto next = std::make_shared<const model::Model>(std::move(step.model));
    update::CutWork work;
    const double t3 =
        processor_milliseconds([&] { work = stiffness.cut(next, step.origin, step.place); });
    const std::shared_ptr<compliance::ComplianceSource> source = stiffness.compliance();
    const std::vector<std::uint32_t> end = far_end(*next);
    const double t5 = processor_milliseconds([&] {
      source->blocks()->need(end);
      (void)source->blocks()->answers(fem::weight_of(*next, {0, 0, -9810}), end);
    });
    std::vector<double> f = some_load(*next);
    const double t4 = processor_milliseconds([&] { source->solve(f, 1); });
    separated.push_back(number);
    elements.push_back(t0);
    follow.push_back(t1 + t2);
    change.push_back(t3);
    some.push_back(t5);
    solve.push_back(t4);
    all.push_back(t0 + t1 + t2 + t3 + t4 + t5);
    computed.push_back(100 * work.factor.operations / work.factor.all_operations);
    operations.push_back(1e-9 * work.factor.operations);
    fresh += work.way == update::CutWay::fresh ? 1 : 0;
    model = next;
    if (errors)
      error.push_back(error_of(*model, *source));
  }
  for (const model::Node& node : model->nodes)
    mass += node.mass;
  volume = signed_volume(model::surface_mesh(*model));
  tell("tetrahedra passed", separated, "tetrahedra");
  tell("elements and surface", elements, "ms");
  tell("nodes and pieces", follow, "ms");
  tell("stiffness and factor", change, "ms");
  tell("some nodes under the weight", some, "ms");
  tell("a shape", solve, "ms");
  tell("all of it", all, "ms");
  tell("share of operations", computed, "%");
  tell("operations", operations, "1e9");
  tell("error of shapes", error, "of the largest");
  std::printf("factors in a new order,%.0f,,,,of %zu\n", fresh, all.size());
  std::printf("mass lost,%.3g,,,,of it\n", std::abs(mass / model::total_mass(first) - 1));
  std::printf("volume lost,%.3g,,,,of it\n",
              std::abs(volume / signed_volume(model::surface_mesh(first)) - 1));
  std::printf("least angle before,%.4g,,,,degrees\n", least_margin(first));
  std::printf("least angle after,%.4g,,,,degrees\n", least_margin(*model));
  const linalg::StiffnessMatrix matrix = fem::stiffness_matrix(*model);
  CholmodPeer peer(matrix, true);
  const double order = processor_milliseconds([&] { peer.order(); });
  std::vector<double> times;
  for (int k = 0; k < 5; ++k)
    times.push_back(processor_milliseconds([&] { peer.factorise(); }));
  std::printf("CHOLMOD's order,%.6g,,,,ms\n", order);
  tell("CHOLMOD's factor", times, "ms");
}

std::string numbers(const Vec3& v, char by) {
  std::array<char, 96> text{};
  (void)std::snprintf(text.data(), text.size(), "%.9g%c%.9g%c%.9g", v.x, by, v.y, by, v.z);
  return text.data();
}

void through_the_pipe(const model::Model& first, std::size_t cuts, bool surfaces, int threads) {
  const std::string tools = std::filesystem::read_symlink("/proc/self/exe").parent_path().string();
  std::string folder = (std::filesystem::temp_directory_path() / "gewebe-bench-XXXXXX").string();
  if (mkdtemp(folder.data()) == nullptr)
    Served::fail("no folder in " + std::filesystem::temp_directory_path().string());
  {
    formats::Output output(folder + "/liver.ela", {});
    formats::write_ela(output, first, Context{});
    output.commit();
  }
  const double radius = 1.72 * mean_edge(first);
  std::vector<double> worked, felt;
  double announced = 0;
  {
    const Served run(tools, folder, threads);
    run.say(std::string("object liver liver.ela method=ffe\nemit forces\n") +
            (surfaces ? "emit surfaces\n" : "") + "gravity 0 0 -9810\ndisplace liver \"x>" +
            std::to_string(far_plane(first)) +
            "\" 0 0 0.1\nstep 0.0166\ntear liver 0\nstep 0.0166\n"); // which announces cuts
    (void)run.hear();
    (void)run.hear();
    announced = run.worked();
    Places places(first);
    for (std::size_t attempt = 0; worked.size() < cuts && attempt < 5 * cuts; ++attempt) {
      const Vec3 place = places.place(), normal = places.normal();
      const std::string cut = "cut liver plane " + numbers(place, ' ') + " " +
                              numbers(normal, ' ') + " sphere:" + numbers(place, ',') + "," +
                              std::to_string(radius) + "\nstep 0.0166\n";
      Served::Answer answer;
      const double before = run.worked();
      const double time = milliseconds([&] {
        run.say(cut);
        answer = run.hear();
      });
      if (answer.refused || answer.doubled == 0)
        continue;
      if (answer.free)
        break;
      worked.push_back(run.worked() - before);
      felt.push_back(time);
    }
  }
  const std::string what = " -j" + std::to_string(threads) + (surfaces ? " with surfaces" : "");
  std::printf("through the pipe%s: before,%.6g,,,,ms\n", what.c_str(), announced);
  if (!worked.empty()) {
    std::printf("through the pipe%s: the first,%.6g,,,,ms\n", what.c_str(), worked[0]);
    std::printf("through the pipe%s: the first by the clock,%.6g,,,,ms\n", what.c_str(), felt[0]);
  }
  tell("through the pipe" + what + ": processor", worked, "ms");
  tell("through the pipe" + what + ": clock", felt, "ms");
  std::filesystem::current_path("/");
  std::filesystem::remove_all(folder);
}

} // namespace

int main(int argc, char** argv) {
  (void)std::signal(SIGPIPE, SIG_IGN);
  std::size_t cuts = 200;
  bool errors = false;
  for (int k = 1; k < argc; ++k)
    if (std::string_view(argv[k]) == "errors")
      errors = true;
    else
      cuts = static_cast<std::size_t>(std::strtoul(argv[k], nullptr, 10));
  const model::Model model = solid();
  std::puts("stage,median,p90,p99,largest,unit");
  std::printf("tetrahedra,%zu,,,,\nnodes,%zu,,,,\n", model.tetrahedra.size(), model.nodes.size());
  in_library(model, cuts, errors);
  for (const int threads : {1, 2})
    for (const bool surfaces : {false, true})
      through_the_pipe(model, cuts, surfaces, threads);
}
