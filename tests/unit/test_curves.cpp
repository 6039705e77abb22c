#include "formats/curves/curve_sheet.h"

#include "base/error.h"
#include "tests/unit/complaint.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace gewebe::test {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

formats::NumberTable table_of(const std::string& text) {
  return formats::read_number_table(text, "t.csv");
}

formats::CurveSheet sheet_of(const formats::NumberTable& table, const std::string& x,
                             const std::vector<std::string>& names) {
  std::vector<const formats::NumberColumn*> ys;
  for (const std::string& name : names)
    ys.push_back(&formats::find_column(table, name));
  return formats::curve_sheet(formats::find_column(table, x), ys, "");
}

TEST(Curves, ATableHasNamesUnitsAndGaps) {
  const formats::NumberTable table = table_of(
      "time [s],\"a,b\" ,o.1.force [uN],what\r\n# a remark\n0,1,+2e3,x\n1,,nan,\"\"\"\"\n");
  ASSERT_EQ(table.columns.size(), 4U);
  EXPECT_EQ(table.columns[0].name, "time");
  EXPECT_EQ(table.columns[0].unit, "s");
  EXPECT_EQ(table.columns[1].name, "a,b ");
  EXPECT_EQ(table.columns[2].name, "o.1.force");
  EXPECT_EQ(table.columns[2].values[0], 2000);
  EXPECT_TRUE(std::isnan(table.columns[2].values[1]));
  EXPECT_TRUE(std::isnan(table.columns[1].values[1]));
  EXPECT_EQ(table.columns[3].words, "'x' in line 3");
  EXPECT_EQ(&formats::find_column(table, "force"), &table.columns[2]);
  EXPECT_EQ(&formats::find_column(table, "o.1.force [uN]"), &table.columns[2]);
}

TEST(Curves, WrongTablesAndNamesAreNamed) {
  EXPECT_EQ(test::complaint([] { table_of(""); }),
            "t.csv: no columns, expected their names in the first line");
  EXPECT_EQ(test::complaint([] { table_of("a,b\n1\n"); }),
            "t.csv:2: 1 cells, expected 2 as in the first line");
  EXPECT_EQ(test::complaint([] { table_of("a,\n"); }),
            "t.csv:1: a column without a name, expected one in the first line");
  EXPECT_EQ(test::complaint([] { table_of("a,\xff\n"); }),
            "t.csv:1: a name that is no UTF-8 text, expected names in the first line");
  EXPECT_EQ(test::complaint([] { table_of("a\n\"1\n"); }),
            "t.csv:2: a quote without end, expected '\"' behind it in the same line");
  const formats::NumberTable table =
      table_of("t [s],p.force [uN],q.force [uN],w,d [mm]\n0,1,2,x,1e301\n");
  EXPECT_EQ(test::complaint([&] { formats::find_column(table, "force"); }),
            "several columns 'force', expected one of p.force, q.force");
  EXPECT_EQ(test::complaint([&] { formats::find_column(table, "forc"); }),
            "no column 'forc' (did you mean force?), expected one of t [s], p.force [uN], q.force "
            "[uN], w, d [mm]");
  EXPECT_EQ(test::complaint([&] { sheet_of(table, "t", {"w"}); }),
            "column 'w' has words: 'x' in line 2, expected a column of numbers");
  EXPECT_EQ(test::complaint([&] {
              sheet_of(table, "t", {"p.force", "d"});
            }),
            "'p.force [uN]' and 'd [mm]' have different units, expected columns of one unit");
  EXPECT_EQ(test::complaint([&] { sheet_of(table, "t", {"d"}); }),
            "a number beyond 1e300, expected smaller ones");
  const formats::NumberTable apart = table_of("a,b\n1,\n,2\n");
  EXPECT_EQ(test::complaint([&] { sheet_of(apart, "a", {"b"}); }),
            "no row has numbers of 'a' and 'b', expected some with both");
}

