#include "base/error.h"
#include "compliance/compliance_source.h"
#include "dynamics/elastodynamic.h"
#include "fem/model_stiffness.h"
#include "larger.h"
#include "linalg/stiffness.h"
#include "sim_models.h"
#include "statics/elastostatic.h"
#include "statics/linear_range.h"
#include "tests/unit/relative_difference.h"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <memory>
#include <random>
#include <utility>

namespace gewebe::test {
namespace {

using test::free_nodes, test::organ;

using Vector = Eigen::VectorXd;

/// K over all axes, from its definition alone.
Eigen::MatrixXd dense_stiffness(const model::Model& model) {
  const auto size = static_cast<Eigen::Index>(3 * model.nodes.size());
  Eigen::MatrixXd k = Eigen::MatrixXd::Zero(size, size);
  for (const model::Spring& s : model.springs) {
    const Vec3 along = model.nodes[s.j].position - model.nodes[s.i].position;
    const Eigen::Vector3d d(along.x, along.y, along.z), n = d.normalized();
    const Eigen::Matrix3d block =
        s.stiffness * (n * n.transpose() +
                       (1 - s.rest / d.norm()) * (Eigen::Matrix3d::Identity() - n * n.transpose()));
    const Eigen::Index i = 3 * Eigen::Index{s.i}, j = 3 * Eigen::Index{s.j};
    k.block<3, 3>(i, i) += block;
    k.block<3, 3>(j, j) += block;
    k.block<3, 3>(i, j) -= block;
    k.block<3, 3>(j, i) -= block;
  }
  return k;
}

/// Displacements under a load by dense LU: prescribed axes and fixed ones are held.
Vector dense_shape(const model::Model& model, const contact::Load& load) {
  const Eigen::MatrixXd k = dense_stiffness(model);
  const Eigen::Index size = k.rows();
  Vector u = Vector::Zero(size), f = Vector::Zero(size);
  std::vector<Eigen::Index> free;
  for (std::uint32_t i = 0; i < model.nodes.size(); ++i)
    for (int a = 0; a < 3; ++a) {
      const Eigen::Index axis = 3 * Eigen::Index{i} + a;
      f[axis] = model.nodes[i].mass * load.gravity[a];
      if (load.force.contains(i))
        f[axis] += load.force.at(i)[a];
      if (load.displacement.contains(i))
        u[axis] = load.displacement.at(i)[a];
      else if (!contact::is_fixed(model, i, a))
        free.push_back(axis);
    }
  const Vector rhs = (f - k * u)(free);
  const Eigen::MatrixXd k_free = k(free, free);
  const Vector u_free = k_free.lu().solve(rhs);
  for (std::size_t r = 0; r < free.size(); ++r)
    u[free[r]] = u_free[static_cast<Eigen::Index>(r)];
  return u;
}

double cond(const model::Model& model) {
  std::vector<Eigen::Index> free;
  for (std::size_t i = 0; i < model.nodes.size(); ++i)
    for (int a = 0; a < 3; ++a)
      if (!contact::is_fixed(model, i, a))
        free.push_back(static_cast<Eigen::Index>(3 * i) + a);
  const Eigen::MatrixXd k = dense_stiffness(model)(free, free);
  const Vector values = k.selfadjointView<Eigen::Lower>().eigenvalues();
  return values.maxCoeff() / values.minCoeff();
}

Vector as_vector(std::span<const double> values) {
  return Eigen::Map<const Vector>(values.data(), static_cast<Eigen::Index>(values.size()));
}

std::span<const double> numbers(const Vector& v) {
  return {v.data(), static_cast<std::size_t>(v.size())};
}
double relative_difference(const Vector& a, const Vector& b) {
  return test::relative_difference(numbers(a), numbers(b));
}

/// Columns in memory, of some nodes.
class Columns final : public columns::ColumnSource {
public:
  Columns(const model::Model& model, std::vector<std::uint32_t> nodes) : nodes_(std::move(nodes)) {
    count_ = model.nodes.size();
    const linalg::StiffnessMatrix matrix = fem::stiffness_matrix(model);
    const linalg::Factor factor(matrix, Context{});
    for (const std::uint32_t node : nodes_) {
      std::vector<double>& column = columns_.emplace_back(9 * count_);
      for (std::size_t a = 0; a < 3; ++a) {
        std::vector<double> f(3 * count_);
        f[3 * node + a] = 1;
        linalg::solve_axes(matrix, factor, f,
                           std::span(column).subspan(a * 3 * count_, 3 * count_));
      }
    }
  }
  std::size_t node_count() const override { return count_; }
  const std::vector<std::uint32_t>& nodes() const override { return nodes_; }
  void read(std::size_t k, std::span<double> out) const override {
    ++reads;
    std::copy(columns_.at(k).begin(), columns_.at(k).end(), out.begin());
  }
  mutable int reads = 0;

private:
  std::size_t count_ = 0;
  std::vector<std::uint32_t> nodes_;
  std::vector<std::vector<double>> columns_;
};

/// The factor may be asked for only where `factor_asked` is given.
std::shared_ptr<compliance::ComplianceSource> with_columns(const model::Model& model,
                                                           std::vector<std::uint32_t> nodes,
                                                           int* factor_asked = nullptr) {
  return compliance::compliance_of_store(
      {std::make_unique<Columns>(model, std::move(nodes)), [&model, factor_asked] {
         if (factor_asked == nullptr)
           throw Error("nobody should need the factor");
         ++*factor_asked;
         return linalg::Factor(fem::stiffness_matrix(model), Context{});
       }});
}

statics::Elastostatic plain(const model::Model& model, std::size_t block_limit = SIZE_MAX) {
  return {model, {}, Context{}, {.measure_error = true, .block_limit = block_limit}};
}

/// Forces, displacements and gravity at several nodes.
contact::Load rich_load(const model::Model& model, std::size_t displaced) {
  const std::vector<std::uint32_t> nodes = free_nodes(model);
  EXPECT_GT(nodes.size(), displaced + 6);
  contact::Load load{.gravity = {1000, 0, -9810}};
  for (std::size_t k = 0; k < displaced; ++k)
    load.displacement[nodes[3 * k % nodes.size()]] = {0.01 * static_cast<double>(k), -0.02, 0.03};
  load.force[nodes[1]] = {10, -20, 30};
  load.force[nodes[4]] = {0, 0, 5};
  load.force[nodes[0]] = {7, 7, 7}; // a displaced node, if there is one
  // A node that is held along z alone can be displaced along x and y.
  for (std::uint32_t i = 0; displaced > 0 && i < model.nodes.size(); ++i)
    if (model.nodes[i].fixed == model::fixed_z) {
      load.displacement[i] = {0.05, 0.01, 0};
      break;
    }
  return load;
}

TEST(Elastostatic, ShapeOfForcesAndGravityEqualsADenseSolve) {
  const model::Model model = organ();
  const double tolerance = 10 * 2.2e-16 * cond(model);
  EXPECT_LT(tolerance, 1e-9);
  statics::Elastostatic object = plain(model);
  const contact::Load load = rich_load(model, 0);
  object.update(load);
  const Vector expected = dense_shape(model, load);
  EXPECT_GT(expected.cwiseAbs().maxCoeff(), 0.01);
  EXPECT_LT(relative_difference(as_vector(object.displacement()), expected), tolerance);
  EXPECT_LT(object.counts().backward_error, 1e-14);
  EXPECT_GT(object.counts().backward_error, 0);
  // The comparison can fail: stiffer springs give another shape.
  model::Model other = model;
  for (model::Spring& s : other.springs)
    s.stiffness *= s.i == free_nodes(model)[0] ? 1.001 : 1;
  EXPECT_GT(relative_difference(as_vector(object.displacement()), dense_shape(other, load)),
            tolerance);
}

TEST(Elastostatic, BothWaysOfContactEqualADenseSolve) {
  const model::Model model = organ();
  const double tolerance = 10 * 2.2e-16 * cond(model);
  for (const std::size_t m : {1U, 3U, 10U}) {
    const contact::Load load = rich_load(model, m);
    const Vector expected = dense_shape(model, load);
    statics::Elastostatic block = plain(model, SIZE_MAX - 1), constrained = plain(model, 0);
    for (statics::Elastostatic* object : {&block, &constrained}) {
      object->update(load);
      EXPECT_LT(relative_difference(as_vector(object->displacement()), expected), tolerance) << m;
      EXPECT_LT(object->counts().backward_error, 1e-14);
      for (const auto& [node, d] : load.displacement)
        for (std::size_t a = 0; a < 3; ++a)
          EXPECT_EQ(object->displacement()[3 * node + a], d[static_cast<int>(a)]);
    }
    EXPECT_EQ(block.counts().factors, 1U);
    EXPECT_EQ(constrained.counts().factors, 2U);
    ASSERT_EQ(block.contact_forces().size(), load.displacement.size());
    double scale = 0;
    for (const contact::NodeVector& f : block.contact_forces())
      scale = test::larger(scale, norm(f.value));
    for (std::size_t k = 0; k < block.contact_forces().size(); ++k) {
      const contact::NodeVector &a = block.contact_forces()[k],
                                &b = constrained.contact_forces()[k];
      EXPECT_EQ(a.node, b.node);
      EXPECT_LT(norm(a.value - b.value), tolerance * scale);
    }
  }
}

TEST(Elastostatic, ForcesAndReactionsBalance) {
  const model::Model model = organ();
  for (const std::size_t limit : {std::size_t{0}, SIZE_MAX}) {
    statics::Elastostatic object = plain(model, limit);
    const contact::Load load = rich_load(model, 5);
    object.update(load);
    std::vector<double> product(3 * model.nodes.size());
    fem::multiply_stiffness(model, object.displacement(), product);
    Vec3 sum, turn;
    double scale = 0;
    const auto acts = [&](std::size_t i, const Vec3& f) {
      sum += f;
      turn += cross(model.nodes[i].position, f); // moments about rest: the object is linearised
      scale += norm(f);
    };
    for (const contact::NodeVector& c : object.contact_forces())
      acts(c.node, c.value);
    for (std::uint32_t i = 0; i < model.nodes.size(); ++i) {
      Vec3 outer = model.nodes[i].mass * load.gravity, reaction;
      if (load.force.contains(i))
        outer += load.force.at(i);
      for (int a = 0; a < 3; ++a)
        if (contact::is_fixed(model, i, a))
          reaction[a] = product[3 * i + static_cast<std::size_t>(a)] - outer[a];
      acts(i, outer + reaction);
    }
    EXPECT_GT(scale, 100);
    EXPECT_LT(norm(sum), 1e-12 * scale);
    EXPECT_LT(norm(turn), 1e-12 * scale * 200);
    // Without the contact forces it does not balance.
    for (const contact::NodeVector& c : object.contact_forces())
      sum -= c.value;
    EXPECT_GT(norm(sum), 1e-3 * scale);
  }
}

TEST(Elastostatic, ShapesOfForcesAddUp) {
  const model::Model model = organ();
  const std::vector<std::uint32_t> nodes = free_nodes(model);
  const auto shape = [&](const contact::Load& load) {
    statics::Elastostatic object = plain(model);
    object.update(load);
    return as_vector(object.displacement()).eval();
  };
  contact::Load a, b, both;
  a.force[nodes[2]] = {30, 0, 10};
  b.force[nodes[2]] = {0, 5, 0};
  b.force[nodes[8]] = {1, 2, 3};
  b.gravity = {0, 0, -9810};
  both = b;
  both.force[nodes[2]] += a.force[nodes[2]];
  EXPECT_LT(relative_difference(shape(a) + shape(b), shape(both)), 1e-12);
  EXPECT_GT(relative_difference(shape(a), shape(both)), 1e-3);
  // As do prescribed displacements of the same nodes.
  a = b = both = {};
  a.displacement[nodes[0]] = {0.1, 0, 0};
  a.displacement[nodes[5]] = {0, 0, 0};
  b.displacement[nodes[0]] = {0, 0.2, 0};
  b.displacement[nodes[5]] = {0.3, 0, 0.1};
  both.displacement[nodes[0]] = {0.1, 0.2, 0};
  both.displacement[nodes[5]] = {0.3, 0, 0.1};
  EXPECT_LT(relative_difference(shape(a) + shape(b), shape(both)), 1e-11);
}

void shape_of(statics::Elastostatic& object, const contact::Load& load) {
  object.update(load);
  (void)object.displacement();
}

TEST(Elastostatic, OnlyWhatChangedIsComputed) {
  const model::Model model = organ();
  const std::vector<std::uint32_t> nodes = free_nodes(model);
  statics::Elastostatic object(model, {}, Context{});
  contact::Load load;
  shape_of(object, load);
  EXPECT_EQ(object.counts().unchanged, 1U);
  EXPECT_EQ(object.counts().solves, 0U);
  load.gravity = {0, 0, -9810};
  shape_of(object, load);
  EXPECT_EQ(object.counts().solves, 1U);
  shape_of(object, load);
  EXPECT_EQ(object.counts().solves, 1U);
  EXPECT_EQ(object.counts().unchanged, 2U);
  load.force[nodes[0]] = {1, 2, 3}; // gravity is kept
  shape_of(object, load);
  EXPECT_EQ(object.counts().solves, 2U);
  load.displacement[nodes[1]] = {0.1, 0, 0}; // three columns, then sums of columns
  shape_of(object, load);
  EXPECT_EQ(object.counts().solves, 5U);
  load.displacement[nodes[1]] = {0.2, 0, 0};
  shape_of(object, load);
  EXPECT_EQ(object.counts().solves, 5U);
  load.displacement[nodes[2]] = {0, 0, 0};
  shape_of(object, load);
  EXPECT_EQ(object.counts().solves, 8U);
  load = {};
  shape_of(object, load);
  EXPECT_EQ(object.counts().solves, 8U);
  EXPECT_EQ(object.counts().factors, 1U);
  for (const double value : object.displacement())
    EXPECT_EQ(value, 0);
  EXPECT_TRUE(object.contact_forces().empty());

  statics::Elastostatic held(model, {}, Context{}, {.block_limit = 0});
  load.displacement[nodes[1]] = {0.1, 0, 0};
  shape_of(held, load);
  load.displacement[nodes[1]] = {0.1, 0, 0.1};
  shape_of(held, load);
  EXPECT_EQ(held.counts().factors, 2U); // of K, and with node 1 held
  load.displacement[nodes[3]] = {0.1, 0, 0.1};
  shape_of(held, load);
  EXPECT_EQ(held.counts().factors, 3U);
}

TEST(Elastostatic, AHistoryGivesTheSameBytesAndALoadTheSameShape) {
  const model::Model model = organ();
  const double tolerance = 10 * 2.2e-16 * cond(model);
  const contact::Load load = rich_load(model, 4), other = rich_load(model, 2);
  for (const std::size_t limit : {std::size_t{0}, SIZE_MAX}) {
    statics::Elastostatic fresh(model, {}, Context{}, {.block_limit = limit});
    fresh.update(load);
    const auto with_history = [&](int threads) {
      Context context;
      context.threads = threads;
      statics::Elastostatic used(model, {}, context, {.block_limit = limit});
      used.update(other);
      (void)used.displacement();
      used.update({});
      used.update(load);
      return used;
    };
    statics::Elastostatic first = with_history(1), second = with_history(2);
    EXPECT_TRUE(std::ranges::equal(first.displacement(), second.displacement()));
    EXPECT_EQ(first.contact_forces(), second.contact_forces());
    EXPECT_LT(relative_difference(as_vector(first.displacement()), as_vector(fresh.displacement())),
              tolerance);
  }
}

TEST(Elastostatic, StoredColumnsNeedNoFactor) {
  const model::Model model = organ();
  const std::vector<std::uint32_t> nodes = free_nodes(model);
  const std::vector<std::uint32_t> some(nodes.begin(), nodes.begin() + 6);
  statics::Elastostatic object(model, with_columns(model, some), Context{});
  contact::Load load;
  load.force[nodes[1]] = {10, -20, 30};
  load.displacement[nodes[0]] = {0.1, 0.2, 0.3};
  load.displacement[nodes[5]] = {0, 0, -0.1};
  object.update(load);
  EXPECT_EQ(object.counts().columns_read, 3U);
  EXPECT_EQ(object.counts().factors, 0U);
  const double tolerance = 10 * 2.2e-16 * cond(model);
  EXPECT_LT(relative_difference(as_vector(object.displacement()), dense_shape(model, load)),
            tolerance);
  load.force[nodes[1]] = {1, 2, 3}; // kept in memory
  object.update(load);
  EXPECT_EQ(object.counts().columns_read, 3U);
  // A node without a column asks for the factor.
  load.force[nodes[7]] = {1, 2, 3};
  EXPECT_THROW(object.update(load), Error);
  int asked = 0;
  statics::Elastostatic both(model, with_columns(model, some, &asked), Context{});
  EXPECT_EQ(asked, 0);
  both.update(load);
  EXPECT_EQ(asked, 1);
  EXPECT_LT(relative_difference(as_vector(both.displacement()), dense_shape(model, load)),
            tolerance);
}

TEST(Elastostatic, LittleMemoryKeepsFewColumns) {
  const model::Model model = organ();
  const std::vector<std::uint32_t> nodes = free_nodes(model);
  Context context;
  context.max_memory = 4 * 72 * model.nodes.size() * 2; // two nodes' columns
  int asked = 0;
  statics::Elastostatic object(model, with_columns(model, nodes, &asked), context);
  for (std::size_t k = 0; k + 1 < nodes.size(); ++k) {
    contact::Load load;
    load.force[nodes[k]] = load.force[nodes[k + 1]] = {1, 2, 3};
    shape_of(object, load);
    if (k == 9) {
      EXPECT_LT(relative_difference(as_vector(object.displacement()), dense_shape(model, load)),
                1e-10);
    }
  }
  EXPECT_EQ(object.counts().columns_read, nodes.size()); // each once, its neighbour was still there
  EXPECT_EQ(asked, 0);
}

TEST(Elastostatic, ARigidGraspAsksWithinTwelveDimensions) {
  const model::Model model = organ();
  const std::vector<std::uint32_t> nodes = free_nodes(model);
  const double tolerance = 40 * 2.2e-16 * cond(model); // shapes are sums of shapes
  const std::size_t m = 20;
  for (const std::size_t limit : {std::size_t{0}, SIZE_MAX - 1}) {
    statics::Elastostatic object(model, {}, Context{}, {.block_limit = limit});
    std::mt19937 random(5);
    std::uniform_real_distribution<double> some(-1, 1);
    const auto pose = [&](double warp) {
      const Eigen::Matrix3d turn =
          Eigen::AngleAxisd(some(random),
                            Eigen::Vector3d(some(random), some(random), some(random)).normalized())
              .toRotationMatrix();
      const Eigen::Vector3d shift(some(random), some(random), some(random));
      contact::Load load{.gravity = {0, 0, -9810}};
      for (std::size_t k = 0; k < m; ++k) {
        const Vec3& p = model.nodes[nodes[k]].position;
        const Eigen::Vector3d x(p.x, p.y, p.z),
            d = turn * x + shift - x + warp * Eigen::Vector3d(some(random), 0, 0);
        load.displacement[nodes[k]] = {d.x(), d.y(), d.z()};
      }
      return load;
    };
    for (int k = 0; k < 16; ++k)
      shape_of(object, pose(0));
    const std::uint64_t solves = object.counts().solves;
    for (int k = 0; k < 20; ++k) {
      const contact::Load load = pose(0);
      shape_of(object, load);
      if (k % 7 == 0) {
        EXPECT_LT(relative_difference(as_vector(object.displacement()), dense_shape(model, load)),
                  tolerance);
      }
    }
    EXPECT_EQ(object.counts().solves, solves);
    // One that bends asks for more, and is as exact.
    for (int k = 0; k < 4; ++k) {
      const contact::Load load = pose(0.1);
      shape_of(object, load);
      EXPECT_LT(relative_difference(as_vector(object.displacement()), dense_shape(model, load)),
                tolerance);
    }
    if (limit == 0) {
      EXPECT_GT(object.counts().solves, solves);
    }
  }
}

TEST(Elastostatic, DelassusOperatorIsWhatForcesDo) {
  const model::Model model = organ();
  const std::vector<std::uint32_t> nodes = free_nodes(model);
  const double tolerance = 10 * 2.2e-16 * cond(model);
  const std::vector<std::uint32_t> touched{nodes[7], nodes[9], nodes[10], nodes[31]};
  for (const std::size_t limit : {std::size_t{0}, SIZE_MAX - 1})
    for (const std::size_t displaced : {0U, 5U}) {
      statics::Elastostatic object(model, {}, Context{}, {.block_limit = limit});
      contact::Load load = rich_load(model, displaced);
      for (const std::uint32_t node : touched)
        load.displacement.erase(node);
      const statics::DelassusOperator delassus = object.delassus_operator(load, touched);
      ASSERT_EQ(delassus.free.size(), 12U);
      ASSERT_EQ(delassus.compliance.size(), 144U);
      Eigen::VectorXd f(12);
      for (int k = 0; k < 12; ++k)
        f[k] = std::sin(k + 1.0) * 20;
      const Eigen::VectorXd u =
          as_vector(delassus.free) +
          Eigen::Map<const Eigen::MatrixXd>(delassus.compliance.data(), 12, 12) * f;
      for (std::size_t k = 0; k < touched.size(); ++k)
        load.force[touched[k]] += Vec3{f[static_cast<int>(3 * k)], f[static_cast<int>(3 * k) + 1],
                                       f[static_cast<int>(3 * k) + 2]};
      const Vector expected = dense_shape(model, load);
      const double size = expected.cwiseAbs().maxCoeff();
      double max = 0, moved = 0;
      for (std::size_t k = 0; k < touched.size(); ++k)
        for (int a = 0; a < 3; ++a) {
          const auto row = static_cast<Eigen::Index>(3 * k) + a;
          max = test::larger(max, std::abs(u[row] - expected[3 * Eigen::Index{touched[k]} + a]));
          moved =
              test::larger(moved, std::abs(u[row] - delassus.free[static_cast<std::size_t>(row)]));
        }
      EXPECT_LT(max, tolerance * size) << limit << " " << displaced;
      EXPECT_GT(moved, 1e-4 * size); // the forces matter
      shape_of(object, load);
      EXPECT_LT(relative_difference(as_vector(object.displacement()), expected), tolerance);
    }
}

TEST(Elastostatic, NodesJoinAndLeaveTheBlock) {
  const model::Model model = organ();
  const std::vector<std::uint32_t> nodes = free_nodes(model);
  const double tolerance = 10 * 2.2e-16 * cond(model);
  statics::Elastostatic object(model, with_columns(model, nodes), Context{});
  std::mt19937 random(7);
  contact::Load load;
  for (int k = 0; k < 60; ++k) {
    const std::uint32_t node = nodes[random() % nodes.size()];
    if (load.displacement.contains(node))
      load.displacement.erase(node);
    else
      load.displacement[node] = {0.1 * std::cos(k), 0.1, 0.02 * k};
    object.update(load);
    EXPECT_EQ(object.contact_forces().size(), load.displacement.size());
    if (k % 6 != 0)
      continue;
    EXPECT_LT(relative_difference(as_vector(object.displacement()), dense_shape(model, load)),
              tolerance);
    EXPECT_LT(object.counts().contact_error, 1e-12);
  }
  EXPECT_EQ(object.counts().factors, 0U);
}

TEST(Elastostatic, WhatTheToleranceLeavesOutStaysBelowIt) {
  const model::Model model = organ(3);
  const std::vector<std::uint32_t> nodes = free_nodes(model);
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  for (const double tolerance : {1e-1, 1e-2, 1e-3}) {
    statics::Elastostatic exact(model, with_columns(model, nodes), Context{}),
        loose(model, with_columns(model, nodes), Context{},
              {.measure_error = true, .tolerance = tolerance});
    double worst = 0;
    for (int round = 0; round < 100; ++round) {
      contact::Load load;
      for (int k = 0; k < 1 + round % 12; ++k) {
        const std::uint32_t node = nodes[random() % nodes.size()];
        const Vec3 value{normal(random), normal(random), normal(random)};
        (round % 2 == 0 ? load.force : load.displacement)[node] = value;
      }
      shape_of(exact, load);
      loose.update(load);
      worst = test::larger(worst, relative_difference(as_vector(loose.rough_surface()),
                                                      as_vector(exact.displacement())));
      EXPECT_EQ(exact.contact_forces().size(), loose.contact_forces().size());
    }
    EXPECT_LE(worst, tolerance);
    EXPECT_GT(worst, 0); // something was left out
    EXPECT_GT(loose.counts().skipped, 0U);
    EXPECT_EQ(exact.counts().skipped, 0U);
    EXPECT_NEAR(loose.counts().shape_error, worst, 1e-9 * worst + 1e-12);
  }
}

TEST(Elastostatic, TheToleranceAndMeasuringChangeNoBitOfForcesAndExactShapes) {
  const model::Model model = organ(3);
  const std::vector<std::uint32_t> nodes = free_nodes(model);
  std::mt19937 random(12);
  std::normal_distribution<double> normal;
  const std::vector<std::uint32_t> some(nodes.begin(), nodes.begin() + std::ssize(nodes) / 2);
  int factors = 0;
  const auto made = [&](const statics::ElastostaticOptions& options) {
    return statics::Elastostatic(model, with_columns(model, some, &factors), Context{}, options);
  };
  statics::Elastostatic exact = made({}), loose = made({.tolerance = 0.05}),
                        measured = made({.measure_error = true, .tolerance = 0.05});
  contact::Load load;
  for (int round = 0; round < 300; ++round) {
    if (round % 17 == 0)
      load.displacement.clear();
    if (round % 23 == 0)
      load.force.clear();
    for (int k = 0; k < 1 + round % 5; ++k) {
      const std::uint32_t node = nodes[random() % nodes.size()];
      const Vec3 value{normal(random), normal(random), normal(random)};
      (round % 3 == 0 ? load.force : load.displacement)[node] = value;
    }
    const bool asked = random() % 2 == 0, needed = random() % 2 == 0;
    for (statics::Elastostatic* const object : {&exact, &loose, &measured}) {
      object->update(load);
      if (asked)
        (void)object->rough_surface();
      if (object == &measured)
        object->verify();
    }
    for (statics::Elastostatic* const object : {&loose, &measured}) {
      const auto same = [](const contact::NodeVector& a, const contact::NodeVector& b) {
        return a.node == b.node && a.value == b.value;
      };
      ASSERT_TRUE(std::ranges::equal(exact.contact_forces(), object->contact_forces(), same))
          << round;
      if (needed) {
        ASSERT_TRUE(std::ranges::equal(exact.displacement(), object->displacement())) << round;
      }
    }
    if (asked) {
      ASSERT_TRUE(std::ranges::equal(loose.rough_surface(), measured.rough_surface())) << round;
    }
  }
}

TEST(Elastostatic, SumsThatFollowTheirChangesStayExact) {
  const model::Model model = organ();
  const std::vector<std::uint32_t> nodes = free_nodes(model);
  statics::Elastostatic object(model, with_columns(model, nodes), Context{}),
      fresh(model, with_columns(model, nodes), Context{});
  contact::Load load;
  for (std::size_t k = 0; k < 10; ++k)
    load.force[nodes[k]] = {1, 2, 3};
  shape_of(object, load);
  const std::uint64_t before = object.counts().terms;
  load.force[nodes[3]] = {3, 2, 1};
  shape_of(object, load);
  shape_of(fresh, load);
  EXPECT_LT(object.counts().terms - before, fresh.counts().terms / 2); // one column, not ten
  for (int k = 0; k < 2500; ++k) {
    load.force[nodes[static_cast<std::size_t>(k) % 10]] = {1e3 * std::sin(k), 0, 1};
    shape_of(object, load);
  }
  EXPECT_LT(relative_difference(as_vector(object.displacement()), dense_shape(model, load)), 1e-11);
}

TEST(Elastostatic, AllNodesDisplaced) {
  const model::Model model = organ(1);
  contact::Load load;
  for (std::uint32_t i = 0; i < model.nodes.size(); ++i)
    if (model.nodes[i].fixed == model::fixed_none)
      load.displacement[i] = {0.01 * i, 0, 0};
    else if (model.nodes[i].fixed != model::fixed_all)
      load.displacement[i] = {};
  for (const std::size_t limit : {std::size_t{0}, SIZE_MAX}) {
    statics::Elastostatic object(model, {}, Context{}, {.block_limit = limit});
    object.update(load);
    for (const auto& [node, d] : load.displacement)
      EXPECT_EQ(object.displacement()[3 * node], d.x);
    std::vector<double> product(3 * model.nodes.size());
    fem::multiply_stiffness(model, object.displacement(), product);
    for (const contact::NodeVector& f : object.contact_forces())
      EXPECT_NEAR(f.value.x, contact::is_fixed(model, f.node, 0) ? 0 : product[3 * f.node], 1e-6);
  }
}

TEST(Elastostatic, IsTheLimitOfElastodynamicsForSmallForces) {
  const model::Model model = organ();
  const std::vector<std::uint32_t> nodes = free_nodes(model);
  Context one;
  one.threads = 1;
  std::vector<double> differences;
  for (const double part : {1.0, 0.1, 0.01}) {
    contact::Load load;
    for (std::size_t k = 0; k < 5; ++k)
      load.force[nodes[7 * k]] = {1000 * part, -500 * part, 1500 * part};
    statics::Elastostatic still(model, {}, Context{});
    still.update(load);
    dynamics::Elastodynamic moving(model);
    moving.set_load(load);
    for (int k = 0; k < 400 && !moving.resting(); ++k)
      (void)moving.advance(0.25, 0.9 * model::safe_step(model), one);
    ASSERT_TRUE(moving.resting());
    Vector u(static_cast<Eigen::Index>(3 * model.nodes.size()));
    for (std::size_t i = 0; i < model.nodes.size(); ++i)
      for (int a = 0; a < 3; ++a)
        u[static_cast<Eigen::Index>(3 * i) + a] = moving.motion()[i].displacement[a];
    differences.push_back(relative_difference(as_vector(still.displacement()), u));
  }
  EXPECT_LT(differences[2], 1e-3);
  EXPECT_GT(differences[0], 1e-4); // they do differ
  EXPECT_NEAR(differences[1] / differences[2], 10, 1);
}

TEST(Elastostatic, RefusesASingularModelAndAnEndlessShape) {
  model::Model loose = organ();
  for (model::Node& n : loose.nodes)
    n.fixed = model::fixed_none;
  EXPECT_THROW(statics::Elastostatic(loose, {}, Context{}), Error);
  const model::Model model = organ();
  statics::Elastostatic object(model, {}, Context{});
  contact::Load load;
  load.force[free_nodes(model)[0]] = {1e308, 1e308, 1e308};
  load.gravity = {1e308, 1e308, 1e308};
  object.update(load);
  EXPECT_THROW((void)object.displacement(), Error);
}

TEST(LinearRangeOf, StrainAndTurn) {
  const model::Model model = test::two_masses();
  const auto range = [&](const Vec3& u) {
    return statics::linear_range(model, std::vector<double>{0, 0, 0, u.x, u.y, u.z});
  };
  EXPECT_EQ(range({}).strain, 0);
  EXPECT_DOUBLE_EQ(range({0.5, 0, 0}).strain, 0.25);
  EXPECT_DOUBLE_EQ(range({-0.5, 0, 0}).strain, 0.25);
  EXPECT_EQ(range({0.5, 0, 0}).turn, 0);
  EXPECT_DOUBLE_EQ(range({0, 0.6, 0.8}).turn, 0.5);
  EXPECT_NEAR(range({0, 0.6, 0.8}).strain, std::sqrt(1.25) - 1, 1e-15);
}

} // namespace
} // namespace gewebe::test
