#include "base/error.h"
#include "formats/model/ela.h"
#include "formats/scene/scene.h"
#include "scratch.h"
#include "sim_models.h"
#include "tests/unit/complaint.h"
#include "tools/run/scene_run.h"
#include "tools/serve/scene_lines.h"

#include <fstream>
#include <gtest/gtest.h>
#include <string>
#include <vector>

namespace gewebe::test {
namespace {

using test::organ;

std::string complaint(std::string_view line) {
  const std::string said = test::complaint([&] { return formats::parse_scene_line(line); });
  EXPECT_EQ(said.find('\n'), std::string::npos);
  return said;
}

template <class T>
T parsed(std::string_view line) {
  return std::get<T>(formats::parse_scene_line(line).value().what);
}

formats::ChangeCommand said(std::string_view line) {
  return parsed<formats::ChangeCommand>(line);
}

template <class Kind>
Kind change(std::string_view line) {
  return std::get<Kind>(said(line).change);
}

TEST(SceneLine, WordsQuotesAndComments) {
  EXPECT_FALSE(formats::parse_scene_line(""));
  EXPECT_FALSE(formats::parse_scene_line(" \t\r"));
  EXPECT_FALSE(formats::parse_scene_line("# step"));
  EXPECT_TRUE(formats::parse_scene_line("step#comment"));
  const auto object =
      parsed<formats::ObjectCommand>(R"(  object a "my organ.ela" store="#1 s".h5  # c "x)");
  EXPECT_EQ(object.name, "a");
  EXPECT_EQ(object.model, "my organ.ela");
  EXPECT_EQ(object.store, "#1 s.h5");
  EXPECT_EQ(object.method, scene::Method::ffe);
  EXPECT_EQ(parsed<formats::ObjectCommand>("object a b").method, scene::Method::ela);
  EXPECT_EQ(parsed<formats::ObjectCommand>("object a b method=ffe").method, scene::Method::ffe);
  EXPECT_EQ(parsed<formats::ObjectCommand>("object a b method=ffe store=s").store, "s");
}

TEST(SceneLine, CommandsWithTheirNumbers) {
  const formats::ChangeCommand force = said("force liver \"z<3 and not 7\" 1 -2.5e3 +0.25 total");
  EXPECT_EQ(force.object, "liver");
  EXPECT_EQ(force.nodes.value().text, "z<3 and not 7");
  EXPECT_EQ(std::get<scene::SetForce>(force.change).force, (Vec3{1, -2500, 0.25}));
  EXPECT_TRUE(force.total);
  EXPECT_FALSE(said("force a 1 1 2 3").total);
  EXPECT_EQ(change<scene::SetDisplacement>("displace a 1-3,5 0 0 1").displacement, (Vec3{0, 0, 1}));
  EXPECT_EQ(said("release a all").nodes.value().text, "all");
  EXPECT_EQ(change<scene::SetGravity>("gravity 0 0 -9810").gravity, (Vec3{0, 0, -9810}));
  EXPECT_EQ(change<scene::SetTimestep>("timestep 1e-4").dt, 1e-4);
  EXPECT_TRUE(change<scene::Emit>("emit forces").forces);
  EXPECT_EQ(change<scene::SetTwoStep>("two-step a 2.5e5").options.threshold, 2.5e5);
  EXPECT_FALSE(change<scene::SetTwoStep>("two-step a 2.5e5").options.series);
  EXPECT_TRUE(change<scene::SetTwoStep>("two-step a 2.5e5 series").options.series);
  EXPECT_EQ(formats::parse_scene_line("at 1 two-step a 3 series").value().at, 1);
  EXPECT_FALSE(change<scene::Emit>("emit shapes").forces);
  EXPECT_EQ(parsed<formats::EmitStressCommand>("emit stress a").object, "a");
  EXPECT_FALSE(parsed<formats::EmitStressCommand>("emit stress a").nodes);
  EXPECT_EQ(parsed<formats::EmitStressCommand>("emit stress a z<3").nodes.has_value(), true);
  EXPECT_THROW((void)formats::parse_scene_line("emit stress"), Error);
  EXPECT_THROW((void)formats::parse_scene_line("emit stress a all more"), Error);
  EXPECT_THROW((void)formats::parse_scene_line("at 1 emit stress a"), Error);
  EXPECT_FALSE(parsed<formats::StepCommand>("step").dt);
  EXPECT_EQ(parsed<formats::StepCommand>("step 0").dt, 0);
  EXPECT_EQ(parsed<formats::RunCommand>("run 2 every 0.5").until, 2);
  EXPECT_EQ(parsed<formats::RunCommand>("run 2 every 0.5").every, 0.5);
  const auto later = formats::parse_scene_line("at 0.5 release a 3");
  EXPECT_EQ(later.value().at, 0.5);
  EXPECT_NO_THROW(change<scene::Release>("at 0.5 release a 3"));
  EXPECT_FALSE(formats::parse_scene_line("step").value().at);
  EXPECT_TRUE(formats::parse_scene_line("at every 0.5 release a 3").value().every);
  EXPECT_FALSE(later.value().every);
  EXPECT_EQ(change<scene::SetForce>("force a 1 1 2 3 total period 0.8").period, 0.8);
  EXPECT_EQ(change<scene::SetPressure>("pressure a all -20").pressure.pressure, -20);
  EXPECT_EQ(change<scene::SetPressure>("pressure a all -20 period 2").pressure.period, 2);
  EXPECT_EQ(change<scene::SetMass>("mass a 3,4 102").mass, 102);
  EXPECT_TRUE(said("mass a 3,4 102").total);
  EXPECT_FALSE(said("at 1 mass a 3,4 102 each").total);
  EXPECT_EQ(change<scene::SetDisplacement>("displace a 1 0 0 1 over 0.25").duration, 0.25);
  EXPECT_EQ(change<scene::Attach>("attach a 1 b z<3 500").stiffness, 500);
  EXPECT_EQ(said("attach a 1 b z<3 500").other, "b");
  EXPECT_EQ(said("attach a 1 b z<3 500").others.value().text, "z<3");
  EXPECT_EQ(said("grasp a z<3 tongs").instrument, "tongs");
  EXPECT_EQ(parsed<formats::ObjectCommand>("object a a.ela integration=implicit").integration,
            scene::Integration::implicit);
  EXPECT_EQ(parsed<formats::ObjectCommand>("object a a.ela integration=auto").integration,
            scene::Integration::automatic);
  EXPECT_TRUE(parsed<formats::ObjectCommand>("object a a.ela method=ffe rotation=warp").warp);
  EXPECT_TRUE(parsed<formats::ObjectCommand>("object a a.ela rotation=warp store=a.h5").warp);
  EXPECT_FALSE(parsed<formats::ObjectCommand>("object a a.ela store=a.h5").warp);
  // What an object has no use for now it may have by another method.
  EXPECT_EQ(parsed<formats::ObjectCommand>("object a a.ela store=x method=ela").method,
            scene::Method::ela);
  EXPECT_EQ(change<scene::SetMethod>("method a ffe").method, scene::Method::ffe);
  EXPECT_EQ(said("method a ela").object, "a");
  EXPECT_FALSE(said("cut a springs z<3").others);
  EXPECT_TRUE(said("cut a springs z<3 z>3").others);
  EXPECT_FALSE(said("cut a plane 1 2 3 0 0 2").nodes);
  EXPECT_EQ(
      std::get<scene::PlaneToCut>(change<scene::CutObject>("cut a plane 1 2 3 0 0 2 z<3").what)
          .plane.normal.z,
      2);
  EXPECT_EQ(change<scene::SetTear>("tear a 0.5").strain, 0.5);
  EXPECT_EQ(formats::parse_scene_line("at 1 restore a").value().at, 1);
  EXPECT_TRUE(change<scene::SetInstrument>("instrument k blade 1 2 3 1 2 8").shape.blade);
  EXPECT_EQ(change<scene::SetInstrument>("instrument k blade 1 2 3 1 2 8").shape.axis,
            (Vec3{0, 0, 5}));
  const auto capsule =
      change<scene::SetInstrument>("instrument k capsule 4 1 2 3 1 7 3 friction 0.3");
  EXPECT_FALSE(capsule.shape.blade);
  EXPECT_EQ(capsule.shape.radius, 4);
  EXPECT_EQ(capsule.pose.place, (Vec3{1, 2, 3}));
  EXPECT_EQ(capsule.shape.axis, (Vec3{0, 5, 0})); // from one end to the other
  EXPECT_EQ(capsule.shape.friction, 0.3);
  EXPECT_EQ(change<scene::SetInstrument>("instrument k sphere 4 1 2 3").shape.axis, Vec3{});
  const auto mesh = change<scene::SetInstrument>(
      "instrument k mesh jaw.ply radius=0.5 1 2 3 turn 0 0 2 90 friction 0.3");
  EXPECT_EQ(mesh.shape.radius, 0.5);
  EXPECT_EQ(mesh.shape.friction, 0.3);
  EXPECT_EQ(mesh.pose.place, (Vec3{1, 2, 3}));
  EXPECT_EQ(mesh.pose.turn, contact::turn_about({0, 0, 1}, 90));
  EXPECT_EQ(said("at 2 instrument k mesh \"a jaw.ply\" 1 2 3").mesh, "a jaw.ply");
  EXPECT_EQ(change<scene::SetInstrument>("instrument k mesh jaw.ply 1 2 3").shape.radius, 0);
  const auto move = change<scene::MoveInstrument>("move k 1 2 3 quaternion 2 0 0 0 over 0.5");
  EXPECT_EQ(move.place, (Vec3{1, 2, 3}));
  EXPECT_EQ(move.turn, (contact::Quaternion{1, 0, 0, 0}));
  EXPECT_EQ(move.duration, 0.5);
  EXPECT_EQ(change<scene::MoveInstrument>("move k 1 2 3 quaternion 0 0 3 4").turn,
            (contact::Quaternion{0, 0, 0.6, 0.8}));
  EXPECT_FALSE(change<scene::MoveInstrument>("move k 1 2 3").turn);
  EXPECT_EQ(change<scene::MoveInstrument>("move k 1 2 3 turn 0 0 2 90").turn,
            contact::turn_about({0, 0, 1}, 90));
}

TEST(SceneLine, WordsMakeALineThatHasTheseWords) {
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"force", "a", "z>3 and not 7", "1"},
        {"object", "", "a#b", "c\td"}})
    EXPECT_EQ(formats::scene_words(formats::scene_line(words)), words);
  EXPECT_EQ(formats::scene_words("a\"b c\"d  # e"), (std::vector<std::string>{"ab cd"}));
}

