// Young's moduli from measured displacements, damping from a measured swing.

#include "embedding/solid_place.h"
#include "fit/swing_fit.h"
#include "fit/young_fit.h"
#include "tests/unit/solid_bodies.h"

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <string>

using namespace gewebe;

namespace {

/// A bar of 80 x 20 x 20 along x, held at x = 0; its second half is of another material.
test::Solid bar(double first, double second, std::uint32_t across = 2,
                const model::HyperelasticLaw& law = {}) {
  tetrahedra::TetMesh mesh = test::box_tetrahedra(4 * across, across, across, 20.0 / across);
  mesh.material.clear();
  for (const Tetrahedron& t : mesh.tetrahedra) {
    double x = 0;
    for (const auto c : t)
      x += mesh.points[c].x / 4;
    mesh.material.push_back(x > 40 ? 1 : 0);
  }
  test::Solid solid(mesh, true, {{first, 0.45, 1e-3, law}, {second, 0.45, 1e-3, law}});
  for (std::size_t axis = 0; axis < 3; ++axis)
    solid.hold(axis, [](const Vec3& p) { return p.x == 0; });
  return solid;
}

const std::vector<std::string> names{"soft", "stiff"};
const std::vector<std::size_t> both{0, 1};

fit::SolidVector weight(const test::Solid& s, double acceleration) {
  return fit::hyperelastic_weight(s.mesh, s.materials, s.elements, {0, 0, -acceleration});
}

/// What is measured on the body under its weight, at its upper edge and 4 mm off its end.
fit::MeasuredCase measured(const test::Solid& s, double acceleration, double noise) {
  fit::MeasuredCase c{weight(s, acceleration), {}};
  const auto u =
      fit::hyperelastic_statics(s.mesh, s.elements, s.fixed, {}, c.load).displacement.axes;
  std::mt19937 random(7);
  std::normal_distribution<double> normal(0, noise);
  for (const Vec3 place : {Vec3{20, 10, 20},
                           {30, 0, 20},
                           {40, 10, 20},
                           {60, 20, 20},
                           {80, 10, 20},
                           {84, 10, 10},
                           {51, 7, 3}}) {
    const Vec3 d = embedding::displacement_at(embedding::find_place(s.mesh, place), u);
    fit::Measurement m{place, {}, "point " + std::to_string(c.measurements.size())};
    for (int i = 0; i < 3; ++i)
      m.displacement[static_cast<std::size_t>(i)] = d[i] + normal(random);
    c.measurements.push_back(m);
  }
  return c;
}

/// The message of what fit_young throws.
std::string refusal(const test::Solid& s, const fit::MeasuredCase& c,
                    std::span<const std::size_t> wanted = both) {
  try {
    fit::fit_young(s.mesh, s.materials, names, wanted, s.fixed, std::span(&c, 1));
  } catch (const Error& error) {
    return error.place() + (error.place().empty() ? "" : ": ") + error.what();
  }
  return "";
}

} // namespace

TEST(SolidPlace, FollowsLinearFieldsInsideAndOff) {
  const test::Solid s = bar(1e4, 1e4);
  std::vector<double> u;
  for (const Vec3& p : s.mesh.points)
    for (const double v : {1 + 0.1 * p.x, 0.2 * p.y - 0.3 * p.z, 0.5 * p.x})
      u.push_back(v);
  for (const Vec3& p : {Vec3{33, 7, 11}, {86, 10, 4}, {-3, -2, 22}, {0, 0, 0}}) {
    const Vec3 d = embedding::displacement_at(embedding::find_place(s.mesh, p), u);
    EXPECT_NEAR(d.x, 1 + 0.1 * p.x, 1e-12);
    EXPECT_NEAR(d.y, 0.2 * p.y - 0.3 * p.z, 1e-12);
    EXPECT_NEAR(d.z, 0.5 * p.x, 1e-12);
  }
  EXPECT_NEAR(embedding::find_place(s.mesh, {86, 10, 4}).outside, 6, 1e-12);
  EXPECT_NEAR(embedding::find_place(s.mesh, {-3, -4, 10}).outside, 5, 1e-12);
  EXPECT_EQ(embedding::find_place(s.mesh, {33, 7, 11}).outside, 0);
}

