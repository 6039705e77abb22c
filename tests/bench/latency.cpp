// Whether ffe-run --serve answers a thousand times a second: a ball of 10,246 nodes by the method
// ffe, along which several spheres slide, each wholly anew in every step of 1 ms, so that what is
// touched changes all the time. Forces and instruments are answered through a pipe; the client
// asks by the clock, once a millisecond.
//
//   bench_latency [SECONDS] [spheres=N] [depth=EDGES] [awake] [fifo] [store] [report] [to=FOLDER]
//
// awake: ffe-run waits for lines without sleep (--busy-wait). fifo: both programs have real-time
// priority, where that is permitted; with awake, where such programs may take all of a processor's
// time (kernel.sched_rt_runtime_us is -1). store: the net's columns are stored before, compressed
// within 1e-4, so that what is touched first costs no more than the rest. Where FOLDER is named,
// latency.csv there becomes the histogram and latency.svg its picture, work.csv and work.svg those
// of the processor's time, memory.csv what ffe-run had in memory, by the second, and memory.svg its
// picture.
//
// report: ten minutes with three spheres and a store, awake, unless other words say otherwise. It
// prints a table, a histogram and the memory at the start and at the end as text instead of CSV:
//
//   build/release/bench_latency report to=build/latency
//   build/release/bench_latency report fifo to=build/latency-real-time
//
// Writes CSV to standard output: stage, program, nodes, contacts (nodes with a force, in the mean),
// answers, what half, 99 % and 99.9 % of all did not exceed and the largest, a figure and its unit.
// "latency" counts from writing the lines until the answer is there; "work" is the processor's time
// of ffe-run between two answers, which other programs disturb less; with awake its waiting is
// among it. "faults" and "switches" count pages that ffe-run had to wait for while it answered, and
// how often its processor was taken away: who compares "latency" with "work" by them knows whether
// the machine or the program was late.

#include "formats/model/ela.h"
#include "model/build.h"
#include "tests/bench/histogram.h"
#include "tests/bench/served.h"
#include "tests/unit/mesh_fixtures.h"
#include "tests/unit/random_cuts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <random>
#include <sched.h>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

using namespace gewebe;
using namespace gewebe::timing;

namespace {

constexpr double tick = 1e-3;         // s
constexpr double ball = 60;           // mm
constexpr double speed = 40;          // mm/s
constexpr double radius_in_edges = 2; // of an instrument
constexpr std::string_view report_word = "report";

struct Wanted {
  double seconds = 10, depth = 0.5;
  std::size_t spheres = 5;
  bool awake = false, fifo = false, store = false, report = false;
  std::string folder;
};

Wanted wanted(int argc, char** argv) {
  Wanted w;
  if (std::any_of(argv + 1, argv + argc, [](const char* word) { return word == report_word; })) {
    w.seconds = 600;
    w.spheres = 3;
    w.report = w.store = w.awake = true;
  }
  for (int k = 1; k < argc; ++k) {
    const std::string word = argv[k];
    const auto behind = [&](std::string_view name) { return word.substr(name.size()); };
    if (word.starts_with("spheres="))
      w.spheres = std::strtoul(behind("spheres=").c_str(), nullptr, 10);
    else if (word.starts_with("depth="))
      w.depth = std::strtod(behind("depth=").c_str(), nullptr);
    else if (word.starts_with("to="))
      w.folder = std::filesystem::absolute(behind("to=")).string();
    else if (word == report_word)
      continue; // above
    else if (word == "awake")
      w.awake = true;
    else if (word == "fifo" || word == "store")
      (word == "fifo" ? w.fifo : w.store) = true;
    else
      w.seconds = std::strtod(word.c_str(), nullptr);
  }
  if (!(w.seconds > 0) || w.spheres == 0 || !(w.depth > 0))
    Served::fail(
        "latency: expected [SECONDS] [spheres=N] [depth=EDGES] [awake] [fifo] [store] [report] "
        "[to=FOLDER]");
  return w;
}

/// Over the ball: around an axis of its own, at a distance from its pole.
class Path {
public:
  explicit Path(std::mt19937& random) {
    std::normal_distribution<double> normal;
    pole_ = Vec3{normal(random), normal(random), normal(random)};
    pole_ = pole_ / norm(pole_);
    aside_ = cross(pole_, std::abs(pole_.x) < 0.6 ? Vec3{1, 0, 0} : Vec3{0, 1, 0});
    aside_ = aside_ / norm(aside_);
  }
  /// Where the surface is, out of it, `way` mm from the beginning.
  Vec3 out(double way) const {
    constexpr double tilt = 0.35; // of the circle against the great one
    const double angle = way / (ball * std::cos(tilt));
    const Vec3 round = std::cos(angle) * aside_ + std::sin(angle) * cross(pole_, aside_);
    return std::cos(tilt) * round + std::sin(tilt) * pole_;
  }

private:
  Vec3 pole_, aside_;
};

double seconds_of(const timespec& t) {
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

double now() {
  timespec t{};
  (void)clock_gettime(CLOCK_MONOTONIC, &t);
  return seconds_of(t);
}

void wait_until(double when) {
  const timespec t{static_cast<time_t>(when), static_cast<long>(1e9 * (when - std::floor(when)))};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr) != 0) {
  }
}

