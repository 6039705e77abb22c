// Scenes that are driven: wrong lines, records, events, latencies, series of shapes.

#include "base/error.h"
#include "formats/results/results_mesh.h"
#include "formats/scene/frames_binary.h"
#include "formats/scene/scene.h"
#include "fuzzed_scenes.h"
#include "scratch.h"
#include "sim_models.h"
#include "tests/unit/sanitizers.h"
#include "tools/run/event_log.h"
#include "tools/run/run_report.h"
#include "tools/run/scene_record.h"
#include "tools/run/scene_run.h"
#include "tools/run/step_latency.h"
#include "tools/serve/scene_lines.h"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <iterator>
#include <limits>
#include <random>
#include <string>
#include <vector>

namespace gewebe::test {
namespace {

using test::organ;

std::string content(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = text.find('\n', at);
    lines.push_back(text.substr(at, end - at));
    at = end == std::string::npos ? text.size() : end + 1;
  }
  return lines;
}

struct Served {
  std::string replies, error, digest;
  std::uint64_t errors = 0;
};

/// Over files that are named by their last part: m and n organs, two a pair of masses.
Served serve(const std::vector<std::string>& lines, const std::string& record = "",
             const std::string& events = "", bool serving = true) {
  Served out;
  cli::SceneOptions options;
  const auto base = [](const std::string& name) { return name.substr(name.find_last_of('/') + 1); };
  options.files.model = [&](const std::string& name) {
    if (base(name) == "two")
      return test::two_masses();
    if (base(name) != "m")
      throw Error(name, "cannot open");
    return organ(1);
  };
  options.files.store = [](const std::string& name,
                           const model::Model&) -> compliance::StoredStiffness {
    throw Error(name, "is damaged");
  };
  options.files.node_list = [](const std::string&) { return std::string("4 6-7 # nodes\n"); };
  options.reply = [&](std::string_view text) { out.replies += text; };
  options.serve = serving;
  options.measure = true;
  std::optional<cli::SceneRecord> log;
  if (!record.empty())
    options.record = &log.emplace(record, formats::Output::Options{}, "-");
  std::optional<cli::EventLog> table;
  if (!events.empty())
    options.events = &table.emplace(events, formats::Output::Options{.binary = false});
  Context context;
  context.threads = 1;
  cli::SceneRun run("s", context, options);
  try {
    for (const std::string& line : lines)
      run.line(line);
    run.finish();
  } catch (const Error& error) {
    out.error = error.place() + ": " + error.what();
  }
  if (log)
    log->commit();
  if (table)
    table->commit();
  out.errors = run.counts().errors;
  out.digest = run.counts().digest;
  return out;
}

std::string without_errors(const std::string& replies) {
  std::string text;
  for (const std::string& line : lines_of(replies))
    if (!line.starts_with("error "))
      text += line + "\n";
  return text;
}

TEST(SceneServe, EveryCommandLeavesTheStateAloneWhereItIsWrong) {
  const std::vector<std::string> start{"object a m",      "object b m method=ffe",
                                       "emit shapes",     "displace a 4 0.01 0 0.3 over 0.02",
                                       "force b 4 3 1 2", "at 0.012 force a 6 0 0 3",
                                       "step 0.01"};
  const std::vector<std::string> wrong{"object a m",
                                       "object c",
                                       "force a 999 0 0 1",
                                       "force z 4 0 0 1",
                                       "force a 4 0 0 nan",
                                       "displace a 5 0 0 1",
                                       "displace b 4,4,5 0 0 1",
                                       "pressure a z>999 3",
                                       "attach a 4 b 4 9",
                                       "attach a 4 a 6 9",
                                       "release a",
                                       "gravity 1 2 inf",
                                       "timestep 0",
                                       "emit all",
                                       "step -1",
                                       "step 1e300x",
                                       "run 0.005 every 0.01",
                                       "run 1 every 0",
                                       "run 1e30 every 1e-9",
                                       "method a fem",
                                       "method z ela",
                                       "prepare z",
                                       "at 0.001 force a 4 1 1 1",
                                       "at 1 step",
                                       "cut a 4",
                                       "at -1 release a 4",
                                       "\"",
                                       std::string("st\0ep", 5),
                                       "object d m store=x method=ela now"};
  const std::vector<std::string> end{"step 0.01", "release b all", "release a all", "step 0.01"};
  std::vector<std::string> right = start, all = start;
  all.insert(all.end(), wrong.begin(), wrong.end());
  for (std::vector<std::string>* lines : {&right, &all})
    lines->insert(lines->end(), end.begin(), end.end());
  const Served calm = serve(right), served = serve(all);
  EXPECT_EQ(calm.errors, 0U);
  EXPECT_EQ(served.error, "");
  EXPECT_EQ(served.errors, wrong.size());
  EXPECT_EQ(without_errors(served.replies), calm.replies);
  EXPECT_EQ(served.digest, calm.digest);
  for (std::size_t i = 0; i < wrong.size(); ++i)
    EXPECT_NE(served.replies.find("error " + std::to_string(start.size() + 1 + i) + ": "),
              std::string::npos)
        << wrong[i];
  // Without serving the first of them is the end.
  EXPECT_NE(serve(all, "", "", false).error.find("s:8: there is an object 'a' already"),
            std::string::npos);
}

TEST(SceneServe, ARecordOfAnyRunDoesTheSameAgain) {
  const ScratchFile record(".scene");
  std::mt19937 random(7);
  const auto pick = [&](const std::vector<std::string>& words) {
    return words[random() % words.size()];
  };
  std::size_t errors = 0;
  for (int round = 0; round < 16; ++round) {
    std::vector<std::string> lines{"object a m",
                                   "object b m method=ffe",
                                   "object c m integration=implicit",
                                   "object d two",
                                   "object e two method=ffe",
                                   "object f none",
                                   "object g m store=x",
                                   "emit forces"};
    for (int k = 0; k < 25; ++k) {
      const std::string object = pick({"a", "b", "c", "a", "b", "d", "e", "f", "g"});
      const std::string node =
          object == "d" || object == "e" ? pick({"0", "1"}) : pick({"4", "6", "@list", "3", "7"});
      const std::string number = pick({"0.1", "-0.3", "0.2", "0", "0.5", "-1", "-0.2", "1e300"});
      lines.push_back(pick({"", "", "", "at 0.0" + std::to_string(random() % 90) + " "}) +
                      pick({"force " + object + " " + node + " " + number + " 0 " + number,
                            "displace " + object + " " + node + " 0 0 " + number,
                            "displace " + object + " " + node + " 0 0.2 0 over 0.03",
                            "release " + object + " " + node, "release " + object + " all",
                            "release a all", "release b all", "release c all", "release d all",
                            "release e all", "method " + object + " " + pick({"ffe", "ela"}),
                            "attach a 4 " + object + " " + node + " 30", "nonsense", "emit shapes",
                            "gravity 0 0 " + pick({"-100", "0"})}));
      if (random() % 2 == 0)
        lines.push_back(pick({"step 0.004", "step 0.002", "run 0.03 every 0.007", "step 0"}));
    }
    const Served live = serve(lines, record.path());
    const Served again = serve(lines_of(content(record.path())), "", "", false);
    EXPECT_EQ(again.error, "") << content(record.path());
    EXPECT_EQ(again.replies, without_errors(live.replies));
    EXPECT_EQ(again.digest, live.digest);
    errors += live.errors;
  }
  EXPECT_GT(errors, 80U);
}

TEST(SceneServe, ARunThatFailsHalfWayKeepsWhatWasAnswered) {
  const ScratchFile record(".scene");
  const Served live =
      serve({"object a two", "at 0.0251 force a 0 1e308 0 0", "run 1 every 0.01"}, record.path());
  EXPECT_EQ(live.errors, 1U);
  EXPECT_NE(live.replies.find("step 2 0.02\ndone\nerror 3: object a at "), std::string::npos)
      << live.replies;
  EXPECT_EQ(lines_of(content(record.path())).back().substr(0, 4), "run ");
  EXPECT_EQ(serve(lines_of(content(record.path()))).replies, without_errors(live.replies));
}

TEST(SceneServe, RefusedInstrumentsAreNotKnown) {
  const ScratchFile record(".scene");
  const Served live =
      serve({"object o two", "step 0.1", "at 0.05 instrument p sphere 1 0 0 20", "at 1 withdraw p",
             "instrument p sphere 1e300 0 0 20", "instrument p sphere 1 0 0 2e38", "withdraw p",
             "at 0.2 instrument p sphere 1 0 0 20", "at 0.3 withdraw p", "step 1"},
            record.path());
  EXPECT_EQ(live.errors, 5U);
  EXPECT_NE(live.replies.find("error 4: there is no instrument 'p'"), std::string::npos);
  const Served again = serve(lines_of(content(record.path())), "", "", false);
  EXPECT_EQ(again.error, "");
  EXPECT_EQ(again.replies, without_errors(live.replies));
}

TEST(SceneServe, ResultsHoldWhatWasAnsweredAlone) {
  // A first step that fails, then a cut that frees a part: no frame before the part.
  const auto run = [](const std::vector<std::string>& lines) {
    return test::run_fuzzed(lines, true, 1, "");
  };
  const std::vector<std::string> before{"object o ball method=ela", "displace o 4 0 0 1"},
      after{"cut o plane 100 -50 41 0 0 1", "step 0.001"};
  std::vector<std::string> right = before, failing = before;
  right.insert(right.end(), after.begin(), after.end());
  for (const char* line : {"force o 6 1e300 0 0", "step 0.001", "release o 6"})
    failing.emplace_back(line);
  failing.insert(failing.end(), after.begin(), after.end());
  const test::FuzzedRun calm = run(right), served = run(failing);
  EXPECT_EQ(calm.fault + served.fault, "");
  EXPECT_EQ(calm.errors, 0U) << calm.replies;
  EXPECT_EQ(served.errors, 1U) << served.replies;
  EXPECT_EQ(served.result, calm.result);
  EXPECT_EQ(served.digest, calm.digest);
}

TEST(SceneServe, ARecordNamesFilesAsAScenesWordsCan) {
  const ScratchFile record(".scene");
  for (const char* folder : {"a\"b/", "a\nb/"}) {
    EXPECT_THROW(cli::SceneRecord(record.path(), formats::Output::Options{},
                                  std::string("/nowhere/") + folder + "s.scene"),
                 Error)
        << folder;
  }
  cli::SceneRecord named(record.path(), formats::Output::Options{}, "/nowhere/a b#c/s.scene");
  const std::string line = "object o \"my m.ela\" store=\"s t.h5\"";
  named.line(line, *formats::parse_scene_line(line), {});
  named.commit();
  const std::string kept = lines_of(content(record.path())).at(0);
  const auto command = formats::parse_scene_line(kept);
  const auto& object = std::get<formats::ObjectCommand>(command->what);
  EXPECT_TRUE(object.model.ends_with("/nowhere/a b#c/my m.ela")) << kept;
  EXPECT_TRUE(object.store.ends_with("/nowhere/a b#c/s t.h5")) << kept;
}

TEST(SceneServe, ALineWithoutEndIsRefusedAtOnce) {
  const ScratchFile file(".scene");
  std::ofstream(file.path(), std::ios::binary)
      << "object o two\n"
      << std::string((1U << 24U) + 5, '#') << "\nstep 0.1\n";
  for (const bool serving : {false, true}) {
    std::string replies;
    cli::SceneOptions options;
    options.files.model = [](const std::string&) { return test::two_masses(); };
    options.reply = [&](std::string_view text) { replies += text; };
    options.serve = serving;
    cli::SceneRun run("s", Context{}, options);
    formats::Input input(file.path(), false);
    if (serving) {
      cli::run_scene(input, run);
      EXPECT_EQ(run.counts().errors, 1U);
      EXPECT_NE(replies.find("step 1 0.1"), std::string::npos);
    } else {
      EXPECT_THROW(cli::run_scene(input, run), Error);
    }
  }
}

TEST(SceneServe, AnyScenePlaysAgainToTheLastByte) {
  // The time that a scene may take is the processor's: sanitizers take some ten times as much, so
  // that more scenes are ended early there. These seeds have few that take long.
  const bool slow = test::under_sanitizers();
  const std::uint64_t first = slow ? 82 : 63, scenes = slow ? 15 : 50, may_be_slow = slow ? 5 : 3;
  test::FuzzedCounts seen;
  for (std::uint64_t seed = first; seed < first + scenes; ++seed)
    EXPECT_EQ(test::fault_of_scene(test::FuzzedScene(seed).lines(), seen), "")
        << "seed " << seed << " of stress_scenes";
  EXPECT_GT(seen.steps, scenes); // or nothing was tried
  EXPECT_LE(seen.slow, may_be_slow);
}

TEST(SceneServe, AnySceneWithStepsThatFailPlaysAgain) {
  constexpr std::uint64_t scenes = 30;
  test::FuzzedCounts seen;
  for (std::uint64_t seed = 1; seed <= scenes; ++seed)
    EXPECT_EQ(test::fault_of_scene(test::failing_scene(seed), seen), "") << "seed " << seed;
  EXPECT_GT(seen.errors, 4 * scenes); // or nothing failed
  EXPECT_LE(seen.slow, scenes / 6);
}

TEST(SceneServe, ShortScenesPlayAgainBehindAFailedStep) {
  const std::vector<std::pair<std::string, std::vector<std::string>>> scenes{
      {"an instrument that a failed step brought pushes a body that moves",
       {"object a free store=free method=ela", "object b sheet method=ffe", "step 0.002",
        "step 0.001", "force a \"8 or not (x<-9.797958971132712)\" 21070 -29620 29710",
        "run 0.0095 every 0.001", "at every 0.004 instrument p sphere 8.976 4.697 8.696 -3.166",
        "step 0.005", "step 0.001"}},
      {"as well, where the step fails by a file",
       {"object b free", "step 0.002", "force b x>8.48528137423857 -41370 22110 23920",
        "step 0.005", "step 0.001",
        "at 0.0085 instrument q capsule 12.188 14.328 4.907 16.352 2.687999999999999 "
        "-3.9019999999999992 5.182",
        "object d sheet store=sheet method=ffe", "at every 0.002 method d ela",
        "run 0.018000000000000002 every 0.0015", "step 0.002"}},
      {"parts that a failed step restored and that instruments touch",
       {"object a free store=free method=ela",
        "instrument q capsule 4.7712 -7.62755439013544 -1.2152011883810774 3.705 "
        "-18.74755439013544 -5.113201188381078 -4.08 friction 0.7756",
        "tear a 0.05415", "step 0.0025", "step 0.005", "at every 0.0015 restore a", "step 0.005",
        "move q 12.36628137423857 9.35038137423857 -0.7874 turn -0.8838 -0.3818 0.008695 74.19 "
        "over 0.001",
        "step 0.001"}},
      {"a way that ends in a failed step",
       {"object b tube store=tube method=ela", "at 0.01 pressure b 17-48 1e300 period 0.002",
        "displace b 18 -7.579 -5.89 -4.997 over 0.01", "step 0.002", "step 0.002", "step 0.0025",
        "step 0.005", "step 0.002"}},
      {"a way that had ended before one",
       {"object a shell method=ela", "step 0.0025",
        "displace a sphere:-7.071067811865475,0,7.071067811865475,7.2540000000000004 1.287 0.3945 "
        "-0 over 0.0015",
        "step 0.0025", "at 0.015 force a x>0 1e38 -14990 45240", "step 0.001", "step 0.005",
        "step 0.005", "step 0.001"}},
      {"instruments between which a filled body has no place",
       {"object b ball integration=auto bulk=87600", "emit instruments",
        "instrument p sphere 10.364 117.85296580927726 -55.52993161855453 31.80596580927726 "
        "friction 1.343",
        "instrument q capsule 6.071999999999999 95.14006838144547 -34.906034190722735 "
        "15.032034190722737 89.96206838144548 -33.33703419072273 16.821034190722738",
        "step 0.0025"}},
      {"an instrument that comes while a factor can't be had",
       {"object a free store=free method=ffe", "emit instruments",
        "cut a plane 0 -11.08655439013544 4.592201188381077 -1.831 -1.183 -0.4173", "step 0.005",
        "cut a plane 4.898979485566356 -9.797958971132712 4.898979485566356 -0.3091 0.6292 1.435",
        "step 0.001", "instrument k blade 4.111 -4.85 -5.27 11.982 -15.129999999999999 -22.2",
        "step 0.001"}},
      {"two steps of stiffness, told again in a failed step",
       {"object b sheet method=ela", "object c tube store=tube method=ffe", "at 0.012 restore b",
        "force c 21-48 35350 -33940 15980", "step 0.005", "at every 0.0015 two-step c 9399",
        "step 0.0025", "force c 22,17 -14320 -1268 28030", "step 0.005", "step 0"}},
      {"an instrument that comes behind a failed step",
       {"object a ball integration=auto bulk=2425000", "object b tube store=tube method=ffe",
        "emit shapes",
        "instrument q capsule 14.7 -3.0990678118654746 10.982067811865475 17.856 "
        "-8.704067811865475 3.251067811865475 7.216000000000001",
        "step 0",
        "at every 0.001 instrument k blade 102.83797730844432 -34.86978873692684 "
        "22.354040331483525 66.83797730844432 -54.25978873692684 3.7640403314835247",
        "at 0.003 method a ffe", "step 0.005",
        "instrument p sphere 6.712 101.02 -42.32486437626905 42.720135623730954", "step 0"}},
      {"what a failed step emits",
       {"object o two", "at 0.05 emit instruments", "at 0.06 force o 0 1e308 0 0", "step 0.1",
        "step 0.01"}}};
  for (const auto& [what, lines] : scenes) {
    test::FuzzedCounts seen;
    EXPECT_EQ(test::fault_of_scene(lines, seen), "") << what;
    EXPECT_GT(seen.errors + (lines[1].starts_with("emit") ? 1 : 0), 0U) << what; // or none failed
  }
}

/// Answers of forces and instruments alone.
std::string forces_in(const std::string& replies) {
  std::istringstream text(replies);
  std::string kept;
  bool in_shape = false;
  for (const std::string& line : test::lines_in(text)) {
    const bool begins = !line.empty() && line[0] >= 'a' && line[0] <= 'z';
    in_shape = begins ? line.starts_with("shapes ") || line.starts_with("nodes ") ||
                            line.starts_with("stress ") || line.starts_with("jump ")
                      : in_shape;
    if (!in_shape)
      kept += line + "\n";
  }
  return kept;
}

// What is measured and how exactly shapes are shown has no effect on how a scene goes on.
TEST(SceneServe, WhatIsMeasuredAndShownChangesNothing) {
  const std::uint64_t scenes = 20; // make stress looks at thousands
  for (std::uint64_t seed = 1; seed <= scenes; ++seed) {
    std::vector<std::string> lines = test::FuzzedScene(seed).lines();
    lines.insert(lines.begin(), {"emit forces", "emit instruments"});
    if (seed % 2 == 0)
      lines.insert(lines.begin(), "emit surfaces");
    for (std::string& line : lines) // all are elastostatic as long as it goes
      if (const std::size_t at = line.find(" method=ela"); at != std::string::npos)
        line.replace(at, 11, " method=ffe");
    const auto run = [&](bool measure, bool verify, double tolerance) {
      return test::run_fuzzed(
          lines, {.shown = false, .measure = measure, .verify = verify, .tolerance = tolerance});
    };
    const test::FuzzedRun plain = run(false, false, 0);
    const auto compare = [&](const test::FuzzedRun& one, const test::FuzzedRun& other,
                             const std::string& what, auto&& part) {
      if (!one.slow && !other.slow) {
        EXPECT_EQ(test::first_difference(part(one.replies), part(other.replies)), "nowhere")
            << what << ", seed " << seed;
      }
    };
    const auto whole = [](const std::string& replies) { return replies; };
    compare(plain, run(true, false, 0), "stats", whole);
    compare(plain, run(true, true, 0), "verify", whole);
    const test::FuzzedRun rough = run(false, false, 0.05);
    compare(plain, rough, "tolerance", forces_in);
    compare(rough, run(true, true, 0.05), "all at once", whole);
  }
}

TEST(SceneServe, NodeListsAreInTheRecordByNumber) {
  const ScratchFile record(".scene");
  const Served live = serve({"object a m", "force a \"@x.list or @'y z' and z>1\" 0 0 1 # @no",
                             "force a (@x) 1 0 0", "step"},
                            record.path());
  EXPECT_EQ(live.error, "");
  const std::vector<std::string> lines = lines_of(content(record.path()));
  ASSERT_EQ(lines.size(), 4U);
  EXPECT_EQ(lines[1], "force a \"4,6-7 or 4,6-7 and z>1\" 0 0 1");
  EXPECT_EQ(lines[2], "force a (4,6-7) 1 0 0");
  EXPECT_EQ(serve(lines).digest, live.digest);
}

TEST(SceneServe, EventsSayWhoTouchedWhatWhen) {
  const ScratchFile table(".csv");
  serve({"object a m", "force a @list 1 2 3 period 0.5", "at 0.01 displace a 4,6 0 0 1 over 2",
         "wrong, \"so\"", "step 0.02", "at 1 release a all", "step 1e9"},
        "", table.path());
  const std::vector<std::string> rows = lines_of(content(table.path()));
  ASSERT_EQ(rows.size(), 6U);
  const std::string none(17, ','); // of the columns of instruments
  EXPECT_EQ(rows[1], "0,object,a,,,,,,,,,\"m ela\"" + none);
  EXPECT_EQ(rows[2], "0,force,a,4 6-7,1,2,3,,0.5,,," + none);
  EXPECT_TRUE(rows[3].starts_with("0,error,,,,,,,,,,\"4: 'wrong,' is no command"));
  EXPECT_EQ(rows[4], "0.01,displace,a,4 6,0,0,1,,2,,," + none);
  EXPECT_TRUE(rows[5].starts_with("0.02,error,,,,,,,,,,\"7: object a at "));
}

TEST(StepLatency, QuantilesAreThoseOfTheSteps) {
  cli::StepLatency latency(1e-3);
  EXPECT_EQ(latency.quantile(0.5), 0);
  latency.line_arrived();
  for (std::uint64_t k = 1; k <= 1000; ++k)
    latency.answered(k, 0);
  EXPECT_EQ(latency.steps(), 1000U);
  EXPECT_EQ(latency.missed(), 0U);
  EXPECT_GT(latency.quantile(0.5), 0);
  EXPECT_LE(latency.quantile(0.5), latency.quantile(0.99));
  EXPECT_LE(latency.quantile(0.999), latency.largest());
  EXPECT_EQ(latency.quantile(1), latency.largest());
  EXPECT_GE(latency.sum(), latency.largest());
  EXPECT_LE(latency.sum(), 1000 * latency.largest());
  cli::StepLatency strict(1e15);
  strict.line_arrived();
  strict.answered(1, 0);
  EXPECT_EQ(strict.missed(), 1U);
}

TEST(ResultsMesh, ASeriesHasOneFileForEachFrame) {
  const ScratchFile name;
  const std::string folder = name.path() + ".folder";
  std::filesystem::create_directory(folder);
  const model::Model model = organ(1);
  const auto writer = formats::open_mesh_result(formats::Kind::ply, folder + "/run_%03d.ply",
                                                formats::Output::Options{});
  writer->add_object("o", model);
  std::vector<double> u(3 * model.nodes.size());
  for (int k = 0; k < 3; ++k) {
    const formats::FrameObject frame{u, {}};
    writer->add_frame(k, std::span(&frame, 1));
    u[0] += 1;
  }
  writer->commit();
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    names.push_back(entry.path().filename());
  std::sort(names.begin(), names.end());
  EXPECT_EQ(names, (std::vector<std::string>{"run_000.ply", "run_001.ply", "run_002.ply"}));
  EXPECT_NE(content(folder + "/run_000.ply"), content(folder + "/run_002.ply"));
  for (const char* pattern : {"%s.ply", "%.ply", "%d%d.ply", "%4d.ply", "%00d.ply", "%010d.ply"})
    EXPECT_THROW(formats::open_mesh_result(formats::Kind::ply, folder + "/" + pattern, {}),
                 UsageError)
        << pattern;
  std::filesystem::remove_all(folder);
}

// No scene was found whose shapes miss their bounds, so --verify's bounds are looked at from both
// sides here.
TEST(RunReport, VerifyTakesWhatIsWithinItsBoundsAlone) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto passes = [](double shape, double backward, double tolerance, double limit = 1e-6,
                         double change = 0) {
    statics::ElastostaticCounts errors;
    errors.shape_error = shape;
    errors.backward_error = backward;
    errors.worst_shape.error = backward;
    errors.worst_shape.limit = limit;
    errors.change = change;
    try {
      cli::require_verified(errors, tolerance);
    } catch (const Error&) {
      return false;
    }
    return true;
  };
  EXPECT_TRUE(passes(0, 0, 0));
  EXPECT_TRUE(passes(0, 0.9e-6, 0));
  EXPECT_FALSE(passes(0, 1.1e-6, 0)) << "a wrong solution";
  EXPECT_FALSE(passes(1e-9, 0, 0)) << "a shape that was to be exact";
  EXPECT_TRUE(passes(0.009, 0, 0.01));
  EXPECT_TRUE(passes(0.01, 1, 0.01)) << "what is left out on purpose has a residual";
  EXPECT_FALSE(passes(0.011, 0, 0.01));
  EXPECT_FALSE(passes(nan, 0, 0.01));
  EXPECT_FALSE(passes(0, nan, 0));
  EXPECT_TRUE(passes(0, 1.1e-6, 0, 2e-6)) << "by compressed columns";
  EXPECT_FALSE(passes(0, 2.1e-6, 0, 2e-6));
  EXPECT_TRUE(passes(0, 0, 0, 1e-6, 0.9e-3)) << "large rotations";
  EXPECT_FALSE(passes(0, 0, 0, 1e-6, 1.1e-3));
  EXPECT_FALSE(passes(0, 0, 0.01, 1e-6, nan));
}

} // namespace
} // namespace gewebe::test