TEST(SolidPlace, FollowsQuadraticFieldsInside) {
  const test::Solid s = bar(1e4, 1e4);
  std::vector<double> u;
  for (const Vec3& p : s.mesh.points)
    for (const double v : {p.x * p.y, p.z * p.z, p.x * p.x - p.y * p.z})
      u.push_back(v);
  const Vec3 p{33, 7, 11}, d = embedding::displacement_at(embedding::find_place(s.mesh, p), u);
  EXPECT_NEAR(d.x, p.x * p.y, 1e-9);
  EXPECT_NEAR(d.y, p.z * p.z, 1e-9);
  EXPECT_NEAR(d.z, p.x * p.x - p.y * p.z, 1e-9);
}

TEST(YoungFit, FindsWhatMadeTheDisplacements) {
  test::Solid truth = bar(8000, 20000);
  // 27 mm of 80: far beyond small strains.
  const fit::MeasuredCase c = measured(truth, 9810, 0);
  const test::Solid start = bar(50000, 10000);
  const fit::YoungFit fit = fit::fit_young(start.mesh, start.materials, names, both, start.fixed,
                                           std::span(&c, 1), {.tolerance = 1e-6});
  EXPECT_NEAR(fit.materials[0].young, 8000, 8e-4 * 8000);
  EXPECT_NEAR(fit.materials[1].young, 20000, 8e-4 * 20000);
  EXPECT_LE(fit.solves, 10);
  EXPECT_LT(fit.residual, 1e-4 * fit.measured);
  EXPECT_TRUE(fit.outliers.empty());
}

TEST(YoungFit, FindsModuliUnderTheLawsOfMaterials) {
  for (const model::HyperelasticLaw& law :
       {model::HyperelasticLaw{model::HyperelasticLaw::yeoh, {0.5, 0.1}},
        model::HyperelasticLaw{model::HyperelasticLaw::ogden, {6}}}) {
    const fit::MeasuredCase c = measured(bar(8000, 20000, 1, law), 9810, 0);
    const test::Solid start = bar(50000, 10000, 1, law);
    const fit::YoungFit fit = fit::fit_young(start.mesh, start.materials, names, both, start.fixed,
                                             std::span(&c, 1), {.tolerance = 1e-6});
    EXPECT_NEAR(fit.materials[0].young, 8000, 8e-4 * 8000);
    EXPECT_NEAR(fit.materials[1].young, 20000, 8e-4 * 20000);
    EXPECT_LT(fit.residual, 1e-4 * fit.measured);
  }
}

TEST(YoungFit, OfOneMaterialTakesTheOtherAsKnown) {
  const fit::MeasuredCase c = measured(bar(8000, 20000), 9810, 0);
  const test::Solid start = bar(8000, 900);
  const std::array<std::size_t, 1> second{1};
  const fit::YoungFit fit =
      fit::fit_young(start.mesh, start.materials, names, second, start.fixed, std::span(&c, 1));
  ASSERT_EQ(fit.materials.size(), 1u);
  EXPECT_EQ(fit.materials[0].material, 1u);
  EXPECT_NEAR(fit.materials[0].young, 20000, 200);
}

