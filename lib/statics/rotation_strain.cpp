#include "statics/rotation_strain.h"

#include "base/error.h"
#include "fem/assembly_blocks.h"
#include "statics/warp_kernel_internal.h"
#include "tetrahedra/boundary.h"

#include <algorithm>
#include <utility>

namespace gewebe::statics {

namespace {

constexpr double smoothing_lengths = 1; ///< volume over surface

Vec3 at(std::span<const double> v, std::uint32_t node) {
  const std::size_t k = 3 * std::size_t{node};
  return {v[k], v[k + 1], v[k + 2]};
}

/// Entries of the whole Laplacian between nodes inside, which have rows, and others.
template <class Visit>
void visit_between(const linalg::StiffnessMatrix& laplacian,
                   std::span<const std::int64_t> inner_row, const Visit& visit) {
  for (std::size_t i = 0; i < inner_row.size(); ++i)
    for (auto e = static_cast<std::size_t>(laplacian.column_start[i]);
         e < static_cast<std::size_t>(laplacian.column_start[i + 1]); ++e) {
      const auto j = static_cast<std::size_t>(laplacian.row[e]);
      if ((inner_row[i] >= 0) == (inner_row[j] >= 0))
        continue;
      visit(inner_row[i] >= 0 ? i : j, inner_row[i] >= 0 ? j : i, laplacian.value[e]);
    }
}

} // namespace

void RotationStrain::list_triangles(const tetrahedra::TetMesh& mesh,
                                    std::span<const std::uint8_t> fixed) {
  const tetrahedra::TetBoundary faces = tetrahedra::boundary(mesh);
  place_.assign(mesh.points.size(), none);
  std::vector<std::uint32_t> middles;
  for (const std::uint32_t i : faces.node)
    nodes_.push_back(i);
  for (const auto& of_triangle : faces.middles)
    middles.insert(middles.end(), of_triangle.begin(), of_triangle.end());
  std::ranges::sort(nodes_);
  std::ranges::sort(middles);
  middles.erase(std::ranges::unique(middles).begin(), middles.end());
  corners_ = nodes_.size();
  nodes_.insert(nodes_.end(), middles.begin(), middles.end());
  for (std::uint32_t s = 0; s < nodes_.size(); ++s)
    place_[nodes_[s]] = s;

  middles_.resize(middles.size());
  std::vector<std::uint8_t> seen(middles.size());
  for (std::uint32_t k = 0; k < faces.mesh.triangles.size(); ++k) {
    Triangle t;
    for (std::size_t c = 0; c < 3; ++c)
      t.node[c] = place_[faces.node[faces.mesh.triangles[k][c]]];
    const Vec3& origin = mesh.points[nodes_[t.node[0]]];
    const Vec3 u = mesh.points[nodes_[t.node[1]]] - origin,
               v = mesh.points[nodes_[t.node[2]]] - origin, n = cross(u, v);
    t.area = norm(n) / 2;
    t.normal = n / norm(n);
    t.gradient = {cross(v, n) / dot(n, n), cross(n, u) / dot(n, n)};
    triangles_.push_back(t);
    for (std::size_t c = 0; !faces.middles.empty() && c < 3; ++c) {
      const std::uint32_t s = place_[faces.middles[k][c]];
      Middle& m = middles_[s - corners_];
      if (seen[s - corners_] == 0)
        m = {s, t.node[c], t.node[(c + 1) % 3], {k, k}};
      m.triangle[1] = k;
      seen[s - corners_] = 1;
    }
  }
  middle_groups_.assign((middles_.size() + 3) / 4, {});
  for (std::size_t n = 0; n < 4 * middle_groups_.size(); ++n) {
    // The last one fills the group up.
    const Middle& m = middles_[std::min(n, middles_.size() - 1)];
    MiddleGroup& group = middle_groups_[n / 4];
    group.node[n % 4] = m.node;
    group.a[n % 4] = m.a;
    group.b[n % 4] = m.b;
    for (std::size_t k = 0; k < 2; ++k)
      group.triangle[k][n % 4] = m.triangle[k];
    for (std::size_t axis = 0; axis < 3; ++axis)
      group.free[axis][n % 4] =
          fixed.empty() || fixed[3 * std::size_t{nodes_[m.node]} + axis] == 0 ? 1 : 0;
  }

  groups_.assign((triangles_.size() + 3) / 4, {});
  for (std::size_t n = 0; n < triangles_.size(); ++n) {
    TriangleGroup& group = groups_[n / 4];
    for (std::size_t k = 0; k < 3; ++k) {
      const int axis = static_cast<int>(k);
      group.node[k][n % 4] = triangles_[n].node[k];
      group.gradient[0][k][n % 4] = triangles_[n].gradient[0][axis];
      group.gradient[1][k][n % 4] = triangles_[n].gradient[1][axis];
      group.normal[k][n % 4] = triangles_[n].normal[axis];
    }
    group.area[n % 4] = triangles_[n].area;
  }

  start_.resize(corners_ + 1);
  for (const Triangle& t : triangles_)
    for (const std::uint32_t i : t.node)
      ++start_[std::size_t{i} + 1];
  for (std::size_t i = 0; i < corners_; ++i)
    start_[i + 1] += start_[i];
  at_.resize(start_.back());
  std::vector<std::size_t> fill(start_.begin(), start_.end() - 1);
  for (std::uint32_t t = 0; t < triangles_.size(); ++t)
    for (const std::uint32_t i : triangles_[t].node)
      at_[fill[i]++] = t;
}

/// `stiffness` times the surface's Laplacian and `mass` times its areas, on the first axes that
/// have rows.
void RotationStrain::fill_surface_matrix(linalg::StiffnessMatrix& matrix, double stiffness,
                                         double mass) const {
  matrix.column_start.push_back(0);
  std::vector<std::pair<std::int64_t, double>> column;
  for (const std::int64_t of_row : matrix.axis_of_row) {
    const auto i = static_cast<std::uint32_t>(of_row / 3);
    const std::int64_t row_of_i = matrix.row_of_axis[3 * std::size_t{i}];
    column.clear();
    for (std::size_t k = start_[i]; k < start_[std::size_t{i} + 1]; ++k) {
      const Triangle& t = triangles_[at_[k]];
      const std::array<Vec3, 3> g{-(t.gradient[0] + t.gradient[1]), t.gradient[0], t.gradient[1]};
      const auto own = static_cast<std::size_t>(std::ranges::find(t.node, i) - t.node.begin());
      for (std::size_t b = 0; b < 3; ++b)
        if (const std::int64_t row = matrix.row_of_axis[3 * std::size_t{t.node[b]}];
            row >= row_of_i)
          column.emplace_back(row,
                              t.area * (stiffness * dot(g[own], g[b]) + (b == own ? mass / 3 : 0)));
    }
    std::ranges::stable_sort(column, {}, [](const auto& entry) { return entry.first; });
    for (const auto& [row, value] : column) {
      const auto begin = static_cast<std::size_t>(matrix.column_start.back());
      if (matrix.row.size() > begin && matrix.row.back() == row) {
        matrix.value.back() += value;
      } else {
        matrix.row.push_back(row);
        matrix.value.push_back(value);
      }
    }
    matrix.column_start.push_back(static_cast<std::int64_t>(matrix.row.size()));
  }
}

/// Rotations of shorter waves than the body is thick are no rotations of the body.
void RotationStrain::factor_smoothing(std::span<const fem::SolidElement> elements,
                                      const Context& context) {
  double volume = 0, area = 0;
  for (const fem::SolidElement& e : elements)
    volume += e.volume;
  for (const Triangle& t : triangles_)
    area += t.area;
  const double length = smoothing_lengths * volume / area;
  linalg::StiffnessMatrix matrix; // scalar: the first axis of each node
  matrix.row_of_axis.assign(3 * corners_, -1);
  for (std::size_t i = 0; i < corners_; ++i) {
    matrix.row_of_axis[3 * i] = static_cast<std::int64_t>(i);
    matrix.axis_of_row.push_back(static_cast<std::int64_t>(3 * i));
  }
  fill_surface_matrix(matrix, length * length, 1);
  smoothing_.emplace(matrix, context);
}

void RotationStrain::factor_surface(std::span<const std::uint8_t> fixed, const Context& context) {
  const auto held = [&](std::size_t i, std::size_t axis) {
    return !fixed.empty() && fixed[3 * std::size_t{nodes_[i]} + axis] != 0;
  };
  bool alike = true;
  for (std::size_t i = 0; i < corners_; ++i)
    alike = alike && held(i, 0) == held(i, 1) && held(i, 0) == held(i, 2);
  for (std::size_t axis = 0; axis < (alike ? 1 : 3); ++axis) {
    // Each part of the surface must stand somewhere.
    std::vector<std::uint8_t> reached(corners_);
    std::vector<std::uint32_t> stack;
    const auto reach = [&](std::uint32_t i) {
      if (reached[i] == 0) {
        reached[i] = 1;
        stack.push_back(i);
      }
    };
    for (std::uint32_t i = 0; i < corners_; ++i)
      if (held(i, axis))
        reach(i);
    while (!stack.empty()) {
      const std::uint32_t i = stack.back();
      stack.pop_back();
      for (std::size_t k = start_[i]; k < start_[std::size_t{i} + 1]; ++k)
        for (const std::uint32_t j : triangles_[at_[k]].node)
          reach(j);
    }
    if (!std::ranges::all_of(reached, [](std::uint8_t r) { return r != 0; }))
      throw Error("a part of a solid's surface has no fixed corner, expected one to build its "
                  "shape from");

    Laplacian laplacian;
    laplacian.row.assign(corners_, -1);
    linalg::StiffnessMatrix matrix; // scalar: the first axis of each node
    matrix.row_of_axis.assign(3 * corners_, -1);
    for (std::size_t i = 0; i < corners_; ++i)
      if (!held(i, axis)) {
        laplacian.row[i] = static_cast<std::int64_t>(matrix.axis_of_row.size());
        matrix.row_of_axis[3 * i] = laplacian.row[i];
        matrix.axis_of_row.push_back(static_cast<std::int64_t>(3 * i));
      }
    laplacian.order = matrix.order();
    fill_surface_matrix(matrix, 1, 0);
    if (laplacian.order > 0)
      laplacian.factor.emplace(matrix, context);
    axes_.push_back(std::move(laplacian));
  }
}

RotationStrain::RotationStrain(const tetrahedra::TetMesh& mesh,
                               std::span<const fem::SolidElement> elements,
                               std::span<const std::uint8_t> fixed, const Context& context)
    : cpu_(context.cpu) {
  list_triangles(mesh, fixed);
  factor_surface(fixed, context);
  factor_smoothing(elements, context);

  // The scalar Laplacian of the volume on the first axis of each node.
  const std::size_t n = mesh.points.size();
  std::vector<std::uint8_t> first_axis(3 * n, 1);
  std::vector<std::uint8_t> used(n);
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t)
    for (std::size_t a = 0; a < fem::solid_nodes(mesh); ++a)
      used[fem::solid_node(mesh, t, a)] = 1;
  bool any_inside = false;
  for (std::size_t i = 0; i < n; ++i) {
    first_axis[3 * i] = used[i] == 0 || place_[i] != none;
    any_inside = any_inside || first_axis[3 * i] == 0;
  }
  if (!any_inside)
    return;
  const fem::BlockOf laplacian = [&](std::size_t t, std::size_t a, std::size_t b) {
    fem::SolidElement e = elements[t];
    e.material = {0, 1}; // of whose block the trace is four times ∫ ∇Na·∇Nb
    const fem::SolidBlock block =
        mesh.middles.empty() ? fem::linear_block(e, a, b) : fem::plain_quadratic_block(e, a, b);
    return fem::SolidBlock{(block[0] + block[4] + block[8]) / 4};
  };
  const linalg::StiffnessMatrix inside =
      fem::assembled_matrix(mesh, laplacian, first_axis, context);
  inside_.emplace(inside, context);
  inner_row_.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    inner_row_[i] = inside.row_of_axis[3 * i];
    first_axis[3 * i] = 0;
  }
  between_ = fem::assembled_matrix(mesh, laplacian, first_axis, context);
}

