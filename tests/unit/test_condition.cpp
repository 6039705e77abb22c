// Condition estimates against known spectra; what moves freely is named rightly.

#include "fem/model_stiffness.h"
#include "linalg/condition.h"

#include "stiffness_models.h"

#include <Eigen/Dense>
#include <cmath>
#include <gtest/gtest.h>

using namespace gewebe;
using namespace gewebe::test;

namespace {

Eigen::MatrixXd dense(const linalg::StiffnessMatrix& k) {
  const auto n = static_cast<Eigen::Index>(k.order());
  Eigen::MatrixXd full = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index c = 0; c < n; ++c)
    for (auto at = k.column_start[static_cast<std::size_t>(c)];
         at < k.column_start[static_cast<std::size_t>(c) + 1]; ++at) {
      const auto r = k.row[static_cast<std::size_t>(at)];
      full(r, c) = full(c, r) = k.value[static_cast<std::size_t>(at)];
    }
  return full;
}

linalg::FreeMotion weakest(const model::Model& model) {
  const auto motion = linalg::weakest_motion(model, fem::stiffness_matrix(model), {});
  EXPECT_TRUE(motion.has_value());
  return motion.value_or(linalg::FreeMotion{});
}

std::string refusal(const model::Model& model) {
  linalg::StiffnessCheck check;
  try {
    (void)linalg::checked_factor(model, fem::stiffness_matrix(model), {}, check);
  } catch (const Error& error) {
    return error.what();
  }
  return "accepted";
}

using Motion = linalg::FreeMotion::Kind;

} // namespace

TEST(Condition, EstimateIsWithinAFactorOfThree) {
  for (const double stretch : {1.0, 1.3}) {
    const model::Model model = stretched(model_of(ball(2)), stretch);
    const linalg::StiffnessMatrix k = fem::stiffness_matrix(model);
    const Eigen::MatrixXd full = dense(k);
    const double exact_norm = full.cwiseAbs().colwise().sum().maxCoeff();
    const double exact_inverse = full.inverse().cwiseAbs().colwise().sum().maxCoeff();
    EXPECT_NEAR(linalg::stiffness_norm(k), exact_norm, 1e-12 * exact_norm);
    const double estimate = linalg::inverse_norm(linalg::Factor(k, {}));
    EXPECT_LE(estimate, exact_inverse * (1 + 1e-9));
    EXPECT_GE(estimate, exact_inverse / 3);
  }
}

TEST(Condition, AcceptsWhatIsHeld) {
  for (const std::int64_t centrals : {3, 4, 8}) {
    const model::Model model = model_of(ball(3), centrals);
    linalg::StiffnessCheck check;
    EXPECT_NO_THROW((void)linalg::checked_factor(model, fem::stiffness_matrix(model), {}, check))
        << centrals;
    EXPECT_GT(check.condition, 10);
    EXPECT_LT(check.condition, 1e9);
    EXPECT_LE(check.residual, 1e-15);
    EXPECT_GT(check.residual, 0);
  }
}

TEST(Condition, NamesRigidMotions) {
  const linalg::FreeMotion none = weakest(model_of(ball(2), 0));
  EXPECT_EQ(none.kind, Motion::free);
  EXPECT_EQ(none.translations + none.rotations, 6);
  const linalg::FreeMotion one = weakest(model_of(ball(2), 1));
  EXPECT_EQ(one.kind, Motion::turn);
  EXPECT_EQ(one.rotations, 3);
  const linalg::FreeMotion two = weakest(model_of(ball(2), 2));
  EXPECT_EQ(two.kind, Motion::hinge);
  EXPECT_EQ(two.rotations, 1);
  EXPECT_EQ(two.translations, 0);
}

TEST(Condition, NamesRigidMotionsOnASlantAndFarAway) {
  for (const double offset : {0.0, 1e3}) {
    model::Model model = model_of(ball(2, 5, {offset, -offset, offset}), 0);
    model.nodes[0].fixed = model::fixed_all; // two nodes: a hinge on a slant
    model.nodes[7].fixed = model::fixed_all;
    EXPECT_EQ(weakest(model).kind, Motion::hinge) << offset;
    model.nodes[7].fixed = model::fixed_none;
    EXPECT_EQ(weakest(model).kind, Motion::turn) << offset;
    for (model::Node& n : model.nodes)
      n.fixed = model::fixed_x; // slides in y and z, and turns about x
    const linalg::FreeMotion slide = weakest(model);
    EXPECT_EQ(slide.kind, Motion::translation) << offset;
    EXPECT_EQ(slide.translations, 2);
    EXPECT_EQ(slide.rotations, 1);
  }
}