TEST(SceneLine, EveryBadLineSaysWhatWasExpected) {
  const std::string known = "expected one of object, force, "; // the golden tests have all
  for (const char* word : {"slice", "steps", "STEP", "\"\""})
    EXPECT_NE(complaint(std::string(word) + " a").find(known), std::string::npos) << word;
  const std::vector<std::pair<std::string, std::string>> bad{
      {"object", "no NAME, expected object NAME"},
      {"object a", "no model"},
      {"object a \"\"", "an empty file name"},
      {"object a/b c", "'a/b' is no name"},
      {"object .a c", "'.a' is no name"},
      {"object \"a b\" c", "'a b' is no name"},
      {"object " + std::string(101, 'a') + " c", "is no name"},
      {"object a b method=fem", "'method=fem' is no use here"},
      {"object a b store=", "'store=' is no use here"},
      {"object a b rotation=warp", "rotation=warp with method=ela"},
      {"object a b method=ffe rotation=warp rotation=warp", "'rotation=warp' is no use here"},
      {"object a b store=x store=y", "'store=y' is no use here"},
      {"object a b method=ela method=ela", "'method=ela' is no use here"},
      {"object a b c", "'c' is no use here"},
      {"object a \"b", "a quote without an end"},
      {"force a", "no NODES"},
      {"force a 1 2 3", "no number, expected force NAME NODES fx fy fz [total]"},
      {"force a 1 2 3 x", "'x' is no number"},
      {"force a 1 2 3 4 totl", "surplus word 'totl'"},
      {"force a 1 2 3 4 total 5", "surplus word '5'"},
      {"force a 1 nan 0 0", "'nan' is not finite"},
      {"force a 1 0 inf 0", "'inf' is not finite"},
      {"force a 1 0 0 -inf", "'-inf' is not finite"},
      {"force a 1 1e999 0 0", "'1e999' is no number"},
      {"force a 1 0x10 0 0", "'0x10' is no number"},
      {"force a 1 1,5 0 0", "'1,5' is no number"},
      {"force a 1 + 0 0", "'+' is no number"},
      {"force a 1 +-1 0 0", "'+-1' is no number"},
      {"force a 1 ++1 0 0", "'++1' is no number"},
      {"force a z<< 0 0 1", "selector 'z<<': column 3"},
      {"displace a 1 0 0", "expected displace NAME NODES dx dy dz"},
      {"displace a 1 nan 0 0", "'nan' is not finite"},
      {"release a", "expected release NAME NODES"},
      {"release a 1 2", "surplus word '2'"},
      {"gravity 0 0", "expected gravity gx gy gz"},
      {"gravity 0 0 nan", "'nan' is not finite"},
      {"timestep", "expected timestep dt"},
      {"timestep 0", "not positive"},
      {"timestep -1", "not positive"},
      {"two-step", "no NAME"},
      {"two-step a", "no force, expected two-step NAME f0 [series] [stage=FILE.ela]"},
      {"two-step a 0", "a threshold that is not positive"},
      {"two-step a 5 stage=", "'stage=' is no use here"},
      {"two-step a 5 stage=b c", "surplus word 'c'"},
      {"two-step a 5 serial", "'serial' is no use here"},
      {"emit", "expected emit shapes|surfaces|forces"},
      {"emit pictures", "'pictures' can't be emitted"},
      {"emit shapes forces", "surplus word 'forces'"},
      {"step -1", "back in time"},
      {"step 1 2", "surplus word '2'"},
      {"step nan", "'nan' is not finite"},
      {"run", "expected run UNTIL every DT"},
      {"run 1", "no 'every'"},
      {"run 1 each 2", "'each' is not 'every'"},
      {"run 1 every", "no time"},
      {"run 1 every 0", "DT is not positive"},
      {"run inf every 1", "'inf' is not finite"},
      {"at", "expected at [every] T COMMAND"},
      {"at every 1 step", "'step' is no command behind at T"},
      {"at every 0 emit shapes", "a period that is not positive"},
      {"force a 1 0 0 1 period 0", "a time that is not positive"},
      {"pressure a 1", "expected pressure NAME NODES p [period T]"},
      {"mass a 1", "expected mass NAME NODES m [each], m 0 or more"},
      {"mass a 1 -1", "expected mass NAME NODES m [each], m 0 or more"},
      {"displace a 1 0 0 1 over -1", "a time that is not positive"},
      {"attach a 1 b 2 0", "a stiffness that is not positive"},
      {"method a", "no method, expected method NAME ffe|ela"},
      {"method a fem", "'fem' is no method"},
      {"cut a",
       "no 'springs' or 'plane', expected cut NAME springs NODES [NODES] or cut NAME plane"},
      {"cut a 3", "'3' can't be cut"},
      {"cut a springs", "no NODES"},
      {"cut a springs 1 2 3", "surplus word '3'"},
      {"cut a plane 0 0 0 0 0", "no number"},
      {"cut a plane 0 0 0 0 0 0", "a normal without direction"},
      {"cut a plane 0 0 0 0 0 1e999", "'1e999' is no number"},
      {"cut a plane 0 0 0 0 0 1 z> 3", "selector 'z>': column"},
      {"tear a", "no strain, expected tear NAME STRAIN"},
      {"tear a -0.1", "a negative strain"},
      {"restore", "no NAME, expected restore NAME"},
      {"prepare a b", "'b' is nothing to prepare, expected prepare NAME [contact [NODES]|cut]"},
      {"prepare a cut b", "surplus word 'b'"},
      {"at 1 prepare a", "'prepare' is no command behind at T"},
      {"instrument a blade 0 0 0 0 0 0", "an edge without length"},
      {"instrument a blade 0 0 0 0 0", "no number"},
      {"instrument a blade 0 0 0 0 0 1 friction 1", "surplus word 'friction'"},
      {"at 1", "no command, expected at [every] T"},
      {"at 1 step", "'step' is no command behind at T, expected one of force"},
      {"at 1 at 2 step", "'at' is no command behind at T"},
      {"at 1 object a b", "'object' is no command behind at T"},
      {"at nan emit shapes", "'nan' is not finite"},
      {std::string("step\0 1", 7), "a zero byte"},
      {std::string("\x01\xff step"), "is no command"},
  };
  for (const auto& [line, what] : bad)
    EXPECT_NE(complaint(line).find(what), std::string::npos) << line << ": " << complaint(line);
}