RotationStrain::~RotationStrain() = default;
RotationStrain::RotationStrain(RotationStrain&&) noexcept = default;
RotationStrain& RotationStrain::operator=(RotationStrain&&) noexcept = default;

void RotationStrain::solve(std::span<const double> f, std::span<double> y) const {
  std::vector<double> right, found;
  for (std::size_t k = 0; k < axes_.size(); ++k) {
    const Laplacian& l = axes_[k];
    const std::size_t first = k, count = axes_.size() == 1 ? 3 : 1;
    right.resize(count * l.order);
    found.resize(right.size());
    for (std::size_t i = 0; i < corners_; ++i)
      for (std::size_t c = 0; l.row[i] >= 0 && c < count; ++c)
        right[c * l.order + static_cast<std::size_t>(l.row[i])] = f[3 * i + first + c];
    if (l.factor)
      l.factor->solve(right, found, count);
    for (std::size_t i = 0; i < corners_; ++i)
      for (std::size_t c = 0; c < count; ++c)
        y[3 * i + first + c] =
            l.row[i] >= 0 ? found[c * l.order + static_cast<std::size_t>(l.row[i])] : 0;
  }
}

std::vector<double> RotationStrain::smoothed(std::span<const double> of_triangles) const {
  std::vector<double> right(3 * corners_), found(right.size()), result(12 * groups_.size());
  for (std::size_t t = 0; t < triangles_.size(); ++t)
    for (const std::uint32_t i : triangles_[t].node)
      for (std::size_t axis = 0; axis < 3; ++axis)
        right[axis * corners_ + i] += triangles_[t].area / 3 * of_triangles[3 * t + axis];
  smoothing_->solve(right, found, 3);
  for (std::size_t t = 0; t < triangles_.size(); ++t)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      double sum = 0;
      for (const std::uint32_t i : triangles_[t].node)
        sum += found[axis * corners_ + i];
      result[3 * t + axis] = sum / 3;
    }
  return result;
}