// Intervals of repeated noise hold the truth about as often as they say.
TEST(YoungFit, IsAsSureAsItSays) {
  const test::Solid truth = bar(30000, 30000, 1);
  const fit::MeasuredCase exact = measured(truth, 2000, 0);
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0, 0.05);
  const std::array<std::size_t, 1> first{0};
  int held = 0;
  constexpr int runs = 60;
  double widest = 0;
  for (int run = 0; run < runs; ++run) {
    fit::MeasuredCase c = exact;
    for (fit::Measurement& m : c.measurements)
      for (auto& d : m.displacement)
        *d += normal(random);
    const fit::YoungFit fit =
        fit::fit_young(truth.mesh, truth.materials, names, first, truth.fixed, std::span(&c, 1));
    const auto [low, high] = fit.materials[0].interval.value();
    held += low <= 30000 && 30000 <= high ? 1 : 0;
    widest = test::larger(widest, high / low);
  }
  EXPECT_GE(held, 52); // 57 expected; fewer than 52 by chance once in 100
  EXPECT_LT(held, 60);
  EXPECT_LT(widest, 1.5);
}

TEST(YoungFit, NamesAnOutlier) {
  const test::Solid truth = bar(30000, 30000);
  fit::MeasuredCase c = measured(truth, 2000, 0.01);
  *c.measurements[4].displacement[2] += 0.5;
  const std::array<std::size_t, 1> first{0};
  const fit::YoungFit fit =
      fit::fit_young(truth.mesh, truth.materials, names, first, truth.fixed, std::span(&c, 1));
  ASSERT_EQ(fit.outliers.size(), 1u);
  EXPECT_EQ(fit.outliers[0], "point 4");
}

/// With few measurements an outlier dominates the variance of all residuals. It is found only
/// if its own residual is excluded (externally studentised).
TEST(YoungFit, NamesAnOutlierAmongFew) {
  const test::Solid truth = bar(30000, 30000);
  fit::MeasuredCase c = measured(truth, 2000, 0.01);
  for (fit::Measurement& m : c.measurements) // 7 axes of 7 places
    m.displacement[0] = m.displacement[1] = std::nullopt;
  *c.measurements[2].displacement[2] += 0.3;
  const std::array<std::size_t, 1> first{0};
  const fit::YoungFit fit =
      fit::fit_young(truth.mesh, truth.materials, names, first, truth.fixed, std::span(&c, 1));
  EXPECT_EQ(fit.axes, 7u);
  EXPECT_EQ(fit.outliers, std::vector<std::string>{"point 2"});
}

/// The fit follows a far point, since it moves most: so its residual is small, and is compared with
/// what the fit leaves of it (the leverage).
TEST(YoungFit, NamesAnOutlierThatTheFitFollows) {
  const test::Solid truth = bar(30000, 30000);
  const std::array<std::size_t, 1> first{0};
  for (const double error : {0.0, 0.028}) {
    fit::MeasuredCase c = measured(truth, 2000, 0.01);
    for (fit::Measurement& m : c.measurements)
      m.displacement[0] = m.displacement[1] = std::nullopt;
    *c.measurements[4].displacement[2] += error;
    const fit::YoungFit fit =
        fit::fit_young(truth.mesh, truth.materials, names, first, truth.fixed, std::span(&c, 1));
    EXPECT_EQ(fit.outliers,
              error > 0 ? std::vector<std::string>{"point 4"} : std::vector<std::string>{});
  }
}

