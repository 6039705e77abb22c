#include "solid/motion_springs_internal.h"

#include "base/vector_at.h"
#include "solid/assembly.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>

namespace gewebe {

namespace {

/// Between the ends of spring k, [3 i + j].
using BlockOfSpring = std::function<std::array<double, 9>(std::size_t k)>;

struct Entry {
  std::int64_t column, row;
  double value;
};

/// The matrix of springs on the free axes of another one, added to that.
StiffnessMatrix with_blocks(const StiffnessMatrix& of_elements,
                            std::span<const SolidSpring> springs, const BlockOfSpring& block_of) {
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
  StiffnessMatrix matrix;
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
  return sum(of_elements, matrix);
}

} // namespace

MotionSprings::MotionSprings(std::span<const SolidSpring> springs)
    : springs_(springs.begin(), springs.end()), lengths_(springs.size()), kept_(springs.size()) {}

double MotionSprings::evaluate(const Numbers& at, double per_time, std::span<double> forces) {
  // In turn for some springs: from here, by the compiler several at a time, and to there.
  constexpr std::size_t some = 64;
  std::array<double, some> x{}, y{}, z{}, pull{};
  double damped = 0;
  elastic_ = 0;
  for (std::size_t first = 0; first < springs_.size(); first += some) {
    const std::size_t count = std::min(some, springs_.size() - first);
    const SolidSpring* const s = springs_.data() + first;
    for (std::size_t k = 0; k < count; ++k) {
      const double *const from = at.data() + 3 * std::size_t{s[k].i}, *const to =
                                                                          at.data() +
                                                                          3 * std::size_t{s[k].j};
      x[k] = to[0] - from[0];
      y[k] = to[1] - from[1];
      z[k] = to[2] - from[2];
    }
    for (std::size_t k = 0; k < some; ++k)
      pull[k] = std::sqrt(x[k] * x[k] + y[k] * y[k] + z[k] * z[k]);
    for (std::size_t k = 0; k < count; ++k) {
      const double length = lengths_[first + k] = pull[k], off = length - s[k].rest,
                   grown = length - kept_[first + k], viscous = s[k].damping * per_time;
      elastic_ += s[k].stiffness * off * off / 2;
      damped += viscous * grown * grown / 2;
      pull[k] = length > 0 ? (s[k].stiffness * off + viscous * grown) / length : 0; // no direction
    }
    for (std::size_t k = 0; k < count; ++k) {
      double *const from = forces.data() + 3 * std::size_t{s[k].i}, *const to =
                                                                        forces.data() +
                                                                        3 * std::size_t{s[k].j};
      const std::array<double, 3> force = {pull[k] * x[k], pull[k] * y[k], pull[k] * z[k]};
      for (std::size_t a = 0; a < 3; ++a) {
        from[a] += force[a];
        to[a] -= force[a];
      }
    }
  }
  return elastic_ + damped;
}

StiffnessMatrix MotionSprings::with_bound(const StiffnessMatrix& of_elements,
                                          double per_time) const {
  return with_blocks(of_elements, springs_, [&](std::size_t k) {
    const double all = springs_[k].stiffness + springs_[k].damping * per_time;
    return std::array<double, 9>{all, 0, 0, 0, all, 0, 0, 0, all};
  });
}

StiffnessMatrix MotionSprings::with_tangent(const StiffnessMatrix& of_elements, const Numbers& at,
                                            double per_time) const {
  return with_blocks(of_elements, springs_, [&](std::size_t k) {
    const SolidSpring& s = springs_[k];
    const Vec3 d = vector_at(at, s.j) - vector_at(at, s.i);
    const double length = norm(d), along = s.stiffness + s.damping * per_time;
    const Vec3 n = length > 0 ? d / length : Vec3{};
    const double pull =
                     s.stiffness * (length - s.rest) + s.damping * per_time * (length - kept_[k]),
                 across = length > 0 ? std::max(0.0, pull / length) : along;
    std::array<double, 9> block{};
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b)
        block[static_cast<std::size_t>(3 * a + b)] =
            (a == b ? across : 0) + (along - across) * n[a] * n[b];
    return block;
  });
}

} // namespace gewebe