std::vector<double> RotationStrain::turning(std::span<const double> local) const {
  std::vector<double> w(12 * groups_.size());
  warp_kernel(cpu_).find_rotations(groups_.data(), groups_.size(), local.data(), w.data());
  return smoothed(w);
}

void RotationStrain::deform(std::span<const double> local, std::span<const double> turning,
                            std::span<double> u) const {
  const WarpKernel& kernel = warp_kernel(cpu_);
  std::vector<double> divergence(3 * corners_);
  kernel.ask(groups_.data(), groups_.size(), local.data(), turning.data(), divergence.data());
  solve(divergence, u);
  kernel.turn_middles(middle_groups_.data(), middle_groups_.size(), turning.data(), local.data(),
                      u.data());
}

void RotationStrain::spread(std::span<const double> f, std::span<double> y) const {
  std::vector<double> on_corners(f.begin(), f.begin() + static_cast<std::ptrdiff_t>(3 * corners_));
  for (const Middle& m : middles_)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double half = f[3 * std::size_t{m.node} + axis] / 2;
      on_corners[3 * std::size_t{m.a} + axis] += half;
      on_corners[3 * std::size_t{m.b} + axis] += half;
      y[3 * std::size_t{m.node} + axis] = 2 * half;
    }
  solve(on_corners, y);
}