// ---- the run

struct FrameLog {
  std::vector<std::string> names;
  std::vector<double> times;
  std::vector<std::size_t> sizes;
};

class FrameLogger final : public formats::ResultWriter {
public:
  explicit FrameLogger(FrameLog& log) : log_(log) {}
  void add_object(const std::string& name, const model::Model& /*model*/) override {
    log_.names.push_back(name);
  }
  void add_frame(double time, std::span<const formats::FrameObject> objects) override {
    log_.times.push_back(time);
    log_.sizes.push_back(objects.size());
  }
  void commit() override {}

private:
  FrameLog& log_;
};

/// A run of lines over the model `m` (an organ) and `two` (two masses), without files.
struct Played {
  std::string replies, error;
  std::vector<std::string> warnings;
  FrameLog frames;
  cli::SceneCounts counts;
  double time = 0;
};

Played play(const std::vector<std::string>& lines) {
  Played out;
  cli::SceneOptions options;
  options.files.model = [](const std::string& name) {
    if (name == "two")
      return test::two_masses();
    if (name != "m")
      throw Error(name, "cannot open");
    return organ();
  };
  options.files.store = [](const std::string& name,
                           const model::Model&) -> compliance::StoredStiffness {
    throw Error(name, "is of another model");
  };
  options.files.node_list = [](const std::string& name) {
    return std::string(name == "list" ? "4 6\n" : "4 x\n");
  };
  options.reply = [&](std::string_view text) { out.replies += text; };
  options.warn = [&](const std::string& text) { out.warnings.push_back(text); };
  FrameLogger logger(out.frames);
  options.result = &logger;
  options.measure = true;
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
  out.counts = run.counts();
  out.time = run.simulation().time();
  return out;
}

