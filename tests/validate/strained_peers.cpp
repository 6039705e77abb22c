// Large strains against FElupe: the same mesh, law and load.

#include "geometry/vector_at.h"
#include "integrator/solid_motion.h"
#include "tests/bench/peer.h"
#include "tests/unit/larger.h"
#include "tests/unit/tet_fixtures.h"
#include "tests/validate/checks.h"
#include "tests/validate/peer_folder.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <ctime>
#include <string>
#include <vector>

namespace gewebe::validate {

namespace {

const char* const script = "tests/validate/peer_felupe.py";
const char* const source =
    "Dutzler, FElupe: finite element analysis for continuum mechanics of solid bodies, JOSS "
    "(software, PyPI)";
constexpr double young = 2500, poisson = 0.4;

double processor_ms() {
  return 1e3 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

/// A box held at x = 0, drawn and sheared at the other end.
struct StrainedBox {
  tetrahedra::TetMesh mesh = test::distorted_box();
  std::vector<std::uint8_t> held = std::vector<std::uint8_t>(3 * mesh.points.size());
  std::vector<double> load = std::vector<double>(3 * mesh.points.size());

  StrainedBox() {
    double ends = 0;
    for (const Vec3& p : mesh.points)
      ends += p.x == 2 ? 1 : 0;
    for (std::size_t i = 0; i < mesh.points.size(); ++i)
      for (std::size_t axis = 0; axis < 3; ++axis) {
        held[3 * i + axis] = mesh.points[i].x == 0 ? 1 : 0;
        load[3 * i + axis] =
            mesh.points[i].x == 2 ? std::array{2500.0, 1200.0, -800.0}[axis] / ends : 0;
      }
  }
};

struct Shape {
  std::vector<double> u;
  double ms = 0;
};

Shape ours(const StrainedBox& box, const model::HyperelasticLaw& law) {
  const double start = processor_ms();
  integrator::SolidMotionOptions options;
  options.law = integrator::SolidLaw::hyperelastic;
  options.tolerance = 1e-10;
  options.max_rounds = 400;
  options.recover = false;
  integrator::SolidMotion motion(
      box.mesh, std::array{fem::SolidMaterial{young, poisson, 1e-3, law, {}}}, options);
  motion.hold(box.held);
  motion.set_load(box.load);
  (void)motion.settle({});
  return {motion.displacement(), processor_ms() - start};
}

/// Nothing where there is no FElupe.
Shape theirs(const StrainedBox& box, const std::string& name, const model::HyperelasticLaw& law) {
  const Folder folder;
  std::vector<double> points;
  std::vector<std::uint32_t> corners;
  for (const Vec3& p : box.mesh.points)
    points.insert(points.end(), {p.x, p.y, p.z});
  for (const Tetrahedron& t : box.mesh.tetrahedra)
    corners.insert(corners.end(), t.begin(), t.end());
  write<double>(folder, "points.f64", points);
  write<double>(folder, "load.f64", box.load);
  write<std::uint32_t>(folder, "tetrahedra.u32", corners);
  write<std::uint8_t>(folder, "fixed.u8", box.held);
  const double mu = young / (2 * (1 + poisson)), bulk = young / (3 * (1 - 2 * poisson));
  std::string command = std::string(script) + " " + folder.path.string() + " " + name;
  for (const double number : {mu, bulk, law.parameter[0], law.parameter[1], law.parameter[2], 8.0})
    command += " " + text_of(number, 17);
  const std::vector<double> numbers = timing::numbers_of_script(command);
  if (numbers.size() != 3)
    return {};
  return {read<double>(folder, "u.f64"), numbers[1]};
}

} // namespace

Section strained_peers() {
  Section section{
      "Large strains by another program",
      "FElupe solves the same distorted box of linear tetrahedra, held on one side, drawn to about "
      "twice its length and sheared by dead forces on the other, by the same law in modified "
      "invariants with K/2 (J - 1)². Times are of the processor, of one thread.",
      {},
      {}};
  const StrainedBox box;
  for (const auto& [name, law] : {std::pair<std::string, model::HyperelasticLaw>{
                                      "neo-hookean", {model::HyperelasticLaw::yeoh, {}}},
                                  {"mooney-rivlin", {model::HyperelasticLaw::mooney_rivlin, {0.2}}},
                                  {"yeoh", {model::HyperelasticLaw::yeoh, {0.1, 0.02}}},
                                  {"ogden", {model::HyperelasticLaw::ogden, {5, -2.6, 0.4}}}}) {
    const std::string what = "shape, " + name;
    const Shape other = theirs(box, name, law);
    if (other.u.empty()) {
      section.checks.push_back(skipped(what, source, "no felupe with tensortrax"));
      continue;
    }
    const Shape own = ours(box, law);
    double off = 0, most = 0;
    for (std::size_t axis = 0; axis < own.u.size(); ++axis) {
      off = test::larger(off, std::abs(own.u[axis] - other.u[axis]));
      most = test::larger(most, std::abs(own.u[axis]));
    }
    section.checks.push_back({what, source, text_of(other.ms, 3) + " ms",
                              text_of(own.ms, 3) + " ms, " + text_of(most / 2, 3) +
                                  " of the length, " + text_of(off / most, 2) + " apart",
                              off / most, 1e-6});
  }
  return section;
}

} // namespace gewebe::validate
