#include "solid/rotation_strain.h"

#include "base/error.h"
#include "solid/assembly_internal.h"
#include "tetrahedra/boundary.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace gewebe {

namespace {

using Matrix = std::array<double, 9>;

Matrix product(const Matrix& a, const Matrix& b) {
  Matrix c;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      c[3 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
  return c;
}

/// aᵀ b
Matrix transposed_product(const Matrix& a, const Matrix& b) {
  Matrix c;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      c[3 * i + j] = a[i] * b[j] + a[3 + i] * b[3 + j] + a[6 + i] * b[6 + j];
  return c;
}

Vec3 product(const Matrix& a, const Vec3& v) {
  return {a[0] * v.x + a[1] * v.y + a[2] * v.z, a[3] * v.x + a[4] * v.y + a[5] * v.z,
          a[6] * v.x + a[7] * v.y + a[8] * v.z};
}

Matrix symmetric_part(const Matrix& m) {
  const double xy = (m[1] + m[3]) / 2, xz = (m[2] + m[6]) / 2, yz = (m[5] + m[7]) / 2;
  return {m[0], xy, xz, xy, m[4], yz, xz, yz, m[8]};
}

/// a + factor vᵀ w
void add_outer(Matrix& a, const Vec3& v, const Vec3& w, double factor) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      a[static_cast<std::size_t>(3 * i + j)] += factor * v[i] * w[j];
}

/// What belongs to w in a sum over the entries of m and of v -> w × v.
Vec3 twice_axial(const Matrix& m) {
  return {m[7] - m[5], m[2] - m[6], m[3] - m[1]};
}

/// (1 - cos a) / a² and (a - sin a) / a³ of the angle a, as power series of its square.
struct Angle {
  double second, third;
};
Angle terms(double square) {
  Angle t{0, 0};
  for (int k = 11; k >= 0; --k) {
    const double even = (2 * k + 1) * (2 * k + 2), odd = (2 * k + 2) * (2 * k + 3);
    t.second = (1 - square * t.second) / even;
    t.third = (1 - square * t.third) / odd;
  }
  return t;
}

} // namespace

/// What a triangle's displacements stand for.
struct RotationStrain::Gradient {
  Vec3 w;
  Angle angle{};
  Matrix strain{};

  /// R(w)
  Matrix rotation() const {
    const double s = dot(w, w), first = 1 - s * angle.third, diagonal = 1 - s * angle.second;
    Matrix r{diagonal,     -first * w.z, first * w.y, first * w.z, diagonal,
             -first * w.x, -first * w.y, first * w.x, diagonal};
    add_outer(r, w, w, angle.second);
    return r;
  }
  /// I + E + E² / 2
  Matrix stretch() const {
    Matrix m = product(strain, strain);
    for (std::size_t k = 0; k < 9; ++k)
      m[k] = strain[k] + m[k] / 2 + (k % 4 == 0 ? 1 : 0);
    return m;
  }
};

namespace {

Vec3 at(std::span<const double> v, std::uint32_t node) {
  const std::size_t k = 3 * std::size_t{node};
  return {v[k], v[k + 1], v[k + 2]};
}

/// Of values at a triangle's nodes, along it.
template <class Triangle>
Matrix along(const Triangle& t, std::span<const double> values) {
  const Vec3 first = at(values, t.node[0]);
  Matrix m{};
  add_outer(m, at(values, t.node[1]) - first, t.gradient[0], 1);
  add_outer(m, at(values, t.node[2]) - first, t.gradient[1], 1);
  return m;
}

/// Adds area m ∇N of each node.
template <class Triangle>
void add_divergence(const Triangle& t, const Matrix& m, std::span<double> sum) {
  const std::array<Vec3, 2> parts{product(m, t.gradient[0]) * t.area,
                                  product(m, t.gradient[1]) * t.area};
  for (int axis = 0; axis < 3; ++axis) {
    const auto k = static_cast<std::size_t>(axis);
    sum[3 * std::size_t{t.node[0]} + k] -= parts[0][axis] + parts[1][axis];
    sum[3 * std::size_t{t.node[1]} + k] += parts[0][axis];
    sum[3 * std::size_t{t.node[2]} + k] += parts[1][axis];
  }
}

} // namespace