TEST(Condition, NamesTheComponent) {
  model::Model model = model_of(joined(ball(2), ball(2, 1, {5, 0, 0})), 4);
  EXPECT_EQ(refusal(model), "accepted");
  // The second ball loses its central springs.
  const std::size_t half = model::surface_count(model) / 2;
  std::erase_if(model.springs, [&](const model::Spring& s) {
    return s.kind == model::SpringKind::central && s.i >= half;
  });
  const linalg::FreeMotion motion = weakest(model);
  EXPECT_EQ(motion.kind, Motion::free);
  EXPECT_EQ(motion.component, 1);
  EXPECT_EQ(refusal(model).find("the stiffness matrix is singular: component 1 is held by nothing"),
            0);
}

TEST(Condition, NamesAnIsolatedNode) {
  model::Model model = model_of(ball(2), 4);
  std::erase_if(model.springs, [&](const model::Spring& s) { return s.i == 9 || s.j == 9; });
  const linalg::FreeMotion motion = weakest(model);
  EXPECT_EQ(motion.kind, Motion::isolated);
  EXPECT_EQ(motion.node, 9);
  EXPECT_EQ(motion.translations, 3);
  EXPECT_NE(refusal(model).find("node 9 (component"), std::string::npos);
  model.nodes[9].fixed = model::fixed_all;
  EXPECT_EQ(refusal(model), "accepted");
}

TEST(Condition, NamesALocalMotion) {
  // A sheet held at its rim offers nothing against moves out of its plane.
  model::Model model = model_of(sheet(6, 6), 0);
  for (std::size_t i = 0; i < model.nodes.size(); ++i) {
    const Vec3& p = model.nodes[i].position;
    if (p.x == 0 || p.y == 0 || p.x == 6 || p.y == 6)
      model.nodes[i].fixed = model::fixed_all;
  }
  const linalg::FreeMotion motion = weakest(model);
  EXPECT_EQ(motion.kind, Motion::local);
  EXPECT_NEAR(std::abs(motion.direction.z), 1, 1e-6);
  EXPECT_NE(refusal(model).find("a part of component 0 can move against the rest"),
            std::string::npos);
}

TEST(Condition, DecidesByTheEstimateAndNotByAPivot) {
  // Central springs softer and softer: from sound over nearly singular to singular, all of which
  // Cholesky may well survive.
  for (const double factor : {1e-3, 1e-6}) {
    model::BuildOptions soft;
    soft.central_factor = factor;
    EXPECT_EQ(refusal(model_of(ball(3), 4, soft)), "accepted") << factor;
  }
  for (const double factor : {1e-12, 1e-13}) {
    model::BuildOptions soft;
    soft.central_factor = factor;
    const model::Model model = model_of(ball(3), 4, soft);
    EXPECT_NO_THROW(linalg::Factor(fem::stiffness_matrix(model), {})) << factor;
    const std::string text = refusal(model);
    EXPECT_EQ(text.find("the stiffness matrix is nearly singular (condition "), 0) << text;
    EXPECT_NE(text.find("component 0"), std::string::npos) << text;
  }
}

TEST(Condition, ScaleOfTheUnitsDoesNotDecide) {
  for (const double scale : {1e-9, 1e9}) {
    model::Model model = model_of(ball(2), 4);
    for (model::Spring& s : model.springs)
      s.stiffness *= scale;
    EXPECT_EQ(refusal(model), "accepted") << scale;
    model::Model hinge = model_of(ball(2), 2);
    for (model::Spring& s : hinge.springs)
      s.stiffness *= scale;
    EXPECT_EQ(weakest(hinge).kind, Motion::hinge) << scale;
  }
}

TEST(Condition, NamesAnUnstableModel) {
  EXPECT_EQ(refusal(stretched(model_of(ball(2), 4), 0.5)).find("the model is unstable at rest"), 0);
  EXPECT_EQ(refusal(stretched(model_of(ball(2), 4), 1.5)), "accepted");
}

TEST(Condition, AMatrixOfZerosIsRefused) {
  model::Model model = model_of(ball(1), 4);
  for (model::Spring& s : model.springs)
    s.stiffness = 0;
  EXPECT_NE(refusal(model).find("held by no spring"), std::string::npos) << refusal(model);
}