TEST(SceneRun, RepliesAreThoseOfTheManPage) {
  const Played p = play({"object a two", "object b m", "step 0.5", "emit forces", "emit shapes",
                         "release b all", "displace b 4 0.5 0 0.25", "step 0.25"});
  EXPECT_EQ(p.error, "");
  EXPECT_EQ(p.replies.substr(0, 16), "step 1 0.5\ndone\n");
  EXPECT_EQ(p.replies.substr(16, 36), "step 2 0.75\nforces a 0\nforces b 1\n4 ");
  const std::size_t shapes = p.replies.find("shapes a 2\n-1 0 0\n1 0 0\nshapes b ");
  ASSERT_NE(shapes, std::string::npos);
  const model::Model model = organ();
  EXPECT_NE(p.replies.find("shapes b " + std::to_string(model.nodes.size()) + "\n"),
            std::string::npos);
  EXPECT_NE(p.replies.find("\n100.5 -50 50.25\n"), std::string::npos); // node 4 is the top
  EXPECT_TRUE(p.replies.ends_with("\ndone\n"));
  // Lines: 2 + (1 + 1 + 2 + 3 + 1 + n + 1)
  EXPECT_EQ(static_cast<std::size_t>(std::count(p.replies.begin(), p.replies.end(), '\n')),
            2 + 9 + model.nodes.size());
  EXPECT_EQ(p.frames.names, (std::vector<std::string>{"a", "b"}));
  EXPECT_EQ(p.frames.times, (std::vector<double>{0, 0.5, 0.75}));
  EXPECT_EQ(p.counts.commands, 8U);
  EXPECT_EQ(p.counts.frames, 3U);
  EXPECT_NEAR(p.counts.largest_displacement, std::sqrt(0.3125), 1e-12);
}

