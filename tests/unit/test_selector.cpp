#include "base/error.h"
#include "model/build.h"
#include "model/selector.h"
#include "model_meshes.h"
#include "tests/unit/complaint.h"

#include <algorithm>
#include <gtest/gtest.h>
#include <iterator>
#include <random>
#include <set>

namespace gewebe::test {
namespace {

using Nodes = std::vector<std::uint32_t>;

/// A 4 × 3 sheet of unit squares (20 nodes, x = i mod 5, y = i / 5) and, far off at -5, 20, 10, an
/// octahedron (nodes 20 to 25); central nodes 26 to 31.
const model::Model& model() {
  static const model::Model built = [] {
    TriangleMesh ball = test::octahedron();
    for (Vec3& p : ball.points)
      p += {-5, 20, 10};
    return model::build_model(test::joined(test::sheet(4, 3), ball), {}, Context{}).model;
  }();
  return built;
}

Nodes select(const std::string& text, const model::LoadNodeList& load = nullptr) {
  return model::select_nodes(model(), model::parse_selector(text), load);
}

Nodes range(std::uint32_t first, std::uint32_t last) {
  Nodes nodes;
  for (std::uint32_t i = first; i <= last; ++i)
    nodes.push_back(i);
  return nodes;
}

TEST(Selector, Atoms) {
  ASSERT_EQ(model::surface_count(model()), 26U);
  ASSERT_EQ(model().nodes.size(), 33U);
  EXPECT_EQ(select("all"), range(0, 32));
  EXPECT_EQ(select("surface"), range(0, 25));
  EXPECT_EQ(select("central"), range(26, 32));
  EXPECT_EQ(select("y<1"), range(0, 4));
  EXPECT_EQ(select("y <= 1 and z<5"), range(0, 9));
  EXPECT_EQ(select("z > 5"), range(20, 25));
  EXPECT_EQ(select("z>=11"), Nodes{24});
  EXPECT_EQ(select("x>3 and z<5"), (Nodes{4, 9, 14, 19}));
  EXPECT_EQ(select("box:1,1,-1,2,2,1"), (Nodes{6, 7, 11, 12}));
  EXPECT_EQ(select("sphere:0,0,0,1"), (Nodes{0, 1, 5}));
  EXPECT_EQ(select("plane:1,1,0,6 and z<5"), Nodes{19});
  EXPECT_EQ(select("plane:-1,0,0,-1 and z<1"), (Nodes{0, 5, 10, 15}));
  EXPECT_EQ(select("component:0"), range(0, 19));
  EXPECT_EQ(select("component:1"), range(20, 25));
  EXPECT_EQ(select("boundary"), (Nodes{0, 1, 2, 3, 4, 5, 9, 10, 14, 15, 16, 17, 18, 19}));
  EXPECT_EQ(select("3,1,7-9,8"), (Nodes{1, 3, 7, 8, 9}));
  EXPECT_EQ(select("x<1e-3 and y>-1.5 and z<1"), (Nodes{0, 5, 10, 15}));
}

TEST(Selector, NearIsTheOneClosestNode) {
  EXPECT_EQ(select("near:1.2,1.1,0,1"), Nodes{6});
  EXPECT_EQ(select("near:1.5,1,0,1"), Nodes{6}); // as near as 7: the lower number
  EXPECT_EQ(select("near:1,1,0,0"), Nodes{6});
  EXPECT_NE(test::complaint([] { select("near:1.2,1.1,0,0.1"); }).find("selects no node"),
            std::string::npos);
  EXPECT_EQ(select("sphere:1.5,1,0,0.5"), (Nodes{6, 7})); // a sphere takes all within
}

TEST(Selector, CentralNodesOnlyWhereNamed) {
  EXPECT_EQ(select("not z<5"), range(20, 25));
  EXPECT_EQ(select("not surface or central"), range(26, 32));
  EXPECT_EQ(select("not central"), range(0, 25));
  EXPECT_EQ(select("central and component:1"), range(30, 32));
  EXPECT_EQ(select("central and z>5"), range(30, 32));
  EXPECT_EQ(select("26"), Nodes{26});
  EXPECT_EQ(select("all and not surface"), range(26, 32));
}

TEST(Selector, NumbersAloneAreWhatTheyAreInAnExpression) {
  EXPECT_EQ(select("8-9,3,3-5,4,32,0-1,8"), (Nodes{0, 1, 3, 4, 5, 8, 9, 32}));
  for (const std::string numbers :
       {"8-9,3,3-5,4,32,0-1,8", "0", "0-32", "32,31,0", "5-7,6,7-8", "1-1,2"})
    EXPECT_EQ(select(numbers), select("not not (" + numbers + ")")) << numbers;
  EXPECT_EQ(test::complaint([] { select("3,33"); }),
            "selector '3,33': node 33 does not exist, expected 0 to 32");
}

TEST(Selector, CountsThatAreKnownAreNotCounted) {
  const model::NodeCounts counts = model::node_counts(model());
  EXPECT_EQ(counts.surface, 26U);
  EXPECT_EQ(counts.body, 26U);
  for (const char* const text : {"surface", "central", "near:1.2,1.1,0,1", "not z<5", "7"})
    EXPECT_EQ(model::select_nodes(model(), counts, model::parse_selector(text)), select(text))
        << text;
  EXPECT_EQ(
      model::select_nodes(model(), {.surface = 5, .body = 26}, model::parse_selector("surface")),
      range(0, 4)); // it is they that are taken
}

TEST(Selector, PrecedenceIsNotAndOr) {
  // or binds weakest: a or b and c is a or (b and c).
  EXPECT_EQ(select("19 or y<1 and x<1"), (Nodes{0, 19}));
  EXPECT_EQ(select("(19 or y<1) and x<1"), Nodes{0});
  EXPECT_EQ(select("not y<1 and z<5 and y<2"), range(5, 9));
  EXPECT_EQ(select("not(y<1 or z>5)and(y<2)"), range(5, 9));
  EXPECT_EQ(select("not not 4"), Nodes{4});
  EXPECT_EQ(select("  ( ( 4 ) )  "), Nodes{4});
}

TEST(Selector, FilesComeFromTheCaller) {
  const model::LoadNodeList load = [](const std::string& name) -> std::string {
    if (name == "grip")
      return "# the grip\n1, 2 7-9\n\n 12 # one more\n";
    if (name == "a b.txt")
      return "3";
    if (name == "bad")
      return "1\n2x\n";
    if (name == "far")
      return "99";
    if (name == "none")
      return "# nothing\n";
    throw Error(name, "cannot be opened, expected a file");
  };
  EXPECT_EQ(select("@grip", load), (Nodes{1, 2, 7, 8, 9, 12}));
  EXPECT_EQ(select("not (@grip)and @grip or @'a b.txt' or @\"a b.txt\"", load), Nodes{3});
  EXPECT_EQ(test::complaint([&] { select("@bad", load); }).substr(0, 6), "bad:2:");
  EXPECT_NE(test::complaint([&] { select("@far", load); }).find("node 99 does not exist"),
            std::string::npos);
  EXPECT_EQ(test::complaint([&] { select("@none", load); }).substr(0, 5), "none:");
  EXPECT_EQ(test::complaint([&] { select("@lost", load); }).substr(0, 5), "lost:");
  EXPECT_NE(test::complaint([&] { select("@grip"); }).find("no files"), std::string::npos);
  EXPECT_NE(test::complaint([&] { model::parse_node_list("1 3-2", "L"); }), "");
  EXPECT_NE(test::complaint([&] { model::parse_node_list("1-", "L"); }), "");
  EXPECT_NE(test::complaint([&] { model::parse_node_list("4294967296", "L"); }), "");
  EXPECT_NE(test::complaint([&] { model::parse_node_list("1;2", "L"); }), "");
}

TEST(Selector, TruthTables) {
  // Node 0 is in A and B, 1 in A, 5 in B, 6 in neither.
  const std::string a = "(0,1)", b = "(0,5)";
  const auto has = [](const Nodes& nodes, std::uint32_t i) {
    return std::binary_search(nodes.begin(), nodes.end(), i);
  };
  const Nodes both = select(a + " and " + b), either = select(a + " or " + b),
              not_a = select("not " + a);
  for (const auto& [node, in_a, in_b] :
       {std::tuple{0U, true, true}, {1U, true, false}, {5U, false, true}, {6U, false, false}}) {
    EXPECT_EQ(has(both, node), in_a && in_b);
    EXPECT_EQ(has(either, node), in_a || in_b);
    EXPECT_EQ(has(not_a, node), !in_a);
  }
}

// Random expressions, and an evaluation of them that shares nothing with the parser.
class RandomExpression {
public:
  explicit RandomExpression(unsigned seed) : random_(seed) {}

