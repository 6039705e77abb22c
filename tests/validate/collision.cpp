// Contact potentials of lib/contact beside ipc-toolkit, where $PYTHON (else python3) has ipctk.

#include "collision/candidates.h"
#include "contact/barrier.h"
#include "contact/contact_pairs.h"
#include "contact/friction.h"
#include "tests/bench/peer.h"
#include "tests/unit/collision_pairs.h"
#include "tests/unit/collision_scene.h"
#include "tests/unit/larger.h"
#include "tests/validate/checks.h"
#include "tests/validate/peer_folder.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <span>
#include <string>
#include <vector>

namespace gewebe::validate {

namespace {

const char* const script = "tests/validate/peer_ipctk.py";
constexpr double d_hat = 0.2, kappa = 3, mu = 0.4, friction_e = 0.05;

struct Case {
  collision::CollisionSurface surface;
  std::vector<Vec3> x, start, target;
  bool own = false; ///< owners meet themselves
};

std::span<const double> numbers(const std::vector<Vec3>& x) {
  static_assert(sizeof(Vec3) == 3 * sizeof(double));
  return {&x[0].x, 3 * x.size()};
}

/// Two sheets, a sphere and a capsule, all with the same radius.
Case make_case(unsigned seed) {
  Case c;
  const double d_min = seed % 2 == 0 ? 0 : 0.1;
  c.surface = test::two_sheets(6, d_min + 0.1, seed % 3 == 0 ? 0.001 : 0.03, 0.5 * d_min, seed);
  c.surface.radius.assign(c.surface.size(), 0.5 * d_min);
  c.own = seed % 4 >= 2;
  std::mt19937 random(seed);
  const auto moved = [&](double by) {
    std::vector<Vec3> x = c.surface.rest;
    for (Vec3& p : x)
      p += test::random_point(random, by);
    return x;
  };
  c.x = moved(0.002);
  c.start = moved(0.01);
  c.target = moved(0.2);
  return c;
}

struct Differences {
  double pairs = 0, energy = 0, gradient = 0, hessian = 0, projected = 0;
  double friction = 0, friction_gradient = 0, friction_hessian = 0;
  double step = 0; ///< of ipc-toolkit over ours
};

/// Largest difference over the largest entry.
double difference(const std::vector<double>& ours, const std::vector<double>& theirs) {
  if (ours.size() != theirs.size())
    return HUGE_VAL;
  double most = 0, size = 0;
  for (std::size_t k = 0; k < ours.size(); ++k) {
    most = test::larger(most, std::abs(ours[k] - theirs[k]));
    size = test::larger(size, std::abs(theirs[k]));
  }
  return size > 0 ? most / size : most;
}

std::vector<double> dense(const std::vector<contact::HessianBlock>& blocks, std::size_t vertices) {
  const std::size_t order = 3 * vertices;
  std::vector<double> all(order * order);
  for (const contact::HessianBlock& block : blocks) {
    const std::size_t n = 3 * std::size_t{block.count};
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = 0; j < n; ++j)
        all[(3 * std::size_t{block.vertex[i / 3]} + i % 3) * order +
            3 * std::size_t{block.vertex[j / 3]} + j % 3] += block.entry[i * n + j];
  }
  return all;
}

Differences compare(const Case& c) {
  collision::CollisionSurface s = c.surface;
  s.overlap.clear(); // the peer counts each triangle
  const double d_min = 2 * s.radius[0];
  const Folder folder;
  write<double>(folder, "rest.f64", numbers(s.rest));
  write<double>(folder, "x.f64", numbers(c.x));
  write<double>(folder, "start.f64", numbers(c.start));
  write<double>(folder, "target.f64", numbers(c.target));
  write<std::uint32_t>(folder, "edges.u32", {s.edges[0].data(), 2 * s.edges.size()});
  write<std::uint32_t>(folder, "triangles.u32", {s.triangles[0].data(), 3 * s.triangles.size()});
  write<std::uint32_t>(folder, "owner.u32", s.owner);
  const std::array<double, 6> parameters{d_hat, d_min, kappa, mu, friction_e, c.own ? 1.0 : 0.0};
  write<double>(folder, "parameters.f64", parameters);
  const std::vector<double> theirs =
      timing::numbers_of_script(std::string(script) + " " + folder.path.string());
  if (theirs.size() != 6)
    throw Error("the peer gave no answer: run " + std::string(script) + " by hand");

  collision::AllowedPairs allowed(4, 1);
  for (std::size_t k = 0; k < 4; ++k)
    allowed.set(k, k, c.own ? 1 : 0);
  collision::Candidates candidates;
  collision::BroadPhase phase(s);
  phase.find(s, c.x, c.x, d_hat, allowed, candidates);
  contact::ContactPairs pairs;
  contact::find_active_pairs(s, candidates, c.x, d_hat, pairs);
  std::vector<Vec3> gradient(s.size()), slip(s.size());
  const double energy = contact::add_barrier_gradient(pairs, c.x, kappa, gradient);
  std::vector<contact::HessianBlock> exact, projected, friction_blocks;
  contact::barrier_hessian(pairs, c.x, kappa, contact::HessianMode::exact, exact);
  contact::barrier_hessian(pairs, c.x, kappa, contact::HessianMode::projected, projected);
  std::vector<contact::FrictionPair> lagged;
  contact::lag_friction(s, pairs, c.x, kappa, contact::FrictionTable(4, mu), lagged);
  const double friction =
      contact::add_friction_gradient(lagged, c.target, c.start, friction_e, slip);
  contact::friction_hessian(lagged, c.target, c.start, friction_e, contact::HessianMode::exact,
                            friction_blocks);
  phase.find(s, c.x, c.target, d_hat, allowed, candidates);
  const double gap = contact::smallest_gap(pairs, c.x);
  const double kept = 0.5 * (gap < d_hat ? gap : d_hat);
  const double step =
      collision::collision_free_step(s, candidates, c.x, c.target, {.d_min = kept, .share = 0});
  const auto flat = [](const std::vector<Vec3>& x) {
    const std::span<const double> n = numbers(x);
    return std::vector<double>(n.begin(), n.end());
  };
  Differences d;
  d.pairs = std::abs(static_cast<double>(pairs.pairs.size()) - theirs[0]) +
            std::abs(gap + d_min - theirs[2]) / theirs[2];
  d.energy = std::abs(energy - theirs[1]) / theirs[1];
  d.gradient = difference(flat(gradient), read<double>(folder, "gradient.f64"));
  d.hessian = difference(dense(exact, s.size()), read<double>(folder, "hessian.f64"));
  d.projected = difference(dense(projected, s.size()), read<double>(folder, "projected.f64"));
  d.friction = std::abs(friction - theirs[3]) / theirs[3];
  d.friction_gradient = difference(flat(slip), read<double>(folder, "friction_gradient.f64"));
  d.friction_hessian =
      difference(dense(friction_blocks, s.size()), read<double>(folder, "friction_hessian.f64"));
  d.step = theirs[4] / step;
  return d;
}

} // namespace