TEST(SceneRun, RunStepsToItsEndExactly) {
  EXPECT_EQ(play({"object a two", "run 1 every 0.25"}).frames.times,
            (std::vector<double>{0, 0.25, 0.5, 0.75, 1}));
  EXPECT_EQ(play({"object a two", "run 0.7 every 0.1"}).frames.times.size(), 8U);
  EXPECT_EQ(play({"object a two", "run 0.7 every 0.1"}).frames.times.back(), 0.7);
  EXPECT_EQ(play({"object a two", "run 1 every 0.4"}).frames.times,
            (std::vector<double>{0, 0.4, 0.8, 1}));
  EXPECT_EQ(play({"object a two", "step 1", "run 1 every 0.4"}).frames.times.size(), 2U);
  EXPECT_EQ(play({"object a two", "step 1", "run 3 every 1"}).frames.times,
            (std::vector<double>{0, 1, 2, 3}));
}

TEST(SceneRun, TenTenthsAreOne) {
  std::vector<std::string> lines{"object a two"};
  lines.insert(lines.end(), 10, "step 0.1");
  const Played p = play(lines);
  EXPECT_EQ(p.time, 1);
  EXPECT_NE(p.replies.find("step 10 1\n"), std::string::npos);
  EXPECT_EQ(play({"object a two", "step", "step"}).frames.times[1], 1.0 / 60);
  EXPECT_EQ(play({"object a two", "timestep 0.125", "step"}).frames.times[1], 0.125);
}

