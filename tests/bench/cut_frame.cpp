// A cut as who drives a scene feels it: from the moment the command is written into the pipe until
// the forces on the displaced nodes (and the shape) have been answered, by ffe-run on one thread. A
// patient's colon (a ball where there is no shared data) with and without bending springs, cut at
// random places, one cut behind the other, while some nodes are held displaced; with and without a
// store of their columns. The first cut, which makes the factor that others refactor in part,
// counts apart; where a cut frees something, the organ is there whole again.
//
// Writes CSV to standard output: stage ("… over …": what stands in the third column), program,
// springs gone and nodes doubled in the mean, nodes, contacts, median, fastest and 99th percentile
// in ms, a figure and its unit.

#include "formats/model/ela.h"
#include "model/build.h"
#include "tests/bench/served.h"
#include "tests/bench/timing.h"
#include "tests/unit/mesh_fixtures.h"
#include "tests/unit/random_cuts.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <spawn.h>
#include <string>
#include <sys/wait.h>
#include <unistd.h>
#include <utility>
#include <vector>

using namespace gewebe;
using namespace gewebe::timing;

namespace {

constexpr int max_cuts = 200, max_runs = 12;
constexpr double picture = 1000.0 / 60; // ms

[[noreturn]] void fail(const std::string& why) {
  Served::fail(why);
}

std::string numbers(std::initializer_list<double> values) {
  std::string text;
  for (const double v : values) {
    std::array<char, 32> one{};
    (void)std::snprintf(one.data(), one.size(), "%.9g", v);
    text += (text.empty() ? "" : " ") + std::string(one.data());
  }
  return text;
}

struct Scene {
  std::string tools, folder;
  model::Model model;
  const char* name = "";
  std::vector<std::uint32_t> free;                    // nodes of the surface that can move
  std::vector<std::vector<std::uint32_t>> neighbours; // by node, along edges
};

std::string with_commas(std::string text) {
  std::replace(text.begin(), text.end(), ' ', ',');
  return text;
}

std::vector<std::uint32_t> by_distance(const Scene& scene, std::uint32_t middle) {
  std::vector<std::uint32_t> nodes = scene.free;
  std::ranges::sort(nodes, {}, [&](std::uint32_t i) {
    const Vec3 d = scene.model.nodes[i].position - scene.model.nodes[middle].position;
    return dot(d, d);
  });
  return nodes;
}

/// Nodes of the surface next to one.
std::string patch(const Scene& scene, std::uint32_t middle, std::size_t count) {
  const std::vector<std::uint32_t> nodes = by_distance(scene, middle);
  std::string text;
  for (std::size_t k = 0; k < count; ++k)
    text += (k == 0 ? "" : ",") + std::to_string(nodes[k]);
  return text;
}

/// Springs around a place, one of each node and none beside another's, so that nothing hangs loose.
struct Pairs {
  std::vector<std::uint32_t> from, to;
};

Pairs springs_near(const Scene& scene, std::uint32_t middle, std::size_t count) {
  std::vector<std::uint8_t> taken(scene.model.nodes.size());
  Pairs pairs;
  for (const std::uint32_t node : by_distance(scene, middle)) {
    const std::vector<std::uint32_t>& next = scene.neighbours[node];
    if (taken[node] != 0 || next.empty() ||
        std::ranges::any_of(next, [&](std::uint32_t n) { return taken[n] != 0; }))
      continue;
    pairs.from.push_back(node);
    pairs.to.push_back(next[0]);
    for (const std::uint32_t end : {node, next[0]})
      for (const std::uint32_t n : scene.neighbours[end])
        taken[n] = 1;
    if (pairs.to.size() == count)
      break;
  }
  return pairs;
}

std::string list(std::vector<std::uint32_t> nodes) {
  std::ranges::sort(nodes);
  std::string text;
  for (const std::uint32_t node : nodes)
    text += (text.empty() ? "" : ",") + std::to_string(node);
  return text;
}

std::string spring_cut(const Scene& scene, std::mt19937& random, double count) {
  const Pairs pairs = springs_near(scene, scene.free[random() % scene.free.size()],
                                   static_cast<std::size_t>(count));
  return "springs " + list(pairs.from) + " " + list(pairs.to);
}

std::string plane_cut(const Scene& scene, std::mt19937& random, double edges) {
  const Vec3 at = scene.model.nodes[scene.free[random() % scene.free.size()]].position;
  const auto part = [&] { return static_cast<double>(random() % 2001) / 1000 - 1; };
  const Vec3 normal{part(), part(), part()};
  const double edge = test::mean_edge(scene.model);
  return "plane " + numbers({at.x + 0.3 * edge, at.y, at.z, normal.x, normal.y, normal.z}) +
         " sphere:" + with_commas(numbers({at.x, at.y, at.z, edges * edge}));
}

struct Kind {
  const char* name;
  std::string (*cut)(const Scene&, std::mt19937&, double);
};

/// Cuts of one size, one behind the other.
void bench(const Scene& scene, const Kind& kind, double size, std::size_t contacts, bool stored,
           bool shapes) {
  std::mt19937 random(7);
  std::vector<double> times, firsts;
  double gone = 0, doubled = 0;
  for (int run_number = 0; run_number < max_runs && times.size() < max_cuts; ++run_number) {
    const Served run(scene.tools, scene.folder);
    run.say("object organ organ.ela method=ffe" + std::string(stored ? " store=organ.h5" : "") +
            "\nemit forces\n" + (shapes ? "emit shapes\n" : ""));
    const std::uint32_t held = scene.free[scene.free.size() / 2];
    run.say("displace organ " + patch(scene, held, contacts) + " 0 0 1\nstep 0.0166\n");
    (void)run.hear();
    bool first = true;
    for (int attempt = 0; attempt < 2 * max_cuts && times.size() < max_cuts; ++attempt) {
      const std::string cut = "cut organ " + kind.cut(scene, random, size) + "\nstep 0.0166\n";
      Served::Answer answer;
      const double time = milliseconds([&] {
        run.say(cut);
        answer = run.hear();
      });
      if (answer.free) // elastodynamic from now on
        break;
      if (answer.refused || answer.gone == 0)
        continue;
      (first ? firsts : times).push_back(time);
      if (first) {
        first = false;
        continue;
      }
      gone += static_cast<double>(answer.gone);
      doubled += static_cast<double>(answer.doubled);
    }
  }
  if (times.empty()) {
    (void)std::fprintf(stderr, "cut_frame: %s of size %g leave nothing that holds\n", kind.name,
                       size);
    return;
  }
  std::ranges::sort(times);
  const auto count = static_cast<double>(times.size());
  const std::string program = std::string(kind.name) + (stored ? " stored columns " : " ") +
                              std::to_string(contacts) + (contacts == 1 ? " node" : " nodes") +
                              (shapes ? " with shapes" : "");
  const double slow = times[times.size() * 99 / 100];
  std::printf(
      "%s: whole cut over springs,%s,%.0f,%.0f,%zu,%zu,%.2f,%.2f,%.2f,%.3g,pictures of 1/60 "
      "s (99th percentile of %zu cuts)\n",
      scene.name, program.c_str(), gone / count, doubled / count, scene.model.nodes.size(),
      contacts, times[times.size() / 2], times.front(), slow, slow / picture, times.size());
  const Times first = times_of(firsts);
  std::printf("%s: first cut over springs,%s,%.0f,%.0f,%zu,%zu,%.2f,%.2f,%.2f,%.3g,ms\n",
              scene.name, program.c_str(), gone / count, doubled / count, scene.model.nodes.size(),
              contacts, first.median, first.fastest, first.slowest, first.median);
  std::fflush(stdout);
}

void bench_model(Scene& scene, const TriangleMesh& mesh, bool bend) {
  model::BuildOptions options;
  options.bend = bend;
  scene.model = model::build_model(mesh, options, Context{}).model;
  scene.free.clear();
  scene.neighbours.assign(scene.model.nodes.size(), {});
  for (std::uint32_t i = 0; i < model::surface_count(scene.model); ++i)
    if (scene.model.nodes[i].fixed == model::fixed_none)
      scene.free.push_back(i);
  for (const model::Spring& s : scene.model.springs)
    if (s.kind == model::SpringKind::edge) {
      scene.neighbours[s.i].push_back(s.j);
      scene.neighbours[s.j].push_back(s.i);
    }
  {
    formats::Output output(scene.folder + "/organ.ela", {});
    formats::write_ela(output, scene.model, Context{});
    output.commit();
  }
  const std::uint32_t held = scene.free[scene.free.size() / 2];
  const std::string store = "cd '" + scene.folder + "' && '" + scene.tools +
                            "/ffe-precompute' -q --columns " + patch(scene, held, 40) +
                            " organ.ela -o organ.h5";
  if (std::system(store.c_str()) != 0)
    fail("no store");
  const Kind springs{"springs removed", spring_cut}, planes{"planes", plane_cut};
  for (const double count : {1.0, 24.0, 100.0})
    for (const std::size_t contacts : {std::size_t{1}, std::size_t{12}})
      bench(scene, springs, count, contacts, false, false);
  bench(scene, springs, 24, 12, true, false);
  bench(scene, springs, 24, 12, false, true);
  if (!bend)
    return;
  for (const double edges : {2.0, 3.0, 5.0})
    for (const std::size_t contacts : {std::size_t{1}, std::size_t{12}})
      bench(scene, planes, edges, contacts, false, false);
  bench(scene, planes, 3, 12, true, false);
  bench(scene, planes, 3, 12, false, true);
}

} // namespace

int main() {
  (void)std::signal(SIGPIPE, SIG_IGN);
  Scene scene;
  scene.tools = std::filesystem::read_symlink("/proc/self/exe").parent_path().string();
  scene.folder = (std::filesystem::temp_directory_path() / "gewebe-bench-XXXXXX").string();
  if (mkdtemp(scene.folder.data()) == nullptr)
    fail("no folder in " + std::filesystem::temp_directory_path().string());
  TriangleMesh mesh = test::load_test_mesh("gca90_large_intestine_20k.stl");
  if (mesh.triangles.empty()) {
    (void)std::fputs("cut_frame: no shared data, a ball instead\n", stderr);
    mesh = test::sphere_mesh(5, 100, {});
  }
  std::puts("stage,program,springs,doubled,nodes,contacts,median_ms,fastest_ms,p99_ms,figure,unit");
  scene.name = "edges alone";
  bench_model(scene, mesh, false);
  scene.name = "bending springs";
  bench_model(scene, mesh, true);
  std::filesystem::current_path("/");
  std::filesystem::remove_all(scene.folder);
  return EXIT_SUCCESS;
}
