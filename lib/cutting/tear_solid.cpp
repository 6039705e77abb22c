#include "cutting/tear_solid.h"

#include "base/error.h"
#include "fem/solid_model.h"
#include "geometry/vector_at.h"

#include <Eigen/Core>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <string>
#include <tuple>
#include <utility>

namespace gewebe::cutting {
namespace {

linalg::SymmetricBlock in_the_middle(const fem::CornerTensors& tensors) {
  return fem::tensor_at(tensors, {0.25, 0.25, 0.25, 0.25});
}

/// The largest principal value and its direction.
std::pair<double, Vec3> largest_principal(const linalg::SymmetricBlock& s) {
  Eigen::Matrix3d m;
  m << s[0], s[1], s[2], s[1], s[3], s[4], s[2], s[4], s[5];
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(m);
  const Eigen::Vector3d along = solver.eigenvectors().col(2);
  return {solver.eigenvalues()[2], {along.x(), along.y(), along.z()}};
}

/// Elements by the cells of a grid in which their middles lie.
class MiddleGrid {
public:
  MiddleGrid(std::span<const Vec3> middles, double cell) : middles_(middles), cell_(cell) {
    for (std::uint32_t t = 0; t < middles.size(); ++t)
      held_.emplace_back(cell_of(middles[t]), t);
    std::ranges::sort(held_);
  }

  /// Calls visit(t) for those within a cell's size of a place, in one order.
  template <class Visit>
  void near(const Vec3& place, Visit&& visit) const {
    const Cell middle = cell_of(place);
    for (int dx = -1; dx <= 1; ++dx)
      for (int dy = -1; dy <= 1; ++dy) {
        const double x = middle[0] + dx, y = middle[1] + dy;
        auto at = std::ranges::lower_bound(held_, std::pair(Cell{x, y, middle[2] - 1}, 0U));
        for (; at != held_.end() && at->first <= Cell{x, y, middle[2] + 1}; ++at)
          if (norm(middles_[at->second] - place) <= cell_)
            visit(at->second);
      }
  }

private:
  using Cell = std::array<double, 3>;
  Cell cell_of(const Vec3& p) const {
    return {std::floor(p.x / cell_), std::floor(p.y / cell_), std::floor(p.z / cell_)};
  }

  std::span<const Vec3> middles_;
  double cell_;
  std::vector<std::pair<Cell, std::uint32_t>> held_;
};

class Finder {
public:
  Finder(const model::Model& model, std::span<const double> u, fem::StrainFrames frames,
         const TearLimit& limit)
      : model_(model), u_(u), frames_(frames), limit_(limit), mesh_(fem::element_mesh(model)) {
    for (const Tetrahedron& t : mesh_.tetrahedra)
      middles_.push_back(
          (mesh_.points[t[0]] + mesh_.points[t[1]] + mesh_.points[t[2]] + mesh_.points[t[3]]) / 4);
  }

  std::optional<SolidTear> find(int attempt) {
    find_shares();
    SolidTear tear;
    std::optional<std::uint32_t> worst;
    for (std::uint32_t t = 0; t < share_.size(); ++t)
      if (share_[t] > 1 && (!worst || share_[t] > share_[*worst]))
        worst = t;
    if (!worst)
      return std::nullopt;
    tear.tetrahedron = *worst;
    tear.share = share_[*worst];
    tear.plane = plane_at(*worst, attempt);
    tear.nodes = nodes_near(tear, attempt);
    return tear;
  }

private:
  void find_shares() {
    const std::vector<fem::SolidMaterial> materials = fem::element_materials(model_);
    const std::vector<fem::SolidElement> elements = fem::solid_elements(mesh_, materials);
    // In the middle of an element bubbles add nothing, so that its weight says nothing there.
    const std::vector<fem::CornerTensors> strains =
        fem::solid_strains(mesh_, materials, elements, u_, {}, frames_);
    const std::vector<fem::CornerTensors> all =
        limit_.stress ? fem::solid_stresses(elements, strains) : std::vector<fem::CornerTensors>{};
    std::vector<linalg::SymmetricBlock> tensors;
    for (const fem::CornerTensors& corners : limit_.stress ? all : strains)
      tensors.push_back(in_the_middle(corners));
    if (limit_.over > 0)
      tensors = means(tensors, elements);
    for (std::uint32_t t = 0; t < tensors.size(); ++t) {
      for (const double value : tensors[t])
        if (!std::isfinite(value))
          throw Error("the stress of element " + std::to_string(t) +
                      " is not finite, expected a smaller load");
      const double most = limit_.of(model_.tetrahedron_material[t]);
      std::tie(share_.emplace_back(), normal_.emplace_back()) = largest_principal(tensors[t]);
      share_.back() = most > 0 ? share_.back() / most : 0;
    }
  }

  std::vector<linalg::SymmetricBlock> means(const std::vector<linalg::SymmetricBlock>& tensors,
                                            std::span<const fem::SolidElement> elements) const {
    const MiddleGrid grid(middles_, limit_.over);
    std::vector<linalg::SymmetricBlock> result(tensors.size());
    for (std::uint32_t t = 0; t < tensors.size(); ++t) {
      double volume = 0;
      grid.near(middles_[t], [&](std::uint32_t other) {
        if (model_.tetrahedron_material[other] != model_.tetrahedron_material[t])
          return;
        volume += elements[other].volume;
        for (std::size_t k = 0; k < 6; ++k)
          result[t][k] += elements[other].volume * tensors[other][k];
      });
      for (double& value : result[t])
        value /= volume;
    }
    return result;
  }

