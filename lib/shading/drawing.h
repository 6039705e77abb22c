#pragma once
// What both backends draw: vertices with texture coordinates and emboss offsets. Report 3.2.3.

#include "base/context.h"
#include "geometry/mesh.h"
#include "geometry/vec3.h"
#include "shading/camera.h"
#include "shading/tangents.h"
#include "texture/rest.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace gewebe::shading {

/// In single precision, as OpenGL takes them, so that all ways of drawing have the same geometry.
struct DrawVertex {
  std::array<float, 3> position{}; ///< (p - origin) / scale, within -1 … 1
  std::array<float, 2> st{};       ///< of the base texture, and of the structure
  std::array<float, 2> shifted{};  ///< (s + ds, t + dt), towards the light
  std::array<float, 2> sphere{};   ///< in sphere maps
  float shade = 1;                 ///< factor of the base colour, 0 … 1
};

/// Where shifts and sphere maps are found for each pixel instead.
struct DrawFrame {
  std::array<float, 3> normal{};
  std::array<float, 3> tangent{}; ///< direction of growing s, perpendicular to the normal, or 0
  float side = 1;                 ///< bitangent = side · normal × tangent
};

struct Drawing {
  Box3 box; ///< of the points, mm
  Vec3 origin;
  double scale = 1; ///< > 0
  std::vector<DrawVertex> vertices;
  std::vector<DrawFrame> frames;        ///< one per vertex if requested, else none
  std::vector<texture::DrawRest> rests; ///< one per vertex if requested, else none
  std::vector<texture::DrawTurn> turns; ///< likewise, where a point is not at rest
  Vec3 rest_origin;
  double rest_scale = 1; ///< > 0
  std::vector<Triangle> triangles;
  /// Where the triangles of groups 1, 2, … begin, which have materials of their own; group 0 comes
  /// first.
  std::vector<std::size_t> group_start;
  std::uint64_t version = 0; ///< of a maker: another one where vertices, frames or triangles are
  // What frames are used with, in coordinates of positions.
  Vec3 light; ///< place, or unit vector to it
  bool directional = false;
  double full_distance = 0;       ///< of the light, 0: it doesn't fall off
  std::array<double, 2> offset{}; ///< of the structure
  Camera camera;                  ///< eye and axes
};

inline std::size_t group_count(const Drawing& drawing) {
  return drawing.group_start.size() + 1;
}
std::span<const Triangle> triangles_of_group(const Drawing& drawing, std::size_t group);

/// A mesh to draw.
struct Surface {
  TriangleMesh mesh;
  std::vector<Vec3> rest;             ///< where its points were at rest; empty: where they are
  std::vector<std::string> materials; ///< names of its materials, where they are known
  bool instrument = false; ///< no tissue: of the group behind all others, without textures
  bool inside = false;     ///< the other side of a surface: of the group behind those of tissue
};

/// What defines the groups of triangles: the mesh's materials or parts (all of a mesh without
/// them are 0), or the number of the surface.
enum class GroupBy : std::uint8_t { material, part, surface };

/// "material", "part", "object".
const std::vector<std::string>& group_by_names();
/// \throw Error if there is no such word
GroupBy group_by_from_name(std::string_view name);