void RotationStrain::take_back(std::span<const double> local, std::span<const double> turning,
                               std::span<const double> y, std::span<double> forces) const {
  const WarpKernel& kernel = warp_kernel(cpu_);
  std::ranges::fill(forces, 0.0);
  std::vector<double> moments(12 * groups_.size());
  kernel.find_moments(groups_.data(), groups_.size(), local.data(), turning.data(), y.data(),
                      moments.data());
  kernel.take_back(groups_.data(), groups_.size(), local.data(), turning.data(), y.data(),
                   smoothed(moments).data(), forces.data());
  for (const Middle& m : middles_) {
    const Vec3 f = at(y, m.node);
    if (f == Vec3{})
      continue;
    const std::array<double, 9> r = rotation(turning, m.node);
    for (std::size_t i = 0; i < 3; ++i) {
      const double turned = r[i] * f.x + r[3 + i] * f.y + r[6 + i] * f.z;
      forces[3 * std::size_t{m.node} + i] = turned;
      forces[3 * std::size_t{m.a} + i] -= turned / 2;
      forces[3 * std::size_t{m.b} + i] -= turned / 2;
    }
  }
}

std::array<double, 9> RotationStrain::rotation(std::span<const double> turning,
                                               std::uint32_t node) const {
  Vec3 w;
  if (node < corners_) {
    double area = 0;
    for (std::size_t k = start_[node]; k < start_[std::size_t{node} + 1]; ++k) {
      const Triangle& t = triangles_[at_[k]];
      w += t.area * at(turning, at_[k]);
      area += t.area;
    }
    w = w / area;
  } else {
    for (const std::uint32_t t : middles_[node - corners_].triangle)
      w += at(turning, t) / 2;
  }
  // By the quaternion of an eighth of the angle, doubled three times.
  const Vec3 eighth = w / 16;
  const double s = dot(eighth, eighth);
  double real = 1 - s / 2 * (1 - s / 12 * (1 - s / 30 * (1 - s / 56)));
  Vec3 v = eighth * (1 - s / 6 * (1 - s / 20 * (1 - s / 42 * (1 - s / 72))));
  for (int k = 0; k < 3; ++k) {
    v = v * (2 * real);
    real = 2 * real * real - 1;
  }
  return {1 - 2 * (v.y * v.y + v.z * v.z), 2 * (v.x * v.y - real * v.z),
          2 * (v.x * v.z + real * v.y),    2 * (v.x * v.y + real * v.z),
          1 - 2 * (v.x * v.x + v.z * v.z), 2 * (v.y * v.z - real * v.x),
          2 * (v.x * v.z - real * v.y),    2 * (v.y * v.z + real * v.x),
          1 - 2 * (v.x * v.x + v.y * v.y)};
}

