#include "model/hyperelastic_law.h"

#include "base/error.h"
#include "complaint.h"
#include "model/law_stability.h"
#include "model/material_table.h"

#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <string>
#include <utility>
#include <vector>

namespace gewebe::test {
namespace {

TEST(HyperelasticLaw, WordsReadBack) {
  for (const char* word : {"neo-hookean", "classical-neo-hookean", "mooney-rivlin",
                           "mooney-rivlin:c01=0.1", "yeoh:c20=-0.2,c30=0.05", "yeoh:c30=1e-05",
                           "ogden:alpha1=-8.2", "ogden:alpha1=4,alpha2=-3,mu2=0.3"})
    EXPECT_EQ(model::law_text(model::parse_law(word)), word);
  EXPECT_EQ(model::law_text(model::parse_law("yeoh:c30=0.5,c20=1.0")), "yeoh:c20=1,c30=0.5");
  EXPECT_EQ(model::parse_law("ogden:alpha1=4,alpha2=-3,mu2=0.3"),
            (model::HyperelasticLaw{model::HyperelasticLaw::ogden, {4, -3, 0.3}}));
  EXPECT_EQ(model::parse_law("neo-hookean"), model::HyperelasticLaw{});
}

TEST(HyperelasticLaw, WhatIsWrongIsNamed) {
  for (const auto& [word, message] : std::vector<std::pair<std::string, std::string>>{
           {"", "'' is no law, expected neo-hookean, classical-neo-hookean, mooney-rivlin, yeoh or "
                "ogden"},
           {"gent", "'gent' is no law"},
           {"neo-hookean:c01=1", "'c01=1': neo-hookean has no parameters, expected none"},
           {"yeoh:", "'' is no parameter of yeoh, expected c20 or c30, '=' and a number"},
           {"yeoh:c40=1", "'c40=1' is no parameter of yeoh"},
           {"yeoh:c20", "'c20' is no parameter of yeoh"},
           {"yeoh:c20=", "'' is no c20, expected a finite number"},
           {"yeoh:c20=inf", "'inf' is no c20"},
           {"yeoh:c20=1x", "'1x' is no c20"},
           {"yeoh:c20=1,c20=2", "a second c20, expected one"},
           {"yeoh:c20=1,", "'' is no parameter of yeoh"},
           {"yeoh:c30=2000", "c30 of 2000 is out of range, expected -1000 to 1000"},
           {"mooney-rivlin:c01=11", "c01 of 11 is out of range, expected -10 to 10"},
           {"ogden", "ogden without alpha1, expected ogden:alpha1=NUMBER"},
           {"ogden:alpha1=0.01",
            "alpha1 of 0.01 is out of range, expected 0.1 to 50 or -50 to -0.1"},
           {"ogden:alpha1=2,alpha2=3",
            "ogden with only one of alpha2 and mu2, expected both or none"},
           {"ogden:alpha1=2,mu2=3", "ogden with only one of alpha2 and mu2"},
       })
    EXPECT_EQ(test::complaint([&] { (void)model::parse_law(word); }).substr(0, message.size()),
              message);
}

TEST(HyperelasticLaw, TablesHaveLaws) {
  const auto table = model::parse_material_table("soft 1e-3 5000 5 0.2 0.49 yeoh:c20=0.1\n"
                                                 "other 1e-3 5000 5 0.2 0.49\n",
                                                 "t");
  EXPECT_EQ(table[0].law, (model::HyperelasticLaw{model::HyperelasticLaw::yeoh, {0.1}}));
  EXPECT_FALSE(table[1].law);
  EXPECT_EQ(test::complaint([] {
              (void)model::parse_material_table("soft 1e-3 5000 5 0.2 0.49 ogden\n", "t");
            }).substr(0, 25),
            "t:1: ogden without alpha1");
}

double until(const model::HyperelasticLaw& law, const std::string& path) {
  for (const auto& [name, stretch] : model::law_instabilities(law))
    if (name == path)
      return stretch;
  return 0;
}

TEST(HyperelasticLaw, StableLawsAreFoundStable) {
  for (const char* word : {"neo-hookean", "classical-neo-hookean", "mooney-rivlin",
                           "mooney-rivlin:c01=0.5", "yeoh", "yeoh:c20=0.1,c30=2", "ogden:alpha1=9",
                           "ogden:alpha1=-20", "ogden:alpha1=4,alpha2=-3,mu2=0.3"})
    EXPECT_EQ(model::instability_text(model::parse_law(word)), "") << word;
}

TEST(HyperelasticLaw, InstabilitiesBeginWhereTheyAreByHand) {
  // Mooney-Rivlin, C01 = -0.1 mu, planar path s, 1, 1/s: D_22 = 4 (C10 (1 + s^-2) + C01 (1 + s²)),
  // D_11 = 4 (C10 + C01) (s² + s^-2), D_12 = 4 (C10 s^-2 + C01 s²).
  const model::HyperelasticLaw rivlin = model::parse_law("mooney-rivlin:c01=-0.1");
  const auto determinant = [](double s) {
    const double c10 = 0.6, c01 = -0.1, q = s * s;
    const double a = (c10 + c01) * (q + 1 / q), b = c10 * (1 + 1 / q) + c01 * (1 + q),
                 c = c10 / q + c01 * q;
    return a * b - c * c;
  };
  const double s = until(rivlin, "planar tension");
  ASSERT_GT(s, 1.1);
  EXPECT_GT(determinant(s - 1e-6), 0);
  EXPECT_LT(determinant(s + 1e-6), 0);
  // Yeoh with C20 < 0, uniaxial: nominal stress times s is 2 (s² - 1/s) W'; its slope by log s,
  // 2 (2 s² + 1/s) W' + 4 (s² - 1/s)² W'', is one direction of D, so the law is unstable from
  // where it is 0 at the latest.
  const model::HyperelasticLaw yeoh = model::parse_law("yeoh:c20=-0.2,c30=0.02");
  const auto slope = [](double t) {
    const double x = t * t + 2 / t - 3, w = 0.5 - 0.4 * x + 0.06 * x * x, v = -0.4 + 0.12 * x,
                 d = t * t - 1 / t;
    return 2 * (2 * t * t + 1 / t) * w + 4 * d * d * v;
  };
  const double t = until(yeoh, "uniaxial tension");
  ASSERT_GT(t, 1.1);
  EXPECT_GT(slope(t - 1e-3), -0.05);
  double zero = 1;
  while (slope(zero) > 0 && zero < 3)
    zero += 1e-4;
  EXPECT_LE(t, zero + 1e-3);
  EXPECT_GT(t, 0.9 * zero);
  // A negative Ogden term outweighs where its power grows faster.
  EXPECT_NE(model::instability_text(model::parse_law("ogden:alpha1=2,alpha2=8,mu2=-0.2"))
                .find("uniaxial tension beyond a strain of "),
            std::string::npos);
}

} // namespace
} // namespace gewebe::test
