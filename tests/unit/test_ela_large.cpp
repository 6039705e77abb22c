// Models of so many lines that their text is read in pieces side by side: what it says, and which
// line is wrong, must not depend on that.

#include "base/error.h"
#include "formats/model/ela.h"
#include "model/build.h"
#include "model/check.h"
#include "model/primitive.h"
#include "tests/unit/complaint.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

namespace gewebe::test {
namespace {

Context on_threads(int count) {
  Context context;
  context.threads = count;
  return context;
}

const model::Model& large_model() {
  static const model::Model model = [] {
    TriangleMesh mesh = model::primitive_mesh(model::parse_primitive("plane:70x60", ""));
    for (std::size_t p = 0; p < mesh.points.size(); ++p)
      mesh.points[p].z = 0.01 * static_cast<double>(p % 7);
    mesh.texcoords.assign(mesh.triangles.size(), {0, 0.1F, 0.2F, 0.3F, 0.4F, 1});
    model::BuildOptions options;
    options.bend = options.normals = true;
    return model::build_model(mesh, options, Context{}).model;
  }();
  return model;
}

std::vector<std::string> lines_of(std::string_view text) {
  std::vector<std::string> lines;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = text.find('\n', at);
    lines.emplace_back(text.substr(at, end - at));
    at = end + 1;
  }
  return lines;
}

std::string text_of(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines)
    text += line + "\n";
  return text;
}

std::size_t line_of_section(const std::vector<std::string>& lines, std::string_view name) {
  const auto at =
      std::ranges::find_if(lines, [&](const std::string& line) { return line.starts_with(name); });
  return static_cast<std::size_t>(at - lines.begin());
}

/// "LINE: what", or "" if the text is read; the same on one thread and on two.
std::string complaint(const std::vector<std::string>& lines) {
  std::vector<std::string> said;
  for (const int threads : {1, 2})
    said.push_back(test::complaint(
        [&] { return formats::parse_ela(text_of(lines), "M", on_threads(threads)); }));
  EXPECT_EQ(said[0], said[1]);
  return said[0].empty() ? said[0] : said[0].substr(2);
}

TEST(ElaLarge, ReadsWhatItWrites) {
  const model::Model& model = large_model();
  const std::string text = formats::ela_text(model);
  ASSERT_GT(text.size(), std::size_t{4} << 18); // several pieces
  ASSERT_GT(model.nodes.size(), 4096U);
  EXPECT_TRUE(formats::parse_ela(text, "M", on_threads(1)) == model);
  EXPECT_TRUE(formats::parse_ela(text, "M", on_threads(2)) == model);
}

TEST(ElaLarge, CommentsAndBlankLinesMayStandAnywhere) {
  std::mt19937 random(5);
  std::vector<std::string> lines;
  for (const std::string& line : lines_of(formats::ela_text(large_model()))) {
    if (random() % 7 == 0)
      lines.emplace_back(random() % 2 == 0 ? "" : "  # nodes 7");
    lines.push_back(line + (random() % 9 == 0 ? " # 3" : ""));
  }
  EXPECT_TRUE(formats::parse_ela(text_of(lines), "M", on_threads(2)) == large_model());
  // Lines behind them are counted, too.
  const std::size_t end = line_of_section(lines, "end");
  lines[end] = "stop";
  EXPECT_EQ(complaint(lines).substr(0, 20),
            (std::to_string(end + 1) + ": 'stop' is no section").substr(0, 20));
}

TEST(ElaLarge, EachFaultHasItsLine) {
  const std::vector<std::string> whole = lines_of(formats::ela_text(large_model()));
  std::mt19937 random(6);
  using Sections = std::vector<std::pair<std::string, std::size_t>>;
  const model::Model& model = large_model();
  for (const auto& [name, count] : Sections{{"nodes", model.nodes.size()},
                                            {"normals", model.normals.size()},
                                            {"springs", model.springs.size()},
                                            {"triangles", model.triangles.size()},
                                            {"texcoords", model.texcoords.size()}})
    for (const std::size_t place : {random() % count, count - 1}) {
      const std::size_t at = line_of_section(whole, name) + 1 + place;
      const std::string where = std::to_string(at + 1) + ": ";
      std::vector<std::string> lines = whole;
      lines[at] = "1e999" + lines[at].substr(lines[at].find(' '));
      EXPECT_EQ(complaint(lines).substr(0, where.size() + 7), where + "'1e999'") << name;
      lines[at] = whole[at] + " 7";
      EXPECT_EQ(complaint(lines).substr(0, where.size() + 12), where + "surplus word") << name;
      lines[at] = "end";
      EXPECT_EQ(complaint(lines), where + "section 'end' after " + std::to_string(place) + " of " +
                                      std::to_string(count) + " " + name +
                                      ", expected all of them");
      lines[at] = whole[at] + "\n" + whole[at]; // one too many: the section, or what stands twice
      EXPECT_NE(complaint(lines), "") << name;
    }
}