std::string vector_text(const Vec3& v) {
  std::array<char, 96> one{};
  (void)std::snprintf(one.data(), one.size(), "%.9g %.9g %.9g", v.x, v.y, v.z);
  return one.data();
}

std::string processor() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);)
    if (line.starts_with("model name"))
      return line.substr(std::min(line.size(), line.find(": ") + 2));
  return "a processor without a name";
}

double load_average() {
  std::ifstream file("/proc/loadavg");
  double load = 0;
  file >> load;
  return load;
}

struct Run {
  std::vector<double> latency, work; // ms
  double contacts = 0;
  double memory_first = 0;                       // MB, before the first step
  double memory_before = 0, memory_after = 0;    // MB, behind the first tenth and in the end
  std::size_t late = 0;                          // answers beyond their tick
  Served::Disturbed disturbed;                   // while it answered
  std::vector<std::pair<double, double>> memory; // s, MB
  double load = 0;
};

Run drive(const Served& served, const Wanted& w, double edge) {
  std::mt19937 random(3);
  std::vector<Path> paths;
  for (std::size_t k = 0; k < w.spheres; ++k)
    paths.emplace_back(random);
  const double radius = radius_in_edges * edge;
  const auto place = [&](std::size_t k, double time) {
    const double depth = w.depth * edge * std::min(1.0, 4 * time) *
                         (1 + 0.3 * std::sin(7 * time + static_cast<double>(k)));
    return (ball + radius - depth) * paths[k].out(speed * time);
  };
  served.say(std::string("object organ organ.ela method=ffe") + (w.store ? " store=organ.h5" : "") +
             "\nprepare organ contact\nemit forces\nemit instruments\n");
  for (std::size_t k = 0; k < w.spheres; ++k)
    served.say("instrument tool" + std::to_string(k) + " sphere " + std::to_string(radius) + " " +
               vector_text(place(k, 0)) + "\n");
  served.say("step 0\n");
  (void)served.hear();
  Run run;
  const auto count = static_cast<std::size_t>(w.seconds / tick);
  run.latency.reserve(count);
  run.work.reserve(count);
  const double begin = now() + tick;
  double worked = served.worked();
  run.memory_first = served.resident();
  const Served::Disturbed before = served.disturbed();
  for (std::size_t step = 1; step <= count; ++step) {
    const double time = static_cast<double>(step) * tick, due = begin + time;
    std::string lines;
    for (std::size_t k = 0; k < w.spheres; ++k)
      lines += "move tool" + std::to_string(k) + " " + vector_text(place(k, time)) + "\n";
    lines += "step 0.001\n";
    wait_until(due);
    const double asked = now();
    served.say(lines);
    const Served::Answer answer = served.hear();
    const double end = now();
    run.latency.push_back(1e3 * (end - asked));
    run.late += end > due + tick ? 1 : 0;
    run.contacts += static_cast<double>(answer.forces);
    const double work = served.worked();
    run.work.push_back(work - worked);
    worked = work;
    if (step % 1000 == 0 || step == count)
      run.memory.emplace_back(time, served.resident());
    if (step == std::max<std::size_t>(1, count / 10))
      run.memory_before = served.resident();
  }
  run.contacts /= static_cast<double>(count);
  run.memory_after = served.resident();
  const Served::Disturbed after = served.disturbed();
  run.disturbed = {after.faults - before.faults, after.switches - before.switches};
  run.load = load_average();
  return run;
}

/// The histogram of sorted times and its picture.
void keep(const std::string& folder, const std::string& name, const std::vector<double>& times,
          const std::string& title) {
  std::filesystem::create_directories(folder);
  std::ofstream csv(folder + "/" + name + ".csv"), picture(folder + "/" + name + ".svg");
  // The system may tell no time of an answer; it is none of the histogram.
  const auto first = std::ranges::upper_bound(times, 0.0);
  const std::span<const double> told(first, times.end());
  if (told.empty())
    return;
  const std::vector<Bin> bins = histogram(told);
  write_csv(csv, bins);
  const std::array<std::pair<std::string, double>, 4> marks{{{"half", quantile(told, 0.5)},
                                                             {"99 %", quantile(told, 0.99)},
                                                             {"99.9 %", quantile(told, 0.999)},
                                                             {"largest", told.back()}}};
  draw(picture, bins, title, marks);
}

std::vector<double> sorted(std::vector<double> times) {
  std::ranges::sort(times);
  return times;
}