TEST(Curves, AxesEndAtRoundNumbersThatEncloseAll) {
  const text::RoundAxis a = text::round_axis(0, 6.48, 6);
  EXPECT_EQ(a.texts, (std::vector<std::string>{"0", "2", "4", "6", "8"}));
  EXPECT_EQ(text::round_axis(-0.13, 0.1, 5).texts,
            (std::vector<std::string>{"-0.15", "-0.10", "-0.05", "0.00", "0.05", "0.10"}));
  EXPECT_EQ(text::round_axis(0, 1, 5).texts.back(), "1.0");
  for (double size = 1e-290; size < 1e290; size *= 37)
    for (const auto& [min, max] :
         {std::pair{-size, 2 * size}, {0.0, size}, {size, size}, {0.997 * size, size}}) {
      const text::RoundAxis axis = text::round_axis(min, max, 5);
      EXPECT_LE(axis.min, min + 1e-8 * size) << size;
      EXPECT_GE(axis.max, max - 1e-8 * size) << size;
      EXPECT_GE(axis.marks.size(), 2U) << size;
      EXPECT_LE(axis.marks.size(), 12U) << size;
      for (const std::string& text : axis.texts)
        EXPECT_LE(text.size(), 13U) << text;
    }
}

TEST(Curves, LargeNumbersGetALargerUnit) {
  const formats::NumberTable table =
      table_of("t [s],f [uN],p [Pa],m [nN m]\n0,23000,999,2e9\n1,-500,0,0\n");
  const formats::CurveSheet forces = sheet_of(table, "t", {"f"});
  EXPECT_EQ(forces.y.title, "f [mN]");
  EXPECT_EQ(forces.curves[0].y[0], 23);
  EXPECT_EQ(forces.curves[0].y[1], -0.5);
  EXPECT_EQ(sheet_of(table, "t", {"p"}).y.title, "p [Pa]");
  EXPECT_EQ(sheet_of(table, "f", {"m"}).y.title, "m [N m]");
  EXPECT_EQ(sheet_of(table, "f", {"m"}).x.title, "f [mN]");
}

TEST(Curves, SvgBreaksLinesAtGapsAndEscapesNames) {
  const formats::NumberTable table =
      table_of("t,a<&> [uN],b [uN]\n0,1,2\n1,2,2\n2,,2\n3,3,2\n4,4,2\n");
  const std::string one = formats::curves_svg(sheet_of(table, "t", {"a<&>"}), 400, 300);
  EXPECT_NE(one.find("a&lt;&amp;&gt; [\u00b5N]"), std::string::npos);
  const std::size_t path = one.find("stroke-linejoin");
  const std::string curve = one.substr(one.rfind("<path", path), path - one.rfind("<path", path));
  EXPECT_EQ(std::count(curve.begin(), curve.end(), 'M'), 2);
  const std::string two = formats::curves_svg(sheet_of(table, "t", {"a<&>", "b"}), 400, 300);
  EXPECT_NE(two.find(">b</text>"), std::string::npos);
  EXPECT_EQ(one.find("nan"), std::string::npos);
}

TEST(Curves, LettersStandWhereThePointsAre) {
  formats::CurveSheet sheet;
  sheet.x = {0, 10, {0, 10}, {"0", "10"}, "x [mm]"};
  sheet.y = {0, 1, {0, 1}, {"0", "1"}, "y"};
  sheet.curves = {{"c", {0, 5, nan, 10}, {0, 0.5, 1, 1}}};
  EXPECT_EQ(formats::curves_ascii(sheet, 40, 10), "y\n"
                                                  "1 +                                *\n"
                                                  "  |\n"
                                                  "  |                *\n"
                                                  "  |\n"
                                                  "  |\n"
                                                  "0 +*\n"
                                                  "  ++-------------------------------+\n"
                                                  "   0                              10\n"
                                                  "                              x [mm]\n");
}

} // namespace
} // namespace gewebe::test