TEST(ElaLarge, EachFaultOfTheModelHasItsLine) {
  const std::vector<std::string> whole = lines_of(formats::ela_text(large_model()));
  const std::size_t nodes = line_of_section(whole, "nodes"),
                    springs = line_of_section(whole, "springs");
  const auto said = [&](std::size_t at, const std::string& line) {
    std::vector<std::string> lines = whole;
    lines[at] = line;
    return complaint(lines);
  };
  const auto where = [](std::size_t at) { return std::to_string(at + 1) + ": "; };
  EXPECT_EQ(said(nodes + 4000, "0 0 0 -1 0 - 4200 0"),
            where(nodes + 4000) + "mass is -1, expected a finite number, 0 or more");
  EXPECT_EQ(said(nodes + 4000, "0 0 0 1 0 - 4200 9").substr(0, 30),
            (where(nodes + 4000) + "material 9 does not exist, expected").substr(0, 30));
  const std::size_t last = springs + large_model().springs.size();
  for (const std::size_t at :
       {springs + 2, springs + 9000, springs + 16384, springs + 16385, springs + 25000, last}) {
    EXPECT_EQ(said(at, whole[at - 1]).substr(0, where(at).size() + 7), where(at) + "spring ") << at;
    EXPECT_NE(said(at, whole[at - 1]).find("stands twice"), std::string::npos) << at;
  }
  EXPECT_NE(said(springs + 9000, whole[springs + 8000]).find("stands behind"), std::string::npos);
}

TEST(ElaLarge, AnEdgeAmongTheBendingSpringsIsFoundSideBySide) {
  const std::size_t edges = model::spring_count(large_model(), model::SpringKind::edge);
  ASSERT_GT(model::spring_count(large_model(), model::SpringKind::bend), 8000U);
  for (std::size_t n = 7; n < edges; n += edges / 6) {
    model::Model model = large_model();
    model::Spring twice = model.springs[n];
    twice.kind = model::SpringKind::bend;
    const auto before = [](const model::Spring& a, const model::Spring& b) {
      return std::tie(a.kind, a.i, a.j) < std::tie(b.kind, b.i, b.j);
    };
    model.springs.insert(std::ranges::lower_bound(model.springs, twice, before), twice);
    try {
      model::check_model(model, on_threads(2));
      ADD_FAILURE() << n;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("is of kind e and of kind b"), std::string::npos);
    }
  }
}

TEST(ElaLarge, ChecksSideBySideSayWhatOneByOneDo) {
  std::mt19937 random(7);
  const auto said = [](const auto& check) -> std::string {
    try {
      check();
    } catch (const gewebe::Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(said([] { model::check_model(large_model(), on_threads(2)); }), "");
  int refused = 0;
  for (int round = 0; round < 40; ++round) {
    model::Model model = large_model();
    for (int fault = 0; fault < 2; ++fault) {
      model::Spring& s = model.springs[random() % model.springs.size()];
      switch (random() % 4) {
      case 0:
        s.j = model.springs[random() % model.springs.size()].j;
        break;
      case 1:
        s.damping = -1;
        break;
      case 2:
        s.kind = model::SpringKind::bend;
        break;
      default:
        std::swap(s, model.springs[random() % model.springs.size()]);
      }
    }
    const std::string one = said([&] { model::check_model(model); });
    EXPECT_EQ(said([&] { model::check_model(model, on_threads(2)); }), one);
    refused += one.empty() ? 0 : 1;
  }
  EXPECT_GT(refused, 35);
}

} // namespace
} // namespace gewebe::test