RotationStrain::Gradient RotationStrain::gradient(const Triangle& t,
                                                  std::span<const double> local) {
  Matrix h = along(t, local);
  // Its normal turns with the surface.
  const Vec3 tilt{t.normal.x * h[0] + t.normal.y * h[3] + t.normal.z * h[6],
                  t.normal.x * h[1] + t.normal.y * h[4] + t.normal.z * h[7],
                  t.normal.x * h[2] + t.normal.y * h[5] + t.normal.z * h[8]};
  add_outer(h, tilt, t.normal, -1);
  Gradient g;
  g.w = twice_axial(h) / 2;
  g.angle = terms(dot(g.w, g.w));
  g.strain = symmetric_part(h);
  return g;
}

void RotationStrain::list_triangles(const TetMesh& mesh) {
  const TetBoundary faces = boundary(mesh);
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    Triangle t;
    t.node = {a, b, c};
    const Vec3 u = mesh.points[b] - mesh.points[a], v = mesh.points[c] - mesh.points[a],
               n = cross(u, v);
    t.area = norm(n) / 2;
    t.normal = n / norm(n);
    t.gradient = {cross(v, n) / dot(n, n), cross(n, u) / dot(n, n)};
    triangles_.push_back(t);
  };
  for (std::size_t k = 0; k < faces.mesh.triangles.size(); ++k) {
    const auto [i, j, l] = faces.mesh.triangles[k];
    const std::uint32_t a = faces.node[i], b = faces.node[j], c = faces.node[l];
    if (mesh.middles.empty()) {
      add(a, b, c);
    } else {
      const auto [ab, bc, ca] = faces.middles[k];
      add(a, ab, ca);
      add(ab, b, bc);
      add(ca, bc, c);
      add(ab, bc, ca);
    }
  }
  place_.assign(mesh.points.size(), none);
  for (const Triangle& t : triangles_)
    for (const std::uint32_t i : t.node)
      place_[i] = 0;
  for (std::uint32_t i = 0; i < place_.size(); ++i)
    if (place_[i] != none) {
      place_[i] = static_cast<std::uint32_t>(nodes_.size());
      nodes_.push_back(i);
    }
  for (Triangle& t : triangles_)
    for (std::uint32_t& i : t.node)
      i = place_[i];

  start_.resize(nodes_.size() + 1);
  for (const Triangle& t : triangles_)
    for (const std::uint32_t i : t.node)
      ++start_[std::size_t{i} + 1];
  for (std::size_t i = 0; i < nodes_.size(); ++i)
    start_[i + 1] += start_[i];
  at_.resize(start_.back());
  std::vector<std::size_t> fill(start_.begin(), start_.end() - 1);
  for (std::uint32_t t = 0; t < triangles_.size(); ++t)
    for (const std::uint32_t i : triangles_[t].node)
      at_[fill[i]++] = t;
}

