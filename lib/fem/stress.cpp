#include "fem/stress.h"

#include "fem/corotational.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cmath>
#include <cstddef>

namespace gewebe::fem {

namespace {

linalg::SymmetricBlock symmetric_part(const SolidBlock& g) {
  return {g[0], (g[1] + g[3]) / 2, (g[2] + g[6]) / 2, g[4], (g[5] + g[7]) / 2, g[8]};
}

/// Half of the curl.
Eigen::Vector3d rotation_vector(const SolidBlock& g) {
  return Eigen::Vector3d(g[7] - g[5], g[2] - g[6], g[3] - g[1]) / 2;
}

Eigen::Matrix3d rotation_by(const Eigen::Vector3d& w) {
  const double angle = w.norm();
  if (!(angle > 0))
    return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, w / angle).toRotationMatrix();
}

linalg::SymmetricBlock turned(const linalg::SymmetricBlock& s, const Eigen::Matrix3d& r) {
  Eigen::Matrix3d m;
  m << s[0], s[1], s[2], s[1], s[3], s[4], s[2], s[4], s[5];
  m = (r * m * r.transpose()).eval();
  return {m(0, 0), m(0, 1), m(0, 2), m(1, 1), m(1, 2), m(2, 2)};
}

Vec3 at_node(std::span<const double> u, std::uint32_t node) {
  const std::size_t axis = 3 * std::size_t{node};
  return {u[axis], u[axis + 1], u[axis + 2]};
}

} // namespace

namespace {

/// The rotation nearest to each element's gradient.
std::vector<Eigen::Matrix3d> element_rotations(const tetrahedra::TetMesh& mesh,
                                               std::span<const SolidElement> elements,
                                               std::span<const double> u) {
  std::vector<double> places, forces(u.size());
  for (std::size_t i = 0; i < mesh.points.size(); ++i)
    for (int a = 0; a < 3; ++a)
      places.push_back(mesh.points[i][a] + u[3 * i + static_cast<std::size_t>(a)]);
  CorotationalSolid solid(mesh, elements);
  Context one;
  one.threads = 1;
  (void)solid.evaluate(places, {}, forces, one);
  std::vector<Eigen::Matrix3d> rotations;
  for (std::size_t t = 0; t < elements.size(); ++t) {
    const SolidBlock r = solid.frame(t).rotation;
    rotations.emplace_back(
        Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(r.data()));
  }
  return rotations;
}

/// What displacements are in the frame of an element that turns by r about its first corner.
void turn_back(const tetrahedra::TetMesh& mesh, std::size_t t, const Eigen::Matrix3d& r,
               std::span<Vec3> values) {
  const Vec3 from = mesh.points[mesh.tetrahedra[t][0]], moved = values[0];
  for (std::size_t a = 0; a < values.size(); ++a) {
    const Vec3 rest = mesh.points[a < 4 ? mesh.tetrahedra[t][a] : mesh.middles[t][a - 4]] - from;
    const Vec3 now = rest + values[a] - moved;
    const Eigen::Vector3d back = r.transpose() * Eigen::Vector3d(now.x, now.y, now.z);
    values[a] = Vec3{back.x(), back.y(), back.z()} - rest;
  }
}

Vec3 turned_back(const Eigen::Matrix3d& r, const Vec3& v) {
  const Eigen::Vector3d back = r.transpose() * Eigen::Vector3d(v.x, v.y, v.z);
  return {back.x(), back.y(), back.z()};
}

} // namespace

std::vector<CornerTensors> solid_strains(const tetrahedra::TetMesh& mesh,
                                         std::span<const SolidMaterial> materials,
                                         std::span<const SolidElement> elements,
                                         std::span<const double> u, const Vec3& acceleration,
                                         StrainFrames frames) {
  std::vector<CornerTensors> strains(elements.size());
  std::array<Vec3, 10> values;
  const std::size_t count = mesh.middles.empty() ? 4 : 10;
  const bool own = frames == StrainFrames::elements;
  const std::vector<Eigen::Matrix3d> rotations =
      own ? element_rotations(mesh, elements, u) : std::vector<Eigen::Matrix3d>{};
  for (std::size_t t = 0; t < elements.size(); ++t) {
    for (std::size_t a = 0; a < count; ++a)
      values[a] = at_node(u, a < 4 ? mesh.tetrahedra[t][a] : mesh.middles[t][a - 4]);
    if (own)
      turn_back(mesh, t, rotations[t], std::span(values).first(count));
    const std::size_t material =
        mesh.material.empty() ? 0 : static_cast<std::size_t>(mesh.material[t]);
    const auto under = [&](const Vec3& a) {
      return displacement_gradients(elements[t], std::span<const Vec3>(values).first(count),
                                    materials[material].density * a);
    };
    auto gradients = under(own ? turned_back(rotations[t], acceleration) : acceleration);
    if (frames == StrainFrames::turning && acceleration != Vec3{}) {
      Eigen::Vector3d mean = Eigen::Vector3d::Zero();
      for (const SolidBlock& g : gradients)
        mean += rotation_vector(g) / 4;
      const Eigen::Vector3d a =
          rotation_by(-mean) * Eigen::Vector3d(acceleration.x, acceleration.y, acceleration.z);
      gradients = under({a.x(), a.y(), a.z()});
    }
    for (std::size_t p = 0; p < 4; ++p) {
      strains[t][p] = symmetric_part(gradients[p]);
      if (frames == StrainFrames::turning)
        strains[t][p] = turned(strains[t][p], rotation_by(rotation_vector(gradients[p])));
      else if (own)
        strains[t][p] = turned(strains[t][p], rotations[t]);
    }
  }
  return strains;
}