  /// Planes are carried along by the element's gradient: of its corners, which is near enough.
  Vec3 at_rest(std::uint32_t t, const Vec3& normal) const {
    if (frames_ == fem::StrainFrames::resting)
      return normal;
    const Tetrahedron& c = mesh_.tetrahedra[t];
    std::array<Vec3, 3> rest, now;
    for (std::size_t k = 0; k < 3; ++k) {
      rest[k] = mesh_.points[c[k + 1]] - mesh_.points[c[0]];
      now[k] = rest[k] + vector_at(u_, c[k + 1]) - vector_at(u_, c[0]);
    }
    // F rest[k] = now[k]; the normal at rest is F^T n, so that it has dot products n now[k] there.
    const Vec3 result = dot(normal, now[0]) * cross(rest[1], rest[2]) +
                        dot(normal, now[1]) * cross(rest[2], rest[0]) +
                        dot(normal, now[2]) * cross(rest[0], rest[1]);
    return result / norm(result);
  }

  CutPlane plane_at(std::uint32_t t, int attempt) const {
    CutPlane plane{middles_[t], at_rest(t, normal_[t])};
    if (attempt > 1) { // by one side or the other: a wall may have been along the surface
      double height = 0;
      for (const std::uint32_t corner : mesh_.tetrahedra[t])
        height = std::max(height, std::abs(dot(mesh_.points[corner] - middles_[t], plane.normal)));
      plane.point = plane.point + (attempt % 2 == 0 ? height : -height) * plane.normal;
    }
    if (attempt > 0)
      return plane;
    std::vector<std::uint8_t> surface(mesh_.points.size());
    for (const Triangle& triangle : model_.triangles)
      for (const std::uint32_t corner : triangle)
        surface[corner] = 1;
    Vec3 sum;
    int count = 0;
    for (const std::uint32_t corner : mesh_.tetrahedra[t])
      if (surface[corner] != 0) {
        sum += mesh_.points[corner];
        ++count;
      }
    if (count == 0)
      return plane;
    const CutPlane on{sum / count, plane.normal};
    return crosses(t, on) ? on : plane; // else it passes beside the element, or along the surface
  }

  bool crosses(std::uint32_t t, const CutPlane& plane) const {
    constexpr double rounding = 1e-9; // of the element's size
    double above = 0, below = 0;
    for (const std::uint32_t corner : mesh_.tetrahedra[t]) {
      const double height = dot(mesh_.points[corner] - plane.point, plane.normal);
      above = std::max(above, height);
      below = std::max(below, -height);
    }
    const Tetrahedron& c = mesh_.tetrahedra[t];
    const double slight = rounding * norm(mesh_.points[c[1]] - mesh_.points[c[0]]);
    return above > slight && below > slight;
  }

  std::vector<std::uint32_t> nodes_near(const SolidTear& tear, int rings) const {
    std::vector<std::uint32_t> on; // the plane
    for (std::uint32_t t = 0; t < mesh_.tetrahedra.size(); ++t)
      if (crosses(t, tear.plane))
        on.push_back(t);
    std::vector<std::uint8_t> marked(mesh_.points.size());
    const auto mark = [&](std::uint32_t t) {
      for (const std::uint32_t corner : mesh_.tetrahedra[t])
        marked[corner] = 1;
    };
    const auto touched = [&](std::uint32_t t) {
      return std::ranges::any_of(mesh_.tetrahedra[t], [&](std::uint32_t c) { return marked[c]; });
    };
    const auto add_ring = [&] {
      std::vector<std::uint32_t> ring;
      std::ranges::copy_if(on, std::back_inserter(ring), touched);
      std::ranges::for_each(ring, mark);
    };
    mark(tear.tetrahedron);
    add_ring();
    // What bears too much as well, outwards.
    std::vector<std::pair<double, std::uint32_t>> left;
    for (const std::uint32_t t : on)
      if (share_[t] > 1)
        left.emplace_back(norm(middles_[t] - middles_[tear.tetrahedron]), t);
    std::ranges::sort(left);
    for (std::size_t taken = 0; taken < tear_most_elements; ++taken) {
      const auto next =
          std::ranges::find_if(left, [&](const auto& one) { return touched(one.second); });
      if (next == left.end())
        break;
      mark(next->second);
      left.erase(next);
    }
    for (int ring = 0; ring < rings; ++ring)
      add_ring();
    std::vector<std::uint32_t> nodes;
    for (std::uint32_t n = 0; n < marked.size(); ++n)
      if (marked[n] != 0)
        nodes.push_back(n);
    return nodes;
  }

  const model::Model& model_;
  std::span<const double> u_;
  fem::StrainFrames frames_;
  const TearLimit& limit_;
  tetrahedra::TetMesh mesh_;
  std::vector<Vec3> middles_, normal_; // of elements; normals in frames_
  std::vector<double> share_;          // of their limits
};

} // namespace

bool TearLimit::any() const {
  return std::ranges::any_of(most, [](double one) { return one > 0; });
}

double TearLimit::of(std::int32_t material) const {
  return most.size() == 1 ? most[0] : most[static_cast<std::size_t>(material)];
}

std::optional<SolidTear> find_tear(const model::Model& model, std::span<const double> u,
                                   fem::StrainFrames frames, const TearLimit& limit, int attempt) {
  return Finder(model, u, frames, limit).find(attempt);
}

} // namespace gewebe::cutting
