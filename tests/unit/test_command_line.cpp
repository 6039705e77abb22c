// How a command line is taken apart, and how what it says is told.

#include "base/error.h"
#include "tools/cli/messages.h"
#include "tools/cli/options_internal.h"

#include <gtest/gtest.h>

using namespace gewebe;
using namespace gewebe::cli;

namespace {

/// -q, -j N, --voxel S, --stats[=FILE], --color [N=]R,G,B; operands FIRST [REST...].
struct Line {
  bool quiet = false, stats = false;
  std::int64_t threads = 0;
  std::optional<double> voxel;
  std::string file, first;
  std::vector<std::string> rest, colors;
  CommandLine line;

  Spec& add(const std::string& names, const std::string& metavar) {
    Spec& spec = *line.specs.emplace_back(std::make_unique<Spec>());
    spec.names = names;
    spec.metavar = metavar;
    return spec;
  }
  Line() {
    line.tool = "tool";
    add("-q,--quiet", "").flag = &quiet;
    Spec& j = add("-j,--threads", "N");
    j.set = [&](std::string_view word) { j.read(word, threads); };
    j.min = 0;
    j.max = 99;
    Spec& s = add("--voxel", "S");
    s.set = [&](std::string_view word) { s.read(word, voxel); };
    Spec& f = add("--stats", "[=FILE]");
    f.flag = &stats;
    f.set = [&](std::string_view word) { f.read(word, file); };
    Spec& c = add("--color", "[N=]C");
    c.set = [&](std::string_view word) { colors.emplace_back(word); };
    c.set_numbered = [&](std::int32_t n, std::string_view word) {
      colors.push_back(std::to_string(n) + ":" + std::string(word));
    };
    line.operands.push_back({"FIRST", "", {}, &first, nullptr, 1, 0});
    line.operands.push_back({"REST", "", {}, nullptr, &rest, 0, 0});
  }
  Line(const Line&) = delete;
  Line& operator=(const Line&) = delete;

  /// The complaint, or "".
  std::string take(const std::vector<std::string>& words) {
    try {
      line.take(words);
      line.check_complete();
      for (const auto& spec : line.specs)
        spec->set_all();
    } catch (const UsageError& error) {
      return error.what();
    }
    return "";
  }
};

std::string complaint(const std::vector<std::string>& words) {
  return Line().take(words);
}

} // namespace

TEST(CommandLine, ValuesStandBesideNamesOrBehindThem) {
  using Words = std::vector<std::string>;
  for (const Words& words :
       {Words{"-j", "4", "a"}, Words{"-j4", "a"}, Words{"-j=4", "a"}, Words{"a", "--threads", "4"},
        Words{"--threads=4", "a"}, Words{"--threads", "+4", "a"}, Words{"-qj4", "a"},
        Words{"-qj", "4", "a"}, Words{"-j4", "--", "a"}}) {
    Line line;
    EXPECT_EQ(line.take(words), "") << words[0];
    EXPECT_EQ(line.threads, 4) << words[0];
    EXPECT_EQ(line.first, "a") << words[0];
    EXPECT_EQ(line.quiet, words[0].starts_with("-q")) << words[0];
  }
  Line line;
  EXPECT_EQ(
      line.take({"-q", "-qq", "--stats", "a", "--voxel", "-2.5", "-", "-1", "--", "--voxel", "--"}),
      "");
  EXPECT_TRUE(line.quiet && line.stats);
  EXPECT_EQ(line.voxel, -2.5);
  EXPECT_EQ(line.file, ""); // the next word is never taken for it
  EXPECT_EQ(line.rest, (Words{"-", "-1", "--voxel", "--"}));
  Line named;
  EXPECT_EQ(named.take({"--stats=b=c", "--color", "red", "--color=2=blue", "a"}), "");
  EXPECT_EQ(named.file, "b=c");
  EXPECT_FALSE(named.stats);
  EXPECT_EQ(named.colors, (Words{"red", "2:blue"}));
}

TEST(CommandLine, MistakesAreNamed) {
  const std::string see = ", see tool --help";
  EXPECT_EQ(complaint({}), "FIRST is required" + see);
  EXPECT_EQ(complaint({"a", "--voxl", "1"}),
            "unexpected argument '--voxl' (did you mean --voxel?)" + see);
  EXPECT_EQ(complaint({"a", "--voxl=1"}),
            "unexpected argument '--voxl=1' (did you mean --voxel?)" + see);
  EXPECT_EQ(complaint({"a", "-voxel"}),
            "unexpected argument '-voxel' (did you mean --voxel?)" + see);
  EXPECT_EQ(complaint({"a", "-qx"}), "unexpected argument '-x'" + see);
  EXPECT_EQ(complaint({"a", "--voxel"}), "--voxel: expected S" + see);
  EXPECT_EQ(complaint({"a", "--voxel=", "3"}), "--voxel: expected S" + see);
  EXPECT_EQ(complaint({"a", "-qj"}), "--threads: expected N" + see);
  EXPECT_EQ(complaint({"a", "--quiet=no"}), "--quiet: takes no value" + see);
  EXPECT_EQ(complaint({"a", "--voxel", "1", "--voxel", "1"}), "--voxel: given more than once");
  EXPECT_EQ(complaint({"a", "--color", "1=x", "--color", "1=y"}),
            "--color 1=: given more than once");
  EXPECT_EQ(complaint({"a", "--voxel", "--color", "x"}), "--voxel: '--color' is no number");
  EXPECT_EQ(complaint({"a", "-j100"}), "--threads: expected 0 to 99, not 100");
  EXPECT_EQ(complaint({"a", "-j", "1.5"}), "--threads: '1.5' is no whole number");
  EXPECT_EQ(complaint({"a", "-j", "+-1"}), "--threads: '+-1' is no whole number");
  EXPECT_EQ(complaint({"a", "--voxel", "+-1"}), "--voxel: '+-1' is no number");
  EXPECT_EQ(complaint({"a", "--voxel", "++1"}), "--voxel: '++1' is no number");
  EXPECT_EQ(complaint({"a", "--voxel", "inf"}), "--voxel: 'inf' is not finite");
}

TEST(Messages, AreOneLineOfUtf8) {
  EXPECT_EQ(one_line("a\tb\nc\x7f \r\n"), "a b c");
  EXPECT_EQ(one_line("Gr\xc3\xb6\xc3\x9f"
                     "e \xe2\x89\xa4 \xf0\x9f\x98\x80"),
            "Gr\xc3\xb6\xc3\x9f"
            "e \xe2\x89\xa4 \xf0\x9f\x98\x80");
  EXPECT_EQ(one_line("a\xff"
                     "b\x80"),
            "a\\xffb\\x80");
  EXPECT_EQ(one_line("\xc2\x9b"
                     "31m"),
            " 31m");                                               // a control of Latin 1
  EXPECT_EQ(one_line("\xc0\xaf"), "\\xc0\\xaf");                   // a longer form of '/'
  EXPECT_EQ(one_line("\xe0\x80\xaf"), "\\xe0\\x80\\xaf");          // so too
  EXPECT_EQ(one_line("\xed\xa0\x80"), "\\xed\\xa0\\x80");          // half a pair of UTF-16
  EXPECT_EQ(one_line("\xf4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80"); // past the last
  EXPECT_EQ(one_line("\xf5\x80"), "\\xf5\\x80");
  EXPECT_EQ(one_line("\xe2\x89"), "\\xe2\\x89"); // cut short
  EXPECT_EQ(one_line("\xe2\x89z"), "\\xe2\\x89z");
  EXPECT_EQ(one_line(""), "");
}