TEST(SceneRun, EventsHappenInOrderOfTimeAndFile) {
  const auto last = [](const Played& p) { return p.replies.substr(p.replies.rfind("step")); };
  const std::vector<std::string> start{"object a m", "emit forces"};
  const auto with = [&](std::vector<std::string> lines) {
    lines.insert(lines.begin(), start.begin(), start.end());
    const Played p = play(lines);
    EXPECT_EQ(p.error, "");
    return last(p);
  };
  EXPECT_NE(with({"at 1 displace a 4 1 0 0", "step 1"}).find("forces a 1"), std::string::npos);
  EXPECT_NE(with({"at 1.01 displace a 4 1 0 0", "step 1"}).find("forces a 0"), std::string::npos);
  // Written later, but earlier in time.
  EXPECT_NE(with({"at 1 release a 4", "at 0.5 displace a 4 1 0 0", "step 2"}).find("forces a 0"),
            std::string::npos);
  // At one time in the order of the file.
  EXPECT_NE(with({"at 1 release a 4", "at 1 displace a 4 1 0 0", "step 2"}).find("forces a 1"),
            std::string::npos);
  EXPECT_NE(with({"at 0 displace a 4 1 0 0", "release a 4", "step 2"}).find("forces a 0"),
            std::string::npos);
  EXPECT_NE(with({"at 0.3 displace a 4 1 0 0", "run 0.3 every 0.1"}).find("forces a 1"),
            std::string::npos);
  // An event in the midst of a step divides it.
  EXPECT_EQ(with({"at 0.01 displace a 4 1 0 0", "step 0.03"}).substr(12),
            with({"step 0.01", "displace a 4 1 0 0", "step 0.02"}).substr(12));
  const Played late = play({"object a m", "at 3 emit shapes", "step 1"});
  ASSERT_EQ(late.warnings.size(), 1U);
  EXPECT_EQ(late.warnings[0], "s: 1 event lies behind the last step and did not happen");
}

