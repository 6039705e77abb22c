#include "contact/contact_solver.h"

#include "larger.h"
#include "sim_models.h"
#include "solid/model_stiffness.h"
#include "solve/factor.h"
#include "solve/stiffness.h"
#include "statics/elastostatic.h"

#include <cmath>
#include <gtest/gtest.h>
#include <random>

namespace gewebe {
namespace {

/// Of nodes each on three springs of its own.
std::vector<double> loose(std::size_t m, double compliance) {
  std::vector<double> w(9 * m * m);
  for (std::size_t a = 0; a < 3 * m; ++a)
    w[a * 3 * m + a] = compliance;
  return w;
}

/// Of nodes of an organ, column by column with its factor.
std::vector<double> compliance_of(const Model& model, const std::vector<std::uint32_t>& nodes) {
  const StiffnessMatrix k = stiffness_matrix(model);
  const Factor factor(k, Context{});
  const std::size_t size = 3 * nodes.size();
  std::vector<double> w(size * size), f(3 * model.nodes.size()), u(f.size());
  for (std::size_t c = 0; c < size; ++c) {
    f.assign(f.size(), 0);
    f[3 * std::size_t{nodes[c / 3]} + c % 3] = 1;
    solve_axes(k, factor, f, u);
    for (std::size_t r = 0; r < size; ++r)
      w[c * size + r] = u[3 * std::size_t{nodes[r / 3]} + r % 3];
  }
  return w;
}

Vec3 moved(const std::vector<double>& w, std::size_t m, const std::vector<Contact>& contacts,
           const std::vector<Vec3>& force, std::size_t node) {
  Vec3 u;
  for (std::size_t j = 0; j < contacts.size(); ++j)
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b)
        u[a] += w[(3 * std::size_t{contacts[j].node} + static_cast<std::size_t>(b)) * 3 * m +
                  3 * node + static_cast<std::size_t>(a)] *
                force[j][b];
  return u;
}

struct Random {
  std::mt19937 engine{7};
  double operator()(double low, double high) {
    return low + (high - low) * (static_cast<double>(engine()) / 4294967296.0);
  }
  Vec3 direction() {
    for (;;) {
      const Vec3 v{(*this)(-1, 1), (*this)(-1, 1), (*this)(-1, 1)};
      if (norm(v) > 0.1 && norm(v) < 1)
        return v / norm(v);
    }
  }
};

struct Case {
  std::size_t m = 0;
  std::vector<double> w;
  std::vector<Contact> contacts;
};

/// Contacts all over an organ, some inside, some not.
Case organ_case(double friction, unsigned seed) {
  const Model model = test::organ();
  Case c;
  const std::vector<std::uint32_t> nodes = test::free_nodes(model);
  c.m = nodes.size();
  c.w = compliance_of(model, nodes);
  Random random;
  random.engine.seed(seed);
  for (std::uint32_t i = 0; i < nodes.size(); ++i)
    if (random(0, 1) < 0.7)
      c.contacts.push_back(
          {i, random.direction(), random(-1, 0.3), 0.5 * random.direction(), friction});
  return c;
}

TEST(ContactSolver, OneNodeOnASpringIsPushedOut) {
  const std::vector<double> w = loose(1, 0.25);
  for (const double gap : {-2.0, 0.0, 3.0}) {
    const std::vector<Contact> c{{0, {0.6, 0, 0.8}, gap, {}, 0}};
    const ContactForces f = solve_contacts(w, 1, c);
    EXPECT_TRUE(f.solved);
    EXPECT_LT(norm(f.force[0] - std::max(0.0, -gap) / 0.25 * c[0].normal), 1e-11);
  }
}

TEST(ContactSolver, OneNodeSticksOrSlips) {
  // Pressed by 8 = 2/0.25, dragged by 0.5/0.25 = 2 along x: sticks for mu >= 1/4.
  const std::vector<double> w = loose(1, 0.25);
  for (const double friction : {0.0, 0.1, 0.2499, 0.2501, 1.0}) {
    const std::vector<Contact> c{{0, {0, 0, 1}, -2, {0.5, 0, 7}, friction}};
    const ContactForces f = solve_contacts(w, 1, c);
    EXPECT_TRUE(f.solved) << friction;
    EXPECT_NEAR(f.force[0].z, 8, 1e-9);
    EXPECT_NEAR(f.force[0].x, -std::min(2.0, friction * 8), 1e-9); // against the slip
    EXPECT_NEAR(f.force[0].y, 0, 1e-9);
  }
}

/// Several contacts at each node of a small organ, as where an instrument lies on all triangles
/// around: their forces are not determined.
Case crowded_case(double friction, unsigned seed, std::size_t at_each) {
  const Model model = test::organ();
  Case c;
  const std::vector<std::uint32_t> nodes = test::free_nodes(model);
  c.m = nodes.size();
  c.w = compliance_of(model, nodes);
  Random random;
  random.engine.seed(seed);
  for (std::uint32_t i = 0; i < nodes.size(); ++i) {
    const Vec3 out = random.direction(), slip = 0.5 * random.direction();
    const double gap = random(-1, 0.3);
    for (std::size_t k = 0; k < at_each; ++k) {
      Vec3 n = out + 0.3 * random.direction();
      n = n / norm(n);
      c.contacts.push_back({i, n, gap, slip, friction});
    }
  }
  return c;
}

TEST(ContactSolver, ContactsShareWhatTheirNodesCanDo) {
  for (const double friction : {0.0, 0.2, 0.4})
    for (unsigned seed = 1; seed <= 4; ++seed) {
      const Case c = crowded_case(friction, seed, 4);
      const ContactForces f = solve_contacts(c.w, c.m, c.contacts);
      EXPECT_TRUE(f.solved) << friction << " " << seed << " " << f.residual;
      EXPECT_LT(contact_residual(c.w, c.m, c.contacts, f.force), 1e-9);
    }
}

TEST(ContactSolver, PushesAreThoseOfTheWholeProblem) {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    const Case c = crowded_case(0, seed, 4);
    const std::size_t count = c.contacts.size();
    std::vector<double> a(count * count), gap;
    for (std::size_t i = 0; i < count; ++i)
      gap.push_back(c.contacts[i].gap);
    std::vector<Vec3> unit(count);
    for (std::size_t j = 0; j < count; ++j) {
      unit.assign(count, {});
      unit[j] = c.contacts[j].normal;
      for (std::size_t i = 0; i < count; ++i)
        a[j * count + i] =
            dot(c.contacts[i].normal, moved(c.w, c.m, c.contacts, unit, c.contacts[i].node));
    }
    const PushForces pushes = solve_pushes(a, gap);
    EXPECT_TRUE(pushes.solved) << seed << " " << pushes.residual;
    const ContactForces whole = solve_contacts(c.w, c.m, c.contacts);
    // Pushes are not determined where contacts share them; what they do is.
    std::vector<Vec3> force;
    for (std::size_t i = 0; i < count; ++i)
      force.push_back(pushes.push[i] * c.contacts[i].normal);
    double largest = 0;
    for (std::size_t node = 0; node < c.m; ++node)
      largest = test::larger(largest, norm(moved(c.w, c.m, c.contacts, force, node)));
    for (std::size_t node = 0; node < c.m; ++node)
      EXPECT_LT(norm(moved(c.w, c.m, c.contacts, force, node) -
                     moved(c.w, c.m, c.contacts, whole.force, node)),
                1e-8 * largest);
  }
}

