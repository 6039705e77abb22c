#include "model/law_stability.h"

#include "numeric/power.h"
#include "text/number_text.h"

#include <array>
#include <cmath>
#include <cstddef>

namespace gewebe::model {

namespace {

using Stretches = std::array<double, 3>;

/// Second derivative of W / mu by logarithmic principal strains, which are independent here:
/// diag(d) + k v vᵀ.
struct LogSecondDerivative {
  Stretches d{}, v{};
  double k = 0;
};

LogSecondDerivative second_derivative(const HyperelasticLaw& law, const Stretches& s) {
  LogSecondDerivative h;
  const auto& p = law.parameter;
  // Sums of powers: c (s_1^a + s_2^a + s_3^a) has c a² s_i^a.
  const auto add = [&](double factor, double alpha) {
    for (std::size_t i = 0; i < 3; ++i)
      h.d[i] += factor * numeric::power(s[i], alpha);
  };
  if (law.kind == HyperelasticLaw::yeoh) {
    const double x = s[0] * s[0] + s[1] * s[1] + s[2] * s[2] - 3;
    add(4 * (0.5 + 2 * p[0] * x + 3 * p[1] * x * x), 2);
    h.k = 4 * (2 * p[0] + 6 * p[1] * x);
    for (std::size_t i = 0; i < 3; ++i)
      h.v[i] = s[i] * s[i];
  } else if (law.kind == HyperelasticLaw::mooney_rivlin) {
    add(4 * (0.5 - p[0]), 2);
    add(4 * p[0], -2);
  } else {
    add(2 * (1 - p[2]), p[0]);
    if (p[2] != 0)
      add(2 * p[2], p[1]);
  }
  return h;
}

/// By trace and determinant of the second derivative by the first two strains; the third is less
/// their sum. \pre s_1 s_2 s_3 = 1
bool is_stable(const HyperelasticLaw& law, const Stretches& s) {
  const auto [d, v, k] = second_derivative(law, s);
  const double x = v[0] - v[2], y = v[1] - v[2];
  return d[0] + d[1] + 2 * d[2] + k * (x * x + y * y) > 0 &&
         d[0] * d[1] + d[0] * d[2] + d[1] * d[2] +
                 k * (x * x * d[1] + y * y * d[0] + (x - y) * (x - y) * d[2]) >
             0;
}

struct Path {
  std::string_view tension, compression;
  Stretches powers; ///< of the stretch along the pull
};

constexpr std::array<Path, 3> paths{{{"uniaxial tension", "uniaxial compression", {1, -0.5, -0.5}},
                                     {"equibiaxial tension", "equibiaxial compression", {1, 1, -2}},
                                     {"planar tension", "planar compression", {1, 0, -1}}}};

bool is_stable(const HyperelasticLaw& law, const Path& path, double stretch) {
  Stretches s{};
  for (std::size_t i = 0; i < 3; ++i)
    s[i] = numeric::power(stretch, path.powers[i]);
  return is_stable(law, s);
}

/// From where on the way from 1 to `end` the law isn't stable; `end` if it is all the way.
double stable_until(const HyperelasticLaw& law, const Path& path, double end) {
  constexpr int steps = 400;
  double stable = 1;
  for (int k = 1; k <= steps; ++k) {
    double next = 1 + (end - 1) * k / steps;
    if (is_stable(law, path, next)) {
      stable = next;
      continue;
    }
    for (int round = 0; round < 40; ++round)
      (is_stable(law, path, (stable + next) / 2) ? stable : next) = (stable + next) / 2;
    return next;
  }
  return end;
}

std::string percent(double value) {
  return text::number_text(std::round(value * 1000) / 10) + " %";
}

} // namespace

std::vector<LawInstability> law_instabilities(const HyperelasticLaw& law) {
  std::vector<LawInstability> found;
  if (law.kind == HyperelasticLaw::stable_neo_hookean || law.kind == HyperelasticLaw::neo_hookean)
    return found;
  constexpr double least = 0.3, most = 3;
  for (const Path& path : paths) {
    if (const double stretch = stable_until(law, path, most); stretch < most)
      found.push_back({path.tension, stretch});
    if (const double stretch = stable_until(law, path, least); stretch > least)
      found.push_back({path.compression, stretch});
  }
  return found;
}

std::string instability_text(const HyperelasticLaw& law) {
  std::string text;
  for (const auto& [path, stretch] : law_instabilities(law))
    text += (text.empty() ? "" : ", ") + std::string(path) + " beyond a strain of " +
            percent(std::abs(stretch - 1));
  return text;
}

} // namespace gewebe::model