TEST(YoungFit, NamesBadData) {
  const test::Solid s = bar(30000, 30000);
  const fit::MeasuredCase good = measured(s, 2000, 0);
  EXPECT_EQ(refusal(s, good), "");

  fit::MeasuredCase c = good;
  for (fit::Measurement& m : c.measurements)
    for (auto& d : m.displacement)
      *d = -*d;
  EXPECT_NE(refusal(s, c).find("against the loads"), std::string::npos) << refusal(s, c);

  c = good;
  c.measurements.push_back({{300, 0, 0}, {1, 1, 1}, "line 9"});
  EXPECT_NE(refusal(s, c).find("line 9: the place is 220 mm off"), std::string::npos)
      << refusal(s, c);

  c = good;
  c.measurements.push_back({{0, 10, 10}, {1, 1, 1}, "line 8"});
  EXPECT_NE(refusal(s, c).find("line 8: what is measured there is held"), std::string::npos)
      << refusal(s, c);

  c = good;
  c.measurements.resize(1);
  c.measurements[0].displacement = {std::nullopt, std::nullopt, -1.0};
  EXPECT_NE(refusal(s, c).find("1 measured axes for 2 materials"), std::string::npos)
      << refusal(s, c);

  // Two copies of one number say one thing.
  c.measurements.push_back(c.measurements[0]);
  EXPECT_NE(refusal(s, c).find("soft and stiff apart"), std::string::npos) << refusal(s, c);

  c = good;
  c.load = weight(s, 0);
  EXPECT_NE(refusal(s, c).find("the loads move nothing"), std::string::npos) << refusal(s, c);

  // What a load near the support bends says nothing of the end.
  c.load = {std::vector<double>(s.fixed.size()), {}};
  c.load.axes[3 * s.node_at({20, 10, 20}) + 2] = -1e5;
  c.measurements = {{{20, 10, 20}, {std::nullopt, std::nullopt, -1}, "a"},
                    {{10, 10, 20}, {std::nullopt, std::nullopt, -0.4}, "b"}};
  EXPECT_EQ(refusal(s, c).find("no measurement depends on"), 0u) << refusal(s, c);

  const std::array<std::size_t, 0> none{};
  EXPECT_NE(refusal(s, good, none).find("all materials are known"), std::string::npos);
}

TEST(SwingFit, FindsFrequencyAndDamping) {
  for (const double ratio : {0.005, 0.05, 0.3}) {
    std::vector<double> t, y;
    const double w = 2 * std::numbers::pi * 7;
    std::mt19937 random(5);
    std::normal_distribution<double> normal(0, 0.02);
    for (int k = 0; k < 200; ++k) {
      t.push_back(3 + 0.005 * k);
      const double s = t.back() - 3;
      y.push_back(
          -4 + 2 * std::exp(-ratio * w * s) * std::cos(w * std::sqrt(1 - ratio * ratio) * s + 0.4) +
          normal(random));
    }
    const fit::SwingFit fit = fit::fit_swing(t, y);
    EXPECT_NEAR(fit.frequency, 7 * std::sqrt(1 - ratio * ratio), 0.01 * 7) << ratio;
    EXPECT_NEAR(fit.ratio, ratio, 0.02 * ratio + 0.0005) << ratio;
    EXPECT_LT(fit.ratio_interval[0], ratio + 0.001);
    EXPECT_GT(fit.ratio_interval[1], ratio - 0.001);
    EXPECT_NEAR(fit.rest, -4, 0.02);
    EXPECT_NEAR(fit.amplitude, 2, 0.05);
    EXPECT_GT(fit.explained, 0.9);
  }
}

TEST(SwingFit, IntervalsHoldTheTruthAsOftenAsTheySay) {
  constexpr int trials = 400;
  const double frequency = 7.76;
  for (const double ratio : {0.01, 0.05, 0.2}) {
    const double w = 2 * std::numbers::pi * frequency,
                 decay = ratio / std::sqrt(1 - ratio * ratio) * w;
    std::mt19937 random(11);
    std::normal_distribution<double> normal(0, 0.1);
    int frequencies = 0, ratios = 0;
    for (int trial = 0; trial < trials; ++trial) {
      std::vector<double> t, y;
      for (int k = 0; k < 100; ++k) {
        t.push_back(0.01 * k);
        y.push_back(-6.6 + 6.6 * std::exp(-decay * t.back()) * std::cos(w * t.back() + 0.2) +
                    normal(random));
      }
      const fit::SwingFit fit = fit::fit_swing(t, y);
      const auto holds = [](const std::array<double, 2>& interval, double truth) {
        return interval[0] <= truth && truth <= interval[1] ? 1 : 0;
      };
      frequencies += holds(fit.frequency_interval, frequency);
      ratios += holds(fit.ratio_interval, ratio);
    }
    // 95 % of 400 are 380; the number's own spread is 4.4.
    for (const int held : {frequencies, ratios}) {
      EXPECT_GE(held, 365) << ratio;
      EXPECT_LE(held, 394) << ratio;
    }
  }
}

