#include "base/cpu.h"
#include "fem/hyperelastic.h"
#include "fem/hyperelastic_kernel_internal.h"
#include "fem/hyperelastic_points_internal.h"
#include "numeric/logarithm.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace gewebe::fem {

namespace {

/// What is left of a bubble's energy, over mu, from where on it counts as settled.
constexpr double settled = 1e-16;

const HyperelasticPoints& group_points() {
  static const HyperelasticPoints points = [] {
    HyperelasticPoints all{};
    const std::vector<IntegrationPoint>& from = quadratic_points();
    for (std::size_t n = 0; n < HyperelasticPoints::count; ++n) {
      all.weight[n] = from[n].weight;
      for (std::size_t k = 0; k < 4; ++k) {
        all.at[n][k] = from[n].at[k];
        all.bubble[n][k] = 256;
        for (std::size_t m = 0; m < 4; ++m)
          all.bubble[n][k] *= m == k ? 1 : from[n].at[m];
      }
    }
    return all;
  }();
  return points;
}

void respond_alone(const SolidElement& element, std::span<const Vec3> u, Vec3& bubble,
                   const std::array<double, 4>* own, HyperelasticForces& forces) {
  HyperelasticResponse response;
  if (u.size() == 10 && own == nullptr)
    bubble = settled_bubble(element, u, bubble);
  hyperelastic_response(element, u, bubble, HyperelasticPart::force, response, own);
  forces = {response.energy, response.force, response.pressure};
}

/// Lanes behind the last element repeat the first one.
void fill(std::span<const SolidElement> elements, std::span<const std::array<Vec3, 10>> u,
          std::span<const Vec3> bubbles, std::span<const std::array<double, 4>> own,
          HyperelasticGroup& group) {
  for (std::size_t lane = 0; lane < 4; ++lane) {
    const std::size_t t = lane < elements.size() ? lane : 0;
    const SolidElement& e = elements[t];
    group.volume[lane] = e.volume;
    group.mu[lane] = e.material.mu;
    group.lambda[lane] = e.material.lambda;
    for (std::size_t i = 0; i < 3; ++i) {
      const int axis = static_cast<int>(i);
      for (std::size_t k = 0; k < 4; ++k)
        group.gradient[k][i][lane] = e.gradient[k][axis];
      for (std::size_t a = 0; a < 10; ++a)
        group.u[a][i][lane] = u[t][a][axis];
      group.bubble[i][lane] = bubbles[t][axis];
    }
    for (std::size_t p = 0; p < 4; ++p)
      group.own[p][lane] = own.empty() ? 0 : own[t][p];
  }
}

/// \return whether its numbers are those of the element
bool read(const HyperelasticGroup& group, const HyperelasticGroupResult& result, std::size_t lane,
          Vec3& bubble, HyperelasticForces& forces) {
  if (!(result.left[lane] <= settled))
    return false;
  double logarithms = 0;
  for (std::size_t k = 0; k < HyperelasticPoints::classes; ++k) {
    const double product = result.product[k][lane];
    if (!(product > 0 && std::isfinite(product)))
      return false;
    logarithms +=
        group_points().weight[HyperelasticPoints::first[k]] * numeric::natural_logarithm(product);
  }
  forces.energy =
      group.volume[lane] * (result.energy[lane] - 2.0 / 3 * group.mu[lane] * logarithms);
  for (std::size_t a = 0; a < HyperelasticResponse::nodes; ++a)
    forces.force[a] = {result.force[a][0][lane], result.force[a][1][lane],
                       result.force[a][2][lane]};
  for (std::size_t p = 0; p < 4; ++p)
    forces.pressure[p] = result.pressure[p][lane];
  bubble = {group.bubble[0][lane], group.bubble[1][lane], group.bubble[2][lane]};
  return std::isfinite(forces.energy);
}

} // namespace

void hyperelastic_forces(std::span<const SolidElement> elements, std::size_t nodes,
                         std::span<const std::array<Vec3, 10>> u, std::span<Vec3> bubbles,
                         std::span<const std::array<double, 4>> own,
                         std::span<HyperelasticForces> forces) {
  const auto alone = [&](std::size_t t) {
    respond_alone(elements[t], std::span(u[t]).first(nodes), bubbles[t],
                  own.empty() ? nullptr : &own[t], forces[t]);
  };
  const bool side_by_side =
      nodes == 10 && std::ranges::all_of(elements, [](const SolidElement& e) {
        return e.law.kind == model::HyperelasticLaw::stable_neo_hookean && !e.memory.acts();
      });
  if (!side_by_side) {
    for (std::size_t t = 0; t < elements.size(); ++t)
      alone(t);
    return;
  }
  static const EvaluateGroup evaluate =
      best_cpu_level() == CpuLevel::baseline ? &evaluate_group_baseline : &evaluate_group_avx2;
  HyperelasticGroup group;
  HyperelasticGroupResult result;
  fill(elements, u, bubbles, own, group);
  evaluate(group_points(), !own.empty(), group, result);
  for (std::size_t t = 0; t < elements.size(); ++t)
    if (Vec3 bubble = bubbles[t]; read(group, result, t, bubble, forces[t]))
      bubbles[t] = bubble;
    else
      alone(t);
}

} // namespace gewebe::fem
