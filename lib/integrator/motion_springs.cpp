#include "integrator/motion_springs_internal.h"

#include "fem/assembly.h"
#include "geometry/vector_at.h"
#include "integrator/motion_kernel_internal.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>

namespace gewebe::integrator {

namespace {

/// Between the ends of spring k, [3 i + j].
using BlockOfSpring = std::function<std::array<double, 9>(std::size_t k)>;

struct Entry {
  std::int64_t column, row;
  double value;
};

/// The matrix of springs on the free axes of another one, added to that.
linalg::StiffnessMatrix with_blocks(const linalg::StiffnessMatrix& of_elements,
                                    std::span<const SolidSpring> springs,
                                    const BlockOfSpring& block_of) {
  std::vector<Entry> entries;
  for (std::size_t k = 0; k < springs.size(); ++k) {
    const std::array<double, 9> block = block_of(k);
    for (const auto& [of_row, of_column] :
         {std::array{springs[k].i, springs[k].i}, std::array{springs[k].j, springs[k].j},
          std::array{springs[k].i, springs[k].j}, std::array{springs[k].j, springs[k].i}})
      for (std::size_t a = 0; a < 3; ++a)
        for (std::size_t b = 0; b < 3; ++b) {
          const std::int64_t row = of_elements.row_of_axis[3 * std::size_t{of_row} + a],
                             column = of_elements.row_of_axis[3 * std::size_t{of_column} + b];
          if (column >= 0 && row >= column)
            entries.push_back(
                {column, row, of_row == of_column ? block[3 * a + b] : -block[3 * a + b]});
        }
  }
  std::ranges::stable_sort(entries, [](const Entry& a, const Entry& b) {
    return a.column < b.column || (a.column == b.column && a.row < b.row);
  });
  linalg::StiffnessMatrix matrix;
  matrix.row_of_axis = of_elements.row_of_axis;
  matrix.axis_of_row = of_elements.axis_of_row;
  matrix.column_start.push_back(0);
  auto next = entries.begin();
  for (std::size_t c = 0; c < matrix.order(); ++c) {
    const auto column = static_cast<std::int64_t>(c);
    const std::size_t first = matrix.row.size();
    for (; next != entries.end() && next->column == column; ++next)
      if (matrix.row.size() > first && matrix.row.back() == next->row) {
        matrix.value.back() += next->value;
      } else {
        matrix.row.push_back(next->row);
        matrix.value.push_back(next->value);
      }
    matrix.column_start.push_back(static_cast<std::int64_t>(matrix.row.size()));
  }
  return fem::sum(of_elements, matrix);
}

} // namespace

MotionSprings::MotionSprings(std::span<const SolidSpring> springs)
    : springs_(springs.begin(), springs.end()) {
  const std::size_t whole =
      (springs.size() + SpringColumns::batch - 1) / SpringColumns::batch * SpringColumns::batch;
  for (const SolidSpring& s : springs) {
    i_.push_back(s.i);
    j_.push_back(s.j);
    stiffness_.push_back(s.stiffness);
    damping_.push_back(s.damping);
    rest_.push_back(s.rest);
  }
  i_.resize(whole);
  j_.resize(whole);
  for (Numbers* const column : {&stiffness_, &damping_, &rest_, &lengths_, &kept_.write()})
    column->resize(whole);
}

double MotionSprings::evaluate(const Numbers& at, double per_time, std::span<double> forces,
                               const Context& context) {
  SpringEnergies energies;
  motion_kernel(context.cpu)
      .pull({i_.data(), j_.data(), stiffness_.data(), damping_.data(), rest_.data(), kept_->data(),
             lengths_.data(), springs_.size()},
            at.data(), per_time, forces.data(), energies);
  elastic_ = energies.elastic;
  return energies.elastic + energies.damped;
}

void MotionSprings::extend(const CopyOnWrite<Numbers>& start, double factor) {
  Numbers& lengths = kept_.write();
  for (std::size_t k = 0; k < lengths.size(); ++k)
    lengths[k] = (*start)[k] + factor * (lengths[k] - (*start)[k]);
}

linalg::StiffnessMatrix MotionSprings::with_bound(const linalg::StiffnessMatrix& of_elements,
                                                  double per_time) const {
  return with_blocks(of_elements, springs_, [&](std::size_t k) {
    const double all = springs_[k].stiffness + springs_[k].damping * per_time;
    return std::array<double, 9>{all, 0, 0, 0, all, 0, 0, 0, all};
  });
}

linalg::StiffnessMatrix MotionSprings::with_tangent(const linalg::StiffnessMatrix& of_elements,
                                                    const Numbers& at, double per_time) const {
  return with_blocks(of_elements, springs_, [&](std::size_t k) {
    const SolidSpring& s = springs_[k];
    const Vec3 d = vector_at(at, s.j) - vector_at(at, s.i);
    const double length = norm(d), along = s.stiffness + s.damping * per_time;
    const Vec3 n = length > 0 ? d / length : Vec3{};
    const double pull = s.stiffness * (length - s.rest) +
                        s.damping * per_time * (length - (*kept_)[k]),
                 across = length > 0 ? std::max(0.0, pull / length) : along;
    std::array<double, 9> block{};
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b)
        block[static_cast<std::size_t>(3 * a + b)] =
            (a == b ? across : 0) + (along - across) * n[a] * n[b];
    return block;
  });
}

} // namespace gewebe::integrator