/// The interval equals that of a fit with the damping ratio as a parameter. Decay rate and
/// frequency are correlated if the swing is short and strongly damped.
TEST(SwingFit, RatioIntervalIncludesTheCovariance) {
  const double ratio = 0.3, omega = 2 * std::numbers::pi * 2; // undamped, 1/s
  std::vector<double> t, y;
  std::mt19937 random(2);
  std::normal_distribution<double> normal(0, 0.02);
  const auto swing = [](const Eigen::Matrix<double, 5, 1>& p, double time) {
    const double damped = p[4] * time;
    return p[0] + std::exp(-p[3] * p[4] / std::sqrt(1 - p[3] * p[3]) * time) *
                      (p[1] * std::cos(damped) + p[2] * std::sin(damped));
  };
  Eigen::Matrix<double, 5, 1> p;
  p << 1, 0.4, 2, ratio, omega * std::sqrt(1 - ratio * ratio);
  for (int k = 0; k < 40; ++k) {
    t.push_back(0.024 * k);
    y.push_back(swing(p, t.back()) + normal(random));
  }
  const fit::SwingFit fit = fit::fit_swing(t, y);
  // Gauss and Newton from the truth, by differences: rest, cosine, sine, ratio, frequency.
  Eigen::Matrix<double, 40, 5> jacobian;
  Eigen::Matrix<double, 40, 1> left;
  for (int round = 0; round < 20; ++round) {
    for (int k = 0; k < 40; ++k) {
      const double time = t[static_cast<std::size_t>(k)];
      left[k] = y[static_cast<std::size_t>(k)] - swing(p, time);
      for (int axis = 0; axis < 5; ++axis) {
        Eigen::Matrix<double, 5, 1> more = p, less = p;
        more[axis] += 1e-5;
        less[axis] -= 1e-5;
        jacobian(k, axis) = (swing(more, time) - swing(less, time)) / 2e-5;
      }
    }
    p += (jacobian.transpose() * jacobian).ldlt().solve(jacobian.transpose() * left);
  }
  EXPECT_NEAR(fit.ratio, p[3], 1e-6);
  const double variance =
                   left.squaredNorm() / 35 * (jacobian.transpose() * jacobian).inverse()(3, 3),
               quantile = 2.0301; // of Student's t with 35 degrees of freedom
  EXPECT_NEAR((fit.ratio_interval[1] - fit.ratio_interval[0]) / 2, quantile * std::sqrt(variance),
              1e-3 * quantile * std::sqrt(variance));
}

TEST(SwingFit, RefusesWhatIsNoSwing) {
  const auto refused = [](const std::function<double(double)>& y, int count, double step) {
    std::vector<double> t, v;
    for (int k = 0; k < count; ++k) {
      t.push_back(step * k);
      v.push_back(y(t.back()));
    }
    try {
      fit::fit_swing(t, v);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const auto swing = [](double t) { return std::exp(-t) * std::cos(20 * t); };
  EXPECT_EQ(refused(swing, 100, 0.02), "");
  EXPECT_NE(refused(swing, 9, 0.02).find("9 samples"), std::string::npos);
  EXPECT_NE(refused(swing, 100, 0.0).find("ascending"), std::string::npos);
  EXPECT_NE(refused([](double) { return 3; }, 100, 0.02).find("all alike"), std::string::npos);
  EXPECT_NE(refused([](double t) { return std::exp(t) * std::cos(20 * t); }, 100, 0.02)
                .find("does not die away"),
            std::string::npos);
  std::mt19937 random(1);
  std::normal_distribution<double> normal(0, 1);
  EXPECT_NE(refused([&](double) { return normal(random); }, 100, 0.02).find("explains"),
            std::string::npos);
  EXPECT_NE(refused([](double t) { return std::exp(-t) * std::cos(3 * t); }, 100, 0.02)
                .find("swings, expected"),
            std::string::npos);
}