TEST(SceneRun, ForceReplacesAddsUpAndDivides) {
  const auto digest = [](std::vector<std::string> lines) {
    lines.insert(lines.begin(), "object a m method=ffe");
    lines.emplace_back("step");
    const Played p = play(lines);
    EXPECT_EQ(p.error, "");
    EXPECT_GT(p.counts.largest_displacement, 0);
    return p.counts.digest;
  };
  const std::string one = digest({"force a 4 10 0 0"});
  EXPECT_EQ(digest({"force a 4 99 9 9", "force a 4 10 0 0"}), one);
  EXPECT_EQ(digest({"force a 4 10 0 0", "force a 6 5 5 5", "release a 6"}), one);
  EXPECT_EQ(digest({"force a 4 10 0 0", "force a 6 5 5 5", "force a 6 0 0 0"}), one);
  EXPECT_NE(digest({"force a 4 10 0 0", "force a 6 5 5 5"}), one);
  EXPECT_EQ(digest({"force a 4,6 10 0 0 total"}), digest({"force a @list 5 0 0"}));
}

TEST(SceneRun, EachErrorNamesItsLine) {
  const std::vector<std::pair<std::vector<std::string>, std::string>> bad{
      {{}, "s: no command, expected object"},
      {{"", "# step"}, "s: no command, expected object"},
      {{"step"}, "s:1: there is no object, expected an object command first"},
      {{"run 1 every 1"}, "s:1: there is no object"},
      {{"gravity 0 0 1"}, "s: there is no object"},
      {{"", "force b 1 0 0 1"}, "s:2: there is no object 'b', expected an object command first"},
      {{"object a m", "force b 1 0 0 1"}, "s:2: there is no object 'b', expected one of a"},
      {{"object a m", "object a m"}, "s:2: there is an object 'a' already"},
      {{"object a none"}, "s:1: none: cannot open"},
      {{"object a m store=x.h5", "step", "force a 4 0 0 1", "step"},
       "s:1: x.h5: is of another model"},
      {{"object a m", "force a 9999 0 0 1"},
       "s:2: selector '9999': node 9999 does not exist, expected 0 to "},
      {{"object a m", "force a z>999 0 0 1"}, "s:2: selector 'z>999' selects no node"},
      {{"object a m", "force a @bad 0 0 1"}, "s:2: bad:1: "},
      {{"object a m", "displace a 5 0 0 1"}, "s:2: node 5 is fixed along "},
      {{"object a m", "displace a central 1 0 0"},
       "is fixed along x, expected a displacement of 0"},
      {{"object a m", "at 1 displace a 5 0 0 1"}, "s:2: node 5 is fixed along "},
      {{"object a m", "step 2", "at 1 emit shapes"},
       "s:3: the time 1 s is past, expected 2 s or later"},
      {{"object a m", "step 2", "run 1 every 1"}, "s:3: the time 1 s is past"},
      {{"object a m", "run 1e30 every 1e-9"}, "s:2: over 1e9 steps"},
      {{"object a two method=ffe", "force a 0 1 0 0", "step"},
       "s:3: object a at 0.016666666666666666 s: the stiffness matrix is singular"},
      {{"object a m", "object b m", "attach a 4 b 6 1", "method b ffe"},
       "s:4: object b is attached to a and moves with it, expected one that is attached to none"},
      {{"object a two", "force a 0 1e308 0 0", "step 10"}, "s:3: object a at "},
      {{"object a m", "timestep 1e-30", "force a 4 0 0 1", "step 1"},
       "s:4: object a at 0 s: a step of this length takes over 1e9 integration steps"},
  };
  for (const auto& [lines, what] : bad) {
    const Played p = play(lines);
    EXPECT_NE(p.error.find(what), std::string::npos) << what << " in: " << p.error;
    EXPECT_EQ(p.error.find('\n'), std::string::npos);
  }
  // What looks alike and is right.
  EXPECT_EQ(play({"object a m", "displace a 5 0 0 0", "step"}).error, "");
  EXPECT_EQ(play({"object a m", "step 2", "at 2 emit shapes"}).error, "");
}

