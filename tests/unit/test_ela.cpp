#include "formats/model/ela.h"
#include "larger.h"
#include "model/build.h"
#include "model_meshes.h"
#include "tests/unit/complaint.h"

#include <chrono>
#include <cstring>
#include <gtest/gtest.h>
#include <limits>
#include <random>
#include <string>

namespace gewebe::test {
namespace {

model::Model rich_model() {
  TriangleMesh mesh = test::joined(test::octahedron(), test::ball(1, 0.3, {5, 0, 0}));
  mesh.texcoords.assign(mesh.triangles.size(), {0, 0.1F, 0.2F, 0.3F, 0.4F, 1});
  model::BuildOptions options;
  options.material = model::parse_material_choice("liver,1=gallbladder");
  options.bend = options.normals = true;
  model::Model model = model::build_model(mesh, options, Context{}).model;
  model.materials[0].poisson = 0.25;
  model.materials[0].law = model::parse_law("ogden:alpha1=4,alpha2=-3,mu2=0.3");
  model.tetrahedra = {{0, 2, 5, 4}, {0, 3, 4, 5}};
  model.tetrahedron_material = {0, 0};
  model.name = "two balls, Größe 1";
  return model;
}

/// The complaint about a text as "LINE: what", or "" if it is read.
std::string complaint(std::string_view text) {
  const std::string said = test::complaint([&] { return formats::parse_ela(text, "M"); });
  EXPECT_TRUE(said.empty() || said.starts_with("M:")) << said;
  EXPECT_EQ(said.find('\n'), std::string::npos);
  return said.empty() ? said : said.substr(2);
}

const std::string small = "ela_expl 1\n"
                          "name \"t\"\n"
                          "materials 1\n"
                          "0 \"liver\" 1e-3 1000 1 0.2\n"
                          "nodes 4\n"
                          "0 0 0 1 0 - 3 0\n"
                          "1 0 0 1 0 xy 3 0\n"
                          "0 1 0 1 0 - 3 0\n"
                          "0 0 1 1 0 xyz -1 0\n"
                          "springs 4\n"
                          "0 1 e 10 0.1 1\n"
                          "0 2 e 10 0.1 1\n"
                          "1 2 b 10 0.1 1.5\n"
                          "0 3 c 10 0.1 1\n"
                          "triangles 1\n"
                          "0 1 2\n"
                          "end\n";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(Ela, ReadsWhatItWrites) {
  const model::Model model = rich_model();
  const std::string text = formats::ela_text(model);
  const model::Model back = formats::parse_ela(text, "M");
  EXPECT_EQ(back, model);
  EXPECT_EQ(formats::ela_text(back), text);
  EXPECT_EQ(model::model_digest(back), model::model_digest(model));
  EXPECT_EQ(text.substr(0, 11), "ela_expl 1\n");
  EXPECT_EQ(text.substr(text.size() - 5), "\nend\n");
}

TEST(Ela, DoublesOfAnyKindSurvive) {
  std::mt19937_64 random(3);
  model::Model model = formats::parse_ela(small, "M");
  for (int round = 0; round < 3000; ++round) {
    for (double* value : {&model.nodes[0].mass, &model.nodes[1].drag, &model.springs[0].stiffness,
                          &model.springs[1].damping, &model.springs[2].rest}) {
      do {
        const std::uint64_t bits = random() >> 1; // no sign
        std::memcpy(value, &bits, sizeof bits);
      } while (!std::isfinite(*value));
    }
    const model::Model back = formats::parse_ela(formats::ela_text(model), "M");
    ASSERT_EQ(back, model);
  }
  model.nodes[0].position = {-0.0, 5e-324, -1.5e100};
  model.nodes[2].mass = std::numeric_limits<double>::max();
  const model::Model back = formats::parse_ela(formats::ela_text(model), "M");
  EXPECT_EQ(back, model);
  EXPECT_TRUE(std::signbit(back.nodes[0].position.x));
}

TEST(Ela, SameBytesForAnyThreads) {
  const model::Model model =
      model::build_model(test::ball(6, 50), {}, Context{}).model; // more than one batch of lines
  const std::string text = formats::ela_text(model);
  EXPECT_EQ(formats::parse_ela(text, "M"), model);
  EXPECT_GT(text.size(), 1U << 20);
}

TEST(Ela, EveryTruncatedPrefixFails) {
  for (const std::string& text : {small, formats::ela_text(rich_model())}) {
    ASSERT_EQ(complaint(text), "");
    for (std::size_t size = 0; size < text.size(); ++size)
      ASSERT_NE(complaint(std::string_view(text).substr(0, size)), "") << size;
  }
}

TEST(Ela, CommentsBlanksAndLineEndsMayStandAnywhere) {
  const model::Model plain = formats::parse_ela(small, "M");
  std::string loose = "# by hand\n\n";
  for (const char c : small)
    loose += c == '\n' ? std::string("\t # a comment\r\n\n  # another\n") : std::string(1, c);
  EXPECT_EQ(formats::parse_ela(loose, "M"), plain);
  EXPECT_EQ(complaint(small + "\n# the last words\n"), "");
}

TEST(Ela, EachFaultHasItsLine) {
  struct Case {
    const char *from, *to, *expected;
  };
  const Case cases[] = {
      {"ela_expl 1", "ela_expl 2", "1: version 2, expected 1"},
      {"ela_expl 1", "ela_expl", "1: the line ends before version"},
      {"ela_expl 1", "ply", "1: no model, expected 'ela_expl 1'"},
      {"name \"t\"", "name t", "2: no name, expected one in quotes"},
      {"name \"t\"", "name \"t", "2: the name has no closing quote"},
      {"name \"t\"", "name \"t\" u", "2: surplus word 'u'"},
      {"name \"t\"", "name \"a\tb\"", "2: the name holds a quote"},
      {"name \"t\"\n", "", "2: section 'materials', expected 'name'"},
      {"materials 1", "material 1", "3: 'material' is no section, expected 'space' or 'materials'"},
      {"materials 1", "materials -1", "3: '-1' is no count"},
      {"materials 1", "materials 0", "4: '0' is no section, expected 'nodes' after 0 materials"},
      {"0 \"liver\"", "1 \"liver\"", "4: material index 1, expected 0"},
      {"0 \"liver\"", "0 \"liver\"0", "4: no blank behind the material name"},
      {"1e-3 1000", "-1e-3 1000", "4: density is -0.001"},
      {"nodes 4", "nodes 4 4", "5: surplus word '4', expected 2 words"},
      {"nodes 4", "nodes 3", "6: central 3 does not exist"},
      {"nodes 4", "nodes 5", "10: section 'springs' after 4 of 5 nodes"},
      {"nodes 4", "nodes 0", "5: 0 nodes, expected at least one"},
      {"nodes 4", "nodes 4000000000", "5: 4000000000 nodes, but only"},
      {"nodes 4", "nodes 18446744073709551616", "5: '18446744073709551616' is no count"},
      {"0 0 0 1 0 - 3 0", "0 0 0 1 0 - 3", "6: the line ends before material"},
      {"0 0 0 1 0 - 3 0", "0 0 0 1 0 - 3 0 7", "6: surplus word '7', expected 8 words"},
      {"0 0 0 1 0 - 3 0", "nan 0 0 1 0 - 3 0",
       "6: 'nan' is no coordinate, expected a finite number"},
      {"0 0 0 1 0 - 3 0", "0 1e999 0 1 0 - 3 0", "6: '1e999' is no coordinate"},
      {"0 0 0 1 0 - 3 0", "0 0 0x1 1 0 - 3 0", "6: '0x1' is no coordinate"},
      {"0 0 0 1 0 - 3 0", "0 0 1,5 1 0 - 3 0", "6: '1,5' is no coordinate"},
      {"0 0 0 1 0 - 3 0", "0 0 0 inf 0 - 3 0", "6: 'inf' is no mass"},
      {"0 0 0 1 0 - 3 0", "0 0 0 -1 0 - 3 0", "6: mass is -1"},
      {"0 0 0 1 0 - 3 0", "0 0 0 1 -0.5 - 3 0", "6: drag is -0.5"},
      {"0 0 0 1 0 - 3 0", "0 0 0 1 0 zy 3 0", "6: 'zy' is no set of axes"},
      {"0 0 0 1 0 - 3 0", "0 0 0 1 0 - 4 0", "6: central 4 does not exist"},
      {"0 0 0 1 0 - 3 0", "0 0 0 1 0 - 0 0", "6: central 0 is no central node"},
      {"0 0 0 1 0 - 3 0", "0 0 0 1 0 - 1 0", "7: node 1 is central or behind"},
      {"0 0 0 1 0 - 3 0", "0 0 0 1 0 - 3 1", "6: material 1 does not exist"},
      {"0 0 0 1 0 - 3 0", "0 0 0 1 0 - 3.0 0", "6: '3.0' is no central"},
      {"springs 4", "normals 3\n0 0 1\n0 0 1\n0 0 1\nsprings 4",
       "10: 3 normals, expected as many as nodes, 4"},
      {"springs 4", "normals 0\nsprings 4", "10: 'normals' 0, expected the section to be absent"},
      {"springs 4", "texcoords 1\nsprings 4",
       "10: section 'texcoords', expected 'normals' or 'springs'"},
      {"springs 4", "springs 3", "14: '0' is no section, expected 'triangles' after 3 springs"},
      {"springs 4", "nodes 1\n0 0 0 1 0 - -1 0\nsprings 4",
       "10: section 'nodes', expected 'normals' or 'springs'"},
      {"nodes 4", "name \"u\"\nnodes 4", "5: section 'name', expected 'nodes'"},
      {"nodes 4", "materials 1\n0 \"m\" 1 1 1 1\nnodes 4",
       "5: section 'materials', expected 'nodes'"},
      {"triangles 1", "springs 1\n0 1 e 1 1 1\ntriangles 1",
       "15: section 'springs', expected 'triangles'"},
      {"end\n", "triangles 1\n0 1 2\nend\n",
       "17: section 'triangles', expected 'texcoords', 'tetrahedra' or 'end'"},
      {"end\n", "texcoords 1\n0 0 0 0 0 0\ntexcoords 1\n0 0 0 0 0 0\nend\n",
       "19: section 'texcoords', expected 'tetrahedra' or 'end'"},
      {"end\n", "tetrahedra 1\n0 1 2 0 0\nend\n", "18: corner 0 stands twice"},
      {"end\n", "tetrahedra 1\n0 1 2\nend\n", "18: "},
      {"1 0.2\n", "1 0.2 0.5\n", "4: Poisson's ratio is 0.5, expected 0 to below 0.5"},
      {"1 0.2\n", "1 0.2 0.4 1\n", "4: '1' is no law, expected neo-hookean"},
      {"1 0.2\n", "1 0.2 0.4 yeoh:c20=2e3\n", "4: c20 of 2000 is out of range, expected -1000"},
      {"1 0.2\n", "1 0.2 0.4 yeoh 1\n",
       "4: '1' is no Prony series, expected prony:G@TAU,G@TAU,..."},
      {"1 0.2\n", "1 0.2 0.4 yeoh prony:0.5@1 1\n", "4: surplus word '1', expected 9 words"},
      {"1 0.2\n", "1 0.2 0.4 prony:2@1\n", "4: shares of 2 together in a Prony series"},
      {"0 1 e 10", "0 4 e 10", "11: node 4 does not exist, expected 0 to 3"},
      {"0 1 e 10", "-1 1 e 10", "11: '-1' is no node"},
      {"0 1 e 10", "1 0 e 10", "11: spring 1 0, expected the smaller node first"},
      {"0 1 e 10", "1 1 e 10", "11: spring 1 1, expected the smaller node first"},
      {"0 1 e 10", "0 1 f 10", "11: 'f' is no kind of spring"},
      {"0 1 e 10", "0 1 eb 10", "11: 'eb' is no kind of spring"},
      {"0 1 e 10", "0 1 e -10", "11: stiffness is -10"},
      {"0 1 e 10", "0 2 e 10", "12: spring 0 2 stands twice"},
      {"0 1 e 10", "1 2 e 10", "12: spring 0 2 of kind e stands behind 1 2 of kind e"},
      {"1 2 b 10", "0 2 b 10", "13: spring 0 2 is of kind e and of kind b"},
      {"1 2 b 10", "1 3 b 10", "13: spring 1 3 of kind b ends at a central node"},
      {"0 3 c 10", "0 2 c 10", "14: spring 0 2 of kind c, expected node 0 and its central node 3"},
      {"0 1 2\nend", "0 1 3\nend", "16: corner 3 is a central node"},
      {"0 1 2\nend", "0 1 1\nend", "16: corner 1 stands twice"},
      {"0 1 2\nend", "0 1 7\nend", "16: node 7 does not exist"},
      {"0 1 2\nend", "0 1 2\n0 1 2\nend",
       "17: '0' is no section, expected 'texcoords', 'tetrahedra' or 'end'"},
      {"end\n", "texcoords 2\n0 0 0 0 0 0\n0 0 0 0 0 0\nend\n",
       "17: 2 texcoords, expected as many as triangles, 1"},
      {"end\n", "tetrahedra 1\n0 1 2 3 0\nend\n", "18: corner 3 is a central node"},
      {"end\n", "end 1\n", "17: surplus word '1'"},
      {"end\n", "end\nend\n", "18: 'end' behind 'end', expected nothing"},
      {"end\n", "end", "17: the last line has no end"},
  };
  for (const Case& c : cases) {
    const std::string text = complaint(replaced(small, c.from, c.to));
    EXPECT_EQ(text.substr(0, std::strlen(c.expected)), c.expected) << text;
    EXPECT_NE(text.find("expected"), std::string::npos) << text;
  }
  EXPECT_EQ(complaint(""), "1: no model, expected 'ela_expl 1'");
  EXPECT_NE(complaint(std::string("ela_expl 1\nname \"a\0b\"\n", 21)), "");
  EXPECT_NE(complaint("\xff\xfe e\n"), "");
}

const std::string element = "ela_expl 1\n"
                            "name \"t\"\n"
                            "materials 2\n"
                            "0 \"gel\" 0.001 1000 1 0.2 0.49\n"
                            "1 \"wire\" 0.001 1000 1 0.2\n"
                            "nodes 10\n"
                            "0 0 0 1 0 - -1 0\n"
                            "2 0 0 1 0 - -1 0\n"
                            "0 2 0 1 0 - -1 0\n"
                            "0 0 2 1 0 - -1 0\n"
                            "1 0 0 1 0 - -1 0\n"
                            "1 1 0 1 0 - -1 0\n"
                            "0 1 0 1 0 - -1 0\n"
                            "0 0 1 1 0 - -1 0\n"
                            "1 0 1 1 0 - -1 0\n"
                            "0 1 1 1 0 - -1 0\n"
                            "springs 0\n"
                            "triangles 0\n"
                            "tetrahedra 1\n"
                            "0 1 2 3 4 5 6 7 8 9 0\n"
                            "end\n";

TEST(Ela, ReadsElementsOfBothOrders) {
  const model::Model quadratic = formats::parse_ela(element, "M");
  EXPECT_EQ(quadratic.tetrahedra, (std::vector<Tetrahedron>{{0, 1, 2, 3}}));
  EXPECT_EQ(quadratic.middles, (std::vector<EdgeMiddles>{{4, 5, 6, 7, 8, 9}}));
  EXPECT_EQ(quadratic.tetrahedron_material, std::vector<std::int32_t>{0});
  EXPECT_EQ(quadratic.materials[0].poisson, 0.49);
  EXPECT_FALSE(quadratic.materials[1].poisson.has_value());
  EXPECT_EQ(formats::ela_text(quadratic), element);
  const std::string text = replaced(element, "3 4 5 6 7 8 9 0\n", "3 0\n");
  const model::Model linear = formats::parse_ela(text, "M");
  EXPECT_TRUE(linear.middles.empty());
  EXPECT_EQ(formats::ela_text(linear), text);
}

TEST(Ela, ErrorsOfElements) {
  struct Case {
    const char *from, *to, *expected;
  };
  const Case cases[] = {
      {"0 1 2 3 4", "0 2 1 3 4", "20: the tetrahedron has no positive volume"},
      {"8 9 0\n", "8 9 1\n", "20: material 1 has no Poisson's ratio"},
      {"8 9 0\n", "8 9 2\n", "20: material 2 does not exist"},
      {"8 9 0\n", "8 9 -1\n", "20: '-1' is no material"},
      {"8 9 0\n", "8 9 4294967295\n", "20: material 2147483647 does not exist"},
      {"8 9 0\n", "8 8 0\n", "20: corner 8 stands twice"},
      {"8 9 0\n", "8 10 0\n", "20: node 10 does not exist"},
      {"8 9 0\n", "8 9\n", "20: "},
      {"8 9 0\n", "8 9 0 0\n", "20: surplus word '0', expected 11 words"},
      {"tetrahedra 1", "tetrahedra 2", "21: "},
      {"0.001 1000 1 0.2 0.49", "0.001 0 1 0.2 0.49", "20: young of an element's material"},
      {"0.2 0.49", "0.2 -0.1", "4: Poisson's ratio is -0.1"},
      {"0.2 0.49", "0.2 nan", "4: 'nan' is no Poisson's ratio"},
  };
  for (const Case& c : cases) {
    const std::string text = complaint(replaced(element, c.from, c.to));
    EXPECT_EQ(text.substr(0, std::strlen(c.expected)), c.expected) << text;
    EXPECT_NE(text.find("expected"), std::string::npos) << text;
  }
}

TEST(Ela, TenThousandNodesTakeAHundredthOfASecond) {
  const model::Model model =
      model::build_model(test::ball(6, 50), {}, Context{}).model; // 16,386 nodes
  const std::string text = formats::ela_text(model);
  double best = 1e9;
  for (int round = 0; round < 3; ++round) {
    const auto start = std::chrono::steady_clock::now();
    const model::Model back = formats::parse_ela(text, "M");
    best = test::smaller(
        best, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    EXPECT_EQ(back.nodes.size(), model.nodes.size());
  }
  RecordProperty("milliseconds", std::to_string(best * 1e3));
  std::cout << "read " << model.nodes.size() << " nodes in " << best * 1e3 << " ms\n";
  EXPECT_LT(best, 2.0); // a bound against quadratic work only: machines and sanitizers differ
}

} // namespace
} // namespace gewebe::test