void print_csv(const Run& run, const std::string& program, std::size_t nodes) {
  std::puts("stage,program,nodes,contacts,answers,p50_ms,p99_ms,p999_ms,largest_ms,figure,unit");
  for (const bool latency : {true, false}) {
    const std::vector<double> times = sorted(latency ? run.latency : run.work);
    std::printf("%s,%s,%zu,%.1f,%zu,%.4f,%.4f,%.4f,%.4f,%.4g,%s\n", latency ? "latency" : "work",
                program.c_str(), nodes, run.contacts, times.size(), quantile(times, 0.5),
                quantile(times, 0.99), quantile(times, 0.999), times.back(),
                latency ? static_cast<double>(run.late) : run.memory_after - run.memory_before,
                latency ? "answers too late" : "MB that memory grew in the last nine tenths");
  }
  for (const bool faults : {true, false})
    std::printf("%s,%s,%zu,%.1f,%zu,,,,,%.4g,%s\n", faults ? "faults" : "switches", program.c_str(),
                nodes, run.contacts, run.latency.size(),
                faults ? run.disturbed.faults : run.disturbed.switches,
                faults ? "page faults while it answered" : "times its processor was taken away");
}

/// Table, histogram and memory as text.
void print_report(const Run& run, const std::string& program, std::size_t nodes) {
  const std::vector<double> latency = sorted(run.latency), work = sorted(run.work);
  std::printf("%zu answers, one a millisecond: %s, %zu nodes, %.1f contacts in the mean\n\n",
              latency.size(), program.c_str(), nodes, run.contacts);
  std::printf("%-22s %9s %9s %9s %9s\n", "ms", "half", "99 %", "99.9 %", "largest");
  for (const bool first : {true, false}) {
    const std::vector<double>& times = first ? latency : work;
    std::printf("%-22s %9.3f %9.3f %9.3f %9.3f\n", first ? "latency" : "processor's time",
                quantile(times, 0.5), quantile(times, 0.99), quantile(times, 0.999), times.back());
  }
  std::printf("\n%.3f %% within a millisecond; the processor was taken away %.0f times\n\n",
              100 * (1 - static_cast<double>(run.late) / static_cast<double>(latency.size())),
              run.disturbed.switches);
  std::vector<Bin> bins; // four to a power of two
  for (const Bin& bin : histogram(latency))
    if (bins.empty() || bin.from >= bins.back().from * 1.18)
      bins.push_back(bin);
    else
      bins.back() = {bins.back().from, bin.to, bins.back().count + bin.count};
  const auto length = [&](std::size_t count) { return std::log1p(static_cast<double>(count)); };
  const double most = length(std::ranges::max_element(bins, {}, &Bin::count)->count);
  for (const Bin& bin : bins)
    std::printf("%8.3f to %8.3f ms %8zu %s\n", bin.from, bin.to, bin.count,
                std::string(static_cast<std::size_t>(50 * length(bin.count) / most), '#').c_str());
  std::printf("\nMB in memory: %.1f at the start, %.1f after a tenth, %.1f at the end\n",
              run.memory_first, run.memory_before, run.memory_after);
}

} // namespace

int main(int argc, char** argv) {
  (void)std::signal(SIGPIPE, SIG_IGN);
  const Wanted w = wanted(argc, argv);
  const std::string tools = std::filesystem::read_symlink("/proc/self/exe").parent_path().string();
  std::string folder = (std::filesystem::temp_directory_path() / "gewebe-bench-XXXXXX").string();
  if (mkdtemp(folder.data()) == nullptr)
    Served::fail("no folder in " + std::filesystem::temp_directory_path().string());
  const model::Model model =
      model::build_model(test::sphere_mesh(5, ball, {}), {}, Context{}).model;
  {
    formats::Output output(folder + "/organ.ela", {});
    formats::write_ela(output, model, Context{});
    output.commit();
  }
  if (w.store &&
      std::system(("cd '" + folder + "' && '" + tools +
                   "/ffe-precompute' -q --columns surface --compress 1e-4 organ.ela -o organ.h5")
                      .c_str()) != 0)
    Served::fail("no store");
  std::string program = std::to_string(w.spheres) + " spheres";
  if (w.store)
    program += " stored";
  if (w.awake)
    program += " awake";
  if (w.fifo) {
    sched_param priority{};
    priority.sched_priority = 50;
    if (sched_setscheduler(0, SCHED_FIFO, &priority) != 0)
      Served::fail("latency: real-time priority is not permitted");
    program += " real-time";
  }
  Run run;
  {
    const Served served(tools, folder, 1, w.awake);
    run = drive(served, w, test::mean_edge(model));
  }
  const std::size_t nodes = model.nodes.size();
  if (w.report)
    print_report(run, program, nodes);
  else
    print_csv(run, program, nodes);
  if (!w.folder.empty())
    for (const bool latency : {true, false})
      keep(w.folder, latency ? "latency" : "work", sorted(latency ? run.latency : run.work),
           (latency ? "Answers at 1 kHz, " : "Processor's time of an answer, ") + program + ", " +
               processor());
  if (!w.folder.empty()) {
    std::ofstream memory(w.folder + "/memory.csv"), curve(w.folder + "/memory.svg");
    memory << "s,MB\n";
    for (const auto& [second, megabytes] : run.memory)
      memory << second << ',' << megabytes << '\n';
    draw_memory(curve, run.memory, "Memory of ffe-run, " + program);
  }
  (void)std::fprintf(stderr, "latency: %s, load average %.2f, %.1f MB resident\n",
                     processor().c_str(), run.load, run.memory_after);
  std::filesystem::current_path("/");
  std::filesystem::remove_all(folder);
  return EXIT_SUCCESS;
}