TEST(SceneRun, WarnsOnceOfAStepThatIsTooLongAndOfALargeStrain) {
  Played p = play({"object a m", "timestep 1", "force a 4 0 0 1", "step 0.01", "step 0.01"});
  EXPECT_EQ(p.error, "");
  ASSERT_EQ(p.warnings.size(), 1U);
  EXPECT_NE(p.warnings[0].find("the timestep 1 s is beyond the safe "), std::string::npos);
  p = play({"object a m method=ffe", "displace a 4 0 0 9", "step", "displace a 4 0 0 10", "step"});
  ASSERT_EQ(p.warnings.size(), 1U);
  EXPECT_NE(p.warnings[0].find("object a at 0.01666"), std::string::npos);
  EXPECT_NE(p.warnings[0].find("beyond the linear range"), std::string::npos);
  p = play({"object a m method=ffe", "displace a 4 0 0 0.1", "step"});
  EXPECT_TRUE(p.warnings.empty());
  p = play({"object a m"});
  ASSERT_EQ(p.warnings.size(), 1U);
  EXPECT_EQ(p.warnings[0], "s: no step, so nothing happens");
}

TEST(SceneRun, AnObjectMayComeLater) {
  const Played p = play({"gravity 0 0 -10", "object a m", "step 1", "object b m", "step 1"});
  EXPECT_EQ(p.error, "");
  EXPECT_EQ(p.frames.sizes, (std::vector<std::size_t>{1, 1, 2}));
}

TEST(SceneRun, LinesComeFromAnInput) {
  const ScratchFile scene(".scene"), model(".ela");
  {
    std::ofstream(model.path()) << formats::ela_text(organ());
    const std::string base = model.path().substr(model.path().rfind('/') + 1);
    std::ofstream(scene.path()) << "object a " << base << "\r\nstep 1\n\nstep 2"; // no end
  }
  std::string replies;
  cli::SceneOptions options;
  options.files = cli::scene_files(scene.path(), Context{});
  options.reply = [&](std::string_view text) { replies += text; };
  formats::Input input(scene.path(), false);
  cli::SceneRun run(input.name(), Context{}, options);
  cli::run_scene(input, run);
  EXPECT_EQ(replies, "step 1 1\ndone\nstep 2 3\ndone\n");
  // From elsewhere the model is not found, for its name counts from the scene's folder.
  options.files = cli::scene_files("/nowhere/x", Context{});
  formats::Input again(scene.path(), false);
  cli::SceneRun lost(again.name(), Context{}, options);
  EXPECT_THROW(cli::run_scene(again, lost), Error);
  std::ofstream(scene.path()) << std::string(17 << 20, 'x');
  formats::Input endless(scene.path(), false);
  cli::SceneRun refused(endless.name(), Context{}, options);
  EXPECT_THROW(cli::run_scene(endless, refused), Error);
}

} // namespace
} // namespace gewebe::test