void RotationStrain::factor_surface(std::span<const std::uint8_t> fixed, const Context& context) {
  const auto held = [&](std::size_t i, std::size_t axis) {
    return !fixed.empty() && fixed[3 * std::size_t{nodes_[i]} + axis] != 0;
  };
  bool alike = true;
  for (std::size_t i = 0; i < nodes_.size(); ++i)
    alike = alike && held(i, 0) == held(i, 1) && held(i, 0) == held(i, 2);
  for (std::size_t axis = 0; axis < (alike ? 1 : 3); ++axis) {
    // Each part of the surface must stand somewhere.
    std::vector<std::uint8_t> reached(nodes_.size());
    std::vector<std::uint32_t> stack;
    const auto reach = [&](std::uint32_t i) {
      if (reached[i] == 0) {
        reached[i] = 1;
        stack.push_back(i);
      }
    };
    for (std::uint32_t i = 0; i < nodes_.size(); ++i)
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
      throw Error("a part of a solid's surface has no fixed node, expected one to build its shape "
                  "from");

    Laplacian laplacian;
    laplacian.row.assign(nodes_.size(), -1);
    StiffnessMatrix matrix; // scalar: the first axis of each node
    matrix.row_of_axis.assign(3 * nodes_.size(), -1);
    for (std::size_t i = 0; i < nodes_.size(); ++i)
      if (!held(i, axis)) {
        laplacian.row[i] = static_cast<std::int64_t>(matrix.axis_of_row.size());
        matrix.row_of_axis[3 * i] = laplacian.row[i];
        matrix.axis_of_row.push_back(static_cast<std::int64_t>(3 * i));
      }
    laplacian.order = matrix.order();
    matrix.column_start.push_back(0);
    std::vector<std::pair<std::int64_t, double>> column;
    for (const std::int64_t of_row : matrix.axis_of_row) {
      const auto i = static_cast<std::uint32_t>(of_row / 3);
      column.clear();
      for (std::size_t k = start_[i]; k < start_[std::size_t{i} + 1]; ++k) {
        const Triangle& t = triangles_[at_[k]];
        const std::array<Vec3, 3> g{-(t.gradient[0] + t.gradient[1]), t.gradient[0], t.gradient[1]};
        const auto own = static_cast<std::size_t>(std::ranges::find(t.node, i) - t.node.begin());
        for (std::size_t b = 0; b < 3; ++b)
          if (laplacian.row[t.node[b]] >= laplacian.row[i])
            column.emplace_back(laplacian.row[t.node[b]], t.area * dot(g[own], g[b]));
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
    if (laplacian.order > 0)
      laplacian.factor.emplace(matrix, context);
    axes_.push_back(std::move(laplacian));
  }
}

RotationStrain::RotationStrain(const TetMesh& mesh, std::span<const SolidElement> elements,
                               std::span<const std::uint8_t> fixed, const Context& context) {
  list_triangles(mesh);
  factor_surface(fixed, context);

  // The scalar Laplacian of the volume on the first axis of each node.
  const std::size_t n = mesh.points.size();
  std::vector<std::uint8_t> first_axis(3 * n, 1);
  std::vector<std::uint8_t> used(n);
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t)
    for (std::size_t a = 0; a < solid_nodes(mesh); ++a)
      used[solid_node(mesh, t, a)] = 1;
  bool any_inside = false;
  for (std::size_t i = 0; i < n; ++i) {
    first_axis[3 * i] = used[i] == 0 || place_[i] != none;
    any_inside = any_inside || first_axis[3 * i] == 0;
  }
  if (!any_inside)
    return;
  const BlockOf laplacian = [&](std::size_t t, std::size_t a, std::size_t b) {
    SolidElement e = elements[t];
    e.material = {0, 1}; // of whose block the trace is four times ∫ ∇Na·∇Nb
    const SolidBlock block =
        mesh.middles.empty() ? linear_block(e, a, b) : plain_quadratic_block(e, a, b);
    return SolidBlock{(block[0] + block[4] + block[8]) / 4};
  };
  const StiffnessMatrix inside = assembled_matrix(mesh, laplacian, first_axis, context);
  inside_.emplace(inside, context);
  inner_row_.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    inner_row_[i] = inside.row_of_axis[3 * i];
    first_axis[3 * i] = 0;
  }
  between_ = assembled_matrix(mesh, laplacian, first_axis, context);
}

