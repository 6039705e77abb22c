#pragma once
// Affine maps of positions.

#include "geometry/vec3.h"

#include <array>
#include <string_view>

namespace gewebe {

/// Rows of a 3 x 4 matrix: x goes to A x + b.
struct Affine {
  std::array<double, 12> m{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

  bool operator==(const Affine&) const = default;
  Vec3 operator()(const Vec3& p) const;
  double determinant() const;
  /// Whether it keeps lengths and angles, to a relative 1e-9; it may mirror.
  bool is_rigid() const;
};

/// `then` after `first`.
Affine operator*(const Affine& then, const Affine& first);

/// Steps in order, separated by `;`: "translate X Y Z", "rotate x|y|z DEGREES" (about the axis
/// through the origin), "scale S", "scale X Y Z", "mirror x|y|z" (that coordinate changes sign).
/// Multiples of 90 degrees are exact. \throw Error for other words, numbers that are not finite, a
/// scale that is 0
Affine parse_affine(std::string_view text);

/// A text of 16 numbers, a 4 x 4 matrix row by row whose last row is 0 0 0 1; `#` begins a comment.
/// \throw Error if it is none, or singular
Affine parse_affine_matrix(std::string_view text);

} // namespace gewebe