std::vector<double> RotationStrain::on_surface(std::span<const double> load) const {
  std::vector<double> result(3 * nodes_.size());
  for (std::size_t k = 0; k < result.size(); ++k)
    result[k] = load[3 * std::size_t{nodes_[k / 3]} + k % 3];
  if (!inside_)
    return result;
  const std::size_t order = inside_->order();
  std::vector<double> right(3 * order), followed(right.size());
  bool any = false;
  for (std::size_t i = 0; i < inner_row_.size(); ++i)
    for (std::size_t axis = 0; inner_row_[i] >= 0 && axis < 3; ++axis) {
      right[axis * order + static_cast<std::size_t>(inner_row_[i])] = load[3 * i + axis];
      any = any || load[3 * i + axis] != 0;
    }
  if (!any)
    return result;
  inside_->solve(right, followed, 3);
  visit_between(between_, inner_row_, [&](std::size_t inner, std::size_t outer, double value) {
    for (std::size_t axis = 0; place_[outer] != none && axis < 3; ++axis)
      result[3 * std::size_t{place_[outer]} + axis] -=
          value * followed[axis * order + static_cast<std::size_t>(inner_row_[inner])];
  });
  return result;
}

std::vector<double> RotationStrain::extend(std::span<const double> surface) const {
  std::vector<double> all(3 * place_.size());
  for (std::size_t k = 0; k < surface.size(); ++k)
    all[3 * std::size_t{nodes_[k / 3]} + k % 3] = surface[k];
  if (!inside_)
    return all;
  const std::size_t order = inside_->order();
  std::vector<double> right(3 * order), found(right.size());
  visit_between(between_, inner_row_, [&](std::size_t inner, std::size_t outer, double value) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      right[axis * order + static_cast<std::size_t>(inner_row_[inner])] -=
          value * all[3 * outer + axis];
  });
  inside_->solve(right, found, 3);
  for (std::size_t i = 0; i < inner_row_.size(); ++i)
    for (std::size_t axis = 0; inner_row_[i] >= 0 && axis < 3; ++axis)
      all[3 * i + axis] = found[axis * order + static_cast<std::size_t>(inner_row_[i])];
  return all;
}

} // namespace gewebe::statics