void RotationStrain::solve(std::span<const double> f, std::span<double> y) const {
  std::ranges::fill(y, 0.0);
  std::vector<double> right, found;
  for (std::size_t k = 0; k < axes_.size(); ++k) {
    const Laplacian& l = axes_[k];
    if (l.order == 0)
      continue;
    const std::size_t first = k, count = axes_.size() == 1 ? 3 : 1;
    right.resize(count * l.order);
    found.resize(right.size());
    for (std::size_t i = 0; i < nodes_.size(); ++i)
      for (std::size_t c = 0; l.row[i] >= 0 && c < count; ++c)
        right[c * l.order + static_cast<std::size_t>(l.row[i])] = f[3 * i + first + c];
    l.factor->solve(right, found, count);
    for (std::size_t i = 0; i < nodes_.size(); ++i)
      for (std::size_t c = 0; l.row[i] >= 0 && c < count; ++c)
        y[3 * i + first + c] = found[c * l.order + static_cast<std::size_t>(l.row[i])];
  }
}

void RotationStrain::deform(std::span<const double> local, std::span<double> u) const {
  std::vector<double> divergence(u.size());
  for (const Triangle& t : triangles_) {
    const Gradient g = gradient(t, local);
    Matrix wanted = product(g.rotation(), g.stretch());
    for (std::size_t k = 0; k < 9; k += 4)
      wanted[k] -= 1;
    add_divergence(t, wanted, divergence);
  }
  solve(divergence, u);
}

void RotationStrain::spread(std::span<const double> f, std::span<double> y) const {
  solve(f, y);
}

void RotationStrain::take_back(std::span<const double> local, std::span<const double> y,
                               std::span<double> forces) const {
  std::ranges::fill(forces, 0.0);
  for (const Triangle& t : triangles_) {
    const Gradient g = gradient(t, local);
    // Of F = R S, dF = R [v] S + R dS with v = dw - second w × dw + third w × (w × dw).
    const Matrix back = transposed_product(g.rotation(), along(t, y)), stretch = g.stretch();
    const Vec3 moment = twice_axial(product(back, stretch)), turned = cross(g.w, moment),
               of_w = moment + turned * g.angle.second + cross(g.w, turned) * g.angle.third;
    const Matrix even = symmetric_part(back), product_of = product(even, g.strain);
    Matrix m;
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j)
        m[3 * i + j] = even[3 * i + j] + (product_of[3 * i + j] + product_of[3 * j + i]) / 2;
    m[1] -= of_w.z / 2;
    m[2] += of_w.y / 2;
    m[3] += of_w.z / 2;
    m[5] -= of_w.x / 2;
    m[6] -= of_w.y / 2;
    m[7] += of_w.x / 2;
    add_outer(m, t.normal, product(m, t.normal), -1); // the normal turns with the surface
    add_divergence(t, m, forces);
  }
}

std::array<double, 9> RotationStrain::rotation(std::span<const double> local,
                                               std::uint32_t node) const {
  Gradient mean;
  double area = 0;
  for (std::size_t k = start_[node]; k < start_[std::size_t{node} + 1]; ++k) {
    const Triangle& t = triangles_[at_[k]];
    mean.w += gradient(t, local).w * t.area;
    area += t.area;
  }
  mean.w = mean.w / area;
  mean.angle = terms(dot(mean.w, mean.w));
  return mean.rotation();
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
  for (std::size_t i = 0; i < inner_row_.size(); ++i) // columns of the whole Laplacian
    for (auto e = static_cast<std::size_t>(between_.column_start[i]);
         e < static_cast<std::size_t>(between_.column_start[i + 1]); ++e) {
      const auto j = static_cast<std::size_t>(between_.row[e]);
      const bool i_inside = inner_row_[i] >= 0, j_inside = inner_row_[j] >= 0;
      if (i_inside == j_inside)
        continue;
      const std::size_t inner = i_inside ? i : j, outer = i_inside ? j : i;
      for (std::size_t axis = 0; place_[outer] != none && axis < 3; ++axis)
        result[3 * std::size_t{place_[outer]} + axis] -=
            between_.value[e] *
            followed[axis * order + static_cast<std::size_t>(inner_row_[inner])];
    }
  return result;
}

} // namespace gewebe