  std::pair<std::string, std::set<std::uint32_t>> make(int depth) {
    const unsigned kind = depth == 0 ? 0 : random_() % 4;
    if (kind == 0) {
      const std::uint32_t node = static_cast<std::uint32_t>(random_() % 26);
      switch (random_() % 3) {
      case 0:
        return {std::to_string(node), {node}};
      case 1: {
        std::set<std::uint32_t> nodes;
        for (std::uint32_t i = 0; i < 26; ++i)
          if (model().nodes[i].position.x < static_cast<double>(node % 5))
            nodes.insert(i);
        return {"x<" + std::to_string(node % 5), nodes};
      }
      default: {
        const std::uint32_t last = node + static_cast<std::uint32_t>(random_() % (26 - node));
        std::set<std::uint32_t> nodes;
        for (std::uint32_t i = node; i <= last; ++i)
          nodes.insert(i);
        return {std::to_string(node) + "-" + std::to_string(last), nodes};
      }
      }
    }
    const auto [text, nodes] = make(depth - 1);
    std::set<std::uint32_t> result;
    if (kind == 1) {
      for (std::uint32_t i = 0; i < 26; ++i)
        if (!nodes.contains(i))
          result.insert(i);
      return {"not (" + text + ")", result};
    }
    const auto [right, right_nodes] = make(depth - 1);
    if (kind == 2)
      std::set_union(nodes.begin(), nodes.end(), right_nodes.begin(), right_nodes.end(),
                     std::inserter(result, result.begin()));
    else
      std::set_intersection(nodes.begin(), nodes.end(), right_nodes.begin(), right_nodes.end(),
                            std::inserter(result, result.begin()));
    return {"(" + text + (kind == 2 ? ") or (" : ") and (") + right + ")", result};
  }

private:
  std::mt19937 random_;
};

TEST(Selector, RandomExpressionsAndDeMorgan) {
  RandomExpression random(11);
  const auto selected = [](const std::string& text) {
    // "or 25" keeps the selection from being empty.
    return select("(" + text + ") or 25");
  };
  int unequal = 0;
  for (int round = 0; round < 2000; ++round) {
    const auto [a, nodes] = random.make(5);
    const auto [b, nodes_b] = random.make(4);
    std::set<std::uint32_t> expected = nodes;
    expected.insert(25);
    ASSERT_EQ(selected(a), Nodes(expected.begin(), expected.end())) << a;
    ASSERT_EQ(selected("not ((" + a + ") or (" + b + "))"),
              selected("not (" + a + ") and not (" + b + ")"));
    ASSERT_EQ(selected("not ((" + a + ") and (" + b + "))"),
              selected("not (" + a + ") or not (" + b + ")"));
    // Negative control: the wrong law must fail somewhere.
    if (selected("not ((" + a + ") or (" + b + "))") !=
        selected("not (" + a + ") or not (" + b + ")"))
      ++unequal;
  }
  EXPECT_GT(unequal, 500);
}

TEST(Selector, SyntaxErrorsNameTheColumn) {
  struct Case {
    const char* text;
    int column;
  };
  for (const Case& c : {Case{"", 1},
                        {"   ", 4},
                        {"foo", 1},
                        {"z", 2},
                        {"z<", 3},
                        {"z<a", 3},
                        {"z<nan", 3},
                        {"z<1e999", 3},
                        {"z<3x", 4},
                        {"z<3 z<4", 5},
                        {"z=3", 2},
                        {"z==3", 2},
                        {"w<3", 1},
                        {"(z<3", 1},
                        {"z<3)", 4},
                        {"()", 2},
                        {"z<3 and", 8},
                        {"and z<3", 1},
                        {"z<3 or or 1", 8},
                        {"not", 4},
                        {"box:1,2,3", 10},
                        {"box:1,2,3,4,5,6,7", 16},
                        {"box:2,2,3,1,5,6", 16},
                        {"box", 4},
                        {"sphere:0,0,0,-1", 16},
                        {"sphere:0,0,,1", 12},
                        {"plane:0,0,0,1", 14},
                        {"near:1,2,3", 11},
                        {"component", 10},
                        {"component:", 11},
                        {"component:-1", 11},
                        {"component:1.5", 12},
                        {"1,", 3},
                        {"1,,2", 3},
                        {"9-7", 3},
                        {"1-", 3},
                        {"1 2", 3},
                        {"4294967296", 1},
                        {"-1", 1},
                        {"@", 1},
                        {"@'a", 2},
                        {"@'a'b", 5},
                        {"all surface", 5},
                        {"All", 1},
                        {"z<3\x01", 4}}) {
    const std::string text = test::complaint([&] { model::parse_selector(c.text); });
    EXPECT_NE(text.find("column " + std::to_string(c.column) + ": "), std::string::npos)
        << c.text << " gives " << text;
    EXPECT_EQ(text.find('\n'), std::string::npos);
  }
  std::string deep;
  for (int i = 0; i < 100000; ++i)
    deep += '(';
  EXPECT_NE(test::complaint([&] { model::parse_selector(deep); }).find("too deep"),
            std::string::npos);
  std::string nots;
  for (int i = 0; i < 100000; ++i)
    nots += "not ";
  EXPECT_EQ(select(nots + "4"), Nodes{4});
  EXPECT_NO_THROW(model::parse_selector(std::string(64, '(') + "1" + std::string(64, ')')));
}

TEST(Selector, WhatTheModelLacksIsAnError) {
  for (const char* text : {"33", "0-33", "component:2", "component:4294967295", "z<-99",
                           "near:99,0,0,1", "1 and 2", "not surface"})
    EXPECT_NE(test::complaint([&] { select(text); }), "") << text;
  EXPECT_EQ(test::complaint([] { select("1 and 2"); }),
            "selector '1 and 2' selects no node, expected at least one; the model's box is -6,0,0 "
            "to 4,21,11");
}

} // namespace
} // namespace gewebe::test