std::vector<CornerTensors> solid_stresses(std::span<const SolidElement> elements,
                                          std::span<const CornerTensors> strains) {
  std::vector<CornerTensors> stresses(elements.size());
  for (std::size_t t = 0; t < elements.size(); ++t)
    for (std::size_t p = 0; p < 4; ++p) {
      const linalg::SymmetricBlock& strain = strains[t][p];
      const double volumetric = elements[t].material.lambda * (strain[0] + strain[3] + strain[5]);
      for (std::size_t k = 0; k < 6; ++k)
        stresses[t][p][k] =
            2 * elements[t].material.mu * strain[k] + (k == 0 || k == 3 || k == 5 ? volumetric : 0);
    }
  return stresses;
}

linalg::SymmetricBlock tensor_at(const CornerTensors& tensors,
                                 const std::array<double, 4>& coordinates) {
  linalg::SymmetricBlock result{};
  for (std::size_t p = 0; p < 4; ++p)
    for (std::size_t k = 0; k < 6; ++k)
      result[k] += coordinates[p] * tensors[p][k];
  return result;
}

std::vector<linalg::SymmetricBlock> nodal_tensors(const tetrahedra::TetMesh& mesh,
                                                  std::span<const SolidElement> elements,
                                                  std::span<const CornerTensors> tensors) {
  std::vector<linalg::SymmetricBlock> sums(mesh.points.size());
  std::vector<double> volumes(mesh.points.size());
  const auto add = [&](std::uint32_t node, std::size_t t, const linalg::SymmetricBlock& tensor) {
    volumes[node] += elements[t].volume;
    for (std::size_t k = 0; k < 6; ++k)
      sums[node][k] += elements[t].volume * tensor[k];
  };
  for (std::size_t t = 0; t < elements.size(); ++t) {
    for (std::size_t a = 0; a < 4; ++a)
      add(mesh.tetrahedra[t][a], t, tensors[t][a]);
    if (mesh.middles.empty())
      continue;
    for (std::size_t k = 0; k < 6; ++k) {
      std::array<double, 4> coordinates{};
      for (const std::size_t end : tetrahedra::tetrahedron_edges[k])
        coordinates[end] = 0.5;
      add(mesh.middles[t][k], t, tensor_at(tensors[t], coordinates));
    }
  }
  for (std::size_t i = 0; i < sums.size(); ++i)
    for (double& value : sums[i])
      value = volumes[i] > 0 ? value / volumes[i] : 0;
  return sums;
}

double von_mises(const linalg::SymmetricBlock& stress) {
  const auto& [xx, xy, xz, yy, yz, zz] = stress;
  const double a = xx - yy, b = yy - zz, c = zz - xx;
  return std::sqrt((a * a + b * b + c * c) / 2 + 3 * (xy * xy + yz * yz + xz * xz));
}

namespace {

std::vector<linalg::SymmetricBlock> in_the_middle(std::span<const CornerTensors> tensors) {
  std::vector<linalg::SymmetricBlock> result;
  result.reserve(tensors.size());
  for (const CornerTensors& of : tensors)
    result.push_back(tensor_at(of, {0.25, 0.25, 0.25, 0.25}));
  return result;
}

} // namespace

SolidFields solid_fields(const tetrahedra::TetMesh& mesh, std::span<const SolidMaterial> materials,
                         std::span<const SolidElement> elements, std::span<const double> u,
                         const Vec3& acceleration, StrainFrames frames) {
  const std::vector<CornerTensors> strains =
      solid_strains(mesh, materials, elements, u, acceleration, frames);
  const std::vector<CornerTensors> stresses = solid_stresses(elements, strains);
  return {in_the_middle(strains), nodal_tensors(mesh, elements, strains), in_the_middle(stresses),
          nodal_tensors(mesh, elements, stresses)};
}

} // namespace gewebe::fem
