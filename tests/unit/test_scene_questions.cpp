// Questions to a scene and acknowledgements: what is told, and that nothing changes by asking.

#include "base/error.h"
#include "formats/scene/frames_binary.h"
#include "formats/scene/scene.h"
#include "fuzzed_scenes.h"
#include "scratch.h"
#include "sim_models.h"
#include "tools/run/event_log.h"
#include "tools/run/scene_record.h"
#include "tools/run/scene_run.h"

#include <cstring>
#include <fstream>
#include <gtest/gtest.h>
#include <iterator>
#include <random>
#include <sstream>
#include <string>
#include <vector>

namespace gewebe::test {
namespace {

struct Asked {
  std::vector<std::string> replies; ///< each as it was told
  std::string record, events;
};

std::string content(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Nothing but answers, a record and events: no shape is computed unless the scene wants it.
Asked ask(const std::vector<std::string>& lines, bool acknowledge = false, bool binary = false) {
  Asked out;
  const ScratchFile record(".scene"), events(".csv");
  {
    cli::SceneRecord log(record.path(), formats::Output::Options{}, "-");
    cli::EventLog table(events.path(), formats::Output::Options{.binary = false});
    cli::SceneOptions options;
    options.files.model = [&](const std::string& name) {
      return test::fuzzed_models().at(name.substr(name.find_last_of('/') + 1));
    };
    options.files.store = [](const std::string& name, const model::Model&) {
      return test::fuzzed_store(name.substr(name.find_last_of('/') + 1), 1);
    };
    options.files.node_list = [](const std::string&) { return std::string("4 6-7 # nodes\n"); };
    options.reply = [&](std::string_view text) { out.replies.emplace_back(text); };
    options.serve = true;
    options.acknowledge = acknowledge;
    options.binary = binary;
    options.record = &log;
    options.events = &table;
    cli::SceneRun run("s", Context{}, options);
    for (const std::string& line : lines)
      run.line(line);
    run.finish();
    log.commit();
    table.commit();
  }
  out.record = content(record.path());
  out.events = content(events.path());
  return out;
}

bool tells(const std::string& reply) {
  for (const char* word : {"nodes ", "select ", "objects ", "instruments ", "error ", "ok "})
    if (reply.starts_with(word))
      return true;
  return false;
}

std::string steps_of(const std::vector<std::string>& replies) {
  std::string text;
  for (const std::string& reply : replies)
    if (!tells(reply))
      text += reply;
  return text;
}

/// Every question, behind every line.
std::vector<std::string> with_questions(const std::vector<std::string>& lines) {
  std::vector<std::string> asked;
  for (const std::string& line : lines) {
    asked.push_back(line);
    for (const char* question :
         {"objects", "instruments", "nodes a", "nodes a rest", "nodes a positions",
          "nodes b positions", "nodes c positions", "select a z>0", "select b \"4 or x<0\"",
          "select b 99999", "nodes nobody", "sync"})
      asked.emplace_back(question);
  }
  return asked;
}

TEST(SceneQuestions, AreRead) {
  const auto query = [](const char* line) {
    return std::get<formats::QueryCommand>(formats::parse_scene_line(line).value().what);
  };
  EXPECT_EQ(query("nodes a").positions, formats::QueryCommand::Positions::none);
  EXPECT_EQ(query("nodes a rest").positions, formats::QueryCommand::Positions::rest);
  EXPECT_EQ(query("nodes a positions").positions, formats::QueryCommand::Positions::now);
  EXPECT_EQ(query("select a \"z<3 and not 4\"").nodes->text, "z<3 and not 4");
  EXPECT_EQ(query("objects").kind, formats::QueryCommand::Kind::objects);
  EXPECT_EQ(query("instruments # all").kind, formats::QueryCommand::Kind::instruments);
  for (const char* line : {"nodes", "nodes a now", "nodes a rest positions", "select a",
                           "select a z<", "objects a", "instruments p", "at 1 objects"})
    EXPECT_THROW((void)formats::parse_scene_line(line), Error) << line;
}

TEST(SceneQuestions, TellWhatThereIs) {
  const Asked out =
      ask({"object a two", "object b gel method=ffe", "objects", "nodes a rest", "nodes b",
           "select a 1", "select b @list", "instrument p capsule 2 0 0 90 0 0 95 friction 0.5",
           "instrument k blade 0 0 80 1 0 80", "instrument q sphere 3 0 0 70", "withdraw q",
           "displace a 1 0 0.25 0", "step 0", "nodes a positions", "objects",
           "move p 1 2 93 quaternion 0 1 0 0", "step 0", "instruments"});
  const std::size_t nodes = test::fuzzed_models().at("gel").nodes.size(),
                    triangles = test::fuzzed_models().at("gel").triangles.size(),
                    tetrahedra = test::fuzzed_models().at("gel").tetrahedra.size();
  EXPECT_EQ(out.replies.at(0), "objects 2\na ela - - - asleep\nb ffe - - - -\n");
  const std::vector<model::Node>& two = test::fuzzed_models().at("two").nodes;
  std::string rest = "nodes a 2\n", moved = rest;
  for (std::size_t k = 0; k < 2; ++k) {
    const Vec3& p = two[k].position;
    const std::string x = text::number_text(p.x) + " ", z = " " + text::number_text(p.z) + "\n";
    rest += x + text::number_text(p.y) + z;
    moved += x + text::number_text(p.y + (k == 1 ? 0.25 : 0)) + z;
  }
  EXPECT_EQ(out.replies.at(1), rest);
  EXPECT_EQ(out.replies.at(2), "nodes b " + std::to_string(nodes) + "\n");
  EXPECT_EQ(out.replies.at(3), "select a 1\n1\n");
  EXPECT_EQ(out.replies.at(4), "select b 3\n4\n6\n7\n");
  EXPECT_EQ(out.replies.at(6), moved);
  EXPECT_EQ(out.replies.at(7), "objects 2\na ela 2 0 0 awake\nb ffe " + std::to_string(nodes) +
                                   " " + std::to_string(triangles) + " " +
                                   std::to_string(tetrahedra) + " -\n");
  const std::string& instruments = out.replies.at(9);
  EXPECT_TRUE(instruments.starts_with("instruments 2\np capsule 2 0.5 1 2 93 1 2 88 0 1 0 0 0 "))
      << instruments;
  EXPECT_NE(instruments.find("\nk blade 0 0 0 0 80 1 0 80 1 0 0 0 0 0 0 0 0 0 0\n"),
            std::string::npos)
      << instruments;
}

TEST(SceneQuestions, EachLineIsAcknowledgedOnceAndLast) {
  const std::vector<std::string> lines{"object a two", "",     "# nothing", "nodes a",
                                       "nodes z",      "step", "step x",    "run 0.1 every 0.03",
                                       "sync",         "\"",   "objects"};
  const Asked out = ask(lines, true);
  std::size_t line = 0;
  bool acknowledged = true; // the reply before was one
  for (const std::string& reply : out.replies) {
    acknowledged = reply.starts_with("ok ") || reply.starts_with("error ");
    line += acknowledged ? 1 : 0;
    if (acknowledged) {
      EXPECT_EQ(reply.substr(reply.find(' ') + 1).substr(0, std::to_string(line).size()),
                std::to_string(line));
      const bool wrong = line == 5 || line == 7 || line == 10;
      EXPECT_EQ(reply.starts_with("error "), wrong) << reply;
    }
  }
  EXPECT_TRUE(acknowledged);
  EXPECT_EQ(line, lines.size());
  // The same in frames.
  std::vector<std::uint64_t> acknowledged_lines;
  std::string told;
  for (const std::string& reply : ask(lines, true, true).replies) {
    std::uint32_t kind = 0;
    std::uint64_t count = 0, number = 0;
    std::memcpy(&kind, &reply.at(4), 4);
    std::memcpy(&count, &reply.at(20), 8);
    if (kind == static_cast<std::uint32_t>(formats::FrameKind::ok)) {
      ASSERT_EQ(reply.size(), 36U);
      std::memcpy(&number, &reply.at(28), 8);
      acknowledged_lines.push_back(number);
    } else if (kind == static_cast<std::uint32_t>(formats::FrameKind::told)) {
      EXPECT_EQ(reply.size(), 28 + 4 * count);
      told += reply.substr(28).c_str();
    }
  }
  EXPECT_EQ(acknowledged_lines, (std::vector<std::uint64_t>{1, 2, 3, 4, 6, 8, 9, 11}));
  EXPECT_EQ(told, "nodes a 2\nobjects 1\na ela 2 0 0 asleep\n");
}

TEST(SceneQuestions, ChangeNothing) {
  // Forces alone are emitted: a shape that a question computed would be seen in the last digits of
  // later ones.
  std::vector<std::string> lines{"object a ball store=ball", "object b gel store=gel",
                                 "object c shell", "emit forces"};
  std::mt19937 random(3);
  const auto number = [&] { return text::number_text(static_cast<double>(random() % 1000) / 3e3); };
  for (int k = 0; k < 20; ++k) {
    const std::string object(1, "ab"[random() % 2]),
        node = object == "a" ? std::to_string(6 + random() % 6) : "x>23";
    lines.push_back("displace " + object + " " + node + " 0 " + number() + " " + number());
    lines.push_back("force c 6 0 " + number() + " 1");
    lines.emplace_back(k == 10 ? "method c ffe" : k == 13 ? "emit shapes" : "step 0.001");
    lines.emplace_back("step 0.002");
  }
  const Asked calm = ask(lines), asked = ask(with_questions(lines));
  std::vector<std::string> refused;
  for (const std::string& reply : asked.replies)
    if (reply.find("had no use for the shape") != std::string::npos)
      refused.push_back(reply);
  EXPECT_GT(refused.size(), 10U);
  std::string steps;
  for (const std::string& reply : asked.replies)
    if (!tells(reply) && !reply.starts_with("sync "))
      steps += reply;
  EXPECT_EQ(steps, steps_of(calm.replies));
  std::string record; // sync is kept
  std::istringstream kept(asked.record);
  for (std::string line; std::getline(kept, line);)
    record += line == "sync" ? "" : line + "\n";
  EXPECT_EQ(record, calm.record);
  std::istringstream events(asked.events);
  std::string happened;
  for (std::string line; std::getline(events, line);)
    happened += line.find(",error,") != std::string::npos ? "" : line + "\n"; // to questions alone
  EXPECT_EQ(happened, calm.events);
}

TEST(SceneQuestions, ChangeNothingInAnyScene) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const std::vector<std::string> lines = test::FuzzedScene(seed).lines();
    const test::FuzzedRun calm = test::run_fuzzed(lines, true, 1, "");
    const test::FuzzedRun asked = test::run_fuzzed(with_questions(lines), true, 1, "");
    if (calm.slow || asked.slow)
      continue;
    EXPECT_EQ(asked.fault, "") << seed;
    EXPECT_EQ(asked.digest, calm.digest) << seed;
    EXPECT_EQ(asked.result, calm.result) << seed;
    EXPECT_GT(asked.errors, calm.errors) << seed;
  }
}

} // namespace
} // namespace gewebe::test