TEST(ContactSolver, AllConditionsHoldOnAnOrgan) {
  for (const double friction : {0.0, 0.05, 0.3, 1.0}) {
    std::size_t pressed = 0, open = 0, slipping = 0, sticking = 0;
    for (unsigned seed = 1; seed <= 5; ++seed) {
      const Case c = organ_case(friction, seed);
      const ContactForces f = solve_contacts(c.w, c.m, c.contacts);
      EXPECT_TRUE(f.solved) << friction << " " << seed << " " << f.residual;
      EXPECT_LT(contact_residual(c.w, c.m, c.contacts, f.force), 1e-9);
      double largest = 0;
      for (const Vec3& v : f.force)
        largest = test::larger(largest, norm(v));
      ASSERT_GT(largest, 0);
      for (std::size_t i = 0; i < c.contacts.size(); ++i) {
        const Contact& k = c.contacts[i];
        const Vec3 u = moved(c.w, c.m, c.contacts, f.force, k.node);
        const double fn = dot(f.force[i], k.normal), gap = k.gap + dot(k.normal, u);
        const Vec3 ft = f.force[i] - fn * k.normal;
        Vec3 slip = k.slip + u;
        slip -= dot(slip, k.normal) * k.normal;
        EXPECT_GE(fn, -1e-10 * largest);
        EXPECT_GT(gap, -1e-9);
        EXPECT_LT(std::abs(fn * gap), 1e-8 * largest);
        EXPECT_LE(norm(ft), friction * fn + 1e-8 * largest);
        if (fn > 1e-6 * largest)
          ++pressed;
        else
          ++open;
        if (fn < 1e-6 * largest || friction == 0)
          continue;
        if (norm(ft) > (1 - 1e-6) * friction * fn) {
          ++slipping;
          EXPECT_LT(norm(slip / norm(slip) + ft / norm(ft)), 1e-4); // opposite
        } else {
          ++sticking;
          EXPECT_LT(norm(slip), 1e-7);
        }
      }
    }
    EXPECT_GT(pressed, 20U); // each of the cases is among them
    EXPECT_GT(open, 10U);
    EXPECT_EQ(slipping > 0, friction > 0);
    if (friction >= 0.3) {
      EXPECT_GT(sticking, 0U);
    }
  }
}