struct DrawingOptions {
  bool texcoords = false;    ///< a base or a structure texture is there
  bool structure = false;    ///< a structure texture is there: offsets are computed
  bool sphere = false;       ///< a texture is sphere-mapped
  bool wet = false;          ///< a film is there: normals for each pixel
  bool rest = false;         ///< places at rest: solid textures or three projections
  bool rest_normals = false; ///< normals at rest: three projections or a solid structure
  bool rest_light = false;   ///< turns: a structure at rest
  bool per_pixel = false;    ///< frames instead of offsets and places in sphere maps
  Vec3 light;                ///< lP, mm, in the space of the mesh; or a vector to it
  bool directional = false;
  std::array<double, 2> offset{0.02, 0.02}; ///< length of the offset along s and t
  double shade = 0;                         ///< share of Lambert's law in the base colour, 0 … 1
  double fill = 0;          ///< strength of a second, far light, from the camera's right, 0 … 1
  double full_distance = 0; ///< of the light, mm, as light_left() has it; 0: it doesn't fall off
  double occlusion = 0;     ///< share of the light that comes from all around, 0 … 1
  double occlusion_radius = 0; ///< mm, of openness()
  Camera camera;               ///< that sees the sphere maps and has the second light
  GroupBy group_by = GroupBy::material;
  std::vector<std::int32_t> groups; ///< numbers of the materials, … that are groups 1, 2, …
  bool insides = false;     ///< insides have a group, after `groups`; else no surface is one
  bool instruments = false; ///< instruments have a group, the last one; else no surface is one
};

/// All surfaces in one, in order within each group. Per vertex (report eq. 3.2)
///   (ds, dt) = offset · (L·T, L·B),  L = (lP - vP) / |lP - vP|
/// with the frame of tangents.h. shade = 1 - k + k (max(0, L·N) + f max(0, F·N)) / max(1, |L + f
/// F|), F of fill_direction(), for shares k and f; times 1 - o (1 - openness) for the share o of
/// occlusion.h. L is 0 for a vertex at the light. Sphere maps are read as OpenGL's GL_SPHERE_MAP
/// does: (x, y) / m + 1/2 for the view's mirror image (x, y, z) at the normal, in axes right, up,
/// back, and m = 2 |(x, y, z + 1)|. Only what is requested is computed. \pre check_mesh passes for
/// every mesh; with `texcoords` all meshes have them \throw Error if a coordinate overflows or
/// there are more than 2³² vertices; Cancelled
Drawing make_drawing(std::span<const Surface> surfaces, const DrawingOptions& options,
                     const Context& context);

/// What is different from the drawing before.
enum class DrawingChange : std::uint8_t {
  all,
  points, ///< points and normals of the same triangles with the same coordinates
  view    ///< light and camera alone
};

/// What a maker did.
struct DrawingCounts {
  std::uint64_t drawings = 0, vertices = 0; ///< made, and those whose vertices were
  std::uint64_t splits = 0, frames = 0;     ///< surfaces whose vertices were split, frames made
};

/// What of a surface a maker keeps.
struct DrawingParts {
  TexturedVertices vertices;
  std::vector<Vec3> normals;
  std::vector<Vec3> rest_normals; ///< if places at rest are requested
  std::vector<float> openness;    ///< of its points, if occlusion is requested
  bool moved = false;             ///< whether its points are not at rest
};

/// Makes the drawings of a sequence: vertices are split once and keep their normals at rest, frames
/// and turns are renewed where the points move, and a change of view leaves all that doesn't depend
/// on it.
class DrawingMaker {
public:
  /// As make_drawing, with the same values. \pre the first call is with DrawingChange::all, later
  /// ones say what may have changed; options but light, offset and camera are those of the first
  const Drawing& make(std::span<const Surface> surfaces, const DrawingOptions& options,
                      DrawingChange change, const Context& context);
  const DrawingCounts& counts() const { return counts_; }
  Drawing drawing() && { return std::move(drawing_); }

private:
  Drawing drawing_;
  std::vector<DrawingParts> parts_; ///< by surface
  DrawingCounts counts_;
};

/// Where the second light comes from: from beside the camera, on the right hand, a little below. A
/// unit vector.
Vec3 fill_direction(const Camera& camera);

/// Bytes that make_drawing and a backend need at most, without pictures and textures.
double drawing_bytes(std::span<const Surface> surfaces);

std::uint64_t triangle_count(std::span<const Surface> surfaces);

/// The box of the rest shapes of all surfaces but instruments.
Box3 rest_box(std::span<const Surface> surfaces);

} // namespace gewebe::shading
