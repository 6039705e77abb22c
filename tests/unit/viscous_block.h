#pragma once
// A block of viscoelastic elements between rollers: it stretches evenly.

#include "dynamics/solid_static.h"
#include "fem/assembly.h"
#include "fem/solid_model.h"
#include "geometry/vector_at.h"
#include "integrator/solid_motion.h"
#include "tet_fixtures.h"
#include "tetrahedra/boundary.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::test {

inline constexpr double viscous_young = 1e4, viscous_edge = 10; // Pa, mm

/// At x = 0, y = 0 and z = 0 it slides.
struct ViscousModel {
  model::Model model;
  tetrahedra::TetMesh mesh;

  ViscousModel(std::span<const model::PronyTerm> terms, const model::HyperelasticLaw& law,
               double poisson, bool quadratic = true) {
    fem::SolidModelOptions options;
    model::Material gel{"gel", 1e-3, viscous_young, 1, 0.2, poisson};
    gel.law = law;
    gel.prony.assign(terms.begin(), terms.end());
    options.material.materials = {gel};
    options.quadratic = quadratic;
    model = fem::solid_model(box_tetrahedra(2, 2, 2, viscous_edge / 2), options, {});
    for (model::Node& node : model.nodes)
      for (int axis = 0; axis < 3; ++axis)
        if (node.position[axis] == 0)
          node.fixed = static_cast<std::uint8_t>(node.fixed | (1 << axis));
    mesh = fem::element_mesh(model);
  }

  std::vector<std::uint8_t> rollers() const {
    std::vector<std::uint8_t> held(3 * mesh.points.size());
    for (std::size_t i = 0; i < mesh.points.size(); ++i)
      for (int axis = 0; axis < 3; ++axis)
        held[3 * i + static_cast<std::size_t>(axis)] = mesh.points[i][axis] == 0 ? 1 : 0;
    return held;
  }
  /// Of a stress along x at the end, Pa.
  std::vector<double> forces(double stress) const {
    const tetrahedra::TetBoundary of = tetrahedra::boundary(mesh);
    std::vector<std::uint32_t> end;
    for (std::uint32_t t = 0; t < of.mesh.triangles.size(); ++t) {
      bool at_end = true;
      for (const std::uint32_t point : of.mesh.triangles[t])
        at_end = at_end && of.mesh.points[point].x > viscous_edge - 1e-9;
      if (at_end)
        end.push_back(t);
    }
    return fem::traction_load(mesh, of, end, {stress, 0, 0});
  }
  contact::Load pulled(double stress) const {
    contact::Load load;
    const std::vector<double> all = forces(stress);
    for (std::uint32_t i = 0; i < mesh.points.size(); ++i)
      if (const Vec3 f = vector_at(all, i); f != Vec3{})
        load.force[i] = f;
    return load;
  }
  /// Of the whole block, over its length.
  double extension(std::span<const double> u) const {
    double sum = 0, count = 0;
    for (std::size_t i = 0; i < mesh.points.size(); ++i)
      if (mesh.points[i].x > viscous_edge - 1e-9) {
        sum += u[3 * i];
        ++count;
      }
    return sum / count / viscous_edge;
  }
};

/// The same of linear elements, as a body that moves.
struct ViscousBlock {
  ViscousModel of;
  integrator::SolidMotion motion;

  ViscousBlock(std::vector<model::PronyTerm> terms, const model::HyperelasticLaw& law,
               double poisson, double density = 1e-3)
      : of(terms, law, poisson, false),
        motion(of.mesh,
               std::vector<fem::SolidMaterial>{{viscous_young, poisson, density, law, terms}},
               options()) {}
  static integrator::SolidMotionOptions options() {
    integrator::SolidMotionOptions options;
    options.law = integrator::SolidLaw::hyperelastic;
    options.tolerance = 1e-5;
    options.max_rounds = 200;
    return options;
  }

  /// The end goes there in the next step.
  void stretch(double by) {
    std::vector<std::uint8_t> held = of.rollers();
    std::vector<double> target(held.size());
    for (std::size_t i = 0; i < of.mesh.points.size(); ++i)
      if (of.mesh.points[i].x > viscous_edge - 1e-9) {
        held[3 * i] = 1;
        target[3 * i] = (by - 1) * viscous_edge;
      }
    motion.hold(held);
    motion.move_held(target);
  }
  /// The force that holds the end.
  double pull() const {
    double sum = 0;
    for (std::size_t i = 0; i < of.mesh.points.size(); ++i)
      if (of.mesh.points[i].x > viscous_edge - 1e-9)
        sum += motion.reactions()[3 * i];
    return sum;
  }
};

} // namespace gewebe::test