TEST(ContactSolver, TheResidualSeesEachBrokenCondition) {
  const Case c = organ_case(0.3, 3);
  ContactForces f = solve_contacts(c.w, c.m, c.contacts);
  std::size_t max = 0;
  for (std::size_t i = 0; i < f.force.size(); ++i)
    if (norm(f.force[i]) > norm(f.force[max]))
      max = i;
  const std::vector<Vec3> right = f.force;
  const auto residual = [&] { return contact_residual(c.w, c.m, c.contacts, f.force); };
  EXPECT_LT(residual(), 1e-9);
  f.force[max] *= 0.9; // too weak: inside
  EXPECT_GT(residual(), 1e-2);
  f.force = right;
  f.force[max] = -f.force[max]; // pulls
  EXPECT_GT(residual(), 1e-2);
  f.force = right;
  f.force[max] += 0.5 * cross(c.contacts[max].normal, f.force[max] + Vec3{1, 2, 3}); // sideways
  EXPECT_GT(residual(), 1e-2);
  f.force[max].x = NAN;
  EXPECT_FALSE(residual() < 1e9);
}

TEST(ContactSolver, TwoPlanesAtOneNode) {
  const std::vector<double> w = loose(1, 1);
  const double s = std::sqrt(0.5);
  const std::vector<Contact> groove{{0, {s, 0, s}, -1, {}, 0}, {0, {-s, 0, s}, -1, {}, 0}};
  const ContactForces f = solve_contacts(w, 1, groove);
  EXPECT_TRUE(f.solved);
  EXPECT_LT(norm(f.force[0] + f.force[1] - Vec3{0, 0, std::sqrt(2.0)}), 1e-9);
  // The same plane twice: redundant, not singular.
  const std::vector<Contact> twice{{0, {0, 0, 1}, -1, {}, 0.2}, {0, {0, 0, 1}, -1, {}, 0.2}};
  const ContactForces g = solve_contacts(w, 1, twice);
  EXPECT_LT(norm(g.force[0] + g.force[1] - Vec3{0, 0, 1}), 1e-9);
}

TEST(ContactSolver, AGuessChangesNothing) {
  for (const double friction : {0.0, 0.3}) {
    const Case c = organ_case(friction, 4);
    const ContactForces cold = solve_contacts(c.w, c.m, c.contacts);
    std::vector<Vec3> guess = cold.force;
    for (std::size_t i = 0; i < guess.size(); i += 3)
      guess[i] = {};
    const ContactForces warm = solve_contacts(c.w, c.m, c.contacts, guess);
    for (std::size_t i = 0; i < guess.size(); ++i)
      EXPECT_LT(norm(cold.force[i] - warm.force[i]), 1e-6 * (1 + norm(cold.force[i])));
  }
}

} // namespace
} // namespace gewebe