Section contact_potentials() {
  Section section{
      "Contact potentials beside ipc-toolkit",
      "Two sheets of 6 x 6 nodes, a sphere and a capsule 0.1 mm apart, 16 random cases: "
      "with and without radius, contact with themselves and nearly parallel edges. "
      "Pairs, energies, gradients and Hessians relative to the largest entry.",
      {},
      {}};
  const std::string source = "ipctk";
  if (timing::numbers_of_script("-c 'import ipctk; print(1)'").empty()) {
    section.checks.push_back(skipped("contact potentials", source, "no ipctk"));
    return section;
  }
  Differences worst;
  for (unsigned seed = 1; seed <= 16; ++seed) {
    const Differences d = compare(make_case(seed));
    const auto keep = [&](double Differences::*member) {
      worst.*member = test::larger(worst.*member, d.*member);
    };
    for (const auto member :
         {&Differences::pairs, &Differences::energy, &Differences::gradient, &Differences::hessian,
          &Differences::projected, &Differences::friction, &Differences::friction_gradient,
          &Differences::friction_hessian, &Differences::step})
      keep(member);
  }
  const auto add = [&](const char* what, double error, double bound) {
    Check check;
    check.what = what;
    check.source = source;
    check.reference = "0";
    check.figure = check.error_text = text_of(error);
    check.error = error;
    check.bound = bound;
    section.checks.push_back(check);
  };
  add("active pairs and smallest gap", worst.pairs, 1e-10);
  add("energy of the barrier", worst.energy, 1e-10);
  add("its gradient", worst.gradient, 1e-10);
  add("its Hessian", worst.hessian, 1e-9);
  add("its projected Hessian", worst.projected, 1e-9);
  add("energy of friction", worst.friction, 1e-10);
  add("its gradient, friction", worst.friction_gradient, 1e-10);
  add("its Hessian, friction", worst.friction_hessian, 1e-9);
  add("collision-free step of ipc-toolkit over ours", worst.step, 1.01);
  return section;
}

} // namespace gewebe::validate
