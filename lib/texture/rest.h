#pragma once
// How textures lie on the shape at rest without coordinates: three projections blended, or solid
// textures. They stay on tissue that moves, since each vertex keeps its place at rest.
//
// Based on: Geiss, Generating Complex Procedural Terrains Using the GPU, GPU Gems 3, 2007 (three
// projections); report FZKA 7190, 2006, eq. 3.2.

#include "geometry/mesh.h"
#include "geometry/vec3.h"

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace gewebe::texture {

/// The three projections of a texture have the coordinates of uv.h's box mapping, upright and
/// unmirrored seen from outside: with q = (p - start) / edge at rest and n the normal there,
///   along x: (sgn(n_x) q_y, q_z), along y: (-sgn(n_y) q_x, q_z), along z: (sgn(n_z) q_x, q_y).
/// They are blended by w_a = max(0, (|n_a| / max_b |n_b|)^sharpness - 1/256), divided by their sum.
/// w_a is 0 long before n_a is, so nothing jumps where a projection is turned over. Each has a
/// frame of its own, T = unit(z × n) (along z: unit(y × n)), B = n × T, and with it the offset of
/// the structure; its relief is blended as colours are. n = 0 counts as along z.
struct RestMapping {
  bool triplanar = false; ///< images that are not sphere-mapped lie so
  Vec3 start;             ///< where s and t start, mm
  /// A coordinate of 1, mm; also what an offset of 1 is for the structure of a solid texture, whose
  /// r = 0.5 + 0.5 (f(p) - f(p + edge · offset · (L - n (n · L)))), L the unit vector to the light.
  double edge = 10;
  int sharpness = 4; ///< 1 … 64
};

/// The mapping whose edge is `edge`, else half the longest side of the box at rest, and which
/// starts at a whole number of edges from the world's origin, as that of a box.
RestMapping rest_mapping(const Box3& rest_box, std::optional<double> edge);

struct DrawRest {
  std::array<float, 3> place{};  ///< at rest, (p - rest_origin) / rest_scale
  std::array<float, 3> normal{}; ///< at rest
};

/// The rotation of the surface from rest to now: where it takes the axes x and y. Light is
/// rotated back by it, so that all else happens at rest.
struct DrawTurn {
  std::array<float, 3> x{1, 0, 0}, y{0, 1, 0};
};

/// Per point the least rotation from the normal at rest to the one now, followed by that about the
/// normal which takes the edges around the point closest to where they are (least squares). None
/// where a normal is 0. \pre equal sizes; the triangles' corners index them
std::vector<DrawTurn> rest_turns(std::span<const Vec3> rest, std::span<const Vec3> rest_normals,
                                 std::span<const Vec3> now, std::span<const Vec3> normals,
                                 std::span<const Triangle> triangles);

} // namespace gewebe::texture
